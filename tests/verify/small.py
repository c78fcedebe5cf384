"""Small programs: the right one for a CL file and a control, and what is found in another."""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.kinematics import Machine, load_machine
from cornersmooth.model import Program
from cornersmooth.nc import Frame, choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification, verify

SAMPLES = Path(__file__).parents[2] / "samples"

#: of controls that need one
MACHINES = {"haas": "table-ac", "linuxcnc": str(SAMPLES / "machines" / "three-axis.toml")}


@cache
def program(text: str) -> Program:
    """A CL file."""
    return read(text.encode(), name="part.cls")


@cache
def right(text: str, control: str = "fanuc", cycles: str = "moves", *, skip: bool = False) -> tuple[str, ...]:
    """The lines of a right program; `skip`: which may leave holes out."""
    form, stream = choose_form(control, "g1", machine=_machine(control)), io.BytesIO()
    frame = Frame(cycles=cycles, skip_cycles=skip)
    postprocess(program(text), stream, Settings(tolerance=0.02), form=form, frame=frame, verify=False)
    lines = tuple(stream.getvalue().decode().splitlines())
    assert passes(text, lines, control, skip=skip)
    return lines


def passes(text: str, lines: Sequence[str], control: str = "fanuc", *, skip: bool = False) -> bool:
    """Whether nothing is wrong with a program, and all of it was looked at."""
    return found(text, lines, control, skip=skip).verdict in (Verdict.PASSED, Verdict.INCOMPLETE)


def found(text: str, lines: Sequence[str], control: str = "fanuc", *, skip: bool = False) -> Verification:
    """What is found in a program; the right one is looked at once, however often it is asked for."""
    return _found(text, tuple(lines), control, skip)


@cache
def _found(text: str, lines: tuple[str, ...], control: str, skip: bool) -> Verification:
    written = ("\n".join(lines) + "\n").encode()
    how = {"control": control, "machine": _machine(control), "skip_cycles": skip}
    return verify(program(text), written, tolerance=0.02, **how)


def codes(text: str, lines: Sequence[str], control: str = "fanuc") -> set[str]:
    """Codes of what is found."""
    return {one.code for one in found(text, lines, control).problems}


def _machine(control: str) -> Machine | None:
    return load_machine(MACHINES[control]) if control in MACHINES else None
