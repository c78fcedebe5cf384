"""Controls as TOML tables: those that come with the program, and the user's own.

A table may say ``like = "fanuc"`` and then only what is different, ``false`` for a form or mode that it has not; the
keys are those of the tables in the folder ``controls``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, get_args

from cornersmooth.control.table import Row, table_of
from cornersmooth.errors import SettingsError
from cornersmooth.nc.control import STEPS, Blocks, Control, Digits, FormTable, Mode, Motion, Orientation, Words
from cornersmooth.nc_reader import CONTROLS
from cornersmooth.tables import Shelf, Table, check_pattern, filled, is_file

_FORM_KEYS = ("description", "curve", "upright", "plane", *get_args(Orientation))
_MOTION_KEYS = tuple(item.name for item in fields(Motion))
#: what stands in braces in blocks of the program, names of steps among it
_PROGRAM_BRACES: Table = {"program": "O1", "units": "G21", "blend": "0.001"} | dict.fromkeys(STEPS, "")
#: what stands in braces in blocks
_BRACES: dict[str, Table] = {
    "tool_change": {"tool": 1, "speed": "1"},
    "tool_select": {"tool": 1},
    "spindle_speed": {"speed": "1", "direction": "M3"},
    "dwell": {"milliseconds": 1, "seconds": "1."},
    "compensation_left": {"register": 1},
    "compensation_right": {"register": 1},
    "on": {"offset": 1, "first": "0.", "second": "0.", "third": "0."},
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
_EXTRA_BRACES: Table = {"blend": "0.001", "turn": "0.01"}  #: the same in blocks of extras
_LARGEST = 9999  #: largest number of a machine function
#: functions that mean the same on every machine (ISO 6983-1; M17 ends a subprogram)
_FIXED = re.compile(r"M(\d|17|19|30)")
#: functions that move the tool, change what coordinates mean, or jump to other blocks
_MOVING = re.compile(r"M(9[6-9]|198|428|429|430)")
_PATH_FUNCTIONS = re.compile(r"M(89|9\d|1[0-4]\d)")  #: path functions of Klartext


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
            if places is _PROGRAM_BRACES and any(f"{{{step}}}" in value and value != f"{{{step}}}" for step in STEPS):
                raise self.wrong(f"{where}: {value!r} holds more than a step", "give the step alone")
        return value


_SHELF = _Controls(
    "control",
    __package__,
    "controls",
    keys=tuple("name description digits program layout words motion forms extras lines cycles trusted".split()),
    unknown="CS210",
    unreadable="CS212",
    unknown_key="CS214",
    wrong_value="CS213",
)


control_names, control_aliases, find_control = _SHELF.names, _SHELF.aliases, _SHELF.find
control_table = _SHELF.built_in


def load_control(name_or_path: str | Path) -> Control:
    """Control of that name, or described by that TOML file.

    A text that ends in ``.toml`` or holds a path separator is a file; anything else is a name.

    Returns
    -------
    Control
        Its digits, blocks, words and forms.

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

    `file` is for messages, `name` for a text that has none. SettingsError: the text is not TOML, has an unknown key
    (with the closest known one), or does not describe a control.
    """
    with _SHELF.in_file(file):
        table, like = _SHELF.parse(text)
        digits = dict(_SHELF.table(table.get("digits", {}), "digits"))
        _SHELF.check_keys(digits, (*(item.name for item in fields(Digits)), "systems"), "digits.")
        systems = {}
        for system, entry in _SHELF.table(digits.pop("systems", {}), "digits.systems").items():
            where = f"digits.systems.{system}"  # with those of the table where it says nothing
            systems[system] = _SHELF.record(Digits, digits | _SHELF.table(entry, where), where)
        motion = table.get("motion", {})
        _SHELF.record(Motion, motion, "motion")
        rest = {key: value for key, value in table.items() if key != "motion"}
        return _SHELF.record(
            Control,
            {"name": name, "forms": {}} | rest | {"digits": digits},
            "",
            given={"like": like, "systems": systems, "own": True},
            words=_words,
            forms=lambda forms, where: _forms(forms, where, motion),
            trusted=partial(_trusted, dialect=like),
        )


def _words(table: Any, where: str) -> Words:
    def coolant(given: Any, place: str) -> dict[str, Blocks]:
        blocks = _SHELF.table(given, place).items()
        return {word.upper(): _SHELF.texts(entry, f"{place}.{word}") for word, entry in blocks}

    return _SHELF.record(Words, table, where, coolant=coolant, coolant_off=coolant)


def _forms(forms: Any, where: str, motion: Table) -> dict[str, FormTable]:
    if not _SHELF.table(forms, where):
        raise _SHELF.wrong("there are no forms", "write a table [forms.g1]")
    return {name: _form(name, entry, motion) for name, entry in forms.items()}


def _form(name: str, entry: Any, motion: Table) -> FormTable:
    where, orientations = f"forms.{name}", get_args(Orientation)
    _SHELF.check_keys(_SHELF.table(entry, where), _FORM_KEYS, f"{where}.")
    mode = partial(_mode, motion=motion)
    modes = {key: mode(entry[key], f"{where}.{key}") for key in orientations if key in entry}
    if entry.get("curve") and {"angles", "machine"} & modes.keys():
        raise _SHELF.wrong(f"{where} has curves in rotary words", "write lines: leave out curve, or angles and machine")
    for orientation, found in modes.items():
        wanted = {"vector": 3, "point": 3}.get(orientation, 0)
        if len(found.words) != wanted:
            raise _SHELF.wrong(f"{where}.{orientation} has {len(found.words)} words", f"give {wanted}")
    rest = {key: value for key, value in entry.items() if key not in orientations}
    form = _SHELF.record(FormTable, rest, where, given={"name": name, "modes": modes}, upright=mode, plane=mode)
    if not modes:
        raise _SHELF.wrong(f"{where} says no orientation", f"use one of {', '.join(orientations)}")
    return form


def _trusted(given: Any, where: str, dialect: str) -> frozenset[str]:
    """All machine functions that some patterns hold which a shop's own table declares not to move the tool."""
    found: set[str] = set()
    rows = table_of(dialect).listed if dialect in CONTROLS else ()

    def row_of(word: str) -> Row | None:
        return next((row for row in rows if row.pattern.fullmatch(word)), None)

    def wrong(why: object) -> SettingsError:
        return _SHELF.wrong(f"{where}: {why}", 'give machine functions, as in ["M208"]')

    any_function = row_of(f"M{_LARGEST}")
    for pattern in _SHELF.texts(given, where):
        try:
            check_pattern(pattern)
        except ValueError as error:
            raise wrong(error) from error
        own = {word for number in range(_LARGEST + 1) if re.fullmatch(pattern, word := f"M{number}")}
        if not pattern.startswith("M") or not own:
            raise wrong(f"{pattern!r} is no machine function: other words may move the tool")
        for word in sorted(own, key=lambda word: int(word[1:])):
            if _MOVING.fullmatch(word) or (dialect == "heidenhain" and _PATH_FUNCTIONS.fullmatch(word)):
                raise wrong(f"{pattern!r} holds {word}, which may move the tool")
            if _FIXED.fullmatch(word) or row_of(word) is not any_function:
                raise wrong(f"{pattern!r} holds {word}, which verification compares with the CL file")
        found |= own
    return frozenset(found)


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


#: names of what verification leaves to such a table, and the fields of `Words` that say it
_STATED: dict[tuple[str, ...], tuple[str, ...]] = {
    ("tool", "next tool"): ("tool_change", "tool_select"),
    ("spindle", "speed"): ("spindle_speed", "clockwise", "counterclockwise", "spindle_off", "spindle_orient"),
    ("coolant",): ("coolant",),
    ("dwell",): ("dwell",),
    ("stop",): ("stop", "optional_stop"),
    ("compensation", "register"): ("compensation_left", "compensation_right", "compensation_off"),
}
#: those of which only new blocks are the table's own: stops for a tool are named by the words of the tool
_TOOLS = (("tool", "next tool"), ("stop",))
#: blocks around the motion
_FRAME = ("start", "begin", "tool_end", "between_tools", "end", "retract", "work_offset_block")
FRAME = "program frame"  #: name of the frame of the program in what is left to a table


def own_words(table: Control) -> tuple[str, ...]:
    """Blocks and names that verification is to take on trust with a table; none with one that comes with the program.

    Those are the blocks that the table has and the one that it is like has not, their braces as they are; names of
    kinds of statements that it says in its own way, with all blocks of these; `FRAME` where it has its own blocks
    around the motion.
    """
    if not table.own:
        return ()
    base = load_control(table.dialect)
    known, names = set(_blocks(base)), list[str]()
    blocks = [block for block in _blocks(table) if block not in known and not re.fullmatch(r"\{\w+\}", block)]
    for kinds, words in _STATED.items():
        if any(getattr(table.words, name) != getattr(base.words, name) for name in words):
            names += kinds
            blocks += [block for name in words if kinds not in _TOOLS for block in _of_field(table, name)]
    modes = [  # of the forms that both tables have
        (form.modes[turn], base.forms[name].modes[turn])
        for name, form in sorted(table.forms.items())
        if name in base.forms
        for turn in sorted(form.modes.keys() & base.forms[name].modes.keys())
    ]
    if any(own.on != other.on for own, other in modes):
        names.append("offset")
        blocks += [block for own, _ in modes for block in own.on]
    if table.program.end != base.program.end:
        names.append("end")
    framed = any(getattr(table.program, name) != getattr(base.program, name) for name in _FRAME)
    around = ("off", "within_on", "within_off", "begin")
    framed |= any(getattr(own, name) != getattr(other, name) for own, other in modes for name in around)
    return (*dict.fromkeys(blocks), *dict.fromkeys(names), *((FRAME,) if framed else ()))


def _blocks(table: Control) -> Iterator[str]:
    """All blocks of a table; the direction of the spindle and the units put in."""
    for block in _texts([getattr(table.program, name) for name in _FRAME]):
        yield from (block.replace("{units}", units) for units in table.layout.units.values())
    for item in fields(table.words):
        yield from _of_field(table, item.name)
    for form in table.forms.values():
        for mode in filter(None, (*form.modes.values(), form.upright, form.plane)):
            yield from _texts([mode.on, mode.off, mode.within_on, mode.within_off, mode.begin, mode.tool_end])
    yield from _texts([(extra.on, extra.off) for extra in table.extras.values()])


def _of_field(table: Control, name: str) -> Iterator[str]:
    """Blocks of a field of `Words`."""
    words = table.words
    for block in _texts(getattr(words, name)):
        yield from (block.replace("{direction}", turn) for turn in (words.clockwise, words.counterclockwise))


def _texts(value: object) -> Iterator[str]:
    """All texts of a value, of lists and tables in it."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | Sequence):
        for each in value.values() if isinstance(value, Mapping) else value:
            yield from _texts(each)
