"""Holes as cycles of the control: what is written, where they stay plain moves, and which mutants are found."""

from __future__ import annotations

import io
import re
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError
from cornersmooth.feedrate import Limits
from cornersmooth.feedrate.written import written_motion
from cornersmooth.model import FeedMode
from cornersmooth.nc import Frame
from cornersmooth.nc_reader import read_nc
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import Case
from nc.test_nc_linuxcnc import accepted, positions
from nc.writing import lines_of
from oracle.share import share

EPS = 0.05

#: a drill with every kind of cycle, two of them in one hole, and a tap; in braces the cycle that a test asks for
CL = """UNITS/MM
LOADTL/1
SPINDL/2000,RPM,CLW
RAPID
GOTO/0,0,30
{before}
CYCLE/DRILL,FEDTO,12,MMPM,150,RAPTO,3
GOTO/20,5,1
GOTO/31,7,2
CYCLE/DEEP,FEDTO,25,STEP,10,MMPM,90,RAPTO,3
GOTO/31,7,2
CYCLE/BRKCHP,FEDTO,15,INCR,4,MMPM,90,RAPTO,3
GOTO/0,7,1
CYCLE/REAM,FEDTO,15,MMPM,90,RAPTO,3
GOTO/0,17,1
CYCLE/DRILL,FEDTO,15,MMPM,90,RAPTO,3,DWELL,0.5
GOTO/10,17,1
CYCLE/BORE,FEDTO,15,MMPM,90,RAPTO,3,DWELL,0.5
GOTO/20,17,1
CYCLE/OFF
RAPID
GOTO/20,17,30
LOADTL/3
SPINDL/500,RPM,CLW
RAPID
GOTO/20,5,30
CYCLE/TAP,FEDTO,15,MMPM,500,RAPTO,5
GOTO/20,5,1
GOTO/31,7,1
CYCLE/OFF
RAPID
GOTO/20,5,30
FINI
"""
PLAIN = CL.format(before="FEDRAT/MMPM,100")
#: one cut with a tilted tool of its own before
TILTED = CL.replace("LOADTL/1\n", "LOADTL/9\nSPINDL/3000,RPM,CLW\nRAPID\nGOTO/0,0,30,0.28,0,0.96\nFEDRAT/MMPM,100\n", 1)
TILTED = TILTED.replace("\nRAPID\nGOTO/0,0,30\n", "\nRAPID\nGOTO/0,0,30,0,0,1\n").format(before="FEDRAT/MMPM,100")
TILTED = TILTED.replace(
    "FEDRAT/MMPM,100\nSPINDL", "FEDRAT/MMPM,100\nGOTO/0,0,0\nGOTO/9,0,0\nRAPID\nGOTO/0,0,30\nLOADTL/1\nSPINDL", 1
)

CASES = [
    Case("fanuc", "g1"),
    Case("mitsubishi", "g1"),
    Case("siemens", "g1"),
    Case("heidenhain", "g1"),
    Case("fanuc", "g1", "table-ac"),
    Case("fanuc", "g1", "table-ac", tcp=False),
    Case("haas", "g1", "table-bc"),
    Case("siemens", "g1", "head-ac"),
    Case("heidenhain", "g1", "nutated-bc"),
    Case("linuxcnc", "g1", "xyzac-trt"),
]


def _klartext(name: str, setup: int, depth: int, *, top: int, feed: int, step: int, dwell: str = "0") -> str:
    drilled = f"Q200=+{setup}.0000 Q201=-{depth}.0000 Q206=+{feed} Q202=+{step}.0000"
    return f"CYCL DEF {name} {drilled} Q210=+0 Q203=+{top}.0000 Q204=+{30 - top}.0000 Q211=+{dwell}"


ISO = """G98 G81 X20.0000 Y5.0000 Z-11.0000 R4.0000 F150.
G98 G81 X31.0000 Y7.0000 Z-10.0000 R5.0000 F150.
G98 G83 X31.0000 Y7.0000 Z-23.0000 R5.0000 Q10.0000 F90.
G98 G73 X0.0000 Y7.0000 Z-14.0000 R4.0000 Q4.0000 F90.
G98 G85 X0.0000 Y17.0000 Z-14.0000 R4.0000 F90.
G98 G82 X10.0000 Y17.0000 Z-14.0000 R4.0000 P500 F90.
G98 G89 X20.0000 Y17.0000 Z-14.0000 R4.0000 P500 F90.
G98 G84 X20.0000 Y5.0000 Z-14.0000 R6.0000 F500.
G98 G84 X31.0000 Y7.0000 Z-14.0000 R6.0000 F500."""
EXPECTED = {
    "fanuc": ISO,
    "mitsubishi": ISO,
    "haas": ISO.replace("P500", "P0.5"),
    "linuxcnc": re.sub(r"(\.\d{4})(?!\d)", r"\g<1>00", ISO.replace("P500", "P0.5")).replace("F500", "P0. F500"),
    "siemens": """CYCLE81(30.000000,1.000000,3.000000,-11.000000)
CYCLE81(30.000000,2.000000,3.000000,-10.000000)
CYCLE83(30.000000,2.000000,3.000000,-23.000000,,,10.000000,0,0,0,1,1)
CYCLE83(30.000000,1.000000,3.000000,-14.000000,,,4.000000,0,0,0,1,0)
CYCLE85(30.000000,1.000000,3.000000,-14.000000,,0,90.,90.)
CYCLE82(30.000000,1.000000,3.000000,-14.000000,,0.5)
CYCLE85(30.000000,1.000000,3.000000,-14.000000,,0.5,90.,90.)
CYCLE84(30.000000,1.000000,5.000000,-14.000000,,0,3,,1.000000,0,500,500)
CYCLE84(30.000000,1.000000,5.000000,-14.000000,,0,3,,1.000000,0,500,500)""",
    "heidenhain": "\n".join(
        (
            _klartext("200 DRILLING", 3, 12, top=1, feed=150, step=12),
            _klartext("200 DRILLING", 3, 12, top=2, feed=150, step=12),
            _klartext("200 DRILLING", 3, 25, top=2, feed=90, step=10),
            "CYCL DEF 201 REAMING Q200=+3.0000 Q201=-15.0000 Q206=+90 Q211=+0 Q208=+90 Q203=+1.0000 Q204=+29.0000",
            _klartext("200 DRILLING", 3, 15, top=1, feed=90, step=15, dwell="0.5"),
            "CYCL DEF 201 REAMING Q200=+3.0000 Q201=-15.0000 Q206=+90 Q211=+0.5 Q208=+90 Q203=+1.0000 Q204=+29.0000",
            "CYCL DEF 207 RIGID TAPPING NEW Q200=+5.0000 Q201=-15.0000 Q239=+1.0000 Q203=+1.0000 Q204=+29.0000",
        )
    ),
}
_CYCLE = re.compile(r"(?:\d+ )?(.*(?:G98 |CYCLE8\d\(|CYCL DEF 20\d ).*)")


@cache
def text_of(case: Case, cl: str = PLAIN, cycles: str = "native") -> list[str]:
    """Lines of a text with cycles of the control."""
    return lines_of(case.choose(), cl, frame=Frame(cycles=cycles, skip_cycles=False))


def problems(case: Case, lines: list[str], cl: str = PLAIN, *, skip_cycles: bool = False) -> list[str]:
    """What is wrong with a text."""
    form = case.choose()
    try:
        found = verify(
            read(cl.encode(), name="part.cls"),
            ("\n".join(lines) + "\n").encode(),
            skip_cycles=skip_cycles,
            tolerance=EPS,
            axis_length=10.0,
            control=case.control,
            machine=form.machine,
            tcp=case.tcp,
        )
    except InputError as error:
        return [str(error)]
    return [f"{problem.code} {problem.text}" for problem in found.problems]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_cycle_in_the_words_of_its_control(case: Case) -> None:
    lines = text_of(case)
    assert [match[1] for match in map(_CYCLE.fullmatch, lines) if match] == EXPECTED[case.control].splitlines()
    assert problems(case, lines) == []


@pytest.mark.parametrize("case", share([case for case in CASES if case.machine], 2), ids=str)
def test_a_tool_along_z_runs_without_tool_tip_control_behind_a_tilted_one(case: Case) -> None:
    lines = text_of(case, TILTED)
    assert [match[1] for match in map(_CYCLE.fullmatch, lines) if match] == EXPECTED[case.control].splitlines()
    assert problems(case, lines, TILTED) == []
    first = next(k for k, line in enumerate(lines) if _CYCLE.fullmatch(line))
    zero = max(k for k, line in enumerate(lines[:first]) if re.search(r"[ABC]\+?0\.0+ [BC]\+?0\.0+", line))
    assert zero > max(k for k, line in enumerate(lines[:first]) if re.search(r"M6$|TOOL CALL 1 Z", line))
    turned = [*lines[:zero], *lines[zero + 1 :]]  # the axes stay where the tilted tool has left them
    assert problems(case, turned, TILTED) != []


def test_without_a_machine_nothing_brings_the_axes_back_behind_a_tilted_tool() -> None:
    case = Case("fanuc", "g1")
    with pytest.raises(InputError, match="nothing says that the rotary axes do"):
        text_of(case, TILTED)
    lines = lines_of(case.choose(), TILTED, frame=Frame(cycles="native", skip_cycles=True))
    assert not any("G98" in line for line in lines)


@pytest.mark.parametrize("case", [Case("siemens", "bspline"), Case("mitsubishi", "g6.2")], ids=str)
def test_a_form_without_cycles_says_so_and_not_that_the_tool_tilts(case: Case) -> None:
    with pytest.raises(InputError, match=f"-f {case.form} has no cycles of the control"):
        text_of(case)


def test_plain_moves_are_the_default_and_taps_are_cycles_anyway() -> None:
    lines = text_of(CASES[0], cycles="moves")
    assert [line for line in lines if "G98" in line] == ISO.splitlines()[-2:]
    assert problems(CASES[0], lines) == []


@pytest.mark.parametrize(
    "cycle",
    [
        "CYCLE/DEEP,FEDTO,25,STEP,10,5,MMPM,90,RAPTO,3",  # steps of two depths
        "CYCLE/DEEP,FEDTO,25,STEP,10,MMPM,90,RAPTO,3,DWELL,1",
        "CYCLE/DRILL,FEDTO,25,MMPM,90",  # from the height of travel
    ],
)
def test_what_the_control_has_no_cycle_for_stays_plain_moves(cycle: str) -> None:
    cl = f"UNITS/MM\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,0,30\n{cycle}\nGOTO/9,0,0\nCYCLE/OFF\nFINI\n"
    for case in CASES[:4]:
        lines = text_of(case, cl)
        assert not any(map(_CYCLE.fullmatch, lines))
        assert problems(case, lines, cl) == []


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("SPINDL/500,RPM,CLW", "SPINDL/500,RPM,CCLW", "clockwise"),
        ("SPINDL/500,RPM,CLW", "SPINDL/OFF", "clockwise"),
        # LinuxCNC: "Spindle turning counterclockwise in G84"
        ("SPINDL/500,RPM,CLW", "SPINDL/500,RPM,CLW\nAUXFUN/4", "clockwise"),
        ("CYCLE/TAP", "CYCLE/TAP,BRKCHP", "not understood"),
        ("MMPM,500,RAPTO,5", "MMPM,500", "no such cycle"),
    ],
)
def test_a_tap_that_no_cycle_can_do_is_an_error(old: str, new: str, why: str) -> None:
    with pytest.raises(InputError, match=why) as refused:
        text_of(CASES[0], PLAIN.replace(old, new))
    assert refused.value.code == "CS342"


def test_a_tap_left_out_on_purpose_is_no_problem_and_any_other_is() -> None:
    case = CASES[0]
    frame = Frame(skip_cycles=True, comments=False)
    cl = PLAIN.replace(",CLW", ",CCLW")
    lines = lines_of(case.choose(), cl, frame=frame)
    assert sum("NOT DRILLED" in line for line in lines) == 2
    assert problems(case, lines, cl, skip_cycles=True) == []
    assert problems(case, lines, cl) == ["CS561 a hole of the CL file is not tapped"] * 2


def test_a_thread_cut_by_plain_feeds_is_found() -> None:
    lines = text_of(CASES[0])
    at = lines.index(ISO.splitlines()[-1])
    moves = ["G0 X31. Y7. Z30.", "G0 X31. Y7. Z6.", "G1 X31. Y7. Z-14. F500.", "G1 X31. Y7. Z6.", "G0 X31. Y7. Z30."]
    found = problems(CASES[0], [*lines[:at], "G80", *moves, *lines[at + 1 :]])
    assert "CS561 a hole of the CL file is not tapped" in found


@dataclass(frozen=True)
class Mutant:
    """A wrong text."""

    kind: str
    lines: tuple[str, ...]


#: numbers that say how often a tool comes out of a hole, or when: nobody's affair but its own
_FREE = re.compile(r"Q10\.0+|Q4\.0+|,,,(10|4)\.0+|Q202=\S+|P0\.")


def mutants(lines: list[str]) -> Iterator[Mutant]:
    """Texts with one wrong word in or about their cycles."""
    for k, line in enumerate(lines):
        match = _CYCLE.fullmatch(line)
        if match is None and not re.search(r"^M29|M99$|^G80$|^F\d+\.$|^G43 H|^D1$", line):
            continue
        before, behind = tuple(lines[:k]), tuple(lines[k + 1 :])
        if line.startswith("F") and line == next((said for said in before[::-1] if said.startswith("F")), ""):
            continue
        if not re.search(r"^G80$|^D1$", line):
            yield Mutant(f"dropped: {line}", before + behind)
        if match is None:
            continue
        free = [found.span() for found in _FREE.finditer(line)]
        for number in re.finditer(r"(?<=[XYZRFP=,(])[-+]?\d+\.?\d*", line):
            if any(first <= number.start() < last for first, last in free) or number[0].strip("+-0.") == "":
                continue
            start = line[: number.start()]
            argument = start.count(",") if "CYCLE8" in line else -1
            if argument == 9 or ("CYCLE83" in line and argument > 9):
                continue  # where the spindle stands before a tap; the kind of peck
            value = float(number[0]) + 0.3
            if start.endswith((" R", "Q200=", "Q204=")) or argument in (0, 1, 2):
                value = -12.0  # heights in the air: a little more or less does no harm
            if start.endswith((" P", "Q211=")):
                value = 2 * float(number[0])
            changed = f"{value:g}" if start.endswith(" P") and "." not in number[0] else f"{value:.4f}"
            yield Mutant(f"{number[0]} in {line}", (*before, start + changed + line[number.end() :], *behind))
        for old, new in (("G81", "G84"), ("G84", "G81"), ("G82", "G81"), ("G85", "G81"), ("G98 ", ""), ("G98", "G99")):
            if old in line and (old, new) != ("G85", "G81"):
                yield Mutant(f"{old} to {new}: {line}", (*before, line.replace(old, new), *behind))


@pytest.mark.parametrize("case", [CASES[0], CASES[2], CASES[3], CASES[6], CASES[9]], ids=str)
def test_mutants_of_cycles_are_found(case: Case) -> None:
    every = list(mutants(text_of(case)))
    assert len(every) > 40
    chosen = share(every, 18, CASES.index(case))
    assert [mutant.kind for mutant in chosen if not problems(case, list(mutant.lines))] == []


@pytest.mark.linuxcnc
@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC is not installed")
def test_linuxcnc_makes_the_same_moves_of_its_cycles(tmp_path: Path) -> None:
    case = Case("linuxcnc", "g1", "xyzac-trt")
    text = "\n".join(text_of(case)) + "\n"
    accepted(text, tmp_path)
    rows = positions(text, tmp_path)
    fed = [place[:3] for kind, place in rows if kind == "feed"]
    tops = {(20, 5): 1, (31, 7): 2, (0, 7): 1, (0, 17): 1, (10, 17): 1, (20, 17): 1}
    depths = {(20, 5): 15, (31, 7): 25, (0, 7): 15, (0, 17): 15, (10, 17): 15, (20, 17): 15}
    lowest = {place: min(z for x, y, z in fed if (round(x), round(y)) == place) for place in tops}
    assert lowest == pytest.approx({place: tops[place] - depths[place] for place in tops})
    heights = np.array([place[2] for kind, place in rows if kind == "rapid"][2:])
    assert heights.max() < 31.0


@pytest.mark.parametrize(
    "cycles",
    [
        ("TAP,FEDTO,9,MMPM,500,RAPTO,5",) * 2,
        ("DRILL,FEDTO,12,MMPM,90,RAPTO,3", "TAP,FEDTO,9,MMPM,500,RAPTO,5"),
        ("TAP,FEDTO,9,MMPR,1,RAPTO,5", "FACE,FEDTO,1,MMPM,90,RAPTO,3,DWELL,0.5"),
    ],
    ids=["tapped twice", "tapped behind a drill", "tapped before a chamfer"],
)
def test_one_hole_by_several_cycles_is_right(cycles: tuple[str, ...]) -> None:
    holes = "".join(f"CYCLE/{cycle}\nGOTO/9,3,0\n" for cycle in cycles)
    cl = f"UNITS/MM\nSPINDL/500,RPM,CLW\nRAPID\nGOTO/0,0,30\n{holes}GOTO/19,3,0\nCYCLE/OFF\nFINI\n"
    for case in CASES[:4]:
        assert problems(case, text_of(case, cl), cl) == []


def test_without_any_cycle_of_the_control_a_tool_along_z_is_written_as_before() -> None:
    case = Case("heidenhain", "g1", "table-ac")
    cl = (
        TILTED[: TILTED.index("CYCLE/DRILL")]
        + "CYCLE/BRKCHP,FEDTO,9,INCR,4,MMPM,90,RAPTO,3\nGOTO/0,7,1\nCYCLE/OFF\nFINI\n"
    )
    assert text_of(case, cl) == text_of(case, cl, cycles="moves")


@pytest.mark.parametrize("case", [CASES[0], CASES[2], CASES[3]], ids=str)
def test_taps_have_a_feed_per_minute_in_plans(case: Case) -> None:
    text = ("\n".join(text_of(case)) + "\n").encode()
    program = written_motion(read_nc(text, control=case.control), "part.nc").program
    assert set(program.feed_mode.tolist()) == {FeedMode.PER_MINUTE}
    fed = program.feed[~np.isnan(program.feed)]
    assert np.isclose(fed, 500.0).sum() == 4


@pytest.mark.parametrize("case", [CASES[0], CASES[2], CASES[3]], ids=str)
def test_planned_feeds_leave_cycles_alone(case: Case) -> None:
    program, stream = read(PLAIN.encode(), name="part.cls"), io.BytesIO()
    frame, settings = Frame(cycles="native", skip_cycles=False), Settings(tolerance=EPS)
    result = postprocess(program, stream, settings, form=case.choose(), frame=frame, plan_feeds=Limits())
    assert result.verification is not None
    assert result.verification.problems == ()
    lines = stream.getvalue().decode("ascii").splitlines()
    assert [match[1] for match in map(_CYCLE.fullmatch, lines) if match] == EXPECTED[case.control].splitlines()


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_tap_behind_a_place_that_the_tool_was_at_before_is_found(case: Case) -> None:
    """Out along a line and back: the place before the tap is in the text twice."""
    cl = (
        "LOADTL/1\nSPINDL/500,RPM,CLW\nFEDRAT/MMPM,900\nRAPID\nGOTO/30,20,80,0,0,1\nGOTO/50,10,60\nGOTO/30,20,80\n"
        "CYCLE/TAP,FEDTO,12,MMPM,500,RAPTO,3,RTRCTO,20\nGOTO/10,22,70\nCYCLE/OFF\nRAPID\nGOTO/10,22,90\nFINI\n"
    )
    lines = text_of(case, cl)
    assert problems(case, lines, cl) == []
    tap = next(k for k, line in enumerate(lines) if re.search(r"G84|CYCLE84|M99", line))
    assert "CS561 a hole of the CL file is not tapped" in problems(case, [*lines[:tap], *lines[tap + 1 :]], cl)
    cl = cl.replace(",CLW", ",CCLW")
    left_out = lines_of(case.choose(), cl, frame=Frame(skip_cycles=True, comments=False))
    assert sum("NOT DRILLED" in line for line in left_out) == 1
    assert problems(case, left_out, cl, skip_cycles=True) == []


@pytest.mark.parametrize("case", CASES, ids=str)
def test_arcs_of_a_tool_whose_holes_are_cycles_are_circular_blocks(case: Case) -> None:
    cl = PLAIN.replace(
        "FEDRAT/MMPM,100",
        "FEDRAT/MMPM,100\nGOTO/0,0,0\nGOTO/30,0,0\nCIRCLE/30,10,0,0,0,1,10\nGOTO/40,10,0\nRAPID\nGOTO/40,10,30",
        1,
    )
    lines = text_of(case, cl)
    assert sum(bool(re.search(r"^G3 X|^\d+ CR X", line)) for line in lines) == 1
    assert any(map(_CYCLE.fullmatch, lines))
    assert problems(case, lines, cl) == []
