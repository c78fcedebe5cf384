"""Whole texts, small enough to read; `python -m nc.test_nc_golden` in the folder of the tests writes them anew."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.settings import Settings
from nc.cases import CHOSEN, Case
from nc.grammars import TIP_DIGITS, reader
from nc.promise import written
from nc.reading import TextError

GOLDEN = Path(__file__).parent / "golden"
TOLERANCE, AXIS_LENGTH, CHORD = 0.05, 10.0, 0.005

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
            *(("inch", case) for case in (Case("siemens", "bspline"), Case("heidenhain", "g1"))),
            ("inch", Case("linuxcnc", "g1", "xyzac-trt")),
        ]
    )
)


def text_of(source: str, case: Case) -> str:
    program = read((GOLDEN / f"{source}.cls").read_bytes(), name=f"{source}.cls")
    settings = Settings(tolerance=TOLERANCE, axis_length=AXIS_LENGTH, chord_tolerance=CHORD)
    return written(program, case.choose(), settings)[0]


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


def spoilt(lines: list[str], case: Case, tip: int) -> Iterator[tuple[str, list[str]]]:
    """What is wrong, and the text with it."""
    first = next(number for number, line in enumerate(lines) if re.search(r"\bX[+-]?\d+\.\d{4,7} Y", line))
    changes = {
        "unknown word": lines[first] + " Q1.",
        "a digit less": re.sub(r"(X[+-]?\d+\.\d+)\d ", r"\1 ", lines[first]),
        "zero with a minus": re.sub(r"X[+-]?\d+\.\d+ ", f"X-{0:.{tip}f} ", lines[first]),
        "no blank": lines[first].replace(" Y", "Y"),
        "exponent": re.sub(r"X([+-]?\d+\.\d+) ", r"X\1e0 ", lines[first]),
    }
    for what, line in changes.items():
        yield what, [*lines[:first], line, *lines[first + 1 :]]
    mode = case.choose().mode
    on, off = (["M428"], ["M429"]) if mode.within_on == ("{kinematics_on}",) else (mode.on[:1], mode.off[-1:])
    for what, blocks in (("never switched on", on), ("never switched off", off)):
        for block in blocks:
            own = re.compile(r"(\d+ )?" + re.escape(block).replace(r"\{offset\}", r"\d+"))
            yield what, [own.sub("", line, count=1).strip() for line in lines if not own.fullmatch(line)]
    if not case.tcp:
        yield "no F under G93", [re.sub(r" F\S+$", "", line) for line in lines]
        yield "G93 to the end", [line for line in lines if line != "G94"]


@pytest.mark.parametrize(("source", "case"), TEXTS, ids=lambda value: str(value))
def test_spoilt_text_is_refused(source: str, case: Case) -> None:
    """The readers can say no."""
    units = "inch" if source == "inch" else "mm"
    tip = TIP_DIGITS.get(case.control, 4) + (units == "inch")
    lines = golden(source, case).read_text().splitlines()
    for what, text in spoilt(lines, case, tip):
        assert text != lines, what
        try:
            reader(case.control, case.form, case.machine, case.tcp, units).read("\n".join(text), AXIS_LENGTH, TOLERANCE)
        except TextError:
            continue
        pytest.fail(f"{what} was taken")


def test_no_golden_file_is_left_over() -> None:
    assert {golden(*which) for which in TEXTS} == set(GOLDEN.glob("*.nc"))


if __name__ == "__main__":
    for which in TEXTS:
        golden(*which).write_text(text_of(*which))
