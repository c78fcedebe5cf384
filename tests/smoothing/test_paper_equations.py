"""The paper's equations, each by its number: `zhang2016` against formulas that are written down here once more.

``python -m smoothing.mutants`` in this folder's parent shows that these tests fall where an equation is wrong.
"""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial.distance import cdist

import cornersmooth
from cornersmooth.cli import run
from cornersmooth.geometry import nurbs
from cornersmooth.model import LimitedBy, Program, SmoothProgram, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing import self_check, smooth
from cornersmooth.smoothing.construction import Construction
from cornersmooth.smoothing.segments import segments_of
from cornersmooth.smoothing.synchronise import matching_parameters
from cornersmooth.smoothing.zhang2016 import CONSTRUCTION, straying_remainders
from smoothing.mutants import MUTANTS, mutated
from smoothing.paths import random_program

Floats = NDArray[np.float64]
KNOTS = [0, 0, 0, 0, 0.5, 1, 1, 1, 1]
HEIGHT = 10.0
SAMPLE = Path(__file__).parents[2] / "samples" / "paper_table1.csv"
#: Table 2: tolerance; errors of the tip curves of corners 2 and 3, and of their axis-point curves, as computed with
#: the digits of Table 1 (docs/method.md)
TABLE_2 = {
    0.078: ((0.07290, 0.07800), (0.07800, 0.07673)),
    0.15: ((0.07290, 0.12654), (0.07895, 0.13074)),
}


def table_1() -> Program:
    rows = list(csv.reader(SAMPLE.read_text().splitlines()))
    values = np.array([[float(cell) for cell in row[:6]] for row in rows if row[0][:1].isdigit()])
    tip, second = values[:, :3], values[:, 3:]
    return Program.from_poses(tip, second - tip if np.abs(second).max() > 2.0 else second)


def settings_of(tolerance: float = 0.05, *, curves: bool = True) -> Settings:
    """Of curves, which are run at common parameters, or of lines, which are run at v(u)."""
    return Settings(tolerance, HEIGHT, method="zhang2016", round_feed_changes=not curves)


@cache
def smoothed(seed: int, tolerance: float = 0.05, *, curves: bool = True):
    return smooth(random_program(seed, 40), settings_of(tolerance, curves=curves))


def legs(of: SmoothProgram) -> tuple[Floats, Floats, Floats, Floats, Floats, Floats]:
    """Corner, segment into it and out of it, of the tip and then of the axis point, by (1)."""
    program, corners = of.program, of.corners
    top = program.tip + HEIGHT * program.axis
    found = []
    for points in (program.tip, top):
        here = points[corners.pose]
        found += [here, here - points[corners.before], points[corners.after] - here]
    return tuple(found)


def size(vectors: Floats) -> Floats:
    return np.linalg.norm(vectors, axis=-1)


def direction(vectors: Floats) -> Floats:
    return vectors / size(vectors)[..., None]


def half_sine(one: Floats, other: Floats) -> Floats:
    cosine = (direction(one) * direction(other)).sum(axis=-1)
    return np.sin(np.arccos(np.clip(cosine, -1.0, 1.0)) / 2.0)


def curve_point(points: Floats, u: Floats) -> Floats:
    """Equation (3) by another library's basis: control points (5, 3)."""
    return BSpline(KNOTS, points, 3)(u)


def test_eq_3_and_4_basis_on_the_papers_knots() -> None:
    u, points = np.linspace(0.0, 1.0, 101), np.random.default_rng(3).normal(size=(5, 3))
    assert nurbs.evaluate(points[None], u)[0] == pytest.approx(curve_point(points, u))


def test_eq_5_to_9_control_points() -> None:
    found = smoothed(1)
    tips, tops = nurbs.control_points(found.program, found.corners, slice(None), HEIGHT)
    corner_tip, tip_in, tip_out, corner_top, top_in, top_out = legs(found)
    trims = found.corners.trim_in, found.corners.axis_trim_in
    for points, corner, before, behind, trim in (
        (tips, corner_tip, tip_in, tip_out, trims[0]),
        (tops, corner_top, top_in, top_out, trims[1]),
    ):
        length = (trim * size(before))[:, None]
        one, other = length * direction(before), length * direction(behind)
        expected = corner - one, corner - 2.0 / 3.0 * one, corner, corner + 2.0 / 3.0 * other, corner + other
        assert points == pytest.approx(np.stack(expected, axis=1))


def test_eq_10_error_at_the_middle() -> None:
    found = smoothed(2)
    curves = nurbs.control_points(found.program, found.corners, slice(None), HEIGHT)
    _, tip_in, tip_out, _, top_in, top_out = legs(found)
    for points, before, behind, trim, error in (
        (curves[0], tip_in, tip_out, found.corners.trim_in, found.corners.tip_error),
        (curves[1], top_in, top_out, found.corners.axis_trim_in, found.corners.axis_error),
    ):
        length = trim * size(before)
        assert error == pytest.approx(length * half_sine(before, behind) / 3.0)
        middle = np.array([curve_point(one, np.array([0.5]))[0] for one in points])
        assert size(middle - points[:, 2]) == pytest.approx(error)
        assert error.max() <= 0.05 * (1.0 + 1e-9)


def test_eq_11_to_15_length() -> None:
    """Of the construction alone: both curves have the length that ε gives, or half of their shorter segment."""
    program, settings = random_program(3, 60), settings_of()
    found = Construction.smooth(CONSTRUCTION, program, settings)
    _, tip_in, tip_out, _, top_in, top_out = legs(found)
    sine = np.maximum(half_sine(tip_in, tip_out), half_sine(top_in, top_out))
    by_tolerance = 3.0 * 0.05 / sine
    kept = found.corners.extra["size"] >= by_tolerance * (1.0 - 1e-9)  # by the motion, too
    assert kept.sum() > 10
    for before, behind, trims in (
        (tip_in, tip_out, (found.corners.trim_in, found.corners.trim_out)),
        (top_in, top_out, (found.corners.axis_trim_in, found.corners.axis_trim_out)),
    ):
        halves = np.minimum(size(before), size(behind)) / 2.0
        for leg, trim in ((before, trims[0]), (behind, trims[1])):
            length = trim * size(leg)
            assert length[kept] == pytest.approx(np.minimum(halves, by_tolerance)[kept])
            assert (length <= np.minimum(halves, by_tolerance) * (1.0 + 1e-9)).all()


def test_eq_13_and_14_neighbours_share_a_segment() -> None:
    for seed in range(4):
        corners = smooth(random_program(seed, 40, step=0.3), settings_of(0.15)).corners
        assert (corners.limited_by == LimitedBy.SEGMENT).any()
        for before, behind in ((corners.trim_in, corners.trim_out), (corners.axis_trim_in, corners.axis_trim_out)):
            assert (behind[:-1] + before[1:] <= 1.0 + 1e-12).all()
            assert max(before.max(), behind.max()) <= 0.5 + 1e-12


def test_eq_16_and_19_shares_of_the_tolerance() -> None:
    program = random_program(5, 60, step=8.0)
    found = smooth(program, settings_of(0.02))
    _, tip_in, tip_out, _, top_in, top_out = legs(found)
    sines = half_sine(tip_in, tip_out), half_sine(top_in, top_out)
    corners = found.corners
    both = corners.limited_by == LimitedBy.TOLERANCE
    assert both.sum() > 20
    assert (corners.tip_error / corners.axis_error)[both] == pytest.approx((sines[0] / sines[1])[both])
    larger = np.maximum(corners.tip_error, corners.axis_error)
    assert larger.max() <= 0.02 * (1.0 + 1e-9)
    assert np.isclose(larger[both], 0.02, rtol=1e-6).sum() > 10


def brute(tip: Floats, curve: Floats, low: float, high: float) -> tuple[Floats, Floats]:
    """Roots of (21) between two parameters, and the excess on a fine grid, by sampling and secants."""
    v = np.linspace(low, high, 4001)
    excess = size(curve_point(curve, v) - tip) - HEIGHT
    at = np.flatnonzero((excess[:-1] <= 0.0) != (excess[1:] <= 0.0))
    return v[at] - excess[at] * (v[at + 1] - v[at]) / (excess[at + 1] - excess[at]), excess


def random_curves(seed: int, count: int) -> tuple[Floats, Floats]:
    random = np.random.default_rng(seed)
    lever = HEIGHT * direction(random.normal(size=(count, 3)))
    ins, outs = random.normal(size=(2, count, 3)) * 0.5
    unlike = random.uniform(0.6, 1.4, size=(2, count, 1))
    tips = nurbs.five_points(np.zeros_like(lever), ins, outs)
    turn = random.normal(size=(2, count, 3)) * 0.1
    return tips, nurbs.five_points(lever, unlike[0] * ins + turn[0], unlike[1] * outs + turn[1])


@pytest.mark.parametrize("seed", [7, 18])  # the excess of the second turns where Newton would pass the nearest root
def test_eq_20_and_21_roots_in_the_knot_interval_or_what_is_nearest(seed: int) -> None:
    tips, tops = random_curves(seed, 40)
    u = np.linspace(0.0, 1.0, 9)
    v, missing = matching_parameters(tips, tops, u, HEIGHT)
    assert (np.diff(v, axis=1) >= 0.0).all()
    assert (v[:, u < 0.5] <= 0.5).all()
    assert (v[:, u == 0.5] == 0.5).all()
    assert (v[:, u > 0.5] >= 0.5).all()
    with_roots = 0
    for row, (tip_curve, top_curve) in enumerate(zip(tips, tops, strict=True)):
        points, expected = curve_point(tip_curve, u), curve_point(top_curve, v[row])
        assert missing[row] == pytest.approx(np.abs(size(expected - points) - HEIGHT), abs=1e-12)
        for j in np.flatnonzero(u != 0.5):
            before = v[row, j - 1] if j else 0.0
            low, high = max(before, 0.0 if u[j] < 0.5 else 0.5), 0.5 if u[j] < 0.5 else 1.0
            roots, excess = brute(points[j], top_curve, low, high)
            assert missing[row, j] <= np.abs(excess).min() + 1e-9
            if len(roots):
                target = np.clip(before + (u[j] - u[j - 1] if j else 0.0), low, high)
                assert missing[row, j] <= 1e-10
                # the nearest, of which the grid of the search may see two as one
                assert abs(v[row, j] - target) <= np.abs(roots - target).min() + 1.0 / 32.0 + 1e-6
                with_roots += 1
    assert with_roots > 100


def test_eq_20_v_is_u_where_both_curves_are_alike() -> None:
    """A tip and an axis point that move alike: every v = u is a root, and the branch stays on it."""
    tips, _ = random_curves(8, 30)
    tops = tips + HEIGHT * np.array([0.0, 0.6, 0.8])
    u = np.array([0.0, 0.1, 0.37, 0.5, 0.61, 0.9, 1.0])
    v, missing = matching_parameters(tips, tops, u, HEIGHT)
    assert v == pytest.approx(np.tile(u, (30, 1)), abs=1e-9)
    assert missing.max() <= 1e-12


def test_eq_22_axis_leads_from_the_tip_to_the_axis_point_at_v() -> None:
    found = smoothed(11, curves=False)
    rows = np.flatnonzero(found.corners.smoothed)
    tips, tops = nurbs.control_points(found.program, found.corners, rows, HEIGHT)
    u = np.array([0.2, 0.4, 0.5, 0.7, 0.9, 1.0])
    v, _ = matching_parameters(tips, tops, u, HEIGHT)
    points, levers = CONSTRUCTION.points(found, rows, u)
    unlike = 0
    for k in range(len(rows)):
        expected = curve_point(tops[k], v[k, :-1]) - points[k, 1:-1]
        assert levers[k, 1:-1] == pytest.approx(expected)
        unlike += np.abs(v[k] - u).max() > 1e-3
    assert unlike > 5
    at = np.full(len(rows), 0.25)
    v, _ = matching_parameters(tips, tops, np.linspace(0.0, 1.0, 9), HEIGHT)
    axes = CONSTRUCTION.axes(found.program, found.corners, found.settings, rows, at)
    for k in range(len(rows)):
        own = curve_point(tops[k], v[k, [2]]) - curve_point(tips[k], at[:1])
        assert axes[k] == pytest.approx(direction(own)[0])


def test_eq_23_and_18_jumps_and_residuals_are_reported() -> None:
    found = smoothed(12, curves=False)
    rows = np.flatnonzero(found.corners.smoothed)
    tips, tops = nurbs.control_points(found.program, found.corners, rows, HEIGHT)
    v, missing = matching_parameters(tips, tops, np.linspace(0.0, 1.0, 9), HEIGHT)
    assert found.corners.extra["sync_residual"][rows] == pytest.approx(missing.max(axis=1))
    for name, end, at in (("jump_in", 0, 0), ("jump_out", -1, 4)):
        for k, row in enumerate(rows):
            one = direction(tops[k, at] - tips[k, at])
            other = direction(curve_point(tops[k], v[k, [end]])[0] - tips[k, at])
            angle = np.arctan2(size(np.cross(one, other)), one @ other)
            assert found.corners.extra[name][row] == pytest.approx(angle, abs=1e-12)


def test_eq_26_joints_are_those_of_the_straight_motion() -> None:
    found = smoothed(13, curves=False)
    rows = np.flatnonzero(found.corners.smoothed)
    tips, tops = nurbs.control_points(found.program, found.corners, rows, HEIGHT)
    points, levers = CONSTRUCTION.points(found, rows, np.array([0.5, 1.0]))
    for place, at in ((0, 0), (-1, 4)):
        assert points[:, place] == pytest.approx(tips[:, at])
        assert levers[:, place] == pytest.approx(tops[:, at] - tips[:, at])


@pytest.mark.parametrize("number", [2, 3, 7])
def test_eq_24_to_28_remainders_turn_evenly_on_the_great_circle(number: int) -> None:
    found = smoothed(14, curves=False)
    segments = segments_of(found, dense=False)
    pose = np.flatnonzero(segments.has_line & (segments.start >= 0))[1:-1]
    fraction, axis = CONSTRUCTION.divide(found, segments, pose, number)
    top, shares = found.program.tip + HEIGHT * found.program.axis, np.arange(1, number) / number
    even = 0
    for k, at in enumerate(pose):
        start = segments.start[at]
        part = segments.entry[at] + shares * (segments.exit[at] - segments.entry[at])
        assert fraction[k] == pytest.approx(part)  # (24), (25)
        ends = []
        for of_tip, of_top in (
            (segments.entry[at], segments.axis_entry[at]),
            (segments.exit[at], segments.axis_exit[at]),
        ):
            tip = found.program.tip[start] + of_tip * (found.program.tip[at] - found.program.tip[start])
            second = top[start] + of_top * (top[at] - top[start])
            ends.append(direction(second - tip))  # (28)
        angle = np.arccos(np.clip(ends[0] @ ends[1], -1.0, 1.0))  # (26)
        normal = np.cross(ends[0], ends[1])
        if size(normal) < 1e-9:
            continue
        normal = direction(normal)
        for j, share in enumerate(shares):  # (27): Rodrigues
            turned = ends[0] * np.cos(share * angle) + np.cross(normal, ends[0]) * np.sin(share * angle)
            assert size(axis[k, j]) == pytest.approx(1.0)
            assert axis[k, j] @ normal == pytest.approx(0.0, abs=1e-9)
            off = HEIGHT * size(axis[k, j] - turned)
            assert off <= 0.3 * found.settings.tolerance  # where the ruled motion is farther off, it is taken
            even += off < 1e-9
    assert even > len(pose) * (number - 1) / 2


@pytest.mark.parametrize("curves", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_the_motion_keeps_the_tolerance_at_fine_parameters(seed: int, curves: bool) -> None:
    """What no equation promises: tip and axis point stay within ε of their paths, and within 1.8 ε of a common pose."""
    found = smooth(random_program(seed + 20, 30, wobble=0.3), settings_of(0.05, curves=curves))
    rows = np.flatnonzero(found.corners.smoothed)
    assert len(rows) > 20
    u = np.linspace(0.0, 1.0, 81)
    if curves:
        tips, tops = (
            nurbs.evaluate(one, u) for one in nurbs.control_points(found.program, found.corners, rows, HEIGHT)
        )
        levers = tops - tips
    else:
        tips, levers = CONSTRUCTION.points(found, rows, u[1:])
    for k, row in enumerate(rows):
        ends = found.corners.before[row], found.corners.pose[row], found.corners.after[row]
        share = np.linspace(0.0, 1.0, 3001)[:, None]
        path, top = [], []
        for one, other in pairwise(ends):
            tip = found.program.tip[one] + share * (found.program.tip[other] - found.program.tip[one])
            axis = found.program.axis[one] + share * (found.program.axis[other] - found.program.axis[one])
            path.append(tip)
            top.append(tip + HEIGHT * direction(axis))
        path, top = np.concatenate(path), np.concatenate(top)
        second = tips[k] + HEIGHT * direction(levers[k])
        off_tip, off_top = cdist(tips[k], path), cdist(second, top)
        assert off_tip.min(axis=1).max() <= 0.05 * (1.0 + 1e-3)
        assert off_top.min(axis=1).max() <= 0.05 * (1.0 + 2e-2)
        assert np.maximum(off_tip, off_top).min(axis=1).max() <= 1.8 * 0.05 * (1.0 + 2e-2)


def test_corners_are_made_smaller_by_no_more_than_what_just_keeps_the_tolerance() -> None:
    """A little larger, the motion leaves the tolerance somewhere."""
    program, settings = random_program(31, 40, wobble=0.3), settings_of(0.05)
    found = CONSTRUCTION.smooth(program, settings)
    free = CONSTRUCTION.smooth(program, settings.but(tolerance=0.05 * 1.02))
    made_smaller = found.corners.limited_by == LimitedBy.TOLERANCE
    assert made_smaller.sum() > 10
    assert (free.corners.extra["size"][made_smaller] > found.corners.extra["size"][made_smaller]).all()


@pytest.mark.parametrize("curves", [True, False])
def test_bounds_let_nothing_pass_that_is_measured(curves: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """Curves are run at common parameters, where Q is off H by more than at v(u)."""
    program, settings = cornersmooth.read(SAMPLE.with_name("impeller.cls")), settings_of(0.01, curves=curves)
    found = CONSTRUCTION.smooth(program, settings).corners
    exact = self_check.bounded

    def none(*given: Any) -> tuple[Floats, Floats]:
        own, share = exact(*given)
        return own, np.full_like(share, np.inf)

    monkeypatch.setattr(self_check, "bounded", none)
    measured = CONSTRUCTION.smooth(program, settings).corners
    assert (found.status == measured.status).all()
    rows = found.smoothed
    assert rows.sum() > 200
    assert found.extra["size"][rows] == pytest.approx(measured.extra["size"][rows], rel=1e-9)


@pytest.mark.parametrize("tolerance", TABLE_2)
def test_table_2_through_the_command(tolerance: float, tmp_path: Path) -> None:
    out, table = tmp_path / "o.nc", tmp_path / "corners.csv"
    arguments = ["smooth", SAMPLE, "-e", tolerance, "-f", "g6.2", "--digits", 6, "--method", "zhang2016", "-o", out]
    assert run([*map(str, arguments), "--report", str(table)]) == 0
    rows = list(csv.DictReader(table.read_text().splitlines()))
    for name, expected in zip(("tip_error_mm", "axis_error_mm"), TABLE_2[tolerance], strict=True):
        assert [float(row[name]) for row in rows] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("tolerance", TABLE_2)
def test_table_2_of_the_construction(tolerance: float) -> None:
    corners = smooth(table_1(), settings_of(tolerance)).corners
    assert corners.tip_error == pytest.approx(TABLE_2[tolerance][0], abs=1e-5)
    assert corners.axis_error == pytest.approx(TABLE_2[tolerance][1], abs=1e-5)
    assert (corners.extra["sync_residual"] > 1e-6).all(), "there is no exact root on this table"


def test_what_is_left_of_a_segment_is_looked_at() -> None:
    """The tip leaves the corner far ahead of the axis, which turns fastest in the middle of its segment."""
    tip = np.array([[-50.7695, 18.9255, -18.034], [-28.7223, 42.7584, -51.656], [-28.7985, 42.5602, -51.3588]])
    axis = np.array([[0.85034, 0.0523, 0.52363], [0.49832, -0.82776, 0.25784], [0.74856, 0.10228, 0.65513]])
    program = Program.from_poses(tip, axis, feed=1000.0)
    settings = Settings(tolerance=0.031, axis_tolerance=2.959, method="zhang2016")
    found = CONSTRUCTION.smooth(program, settings)
    corners = found.corners
    unlike = replace(corners, axis_trim_in=corners.axis_trim_in.copy())
    assert not len(straying_remainders(found)) or corners.status[0] == Status.SMOOTHED
    unlike.axis_trim_in[:] = 3.0 * unlike.trim_in + 0.1
    assert straying_remainders(replace(found, corners=unlike)).tolist() == [0]
    whole = smooth(program, settings)
    assert whole.corners.smoothed.all()
    assert not len(straying_remainders(whole))


def test_mutants_are_faults_of_the_source_as_it_is() -> None:
    for mutant in MUTANTS:
        assert mutated(mutant)


def test_docs_and_code_name_the_same_equations() -> None:
    """Each row of the table in docs/method.md names functions whose modules name the equations."""
    text = (Path(__file__).parents[2] / "docs" / "method.md").read_text()
    package = Path(cornersmooth.__file__).parent
    rows = re.findall(r"^\| (\(\d.*?) \| [^|]* \| (`.*?) \|$", text, re.MULTILINE)
    named: set[int] = set()
    for equations, places in rows:
        numbers = [int(number) for number in re.findall(r"\d+", equations)]
        wanted = {*range(numbers[0], numbers[-1] + 1)} if "to" in equations else {*numbers}
        named |= wanted
        for functions, file in re.findall(r"((?:`\w+`(?:, )?)+) in `([\w/]+\.py)`", places):
            source = (package / (file if "/" in file else f"smoothing/{file}")).read_text()
            for function in re.findall(r"\w+", functions):
                assert re.search(rf"def {function}\(", source), (function, file)
        source = "".join(
            (package / (file if "/" in file else f"smoothing/{file}")).read_text()
            for file in re.findall(r"`([\w/]+\.py)`", places)
        )
        spelt = {int(number) for number in re.findall(r"\((\d+)\)", source)}
        for one, other in re.findall(r"\((\d+)\) to \((\d+)\)", source):
            spelt |= {*range(int(one), int(other) + 1)}
        assert wanted <= spelt, (equations, wanted - spelt)
    assert named == {*range(1, 29)}
