"""Tools of several lengths in a head without tool tip control: each position with the length of the tool at hand."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Machine, parse_machine, tip_position
from cornersmooth.nc import Form, Frame, choose_form
from cornersmooth.verify import verify
from nc.writing import lines_of

EPS = 0.05
#: what one tool does
PATH = """SPINDL/2000,RPM,CLW
RAPID
GOTO/0,0,60,0.28,0,0.96
FEDRAT/MMPM,300
GOTO/0,0,0
GOTO/9,1,0,0.28,0.1,0.95
GOTO/20,4,1,-0.2,0.1,0.97
RAPID
GOTO/0,0,60,0.28,0,0.96
"""
CL = f"UNITS/MM\nLOADTL/1\n{PATH}LOADTL/7\n{PATH}LOADTL/1\n{PATH}FINI\n"


def machine(lengths: str = "1 = 120\n7 = 81.5\n", *, like: str = "head-ac", length: float = 0.0) -> Machine:
    return parse_machine(f'like = "{like}"\ntool_length = {length}\n[tool_lengths]\n{lengths}')


def form_of(control: str, chosen: Machine) -> Form:
    return choose_form(control, machine=chosen, tcp=False)


def feeds(lines: list[str]) -> list[np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """Words of the feed moves."""
    return [
        np.array([float(word) for word in re.findall(r"[A-Z](-?[\d.]+)", line)][1:6]) for line in lines if "G1 " in line
    ]


def problems(control: str, lines: list[str], chosen: Machine) -> list[str]:
    text = ("\n".join(lines) + "\n").encode()
    program = read(CL.encode(), name="part.cls")
    found = verify(program, text, tolerance=EPS, axis_length=10.0, control=control, machine=chosen, tcp=False)
    return [f"{problem.code} {problem.text}" for problem in found.problems]


@pytest.mark.parametrize(
    ("control", "like"), [("fanuc", "head-ac"), ("siemens", "head-table-bc"), ("haas", "nutated-bc")]
)
def test_every_cut_ends_where_it_should_with_the_length_of_its_tool(control: str, like: str) -> None:
    chosen = machine(like=like)
    lines = lines_of(form_of(control, chosen), CL)
    assert problems(control, lines, chosen) == []
    order = [sorted(chosen.names).index(name) for name in chosen.names]
    cuts = "\n".join(lines).split("G0 ")
    ends = [feeds(cut.splitlines())[-1] for cut in cuts if "G1 " in cut]
    assert len(ends) == 3
    for words, length, other in zip(ends, (120.0, 81.5, 120.0), (81.5, 120.0, 81.5), strict=True):
        angles = words[None, 3:][:, order]
        right, wrong = (
            tip_position(replace(chosen, tool_length=size), words[None, :3], angles) for size in (length, other)
        )
        np.testing.assert_allclose(right[0], [20.0, 4.0, 1.0], atol=1e-3)
        assert np.linalg.norm(wrong - right) > 1.0


def test_a_length_that_is_another_is_found() -> None:
    lines = lines_of(form_of("fanuc", machine()), CL)
    for lengths in ("1 = 81.5\n7 = 120\n", "1 = 120\n7 = 81.6\n"):
        assert problems("fanuc", lines, machine(lengths)) != []
    change = next(k for k, line in enumerate(lines) if line == "T7 M6")
    assert problems("fanuc", [*lines[:change], "T1 M6", *lines[change + 1 :]], machine()) != []


def test_cycles_go_with_tools_of_their_own_lengths() -> None:
    hole = "CYCLE/DRILL,FEDTO,9,MMPM,200,RAPTO,3\nGOTO/9,3,0\nCYCLE/OFF\n"
    drill = f"LOADTL/7\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/9,3,60,0,0,1\n{hole}"
    cl = CL.replace(f"LOADTL/7\n{PATH}", drill)
    lines = lines_of(form_of("fanuc", machine()), cl, frame=Frame(cycles="native"))
    assert any(line.startswith("G98 G81") for line in lines)
    program, text = read(cl.encode(), name="part.cls"), ("\n".join(lines) + "\n").encode()
    found = verify(program, text, tolerance=EPS, axis_length=10.0, machine=machine(), tcp=False)
    assert found.problems == ()


@pytest.mark.parametrize("lengths", ["", "1 = 120\n"])
def test_a_tool_without_a_length_is_refused(lengths: str) -> None:
    with pytest.raises(SettingsError, match="length of tool") as refused:
        lines_of(form_of("fanuc", machine(lengths)), CL)
    assert refused.value.code == "CS219"
    assert refused.value.line == 2 + CL[: CL.index("LOADTL/7")].count("\n") - 1


def test_a_tool_that_toolno_loads_needs_its_length_too() -> None:
    with pytest.raises(SettingsError) as refused:
        lines_of(form_of("fanuc", machine("1 = 120\n")), CL.replace("LOADTL", "TOOLNO"))
    assert refused.value.code == "CS219"
    assert refused.value.line == 2 + CL[: CL.index("LOADTL/7")].count("\n") - 1


def test_what_is_no_table_of_lengths_is_refused() -> None:
    for text in ("x = 3", "1 = -3", '1 = "a"'):
        with pytest.raises(SettingsError):
            machine(text)


#: a right angle below 60 mm, the tool along Z
UPRIGHT = "UNITS/MM\nLOADTL/{}\nRAPID\nGOTO/0,0,60\nFEDRAT/MMPM,300\nGOTO/0,0,0\nGOTO/30,0,0\nGOTO/30,30,0\nFINI\n"


@pytest.mark.parametrize(
    ("axes", "method"),
    [("axis = []", "proportional"), ('like = "head-ac"', "proportional"), ('like = "head-ac"', "global")],
)
def test_travel_counts_with_the_length_of_the_tool_at_hand(axes: str, method: str) -> None:
    """The nose is at 60 + 120 mm with tool 1, at 60 + 81.5 mm with tool 7."""
    lengths = "tool_length = 0\n[tool_lengths]\n1 = 120\n7 = 81.5\n[travel]\nZ = [-500, 150]\n"
    chosen = choose_form("fanuc", machine=parse_machine(f"{axes}\n{lengths}"))
    assert lines_of(chosen, UPRIGHT.format(7), method=method)
    with pytest.raises(InputError, match=r"Z of machine would have to go to 180\.000 mm"):
        lines_of(chosen, UPRIGHT.format(1), method=method)
