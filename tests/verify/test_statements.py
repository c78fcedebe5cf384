"""Statements and holes: what the CL file asks for, and what the text does."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.control import source
from cornersmooth.model import Move, Program, Source, Statement
from cornersmooth.nc_reader import reader
from cornersmooth.nc_reader.elements import Ahead
from cornersmooth.verify import parse, stretches, verify

from .writing import HEAD, TAIL, encode

UP = np.array([0.0, 0.0, 1.0])


def said(*statements, kind=None, tip=None, **rest):
    tip = np.array([[0.0, 0, 5], [10, 0, 5], [20, 0, 5]]) if tip is None else np.array(tip, float)
    n = len(tip)
    kind = np.array([Move.RAPID] + [Move.LINEAR] * (n - 1), np.uint8) if kind is None else np.array(kind, np.uint8)
    return Program.from_poses(
        tip,
        np.tile(UP, (n, 1)),
        kind=kind,
        feed=100.0,
        statements=tuple(statements),
        line=np.arange(10, 10 + n),
        **rest,
    )


def text(*lines, offset=1):
    """Lines with places given as (code, x, y, z)."""
    out = [*HEAD]
    for line in lines:
        if isinstance(line, str):
            out.append(line)
        else:
            code, x, y, z = line
            feed = " F100." if code == "G1" else ""
            out.append(f"{code} X{x:.4f} Y{y:.4f} Z{z:.4f} I0.0000000 J0.0000000 K1.0000000{feed}")
    return encode([*out, *TAIL])


def codes(program, nc, **how):
    return sorted({problem.code for problem in verify(program, nc, tolerance=0.01, **how).problems})


PATH = [("G0", 0, 0, 5), ("G1", 10, 0, 5), ("G1", 20, 0, 5)]


@pytest.mark.parametrize(
    ("statement", "block"),
    [
        (Statement(0, 1, "LOADTL", (7.0,)), ["T7 M6", "G43.5 H7"]),
        (Statement(0, 1, "LOAD", ("TOOL", 7.0, "ADJUST", 2.0)), ["T7 M6", "G43.5 H2"]),
        (Statement(0, 1, "TURRET", (7.0, "OSETNO", 17.0)), ["T7", "M6", "G43.5 H17"]),
        (Statement(0, 1, "LOADTL", (7.0, "LENGTH", 60.0, "OSETNO", 7.0)), ["T7 M6", "G43.5 H7"]),
        (Statement(0, 1, "SELECT", ("TOOL", 9.0)), ["T9", "G43.5 H1"]),
        (Statement(0, 1, "SPINDL", (800.0, "RPM", "CCLW")), ["S800 M4", "G43.5 H1"]),
        (Statement(0, 1, "SPINDL", ("RPM", 800.5, "CLW", "RANGE", 2.0)), ["M3 S800.5", "G43.5 H1"]),
        (Statement(0, 1, "SPINDL", ("ORIENT",)), ["M19", "G43.5 H1"]),
        (Statement(0, 1, "COOLNT", ("FLOOD",)), ["M8", "G43.5 H1"]),
        (Statement(0, 1, "COOLNT", (), "COOLNT"), ["M8", "G43.5 H1"]),
        (Statement(0, 1, "DELAY", (2.5,)), ["G4 P2500", "G43.5 H1"]),
        (Statement(0, 1, "DELAY", (2.5,)), ["G4 X2.5", "G43.5 H1"]),
        (Statement(0, 1, "STOP"), ["M0", "G43.5 H1"]),
        (Statement(0, 1, "OPSTOP"), ["M1", "G43.5 H1"]),
        (Statement(0, 1, "AUXFUN", (31.0,)), ["M31", "G43.5 H1"]),
        (Statement(0, 1, "END"), ["M0", "G43.5 H1"]),
    ],
)
def test_statement_and_its_words(statement, block):
    program = said(statement)
    assert codes(program, text(*block, *PATH)) == []
    without = [line for line in block if line.startswith("G43")]
    assert codes(program, text(*without, *PATH)) != []
    late = [block[-1], PATH[0], PATH[1], *block[:-1], PATH[2]]
    assert codes(program, text(*late)) != []
    # nobody has to ask that time passes
    assert (codes(said(), text(*block, *PATH)) != []) is (statement.word != "DELAY")


def test_cutting_speed_needs_the_diameter():
    cutter = Statement(0, 1, "CUTTER", (20.0, 0.0, 10.0))
    speed = Statement(0, 2, "SPINDL", (100.0, "SMM", "CLW"))
    assert codes(said(cutter, speed), text("S1592 M3", "G43.5 H1", *PATH)) == []
    assert codes(said(cutter, speed), text("S1590 M3", "G43.5 H1", *PATH)) == ["CS552"]
    # without a diameter nobody can say: nothing is asked for
    assert codes(said(speed), text("G43.5 H1", *PATH)) == []


def test_what_is_repeated_changes_nothing():
    program = said(Statement(0, 1, "COOLNT", ("ON",)), Statement(1, 2, "COOLNT", ("ON",)))
    assert codes(program, text("G43.5 H1", "M8", *PATH)) == []
    assert codes(program, text("G43.5 H1", PATH[0], "M8", *PATH[1:])) == ["CS553"]


def test_compensation_and_its_register():
    program = said(Statement(1, 1, "CUTCOM", ("LEFT",)), Statement(3, 2, "CUTCOM", ("OFF",)))
    assert codes(program, text("G43.5 H1", PATH[0], "G41 D1", *PATH[1:], "G40")) == []
    assert codes(program, text("G43.5 H1", PATH[0], "G42 D1", *PATH[1:], "G40")) == ["CS554"]
    assert codes(program, text("G43.5 H1", PATH[0], "G41 D2", *PATH[1:], "G40")) == ["CS554"]
    assert codes(program, text("G43.5 H1", PATH[0], "G41 D1", *PATH[1:])) == ["CS554"]


def test_compensation_may_be_cancelled_before_the_end():
    program = said(Statement(1, 1, "CUTCOM", ("LEFT",)))
    for tail in ((), ("G40",)):
        assert codes(program, text("G43.5 H1", PATH[0], "G41 D1", *PATH[1:], *tail)) == []
    assert codes(program, text("G43.5 H1", PATH[0], "G41 D1", PATH[1], "G40", PATH[2])) == ["CS554"]


CYCLE = Statement(1, 3, "CYCLE", ("DRILL", "FEDTO", 8.0, "MMPM", 100.0, "RAPTO", 2.0))
OFF = Statement(3, 9, "CYCLE", ("OFF",))
HOLES = [[0.0, 0, 20], [0, 0, 0], [15, 0, 0], [15, 0, 30]]
KINDS = [Move.RAPID, Move.HOLE, Move.HOLE, Move.RAPID]
DRILLED = [
    ("G0", 0, 0, 20),
    ("G0", 0, 0, 2),
    ("G1", 0, 0, -8),
    ("G0", 0, 0, 20),
    ("G0", 15, 0, 20),
    ("G0", 15, 0, 2),
    ("G1", 15, 0, -8),
    ("G0", 15, 0, 20),
    ("G0", 15, 0, 30),
]


def drilled(**changes):
    lines = list(DRILLED)
    for name, line in changes.items():
        lines[int(name[1:])] = line
    return text("G43.5 H1", *[line for line in lines if line])


def test_holes():
    program = said(CYCLE, OFF, kind=KINDS, tip=HOLES)
    assert codes(program, drilled()) == []
    # pecks are what the cycle says: it has none
    pecked = [*DRILLED[:2], ("G1", 0, 0, -3), ("G0", 0, 0, 2), ("G0", 0, 0, -2.5), *DRILLED[2:]]
    assert codes(program, text("G43.5 H1", *pecked)) == ["CS562"]


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"n2": ("G1", 0, 0, -8.01)}, "CS562"),
        ({"n6": ("G1", 15, 0, -7.99)}, "CS562"),
        ({"n2": None}, "CS561"),
        ({"n1": ("G0", 0, 0, -1)}, "CS563"),
        ({"n3": None}, "CS563"),
        ({"n6": ("G1", 15.001, 0, -8)}, "CS561"),
        ({"n8": ("G0", 15, 0, 31)}, "CS532"),
    ],
)
def test_wrong_holes(changes, code):
    program = said(CYCLE, OFF, kind=KINDS, tip=HOLES)
    assert code in codes(program, drilled(**changes))


def test_depth_upwards_in_nx():
    cycle = Statement(1, 3, "CYCLE", ("DRILL", "FEDTO", -8.0, "RAPTO", 2.0))
    program = said(cycle, OFF, kind=KINDS, tip=HOLES, source=Source("a.cls", "apt", "nx"))
    assert codes(program, drilled()) == []


def test_cycle_that_says_no_depth_may_not_be_drilled():
    cycle = Statement(1, 3, "CYCLE", ("DRILL", 8.0, 2.0))
    program = said(cycle, OFF, kind=KINDS, tip=HOLES)
    assert codes(program, drilled()) == ["CS564"]
    over = [("G0", 0, 0, 20), ("G0", 15, 0, 20), ("G0", 15, 0, 30)]
    assert codes(program, text("G43.5 H1", *over)) == ["CS561"]
    assert codes(program, text("G43.5 H1", *over), skip_cycles=True) == []


def test_statement_between_holes():
    program = said(CYCLE, Statement(2, 5, "OPSTOP"), OFF, kind=KINDS, tip=HOLES)
    lines = [*DRILLED[:4], "M1", *DRILLED[4:]]
    assert codes(program, text("G43.5 H1", *lines)) == []
    lines = [*DRILLED[:8], "M1", *DRILLED[8:]]
    assert codes(program, text("G43.5 H1", *lines)) == ["CS555"]


@pytest.mark.parametrize(
    ("stop", "wanted"),
    [
        (["M1", "T8 M6"], []),  # posts write it on their own
        (["T8 M6", "M1"], ["CS555"]),
        (["M1", "M3", "T8 M6"], ["CS552", "CS555", "CS571"]),
        (["M0", "T8 M6"], ["CS555"]),
        (["M1", "M1", "T8 M6"], ["CS555"]),
    ],
)
def test_an_optional_stop_right_before_another_tool_is_nobodys_fault(stop, wanted):
    program = said(Statement(0, 1, "LOADTL", (7.0,)), Statement(2, 2, "LOADTL", (8.0,)))
    before, behind = ["T7 M6", "G43.5 H7", *PATH[:2]], ["G43.5 H8", ("G0", 10, 0, 5), *PATH[2:]]
    assert codes(program, text(*before, "G91 G28 Z0.", "G90", "G49", *stop, *behind)) == wanted


def test_an_optional_stop_that_is_asked_for_before_a_tool_must_be_there():
    program = said(Statement(0, 1, "LOADTL", (7.0,)), Statement(2, 2, "OPSTOP", ()), Statement(2, 3, "LOADTL", (8.0,)))
    before, behind = ["T7 M6", "G43.5 H7", *PATH[:2]], ["T8 M6", "G43.5 H8", ("G0", 10, 0, 5), *PATH[2:]]
    up = ["G91 G28 Z0.", "G90", "G49"]
    assert codes(program, text(*before, *up, "M1", *behind)) == []
    assert codes(program, text(*before, *up, *behind)) == ["CS555"]


@pytest.mark.parametrize("changes", [{}, {"n2": ("G1", 0, 0, -8.01)}, {"n2": None}, {"n0": None}, {"n8": None}])
def test_holes_are_the_same_however_the_text_is_read(changes, monkeypatch):
    program = said(CYCLE, OFF, kind=KINDS, tip=HOLES)
    whole = verify(program, drilled(**changes), tolerance=0.01)
    monkeypatch.setattr(reader, "GIVEN_OUT", 1)
    monkeypatch.setattr(source, "CHUNK", 40)
    assert repr(verify(program, drilled(**changes), tolerance=0.01)) == repr(whole)
    assert whole.passed == (not changes)


def test_path_before_holes_is_measured_as_it_is_read(monkeypatch):
    """What cannot belong to the holes any more is not held, though the pose before them is met early, too."""
    count = 240
    path = [[0.0, 0, 20], *([float(x), 3, 5] for x in range(count)), *HOLES]
    kinds = [Move.RAPID, *[Move.LINEAR] * count, *KINDS]
    cycle = Statement(count + 2, 3, "CYCLE", CYCLE.args), Statement(count + 4, 9, "CYCLE", ("OFF",))
    program = said(*cycle, kind=kinds, tip=path)
    lines = [("G0", 0, 0, 20), *(("G1", x, 3, 5) for x in range(count)), *DRILLED]
    monkeypatch.setattr(reader, "GIVEN_OUT", 4)
    monkeypatch.setattr(source, "CHUNK", 60)
    monkeypatch.setattr(parse, "TOGETHER", 4)
    monkeypatch.setattr(stretches, "BATCH", 40)
    held = []
    part = Ahead.part
    monkeypatch.setattr(Ahead, "part", lambda ahead, *rows: (held.append(len(ahead.nc)), part(ahead, *rows))[1])
    assert codes(program, text("G43.5 H1", *lines)) == []
    assert max(held) < 150  # of 240 lines: two chunks and what a batch holds
    assert "CS562" in codes(program, text("G43.5 H1", *lines[: count + 3], ("G1", 0, 0, -7), *lines[count + 4 :]))


def many_holes(count, dwell=()):
    """A program of holes in a row, and the lines of its text, four of each hole with its dwell."""
    cycle = Statement(1, 3, "CYCLE", ("DRILL", "FEDTO", 8.0, "RAPTO", 2.0, *dwell))
    tip = [[0.0, 0, 20], *([3.0 * k, 0, 0] for k in range(count)), [0.0, 0, 30]]
    kind = [Move.RAPID, *[Move.HOLE] * count, Move.RAPID]
    program = said(cycle, Statement(count + 1, 4, "CYCLE", ("OFF",)), kind=kind, tip=tip)
    lines = ["G43.5 H1", ("G0", 0, 0, 20)]
    for x in range(0, 3 * count, 3):
        lines += [("G0", x, 0, 2), ("G1", x, 0, -8), *(["G4 P500"] if dwell else []), ("G0", x, 0, 2)]
    return program, [*lines, ("G0", 0, 0, 30)]


def test_a_long_run_of_holes_is_measured_as_it_is_read(monkeypatch):
    program, lines = many_holes(90)
    monkeypatch.setattr(reader, "GIVEN_OUT", 4)
    monkeypatch.setattr(source, "CHUNK", 60)
    monkeypatch.setattr(parse, "TOGETHER", 8)
    held = []
    part = Ahead.part
    monkeypatch.setattr(Ahead, "part", lambda ahead, *rows: (held.append(len(ahead.nc)), part(ahead, *rows))[1])
    assert codes(program, text(*lines)) == []
    assert max(held) < 150  # of 270 lines: two chunks and what a batch holds
    assert codes(program, text(*lines[:120], ("G1", lines[120][1], 0, -8.5), *lines[121:])) == ["CS562"]
    assert codes(program, text(*lines[:122], *lines[125:])) == ["CS561"]


def test_one_dwell_of_many_that_is_missing_is_one_finding():
    program, lines = many_holes(40, ("DWELL", 0.5))
    third = [k for k, line in enumerate(lines) if line == "G4 P500"][2]
    missing = text(*lines[:third], *lines[third + 1 :])
    found = verify(program, missing, tolerance=0.01).problems
    assert [(one.code, one.cl_line) for one in found] == [("CS556", 13)]  # the line of the third hole
    found = verify(program, text(*lines[:third], "G4 P700", *lines[third + 1 :]), tolerance=0.01).problems
    assert [(one.code, one.cl_line) for one in found] == [("CS556", 13)]
    # several that are wrong far apart
    last = [k for k, line in enumerate(lines) if line == "G4 P500"][30]
    wrong = text(*lines[:third], *lines[third + 1 : last], "G4 P700", *lines[last + 1 :])
    assert [one.code for one in verify(program, wrong, tolerance=0.01).problems] == ["CS556"] * 2
