"""Nothing that verification does not look at, or takes from the program itself, passes in silence.

| what was bounded | beyond it |
|---|---|
| rows whose tip and axis point are measured alone | all are, some at a time |
| digits: first 64 kB, I and J, a step of 1 without decimals | all of the text, K too, never more than a share of ε |
| motion after the last stop, said once | each piece is compared with where the tool stood |
| places where the motions part | after 20 of them nothing more, NOT VERIFIED with the line |
| comments about holes | FAILED, or INCOMPLETE with --skip-cycles |
| words of the head | NOT VERIFIED where they loosen the check, FAILED for another CL file |
"""

from __future__ import annotations

import hashlib

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.nc_reader.dialects import Steps
from cornersmooth.verify import verify
from oracle.command import run

HEAD = ["%", "O0001", "G21 G90 G94 G17 G40 G49 G80", "G91 G28 Z0.", "G90"]
TAIL = ["G91 G28 Z0.", "G90", "G49", "M30", "%"]


def program(*lines: str, start: tuple[str, ...] = ("G54", "G43.5 H1")) -> bytes:
    return "\n".join([*HEAD, *start, *lines, *TAIL, ""]).encode()


def cl(*lines: str) -> bytes:
    return "\n".join(["UNITS/MM", *lines, "FINI", ""]).encode()


LINE = cl("RAPID", "GOTO/0,0,50,0,0,1", "FEDRAT/1000,MMPM", *(f"GOTO/{x},0,50,0,0,1" for x in range(10, 60, 10)))
START = "G0 X0. Y0. Z50. I0. J0. K1."
CUT = ["G1 X10. F1000.", *(f"G1 X{x}." for x in range(20, 60, 10))]


def judged(source: bytes, nc: bytes, **how: object) -> Verdict:
    return verify(read(source), nc, **{"tolerance": 0.02} | how).verdict


@pytest.mark.parametrize(
    ("cut", "verdict"),
    [
        (CUT, Verdict.PASSED),
        ([*CUT[:2], "G1 Z11.5", "G1 Z50.", *CUT[2:]], Verdict.FAILED),  # a dive
        ([*CUT[:3], "G1 X21.", *CUT[3:]], Verdict.FAILED),  # 9 mm backwards
        ([*CUT[:-1], "G1 X50.45"], Verdict.FAILED),
    ],
)
@pytest.mark.parametrize("third", ["K1.", "K1.0000000"])
def test_vectors_without_decimals_leave_no_room(cut: list[str], verdict: Verdict, third: str) -> None:
    assert judged(LINE, program(START.replace("K1.", third), *cut)) == verdict


def test_whole_numbers_for_others_are_found() -> None:
    source = cl("RAPID", "GOTO/10.45,20.45,50.45", "FEDRAT/1000,MMPM", "GOTO/20,20,50")
    text = program("G0 X10 Y20 Z50", "G1 X20. F1000.", start=("G54", "G43 H1"))
    assert judged(source, text) == Verdict.FAILED


def test_a_pose_that_digits_alone_explain_is_not_verified() -> None:
    source = cl("RAPID", "GOTO/10.0035,20,50", "FEDRAT/1000,MMPM", "GOTO/20,20,50")
    text = program("G0 X10.00 Y20. Z50.", "G1 X20. F1000.", start=("G54", "G43 H1"))
    found = verify(read(source), text, tolerance=0.005)
    assert found.verdict == Verdict.NOT_VERIFIED
    assert "digits are too few for 0.005 mm at NC line 8" in found.unverified


def test_digits_of_the_whole_text_count() -> None:
    assert Steps(1.0, 0.0).finer(Steps(1e-4, 1e-7)) == Steps(1e-4, 1e-7)
    poses = [f"GOTO/{x},0,0,0,0,1" for x in range(1, 2800)]
    source = cl("RAPID", "GOTO/0,0,0,0,0,1", "FEDRAT/1000,MMPM", *poses, "RAPID", "GOTO/10.35,0.35,0,0,0,1")
    cut = ["G0 X0. Y0. Z0. I0. J0. K1.", "G1 X1. F1000.", *(f"G1 X{x}. Y0. Z0. I0. J0. K1." for x in range(2, 2800))]
    for last, verdict in (("10.3500", Verdict.PASSED), ("10.3450", Verdict.FAILED)):
        assert judged(source, program(*cut, f"G0 X{last} Y0.3500 Z0. I0. J0. K1."), tolerance=0.05) == verdict


def test_many_rows_that_are_only_not_synchronised_hide_nothing() -> None:
    count, eps = 9000, 0.02
    lean = -3.9 * eps / 10.0
    size = np.hypot(lean, 1.0)
    vector = f"I{lean / size:.7f} J0.0000000 K{1 / size:.7f}"
    poses = [f"GOTO/{0.3 * k:.4f},0,0,0,0,1" for k in range(1, count)]
    lines = []
    for k in range(1, count):
        other = k in (count // 2, count - 1)
        y = 1.8 * eps if k == count // 2 else 0.0
        upright = "I0.0000000 J0.0000000 K1.0000000"
        lines.append(f"G1 X{0.3 * k:.4f} Y{y:.4f} Z0.0000 {upright if other else vector}" + " F1000." * (k == 1))
    source = cl("RAPID", "GOTO/0,0,0,0,0,1", "FEDRAT/1000,MMPM", *poses)
    found = verify(read(source), program("G0 X0. Y0. Z0. I0. J0. K1.", *lines), tolerance=eps)
    assert found.verdict == Verdict.FAILED
    assert found.max_tip_deviation_mm == pytest.approx(1.8 * eps, abs=1e-9)


@pytest.mark.parametrize(("behind", "verdict"), [([], Verdict.PASSED), (["G1 Z-100.", "G1 Z50."], Verdict.FAILED)])
def test_motion_after_long_standing_still_is_compared(behind: list[str], verdict: Verdict) -> None:
    source = LINE.replace(b"FINI", b"RAPID\nGOTO/50,0,60,0,0,1\nFINI")
    still = ["G1 X50. Y0. Z60. I0. J0. K1."] * 40_000
    assert (
        judged(source, program(START, *CUT, "G0 Z60.", *still, *[b.replace("Z50", "Z60") for b in behind])) == verdict
    )


def test_after_many_places_nothing_more_is_looked_at() -> None:
    source = cl("RAPID", "GOTO/0,0,50,0,0,1", "FEDRAT/1000,MMPM", *(f"GOTO/{x},0,50,0,0,1" for x in range(1, 211)))
    cut = [f"G1 X{x}. Y{0.1 * (x % 2):.1f}" + " F1000." * (x == 1) for x in range(1, 211)]
    found = verify(read(source), program(START, *cut), tolerance=0.02)
    assert found.verdict == Verdict.FAILED
    assert "after 20 places where the motions part" in found.unverified
    assert found.max_tip_deviation_mm == pytest.approx(0.1, abs=1e-9)


def test_tips_and_axis_points_on_their_own_are_said_to_be() -> None:
    """The axis point is 0.03 mm behind, along its own path: within ε of that, but not at a common pose."""
    poses = [f"GOTO/{x},0,50,0,0,1" for x in range(1, 50)]
    source = cl("RAPID", "GOTO/0,0,50,0,0,1", "FEDRAT/1000,MMPM", *poses)
    lines = [f"G1 X{x}. I-0.0060000 J0. K0.9999820" + " F1000." * (x == 1) for x in range(1, 49)]
    text = program(START, *lines, "G1 X49. I0. J0. K1.")
    found = verify(read(source), text, tolerance=0.02)
    assert (found.verdict, found.apart) == (Verdict.PASSED, True)
    assert not verify(read(source), text, tolerance=0.031).apart
    assert judged(source, text, tolerance=0.0149) == Verdict.FAILED


HOLES = cl(
    "LOADTL/1",
    "SPINDL/RPM,500,CLW",
    "RAPID",
    "GOTO/0,0,50",
    "CYCLE/{},RAPTO,5,FEDTO,-10,RTRCTO,50,{}",
    "GOTO/10,0,0",
    "GOTO/90,0,0",
    "CYCLE/OFF",
    "RAPID",
    "GOTO/0,0,50",
).decode()
DRILL, TAP = HOLES.format("DRILL", "MMPM,100").encode(), HOLES.format("TAP", "MMPR,1").encode()


def drilled(out: str, over: str, down: str) -> bytes:
    first = ["G0 X0. Y0. Z50.", "G0 X10. Z50.", "G0 Z5.", "G1 Z-10. F100."]
    last = [f"G0 Z{out}", f"G0 X90. Z{over}", f"G0 Z{down}", "G1 Z-10.", "G0 Z50.", "G0 X0."]
    return program(*first, *last, start=("T1 M6", "S500 M3", "G54", "G43 H1"))


@pytest.mark.parametrize(
    ("heights", "verdict"),
    [
        (("50.", "50.", "5."), Verdict.PASSED),
        (("60.", "60.", "5."), Verdict.PASSED),
        (("0.", "0.", "0."), Verdict.FAILED),  # over clamps at the level of the holes
        (("5.", "5.", "5."), Verdict.FAILED),
        (("50.", "50.", "0.5"), Verdict.FAILED),  # lower than RAPTO
    ],
)
def test_rapids_keep_the_heights_of_the_cycle(heights: tuple[str, str, str], verdict: Verdict) -> None:
    assert judged(DRILL, drilled(*heights)) == verdict


@pytest.mark.parametrize(
    ("out", "verdict"),
    [
        (["G1 Z20."], Verdict.PASSED),
        (["G18 G3 X0. Z20. R8.", "G17"], Verdict.FAILED),  # 8 mm aside
        (["G1 X8. Z12.", "G1 X0. Z20."], Verdict.FAILED),
    ],
)
def test_the_way_at_feed_out_of_a_hole_is_looked_at(out: list[str], verdict: Verdict) -> None:
    hole = ["CYCLE/DRILL,FEDTO,8,MMPM,100,RAPTO,2,RTRCTO,4", "GOTO/0,0,0", "CYCLE/OFF"]
    start = ["LOADTL/1", "SPINDL/500,RPM,CLW", "RAPID", "GOTO/0,0,30"]
    source = cl(*start, *hole, "FEDRAT/100,MMPM", "GOTO/0,0,20", "GOTO/20,0,20")
    lines = ["G0 X0. Y0. Z30.", "G0 Z2.", "G1 Z-8. F100.", "G0 Z4.", out[0] + " F100.", *out[1:], "G1 X20."]
    assert judged(source, program(*lines, start=("T1 M6", "S500 M3", "G54", "G43 H1"))) == verdict


def test_comments_vouch_for_no_hole() -> None:
    comments = [f"(NOT DRILLED X{x}. Y0. Z0.)" for x in (10, 90)]
    text = program("G0 X0. Y0. Z50.", *comments, start=("T1 M6", "S500 M3", "G54", "G43 H1"))
    assert judged(TAP, text) == Verdict.FAILED
    found = verify(read(TAP), text, tolerance=0.02, skip_cycles=True)
    assert (found.verdict, found.left_out) == (Verdict.INCOMPLETE, 2)
    assert judged(DRILL, text, skip_cycles=True) == Verdict.FAILED  # what can be drilled is drilled


@pytest.mark.parametrize(
    ("words", "typed", "first"),
    [
        ("E=0.01 H=10", (), b"PASSED"),
        ("E=1 H=10", (), b"NOT VERIFIED"),
        ("E=1 H=10", ("-e", "1"), b"PASSED"),
        ("E=0.01 H=0.01", ("-e", "0.01"), b"NOT VERIFIED"),
        ("E=0.01 H=0.01", ("-e", "0.01", "-H", "10"), b"PASSED"),
        ("E=0.01 H=10 AXIS=40", ("-e", "0.01"), b"NOT VERIFIED"),
        ("E=0.01 H=10 FEEDS=plan", ("-e", "0.01", "-H", "10"), b"NOT VERIFIED"),
        ("E=0.01 H=10 FEEDS=plan", ("--planned-feeds",), b"PASSED"),
        ("E=0.01 H=10 SHA256", (), b"FAILED"),
    ],
)
def test_the_head_loosens_nothing(tmp_path, words: str, typed: tuple[str, ...], first: bytes) -> None:
    part, nc = tmp_path / "part.cls", tmp_path / "part.nc"
    part.write_bytes(LINE)
    digest = hashlib.sha256(b"another" if "SHA256" in words else LINE).hexdigest()
    words = words.replace(" SHA256", "")
    head = [f"(CORNERSMOOTH 1.0: {words} METHOD=proportional CONTROL=fanuc FORM=g1)", f"(SHA256={digest} CL=part.cls)"]
    nc.write_bytes(program("G0 X0. Y0. I0. J0. K1.", "G0 Z50.", *CUT, start=(*head, "G54", "G43.5 H1")))
    done, quiet = run("verify", part, nc, *typed), run("verify", part, nc, *typed, "-q")
    assert done.stdout.startswith(first), done.stdout + done.stderr
    assert done.returncode == quiet.returncode == (first != b"PASSED")
    assert bool(quiet.stderr) == (first != b"PASSED")
    if not typed:
        assert words.encode().partition(b" ")[0] in done.stdout.split(b"\n")[1]
