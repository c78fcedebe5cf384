"""What was executed as path elements: in millimetres, with the steps of its digits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cornersmooth.nc_reader.elements import Curves, Elements, NcArcs, Second
from cornersmooth.nc_reader.execution import Executed
from cornersmooth.nc_reader.reading_options import Steps


def in_mm(run: Executed, factor: float, feed: float, *, points: bool) -> Executed:
    """Return a run with lengths in millimetres; a factor of one leaves the numbers untouched.

    Parameters
    ----------
    run : Executed
        Its curves are changed in place.
    factor : float
        Millimetres for a unit of the text.
    feed : float
        The same for feeds.
    points : bool
        Whether second vectors are points on the tool axis.
    """
    if factor == 1.0:
        return run
    columns = slice(0, 6 if points else 3)
    run.curves.control[:, columns] *= factor
    return replace(
        run,
        tip=run.tip * factor,
        second=run.second * factor if points else run.second,
        feed=run.feed * feed,
        arc_centre=run.arc_centre * factor,
    )


def path_elements(run: Executed, second_is: Second, steps: tuple[float, float], *, rotary: bool) -> Elements:
    """Return the elements of a run in millimetres, all of them with the same steps of tip and second vector."""
    curves = run.curves
    size = curves.points + curves.order
    return Elements(
        kind=run.kind,
        tip=run.tip,
        second=run.second,
        line=run.line,
        feed=run.feed,
        per_revolution=run.per_revolution,
        feed_room=run.feed_room,
        second_room=np.zeros(len(run.kind)),
        tip_room=np.zeros(len(run.kind)),
        curves=Curves(
            run.curve_element,
            curves.order,
            np.cumsum(curves.points) - curves.points,
            curves.points,
            np.cumsum(size) - size,
            curves.control,
            curves.weight,
            curves.knot,
        ),
        arcs=NcArcs(run.arc_element, run.arc_centre, run.arc_normal, run.arc_sweep),
        second_is=second_is,
        tip_step=steps[0],
        second_step=steps[1],
        rotary=rotary,
    )


def no_elements(steps: Steps) -> Elements:
    """No elements at all."""
    none, rows = np.zeros(0), np.zeros((0, 3))
    return Elements(
        kind=np.zeros(0, np.uint8),
        tip=rows,
        second=rows,
        line=np.zeros(0, np.int64),
        feed=none,
        per_revolution=np.zeros(0, np.bool_),
        feed_room=none,
        second_room=none,
        tip_room=none,
        curves=Curves(),
        arcs=NcArcs(),
        second_is="vector",
        tip_step=steps.tip,
        second_step=steps.second,
    )
