"""Feeds: every written element must carry the feed of the original move it replaces.

Where a rounded pose changes the feed, the change may lie anywhere inside the rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from cornersmooth.model import Bools, FeedMode, Floats, Ints, Program
from cornersmooth.nc_reader.elements import Element, Elements, FeedIs, Problem
from cornersmooth.nc_reader.rotary import SHORT_STEPS
from cornersmooth.verify.cl_motion import Original
from cornersmooth.verify.findings import Findings, Runs
from cornersmooth.verify.match import Match
from cornersmooth.verify.rapids import ARITHMETIC

#: a rounding reaches at most so many times as far as its first vertex that is visibly off the line
_BEYOND_VISIBLE = 3.0

#: a tip that creeps goes at most so many times the room of the feed: `SHORT_STEPS` and two of which the room is two
_CREEPING = (SHORT_STEPS + 2) / 2

#: an element shorter than this may have the feed of any move so near, mm: ten steps of what CL files are written in
_TINY = 1e-3

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
    said = _Said(nc, element)
    rapid = nc.kind[element] == Element.RAPID

    def fits(k: int, moves: Ints) -> Bools:
        """(m,) whether row k carries the feed of moves."""
        return _Said(nc, int(element[k])).same(original, moves)

    # a planned feed of what does not move the tool, as a table that turns about it, tells nothing but a time
    still = (nc.feed_is[element] == FeedIs.LEAST) & (
        np.linalg.norm(match.six[end] - match.six[start], axis=1) <= ARITHMETIC
    )
    good = said.same(original, low) | rapid | still
    other = np.flatnonzero(~good)
    if len(other):
        good[other] = _Said(nc, element[other]).same(original, high[other])
        several = np.flatnonzero(~good & (high > low + 1))
        for k in several.tolist():
            good[k] = fits(k, np.arange(low[k], high[k] + 1)).any()
    wrong = np.flatnonzero(~good)
    follows = np.diff(wrong, prepend=-2) == 1
    in_a_row = 0
    for k, joined in zip(wrong.tolist(), follows.tolist(), strict=True):
        in_a_row = in_a_row + 1 if joined and not good[k - 1] else 0
        if in_a_row >= _MOST_SINGLE:
            continue
        ends = int(start[k]), int(end[k])
        good[k] = fits(k, _alike(match, int(element[k]), *ends)).any() or _elsewhere(match, *ends, partial(fits, k))
        if good[k]:
            continue
        good[k] = _inside_rounding(match, *ends, int(low[k]), _Said(nc, int(element[k])))
    wrong = np.flatnonzero(~good)
    if len(wrong):
        runs = np.split(wrong, np.flatnonzero(np.diff(wrong) > 1) + 1)
        problems = [_problem(program, nc, original.pose, element, low, int(run[0])) for run in runs]
        found.feeds = Runs(problems, begins=not good[0], ends=not good[-1])


def _touched(match: Match, start: Ints, end: Ints) -> tuple[Ints, Ints]:
    """First and last original move that an element runs along."""
    length = match.path.length
    owner = match.original.trail.owner
    segment, at = match.segment[start], match.fraction[start]
    rest = (1 - at) * (length[segment + 1] - length[segment])
    segment = np.where((rest <= match.margin) & (segment < match.high[start]), segment + 1, segment)
    last, at = match.segment[end], match.fraction[end]
    gone = at * (length[last + 1] - length[last])
    last = np.where((gone <= match.margin) & (last > segment), last - 1, last)
    last = np.maximum(last, segment)
    return owner[segment + 1], owner[last + 1]


@dataclass(frozen=True)
class _Said:
    """What elements say of their feed."""

    nc: Elements
    element: Ints | int

    def near(self, asked: Floats) -> Bools:
        """Whether they may be feeds that are asked for; the unit is not looked at."""
        nc, own = self.nc, self.element
        feed, room, kind = nc.feed[own], nc.feed_room[own], nc.feed_is[own]
        slack = ARITHMETIC * np.maximum(np.abs(asked), 1.0)
        near: Bools = np.abs(feed - asked) <= room + slack
        near |= (kind == FeedIs.OF_AXIS_POINT) & (asked <= _CREEPING * room)
        near |= (kind == FeedIs.LEAST) & (feed > 0.0) & (feed <= asked + slack)
        return near

    def same(self, original: Original, move: Ints) -> Bools:
        """Whether they are the feeds of moves, in their unit."""
        pose = original.pose[move]
        asked, mode = original.program.feed[pose], original.program.feed_mode[pose] == FeedMode.PER_REVOLUTION
        same: Bools = np.isnan(asked) | (self.near(asked) & (self.nc.per_revolution[self.element] == mode))
        return same


def _alike(match: Match, element: int, start: int, end: int) -> Ints:
    """Moves that an element may run along as well: its ends are as far from theirs as nobody can tell.

    Digits do not tell apart what poses a digit apart lie between, and near the pole the axis turns ahead of time.
    """
    nc, six = match.nc, match.path.points
    pole = match.task.axis_length * float(nc.second_room[element - 1 : element + 1].max()) if nc.rotary else 0.0
    room = 2 * match.margin + pole  # a pose is a rounding off, and its place as far from it as the margin
    if np.linalg.norm(match.six[end] - match.six[start]) < _TINY:
        room = max(room, _TINY)
    found = []
    for vertex, step in ((start, -1), (end, 1)):
        segment, fraction = int(match.segment[vertex]), match.fraction[vertex]
        here = six[segment] + fraction * (six[segment + 1] - six[segment])
        low, high = int(match.low[vertex]), int(match.high[vertex])
        k = segment
        while low <= k <= high and np.linalg.norm(six[k + (step > 0)] - here) <= room:
            k += step
        found.append(min(max(k, low), high))
    return np.unique(match.original.trail.owner[found[0] + 1 : found[1] + 2])


def _elsewhere(match: Match, start: int, end: int, fits: Callable[[Ints], Bools]) -> bool:
    """Whether an element may run along moves that fit beside its place, or on another turn of a path to and fro.

    Which of the poses within the tolerance a written one stands for nobody can tell.
    """
    owner = match.original.trail.owner
    segments = match.reachable.segments(start), match.reachable.segments(end)
    return all(map(len, segments)) and _joined(fits, *(owner[part + 1] for part in segments))


def _joined(fits: Callable[[Ints], Bools], first: Ints, last: Ints) -> bool:
    """Whether a move of the first leads to one of the last along moves that all fit."""
    moves = np.arange(min(first[0], last[0]), max(first[-1], last[-1]) + 1)
    good = fits(moves)
    run = np.cumsum(np.diff(good, prepend=False))
    one, other = (set(run[good & np.isin(moves, part)].tolist()) for part in (first, last))
    return not one.isdisjoint(other)


def _inside_rounding(match: Match, start: int, end: int, move: int, said: _Said) -> bool:
    """Whether an element lies in the rounding at one end of its move, and carries the feed of the move beyond."""
    length, trail, pose, off = match.path.length, match.original.trail, match.original.pose, match.off
    visible = match.margin / 2
    low, high = int(match.low[start]), int(match.high[start])

    def at(vertex: int) -> float:
        segment = int(match.segment[vertex])
        here: float = length[segment] + match.fraction[vertex] * (length[segment + 1] - length[segment])
        return here

    def beyond(towards: int) -> list[int]:
        """Moves beyond the pose up to the next that leads anywhere: repeated poses are rounded as one."""
        found = []
        other = move + towards
        while 0 <= other < len(pose):
            found.append(other)
            if length[trail.last[other]] - (length[trail.last[other - 1]] if other else 0.0) > match.margin:
                break
            other += towards
        return found

    for pose_vertex, vertex, step in (
        (int(trail.last[move]), start, 1),
        (int(trail.last[move - 1]) if move else -1, end, -1),
    ):
        if not low < pose_vertex <= high:
            continue
        if not said.near(match.original.program.feed[pose[beyond(step)]]).any():
            continue
        there = length[pose_vertex]
        begin, other = length[trail.last[move - 1]], length[trail.last[move]]
        far = abs(at(vertex) - there)
        if far > (other - begin) / 2 + match.margin:
            continue
        reach = largest = 0.0
        walker = vertex
        while 0 <= walker < len(off) and match.on[walker] and step * (at(walker) - there) <= 0:
            if off[walker] > visible:
                reach = max(reach, abs(at(walker) - there))
                largest = max(largest, float(off[walker]))
            walker += step
        if 0 <= walker < len(off):
            largest = max(largest, float(off[walker]))
        # the tip tells no more than that, and the axis of a rounding that ends where it stands may be far beyond
        stands = np.linalg.norm(match.six[vertex, :3] - match.path.points[pose_vertex, :3]) <= match.margin
        if far <= _BEYOND_VISIBLE * reach + match.margin or 0 < largest <= (np.inf if stands else 8 * visible):
            return True
    return False


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
