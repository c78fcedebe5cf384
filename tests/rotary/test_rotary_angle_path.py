"""Rotary angles along paths: continuity, limits, the pole."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine, load_machine, machine_names, poses, tool_axis
from cornersmooth.kinematics.poses import angle_between
from cornersmooth.model import Move, rapid_moves, still_poses
from cornersmooth.rotary import angle_path, filled_path, rotary_angles
from cornersmooth.rotary.angle_path import RotaryPath
from oracle.messages import one_line
from oracle.share import covering_share

TOLERANCE = 0.02  # degrees


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def tilted(tilt: np.ndarray | float, azimuth: np.ndarray | float) -> np.ndarray:
    tilt, azimuth = np.broadcast_arrays(np.radians(tilt), np.radians(azimuth))
    return np.stack((np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), np.cos(tilt)), axis=1)


def line_of(n: int, length: float = 50.0) -> np.ndarray:
    return np.stack((np.linspace(0, length, n), np.zeros(n), np.zeros(n)), axis=1)


def limited(name: str, *limits: tuple[float, float] | None, preferred: tuple[str, float] | None = None) -> Machine:
    machine = load_machine(name)
    first, second = (replace(axis, limits=limit) for axis, limit in zip(machine.axes, limits, strict=True))
    return replace(machine, axes=(first, second), preferred=preferred)


def deviation(machine: Machine, path: RotaryPath, axis: np.ndarray) -> np.ndarray:
    """(n,) degrees between the axes that the angles give and the given ones."""
    return angle_between(tool_axis(machine, path.angles), axis)


def test_fan_path_of_the_literature():
    """Zhang 2021 Table B.1 (IJMS), points 1 to 3 of the path that HUST publishes with six decimals."""
    axis = unit(np.array([[-0.107258, 0.624902, 0.773300], [-0.003002, 0.653008, 0.757345]]))
    path = rotary_angles(load_machine("xyzac-trt"), np.zeros((2, 3)), axis, tolerance=TOLERANCE)
    # The table prints 39.3488 / -9.7393 for the first.
    np.testing.assert_allclose(path.angles[0], [-9.7393, 39.3488], atol=5e-5)
    assert deviation(load_machine("xyzac-trt"), path, axis).max() < 1e-9
    assert path.findings == ()


@pytest.mark.corpus
def test_fan_path_stays_as_it_is(corpus: Path):
    rows = np.loadtxt(corpus / "hust_5x_toolpath_fan.txt")
    axis = unit(rows[:, 3:])
    path = rotary_angles(load_machine("xyzac-trt"), rows[:, :3], axis, tolerance=TOLERANCE)
    np.testing.assert_allclose(tool_axis(load_machine("xyzac-trt"), path.angles), axis, atol=1e-12)
    c, a = path.angles.T
    np.testing.assert_allclose(a, np.degrees(np.arccos(axis[:, 2])), atol=1e-6)
    assert np.abs(np.diff(c)).max() < 15


@pytest.mark.corpus
@pytest.mark.parametrize("name", ["table-ac", "table-bc", "head-ac", "head-table-bc"])
def test_impeller_blade(corpus: Path, name: str):
    text = (corpus / "hust_5x_impeller_yelun.cls").read_text()
    rows = np.array(
        [[float(n) for n in line.split("/")[1].split(",")] for line in text.splitlines() if line.startswith("GOTO/")]
    )
    tip, axis = rows[:, :3], unit(rows[:, 3:])
    machine = load_machine(name)
    path = rotary_angles(machine, tip, axis, tolerance=TOLERANCE)
    assert len(path.angles) > 40
    np.testing.assert_allclose(tool_axis(machine, path.angles), axis, atol=1e-12)
    filled, jumps = filled_path(machine, tip, axis, path.angles, tolerance=TOLERANCE)
    assert len(jumps) == 0
    assert np.abs(np.diff(filled.angles, axis=0)).max() < 5


@pytest.mark.parametrize("name", machine_names())
def test_smooth_paths_stay_smooth(name: str):
    """On a spiral well away from the pole no step exceeds what the axis turns by, magnified by the tilt."""
    machine = load_machine(name)
    n = 20_000
    axis = tilted(25 + 10 * np.sin(np.linspace(0, 40, n)), np.linspace(0, 4000, n))
    path = rotary_angles(machine, line_of(n), axis, tolerance=TOLERANCE) if name != "head-ac" else None
    if path is None:  # C is limited to one turn each way there
        with pytest.raises(InputError, match="C would have to go to"):
            rotary_angles(machine, line_of(n), axis, tolerance=TOLERANCE)
        return
    np.testing.assert_allclose(tool_axis(machine, path.angles), axis, atol=1e-12)
    step = np.abs(np.diff(path.angles, axis=0)).max()
    assert step < angle_between(axis[1:], axis[:-1]).max() * 5
    assert abs(np.ptp(path.angles[:, 0]) - 4000) < 60
    assert path.findings == ()


def test_straight_through_the_pole_first_axis_rests():
    for name in machine_names():
        machine = load_machine(name)
        axis = tilted(np.linspace(-20, 20, 41), 30.0)
        path = rotary_angles(machine, line_of(41), axis, tolerance=TOLERANCE)
        assert np.abs(np.diff(path.angles[:, 1])).max() < 1.5
        assert np.ptp(path.angles[:, 0]) < (1e-9 if name != "nutated-bc" else 25)
        assert deviation(machine, path, axis).max() < 1e-9
        assert path.findings == ()


@pytest.mark.parametrize("name", machine_names())
@pytest.mark.parametrize("aside", [0.0, 1e-9, 1e-4, 0.005, 0.0099, 0.0101, 0.03, 0.5])
def test_through_the_pole_within_tolerance(name: str, aside: float):
    """Blocks that run linearly in their words stay within the tolerance of the ruled motion, whatever they pass by."""
    machine = load_machine(name)
    axis = unit(tilted(np.linspace(-23, 20, 9), 30.0) + np.radians(aside) * np.array([-0.5, np.sqrt(0.75), 0]))
    tip = line_of(9)
    path = rotary_angles(machine, tip, axis, tolerance=TOLERANCE)
    assert deviation(machine, path, axis).max() <= TOLERANCE
    filled, jumps = filled_path(machine, tip, axis, path.angles, tolerance=TOLERANCE, max_step=5.0)
    assert len(jumps) == 0
    assert np.abs(np.diff(filled.angles, axis=0)).max() <= 5.0 + 1e-9
    # Our own walk along every block, against the ruled motion between the original poses.
    share = np.linspace(0, 1, 33)[:, None, None]
    words = (filled.angles[:-1] * (1 - share) + filled.angles[1:] * share).reshape(-1, 2)
    along = (filled.tip[:-1, 0] * (1 - share[:, :, 0]) + filled.tip[1:, 0] * share[:, :, 0]).ravel()
    segment = np.clip(np.searchsorted(tip[:, 0], along, side="right") - 1, 0, 7)
    part = ((along - tip[segment, 0]) / (tip[segment + 1, 0] - tip[segment, 0]))[:, None]
    wanted = unit(axis[segment] * (1 - part) + axis[segment + 1] * part)
    assert angle_between(tool_axis(machine, words), wanted).max() <= TOLERANCE * 1.02
    assert filled.inserted.sum() < 150


def test_bend_at_the_pole_turns_inside_the_cone():
    """In at azimuth 0, out at azimuth 90: the first axis turns by a right angle, on poses that stand at the pole."""
    tilt = np.concatenate((np.linspace(10, 0, 21), np.zeros(10), np.linspace(0, 10, 21)))
    azimuth = np.where(np.arange(52) < 26, 0.0, 90.0)
    machine = load_machine("table-ac")
    path = rotary_angles(machine, line_of(52), tilted(tilt, azimuth), tolerance=TOLERANCE, line=np.arange(52) + 100)
    c, a = path.angles.T
    assert np.ptp(c[:20]) < 1e-9
    assert np.ptp(c[32:]) < 1e-9
    assert abs(c[-1] - c[0]) == pytest.approx(90)
    assert np.abs(np.diff(c)).max() < 90 / 10
    assert np.abs(a[20:32]).max() < 1e-9
    (finding,) = path.findings
    assert finding.code == "CS363"
    assert finding.count == 1
    assert 121 <= finding.line <= 131
    assert re.search(r"within 0 deg of the pole of C, .* 8\.182 deg in one move, 8\.345 deg/mm", finding.text)


def test_near_miss_is_reported_with_its_rate():
    axis = unit(tilted(np.linspace(-10, 10, 41), 0.0) + np.array([0, np.radians(0.1), 0]))
    path = rotary_angles(load_machine("table-ac"), line_of(41, 40.0), axis, tolerance=TOLERANCE)
    (finding,) = path.findings
    turn = np.degrees(np.arctan2(np.sin(np.radians(0.5)), np.radians(0.1)))
    assert f"within 0.1 deg of the pole of C, which turns fast there: {turn:.4g} deg in one move" in finding.text


def test_upright_program_does_not_turn():
    for name in machine_names():
        path = rotary_angles(load_machine(name), line_of(50), tilted(np.zeros(50), 0.0), tolerance=TOLERANCE)
        assert np.abs(path.angles).max() == 0


def test_upright_cuts_wait_where_they_will_be_needed():
    """Cut 1 leans, cut 2 stands upright, cut 3 starts upright and leans over the other way."""
    tilt = np.concatenate((np.full(5, 20.0), np.zeros(5), [0.0, 0, 10, 20, 30]))
    azimuth = np.concatenate((np.full(5, 10.0), np.zeros(5), np.full(5, 40.0)))
    rapid = np.isin(np.arange(15), [0, 5, 10])
    machine = load_machine("table-ac")
    path = rotary_angles(machine, line_of(15), tilted(tilt, azimuth), tolerance=TOLERANCE, rapid=rapid)
    c = path.angles[:, 0]
    assert np.ptp(c[:10]) < 1e-9
    assert np.ptp(c[10:]) < 1e-9
    assert c[10] - c[9] == pytest.approx(30)


@pytest.mark.parametrize("name", ["table-bc", "head-ac", "nutated-bc"])
def test_holes_near_the_pole_are_not_left_to_the_tolerance(name: str):
    """Nothing is cut on the way through: a rapid to another axis, another hole, a cut and the hole behind it."""
    kind = np.array([Move.RAPID, Move.HOLE, Move.HOLE, Move.RAPID, Move.LINEAR, Move.HOLE, Move.LINEAR], np.uint8)
    axis = tilted([15.0, 1.6, 0.0, 1.0, 2.0, 1.0, 1.0], [180.0, 3.0, 0.0, 90.0, 90.0, 210.0, 210.0])
    how = {"tolerance": 5.0, "rapid": rapid_moves(kind), "still": still_poses(kind)}
    path = rotary_angles(load_machine(name), line_of(7), axis, **how)
    assert still_poses(kind).tolist() == [True, True, True, False, False, True, False]
    assert deviation(load_machine(name), path, axis)[still_poses(kind)].max() < 1e-9
    assert deviation(load_machine(name), path, axis).max() <= 5.0
    # where digits do not tell the axis from the pole the first angle waits
    near = tilted([15.0, 4e-5, 15.0], [180.0, 3.0, 170.0])
    how = {"tolerance": 5.0, "rapid": np.ones(3, np.bool_), "still": np.ones(3, np.bool_), "still_tolerance": 1e-4}
    path = rotary_angles(load_machine(name), line_of(3), near, **how)
    assert path.angles[1, 0] == path.angles[0, 0]
    assert deviation(load_machine(name), path, near).max() <= 1e-4


def test_start_looks_ahead_to_the_end_of_the_cut():
    """C from 170 on by 100 deg: from 170 the limit would be passed, from -190 it is not."""
    machine = limited("table-ac", (-200, 200), (-100, 100))
    azimuth = np.linspace(80, 180, 101) - 180  # C of the branch with A > 0 is azimuth + 90
    axis = tilted(30.0, azimuth + 180)
    path = rotary_angles(machine, line_of(101), axis, tolerance=TOLERANCE)
    assert path.angles[:, 0].min() >= -200
    assert path.angles[:, 0].max() <= 200
    np.testing.assert_allclose(tool_axis(machine, path.angles), axis, atol=1e-12)
    assert np.abs(np.diff(path.angles, axis=0)).max() < 1.01


def test_other_solution_is_taken_where_the_limit_of_the_tilt_asks_for_it():
    machine = load_machine("xyzac-trt")  # A from -100 to 50, positive preferred
    axis = tilted(np.linspace(20, 60, 50), 0.0)
    path = rotary_angles(machine, line_of(50), axis, tolerance=TOLERANCE)
    assert path.angles[:, 1].max() < 0
    np.testing.assert_allclose(tool_axis(machine, path.angles), axis, atol=1e-12)
    assert rotary_angles(machine, line_of(30), axis[:30], tolerance=TOLERANCE).angles[:, 1].min() > 0


@pytest.mark.parametrize(("sign", "want"), [(1.0, 30.0), (-1.0, -30.0)])
def test_preferred_solution(sign: float, want: float):
    machine = limited("table-ac", None, (-120, 120), preferred=("A", sign))
    path = rotary_angles(machine, line_of(3), tilted(np.full(3, 30.0), 50.0), tolerance=TOLERANCE)
    np.testing.assert_allclose(path.angles[:, 1], want)


def test_rewinds_happen_in_rapids_where_nothing_else_helps():
    machine = limited("table-ac", (-360, 360), (0, 100))  # one solution only
    azimuth = np.linspace(0, 1500, 1501)
    axis = tilted(30.0, azimuth)
    rapid = np.arange(1501) % 300 == 0
    lines = np.arange(1501) + 1
    path = rotary_angles(machine, line_of(1501), axis, tolerance=TOLERANCE, rapid=rapid, line=lines)
    np.testing.assert_allclose(tool_axis(machine, path.angles), axis, atol=1e-12)
    assert np.abs(path.angles[:, 0]).max() <= 360 + 1e-9
    step = np.abs(np.diff(path.angles[:, 0]))
    assert step[~rapid[1:]].max() < 1.01
    (finding,) = path.findings
    assert finding.code == "CS364"
    # The cuts start at C = 90, 30, -30, -90, -150 and whole turns; only two of them fit one after the other, from -270
    # on; every later one of 300 deg would pass 360 where it stands.
    assert finding.count == (step > 180).sum() == 3
    assert finding.line in lines[rapid]
    assert re.match(r"C turns back by \d+ deg in a rapid", finding.text)


def test_change_of_solution_in_a_rapid_is_said():
    """The limits of C let the first cut use one solution only, the second the other one only."""
    machine = limited("table-ac", (60, 200), (-40, 40))
    azimuth = np.concatenate((np.linspace(60, 100, 10), np.linspace(160, 200, 10)))  # C = 150 or -30, then 250 or 70
    rapid = np.arange(20) % 10 == 0
    lines = np.arange(20) + 1
    path = rotary_angles(machine, line_of(20), tilted(30.0, azimuth), tolerance=TOLERANCE, rapid=rapid, line=lines)
    assert path.angles[0, 1] * path.angles[-1, 1] < 0
    (finding,) = path.findings
    assert (finding.code, finding.line, finding.count) == ("CS365", 11, 1)
    assert finding.text.startswith("C and A go over to their other solution in a rapid")


def test_no_rewind_within_a_cut():
    machine = limited("table-ac", (-360, 360), (0, 100))
    axis = tilted(30.0, np.linspace(0, 800, 801))
    with pytest.raises(InputError) as caught:
        rotary_angles(machine, line_of(801), axis, tolerance=TOLERANCE, line=np.arange(801) + 11, file="part.cls")
    assert re.fullmatch(
        r"part\.cls:\d+: error: C would have to go to 36\d\.\d{3} deg, its limit is 360 deg, in a cut from line 11 on; "
        r"interrupt the cut with a retract in rapid before, so that the axis can turn back, or give --rewind, "
        r"for a control that has a retract",
        one_line(caught.value),
    )
    assert caught.value.code == "CS362"
    # From -360 on: 720 deg of travel are used up at the pose that is named.
    start = -360 + 90  # C = azimuth + 90 and the lowest start above the limit
    assert caught.value.line == 11 + (360 - start) + 1


def test_limit_names_axis_angle_and_limit():
    machine = limited("table-ac", None, (-30, 60))
    axis = tilted(np.linspace(0, 80, 81), 0.0)
    with pytest.raises(InputError) as caught:
        rotary_angles(machine, line_of(81), axis, tolerance=TOLERANCE, line=np.arange(81) + 1, file="part.cls")
    assert one_line(caught.value) == (
        "part.cls:62: error: A would have to go to 61.000 deg, its limit is 60 deg; "
        "turn the part or use a machine with more travel"
    )


def test_pole_outside_of_the_limits():
    machine = limited("table-ac", None, (5, 60))
    with pytest.raises(InputError, match=r"<input>:3: error\[\w+\]: A would have to go to .* its limit is 5 deg"):
        rotary_angles(machine, line_of(3), tilted(np.zeros(3), 0.0), tolerance=TOLERANCE, line=np.array([3, 4, 5]))


def test_unreachable_axis():
    with pytest.raises(InputError) as caught:
        rotary_angles(
            load_machine("nutated-bc"),
            line_of(2),
            tilted(np.array([80.0, 100.0]), 0.0),
            tolerance=TOLERANCE,
            line=np.array([7, 8]),
            file="part.cls",
        )
    assert one_line(caught.value) == (
        "part.cls:8: error: tool axis (0.984808, 0.000000, -0.173648) is 10.000 deg beyond the reach of C and B of "
        "nutated-bc; turn the part or use a machine that reaches it; --method proportional turns the tool no farther "
        "than poses"
    )


def test_axis_just_out_of_reach_is_taken_as_the_edge():
    machine = load_machine("nutated-bc")
    axis = tilted(np.linspace(80, 90.01, 60), 25.0)  # four printed decimals may lie below the horizontal
    path = rotary_angles(machine, line_of(60), axis, tolerance=TOLERANCE)
    assert deviation(machine, path, axis).max() == pytest.approx(0.01)
    assert abs(path.angles[-1, 1]) == pytest.approx(180)


def test_wide_step_goes_the_way_of_the_ruled_motion():
    """Poses 170 deg of azimuth apart near the pole, on the nutated head where both angles turn far."""
    for name in ("nutated-bc", "table-ac"):
        machine = load_machine(name)
        ends = tilted(np.array([40.0, 40.0]), np.array([0.0, 170.0]))
        path = rotary_angles(machine, line_of(2), ends, tolerance=TOLERANCE)
        share = np.linspace(0, 1, 2001)[:, None]
        fine = rotary_angles(
            machine, line_of(2001), unit(ends[:1] * (1 - share) + ends[1:] * share), tolerance=TOLERANCE
        )
        np.testing.assert_allclose(path.angles, fine.angles[[0, -1]], atol=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_random_walks(seed: int):
    """Noise around the pole, coarse and fine: continuous, inside limits, solved, within tolerance."""
    rng = np.random.default_rng(seed)
    n = 400
    size = [0.5, 0.05, 0.005, 0.0005][seed % 4]
    walk = np.cumsum(rng.normal(size=(n, 2)) * size, axis=0) * [1, 0.3]
    if seed % 2:
        walk = np.round(walk, 4)
    axis = unit(np.column_stack((np.sin(walk), np.ones(n))))
    tip = np.cumsum(rng.uniform(0, 0.2, (n, 3)), axis=0)
    for name in ("table-ac", "nutated-bc"):
        machine = load_machine(name)
        path = rotary_angles(machine, tip, axis, tolerance=TOLERANCE)
        assert angle_between(tool_axis(machine, path.angles), axis).max() <= TOLERANCE
        assert len(filled_path(machine, tip, axis, path.angles, tolerance=TOLERANCE)[1]) == 0


@pytest.mark.parametrize(("size", "seed"), covering_share(product([1, 2, 7, 64], range(4)), 7))
def test_blocks_change_nothing(size: int, seed: int, monkeypatch: pytest.MonkeyPatch):
    """Rows are worked on some at a time: whatever stands at an edge between blocks, the result is the same."""
    rng = np.random.default_rng(seed)
    n = 300
    walk = np.cumsum(rng.normal(size=(n, 2)) * [0.6, 0.05, 0.003][seed % 3], axis=0) * [1, 0.3]
    walk[rng.random(n) < 0.2] = 0.0  # at the pole
    axis = unit(np.column_stack((np.sin(walk), np.ones(n))))
    tip = np.cumsum(rng.uniform(0, 0.2, (n, 3)), axis=0)
    rapid = rng.random(n) < 0.03
    machine = limited("table-ac", (-720, 720), (-100, 100)) if seed % 2 else load_machine("table-ac")
    whole = rotary_angles(machine, tip, axis, tolerance=TOLERANCE, rapid=rapid, line=np.arange(n))
    for module in (angle_path, poses):
        monkeypatch.setattr(module, "CHUNK", size)
    parts = rotary_angles(machine, tip, axis, tolerance=TOLERANCE, rapid=rapid, line=np.arange(n))
    np.testing.assert_array_equal(parts.angles, whole.angles)
    assert parts.findings == whole.findings
    assert (axis[:, 2] == 1.0).any()  # at the pole


def test_empty_and_single():
    machine = load_machine("table-ac")
    assert rotary_angles(machine, np.zeros((0, 3)), np.zeros((0, 3)), tolerance=TOLERANCE).angles.shape == (0, 2)
    path = rotary_angles(machine, np.zeros((1, 3)), tilted(np.array([30.0]), 0.0), tolerance=TOLERANCE)
    np.testing.assert_allclose(path.angles, [[90.0, 30.0]])
