"""Controls as TOML tables: those that come with the program, and the user's own.

A table may say ``like = "fanuc"`` and then only what is different, ``false`` for a form or mode that it has not; the
keys are those of the tables in the folder ``controls``.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, get_args

from cornersmooth.errors import SettingsError
from cornersmooth.model import FeedMode
from cornersmooth.nc.control import (
    INVERSE_TIME,
    LINE_ENDS,
    PLANNERS,
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
from cornersmooth.nc.trusted_words import trusted_words
from cornersmooth.settings import BOUNDS, Lines
from cornersmooth.tables import Shelf, Table, check_pattern, filled, is_file

_FORM_KEYS = ("description", "curve", "upright", "plane", *get_args(Orientation))
_MOTION_KEYS = frozenset(item.name for item in fields(Motion))
_PLANES = {"xy": 17, "zx": 18, "yz": 19}
_FEED_MODES = {
    "per_minute": int(FeedMode.PER_MINUTE),
    "per_revolution": int(FeedMode.PER_REVOLUTION),
    "inverse_time": INVERSE_TIME,
}
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


class _Controls(Shelf):
    """Tables of controls: their texts are ASCII, and hold the braces that their place has."""

    def text(self, value: object, where: str) -> str:
        """Refuse what is no text for an NC program."""
        if not isinstance(value, str) or not value.isascii() or not (value.isprintable()):
            raise self.wrong(f"{where} is {value!r}", "give ASCII text without line ends")
        own = {"extras": _EXTRA_BRACES, "cycles": _CYCLE_BRACES}.get(where.partition(".")[0])
        places = _BRACES.get(where.rpartition(".")[2], {}) if own is None else own
        if not where.endswith("_pattern") and where != "trusted" and ("{" in value or "}" in value):
            try:
                filled(value, places)
            except ValueError as error:
                known = ", ".join(f"{{{place}}}" for place in places) or "no braces"
                raise self.wrong(f"{where}: {value!r} has unknown braces", f"use {known}") from error
        return value


_SHELF = _Controls(
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
        "trusted",
    ),
    unknown="CS210",
    unreadable="CS212",
    unknown_key="CS214",
    wrong_value="CS213",
)


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
        digits = _SHELF.table(table.get("digits", {}), "digits")
        motion = table.get("motion", {})
        _SHELF.record(Motion, motion, "motion")
        rest = {key: value for key, value in table.items() if key != "motion"}
        return _SHELF.record(
            Control,
            {"name": name, "forms": {}, "digits": {}} | rest,
            "",
            given={"like": like, "systems": _systems(digits), "own": True},
            digits=lambda _, where: _digits({key: value for key, value in digits.items() if key != "systems"}, where),
            program=_program,
            layout=_layout,
            words=_words,
            forms=lambda forms, where: _forms(forms, where, motion),
            extras=_extras,
            lines=_lines,
            cycles=partial(_SHELF.record, Cycles),
            trusted=partial(_trusted, dialect=like),
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


def _digits(table: Any, where: str) -> Digits:
    digits = partial(_SHELF.whole, most=_MOST_DIGITS)
    checks: dict[str, Any] = {item.name: digits for item in fields(Digits) if item.name != "lever"}
    if isinstance(table, dict):
        _SHELF.check_keys(table, (*checks, "lever", "systems"), f"{where}.")
    return _SHELF.record(Digits, table, where, **checks | {"vector_length": partial(_SHELF.whole, least=1)})


def _systems(digits: Table) -> dict[str, Digits]:
    """Digits to choose from, each with those of the table where it says nothing."""
    systems = _SHELF.table(digits.get("systems", {}), "digits.systems")
    plain = {key: value for key, value in digits.items() if key != "systems"}
    where = {name: f"digits.systems.{name}" for name in systems}
    return {name: _digits(plain | _SHELF.table(entry, where[name]), where[name]) for name, entry in systems.items()}


def _program(table: Any, where: str) -> ProgramTable:
    program = _SHELF.record(ProgramTable, table, where)
    for key in ("name_pattern", "work_offset_pattern"):
        pattern = getattr(program, key)
        try:
            check_pattern(pattern)
        except ValueError as error:
            raise _SHELF.wrong(f"program.{key} is {pattern!r}: {error}", "give a plain regular expression") from error
    for key in ("start", "begin", "tool_end", "between_tools", "end", "retract"):
        for block in getattr(program, key):
            if any(f"{{{step}}}" in block and block != f"{{{step}}}" for step in STEPS):
                raise _SHELF.wrong(f"program.{key}: {block!r} holds more than a step", "give the step alone")
    return program


def _layout(table: Any, where: str) -> TextStyle:
    layout = _SHELF.record(
        TextStyle,
        table,
        where,
        units=lambda given, place: {"mm": "", "inch": ""} | _strings(given, place, ("mm", "inch")),
        comment=partial(_SHELF.texts, count=2, hint="give what stands before and behind"),
    )
    if layout.line_ends not in LINE_ENDS:
        raise _SHELF.wrong(f"layout.line_ends is {layout.line_ends!r}", f"use {' or '.join(LINE_ENDS)}")
    return layout


def _words(table: Any, where: str) -> Words:
    def coolant(given: Any, place: str) -> dict[str, tuple[str, ...]]:
        given = _SHELF.table(given, place)
        return {word.upper(): _SHELF.texts(blocks, f"{place}.{word}") for word, blocks in given.items()}

    def by_number(given: Any, place: str, numbers: Mapping[str, int]) -> dict[int, str]:
        return {numbers[key]: block for key, block in _strings(given, place, tuple(numbers)).items()}

    return _SHELF.record(
        Words,
        table,
        where,
        coolant=coolant,
        coolant_off=coolant,
        plane=partial(by_number, numbers=_PLANES),
        feed_mode=partial(by_number, numbers=_FEED_MODES),
    )


def _forms(forms: Any, where: str, motion: Table) -> dict[str, FormTable]:
    if not _SHELF.table(forms, where):
        raise _SHELF.wrong("there are no forms", "write a table [forms.g1]")
    return {name: _form(name, entry, motion) for name, entry in forms.items()}


def _form(name: str, entry: Any, motion: Table) -> FormTable:
    where, orientations = f"forms.{name}", get_args(Orientation)
    _SHELF.check_keys(_SHELF.table(entry, where), _FORM_KEYS, f"{where}.")
    curve = entry.get("curve", "")
    if curve not in get_args(CurveStyle):
        raise _SHELF.wrong(f"{where}.curve is {curve!r}", f"use one of {', '.join(get_args(CurveStyle)[1:])}")
    mode = partial(_mode, motion=motion)
    modes = {key: mode(entry[key], f"{where}.{key}") for key in orientations if key in entry}
    for orientation, found in modes.items():
        wanted = {"vector": 3, "point": 3}.get(orientation, 0)
        if len(found.words) != wanted:
            raise _SHELF.wrong(f"{where}.{orientation} has {len(found.words)} words", f"give {wanted}")
    if not modes:
        raise _SHELF.wrong(f"{where} says no orientation", f"use one of {', '.join(orientations)}")
    rest = {key: value for key, value in entry.items() if key not in (*orientations, "curve")}
    given = {"name": name, "curve": curve, "modes": modes}
    return _SHELF.record(FormTable, rest, where, given=given, upright=mode, plane=mode)


def _trusted(given: Any, where: str, dialect: str) -> frozenset[str]:
    try:
        return trusted_words(_SHELF.texts(given, where), dialect)
    except ValueError as error:
        raise _SHELF.wrong(f"{where}: {error}", 'give machine functions, as in ["M208"]') from error


def _lines(table: Any, where: str) -> LineStyle:
    lines = _SHELF.record(LineStyle, table, where)
    if lines.lines not in get_args(Lines):
        raise _SHELF.wrong(f"lines.lines is {lines.lines!r}", f"use {' or '.join(get_args(Lines))}")
    for name in ("curve_share", "line_share", "blend_share", "executed_share"):
        if not 0.0 < getattr(lines, name) <= 1.0:
            raise _SHELF.wrong(f"lines.{name} is {getattr(lines, name)}", "give a part of 1")
    if not 0.0 <= lines.block_time <= BOUNDS["block_time"][1]:
        raise _SHELF.wrong(f"lines.block_time is {lines.block_time}", "give seconds, up to 1")
    if lines.planner not in PLANNERS:
        raise _SHELF.wrong(f"lines.planner is {lines.planner!r}", f"use {PLANNERS[1]}, or leave it out")
    if not 0.0 <= lines.lag <= _MOST_LAG:
        raise _SHELF.wrong(f"lines.lag is {lines.lag}", f"give a number up to {_MOST_LAG:g}")
    return lines


def _extras(table: Any, where: str) -> dict[str, Extra]:
    entries = _SHELF.table(table, where).items()
    return {name: _SHELF.record(Extra, entry, f"{where}.{name}", given={"name": name}) for name, entry in entries}


def _mode(entry: Any, where: str, motion: Table) -> Mode:
    known = (*(item.name for item in fields(Mode) if item.name != "motion"), *_MOTION_KEYS)
    _SHELF.check_keys(_SHELF.table(entry, where), known, f"{where}.")
    own = {key: value for key, value in entry.items() if key in _MOTION_KEYS}
    rest = {key: value for key, value in entry.items() if key not in _MOTION_KEYS}
    mode = _SHELF.record(Mode, rest, where, given={"motion": _SHELF.record(Motion, motion | own, where)})
    if mode.rotations and not re.fullmatch(r"(?!(.)\1)[xyz][xy][xyz]", mode.rotations):
        what = f"{where}.rotations is {mode.rotations!r}"
        raise _SHELF.wrong(what, "give three axes, as in zxz; the second is not z")
    return mode


def _strings(table: Any, where: str, keys: tuple[str, ...]) -> dict[str, str]:
    _SHELF.check_keys(_SHELF.table(table, where), keys, f"{where}.")
    return {key: _SHELF.text(value, f"{where}.{key}") for key, value in table.items()}
