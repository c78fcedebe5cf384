"""Controls as TOML tables: those that come with the program, and the user's own.

A table may say ``like = "fanuc"`` and then only what is different, ``false`` for a form or mode that it has not; the
keys are those of the tables in the folder ``controls``.
"""

from __future__ import annotations

import re
from dataclasses import fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar, get_args

from cornersmooth.errors import SettingsError
from cornersmooth.model import FeedMode
from cornersmooth.nc.control import (
    INVERSE_TIME,
    LINE_ENDS,
    Control,
    CurveStyle,
    Cycles,
    Digits,
    Extra,
    FormTable,
    LineStyle,
    Mode,
    Motion,
    Orientation,
    TextStyle,
    Words,
)
from cornersmooth.nc.program_table import STEPS, ProgramTable
from cornersmooth.settings import Lines
from cornersmooth.tables import Shelf, Table, is_file

Record = TypeVar("Record", Digits, ProgramTable, TextStyle, Words, Motion, Extra, LineStyle, Cycles)

_SHELF = Shelf(
    "control",
    __package__,
    "controls",
    keys=(
        "name",
        "description",
        "digits",
        "program",
        "layout",
        "words",
        "motion",
        "forms",
        "extras",
        "lines",
        "cycles",
    ),
    unknown="CS210",
    unreadable="CS212",
    unknown_key="CS214",
    wrong_value="CS213",
)

_FORM_KEYS = ("description", "curve", "upright", "plane", *get_args(Orientation))
_MODE_KEYS = (
    "words",
    "on",
    "off",
    "within_on",
    "within_off",
    "begin",
    "tool_end",
    "rotations",
    "reset",
    "circles",
    "timed_turns",
    *(item.name for item in fields(Motion)),
)
_PLANES = {"xy": 17, "zx": 18, "yz": 19}
_FEED_MODES = {
    "per_minute": int(FeedMode.PER_MINUTE),
    "per_revolution": int(FeedMode.PER_REVOLUTION),
    "inverse_time": INVERSE_TIME,
}
#: keys whose values are tables
_TABLES = (
    "digits",
    "digits.systems",
    "lines",
    "cycles",
    "program",
    "layout",
    "layout.units",
    "words",
    "words.coolant",
    "words.coolant_off",
    "words.plane",
    "words.feed_mode",
    "motion",
)
_MOST_DIGITS = 9
_MOST_LAG = 100.0
#: what stands in braces in blocks of the program, names of steps among it
_PROGRAM_BRACES: Table = {"program": "O1", "units": "G21", "blend": "0.001"} | dict.fromkeys(STEPS, "")
#: what stands in braces in blocks
_BRACES: dict[str, Table] = {
    "tool_change": {"tool": 1},
    "tool_select": {"tool": 1},
    "spindle_speed": {"speed": "1", "direction": "M3"},
    "dwell": {"milliseconds": 1, "seconds": "1."},
    "compensation_left": {"register": 1},
    "compensation_right": {"register": 1},
    "on": {"offset": 1, "rotary": "A,C", "first": "0.", "second": "0.", "third": "0."},
    "with_z": {"offset": 1},
    "within_on": {"kinematics_on": ""},
    "within_off": {"kinematics_off": ""},
    "work_offset_block": {"work_offset": "G54"},
    "file_name": {"stem": "PART", "number": "0001"},
    "position": {"position": "Z0."},
    **dict.fromkeys(("start", "begin", "tool_end", "between_tools", "end", "retract"), _PROGRAM_BRACES),
    "block_number": {"number": 10},
    "rounding": {"blend": "0.001"},
}
#: the same in blocks of hole cycles
_CYCLE_BRACES: Table = dict.fromkeys(
    ("x", "y", "travel", "top", "clearance", "bottom", "setup", "above", "depth", "step", "feed", "seconds", "pitch"),
    "",
) | {"milliseconds": 1, "speed": ""}
#: the same in blocks of extras
_EXTRA_BRACES: Table = {"blend": "0.001", "turn": "0.01"}


def control_names() -> tuple[str, ...]:
    """Names of the controls that come with the program, sorted."""
    return _SHELF.names()


def control_aliases() -> dict[str, str]:
    """Name of the control for each of its other names, such as that of a model."""
    return _SHELF.aliases()


def find_control(name: str) -> str:
    """Return the name of the control that comes with the program and is called so; empty for none."""
    return _SHELF.find(name)


def load_control(name_or_path: str | Path) -> Control:
    """Control of that name, or described by that TOML file.

    A text that ends in ``.toml`` or holds a path separator is a file; anything else is a name.

    Raises
    ------
    SettingsError
        The name is unknown (with the closest known one), the file cannot be read, or it does not describe a control.
    """
    if not is_file(name_or_path):
        return _built_in(str(name_or_path))
    text, file, name = _SHELF.choose(name_or_path)
    return parse_control(text, file=file, name=name)


@lru_cache(maxsize=32)
def _built_in(given: str) -> Control:
    text, file, name = _SHELF.choose(given)
    return replace(parse_control(text, file=file, name=name), own=False)


def parse_control(text: str | Table, *, file: str = "<control>", name: str = "control") -> Control:
    """Control that a TOML text, or a table read from one, describes.

    Parameters
    ----------
    file : str
        For messages.
    name : str
        Where the text has none.

    Raises
    ------
    SettingsError
        The text is not TOML, has an unknown key (with the closest known one), or does not describe a control.
    """
    try:
        table, like = _SHELF.parse(text)
        _check_tables(table)
        return Control(
            name=_text(table, "name", name),
            description=_text(table, "description", ""),
            like=like,
            digits=_digits(table),
            program=_program(table.get("program", {})),
            layout=_layout(table.get("layout", {})),
            words=_words(table.get("words", {})),
            forms=_forms(table),
            extras=_extras(table.get("extras", {})),
            lines=_lines(table.get("lines", {})),
            cycles=_record(Cycles, table.get("cycles", {}), "cycles"),
            systems=_systems(table),
            own=True,
        )
    except SettingsError as error:
        raise SettingsError(error.code, error.what, error.hint, file=file) from error


def control_table(name: str) -> str:
    """Text of the table of a control that comes with the program.

    Raises
    ------
    SettingsError
        The name is unknown.
    """
    return _SHELF.built_in(name)


def _check_tables(table: Table) -> None:
    """Refuse what is no table where one is wanted."""
    for path in _TABLES:
        value: Any = table
        for key in path.split("."):
            value = value.get(key, {})
        _check_table(value, path)
    _check_table(table.get("forms", {}), "forms")
    for name, form in table.get("forms", {}).items():
        _check_table(form, f"forms.{name}")
        for mode in ("upright", "plane", *get_args(Orientation)):
            _check_table(form.get(mode, {}), f"forms.{name}.{mode}")


def _check_table(value: object, where: str) -> None:
    if not isinstance(value, dict):
        raise _SHELF.wrong(f"{where} is {value!r}", f"write a table [{where}]")


def _digits(table: Table) -> Digits:
    _SHELF.check_keys(table.get("digits", {}), (*(item.name for item in fields(Digits)), "systems"), "digits.")
    return _record(Digits, {key: value for key, value in table.get("digits", {}).items() if key != "systems"}, "digits")


def _systems(table: Table) -> dict[str, Digits]:
    """Digits to choose from, each with those of the table where it says nothing."""
    digits = table.get("digits", {})
    plain = {key: value for key, value in digits.items() if key != "systems"}
    systems = {}
    for name, entry in digits.get("systems", {}).items():
        where = f"digits.systems.{name}"
        _check_table(entry, where)
        systems[name] = _record(Digits, {**plain, **entry}, where)
    return systems


def _program(table: Table) -> ProgramTable:
    program = _record(ProgramTable, table, "program")
    for key in ("name_pattern", "work_offset_pattern"):
        pattern = getattr(program, key)
        try:
            re.compile(pattern)
        except re.error as error:
            raise _SHELF.wrong(f"program.{key} is {pattern!r}: {error}", "give a regular expression") from error
    for key in ("start", "begin", "tool_end", "between_tools", "end", "retract"):
        for block in getattr(program, key):
            if any(f"{{{step}}}" in block and block != f"{{{step}}}" for step in STEPS):
                raise _SHELF.wrong(f"program.{key}: {block!r} holds more than a step", "give the step alone")
    return program


def _layout(table: Table) -> TextStyle:
    units = {"mm": "", "inch": ""} | _strings(table.get("units", {}), "layout.units", ("mm", "inch"))
    plain = {key: value for key, value in table.items() if key != "units"}
    _SHELF.check_keys(table, tuple(item.name for item in fields(TextStyle)), "layout.")
    layout = _record(TextStyle, plain, "layout")
    if len(layout.comment) != 2:
        raise _SHELF.wrong(f"layout.comment is {plain['comment']!r}", "give what stands before and behind")
    if layout.line_ends not in LINE_ENDS:
        raise _SHELF.wrong(f"layout.line_ends is {layout.line_ends!r}", f"use {' or '.join(LINE_ENDS)}")
    return TextStyle(**{**vars(layout), "units": units})


def _words(table: Table) -> Words:
    _SHELF.check_keys(table, tuple(item.name for item in fields(Words)), "words.")
    special = {"coolant", "coolant_off", "plane", "feed_mode"}
    words = _record(Words, {key: value for key, value in table.items() if key not in special}, "words")
    coolant, coolant_off = (
        {word.upper(): _blocks(blocks, f"words.{key}.{word}") for word, blocks in table.get(key, {}).items()}
        for key in ("coolant", "coolant_off")
    )
    planes = _strings(table.get("plane", {}), "words.plane", tuple(_PLANES))
    modes = _strings(table.get("feed_mode", {}), "words.feed_mode", tuple(_FEED_MODES))
    return Words(
        **{
            **vars(words),
            "coolant": coolant,
            "coolant_off": coolant_off,
            "plane": {_PLANES[key]: block for key, block in planes.items()},
            "feed_mode": {_FEED_MODES[key]: block for key, block in modes.items()},
        }
    )


def _forms(table: Table) -> dict[str, FormTable]:
    entries = table.get("forms", {})
    if not isinstance(entries, dict) or not entries:
        raise _SHELF.wrong("there are no forms", "write a table [forms.g1]")
    motion = table.get("motion", {})
    _SHELF.check_keys(motion, tuple(item.name for item in fields(Motion)), "motion.")
    return {name: _form(name, entry, motion) for name, entry in entries.items()}


def _form(name: str, entry: Table, motion: Table) -> FormTable:
    where = f"forms.{name}"
    _SHELF.check_keys(entry, _FORM_KEYS, f"{where}.")
    curve = entry.get("curve", "")
    if curve not in get_args(CurveStyle):
        raise _SHELF.wrong(f"{where}.curve is {curve!r}", f"use one of {', '.join(get_args(CurveStyle)[1:])}")
    modes: dict[Orientation, Mode] = {}
    for orientation in get_args(Orientation):
        if orientation in entry:
            modes[orientation] = _mode(entry[orientation], motion, f"{where}.{orientation}")
            wanted = {"vector": 3, "point": 3}.get(orientation, 0)
            if len(modes[orientation].words) != wanted:
                raise _SHELF.wrong(f"{where}.{orientation} has {len(modes[orientation].words)} words", f"give {wanted}")
    if not modes:
        raise _SHELF.wrong(f"{where} says no orientation", f"use one of {', '.join(get_args(Orientation))}")
    upright = _mode(entry["upright"], motion, f"{where}.upright") if "upright" in entry else None
    plane = _mode(entry["plane"], motion, f"{where}.plane") if "plane" in entry else None
    return FormTable(name, _text(entry, "description", ""), curve, modes, upright, plane)


def _lines(table: Table) -> LineStyle:
    lines = _record(LineStyle, table, "lines")
    if lines.lines not in get_args(Lines):
        raise _SHELF.wrong(f"lines.lines is {lines.lines!r}", f"use {' or '.join(get_args(Lines))}")
    for name in ("curve_share", "line_share", "blend_share", "executed_share"):
        if not 0.0 < getattr(lines, name) <= 1.0:
            raise _SHELF.wrong(f"lines.{name} is {getattr(lines, name)}", "give a part of 1")
    if not 0.0 <= lines.lag <= _MOST_LAG:
        raise _SHELF.wrong(f"lines.lag is {lines.lag}", f"give a number up to {_MOST_LAG:g}")
    return lines


def _extras(table: Table) -> dict[str, Extra]:
    _check_table(table, "extras")
    extras = {}
    for name, entry in table.items():
        _check_table(entry, f"extras.{name}")
        extras[name] = _record(Extra, {**entry, "name": name}, f"extras.{name}")
    return extras


def _mode(entry: Table, motion: Table, where: str) -> Mode:
    _SHELF.check_keys(entry, _MODE_KEYS, f"{where}.")
    own = {item.name for item in fields(Motion)}
    rotations = _text(entry, "rotations", "")
    if rotations and not re.fullmatch(r"(?!(.)\1)[xyz][xy][xyz]", rotations):
        raise _SHELF.wrong(f"{where}.rotations is {rotations!r}", "give three axes, as in zxz; the second is not z")
    return Mode(
        words=_blocks(entry.get("words", []), f"{where}.words"),
        on=_blocks(entry.get("on", []), f"{where}.on"),
        off=_blocks(entry.get("off", []), f"{where}.off"),
        within_on=_blocks(entry.get("within_on", []), f"{where}.within_on"),
        within_off=_blocks(entry.get("within_off", []), f"{where}.within_off"),
        begin=_blocks(entry["begin"], f"{where}.begin") if "begin" in entry else None,
        tool_end=_blocks(entry["tool_end"], f"{where}.tool_end") if "tool_end" in entry else None,
        rotations=rotations,
        reset=_blocks(entry.get("reset", []), f"{where}.reset"),
        motion=_record(Motion, {**motion, **{key: value for key, value in entry.items() if key in own}}, where),
        circles=_flag(entry.get("circles", False), f"{where}.circles"),
        timed_turns=_flag(entry.get("timed_turns", False), f"{where}.timed_turns"),
    )


def _record(kind: type[Record], table: Table, where: str) -> Record:
    """Dataclass of plain fields from a table, each checked against the type of its default."""
    values: Table = {}
    _SHELF.check_keys(table, tuple(item.name for item in fields(kind)), f"{where}.")
    plain = kind()
    for key, value in table.items():
        default = getattr(plain, key)
        if isinstance(default, tuple):
            values[key] = _blocks(value, f"{where}.{key}")
        elif isinstance(default, bool):
            values[key] = _flag(value, f"{where}.{key}")
        elif isinstance(default, int):
            most = _MOST_DIGITS if kind is Digits and key not in ("lever", "vector_length") else 1_000_000
            least = int(key == "vector_length")
            if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
                span = f"from {least} to {most}" if least else f"up to {most}"
                raise _SHELF.wrong(f"{where}.{key} is {value!r}", f"give a whole number {span}")
            values[key] = value
        elif isinstance(default, float):
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise _SHELF.wrong(f"{where}.{key} is {value!r}", "give a number")
            values[key] = float(value)
        else:
            values[key] = _string(value, f"{where}.{key}")
    return kind(**values)


def _blocks(value: object, where: str) -> tuple[str, ...]:
    if not isinstance(value, list) or not all(isinstance(block, str) for block in value):
        raise _SHELF.wrong(f"{where} is {value!r}", 'give a list of texts, as in ["M8"]')
    return tuple(_string(block, where) for block in value)


def _strings(table: Any, where: str, keys: tuple[str, ...]) -> dict[str, str]:
    if not isinstance(table, dict):
        raise _SHELF.wrong(f"{where} is {table!r}", "give a table of texts")
    _SHELF.check_keys(table, keys, f"{where}.")
    return {key: _string(value, f"{where}.{key}") for key, value in table.items()}


def _string(value: object, where: str) -> str:
    if not isinstance(value, str) or not value.isascii() or not (value.isprintable()):
        raise _SHELF.wrong(f"{where} is {value!r}", "give ASCII text without line ends")
    own = {"extras": _EXTRA_BRACES, "cycles": _CYCLE_BRACES}.get(where.partition(".")[0])
    places = _BRACES.get(where.rpartition(".")[2], {}) if own is None else own
    if not where.endswith("_pattern") and ("{" in value or "}" in value):
        try:
            value.format(**places)
        except (KeyError, IndexError, ValueError) as error:
            known = ", ".join(f"{{{place}}}" for place in places) or "no braces"
            raise _SHELF.wrong(f"{where}: {value!r} has unknown braces", f"use {known}") from error
    return value


def _text(table: Table, key: str, default: str) -> str:
    return _string(table.get(key, default), key)


def _flag(value: object, where: str) -> bool:
    if not isinstance(value, bool):
        raise _SHELF.wrong(f"{where} is {value!r}", "give true or false")
    return value
