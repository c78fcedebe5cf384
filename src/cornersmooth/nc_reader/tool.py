"""Where the tool is on the elements of a text, where it points there, and whether a rapid moves it."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.arcs import arc_points
from cornersmooth.nc_reader.curves import groups
from cornersmooth.nc_reader.elements import Element, Elements


def unit(vectors: Floats) -> Floats:
    """Vectors (k, 3) at length one; zero stays zero."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))[:, None]
    return np.divide(vectors, length, out=np.zeros_like(vectors), where=length > 0)


def directions(nc: Elements, tip: Floats, second: Floats) -> Floats:
    """Unit tool vectors (k, 3) of written poses."""
    return unit(second - tip if nc.second_is == "point" else second)


def between(values: Floats, start: Ints, end: Ints, fraction: Floats) -> Floats:
    """Rows (k, 3) of a table on the way from some of its rows to others."""
    first = values.take(start, axis=0)
    way = values.take(end, axis=0)
    way -= first
    way *= fraction[:, None]
    way += first
    return way


def written_at(nc: Elements, element: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Tip and unit axis (k, 3) on path elements, at a fraction of each (curves: of the range of their parameter)."""
    before, kind = np.maximum(element - 1, 0), nc.kind[element]
    on = np.flatnonzero(kind == Element.CURVE)
    if len(on) == len(element):
        tip, second = np.empty((len(on), 3)), np.empty((len(on), 3))
    else:
        tip, second = between(nc.tip, before, element, fraction), between(nc.second, before, element, fraction)
    arc = np.flatnonzero(kind == Element.ARC)
    if len(arc):
        arcs, start, end = nc.arcs, nc.tip[before[arc]], nc.tip[element[arc]]
        r = np.searchsorted(arcs.element, element[arc])
        tip[arc] = arc_points(start, end, arcs.centre[r], arcs.normal[r], arcs.sweep[r], fraction[arc])
    row = np.searchsorted(nc.curves.element, element[on])
    for group in groups(nc.curves, np.unique(row)) if len(on) else ():  # curves with the same knots
        chosen = np.isin(row, group.index)
        mine, local = on[chosen], np.searchsorted(group.index, row[chosen])
        point = group.at_own(local, group.spans[0] + fraction[mine] * (group.spans[-1] - group.spans[0]))
        tip[mine], second[mine] = point[:, :3], point[:, 3:]
    return tip, directions(nc, tip, second)


def moving_rapids(nc: Elements, first: int, stop: int) -> Ints:
    """Elements from `first` (at least 1) to `stop` (excluded) that are rapid and move the tool."""
    index = np.flatnonzero(nc.kind[first:stop] == Element.RAPID) + first
    ways = (values[index] - values[index - 1] for values in (nc.tip, nc.second))
    return index[leads_somewhere(nc, *ways)]


def leads_somewhere(nc: Elements, way: Floats, turn: Floats) -> Bools:
    """Whether motions (k, 3) of the tip and of the second point or vector are any.

    Two pairs of rotary angles that hold the tool alike do so up to the digits that are printed.
    """
    turned: Bools = np.abs(turn).max(axis=1) > (nc.second_step if nc.rotary else 0.0)
    moved: Bools = beyond_digits(nc, way) if nc.rotary else np.abs(way).max(axis=1) > 0.0
    return moved | turned


def beyond_digits(nc: Elements, way: Floats) -> Bools:
    """Whether ways (k, 3) of the tip are longer than printed digits show, which may be those of turned axes."""
    large = np.linalg.norm(way, axis=1) / np.sqrt(3) if nc.rotary else np.abs(way).max(axis=1)
    return large > 1.01 * nc.tip_step
