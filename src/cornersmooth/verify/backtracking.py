"""Whether the path is run in order: no going back that the CL file does not have, even within the tolerance.

Where the original turns round itself, going back along it is what it asks for; so only such stretches count that the
other motion runs through without turning.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.distances import Distances, Reached
from cornersmooth.verify.findings import Findings
from cornersmooth.verify.in_order import Windows
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import COLUMNS, Metric, distance_between, nearest_segments
from cornersmooth.verify.rapids import ARITHMETIC
from cornersmooth.verify.wide_search import nearest_alone

#: segments looked at on either side
_REACH = 3

#: a stretch whose length is more than so many times the distance of its ends turns
_STRAIGHT = 1.2

#: part of what counts as nearer by which tip or axis point must be nearer ahead to be taken as going on
_CLEARLY = 0.25

#: vertices of a batch that are followed one by one, and how far before a doubtful place one is sure, in `near`
_MOST_VERTICES, _SURE = 4096, 2.0

#: how many times `Match.near` a vertex is from its path that is on it nowhere, in six dimensions
_OFF = 2.0

#: times that a segment is cut to two thirds
_HALVINGS = 40

Found = tuple[Floats, Ints, Ints, Floats]


def check_backtracking(distances: Distances, found: Findings) -> None:
    """The path must be run in order: CS523."""
    match = distances.match
    theirs = original_backwards(match, distances.original, distances.windows)
    for places in (written_backwards(match, distances.written), theirs):
        if places is not None:
            found.violations.add(523, *places)


def written_backwards(match: Match, written: Reached) -> Found | None:
    """Written vertices that would fit clearly better before the one in front of them.

    Blocks in rotary words may bend: how far the tool has come the ends of blocks tell, not what lies between them.

    Returns
    -------
    place, cl_line, nc_line, amount
        (k,) place on the original, lines, and mm gained; None where there are none.
    """
    vertex = written.vertex[match.backward[written.vertex]]
    if not len(vertex):
        return None
    own, six, length = match.six[vertex], match.path.six, match.path.length
    segment, at = nearest_segments(own, six, match.segment[vertex], _REACH, match.low[vertex], match.high[vertex])
    free, held = segment + at, match.place[vertex]
    ends = match.on
    if match.nc.rotary:
        ends = match.on & _ends_blocks(match)
        held = _held_by_ends(match, ends, vertex, free, held)
        rows = np.flatnonzero(ends[vertex] & (free < held))
        vertex, own, free, held = vertex[rows], own[rows], free[rows], held[rows]
        if not len(vertex):
            return None
    off = distance_between(own, _on(six, free))
    gain = distance_between(own, _on(six, held)) - off
    # what is off the path is told by its distance: where along the path it would be nearest says nothing
    wrong = (gain > match.slack) & (free < held) & (off <= _OFF * match.near)
    way = _way(length, free, held)
    wrong &= way <= _STRAIGHT * distance_between(_on(six, held), _on(six, free)) + match.slack
    wrong &= way > off  # what is off the path by so much tells only within that how far along it it is
    rows = np.flatnonzero(wrong)
    wrong[rows] = _gain_alone(match, vertex[rows], held[rows], free[rows]) > match.slack
    rows = np.flatnonzero(wrong)
    if len(rows):
        wrong[rows] = ~_on_other_lines(match, ends, vertex[rows], held[rows])
    if not wrong.any():
        return None
    original = match.original
    move = original.trail.owner[match.segment[vertex[wrong]] + 1]
    nc_line = match.nc.line[match.written.trail.owner[vertex[wrong]]]
    return held[wrong], original.program.line[original.pose[move]], nc_line, gain[wrong]


def _ends_blocks(match: Match) -> Bools:
    """(v,) whether a vertex is more than a point of the straight motion of the axes in one block."""
    nc, owner = match.nc, match.written.trail.owner
    following = np.minimum(owner + 1, len(nc.line) - 1)
    goes_on = (nc.line[following] == nc.line[owner]) & (following > owner)
    ends: Bools = ~(goes_on & match.written.straight[owner - match.written.first])
    return ends


def _held_by_ends(match: Match, ends: Bools, vertex: Ints, free: Floats, held: Floats) -> Floats:
    """Places (k,) that vertices must not go back behind, where only the ends of blocks have reached any."""
    place = np.where(ends, match.place, -np.inf)
    place[vertex] = np.where(ends[vertex], free, -np.inf)
    reached = np.append(-np.inf, np.maximum.accumulate(place)[:-1])[vertex]
    behind: Floats = np.minimum(held, np.maximum(reached, free))
    return behind


def _on_other_lines(match: Match, ends: Bools, vertex: Ints, held: Floats) -> Bools:
    """(k,) whether vertices follow in order all the same, if some before them belong to other lines of the CL path.

    Beside a turn several lines are near, and the nearest is not always the one that is run along. So each may be where
    it is nearest on any line within the tolerance, from the last place without doubt on. Those before them that are
    not in doubt themselves may wait where they are nearly nearest.
    """
    found = np.zeros(len(vertex), np.bool_)
    path, on = match.path, np.flatnonzero(ends)
    segment = np.minimum(held.astype(np.int64), len(path.length) - 2)
    last = np.searchsorted(on, vertex)
    sure = path.length[segment] - _SURE * match.near
    first = np.searchsorted(path.length_at(match.segment[on], match.fraction[on]), sure) - 1
    first = np.maximum(first, np.searchsorted(match.stretch[on], match.stretch[vertex]))
    groups = np.split(np.arange(len(vertex)), np.flatnonzero(first[1:] > last[:-1]) + 1)
    left = _MOST_VERTICES
    for rows in groups:
        walk = on[first[rows[0]] : last[rows[-1]] + 1]
        left -= len(walk)
        if left < 0:
            break
        reached = float(path.length_at(match.segment[walk[:1]], match.fraction[walk[:1]])[0])
        for here in walk[1:].tolist():
            mine = rows[vertex[rows] == here]
            reached = _first_place(match, here, int(segment[rows[-1]]) + _REACH, reached, waits=not len(mine))
            if np.isinf(reached):
                break
            found[mine] = True
    return found


def _first_place(match: Match, vertex: int, last: int, reached: float, *, waits: bool) -> float:
    """Path length of the first place, not clearly before `reached`, where a vertex is nearest to a line; else inf.

    With `waits` it may be before it by as much as the vertex is off the line: only within that is its place known.
    """
    path, own = match.path, match.six[vertex]
    room = match.near if waits else match.slack
    low = max(int(np.searchsorted(path.length, reached - room, side="right")) - 2, int(match.low[vertex]))
    high = max(min(last, int(match.high[vertex])), low)
    start = path.six[low : high + 1]
    way = path.six[low + 1 : high + 2] - start
    size = np.einsum("ij,ij->i", way, way)
    share = np.einsum("ij,ij->i", own - start, way)
    share = np.clip(np.divide(share, size, out=np.zeros_like(share), where=size > 0), 0.0, 1.0)
    # not the end of a line that leads on to a nearer place
    leads_on = (share >= 1.0) & (np.append(share[1:], 1.0) > 0.0) | (share <= 0.0) & (np.append(0.0, share[:-1]) < 1.0)
    square = (own - start - share[:, None] * way) ** 2
    near = np.maximum(square[:, :3].sum(axis=1), square[:, 3:].sum(axis=1)) <= (match.tolerance + match.margin) ** 2
    begin = path.length[low : high + 1]
    place = begin + share * (path.length[low + 1 : high + 2] - begin)
    before = np.sqrt(square.sum(axis=1)) if waits else np.zeros(len(place))
    good = place[near & ~leads_on & (place >= reached - match.slack - before)]
    first = float(good.min(initial=np.inf))
    return max(first, reached)


def _gain_alone(match: Match, vertex: Ints, held: Floats, free: Floats) -> Floats:
    """By how much tip or axis point alone would be nearer at a place before the one that it must not go back behind.

    Where the tip turns round while its axis turns, a rounding that has turned already is nearest to the way before the
    turn, though tip and axis point each are near the way behind it. And a path that is run backwards takes both back:
    where one of them goes on, a curve only turns the tool a little less than it has done, within the tolerance.
    """
    own, six = match.six[vertex], match.path.six
    here, there = _on(six, held), _on(six, free)
    high = match.high[vertex]
    ahead = np.minimum(held.astype(np.int64) + 1, high)
    gains = np.zeros((2, len(vertex)))
    ways: tuple[Metric, ...] = ("tip", "axis point")
    for gain, metric in zip(gains, ways, strict=True):
        column = COLUMNS[metric]
        off = distance_between(own[:, column], here[:, column])
        beyond = nearest_alone(own, six, ahead, ahead, high, match.near, metric)[2]
        off = np.where(ahead > held, np.minimum(off, beyond), off)
        gain[:] = off - distance_between(own[:, column], there[:, column])
    one_goes_on = gains.min(axis=0) < -_CLEARLY * match.slack
    found: Floats = np.where(one_goes_on, 0.0, gains.max(axis=0))
    return found


def original_backwards(match: Match, theirs: Reached, windows: Windows) -> Found | None:
    """Neighbouring original vertices that the text clearly passes in reverse: part of the path, beyond ε, is missing.

    Nothing is, where both are run in order within the tolerance all around.

    Returns
    -------
    As `written_backwards`.
    """
    falls = np.flatnonzero((np.diff(theirs.place) < 0) & (np.diff(theirs.vertex) == 1)) + 1
    if not len(falls):
        return None
    six, trail = match.six, match.written.trail
    before, here = theirs.place[falls - 1], theirs.place[falls]
    length = np.concatenate(([0.0], np.cumsum(distance_between(six[1:], six[:-1]))))
    way = _way(length, here, before)
    straight = way <= _STRAIGHT * distance_between(_on(six, before), _on(six, here)) + match.slack
    falls, before, here = falls[straight], before[straight], here[straight]
    later, comes_back = _cost(match, theirs.vertex[falls], here, before, forward=True)
    earlier, came = _cost(match, theirs.vertex[falls - 1], before, here, forward=False)
    gain = np.minimum(later, earlier)
    wrong = np.flatnonzero((gain > match.slack) & ~comes_back & ~came)
    wrong = wrong[~_waits(match, theirs.vertex[falls[wrong]], here[wrong], before[wrong])]
    around = [windows.around(vertex) for vertex in before[wrong].astype(np.int64).tolist()]
    wrong = wrong[np.array([window is None or not window.passed for window in around], np.bool_)]
    if not len(wrong):
        return None
    original, vertex = match.original, theirs.vertex[falls[wrong]]
    cl_line = original.program.line[original.pose[original.trail.owner[vertex]]]
    nc_line = match.nc.line[trail.owner[np.minimum(before[wrong].astype(np.int64) + 1, len(trail) - 1)]]
    return vertex.astype(np.float64), cl_line, nc_line, gain[wrong]


def _waits(match: Match, vertex: Ints, low: Floats, high: Floats) -> Bools:
    """(k,) whether the text is within the tolerance of original vertices, and of those before them, at one place.

    It waits there while the original goes from one to the other: both are passed in order then. The places are looked
    for between `low` and `high`. On a segment the largest of the distances has one minimum only.
    """
    found = np.zeros(len(vertex), np.bool_)
    for k in range(min(len(vertex), _MOST_VERTICES)):
        first, last = int(low[k]), min(int(np.ceil(high[k])), len(match.six) - 1)
        if last - first > _MOST_VERTICES:
            continue
        start = match.six[first:last]
        way = match.six[first + 1 : last + 1] - start
        theirs = match.path.six[vertex[k] - 1 : vertex[k] + 1]

        def off(share: Floats, start: Floats = start, way: Floats = way, theirs: Floats = theirs) -> Floats:
            away = (start + share[:, None] * way)[:, None] - theirs
            largest: Floats = np.linalg.norm(away.reshape(len(share), 4, 3), axis=2).max(axis=1)
            return largest

        begin, end = np.zeros(len(start)), np.ones(len(start))
        begin[0], end[-1] = low[k] - first, high[k] - (last - 1)
        for _ in range(_HALVINGS):
            left, right = (2.0 * begin + end) / 3.0, (begin + 2.0 * end) / 3.0
            falls = off(right) < off(left)
            begin, end = np.where(falls, left, begin), np.where(falls, end, right)
        found[k] = off((begin + end) / 2.0).min() <= match.tolerance + ARITHMETIC
    return found


def _cost(match: Match, vertex: Ints, free: Floats, bound: Floats, *, forward: bool) -> tuple[Floats, Bools]:
    """Look at original vertices as if the text may not pass them before, or behind, `bound`.

    Returns how much farther it is from them then, mm, and whether it is within the tolerance of them there all the
    same: what it leaves out is no more than a rounding.
    """
    own, six = match.path.six[vertex], match.six
    middle = np.minimum(bound.astype(np.int64), len(six) - 2)
    ends = np.flatnonzero(np.append(np.diff(match.stretch) != 0, True))
    stretch = np.searchsorted(ends, middle)
    first = np.concatenate(([0], ends[:-1] + 1))[stretch]
    last = np.maximum(ends[stretch] - 1, middle)
    # the segment that the bound lies on counts in part, those beyond it whole
    segment, at = nearest_segments(own, six, middle, 0, middle, middle)
    limited = np.maximum(at, bound - middle) if forward else np.minimum(at, bound - middle)
    reached = _on(six, middle + limited)
    best = distance_between(own, reached)
    beyond = middle + (1 if forward else -1)
    there = (beyond <= last) & (beyond >= first)
    low, high = (beyond, np.maximum(last, beyond)) if forward else (np.minimum(first, beyond), beyond)
    rows = np.flatnonzero(there)
    segment, at = nearest_segments(own[rows], six, beyond[rows], _REACH, low[rows], high[rows])
    other = _on(six, segment + at)
    away = distance_between(own[rows], other)
    nearer = away < best[rows]
    reached[rows[nearer]] = other[nearer]
    best[rows] = np.minimum(best[rows], away)
    off = own - reached
    own_way = np.maximum(distance_between(off[:, :3], 0.0), distance_between(off[:, 3:], 0.0))
    comes = own_way <= match.tolerance
    return best - distance_between(own, _on(six, free)), comes


def _on(six: Floats, place: Floats) -> Floats:
    """(k, 6) points of a trail at segment plus fraction."""
    segment = np.clip(place.astype(np.int64), 0, len(six) - 2)
    start = six[segment]
    point: Floats = start + (place - segment)[:, None] * (six[segment + 1] - start)
    return point


def _way(length: Floats, start: Floats, end: Floats) -> Floats:
    """Path length between two places, `length` being that up to every vertex."""
    vertices = np.arange(len(length))
    way: Floats = np.interp(end, vertices, length) - np.interp(start, vertices, length)
    return way
