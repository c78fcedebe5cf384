"""Finished programs in many short lines, as users have them: reliefs, moulds, carvings; made here, of no customer."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, partial

import numpy as np

HEAD = "%\nO1\nG21 G90 G94 G17 G40 G49 G80\nG54 G0 X0. Y0.\nZ20.\n"
Curve = Callable[[np.ndarray], np.ndarray]


def chords(curve: Curve, first: float, last: float, tolerance: float) -> np.ndarray:
    """Vertices on a curve whose chords leave it by at most so much, about."""
    t = np.linspace(first, last, 4001)
    at = curve(t)
    kept = [0]
    while kept[-1] < len(t) - 1:
        i, j = kept[-1], kept[-1] + 1
        while j < len(t) - 1:
            way, gone = at[j + 1] - at[i], at[i : j + 2] - at[i]
            along = gone @ way / (way @ way)
            if ((gone - along[:, None] * way) ** 2).sum(axis=1).max() > tolerance**2:
                break
            j += 1
        kept.append(j)
    return at[kept]


def cut(places: np.ndarray, digits: int = 3) -> str:
    """Cuts through places, with all words."""
    return "".join(f"X{x:.{digits}f} Y{y:.{digits}f} Z{z:.{digits}f}\n" for x, y, z in places)


def program(parts: list[np.ndarray], *, along: bool = False) -> str:
    """Program that cuts parts one after another, from above each, or `along` in one run."""
    text = HEAD
    for k, part in enumerate(parts):
        x, y, z = part[0]
        if not (along and k):
            text += f"G0 Z20.\nX{x:.3f} Y{y:.3f}\nG1 Z{z:.3f} F300.\n"
        text += cut(part)
    return text + "G0 Z20.\nM30\n%\n"


def relief(rows: int = 4, step: float = 0.1) -> str:
    """Lines over a surface, in even steps."""
    x = np.arange(0.0, 12.0, step)
    parts = []
    for k in range(rows):
        z = -2 + np.sin(0.9 * x + k / 5) + 0.6 * np.exp(-((x - 6) ** 2))
        parts.append(np.column_stack((x, np.full_like(x, k / 4), z))[:: -1 if k % 2 else 1])
    return program(parts, along=True)


def mould(turn: float = 0.0, tolerance: float = 0.002) -> str:
    """Lines over a pocket with a flat floor, whose ends follow its chord tolerance; turned about Z, in degrees."""
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))

    def row(q: float) -> Curve:
        return lambda t: np.column_stack(
            (c * t - s * q, s * t + c * q, np.maximum(-6 + 4 * np.exp(-((t - 8 - q) ** 2) / 20), -5.2))
        )

    return program([chords(row(q), 0.0, 16.0, tolerance) for q in (0.0, 0.3, 0.6)], along=True)


def carving() -> str:
    """Rings, some with a depth that changes, and an outline with corners."""
    parts = []
    for k, radius in enumerate((2.0, 5.0, 8.0)):
        parts.append(
            chords(
                lambda t, r=radius, k=k: np.column_stack(
                    (20 * k + r * np.cos(t), 0.7 * r * np.sin(t), -1 - 0.3 * k * np.cos(2 * t))
                ),
                0.0,
                2 * np.pi,
                0.002,
            )
        )
        parts.append(np.array([(0, 0, -1), (5, 0, -1), (5, 3, -1), (2, 3, -1), (2, 8, -1), (0, 8, -1)], float) + 9 * k)
    return program(parts)


def fine() -> str:
    """Steps so short that the digits bend it."""
    t = np.arange(0.0, 12.0, 0.02)
    return program([np.column_stack((t, 3 * np.sin(0.3 * t), -1 - 0.5 * np.cos(0.5 * t)))])


_PROGRAMS: dict[str, Callable[[], str]] = {
    "relief": relief,
    "coarse relief": partial(relief, step=0.6),
    "mould": mould,
    "mould, turned": partial(mould, 30.0),
    "mould, coarse": partial(mould, tolerance=0.01),
    "carving": carving,
    "fine": fine,
}
NAMES = tuple(_PROGRAMS)


@cache
def made(name: str) -> str:
    """The program of a name."""
    return _PROGRAMS[name]()
