"""The way back from a retract: rapids whose ends the text does not say in full, until all of the tip is known again."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Floats
from cornersmooth.nc_reader.elements import Element, Problem
from cornersmooth.nc_reader.execution import Executed, Modal


class WayBack:
    """Leaves the rapids of the way back out of the path, and looks whether the tool comes straight down.

    Parameters
    ----------
    name : str or None
        Of the text, for messages.
    """

    def __init__(self, name: str | None) -> None:
        self._name = name
        #: whether an axis stands at a position of the machine
        self.open = False
        #: where the last rapid has gone, NaN where that is not known, and its line
        self._above: tuple[Floats, int] | None = None

    def leave(self, modal: Modal, axes: str) -> Modal:
        """Say that axes go to positions of the machine: where they are in the part is not known any more."""
        self.open = True
        tip = tuple(math.nan if axis in axes else value for axis, value in zip("XYZ", modal.tip, strict=True))
        return modal.but(tip=tip)

    def arrive(self, run: Executed, problems: list[Problem]) -> Executed:
        """Leave out the rapids of the way back.

        Parameters
        ----------
        run : Executed
        problems : list of Problem
            Takes a way back that does not end straight above where it leads to.

        Raises
        ------
        InputError
            CS503 for a feed move before all of the tip is known.
        """
        unknown = np.isnan(run.tip).any(axis=1)
        gone = unknown & (run.kind == Element.RAPID)
        if (unknown & ~gone).any():
            line = int(run.line[np.argmax(unknown & ~gone)])
            hint = "say X Y Z in rapid behind a position of the machine, before the first feed"
            raise InputError(
                "CS503", "a feed move where not all of the position is known", hint, file=self._name, line=line
            )
        self.open = bool(unknown.all())
        if gone.any():
            row = int(np.flatnonzero(gone)[-1])
            self._above = np.concatenate((run.tip[row], run.second[row])), int(run.line[row])
        if not self.open and self._above is not None:
            above, line = self._above
            self._above = None
            _check_approach(above, run, int(np.argmin(unknown)), line, problems)
        if not gone.any():
            return run
        kept = ~gone
        rows = {
            key: getattr(run, key)[kept]
            for key in ("kind", "tip", "second", "line", "feed", "per_revolution", "feed_room")
        }
        return replace(run, **rows, arc_element=(np.cumsum(kept) - 1)[run.arc_element])


def _check_approach(above: Floats, run: Executed, arrival: int, line: int, problems: list[Problem]) -> None:
    """Complain where the tool does not come straight down: the last rapid of the way back must be over its end."""
    below = np.concatenate((run.tip[arrival], run.second[arrival]))
    unknown = np.isnan(above)
    aside = np.abs(above - below)[~unknown].max(initial=0.0) > 0.0
    if aside or unknown[:3].sum() == 2:
        text = "the last rapid of the way back from a retract is not over the position that it leads to"
        problems.append(Problem("CS531", 0, line, text))
