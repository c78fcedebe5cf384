"""How far motions leave their chords at most, proved.

The *bend* of a part of a motion is an eighth of the largest second derivative by the fraction of the part: a motion
leaves its chord by no more than that, and a part of ``1 / n`` of it has ``1 / n²`` of its bend. Here it is in mm, of
tip and axis point alike: the axis point is the tip and H times the tool axis, so its bend is at most the sum of both.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.nc_reader.elements import Second
from cornersmooth.nc_reader.tool import CurveGroup

#: A direction u = v / |v| has |u"| <= |v"| / |v| + (b² + 2 a b) / |v|², where a and b are the parts of v' along v and
#: across it: from v" = |v|" u + 2 |v|' u' + |v| u", where |v|' = a, |v|" = u' v' + u v" and |u'| = b / |v|. And
#: b² + 2 a b is at most this number times |v'|²: the larger eigenvalue of the form.
_GOLDEN: Final = (1.0 + math.sqrt(5.0)) / 2.0


def turn_bend(start: Floats, end: Floats) -> Floats:
    """(k,) bend, without unit, of the directions of vectors that run straight from `start` to `end`, (k, 3).

    Directions that run evenly along the great circle bend less. It is inf where the way leads through zero.
    """
    way = end - start
    size = np.einsum("ij,ij->i", way, way)
    foot = np.clip(-np.einsum("ij,ij->i", start, way) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
    nearest = start + foot[:, None] * way
    least = np.einsum("ij,ij->i", nearest, nearest)
    return np.divide(_GOLDEN / 8.0 * size, least, out=np.where(size > 0.0, np.inf, 0.0), where=least > 0.0)


def wound_bend(start: Floats, slope: Floats, bend: Floats) -> Floats:
    """(k,) bend of the directions of vectors (k, 3) that change by at most `slope`, and bend by `bend`."""
    least = np.linalg.norm(start, axis=1) - slope
    safe = np.where(least > 0.0, least, 1.0)
    return np.where(least > 0.0, bend / safe + _GOLDEN / 8.0 * (slope / safe) ** 2, np.inf)


def arc_bend(radius: Floats, sweep: Floats) -> Floats:
    """(k,) bend of arcs, and of helices, in the unit of the radius; the sweep in rad."""
    return radius * sweep * sweep / 8.0


def curve_bend(group: CurveGroup, second: Second, axis_length: float) -> Floats:
    """(k, s) bend, mm, of rational curves between their knots, each of s intervals.

    In each interval a curve is N / w, and its control points there and their divided differences bound N, w and their
    derivatives. Seen from a point c in the middle it is c + N / w with |N / w| <= R, so with the least weight w0

        |P'| <= (|N'| + |w'| R) / w0,    |P"| <= (|N"| + |w"| R + 2 |w'| |P'|) / w0.

    The direction of the tool does not depend on the weights.
    """
    # each number of all curves side by side: the fastest
    points, weight = np.ascontiguousarray(group.points.transpose(1, 2, 0)), np.ascontiguousarray(group.weight.T)
    tip, other = points[:, :3], points[:, 3:]
    vector = other - tip if second == "point" else other
    vector = vector if group.plain else vector * weight[:, None]
    bends = []
    for start in group.spans[:-1]:
        stop = int(np.searchsorted(group.knot, start, side="right"))  # the knot that ends the interval
        own, knots = slice(stop - group.order, stop), group.knot[stop - group.order + 1 : stop + group.order - 1]
        bend = _point_bend(tip[own], weight[own], knots) + axis_length * _direction_bend(vector[own], knots)
        bends.append(bend)
    return np.stack(bends, axis=1) if bends else np.zeros((len(group.index), 0))


def _point_bend(points: Floats, weight: Floats, knots: Floats) -> Floats:
    """(k,) bend of rational curves with control points (d + 1, 3, k) and weights (d + 1, k) in one interval."""
    if not np.ptp(weight):
        one: Floats = _derivatives(points, knots)[1] / 8.0
        return one
    away = points - points.mean(axis=0)
    reach = _largest(away)
    first, second = _derivatives(away * weight[:, None], knots)
    least = weight.min(axis=0)
    fall, curl = _derivatives(weight[:, None], knots)
    slope = (first + fall * reach) / least
    bend: Floats = (second + curl * reach + 2.0 * fall * slope) / least / 8.0
    return np.where(least > 0.0, bend, np.inf)


def _direction_bend(vector: Floats, knots: Floats) -> Floats:
    """(k,) bend of the directions of curves with control points (d + 1, 3, k) in one interval."""
    middle = vector.mean(axis=0)
    middle /= np.maximum(np.sqrt(np.einsum("ik,ik->k", middle, middle)), np.finfo(np.float64).tiny)
    least = np.einsum("jik,ik->jk", vector, middle).min(axis=0)  # the curve is in the hull of its control points
    first, second = _derivatives(vector, knots)
    safe = np.where(least > 0.0, least, 1.0)
    return np.where(least > 0.0, (second / safe + _GOLDEN * (first / safe) ** 2) / 8.0, np.inf)


def _derivatives(points: Floats, knots: Floats) -> tuple[Floats, Floats]:
    """(k,) bounds of the first and second derivative, by the fraction of an interval, of curves (d + 1, n, k) there.

    They are curves of lower degree, whose control points are divided differences. The knots (2 d,) are those around the
    interval, in their middle.
    """
    degree = len(points) - 1
    if degree == 0:  # one control point, of a curve that is refused already
        return np.zeros(points.shape[2]), np.zeros(points.shape[2])
    width = knots[degree] - knots[degree - 1]
    first = np.diff(points, axis=0) * (degree * width / (knots[degree:] - knots[:degree]))[:, None, None]
    share = (degree - 1) * width / (knots[degree:-1] - knots[1:degree])
    return _largest(first), _largest(np.diff(first, axis=0) * share[:, None, None])


def _largest(vectors: Floats) -> Floats:
    """(k,) the largest size of vectors (d, n, k)."""
    return np.sqrt(np.einsum("jik,jik->jk", vectors, vectors).max(axis=0, initial=0.0))
