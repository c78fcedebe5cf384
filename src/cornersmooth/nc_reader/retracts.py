"""Retracts, and the ways back from them.

On the way back rapids do not say in full where they end, until all of the tip is known again. They are left out, and
the tool must come straight down.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements, Problem


class Retracts:
    """Follows the retracts of a program.

    Parameters
    ----------
    name : str or None
        Of the program, for messages.
    problems : list of Problem
        Takes ways back that are not straight above where they lead to.
    """

    def __init__(self, name: str | None, problems: list[Problem]) -> None:
        self._name, self._problems = name, problems
        #: whether an axis is at a position of the machine
        self.open = False
        #: elements before which the tool is retracted, ascending
        self.places: list[int] = []
        self._above: tuple[Floats, int] | None = None  # where the last rapid has gone, NaN where not known; its line

    def leave(self, elements: int) -> None:
        """Take note of a retract after so many elements."""
        self.open = True
        if self.places[-1:] != [elements]:
            self.places.append(elements)

    def arrive(self, run: Elements, aside: Ints) -> Elements:
        """Leave out the rapids of the way back; lines `aside` have words of X or Y, others only turn the rotary axes.

        Raises
        ------
        InputError
            CS503 for a feed move before all of the tip is known.
        """
        unknown = np.isnan(run.tip).any(axis=1)
        gone = unknown & (run.kind == Element.RAPID)
        if (unknown & ~gone).any():
            line = int(run.line[np.argmax(unknown & ~gone)])
            hint = "say X Y Z in rapid after a position of the machine, before the first feed"
            raise InputError(
                "CS503", "a feed move where not all of the position is known", hint, file=self._name, line=line
            )
        self.open = bool(unknown.all())
        if (places := np.flatnonzero(gone & np.isin(run.line, aside))).size:
            row = int(places[-1])
            self._above = np.concatenate((run.tip[row], run.second[row])), int(run.line[row])
        if not self.open:
            arrival = int(np.argmin(unknown))
            if self._above is not None:
                self._check_approach(*self._above, np.concatenate((run.tip[arrival], run.second[arrival])))
            self._above = None
        return run.only(~gone) if gone.any() else run

    def _check_approach(self, above: Floats, line: int, below: Floats) -> None:
        """Complain where the tool does not come straight down: the last rapid must be over the end of the way back."""
        unknown = np.isnan(above)
        if np.abs(above - below)[~unknown].max(initial=0.0) > 0.0 or unknown[:3].sum() == 2:
            text = "the last rapid of the way back from a retract is not over the position that it leads to"
            self._problems.append(Problem("CS531", 0, line, text))
