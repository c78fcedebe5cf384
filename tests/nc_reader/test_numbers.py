"""Numbers of a text found all at once, against the pattern that says what a number is."""

from __future__ import annotations

import random

import numpy as np
import pytest

from cornersmooth.nc_reader.block_tables import find_numbers
from cornersmooth.nc_reader.dialects import dialect_of

PIECES = [
    "G",
    "X",
    "K2X",
    "1",
    "23",
    ".",
    "..",
    "+",
    "-",
    "--",
    " ",
    "\n",
    ",",
    "(",
    "0.5",
    "-1.25",
    "E-02",
    "+.5",
    "G43.4",
]
PIECES += ["G43.4", "1.2.3", "5.", "\x01", "PO[X]=(", "12-1.5"]


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
def test_numbers_are_those_of_the_pattern(control: str) -> None:
    random.seed(5)
    lexer = dialect_of(control).lexer
    for _ in range(300):
        text = ("".join(random.choice(PIECES) for _ in range(random.randrange(1, 40))) + "\n").encode()
        found = find_numbers(text, lexer)
        spans = [match.span() for match in lexer.measure.finditer(text)]
        assert list(zip(found.start.tolist(), found.stop.tolist(), strict=True)) == spans
        assert found.values.tolist() == [float(text[slice(*span)]) for span in spans]
        marked = lexer.measure.sub(b"\x01", text.replace(b"\x01", b"?"))
        assert found.marked() == marked
        lines = text.split(b"\n")[:-1]
        before = np.cumsum([0, *(len(line) + 1 for line in lines)])[:-1]
        assert found.first.tolist() == [sum(start < place for start, _ in spans) for place in before.tolist()]
