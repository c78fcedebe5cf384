"""What may not happen in a hole: another state of the spindle, a rapid back into it."""

from __future__ import annotations

import re

import pytest

from .small import codes, passes, right

CL = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
CYCLE/DRILL,DEPTH,15,MMPM,100,CLEAR,2
GOTO/10,0,0
GOTO/40,0,0
CYCLE/OFF
SPINDL/OFF
RAPID
GOTO/40,0,80
FINI
"""
CASES = [(control, cycles) for control in ("fanuc", "siemens") for cycles in ("moves", "native")]


@pytest.mark.parametrize(("control", "cycles"), CASES)
def test_the_spindle_stops_after_the_last_hole(control: str, cycles: str) -> None:
    lines = right(CL, control, cycles)
    off = next(k for k, line in enumerate(lines) if line == "M5")
    drills = [k for k in range(off) if re.search(r"CYCLE81\(|G81|G1 .*Z-15", lines[k])]
    rest = [line for line in lines if line != "M5"]
    for place in {drills[-1], drills[-1] + (cycles == "moves")}:  # before it goes down, and at the bottom
        assert codes(CL, [*rest[:place], "M5", *rest[place:]], control) == {"CS552"}, place


@pytest.mark.parametrize(("control", "cycles"), CASES)
def test_no_rapid_goes_back_into_a_hole(control: str, cycles: str) -> None:
    lines = right(CL, control, cycles)
    up = next(k for k, line in enumerate(lines) if re.match(r"G0 .*Z80", line))
    dip = [re.sub(r"Z80", f"Z{height}", lines[up]) for height in (-10, 50)]
    assert "CS563" in codes(CL, [*lines[:up], *dip, *lines[up:]], control)


@pytest.mark.parametrize("control", ["fanuc", "siemens"])
def test_a_dwell_is_at_the_bottom(control: str) -> None:
    text = CL.replace("CLEAR,2", "CLEAR,2,DWELL,0.5")
    lines = right(text, control, "moves")
    bottom = [k for k, line in enumerate(lines) if line.startswith("G4 ")]
    assert len(bottom) == 2
    for k in bottom:
        for place in (k - 1, k + 1):
            others = [*lines[:k], *lines[k + 1 :]]
            assert codes(text, [*others[:place], lines[k], *others[place:]], control) == {"CS556"}, place
        for place in (k, k + 1):  # the last block again, in front of the dwell and behind it
            assert not codes(text, [*lines[:place], lines[k - 1], *lines[place:]], control), place


def test_a_feed_move_out_of_a_hole_ends_at_its_pose() -> None:
    text = CL.replace("CYCLE/OFF", "CYCLE/OFF\nFEDRAT/MMPM,200\nGOTO/40,0,12")
    lines = right(text, "fanuc", "native")
    out = next(k for k, line in enumerate(lines) if line.startswith("G1") and "Z12." in line)
    assert codes(text, [*lines[:out], lines[out].replace("Z12.", "Z13."), *lines[out + 1 :]])


def test_a_dwell_within_a_hole_is_not_that_behind_it() -> None:
    text = CL.replace("DRILL,DEPTH,15,MMPM,100,CLEAR,2", "DEEP,DEPTH,15,MMPM,100,CLEAR,2,STEP,4")
    text = text.replace("CYCLE/OFF", "CYCLE/OFF\nDELAY/0.5")
    lines = right(text, "fanuc", "moves")
    dwell = next(k for k, line in enumerate(lines) if line.startswith("G4 "))
    others = [*lines[:dwell], *lines[dwell + 1 :]]
    within = [k for k in range(dwell) if re.match(r"G1 .*Z-", others[k]) and "X40." in others[k]]
    assert len(within) == 4
    for k in within:
        for place in (k, k + 1):
            assert codes(text, [*others[:place], lines[dwell], *others[place:]]) == {"CS556"}, place


AFTER_A_TOOL = CL.replace("GOTO/40,0,0", "LOADTL/4\nGOTO/40,0,-30")


def test_a_rapid_goes_across_at_the_higher_level_behind_a_tool_change_without_way_back() -> None:
    lines = right(AFTER_A_TOOL, "generic", "moves")
    change = next(k for k, line in enumerate(lines) if line.startswith("T4"))
    across = next(k for k in range(change, len(lines)) if lines[k].startswith("G0 "))
    assert codes(AFTER_A_TOOL, [*lines[:across], *lines[across + 1 :]], "generic") == {"CS563"}


#: three holes in one line, one of which may be left out, with another state for each
IN_ONE_LINE = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/10,0,60,0,0,1
CYCLE/DRILL,FEDTO,4,MMPM,100,RAPTO,3,RTRCTO,10
GOTO/10,0,20,0,0,1
SPINDL/RPM,2000,CLW
CYCLE/{kind},FEDTO,4,MMPM,150,RAPTO,3,RTRCTO,10
GOTO/10,0,10,0,0,1
SPINDL/RPM,1000,CLW
CYCLE/DRILL,FEDTO,4,MMPM,200,RAPTO,3,RTRCTO,10
GOTO/10,0,0,0,0,1
CYCLE/OFF
RAPID
GOTO/10,0,80,0,0,1
SPINDL/OFF
FINI
"""


@pytest.mark.parametrize("kind", ["FACE", "BORE", "TAP"])
@pytest.mark.parametrize("cycles", ["moves", "native"])
def test_words_between_holes_in_one_line_stay_between_them(kind: str, cycles: str) -> None:
    text = IN_ONE_LINE.format(kind=kind)
    lines = right(text, "fanuc", cycles, skip=True)
    speeds = [k for k, line in enumerate(lines) if re.match(r"S[12]000 ", line)]
    assert len(speeds) == 2
    for k in speeds[kind == "TAP" :]:  # a speed at a tap that is left out no motion meets
        others = [*lines[:k], *lines[k + 1 :]]
        assert not passes(text, others, skip=True)
        fed = [j for j, line in enumerate(others) if re.match(r"G1 |G98|G81|G8[2459]", line)]
        behind = next(j for j in fed if j >= k)
        before = [j for j in fed if j < k]
        # in front of a feed move before it, or behind one that it has to be in front of
        for place in (*before, behind + 1):
            assert not passes(text, [*others[:place], lines[k], *others[place:]], skip=True), (lines[k], place)


@pytest.mark.parametrize("cycles", ["moves", "native"])
def test_of_holes_in_one_line_none_is_lost_and_none_is_drilled_twice(cycles: str) -> None:
    text = IN_ONE_LINE.format(kind="DRILL")
    lines = right(text, "fanuc", cycles)
    for k in [k for k, line in enumerate(lines) if re.match(r"G1 .*Z|G98|G81|.*F[12][05]0", line)]:
        assert not passes(text, [*lines[:k], *lines[k + 1 :]]), lines[k]
        deeper = re.sub(r"Z(-?\d+)", lambda found: f"Z{int(found[1]) - 1}", lines[k])
        assert not passes(text, [*lines[:k], deeper, *lines[k + 1 :]]), deeper
