"""Limits of vectors: the whole jerk of the tip, the turning of the tool axis."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cornersmooth.arrays import norm
from cornersmooth.feedrate import Limits, curves, plan, taylor
from cornersmooth.feedrate.path import Path, build_path
from cornersmooth.feedrate.taylor import poses, taylor_along
from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.model import Arcs, Floats, Ints, Move, Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

STEP = 2e-4  # s


def derivatives(path: Path, element: Ints, share: Floats) -> list[tuple[Floats, Floats]]:
    """First three derivatives of tip and tool axis by the path coordinate."""
    tip, axis, speed = taylor_along(path, element, share)
    return list(zip(taylor.by_way(tip, speed), taylor.by_way(axis, speed), strict=True))


def sampled(law: TimeLaw) -> tuple[Floats, Floats]:
    states = law.at(np.arange(0.0, law.total, STEP))
    return states.tip, states.axis


def largest(positions: Floats, order: int, outliers: int = 0) -> float:
    """Largest length of differences over time; the third derivative has jumps, where few differences overshoot."""
    found = np.sort(np.linalg.norm(np.diff(positions, n=order, axis=0), axis=1)) / STEP**order
    return float(found[-1 - outliers])


def test_jets_against_a_function() -> None:
    """exp(2u)/(1 + u²) and its square root at u = 0.3, derivatives by hand from the series."""
    u = 0.3
    e = np.exp(2 * u) * np.array([1.0, 2.0, 2.0, 8.0 / 6.0])
    p = np.array([1.0 + u * u, 2.0 * u, 1.0, 0.0])
    found = taylor.divide(e, p)
    h = 1e-2

    def value(x: float) -> float:
        return float(np.exp(2 * x) / (1 + x * x))

    y = np.array([value(u + k * h) for k in range(-3, 4)])
    first = (-y[0] + 9 * y[1] - 45 * y[2] + 45 * y[4] - 9 * y[5] + y[6]) / (60 * h)
    second = (2 * y[0] - 27 * y[1] + 270 * y[2] - 490 * y[3] + 270 * y[4] - 27 * y[5] + 2 * y[6]) / (180 * h * h)
    third = (y[0] - 8 * y[1] + 13 * y[2] - 13 * y[4] + 8 * y[5] - y[6]) / (8 * h**3)
    assert found == pytest.approx([y[3], first, second / 2, third / 6], rel=1e-5)
    half = taylor.root(found)
    assert taylor.multiply(half, half) == pytest.approx(found)
    assert taylor.derivative(found) == pytest.approx([found[1], 2 * found[2], 3 * found[3]])


def test_derivatives_of_a_path(chain: Callable[[int], Program]) -> None:
    """Against differences of poses along the way, where the curves are smooth."""
    smoothed = smooth(chain(2), Settings(tolerance=0.05))
    path = build_path(smoothed.program, smoothed.corners, smoothed.settings, Limits())
    for element in np.flatnonzero(path.kind == 0)[:5]:
        length = path.length[element]
        h = 0.02 * length
        way = 0.5 * length + h * np.arange(-2, 3)
        _, axis, _ = poses(path, np.full(5, element), way)
        found = [norm(order[1])[0] for order in derivatives(path, np.array([element]), np.array([0.5]))]
        first = np.linalg.norm(axis[0] - 8 * axis[1] + 8 * axis[3] - axis[4]) / (12 * h)
        second = np.linalg.norm(-axis[0] + 16 * axis[1] - 30 * axis[2] + 16 * axis[3] - axis[4]) / (12 * h * h)
        assert found[0] == pytest.approx(first, rel=1e-6)
        assert found[1] == pytest.approx(second, rel=1e-4, abs=1e-9)
    t = np.linspace(0.05, 0.95, 10)
    for element in np.flatnonzero(path.kind == 1)[:6]:
        where = np.full(len(t), element)
        first, second, third = (norm(order[0]) for order in derivatives(path, where, t))
        assert first == pytest.approx(1.0)
        # curvature by the way: its own differences against the third derivative, |r‴|² = κ⁴ + κ′² in a plane
        h = 1e-4
        ahead, behind = (norm(derivatives(path, where, t + side)[1][0]) for side in (h, -h))
        x = halves_way(path, int(element), t, h)
        slope = (ahead - behind) / x
        assert third == pytest.approx(np.hypot(second**2, slope), rel=1e-4)


def halves_way(path: Path, element: int, t: Floats, h: float) -> Floats:
    """Way between the parameters t − h and t + h of a half."""
    tip = np.repeat(path.curves.tip[path.row[[element]]], len(t), axis=0)
    ends = curves.evaluate(tip, np.stack((t - h, t + h), axis=1))
    return np.linalg.norm(np.diff(ends, axis=1)[:, 0], axis=1)


def test_derivatives_on_an_arc() -> None:
    arcs = Arcs(
        pose=np.array([1]),
        centre=np.array([[0.0, 3.0, 0.0]]),
        normal=np.array([[0.0, 0.0, 1.0]]),
        sweep=np.array([np.pi / 2]),
    )
    kind = np.array([Move.LINEAR, Move.ARC], np.uint8)
    program = Program.from_poses([[0, 0, 0], [3, 3, 0]], [[0, 0, 1]] * 2, kind=kind, feed=100.0, arcs=arcs)
    path = build_path(program, None, Settings(), Limits())
    found = derivatives(path, np.zeros(3, np.int64), np.array([0.0, 0.4, 1.0]))
    for order, expected in zip(found, (1.0, 1.0 / 3.0, 1.0 / 9.0), strict=True):
        assert norm(order[0]) == pytest.approx(expected)


def test_turn_on_the_spot_beside_lines() -> None:
    """The tip stops on the transitions to the turn; the limits of the axis are kept in the turn itself."""
    tip = [[0, 0, 0], [5, 0, 0], [5, 0, 0], [10, 0, 0]]
    axis = [[0, 0, 1], [0, 0, 1], [0, 1, 1], [0, 1, 1]]
    program = Program.from_poses(tip, axis, feed=3000.0)
    for limits in (Limits(), Limits(angular_feed=10.0, angular_accel=100.0, angular_jerk=1000.0)):
        law = plan(smooth(program, Settings(tolerance=0.2)), limits)
        assert law.path.turning.sum() == 1
        states = law.at(np.arange(0.0, law.total, 1e-3))
        speed, accel, jerk = np.degrees(limits.angular_limits)
        turning = states.turning
        assert np.degrees(states.v[turning].max()) <= speed * 1.001
        assert np.degrees(np.abs(states.a[turning]).max()) <= accel * 1.001
        assert np.degrees(np.abs(states.j[turning]).max()) <= jerk * 1.001
        assert law.total < 10.0
