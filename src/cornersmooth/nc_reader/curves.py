"""Evaluation of rational B-splines from control points, weights and knots as a text gives them (Cox and de Boor)."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Curves


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


def basis_derivative(knot: Floats, order: int, u: Floats, times: int = 1) -> Floats:
    """(k, p) derivatives of the basis functions with respect to u, of first or higher order."""
    if times == 0:
        return basis(knot, order, u)
    points = len(knot) - order
    if order < 2:
        return np.zeros((len(u), points))
    lower = np.pad(basis_derivative(knot[1:-1], order - 1, u, times - 1), ((0, 0), (1, 1)))
    width = knot[order - 1 : order + points] - knot[: points + 1]
    # the quotient with an empty knot interval counts as zero
    share = (order - 1) * np.divide(lower, width, out=np.zeros_like(lower), where=width > 0)
    return share[:, :-1] - share[:, 1:]


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

    def _combine(self, values: Floats, columns: slice = slice(None)) -> Floats:
        """(k, r, 6) sums of the weighted control points with the coefficients (r, p), most of which are zero."""
        own = self._columns[:, columns]
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

    def jet(self, u: float, columns: slice = slice(None)) -> tuple[Floats, Floats, Floats]:
        """Points, first and second derivatives (k, 6) of all curves at one parameter, or some of their columns."""
        at = np.array([u])
        values = np.concatenate([basis_derivative(self.knot, self.order, at, times) for times in range(3)])
        both = self._combine(values, columns)
        point, slope, bend = both[:, 0], both[:, 1], both[:, 2]
        if self.plain:
            return point, slope, bend
        below, fall, curl = (self.weight @ values.T).T[:, :, None]
        point = point / below
        slope = (slope - fall * point) / below
        return point, slope, (bend - curl * point - 2 * fall * slope) / below

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
