"""Rapids and what lies between them: the first, coarse correspondence of the two motions.

A *stop* is a pose that the text must name exactly and that divides the motion: the end of a rapid, a hole, the very
first pose. A *stretch* is the run of feed moves between two stops.
"""

from __future__ import annotations

import difflib
from typing import Final

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.nc_reader.elements import Elements, Problem
from cornersmooth.nc_reader.tool import beyond_digits, directions
from cornersmooth.verify.cl_motion import Original
from cornersmooth.verify.task import ARITHMETIC

#: longer runs of stops that do not fit are not searched for their best correspondence
_LONGEST_SEARCH = 2000

#: stops missing one after another of which it is looked for where they should be
_LOCATED: Final = 16

#: stops of the text that are looked at together where they do not fit, before the end of it is known
WINDOW: Final = 64


def digit_errors(nc: Elements, element: Ints, tip: Floats, axis: Floats, axis_length: float) -> tuple[Bools, Floats]:
    """Compare ends of elements with poses they should name exactly.

    Parameters
    ----------
    element : (k,) int64
    tip, axis : (k, 3) float64
    axis_length : float, mm

    Returns
    -------
    exact : (k,) bool
        Every printed number is the pose's, rounded to the printed digits.
    amount : (k,) float64, mm
        The larger distance, of tips or of axis points.
    """
    off = nc.tip[element] - tip
    second = nc.second[element]
    near = np.abs(off) <= (nc.tip_step / 2 + nc.tip_room[element] + ARITHMETIC)[:, None]
    exact: Bools = np.logical_and.reduce(near, axis=1)
    if nc.second_is == "vector":
        side = second - axis
        room = (nc.second_step / 2 + nc.second_room[element] + ARITHMETIC)[:, None]
    else:  # only the direction of the axis point counts, and the tip's own rounding turns it too
        side = second - nc.tip[element]
        side -= np.linalg.norm(side, axis=1)[:, None] * axis
        room = np.sqrt(3) * (nc.second_step + nc.tip_step) / 2 + ARITHMETIC
    exact &= (np.abs(side) <= room).all(axis=1)
    turned = off + axis_length * (directions(nc, nc.tip[element], second) - axis)
    return exact, np.maximum(np.linalg.norm(off, axis=1), np.linalg.norm(turned, axis=1))


class Rapids:
    """Pairs the stops of a part of the CL motion with those of the text, in order, as they are read.

    Parameters
    ----------
    axis_length : float, mm
    nc : Elements
        Any of the text: its digits decide which rapids of the CL file move the tool.
    first, last : int
        Moves of the part.
    """

    def __init__(self, original: Original, axis_length: float, nc: Elements, first: int, last: int) -> None:
        self.original, self.axis_length = original, axis_length
        self.stops = stops_of_original(original, axis_length, nc.tip_step, first, last)
        self.next = 0
        #: how many of the stops last given to `pair` are done with
        self.settled = 0
        self.problems: list[Problem] = []
        program, poses = original.program, original.pose[self.stops]
        self._tip, self._axis = program.tip[poses], program.axis[poses]
        self._from_hole = bool(program.kind[poses[0]] == Move.HOLE)

    def pair(self, nc: Elements, ours: Ints, *, final: bool, urgent: bool = False) -> tuple[Ints, Ints]:
        """Pair stops of the text.

        Parameters
        ----------
        nc : Elements
            The part of the text that is at hand.
        ours : (k,) int64
            Its stops that have not been paired, ascending.
        final : bool
            Whether there are no more.
        urgent : bool
            Whether it must be decided now what belongs to stops that do not fit.

        Returns
        -------
        move, element : (p,) int64
            Pairs found, each behind those before. Stops of the text up to the last of them are done with; those that
            fit nothing are in `problems`: CS531 a rapid goes elsewhere, CS532 a rapid is missing, CS533 a rapid too
            many.
        """
        moves, elements = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
        count = len(ours)
        while True:
            head = self._fitting(nc, ours)
            moves.append(self.stops[self.next : self.next + head])
            elements.append(ours[:head])
            self.next += head
            ours = ours[head:]
            left = len(self.stops) - self.next
            if not (len(ours) or (final and left)):
                break
            if not final and len(ours) < WINDOW and not urgent:
                break
            before = int(elements[-1][-1]) if head else 0
            found, used = self._align(nc, ours, before, final=final)
            moves.append(self.stops[[i for i, _ in found]] if found else moves[0])
            elements.append(ours[[j for _, j in found]] if found else elements[0])
            ours = ours[used:]
            if final:
                break
        self.settled = count - len(ours)
        return np.concatenate(moves), np.concatenate(elements)

    def _fitting(self, nc: Elements, ours: Ints) -> int:
        """How many of the next stops name their poses exactly."""
        count = min(len(self.stops) - self.next, len(ours))
        if not count:
            return 0
        rows = slice(self.next, self.next + count)
        exact, _ = digit_errors(nc, ours[:count], self._tip[rows], self._axis[rows], self.axis_length)
        if self._from_hole and self.next == 0:  # out of a hole the tool comes from anywhere
            exact[0] = True
        return count if exact.all() else int(np.argmin(exact))

    def _align(self, nc: Elements, ours: Ints, before: int, *, final: bool) -> tuple[list[tuple[int, int]], int]:
        """Pair stops that do not all fit: pairs (indices), and how many stops of the text that settles."""
        theirs = np.arange(self.next, len(self.stops))
        if not final:
            theirs, ours = theirs[:WINDOW], ours[:WINDOW]
        tail = 0
        count = min(len(theirs), len(ours))
        if final and count:
            rows = theirs[len(theirs) - count :]
            exact, _ = digit_errors(nc, ours[-count:], self._tip[rows], self._axis[rows], self.axis_length)
            tail = count if exact.all() else int(np.argmin(exact[::-1]))
        middle = slice(0, len(theirs) - tail), slice(0, len(ours) - tail)
        codes = _opcodes(self._tip[theirs[middle[0]]], nc, ours[middle[1]])
        if not final:  # what is left behind the last that fits may fit something farther on
            while len(codes) > 1 and codes[-1][0] != "equal":
                codes.pop()
            tag, i0, i1, j0, j1 = codes[-1]
            codes[-1] = tag, i0, min(i1, i0 + j1 - j0), j0, j1
        pairs: list[tuple[int, int]] = []
        used = 0
        for tag, i0, i1, j0, j1 in codes:
            both = min(i1 - i0, j1 - j0)
            for i, j in zip(theirs[i0 : i0 + both].tolist(), range(j0, j0 + both), strict=True):
                pairs.append((i, j))
                self._compare(nc, i, int(ours[j]), same=tag == "equal")
            first, last = int(ours[j1 - 1]) if j1 else before, int(ours[j1]) if j1 < len(ours) else len(nc) - 1
            for count, i in enumerate(theirs[i0 + both : i1].tolist()):
                self.missing(nc, i, first if count < _LOCATED else last, last)
            for j in range(j0 + both, j1):
                if not _negligible(nc.tip, ours[j], nc):
                    move = self.stops[min(int(theirs[0]) + i1, len(self.stops)) - 1] if len(theirs) else self.stops[-1]
                    text = "a rapid that the CL file does not have, or a feed move written as one"
                    self.problems.append(_problem("CS533", self.original, int(move), nc, ours[j], text))
            self.next, used = self.next + i1 - i0, j1
        pairs += [(int(theirs[len(theirs) - tail + k]), len(ours) - tail + k) for k in range(tail)]
        self.next += tail
        return pairs, used + tail

    def _compare(self, nc: Elements, i: int, element: int, *, same: bool) -> None:
        """Say where a stop goes elsewhere; `same` where their tips agree in the printed digits."""
        own = np.array([element])
        fine, amount = digit_errors(nc, own, self._tip[i : i + 1], self._axis[i : i + 1], self.axis_length)
        if not (same and fine[0]):
            text = "a rapid does not end at its pose"
            move = int(self.stops[i])
            self.problems.append(_problem("CS531", self.original, move, nc, element, text, float(amount[0])))

    def missing(self, nc: Elements, i: int, first: int, last: int) -> None:
        """Say that a stop is missing in the text between two elements, if it moves the tool."""
        original, move = self.original, int(self.stops[i])
        around = original.program.tip[original.pose[max(move - 1, 0) : move + 1]]
        if not _negligible(around, len(around) - 1, nc):
            element = first + int(np.argmin(np.linalg.norm(nc.tip[first : last + 1] - self._tip[i], axis=1)))
            text = "a rapid of the CL file is missing, or is written as a feed move"
            self.problems.append(_problem("CS532", original, move, nc, element, text))


def stops_of_original(original: Original, axis_length: float, step: float, first: int = 0, last: int = -1) -> Ints:
    """Moves from `first` to `last` that are rapid and move the tool in printed steps, and the first of all."""
    pose = original.pose[first : None if last < 0 else last + 1]
    index = np.flatnonzero(original.program.kind[pose] == Move.RAPID)
    index = index[index > 0]
    moved = np.zeros(len(index), np.bool_)
    for values, length in ((original.program.tip, 1.0), (original.program.axis, axis_length)):
        here, before = (np.round(length * values[rows] / step) for rows in (pose[index], pose[index - 1]))
        moved |= (here != before).any(axis=1)
    return np.concatenate(([first], index[moved] + first))


def _opcodes(theirs: Floats, nc: Elements, element: Ints) -> list[tuple[str, int, int, int, int]]:
    """How the tips of elements differ from a list of tips, in printed digits."""
    if max(len(theirs), len(element)) > _LONGEST_SEARCH:
        return [("replace", 0, len(theirs), 0, len(element))]
    step, ours = nc.tip_step, nc.tip[element]
    aside = np.flatnonzero(nc.tip_room[element])
    if len(aside) and len(theirs):  # digits along other axes: the nearest tip, if it is as near as they can be
        apart = np.linalg.norm(ours[aside, None] - theirs, axis=2)
        near = apart.min(axis=1) <= np.sqrt(3) / 2 * step + ARITHMETIC
        ours[aside[near]] = theirs[apart.argmin(axis=1)[near]]
    left = [tuple(row) for row in np.round(theirs / step).astype(np.int64).tolist()]
    right = [tuple(row) for row in np.round(ours / step).astype(np.int64).tolist()]
    return list(difflib.SequenceMatcher(None, left, right, autojunk=False).get_opcodes())


def _negligible(tip: Floats, index: int, nc: Elements) -> bool:
    """Whether a stop moves the tip by no more than printed digits show."""
    return bool(index > 0 and not beyond_digits(nc, (tip[index] - tip[index - 1])[None])[0])


def _problem(
    code: str, original: Original, move: int, nc: Elements, element: int, text: str, amount: float = float("nan")
) -> Problem:
    return Problem(code, int(original.program.line[original.pose[move]]), int(nc.line[element]), text, amount)
