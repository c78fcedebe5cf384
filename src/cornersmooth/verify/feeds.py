"""Feeds: every written element must carry the feed of a CL move that its tip may run along within the tolerance."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, FeedMode, Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.nc_reader.tool import directions
from cornersmooth.verify.cl_motion import Original
from cornersmooth.verify.findings import Findings, Runs
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import COLUMNS, on_segments
from cornersmooth.verify.task import ARITHMETIC, Task

#: segments on either side of a vertex that are looked at first (speed only)
_FEW = 64

#: wrong elements in a row that are looked at one by one; the rest of them goes with these
_MOST_SINGLE = 50


def check_feeds(match: Match, found: Findings) -> None:
    """Every element must carry the feed of its move: CS541 a wrong feed, CS542 none, CS543 the wrong feed mode."""
    nc, feeding = match.nc, match.feeding
    element = np.flatnonzero(feeding) + match.first + 1
    if not len(element):
        return
    start, end = match.motion.last[:-1][feeding], match.motion.last[1:][feeding]
    low, high = _touched(match, start, end)
    # a planned feed of what does not move the tool, as a table that turns about it, tells nothing but a time
    still = nc.least_feed[element] & (np.linalg.norm(match.six[end] - match.six[start], axis=1) <= ARITHMETIC)
    still &= end == start + 1  # a full circle has more vertices
    good = still | (nc.kind[element] == Element.RAPID)
    for move in (low, high):
        rows = np.flatnonzero(~good)
        good[rows] = _fits(match.original, match.nc, element[rows], move[rows])
    in_a_row = 0
    for k in np.flatnonzero(~good).tolist():
        in_a_row = in_a_row + 1 if k and not good[k - 1] else 0
        if in_a_row < _MOST_SINGLE:
            own = int(element[k])
            good[k] = _fits(match.original, match.nc, own, np.arange(low[k], high[k] + 1)).any() or _joined(
                match, own, _beside(match, int(start[k])), _beside(match, int(end[k]))
            )
    wrong = np.flatnonzero(~good)
    if len(wrong):
        first = wrong[np.diff(wrong, prepend=-2) > 1]
        problems = [_problem(match.original, nc, int(element[k]), int(low[k])) for k in first.tolist()]
        found.feeds = Runs(problems, begins=not good[0], ends=not good[-1])


def _touched(match: Match, start: Ints, end: Ints) -> tuple[Ints, Ints]:
    """First and last original move that an element runs along."""
    length = match.path.length
    owner = match.original.trail.owner
    segment = match.segment[start]
    rest = length[segment + 1] - match.path.lengths_at(match.place[start])
    segment = np.where((rest <= match.margin) & (segment < match.high[start]), segment + 1, segment)
    last = match.segment[end]
    gone = match.path.lengths_at(match.place[end]) - length[last]
    last = np.where((gone <= match.margin) & (last > segment), last - 1, last)
    last = np.maximum(last, segment)
    return owner[segment + 1], owner[last + 1]


def _fits(original: Original, nc: Elements, element: Ints | int, move: Ints) -> Bools:
    """Whether elements carry the feeds of moves, in their unit."""
    program, pose = original.program, original.pose[move]
    asked, mode = program.feed[pose], program.feed_mode[pose] == FeedMode.PER_REVOLUTION
    return np.isnan(asked) | nc.carry(element, asked, mode)


def _beside(match: Match, vertex: int) -> Ints:
    """Moves around its own that a vertex may be on."""
    low, here, high = (int(segment[vertex]) for segment in (match.low, match.segment, match.high))
    return _near(match.task, match.six[vertex, :3], low, here, high)


def _near(task: Task, tip: Floats, low: int, here: int, high: int) -> Ints:
    """Moves around that of a segment, from one segment to another, within the tolerance (`Task.radius`) of a tip."""
    size = _FEW
    while True:
        segments = np.arange(max(here - size, low), min(here + size, high) + 1)
        _, square = on_segments(tip[None, None], task.path.points, segments[None], COLUMNS["tip"])
        off = segments[square[0] > task.radius**2]
        begin, end = off[off < here].max(initial=low - 1) + 1, off[off > here].min(initial=high + 1)
        if segments[0] <= max(begin - 1, low) and min(end, high) <= segments[-1]:
            owner: Ints = task.original.trail.owner[begin + 1 : end + 1]
            return owner
        size *= 4


def _joined(match: Match, element: int, first: Ints, last: Ints) -> bool:
    """Whether a move of the first leads to one of the last along moves whose feed an element carries."""
    moves = np.arange(min(first[0], last[0]), max(first[-1], last[-1]) + 1)
    good = _fits(match.original, match.nc, element, moves)
    run = np.cumsum(np.diff(good, prepend=False))
    one, other = (set(run[good & np.isin(moves, part)].tolist()) for part in (first, last))
    return not one.isdisjoint(other)


def out_of_hole(task: Task, nc: Elements, element: int, move: int) -> float:
    """Place on the move after a hole that is nearest to the end of an element."""
    tip, last = nc.tip[element : element + 1], task.original.trail.last
    six = task.six(tip, directions(nc, tip, nc.second[element : element + 1]))
    segment = np.arange(int(last[move]), int(last[move + 1]))
    share, square = on_segments(six[None], task.path.points, segment[None], COLUMNS["both"])
    nearest = int(np.argmin(square))
    return float(segment[nearest] + share[0, nearest])


def feed_at(task: Task, nc: Elements, element: int, move: int, place: float) -> list[Problem]:
    """What is wrong with the feed of an element of which only the end is compared: it leads to a place of a move."""
    last, moves = task.path.segments - 1, np.array([move])
    if last >= 0:
        here = min(int(place), last)
        moves = np.append(moves, _near(task, nc.tip[element], here, here, last))
    if _fits(task.original, nc, element, moves).any():
        return []
    return [_problem(task.original, nc, element, move)]


def _problem(original: Original, nc: Elements, element: int, move: int) -> Problem:
    program, pose = original.program, int(original.pose[move])
    unit = "rev" if program.feed_mode[pose] == FeedMode.PER_REVOLUTION else "min"
    said = "rev" if nc.per_revolution[element] else "min"
    if np.isnan(nc.feed[element]):
        what = "CS542", "a feed move before any F, or at inverse time (G93) from a place that is not known"
    elif unit != said:
        what = "CS543", f"the feed is per {said}, the CL file says per {unit}"
    else:
        what = "CS541", f"the feed is {nc.feed[element]:g} mm/{said}, the CL file says {program.feed[pose]:g}"
    code, text = what
    return Problem(code, int(program.line[pose]), int(nc.line[element]), text)
