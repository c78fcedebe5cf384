"""Coordinate systems that positions are given in, and the way from one into another."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats

Vector = tuple[float, float, float]

#: by how much axes may miss length 1 and right angles: what four printed decimals leave
TOLERANCE: Final = 1e-3


@dataclass(frozen=True, slots=True)
class System:
    """A coordinate system, seen from another one."""

    axes: Floats  #: (3, 3): its X, Y and Z axes as columns, orthonormal
    origin: Floats  #: (3,)

    def points(self, points: Floats) -> Floats:
        """Points (n, 3) of this system, in the other one."""
        return points @ self.axes.T + self.origin

    def vectors(self, vectors: Floats) -> Floats:
        """Vectors (n, 3) of this system, in the other one."""
        return vectors @ self.axes.T

    def seen_from(self, other: System) -> System:
        """Return this system as it is seen from another one, both seen from the same."""
        return System(other.axes.T @ self.axes, other.axes.T @ (self.origin - other.origin))

    def point(self, point: Vector) -> Vector:
        """One point of this system, in the other one."""
        x, y, z = self.points(np.array([point]))[0].tolist()
        return x, y, z

    def vector(self, vector: Vector) -> Vector:
        """One vector of this system, in the other one."""
        x, y, z = self.vectors(np.array([vector]))[0].tolist()
        return x, y, z


IDENTITY: Final = System(np.eye(3), np.zeros(3))


def from_numbers(values: list[float]) -> System | None:
    """Return the system of origin, X axis and Y axis; None where the axes are not orthonormal.

    Parameters
    ----------
    values : list of 9 float
        As NX writes MSYS: ox,oy,oz, x1,x2,x3, y1,y2,y3.
    """
    if len(values) != 9:
        return None
    origin, x, y = np.array(values).reshape(3, 3)
    if max(abs(x @ x - 1), abs(y @ y - 1), abs(x @ y)) > TOLERANCE:
        return None
    x = x / np.linalg.norm(x)
    z = np.cross(x, y)
    z = z / np.linalg.norm(z)
    return System(np.stack((x, np.cross(z, x), z), axis=1), origin)
