"""Carries out the statements of a CL file, one after the other."""

from __future__ import annotations

from typing import Final

from cornersmooth.cl import motion, state
from cornersmooth.cl.grammar import Record
from cornersmooth.cl.machine import Machine
from cornersmooth.cl.words import (
    KNOWN_WORDS,
    MOTION_WORDS,
    PLAIN_PREFIXES,
    STRANGE_MOTION_WORDS,
    near_motion_word,
)
from cornersmooth.model import INFORMING_WORDS

HANDLERS: Final = motion.HANDLERS | state.HANDLERS

#: words that may stand between an arc and the GOTO that ends it
_WITHIN_ARC: Final = INFORMING_WORDS | {"FEDRAT", "GOTO"}

#: words of a NURBS record
_WITHIN_CURVE: Final = frozenset({"KNOT", "CNTRL"})

#: drive surfaces other than those that CAM systems write
_STRANGE_PREFIXES: Final = ("TLON,", "TLLFT,", "TLRGT,", "TLOFF,")


def plain(machine: Machine, count: int, line: int) -> None:
    """Carry out some plain GOTO statements, whose poses the builder already has.

    Parameters
    ----------
    machine : Machine
    count : int
    line : int
        Line of the first, for messages.
    """
    if machine.finished:
        raise machine.fail("CS118", line, word="GOTO")
    if machine.curve is not None:
        motion.finish_curve(machine)
    if machine.rapid or machine.arc is not None:
        machine.builder.take(1)
        machine.arrived()
        count -= 1
    if count:
        machine.builder.take(count)


def obey(machine: Machine, record: Record) -> None:
    """Carry out one statement.

    Raises
    ------
    InputError
        For everything that is not a statement in its place.
    """
    word = machine.renamed.get(record.word, record.word)
    if machine.curve is not None and word not in _WITHIN_CURVE:
        motion.finish_curve(machine)
    if machine.finished:
        _after_end(machine, record, word)
        return
    if machine.arc is not None and word not in _WITHIN_ARC:
        raise machine.fail("CS121", machine.arc.line, word=machine.arc.word)
    if record.points and word != "GOTO":
        raise machine.fail("CS105", record.points[0][0], text=state.joined(record.points[0][1]))
    if word in STRANGE_MOTION_WORDS or (word.startswith(_STRANGE_PREFIXES) and word not in HANDLERS):
        raise machine.fail("CS108", record.line, word=word)
    handler = HANDLERS.get(word)
    if handler is not None:
        if record.rest:
            raise machine.fail("CS107", record.line, word=word, text=record.rest)
        handler(machine, record)
        return
    if word not in KNOWN_WORDS and word != "$$" and not word.startswith(PLAIN_PREFIXES):
        _unknown(machine, record, word)
    machine.keep(record)


def end(machine: Machine) -> None:
    """Check that nothing is left open."""
    if machine.curve is not None:
        motion.finish_curve(machine)
    if machine.arc is not None:
        raise machine.fail("CS121", machine.arc.line, word=machine.arc.word)


def _after_end(machine: Machine, record: Record, word: str) -> None:
    if word in MOTION_WORDS | STRANGE_MOTION_WORDS and not machine.lenient:
        raise machine.fail("CS118", record.line, word=word)
    if word != "$$":
        machine.note("CS144", record.line, what="statements after FINI")


def _unknown(machine: Machine, record: Record, word: str) -> None:
    near = near_motion_word(word)
    if near is not None and not machine.lenient:
        raise machine.fail("CS109", record.line, word=word, near=near)
    if word:
        machine.note("CS130", record.line, word=word)
    else:
        machine.note("CS131", record.line)
