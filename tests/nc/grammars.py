"""The text of every control and form as its manual has it: readers by control, form, machine and units."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from nc.reading import Reader
from nc.rotations import machine_letters
from nc.splines import HeidenhainSplines, KnotSplines, SiemensPolynomials, SiemensSplines

#: comments, ends, tools, spindle, coolant, stops, feed modes, planes and compensation of the ISO controls
ISO = (
    r"\([^()]*\)|%|T\d+ M6|T\d+|S\d+ M[34]|M(?:0|1|3|4|5|7|8|9|19|30)|G9[345]|G1[789]|G4[12] D\d+|G40|"
    r"G1|G2[01] G90 G94 G17 G40 G49 G80|G54"
)
MILLISECONDS, SECONDS = r"|O\d{4}|G4 P\d+", r"|O\d{4}|G4 P\d+\.\d*"
SIEMENS = (
    r"; .*|G90 G94 G17 G40 G7[01]0|T\d+|M6|D1|G54|S[\d.]+ M[34]|M(?:0|1|3|4|5|7|8|9|30)|SPOS=0|G4 F[\d.]+|G9[345]|"
    r"G1[789]|G4[0-2]|TRAORI|TRAFOOF|ORIWKS ORIVECT|ORIWKS ORICURVE|ORIMKS ORIAXES"
)
HEIDENHAIN = (
    r"; .*|BEGIN PGM \w+ (?:MM|INCH)|END PGM \w+ (?:MM|INCH)|TOOL CALL \d+ Z|TOOL CALL Z S\d+(?:\.\d{1,3})?|"
    r"PLANE RESET STAY|CYCL DEF 247 DATUM SETTING Q339=\+1|M126|"
    r"TOOL DEF \d+|STOP|M(?:1|3|4|5|8|9|30|136|137)|CYCL DEF 9\.0 DWELL TIME|CYCL DEF 9\.1 DWELL [\d.]+|"
    r"FUNCTION TCPM F TCP AXIS POS PATHCTRL (?:VECTOR|AXIS)|FUNCTION RESET TCPM"
)

#: the retract of every control, and the block that must follow it
HOMES = {
    "fanuc": {"home": r"G91 G28 Z0\.", "back": "G90", "retracts_on": True},
    "mitsubishi": {"home": r"G91 G28 Z0\.", "back": "G90", "retracts_on": True},
    "haas": {"home": r"G53 G0 Z0\.", "retracts_on": True},
    "linuxcnc": {"home": "G53 G0 Z0", "retracts_on": True},
    "siemens": {"home": "SUPA G0 Z0 D0"},
    "heidenhain": {"home": "L Z-1 R0 FMAX M91"},
    "generic": {},
}

#: decimals of lengths in mm (in inches one more) and of rotary words
TIP_DIGITS = {"siemens": 6, "linuxcnc": 6, "generic": 6}
ANGLE_DIGITS = {"siemens": 6, "linuxcnc": 6, "generic": 6}

#: how tip control or the length of the tool is switched on and off
LENGTH = {"on": r"G43 H\d+", "off": "G49", "with_z": True}
FUNCTIONS = LENGTH | {"with_z": False}  # further functions follow, or it never moves an axis
VECTORS = {"on": r"G43\.5 H\d+", "off": "G49"}
ANGLES = {"on": r"G43\.4 H\d+", "off": "G49"}
HAAS = {"on": r"G234 H\d+", "off": "G49"}
KINEMATICS = {"on": "M428", "off": "M429"}
TRAORI = {"on": "TRAORI", "off": "TRAFOOF", "tool": "M6"}
TCPM = {"on": "FUNCTION TCPM .*", "off": "FUNCTION RESET TCPM", "tool": r"TOOL CALL \d+ Z"}


def reader(control: str, form: str, machine: str = "", tcp: bool = True, units: str = "mm", digits: str = "") -> Reader:
    """Reader of the text of a control in one of its forms; `digits` of lengths in mm, where they are not the usual."""
    tip = int(digits or TIP_DIGITS.get(control, 4)) + (units == "inch")
    made = {"siemens": _siemens, "heidenhain": _heidenhain}.get(control, _iso)(control, form, machine, tcp, tip)
    made = replace(made, **HOMES[control])
    if made.on == KINEMATICS["on"]:  # retracts are of the machine: tip control is off before
        made = replace(made, retracts_on=False)
    return replace(made, scale=1.0 if units == "mm" else 25.4)


def _rotary(machine: str, tcp: bool) -> str:
    return "angles" if tcp else "machine"


def _iso(control: str, form: str, machine: str, tcp: bool, tip: int) -> Reader:
    alone = control == "linuxcnc" or (control, form) == ("mitsubishi", "g6.2")
    switch: dict[str, Any] = FUNCTIONS if alone else LENGTH
    if control == "generic":
        switch = {"on": "", "off": ""}
    elif tcp and machine:
        switch = {"haas": HAAS, "linuxcnc": KINEMATICS if machine.endswith("-trt") else FUNCTIONS}.get(control, ANGLES)
    elif tcp and form == "g1":
        switch = VECTORS
    codes = ISO + (SECONDS if control in ("haas", "linuxcnc") else MILLISECONDS)
    if control == "generic":
        codes = codes.replace(" G49", "").replace("|G54", "")
    if control == "linuxcnc":
        codes = codes.replace("M(?:", "M(?:2|").replace("M(?:2|0|1|3|4|5|7|8|9|19|30)", "M(?:0|1|2|3|4|5|7|8|9)")
        codes += r"|S\d+\.\d{1,3} M[34]|M19 R0|G64 P(?!0\.0* )\d+\.\d+ Q0|M429" + r"|G43 H\d+|G49" * tcp
    else:
        codes += "|G5 P10000|G5 P0" if (control, form) == ("mitsubishi", "g6.2") else ""
    on = "" if switch.get("with_z") else switch["on"]
    codes = "|".join(part for part in (codes, on, switch["off"]) if part)
    if machine:
        words, decimals, turn = machine_letters(machine), (ANGLE_DIGITS.get(control, 4),) * 2, _rotary(machine, tcp)
    elif form == "g1":
        words, decimals, turn = ("I", "J", "K"), (7,) * 3, "great circle"
    elif control == "mitsubishi":
        words, decimals, turn = (), (), "fixed"
    else:
        words, decimals, turn = ("U", "V", "W"), (tip,) * 3, "point"
    return Reader(
        ("X", "Y", "Z", *words),
        codes,
        turn,
        machine,
        decimals=(tip,) * 3 + decimals,
        circles="" if (control, turn) in (("haas", "angles"), ("generic", "point")) else "R",
        longest=252,
        extra=KnotSplines(weight_decimals=4 if control == "mitsubishi" else 3) if form == "g6.2" else None,
        **switch,
    )


def _siemens(control: str, form: str, machine: str, tcp: bool, tip: int) -> Reader:
    if machine:
        words, decimals, turn = machine_letters(machine), (ANGLE_DIGITS[control],) * 2, _rotary(machine, tcp)
    elif form == "g1":
        words, decimals, turn = ("A3=", "B3=", "C3="), (7,) * 3, "great circle"
    else:
        words, decimals, turn = ("XH=", "YH=", "ZH="), (tip,) * 3, "point"
    return Reader(
        ("X", "Y", "Z", *words),
        SIEMENS,
        turn,
        machine,
        decimals=(tip,) * 3 + decimals,
        circles="" if turn == "point" else "CR=",
        longest=512,
        extra={"bspline": SiemensSplines(), "poly": SiemensPolynomials()}.get(form),
        **(TRAORI if tcp else {}),
    )


def _heidenhain(control: str, form: str, machine: str, tcp: bool, tip: int) -> Reader:
    assert tcp
    if machine:
        words, decimals, turn = machine_letters(machine), (4,) * 2, "angles"
    elif form == "g1":
        words, decimals, turn = ("TX", "TY", "TZ"), (8,) * 3, "great circle"
    else:
        words, decimals, turn = (), (), "fixed"
    line = "LN" if turn == "great circle" else "L"
    return Reader(
        ("X", "Y", "Z", *words),
        HEIDENHAIN,
        turn,
        machine,
        rapid=line,
        feed=line,
        rapid_end=" FMAX",
        decimals=(tip,) * 3 + decimals,
        signs=True,
        circles="R+",
        number="{number} ",
        modes=("M137", "M136", "G93"),
        extra=HeidenhainSplines() if form == "spl" else None,
        **(TCPM if turn != "fixed" else {}),
    )
