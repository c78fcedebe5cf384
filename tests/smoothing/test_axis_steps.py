"""Moves in which the tool axis turns far: refused near half a turn, warned of above a quarter."""

from __future__ import annotations

import io
import math

import numpy as np
import pytest

from cornersmooth import nc
from cornersmooth.cl import read
from cornersmooth.errors import InputError
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Move, Program
from cornersmooth.nc import Form, choose_form
from cornersmooth.report.info import describe
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.command import BAD_INPUT, message, run


def leaning(angle: float, azimuth: float = 25.0) -> list[float]:
    """Unit vector at an angle (degrees) from Z."""
    tilt, around = math.radians(angle), math.radians(azimuth)
    return [math.sin(tilt) * math.cos(around), math.sin(tilt) * math.sin(around), math.cos(tilt)]


def program(*angles: float, kinds: tuple[Move, ...] | None = None) -> Program:
    """Poses 10 mm apart, the axis at angles from Z in one plane; line 10 i of pose i."""
    n = len(angles)
    tips = np.arange(n)[:, None] * [10.0, 0.0, 0.0]
    kind = np.array([Move.RAPID] + [Move.LINEAR] * (n - 1) if kinds is None else kinds, np.uint8)
    return Program.from_poses(tips, [leaning(a) for a in angles], kind=kind, feed=500.0, line=10 * np.arange(1, n + 1))


def refusal(one: Program, settings: Settings | None = None) -> InputError:
    with pytest.raises(InputError) as caught:
        smooth(one, settings)
    assert caught.value.code == "CS183"
    return caught.value


def steps_told(one: Program, settings: Settings | None = None) -> list[tuple[int, int]]:
    """Line and count of the warnings about steps."""
    return [(f.line, f.count) for f in smooth(one, settings).findings if f.code == "CS184"]


@pytest.mark.parametrize("start", [0.0, 20.0, -77.7])
@pytest.mark.parametrize(
    ("turn", "said"), [(175.0001, "175 deg"), (179.9, "179.9 deg"), (180.0, "180 deg"), (179.9999999, "180 deg")]
)
def test_nearly_half_a_turn_in_a_cut_is_refused_at_its_line(start: float, turn: float, said: str) -> None:
    found = refusal(program(start, start + 1, start + 1 + turn, start + 2 + turn))
    assert found.line == 30
    assert f"turns by {said} in one move, and which way a control turns is not defined" in str(found)
    assert found.hint == "insert a pose in between"


@pytest.mark.parametrize("start", [0.0, 20.0, -77.7])
@pytest.mark.parametrize("turn", [174.9999, 175.0, 120.0, 90.0001])
def test_less_is_a_warning(start: float, turn: float) -> None:
    assert steps_told(program(start, start + 1, start + 1 + turn, start + 2 + turn)) == [(30, 1)]


@pytest.mark.parametrize("start", [0.0, 20.0, -77.7])
@pytest.mark.parametrize("turn", [90.0, 89.9999, 10.0, 0.0])
def test_a_quarter_of_a_turn_is_none(start: float, turn: float) -> None:
    assert steps_told(program(start, start + 1, start + 1 + turn, start + 2 + turn)) == []


def test_the_first_line_is_told_and_all_are_counted() -> None:
    assert steps_told(program(0, 100, 0, 5, 130, 5)) == [(20, 4)]
    assert steps_told(program(0, 50, 0, 5), Settings(max_axis_step=45)) == [(20, 2)]
    (finding,) = smooth(program(0, 100, 0, 5, 130, 5)).findings
    assert "more than 90 deg in one move, by 125 deg at most" in finding.text


@pytest.mark.parametrize("method", ["proportional", "zhang2016", "global"])
def test_every_method_refuses(method: str) -> None:
    assert refusal(program(0, 1, 181, 182), Settings(method=method)).line == 30
    assert steps_told(program(0, 1, 121, 122), Settings(method=method)) == [(30, 1)]


def test_repeated_poses_before_the_flip_do_not_hide_it() -> None:
    one = program(0, 0, 0, 180, 180)
    tips = np.array([[0, 0, 0], [5, 0, 0], [5, 0, 0], [5, 0, 0], [5, 0, 0]], float)
    assert refusal(Program.from_poses(tips, one.axis, kind=one.kind, line=one.line)).line == 40


def test_a_pose_in_between_is_enough() -> None:
    assert steps_told(program(0, 90, 180, 180)) == []


def test_an_arc_is_a_cut_too() -> None:
    assert refusal(program(0, 0, 180, kinds=(Move.RAPID, Move.LINEAR, Move.ARC))).line == 30


def test_a_start_position_is_stated_not_moved_from() -> None:
    one = program(180, 0, 0, 1, kinds=(Move.FROM, Move.LINEAR, Move.LINEAR, Move.LINEAR))
    assert smooth(one).findings == ()
    assert flips_told(one, choose_form("fanuc", "g1")) == []


def test_one_pose_has_no_move() -> None:
    assert smooth(program(180.0)).findings == ()


# ---------------------------------------------------------------- rapids


def flips_told(one: Program, form: Form) -> list[tuple[int, int]]:
    settings = nc.fit_settings(Settings(tolerance=0.05), form, one.units)
    written = nc.write(smooth(one, settings), io.BytesIO(), form=form)
    return [(f.line, f.count) for f in written.findings if f.code == "CS326"]


RAPIDS = (Move.RAPID, Move.LINEAR, Move.RAPID, Move.LINEAR, Move.RAPID, Move.RAPID)


@pytest.mark.parametrize("form", ["g1", "g6.2"])
def test_flip_in_a_rapid_is_a_warning(form: str) -> None:
    chosen = choose_form("fanuc", form)
    assert flips_told(program(0, 1, 180.5, 180, 0, 0, kinds=RAPIDS), chosen) == [(30, 2)]
    assert flips_told(program(0, 1, 170, 171, 0, 0, kinds=RAPIDS), chosen) == []


def test_rotary_words_say_which_way_a_rapid_turns() -> None:
    one = program(89, 88, -89, -88, 89, 89, kinds=RAPIDS)
    assert flips_told(one, choose_form("fanuc", machine=load_machine("head-ac"))) == []
    assert flips_told(one, choose_form("fanuc")) == [(30, 2)]


# ---------------------------------------------------------------- files


def cl(units: str, *axes: list[float]) -> bytes:
    lines = [f"UNITS/{units}", "LOADTL/1", "SPINDL/1000,RPM,CLW", "RAPID", "GOTO/0,0,0,0,0,1", "FEDRAT/10"]
    lines += [f"GOTO/{k},1,0," + ",".join(f"{v:.9f}" for v in axis) for k, axis in enumerate(axes, 1)]
    return "\n".join([*lines, "FINI", ""]).encode()


@pytest.mark.parametrize("units", ["MM", "INCHES"])
@pytest.mark.parametrize(
    "options", [[], ["-f", "g6.2"], ["--lenient"], ["--machine", "xyzbc-trt"], ["--method", "zhang2016"]]
)
def test_command_says_the_line_and_writes_nothing(units: str, options: list[str], tmp_path) -> None:
    source, target = tmp_path / "part.cls", tmp_path / "part.nc"
    source.write_bytes(cl(units, leaning(0), leaning(179.9), leaning(179.9)))
    result = run("smooth", source, "-o", target, *options)
    assert result.returncode == BAD_INPUT
    want = (
        "part.cls:8: error: the tool axis turns by 179.9 deg in one move, "
        "and which way a control turns is not defined; insert a pose in between"
    )
    assert want in message(result.stderr)
    assert not target.exists()


@pytest.mark.parametrize("units", ["MM", "INCHES"])
def test_command_warns_of_a_large_step(units: str, tmp_path) -> None:
    source, target = tmp_path / "part.cls", tmp_path / "part.nc"
    source.write_bytes(cl(units, leaning(0), leaning(100), leaning(100)))
    result = run("smooth", source, "-o", target, "-v")
    assert result.returncode == 0, result.stderr
    assert b"turns by more than 90 deg in one move, by 100 deg at most" in b" ".join(result.stderr.split())
    assert target.exists()


def test_info_describes_a_file_that_smoothing_refuses() -> None:
    one = read(cl("MM", leaning(0), leaning(180), leaning(180)))
    found = describe(one, 0.01, 10.0)
    assert found["corners"]["not_smoothed"]["axis_step"] == 2
    assert [(f["code"], f["line"], f["count"]) for f in found["findings"] if f["code"] == "CS184"] == [("CS184", 8, 1)]
