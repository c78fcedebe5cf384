"""Curves of corners in rotary words, evaluated with scipy's B-splines and compared with both motions."""

from __future__ import annotations

import io
import sys
from dataclasses import dataclass, replace
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

import cornersmooth
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.geometry import nurbs
from cornersmooth.kinematics import Machine, load_machine, machine_names, tool_axis
from cornersmooth.model import Move, Program, SmoothProgram
from cornersmooth.nc import Form, choose_form, fit_settings, write
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.rotary_curve_rows import rotary_curve_rows
from cornersmooth.settings import Settings
from cornersmooth.slices import joined_rows
from cornersmooth.smoothing import smooth
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.smoothing.segments import segments_of
from oracle.loops import bytecodes
from oracle.share import covering_share

TOLERANCE = 0.01  # mm
SAMPLES = Path(__file__).parents[2] / "samples"
KNOTS5 = np.array([0, 0, 0, 0, 0.5, 1, 1, 1, 1])
U = np.linspace(0, 1, 129)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def endless(name: str) -> Machine:
    machine = load_machine(name)
    return replace(machine, axes=tuple(replace(axis, limits=None) for axis in machine.axes))


@dataclass(frozen=True)
class Piece:
    """A line, of two control points, or a curve."""

    move: int
    knots: np.ndarray  # whole vector, from 0 to 1
    weights: np.ndarray
    tip: np.ndarray
    angles: np.ndarray

    def derivatives(self, values: np.ndarray, u: float) -> list[np.ndarray]:
        """Value and first two derivatives by u."""
        degree = len(self.knots) - len(self.weights) - 1
        curve = BSpline(self.knots, np.column_stack((values * self.weights[:, None], self.weights)), degree)
        p0, p1, p2 = (curve(u, nu) for nu in range(3))
        v0 = p0[:-1] / p0[-1]
        v1 = (p1[:-1] - p1[-1] * v0) / p0[-1]
        return [v0, v1, (p2[:-1] - p2[-1] * v0 - 2 * p1[-1] * v1) / p0[-1]]

    def at(self, values: np.ndarray, u: np.ndarray) -> np.ndarray:
        degree = len(self.knots) - len(self.weights) - 1
        both = BSpline(self.knots, np.column_stack((values * self.weights[:, None], self.weights)), degree)(u)
        return both[:, :-1] / both[:, -1:]

    def per_length(self, u: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles and their first two derivatives by the length of the tip curve at one of its ends."""
        _, tip1, tip2 = self.derivatives(self.tip, u)
        value, one, two = self.derivatives(self.angles, u)
        speed = np.linalg.norm(tip1)
        slope = one / speed
        return value, slope, (two - slope * (tip2 @ tip1) / speed) / speed**2


@dataclass(frozen=True)
class Written:
    pieces: list[Piece]
    findings: dict[str, int]
    smoothed: SmoothProgram

    @property
    def curves(self) -> dict[int, Piece]:
        """Curves by the poses of their corners."""
        return {piece.move: piece for piece in self.pieces if len(piece.weights) > 2}


def form_of(machine: Machine) -> Form:
    return choose_form("fanuc", "g6.2", machine=machine)


def smoothed_for(program: Program, machine: Machine, **changes: object) -> SmoothProgram:
    settings = Settings(tolerance=TOLERANCE, method="proportional", **changes)  # type: ignore[arg-type]
    return smooth(program, fit_settings(settings, form_of(machine), "mm"))


def pieces_of(smoothed: SmoothProgram, machine: Machine) -> Written:
    findings = Findings()
    chunks = list(rotary_curve_rows(smoothed, form_of(machine), findings))
    names = ("tip", "other", "move", "curve")
    tip, other, move, curve = (np.concatenate([vars(chunk)[name] for chunk in chunks]) for name in names)
    none = [np.zeros((len(chunk.move), 3)) if chunk.spline is None else chunk.spline for chunk in chunks]
    spline, found, row = np.concatenate(none), [], 1 if len(move) and curve[0] == 0 else 0
    while row < len(move):
        stop = row + 1
        if curve[row]:
            while stop < len(move) and curve[stop] > 1:
                stop += 1
            knots = np.concatenate((spline[row:stop, 0], [spline[stop - 1, 2]] * 4))
            np.testing.assert_array_equal(spline[row:stop, :2], np.round(spline[row:stop, :2], 3))
            own, weights = slice(row, stop), spline[row:stop, 1]
        else:
            knots, own, weights = np.array([0.0, 0.0, 1.0, 1.0]), slice(row - 1, stop), np.ones(2)
        found.append(Piece(int(move[row]), knots / knots[-1], weights, tip[own], other[own]))
        row = stop
    for one, following in pairwise(found):
        np.testing.assert_allclose(one.angles[-1], following.angles[0], atol=1e-6)
    return Written(found, {item.code: item.count for item in findings.all()}, smoothed)


def checked(program: Program, machine: Machine, **changes: object) -> Written:
    """Tips are those of the smoothed corners, and all of the motion is within ε of the original one."""
    smoothed = smoothed_for(program, machine, **changes)
    written = pieces_of(smoothed, machine)
    corners, height = smoothed.corners, smoothed.settings.axis_length
    rows = np.flatnonzero(corners.smoothed)
    assert len(written.curves) + written.findings.get("CS378", 0) == len(rows)
    assert "CS369" not in written.findings
    fives = nurbs.control_points(smoothed.program, corners, rows, height)[0]
    for five, row in zip(fives, rows, strict=True):
        if piece := written.curves.get(int(corners.pose[row])):
            w1, w2 = corners.weights[row]
            expected = replace(piece, knots=KNOTS5, weights=np.array([1, w1, w2, w1, 1]))
            np.testing.assert_allclose(piece.at(piece.tip, U), expected.at(five, U), atol=1e-9)
    new = []
    for piece in written.pieces:
        tip, words = (
            piece.at(values, U[:: 8 if len(piece.weights) == 2 else 2]) for values in (piece.tip, piece.angles)
        )
        new.append(np.hstack((tip, height * tool_axis(machine, words))))
    share, old = np.linspace(0, 1, 3001)[:, None], []
    for pose in np.flatnonzero(program.kind[1:] == Move.LINEAR):
        tip, axis = (one[pose] * (1 - share) + one[pose + 1] * share for one in (program.tip, program.axis))
        old.append(np.hstack((tip, height * unit(axis))))
    places, grain = np.concatenate(old), max(np.linalg.norm(np.diff(part, axis=0), axis=1).max() for part in old)
    moved = np.concatenate(new)
    off = moved[:, None] - places[cKDTree(places).query(moved, k=60)[1]]
    at_tip, at_axis_point = np.linalg.norm(off[..., :3], axis=2), np.linalg.norm(off[..., :3] + off[..., 3:], axis=2)
    assert np.maximum(at_tip, at_axis_point).min(axis=1).max() <= TOLERANCE + grain
    return written


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


@pytest.mark.corpus
@pytest.mark.parametrize("name", machine_names())
def test_fan_path_of_the_literature(corpus: Path, name: str):
    rows = np.loadtxt(corpus / "hust_5x_toolpath_fan.txt")
    for weights in ((1.0, 1.0), (1.0, 0.6)):
        written = checked(Program.from_poses(rows[:, :3], rows[:, 3:]), load_machine(name), weights=weights)
        assert "CS378" not in written.findings
        assert max(len(piece.weights) for piece in written.pieces) <= 11
        assert written.findings.get("CS367", 0) < 25


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
    weights = (1.0, 0.7) if spread == 0.02 else (1.0, 1.0)
    checked(random_chain(machine_names().index(name), tilt, spread), endless(name), weights=weights)


@pytest.mark.parametrize("changes", [{"ratio": 0.6}, {"ratio": 0.8, "weights": (1.3, 0.4)}, {"axis_length": 40.0}])
def test_other_ratios_and_shapes(changes: dict[str, object]):
    assert "CS378" not in checked(random_chain(5, 25, 0.05), load_machine("table-bc"), **changes).findings


def test_gentle_motion_needs_five_points_and_joins_straight_lines_with_its_curvature():
    machine = load_machine("table-ac")
    n = 30
    tip = np.stack((np.arange(n) * 3.0, np.cumsum(np.arange(n) % 2), np.zeros(n)), axis=1)
    axis = zigzag(20 + np.linspace(0, 8, n) + 0.2 * (np.arange(n) % 3), np.linspace(0, 10, n), n).axis
    written = checked(Program.from_poses(tip, axis), machine)
    assert [len(piece.weights) for piece in written.curves.values()] == [5] * (n - 2)
    assert sum(len(piece.weights) == 2 for piece in written.pieces) == n - 1  # none is divided
    for before, curve, after in zip(written.pieces, written.pieces[1:], written.pieces[2:], strict=False):
        if len(curve.weights) == 2:
            continue
        # the angles in the middle are those of the corner's axis
        np.testing.assert_allclose(tool_axis(machine, curve.angles[2:3])[0], axis[curve.move], atol=1e-12)
        for u, line in ((0.0, before), (1.0, after)):
            _, slope, bend = curve.per_length(u)
            along = np.diff(line.angles, axis=0)[0] / np.linalg.norm(np.diff(line.tip, axis=0))
            np.testing.assert_allclose(slope, along, atol=1e-9)
            np.testing.assert_allclose(bend, 0, atol=1e-6 * np.abs(along).max())


@pytest.mark.parametrize(("tilt", "step"), [(30.0, 7.5), (3.0, 23.0)])
def test_joints_of_fitted_curves(tilt: float, step: float):
    """Neighbouring curves, and curves and lines, share angles, rates and curvature, which is none along lines."""
    machine = endless("nutated-bc")
    steps = np.where(np.arange(60) % 6 == 3, 2.0, 1.0)  # shorter segments are all transition, longer ones are not
    way = np.cumsum(steps)
    tip = np.stack((0 * way, 0 * way, 0.02 * way), axis=1)
    written = checked(Program.from_poses(tip, zigzag(tilt, way * step, 60).axis), machine)
    assert sum(len(piece.weights) > 5 for piece in written.curves.values()) > 20
    with_line = without = bent = 0
    for one, other in pairwise(written.pieces):
        value, slope, bend = one.per_length(1.0)
        next_value, next_slope, next_bend = other.per_length(0.0)
        if len(one.weights) == len(other.weights) == 2:
            continue
        scale = np.abs(slope).max() + np.abs(bend).max() + 1
        np.testing.assert_allclose(next_value, value, atol=1e-9)
        np.testing.assert_allclose(next_slope, slope, atol=1e-6 * scale)
        np.testing.assert_allclose(next_bend, bend, atol=1e-6 * scale)
        if min(len(one.weights), len(other.weights)) == 2:
            with_line += 1
        else:
            without += 1
            bent += bool(np.abs(bend).max() > 1e-3)
    assert with_line > 5
    assert without > 20
    assert bent > 20


@pytest.mark.parametrize("name", machine_names())
def test_straight_through_the_pole_first_axis_rests(name: str):
    written = checked(zigzag(np.linspace(-20, 20, 41), 30.0), endless(name))
    assert {len(piece.weights) for piece in written.pieces} == {2, 5}
    assert "CS367" not in written.findings
    assert max(np.abs(np.diff(piece.angles, axis=0)).max() for piece in written.pieces) < 1.5


@pytest.mark.parametrize(
    ("name", "aside", "n"),
    covering_share(product(["table-ac", "nutated-bc"], [1e-9, 1e-4, 0.005, 0.02, 0.03, 0.1, 0.5, 2.0], [9, 41]), 5),
)
def test_beside_the_pole(name: str, aside: float, n: int):
    program = zigzag(np.linspace(-23, 20, n), 30.0, n)
    axis = program.axis + np.radians(aside) * np.array([-0.5, np.sqrt(0.75), 0])
    written = checked(Program.from_poses(program.tip, axis), endless(name))
    assert written.findings.get("CS378", 0) <= 1


def test_bend_at_the_pole():
    """In at azimuth 0, out at azimuth 90: C turns by a right angle inside one rounded corner, no pose jumps."""
    tilt = np.concatenate((np.linspace(10, 0, 21), np.linspace(0, 10, 21)[1:]))
    written = checked(zigzag(tilt, np.where(np.arange(41) < 20, 0.0, 90.0)), load_machine("table-ac"))
    assert "CS378" not in written.findings
    assert abs(written.pieces[-1].angles[-1, 0] - written.pieces[0].angles[0, 0]) == pytest.approx(90)


def test_limits_hold_on_curves_too():
    machine, program = load_machine("table-ac"), random_chain(8, 30, 0.08)
    free = checked(program, machine)
    highest = max(piece.angles[:, 1].max() for piece in free.pieces)
    reached = max(piece.at(piece.angles, U)[:, 1].max() for piece in free.pieces)
    first, second = machine.axes
    narrow = replace(machine, axes=(first, replace(second, limits=(-5.0, highest))))
    assert "CS378" not in checked(program, narrow).findings
    # a curve keeps a limit only where its control points do
    close = replace(machine, axes=(first, replace(second, limits=(-5.0, reached + 1e-3))))
    lined = checked(program, close)
    assert max(piece.angles[:, 1].max() for piece in lined.pieces) <= reached + 2e-3
    low = replace(machine, axes=(first, replace(second, limits=(-5.0, reached - 2.0))))
    with pytest.raises(InputError, match="A would have to go to"):
        pieces_of(smoothed_for(program, low), low)


def test_sharp_corners_rapids_and_repeated_poses():
    program = random_chain(4, 20, 0.05, 30)
    tip, axis = np.repeat(program.tip, 2, axis=0), np.repeat(program.axis, 2, axis=0)
    keep = np.arange(60) % 2 == np.isin(np.arange(60) // 2, (3, 9, 10, 20))
    keep |= np.arange(60) % 2 == 0
    tip, axis = tip[keep], axis[keep]
    kind = np.full(len(tip), Move.LINEAR, np.uint8)
    kind[[0, 14, 15]] = Move.FROM, Move.RAPID, Move.RAPID
    program = Program.from_poses(tip, axis, kind=kind, feed=np.where(np.arange(len(tip)) < 24, 100.0, 200.0))
    machine = load_machine("head-table-bc")
    smoothed = smoothed_for(program, machine)
    written = pieces_of(smoothed, machine)
    assert 0 < smoothed.corners.smoothed.sum() < len(smoothed.corners)
    assert len(written.curves) == smoothed.corners.smoothed.sum()
    poses = written.smoothed.program
    ends = [piece for piece in written.pieces if len(piece.weights) == 2 and piece.move not in written.curves]
    reached = np.array([piece.tip[-1] for piece in ends])
    sharp = np.setdiff1d(np.arange(2, len(poses)), [*written.curves])
    for pose in sharp[~segments_of(smoothed, dense=False).skip[sharp]]:
        near = np.flatnonzero(np.linalg.norm(reached - poses.tip[pose], axis=1) < 1e-9)
        assert len(near)
        np.testing.assert_allclose(tool_axis(machine, ends[near[0]].angles[-1:])[0], poses.axis[pose], atol=1e-9)


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
    program = Program.from_poses(tip, unit(axis))
    settings = fit_settings(Settings(tolerance=TOLERANCE, method="proportional"), form_of(machine), "mm")
    with pytest.raises(InputError, match="turns by"):  # it is refused before it comes to that
        smooth(program, settings)
    smoothed = construction_of(settings.method).smooth(program, settings, None)
    told = write(smoothed, io.BytesIO(), form=form_of(machine)).findings
    assert [finding.count for finding in told if finding.code == "CS369"] == ([1] if aside < 1e-9 else [])


@pytest.mark.parametrize("n", [1, 2])
def test_paths_without_corners(n: int):
    program = Program.from_poses(np.arange(3.0 * n).reshape(n, 3), np.tile([0, 0.1, 1], (n, 1)))
    machine = load_machine("table-ac")
    assert len(pieces_of(smoothed_for(program, machine), machine).pieces) == n - 1


@pytest.mark.parametrize("axis", [[0, 0, 1], [0, 0.5, 1]])
def test_fixed_axis_keeps_its_angles(axis: list[float]):
    written = checked(Program.from_poses(random_chain(1, 0, 0).tip, np.tile(axis, (40, 1))), load_machine("table-ac"))
    assert {len(piece.weights) for piece in written.curves.values()} == {5}
    assert max(np.ptp(piece.angles, axis=0).max() for piece in written.pieces) < 1e-9


def test_two_parameters_are_refused():
    machine = load_machine("table-ac")
    smoothed = smooth(random_chain(1, 20, 0.01), Settings(method="zhang2016"))
    with pytest.raises(SettingsError, match="method zhang2016 has no curves in rotary axes"):
        pieces_of(smoothed, machine)


def test_long_paths_are_made_without_a_loop_over_corners():
    rng = np.random.default_rng(1)
    n = 10_002
    t = np.linspace(0, 30, n)
    tip = np.cumsum(rng.normal(size=(n, 3)) * 0.3 + [1, 0, 0], axis=0)
    axis = zigzag(25 + 10 * np.sin(t), 115 * np.sin(0.7 * t), n).axis + rng.normal(size=(n, 3)) * 0.002
    machine = load_machine("table-ac")
    smoothed = smoothed_for(Program.from_poses(tip, axis), machine)

    def rows() -> list[object]:
        return list(rotary_curve_rows(smoothed, form_of(machine), Findings()))

    assert bytecodes(rows) < 30 * n  # of rounds over arrays: a loop takes hundreds
    counts = [len(piece.weights) for piece in pieces_of(smoothed, machine).curves.values()]
    assert len(counts) == n - 2
    assert (np.array(counts) == 5).mean() > 0.9


@pytest.mark.parametrize(("method", "tolerance"), [("proportional", 0.01), ("proportional", 0.002), ("global", 0.01)])
def test_curves_in_small_parts_are_those_in_one(method: str, tolerance: float, monkeypatch: pytest.MonkeyPatch) -> None:
    form = choose_form("siemens", "bspline", machine=load_machine("xyzac-trt"))
    program = cornersmooth.read(SAMPLES / "impeller.cls")
    smoothed = smooth(program, fit_settings(Settings(tolerance=tolerance, method=method), form, program.units))
    found = []
    for together in (60, 1_000_000):
        monkeypatch.setattr(sys.modules["cornersmooth.nc.rotary_curve_rows"], "_TOGETHER", together)
        findings = Findings()
        rows = joined_rows(
            [
                replace(part, spline=np.zeros((len(part.move), 3)) if part.spline is None else part.spline)
                for part in rotary_curve_rows(smoothed, form, findings)
                if len(part.move)
            ]
        )
        found.append((rows, {finding.code: finding for finding in findings.all()}))
    (rows, others), (whole, noted) = found
    assert (whole.curve > 0).any()
    assert others == noted
    for name in ("move", "curve", "joined"):
        np.testing.assert_array_equal(getattr(rows, name), getattr(whole, name), name)
    np.testing.assert_allclose(rows.tip, whole.tip, atol=1e-9)
    # of a line between two parts one joint is not known yet: the curve before may end a little slower or faster
    np.testing.assert_allclose(rows.other, whole.other, atol=1e-4)
