"""Feeds are functions of the place: another move that runs through the same places lends none."""

from __future__ import annotations

import re
from functools import cache
from itertools import product

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.model import Program
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import Case
from nc.promise import written
from oracle.share import covering_share
from verify.writing import HEAD, TAIL, encode

CASES = (
    Case("fanuc", "g1"),
    Case("fanuc", "g6.2"),
    Case("fanuc", "g1", "table-ac"),
    Case("generic", "g1"),
    Case("haas", "g1", "table-bc"),
    Case("siemens", "g1"),
    Case("siemens", "bspline"),
    Case("heidenhain", "g1"),
    Case("heidenhain", "g1", "table-bc"),
    Case("linuxcnc", "g1", "xyzac-trt"),
    Case("mitsubishi", "g1"),
)

_BEGIN = "LOAD/TOOL,4,ADJUST,4\nRAPID\nGOTO/90,10,50,0,0,1\nRAPID\nGOTO/90,10,2\n"
_END = "RAPID\nGOTO/90,10,50\nFINI\n"

#: down and out again at once, a pass there and back, one of several moves with a corner, turned in its place and back
CLS = {
    "plunge": "FEDRAT/MMPM,150\nGOTO/90,10,-6\nFEDRAT/MMPM,2000\nGOTO/90,10,2\n",
    "spring pass": "FEDRAT/MMPM,150\nGOTO/110,10,2\nFEDRAT/MMPM,2000\nGOTO/90,10,2\n",
    "corner": "FEDRAT/MMPM,150\nGOTO/90,10,-6\nGOTO/110,10,-6\nFEDRAT/MMPM,2000\nGOTO/90,10,-6\nGOTO/90,10,2\n",
    "roughing": "FEDRAT/MMPM,2000\nGOTO/95,12,2\nGOTO/110,10,2\nFEDRAT/MMPM,150\nGOTO/95,12,2\nGOTO/90,10,2\n",
    "turn": "FEDRAT/MMPM,150\nGOTO/90,10,2,0.3420201,0,0.9396926\nFEDRAT/MMPM,2000\nGOTO/90,10,2,0,0,1\n",
}


@cache
def program(name: str) -> Program:
    """A CL program."""
    return read((_BEGIN + CLS[name] + _END).encode(), name="part.cls")


def codes(name: str, case: Case, lines: list[str]) -> list[str]:
    """What is found in a text whose head says nothing of who wrote it."""
    text = "\n".join([*(re.sub("CORNERSMOOTH", "MADE", line) for line in lines), ""]).encode()
    how = {"control": case.control, "machine": case.choose().machine, "tcp": case.tcp}
    return sorted({problem.code for problem in verify(program(name), text, tolerance=0.02, **how).problems})


@pytest.mark.parametrize(("case", "name"), covering_share(product(CASES, CLS), 2), ids=str)
def test_the_feed_of_the_way_back_is_found(case: Case, name: str) -> None:
    lines = written(program(name), case.choose(), Settings(tolerance=0.02))[0].splitlines()
    assert codes(name, case, lines) == []
    feeds = sorted({feed for line in lines for feed in re.findall(r"\bF(\d[\d.]*)", line)})
    assert len(feeds) == 2
    for feed, other in (feeds, feeds[::-1]):
        changed = [re.sub(rf"F{re.escape(feed)}(?![\d.])", f"F{other}", line) for line in lines]
        assert codes(name, case, changed) == ["CS541"], feed


def _text(feeds: list[float], heights: list[float]) -> bytes:
    """A plunge in blocks, and out of it."""
    rapid = "G0 X90. Y10. Z{:g}. I0. J0. K1."
    pairs = zip(heights, feeds, strict=True)
    blocks = [f"G1 X90. Y10. Z{height:.4f} I0. J0. K1. F{feed:g}." for height, feed in pairs]
    return encode([*HEAD, "T4 M6", "G43.5 H4", rapid.format(50), rapid.format(2), *blocks, rapid.format(50), *TAIL])


def test_short_blocks_have_the_feed_of_their_place() -> None:
    """Shorter than ε, so that each is near two moves at the bottom, and near one alone everywhere else."""
    down = np.round(np.arange(2.0, -6.0, -0.01)[1:], 4)
    heights = [*down.tolist(), -6.0, *down[::-1].tolist(), 2.0]
    right = [150.0] * (len(down) + 1) + [2000.0] * (len(down) + 1)
    cl = program("plunge")
    assert not verify(cl, _text(right, heights), tolerance=0.02).problems
    early = [*right]
    early[len(down)] = 2000.0
    assert not verify(cl, _text(early, heights), tolerance=0.02).problems
    for place in (10, len(down) // 2, len(down) - 6):
        wrong = [*right]
        wrong[place] = 2000.0
        assert [one.code for one in verify(cl, _text(wrong, heights), tolerance=0.02).problems] == ["CS541"]
    other = [*right]
    other[len(down)] = 900.0
    (one,) = verify(cl, _text(other, heights), tolerance=0.02).problems
    assert one.text == "the feed is 900 mm/min, the CL file says 150, then 2000"  # either would do there
    all_fast = [2000.0] * len(heights)
    assert [one.code for one in verify(cl, _text(all_fast, heights), tolerance=0.02).problems] == ["CS541"]


def test_every_move_under_a_long_block_has_its_feed() -> None:
    cl = read(
        (
            _BEGIN + "FEDRAT/MMPM,500\nGOTO/90,10,0\nFEDRAT/MMPM,150\nGOTO/90,10,-4\nFEDRAT/MMPM,500\n"
            "GOTO/90,10,-6\n" + _END
        ).encode(),
        name="part.cls",
    )
    assert not verify(cl, _text([500, 150, 500], [0, -4, -6]), tolerance=0.02).problems
    for feeds, heights in (([500], [-6]), ([150], [-6]), ([500, 500], [0, -6]), ([500, 150], [0, -6])):
        assert [one.code for one in verify(cl, _text(feeds, heights), tolerance=0.02).problems] == ["CS541"]


@pytest.mark.parametrize(
    ("control", "height", "feed", "found"),
    [
        ("fanuc", -5, 300, ["CS541"]),
        ("fanuc", -5, 286, []),
        ("fanuc", -2, 300, []),  # 0.8 % faster
        ("fanuc", 0, 300, []),
        ("linuxcnc", -5, 300, []),
        ("linuxcnc", -5, 286, ["CS541"]),
    ],
)
def test_a_helix_is_faster_where_f_counts_in_its_plane(
    control: str, height: float, feed: float, found: list[str]
) -> None:
    """F of FANUC counts along the arc, not along the helix (B-63324EN 4.5), unless 1403#5 is set."""
    circle = f"FEDRAT/MMPM,300\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,{height}\n"
    start = "LOAD/TOOL,4,ADJUST,4\nRAPID\nGOTO/10,0,0,0,0,1\n"
    cl = read((start + circle + "RAPID\nGOTO/0,10,50\nFINI\n").encode(), name="part.cls")
    assert len(cl.arcs.pose) == 1
    arc = f"G3 X0. Y10. Z{height:g}. R10. F{feed:g}{'' if '.' in str(feed) else '.'}"
    blocks = ["T4 M6", "G43 H4", "G0 X10. Y0.", "G0 X10. Y0. Z0.", arc, "G0 X0. Y10. Z50."]
    text = encode([*HEAD, *blocks, *TAIL])
    problems = verify(cl, text, tolerance=0.02, control=control, words=False).problems
    assert [problem.code for problem in problems] == found, problems


PLUNGES = b"""LOADTL/4
SPINDL/3000,RPM,CLW
RAPID
GOTO/-9,-9,20,0,0,1
RAPID
GOTO/-9,-9,2
FEDRAT/MMPM,300
GOTO/-9,-9,-3
{}
GOTO/20,0,-3
GOTO/40,9,-3
RAPID
GOTO/40,9,50
FINI
"""


@pytest.mark.parametrize("statement", [b"COOLNT/FLOOD", b"OPSTOP", b"SPINDL/900,RPM,CLW", b"CUTCOM/LEFT,4"])
@pytest.mark.parametrize("feed", ["F30.", "F3000."])
def test_the_last_block_before_a_word_within_a_run_has_its_feed(statement: bytes, feed: str) -> None:
    """The pose of the word divides the run, and the block before it belongs to the part that ends there."""
    part, case = read(PLUNGES.replace(b"{}", statement), name="part.cls"), Case("fanuc", "g1")
    lines = written(part, case.choose(), Settings(tolerance=0.02))[0].splitlines()
    how = {"tolerance": 0.02, "control": case.control}
    assert verify(part, "\n".join(lines).encode(), **how).verdict is Verdict.PASSED
    plunge = max(k for k, line in enumerate(lines) if line.startswith("G1 X-9.0000 Y-9.0000 Z-3.0000"))
    cut = next(k for k in range(plunge + 1, len(lines)) if lines[k].startswith("G1 "))
    for k, word in ((plunge, feed), (cut, "F300.")):
        lines[k] = re.sub(r" F.*|$", f" {word}", lines[k], count=1)
    found = verify(part, "\n".join(lines).encode(), **how)
    assert {(one.code, one.nc_line) for one in found.problems} == {("CS541", plunge + 1)}
