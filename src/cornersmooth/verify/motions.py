"""Both motions as polylines with a bound of how far each leaves them: what the theorem is about.

Nothing is put into straight moves that hardly turn the axis, which are nearly all. Arcs, curves and turns get inner
vertices, as many as keep the bend (see `bending`) within a share of the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements
from cornersmooth.nc_reader.tool import directions, groups, written_at
from cornersmooth.verify.bending import arc_bend, curve_bend, turn_bend, wound_bend

#: slack of arithmetic on coordinates that are a million times larger, mm
ARITHMETIC: Final = 1e-9

#: which distance is meant: of tip and axis point together, or of one of them
Metric = Literal["both", "tip", "axis_point"]

#: columns of a row of both that count for each
COLUMNS: Final[dict[Metric, slice]] = {"both": slice(0, 6), "tip": slice(0, 3), "axis_point": slice(3, 6)}

#: points taken at a time, so that the work arrays stay in the cache (speed only)
_BLOCK: Final = 8192

#: bend of what has none, as where the axis turns over, mm: it is not proved and not divided
UNBOUND: Final = 1e9


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A motion as a polyline, v vertices."""

    nc: Elements  #: (m,) what it is made of: the first of them only says where it begins
    axis_length: float  #: mm: H
    own_axis: bool  #: whether the axis points are H times the axis, wherever the tip is
    six: Floats  #: (v, 6) mm: tips and axis points
    owner: Ints  #: (v,): the element that leads to each vertex
    fraction: Floats  #: (v,): where on it, 1 at its end
    last: Ints  #: (m,): vertex at the end of each element
    bend: Floats  #: (v - 1,) mm: of the step to the next vertex

    def __len__(self) -> int:
        return len(self.owner)

    def located(self, place: Floats) -> tuple[Ints, Floats]:
        """(k,) elements at vertex numbers with fractions of the steps behind them, and fractions of the elements."""
        before = place.astype(np.int64)
        after = np.minimum(before + 1, len(self) - 1)
        owner = self.owner[after]
        start = np.where(self.owner[before] == owner, self.fraction[before], 0.0)
        return owner, start + (place - before) * (self.fraction[after] - start)

    def at(self, place: Floats) -> Floats:
        """(k, 6) tips and axis points there."""
        return side_by_side(*written_at(self.nc, *self.located(place)), self.axis_length, self.own_axis)


def motion_of(nc: Elements, axis_length: float, share: float, most: int, *, own_axis: bool) -> Motion:
    """Make the polyline of elements.

    The bends of its parts are at most `share`, mm, but where that takes more than `most` of them in an element, or in
    a curve between its knots.
    """
    how: dict[str, Any] = {"nc": nc, "axis_length": axis_length, "own_axis": own_axis}
    second = nc.second - nc.tip if nc.second_is == "point" else nc.second
    bend = np.zeros(len(nc))
    bend[1:] = axis_length * turn_bend(second[:-1], second[1:])
    bend[nc.kind == Element.RAPID] = 0.0  # the way of a rapid is the machine's
    if len(nc.arcs):
        at = nc.arcs.element
        radius = np.linalg.norm(np.cross(nc.tip[at - 1] - nc.arcs.centre, nc.arcs.normal), axis=1)
        arc = arc_bend(radius, nc.arcs.sweep)
        bend[at] += arc
        if nc.second_is == "point":  # the tip turns the direction, too
            slope = np.linalg.norm(nc.second[at] - nc.second[at - 1], axis=1) + radius * nc.arcs.sweep
            bend[at] = arc + axis_length * wound_bend(second[at - 1], slope, arc)
    bend[:1] = 0.0
    bend = np.minimum(bend, UNBOUND)
    parts = parts_of(bend, share, most)
    step_bend = bend / parts**2
    curved = []
    for group in groups(nc.curves, np.flatnonzero(nc.curves.element > 0)):
        at = nc.curves.element[group.index]
        spans = np.minimum(curve_bend(group, nc.second_is, axis_length), UNBOUND)
        inner = parts_of(spans.max(axis=1, initial=0.0), share, most)
        parts[at] = inner * max(spans.shape[1], 1)
        curved.append((group, at, inner, spans))
    if not len(nc) or parts.max() == 1:
        index = np.arange(len(nc))
        six = side_by_side(nc.tip, directions(nc, nc.tip, nc.second), axis_length, own_axis)
        bends = step_bend[1:].copy()
        for _, at, _, spans in curved:
            bends[at - 1] = spans.max(axis=1, initial=0.0)
        return Motion(**how, six=six, owner=index, fraction=np.broadcast_to(1.0, len(nc)), last=index, bend=bends)
    owner, fraction, last = divided(parts)
    bends = step_bend[owner]
    tip, other = nc.tip.take(owner, axis=0), nc.second.take(owner, axis=0)
    for group, at, inner, spans in curved:
        if not spans.shape[1]:
            continue
        edges = (group.spans - group.spans[0]) / (group.spans[-1] - group.spans[0])
        for number in np.unique(inner).tolist():
            some = np.flatnonzero(inner == number)
            share_of = np.arange(1, number + 1) / number
            u = (edges[:-1, None] + share_of * np.diff(edges)[:, None]).ravel()
            vertex = (last[at[some]] - len(u) + 1)[:, None] + np.arange(len(u))
            fraction[vertex] = u
            bends[vertex] = np.repeat(spans[some], number, axis=1) / number**2
            if len(u) > 1:
                points = group.only(some).at(group.spans[0] + u[:-1] * (group.spans[-1] - group.spans[0]))
                tip[vertex[:, :-1]], other[vertex[:, :-1]] = points[..., :3], points[..., 3:]
    within = np.flatnonzero((fraction < 1.0) & (nc.kind[owner] != Element.CURVE))
    axis = directions(nc, tip, other)
    if len(within):
        tip[within], axis[within] = written_at(nc, owner[within], fraction[within])
    six = side_by_side(tip, axis, axis_length, own_axis)
    return Motion(**how, six=six, owner=owner, fraction=fraction, last=last, bend=bends[1:])


def parts_of(bend: Floats, share: float, most: int) -> Ints:
    """(k,) number of equal parts whose bends are at most `share`; no more than `most`, then they bend more."""
    parts = np.ceil(np.sqrt(np.minimum(bend / share, float(most) ** 2)))
    return np.where(bend < UNBOUND, np.clip(parts, 1, most), 1).astype(np.int64)


def divided(cuts: Ints) -> tuple[Ints, Floats, Ints]:
    """Owner and fraction of every vertex, and each owner's last vertex, for given numbers of parts."""
    last = np.cumsum(cuts) - 1
    owner = np.repeat(np.arange(len(cuts)), cuts)
    part = np.arange(len(owner)) - np.repeat(last + 1 - cuts, cuts) + 1
    return owner, part / np.repeat(cuts, cuts), last


def side_by_side(tip: Floats, axis: Floats, axis_length: float, own_axis: bool) -> Floats:
    """(..., 6) tips and axis points, mm."""
    six = np.empty((*tip.shape[:-1], 6))
    for k in range(3):  # by columns: rows are too short to go along
        six[..., k], other = tip[..., k], axis_length * axis[..., k]
        six[..., 3 + k] = other if own_axis else other + tip[..., k]
    return six


def largest_square(away: Floats) -> Floats:
    """Square (...) of the longest of the triples of vectors (3h, ...)."""
    squares = [np.einsum("i...,i...->...", away[c : c + 3], away[c : c + 3]) for c in range(0, len(away), 3)]
    return np.maximum(*squares) if len(squares) == 2 else np.asarray(squares[0])


def nearest_places(
    point: Floats, vertices: Floats, middle: Ints, reach: int, low: Ints, high: Ints, metric: Metric = "both"
) -> Floats:
    """(k,) nearest places of points (k, 6) on a polyline of vertices (v, 6): segment plus fraction.

    They are looked for `reach` segments on either side of `middle`, from `low` to `high`, all (k,).
    """
    columns = COLUMNS[metric]
    steps = np.array([0, *(sign * k for k in range(1, reach + 1) for sign in (-1, 1))])
    place = np.empty(len(point))
    size = max(_BLOCK // len(steps), 1)
    for begin in range(0, len(point), size):
        part = slice(begin, begin + size)
        j = np.clip(middle[part, None] + steps, low[part, None], high[part, None])
        share, square = on_segments(point[part, None, columns], vertices, j, columns)
        best = np.argmin(square, axis=1)
        each = np.arange(len(j))
        place[part] = j[each, best] + share[each, best]
    return place


def on_segments(own: Floats, vertices: Floats, segment: Ints, columns: slice) -> tuple[Floats, Floats]:
    """Fractions (k, m) of the nearest places of points (k, 1, d) on segments (k, m), and the squared distances."""
    start = vertices.take(segment, axis=0)[..., columns]
    way = vertices.take(segment + 1, axis=0)[..., columns] - start
    away = own - start
    size = np.einsum("...i,...i->...", way, way)
    share = np.einsum("...i,...i->...", away, way)
    np.divide(share, size, out=share, where=size > 0)
    np.clip(share, 0.0, 1.0, out=share)
    away -= share[..., None] * way
    return share, np.einsum("...i,...i->...", away, away)


def digit_errors(nc: Elements, element: Ints, tip: Floats, axis: Floats, axis_length: float) -> tuple[Bools, Floats]:
    """(k,) whether ends of elements name poses exactly, and the larger distance, mm, of tips or of axis points.

    Exactly: every printed number is the pose's, rounded to the printed digits.
    """
    off = nc.tip[element] - tip
    second = nc.second[element]
    near = np.abs(off) <= (nc.tip_step / 2 + nc.tip_room[element] + ARITHMETIC)[:, None]
    exact: Bools = np.logical_and.reduce([*near.T])
    if nc.second_is == "vector":
        side = second - axis
        room = (nc.second_step / 2 + nc.second_room[element] + ARITHMETIC)[:, None]
    else:  # only the direction of the axis point counts, and the tip's own rounding turns it too
        side = second - nc.tip[element]
        side -= np.linalg.norm(side, axis=1)[:, None] * axis
        room = np.sqrt(3) * (nc.second_step + nc.tip_step) / 2 + ARITHMETIC
    exact &= np.logical_and.reduce([*(np.abs(side) <= room).T])
    turned = off + axis_length * (directions(nc, nc.tip[element], second) - axis)
    return exact, np.maximum(np.linalg.norm(off, axis=1), np.linalg.norm(turned, axis=1))
