"""What the words of a program do to what a control remembers, for each control: the tables of ``words.toml``.

A word that is not there is let through. What it may have changed counts as unknown until the program says it again.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from importlib import resources
from typing import Any, Final


class Does(StrEnum):
    """What a word does; of several the first counts."""

    ALL = "all"  #: it may have changed anything
    LEVEL = "level"  #: ends a `FRAME`
    NOTHING = "nothing"  #: nothing that bears on the motion
    DWELL = "dwell"  #: the other words of the block are its own: a time, not a place or a feed
    PLACE = "place"  #: the machine may be anywhere after it; places in its block are not those of the part
    MACHINE = "machine"  #: the axes of its block go to places of the machine, all axes where it names none
    MOVE = "move"  #: moves by a law that is not known here, and does so again in the blocks after it
    LENGTH = "length"  #: X Y Z count anew, those of its block already
    OFFSET = "offset"  #: the same for all axes
    CHANGE = "change"  #: another tool
    FRAME = "frame"  #: turns, scales or mirrors the places of the part


#: kinds of tool tip control: which words the tool axis may have under it
ANGLES, VECTOR, BOTH, NONE = "rotary words", "tool vectors", "rotary words and tool vectors", ""
#: what a tool that never turns asks for
ANY: Final = "any"

_KINDS: Final = {"angles": ANGLES, "vector": VECTOR, "both": BOTH, "": NONE}


@dataclass(frozen=True)
class Vocabulary:
    """What a control's words do; its fields are explained in ``words.toml``."""

    table: tuple[tuple[Does, str], ...]
    tip_control: Mapping[str, str]
    ends_frame: Mapping[str, str]
    offsets: str
    change_keeps_tip: bool

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Vocabulary:
        """Make the vocabulary of a table."""
        patterns = ((does, given.get(does, ())) for does in Does)
        return cls(
            tuple((does, one if isinstance(one, str) else "|".join(one)) for does, one in patterns if one),
            {word: _KINDS[kind] for word, kind in given["tip"].items()},
            given.get("ends", {}),
            given["offsets"],
            given.get("change_keeps_tip", False),
        )

    def does(self, word: str) -> Does:
        """Say what a word such as ``G43.4`` does; words of group 01, of units, distances and feeds are not here."""
        return _does(self.table, word)


@lru_cache(maxsize=4096)
def _does(table: tuple[tuple[Does, str], ...], word: str) -> Does:
    for does, pattern in table:
        if re.fullmatch(pattern, word):
            return does
    return Does.PLACE if word.startswith("M") else Does.ALL


def _vocabularies() -> dict[str, Vocabulary]:
    tables = tomllib.loads((resources.files("cornersmooth.filter") / "words.toml").read_text(encoding="utf-8"))
    for name, table in tables.items():  # what one is like comes before it
        tables[name] = tables.get(table.get("like", ""), {}) | table
    return {name: Vocabulary.of(table) for name, table in tables.items() if "tip" in table}


VOCABULARIES: Final[Mapping[str, Vocabulary]] = _vocabularies()

#: what sends a control to other lines of the program; the numbers after it may be those of the lines
JUMPS: Final = re.compile(rb"(?i)(?:GOTO[BFCS]?|M9[6-9]|M198|G6[56]|THEN|REPEATB?|CALL|UNTIL)[^\n]*")
#: one of these is in every such line
JUMP_SIGNS: Final = (b"GOTO", b"M9", b"M198", b"G6", b"THEN", b"REPEAT", b"CALL", b"UNTIL")
#: a jump to a line that the program works out
COMPUTED: Final = re.compile(rb"(?i)GOTO[BFCS]?\s*[^\d\s]|M9[6-9][^\n]*P\s*[#\[]")
