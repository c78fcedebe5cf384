"""Feeds as functions of the place: where an element runs along a CL move, it must carry the feed of that move.

A vertex may be a little before its place or behind it: anywhere on the CL path, without a break, within the tolerance.
Between the last place of the start of an element and the first of its end, every move counts. Where nothing lies
between the two, any of the moves that the element may be on does.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.model import Bools, FeedMode, Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements, Problem
from cornersmooth.nc_reader.tool import cross
from cornersmooth.verify.free_space import free_interval
from cornersmooth.verify.match import Match
from cornersmooth.verify.motions import ARITHMETIC, COLUMNS, on_segments
from cornersmooth.verify.result import Findings, Runs
from cornersmooth.verify.task import Original, Task

#: share by which the feed may be another on an arc that rises, where F counts in the plane of the circle alone
_FASTER: Final = 0.02

#: places nearer to a vertex of the CL path are at it, in segments
_HAIR: Final = 1e-9


def check_feeds(match: Match, found: Findings) -> None:
    """Every element must carry the feed of its moves: CS541 a wrong feed, CS542 none, CS543 the wrong feed mode."""
    feeding, task = match.feeding, match.task
    nc = _along_helices(match.nc) if task.feed_in_plane and len(match.nc.arcs) else match.nc
    element = np.flatnonzero(feeding) + match.first + 1
    if not len(element):
        return
    start, end = match.motion.last[:-1][feeding], match.motion.last[1:][feeding]
    place = match.place[start], match.place[end]
    wrong = np.full(len(element), -1)
    first, last = _runs_between(task, *place)
    good = (first == last) & _fits(task.original, nc, element, task.feed_runs[1][first])
    good |= nc.kind[element] == Element.RAPID
    # the feed of what does not move the tool, as a table that turns about it, tells nothing but a time
    rows = np.flatnonzero(~good & (end == start + 1))  # a full circle has more vertices
    ways = match.six[end[rows]] - match.six[start[rows]]
    good[rows] = np.linalg.norm(ways, axis=1) <= ARITHMETIC
    until = wrong.copy()  # the last run whose feed would do, from `wrong` on
    if len(rows := np.flatnonzero(~good)):
        own = start[rows]
        limits = match.low[own], match.high[own]
        six = match.six[own], match.six[end[rows]]
        from_, to = (where[rows] for where in place)
        latest, earliest = reach(task, six[0], from_, limits, 1), reach(task, six[1], to, limits, -1)
        between = latest + _HAIR < earliest - _HAIR
        runs = _runs_between(task, latest, earliest)
        wrong[rows] = until[rows] = np.where(between, _first_run(task, nc, element[rows], *runs, fits=False), -1)
        if len(some := np.flatnonzero(~between)):
            limits, rows = (limits[0][some], limits[1][some]), rows[some]
            around = (reach(task, six[k][some], (from_, to)[k][some], limits, 2 * k - 1) for k in (0, 1))
            runs = _runs_between(task, *around)
            fitting = _first_run(task, nc, element[rows], *runs, fits=True) >= 0
            wrong[rows], until[rows] = np.where(fitting, -1, runs)
        good = wrong < 0
    wrongs = np.flatnonzero(~good)
    if len(wrongs):
        shown = wrongs[np.diff(wrongs, prepend=-2) > 1]
        moves = task.feed_runs[1]
        each = zip(element[shown].tolist(), wrong[shown].tolist(), until[shown].tolist(), strict=True)
        problems = [_problem(match.original, nc, row, moves[one : last_one + 1]) for row, one, last_one in each]
        found.feeds = Runs(problems, begins=not good[0], ends=not good[-1])


def _along_helices(nc: Elements) -> Elements:
    """The same elements with feeds along steep arcs as they are where F counts in the plane of the circle alone."""
    arcs = nc.arcs
    way = nc.tip[arcs.element] - nc.tip[np.maximum(arcs.element - 1, 0)]
    radius = np.linalg.norm(cross(arcs.normal, nc.tip[arcs.element] - arcs.centre), axis=1)
    flat, faster = radius * arcs.sweep, np.ones(len(nc))
    share = np.hypot(flat, np.einsum("ij,ij->i", way, arcs.normal)) / np.where(flat > 0.0, flat, np.inf)
    faster[arcs.element] = np.maximum(share, 1.0)
    room = np.nan_to_num(nc.feed) * np.minimum(faster - 1.0, _FASTER)
    return replace(nc, feed=nc.feed * faster, other_feed=nc.other_feed * faster, feed_room=nc.feed_room + room)


def _runs_between(task: Task, low: Floats, high: Floats) -> tuple[Ints, Ints]:
    """(k,) first and last run of moves with one feed between two places of the CL path."""
    run, owner = task.feed_runs[0], task.original.trail.owner
    first = np.minimum((low + _HAIR).astype(np.int64), task.path.segments - 1)
    last = np.maximum(np.ceil(high - _HAIR).astype(np.int64) - 1, first)
    return run[owner[first + 1]], run[owner[last + 1]]


def _first_run(task: Task, nc: Elements, element: Ints, first: Ints, last: Ints, *, fits: bool) -> Ints:
    """(k,) first of some runs, from `first` to `last`, whose feed elements carry, or do not; -1 for none."""
    found, run, rows = np.full(len(element), -1), first.copy(), np.arange(len(element))
    while len(rows):
        here = _fits(task.original, nc, element[rows], task.feed_runs[1][run[rows]]) == fits
        found[rows[here]] = run[rows[here]]
        rows = rows[~here & (run[rows] < last[rows])]
        run[rows] += 1
    return found


def _fits(original: Original, nc: Elements, element: Ints | int, move: Ints) -> Bools:
    """Whether elements carry the feeds of moves, in their unit."""
    program, pose = original.program, original.pose[move]
    wanted, mode = program.feed[pose], program.feed_mode[pose] == FeedMode.PER_REVOLUTION
    return np.isnan(wanted) | nc.carry(element, wanted, mode)


def reach(task: Task, six: Floats, place: Floats, limits: tuple[Ints, Ints], way: int) -> Floats:
    """(k,) last places up to which the CL path stays within the tolerance of points (k, 6), from places on.

    Forward or back, as `way` is 1 or -1; `limits`: the first and the last segment (k,) that may be reached.
    """
    points, bend = task.path.points, task.path.bend  # the path leaves its chords by that
    found, rows = place.copy(), np.arange(len(place))
    segment = place.astype(np.int64) if way > 0 else np.ceil(place).astype(np.int64) - 1
    segment = np.clip(segment, np.minimum(*limits), limits[1])
    while len(rows):
        start = points[segment].T
        low, high = free_interval(six[rows].T, start, points[segment + 1].T - start, task.radius + bend[segment])
        share = np.clip(found[rows] - segment, 0.0, 1.0)
        free = (low <= share + _HAIR) & (share - _HAIR <= high)
        end = np.clip(high, share, 1.0) if way > 0 else np.clip(low, 0.0, share)
        found[rows[free]] = (segment + end)[free]
        more = free & (
            (end >= 1.0) & (segment < limits[1][rows]) if way > 0 else (end <= 0.0) & (segment > limits[0][rows])
        )
        rows, segment = rows[more], segment[more] + way
    return found


def out_of_hole(task: Task, nc: Elements, element: int, move: int) -> float:
    """Place on the move after a hole that is nearest to the end of an element."""
    six, last = task.ends(nc, [element]), task.original.trail.last
    segment = np.arange(int(last[move]), int(last[move + 1]))
    share, square = on_segments(six[None], task.path.points, segment[None], COLUMNS["both"])
    nearest = int(np.argmin(square))
    return float(segment[nearest] + share[0, nearest])


def feed_at(task: Task, nc: Elements, element: int, move: int, place: float) -> list[Problem]:
    """What is wrong with the feed of an element of which only the end is compared: it leads to a place of a move."""
    first = last = task.feed_runs[0][[move]]
    if task.path.segments > 0:
        six, at = task.ends(nc, [element]), np.array([place])
        limits = np.zeros(1, np.int64), np.array([task.path.segments - 1])
        first, last = _runs_between(task, *(reach(task, six, at, limits, way) for way in (-1, 1)))
    if (
        _fits(task.original, nc, element, np.array([move])).any()
        or _first_run(task, nc, np.array([element]), first, last, fits=True)[0] >= 0
    ):
        return []
    return [_problem(task.original, nc, element, np.array([move]))]


def _problem(original: Original, nc: Elements, element: int, moves: Ints) -> Problem:
    """What is wrong with the feed of an element, for which the feed of any of some moves would do."""
    program, pose = original.program, int(original.pose[moves[0]])
    unit = "rev" if program.feed_mode[pose] == FeedMode.PER_REVOLUTION else "min"
    stated = "rev" if nc.per_revolution[element] else "min"
    if np.isnan(nc.feed[element]):
        what = "CS542", "a feed move before any F, or at inverse time (G93) from a place that is not known"
    elif unit != stated:
        what = "CS543", f"the feed is per {stated}, the CL file says per {unit}"
    else:
        poses = original.pose[moves]
        feeds = program.feed[poses[program.feed_mode[poses] == program.feed_mode[pose]]].tolist()
        wanted = ", then ".join(dict.fromkeys(f"{feed:g}" for feed in feeds))
        what = "CS541", f"the feed is {nc.feed[element]:g} mm/{stated}, the CL file says {wanted}"
    code, text = what
    return Problem(code, int(program.line[pose]), int(nc.line[element]), text)
