"""Lines read by their digit patterns say what each says alone."""

from __future__ import annotations

import random
import re
from itertools import product
from operator import itemgetter

import numpy as np
import pytest

from cornersmooth.control import line_patterns, source
from cornersmooth.control.line_patterns import LinePatterns, Lines
from cornersmooth.control.words import Table, numbers
from cornersmooth.errors import InputError
from cornersmooth.nc_reader.dialects import dialect_of
from oracle.share import covering_share, how_many

NUMBERS = ["0.", "-0.", "5.", ".5", "-.25", "12.3456", "-123.4567", "0.3956870", "-1.0000000", "1234.5678", "7", "-42"]
NUMBERS += ["123.456789", "-1234.567891", "-9876543.2104567", "99.99999999", "-0.10000001"]
ODD = ["+1.5", "0.123456789", "1234567890.123456", "1-2", "", " 3.", "1..2", "1.5+1.5", "--1.5", "1.5E3"]

ISO = ["X# Y# Z#", "X#Y#Z#I#J#K#", "G1 X# Y# Z# F#", "G0 X# Z#", "K# X# Y# Z# U# V# W# R#", "K#", "G6.2 P4 K# X#"]
ISO += ["", "(A 1.5 B)", "T1 M6", "S12000 M3", "G4 X1.5", "N10 G1 X#", "G1 X# (A)", "/ X#"]
SIEMENS = ["X# Y# Z# A3=# B3=# C3=#", "G1 X# XH=# YH=# ZH=# F#", "BSPLINE SD=3 X# Y# PL=# PW=#", "X# PL=#", "G0 X# Y#"]
SIEMENS += ["POLY PO[X]=(#, #) PO[Y]=(#, #,#) PL=#", "N10 X#", "TRAORI", "CYCLE832(0.1,_FINISH,1)", "M8 X#", "SD=2 X#"]
KLARTEXT = ["10 LN X# Y# Z# TX# TY# TZ#", "11 L X# FMAX", "L Y# F800", "SPL X# K3X#E-02 K2X# K1X# Y# K3Y#E-01 K2Y#"]
KLARTEXT += [
    "12 TOOL CALL 3 Z",
    "13 ; A 1.5 B",
    "14",
    "15 M8",
    "16 LN X# M8",
    "17 CC X# Y#",
    "18 C X# DR+",
    "SPL K2X# X#",
]
SHAPES = {"fanuc": ISO, "siemens": SIEMENS, "heidenhain": KLARTEXT}


def text(control, seed, odd):
    random.seed(seed)
    shapes = []
    for _ in range(100):
        shape = re.sub("#", lambda _: random.choice(NUMBERS), random.choice(SHAPES[control]))
        shapes.append(shape + random.choice(["", " ", "\r"]))
    lines = [re.sub(r"(?<=[\d.])[2-9]", lambda _: str(random.randrange(10)), random.choice(shapes)) for _ in range(400)]
    if odd is not None:
        lines[200] = SHAPES[control][0].replace("#", odd, 1).replace("#", "1.5")
    return ("\n".join(lines) + "\n").encode()


def lines_apart(items):
    """What is said, line by line: where a run begins and ends does not matter."""
    for item in items:
        if isinstance(item, Table):
            for row, number in enumerate(item.line.tolist()):
                yield number, {k: v[row] for k, v in item.columns.items() if not np.isnan(v[row])}
        else:
            yield item.number, item


def read(call):
    found = []
    try:
        found.extend(lines_apart(call))
        wrong = ""
    except Exception as error:
        wrong = str(error)
    blocks = {number for number, said in found if isinstance(said, dict)}  # comments of these come before them
    apart = [(number, said) for number, said in found if isinstance(said, dict) or number not in blocks]
    return sorted(apart, key=itemgetter(0)), wrong  # blank lines within a run come after it


def same_alone(data, dialect):
    """How many lines are read in runs; each says what it says alone."""
    together, _ = read(source.read_lines(data, None, dialect.lexer))
    for (number, said), line in zip(together, data.split(b"\n")[:-1], strict=True):
        alone = dialect.lexer.line(line, number, None)
        assert said == (alone if not isinstance(said, dict) else numbers(dialect.lexer.motion(alone)))
    return int(Lines.of(data, LinePatterns(dialect.lexer)).bulk().sum())


@pytest.mark.parametrize(
    ("control", "seed", "odd"), covering_share(product(SHAPES, range(how_many(1, 3)), [None, *ODD]), 3)
)
def test_lines_in_runs_say_what_each_says_alone(control, seed, odd):
    data, dialect = text(control, seed, odd), dialect_of(control)
    together, wrong = read(source.read_lines(data, None, dialect.lexer))
    for (number, said), line in zip(together, data.split(b"\n"), strict=False):
        alone = dialect.lexer.line(line, number, None)
        assert said == (alone if not isinstance(said, dict) else numbers(dialect.lexer.motion(alone)))
    assert any(isinstance(said, dict) for _, said in together)
    if len(together) < len(data.split(b"\n")) - 1:
        assert odd is not None
        with pytest.raises(InputError) as error:
            dialect.lexer.line(data.split(b"\n")[200], 201, None)
        assert str(error.value) == wrong


def test_zero_without_a_point_does_not_let_other_numbers_without_one_through():
    assert same_alone(b"G1 X0 Y1.5\nX0 Y1.5\nX5 Y2.5\nN1 X0 Y3.5\n", dialect_of("fanuc")) == 3
    assert same_alone(b"G1 X0 Y1.5\nX5 Y1.5\n", dialect_of("linuxcnc")) == 2


@pytest.mark.parametrize("control", SHAPES)
def test_lines_that_each_have_a_shape_of_their_own_are_read_in_runs(control, monkeypatch):
    monkeypatch.setattr(source, "CHUNK", 4000)
    rng, data = random.Random(5), []
    for number in range(600):
        words = [f"{letter}{rng.uniform(-10, 900):.{rng.randrange(9)}f}".ljust(5, "0") for letter in "XYZ"]
        words = [word if "." in word else word + "." for word in words]
        data.append(f"{number} L " + " ".join(words) if control == "heidenhain" else f"N{number} " + " ".join(words))
    assert same_alone("\n".join(data + ["G1 X1.5"]).encode() + b"\n", dialect_of(control)) >= 600


def test_a_motion_block_with_a_comment_is_one_of_a_run():
    one, two, table, three = source.read_lines(b"G1 X1.5 (A)\nX2.5(B)\n/X3.5 (C)\n", None, dialect_of("fanuc").lexer)
    assert [(line.number, line.comments, line.words) for line in (one, two)] == [(1, ("A",), ()), (2, ("B",), ())]
    assert (table.line.tolist(), table.columns["X"].tolist()) == ([1, 2], [1.5, 2.5])
    assert (three.skipped, len(three.words)) == (True, 1)


def test_lines_without_words_do_not_end_a_run():
    lexer = dialect_of("fanuc").lexer
    first, *rest = source.read_lines(b"G1 X1.5\n\n \r\nX2.5\n", None, lexer)
    assert first.line.tolist() == [1, 4]
    assert [line.number for line in rest] == [2, 3]


def test_digits_that_stand_for_themselves_make_another_pattern():
    data = b"G1 X1.5\nG4 X2.5\nG0 X3.5\nG1 X4.5\n"
    lines = Lines.of(data, LinePatterns(dialect_of("fanuc").lexer))
    assert lines.bulk().tolist() == [True, False, True, True]
    columns = lines.columns(np.array([0, 2, 3]))
    assert columns["G"].tolist() == [1.0, 0.0, 1.0]
    assert columns["X"].tolist() == [1.5, 3.5, 4.5]


def test_numbers_of_any_length_are_those_of_python():
    numbers = [b"0.1234567890123", b"-123456789012.123456", b"-0.000000001", b"99999999.99999999", b"5", b"-.5", b"3."]
    data = b"".join(b"X%s Y1.0\n" % number for number in numbers)
    lines = Lines.of(data, LinePatterns(dialect_of("linuxcnc").lexer))
    assert lines.columns(np.arange(len(numbers)))["X"].tolist() == [float(number) for number in numbers]


def test_fast_path_is_taken():
    lines = Lines.of(b"X1.5 Y-2.25\nX-1.5 Y2.25 Z12345.678\n(A)\n", LinePatterns(dialect_of("fanuc").lexer))
    assert lines.bulk().tolist() == [True, True, False]
    columns = lines.columns(np.arange(2))
    assert columns["X"].tolist() == [1.5, -1.5]
    assert columns["Y"].tolist() == [-2.25, 2.25]
    assert np.isnan(columns["Z"][0])
    assert columns["Z"][1] == 12345.678


def test_shapes_with_one_key_or_with_keys_that_begin_alike_are_told_apart(monkeypatch):
    data, dialect, factors = text("fanuc", 1, None), dialect_of("fanuc"), line_patterns._FACTORS
    in_runs = same_alone(data, dialect)
    monkeypatch.setattr(line_patterns, "_FACTORS", factors >> np.uint64(20))
    assert same_alone(data, dialect) == in_runs > 100
    monkeypatch.setattr(line_patterns, "_FACTORS", factors << np.uint64(62))
    assert same_alone(data, dialect) < in_runs


def test_long_lines_are_read_as_they_are():
    blanks = (0, 100, *range(500, 507), 600)
    data = b"\n".join(b"X1.5 Y2.5" + b" " * k for k in blanks) + b"\n(" + b"A" * 300 + b")\nX3.5 Y1.5\n"
    assert same_alone(data, dialect_of("fanuc")) == sum(k + 10 <= line_patterns._LONGEST for k in blanks) + 1


def test_lines_keep_their_patterns_where_others_are_forgotten() -> None:
    patterns = LinePatterns(dialect_of("fanuc").lexer)
    first = Lines.of(b"".join(b"X%d.5 Y-%d. F%s.\n" % (k, k, b"1" * (k % 9 + 1)) for k in range(40)), patterns)
    Lines.of(b"Z1.5\n", patterns)  # fewer lines than patterns: all are forgotten
    Lines.of(b"G1 X1.25 I0.5\nY7. Z2.\n", patterns)
    assert first.bulk().all()
    columns = first.columns(np.arange(40))
    assert columns["X"].tolist() == [k + 0.5 for k in range(40)]
    assert columns["F"].tolist() == [float("1" * (k % 9 + 1)) for k in range(40)]
