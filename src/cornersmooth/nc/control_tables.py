"""Controls as TOML tables: those that come with the program, and the user's own.

A table may say ``like = "fanuc"`` and then only what is different, ``false`` for a form or mode that it has not; the
keys are those of the tables in the folder ``controls``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import lru_cache, partial
from itertools import product
from pathlib import Path
from typing import Any, get_args

from cornersmooth.control.table import Row, table_of
from cornersmooth.nc.control import STEPS, Blocks, Control, Digits, FormTable, Motion, Orientation, Words
from cornersmooth.nc_reader import CONTROLS
from cornersmooth.tables import Shelf, Table, filled, is_file

#: modes of a form, and how many words of the tool axis they have
_MODES = dict.fromkeys((*get_args(Orientation), "upright", "plane"), 0) | {"vector": 3, "point": 3}
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
#: functions that mean the same on every machine (ISO 6983-1; M17 ends a subprogram), that move the tool, change what
#: coordinates mean, or jump to other blocks; and path functions of Klartext
_FIXED, _PATH_FUNCTIONS = r"M(\d|17|19|30|9[6-9]|198|428|429|430)", r"M(89|9\d|1[0-4]\d)"


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
    Path(__file__).with_name("controls"),
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
        motion = table.pop("motion", {})
        _SHELF.record(Motion, motion, "motion")
        return _SHELF.record(
            Control,
            {"name": name, "forms": {}} | table | {"digits": digits},
            "",
            given={"like": like, "systems": systems, "own": True},
            words=partial(_SHELF.record, Words, coolant=_coolant, coolant_off=_coolant),
            forms=partial(_forms, motion=motion),
            trusted=partial(_trusted, dialect=like),
        )


def _coolant(given: Any, where: str) -> dict[str, Blocks]:
    blocks = _SHELF.table(given, where).items()
    return {word.upper(): _SHELF.texts(entry, f"{where}.{word}") for word, entry in blocks}


def _forms(forms: Any, where: str, motion: Table) -> dict[str, FormTable]:
    """Forms whose modes have the motion of the control, but for what they say themselves."""
    found = {}
    for name, entry in _SHELF.table(forms, where).items():
        place, form = f"{where}.{name}", dict(_SHELF.table(entry, f"{where}.{name}"))
        for key in form.keys() & _MODES.keys():
            form[key] = motion | _SHELF.table(form[key], f"{place}.{key}")
        found[name] = _SHELF.record(FormTable, form, place, given={"name": name})
        if not found[name].modes:
            raise _SHELF.wrong(f"{place} says no orientation", f"use one of {', '.join(get_args(Orientation))}")
        if found[name].curve and {"angles", "machine"} & form.keys():
            raise _SHELF.wrong(
                f"{place} has curves in rotary words", "write lines: leave out curve, or angles and machine"
            )
        for key, mode in found[name].modes.items():
            if len(mode.words) != _MODES[key]:
                raise _SHELF.wrong(f"{place}.{key} has {len(mode.words)} words", f"give {_MODES[key]}")
        plane = found[name].plane
        if plane and plane.rotations and not re.fullmatch(r"(?!(.)\1)[xyz][xy][xyz]", plane.rotations):
            what = f"{place}.plane.rotations is {plane.rotations!r}"
            raise _SHELF.wrong(what, "give three axes, as in zxz; the second is not z")
    if not found:
        raise _SHELF.wrong("there are no forms", "write a table [forms.g1]")
    return found


def _trusted(given: Any, where: str, dialect: str) -> frozenset[str]:
    """Machine functions that a shop's own table declares not to move the tool."""
    rows = table_of(dialect).listed if dialect in CONTROLS else ()
    known = f"{_FIXED}|{_PATH_FUNCTIONS}" if dialect == "heidenhain" else _FIXED

    def row_of(word: str) -> Row | None:
        return next((row for row in rows if row.pattern.fullmatch(word)), None)

    found = _SHELF.texts(given, where)
    for word in found:
        other = row_of(word) is row_of("M9999")
        if not other or re.fullmatch(known, word) or not re.fullmatch(r"M[1-9]\d{0,3}", word):
            why = "is no function of the shop alone: it may move the tool, or verification compares it"
            raise _SHELF.wrong(f"{where}: {word!r} {why}", 'give machine functions, as in ["M208"]')
    return frozenset(found)


#: names of what is left to a table: the frame of the program, and whether F of a helix counts in its plane alone
FRAME, HELICES = "program frame", "feed of helices"
#: names of what verification leaves to a table that says it in its own way, and the blocks that say it, as `_blocks`
#: names them
_STATED: dict[tuple[str, ...], str] = {
    ("tool", "next tool"): r"words\.tool_(change|select)",
    ("spindle", "speed"): r"words\.(spindle_\w+|clockwise|counterclockwise)",
    ("coolant",): r"words\.coolant",
    ("dwell",): r"words\.dwell",
    ("stop",): r"words\.(optional_)?stop",
    ("compensation", "register"): r"words\.compensation_(left|right|off)",
    ("offset",): r"modes\..*\.on",
    ("end",): r"program\.end",
    (FRAME,): r"program\..*|modes\..*\.(off|within_on|within_off|begin)",
}
#: those of which only new blocks are the table's own: stops for a tool are named by the words of the tool
_NEW_ALONE = (("tool", "next tool"), ("stop",), ("end",), (FRAME,))


def own_words(table: Control) -> tuple[str, ...]:
    """Blocks and names that verification is to take on trust with a table; none with one that comes with the program.

    Those are the blocks that the table has and the one that it is like has not, their braces as they are; names of
    kinds of statements that it says in its own way, with all blocks of these; `FRAME` where it has its own blocks
    around the motion; `HELICES` where F of a helix does not count in its plane, as the control's does.
    """
    if not table.own:
        return ()
    own, base = _blocks(table), _blocks(load_control(table.dialect))
    known, names = {block for some in base.values() for block in some}, list[str]()
    blocks = [block for some in own.values() for block in some if block not in known]
    for kinds, pattern in _STATED.items():
        both = [key for key in own if key in base and re.fullmatch(pattern, key)]
        if any(own[key] != base[key] for key in both):
            names += kinds
            blocks += [block for key in both if kinds not in _NEW_ALONE for block in own[key]]
    if _feed_in_plane(load_control(table.dialect)) and not _feed_in_plane(table):
        names.append(HELICES)
    return (*dict.fromkeys(block for block in blocks if not re.fullmatch(r"\{\w+\}", block)), *dict.fromkeys(names))


def _feed_in_plane(table: Control) -> bool:
    return any(mode.feed_in_plane for form in table.forms.values() for mode in form.modes.values())


def _blocks(table: Control) -> dict[str, Blocks]:
    """Blocks of a table by their place; the direction of the spindle and the units put in."""
    words, units = table.words, tuple(table.layout.units.values())
    found = {
        f"program.{name}": _put("{units}", units, getattr(table.program, name))
        for name in ("start", "begin", "tool_end", "between_tools", "end", "retract", "work_offset_block")
    }
    for item in fields(words):
        turns = (words.clockwise, words.counterclockwise)
        found[f"words.{item.name}"] = _put("{direction}", turns, _texts(getattr(words, item.name)))
    for form, turn in product(table.forms.values(), _MODES):
        if mode := getattr(form, turn):
            for name in ("on", "off", "within_on", "within_off", "begin", "tool_end"):
                blocks = getattr(mode, name)  # None is what the program says
                kind = "others" if turn in ("upright", "plane") else "modes"
                found[f"{kind}.{form.name}.{turn}.{name}"] = (f"{{{name}}}",) if blocks is None else blocks
    found["extras"] = tuple(block for extra in table.extras.values() for block in (*extra.on, *extra.off))
    return found


def _put(brace: str, values: Blocks, blocks: Iterable[str]) -> Blocks:
    """Blocks with each of some values in place of a brace."""
    return tuple(block.replace(brace, value) for block in blocks for value in (values if brace in block else ("",)))


def _texts(value: object) -> Iterator[str]:
    """All texts of a value, of lists and tables in it."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, Mapping | Sequence):
        for each in value.values() if isinstance(value, Mapping) else value:
            yield from _texts(each)
