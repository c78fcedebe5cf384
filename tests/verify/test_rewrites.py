"""A program against its CL file: another spelling passes, and whatever the control does otherwise does not."""

from __future__ import annotations

from functools import cache

import pytest

from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError, Verdict
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from filter.test_meaning import HARMLESS, Lines, behind, once
from nc.cases import Case
from nc.promise import written

from .test_harmless_edits import CL

CASES = {name: Case(name.split(maxsplit=1)[0].strip(","), "g1") for name in HARMLESS if "linuxcnc" not in name}


@cache
def lines_of(case: Case) -> tuple[str, ...]:
    """The lines of the right program."""
    part = read(CL.encode(), name="part.cls")
    return tuple(written(part, case.choose(), Settings(tolerance=0.02))[0].splitlines())


def verdict(case: Case, lines: Lines | tuple[str, ...]) -> Verdict:
    """How a program turns out."""
    part, text = read(CL.encode(), name="part.cls"), ("\n".join(lines) + "\n").encode()
    try:
        return verify(part, text, tolerance=0.02, control=case.control).verdict
    except CornersmoothError:
        return Verdict.FAILED


@pytest.mark.parametrize(("name", "rewrite"), [(name, one) for name in CASES for one in HARMLESS[name]])
def test_another_spelling_passes(name: str, rewrite: str) -> None:
    case = CASES[name]
    assert verdict(case, lines_of(case)) is Verdict.PASSED
    lines = HARMLESS[name][rewrite](list(lines_of(case)))
    if rewrite == "order of words":  # but for retracts, which are known by their words in order
        lines = [old if "G28" in old else new for old, new in zip(lines_of(case), lines, strict=True)]
    assert verdict(case, lines) is Verdict.PASSED


HARMFUL = {
    "another tool": once("T4 M6", "T5 M6"),
    "no tool": once("T4 M6", None),
    "a tool twice": once("T7 M6", "T4 M6"),
    "another speed": once("S3000", "S300"),
    "no start": once(" M3", ""),
    "the other way round": once("M3", "M4"),
    "no spindle": once("S3000 M3", None),
    "no coolant": once("^M8", None),
    "coolant of another kind": once("^M8", "M7"),
    "another length": once("H4", "H5"),
    "no length": once("G43.* H4", None),
    "inch": once("G21", "G20"),
    "distances": once("G90", "G91"),
    "another rapid": once("^(G0 .*)Z50", r"\1Z49"),
    "a rapid lost": once("^G0 X20", None),
    "a rapid cuts": once("^G0 X20", "G1 X20"),
    "the end lost": once("M30", None),
    "coolant off in a run": behind("^G1", "M9", 1),
    "a stop in a run": behind("^G1", "M0", 1),
    "speed in a run": behind("^G1", "S100", 1),
    "a dwell lost": once("^G4", None),
    "another dwell": once("^G4 P500", "G4 P50"),
    "a call in a run": behind("^G1", "M98 P10", 1),
    "compensation in a run": behind("^G1", "G41 D4", 1),
    "a cut lost": once("^G1 X25", None),
    "the last cut lost": once("^G1", None, -1),
    "a cut twice": behind("^G1", "G1 X0. Y0. Z-3.", 1),
    "a pose beyond the tolerance": once(r"X20\.", "X20.1", 1),
    "another feed": once(r"F900\.", "F9000."),
    "a feed lost": once(r" F300\.", ""),
    "a block that may be skipped": once("^T7", "/T7"),
    "more at the end": behind("^M9", "G0 Z-50."),
    "a rapid more": behind("^G0 X20", "G0 X0. Y0. Z50."),
}


@pytest.mark.parametrize("name", HARMFUL)
def test_what_the_control_does_otherwise_does_not_pass(name: str) -> None:
    lines = lines_of(Case("fanuc", "g1"))
    changed = HARMFUL[name](list(lines))
    assert tuple(changed) != lines
    assert verdict(Case("fanuc", "g1"), changed) not in (Verdict.PASSED, Verdict.INCOMPLETE)
