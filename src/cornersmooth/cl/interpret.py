"""Carries out the statements of a CL file, one after the other."""

from __future__ import annotations

import math
import re
from typing import Final

from cornersmooth.cl import motion_statements, state_statements
from cornersmooth.cl.grammar import Record, joined, number
from cornersmooth.cl.messages import error
from cornersmooth.cl.reader_state import ReaderState
from cornersmooth.cl.words import (
    GOTO_WORDS,
    KNOWN_WORDS,
    MOTION_WORDS,
    MOVES,
    PLAIN_PREFIXES,
    REFUSED_WORDS,
    near_motion_word,
)

HANDLERS: Final = motion_statements.HANDLERS | state_statements.FED | state_statements.KEPT

#: words that may stand between an arc and the GOTO that ends it
_WITHIN_ARC: Final = GOTO_WORDS | frozenset(
    "$$ PAINT PPRINT REMARK DISPLY PARTNO TPRINT LETTER INTOL OUTTOL CUTTER TLDATA FEDRAT".split()
)

#: words of a NURBS record
_WITHIN_CURVE: Final = frozenset({"KNOT", "CNTRL"})

#: so many numbers in a row may be a position
_POSITION: Final = 3

#: blocks for the control that turn coordinates or move axes: a G code, or a word of an axis
_NC_BLOCK: Final = re.compile(r"\s*(?:[A-Z][-+]?(?:\d+\.?\d*|\.\d+)\s*)+[$%;]?\s*", re.IGNORECASE)
_AXIS_OR_G: Final = re.compile(r"[GXYZABCUVWIJK]", re.IGNORECASE)

#: words whose first argument says what they do
_CHOOSING: Final = frozenset({"LOAD", "SELECT", "MODE", "SET"})

#: drive surfaces other than those that CAM systems write
_STRANGE_PREFIXES: Final = ("TLON,", "TLLFT,", "TLRGT,", "TLOFF,")


def plain(state: ReaderState, count: int, line: int) -> None:
    """Carry out some plain GOTO statements, whose poses are in the chunk."""
    if state.finished:
        raise error("CS118", state.file, line, word="GOTO")
    if state.curve is not None:
        motion_statements.finish_curve(state)
    if state.rapid or state.arc is not None:
        state.take(1)
        state.arrived()
        count -= 1
    if count:
        state.take(count)


def obey(state: ReaderState, record: Record) -> None:
    """Carry out one statement (InputError where it is none that can be in its place)."""
    word = state.renamed.get(record.word, record.word)
    if state.curve is not None and word not in _WITHIN_CURVE:
        motion_statements.finish_curve(state)
    if state.finished:
        if (word in MOTION_WORDS or _refused(record, word)) and not state.lenient:
            raise state.fail("CS118", record, word=word)
        if word != "$$":
            state.note("CS144", record.line, what="statements after FINI")
        return
    if state.arc is not None and word not in _WITHIN_ARC:
        raise state.fail("CS121", state.arc)
    if record.points and word not in GOTO_WORDS:
        line, args = record.points[0]
        raise state.fail("CS105", record, line, text=joined(args))
    handler = HANDLERS.get(word)
    refused = _refused(record, word) if handler is None or word in _CHOOSING else None
    if refused is not None:
        whole = word in _CHOOSING or word == "INSERT" or refused == "CS198"
        raise state.fail(refused, record, word=record.text if whole else word)
    if handler is not None:
        if record.rest:
            raise state.fail("CS107", record, word=word, text=record.rest)
        handler(state, record)
        if word in state_statements.KEPT:
            state.keep(record)
        return
    if any(isinstance(value, float) and not math.isfinite(value) for value in record.args):
        raise state.fail("CS196", record, word=word)
    if word not in KNOWN_WORDS and word != "$$" and not word.startswith(PLAIN_PREFIXES):
        _unknown(state, record, word)
    state.keep(record)


def end(state: ReaderState) -> None:
    """Check that nothing is left open."""
    if state.curve is not None:
        motion_statements.finish_curve(state)
    if state.arc is not None:
        raise state.fail("CS121", state.arc)


def _refused(record: Record, word: str) -> str | None:
    """Code of the error for a statement that is not carried out although it may move the tool."""
    first = record.option
    name = word.rpartition("=")[2]  # M1=MACRO
    if word in _CHOOSING and isinstance(first, str):
        name = first  # LOAD/HEAD,2
    if name in REFUSED_WORDS:
        return None if first in ("OFF", "NOMORE") else REFUSED_WORDS[name]
    if word.startswith(_STRANGE_PREFIXES):
        return MOVES
    if word == "INSERT":
        return MOVES if _is_nc_motion(str(first)) else None
    return "CS198" if word not in KNOWN_WORDS and _is_nc_motion(record.text) else None


def _is_nc_motion(text: str) -> bool:
    return _NC_BLOCK.fullmatch(text) is not None and _AXIS_OR_G.search(text) is not None


def _numbers_in_a_row(record: Record) -> int:
    """Length of the longest row of numbers in an unknown statement."""
    row = most = 0
    for value in record.args:
        for part in [value] if isinstance(value, float) else value.replace(",", " ").split() or [""]:
            row = row + 1 if isinstance(part, float) or number(part) is not None else 0
            most = max(most, row)
    return most


def _unknown(state: ReaderState, record: Record, word: str) -> None:
    near = near_motion_word(word)
    if near is not None and not state.lenient:
        raise state.fail("CS109", record, word=word, near=near)
    if _numbers_in_a_row(record) >= _POSITION and not state.lenient:
        raise state.fail("CS187", record, word=word or record.text)
    if word:
        state.note("CS130", record.line, word=word)
    else:
        state.note("CS131", record.line)
