"""The way back from a retract: rapids whose ends the text does not say in full, until all of the tip is known again."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.nc_reader.execution import Modal

#: how far, mm and rad, a way along the tool may be off it: printed digits
_ASIDE, _TURN = 1e-3, 1e-3

#: shorter ways along the tool are none, mm: a pose and the line of its hole are as far apart in the digits of CL files
_LEAST = 0.01


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
        #: says whether nobody asked for a rapid along the tool: start, end, last printed digit, the end near the part
        self.added: Callable[[Floats, Floats, float, Floats], bool] = lambda start, end, step, near: False
        self._arrival = 0
        self._came = 0  # line of the last end of a way back
        #: where the last rapid has gone, NaN where that is not known, and its line
        self._above: tuple[Floats, int] | None = None

    def leave(self, modal: Modal, axes: str) -> Modal:
        """Say that axes go to positions of the machine: where they are in the part is not known any more."""
        self.open = True
        tip = tuple(math.nan if axis in axes else value for axis, value in zip("XYZ", modal.tip, strict=True))
        return modal.but(tip=tip)

    def look_along(self, elements: Elements) -> None:
        """Let a rapid that nobody asked for, straight above the first position behind a retract, end there."""
        line, self._arrival = self._arrival, 0
        if not line or len(elements) < 2 or int(elements.line[0]) != line:
            return
        ends = elements.part(0, 2)
        along = (ends.kind == Element.RAPID).all() and is_above(ends, 0, 1)
        if along and self.added(ends.tip[0], ends.tip[1], ends.tip_step, ends.tip[1]):
            elements.tip[0], elements.second[0] = ends.tip[1], ends.second[1]

    def has_come(self, ready: list[Elements]) -> bool:
        """Whether the element before the last is on the other side of a retract."""
        return bool(ready) and int(ready[-1].line[-1]) == self._came

    def look_back(self, given: list[Elements], ready: list[Elements]) -> bool:
        """Let a last rapid that nobody asked for, straight back along the tool before a retract, not move the tool.

        Parameters
        ----------
        given : list of Elements
            What has been given out last.
        ready : list of Elements
            What is to be given out, and may be changed.

        Returns
        -------
        bool
            Whether there is one.
        """
        parts = [*given, *ready[-2:]]
        if not ready or sum(map(len, parts)) < 2 or ready[-1].kind[-1] != Element.RAPID:
            return False
        if self.has_come(ready):
            return False
        whole = Elements.joined(parts)
        ends = whole.part(len(whole) - 2, len(whole))
        near = ends.tip[0]
        if not (is_above(ends, 1, 0) and self.added(near, ends.tip[1], ends.tip_step, near)):
            return False
        ready[-1].tip[-1], ready[-1].second[-1] = ends.tip[0], ends.second[0]
        return True

    def arrive(self, run: Elements, aside: Ints, problems: list[Problem]) -> Elements:
        """Leave out the rapids of the way back.

        Parameters
        ----------
        aside : (k,) int64
            Lines with words of X or Y: others only turn the rotary axes.
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
            hint = "say X Y Z in rapid after a position of the machine, before the first feed"
            raise InputError(
                "CS503", "a feed move where not all of the position is known", hint, file=self._name, line=line
            )
        self.open = bool(unknown.all())
        if (places := np.flatnonzero(gone & np.isin(run.line, aside))).size:
            row = int(places[-1])
            self._above = np.concatenate((run.tip[row], run.second[row])), int(run.line[row])
        if not self.open:
            self._arrival = self._came = int(run.line[int(np.argmin(unknown))])
        if not self.open and self._above is not None:
            above, line = self._above
            self._above = None
            _check_approach(above, run, int(np.argmin(unknown)), line, problems)
        if not gone.any():
            return run
        return run.only(~gone)


def is_above(ends: Elements, above: int, below: int) -> bool:
    """Whether a tip is straight back along the tool from another, with the same axis."""
    axis = ends.second if ends.second_is == "vector" else ends.second - ends.tip
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    way = ends.tip[above] - ends.tip[below]
    height = float(way @ axis[below])
    aside = float(np.linalg.norm(way - height * axis[below]))
    turned = float(np.linalg.norm(axis[above] - axis[below]))
    return height > _LEAST and aside <= _ASIDE + _TURN * height and turned <= _TURN


def _check_approach(above: Floats, run: Elements, arrival: int, line: int, problems: list[Problem]) -> None:
    """Complain where the tool does not come straight down: the last rapid of the way back must be over its end."""
    below = np.concatenate((run.tip[arrival], run.second[arrival]))
    unknown = np.isnan(above)
    aside = np.abs(above - below)[~unknown].max(initial=0.0) > 0.0
    if aside or unknown[:3].sum() == 2:
        text = "the last rapid of the way back from a retract is not over the position that it leads to"
        problems.append(Problem("CS531", 0, line, text))
