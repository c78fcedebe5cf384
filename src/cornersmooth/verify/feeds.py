"""Feeds: every written element must carry the feed of a CL move that its tip may run along within the tolerance."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, FeedMode, Ints, Program
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.verify.findings import Findings, Runs
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import COLUMNS, on_segments
from cornersmooth.verify.task import ARITHMETIC

#: segments on either side of a vertex that are looked at first (speed only)
_FEW = 64

#: elements that are looked at one by one in a run of wrong ones; none of those behind them is better
_MOST_SINGLE = 50


def check_feeds(match: Match, found: Findings) -> None:
    """Every element must carry the feed of its move: CS541 a wrong feed, CS542 none, CS543 the wrong feed mode."""
    nc, original = match.nc, match.original
    program, last = original.program, match.motion.last
    start, end, feeding = last[:-1], last[1:], match.feeding
    element = np.flatnonzero(feeding) + match.first + 1
    if not len(element):
        return
    start, end = start[feeding], end[feeding]
    low, high = _touched(match, start, end)
    rapid = nc.kind[element] == Element.RAPID

    # a planned feed of what does not move the tool, as a table that turns about it, tells nothing but a time
    still = nc.least_feed[element] & (np.linalg.norm(match.six[end] - match.six[start], axis=1) <= ARITHMETIC)
    still &= end == start + 1  # a full circle has more vertices
    good = _fits(match, element, low) | rapid | still
    other = np.flatnonzero(~good)
    if len(other):
        good[other] = _fits(match, element[other], high[other])
        several = np.flatnonzero(~good & (high > low + 1))
        for k in several.tolist():
            good[k] = _fits(match, int(element[k]), np.arange(low[k], high[k] + 1)).any()
    wrong = np.flatnonzero(~good)
    follows = np.diff(wrong, prepend=-2) == 1
    in_a_row = 0
    for k, joined in zip(wrong.tolist(), follows.tolist(), strict=True):
        in_a_row = in_a_row + 1 if joined and not good[k - 1] else 0
        if in_a_row >= _MOST_SINGLE:
            continue
        good[k] = _joined(match, int(element[k]), _beside(match, int(start[k])), _beside(match, int(end[k])))
    wrong = np.flatnonzero(~good)
    if len(wrong):
        runs = np.split(wrong, np.flatnonzero(np.diff(wrong) > 1) + 1)
        problems = [_problem(program, nc, original.pose, element, low, int(run[0])) for run in runs]
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


def _fits(match: Match, element: Ints | int, move: Ints) -> Bools:
    """Whether elements carry the feeds of moves, in their unit."""
    nc, program, pose = match.nc, match.original.program, match.original.pose[move]
    asked, mode = program.feed[pose], program.feed_mode[pose] == FeedMode.PER_REVOLUTION
    feed, slack = nc.feed[element], ARITHMETIC * np.maximum(np.abs(asked), 1.0)
    room = nc.feed_room[element] + slack
    near = (np.abs(feed - asked) <= room) | (np.abs(nc.other_feed[element] - asked) <= room)
    near |= nc.least_feed[element] & (feed > 0.0) & (feed <= asked + slack)
    return np.isnan(asked) | (near & (nc.per_revolution[element] == mode))


def _beside(match: Match, vertex: int) -> Ints:
    """Moves around its own that a vertex may be on: within the tolerance (`Task.radius`) of its tip."""
    low, here, high = int(match.low[vertex]), int(match.segment[vertex]), int(match.high[vertex])
    size = _FEW
    while True:
        first, stop = max(here - size, low), min(here + size, high) + 1
        segments = np.arange(first, stop)
        _, square = on_segments(match.six[vertex, None, None, :3], match.path.points, segments[None], COLUMNS["tip"])
        off = np.flatnonzero(square[0] > match.task.radius**2) + first
        begin, end = off[off < here].max(initial=first - 1) + 1, off[off > here].min(initial=stop)
        if (begin > first or first == low) and (end < stop or stop == high + 1):
            owner: Ints = match.original.trail.owner[begin + 1 : end + 1]
            return owner
        size *= 4


def _joined(match: Match, element: int, first: Ints, last: Ints) -> bool:
    """Whether a move of the first leads to one of the last along moves whose feed an element carries."""
    moves = np.arange(min(first[0], last[0]), max(first[-1], last[-1]) + 1)
    good = _fits(match, element, moves)
    run = np.cumsum(np.diff(good, prepend=False))
    one, other = (set(run[good & np.isin(moves, part)].tolist()) for part in (first, last))
    return not one.isdisjoint(other)


def _problem(program: Program, nc: Elements, pose: Ints, element: Ints, low: Ints, k: int) -> Problem:
    own, move = int(element[k]), int(pose[low[k]])
    cl_line, nc_line = int(program.line[move]), int(nc.line[own])
    unit = "rev" if program.feed_mode[move] == FeedMode.PER_REVOLUTION else "min"
    said = "rev" if nc.per_revolution[own] else "min"
    if np.isnan(nc.feed[own]):
        return Problem(
            "CS542",
            cl_line,
            nc_line,
            "a feed move before any F, or at inverse time (G93) from a place that is not known",
        )
    if unit != said:
        return Problem("CS543", cl_line, nc_line, f"the feed is per {said}, the CL file says per {unit}")
    text = f"the feed is {nc.feed[own]:g} mm/{said}, the CL file says {program.feed[move]:g}"
    return Problem("CS541", cl_line, nc_line, text)
