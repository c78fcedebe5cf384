"""Rapids and what lies between them: the first, coarse correspondence of the two motions.

A *stop* is a pose that the text must name exactly and that divides the motion: the end of a rapid, a hole, the very
first pose. A *stretch* is the run of feed moves between two stops.
"""

from __future__ import annotations

import difflib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints, Move
from cornersmooth.verify.ncprogram import Element, NcProgram, Problem
from cornersmooth.verify.trails import Original, directions

#: slack of arithmetic on coordinates that are a million times larger, mm
ARITHMETIC = 1e-9

#: longer runs of stops that do not fit are not searched for their best correspondence
_LONGEST_SEARCH = 2000


@dataclass(frozen=True)
class Stretches:
    """Feed moves between stops, k rows.

    Parameters
    ----------
    move_first, move_last : (k,) int64
        The stretch starts at the end of one original move and ends with another.
    element_first, element_last : (k,) int64
        The same for the path elements.
    fraction : (k,) float64
        Where on the next original move the stretch starts; 0 but for moves out of a hole.
    """

    move_first: Ints
    move_last: Ints
    element_first: Ints
    element_last: Ints
    fraction: Floats

    def __len__(self) -> int:
        return len(self.move_first)


def digit_errors(nc: NcProgram, element: Ints, tip: Floats, axis: Floats, axis_length: float) -> tuple[Bools, Floats]:
    """Compare ends of elements with poses they should name exactly.

    Parameters
    ----------
    nc : NcProgram
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
    exact: Bools = np.logical_and.reduce(np.abs(off) <= nc.tip_step / 2 + ARITHMETIC, axis=1)
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


def find_stretches(
    original: Original, nc: NcProgram, axis_length: float, parts: list[tuple[int, int, int, int]] | None = None
) -> tuple[Stretches, list[Problem]]:
    """Match the stops of both motions in order.

    Parameters
    ----------
    original : Original
    nc : NcProgram
    axis_length : float, mm
    parts : list of (move_first, move_last, element_first, element_last), optional
        Ranges to match one by one, both ends included; everything by default.

    Returns
    -------
    Stretches
        Everything between matched stops; a rapid that is missing on one side is taken as a straight move.
    list of Problem
        CS531 a rapid goes elsewhere, CS532 a rapid is missing, CS533 a rapid too many, CS534 no motion at all.
    """
    if parts is None:
        parts = [(0, len(original.pose) - 1, 0, len(nc) - 1)]
    problems: list[Problem] = []
    none = np.zeros(0, np.int64)
    rows: list[tuple[Ints, Ints, Ints, Ints, Floats]] = [(none, none, none, none, np.zeros(0))]
    for move_first, move_last, element_first, element_last in parts:
        if move_last < move_first and element_last < element_first:
            continue
        if move_last < move_first or element_last < element_first:
            ours = move_last < move_first
            line = 0 if ours else int(original.program.line[original.pose[move_first]])
            text = "motion that the CL file does not have" if ours else "the NC text lacks motion of the CL file"
            problems.append(Problem("CS534", line, int(nc.line[element_first]) if ours else 0, text))
            continue
        pairs, found = _match_part(original, nc, axis_length, move_first, move_last, element_first, element_last)
        move, element = pairs
        problems += found
        fraction = np.zeros(len(move))
        if original.program.kind[original.pose[move_first]] == Move.HOLE:
            fraction[0] = _fraction(original, nc, move_first, element_first, axis_length)
        last = np.append(move[1:] - 1, move_last), np.append(element[1:] - 1, element_last)
        rows.append((move, last[0], element, last[1], fraction))
    return Stretches(*(np.concatenate(column) for column in zip(*rows, strict=True))), problems


def _fraction(original: Original, nc: NcProgram, move: int, element: int, axis_length: float) -> float:
    """Where on the move after `move` an element ends."""
    program = original.program
    start, end = (
        np.concatenate((program.tip[pose], program.tip[pose] + axis_length * program.axis[pose]))
        for pose in original.pose[[move, move + 1]]
    )
    axis = directions(nc, nc.tip[element : element + 1], nc.second[element : element + 1])[0]
    point = np.concatenate((nc.tip[element], nc.tip[element] + axis_length * axis))
    way = end - start
    size = float(way @ way)
    return float(np.clip((point - start) @ way / size, 0.0, 1.0)) if size > 0 else 1.0


def _match_part(
    original: Original,
    nc: NcProgram,
    axis_length: float,
    move_first: int,
    move_last: int,
    element_first: int,
    element_last: int,
) -> tuple[tuple[Ints, Ints], list[Problem]]:
    """Match the stops of a range of moves with those of a range of elements."""
    theirs = stops_of_original(original, axis_length, nc.tip_step, move_first, move_last)
    ours = stops_of_text(nc, element_first, element_last)
    pairs, problems = _match(original, nc, theirs, ours, axis_length)
    if original.program.kind[original.pose[move_first]] == Move.RAPID and nc.kind[element_first] != Element.RAPID:
        text = "the first rapid is written as a feed move"
        problems.insert(0, _problem("CS532", original, move_first, nc, element_first, text))
    return pairs, problems


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


def stops_of_text(nc: NcProgram, first: int, last: int) -> Ints:
    """Elements from `first` to `last` that are rapid and move the tool, and the first of all, if there is any."""
    if last < first:
        return np.zeros(0, np.int64)
    return np.concatenate(([first], moving_rapids(nc.kind, nc.tip, nc.second, first + 1, last + 1)))


def moving_rapids(kind: NDArray[np.uint8], tip: Floats, second: Floats, first: int, stop: int) -> Ints:
    """Elements from `first` (at least 1) to `stop` (excluded) that are rapid and move the tool."""
    index = np.flatnonzero(kind[first:stop] == Element.RAPID) + first
    moved = (tip[index] != tip[index - 1]).any(axis=1) | (second[index] != second[index - 1]).any(axis=1)
    found: Ints = index[moved]
    return found


def _match(
    original: Original, nc: NcProgram, theirs: Ints, ours: Ints, axis_length: float
) -> tuple[tuple[Ints, Ints], list[Problem]]:
    program = original.program
    tip, axis = program.tip[original.pose[theirs]], program.axis[original.pose[theirs]]
    count = min(len(theirs), len(ours))
    exact, _ = digit_errors(nc, ours[:count], tip[:count], axis[:count], axis_length)
    if program.kind[original.pose[theirs[0]]] == Move.HOLE:  # out of a hole the tool comes from anywhere
        exact[0] = True
    if len(theirs) == len(ours) and exact.all():
        return (theirs, ours), []
    head = count if exact.all() else int(np.argmin(exact))
    tail_exact, _ = digit_errors(nc, ours[len(ours) - count :], tip[-count:], axis[-count:], axis_length)
    tail = count if tail_exact.all() else int(np.argmin(tail_exact[::-1]))
    tail = min(tail, count - head)
    mid_theirs, mid_ours = slice(head, len(theirs) - tail), slice(head, len(ours) - tail)
    pairs = [(k, k) for k in range(head)]
    problems: list[Problem] = []
    for tag, i0, i1, j0, j1 in _opcodes(tip[mid_theirs], nc.tip[ours[mid_ours]], nc.tip_step):
        both = min(i1 - i0, j1 - j0)
        for step in range(both):
            i, j = head + i0 + step, head + j0 + step
            pairs.append((i, j))
            if tag == "equal":
                fine, how_much = digit_errors(nc, ours[j : j + 1], tip[i : i + 1], axis[i : i + 1], axis_length)
                if fine[0]:
                    continue
            else:
                _, how_much = digit_errors(nc, ours[j : j + 1], tip[i : i + 1], axis[i : i + 1], axis_length)
            problems.append(
                _problem(
                    "CS531", original, theirs[i], nc, ours[j], "a rapid does not end at its pose", float(how_much[0])
                )
            )
        for k in range(head + i0 + both, head + i1):
            if not _negligible(program.tip[original.pose], theirs[k], nc):
                element = _passing(nc, ours, head + j1, program.tip[original.pose[theirs[k]]])
                text = "a rapid of the CL file is missing, or is written as a feed move"
                problems.append(_problem("CS532", original, theirs[k], nc, element, text))
        for k in range(head + j0 + both, head + j1):
            if not _negligible(nc.tip, ours[k], nc):
                pose = theirs[min(head + i1, len(theirs)) - 1] if len(theirs) else 0
                text = "a rapid that the CL file does not have, or a feed move written as one"
                problems.append(_problem("CS533", original, int(pose), nc, ours[k], text))
    pairs += [(len(theirs) - tail + k, len(ours) - tail + k) for k in range(tail)]
    i, j = np.array(pairs).T
    return (theirs[i], ours[j]), problems


def _opcodes(theirs: Floats, ours: Floats, step: float) -> list[tuple[str, int, int, int, int]]:
    if max(len(theirs), len(ours)) > _LONGEST_SEARCH:
        return [("replace", 0, len(theirs), 0, len(ours))]
    left = [tuple(row) for row in np.round(theirs / step).astype(np.int64).tolist()]
    right = [tuple(row) for row in np.round(ours / step).astype(np.int64).tolist()]
    return list(difflib.SequenceMatcher(None, left, right, autojunk=False).get_opcodes())


def _passing(nc: NcProgram, ours: Ints, stop: int, tip: Floats) -> int:
    """Element that ends nearest to a pose, between the stop before `stop` and that one."""
    first = int(ours[stop - 1]) if stop else 0
    last = int(ours[stop]) if stop < len(ours) else len(nc) - 1
    return first + int(np.argmin(np.linalg.norm(nc.tip[first : last + 1] - tip, axis=1)))


def _negligible(tip: Floats, index: int, nc: NcProgram) -> bool:
    """Whether a stop moves the tip by no more than the printed digits show, which may be those of turned axes."""
    way = np.abs(tip[index] - tip[index - 1])
    large = np.linalg.norm(way) / np.sqrt(3) if nc.rotary else way.max()
    return bool(index > 0 and large <= 1.01 * nc.tip_step)


def _problem(
    code: str, original: Original, move: int, nc: NcProgram, element: int, text: str, amount: float = float("nan")
) -> Problem:
    return Problem(code, int(original.program.line[original.pose[move]]), int(nc.line[element]), text, amount)
