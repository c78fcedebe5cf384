"""What each word of a control does to what the control remembers: a row a word.

The rows are `[words]` and `[does]` of the control's table in ``nc_reader/word_lists``: words that verification accepts,
and others. A row begins with ``"WORDS" = "EFFECTS: LETTERS"``; what comes behind it, `nc_words.rules` explains::

    "G44" = "tip=off axis: H"

WORDS
    Words with `` | `` between them, as the control's lexer names them: ``G1``, ``M6``, ``T``, ``TRAORI``, a whole block
    of Klartext. ``PLANE *`` stands for all that begin so, ``/.../`` for all that a regular expression matches. Words
    that are named themselves come first, then rows in order. ``ROT alone`` is a word that has no other beside it,
    ``G10 R`` one that has that letter, ``G54.2 P0`` that word.
EFFECTS
    ``GROUP=VALUE`` sets a modal group. The value ``.`` is the word itself, ``?`` is not known. All others: `LOSES`.
LETTERS
    What belongs to the word in its block, and so is no place and no feed.

A control that is ``like`` another has its rows, too, behind its own; ``""`` takes one back. Words of spindle, coolant,
stops, registers and the end are in `[means]`. A word without a row may do anything.

What a change of a group does beside is the same for all controls, and is in `state`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property, lru_cache
from itertools import chain
from typing import Final

from cornersmooth.nc_reader.word_tables import means_of, word_table

#: groups of words that turn, scale or mirror the places of the part begin so
FRAME: Final = "frame."

#: modal groups beside those of frames, and the values of those that somebody reads; none where it is any word
GROUPS: Final[Mapping[str, str]] = {
    "motion": "rapid line arc",
    "distance": "absolute incremental",
    "units": "mm inch",
    "feed": "minute inverse revolution",
    "tip": "off angles vectors both",
    "compensation": "off on",
    **dict.fromkeys(("offset", "path", "plane", "spindle", "coolant", "orientation", "coordinates", "way"), ""),
}

#: what each effect leaves unknown
LOSES: Final[Mapping[str, str]] = {
    "nothing": "",
    "dwell": "",  # and the other words of the block are no motion
    "stop": "whether spindle and coolant are on: most machines stop them with the program",
    "axis": "as `length`, along the axis of the tool alone where the plane says which that is",
    "length": "XYZ count anew, those of the block already",
    "shift": "all axes count anew, those of the block already",
    "place": "the machine may be anywhere; places of the block are not those of the part",
    "machine": "the axes of the block go to places of the machine, all axes where it names none",
    "tool": "as `place`, and whether tip control is still on",
    "anything": "all, but for frames that the program does not name: jumps and calls leave these as they are",
    "unknown": "all",
}

#: what a word of `[means]` does by its kind, where it is not the group of the kind
_OF_KIND: Final = {"stop": "stop", "end": "anything", "register": "length", "offset": "length"}
_COMPENSATION: Final = {"OFF": "off", "LEFT": "on", "RIGHT": "on"}

_REMEMBERED: Final = 4096


@dataclass(frozen=True)
class Row:
    """What a word does."""

    sets: tuple[tuple[str, str | None], ...] = ()  #: groups and their values; None where it is not known which
    does: frozenset[str] = frozenset()  #: of `LOSES`
    beside: frozenset[str] = frozenset()  #: letters of words of its own

    @classmethod
    @lru_cache(_REMEMBERED)
    def of(cls, word: str, text: str) -> Row:
        """Take a row of the table apart; ValueError where it is none."""
        effects, _, beside = text.partition(":")
        sets, does = [], set()
        for effect in effects.split():
            group, given, value = effect.partition("=")
            if given and _is_value(group, value):
                sets.append((group, None if value == "?" else word if value == "." else value))
            elif effect in LOSES:
                does.add(effect)
            else:
                raise ValueError(
                    f"{word!r} does {effect!r}: not one of {', '.join(LOSES)}, and no group with its value"
                )
        return cls(tuple(sets), frozenset(does), frozenset(beside.split()))


def _is_value(group: str, value: str) -> bool:
    """Whether a group may have a value."""
    return group.startswith(FRAME) or (
        group in GROUPS and (not GROUPS[group] or value in (*GROUPS[group].split(), "?"))
    )


#: what a word without a row does
UNKNOWN: Final = Row(does=frozenset(("unknown",)))


@dataclass(frozen=True)
class Table:
    """The rows of a control."""

    control: str
    named: Mapping[str, str]  #: effects of words by their names
    patterns: tuple[tuple[re.Pattern[str], str], ...]  #: of words by a pattern, in order
    groups: tuple[str, ...]  #: all that are set by a word
    #: letters that belong to a motion while it holds
    arguments: Mapping[str, frozenset[str]]

    def row(self, name: str, beside: Mapping[str, float] | None = None, *, alone: bool = False) -> Row:
        """What a word does in a block with some letters and their numbers; `alone` where it has no other word."""
        numbers = (beside or {}).items()
        others = (
            (f"{name} {letter}{value:g}" for letter, value in numbers),
            (f"{name} {letter}" for letter, _ in numbers),
        )
        for key in chain((f"{name} alone",) * alone, *others) if name in self._with_others else ():
            if key in self.named:
                return Row.of(name, self.named[key])
        if name in self.named:
            return Row.of(name, self.named[name])
        found = (text for pattern, text in self.patterns if pattern.fullmatch(name))
        text = next(found, None)
        return UNKNOWN if text is None else Row.of(name, text)

    @cached_property
    def _with_others(self) -> frozenset[str]:
        """Words that rows name beside others."""
        return frozenset(name.split(" ")[0] for name in self.named if " " in name)

    @cached_property
    def frame_words(self) -> Mapping[str, re.Pattern[str]]:
        """What stands in each line that names a frame, in capitals, by its group."""
        parts: dict[str, list[str]] = {}
        rows = [(_sign(name.split(" ")[0].removesuffix("()")), text) for name, text in self.named.items()]
        for sign, text in (*rows, *((pattern.pattern, text) for pattern, text in self.patterns)):
            for group, _ in Row.of("", text).sets:
                if group.startswith(FRAME):
                    parts.setdefault(group, []).append(sign)
        return {group: re.compile("|".join(signs)) for group, signs in parts.items()}


def _sign(name: str) -> str:
    """Pattern of a word in a line, however it is spelt."""
    number = re.fullmatch(r"([GM])([\d.]+)", name)
    return rf"{number[1]}[ \t]*0*{re.escape(number[2])}(?![\d.]*[1-9])" if number else re.escape(name)


@cache
def table_of(control: str) -> Table:
    """The table of a control, one of `CONTROLS`."""
    named: dict[str, str] = {}
    patterns = []
    for word, text in word_table(control)["does"].items():
        if not text:
            continue
        if word.startswith("/") and word.endswith("/"):
            patterns.append((re.compile(word[1:-1]), text))
        elif word.endswith("*"):
            patterns.append((re.compile(re.escape(word[:-1]) + ".*"), text))
        else:
            named[word] = text
    named |= {word: _of_means(*meaning) for word, meaning in means_of(control).items()}
    rows = [Row.of("", text) for text in (*named.values(), *(text for _, text in patterns))]
    arguments: dict[str, frozenset[str]] = {}
    for row in rows:
        for group, value in row.sets:
            if group == "motion" and value is not None:
                arguments[value] = arguments.get(value, frozenset()) | row.beside
    groups = sorted({group for row in rows for group, _ in row.sets})
    return Table(control, named, tuple(patterns), tuple(groups), arguments)


def _of_means(kind: str, value: str) -> str:
    """Effects of a word that `[means]` has."""
    if kind == "compensation":
        return f"compensation={_COMPENSATION[value]}"
    return _OF_KIND.get(kind, f"{kind}={value}")
