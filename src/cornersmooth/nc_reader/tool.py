"""Where the tool is on the elements of a text, where it points there, and whether a rapid moves it.

Arcs go by centre, axis and sweep. Curves are rational B-splines by their control points, weights and knots (Cox and de
Boor).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cornersmooth.control.words import Table
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Curves, Element, Elements, Problem

#: of circles in G17, G18, G19
_PLANE_NORMAL = {17: (0.0, 0.0, 1.0), 18: (0.0, 1.0, 0.0), 19: (1.0, 0.0, 0.0)}
#: rad: an arc about a centre that ends where it begins goes round once
_FULL_TURN = 2 * np.pi

#: how much the distances of both ends from the centre may differ: more is an alarm on most controls
_UNLIKE = 0.01


def circles(
    table: Table, before: Floats, end: Floats, counterclockwise: Bools, plane: int, problems: list[Problem]
) -> tuple[Floats, Floats, Floats]:
    """Circles of G2 and G3 by radius R or by centre I J K, in units of the text, in the plane 17, 18 or 19.

    `problems` takes CS520, an arc that does not reach its end, or whose ends are not as far from its centre.

    Returns
    -------
    centre, normal : (k, 3) float64
    sweep : (k,) float64
    """
    upright = np.array(_PLANE_NORMAL[plane])
    sense = np.where(counterclockwise, 1.0, -1.0)
    chord = end - before
    chord -= (chord @ upright)[:, None] * upright
    length = np.linalg.norm(chord, axis=1)
    across = cross(upright, chord)
    radius = table.column("R")
    by_radius = ~np.isnan(radius)
    half = np.divide(length, 2 * np.abs(radius), out=np.ones_like(length), where=by_radius & (radius != 0))
    # by so much of the radius a half circle may be missed because of printed digits
    slack = np.maximum(1e-6, np.divide(1e-3, np.abs(radius), out=np.zeros_like(length), where=radius != 0))
    for k in np.flatnonzero(by_radius & ((length == 0) | (half > 1 + slack))).tolist():
        text = f"an arc of radius {radius[k]:g} does not reach its end"
        problems.append(Problem("CS520", 0, int(table.line[k]), text))
    rise = np.sqrt(np.maximum(1 - half**2, 0)) * np.abs(np.nan_to_num(radius)) * np.sign(np.nan_to_num(radius))
    towards = np.divide(across, length[:, None], out=np.zeros_like(across), where=length[:, None] > 0)
    centre = before + chord / 2 + (sense * rise)[:, None] * towards
    offsets = np.stack([np.nan_to_num(table.column(letter)) for letter in "IJK"], axis=1)
    offsets -= (offsets @ upright)[:, None] * upright
    centre = np.where(by_radius[:, None], centre, before + offsets)
    first = np.linalg.norm(offsets, axis=1)
    last = np.linalg.norm(chord - offsets, axis=1)
    for k in np.flatnonzero(~by_radius & ((first == 0) | (np.abs(first - last) > _UNLIKE))).tolist():
        text = f"an arc about a centre {first[k]:g} from where it begins and {last[k]:g} from where it ends"
        problems.append(Problem("CS520", 0, int(table.line[k]), text))
    normals = sense[:, None] * upright
    return centre, normals, _sweep(before - centre, end - centre, normals, by_radius)


def _sweep(start: Floats, end: Floats, normal: Floats, by_radius: Bools) -> Floats:
    """Angle from start to end, right-handed about the normals; a full turn for a centre form that comes back."""
    sine = np.einsum("ij,ij->i", cross(start, end), normal)
    flat = start - np.einsum("ij,ij->i", start, normal)[:, None] * normal
    cosine = np.einsum("ij,ij->i", flat, end)
    angle = np.arctan2(sine, cosine) % _FULL_TURN
    return np.where(~by_radius & (angle == 0), _FULL_TURN, angle)


def arc_points(start: Floats, end: Floats, centre: Floats, normal: Floats, sweep: Floats, fraction: Floats) -> Floats:
    """Points of arcs at given fractions of their sweep.

    Parameters
    ----------
    start, end, centre, normal : (k, 3) float64
        The axis of each arc goes through `centre` along the unit vector `normal`.
    sweep : (k,) float64, rad
        Right-handed about `normal`.
    fraction : (k,) float64

    Returns
    -------
    (k, 3) float64
        What start, sweep and end contradict each other by (height of a helix, printed digits) grows evenly.
    """
    radius = start - centre
    radius = radius - np.einsum("ij,ij->i", radius, normal)[:, None] * normal
    across = cross(normal, radius)

    def turned(angle: Floats) -> Floats:
        return start + (np.cos(angle) - 1)[:, None] * radius + np.sin(angle)[:, None] * across

    rest = end - turned(sweep)
    return turned(fraction * sweep) + fraction[:, None] * rest


def basis(knot: Floats, order: int, u: Floats) -> Floats:
    """Values of all B-spline basis functions.

    Parameters
    ----------
    knot : (p + order,) float64
        Non-decreasing.
    order : int
        Degree plus one.
    u : (k,) float64
        Parameters; what lies outside the curve is taken to its nearer end.

    Returns
    -------
    (k, p) float64
        Rows sum to one.
    """
    points, degree = len(knot) - order, order - 1
    low, high = knot[degree], knot[points]
    u = np.clip(u, low, high)
    inside = np.flatnonzero((knot[:-1] < knot[1:]) & (knot[:-1] >= low) & (knot[1:] <= high))
    values = np.zeros((len(u), points))
    if not len(inside):  # all knots equal: no curve, only its first point
        values[:, 0] = 1.0
        return values
    span = inside[np.clip(np.searchsorted(knot[inside], u, side="right") - 1, 0, len(inside) - 1)]
    # only the functions `span - degree` to `span` are not zero there; those of a degree are made of those below
    away = knot[span + np.arange(1 - degree, order)[:, None]] - u
    own = [np.ones(len(u))]
    for k in range(1, order):
        rest = np.zeros(len(u))
        for r in range(k):
            above, below = away[degree + r], away[degree - k + r]
            share = own[r] / (above - below)
            own[r] = rest + above * share
            rest = -below * share
        own.append(rest)
    rows = np.arange(len(u))
    for r, column in enumerate(own):
        values[rows, span - degree + r] = column
    return values


@dataclass(frozen=True)
class CurveGroup:
    """Curves with the same order and knots, k of them, with p control points each."""

    index: Ints  #: (k,): rows of `Curves`
    order: int
    knot: Floats  #: (p + order,)
    points: Floats  #: (k, p, 6): control points of tip and vector or axis point
    weight: Floats  #: (k, p)

    @cached_property
    def spans(self) -> Floats:
        """Distinct knots from the start of the curve to its end."""
        return np.unique(self.knot[self.order - 1 : len(self.knot) - self.order + 1])

    @cached_property
    def weighted(self) -> Floats:
        """(k, p, 6) control points times their weights."""
        return self.points if self.plain else self.points * self.weight[:, :, None]

    @cached_property
    def _columns(self) -> Floats:
        """(p, 6, k) the same, each number of all curves side by side: so they are added fastest."""
        return np.ascontiguousarray(self.weighted.transpose(1, 2, 0))

    @cached_property
    def plain(self) -> bool:
        """Whether all weights are one."""
        return bool((self.weight == 1.0).all())

    def at(self, u: Floats) -> Floats:
        """(k, len(u), 6) points of every curve at the same parameters."""
        values = basis(self.knot, self.order, u)
        points = self._combine(values)
        if not self.plain:
            points /= (self.weight @ values.T)[:, :, None]
        return points

    def _combine(self, values: Floats) -> Floats:
        """(k, r, 6) sums of the weighted control points with the coefficients (r, p), most of which are zero."""
        own = self._columns
        result = np.zeros((len(values), *own.shape[1:]))
        for r, p in zip(*np.nonzero(values), strict=True):
            result[r] += values[r, p] * own[p]
        return result.transpose(2, 0, 1)

    def at_own(self, rows: Ints, u: Floats) -> Floats:
        """(r, 6) points of the curves `rows`, each at its own parameter."""
        value = basis(self.knot, self.order, u)
        point: Floats = np.einsum("ri,rid->rd", value, self.weighted[rows])
        if not self.plain:
            point /= np.einsum("ri,ri->r", value, self.weight[rows])[:, None]
        return point

    def bezier(self, k: int) -> tuple[Floats, Floats]:
        """Control points (k, order, 6) and weights (k, order) of the k-th knot interval alone.

        Interpolation in homogeneous coordinates at as many parameters as the order.
        """
        start, stop = self.spans[k], self.spans[k + 1]
        t = (np.arange(self.order) + 0.5) / self.order
        nodes = basis(self.knot, self.order, start + t * (stop - start))
        convert: Floats = np.linalg.solve(bernstein(self.order, t), nodes).astype(np.float64)
        weight = self.weight @ convert.T
        return self._combine(convert) / weight[:, :, None], weight

    def only(self, rows: Ints | NDArray[np.bool_]) -> CurveGroup:
        """Some of the curves."""
        return CurveGroup(self.index[rows], self.order, self.knot, self.points[rows], self.weight[rows])


def bernstein(order: int, t: Floats) -> Floats:
    """(len(t), order) Bernstein polynomials."""
    i = np.arange(order)
    binomial = np.array([float(math.comb(order - 1, k)) for k in range(order)])
    return binomial * t[:, None] ** i * (1 - t[:, None]) ** (order - 1 - i)


def groups(curves: Curves, index: Ints) -> Iterator[CurveGroup]:
    """Curves `index`, ascending, by order and knots."""
    while len(index):
        head = index[0]
        order, points = int(curves.order[head]), int(curves.points[head])
        same = (curves.order[index] == order) & (curves.points[index] == points)
        rows = index[same]
        knots = curves.knot[curves.first_knot[rows][:, None] + np.arange(order + points)]
        alike = (knots == knots[0]).all(axis=1)
        rows = rows[alike]
        place = curves.first_point[rows]
        if len(rows) and place[-1] - place[0] == (len(rows) - 1) * points and (np.diff(place) == points).all():
            part = slice(int(place[0]), int(place[-1]) + points)  # one after another: no copy
            control, weight = curves.point[part], curves.weight[part]
        else:
            several = (place[:, None] + np.arange(points)).ravel()
            control, weight = curves.point[several], curves.weight[several]
        yield CurveGroup(rows, order, knots[0], control.reshape(-1, points, 6), weight.reshape(-1, points))
        same[same] = alike
        index = index[~same]


def unit(vectors: Floats) -> Floats:
    """Vectors (k, 3) at length one; zero stays zero."""
    length = np.sqrt(np.einsum("ij,ij->i", vectors, vectors))
    some = length > 0
    found = vectors / np.where(some, length, 1.0)[:, None]
    found[~some] = 0.0
    return found


def cross(one: Floats, other: Floats) -> Floats:
    """Vector products: those of ``np.cross``, bit by bit, in a quarter of its time for a few vectors."""
    (a, b, c), (x, y, z) = ((vectors[..., 0], vectors[..., 1], vectors[..., 2]) for vectors in (one, other))
    found = np.empty(np.broadcast_shapes(one.shape, other.shape))
    found[..., 0], found[..., 1], found[..., 2] = b * z - c * y, c * x - a * z, a * y - b * x
    return found


def directions(nc: Elements, tip: Floats, second: Floats) -> Floats:
    """Unit tool vectors (k, 3) of written poses."""
    return unit(second - tip if nc.second_is == "point" else second)


def between(values: Floats, start: Ints, end: Ints, fraction: Floats) -> Floats:
    """Rows (k, 3) of a table on the way from some of its rows to others."""
    first = values.take(start, axis=0)
    way = values.take(end, axis=0)
    way -= first
    way *= fraction[:, None]
    way += first
    return way


def written_at(nc: Elements, element: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Tip and unit axis (k, 3) on path elements, at a fraction of each (curves: of the range of their parameter)."""
    before, kind = np.maximum(element - 1, 0), nc.kind[element]
    on = np.flatnonzero(kind == Element.CURVE)
    if len(on) == len(element):
        tip, second = np.empty((len(on), 3)), np.empty((len(on), 3))
    else:
        tip, second = between(nc.tip, before, element, fraction), between(nc.second, before, element, fraction)
    arc = np.flatnonzero(kind == Element.ARC)
    if len(arc):
        arcs, start, end = nc.arcs, nc.tip[before[arc]], nc.tip[element[arc]]
        r = np.searchsorted(arcs.element, element[arc])
        tip[arc] = arc_points(start, end, arcs.centre[r], arcs.normal[r], arcs.sweep[r], fraction[arc])
    row = np.searchsorted(nc.curves.element, element[on])
    for group in groups(nc.curves, np.unique(row)) if len(on) else ():  # curves with the same knots
        chosen = np.isin(row, group.index)
        mine, local = on[chosen], np.searchsorted(group.index, row[chosen])
        point = group.at_own(local, group.spans[0] + fraction[mine] * (group.spans[-1] - group.spans[0]))
        tip[mine], second[mine] = point[:, :3], point[:, 3:]
    return tip, directions(nc, tip, second)


def moving_rapids(nc: Elements, first: int, stop: int) -> Ints:
    """Elements from `first` (at least 1) to `stop` (excluded) that are rapid and move the tool."""
    index = np.flatnonzero(nc.kind[first:stop] == Element.RAPID) + first
    ways = (values[index] - values[index - 1] for values in (nc.tip, nc.second))
    return index[leads_somewhere(nc, *ways)]


def leads_somewhere(nc: Elements, way: Floats, turn: Floats) -> Bools:
    """Whether motions (k, 3) of the tip and of the second point or vector are any.

    Two pairs of rotary angles that hold the tool alike do so up to the digits that are printed.
    """
    turned: Bools = np.abs(turn).max(axis=1) > (nc.second_step if nc.rotary else 0.0)
    moved: Bools = beyond_digits(nc, way) if nc.rotary else np.abs(way).max(axis=1) > 0.0
    return moved | turned


def beyond_digits(nc: Elements, way: Floats) -> Bools:
    """Whether ways (k, 3) of the tip are longer than printed digits show, which may be those of turned axes."""
    large = np.linalg.norm(way, axis=1) / np.sqrt(3) if nc.rotary else np.abs(way).max(axis=1)
    return large > 1.01 * nc.tip_step
