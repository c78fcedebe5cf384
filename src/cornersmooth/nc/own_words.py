"""What a control table of the user's own adds to the words of the control that it is like."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields

from cornersmooth.nc.control import Control, Mode
from cornersmooth.nc.control_tables import load_control

#: names of what verification leaves to such a table, by the fields of `Words` that say it
_KINDS: dict[str, tuple[str, ...]] = {
    "tool_change": ("tool", "next tool"),
    "tool_select": ("next tool",),
    "spindle_speed": ("spindle", "speed"),
    "clockwise": ("spindle",),
    "counterclockwise": ("spindle",),
    "spindle_off": ("spindle",),
    "spindle_orient": ("spindle",),
    "coolant": ("coolant",),
    "dwell": ("dwell",),
    "stop": ("stop",),
    "optional_stop": ("stop",),
    "compensation_left": ("compensation", "register"),
    "compensation_right": ("compensation", "register"),
    "compensation_off": ("compensation",),
}

#: fields of which only new blocks are the table's own: stops for a tool are named by the words of the tool
_TOOLS = {"tool_change", "tool_select", "stop", "optional_stop"}

#: blocks around the motion
_FRAME = ("start", "begin", "tool_end", "between_tools", "end", "retract", "work_offset_block")

#: name of the frame of the program in what is left to a table
FRAME = "program frame"


def own_words(table: Control) -> tuple[str, ...]:
    """Blocks and names that verification is to take on trust with a table; none with one that comes with the program.

    Those are the blocks that the table has and the one that it is like has not, their braces as they are; names of
    kinds of statements that it says in its own way, with all blocks of these; `FRAME` where it has its own blocks
    around the motion.
    """
    if not table.own:
        return ()
    base = load_control(table.dialect)
    known = set(_blocks(base))
    blocks = [block for block in _blocks(table) if block not in known and not re.fullmatch(r"\{\w+\}", block)]
    changed = {name for name in _KINDS if getattr(table.words, name) != getattr(base.words, name)}
    for _ in _KINDS:  # one field may say several kinds, and several fields one
        stated = {kind for name in changed for kind in _KINDS[name]}
        changed |= {name for name, own in _KINDS.items() if stated & set(own)}
    names = [kind for name in _KINDS if name in changed for kind in _KINDS[name]]
    blocks += [block for name in _KINDS if name in changed - _TOOLS for block in _of_field(table, name)]
    own_modes, base_modes = _modes(table, base), _modes(base, table)
    if [mode.on for mode in own_modes] != [mode.on for mode in base_modes]:
        names.append("offset")
        blocks += [block for mode in own_modes for block in mode.on]
    if table.program.end != base.program.end:
        names.append("end")
    framed = any(getattr(table.program, name) != getattr(base.program, name) for name in _FRAME)
    framed |= _around(own_modes) != _around(base_modes)
    return (*dict.fromkeys(blocks), *dict.fromkeys(names), *((FRAME,) if framed else ()))


def _modes(table: Control, other: Control) -> list[Mode]:
    """Modes of the forms that both tables have."""
    return [
        mode
        for name, form in sorted(table.forms.items())
        if name in other.forms
        for turn, mode in sorted(form.modes.items())
        if turn in other.forms[name].modes
    ]


def _around(modes: list[Mode]) -> list[tuple[object, ...]]:
    return [(mode.off, mode.within_on, mode.within_off, mode.begin) for mode in modes]


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
