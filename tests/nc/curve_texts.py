"""Second points beside the tip in the written text: curves and lines read with scipy's splines, and places on them.

Nothing here is shared with the program, nor with the strict readers of `nc.grammars`.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import BSpline

from oracle.chains import Chain
from oracle.motion import unit

FORMS = {"fanuc": ("g6.2", "XYZUVW"), "siemens": ("bspline", ("X", "Y", "Z", "XH=", "YH=", "ZH="))}
H = 10.0
#: pieces of a segment of the original
PARTS = 60


@dataclass(frozen=True)
class Stretch:
    """A written curve, or a line as a curve of degree 1: knots and control points (k, 6)."""

    knots: np.ndarray
    points: np.ndarray
    degree: int

    def __call__(self, shares: np.ndarray) -> np.ndarray:
        low, high = self.knots[0], self.knots[-1]
        return BSpline(self.knots, self.points, self.degree)(low + shares * (high - low))


def stretches(text: str, control: str) -> list[list[Stretch]]:
    """Feed motion between rapids."""
    words = FORMS[control][1]
    held = dict.fromkeys(words, np.nan)
    runs: list[list[Stretch]] = []
    position, knots, points, intervals = np.full(6, np.nan), [], [], []

    def close() -> None:
        nonlocal knots, points, intervals
        if control == "siemens" and points:
            first = [i for i, step in enumerate(intervals[1:], 1) if step == 0 and intervals[i - 1] == 0]
            for begin, end in zip([0, *first], [*first, len(intervals)], strict=True):
                own = points[begin : end + 1]  # the first control point is where the block before ended
                inner = np.concatenate(([0.0] * 3, np.cumsum(intervals[begin:end])))
                runs[-1].append(Stretch(np.append(inner, [inner[-1]] * 2)[: len(own) + 4], np.array(own), 3))
        elif points:
            runs[-1].append(Stretch(np.array(knots), np.array(points), 3))
        knots, points, intervals = [], [], []

    for line in text.splitlines():
        if "G28" in line or "SUPA" in line:  # a place of the machine
            continue
        numbers = {word: re.search(rf"(?:^|\s){re.escape(word)}(-?[\d.]+)", line) for word in words}
        curve = (
            re.search(r"\bPL=([\d.]+)", line) if control == "siemens" else re.match(r"(?:G6\.2 P4 )?K([\d.]+)", line)
        )
        if line.startswith("G6.2"):
            close()
        if curve and control == "fanuc":
            knots.append(float(curve[1]))
        if not any(numbers.values()):
            if not curve:
                close()
            continue
        held |= {word: float(found[1]) for word, found in numbers.items() if found}
        here = np.array(list(held.values()))
        if curve:
            if control == "siemens":
                points = points or [position]
                intervals.append(float(curve[1]))
            points.append(here)
        else:
            close()
            if line.startswith("G0 ") or not runs:
                runs.append([])
            elif not np.isnan(position).any():
                runs[-1].append(Stretch(np.array([0.0, 0, 1, 1]), np.array([position, here]), 1))
        position = here
    close()
    return [run for run in runs if run]


def farthest(places: np.ndarray, path: np.ndarray) -> float:
    """Largest distance of places (m, d) from a polyline (n, d), each piece looked at by all places."""
    best = np.full(len(places), np.inf)
    for first in range(0, len(path) - 1, 50):
        start, end = path[:-1][first : first + 50], path[1:][first : first + 50]
        way, size = end - start, np.square(end - start).sum(axis=1)
        # (start + share way - place)² from scalar products alone would lose the digits: differences, then products
        arm = places[:, None] - start
        share = np.clip(np.einsum("mnd,nd->mn", arm, way) / np.where(size > 0, size, 1.0), 0, 1)
        arm -= share[..., None] * way
        best = np.minimum(best, np.einsum("mnd,mnd->mn", arm, arm).min(axis=1))
    return float(np.sqrt(best.max()))


def dense(stretch: Stretch) -> tuple[np.ndarray, np.ndarray]:
    """Tips and points at H on the axis, closely."""
    six = stretch(np.linspace(0, 1, 8 * max(4, len(stretch.points))))
    return six[:, :3], six[:, :3] + H * unit(six[:, 3:] - six[:, :3])


def original(chain: Chain) -> np.ndarray:
    """Points at H on the axis of the ruled motion, closely."""
    axis, share = unit(chain.axis), np.linspace(0, 1, PARTS + 1)[:, None]
    top = chain.tip + H * axis
    tips = np.concatenate([a + share * (b - a) for a, b in zip(chain.tip[:-1], chain.tip[1:], strict=True)])
    ends = np.concatenate([a + share * (b - a) for a, b in itertools.pairwise(top)])
    return tips + H * unit(ends - tips)


def polynomials(text: str) -> list[list[Stretch]]:
    """Feed motion between rapids in blocks of Siemens' POLY; lines are curves of degree 1."""
    letters = ("X", "Y", "Z", "XH", "YH", "ZH")
    knots, position = np.array([0.0] * 4 + [1.0] * 4), np.full(6, np.nan)
    runs: list[list[Stretch]] = []
    for line in text.splitlines():
        if "SUPA" in line:
            continue
        if line.startswith("POLY "):
            found = [re.search(rf"PO\[{letter}\]=\(([^)]*)\)", line) for letter in letters]
            end, square, cube = np.array([np.fromstring(part[1], sep=",") for part in found if part]).T
            slope = end - position - square - cube
            inner = position + slope / 3, position + 2 * slope / 3 + square / 3
            runs[-1].append(Stretch(knots, np.array([position, *inner, end]), 3))
        else:
            found = [re.search(rf"(?:^|\s){letter}=?(-?[\d.]+)", line) for letter in letters]
            if not any(found):
                continue
            end = np.array([float(word[1]) if word else old for word, old in zip(found, position, strict=True)])
            if line.startswith("G0 ") or not runs:
                runs.append([])
            elif not np.isnan(position).any():
                runs[-1].append(Stretch(np.array([0.0, 0, 1, 1]), np.array([position, end]), 1))
        position = end
    return [run for run in runs if run]
