"""Programs to smooth, and their deviation computed from the poses alone."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from cornersmooth.geometry import nurbs
from cornersmooth.model import Program, SmoothProgram

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def plane_corner(turn_deg: float, leg_in: float = 100.0, leg_out: float = 100.0) -> Program:
    """Two segments in the XY plane that turn by the angle, axis +Z."""
    turn = np.radians(turn_deg)
    tips = np.array([[-leg_in, 0, 0], [0, 0, 0], [leg_out * np.cos(turn), leg_out * np.sin(turn), 0]])
    return Program.from_poses(tips, np.tile([0.0, 0.0, 1.0], (3, 1)))


def random_program(seed: int, count: int, *, step: float = 3.0, wobble: float = 0.15) -> Program:
    """One chain that turns any which way, its axis wandering by `wobble` per pose."""
    rng = np.random.default_rng(seed)
    tips = np.cumsum(rng.normal(size=(count, 3)) * step, axis=0)
    axes = np.array([0.0, 0.0, 2.0]) + np.cumsum(rng.normal(size=(count, 3)) * wobble, axis=0)
    return Program.from_poses(tips, axes)


@st.composite
def grid_program(draw: st.DrawFn) -> Program:
    """Chains whose tips and axes lie on a coarse grid."""
    count = draw(st.integers(3, 12))
    place = st.integers(-1, 1).map(float)
    tips = draw(st.lists(st.tuples(place, place, place), min_size=count, max_size=count))
    lean = st.integers(-1, 1).map(lambda value: 0.4 * value)
    axes = draw(st.lists(st.tuples(lean, lean, st.just(1.0)), min_size=count, max_size=count))
    return Program.from_poses(np.array(tips), np.array(axes))


def simultaneous_deviation(smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[Floats, Floats]:
    """Largest tip and axis-point distance at the common parameter, for each of the corners."""
    program, corners, height = smoothed.program, smoothed.corners, smoothed.settings.axis_length
    tip_curve, axis_curve = nurbs.control_points(program, corners, rows, height)
    shares = nurbs.basis(u)
    first = shares[..., 0] + 2 / 3 * (shares[..., 1] - shares[..., 3])
    second = shares[..., 4] + 2 / 3 * (shares[..., 3] - shares[..., 1])
    towards = np.where(u <= 0.5, corners.before[rows][:, None], corners.after[rows][:, None])
    trim = np.where(u <= 0.5, corners.trim_in[rows][:, None], corners.trim_out[rows][:, None])
    fraction = (np.where(u <= 0.5, first, second) * trim)[..., None]
    pose = corners.pose[rows][:, None]
    tip = program.tip[pose] + fraction * (program.tip[towards] - program.tip[pose])
    lever = program.axis[pose] + fraction * (program.axis[towards] - program.axis[pose])
    top = tip + height * lever / np.linalg.norm(lever, axis=-1, keepdims=True)
    points = nurbs.evaluate(tip_curve, u)
    levers = nurbs.evaluate(axis_curve, u) - points
    tops = points + height * levers / np.linalg.norm(levers, axis=-1, keepdims=True)
    return np.linalg.norm(points - tip, axis=-1).max(axis=1), np.linalg.norm(tops - top, axis=-1).max(axis=1)
