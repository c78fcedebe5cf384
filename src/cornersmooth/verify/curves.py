"""Evaluation of rational B-splines from control points, weights and knots as a text gives them (Cox and de Boor)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.ncprogram import Curves


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
    points = len(knot) - order
    low, high = knot[order - 1], knot[points]
    u = np.clip(u, low, high)
    inside = np.flatnonzero((knot[:-1] < knot[1:]) & (knot[:-1] >= low) & (knot[1:] <= high))
    if not len(inside):  # all knots equal: no curve, only its first point
        values = np.zeros((len(u), points))
        values[:, 0] = 1.0
        return values
    span = inside[np.clip(np.searchsorted(knot[inside], u, side="right") - 1, 0, len(inside) - 1)]
    values = np.zeros((len(u), len(knot) - 1))
    values[np.arange(len(u)), span] = 1.0
    for degree in range(1, order):
        lower = knot[degree : len(knot) - 1] - knot[: len(knot) - 1 - degree]
        upper = knot[degree + 1 :] - knot[1 : len(knot) - degree]
        left = _ratio(u[:, None] - knot[None, : len(lower)], lower)
        right = _ratio(knot[None, degree + 1 :] - u[:, None], upper)
        values = left[:, : len(upper)] * values[:, : len(upper)] + right * values[:, 1 : len(upper) + 1]
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
    share = (order - 1) * _ratio(lower, width)
    return share[:, :-1] - share[:, 1:]


def _ratio(above: Floats, below: Floats) -> Floats:
    """Quotient where an empty knot interval counts as zero, as the recursion asks for."""
    return np.divide(above, below, out=np.zeros(np.broadcast_shapes(above.shape, below.shape)), where=below > 0)


@dataclass(frozen=True)
class CurveGroup:
    """Curves with the same order and knots, k of them, with p control points each.

    Parameters
    ----------
    index : (k,) int64
        Rows of `Curves`.
    order : int
    knot : (p + order,) float64
    points : (k, p, 6) float64
        Control points of tip and vector or axis point.
    weight : (k, p) float64
    """

    index: Ints
    order: int
    knot: Floats
    points: Floats
    weight: Floats

    @cached_property
    def spans(self) -> Floats:
        """Distinct knots from the start of the curve to its end."""
        return np.unique(self.knot[self.order - 1 : len(self.knot) - self.order + 1])

    @cached_property
    def weighted(self) -> Floats:
        """(k, p, 6) control points times their weights."""
        return self.points * self.weight[:, :, None]

    @cached_property
    def plain(self) -> bool:
        """Whether all weights are one."""
        return bool((self.weight == 1.0).all())

    def at(self, u: Floats) -> Floats:
        """(k, len(u), 6) points of every curve at the same parameters."""
        return self._combine(basis(self.knot, self.order, u))

    def at_own(self, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
        """(r, 6) points and (r, 6) derivatives of the curves `rows`, each at its own parameter."""
        value, slope = basis(self.knot, self.order, u), basis_derivative(self.knot, self.order, u)
        weighted, weight = self.weighted[rows], self.weight[rows]
        below = np.einsum("ri,ri->r", value, weight)[:, None]
        fall = np.einsum("ri,ri->r", slope, weight)[:, None]
        point = np.einsum("ri,rid->rd", value, weighted) / below
        return point, (np.einsum("ri,rid->rd", slope, weighted) - fall * point) / below

    def jet(self, u: float) -> tuple[Floats, Floats, Floats]:
        """Points, first and second derivatives (k, 6) of all curves at one parameter."""
        at = np.array([u])
        values = [basis_derivative(self.knot, self.order, at, times)[0] for times in range(3)]
        point, slope, bend = (np.einsum("i,cid->cd", value, self.weighted) for value in values)
        if self.plain:
            return point, slope, bend
        below, fall, curl = (self.weight @ value for value in values)
        point = point / below[:, None]
        slope = (slope - fall[:, None] * point) / below[:, None]
        return point, slope, (bend - curl[:, None] * point - 2 * fall[:, None] * slope) / below[:, None]

    def bezier(self, k: int) -> tuple[Floats, Floats]:
        """Control points (k, order, 6) and weights (k, order) of the k-th knot interval alone.

        Interpolation in homogeneous coordinates at as many parameters as the order.
        """
        start, stop = self.spans[k], self.spans[k + 1]
        t = (np.arange(self.order) + 0.5) / self.order
        degree = self.order - 1
        i = np.arange(self.order)
        binomial = np.array([_binomial(degree, int(r)) for r in i])
        bernstein = binomial * t[:, None] ** i * (1 - t[:, None]) ** (degree - i)
        convert = np.linalg.solve(bernstein, basis(self.knot, self.order, start + t * (stop - start)))
        weight = self.weight @ convert.T
        return np.einsum("qp,cpd->cqd", convert, self.weighted) / weight[:, :, None], weight

    def _combine(self, values: Floats) -> Floats:
        points: Floats = np.matmul(values, self.weighted)
        if not self.plain:
            points = points / np.matmul(values, self.weight[:, :, None])
        return points


def _binomial(n: int, k: int) -> float:
    result = 1.0
    for step in range(k):
        result = result * (n - step) / (step + 1)
    return result


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
        place = curves.first_point[rows][:, None] + np.arange(points)
        both = np.concatenate((curves.tip[place], curves.second[place]), axis=2)
        yield CurveGroup(rows, order, knots[0], both, curves.weight[place])
        same[same] = alike
        index = index[~same]
