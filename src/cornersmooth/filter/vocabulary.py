"""What the words of a program do to what a control remembers, for each control: as much as a filter has to know.

A word that is not here is let through. What it may have changed counts as unknown until the program says it again.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from functools import lru_cache
from typing import Final


class Does(StrEnum):
    """What a word does.

    Attributes
    ----------
    NOTHING
        Nothing that bears on the motion.
    DWELL
        The other words of the block are its own: a time, not a place or a feed.
    PLACE
        The machine may be anywhere after it; places in its block are not those of the part.
    MACHINE
        The axes of its block go to places of the machine, all axes where it names none.
    MOVE
        It moves by a law that is not known here, and does so again in the blocks after it.
    LENGTH
        X Y Z count anew, those of its block already.
    OFFSET
        The same for all axes.
    CHANGE
        Another tool.
    FRAME, LEVEL
        Turns, scales or mirrors the places of the part; and ends that.
    ALL
        It may have changed anything.
    """

    NOTHING = "nothing"
    DWELL = "dwell"
    PLACE = "place"
    MACHINE = "machine"
    MOVE = "move"
    LENGTH = "length"
    OFFSET = "offset"
    CHANGE = "change"
    FRAME = "frame"
    LEVEL = "level"
    ALL = "all"


#: kinds of tool tip control: which words the tool axis may have under it
ANGLES, VECTOR, BOTH, NONE = "rotary words", "tool vectors", "rotary words and tool vectors", ""
#: what a tool that never turns asks for
ANY: Final = "any"

Table = Mapping[Does, str]

_ISO: Final[Table] = {
    Does.NOTHING: r"G(9|1[789]|61(\.1)?|64|80|9[6789]|40)|M([0134579]|[78]|1[0-3]|19|29|4[89]|8[89])",
    Does.DWELL: r"G4",
    Does.PLACE: r"G(10|11|31|52|53\.\d|92(\.\d)?|38\.\d)",
    Does.MACHINE: r"G(28|30|53|28\.1|30\.1)",
    Does.MOVE: r"G(5(\.[23])?|6\.2|1[23]|3[2346](\.\d)?|7[0-46]|8[1-9]|150)",
    Does.LENGTH: r"G(43(\.[1245])?|44|49|234)",
    Does.CHANGE: r"M6",
}

_FANUC: Final[Table] = {
    **_ISO,
    Does.NOTHING: _ISO[Does.NOTHING] + r"|G(5|5\.[14]|8)",
    Does.FRAME: r"G(68(\.[234])?|51(\.1)?|16|12\.1|66(\.1)?|54\.[24])",
    Does.LEVEL: r"G(69|50(\.1)?|15|13\.1|67)",
}


@dataclass(frozen=True)
class Vocabulary:
    """What a control's words do.

    Parameters
    ----------
    table : mapping of Does to str
        Regular expression of the words that do it. What none of them knows does `Does.ALL`; an M word loses the place.
    tip_control : mapping of str to str
        Kind of tool tip control that a word switches on; `NONE` for words that switch it off.
    ends_frame : mapping of str to str
        Which word of `Does.FRAME` a word of `Does.LEVEL` ends; all of them where it is not named.
    offsets : str
        Regular expression of work offsets.
    change_keeps_tip : bool
        Whether tool tip control outlives a change of tool.
    """

    table: Table
    tip_control: Mapping[str, str] = field(default_factory=dict)
    ends_frame: Mapping[str, str] = field(default_factory=dict)
    offsets: str = r"G(5[4-9]|54\.1|59\.[1-3]|154)"
    change_keeps_tip: bool = False

    def does(self, word: str) -> Does:
        """Say what a word such as ``G43.4`` does; words of group 01, of units, distances and feeds are not here."""
        return _does(tuple(self.table.items()), word)


@lru_cache(maxsize=4096)
def _does(table: tuple[tuple[Does, str], ...], word: str) -> Does:
    for does, pattern in table:
        if re.fullmatch(pattern, word):
            return does
    return Does.PLACE if word.startswith("M") else Does.ALL


_ENDS: Final = {"G69": r"G68.*", "G50": "G51", "G50.1": r"G51\.1", "G15": "G16", "G13.1": r"G12\.1", "G67": "G66.*"}
_TIP: Final = {"G43.4": ANGLES, "G43.5": VECTOR, "G43": NONE, "G44": NONE, "G49": NONE}
#: M words after which another program, or another part of this one, may have run
_CALLS: Final = r"M(2|30|60|7[0-3]|9[6-9]|17|198)"

_SIEMENS: Final[Table] = {
    Does.NOTHING: (
        r"G(9|1[789]|40|6[04]|60[123]|64[1-5]|9[67]|45[01])|M([0134579]|[78]|1[0-3]|19|4[0-5])"
        r"|CYCLE832|ORI(WKS|MKS|VECT|AXES|PLANE)|FFWO[NF]|SOFT|BRISK|STOPRE|MSG|CFTCP|CFIN|CFC|COMP(CAD|CURV|ON|OF)"
        r"|CD(ON|OF2?)|UPATH|SPATH|DYN(NORM|POS|ROUGH|SEMIFIN|FINISH)|RTLI(ON|OF)|FIFOCTRL|WALIM(ON|OF)|FGROUP|SPOS|S|H"
    ),
    Does.DWELL: r"G4",
    Does.PLACE: r"A?TRANS|=|G(58|59)",
    Does.MACHINE: r"SUPA|G53|G153|G7[45]",
    Does.MOVE: r"CYCLE8[1-9]|POCKET\d|HOLES\d|BSPLINE|POLY|ASPLINE|CSPLINE|ORICURVE|G33",
    Does.LENGTH: r"D|T",
    Does.CHANGE: r"M6",
    Does.FRAME: r"A?ROTS?|A?SCALE|A?MIRROR|CYCLE800|TOFRAME|TOROT\w*",
    Does.LEVEL: r"CYCLE800\(\)|ROT0",
}

#: whole blocks of Klartext, and its M words
_KLARTEXT: Final[Table] = {
    Does.NOTHING: (
        r"BLK FORM.*|\*.*|CYCL DEF (32|9)\.\d.*|STOP.*|TOOL DEF.*|TOOL CALL( Z)?( S\S+)?( F\S+)?|CC.*"
        r"|M([01345789]|1[34]|12[67])"
    ),
    Does.PLACE: r"(FN ?[0-8] ?:|Q[LRS]?\d+ ?=).*|CYCL DEF (247|7\.).*|TRANS DATUM.*|M9[129]|CYCL CALL.*",
    Does.MOVE: r"(RND|CHF|CT|LP|CP|CTP|APPR|DEP|POLY|SPL)\b.*",
    Does.CHANGE: r"TOOL CALL \S.*",
    Does.FRAME: r"PLANE .*|CYCL DEF (8|10|11|19|26)\..*",
    Does.LEVEL: r"PLANE RESET.*",
}

_FANUC_WORDS: Final = Vocabulary({Does.ALL: _CALLS, **_FANUC}, _TIP, _ENDS)

VOCABULARIES: Final[Mapping[str, Vocabulary]] = {
    "fanuc": _FANUC_WORDS,
    "mitsubishi": _FANUC_WORDS,
    "haas": Vocabulary(
        {
            Does.ALL: _CALLS,
            **_FANUC,
            Does.NOTHING: _ISO[Does.NOTHING] + "|G187",
            Does.FRAME: r"G(68(\.[234])?|51|66|254)",
            Does.LEVEL: r"G(69|50|67|255)",
        },
        {"G234": ANGLES, "G43": NONE, "G44": NONE, "G49": NONE, "M6": NONE},
        {"G69": r"G68.*", "G50": "G51", "G67": "G66", "G255": "G254"},
    ),
    "linuxcnc": Vocabulary(
        {Does.ALL: _CALLS, **_ISO, Does.FRAME: r"G(68|51|16)", Does.LEVEL: r"G(69|50|15)"},
        {"M428": ANGLES, "M429": NONE, "M430": NONE, "G12.1": ANGLES, "G13.1": NONE},
        change_keeps_tip=True,
    ),
    "siemens": Vocabulary(
        {Does.ALL: r"M(2|30|17|9[6-9])", Does.LEVEL: _SIEMENS[Does.LEVEL], **_SIEMENS},
        {"TRAORI": BOTH, "TRAFOOF": NONE},
        {"CYCLE800()": "CYCLE800", "ROT0": r"A?(ROTS?|SCALE|MIRROR)"},
        r"G(5[4-7]|50[0-9]|5[1-9]\d)",
    ),
    "heidenhain": Vocabulary(
        {Does.ALL: r"M(2|30|99)|FN ?(9|1\d).*", Does.LEVEL: _KLARTEXT[Does.LEVEL], **_KLARTEXT},
        {"M128": BOTH, "M129": NONE},
        {"PLANE RESET": "PLANE.*"},
    ),
}

#: what sends a control to other lines of the program; the numbers after it may be those of the lines
JUMPS: Final = re.compile(rb"(?i)(?:GOTO[BFCS]?|M9[6-9]|M198|G6[56]|THEN|REPEATB?|CALL|UNTIL)[^\n]*")
#: one of these is in every such line
JUMP_SIGNS: Final = (b"GOTO", b"M9", b"M198", b"G6", b"THEN", b"REPEAT", b"CALL", b"UNTIL")
#: a jump to a line that the program works out
COMPUTED: Final = re.compile(rb"(?i)GOTO[BFCS]?\s*[^\d\s]|M9[6-9][^\n]*P\s*[#\[]")
