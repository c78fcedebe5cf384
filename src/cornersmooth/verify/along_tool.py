"""Rapids along the tool that posts add before retracts and after them.

The CL file does not ask for them: those that it asks for are acts (see `parse`), and are taken as such first. The tool
is put to where such a rapid is nearer to the part, and so stays there.

Where a rotary axis has to turn back, posts leave a cut along the tool, and go on with it where they left it. Between
the two the tool is nowhere near the part: it stays where the cut is left.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from typing import Final

import numpy as np

from cornersmooth.nc_reader.elements import Ahead, Element, Event, Problem
from cornersmooth.nc_reader.tool import directions
from cornersmooth.verify.acts import Acts
from cornersmooth.verify.holes import HoleLines, leads_nowhere

#: how far, mm and rad, a way along the tool may be off it: printed digits
_ASIDE, _TURN = 1e-3, 1e-3

#: shorter ways along the tool are none, mm: a pose and the line of its hole are as far apart in the digits of CL files
_LEAST: Final = 0.01

#: a cut is left by at least so much, mm: less is not clear of it
_LEAST_LIFT: Final = 1.0

#: printed digits by which the place where a cut goes on may be off that where it was left
_STEPS: Final = 2.0


class AlongTool:
    """Finds the rapids along the tool beside retracts.

    Parameters
    ----------
    retracts : sequence of int
        Elements before which the tool is retracted, ascending; it grows as the program is read, as `events` do.
    """

    def __init__(self, ahead: Ahead, retracts: Sequence[int], events: Sequence[Event], acts: Acts) -> None:
        self._ahead, self._retracts, self._events, self._acts = ahead, retracts, events, acts
        self._left, self._lift = -1, 0.0  # the first element after a retract for which a cut has been left; how far, mm

    def next_retract(self, element: int) -> float:
        """The first element from one on that the tool is retracted before, as far as that has been read."""
        number = bisect_left(self._retracts, element)
        return self._retracts[number] if number < len(self._retracts) else math.inf

    def comes_down_first(self, element: int) -> bool:
        """Whether a rapid comes down from a retract, and the next leads away from there, not along the tool."""
        after = element + 1
        if self.next_retract(element) != element or not self._ahead.has(after) or not self._is(Element.RAPID, after):
            return False
        return self.next_retract(after) != after and not (self.height(element, after) or self.height(after, element))

    def stays(self, element: int) -> bool:
        """Whether an element is a rapid along the tool beside a retract; then it is put to where the tool stays."""
        ahead = self._ahead
        more = ahead.has(element + 1)  # a retract after the element is known now
        if not self._is(Element.RAPID, element):
            return False
        if self.next_retract(element) != element:
            place = self._left_at(element) if self.next_retract(element + 1) == element + 1 else element
        else:
            place = self._back_at(element) if more else element
        if place == element:
            return False
        ahead.put(element, place)
        # what leads nowhere is another now
        nc, rows = ahead.nc, np.arange(max(element, 1), element + 1 + more) - ahead.base
        ways = (values[rows] - values[rows - 1] for values in (nc.tip, nc.second))
        idle = leads_nowhere(nc, rows, *ways)
        self._acts.still.difference_update((rows[~idle] + ahead.base).tolist())
        self._acts.still.update((rows[idle] + ahead.base).tolist())
        return True

    def _left_at(self, element: int) -> int:
        """Element that a rapid before a retract is put to; the rapid itself if that is not along the tool."""
        lift = self.height(element, element - 1)
        if lift and not self._is(Element.RAPID, element - 1):
            self._left, self._lift = element + 1, lift
        return element - 1 if lift else element

    def _back_at(self, element: int) -> int:
        """Element that a rapid after a retract is put to; the rapid itself if what follows is not along the tool."""
        after = element + 1
        height = self.height(element, after)
        if not height or self._is(Element.RAPID, after):
            return after if height else element
        goes_on = element == self._left and self._is(Element.LINE, after) and self._is_where_left(after)
        if not goes_on or min(height, self._lift) < _LEAST_LIFT:
            return element
        first, last = self._ahead.nc.line[[element - 1 - self._ahead.base, after - self._ahead.base]].tolist()
        self._acts.rewinds.append((first, last))
        self._left = -1
        return element - 1

    def leave_cut(self, element: int) -> None:
        """Take down that a cut is left where a retract comes before an element, if no rapid leads out of it."""
        if not self._is(Element.RAPID, element - 1):
            self._left, self._lift = element, 0.0

    def check_return(self, element: int, lines: HoleLines) -> None:
        """Complain of an element that goes on with a cut, but if the CL file has a pose where that was left: CS582."""
        rapid = self._is(Element.RAPID, element)
        if element != self._left or not self._comes_back(element) or lines.goes_to(element - 1, rapid=rapid):
            return
        at_feed = "the tool goes on at feed with a cut that it has left, and does not come from above"
        text = "the tool comes back in rapid to where it has left a cut" if rapid else at_feed
        self._acts.problems.append(Problem("CS582", 0, lines.nc_line(element), text))

    def _comes_back(self, element: int) -> bool:
        """Whether the first element behind a retract goes on at feed with a cut, or it or the next one in rapid."""
        first, last = (
            side(self._events, element, key=lambda event: event.element) for side in (bisect_left, bisect_right)
        )
        if any(event.letter == "T" for event in self._events[first:last]):
            return False
        found = not self._is(Element.RAPID, element) or self._is_where_left(element)
        if not found and self._ahead.has(element + 1):
            found = self._is(Element.RAPID, element + 1) and self._is_where_left(element + 1)
        if found:
            self._left = -1  # that is written once
        return found

    def _is_where_left(self, element: int) -> bool:
        """Whether an element ends where a cut has been left."""
        nc, base = self._ahead.nc, self._ahead.base
        for values, step in ((nc.tip, nc.tip_step), (nc.second, nc.second_step)):
            if np.abs(values[element - base] - values[self._left - 1 - base]).max() > _STEPS * step:
                return False
        return True

    def _is(self, kind: Element, element: int) -> bool:
        return bool(self._ahead.nc.kind[element - self._ahead.base] == kind)

    def height(self, above: int, below: int) -> float:
        """Height, mm, of one end over another where it is straight back along the tool with the same axis, or 0."""
        nc, base = self._ahead.nc, self._ahead.base
        if below < base:
            return 0.0
        both = np.array([above, below]) - base
        axis = directions(nc, nc.tip[both], nc.second[both])
        way = nc.tip[both[0]] - nc.tip[both[1]]
        height = float(way @ axis[1])
        aside = float(np.linalg.norm(way - height * axis[1]))
        turned = float(np.linalg.norm(axis[0] - axis[1]))
        return height if height > _LEAST and aside <= _ASIDE + _TURN * height and turned <= _TURN else 0.0
