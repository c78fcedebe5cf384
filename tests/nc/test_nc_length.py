"""Where the length of the tool comes on: with the first motion of Z, as alone it may move the axis."""

from __future__ import annotations

import io
import re

import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc.program_frame import Frame
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify

EPS = 0.01
CL = b"""UNITS/MM
LOADTL/2
SPINDL/900,RPM,CLW
RAPID
GOTO/0,0,50,0,0,1
GOTO/0,0,5
FEDRAT/300,MMPM
GOTO/0,0,0
GOTO/30,0,0
GOTO/30,20,0
RAPID
GOTO/30,20,50
LOADTL/3
SPINDL/900,RPM,CLW
RAPID
GOTO/5,5,50
GOTO/5,5,5
FEDRAT/300,MMPM
GOTO/5,5,0
GOTO/35,5,0
RAPID
GOTO/35,5,50
FINI
"""
#: control, machine, approach
RUNS = [("fanuc", "table-bc", 0.0), ("mitsubishi", "table-ac", 20.0), ("haas", "table-bc", 0.0), ("fanuc", "", 0.0)]


def text_of(control: str, machine: str, approach: float) -> list[str]:
    form = choose_form(
        control, None if machine else "g6.2", machine=load_machine(machine) if machine else None, tcp=not machine
    )
    stream = io.BytesIO()
    smoothed = smooth(read(CL), fit_settings(Settings(tolerance=EPS), form, "mm"))
    write(smoothed, stream, form=form, frame=Frame(approach=approach))
    return stream.getvalue().decode().splitlines()


def problems(lines: list[str], control: str, machine: str) -> tuple[object, ...]:
    own = load_machine(machine) if machine else None
    data = ("\n".join(lines) + "\n").encode()
    return verify(read(CL), data, tolerance=EPS, control=control, machine=own, tcp=not machine).problems


@pytest.mark.parametrize(("control", "machine", "approach"), RUNS, ids=lambda value: str(value))
def test_the_length_comes_on_where_z_moves_first(control: str, machine: str, approach: float) -> None:
    lines = text_of(control, machine, approach)
    on = [k for k, line in enumerate(lines) if line.startswith("G43")]
    assert [lines[k][:6] for k in on] == ["G43 H2", "G43 H3"]
    for k, off in zip(on, [k for k, line in enumerate(lines) if line == "G49"], strict=True):
        assert re.match(r"G43 H\d G0 X\S+ Y\S+ Z", lines[k])
        up = max(j for j in range(k) if lines[j].startswith(("G91 G28", "G53")))
        assert not any(" Z" in line for line in lines[up + 1 : k])
        assert off > k
    assert problems(lines, control, machine) == ()
    # in a block of its own, as other posts have it
    other = [part for line in lines for part in re.sub(r"^(G43 H\d) ", r"\1\n", line).split("\n")]
    assert problems(other, control, machine) == ()


@pytest.mark.parametrize(("control", "machine", "approach"), RUNS, ids=lambda value: str(value))
def test_a_length_that_is_missing_or_late_is_found(control: str, machine: str, approach: float) -> None:
    lines = text_of(control, machine, approach)
    for k in [k for k, line in enumerate(lines) if line.startswith("G43")]:
        bare = lines[k].split(" ", 2)[2]
        assert problems([*lines[:k], bare, *lines[k + 1 :]], control, machine)
        late = lines[k][:7] + lines[k + 1]
        assert problems([*lines[:k], bare, late, *lines[k + 2 :]], control, machine)
        assert problems([*lines[:k], lines[k].replace(" H", " H1"), *lines[k + 1 :]], control, machine)
