"""The block that leads a tilted tool from the retract to its first position, and what may go wrong in it."""

from __future__ import annotations

import io
import re
from functools import cache

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.kinematics import Machine, parse_machine
from cornersmooth.nc import Frame, choose_form
from cornersmooth.pipeline import Result, postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify

EPS = 0.01

#: travel of a mill, with its part 50 mm above the crossing of the rotary axes
TRAVEL = "part_zero = [0, 0, 50]\ntravel = { X = [-300, 300], Y = [-200, 200], Z = [-100, 400] }\n"

#: control, form, machine; without a machine tool vectors
WAYS = [
    ("fanuc", "g1", "table-ac"),
    ("fanuc", "g1", ""),
    ("fanuc", "g1", "head-table-bc"),
    ("mitsubishi", "g1", "table-bc"),
    ("haas", "g1", "table-bc"),
    ("siemens", "g1", "nutated-bc"),
    ("siemens", "g1", ""),
    ("siemens", "g1", "table-ac"),
    ("heidenhain", "g1", "table-ac"),
    ("heidenhain", "g1", ""),
    ("linuxcnc", "g1", "xyzac-trt"),
    ("linuxcnc", "g1", "xyzbc-trt"),
]

#: blocks that switch tip control on
ON = r"G43\.[45] H\d+|G234 H\d+|TRAORI|FUNCTION TCPM .*|M428"


def axis(degrees: float, towards: str = "y") -> str:
    lean = np.sin(np.radians(degrees)), 0.0
    x, y = lean if towards == "x" else lean[::-1]
    return f"{x:.7f},{y:.7f},{np.cos(np.radians(degrees)):.7f}"


def part(*tools: str) -> str:
    """Each tool with its axis: a rapid to 20 mm above the part, and a cut with a corner."""
    cuts = "".join(
        f"LOADTL/{number}\nSPINDL/8000,RPM,CLW\nRAPID\nGOTO/0,0,20,{lean}\nFEDRAT/1000,MMPM\nGOTO/0,0,0,{lean}\n"
        f"GOTO/10,0,0,{lean}\nGOTO/20,2,0,{lean}\nRAPID\nGOTO/20,2,40,{lean}\n"
        for number, lean in enumerate(tools, 1)
    )
    return f"UNITS/MM\n{cuts}FINI\n"


#: tilted, along Z, tilted: each after a tool change
TOOLS = part(axis(30), axis(0), axis(40, "x"))


def machine_of(name: str, more: str = "") -> Machine | None:
    return parse_machine(f'like = "{name}"\n{more}') if name else None


def post(cl: str, control: str, form: str | None, machine: Machine | None, **how: object) -> tuple[list[str], Result]:
    """Blocks without their numbers, and what was said."""
    chosen = choose_form(control, form, machine=machine, planes=bool(how.pop("planes", False)), rewind=0.0)
    stream = io.BytesIO()
    frame = Frame(**how) if how else None  # type: ignore[arg-type]
    result = postprocess(cl.encode(), stream, Settings(tolerance=EPS), form=chosen, frame=frame)
    assert result.verification is not None
    assert result.verification.passed
    lines = stream.getvalue().decode("ascii").splitlines()
    return ([line.partition(" ")[2] for line in lines] if control == "heidenhain" else lines), result


@cache
def text(control: str, form: str, machine: str) -> tuple[str, ...]:
    return tuple(post(TOOLS, control, form, machine_of(machine))[0])


def codes(result: Result) -> list[str]:
    return [finding.code for finding in result.findings]


def words(line: str) -> dict[str, float]:
    return {name: float(value) for name, value in re.findall(r"\b([A-Z]+3?=?)([-+]?\d+\.\d+)", line)}


def motions(lines: list[str] | tuple[str, ...], start: int) -> list[int]:
    return [k for k in range(start, len(lines)) if re.match(r"(G43 H\d+ )?(G0|G1|LN?) [XYZ]", lines[k])]


@pytest.mark.parametrize(("control", "form", "machine"), WAYS)
def test_a_tilted_tool_comes_from_the_retract_in_one_block(control: str, form: str, machine: str) -> None:
    lines = text(control, form, machine)
    starts = [k for k, line in enumerate(lines) if re.fullmatch(ON, line)]
    assert len(starts) == 3
    for start, tilted in zip(starts, (True, False, True), strict=True):
        first, then = motions(lines, start)[:2]
        said = words(lines[first])
        if not tilted:  # the plane of X Y is that of the machine: over the position, and down
            assert {"X", "Y"} <= said.keys()
            assert "Z" not in said
            assert {**said, "Z": 20.0} == words(lines[then])
            continue
        assert {"X", "Y", "Z"} <= said.keys()
        assert said["Z"] == 20.0
        if machine:
            turned = next(k for k in range(start, 0, -1) if re.match(r"(G0|L) [ABC]", lines[k]))
            assert turned < start
            angles = {name: value for name, value in words(lines[turned]).items() if name in "ABC"}
            if control in ("fanuc", "mitsubishi"):  # WKP = 0: the part turns from the angles of that moment
                assert set(angles.values()) == {0.0}
            else:
                assert angles == {name: said[name] for name in angles}


def mutants(lines: list[str]) -> dict[str, list[str]]:
    """The order of the first tool, spoilt."""
    on = next(k for k, line in enumerate(lines) if re.fullmatch(ON, line))
    first = motions(lines, on)[0]
    block = lines[first]
    split = re.sub(r" Z\S+", "", block)
    found = {
        "X Y, then Z": [*lines[:first], split, *lines[first:]],
        "Z, then X Y": [*lines[:first], re.sub(r" [XY]\S+", "", block), *lines[first:]],
        "too late": [*lines[:on], *lines[on + 1 : first + 1], lines[on], *lines[first + 1 :]],
        "never": [*lines[:on], *lines[on + 1 :]],
    }
    turn = next((k for k in range(on, 0, -1) if re.match(r"(G0|L) [ABC]", lines[k])), None)
    if turn is not None:
        found["too early"] = [*lines[:turn], lines[on], *lines[turn:on], *lines[on + 1 :]]
        found["not turned"] = [*lines[:turn], *lines[turn + 1 :]]
    return found


@pytest.mark.parametrize(("control", "form", "machine"), WAYS)
def test_another_order_is_found(control: str, form: str, machine: str) -> None:
    program, own = read(TOOLS.encode(), name="part.cls"), machine_of(machine)
    lines = list(text(control, form, machine))
    for what, changed in mutants(lines).items():
        if control == "heidenhain":
            changed = [f"{number} {line}" for number, line in enumerate(changed)]
        data = ("\n".join(changed) + "\n").encode()
        found = verify(program, data, control=control, machine=own, tolerance=EPS)
        assert found.verdict in (Verdict.FAILED, Verdict.NOT_VERIFIED), what


@pytest.mark.parametrize("control", ["siemens", "haas", "heidenhain"])
@pytest.mark.parametrize("more", ["", TRAVEL])
def test_a_block_that_may_come_from_below_its_end_is_a_warning(control: str, more: str) -> None:
    """At A85 the way down is nearly level in the part: 350 mm higher is 30 mm of Z, and X Y may be 200 mm aside."""
    machine = machine_of("table-ac", more)
    assert "CS392" in codes(post(part(axis(85)), control, None, machine)[1])
    assert "CS392" not in codes(post(part(axis(20)), control, None, machine)[1])


def test_it_is_none_where_the_part_is_not_turned_before() -> None:
    """A head turns the tool; FANUC's tables stand at zero until tool tip control is on."""
    assert "CS392" not in codes(post(part(axis(85)), "siemens", None, machine_of("head-ac"))[1])
    assert "CS392" not in codes(post(part(axis(85)), "fanuc", None, machine_of("table-ac", TRAVEL))[1])


@pytest.mark.parametrize("control", ["siemens", "fanuc"])
def test_planes_come_in_one_block_too(control: str) -> None:
    lines, result = post(part(axis(60)), control, None, machine_of("table-ac"), planes=True)
    on = next(k for k, line in enumerate(lines) if re.match(r"CYCLE800\(0|G53\.1", line))
    assert {"X", "Y", "Z"} <= words(lines[motions(lines, on)[0]]).keys()
    assert "CS392" in codes(result)


def test_an_endless_axis_goes_home_to_the_nearest_full_turn() -> None:
    turns = "".join(f"GOTO/0,0,0,{axis_at(angle)}\n" for angle in range(0, 1801, 15))
    cl = f"UNITS/MM\nLOADTL/3\nSPINDL/8000,RPM,CLW\nRAPID\nGOTO/0,0,20,{axis_at(0)}\nFEDRAT/1000,MMPM\n{turns}FINI\n"
    for control, home in (("haas", 1800.0), ("fanuc", 1800.0), ("siemens", 1800.0), ("heidenhain", 1800.0)):
        lines, _ = post(cl, control, None, machine_of("table-ac"))
        last = next(words(line) for line in reversed(lines) if re.match(r"(G0|L) [ABC]", line))
        assert abs(last.pop("C")) == home
        assert last == {"A": 0.0}
    limited = '[[axis]]\nname = "C"\nlimits = [-3600, 3600]\n'
    lines, _ = post(cl, "haas", None, machine_of("table-ac", limited))
    last = next(words(line) for line in reversed(lines) if re.match(r"(G0|L) [ABC]", line))
    assert last == {"A": 0.0, "C": 0.0}


def axis_at(angle: float) -> str:
    across = 0.5 * np.cos(np.radians(angle)), 0.5 * np.sin(np.radians(angle))
    return f"{across[0]:.7f},{across[1]:.7f},{np.sqrt(0.75):.7f}"


def test_the_machine_names_what_switches_tip_control_of_its_kinematics() -> None:
    for given, on, off in (('["G12.1 P1", "G13.1"]', "G12.1 P1", "G13.1"), ('["M428", "M429"]', "M428", "M429")):
        own = machine_of("xyzac-trt", f"tip_control = {given}\n")
        lines, result = post(TOOLS, "linuxcnc", None, own)
        assert "CS393" not in codes(result)
        assert lines.count(on) == 3
        retracts = [k for k, line in enumerate(lines) if line == "G53 G0 Z0"]
        assert [lines[k - 1] for k in retracts] == [off] * len(retracts)
    lines, result = post(TOOLS, "linuxcnc", None, machine_of("xyzac-trt", "tip_control = []\n"))
    assert not {"M428", "M429"} & set(lines)
    assert "CS393" not in codes(result)
    assert "CS393" in codes(post(TOOLS, "linuxcnc", None, machine_of("table-ac"))[1])
    assert "M428" not in post(TOOLS, "fanuc", None, machine_of("xyzac-trt"))[0]


def test_motion_without_tip_control_of_the_kinematics_is_found() -> None:
    program, own = read(TOOLS.encode(), name="part.cls"), machine_of("xyzac-trt")
    lines = list(text("linuxcnc", "g1", "xyzac-trt"))
    on, off = lines.index("M428"), [k for k, line in enumerate(lines) if line == "M429"]
    for changed, said in (
        ([line for line in lines if line not in ("M428", "M429")], "before any word of tip control"),
        ([*lines[:on], *lines[on + 1 :]], "under M429, where M428 must be in force"),
        ([*lines[: off[1]], *lines[off[1] + 1 :]], "M6 under M428"),
        ([*lines[: off[0]], *lines[off[0] + 1 :]], "changed since the program was written"),
        ([*lines[: off[-1]], *lines[off[-1] + 1 :]], "M428 of line"),
    ):
        found = verify(program, "\n".join([*changed, ""]).encode(), control="linuxcnc", machine=own, tolerance=EPS)
        texts = [*(problem.text for problem in found.problems), found.unverified]
        assert any(said in text for text in texts), (said, texts)
