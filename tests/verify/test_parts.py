"""Digests of the parts of a program: which lines are named where one has changed."""

from __future__ import annotations

import pytest

from cornersmooth.control.source import read_lines
from cornersmooth.nc_reader.dialects import dialect_of
from cornersmooth.nc_words.check import WordCheck
from cornersmooth.nc_words.parts import Parts

CUTS = ["G0 X5. Y5.", "Z5.", "G1 Z0. F100.", "X1."]
UP = ["G91 G28 Z0.", "G90"]
PROGRAM = ["G21 G90 G94 G17 G40 G49 G80", *UP, "T1 M6", "G54", *CUTS, *UP, *CUTS, *UP, "G49", "M30"]


def parts_of(lines: list[str]) -> Parts:
    check = WordCheck("fanuc", dialect_of("fanuc", "").lexer, 0.01)
    list(check.watch(read_lines("".join(f"{line}\n" for line in lines).encode(), None, check.lexer)))
    return check.parts


@pytest.mark.parametrize(
    ("lines", "named"),
    [
        (PROGRAM, ""),
        ([*PROGRAM[:9], *UP, "M31", *CUTS, *PROGRAM[9:]], "lines 11 to 16"),  # a part more, in these lines
        ([*PROGRAM[:9], *PROGRAM[15:]], "lines 9 to 11"),  # one is gone, behind the first cut and before the retract
        ([*PROGRAM[:10], "M31", *PROGRAM[10:]], "lines 11 to 16"),  # one has a word more
    ],
)
def test_the_lines_of_the_parts_that_changed_are_named(lines: list[str], named: str) -> None:
    head = f"(PARTS={parts_of(PROGRAM).digests})"
    assert parts_of([head, *lines]).changed().partition(",")[0] == named
