"""Whole texts, small enough to read; `python -m nc.test_nc_golden` in the folder of the tests writes them anew."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

GOLDEN = Path(__file__).parent / "golden"

#: CL file, control, form, machine, tool tip control
TEXTS = [
    ("mixed", "fanuc", "g1", "", True),
    ("mixed", "fanuc", "g6.2", "", True),
    ("mixed", "siemens", "g1", "", True),
    ("mixed", "heidenhain", "g1", "", True),
    ("corner", "fanuc", "g1", "table-ac", True),
    ("corner", "fanuc", "g1", "table-ac", False),
    ("corner", "fanuc", "g6.2", "table-ac", True),
    ("corner", "generic", "g6.2", "", True),
    ("corner", "siemens", "bspline", "", True),
    ("corner", "siemens", "poly", "", True),
    ("corner", "siemens", "g1", "head-ac", True),
    ("corner", "heidenhain", "g1", "table-bc", True),
    ("corner", "heidenhain", "spl", "table-bc", True),
    ("corner", "haas", "g1", "table-bc", True),
    ("corner", "linuxcnc", "g1", "xyzac-trt", True),
    ("corner", "mitsubishi", "g1", "", True),
]


def text_of(source: str, control: str, form: str, machine: str, tcp: bool) -> str:
    chosen = choose_form(control, form, machine=load_machine(machine) if machine else None, tcp=tcp)
    program = read((GOLDEN / f"{source}.cls").read_bytes(), name=f"{source}.cls")
    smoothed = smooth(program, fit_settings(Settings(tolerance=0.05), chosen, program.units))
    stream = io.BytesIO()
    write(smoothed, stream, form=chosen)
    return stream.getvalue().decode("ascii")


def golden(source: str, control: str, form: str, machine: str, tcp: bool) -> Path:
    parts = [control, form, machine, "" if tcp else "axes"]
    return GOLDEN / f"{source}.{'-'.join(part for part in parts if part)}.nc"


@pytest.mark.parametrize("which", TEXTS, ids=lambda which: golden(*which).stem)
def test_text_is_what_was_agreed(which: tuple[str, str, str, str, bool]) -> None:
    assert text_of(*which) == golden(*which).read_text()


def test_no_golden_file_is_left_over() -> None:
    assert {golden(*which) for which in TEXTS} == set(GOLDEN.glob("*.nc"))


if __name__ == "__main__":
    for which in TEXTS:
        golden(*which).write_text(text_of(*which))
