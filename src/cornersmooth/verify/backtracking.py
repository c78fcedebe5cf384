"""Whether the path is run in order: no going back that the CL file does not have, even within the tolerance.

Where the original turns round itself, going back along it is what it asks for; so only such stretches count that the
other motion runs through without turning.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Element
from cornersmooth.verify.distances import Distances, Reached, own_gaps_of_original, own_gaps_of_written
from cornersmooth.verify.findings import Findings
from cornersmooth.verify.in_order import MOST_PAIRS, Window, Windows, passage
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import distance_between, foot_share, larger_square, nearest_places
from cornersmooth.verify.polyline import points_on
from cornersmooth.verify.rapids import ARITHMETIC

#: segments looked at on either side
_REACH = 3

#: a stretch whose length is more than so many times the distance of its ends turns
_STRAIGHT = 1.2

#: how many times `Match.near` a vertex is from its path that is on it nowhere, in six dimensions
_OFF = 2.0

#: vertices of a batch that run backwards after which all that seem to are taken to
_MOST_WRONG = 512

#: place on the original, CL line, NC line and mm of each that is found, (k,); None stands for none
Found = tuple[Floats, Ints, Ints, Floats]


def check_backtracking(distances: Distances, found: Findings) -> None:
    """The path must be run in order: CS523."""
    match = distances.match
    mine = written_backwards(match, distances.written, distances.windows)
    mine = mine or written_elsewhere(match, distances.written, distances.windows)
    mine = mine or turned_elsewhere(distances)
    theirs = original_backwards(match, distances.original, distances.windows)
    for places in (mine, theirs):
        if places is not None:
            found.violations.add(523, *places)
    owner = match.written.trail.owner
    lines = (int(match.nc.line[owner[vertex]]) for vertex in distances.windows.unlooked)
    found.unlooked += [(line, "the order of the motion") for line in lines]


def written_backwards(match: Match, written: Reached, windows: Windows) -> Found | None:
    """Written vertices that would fit clearly better before the one in front of them.

    Around each text and path must be in order within what they are off each other there anyway: a piece that is run
    twice is off by nothing and yet out of order, while what is off its path by so much tells only within that how far
    along it it is. Where the path turns back nearby, the tolerance is what counts. Blocks in rotary words may bend: how
    far the tool has come the ends of blocks tell, not what lies between them.
    """
    vertex = written.vertex[match.backward[written.vertex]]
    if not len(vertex):
        return None
    own, path = match.six[vertex], match.path
    segment, at, _ = nearest_places(own, path.six, match.segment[vertex], _REACH, match.low[vertex], match.high[vertex])
    free, held = segment + at, match.place[vertex]
    off = distance_between(own, _on(path.six, free))
    gain = distance_between(own, _on(path.six, held)) - off
    # what is off the path is told by its distance: where along the path it would be nearest says nothing
    wrong = (gain > match.slack) & (free < held) & (off <= _OFF * match.near)
    straight = _way(path.length, free, held) <= _STRAIGHT * distance_between(_on(path.six, held), _on(path.six, free))
    rows = np.flatnonzero(wrong & straight)
    ends = _block_ends(match)
    rows = rows[np.isin(vertex[rows], ends[0])]
    begin = path.length_at(segment[rows], at[rows])
    stop = path.length_at(match.segment[vertex[rows]], match.fraction[vertex[rows]])
    found: list[int] = []
    for row, low, high in zip(rows.tolist(), begin.tolist(), stop.tolist(), strict=True):
        if found and (vertex[row] == vertex[found[-1]] + 1 or len(found) > _MOST_WRONG):
            found.append(row)  # one problem with the vertex before it, or the text is off everywhere
            continue
        if _followed(match, ends, int(vertex[row]), low, high, float(off[row])):
            continue
        window = windows.around(int(vertex[row])) if _turns_back(match, low, high) else None
        if window is None or not window.passed:
            found.append(row)
    return _told(match, vertex[found], gain[found])


def written_elsewhere(match: Match, written: Reached, windows: Windows) -> Found | None:
    """Written vertices far from their places in order, but near the path at another: some are run in a wrong order.

    Unless both motions are in order around them, be it tips and axis points each on their own.

    The amount is how far vertices are from their places.
    """
    away, path = match.distance[written.vertex], match.path
    lost = np.isfinite(away) & (away > np.sqrt(2.0) * match.near) & (written.gap.larger <= match.near)
    rows = np.flatnonzero(lost)
    if not len(rows):
        return None
    ends = _block_ends(match)
    found: list[int] = []
    for row in rows.tolist():
        vertex = int(written.vertex[row])
        if found and (vertex == written.vertex[found[-1]] + 1 or len(found) > _MOST_WRONG):
            found.append(row)
            continue
        if windows.disordered(vertex) is None:
            continue
        place = np.sort([written.place[row], match.place[vertex]])
        low, high = path.length_at(*_segments(path.six, place)).tolist()
        if not _followed(match, ends, vertex, low, high, float(written.gap.larger[row])):
            found.append(row)
    return _told(match, written.vertex[found], away[found])


def turned_elsewhere(distances: Distances) -> Found | None:
    """Blocks along which a path that turns back is not followed in order, be it tips and axis points each on their own.

    Every turn is near the other motion, and so is every vertex; but not one after the other. Where one is not, that is
    said already. Near curves nothing is said.

    The amount is how far the motions are apart in the order of their places.
    """
    match, written, windows = distances.match, distances.written, distances.windows
    away = _apart_in_order(match, written)
    found: list[int] = []
    failed: list[Window] = []
    for row in np.flatnonzero(away > match.tolerance + match.slack).tolist():
        vertex = int(written.vertex[row])
        if any(window.inner[0] <= vertex <= window.inner[1] for window in failed):
            continue  # one problem with what was found there
        window = windows.disordered(vertex)
        if window is None:
            continue
        failed.append(window)
        if not _curved(match, window) and not _left(distances, window):
            found.append(row)
    return _told(match, written.vertex[found], away[found])


def _told(match: Match, vertex: Ints, amount: Floats) -> Found | None:
    """Where written vertices are that are run in a wrong order, if there are any."""
    if not len(vertex):
        return None
    original = match.original
    move = original.trail.owner[match.segment[vertex] + 1]
    nc_line = match.nc.line[match.written.trail.owner[vertex]]
    return match.place[vertex], original.program.line[original.pose[move]], nc_line, amount


def _curved(match: Match, window: Window) -> bool:
    """Whether there are curves in a window: its polyline runs from knot to knot, and tells no order between them."""
    owner = match.written.trail.owner[window.vertex : window.vertex + len(window.low)]
    return bool((match.nc.kind[owner] == Element.CURVE).any())


def _left(distances: Distances, window: Window) -> bool:
    """Whether one of the motions leaves the other in a window, in whatever order."""
    match, (rows, columns) = distances.match, window.low.shape
    limit = match.tolerance + ARITHMETIC
    for reached, own_gaps, first, last in (
        (distances.written, own_gaps_of_written, window.vertex, window.vertex + rows - 1),
        (distances.original, own_gaps_of_original, window.segment, window.segment + columns),
    ):
        inside = (reached.vertex >= first) & (reached.vertex <= last)
        over = np.flatnonzero(inside & (reached.gap.larger > limit))
        if len(over) and max(own.max() for own in own_gaps(match, reached, over)) > limit:
            return True
    return False


def _apart_in_order(match: Match, written: Reached) -> Floats:
    """(k,) how far the motions are apart on the block from each written vertex on, if followed in order of places.

    0 where neither turns back nearby: all that is passed is passed in order there.
    """
    vertex, path = written.vertex, match.path
    away = np.zeros(len(vertex))
    if len(vertex) < 2:
        return away
    place = np.maximum.accumulate(match.place[vertex])
    length = path.length_at(*_segments(path.six, place))
    first, last = int(place[0]), int(np.ceil(place[-1]))
    turns = [path.length[first + 1 + np.flatnonzero(_turns(path.six[first : last + 1]))]]
    turns.append(length[1 + np.flatnonzero(_turns(match.six[vertex]))])
    at = np.concatenate(turns)
    if not len(at):
        return away
    edges = np.zeros(len(vertex) + 1, np.int64)
    np.add.at(edges, np.maximum(np.searchsorted(length, at - 2.0 * match.near) - 1, 0), 1)
    np.add.at(edges, np.searchsorted(length, at + 2.0 * match.near, side="right"), -1)
    rows = np.flatnonzero((np.cumsum(edges)[:-1] > 0)[:-1] & (np.diff(match.stretch[vertex]) == 0))
    away[rows] = np.sqrt(larger_square(match.six[vertex[rows]] - _on(path.six, place[rows])))
    # vertices of the path between the places of a block's ends are passed on it, one after the other
    begin, end = np.floor(place[rows]).astype(np.int64) + 1, np.ceil(place[rows + 1]).astype(np.int64)
    count = np.maximum(end - begin, 0)
    row = np.repeat(rows, count)
    passed = np.arange(count.sum()) + np.repeat(begin - (np.cumsum(count) - count), count)
    start = match.six[vertex[row]]
    way = match.six[vertex[row] + 1] - start
    share = np.maximum.accumulate(row + foot_share(path.six[passed] - start, way)) - row
    np.maximum.at(away, row, np.sqrt(larger_square(path.six[passed] - start - share[:, None] * way)))
    return away


def _turns(six: Floats) -> Bools:
    """(v − 2,) whether a polyline (v, 6) turns back at each inner vertex, at tip or axis point."""
    way = np.diff(six, axis=0)
    back = way[1:] * way[:-1]
    turned: Bools = (back[:, :3].sum(axis=1) < 0.0) | (back[:, 3:].sum(axis=1) < 0.0)
    return turned


def _segments(six: Floats, place: Floats) -> tuple[Ints, Floats]:
    segment = np.clip(place.astype(np.int64), 0, len(six) - 2)
    return segment, place - segment


def _followed(match: Match, ends: tuple[Ints, Floats], vertex: int, low: float, high: float, off: float) -> bool:
    """Whether both are in order from one path length to another within what they are off there (a vertex by `off`)."""
    mine = np.searchsorted(match.stretch[ends[0]], match.stretch[vertex] + np.arange(2))
    beyond = 2.0 * max(off, match.slack)
    first, last = np.searchsorted(ends[1], [low - beyond, high + beyond])
    first, last = max(int(first) - 1, int(mine[0])), min(int(last), int(mine[1]) - 1)
    return _in_order(match, ends[0][first : last + 1])


def _in_order(match: Match, vertex: Ints) -> bool:
    """Whether vertices are in order within what they and the path between them are off each other."""
    place = match.place[vertex[[0, -1]]]
    ends = _on(match.path.six, place)
    inner = slice(int(place[0]) + 1, int(np.ceil(place[1])))
    own, path = match.six[vertex], np.vstack((ends[:1], match.path.six[inner], ends[1:]))
    if len(own) * len(path) > MOST_PAIRS:
        return False
    around = match.path.six[max(inner.start - 1 - _REACH, 0) : inner.stop + 1 + _REACH]
    radius = max(_off(own, around), _off(path, own)) + match.slack / 2.0
    low, _ = passage(own, path, (0.0, len(path) - 1.0), radius)
    return bool((~np.isnan(low)).any(axis=1).all())


def _turns_back(match: Match, low: float, high: float) -> bool:
    """Whether the path turns back near two places (path lengths): which of its turns is meant nobody can tell then."""
    path = match.path
    first, last = np.searchsorted(path.length, [low - 2.0 * match.near, high + 2.0 * match.near])
    way = np.diff(path.six[max(int(first) - 1, 0) : int(last) + 1], axis=0)
    return bool((np.einsum("ij,ij->i", way[1:], way[:-1]) < 0.0).any())


def _off(points: Floats, path: Floats) -> float:
    """Largest distance of points (k, 6) from a path (m + 1, 6)."""
    start, way = path[:-1], path[1:] - path[:-1]
    rest = points[:, None] - start
    away = (rest - foot_share(rest, way)[..., None] * way) ** 2
    return float(np.sqrt(np.maximum(away[..., :3].sum(axis=2), away[..., 3:].sum(axis=2)).min(axis=1).max()))


def _block_ends(match: Match) -> tuple[Ints, Floats]:
    """Vertices (e,) that have a place, but none inside a straight motion of rotary axes, and path lengths there."""
    nc, owner = match.nc, match.written.trail.owner
    following = np.minimum(owner + 1, len(nc.line) - 1)
    inside = (nc.line[following] == nc.line[owner]) & (following > owner)
    inside &= match.written.straight[owner - match.written.first]
    ends = np.flatnonzero(match.on & ~inside if nc.rotary else match.on)
    return ends, match.path.length_at(match.segment[ends], match.fraction[ends])


def original_backwards(match: Match, theirs: Reached, windows: Windows) -> Found | None:
    """Neighbouring original vertices that the text clearly passes in reverse: part of the path, beyond ε, is missing.

    Nothing is, where both are run in order within the tolerance all around.
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
    later = _cost(match, theirs.vertex[falls], here, before, forward=True)
    earlier = _cost(match, theirs.vertex[falls - 1], before, here, forward=False)
    gain = np.minimum(later, earlier)
    wrong = np.flatnonzero(gain > match.slack)
    around = [windows.around(vertex) for vertex in before[wrong].astype(np.int64).tolist()]
    wrong = wrong[np.array([window is None or not window.passed for window in around], np.bool_)]
    if not len(wrong):
        return None
    original, vertex = match.original, theirs.vertex[falls[wrong]]
    cl_line = original.program.line[original.pose[original.trail.owner[vertex]]]
    nc_line = match.nc.line[trail.owner[np.minimum(before[wrong].astype(np.int64) + 1, len(trail) - 1)]]
    return vertex.astype(np.float64), cl_line, nc_line, gain[wrong]


def _cost(match: Match, vertex: Ints, free: Floats, bound: Floats, *, forward: bool) -> Floats:
    """How much farther (k,) the text is from original vertices if it may not pass them before, or behind, `bound`."""
    own, six = match.path.six[vertex], match.six
    middle = np.minimum(bound.astype(np.int64), len(six) - 2)
    ends = np.flatnonzero(np.append(np.diff(match.stretch) != 0, True))
    stretch = np.searchsorted(ends, middle)
    first = np.concatenate(([0], ends[:-1] + 1))[stretch]
    last = np.maximum(ends[stretch] - 1, middle)
    # the segment that the bound lies on counts in part, those beyond it whole
    _, at, _ = nearest_places(own, six, middle, 0, middle, middle)
    limited = np.maximum(at, bound - middle) if forward else np.minimum(at, bound - middle)
    best = distance_between(own, _on(six, middle + limited))
    beyond = middle + (1 if forward else -1)
    low, high = (beyond, np.maximum(last, beyond)) if forward else (np.minimum(first, beyond), beyond)
    rows = np.flatnonzero((beyond <= last) & (beyond >= first))
    _, _, square = nearest_places(own[rows], six, beyond[rows], _REACH, low[rows], high[rows])
    best[rows] = np.minimum(best[rows], np.sqrt(square))
    return best - distance_between(own, _on(six, free))


def _on(six: Floats, place: Floats) -> Floats:
    """(k, 6) points of a trail at segment plus fraction."""
    return points_on(six, *_segments(six, place))


def _way(length: Floats, start: Floats, end: Floats) -> Floats:
    """Path length between two places, `length` being that up to every vertex."""
    vertices = np.arange(len(length))
    way: Floats = np.interp(end, vertices, length) - np.interp(start, vertices, length)
    return way
