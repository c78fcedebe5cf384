"""One pair of splines for a run: proved within ε, smooth, and what it is asked to be."""

from __future__ import annotations

import io
import tracemalloc
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from scipy.optimize import NonlinearConstraint, minimize

from cornersmooth import Limits, Program, Settings, postprocess, read, smooth
from cornersmooth.arrays import unit
from cornersmooth.feedrate import plan_text
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Move, Status
from cornersmooth.nc import choose_form
from cornersmooth.nc_reader import read_nc
from cornersmooth.smoothing import global_runs
from cornersmooth.smoothing.runs.banded import Gather, Windows, couplings, keep_in_planes, solve_blocks
from cornersmooth.smoothing.runs.fitting import fit
from cornersmooth.smoothing.runs.interior import COLD, Task, smoothest
from cornersmooth.smoothing.runs.polylines import Pieces, Polylines, Samples
from cornersmooth.smoothing.runs.rows import largest_curvature
from cornersmooth.smoothing.runs.solving import RunCurves, solve_runs
from oracle.share import covering_share, how_many
from smoothing.runs_oracle import deviation, random_runs, spline_of, through

H = 10.0


def winding(n: int, seed: int = 3) -> np.ndarray:
    """(n, 6) points of a winding five-axis path with noise, lines of 0.2 to 1 mm."""
    rng = np.random.default_rng(seed)
    heading, tilt = np.cumsum(rng.normal(0, 0.05, n)), 0.3 * np.sin(np.arange(n) * 0.02)
    step = np.stack((np.cos(heading) * np.cos(tilt), np.sin(heading) * np.cos(tilt), np.sin(tilt)), axis=1)
    tip = np.cumsum(rng.uniform(0.2, 1.0, n)[:, None] * step, axis=0) + rng.normal(0, 0.002, (n, 3))
    swing = 0.4 * np.sin(np.arange(n) * 0.006)
    axis = np.stack((np.sin(swing) * 0.6, np.sin(swing) * 0.8, np.cos(swing)), axis=1)
    return np.hstack((tip, tip + H * axis))


def jerk(curves: RunCurves) -> float:
    """∫|C‴|² of all runs."""
    return sum(
        float((np.diff(spline.t[3:-3])[:, None] * spline.derivative(3)(spline.t[3:-4]) ** 2).sum())
        for spline in (spline_of(curves, run) for run in range(len(curves.kept)))
    )


def test_splines_are_those_of_scipy() -> None:
    rng = np.random.default_rng(0)
    count = np.array([2, 5, 9])
    splines = Splines(np.concatenate([np.sort(rng.random(k)) for k in count]), count)
    control = rng.normal(size=(splines.control_first[-1], 2))
    for run in range(len(count)):
        knots = splines.knot[splines.first[run] : splines.first[run + 1]]
        own = control[splines.control_first[run] : splines.control_first[run + 1]]
        spline = BSpline(np.concatenate(([knots[0]] * 3, knots, [knots[-1]] * 3)), own, 3)
        span = np.arange(splines.span_first[run], splines.span_first[run + 1])
        taps = control[splines.span_control[span][:, None] + np.arange(4)]
        low, high = knots[:-1] + 0.2 * np.diff(knots), knots[:-1] + 0.9 * np.diff(knots)
        np.testing.assert_allclose(np.einsum("sk,skd->sd", splines.basis(span, low), taps), spline(low), atol=1e-12)
        third = spline.derivative(3)(low)
        got = np.einsum("sk,skd->sd", splines.third[span], taps)
        np.testing.assert_allclose(got, third, atol=1e-12 * np.abs(third).max())
        hull = splines.bernstein(span, low, high) @ taps
        u = 0.3
        bernstein = np.array([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u * u * (1 - u), u**3])
        np.testing.assert_allclose(np.einsum("i,sid->sd", bernstein, hull), spline(low + u * (high - low)), atol=1e-12)


def test_banded_sums_and_solutions_are_those_of_full_matrices() -> None:
    rng = np.random.default_rng(1)
    size, rows = 9, 40
    first = np.sort(rng.integers(0, size - 3, rows))
    tap = rng.normal(size=(rows, 4))
    full = np.zeros((rows, size))
    np.put_along_axis(full, first[:, None] + np.arange(4), tap, axis=1)
    gather = Gather(first, tap, size)
    off = rng.normal(size=(rows, 3))
    np.testing.assert_allclose(gather.sums(off), full.T @ off, atol=1e-12)
    np.testing.assert_allclose(gather.apply(rng_like(size)), full @ rng_like(size), atol=1e-12)
    free = np.arange(size) % 5 != 4
    blocks = np.einsum("mi,mj->mij", off, off) + np.eye(3)
    six = np.stack([blocks[:, i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))], axis=1)
    right = rng.normal(size=(size, 3))
    matrix = np.einsum("ma,mb,mij->aibj", full, full, blocks)[free][:, :, free].reshape(3 * free.sum(), -1)
    expected = np.zeros((size, 3))
    expected[free] = np.linalg.solve(matrix, right[free].ravel()).reshape(-1, 3)
    np.testing.assert_array_equal(gather.apply_rows(rng_like(size).T), gather.apply(rng_like(size)).T)
    np.testing.assert_allclose(gather.sum_rows(off.T), gather.sums(off).T, atol=1e-12)
    found = solve_blocks(gather.bands(six), np.ascontiguousarray(right.T), couplings(free))
    np.testing.assert_allclose(found.T, expected, rtol=1e-8, atol=1e-10)
    # in a plane: as in the coordinates of the plane, and free control points without one are not touched
    normal = np.array([0.6, 0.0, 0.8])
    inside = np.kron(np.eye(free.sum()), np.array([[0.0, 1.0, 0.0], [0.8, 0.0, -0.6]]).T)
    expected[free] = (inside @ np.linalg.solve(inside.T @ matrix @ inside, inside.T @ right[free].ravel())).reshape(
        -1, 3
    )
    for plane in (normal, np.zeros(3)):
        bands, held = gather.bands(six), np.ascontiguousarray(right.T)
        keep_in_planes(bands, held, np.tile(plane, (size, 1)))
        in_plane = solve_blocks(bands, held, couplings(free)).T
        np.testing.assert_allclose(in_plane, expected if plane.any() else found.T, rtol=1e-8, atol=1e-10)


def rng_like(size: int) -> np.ndarray:
    return np.random.default_rng(2).normal(size=(size, 3))


def test_straight_run_stays_a_line() -> None:
    tip = np.outer(np.array([0.0, 1, 1.5, 4, 4.001, 9]), [1.0, 2, -1])
    curves = solve_runs(through(np.hstack((tip, tip + np.array([0, 0, H]))), step=1e-5), (0.01, 0.01), H)
    assert curves.kept.all()
    assert max(curves.tip_bound[0], curves.axis_bound[0]) < 1e-5  # the parameter is the length but for its steps
    assert np.linalg.norm(np.cross(curves.control[:, :3], tip[-1] / np.linalg.norm(tip[-1])), axis=1).max() < 1e-10
    np.testing.assert_allclose(
        curves.control[:, 3:] - curves.control[:, :3], [[0, 0, H]] * len(curves.control), atol=1e-9
    )


@pytest.mark.parametrize(("seed", "tolerance"), covering_share(product(range(4), [0.001, 0.01, 0.15]), 5))
def test_every_run_is_within_its_bounds(seed: int, tolerance: float) -> None:
    lines = random_runs(seed, 24, 14, H)
    curves = solve_runs(lines, (tolerance, tolerance), H)
    assert curves.kept.all()
    for run in range(len(lines.count)):
        tip, axis = deviation(curves, run, H)
        assert tip <= curves.tip_bound[run] * (1 + 1e-9) + 1e-11
        assert axis <= curves.axis_bound[run] * (1 + 1e-9) + 1e-11
        assert curves.tip_bound[run] <= tolerance
        assert curves.axis_bound[run] <= tolerance


@settings(max_examples=how_many(12, 25), deadline=None)
@given(
    seed=st.integers(0, 10**6),
    corners=st.integers(1, 40),
    exponent=st.floats(-3, -0.8),
    axis_length=st.sampled_from([1.0, 10.0, 80.0]),
    shift=st.sampled_from([0.0, 1e5]),
)
def test_random_runs_keep_their_tolerance(
    seed: int, corners: int, exponent: float, axis_length: float, shift: float
) -> None:
    tolerance = 10**exponent
    lines = random_runs(seed, 6, corners, axis_length)
    lines = Polylines.through(lines.point + shift, lines.count, tolerance / 100)
    curves = solve_runs(lines, (tolerance, 0.9 * tolerance), axis_length)
    assert curves.kept.sum() >= len(lines.count) - 1  # one in a thousand is not proved, and rounded corner by corner
    for run in np.flatnonzero(curves.kept).tolist():
        tip, axis = deviation(curves, run, axis_length)
        assert tip <= tolerance * (1 + 1e-9) + 1e-9
        assert axis <= 0.9 * tolerance * (1 + 1e-9) + 1e-9


def test_runs_start_and_end_like_their_segments() -> None:
    lines = random_runs(7, 24, 12, H)
    curves = solve_runs(lines, (0.02, 0.02), H)
    for run in range(len(lines.count)):
        spline = spline_of(curves, run)
        own = np.arange(lines.first[run], lines.first[run + 1])
        for at, pose, segment in ((spline.t[0], own[0], own[0]), (spline.t[-1], own[-1], own[-2])):
            step = lines.point[segment + 1] - lines.point[segment]
            speed = step / (lines.s[segment + 1] - lines.s[segment])
            np.testing.assert_allclose(spline(at), lines.point[pose], rtol=0, atol=1e-11 * np.abs(lines.point).max())
            bend = spline.derivative(2)(at) * np.diff(spline.t)[np.diff(spline.t) > 0].min()
            np.testing.assert_allclose(spline.derivative(1)(at), speed, rtol=0, atol=1e-8)
            assert np.abs(bend).max() < 1e-7


def test_smoothest_is_what_a_general_solver_finds() -> None:
    lines = through(winding(9))
    splines, rough = fit(lines, (0.05, 0.05))
    samples = Samples.of(splines, lines, Pieces.of(splines, lines))
    windows = Windows.of(splines, splines.span_first[:-1], np.diff(splines.span_first))
    rng = np.random.default_rng(4)
    lever = samples.target[:, 3:] - samples.target[:, :3]
    axis, stretch = lever / np.linalg.norm(lever, axis=1)[:, None], rng.uniform(-0.9, 1.0, len(lever))
    free, one = np.flatnonzero(windows.free), np.zeros(len(samples.s), np.int64)
    basis = np.zeros((len(samples.s), len(rough)))
    np.put_along_axis(basis, splines.span_control[samples.span][:, None] + np.arange(4), samples.basis, axis=1)
    third = np.zeros((len(splines.width), len(rough)))
    np.put_along_axis(third, splines.span_control[:, None] + np.arange(4), splines.third, axis=1)
    start = rough[:, 3:]
    off = (basis @ start - samples.target[:, 3:]) / 0.05

    def size(off: np.ndarray) -> np.ndarray:
        return np.square(off).sum(axis=1) + stretch * (off * axis).sum(axis=1) ** 2

    penalty = rng.uniform(0.0, 0.02, len(lever))
    scaled = np.sqrt(splines.width)[:, None] * third
    for many in (1.0, 0.5):  # begun inside of the bounds, and outside of some of them
        radius = np.maximum(0.8, many * np.sqrt(size(off)) + 0.1)
        radius[::7] *= many
        task = Task(
            near=Gather(splines.span_control[samples.span], samples.basis, len(start)),
            smooth=Gather(splines.span_control, splines.third, len(start)),
            weight=splines.width,
            axis=axis,
            stretch=stretch,
            radius=radius,
            penalty=penalty,
            windows=windows,
            sample_window=one,
        )
        change = smoothest(task, off, third @ start / 0.05, 1e-5, COLD)
        assert not change[~windows.free].any()
        assert (size(off + basis @ change) <= radius**2 * (1 + 1e-6)).all()
        base, scale = scaled @ start / 0.05, np.square(scaled @ start / 0.05).sum()

        def whole(x: np.ndarray) -> np.ndarray:
            change = np.zeros_like(start)
            change[free] = x.reshape(-1, 3)
            return change

        def cost(change: np.ndarray, base: np.ndarray = base, scale: float = scale) -> float:
            away = np.square(off + basis @ change).sum(axis=1)
            return float(np.square(base + scaled @ change).sum() / scale + penalty @ away)

        def slope(change: np.ndarray, base: np.ndarray = base, scale: float = scale) -> np.ndarray:
            away = basis.T @ (penalty[:, None] * (off + basis @ change))
            return 2.0 * (scaled.T @ (base + scaled @ change) / scale + away)

        reference = minimize(
            lambda x: cost(whole(x)),
            np.zeros(3 * len(free)),
            jac=lambda x: slope(whole(x))[free].ravel(),
            constraints=NonlinearConstraint(lambda x, r=radius: size(off + basis @ whole(x)) / r**2, -np.inf, 1.0),
            method="SLSQP",
            options={"maxiter": 500, "ftol": 1e-12},
        )
        assert cost(change) <= reference.fun * 1.001


def test_long_runs_are_smooth_where_windows_meet() -> None:
    lines = through(winding(2500))
    curves = solve_runs(lines, (0.005, 0.005), H)
    assert curves.kept.all()
    assert curves.splines.count[0] > 600  # several windows
    spline = spline_of(curves, 0)
    inner = spline.t[4:-4]
    for order in (1, 2):
        derivative = spline.derivative(order)
        step = 1e-9
        jump = np.linalg.norm(derivative(inner + step) - derivative(inner - step), axis=1)
        slope = np.linalg.norm(spline.derivative(order + 1)(spline.t[3:-3]), axis=1).max()
        assert jump.max() <= 2 * step * slope * 1.1 + 1e-9 * np.linalg.norm(derivative(inner), axis=1).max()
    # as smooth as it is where one window holds all: no seam adds to the jerk
    third = np.linalg.norm(spline.derivative(3)((spline.t[3:-4] + spline.t[4:-3]) / 2), axis=1)
    assert jerk(curves) <= np.square(third).max() * (spline.t[-1] - spline.t[0])


def test_few_control_points_where_poses_are_dense() -> None:
    t = np.linspace(0, 2 * np.pi, 4000)
    rng = np.random.default_rng(5)
    tip = np.stack((30 * np.cos(t), 30 * np.sin(t), 3 * np.sin(3 * t)), axis=1) + rng.normal(0, 0.001, (len(t), 3))
    axis = np.stack((0.3 * np.cos(2 * t), 0.3 * np.sin(2 * t), np.ones_like(t)), axis=1)
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    curves = solve_runs(through(np.hstack((tip, tip + H * axis))), (0.02, 0.02), H)
    assert curves.kept.all()
    assert len(curves.control) < 0.2 * len(t)


def test_translation_rotation_and_scaling_commute() -> None:
    points = winding(300, seed=11)
    plain = solve_runs(through(points), (0.01, 0.01), H)
    q, _ = np.linalg.qr(np.random.default_rng(6).normal(size=(3, 3)))
    turned = np.hstack((points[:, :3] @ q.T, points[:, 3:] @ q.T))
    shifted = points + np.tile([12.0, -34.0, 56.0], 2)
    for other, back in (
        (solve_runs(through(turned), (0.01, 0.01), H), lambda c: np.hstack((c[:, :3] @ q, c[:, 3:] @ q))),
        (solve_runs(through(shifted), (0.01, 0.01), H), lambda c: c - np.tile([12.0, -34.0, 56.0], 2)),
        (solve_runs(through(2.5 * points, step=2.5e-5), (0.025, 0.025), 2.5 * H), lambda c: c / 2.5),
    ):
        assert len(other.control) == len(plain.control)
        np.testing.assert_allclose(back(other.control), plain.control, rtol=0, atol=1e-6 * np.abs(points).max())


def test_same_input_gives_the_same_curve() -> None:
    lines = through(winding(200), winding(40, seed=9))
    one, other = (solve_runs(lines, (0.01, 0.01), H) for _ in range(2))
    np.testing.assert_array_equal(one.control, other.control)
    np.testing.assert_array_equal(one.splines.knot, other.splines.knot)


def test_curvature_beside_a_pose_is_the_largest_of_its_half_segments() -> None:
    lines = random_runs(5, 6, 8, H)
    curves = solve_runs(lines, (0.02, 0.02), H)
    largest = largest_curvature(curves.lines, curves.splines, curves.control)
    for run in range(len(lines.count)):
        own = np.arange(lines.first[run], lines.first[run + 1])
        spline = spline_of(curves, run)
        s = np.linspace(0.0, lines.s[own[-1]], 4001)[1:-1]
        first, second = (spline.derivative(order)(s)[:, :3] for order in (1, 2))
        bent = np.linalg.norm(np.cross(first, second), axis=1) / np.linalg.norm(first, axis=1) ** 3
        moving = np.linalg.norm(first, axis=1) > 0.05 * lines.step
        pose = np.abs(s[:, None] - lines.s[own]).argmin(axis=1)
        for place in range(len(own)):
            here = moving & (pose == place)
            assert bent[here].max(initial=0.0) <= 1.3 * largest[own[place]] + 1e-6
    assert (largest < 1e9).all()


def test_curvature_of_a_circle() -> None:
    t = np.linspace(0, 3.0, 300)
    tip = np.stack((30 * np.cos(t), 30 * np.sin(t), 0 * t), axis=1)
    curves = solve_runs(through(np.hstack((tip, tip + [0, 0, H]))), (0.01, 0.01), H)
    largest = largest_curvature(curves.lines, curves.splines, curves.control)
    np.testing.assert_allclose(largest[20:-20], 1 / 30, rtol=0.02)


def test_axis_that_does_not_turn_does_not_tremble() -> None:
    points = winding(300, seed=8)
    turning = winding(40, seed=9)
    points[:, 3:] = points[:, :3] + H * np.array([0.36, 0.48, 0.8])
    curves = solve_runs(through(points, turning), (0.01, 0.01), H)
    assert curves.kept.all()
    own = curves.control[: curves.splines.control_first[1]]
    np.testing.assert_allclose(own[:, 3:] - own[:, :3], [H * np.array([0.36, 0.48, 0.8])] * len(own), atol=1e-11)
    assert curves.axis_bound[0] <= 0.01


@pytest.mark.parametrize("noise", [0.0, 2e-7])
def test_axes_in_a_plane_stay_in_it(noise: float) -> None:
    """Within the digits of a CL file, which leave the plane a little."""
    points, normal = winding(400, seed=4), np.array([0.8, -0.6, 0.0])
    rng = np.random.default_rng(2)
    points[:, 3:] += H * noise * rng.uniform(-1.0, 1.0, (400, 1)) * normal
    turning = random_runs(5, 1, 12, H).point
    curves = solve_runs(through(points, turning), (0.01, 0.01), H)
    assert curves.kept.all()
    assert max(deviation(curves, 0, H)) <= 0.01
    own = curves.control[: curves.splines.control_first[1]]
    across = np.abs((own[:, 3:] - own[:, :3]) @ normal).max()
    assert across <= 4 * H * noise + 1e-11
    # the tip goes out of the plane as it likes
    off = own[:, :3] @ normal
    assert np.ptp(off) > 1.0


def test_a_tip_that_stands_while_the_tool_turns_goes_on_standing() -> None:
    lean = 0.05 * np.arange(12) + 0.02 * np.sin(np.arange(12))
    axis = np.stack((np.sin(lean), np.zeros(12), np.cos(lean)), axis=1)
    program = Program.from_poses(np.zeros((12, 3)), axis, feed=500.0)
    found = smooth(program, Settings(method="global", tolerance=0.02, axis_length=H))
    assert found.runs is not None
    assert found.runs.count.tolist() == [12]
    assert np.abs(found.runs.control[:, :3]).max() < 1e-6


def test_tip_and_axis_point_deviate_to_opposite_sides_where_that_keeps_the_lever_calm() -> None:
    count, wobble = 60, 0.018  # of the axis point: more than its tolerance, less than both together
    points = np.zeros((count, 6))
    points[:, [0, 3]] = np.arange(count)[:, None]
    points[:, 5] = H
    points[2:-2, 4] = wobble * (-1.0) ** np.arange(count - 4)
    curves = solve_runs(through(points), (0.01, 0.01), H)
    assert curves.kept.all()
    assert max(deviation(curves, 0, H)) <= 0.01
    middle = spline_of(curves, 0)(curves.lines.s[20:40])
    lever = middle[:, 4] - middle[:, 1]
    assert np.abs(lever).max() < 0.2 * wobble


def test_groups_of_runs_are_solved_as_all_of_them_by_any_number_of_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    lines = random_runs(7, 12, 14, H)
    first = lines.first[:-1]
    axis = unit(lines.point[:, 3:] - lines.point[:, :3])
    kind = np.full(len(axis), Move.LINEAR)
    kind[first] = Move.RAPID
    program = Program.from_poses(lines.point[:, :3], axis, kind=kind, feed=900.0)
    chosen = Settings(method="global", axis_length=H)
    whole = smooth(program, chosen)
    assert whole.runs is not None
    monkeypatch.setattr(global_runs, "GROUP", 30)
    for processes in (1, 2):
        told: list[tuple[int, int]] = []
        found = smooth(program, chosen, progress=lambda *now, told=told: told.append(now), processes=processes)
        assert len(told) > 2  # groups
        assert told[-1][0] == told[-1][1]
        assert found.runs is not None
        np.testing.assert_array_equal(found.runs.knot, whole.runs.knot)
        np.testing.assert_allclose(found.runs.control, whole.runs.control, rtol=0, atol=1e-9)
        in_run = whole.corners.status == Status.IN_RUN
        np.testing.assert_array_equal(found.corners.status == Status.IN_RUN, in_run)
        for name in ("tip_error", "axis_error", "orientation_error"):
            column = getattr(found.corners, name)
            np.testing.assert_allclose(column, getattr(whole.corners, name), rtol=0, atol=1e-9)
        assert found.corners.tip_error[in_run].max() <= whole.runs.tip_bound.max() + 1e-9


def test_memory_grows_by_the_curves_and_corners_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """About 120 bytes a pose are kept of a corner, 60 of a curve."""
    monkeypatch.setattr(global_runs, "GROUP", 250)
    peaks = []
    for count in (500, 1500):
        points, kind = winding(count), np.full(count, Move.LINEAR)
        kind[::250] = Move.RAPID
        program = Program.from_poses(points[:, :3], points[:, 3:] - points[:, :3], kind=kind, feed=900.0)
        tracemalloc.start()
        assert smooth(program, Settings(method="global")).runs is not None
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] - peaks[0] <= 300 * 1000


@pytest.mark.corpus
def test_a_written_path_has_at_most_a_block_a_pose_and_takes_three_quarters_of_the_time(corpus: Path) -> None:
    """By the planner of finished programs, head and tail of the program among the blocks."""
    whole, times = read(corpus / "hecc_point_zigzag.csv"), []
    program = Program.from_poses(whole.tip[:120], whole.axis[:120], feed=1800.0)
    for method in ("proportional", "global"):
        text, chosen = io.BytesIO(), Settings(method=method)
        written = postprocess(program, text, chosen, form=choose_form("fanuc", "g6.2")).written
        back = read_nc(text.getvalue(), control="fanuc", tolerance=0.01)
        law = plan_text(back, Limits(feed=1800.0), settings=chosen, machine=load_machine("table-ac"))
        times.append(law.total)
    assert written.blocks <= len(program)
    assert times[1] <= 0.75 * times[0]
