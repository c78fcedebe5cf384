"""Writes docs/findings.md: what a review of the first version found around the motion, beside the texts of today.

python docs/make_findings.py
"""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import parse_machine
from cornersmooth.nc import Frame, choose_form, fit_settings, load_control, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

HERE = Path(__file__).resolve().parent
PAGE = HERE / "findings.md"
TWO_TOOLS = (HERE.parent / "samples" / "two_tools.cls").read_text(encoding="utf-8")

MACHINES = {
    "fanuc": "table-ac",
    "mitsubishi": "table-ac",
    "haas": "table-bc",
    "siemens": "table-ac",
    "heidenhain": "table-ac",
    "linuxcnc": "xyzac-trt",
    "generic": "table-ac",
}
TWO_TURNS = '[[axis]]\nname = "C"\nlimits = [-330, 330]\n'

_TOOL = "UNITS/MM\nLOADTL/3\nSPINDL/5000,CLW\nRAPID\nGOTO/0,0,50,{}\nFEDRAT/12000,MMPM\n"
_UP, _TILTED = "0,0,1", "0.2,0,0.9797959"
TILTED_FIRST = _TOOL.format(_TILTED) + f"GOTO/0,0,0,{_TILTED}\nGOTO/9,0,0,{_TILTED}\nFINI\n"
FAST = _TOOL.format(_UP) + "GOTO/0,0,0,0,0,1\nGOTO/0.02,0,0,0.001,0,0.9999995\nGOTO/0.04,0,0,0.002,0,0.999998\nFINI\n"
SPEED = _TOOL.format(_TILTED) + f"GOTO/0,0,0,{_TILTED}\nSPINDL/6000,CLW\nGOTO/40,10,0,0,0.2,0.9797959\nFINI\n"
MIST = "UNITS/MM\nLOADTL/3\nSPINDL/5000,CLW\nCOOLNT/MIST\nRAPID\nGOTO/0,0,50\nFEDRAT/500,MMPM\nGOTO/0,0,0\nFINI\n"
BARE = "UNITS/MM\nFEDRAT/500,MMPM\nGOTO/0,0,0\nGOTO/9,0,0\nGOHOME\nFINI\n"
CUTCOM = _TOOL.format(_UP) + "GOTO/0,0,0\nCUTCOM/LEFT\nGOTO/20,0,0\nGOTO/20,20,0\nCUTCOM/OFF\nGOTO/40,20,0\nFINI\n"


def _ring(*, rapid: bool) -> str:
    """Nearly two turns of a tool that leans, in one cut or with a rapid between."""
    poses = []
    for degrees in range(0, 640, 20):
        cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
        values = 40 * cosine, 40 * sine, 0.0, 0.5 * cosine, 0.5 * sine, math.sqrt(0.75)
        poses.append("GOTO/" + ",".join(f"{value:.6f}" for value in values))
    half = len(poses) // 2
    between = ["RAPID", poses[half], "FEDRAT/300,MMPM"] if rapid else []
    start = ["UNITS/MM", "LOADTL/3", "SPINDL/500,RPM,CLW", "RAPID", poses[0], "FEDRAT/300,MMPM"]
    return "\n".join([*start, *poses[1:half], *between, *poses[half:], "FINI", ""])


@cache
def _written(
    control: str,
    cl: str,
    more: str | None = "",
    *,
    like: str = "",
    frame: Frame | None = None,
    form: str | None = None,
    **how: object,
) -> tuple[tuple[str, ...], frozenset[str]]:
    """Blocks of a text and codes of its findings; no blocks, and a code, where it is refused.

    `more` stands in the machine's file; None for no machine.
    """
    try:
        machine = None if more is None else parse_machine(f'like = "{like or MACHINES[control]}"\n{more}')
        chosen = choose_form(control, form, machine=machine, **how)
        program = read(cl.encode(), name="part.cls")
        stream = io.BytesIO()
        smoothed = smooth(program, fit_settings(Settings(tolerance=0.01), chosen, "mm"))
        found = write(smoothed, stream, form=chosen, frame=frame)
    except (InputError, SettingsError) as error:
        return (), frozenset((error.code,))
    lines = stream.getvalue().decode("ascii").splitlines()
    if control == "heidenhain":
        lines = [re.sub(r"^\d+ ", "", line) for line in lines]
    return tuple(lines), frozenset(finding.code for finding in found.findings)


def _places(lines: tuple[str, ...], pattern: str) -> list[int]:
    return [k for k, line in enumerate(lines) if re.match(pattern, line)]


def _shown(lines: tuple[str, ...], pattern: str, until: str = "") -> str:
    """The last block of a pattern, or what stands from there to the next of another."""
    at = _places(lines, pattern)
    if not at:
        return ""
    stop = next((k for k in _places(lines, until) if k > at[-1]), at[-1]) if until else at[-1]
    return "mended: " + ", ".join(f"`{line}`" for line in lines[at[-1] : stop + 1] if line[0] not in "(;")


def _said(codes: frozenset[str], *of: str) -> str:
    there = [code for code in of if code in codes]
    return f"said: {' '.join(there)}" if there else ""


def _refused(lines: tuple[str, ...], codes: frozenset[str]) -> str:
    return "" if lines else f"refused: {' '.join(sorted(codes))}"


TIP = r"G43\.4|G234|TRAORI|FUNCTION TCPM"
CHANGE = r"(T\d+ )?M6|TOOL CALL \d"
RETRACT = r"G91 G28 Z0|G53 G0 Z0|SUPA G0 Z0 D0|L Z-1 R0 FMAX M91"


def _turned_table(control: str) -> str:
    lines, _ = _written(control, TWO_TOOLS)
    _, codes = _written(control, TWO_TOOLS, None)
    on = _places(lines, TIP)
    if not on:
        return "– " + ("the kinematics count from the machine" if control == "linuxcnc" else "nothing switches it on")
    block = next(line for line in reversed(lines[: on[-1]]) if re.match(r"(G0|L) [AB]", line))
    vectors = f"; vectors {_said(codes, 'CS358')}" if "CS358" in codes else ""
    return f"mended: `{block}`, `{lines[on[-1]]}`{vectors}"


def _work_offset(control: str) -> str:
    lines, _ = _written(control, TWO_TOOLS)
    mended = _shown(lines, r"G54$|CYCL DEF 247")
    if not mended:
        return "`--work-offset` " + _refused(*_written(control, TWO_TOOLS, frame=Frame(work_offset="G54")))
    return mended + (" behind TRAORI" if control == "siemens" else "")


def _first_motion(control: str) -> str:
    lines, _ = _written(control, TILTED_FIRST)
    first = lines[next(k for k in _places(lines, r"(G0|L) X") if k > _places(lines, CHANGE)[0])]
    block = f"mended: `{first}`; " if " Z" not in first else ""
    vectors = _written(control, TILTED_FIRST, None)
    return f"{block}vectors {_said(vectors[1], 'CS337') or _refused(*vectors)}"


def _length_off(control: str) -> str:
    lines, _ = _written(control, TWO_TOOLS)
    return _shown(lines, RETRACT, "G49") if _places(lines, "G49") else "–"


def _tool_change(control: str) -> str:
    lines, _ = _written(control, TWO_TOOLS)
    change = _places(lines, CHANGE)[1]
    last = [k for k in _places(lines, r"(G[01]|LN?) X") if k < change][-1]
    without = "" if _places(lines, RETRACT) else " (without a retract: it has none)"
    return f"mended{without}: " + ", ".join(f"`{line}`" for line in lines[last + 1 : change + 1] if line[0] not in "(;")


def _rewind_in_rapid(control: str) -> str:
    lines, codes = _written(control, _ring(rapid=True), TWO_TURNS)
    if "CS340" in codes:
        return "said: CS340"
    turn = _places(lines, RETRACT)[1]
    on = next(k for k in _places(lines, r"(G0|L) X") if k > turn)
    return "mended: " + ", ".join(f"`{line}`" for line in lines[turn : on + 1])


def _rewind_in_cut(control: str) -> str:
    plain = _refused(*_written(control, _ring(rapid=False), TWO_TURNS))
    lines, codes = _written(control, _ring(rapid=False), TWO_TURNS, rewind=40.0)
    return plain + "; `--rewind 40` " + (_refused(lines, codes) or f"mends it ({_said(codes, 'CS376')})")


def _fragments(control: str) -> str:
    return _said(_written(control, BARE)[1], "CS332", "CS333", "CS334", "CS335")


def _compensation(control: str) -> str:
    lines, codes = _written(control, CUTCOM)
    return _said(codes, "CS319") or _refused(lines, codes)


def _lengths_of_heads(control: str) -> str:
    return _refused(*_written(control, TWO_TOOLS, like="head-ac", tcp=False))


def _inverse_time(control: str) -> str:
    lines, codes = _written(control, FAST, tcp=False)
    if not lines:
        return "–"
    fastest = max(float(word) for line in lines for word in re.findall(r" F([\d.]+)", line))
    limit = load_control(control).forms["g1"].modes["machine"].motion.fastest
    return (f"mended: F{fastest:.3f} of F{limit:.3f}" if limit else f"no limit: F{fastest:.3f}") + (
        f"; {_said(codes, 'CS371')}" if "CS371" in codes else ""
    )


def _beyond_a_turn(control: str) -> str:
    _, codes = _written(control, _ring(rapid=False))
    modulo, _ = _written(control, _ring(rapid=False), '[[axis]]\nname = "C"\nmodulo = true\n')
    word = re.search(r"C=?(DC\()?[-+]?[\d.]+\)?", modulo[-12] if modulo else "")
    with_file = f"`modulo`: `{word[0]}`" + (" under `M126`" if "M126" in modulo else "") if word else ""
    return "; ".join(filter(None, (_said(codes, "CS346"), with_file))) or "endless axis"


def _new_speed(control: str) -> str:
    lines, _ = _written(control, SPEED)
    at = _places(lines, "TOOL CALL Z S6000")
    return "mended: " + ", ".join(f"`{line}`" for line in lines[at[0] - 1 : at[0] + 4]) if at else "–"


def _splines(control: str) -> str:
    if "bspline" not in load_control(control).forms:
        return "–"
    return _said(_written(control, TWO_TOOLS, None, form="bspline")[1], "CS325")


def _numbers(control: str) -> str:
    lines, _ = _written(control, TWO_TOOLS, frame=Frame(block_numbers=True))
    return "mended: " + ", ".join(f"`{line}`" for line in lines[:3]) if lines[0] == "%" else "–"


def _high_speed(control: str) -> str:
    if "hpcc" not in load_control(control).extras:
        return "–"
    return _said(_written(control, TWO_TOOLS, extras=("hpcc",))[1], "CS339")


def _mist(control: str) -> str:
    lines, codes = _written(control, MIST)
    return _shown(lines, "M7") or _said(codes, "CS310")


def _name(control: str) -> str:
    lines, _ = _written(control, TWO_TOOLS, frame=Frame(stem="part-0712"))
    line = next(line for line in lines if "0712" in line)
    return f"mended: `{line}`, {load_control(control).layout.suffix}"


ROWS: tuple[tuple[str, str, Callable[[str], str]], ...] = (
    ("1", "tip control on with the table at any angle", _turned_table),
    ("2", "no work offset", _work_offset),
    ("3", "first motion: a rapid of five axes to a tilted tool", _first_motion),
    ("4", "G49 alone", _length_off),
    ("5", "tool change without retract, with spindle and coolant on", _tool_change),
    ("6", "an axis turns back in a rapid under tip control", _rewind_in_rapid),
    ("6", "an axis passes its limit in a cut", _rewind_in_cut),
    ("7", "no tool, no spindle, first motion at feed, bare GOHOME", _fragments),
    ("7", "cutter compensation", _compensation),
    ("7", "several tools, a head, `--no-tcp`, one length", _lengths_of_heads),
    ("8", "F of inverse time beyond the control's range", _inverse_time),
    ("8", "angles beyond a turn", _beyond_a_turn),
    ("8", "a new speed under TCPM", _new_speed),
    ("8", "fewer than six spline blocks of ten", _splines),
    ("8", "a number before the O line", _numbers),
    ("8", "HPCC across rapids and M codes", _high_speed),
    ("8", "COOLNT/MIST", _mist),
    ("9", "name of part-0712.cls", _name),
)

_TOP = """# What a review found around the motion

27 texts of the first version were read line by line beside real posts and manuals. Each finding stands here beside
the texts of today: mended, with the blocks that show it; refused; or said, as a warning that the summary counts; –
where it cannot be. `python docs/make_findings.py` makes this page of [two_tools.cls](two_tools.md) and small files;
the codes are in [codes.md](codes.md), what else stands around the motion in [controls.md](controls.md).

"""


def page() -> str:
    """Text of the page."""
    parts = [_TOP]
    for number, title, row in ROWS:
        parts.append(f"## {number}. {title[0].upper()}{title[1:]}\n\n| | |\n|---|---|\n")
        cells: dict[str, list[str]] = {}
        for control in MACHINES:
            cells.setdefault(row(control), []).append(control)
        parts += [f"| {', '.join(controls)} | {cell} |\n" for cell, controls in cells.items()]
        parts.append("\n")
    return "".join(parts).rstrip("\n") + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
