"""Lines that are not made of words alone: variables, jumps, paths of a kind that is not known."""

from __future__ import annotations

import math
import re
from typing import Final

from cornersmooth.control.lexer import Lexer
from cornersmooth.control.state import CUTS, State
from cornersmooth.control.table import UNKNOWN
from cornersmooth.control.words import Line, Word
from cornersmooth.errors import InputError

#: a value for a variable, which is no axis and no word of its own
_ASSIGNMENT: Final = re.compile(r"(#|Q[LRS]?\d+\s*=|(R\d*|[A-Z_]{2,}\w*)(\[[^]]*\])?\s*=(?!=)|DEF\s|FN ?[0-8] ?:)")
#: what a value is made of, and a word that stands beside it
_IN_VALUE: Final = re.compile(r"\[[^][]*\]|\([^()]*\)|\"[^\"]*\"|<[^>]*>|[RQ][LRS]?\d+|[A-Z_]{2,}\w*")
_WORD_BESIDE: Final = re.compile(r"[A-Z]\s*[-+.\d#\[=]")
#: a word whose number is worked out by the control
_WORKED_OUT: Final = re.compile(
    r"([A-Z]+\d*)\s*=?\s*[-+]?(?:#(?:<[^>]*>|\d+|\[[^]]*\])|\[[^]]*\]|Q[LRS]?\d+|"
    r"(?<==)\"[^\"]*\"|(?<==)(?:AC|IC|DC|ACP|ACN)\([^()]*\)|(?<==)[A-Z_$][^\s]*)"
)
#: a chamfer or a round corner at the end of a block: it changes neither groups nor the end of the next block
_CORNER: Final = re.compile(r",\s*[RC]\s*[\d.]+")
#: words that change no group, whatever their number
_NUMBERS: Final = frozenset("XYZABCFSQRP")
#: jumps, loops and labels, which are no words
_FLOW: Final = re.compile(r"(IF|ELSE|WHILE|DO|END|GOTO|FOR|LOOP|REPEAT|UNTIL|CASE|O\s*[\d<])|[A-Z_]\w*:")
_HEAD: Final = re.compile(r"/?\d?\s*(N?\d+\s+|N\d+)?\s*")
_KLARTEXT_PATH: Final = re.compile(r"LN? ")
_KLARTEXT_WORDS: Final = re.compile(r"\b(?:M\d+|R[0LR])\b")


def _execute_unread(state: State, text: bytes, lexer: Lexer) -> str:
    """Execute a line that the lexer does not know; say why it cuts in a way that is not known, else nothing."""
    plain = lexer.comment.sub(" ", text.upper().decode("latin-1")).strip()
    skipped, plain = plain.startswith("/"), _HEAD.sub("", plain, count=1)
    before = state.copy()
    why = _execute(state, plain, lexer)
    if skipped:  # the operator chooses
        state.or_not(before)
    return why


def _execute(state: State, plain: str, lexer: Lexer) -> str:
    if _ASSIGNMENT.match(plain) and "FRAME" not in plain and not _word_beside(plain):
        state.lose_place()
        return ""
    lost = {match[1] for match in _WORKED_OUT.finditer(plain)}
    try:
        bare = _CORNER.sub(" ", _WORKED_OUT.sub(" ", plain))
        line = lexer.line(bare.encode("latin-1"), 0, None) if bare != plain else None
    except InputError:
        line = None
    if line is None and state.table.row(plain) is not UNKNOWN:
        line = Line(0, (Word("block", 0.0, plain),))
    elif line is None and _KLARTEXT_PATH.match(plain) and "RAPID" in state.table.named:
        for word in _KLARTEXT_WORDS.findall(plain):
            state.execute(lexer.line(f"L {word}".encode(), 0, None))
        state.lose_place()
        state.groups["motion"], state.feed = None, math.nan
        return "words that are not known"
    if line is None or {"G", "M"} & lost or (lost and line.words and line.words[0].name == "block"):
        state.lose_all(frames=not _FLOW.match(plain))
        return ""
    state.execute(line)
    state.lose_place(None if lost - _NUMBERS - {*state.axes} else lost)
    if "F" in lost:
        state.feed = math.nan
    return "words that the control works out" if state.groups["motion"] in CUTS else ""


def _word_beside(plain: str) -> bool:
    """Whether beside a value for a variable there are words of a block."""
    rest, count = plain.partition("=")[2], 1
    while count:
        rest, count = _IN_VALUE.subn("", rest)
    return _WORD_BESIDE.search(rest) is not None


def execute(state: State, text: bytes, lexer: Lexer) -> str:
    """Execute a line that is no plain motion block; say why it is left as it is where it cuts, else nothing."""
    try:
        line = lexer.line(text, 0, None)
    except InputError:
        return _execute_unread(state, text, lexer)
    if line.words and line.words[0].name == "DEF":  # a variable of Siemens, with its name as a word
        return _execute_unread(state, text, lexer)
    cuts = state.execute(line)
    state.lose_place(word.name for word in line.words if lexer.without_point(word))  # in which unit, nobody says
    if not cuts:
        return ""
    return "the operator may skip the block" if line.skipped else "other words in the block"
