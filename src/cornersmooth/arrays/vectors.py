"""Arithmetic of arrays of vectors: the vectors lie along the last axis, whatever stands before it."""

from __future__ import annotations

import numpy as np

from cornersmooth.arrays import Floats


def dot(one: Floats, other: Floats) -> Floats:
    """Scalar products."""
    return np.einsum("...i,...i->...", one, other)


def square(vectors: Floats) -> Floats:
    """Squared lengths."""
    return dot(vectors, vectors)


def norm(vectors: Floats) -> Floats:
    """Lengths."""
    return np.sqrt(dot(vectors, vectors))


def unit(vectors: Floats) -> Floats:
    """Vectors of length one with the same directions; a vector of no length stays as it is."""
    length = norm(vectors)[..., None]
    return vectors / np.where(length > 0.0, length, 1.0)


def angle_between(one: Floats, other: Floats) -> Floats:
    """Angles between vectors, rad; accurate for small angles too."""
    return np.arctan2(norm(np.cross(one, other)), dot(one, other))
