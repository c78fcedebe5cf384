"""Taylor polynomials of functions of one parameter, cut after the third order, as arrays of their coefficients.

A series has its orders along the first axis: ``a[k]`` is the k-th derivative over k!. Products, quotients and roots
follow from comparing coefficients (Griewank and Walther, Evaluating Derivatives, ch. 13), so derivatives are exact.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats

#: coefficients of a series: value and three derivatives
ORDERS = 4


def multiply(a: Floats, b: Floats) -> Floats:
    """Product of two series; shapes broadcast behind the first axis, and the shorter series counts."""
    orders = min(len(a), len(b))
    return np.stack([sum(a[i] * b[k - i] for i in range(k + 1)) for k in range(orders)])


def divide(a: Floats, b: Floats) -> Floats:
    """Quotient of two series."""
    found: list[Floats] = []
    for k in range(min(len(a), len(b))):
        rest = a[k] - sum(found[i] * b[k - i] for i in range(k))
        found.append(rest / b[0])
    return np.stack(found)


def root(a: Floats) -> Floats:
    """Square root of a series with a positive value."""
    found: list[Floats] = [np.sqrt(a[0])]
    for k in range(1, len(a)):
        rest = a[k] - sum(found[i] * found[k - i] for i in range(1, k))
        found.append(rest / (2.0 * found[0]))
    return np.stack(found)


def derivative(a: Floats) -> Floats:
    """Series of the derivative, one order shorter."""
    return np.stack([(k + 1) * a[k + 1] for k in range(len(a) - 1)])


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar product of two Taylor series of vectors along the last axis."""
    return multiply(a, b).sum(axis=-1)


def cross(a: Floats, b: Floats) -> Floats:
    """Vector product of two Taylor series of vectors along the last axis."""
    orders = min(len(a), len(b))
    return np.stack([sum(np.cross(a[i], b[k - i]) for i in range(k + 1)) for k in range(orders)])


def normalised(a: Floats) -> Floats:
    """Series of vectors over their lengths."""
    return divide(a, root(dot(a, a))[..., None])


def by_way(a: Floats, speed: Floats) -> tuple[Floats, Floats, Floats]:
    """First three derivatives by the way s of a series in u; infinite where ds/du is zero.

    Parameters
    ----------
    a : (4, m, d) float64
    speed : (3, m) float64
        Series of ds/du.
    """
    found, series = [], a
    with np.errstate(over="ignore", invalid="ignore"):
        for _ in range(3):
            series = divide(derivative(series), speed[: len(series) - 1, :, None])
            found.append(np.where(np.isfinite(series[0]), series[0], np.inf))
    return found[0], found[1], found[2]
