"""Planned times beside those of copp, a planner of others under the same limits (sequential conic programmes, MIT).

It keeps limits at its stations alone, so its time rises to the true one from below as stations are added; ours keeps
them everywhere.
"""

from __future__ import annotations

from pathlib import Path as FilePath

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.feedrate import Limits, TimeLaw, plan
from cornersmooth.feedrate.taylor import poses, shares_at
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Floats, Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

copp = pytest.importorskip("copp_py")

IMPELLER = FilePath(__file__).resolve().parents[2] / "samples" / "impeller.cls"
STATIONS, ROUNDS = 500, 4


def stations(length: float) -> Floats:
    """Places along a path, closer at its ends."""
    even = np.linspace(0.0, length, STATIONS)
    ends = length * (1.0 - np.cos(np.linspace(0.0, np.pi, 60))) / 2.0
    s = np.unique(np.concatenate((even, ends)))
    return s[np.concatenate(([True], np.diff(s) > 1e-6))]


def foreign_time(law: TimeLaw) -> float:
    """Time of copp for the path and the limits of a law, s."""
    path, limits, axes = law.path, law.limits, law.machine_axes
    assert axes is not None
    s = stations(float(path.edge[-1]))
    element = np.clip(np.searchsorted(path.edge, s, side="right") - 1, 0, len(path) - 1)
    local = s - path.edge[element]
    q, one, two, three = axes.orders(element, shares_at(path, element, local))
    kappa = poses(path, element, local)[2]
    way = np.ones((len(s), 1))
    speed, accel, jerk = (
        np.concatenate(([own], bound)) for own, bound in zip((1e3, limits.accel, limits.jerk), axes.limits, strict=True)
    )
    robot = copp.Robot(6, capacity=len(s))
    robot.append_s(s)
    first, second, third = (np.hstack(pair) for pair in ((way, one), (0.0 * way, two), (0.0 * way, three)))
    robot.set_q(np.hstack((s[:, None], q)), first, second, 0, dddq=third)
    for add, most in (
        (robot.add_velocity_limits, speed),
        (robot.add_acceleration_limits, accel),
        (robot.add_jerk_limits, jerk),
    ):
        add(most, -most, start_idx_s=0, length=len(s))
    square = np.minimum(path.speed[element] ** 2, limits.centripetal_accel / np.maximum(kappa, 1e-12))
    robot.constraints.add_constraint_1st(square[:, None], 0)
    by_accel, by_jerk = copp.solver.topp2_ra, copp.solver.topp3_socp
    ends = {"a_boundary": (0.0, 0.0)}
    begin = by_accel.Problem(robot.constraints, idx_s_interval=(0, len(s) - 1), **ends)
    profile, known = by_accel.solve(begin, by_accel.Options()), None
    for _ in range(ROUNDS):
        more = {} if known is None else {"b_linearization": known.b}
        problem = by_jerk.Problem(
            robot.constraints,
            profile if known is None else known.a,
            b_boundary=(0.0, 0.0),
            num_stationary_max=1,
            **ends,
            **more,
        )
        known = by_jerk.solve(problem, copp.clarabel.ClarabelOptions())
    return float(copp.interpolation.s_to_t_topp3(s, known, 0.0)[0])


def test_plans_are_as_fast_as_those_of_others() -> None:
    whole = read(IMPELLER)
    rows = slice(4, 34)
    program = Program.from_poses(whole.tip[rows], whole.axis[rows], feed=1800.0)
    smoothed = smooth(program, Settings(tolerance=0.01, axis_length=10.0, method="global"))
    law = plan(smoothed, Limits(), machine=load_machine("table-ac"))
    other = foreign_time(law)
    assert 0.95 * other < law.total < 1.02 * other
