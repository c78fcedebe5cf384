"""Rotary angles as further axes of the tip curves, evaluated with scipy's B-splines and compared with both motions."""

from __future__ import annotations

import io
import itertools
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from cornersmooth.errors import InputError, SettingsError
from cornersmooth.geometry import nurbs
from cornersmooth.geometry.nurbs import refinement
from cornersmooth.kinematics import Machine, load_machine, machine_names, tool_axis
from cornersmooth.model import Move, Program, SmoothProgram, Status
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.rotary.angle_curves import (
    SPANS,
    CurveGroup,
    RotaryCurves,
    angle_allowance,
    rotary_curves,
    weight_factors,
)
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.segments import segments_of
from oracle.loops import bytecodes
from oracle.share import covering_share

TOLERANCE = 0.01  # mm
KNOTS5 = np.array([0, 0, 0, 0, 0.5, 1, 1, 1, 1])
U = np.linspace(0, 1, 321)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def angle(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(one, other), axis=-1), (one * other).sum(axis=-1)))


def endless(name: str) -> Machine:
    machine = load_machine(name)
    first, second = (replace(axis, limits=None) for axis in machine.axes)
    return replace(machine, axes=(first, second))


def reserved(**changes: object) -> Settings:
    """Settings that leave a tenth of ε to the orientation of every corner."""
    return Settings(tolerance=TOLERANCE, method="proportional", axis_point_resolution=0.1 * TOLERANCE).but(**changes)


def rotary(smoothed: SmoothProgram, machine: Machine) -> RotaryCurves:
    tolerance = np.degrees(smoothed.settings.tolerance / smoothed.settings.axis_length) * 0.99
    return rotary_curves(smoothed, machine, tolerance=tolerance, allowance=angle_allowance(smoothed, 0.0))


def spline(knots: np.ndarray, points: np.ndarray, weights: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Rational curve by scipy: (p, d) control points -> (m, d)."""
    return BSpline(knots, points * weights[:, None], 3)(u) / BSpline(knots, weights[:, None], 3)(u)


def five_weights(smoothed: SmoothProgram, row: int) -> np.ndarray:
    w1, w2 = smoothed.corners.weights[row]
    return np.array([1, w1, w2, w1, 1])


def motion(group: CurveGroup, i: int, u: np.ndarray = U) -> tuple[np.ndarray, np.ndarray]:
    """Tip and angles of one written curve."""
    at = u * group.knots[-1]
    weights = group.weights[i]
    tip = group.tips(slice(i, i + 1))[0]
    return spline(group.knots, tip, weights, at), spline(group.knots, group.angles[i], weights, at)


def jet(group: CurveGroup, i: int, u: float, values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value and first two derivatives of one curve at one of its ends."""
    homogeneous = np.column_stack((values * group.weights[i][:, None], group.weights[i]))
    curve = BSpline(group.knots / group.knots[-1], homogeneous, 3)
    p0, p1, p2 = (curve(u, nu) for nu in range(3))
    v0 = p0[:-1] / p0[-1]
    v1 = (p1[:-1] - p1[-1] * v0) / p0[-1]
    v2 = (p2[:-1] - p2[-1] * v0 - 2 * p1[-1] * v1) / p0[-1]
    return v0, v1, v2


def per_length(group: CurveGroup, i: int, u: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles and their first two derivatives with respect to the length of the tip curve at one of its ends."""
    _, tip1, tip2 = jet(group, i, u, group.tips(slice(i, i + 1))[0])
    value, one, two = jet(group, i, u, group.angles[i])
    speed = np.linalg.norm(tip1)
    slope = one / speed
    return value, slope, (two - slope * (tip2 @ tip1) / speed) / speed**2


def original(smoothed: SmoothProgram, row: int, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tip and axis of the original motion at the common parameter: the legs without the deviation of the curve."""
    corners, program = smoothed.corners, smoothed.program
    rho = corners.ratio[row]
    along = np.array([[-1.0], [-rho], [0.0], [rho], [1.0]])
    share = spline(KNOTS5, along, five_weights(smoothed, row), u)
    here = corners.pose[row]
    there = np.where(share < 0, corners.before[row], corners.after[row])[:, 0]
    part = np.where(share < 0, -share * corners.trim_in[row], share * corners.trim_out[row])
    tip = program.tip[here] * (1 - part) + program.tip[there] * part
    return tip, unit(program.axis[here] * (1 - part) + program.axis[there] * part)


def assert_curves(smoothed: SmoothProgram, machine: Machine, curves: RotaryCurves) -> None:
    """Every smoothed corner is a curve or lines, the tip is the five-point curve, the axis within what is promised."""
    height, epsilon = smoothed.settings.axis_length, smoothed.settings.tolerance
    allowance = angle_allowance(smoothed, 0.0)
    seen = np.concatenate([group.row for group in curves.groups] + [np.unique(curves.lines.row)])
    np.testing.assert_array_equal(np.sort(seen), np.flatnonzero(smoothed.corners.smoothed))
    for group in curves.groups:
        np.testing.assert_array_equal(group.knots * 1000, np.round(group.knots * 1000))
        np.testing.assert_array_equal(group.weights, np.round(group.weights, 3))
        for i, row in enumerate(group.row):
            tip, angles = motion(group, i)
            pair = nurbs.control_points(smoothed.program, smoothed.corners, [row], height)
            p, q = (spline(KNOTS5, points[0], five_weights(smoothed, row), U) for points in pair)
            np.testing.assert_allclose(tip, p, atol=1e-9)
            axis = tool_axis(machine, angles)
            error = angle(axis, unit(q - p)).max()
            assert error <= allowance[row]
            old_tip, old_axis = original(smoothed, row, U)
            assert np.linalg.norm(tip + height * axis - old_tip - height * old_axis, axis=1).max() <= epsilon
            assert curves.points[row] == group.points


def joint_angles(curves: RotaryCurves) -> np.ndarray:
    """Angles at the start and at the end of every rounded corner: (2, k, 2)."""
    found = np.full((2, len(curves.points), 2), np.nan)
    for group in curves.groups:
        found[:, group.row] = group.angles[:, [0, -1]].transpose(1, 0, 2)
    for row in np.unique(curves.lines.row):
        found[:, row] = curves.lines.angles[curves.lines.row == row][[0, -1]]
    return found


def assert_straight(smoothed: SmoothProgram, machine: Machine, curves: RotaryCurves) -> None:
    """Even angles on the straight remainders, with the inserted points, keep to the ruled motion."""
    program, corners, segments = smoothed.program, smoothed.corners, segments_of(smoothed, dense=False)
    assert len(curves.inserted.unsolved) == 0
    tolerance = np.degrees(smoothed.settings.tolerance / smoothed.settings.axis_length)
    start_angles, end_angles = joint_angles(curves)
    arrival = curves.pose_angles.copy()
    arrival[corners.pose[corners.smoothed]] = start_angles[corners.smoothed]
    share = np.linspace(0, 1, 17)[:, None]
    for pose in np.flatnonzero((segments.start >= 0) & ~segments.skip & segments.has_line):
        start = segments.start[pose]
        row = segments.row[start]
        leaving = end_angles[row] if row >= 0 else curves.pose_angles[start]
        own = curves.inserted.segment == pose
        places = np.concatenate(([segments.entry[pose]], curves.inserted.fraction[own], [segments.exit[pose]]))
        assert (np.diff(places) > 0).all()
        words = np.concatenate((leaving[None], curves.inserted.angles[own], arrival[None, pose]))
        for j in range(len(places) - 1):
            at = places[j] * (1 - share) + places[j + 1] * share
            wanted = unit(program.axis[start] * (1 - at) + program.axis[pose] * at)
            assert angle(tool_axis(machine, words[j] * (1 - share) + words[j + 1] * share), wanted).max() <= tolerance


def assert_lines(smoothed: SmoothProgram, machine: Machine, curves: RotaryCurves) -> None:
    """Corners as lines stay within ε of the original motion at tip and axis point, and meet their joints."""
    program, corners, height = smoothed.program, smoothed.corners, smoothed.settings.axis_length
    assert len(curves.lines.unsolved) == 0
    for row in np.unique(curves.lines.row):
        own = curves.lines.row == row
        tip, angles = curves.lines.tip[own], curves.lines.angles[own]
        assert curves.points[row] == 0
        share = np.linspace(0, 1, 9)[:, None, None]
        here = (tip[:-1] * (1 - share) + tip[1:] * share).reshape(-1, 3)
        words = (angles[:-1] * (1 - share) + angles[1:] * share).reshape(-1, 2)
        part = np.linspace(0, 1, 4001)[:, None]
        old = []
        for a, b in itertools.pairwise((corners.before[row], corners.pose[row], corners.after[row])):
            axis = unit(program.axis[a] * (1 - part) + program.axis[b] * part)
            old.append(program.tip[a] * (1 - part) + program.tip[b] * part + height * axis)
        new = here + height * tool_axis(machine, words)
        assert cKDTree(np.concatenate(old)).query(new)[0].max() <= smoothed.settings.tolerance


def random_chain(seed: int, machine_tilt: float, spread: float, n: int = 40) -> Program:
    """Poses whose axes wander about a direction tilted by so many degrees."""
    rng = np.random.default_rng(seed)
    tip = np.cumsum(rng.normal(size=(n, 3)) * 2 + [1, 0, 0], axis=0)
    tilt = np.radians(machine_tilt)
    axis = np.array([np.sin(tilt), 0, np.cos(tilt)]) + rng.normal(size=(n, 3)) * spread
    return Program.from_poses(tip, axis)


def zigzag(tilt: float | np.ndarray, azimuth: float | np.ndarray, n: int = 41) -> Program:
    """Axes of given tilt and azimuth in degrees along a tip path of small corners."""
    tip = np.stack((np.linspace(0, 50, n), np.sin(np.arange(n)), np.zeros(n)), axis=1)
    tilt, azimuth = np.broadcast_arrays(np.radians(tilt), np.radians(azimuth))
    axis = np.stack((np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)), axis=1)
    return Program.from_poses(tip, axis)


@pytest.mark.parametrize("spans", SPANS)
def test_refined_curve_is_the_same_curve(spans: int):
    rng = np.random.default_rng(spans)
    refined = refinement(spans)
    points = rng.normal(size=(20, 5, 3))
    weights = np.round(rng.uniform(0.05, 3, (20, 5)), 3)
    weights[:, [0, 4]] = 1
    more, own = refined.control_points(points, weights), refined.homogeneous(weights)
    assert refined.points == spans + 3 == more.shape[1]
    np.testing.assert_allclose(BSpline.design_matrix(U, refined.knots, 3).toarray(), refined.basis(U), atol=1e-14)
    written = own * weight_factors(own)[:, None]
    np.testing.assert_allclose(written, np.round(written, 3), atol=1e-9)
    assert written.max() < 999_999
    for i in range(len(points)):
        expected = spline(KNOTS5, points[i], weights[i], U)
        np.testing.assert_allclose(spline(refined.knots, more[i], np.round(written[i], 3), U), expected, atol=1e-12)
    np.testing.assert_array_equal(refined.homogeneous(np.ones((1, 5))), np.ones((1, refined.points)))


@pytest.mark.corpus
@pytest.mark.parametrize("name", machine_names())
def test_fan_path_of_the_literature(corpus: Path, name: str):
    rows = np.loadtxt(corpus / "hust_5x_toolpath_fan.txt")
    for settings in (reserved(), reserved(weights=(1.0, 0.6))):
        smoothed = smooth(Program.from_poses(rows[:, :3], rows[:, 3:]), settings)
        machine = load_machine(name)
        curves = rotary(smoothed, machine)
        assert len(curves.lines.row) == 0
        assert max(group.points for group in curves.groups) <= 11
        assert len(curves.inserted) < 25
        assert_curves(smoothed, machine, curves)
        assert_straight(smoothed, machine, curves)


@pytest.mark.parametrize(
    ("name", "tilt", "spread"),
    [
        (name, *bend)
        for name, bend in covering_share(
            product(
                machine_names(),
                [(30, 0.003), (30, 0.03), (30, 0.2), (4, 0.02), (0.3, 0.01), (0, 0.002), (0, 0.3)],
            ),
            5,
        )
    ],
)
def test_random_chains(name: str, tilt: float, spread: float):
    machine = endless(name)
    weights = (1.0, 0.7) if spread == 0.02 else (1.0, 1.0)
    smoothed = smooth(random_chain(machine_names().index(name), tilt, spread), reserved(weights=weights))
    curves = rotary(smoothed, machine)
    assert_curves(smoothed, machine, curves)
    assert_straight(smoothed, machine, curves)
    assert_lines(smoothed, machine, curves)


def test_other_ratios_and_shapes():
    machine = load_machine("table-bc")
    program = random_chain(5, 25, 0.05)
    for settings in (
        reserved(ratio=0.6),
        reserved(ratio=0.8, weights=(1.3, 0.4)),
        reserved(axis_length=40.0),
    ):
        smoothed = smooth(program, settings)
        curves = rotary(smoothed, machine)
        assert len(curves.lines.row) == 0
        assert_curves(smoothed, machine, curves)
        assert_straight(smoothed, machine, curves)


def test_gentle_motion_needs_five_points_and_joins_straight_lines_with_its_curvature():
    machine = load_machine("table-ac")
    n = 30
    tip = np.stack((np.arange(n) * 3.0, np.cumsum(np.arange(n) % 2), np.zeros(n)), axis=1)
    axis = zigzag(20 + np.linspace(0, 8, n) + 0.2 * (np.arange(n) % 3), np.linspace(0, 10, n), n).axis
    smoothed = smooth(Program.from_poses(tip, axis), reserved())
    curves = rotary(smoothed, machine)
    (group,) = curves.groups
    assert group.points == 5
    assert len(group) == n - 2
    assert len(curves.inserted) == 0
    assert_curves(smoothed, machine, curves)
    poses, corners = curves.pose_angles, smoothed.corners
    np.testing.assert_allclose(tool_axis(machine, poses), axis, atol=1e-12)
    np.testing.assert_allclose(group.angles[:, 2], poses[1:-1], atol=1e-9)
    for i, row in enumerate(group.row):
        pose = corners.pose[row]
        for u, step in ((0.0, pose), (1.0, pose + 1)):
            _, slope, bend = per_length(group, i, u)
            along = (poses[step] - poses[step - 1]) / np.linalg.norm(tip[step] - tip[step - 1])
            np.testing.assert_allclose(slope, along, atol=1e-9)
            np.testing.assert_allclose(bend, 0, atol=1e-6 * np.abs(along).max() / corners.trim_in[row])


@pytest.mark.parametrize(("tilt", "step"), [(30.0, 7.5), (3.0, 23.0)])
def test_joints_of_fitted_curves(tilt: float, step: float):
    """Neighbouring curves, and curves and lines, share angles and rates; along lines the curvature vanishes."""
    machine = endless("nutated-bc")
    steps = np.where(np.arange(60) % 6 == 3, 2.0, 1.0)  # shorter segments are all transition, longer ones are not
    way = np.cumsum(steps)
    tip = np.stack((0 * way, 0 * way, 0.02 * way), axis=1)
    program = Program.from_poses(tip, zigzag(tilt, way * step, 60).axis)
    smoothed = smooth(program, reserved())
    curves = rotary(smoothed, machine)
    segments = segments_of(smoothed, dense=False)
    place = {int(row): (group, i) for group in curves.groups for i, row in enumerate(group.row)}
    assert sum(group.points > 5 for group, _ in place.values()) > 20
    with_line = without = bent = 0
    for row in range(len(smoothed.corners) - 1):
        if row not in place or row + 1 not in place:
            continue
        pose = int(smoothed.corners.pose[row + 1])
        value, slope, bend = per_length(*place[row], 1.0)
        next_value, next_slope, next_bend = per_length(*place[row + 1], 0.0)
        scale = np.abs(slope).max() + np.abs(bend).max() + 1
        if segments.has_line[pose]:
            own = curves.inserted.segment == pose
            length = np.linalg.norm(program.tip[pose] - program.tip[pose - 1])
            at = length * np.concatenate(([segments.entry[pose]], curves.inserted.fraction[own], [segments.exit[pose]]))
            words = np.concatenate((value[None], curves.inserted.angles[own], next_value[None]))
            rates = np.diff(words, axis=0) / np.diff(at)[:, None]
            for ours, curvature, line in ((slope, bend, rates[0]), (next_slope, next_bend, rates[-1])):
                if np.abs(ours - line).max() <= 1e-6 * scale:
                    np.testing.assert_allclose(curvature, 0, atol=1e-6 * scale)
                    with_line += 1
                else:  # with the rates of the ruled motion, which the lines follow by steps
                    steps = np.abs(np.diff(rates, axis=0)).max(axis=0, initial=0)
                    assert (np.abs(ours - line) <= np.maximum(steps, 0.05 * np.abs(line).max())).all()
        else:
            np.testing.assert_allclose(next_value, value, atol=1e-9)
            np.testing.assert_allclose(next_slope, slope, atol=1e-6 * scale)
            np.testing.assert_allclose(next_bend, bend, atol=1e-6 * scale)
            without += 1
            bent += bool(np.abs(bend).max() > 1e-3)
    assert with_line > 5
    assert without > 20
    assert bent > 20


@pytest.mark.parametrize("name", machine_names())
def test_straight_through_the_pole_first_axis_rests(name: str):
    machine = endless(name)
    smoothed = smooth(zigzag(np.linspace(-20, 20, 41), 30.0), reserved())
    curves = rotary(smoothed, machine)
    assert [group.points for group in curves.groups] == [5]
    assert len(curves.inserted) == 0
    assert np.abs(np.diff(curves.pose_angles, axis=0)).max() < 1.5
    assert_curves(smoothed, machine, curves)


@pytest.mark.parametrize(
    ("name", "aside", "n"),
    covering_share(product(["table-ac", "nutated-bc"], [1e-9, 1e-4, 0.005, 0.02, 0.03, 0.1, 0.5, 2.0], [9, 41]), 5),
)
def test_beside_the_pole(name: str, aside: float, n: int):
    machine = endless(name)
    program = zigzag(np.linspace(-23, 20, n), 30.0, n)
    axis = program.axis + np.radians(aside) * np.array([-0.5, np.sqrt(0.75), 0])
    smoothed = smooth(Program.from_poses(program.tip, axis), reserved())
    curves = rotary(smoothed, machine)
    assert_curves(smoothed, machine, curves)
    assert_straight(smoothed, machine, curves)
    assert_lines(smoothed, machine, curves)
    assert len(np.unique(curves.lines.row)) <= 1


def test_bend_at_the_pole():
    """In at azimuth 0, out at azimuth 90: C turns by a right angle inside one rounded corner, no pose jumps."""
    tilt = np.concatenate((np.linspace(10, 0, 21), np.linspace(0, 10, 21)[1:]))
    smoothed = smooth(zigzag(tilt, np.where(np.arange(41) < 20, 0.0, 90.0)), reserved())
    machine = load_machine("table-ac")
    curves = rotary(smoothed, machine)
    assert len(curves.lines.row) == 0
    assert abs(curves.pose_angles[-1, 0] - curves.pose_angles[0, 0]) == pytest.approx(90)
    assert_curves(smoothed, machine, curves)
    assert_straight(smoothed, machine, curves)


def test_corners_that_no_curve_meets_are_lines():
    """Corners limited by ε leave nothing where the settings keep nothing back."""
    smoothed = smooth(random_chain(2, 30, 0.05), Settings(tolerance=TOLERANCE))
    machine = load_machine("table-bc")
    curves = rotary(smoothed, machine)
    rows = np.unique(curves.lines.row)
    left = angle_allowance(smoothed, 0.0)[smoothed.corners.smoothed]
    assert 5 < (left < 1e-5).sum() == len(rows) < len(smoothed.corners)
    assert_lines(smoothed, machine, curves)
    assert_curves(smoothed, machine, curves)
    (finding,) = [finding for finding in curves.findings if finding.code == "CS366"]
    assert finding.count == len(rows)
    assert finding.line == smoothed.program.line[smoothed.corners.pose[rows[0]]]


def test_limits_hold_on_curves_too():
    machine = load_machine("table-ac")
    program = random_chain(8, 30, 0.08)
    smoothed = smooth(program, reserved())
    free = rotary(smoothed, machine)
    words = np.concatenate([motion(group, i)[1] for group in free.groups for i in range(len(group))])
    highest = float(max(words[:, 1].max(), np.nanmax(free.pose_angles[[0, -1], 1])))
    first, second = machine.axes
    narrow = replace(machine, axes=(first, replace(second, limits=(-5.0, highest + 1e-3))))
    kept = rotary(smoothed, narrow)
    assert_curves(smoothed, narrow, kept)
    assert len(kept.lines.row) == 0
    low = replace(machine, axes=(first, replace(second, limits=(-5.0, highest - 2.0))))
    with pytest.raises(InputError, match="A would have to go to"):
        rotary(smoothed, low)


def test_sharp_corners_rapids_and_repeated_poses():
    program = random_chain(4, 20, 0.05, 30)
    tip, axis = np.repeat(program.tip, 2, axis=0), np.repeat(program.axis, 2, axis=0)
    keep = np.arange(60) % 2 == np.isin(np.arange(60) // 2, (3, 9, 10, 20))
    keep |= np.arange(60) % 2 == 0
    tip, axis = tip[keep], axis[keep]
    kind = np.full(len(tip), Move.LINEAR, np.uint8)
    kind[[0, 14, 15]] = Move.FROM, Move.RAPID, Move.RAPID
    program = Program.from_poses(tip, axis, kind=kind, feed=np.where(np.arange(len(tip)) < 24, 100.0, 200.0))
    smoothed = smooth(program, reserved(round_feed_changes=False))
    machine = load_machine("head-table-bc")
    curves = rotary(smoothed, machine)
    assert 0 < smoothed.corners.smoothed.sum() < len(smoothed.corners)
    assert_curves(smoothed, machine, curves)
    assert_straight(smoothed, machine, curves)
    written = ~np.isnan(curves.pose_angles[:, 0])
    repeated = smoothed.corners.pose[smoothed.corners.status == Status.DUPLICATE]
    assert len(repeated) == 3
    np.testing.assert_array_equal(np.flatnonzero(~written), [0, *repeated])  # FROM is not written either
    np.testing.assert_allclose(tool_axis(machine, curves.pose_angles[written]), axis[written], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "aside"),
    covering_share(
        product([name for name in machine_names() if name != "nutated-bc"], [0.0, 1e-15, 1e-12, 1e-8, 1e-4, 0.01]), 14
    ),
)
def test_axis_that_turns_over(name: str, aside: float):
    """Half a turn of the axis in one segment: followed where a way round can be told, else said, never a warning."""
    machine = endless(name)
    axis = np.array([[0.3, 0.1, 1], [0.3, 0.2, 1], [-0.3, -0.2, -1], [-0.3, -0.1, -1], [0, 0.1, -1]])
    axis[2] += aside * np.array([0.5, -0.3, 0.2])
    tip = np.array([[0, 0, 0], [10, 1, 0], [20, 0, 0], [30, 2, 0], [40, 1, 0.0]])
    chosen = choose_form("fanuc", "g6.2", machine=machine)
    program, settings = Program.from_poses(tip, unit(axis)), fit_settings(reserved(), chosen, "mm")
    with pytest.raises(InputError, match="turns by"):  # it is refused before it comes to that
        smooth(program, settings)
    smoothed = construction_of(settings.method).smooth(program, settings, None)
    curves = rotary(smoothed, machine)
    if aside < 1e-7:
        assert curves.inserted.unsolved.tolist() == [2]
    else:
        assert_straight(smoothed, machine, curves)
    assert_curves(smoothed, machine, curves)
    told = write(smoothed, io.BytesIO(), form=chosen).findings
    assert [finding.count for finding in told if finding.code == "CS369"] == ([1] if aside < 1e-7 else [])


@pytest.mark.parametrize("n", [0, 1, 2])
def test_paths_without_corners(n: int):
    smoothed = smooth(Program.from_poses(np.arange(3.0 * n).reshape(n, 3), np.tile([0, 0.1, 1], (n, 1))), reserved())
    curves = rotary(smoothed, load_machine("table-ac"))
    assert curves.groups == ()
    assert len(curves.lines.row) == len(curves.points) == 0
    assert curves.pose_angles.shape == (n, 2)


def test_fixed_axis_keeps_its_angles():
    for axis in ([0, 0, 1], [0, 0.5, 1]):
        smoothed = smooth(Program.from_poses(random_chain(1, 0, 0).tip, np.tile(axis, (40, 1))), reserved())
        (group,) = rotary(smoothed, load_machine("table-ac")).groups
        assert group.points == 5
        assert np.ptp(group.angles, axis=(0, 1)).max() < 1e-9


def test_refusals():
    machine = load_machine("table-ac")
    with pytest.raises(SettingsError, match="method zhang2016 has no curves in rotary axes"):
        rotary_curves(smooth(random_chain(1, 20, 0.01), Settings(method="zhang2016")), machine, tolerance=0.01)
    with pytest.raises(SettingsError, match="orientation tolerance is 0 deg"):
        rotary_curves(smooth(random_chain(1, 20, 0.01)), machine, tolerance=0.0)


def test_long_paths_are_made_without_a_loop_over_corners():
    rng = np.random.default_rng(1)
    n = 10_002
    t = np.linspace(0, 30, n)
    tip = np.cumsum(rng.normal(size=(n, 3)) * 0.3 + [1, 0, 0], axis=0)
    axis = zigzag(25 + 10 * np.sin(t), 115 * np.sin(0.7 * t), n).axis + rng.normal(size=(n, 3)) * 0.002
    smoothed = smooth(Program.from_poses(tip, axis), reserved())
    machine = load_machine("table-ac")
    curves = rotary(smoothed, machine)
    assert bytecodes(lambda: rotary(smoothed, machine)) < 20 * n  # of rounds over arrays: a loop takes hundreds
    assert (curves.points > 0).all()
    assert (curves.points == 5).mean() > 0.9
