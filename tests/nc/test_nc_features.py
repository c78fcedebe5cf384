"""The table of features in docs/dev/posts.md, each cell beside what the texts of today have."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Machine, parse_machine
from cornersmooth.nc import Frame, choose_form, fit_settings, load_control, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.files import SAMPLES

PAGE = SAMPLES.parent / "docs" / "dev" / "posts.md"
MACHINES = dict.fromkeys(("fanuc", "mitsubishi", "siemens", "heidenhain", "generic"), "table-ac")
MACHINES |= {"haas": "table-bc", "linuxcnc": "xyzac-trt"}

#: two tools; the first leans by 20 degrees
_TILTED, _UP = "0.3420201,0,0.9396926", "0,0,1"
_HEAD = "UNITS/MM\nLOADTL/{}\nSPINDL/500,RPM,CLW\nCOOLNT/ON\nRAPID\nGOTO/0,0,50,{}\n"
_CUT = "FEDRAT/300,MMPM\nGOTO/0,0,0,{0}\nGOTO/9,0,0,{0}\nGOTO/9,9,0,{0}\nRAPID\nGOTO/9,9,50,{0}\n"
_CYCLE = "CYCLE/{},FEDTO,15,MMPM,500,RAPTO,5\nGOTO/20,5,1,{}\nCYCLE/OFF\nRAPID\nGOTO/0,0,60,{}\n"
_ARC = "FEDRAT/300,MMPM\nGOTO/{1},{0}\nCIRCLE/0,0,0,{0},10\nGOTO/0,10,0,{0}\nRAPID\nGOTO/0,0,60,{0}\n"
TWO_TOOLS = "".join(_HEAD.format(tool, axis) + _CUT.format(axis) for tool, axis in ((3, _TILTED), (5, _UP))) + "FINI\n"


def _of(cut: str, axis: str, *more: str) -> str:
    return _HEAD.format(3, axis) + cut.format(*more) + "FINI\n"


DRILLED, TAPPED = (_of(_CYCLE, _UP, kind, _UP, _UP) for kind in ("DRILL", "TAP"))
TILTED_TAP = _of(_CYCLE, _TILTED, "TAP", _TILTED, _TILTED)
ARC, TILTED_ARC = _of(_ARC, _UP, _UP, "10,0,0"), _of(_ARC, _TILTED, _TILTED, "9.396926,0,-3.420201")


def ring(*, rapid: bool) -> str:
    """Nearly two turns of a tool that leans, in one cut or with a rapid between."""
    poses = []
    for angle in np.radians(np.arange(0, 640, 20)).tolist():
        axis = 0.5 * np.cos(angle), 0.5 * np.sin(angle), np.sqrt(0.75)
        poses.append("GOTO/" + ",".join(f"{value:.6f}" for value in (40 * np.cos(angle), 40 * np.sin(angle), 0, *axis)))
    half = len(poses) // 2
    between = ["RAPID", poses[half], "FEDRAT/300,MMPM"] if rapid else []
    start = ["UNITS/MM", "LOADTL/3", "SPINDL/500,RPM,CLW", "RAPID", poses[0], "FEDRAT/300,MMPM"]
    return "\n".join([*start, *poses[1:half], *between, *poses[half:], "FINI", ""])


def machine(control: str, more: str = "") -> Machine:
    return parse_machine(f'like = "{MACHINES[control]}"\n{more}')


@cache
def lines(
    control: str, cl: str, more: str | None = "", frame: Frame | None = None, form: str | None = None, **how: Any
) -> tuple[str, ...]:
    """Blocks of a text, or the code of what is refused; `more` in the machine's file, None without a machine."""
    try:
        named = None if more is None else machine(control, more)
        chosen = choose_form(control, form, machine=named, **how)
        program = read(cl.encode(), name="part.cls")
        stream = io.BytesIO()
        smoothed = smooth(program, fit_settings(Settings(tolerance=0.05), chosen, "mm"))
        found = write(smoothed, stream, form=chosen, frame=frame)
    except (InputError, SettingsError) as error:
        return (error.code,)
    text = stream.getvalue().decode("ascii").splitlines()
    words = [re.sub(r"^\d+ ", "", line) for line in text] if control == "heidenhain" else text
    return (*words, *(f"finding {finding.code}" for finding in found.findings))


def where(text: tuple[str, ...], pattern: str) -> list[int]:
    return [k for k, line in enumerate(text) if re.match(pattern, line)]


RETRACT = r"G91 G28 Z0|G53 G0 Z0|SUPA G0 Z0 D0|L Z-1 R0 FMAX M91"
TIP_CONTROL = r"G43\.4|G234|M428|TRAORI|FUNCTION TCPM"
CHANGE = r"(T\d+ )?M6|TOOL CALL \d"
MOTION = r"(G[01]|L) X"
C_LIMITS = '[[axis]]\nname = "C"\nlimits = [-330, 330]\n'


def yes(there: bool, word: str = "yes") -> str:
    return word if there else "no"


# ------------------------------------------------------------------------------------------------ the rows


def safe_start(control: str) -> str:
    text = lines(control, TWO_TOOLS)
    first = where(text, CHANGE)[0]
    return yes(any(("G90 " in line and "G17" in line) or line == "PLANE RESET STAY" for line in text[:first]))


def work_offset(control: str) -> str:
    text = lines(control, TWO_TOOLS)
    offsets, tip = where(text, r"G54$|CYCL DEF 247"), where(text, "TRAORI")
    if tip:
        return yes(offsets[0] > tip[0], "yes, after TRAORI")
    return yes(bool(offsets), "yes, CYCL DEF 247" if "CYCL" in text[(offsets or [0])[0]] else "yes")


def retracts(control: str) -> str:
    text = lines(control, TWO_TOOLS)
    up, changes, motion = where(text, RETRACT), where(text, CHANGE), where(text, MOTION)
    between = [k for k in motion if k < changes[1]]
    ahead, behind = any(k < changes[0] for k in up), any(between[-1] < k < changes[1] for k in up)
    return yes(ahead and behind and up[-1] > motion[-1])


def turned_before(control: str) -> str:
    text = lines(control, TWO_TOOLS)
    tip = where(text, TIP_CONTROL)
    if not tip:
        return "no"
    before = [line for line in text[: tip[0]] if re.match(r"(G0|L) [AB]", line)]
    if not before:
        return "no"
    angles = re.findall(r"[ABC][-+]?[\d.]+", before[-1])
    if all(float(word[1:]) == 0.0 for word in angles):
        return "to zero"
    first = text[next(k for k in where(text, MOTION) if k > tip[0])]
    return yes(all(word in first for word in angles), "first angles")


def first_block(control: str) -> str:
    """Of a tool that leans, and of one along Z."""
    text = lines(control, TWO_TOOLS)
    motion = where(text, MOTION)
    down = [" Z" in text[next(k for k in motion if k > change)] for change in where(text, CHANGE)]
    return "as the CL file" if all(down) else yes(down == [True, False])


def along_the_tool(control: str) -> str:
    text = lines(control, TWO_TOOLS, frame=Frame(approach=15.0))
    return yes(text[0] != "CS216" and len(text) > len(lines(control, TWO_TOOLS)), "option")


def between_tools(control: str) -> str:
    return yes(len(where(lines(control, TWO_TOOLS), "M1$")) == 1)


def switched_off(control: str) -> str:
    text = lines(control, TWO_TOOLS)
    second, last = where(text, CHANGE)[1], where(text, MOTION)[-1]
    off = [where(text, f"{word}$") for word in ("M5", "M9")]
    return yes(all(min(places) < second and max(places) > last for places in off))


def positions(control: str) -> str:
    more = "[home]\nZ = -5.0\nX = -300.0\n[tool_change]\nX = -123.0\n"
    text = lines(control, TWO_TOOLS, more)
    return yes(any("X-123" in line for line in text) and any("X-300" in line for line in text), "machine file")


def unwinding_above(control: str) -> str:
    text = lines(control, ring(rapid=True), C_LIMITS)
    if "finding CS340" in text:
        return "warning CS340" if not where(text, RETRACT) else "no"
    return yes("finding CS341" in text and len(where(text, RETRACT)) == 3)


def unwinding_inside(control: str) -> str:
    assert lines(control, ring(rapid=False), C_LIMITS) == ("CS362",)
    text = lines(control, ring(rapid=False), C_LIMITS, rewind=40.0)
    return "error" if len(text) == 1 else yes("finding CS376" in text, "option")


def high_speed(control: str) -> str:
    if where(lines(control, TWO_TOOLS), "G64 P"):
        return "G64 P"
    if control == "mitsubishi":
        upright = lines(control, _of(_CUT, _UP, _UP), None, form="g6.2")
        return yes(len(where(upright, "G5 P10000")) == 1, "always with G6.2")
    names = list(load_control(control).extras)
    for name in names:
        assert set(lines(control, TWO_TOOLS, extras=(name,))) - set(lines(control, TWO_TOOLS)), name
    return ", ".join(names) or "no"


def drilling(control: str) -> str:
    text = lines(control, DRILLED, frame=Frame(cycles="native"))
    return yes(bool(where(text, r"G98 G81|CYCLE81|CYCL DEF 200")), "option")


def taps(control: str) -> str:
    text = lines(control, TAPPED, frame=Frame(skip_cycles=False))
    tilted = lines(control, TILTED_TAP, frame=Frame(skip_cycles=False), planes=_has_planes(control))
    if text == ("CS342",):
        return "error"
    for word, pattern in (("G84", "G98 G84"), ("CYCLE84", "CYCLE84"), ("207", "CYCL DEF 207")):
        if where(text, pattern):
            assert bool(where(tilted, pattern)) == _has_planes(control)
            return word
    return "no"


def other_taps(control: str) -> str:
    return yes(lines(control, TILTED_TAP, frame=Frame(skip_cycles=False)) == ("CS342",), "error")


def _has_planes(control: str) -> bool:
    return load_control(control).forms["g1"].plane is not None


def planes(control: str) -> str:
    text = lines(control, TWO_TOOLS, planes=True)
    if not _has_planes(control):
        assert len(text) == 1
        return "no: tip control" if control == "linuxcnc" else "no"
    words = ("G68.2", "G254", "CYCLE800", "PLANE SPATIAL")
    return "option: " + next(word for word in words if where(text, rf"{word}\b(?!\(\))"))


def clamps(control: str) -> str:
    text = lines(control, TWO_TOOLS, '[[axis]]\nname = "C"\nclamp = ["M10", "M11"]\n')
    first = where(text, MOTION)[0]
    return yes(where(text, "M11$")[0] < first and where(text, "M10$")[-1] > first, "machine file")


def modulo(control: str) -> str:
    text = lines(control, ring(rapid=True), '[[axis]]\nname = "C"\nmodulo = true\n')
    if len(text) == 1:
        return "no"
    words = [float(word) for line in text for word in re.findall(r"C(?:=DC\()?([-+]?\d+\.\d*)", line)]
    assert 0.0 <= min(words) <= max(words) < 360.0
    return "DC()" if any("C=DC(" in line for line in text) else "M126" if "M126" in text else "roll-over"


def vectors(control: str) -> str:
    form = load_control(control).forms["g1"]
    if "vector" not in form.modes:
        return "no vectors"
    named = lines(control, TWO_TOOLS, None, digits="IS-B")
    if any(" K9396.926" in line for line in named):
        return "the same" if control == "mitsubishi" else "`--digits IS-B`, IS-C …"
    assert named == ("CS228",)
    text = "\n".join(lines(control, TWO_TOOLS, None))
    assert re.search(r"(K|C3=|TZ\+)0\.939692", text)
    if control == "heidenhain":
        return "unit vectors wanted"
    return "table: `vector_length`" if control == "siemens" else "`--digits N`"


def arcs(control: str) -> str:
    vectors, native = "vector" in load_control(control).forms["g1"].modes, Frame(cycles="native")

    def circles(cl: str, more: str | None = "", **how: Any) -> bool:
        return bool(where(lines(control, cl, more, **how), r"G[23] X|CR X"))

    behind_a_hole = DRILLED.replace("FINI\n", "") + ARC[ARC.index("FEDRAT") :]
    without = circles(behind_a_hole, frame=native)
    in_planes = _has_planes(control) and circles(TILTED_ARC, planes=True)
    return {
        (True, True, True): "all three",
        (False, True, True): "the last two",
        (True, True, False): "the first two",
    }[circles(ARC, None if vectors else ""), without, in_planes]


def repeated(control: str) -> str:
    short = {more: lines(control, TWO_TOOLS, more, frame=Frame(modal=True)) for more in ("", None)}
    whole = {more: lines(control, TWO_TOOLS, more) for more in short}
    there = {more: len("".join(short[more])) < len("".join(whole[more])) for more in short}
    if "vector" in load_control(control).forms["g1"].modes and not there[None]:
        return yes(there[""], "option: not under LN")
    return yes(there[""], "option")


def name(control: str) -> str:
    """Names of files that end in digits, and of which only these are taken."""
    program = {stem: lines(control, TWO_TOOLS, frame=Frame(stem=stem)) for stem in ("part-0712", "flange")}
    if "PART_0712" in "".join(program["part-0712"]) and "FLANGE" in "".join(program["flange"]):
        return "the file"
    digits = where(program["part-0712"], "O0712$") and where(program["flange"], "O0001$")
    return "no" if not digits else "the same" if control in ("mitsubishi", "haas") else "digits of the file"


ROWS: dict[str, Callable[[str], str]] = {
    "safe start": safe_start,
    "work offset": work_offset,
    "retract before tools, at the end": retracts,
    "rotary axes before tip control": turned_before,
    "first block: X Y Z of a tilted tool, over the position along Z": first_block,
    "along the tool": along_the_tool,
    "optional stop between tools": between_tools,
    "coolant and spindle off": switched_off,
    "home and tool-change positions": positions,
    "unwinding above a retract": unwinding_above,
    "unwinding inside a cut": unwinding_inside,
    "high-speed mode": high_speed,
    "drilling cycles of the control": drilling,
    "taps of a tool along Z, or in a tilted plane": taps,
    "other taps": other_taps,
    "tilted planes (3+2)": planes,
    "clamps of rotary axes": clamps,
    "modulo axes, the shorter way (machine file)": modulo,
    "vectors in the digits that the control keeps": vectors,
    "arcs: under tip control, without (a tool along Z), in planes": arcs,
    "repeated words left out": repeated,
    "name of the program": name,
}


def cells() -> dict[tuple[str, str], str]:
    """Cells of the table by row and control."""
    page = PAGE.read_text(encoding="utf-8")
    table = page[page.index("| | fanuc | mitsubishi | haas | siemens |") :].split("\n\n")[0].splitlines()
    controls = [cell.strip() for cell in table[0].split("|")[2:-2]]
    found = {}
    for row in table[2:]:
        name, *values = [cell.strip() for cell in row.split("|")[1:-2]]
        found |= {(name, control): value for control, value in zip(controls, values, strict=True)}
    return found


CELLS = cells()


@pytest.mark.parametrize("row", ROWS)
def test_a_row_of_the_table_is_what_the_texts_have(row: str) -> None:
    written = {control: CELLS[row, control] for control in sorted(MACHINES)}
    assert {control: ROWS[row](control) for control in sorted(MACHINES)} == written


def test_each_row_of_the_table_is_looked_at() -> None:
    assert {row for row, _ in CELLS} == ROWS.keys()
    assert {control for _, control in CELLS} == MACHINES.keys()
