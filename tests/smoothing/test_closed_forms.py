"""The closed forms of docs/method.md, the paper's table, and the promises that need no NC text."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from scipy.interpolate import BSpline

from cornersmooth.geometry import nurbs
from cornersmooth.model import Program, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.share import covering_share, how_many
from smoothing.paths import plane_corner, random_program, simultaneous_deviation


def test_basis_is_the_b_spline_basis_on_the_papers_knots():
    u = np.linspace(0.0, 1.0, 101)
    expected = np.stack([BSpline([0, 0, 0, 0, 0.5, 1, 1, 1, 1], np.eye(5)[i], 3)(u) for i in range(5)], axis=-1)
    assert nurbs.basis(u) == pytest.approx(expected, abs=1e-15)


@pytest.mark.parametrize("turn", [5.0, 30.0, 60.0, 90.0, 120.0, 150.0, 169.0])
def test_curvature_and_deviation_of_a_plane_corner(turn):
    smoothed = smooth(plane_corner(turn), Settings(tolerance=0.05))
    beta = np.radians(turn) / 2
    length = 100.0 * smoothed.corners.trim_in[0]
    assert 3 * 0.05 / np.sin(beta) == pytest.approx(length, rel=1e-9)
    curve, _ = nurbs.control_points(smoothed.program, smoothed.corners, slice(None), 10.0)
    u = np.linspace(0.0, 1.0, 2001)
    point, first, second = (value[0] for value in nurbs.derivatives(curve, u))
    curvature = np.linalg.norm(np.cross(first, second), axis=1) / np.linalg.norm(first, axis=1) ** 3
    assert curvature.max() == pytest.approx(2 * np.sin(beta) / (length * np.cos(beta) ** 2), rel=1e-9)
    assert curvature[0] == pytest.approx(0.0, abs=1e-9)
    assert curvature[-1] == pytest.approx(0.0, abs=1e-9)
    assert np.linalg.norm(first[0]) == pytest.approx(2 * length)
    assert np.linalg.norm(point, axis=1).min() == pytest.approx(0.05, rel=1e-9), "corner to curve"
    to_leg = np.abs(point[:1001, 1])
    assert to_leg.max() == pytest.approx(0.05 * np.cos(beta), rel=1e-9), "curve to polyline"


def axis_by_tip_length(tip_curve, axis_curve, at):
    """Axis and its first two derivatives with respect to tip arc length, at one end of each transition."""
    u = np.array([float(at)])
    _, p1, p2 = (value[:, 0] for value in nurbs.derivatives(tip_curve, u))
    p0 = tip_curve[:, 0 if at == 0 else 4]
    q0, q1, q2 = (value[:, 0] for value in nurbs.derivatives(axis_curve, u))
    v0, v1, v2 = q0 - p0, q1 - p1, q2 - p2
    return _unit_derivatives(v0, v1, v2, p1, p2)


def _unit_derivatives(v0, v1, v2, p1, p2):
    """Derivatives of v/|v| by arc length of p, from derivatives by a common parameter."""
    dot = lambda a, b: (a * b).sum(axis=-1, keepdims=True)  # noqa: E731
    norm = np.sqrt(dot(v0, v0))
    o0 = v0 / norm
    n1 = dot(o0, v1)
    o1 = (v1 - n1 * o0) / norm
    n2 = dot(o1, v1) + dot(o0, v2)
    o2 = (v2 - n2 * o0 - 2 * n1 * o1) / norm
    speed = np.sqrt(dot(p1, p1))
    rate = dot(p1, p2) / speed
    return o0, o1 / speed, (o2 - o1 * rate / speed) / speed**2


def test_orientation_is_twice_differentiable_in_tip_length_at_the_joints():
    smoothed = smooth(random_program(7, 400), Settings(tolerance=0.5))
    program, corners = smoothed.program, smoothed.corners
    rows = np.flatnonzero(corners.smoothed)
    assert len(rows) > 300
    tip_curve, axis_curve = nurbs.control_points(program, corners, rows, 10.0)
    tops = program.tip + 10.0 * program.axis
    for at, near, far, trim in (
        (0, corners.before[rows], corners.pose[rows], 1.0 - corners.trim_in[rows]),
        (1, corners.pose[rows], corners.after[rows], corners.trim_out[rows]),
    ):
        tip_step, top_step = program.tip[far] - program.tip[near], tops[far] - tops[near]
        lever = 10.0 * program.axis[near] + trim[:, None] * (top_step - tip_step)
        line = _unit_derivatives(lever, top_step - tip_step, np.zeros_like(lever), tip_step, np.zeros_like(lever))
        curve = axis_by_tip_length(tip_curve, axis_curve, at)
        for of_line, of_curve in zip(line, curve, strict=True):
            scale = np.maximum(np.linalg.norm(of_line, axis=1), 1e-3)
            assert (np.linalg.norm(of_line - of_curve, axis=1) / scale).max() <= 1e-9


def test_moving_turning_scaling_and_reversing_the_path_commute_with_smoothing():
    program = random_program(3, 200)
    settings = Settings(tolerance=0.05)
    plain = smooth(program, settings).corners
    rotation = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    moved = Program.from_poses(program.tip @ rotation.T + [5.0, -3.0, 11.0], program.axis @ rotation.T)
    bigger = Program.from_poses(program.tip * 3.0, program.axis)
    backwards = Program.from_poses(program.tip[::-1], program.axis[::-1])
    for corners, order in (
        (smooth(moved, settings).corners, slice(None)),
        (smooth(bigger, settings.but(tolerance=0.15, axis_length=30.0)).corners, slice(None)),
    ):
        assert corners.trim_in[order] == pytest.approx(plain.trim_in, rel=1e-9, abs=1e-12)
        assert corners.trim_out[order] == pytest.approx(plain.trim_out, rel=1e-9, abs=1e-12)
    turned = smooth(backwards, settings).corners
    assert turned.trim_in[::-1] == pytest.approx(plain.trim_out, rel=1e-9, abs=1e-12)
    assert turned.status[::-1].tolist() == plain.status.tolist()


@pytest.mark.parametrize(("wobble", "axis_length"), covering_share(product([0.02, 0.3, 1.0], [10.0, 50.0]), 6, 1))
def test_tip_and_axis_point_keep_the_tolerance_at_one_common_parameter(wobble, axis_length):
    program = random_program(11, how_many(1000, 3000), wobble=wobble)
    smoothed = smooth(program, Settings(tolerance=0.04, axis_length=axis_length))
    corners = smoothed.corners
    rows = np.flatnonzero(corners.smoothed)
    tip, top = simultaneous_deviation(smoothed, rows, np.linspace(0, 1, 401))
    assert tip.max() <= 0.04 + 1e-12
    assert top.max() <= 0.04 + 1e-10
    assert top == pytest.approx(corners.axis_error[rows], rel=2e-3, abs=1e-6)
    assert tip == pytest.approx(corners.tip_error[rows], rel=1e-9)


def test_reversals_and_flips_stay_sharp():
    tips = np.array([[0, 0, 0], [10, 0, 0], [0, 0, 0], [0, 10, 0], [0, 20, 1]], float)
    axes = np.array([[0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0, 1], [0, 0.1, -1]], float)
    corners = smooth(Program.from_poses(tips, axes), Settings()).corners
    assert corners.status.tolist() == [Status.REVERSAL, Status.SMOOTHED, Status.AXIS_STEP]


@pytest.mark.parametrize("creep", [0.0, 1e-9])
def test_repeated_poses_are_one_corner(creep):
    tips = np.array([[0, 0, 0], [10, 0, 0], [10, creep, 0], [10, creep, creep], [10, 10, 0]], float)
    axes = np.tile([0.0, 0.0, 1.0], (5, 1))
    corners = smooth(Program.from_poses(tips, axes), Settings()).corners
    assert corners.status.tolist() == [Status.SMOOTHED, Status.DUPLICATE, Status.DUPLICATE]
    assert corners.before[0] == 0
    assert corners.after[0] == 4


def test_poses_that_creep_on_are_not_one_corner():
    step = 0.9e-6
    tips = np.concatenate(([[-5.0, 0, 0]], np.arange(12000)[:, None] * [step, 0, 0], [[5.0, 5.0, 0]]))
    program = Program.from_poses(tips, np.tile([0.0, 0, 1], (len(tips), 1)))
    smoothed = smooth(program, Settings())
    assert np.abs(smoothed.program.tip - program.tip).max() <= 0.5e-6 * (1.0 + 1e-9)
    assert np.count_nonzero(smoothed.corners.status != Status.DUPLICATE) >= 6000
