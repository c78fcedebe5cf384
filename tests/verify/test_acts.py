"""States where the tool moves, actions between two motions: what is said late, early, in a hole or for nothing."""

from __future__ import annotations

import re

import pytest

from cornersmooth.errors import Verdict

from .small import codes, found, right

RUN = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
RAPID
GOTO/0,0,0
FEDRAT/MMPM,500
GOTO/10,0,0
COOLNT/ON
GOTO/10,10,0
GOTO/0,10,0
COOLNT/OFF
GOTO/0,0,0
RAPID
GOTO/0,0,50
FINI
"""
#: the same place twice, and holes in one line
TWICE = RUN.replace("GOTO/0,10,0\n", "GOTO/10,0,0\nOPSTOP\nGOTO/0,10,0\n")
HOLES = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
CYCLE/DRILL,DEPTH,10,MMPM,100,CLEAR,2
GOTO/0,0,0
GOTO/0,0,-10
CYCLE/OFF
SPINDL/OFF
RAPID
GOTO/0,0,80
FINI
"""


def moved(lines: tuple[str, ...], word: str, by: int) -> tuple[str, ...]:
    """A program in which a word stands some lines farther on."""
    k = next(k for k, line in enumerate(lines) if re.fullmatch(rf"(\d+ )?{word}", line))
    rest = (*lines[:k], *lines[k + 1 :])
    return *rest[: k + by], lines[k], *rest[k + by :]


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
@pytest.mark.parametrize("word", ["M8", "M9"])
def test_a_word_within_a_run_stands_at_its_pose_alone(control: str, word: str) -> None:
    """One block before or behind is another place, though it is within ε of the pose, too."""
    lines = right(RUN, control)
    for by in (-2, -1, 1, 2):
        assert codes(RUN, moved(lines, word, by), control) == {"CS553"}, by


def test_a_pose_met_twice_counts_once() -> None:
    lines = right(TWICE)
    k = lines.index("M8")
    again = lines.index("M1")
    late = (*lines[:k], *lines[k + 1 : again + 1], "M8", *lines[again + 1 :])
    assert lines[again - 1] == lines[k - 1].removesuffix(" F500.")
    assert "CS553" in codes(TWICE, late)


def test_nothing_but_a_dwell_and_a_tap_is_said_in_a_hole() -> None:
    """Also in the last of several holes in one line, and on the way out of it."""
    lines = right(HOLES)
    off = lines.index("M5")
    first = next(k for k, line in enumerate(lines) if re.search(r"Z-20", line))
    rest = (*lines[:off], *lines[off + 1 :])
    for at in (first, first + 1):
        assert "CS552" in codes(HOLES, (*rest[:at], "M5", *rest[at:]))
    for word in ("M1", "M8", "S2000", "M4"):
        assert found(HOLES, (*lines[: first + 1], word, *lines[first + 1 :])).problems, word
    assert found(HOLES, (*lines[: first + 1], "M3", *lines[first + 1 :])).passed  # it turns already


def test_holes_above_one_another_are_not_verified_where_they_are_not_done_as_their_cycles_say() -> None:
    """Which of them a move belongs to, nobody can tell; a hole beside others is wrong at its line."""
    lines = right(HOLES)
    for number, depth in ((0, "Z-10."), (1, "Z-20.")):
        at = next(k for k, line in enumerate(lines) if line.startswith("G1") and depth in line)
        deeper = (*lines[:at], lines[at].replace(depth, depth[:-1] + ".5"), *lines[at + 1 :])
        judged = found(HOLES, deeper)
        assert (judged.verdict, judged.problems) == (Verdict.NOT_VERIFIED, ()), number
        assert judged.unverified.startswith("holes above one another in one line at NC line")
    beside = HOLES.replace("GOTO/0,0,-10", "GOTO/5,0,-10").replace("GOTO/0,0,80", "GOTO/5,0,80")
    lines = right(beside)
    at = next(k for k, line in enumerate(lines) if "Z-20." in line)
    deeper = (*lines[:at], lines[at].replace("Z-20.", "Z-20.5"), *lines[at + 1 :])
    assert [(one.code, one.nc_line) for one in found(beside, deeper).problems] == [("CS562", at + 1)]


def test_what_does_not_change_anything_may_be_said() -> None:
    lines = right(RUN)
    k = next(k for k, line in enumerate(lines) if line.startswith("G1"))
    for word in ("M3", "M9", "S3000", "G4 P100"):
        assert found(RUN, (*lines[:k], word, *lines[k:])).passed, word
    for word in ("M4", "M8", "S2000", "M5"):
        assert len(found(RUN, (*lines[:k], word, *lines[k:])).problems) <= 2, word
        assert not found(RUN, (*lines[:k], word, *lines[k:])).passed, word


MET = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
CYCLE/BORE,DEPTH,10,MMPM,100,CLEAR,2
GOTO/0,0,0
CYCLE/OFF
COOLNT/ON
RAPID
GOTO/0,0,50
SPINDL/RPM,2000,CLW
FEDRAT/MMPM,500
GOTO/0,10,50
GOTO/0,10,60
RAPID
GOTO/0,0,80
FINI
"""


@pytest.mark.parametrize(
    "text", [MET, MET.replace("FEDRAT/MMPM,500\nGOTO/0,10,50\n", "RAPID\nGOTO/0,10,50\nFEDRAT/MMPM,500\n")]
)
def test_a_rapid_that_ends_where_a_hole_is_left_is_the_way_up_or_leads_nowhere(text: str) -> None:
    lines = right(text)
    m8, s = lines.index("M8"), next(k for k, line in enumerate(lines) if line.startswith("S2000"))
    assert "Z50." in lines[m8 - 1]  # the tool is up
    rest = tuple(line for k, line in enumerate(lines) if k not in (m8, s))
    up = m8 - 1

    def said(coolant: int, speed: int) -> set[str]:
        """Codes with both words before lines of the rest."""
        words = {coolant: ["M8"]}
        words.setdefault(speed, []).append(lines[s])
        new = [one for k, line in enumerate(rest) for one in (*words.get(k, ()), line)]
        return codes(text, tuple(new))

    assert said(up + 1, up + 1) == said(up, up + 1) == set()
    assert said(up, up) == {"CS552"}  # the speed is that behind the rapid
    assert "CS553" in said(up - 1, up + 1)
    assert said(up + 2, up + 1) == {"CS553"}
    assert said(up + 1, up + 2) == {"CS552"}


def test_a_rapid_higher_than_the_way_up_from_a_hole_is_no_way_up() -> None:
    text = MET.replace("RAPID\nGOTO/0,0,50\nSPINDL", "RAPID\nGOTO/0,0,70\nSPINDL").replace(
        ",50\nGOTO/0,10", ",70\nGOTO/0,10"
    )
    lines = right(text)
    k = lines.index("M8")
    assert "Z50." in lines[k - 1]
    assert "Z70." in lines[k + 1]
    assert codes(text, moved(lines, "M8", 1)) == {"CS553"}
    assert not found(text, moved(lines, "M8", -1)).problems  # the hole ends at its clearance, as in the test above
    assert codes(text, moved(lines, "M8", -2)) == {"CS553"}  # the tool is in the hole
