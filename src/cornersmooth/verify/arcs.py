"""Points of circular arcs and helices."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats


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
    radius = radius - _dot(radius, normal)[:, None] * normal
    across = np.cross(normal, radius)

    def turned(angle: Floats) -> Floats:
        moved: Floats = start + (np.cos(angle) - 1)[:, None] * radius + np.sin(angle)[:, None] * across
        return moved

    rest = end - turned(sweep)
    return turned(fraction * sweep) + fraction[:, None] * rest


def arc_fraction(
    point: Floats, start: Floats, end: Floats, centre: Floats, normal: Floats, sweep: Floats, guess: Floats
) -> Floats:
    """(k,) fraction of the sweep nearest to each point, near a guess, between 0 and 1.

    Two Newton steps on the squared distance; the guess is within a few degrees.
    """
    step = 1e-4
    fraction = guess
    for _ in range(3):
        here = arc_points(start, end, centre, normal, sweep, fraction)
        tangent = (
            arc_points(start, end, centre, normal, sweep, fraction + step)
            - arc_points(start, end, centre, normal, sweep, fraction - step)
        ) / (2 * step)
        size = _dot(tangent, tangent)
        move = np.divide(_dot(point - here, tangent), size, out=np.zeros_like(size), where=size > 0)
        fraction = np.clip(fraction + move, 0.0, 1.0)
    return fraction


def _dot(a: Floats, b: Floats) -> Floats:
    product: Floats = np.einsum("ij,ij->i", a, b)
    return product
