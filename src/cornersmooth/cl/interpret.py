"""Carries out the statements of a CL file, one after the other."""

from __future__ import annotations

from typing import Final

from cornersmooth.cl import motion_statements, state_statements
from cornersmooth.cl.grammar import Record
from cornersmooth.cl.reader_state import ReaderState
from cornersmooth.cl.words import (
    KNOWN_WORDS,
    MOTION_WORDS,
    PLAIN_PREFIXES,
    STRANGE_MOTION_WORDS,
    near_motion_word,
)
from cornersmooth.model import INFORMING_WORDS

HANDLERS: Final = motion_statements.HANDLERS | state_statements.HANDLERS

#: words that may stand between an arc and the GOTO that ends it
_WITHIN_ARC: Final = INFORMING_WORDS | {"FEDRAT", "GOTO"}

#: words of a NURBS record
_WITHIN_CURVE: Final = frozenset({"KNOT", "CNTRL"})

#: drive surfaces other than those that CAM systems write
_STRANGE_PREFIXES: Final = ("TLON,", "TLLFT,", "TLRGT,", "TLOFF,")


def plain(state: ReaderState, count: int, line: int) -> None:
    """Carry out some plain GOTO statements, whose poses the builder already has.

    Parameters
    ----------
    state : ReaderState
    count : int
    line : int
        Line of the first, for messages.
    """
    if state.finished:
        raise state.fail("CS118", line, word="GOTO")
    if state.curve is not None:
        motion_statements.finish_curve(state)
    if state.rapid or state.arc is not None:
        state.builder.take(1)
        state.arrived()
        count -= 1
    if count:
        state.builder.take(count)


def obey(state: ReaderState, record: Record) -> None:
    """Carry out one statement.

    Raises
    ------
    InputError
        For everything that is not a statement in its place.
    """
    word = state.renamed.get(record.word, record.word)
    if state.curve is not None and word not in _WITHIN_CURVE:
        motion_statements.finish_curve(state)
    if state.finished:
        _after_end(state, record, word)
        return
    if state.arc is not None and word not in _WITHIN_ARC:
        raise state.fail("CS121", state.arc.line, word=state.arc.word)
    if record.points and word != "GOTO":
        raise state.fail("CS105", record.points[0][0], text=state_statements.joined(record.points[0][1]))
    if word in STRANGE_MOTION_WORDS or (word.startswith(_STRANGE_PREFIXES) and word not in HANDLERS):
        raise state.fail("CS108", record.line, word=word)
    handler = HANDLERS.get(word)
    if handler is not None:
        if record.rest:
            raise state.fail("CS107", record.line, word=word, text=record.rest)
        handler(state, record)
        return
    if word not in KNOWN_WORDS and word != "$$" and not word.startswith(PLAIN_PREFIXES):
        _unknown(state, record, word)
    state.keep(record)


def end(state: ReaderState) -> None:
    """Check that nothing is left open."""
    if state.curve is not None:
        motion_statements.finish_curve(state)
    if state.arc is not None:
        raise state.fail("CS121", state.arc.line, word=state.arc.word)


def _after_end(state: ReaderState, record: Record, word: str) -> None:
    if word in MOTION_WORDS | STRANGE_MOTION_WORDS and not state.lenient:
        raise state.fail("CS118", record.line, word=word)
    if word != "$$":
        state.note("CS144", record.line, what="statements after FINI")


def _unknown(state: ReaderState, record: Record, word: str) -> None:
    near = near_motion_word(word)
    if near is not None and not state.lenient:
        raise state.fail("CS109", record.line, word=word, near=near)
    if word:
        state.note("CS130", record.line, word=word)
    else:
        state.note("CS131", record.line)
