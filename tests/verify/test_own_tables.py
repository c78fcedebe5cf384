"""Texts of a control table of the user's own: the words of the control that it is like, and those that it adds."""

from __future__ import annotations

import io

import pytest

from cornersmooth.cl import read
from cornersmooth.nc import choose_form, own_words, parse_control
from cornersmooth.pipeline import Result, postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification, verify

CL = b"""LOADTL/1
SPINDL/900,RPM,CLW
COOLNT/ON
FEDRAT/MMPM,500
RAPID
GOTO/0,0,9,0,0,1
GOTO/0,0,0
GOTO/10,0,0
COOLNT/OFF
LOADTL/2
SPINDL/800,RPM,CLW
RAPID
GOTO/0,0,9,0,0,1
GOTO/0,5,0
GOTO/10,5,0
FINI
"""

PROGRAM = read(CL, name="part.cls")

#: other coolant, and a call behind the tool change
WORDS = """like = "fanuc"
[words]
tool_change = ["T{tool} M6", "M98 P{tool}"]
coolant = { ON = ["M50"], OFF = ["M51"] }
"""

#: other blocks around the motion
FRAME = """like = "fanuc"
[program]
start = ["%", "{program}", "{units} G90 G94 G17 G40 G49", "G5.1 Q1", "{retract}", "{header}"]
end = ["{footer}", "M95", "M30", "%"]
"""


def made(table: str) -> tuple[str, Result]:
    """Text of a table, and what was found in it."""
    stream = io.BytesIO()
    result = postprocess(PROGRAM, stream, Settings(), form=choose_form(parse_control(table)), processes=1)
    return stream.getvalue().decode(), result


def judged(table: str, text: str) -> Verification:
    own = own_words(parse_control(table))
    return verify(PROGRAM, text.encode(), tolerance=0.01, axis_length=10.0, trusted=own)


def test_a_table_that_adds_no_words_is_verified_as_the_control_that_it_is_like() -> None:
    text, result = made('like = "fanuc"\n[digits]\nmm = 3\n')
    assert result.unverified == ""
    assert result.verification is not None
    assert result.verification.trusted == ()
    assert own_words(parse_control('like = "fanuc"')) == ()
    assert "X10.000 " in text


def test_what_a_table_adds_is_named() -> None:
    text, result = made(WORDS)
    assert result.verification is not None
    kinds, *blocks = result.verification.trusted
    assert {block for _, block in blocks} == {*("M98 P1", "M98 P2", "M50", "M51")}
    assert kinds == (0, "what your own table says of coolant, next tool, tool")
    assert result.unverified.endswith("1 more blocks of your own")
    assert judged(WORDS, text).passed


def test_blocks_around_the_motion_may_be_other_ones() -> None:
    text, result = made(FRAME)
    assert "M95, NC line" in result.unverified
    assert "cycles: G80 must come before the first motion" in result.unverified
    assert judged(FRAME, text).passed


#: what stands in the text, and what is put in its place
CHANGES = [
    ("M50", "M52"),
    ("M98 P1", "M97 P1"),
    ("G54\n", "G54\nM6\n"),
    ("M50\n", "M88\n"),
    ("F500.", "F500. M88"),
    ("F500.\n", "F500.\nG55\n"),
    ("F500.\n", "F500.\nG5.1 Q1\n"),
    ("F500.\n", "F500.\nM95\n"),
    ("F500.\n", "F500.\nG43.5 H7\n"),
    ("G21 G90 G94 G17 G40 G49 G80\n", "G21 G90 G94 G17 G40 G49\n"),
    ("M30\n%\n", "%\n"),
]


@pytest.mark.parametrize(("old", "new"), CHANGES)
def test_other_words_are_found(old: str, new: str) -> None:
    text, _ = made(WORDS)
    assert old in text
    assert not judged(WORDS, text.replace(old, new, 1)).passed
