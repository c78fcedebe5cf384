"""Known deviations, known mistakes, and the numbers that come out."""

from __future__ import annotations

import json
import math
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.cli import run
from cornersmooth.errors import SettingsError
from cornersmooth.model import Arcs, Move, Program
from cornersmooth.nc_reader import read_nc
from cornersmooth.verify import verify
from oracle.share import covering_share

from .writing import HEAD, TAIL, corners, encode, job, place_g1, rapid, simple_text, unit

UP = np.array([0.0, 0.0, 1.0])


def corner_program(angle=90.0, leg=10.0):
    a = math.radians(angle)
    tip = np.array([[-leg, 0, 0], [0, 0, 0], [leg * math.cos(a), leg * math.sin(a), 0]])
    return Program.from_poses(tip, np.tile(UP, (3, 1)), feed=100.0)


def g1(program, points, axes=None, feed=" F100."):
    lines = [*HEAD, "G43.5 H1", rapid(program.tip[0], program.axis[0], 10.0, "g1")]
    axes = np.tile(UP, (len(points), 1)) if axes is None else axes
    for k, (point, axis) in enumerate(zip(points, axes, strict=True)):
        lines.append("G1 " + place_g1(np.asarray(point, float), axis) + (feed if k == 0 else ""))
    return encode([*lines, *TAIL])


def codes(found):
    return sorted({problem.code for problem in found.problems})


def test_chamfer_deviates_by_half_its_height_from_one_side_and_all_of_it_from_the_other():
    program = corner_program()
    found = verify(program, g1(program, [(-0.1, 0, 0), (0, 0.1, 0), (0, 10, 0)]), tolerance=0.08)
    # corner to chamfer: 0.1/sqrt(2)
    assert found.max_tip_deviation_mm == pytest.approx(0.1 / math.sqrt(2), abs=1e-12)
    assert found.max_axis_point_deviation_mm == pytest.approx(0.1 / math.sqrt(2), abs=1e-12)
    assert (found.tip.cl_line, found.tip.nc_line) == (2, len(HEAD) + 4)
    assert found.passed
    assert not verify(program, g1(program, [(-0.1, 0, 0), (0, 0.1, 0), (0, 10, 0)]), tolerance=0.07).passed


def test_bump_is_measured_where_it_is():
    program = corner_program()
    found = verify(program, g1(program, [(-5, 0.03, 0), (0, 0, 0), (0, 10, 0)]), tolerance=0.01)
    assert found.max_tip_deviation_mm == pytest.approx(0.03, abs=1e-12)
    assert (found.tip.cl_line, found.tip.nc_line) == (2, len(HEAD) + 3)
    assert codes(found) == ["CS521", "CS522"]
    assert {(problem.cl_line, problem.nc_line) for problem in found.problems} == {(2, len(HEAD) + 3)}
    assert found.problems[0].text == "the tip leaves its path by 0.030000 mm"


def test_turned_axis_shows_at_the_axis_point_only():
    program = corner_program()
    tilt = unit([0.0, 0.002, 1.0])
    axes = [tilt, UP, UP]
    found = verify(program, g1(program, [(-5, 0, 0), (0, 0, 0), (0, 10, 0)], axes), tolerance=0.01, axis_length=50.0)
    assert found.max_tip_deviation_mm < 1e-12
    assert found.max_axis_point_deviation_mm == pytest.approx(50 * 0.002, rel=1e-4)
    assert found.max_orientation_deviation_deg == pytest.approx(math.degrees(0.002), rel=1e-4)
    assert codes(found) == ["CS522"]


@pytest.mark.parametrize("w", [1.0, 0.5, 2.0])
def test_curve_deviates_by_the_closed_form(w):
    # c = w1/(3 (w1 + w2)); the corner is c L |U+ - U-| from the curve
    program = corner_program()
    length = 0.3
    points = [(-length, 0), (-2 * length / 3, 0), (0, 0), (0, 2 * length / 3), (0, length)]
    text = [*HEAD, "G43 H1", "G0 X-10.0000 Y0.0000 Z0.0000 U-10.0000 V0.0000 W10.0000"]
    text.append(f"G1 X{points[0][0]:.4f} Y0.0000 Z0.0000 U{points[0][0]:.4f} V0.0000 W10.0000 F100.")
    for k, (x, y) in enumerate(points):
        start = "G6.2 P4 " if k == 0 else ""
        weight = w if k == 2 else 1.0
        knot = "0.5" if k == 4 else "0."
        text.append(f"{start}K{knot} X{x:.4f} Y{y:.4f} Z0.0000 U{x:.4f} V{y:.4f} W10.0000 R{weight:.1f}")
    text += ["K1."] * 4 + ["G1 X0.0000 Y10.0000 Z0.0000 U0.0000 V10.0000 W10.0000", *TAIL]
    found = verify(program, encode(text), tolerance=0.15)
    expected = length * math.sqrt(2) / (3 * (1 + w))
    assert found.problems == ()
    assert found.max_tip_deviation_mm == pytest.approx(expected, abs=1e-10)
    assert found.max_axis_point_deviation_mm == pytest.approx(expected, abs=1e-10)
    assert found.pose_tip[1] == pytest.approx(expected, abs=1e-10)
    assert found.pose_nc_line[1] == len(HEAD) + 4
    assert found.tangent_jump.value == pytest.approx(0.0, abs=1e-5)
    assert found.curves == 1


def test_simultaneous_deviation_sees_an_axis_that_lags_along_its_own_path():
    tip = np.array([[0.0, 0, 0], [10, 0, 0]])
    program = Program.from_poses(tip, np.tile(UP, (2, 1)), feed=100.0)
    lagging = unit([-0.02, 0, 1.0])
    found = verify(program, g1(program, [(5, 0, 0), (10, 0, 0)], [lagging, UP]), tolerance=0.02)
    # the axis point stays on its own straight path but for the height of the arc it turns on
    assert found.max_axis_point_deviation_mm < 0.003
    assert found.together_axis_point.value > 0.09
    assert codes(found) == ["CS525"]


def test_pose_at_a_statement_must_be_exact():
    program, lines = job("g1")
    stop = lines.index("M1")
    x = float(lines[stop - 1].split()[1][1:])
    wrong = lines[stop - 1].replace(f"X{x:.4f}", f"X{x + 2e-4:.4f}")
    found = verify(program, encode([*lines[: stop - 1], wrong, *lines[stop:]]), tolerance=0.02)
    assert codes(found) == ["CS524"]
    assert found.problems[0].cl_line == 113
    assert found.problems[0].nc_line == stop


def test_loop_that_lies_within_the_tolerance_of_the_rest_must_be_run():
    turn = np.radians(np.arange(0, 361, 30))
    circle = np.stack((np.cos(turn), np.sin(turn), 0 * turn), 1).round(4) * 5
    tip = np.vstack((circle, circle[1:], circle[1:], [[5.0, 9.0, 0.0]]))
    program = Program.from_poses(tip, np.tile(UP, (len(tip), 1)), feed=100.0)
    assert verify(program, g1(program, tip[1:]), tolerance=0.01).passed
    once = np.delete(tip, range(13, 25), axis=0)
    found = verify(program, g1(program, once[1:]), tolerance=0.01)
    assert not found.passed
    twice = np.vstack((tip[:25], tip[13:25], tip[25:]))
    assert not verify(program, g1(program, twice[1:]), tolerance=0.01).passed


def test_reversal_and_repeated_poses_are_no_problem():
    tip = np.array([[0, 0, 0], [10, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, -5], [0, 0, 5.0], [3, 0, 5]])
    program = Program.from_poses(tip, np.tile(UP, (len(tip), 1)), feed=100.0)
    text = g1(program, tip[[1, 2, 4, 5, 6]])
    found = verify(program, text, tolerance=0.001)
    assert found.problems == ()
    assert found.max_tip_deviation_mm == 0
    # the way down is not run
    assert not verify(program, g1(program, tip[[1, 2, 5, 6]]), tolerance=0.001).passed


def test_pure_rotation():
    angle = np.radians([0, 20, 45, 80])
    axes = np.stack((np.sin(angle), 0 * angle, np.cos(angle)), 1)
    program = Program.from_poses(np.zeros((4, 3)), axes, feed=100.0)
    lines = g1(program, np.zeros((3, 3)), axes[1:])
    found = verify(program, lines, tolerance=0.01)
    assert found.passed
    assert found.max_axis_point_deviation_mm < 1e-5
    off = axes[1:].copy()
    off[1] = unit(off[1] + [0, 0.004, 0])
    found = verify(program, g1(program, np.zeros((3, 3)), off), tolerance=0.01)
    assert found.max_axis_point_deviation_mm == pytest.approx(0.04, rel=1e-3)


def test_axis_that_nearly_turns_over_is_followed_closely():
    """The ruled motion turns fastest in the middle; every pose written here lies on it."""
    angle = math.radians(165.0)
    ends = np.array([[0.0, 0.0, 1.0], [math.sin(angle), 0.0, math.cos(angle)]])
    tip = np.array([[0.0, 0, 0], [0.3, 0, 0]])
    program = Program.from_poses(tip, ends, feed=100.0)
    share = (1 + np.tan(np.linspace(-angle / 2, angle / 2, 1200)) / math.tan(angle / 2)) / 2
    points = tip[0] + share[1:, None] * (tip[1] - tip[0])
    axes = unit(ends[0] + share[1:, None] * (ends[1] - ends[0]))
    found = verify(program, g1(program, points, axes), tolerance=0.002)
    assert found.passed
    assert found.axis_point.value < 2e-4


@pytest.mark.parametrize("as_arc", [True, False])
def test_arc_against_arc_and_against_chords(as_arc):
    tip = np.array([[10.0, 0, 0], [0, 10, 0], [0, 20, 0]])
    kind = np.array([Move.RAPID, Move.ARC, Move.LINEAR], np.uint8)
    arcs = Arcs(np.array([1]), np.zeros((1, 3)), UP[None], np.array([math.pi / 2]))
    program = Program.from_poses(tip, np.tile(UP, (3, 1)), kind=kind, feed=100.0, arcs=arcs)
    head = [*HEAD, "G43.5 H1", rapid(tip[0], UP, 10.0, "g1")]
    if as_arc:
        lines = ["G3 X0.0000 Y10.0000 Z0.0000 R10.0000 F100."]
    else:
        turn = np.linspace(0, np.pi / 2, 65)[1:]
        lines = ["G1 " + place_g1(10 * np.array([math.cos(t), math.sin(t), 0]), UP) + " F100." for t in turn]
    text = encode([*head, *lines, "G1 " + place_g1(tip[2], UP), *TAIL])
    found = verify(program, text, tolerance=0.001)
    assert found.problems == ()
    sagitta = 10 * (1 - math.cos(math.pi / 2 / 64 / 2))
    expected = 0.0 if as_arc else sagitta
    assert found.max_tip_deviation_mm == pytest.approx(expected, abs=1e-7 if as_arc else 1e-4)
    other_way = text.replace(b"G3 X", b"G2 X") if as_arc else text.replace(b"X9.9970", b"X9.9920")
    assert not verify(program, other_way, tolerance=0.001).passed
    if not as_arc:  # chords as long as those of the measure itself could be
        found = verify(program, text, tolerance=10 * sagitta)
        assert found.max_tip_deviation_mm == pytest.approx(sagitta, rel=0.05)


@pytest.mark.parametrize(("size", "form"), covering_share(product([70, 300], ["g1", "g6.2"]), 3))
def test_one_long_chain_that_is_cut_is_the_same_as_whole(form, size, monkeypatch):
    from cornersmooth.verify import stretches

    tip, axis = corners(200, seed=4)
    program = Program.from_poses(tip, axis, feed=250.0)
    nc = read_nc(simple_text(tip, axis, 0.02, 10.0, form))
    whole = verify(program, nc, tolerance=0.02)
    monkeypatch.setattr(stretches, "BATCH", size)
    cut = verify(program, nc, tolerance=0.02)
    assert whole.problems == cut.problems == ()
    assert cut.max_tip_deviation_mm == pytest.approx(whole.max_tip_deviation_mm, abs=1e-12)
    assert np.allclose(whole.pose_tip, cut.pose_tip, atol=1e-9)
    assert np.allclose(whole.pose_axis_point, cut.pose_axis_point, atol=1e-9)
    assert np.array_equal(whole.pose_nc_line, cut.pose_nc_line)


def test_inch_text():
    tip, axis = corners(30, seed=7)
    program = Program.from_poses(tip * 25.4, axis, feed=254.0, units="inch")
    text = simple_text(tip * 25.4, axis, 0.05, 10.0, "g1", feed=10.0, scale=25.4, decimals=5)
    lines = text.replace(b"G21", b"G20").decode().splitlines()
    i = next(k for k, line in enumerate(lines) if line.startswith("G0"))
    lines[i] = rapid(tip[0] * 25.4, axis[0], 10.0, "g1", scale=25.4, decimals=5)
    found = verify(program, encode(lines), tolerance=0.05)
    assert found.problems == ()
    assert 0.03 < found.max_tip_deviation_mm <= 0.05
    assert "CS505" in codes(verify(program, text, tolerance=0.05))


def test_dict_is_json_and_has_no_nan():
    program, lines = job("g6.2")
    found = verify(program, encode(lines), tolerance=0.02)
    back = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert back["passed"] is True
    assert back["max_tip_deviation_mm"] == found.max_tip_deviation_mm
    assert back["blocks"] == found.blocks
    broken = verify(program, encode([*lines[: -len(TAIL) - 1], *TAIL]), tolerance=0.02)
    back = json.loads(json.dumps(broken.to_dict(), allow_nan=False))
    assert back["passed"] is False
    assert back["problems"]


def test_continuity_is_measured_where_it_is_wanted() -> None:
    program = corner_program()
    text = g1(program, [(-10, 0, 0), (0, 0, 0), (0, 10, 0)])
    whole, rest = (verify(program, text, tolerance=0.01, continuity=wanted).to_dict() for wanted in (True, False))
    names = "max_tangent_jump_deg", "shortest_block_mm"
    assert [whole.pop(name) for name in names] == pytest.approx([90.0, 10.0])
    assert [rest.pop(name) for name in names] == [None, None]
    assert {one: whole["where"].pop(one) != rest["where"].pop(one) for one in names} == dict.fromkeys(names, True)
    assert rest == whole


def test_nothing_to_compare():
    program = corner_program()
    found = verify(program, b"%\nO1\nG21\nG91 G28 Z0.\nG90\nM30\n%\n", tolerance=0.01)
    assert codes(found) == ["CS534"]
    with pytest.raises(SettingsError, match="tolerance"):
        verify(program, b"", tolerance=0.0)


@pytest.mark.parametrize(
    ("tolerance", "tip", "axis_point"),
    [(0.078, (0.0729, 0.0780), (0.0780, 0.0767)), (0.15, (0.0729, 0.1265), (0.0790, 0.1307))],
)
def test_second_table_of_the_paper_is_measured_in_the_text(tolerance, tip, axis_point):
    import io
    from dataclasses import replace
    from pathlib import Path

    import cornersmooth
    from cornersmooth.nc import choose_form

    sample = Path(__file__).resolve().parents[2] / "samples" / "paper_table1.csv"
    program = cornersmooth.read(sample)
    program = replace(program, feed=np.full(len(program), 500.0))
    settings = cornersmooth.Settings(tolerance=tolerance, method="zhang2016")
    settings = cornersmooth.fit_settings(settings, choose_form("fanuc", "g6.2"), program.units)
    stream = io.BytesIO()
    cornersmooth.write(cornersmooth.smooth(program, settings), stream, control="fanuc", form="g6.2")
    found = verify(program, stream.getvalue(), tolerance=tolerance, axis_length=10.0)
    # four printed decimals, and half a step of the written numbers. At 0.078 the paper's axis point leaves the
    # tolerance by 5e-6 mm at the first corner: that corner gets the size that just keeps it
    assert found.pose_tip[1:3] == pytest.approx(tip, abs=1.2e-4)
    assert found.pose_axis_point[1:3] == pytest.approx(axis_point, abs=1.2e-4)


@pytest.mark.parametrize(
    ("asked", "block", "code"),
    [
        (True, "G3 X60. Y0. I-10. J0. F500.", ""),
        (True, "G3 I-10. F500.", ""),
        (True, "G1 X60. F500.", "CS521"),
        (True, "", "CS535"),
        (False, "G3 X60. Y0. I-10. J0. F500.", "CS536"),
        (False, "G3 I-10. F500.", "CS536"),
        (False, "G1 X60.3 F500.\nX60.", "CS536"),
        (False, "G1 X60.005 F500.\nX60.", ""),  # within the tolerance
        (False, "", ""),
    ],
)
def test_motion_that_ends_where_it_begins_between_two_stops(asked: bool, block: str, code: str) -> None:
    circle = "FEDRAT/500,MMPM\nCIRCLE/50,0,5,0,0,1,10\nGOTO/60,0,5\n" if asked else ""
    cl = f"UNITS/MM\nLOADTL/1\nSPINDL/1000,RPM,CLW\nRAPID\nGOTO/60,0,5\n{circle}RAPID\nGOTO/60,0,50\nFINI\n"
    head = "%\nO1\nG21 G90 G94 G17 G40 G49 G80\nG91 G28 Z0.\nG90\nT1 M6\nS1000 M3\nG54\nG43 H1\nG0 X60. Y0.\nG0 Z5.\n"
    text = f"{head}{block}\nG0 Z50.\nM5\nG91 G28 Z0.\nG90\nG49\nM30\n%\n"
    found = verify(read(cl.encode(), name="part.cls"), text.encode(), tolerance=0.01, words=False)
    assert [problem.code for problem in found.problems][:1] == [code] * bool(code)


@pytest.mark.parametrize("block", ["", "G1 Z-8.", "G2 I5.", "G2 X0. Y0. I5.", "G3 X0. Y0. Z-8. I5."])
def test_a_circle_in_a_hole(block: str) -> None:
    drill = "CYCLE/DRILL,FEDTO,8,MMPM,100,RAPTO,3,RTRCTO,25\nGOTO/0,0,0\nCYCLE/OFF\n"
    cl = f"UNITS/MM\nLOADTL/1\nSPINDL/1000,RPM,CLW\nRAPID\nGOTO/0,0,25\n{drill}RAPID\nGOTO/80,0,50\nFINI\n"
    head = "%\nO1\nG21 G90 G94 G17 G40 G49 G80\nG91 G28 Z0.\nG90\nT1 M6\nS1000 M3\nG54\nG43 H1\nG0 X0. Y0.\nG0 Z25.\n"
    text = f"{head}G0 Z3.\nG1 Z-8. F100.\n{block}\nG0 Z25.\nG0 X80. Z50.\nM5\nG91 G28 Z0.\nG90\nG49\nM30\n%\n"
    found = verify(read(cl.encode(), name="part.cls"), text.encode(), tolerance=0.01, words=False)
    assert ("CS536" in codes(found)) == bool(found.problems) == ("I5" in block)


@pytest.mark.parametrize("options", [(), ("--form", "g6.2")], ids=["lines", "curves"])
def test_no_program_that_passes_is_beyond_the_limit_at_common_poses(options: tuple[str, ...], tmp_path: Path) -> None:
    """The least sum of both squares is not where the larger is least: 0.0437 was shown where 0.0400 holds."""
    sample = Path(__file__).parents[2] / "samples" / "impeller.cls"
    made = tmp_path / "part.nc"
    assert run(["smooth", str(sample), "-e", "0.04", "--method", "global", *options, "-o", str(made), "-q"]) == 0
    found = verify(read(sample.read_bytes(), name=sample.name), made, tolerance=0.04)
    assert found.passed
    assert not found.apart
    assert max(found.together_tip.value, found.together_axis_point.value) <= 0.04 + 1e-8
    assert np.nanmax(found.pose_axis_point) <= 0.04 + 1e-8
