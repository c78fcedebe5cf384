"""Reader of APT / CL files: bytes to `Program`."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from cornersmooth.cl import arcs as arc_geometry
from cornersmooth.cl import motion_statements, state_statements
from cornersmooth.cl.arcs import ArcRule
from cornersmooth.cl.bulk import parts
from cornersmooth.cl.dialects import DIALECTS, recognise
from cornersmooth.cl.grammar import Decode, Record, joined, number, read_records
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.nurbs import curves_of
from cornersmooth.cl.poses import AXIS_NOISE
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
from cornersmooth.errors import Finding
from cornersmooth.frame import HEAD
from cornersmooth.model import MM_PER_UNIT, Floats, Ints, Keep, Move, Program, Source, Statement, Units
from cornersmooth.nc_reader.recognition import first_block

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


def read_apt(
    data: bytes,
    *,
    name: str,
    dialect: str | None = None,
    units: Units | None = None,
    arc_rule: ArcRule | None = None,
    lenient: bool = False,
    cycle_order: tuple[str, ...] = (),
    processes: int = 1,
) -> Program:
    """Read an APT / CL text; parameters are those of `cornersmooth.cl.read`.

    The text has LF line ends (`cornersmooth.cl.source.clean` makes it so). Memory while reading: 5 bytes for a byte of
    a tool path of plain GOTO lines, at most 130 for any statements; the lines of a NURBS record may be
    `nurbs.MOST_LINES` poses for each control point. Raises InputError CS101-CS128 and CS181-CS193, with the line.
    """
    refuse_program(data, name)
    known = next(one for one in DIALECTS if one.name == dialect) if dialect else recognise(data)
    state = ReaderState(
        file=name, dialect=known, wanted_units=units, arc_rule=arc_rule, lenient=lenient, cycle_order=cycle_order
    )
    state.expect(data.count(b"GOTO"))
    decode = _decoder(data)
    for part in parts(data, processes):
        if state.finished and lenient:
            break
        if part.poses is not None:
            _plain(state, part.poses)
            continue
        for record in read_records(part.text.split(b"\n")[:-1], part.first, decode, name, part.follows):
            _obey(state, record)
    _end(state)
    if not state.n:
        raise error("CS101", name, 1)
    return _program(state)


def _plain(state: ReaderState, poses: Floats) -> None:
    """Carry out some plain GOTO statements."""
    if state.finished:
        raise error("CS118", state.file, int(poses[0, 6]), word="GOTO")
    if state.curve is not None:
        motion_statements.finish_curve(state)
    state.arrive()
    state.take(poses)


def _obey(state: ReaderState, record: Record) -> None:
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
    if word not in KNOWN_WORDS and not word.startswith(PLAIN_PREFIXES):
        _unknown(state, record, word)
    state.keep(record)


def _end(state: ReaderState) -> None:
    """Check that nothing is left open."""
    if state.curve is not None:
        motion_statements.finish_curve(state)
    if state.arc is not None:
        raise state.fail("CS121", state.arc)
    if state.points_from is not None:
        raise error("CS128", state.file, state.points_from[0], why="MOVNRB/OFF is missing")


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


def refuse_program(data: bytes, name: str) -> None:
    """Refuse an NC program (InputError CS198, with the line of its first block)."""
    block = first_block(data[:HEAD])
    if block is not None:
        raise error("CS198", name, data.count(b"\n", 0, block.start()) + 1, word=block[0].decode("latin-1").strip())


def _decoder(data: bytes) -> Decode:
    """UTF-8 if all of it is; else Windows-1252, as CATIA writes its headers."""
    if not data.isascii():
        try:
            data.decode("utf-8")
        except UnicodeDecodeError:
            return lambda line: line.decode("cp1252", "replace")
    return lambda line: line.decode("utf-8")


def _program(state: ReaderState) -> Program:
    units, unit_findings = _units(state)
    scale = MM_PER_UNIT[units]
    tip = state.tips()
    axis, axis_findings = state.axes()
    kind = state.kind.spread(state.n).astype(np.uint8)
    line = state.rows[:, 6].astype(np.int64)
    arcs, straight, kept, arc_findings = arc_geometry.resolve(state.arcs, tip, kind, state.file, state.arc_rule)
    kind[straight] = Move.LINEAR
    keep = state.exact.spread(state.n).astype(np.uint8)
    for first in (np.flatnonzero((keep[:-1] == Keep.CUTTER_COMPENSATION) & (keep[1:] == Keep.NO)) + 1).tolist():
        rapid = ~np.isin(kind[first:], (Move.LINEAR, Move.ARC))  # ends it, as the first feed in the plane does
        ends = int(np.argmax(np.append(rapid | (tip[first:, :2] != tip[first - 1 : -1, :2]).any(axis=1), True)))
        keep[first : first + ends + 1][~rapid[: ends + 1]] = Keep.CUTTER_COMPENSATION
    keep[kept] = keep[kept - 1] = Keep.CONTRADICTION
    turned = np.abs(axis[arcs.pose] - axis[arcs.pose - 1]).max(axis=1, initial=0) > AXIS_NOISE
    along = [finding("CS147", int(line[arcs.pose[turned]][0]), int(turned.sum()))] if turned.any() else []
    fed = _fed_from_elsewhere(tip, kind)
    jumps = [finding("CS185", int(line[fed[0]]), len(fed))] if len(fed) else []
    for index in state.unitless_feeds:
        state.feed.value[index] *= scale
    return Program(
        tip=tip * scale,
        axis=axis,
        kind=kind,
        feed=state.feed.spread(state.n),
        line=line,
        feed_mode=state.feed_mode.spread(state.n).astype(np.uint8),
        keep=keep,
        arcs=replace(arcs, centre=arcs.centre * scale),
        curves=curves_of(state.curves, scale, axis, keep != Keep.NO, kind),
        statements=tuple(_with_one_coolant(state.statements) if state.dialect.autodesk else state.statements),
        units=units,
        source=Source(state.file, "apt", state.dialect.name),
        findings=(*unit_findings, *state.findings.values(), *axis_findings, *arc_findings, *along, *jumps),
    )


def _with_one_coolant(statements: list[Statement]) -> list[Statement]:
    """Leave out COOLNT/ON beside a kind of coolant."""
    kinds = {one.pose for one in statements if one.word == "COOLNT" and one.args not in (("ON",), ("OFF",))}
    return [one for one in statements if one.word != "COOLNT" or one.args != ("ON",) or one.pose not in kinds]


def _fed_from_elsewhere(tip: Floats, kind: NDArray[np.uint8]) -> Ints:
    """Poses of FROM that name another place than the tool's, which then feeds on: nothing says how it gets there."""
    stated, stands = np.flatnonzero(kind[:-1] == Move.FROM), np.flatnonzero(kind != Move.FROM)
    before = np.searchsorted(stands, stated) - 1
    stated, before = stated[before >= 0], stands[before[before >= 0]]
    feeds = np.isin(kind[stated + 1], (Move.LINEAR, Move.ARC))
    return stated[feeds & (tip[stated] != tip[before]).any(axis=1)]


def _units(state: ReaderState) -> tuple[Units, list[Finding]]:
    """Units of the file: as wanted, as stated, as the feeds suggest, or as the dialect has them."""
    stated, wanted = state.stated_units, state.wanted_units
    guess, why = state.dialect.units, f"as usual for {state.dialect.name} files"
    if state.feed_units:
        guess, why = state.feed_units[0], "as in its feeds"
    before = stated[0][1] if stated and not stated[0][2] else guess
    for line, now, pose in stated:
        if pose and now != before and not wanted:
            raise error("CS116", state.file, line, word="UNITS", new=now, old=before)
        before = now
    if wanted:
        other = [line for line, now, _ in stated if now != wanted]
        if other:
            text = {"stated": "inch" if wanted == "mm" else "mm", "units": wanted}
            return wanted, [finding("CS133", other[0], len(other), **text)]
        if not stated and state.feed_units and wanted not in state.feed_units:
            return wanted, [finding("CS180", 0, feeds=state.feed_units[0], units=wanted)]
        return wanted, []
    if stated:
        return stated[-1][1], []
    return guess, [finding("CS132", 0, units=guess, why=why)]
