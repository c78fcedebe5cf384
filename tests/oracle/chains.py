"""Random tool paths of every character, and the CL text that carries them.

The poses are kept as the numbers that stand in the text, so that reader, smoothing and writer are all on trial.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from oracle.motion import Original, unit

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

TIP_DECIMALS, AXIS_DECIMALS = 7, 9
#: the largest axis step that still is a ruled motion, less a hair
STEEPEST = math.radians(89.9)
#: directions of a coarse grid no two of which are 90 degrees or more apart
GRID_AXES = unit(np.array([[0.0, 0, 1], [0.5, 0, 1], [0, 0.5, 1], [0.5, 0.5, 1], [1, 0, 1], [-0.3, 0.3, 1]]))


@dataclass(frozen=True)
class Chain:
    """Poses of a run of feed moves; the first is reached in rapid. `feed` (n,) mm/min of the move into each pose."""

    tip: Floats
    axis: Floats
    feed: Floats

    @property
    def original(self) -> Original:
        return Original(self.tip, unit(self.axis))


def turned(axis: Floats, angle: float, rng: np.random.Generator) -> Floats:
    """Unit vector at the angle (rad) from `axis`, in a random direction."""
    across = np.cross(axis, unit(rng.normal(size=3)))
    return unit(axis * math.cos(angle) + unit(across) * math.sin(angle))


def wander(rng: np.random.Generator, lengths: Floats, turns: Floats, axis_steps: Floats) -> tuple[Floats, Floats]:
    """Poses from segment lengths (mm), turns of the tip path and steps of the axis (rad), directions at random."""
    tip, axis = [rng.uniform(-100, 100, 3)], [unit(rng.normal(size=3))]
    heading = unit(rng.normal(size=3))
    for length, turn, step in zip(lengths, turns, axis_steps, strict=True):
        heading = turned(heading, turn, rng)
        tip.append(tip[-1] + length * heading)
        axis.append(turned(axis[-1], step, rng))
    return np.array(tip), np.array(axis)


def _finishing(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    return wander(rng, rng.uniform(0.03, 2, n), np.radians(rng.exponential(3, n)), np.radians(rng.exponential(1.5, n)))


def _benchmark(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    return wander(rng, rng.uniform(5, 25, n), np.radians(rng.uniform(5, 90, n)), np.radians(rng.uniform(0, 30, n)))


def _wild(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    return wander(rng, 10 ** rng.uniform(-3, 2, n), rng.uniform(0, math.pi, n), STEEPEST * np.sqrt(rng.random(n)))


def _steep(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    return wander(rng, rng.uniform(0, 30, n), rng.uniform(0, math.pi, n), rng.uniform(math.radians(60), STEEPEST, n))


def _piecewise(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    """Pure rotations, pure translations and standing poses mixed."""
    moves, rotates = rng.random(n) < 0.7, rng.random(n) < 0.5
    return wander(
        rng,
        rng.uniform(0.1, 10, n) * moves,
        np.radians(rng.uniform(0, 60, n)),
        np.radians(rng.uniform(0.5, 50, n)) * rotates,
    )


def _grid(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    """Coarse points: collinear runs, repeats, exact reversals, right angles."""
    size = rng.choice([0.25, 1.0, 8.0])
    tip = np.cumsum(rng.integers(-1, 2, (n + 1, 3)) * (rng.random((n + 1, 1)) < 0.8), axis=0) * size
    few = rng.integers(1, len(GRID_AXES) + 1)
    return tip.astype(float), GRID_AXES[rng.integers(0, few, n + 1)]


TAME = (_finishing, _benchmark)
KINDS = (*TAME, _wild, _steep, _piecewise, _grid)


def random_chains(seed: int, count: int, corners: int = 6, *, tame: bool = False) -> list[Chain]:
    """Chains of one to `corners` corners, all kinds in turn or the `tame` ones; some change their feed on the way."""
    kinds = TAME if tame else KINDS
    rng = np.random.default_rng(seed)
    chains = []
    for index in range(count):
        tip, axis = kinds[index % len(kinds)](rng, int(rng.integers(2, corners + 2)))
        feed = np.full(len(tip), float(rng.integers(100, 5000)))
        if rng.random() < 0.2:
            feed[rng.integers(1, len(tip)) :] = float(rng.integers(100, 5000))
        chains.append(Chain(np.round(tip, TIP_DECIMALS), np.round(axis, AXIS_DECIMALS), feed))
    return chains


def cl_text(chains: list[Chain]) -> tuple[bytes, list[Ints]]:
    """APT text of the chains with a rapid to each, and the line of every pose."""
    text = ["PARTNO RANDOM CHAINS", "UNITS/MM", "LOADTL/1", "SPINDL/12000,RPM,CLW", "MULTAX/ON"]
    lines = []
    for chain in chains:
        text.append("RAPID")
        feed, numbers = math.nan, []
        for pose in range(len(chain.tip)):
            if pose and chain.feed[pose] != feed:
                feed = chain.feed[pose]
                text.append(f"FEDRAT/{feed:.4f},MMPM")
            six = (*chain.tip[pose], *chain.axis[pose])
            # every digit that counts and no exponent
            text.append("GOTO/" + ",".join(np.format_float_positional(value, trim="0") for value in six))
            numbers.append(len(text))
        lines.append(np.array(numbers))
    text += ["SPINDL/OFF", "FINI", ""]
    return "\n".join(text).encode(), lines
