"""Retracts: what of the motion around them is none of the CL file's.

- On the way back from a retract rapids do not say in full where they end, until all of the tip is known again. They are
  left out, and the tool must come straight down.
- A rapid along the tool that nobody asked for, before a retract or after one, does not move the tool.
- Where a rotary axis has to turn back, posts leave a cut along the tool, and go on with it where they left it. Between
  the two the tool is nowhere near the part: both elements along the tool are put to where the cut was left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements, Problem

#: how far, mm and rad, a way along the tool may be off it: printed digits
_ASIDE, _TURN = 1e-3, 1e-3

#: shorter ways along the tool are none, mm: a pose and the line of its hole are as far apart in the digits of CL files
_LEAST: Final = 0.01

#: a cut is left by at least so much, mm: less is not clear of it
LEAST_LIFT: Final = 1.0

#: printed digits by which the place where a cut goes on may be off that where it was left
_STEPS: Final = 2.0

#: differences of sums, mm
_ARITHMETIC: Final = 1e-9


@dataclass(frozen=True)
class _Left:
    """Where a cut was left."""

    part: Elements  # its last element is the rapid along the tool
    element: int  # number of that
    tip: Floats
    second: Floats
    line: int

    def is_there(self, part: Elements, row: int) -> bool:
        """Whether an element ends there."""
        off, turned = np.abs(part.tip[row] - self.tip).max(), np.abs(part.second[row] - self.second).max()
        return bool(off <= _STEPS * part.tip_step and turned <= _STEPS * part.second_step)


class Retracts:
    """Follows the retracts of a program, and changes the elements around them.

    Parameters
    ----------
    name : str or None
        Of the program, for messages.
    problems : list of Problem
        Takes ways back that are not straight above where they lead to, and cuts that are gone on with in rapid.
    """

    def __init__(self, name: str | None, problems: list[Problem]) -> None:
        self._name, self._problems = name, problems
        #: whether an axis is at a position of the machine
        self.open = False
        #: says whether nobody asked for a rapid along the tool: start, end, last printed digit, the end near the part
        self.added: Callable[[Floats, Floats, float, Floats], bool] = lambda start, end, step, near: False
        #: says whether the CL file goes somewhere in rapid: tip and last printed digit; None where nobody knows
        self.asked: Callable[[Floats, float], bool] | None = None
        #: elements along the tool where cuts are left, and where the tool comes back, and NC lines of both
        self.left_cuts: list[tuple[int, int, int, int]] = []
        self._arrival = self._came = 0  # line of the end of a way back that is not looked at yet; of the last one
        self._above: tuple[Floats, int] | None = None  # where the last rapid has gone, NaN where not known; its line
        self._left: _Left | None = None
        self._rapids: list[tuple[Elements, int, int]] = []

    @property
    def cut_is_left(self) -> bool:
        """Whether what has been read last may still have to be changed."""
        return self._left is not None

    def forget(self) -> None:
        """Take note of another tool: it has left no cut."""
        self._left = None

    def leave(self, given: list[Elements], ready: list[Elements], elements: int) -> bool:
        """Take note of a retract; return whether a last rapid along the tool was none that moves it.

        Of the elements so far `given` is the last one that was given out, and `ready` may be changed.
        """
        self.open = True
        if ready and int(ready[-1].line[-1]) == self._came:  # what is before is on the other side of a retract
            return False
        parts = [*given, *ready[-2:]]
        left = self._left
        again = left is not None and bool(parts) and left.part is parts[-1] and left.element == elements - 1
        if not again:
            self._left, self._rapids = None, []
        if not ready or sum(map(len, parts)) < 2 or ready[-1].kind[-1] != Element.RAPID:
            return False
        whole = Elements.joined(parts)
        ends = whole.part(len(whole) - 2, len(whole))
        near, far = ends.tip
        if not is_above(ends, 1, 0):
            return False
        cut = ends.kind[0] != Element.RAPID and ends.second_is == "vector"
        if cut and not again and float(np.linalg.norm(far - near)) >= LEAST_LIFT:
            self._left = _Left(ready[-1], elements - 1, near.copy(), ends.second[0].copy(), int(ends.line[1]))
        if not self.added(near, far, ends.tip_step, near):
            return False
        ready[-1].tip[-1], ready[-1].second[-1] = near, ends.second[0]
        return True

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
            self._arrival = self._came = int(run.line[arrival])
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

    def take(self, part: Elements, first: int) -> None:
        """Look at what follows, which may be changed; `first` is the number of its first element."""
        line, self._arrival = self._arrival, 0
        if line and len(part) > 1 and int(part.line[0]) == line:
            ends = part.part(0, 2)
            along = (ends.kind == Element.RAPID).all() and is_above(ends, 0, 1)
            if along and self.added(ends.tip[0], ends.tip[1], ends.tip_step, ends.tip[1]):
                part.tip[0], part.second[0] = ends.tip[1], ends.second[1]
        if self._left is not None:
            self._come_back(self._left, part, first)

    def _come_back(self, left: _Left, part: Elements, first: int) -> None:
        """Look whether the tool comes back to where it has left a cut."""
        feeds = np.flatnonzero(part.kind != Element.RAPID)
        stop = int(feeds[0]) if len(feeds) else len(part)
        self._rapids += [(part, row, first + row) for row in range(min(stop, 2))]
        if stop == len(part) and len(self._rapids) < 2:
            return
        rapids, self._left, self._rapids = self._rapids, None, []
        if any(left.is_there(one, row) for one, row, _ in rapids[:2]):
            if self.asked is not None and not self.asked(left.tip, part.tip_step):
                text = "the tool comes back in rapid to where it has left a cut"
                self._problems.append(Problem("CS582", 0, int(rapids[0][0].line[rapids[0][1]]), text))
            return
        if len(rapids) != 1 or stop == len(part) or not left.is_there(part, stop):
            return
        above, row, element = rapids[0]
        both = Elements.joined([above.part(row, row + 1), part.part(stop, stop + 1)])
        height = float(np.linalg.norm(both.tip[0] - both.tip[1]))
        if height < LEAST_LIFT or not is_above(both, 0, 1) or part.kind[stop] != Element.LINE:
            return
        if self.asked is not None:
            if self.asked(left.part.tip[-1], part.tip_step) or self.asked(both.tip[0], part.tip_step):
                return
            for own, at in ((left.part, len(left.part) - 1), (above, row)):
                own.tip[at], own.second[at] = left.tip, left.second
            for values, place in ((part.tip, left.tip), (part.second, left.second)):
                if np.abs(values[stop] - place).max() < _ARITHMETIC:
                    values[stop] = place
        self.left_cuts.append((left.element, element, left.line, int(part.line[stop])))


def is_above(ends: Elements, above: int, below: int) -> bool:
    """Whether a tip is straight back along the tool from another, with the same axis."""
    axis = ends.second if ends.second_is == "vector" else ends.second - ends.tip
    axis = axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), np.finfo(np.float64).tiny)
    way = ends.tip[above] - ends.tip[below]
    height = float(way @ axis[below])
    aside = float(np.linalg.norm(way - height * axis[below]))
    turned = float(np.linalg.norm(axis[above] - axis[below]))
    return height > _LEAST and aside <= _ASIDE + _TURN * height and turned <= _TURN
