"""Deviations of one batch, in both directions: written vertices from the original, original vertices from the written.

Where both motions run straight between neighbouring vertices of either, their distance is largest at a vertex; so the
vertices of both are all that needs to be looked at. Curves are looked at where they come nearest to a vertex, and
between their knots by `hull_gaps`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.curves import CurveGroup
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.tool import directions, written_at
from cornersmooth.verify.in_order import Windows
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import COLUMNS, Gap, Metric, climb, distance_between, nearest_places
from cornersmooth.verify.polyline import points_on
from cornersmooth.verify.rapids import ARITHMETIC
from cornersmooth.verify.wide_search import look_farther, nearest_alone

#: a Newton step from a knot longer than this part of the parameter range is followed up
_SHORT_STEP = 0.02

#: samples and rounds of the search on single elements
_SAMPLES, _ROUNDS, _ZOOM = 17, 2, 33


@dataclass(frozen=True)
class Reached:
    """What the vertices of one motion find on the other, k rows.

    Parameters
    ----------
    vertex : (k,) int64
        Vertex of the trail they are taken from.
    gap : Gap
    place : (k,) float64
        Where on the other trail: segment plus fraction.
    """

    vertex: Ints
    gap: Gap
    place: Floats


def owner_fraction(trail_owner: Ints, trail_fraction: Floats, segment: Ints, at: Floats) -> tuple[Ints, Floats]:
    """Owner of trail segments, and the fraction of the owner that a fraction of the segment is."""
    owner = trail_owner[segment + 1]
    end = trail_fraction[segment + 1]
    start = np.where(trail_owner[segment] == owner, trail_fraction[segment], 0.0)
    return owner, start + at * (end - start)


@dataclass(frozen=True)
class Distances:
    """How far the vertices of each motion of a match are from the other."""

    match: Match

    @cached_property
    def written(self) -> Reached:
        """Of every written vertex, from the pose of the original where its place is."""
        return from_written(self.match)

    @cached_property
    def original(self) -> Reached:
        """Of every vertex of the original in this batch, from the written motion."""
        return from_original(self.match)

    @cached_property
    def windows(self) -> Windows:
        """Where vertices may be besides the places that were found for them."""
        return Windows(self.match)

    @cached_property
    def off(self) -> Floats:
        """(v,) the larger distance, mm, of every written vertex; 0 for those that belong to no stretch."""
        off = np.zeros(len(self.match.six))
        off[self.written.vertex] = self.written.gap.larger
        return off


def from_written(match: Match) -> Reached:
    """Deviation of every written vertex from the pose of the original it was assigned to."""
    vertex = np.flatnonzero(match.on)
    segment, at = match.segment[vertex], match.fraction[vertex]
    # measured in full where it may matter: the distance in six dimensions is a bound, and of use for the rest
    bound = match.distance[vertex]
    known = bound[np.isfinite(bound)]
    gap = Gap(bound.copy(), bound.copy(), np.zeros(len(vertex)))
    loose = np.flatnonzero(bound > min(match.margin, known.max(initial=0.0) / 2))
    rows = vertex[loose]
    again = loose[~match.nearest[rows]]
    if len(again):
        own = vertex[again]
        segment[again], at[again], _ = nearest_places(
            match.six.take(own, axis=0), match.path.six, segment[again], 1, match.low[own], match.high[own]
        )
    better = _gap_to_original(match, rows, segment[loose], at[loose])
    # where the next is a tiny one, another may be nearer beyond it
    over = np.flatnonzero(better.larger > match.tolerance)
    if len(over):
        own = rows[over]
        segment[loose[over]], at[loose[over]], _ = nearest_places(
            match.six[own], match.path.six, segment[loose[over]], REACH, match.low[own], match.high[own]
        )
        wider = _gap_to_original(match, own, segment[loose[over]], at[loose[over]])
        better.tip[over], better.axis_point[over], better.angle[over] = wider.tip, wider.axis_point, wider.angle
    gap.tip[loose], gap.axis_point[loose], gap.angle[loose] = better.tip, better.axis_point, better.angle
    return Reached(vertex, gap, segment + at)


def _gap_to_original(match: Match, vertex: Ints, segment: Ints, at: Floats) -> Gap:
    original, trail = match.original, match.written.trail
    tip, axis = original.at(*owner_fraction(original.trail.owner, original.trail.fraction, segment, at))
    own = trail.tip.take(vertex, axis=0), trail.axis.take(vertex, axis=0)
    return match.task.gap(*own, tip, axis)


def from_original(match: Match) -> Reached:
    """Deviation of every vertex of the original in this batch from the written motion."""
    vertex, middle, low, high = _brackets(match)
    trail, six = match.original.trail, match.path.six
    point = six.take(vertex, axis=0)
    segment, at, _ = nearest_places(point, match.six, middle, 1, low, high)
    climb(point, match.six, middle, low, high, segment, at)
    look_farther(match, vertex, low, high, segment, at)
    tip = points_on(match.written.trail.tip, segment, at)
    axis = _unit_on(match.written.trail.axis, segment, at)
    owner = match.written.trail.owner[segment + 1]
    bent = np.flatnonzero(~match.written.straight[owner - match.written.first])
    if len(bent):
        tip[bent], axis[bent], at[bent] = _on_bent(match, point.take(bent, axis=0), segment[bent], at[bent])
    gap = match.task.gap(tip, axis, point[:, :3], trail.axis.take(vertex, axis=0))
    return Reached(vertex, gap, segment + at)


def _brackets(match: Match) -> tuple[Ints, Ints, Ints, Ints]:
    """Original vertices of a batch's stretches, the written segment each lies at, and the segments allowed."""
    on = np.flatnonzero(match.on)
    place, stretch = match.place[on], match.stretch[on]
    first = np.flatnonzero(np.diff(stretch, prepend=-1))
    last = np.append(first[1:], len(on)) - 1
    start = np.ceil(place[first]).astype(np.int64)
    stop = np.where(np.arange(len(last)) < len(last) - 1, match.high[on[last]] + 1, np.floor(place[last])).astype(
        np.int64
    )
    if np.isinf(match.until):
        stop[-1] = match.high[on[last[-1]]] + 1
    else:  # up to where the next batch begins, wherever the search has ended
        stop[-1] = max(stop[-1], int(match.until))
    count = np.maximum(stop - start + 1, 0)
    number = np.repeat(np.arange(len(first)), count)
    vertex = np.arange(len(number)) - np.repeat(np.cumsum(count) - count, count) + start[number]
    k = np.clip(np.searchsorted(place, vertex, side="right") - 1, first[number], last[number])
    low, high = on[first[number]], on[last[number]] - 1
    return vertex, np.clip(on[k], low, high), low, high


#: poses of a batch that are looked for on single elements: how many are many, of which those that are far off need no
#: search, with how many tolerances far is; and how many are looked for at a time
_MANY, _FAR_OFF, _SEARCHED_AT_ONCE = 512, 10.0, 4096

#: vectors shorter than this have no direction
_LEAST = 1e-300


def _unit_on(values: Floats, segment: Ints, at: Floats) -> Floats:
    between = points_on(values, segment, at)
    size = np.sqrt(np.einsum("ij,ij->i", between, between))
    between /= np.maximum(size, _LEAST, out=size)[:, None]
    return between


def _on_bent(match: Match, point: Floats, segment: Ints, at: Floats) -> tuple[Floats, Floats, Floats]:
    """Nearest poses (k, 3) and (k, 3) on curves and arcs, from the nearest place on the trail, and that place."""
    nc, trail = match.nc, match.written.trail
    owner = trail.owner[segment + 1]
    vertex = segment + (at > 0.5)
    tip, axis, place = np.empty((len(point), 3)), np.empty((len(point), 3)), at.copy()
    open_rows = np.ones(len(point), np.bool_)
    for group in match.written.curves:
        element = nc.curves.element[group.index]
        for u in group.spans[1:]:
            rows = np.flatnonzero(
                open_rows & (trail.fraction[vertex] == u) & (trail.owner[vertex] == owner) & np.isin(owner, element)
            )
            if not len(rows):
                continue
            curve = np.searchsorted(element, owner[rows])
            found, good = _newton_from_knot(match, group, float(u), curve, point[rows])
            rows = rows[good]
            tip[rows] = found[good, :3]
            axis[rows] = directions(nc, found[good, :3], found[good, 3:])
            open_rows[rows] = False
    rest = np.flatnonzero(open_rows)
    if len(rest) > _MANY:  # of what is far off anyway the polyline tells enough
        tip[rest] = points_on(trail.tip, segment[rest], at[rest])
        axis[rest] = _unit_on(trail.axis, segment[rest], at[rest])
        away = point[rest, :3] - tip[rest]
        near = np.einsum("ij,ij->i", away, away) <= (_FAR_OFF * match.tolerance) ** 2
        rest = rest[near]
    for begin in range(0, len(rest), _SEARCHED_AT_ONCE):
        rows = rest[begin : begin + _SEARCHED_AT_ONCE]
        tip[rows], axis[rows], _ = search_elements(match, owner[rows][:, None], point[rows])
    return tip, axis, place


def _newton_from_knot(
    match: Match, group: CurveGroup, u: float, curve: Ints, point: Floats
) -> tuple[Floats, np.ndarray]:
    """Nearest points (k, 6) of curves to poses near the knot u, by one step; and whether the step was short enough.

    A second point may stand at any distance from the tip: it is brought to that of the axis point first.
    """
    if 2 * len(curve) < len(group.index):
        value, slope, bend = group.only(curve).jet(u)
    else:
        value, slope, bend = (part.take(curve, axis=0) for part in group.jet(u))
    target = point.copy()
    vectors = match.nc.second_is == "vector"
    if vectors:  # of length one
        value, slope, bend = (match.task.six(part[:, :3], part[:, 3:]) for part in (value, slope, bend))
    else:
        share = 1.0 / np.linalg.norm(value[:, 3:] - value[:, :3], axis=1)[:, None]
        value, slope, bend = (
            match.task.six(part[:, :3], share * (part[:, 3:] - part[:, :3])) for part in (value, slope, bend)
        )
    rest = target - value
    size = np.einsum("ij,ij->i", slope, slope) - np.einsum("ij,ij->i", rest, bend)
    step = np.divide(np.einsum("ij,ij->i", rest, slope), size, out=np.full(len(size), np.inf), where=size > 0)
    good = np.abs(step) <= _SHORT_STEP * (group.spans[-1] - group.spans[0])
    step = np.clip(np.where(good, step, 0.0), group.spans[0] - u, group.spans[-1] - u)[:, None]
    found = value + step * slope + step * step / 2 * bend
    if vectors != match.task.own_axis:
        found[:, 3:] += -found[:, :3] if vectors else found[:, :3]
    return found, good


def search_elements(
    match: Match, elements: Ints, point: Floats, column: slice = slice(0, 6)
) -> tuple[Floats, Floats, Floats]:
    """Nearest poses on path elements by sampling and zooming in; for few rows.

    Each element is searched by itself: the chords of one in which the tool turns far may be nearer than it is.

    Parameters
    ----------
    elements : (k, e) int64
        Elements to look at for each row.
    point : (k, 6) float64
    column : slice
        Which of tip and axis point count.

    Returns
    -------
    tip, axis : (k, 3) float64
    distance : (k,) float64
    """
    element = elements.ravel()
    target = np.repeat(point, elements.shape[1], axis=0)[:, None, column]

    def look(place: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Poses at fractions (m, p) of the elements, what counts of them, and their distances."""
        tip, axis = written_at(match.nc, np.repeat(element, place.shape[1]), place.ravel())
        counts = match.task.six(tip, axis).reshape(*place.shape, 6)[..., column]
        off = counts - target
        distance = np.sqrt(np.einsum("...i,...i->...", off, off))
        return tip.reshape(*place.shape, 3), axis.reshape(*place.shape, 3), counts, distance

    grid = np.linspace(0.0, 1.0, _SAMPLES)
    step = grid[1]
    points = look(np.broadcast_to(grid, (len(element), _SAMPLES)))[2]
    share, off = _on_chords(points, target)
    chord = np.argmin(off, axis=1)
    each = np.arange(len(element))
    # only elements go on that are not farther than another of their row by more than both may be off their chords
    least, bend = off[each, chord], np.diff(points, 2, axis=1)
    sag = np.sqrt(np.einsum("kmi,kmi->km", bend, bend).max(axis=1))
    most = (least + sag).reshape(elements.shape).min(axis=1)
    kept = np.flatnonzero(~(least - sag > np.repeat(most, elements.shape[1])))
    row, element, target = kept // elements.shape[1], element[kept], target[kept]
    at = grid[chord[kept]] + share[kept, chord[kept]] * step
    each = np.arange(len(element))
    for _ in range(_ROUNDS):
        place = np.clip(at[:, None] + np.linspace(-step, step, _ZOOM), 0.0, 1.0)
        at = place[each, np.argmin(look(place)[3], axis=1)]
        step *= 2.0 / (_ZOOM - 1)
    ends = np.clip(np.stack((at - step, at + step), axis=1), 0.0, 1.0)  # so close together the motion is straight
    share, _ = _on_chords(look(ends)[2], target)
    tip, axis, _, distance = look(np.hstack((ends[:, :1] + share * np.diff(ends, axis=1), at[:, None])))
    nearer = np.argmin(distance, axis=1)
    distance = distance[each, nearer]
    order = np.lexsort((distance, row))
    best = order[np.diff(row[order], prepend=-1) > 0]  # of each row
    return tip[best, nearer[best]], axis[best, nearer[best]], distance[best]


def _on_chords(points: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Of rows (k, m, d) of points: shares (k, m − 1) of the chords nearest to targets (k, 1, d), and the distances."""
    way = np.diff(points, axis=1)
    size = np.einsum("kmi,kmi->km", way, way)
    from_start = target - points[:, :-1]
    share = np.einsum("kmi,kmi->km", from_start, way)
    share = np.clip(np.divide(share, size, out=np.full(size.shape, 0.5), where=size > 0), 0.0, 1.0)
    off = from_start - share[..., None] * way
    return share, np.sqrt(np.einsum("kmi,kmi->km", off, off))


def _each_alone(reached: Reached, rows: Ints) -> tuple[tuple[Metric, Floats], ...]:
    """Tip and axis point, and how far each is at a common pose, which is never nearer than on its own."""
    return ("tip", reached.gap.tip[rows]), ("axis point", reached.gap.axis_point[rows])


def own_gaps_of_written(match: Match, reached: Reached, rows: Ints) -> tuple[Floats, Floats]:
    """Distance of chosen written vertices from the original tip path, and from its axis-point path, each on its own."""
    vertex = reached.vertex[rows]
    six, segment, low, high = match.six[vertex], match.segment[vertex], match.low[vertex], match.high[vertex]
    trail, original = match.written.trail, match.original
    result = []
    for metric, known in _each_alone(reached, rows):
        near, at, _ = nearest_places(six, match.path.six, segment, REACH, low, high, metric)
        tip, axis = original.at(*owner_fraction(original.trail.owner, original.trail.fraction, near, at))
        gap = match.task.gap(trail.tip[vertex], trail.axis[vertex], tip, axis)
        values = np.minimum(gap.tip if metric == "tip" else gap.axis_point, known)
        result.append(values)
        far = np.flatnonzero(values > match.tolerance + ARITHMETIC)
        if len(far):
            own = six[far], match.path.six, segment[far], low[far], high[far]
            values[far] = np.minimum(values[far], nearest_alone(*own, match.near, metric)[2])
    return result[0], result[1]


#: segments looked at on either side for the distance of tip or axis point alone
REACH = 4


def common_gaps_of_original(match: Match, reached: Reached, rows: Ints) -> Floats:
    """Distance of chosen original vertices from the nearest written pose: the larger one of tip and axis point."""
    segment = np.minimum(reached.place[rows].astype(np.int64), len(match.six) - 2)
    vertex = reached.vertex[rows]
    tip, axis, _ = search_elements(match, elements_around(match, segment), match.path.six[vertex])
    trail = match.original.trail
    gap = match.task.gap(tip, axis, trail.tip[vertex], trail.axis[vertex])
    return np.minimum(gap.larger, reached.gap.larger[rows])


def elements_around(match: Match, segment: Ints, reach: int = REACH) -> Ints:
    """(k, e) element of each segment of the written trail, and `reach` of those beside it on either side."""
    nc, written = match.nc, match.written
    first, last = written.first + 1, written.first + len(written.trail.last) - 1
    owner = written.trail.owner[segment + 1]
    elements = np.clip(owner[:, None] + np.arange(-reach, reach + 1), first, last)
    return np.where(nc.kind[elements] == Element.RAPID, owner[:, None], elements)


def own_gaps_of_original(match: Match, reached: Reached, rows: Ints) -> tuple[Floats, Floats]:
    """Distance of chosen original vertices from the written tip path and axis-point path, each on its own."""
    segment = np.minimum(reached.place[rows].astype(np.int64), len(match.six) - 2)
    ends = np.flatnonzero(np.append(np.diff(match.stretch) != 0, True))
    stretch = np.searchsorted(ends, segment)
    low = np.concatenate(([0], ends[:-1] + 1))[stretch]
    high = np.maximum(ends[stretch] - 1, segment)
    point = match.path.six[reached.vertex[rows]]
    result = []
    for metric, known in _each_alone(reached, rows):
        column = COLUMNS[metric]
        near, at, _ = nearest_places(point, match.six, segment, REACH * match.parts, low, high, metric)
        climb(point, match.six, segment, low, high, near, at, metric)
        elements = elements_around(match, near)
        values = np.minimum(known, distance_between(points_on(match.six, near, at)[:, column], point[:, column]))
        bent = np.flatnonzero(~match.written.straight[elements - match.written.first].all(axis=1))
        if metric == "axis point":  # which runs a little off its chords where the tool turns
            bent = np.arange(len(rows))
        if len(bent):
            away = search_elements(match, elements[bent], point[bent], column=column)[2]
            values[bent] = np.minimum(away, known[bent])
        result.append(values)
        far = np.flatnonzero(values > match.tolerance + ARITHMETIC)
        if not len(far):
            continue
        own = point[far], match.six, segment[far], low[far], high[far]
        there, _, distance = nearest_alone(*own, match.near, metric)
        known_near = np.isfinite(distance)
        far, elements = far[known_near], elements_around(match, there[known_near])
        values[far] = np.minimum(values[far], search_elements(match, elements, point[far], column=column)[2])
    return result[0], result[1]
