"""Fast path equals careful path: lines read by their patterns, and the same lines read carefully."""

from __future__ import annotations

import random
import re

import numpy as np
import pytest

from cornersmooth.verify import block_tables
from cornersmooth.verify.lexer import Lexer
from cornersmooth.verify.line_patterns import LinePatterns, lines_of
from cornersmooth.verify.words import Table

NUMBERS = ["0", "-0.", "5.", ".5", "-.25", "12.3456", "-123.4567", "0.3956870", "-1.0000000", "1234.5678", "7", "-42"]
ODD = ["+1.5", "123456.789", "1-2", "", " 3.", "1..2"]


def text(seed, odd):
    random.seed(seed)
    shapes = []
    for _ in range(100):
        letters = random.choice(["XYZ", "XYZIJK", "GXYZF", "KXYZUVWR", "K", "XYZ"])
        words = [letter + ("1" if letter == "G" else random.choice(NUMBERS)) for letter in letters]
        shapes.append(random.choice([" ", " ", "", "  "]).join(words) + random.choice(["", " ", "\r"]))
    shapes += ["", "(A 1.5 B)", "T1 M6", "S12000 M3"]
    lines = [re.sub("[2-9]", lambda _: str(random.randrange(10)), random.choice(shapes)) for _ in range(400)]
    if odd is not None:
        lines[200] = f"X1. Y{odd} Z3."
    return ("\n".join(lines) + "\n").encode()


def plain(items):
    return [
        (item.line.tolist(), {k: v.tobytes() for k, v in item.columns.items()}) if isinstance(item, Table) else item
        for item in items
    ]


def read(call):
    found = []
    try:
        found.extend(call)
    except Exception as error:
        return plain(found), str(error)
    return plain(found), ""


@pytest.mark.parametrize("odd", [None, *ODD])
@pytest.mark.parametrize("seed", range(5))
def test_fast_path_is_the_careful_path(seed, odd):
    data, lexer = text(seed, odd), Lexer()
    patterns = LinePatterns(lexer.columns, numbered=False)
    assert (lines_of(data, patterns) is not None) == (odd is None)
    fast = read(block_tables._read_chunk(data, 1, lexer, patterns, None))
    assert fast == read(block_tables._in_order(block_tables.LetteredLines(data, lexer), data, 1, lexer, None))


def test_fast_path_is_taken():
    patterns = LinePatterns(Lexer().columns, numbered=False)
    lines = lines_of(b"X1.5 Y-2.25\nX-1.5 Y2.25 Z12345.678\n(A)\n", patterns)
    assert lines is not None
    assert lines.bulk().tolist() == [True, True, False]
    columns = lines.columns(0, 2)
    assert columns["X"].tolist() == [1.5, -1.5]
    assert columns["Y"].tolist() == [-2.25, 2.25]
    assert np.isnan(columns["Z"][0])
    assert columns["Z"][1] == 12345.678
