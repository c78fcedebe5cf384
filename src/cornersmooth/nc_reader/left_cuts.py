"""Cuts that a text leaves along the tool, for a retract, and goes on with where it has left them.

Posts do so where a rotary axis has to turn back. Between leaving and coming back the tool is nowhere near the part, so
that the motion is the same as without: both elements along the tool are put to where the cut was left.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.nc_reader.way_back import is_above

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


class LeftCuts:
    """Finds cuts that are left and gone on with.

    Parameters
    ----------
    problems : list of Problem
        Takes those that are gone on with in rapid.
    """

    def __init__(self, problems: list[Problem]) -> None:
        self._problems = problems
        #: says whether the CL file goes somewhere in rapid: tip and last printed digit; None where nobody knows
        self.asked: Callable[[Floats, float], bool] | None = None
        #: elements along the tool where cuts are left, and where the tool comes back, and NC lines of both
        self.found: list[tuple[int, int, int, int]] = []
        self._left: _Left | None = None
        self._rapids: list[tuple[Elements, int, int]] = []

    @property
    def open(self) -> bool:
        """Whether what has been read last may still have to be changed."""
        return self._left is not None

    def leave(self, last: list[Elements], elements: int) -> None:
        """Take note of a retract.

        Parameters
        ----------
        last : list of Elements
            The last elements, those of the last part ready to be changed; all on this side of a retract.
        elements : int
            How many there are in all.
        """
        if self._left is not None and last and self._left.part is last[-1] and self._left.element == elements - 1:
            return
        self._left, self._rapids = None, []
        if sum(map(len, last)) < 2 or last[-1].kind[-1] != Element.RAPID or last[-1].second_is != "vector":
            return
        whole = Elements.joined(last)
        ends = whole.part(len(whole) - 2, len(whole))
        lifted = float(np.linalg.norm(ends.tip[1] - ends.tip[0])) >= LEAST_LIFT
        if ends.kind[0] != Element.RAPID and lifted and is_above(ends, 1, 0):
            self._left = _Left(last[-1], elements - 1, ends.tip[0].copy(), ends.second[0].copy(), int(ends.line[1]))

    def forget(self) -> None:
        """Take note of another tool: it has left no cut."""
        self._left = None

    def come_back(self, part: Elements, first: int) -> None:
        """Look whether the tool comes back to where it has left a cut.

        Parameters
        ----------
        part : Elements
            What follows; it may be changed.
        first : int
            Number of its first element.
        """
        left = self._left
        if left is None:
            return
        feeds = np.flatnonzero(part.kind != Element.RAPID)
        stop = int(feeds[0]) if len(feeds) else len(part)
        self._rapids += [(part, row, first + row) for row in range(min(stop, 2))]
        if stop == len(part) and len(self._rapids) < 2:
            return
        rapids, self._left, self._rapids = self._rapids, None, []
        if any(self._is_there(left, one, row) for one, row, _ in rapids[:2]):
            if self.asked is not None and not self.asked(left.tip, part.tip_step):
                text = "the tool comes back in rapid to where it has left a cut"
                self._problems.append(Problem("CS582", 0, int(rapids[0][0].line[rapids[0][1]]), text))
            return
        if len(rapids) != 1 or stop == len(part) or not self._is_there(left, part, stop):
            return
        above, row, element = rapids[0]
        both = Elements.joined([above.part(row, row + 1), part.part(stop, stop + 1)])
        height = float(np.linalg.norm(both.tip[0] - both.tip[1]))
        if height < LEAST_LIFT or not is_above(both, 0, 1) or part.kind[stop] != Element.LINE:
            return
        far = left.part.tip[-1]
        if self.asked is not None:
            if self.asked(far, part.tip_step) or self.asked(both.tip[0], part.tip_step):
                return
            for own, at in ((left.part, len(left.part) - 1), (above, row)):
                own.tip[at], own.second[at] = left.tip, left.second
            for values, place in ((part.tip, left.tip), (part.second, left.second)):
                if np.abs(values[stop] - place).max() < _ARITHMETIC:
                    values[stop] = place
        self.found.append((left.element, element, left.line, int(part.line[stop])))

    @staticmethod
    def _is_there(left: _Left, part: Elements, row: int) -> bool:
        """Whether an element ends where a cut was left."""
        off, turned = np.abs(part.tip[row] - left.tip).max(), np.abs(part.second[row] - left.second).max()
        return bool(off <= _STEPS * part.tip_step and turned <= _STEPS * part.second_step)
