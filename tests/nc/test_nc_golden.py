"""Whole texts, small enough to read; `python -m nc.test_nc_golden` in the folder of the tests writes them anew."""

from __future__ import annotations

from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.settings import Settings
from nc.cases import CHOSEN, Case
from nc.grammars import reader
from nc.promise import written

GOLDEN = Path(__file__).parent / "golden"
TOLERANCE, AXIS_LENGTH = 0.05, 10.0

#: forms for a tool that stays parallel to Z
UPRIGHT = (Case("heidenhain", "spl"), Case("mitsubishi", "g6.2"))

#: CL file and what is asked for: every control in every form, and what was kept before there was a choice
TEXTS = list(
    dict.fromkeys(
        [
            *(("mixed", Case(control, "g1")) for control in ("fanuc", "siemens", "heidenhain")),
            ("mixed", Case("fanuc", "g6.2")),
            *(("upright" if case in UPRIGHT else "corner", case) for case in CHOSEN),
            ("corner", Case("fanuc", "g1", "table-ac", tcp=False)),
            ("corner", Case("siemens", "g1", "head-ac")),
            ("corner", Case("heidenhain", "spl", "table-bc")),
            *(("inch", case) for case in (Case("siemens", "bspline"), Case("heidenhain", "g1"))),
            ("inch", Case("linuxcnc", "g1", "xyzac-trt")),
        ]
    )
)


def text_of(source: str, case: Case) -> str:
    program = read((GOLDEN / f"{source}.cls").read_bytes(), name=f"{source}.cls")
    return written(program, case.choose(), Settings(tolerance=TOLERANCE, axis_length=AXIS_LENGTH))[0]


def golden(source: str, case: Case) -> Path:
    return GOLDEN / f"{source}.{case}.nc"


@pytest.mark.parametrize(("source", "case"), TEXTS, ids=lambda value: str(value))
def test_text_is_what_was_agreed(source: str, case: Case) -> None:
    assert text_of(source, case) == golden(source, case).read_text()


@pytest.mark.parametrize(("source", "case"), TEXTS, ids=lambda value: str(value))
def test_agreed_text_is_text_of_the_control(source: str, case: Case) -> None:
    units = "inch" if source == "inch" else "mm"
    control = reader(case.control, case.form, case.machine, case.tcp, units)
    assert control.read(golden(source, case).read_text(), AXIS_LENGTH, TOLERANCE).pieces


def test_no_golden_file_is_left_over() -> None:
    assert {golden(*which) for which in TEXTS} == set(GOLDEN.glob("*.nc"))


if __name__ == "__main__":
    for which in TEXTS:
        golden(*which).write_text(text_of(*which))
