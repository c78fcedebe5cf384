"""What the statements of a CL file do: a state machine that fills a `Builder`.

RAPID holds for one motion (PostWorks 4.3), a feed until the next FEDRAT, an axis until the next one, CYCLE and CUTCOM
until OFF; a CIRCLE is completed by the GOTO after it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

from cornersmooth.cl.arcs import Arc, ArcRule, ArcTable, read_arc
from cornersmooth.cl.builder import UNIT_TOLERANCE, UP, Builder, Vector
from cornersmooth.cl.dialects import Dialect
from cornersmooth.cl.grammar import Argument, Record
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.words import (
    FRAME_WORDS,
    KNOWN_WORDS,
    MOTION_WORDS,
    PLAIN_PREFIXES,
    STRANGE_MOTION_WORDS,
    near_motion_word,
)
from cornersmooth.errors import Finding, InputError
from cornersmooth.model import INFORMING_WORDS, FeedMode, Keep, Move, Statement, Units

#: unit words of FEDRAT: millimetres per unit of the value (None: the unit of the file) and whether per revolution
FEED_UNITS: Final[dict[str, tuple[float | None, FeedMode]]] = {
    "MMPM": (1.0, FeedMode.PER_MINUTE),
    "MPM": (1000.0, FeedMode.PER_MINUTE),
    "IPM": (25.4, FeedMode.PER_MINUTE),
    "FPM": (12 * 25.4, FeedMode.PER_MINUTE),
    "PERMIN": (None, FeedMode.PER_MINUTE),
    "MMPR": (1.0, FeedMode.PER_REVOLUTION),
    "IPR": (25.4, FeedMode.PER_REVOLUTION),
    "FPR": (12 * 25.4, FeedMode.PER_REVOLUTION),
    "PERREV": (None, FeedMode.PER_REVOLUTION),
}

UNIT_NAMES: Final[dict[str, Units]] = {
    "MM": "mm",
    "MILLIMETER": "mm",
    "MILLIMETERS": "mm",
    "MILLIMETRE": "mm",
    "MILLIMETRES": "mm",
    "METRIC": "mm",
    "INCH": "inch",
    "INCHES": "inch",
    "IN": "inch",
}

#: words that may stand between an arc and the GOTO that ends it
_WITHIN_ARC: Final = INFORMING_WORDS | {"FEDRAT"}

#: first words of CYCLE that end one
_CYCLE_ENDS: Final = frozenset({"OFF", "NOMORE", "STOP"})


@dataclass
class Interpreter:
    """Carries out statements one after the other.

    Parameters
    ----------
    file : str
        For messages.
    dialect : Dialect
    builder : Builder
    lenient : bool
    """

    file: str
    dialect: Dialect
    builder: Builder
    arcs: ArcTable
    arc_rule: ArcRule | None = None
    lenient: bool = False
    statements: list[Statement] = field(default_factory=list)
    stated_units: list[tuple[int, Units, int]] = field(default_factory=list)
    unitless_feeds: set[int] = field(default_factory=set)
    feed_units: list[Units] = field(default_factory=list)
    finished: int = 0
    _rapid: bool = False
    _hole: bool = False
    _rapid_on: bool = False
    _arc: Arc | None = None
    _renamed: dict[str, str] = field(default_factory=dict)
    _findings: dict[str, Finding] = field(default_factory=dict)
    _system: tuple[Argument, ...] | None = None

    def findings(self) -> tuple[Finding, ...]:
        """Return what was noticed, each kind once, in the order in which it was first met."""
        return tuple(self._findings.values())

    def note(self, code: str, line: int, **values: object) -> None:
        """Count a finding; equal texts are one."""
        new = finding(code, line, 1, **values)
        old = self._findings.get(new.text)
        if old is not None:
            new = Finding(old.code, old.severity, old.line, old.text, old.count + 1)
        self._findings[new.text] = new

    def fail(self, code: str, line: int, **values: object) -> InputError:
        """Return the error, to be raised."""
        return error(code, self.file, line, **values)

    def plain(self, count: int, line: int) -> None:
        """Carry out some plain GOTO statements, whose poses the builder already has."""
        if self.finished:
            raise self.fail("CS118", line, word="GOTO")
        if self._rapid or self._arc is not None:
            self.builder.take(1)
            self._arrived()
            count -= 1
        if count:
            self.builder.take(count)

    def obey(self, record: Record) -> None:
        """Carry out one statement."""
        word = self._renamed.get(record.word, record.word)
        if self.finished:
            self._after_end(record, word)
            return
        if self._arc is not None and word not in _WITHIN_ARC and word != "GOTO":
            raise self.fail("CS121", self._arc.line, word=self._arc.word)
        if record.points and word not in ("GOTO", "FROM"):
            raise self.fail("CS105", record.points[0][0], text=_joined(record.points[0][1]))
        handler = HANDLERS.get(word)
        if handler is not None:
            if record.rest:
                raise self.fail("CS107", record.line, word=word, text=record.rest)
            handler(self, record)
            return
        if word not in KNOWN_WORDS and word != "$$" and not word.startswith(PLAIN_PREFIXES):
            self._unknown(record, word)
        self.keep(record)

    @property
    def stopped(self) -> bool:
        """Whether the rest of the file is of no interest."""
        return bool(self.finished) and self.lenient

    def _after_end(self, record: Record, word: str) -> None:
        if word in MOTION_WORDS and not self.lenient:
            raise self.fail("CS118", record.line, word=word)
        if word != "$$":
            self.note("CS144", record.line, what="statements after FINI")

    def keep(self, record: Record) -> None:
        """Keep a statement in its place."""
        word = record.word or "?"
        self.statements.append(Statement(self.builder.n, record.line, word, record.args, record.text))

    def end(self) -> None:
        """Check that nothing is left open."""
        if self._arc is not None:
            raise self.fail("CS121", self._arc.line, word=self._arc.word)

    def numbers(self, record: Record, args: tuple[Argument, ...] | None = None) -> list[float]:
        """Return arguments that must all be numbers.

        Raises
        ------
        InputError
            CS106
        """
        given = record.args if args is None else args
        if len(given) == 1 and isinstance(given[0], str) and len(parts := given[0].split()) > 1:
            given = tuple(_number_or_text(part) for part in parts)
            if all(isinstance(value, float) for value in given):
                self.note("CS134", record.line)
        for value in given:
            if isinstance(value, str):
                raise self.fail("CS106", record.line, word=record.word, token=value)
        return [float(value) for value in given]

    def _unknown(self, record: Record, word: str) -> None:
        if word in STRANGE_MOTION_WORDS or word.startswith(("TLON,", "TLLFT,", "TLRGT,", "TLOFF,")):
            raise self.fail("CS108", record.line, word=word)
        near = near_motion_word(word)
        if near is not None and not self.lenient:
            raise self.fail("CS109", record.line, word=word, near=near)
        if word:
            self.note("CS130", record.line, word=word)
        else:
            self.note("CS131", record.line)

    def _arrived(self) -> None:
        """Settle how the last pose was reached."""
        pose = self.builder.n - 1
        if self._arc is not None:
            self.arcs.add(pose, self._arc)
            self.builder.special[pose] = Move.ARC
            self._arc = None
        elif self._rapid and not self._hole:
            self.builder.special[pose] = Move.RAPID
        self._rapid = False

    def _pose(self, record: Record, args: tuple[Argument, ...], line: int) -> tuple[Vector, Vector | None]:
        values = self.numbers(record, args)
        count = len(values)
        if count not in (3, 6, 9):
            want = "x,y,z or x,y,z,i,j,k"
            raise self.fail("CS110", line, word=record.word, count=count, s="s"[: count != 1], want=want)
        tip = (values[0], values[1], values[2])
        return tip, (values[3], values[4], values[5]) if count > 3 else None

    def _goto(self, record: Record) -> None:
        for line, args in ((record.line, record.args), *record.points):
            tip, axis = self._pose(record, args, line)
            if record.text.endswith("$"):
                self.note("CS129", line)
                axis = self.builder.last_axis()
            self.builder.add(tip, axis, line)
            self._arrived()

    def _from(self, record: Record) -> None:
        tip, axis = self._pose(record, record.args, record.line)
        self.builder.special[self.builder.n] = Move.FROM
        self.builder.add(tip, axis, record.line)

    def _gohome(self, record: Record) -> None:
        if not record.args:
            self.keep(record)
            return
        tip, axis = self._pose(record, record.args, record.line)
        self.builder.special[self.builder.n] = Move.RAPID
        self.builder.add(tip, axis, record.line)
        self._rapid = False

    def _godlta(self, record: Record) -> None:
        values = self.numbers(record)
        if len(values) not in (1, 2, 3, 6):
            want = "dx,dy,dz or the distance along the tool axis"
            raise self.fail("CS110", record.line, word="GODLTA", count=len(values), s="s", want=want)
        if not self.builder.n:
            raise self.fail("CS114", record.line, word="GODLTA")
        if len(values) == 1:
            step = [values[0] * part / math.hypot(*self.builder.last_axis()) for part in self.builder.last_axis()]
        else:
            step = [*values, 0.0][:3]
        x, y, z = (a + b for a, b in zip(self.builder.last_tip(), step, strict=True))
        axis = (values[3], values[4], values[5]) if len(values) == 6 else None
        self.builder.add((x, y, z), axis, record.line)
        self._arrived()

    def _rapid_word(self, record: Record) -> None:
        option = record.args[0] if record.args else ""
        if option in ("ON", "OFF"):
            self._rapid_on = option == "ON"
            self._rapid = False
            self._set_kind()
        elif not option or option == "MODIFY":
            self._rapid = True
        else:
            self.note("CS140", record.line, text=_joined(record.args))

    def _set_kind(self) -> None:
        kind = Move.HOLE if self._hole else Move.RAPID if self._rapid_on else Move.LINEAR
        self.builder.kind.set(self.builder.n, float(kind))

    def _feed(self, record: Record) -> None:
        values = [value for value in record.args if isinstance(value, float)]
        words = [value for value in record.args if isinstance(value, str) and value]
        units = [word for word in words if word in FEED_UNITS]
        if len(values) != 1 or len(units) > 1 or len(units) != len(words):
            self.note("CS136", record.line, text=_joined(record.args))
            self.keep(record)
            return
        if not (math.isfinite(values[0]) and values[0] > 0):
            if not self.lenient:
                raise self.fail("CS119", record.line, word="FEDRAT", value=values[0])
            self.note("CS144", record.line, what=f"feed of {values[0]:g}")
            return
        if self._rapid:
            self.note("CS135", record.line)
        builder = self.builder
        if units:
            scale, mode = FEED_UNITS[units[0]]
        else:
            scale, mode = None, FeedMode(int(builder.feed_mode.now))
        if scale is None:
            self.unitless_feeds.add(len(builder.feed.at))
        else:
            self.feed_units.append("mm" if units[0].startswith("M") else "inch")
        builder.feed_mode.set(builder.n, float(mode))
        builder.feed.at.append(builder.n)
        builder.feed.value.append(values[0] * (scale or 1.0))

    def _units(self, record: Record) -> None:
        name = record.args[0] if len(record.args) == 1 else None
        units = UNIT_NAMES.get(name) if isinstance(name, str) else None
        if units is None:
            text = _joined(record.args)
            raise self.fail("CS115", record.line, word=record.word, text=text, want="use UNITS/MM or UNITS/INCHES")
        self.stated_units.append((record.line, units, self.builder.n))
        self.keep(record)

    def _multax(self, record: Record) -> None:
        self.builder.lock_axis(bool(record.args) and record.args[0] == "OFF")
        self.keep(record)

    def _tlaxis(self, record: Record) -> None:
        values = self.numbers(record)
        if len(values) != 3:
            count = len(values)
            raise self.fail("CS110", record.line, word="TLAXIS", count=count, s="s"[: count != 1], want="i,j,k")
        self._set_axis(record, (values[0], values[1], values[2]))
        self.keep(record)

    def _set_axis(self, record: Record, axis: Vector) -> None:
        length = math.hypot(*axis)
        if length == 0:
            raise self.fail("CS111", record.line)
        if not abs(length - 1) <= UNIT_TOLERANCE:
            if not (self.lenient and math.isfinite(length)):
                raise self.fail("CS112", record.line, length=length)
            self.note("CS139", record.line, length=length)
        self.builder.set_axis((axis[0] / length, axis[1] / length, axis[2] / length))

    def _tool_path(self, record: Record) -> None:
        self.builder.set_axis(UP)
        self.keep(record)

    def _csys_word(self, record: Record) -> None:
        if len(record.args) == 12:
            values = self.numbers(record)
            self._set_axis(record, (values[2], values[6], values[10]))
        self.keep(record)

    def _msys(self, record: Record) -> None:
        if self._system is not None and self._system != record.args:
            self.note("CS146", record.line, word="MSYS")
        self._system = record.args
        self.keep(record)

    def _cutcom(self, record: Record) -> None:
        option = record.args[0] if record.args else ""
        if option in ("LEFT", "RIGHT", "ON"):
            if not self.builder.keep.now:
                self.note("CS138", record.line)
            self.builder.keep.set(self.builder.n, float(Keep.CUTTER_COMPENSATION))
        elif option in ("OFF", "NOMORE"):
            self.builder.keep.set(self.builder.n, float(Keep.NO))
        self.keep(record)

    def _cycle(self, record: Record) -> None:
        self._hole = not (record.args and record.args[0] in _CYCLE_ENDS)
        self._set_kind()
        self.keep(record)

    def _circle(self, record: Record) -> None:
        if not self.builder.n:
            raise self.fail("CS122", record.line, word=record.word)
        values = [value for value in record.args if isinstance(value, float)]
        decimals = self.dialect.decimals if self.dialect.strips_zeros else 0
        self._arc = read_arc(record, values, self.file, self.arc_rule, decimals)
        if self._rapid:
            self.note("CS140", record.line, text=record.word)

    def _frame(self, record: Record) -> None:
        if not _is_identity(record):
            if not self.lenient:
                raise self.fail("CS117", record.line, word=record.word)
            self.note("CS143", record.line, word=record.word)
        self.keep(record)

    def _set_mode(self, record: Record) -> None:
        if "INCR" in record.args or "INCREM" in record.args:
            text = _joined(record.args)
            raise self.fail("CS115", record.line, word="SET", text=text, want="write absolute positions")
        self.keep(record)

    def _trntyp(self, record: Record) -> None:
        if record.args and record.args[0] != "WORLD":
            self._frame(record)
        else:
            self.keep(record)

    def _syn(self, record: Record) -> None:
        words = [value.strip("'").upper() for value in record.args if isinstance(value, str)]
        if len(words) == 2:
            self._renamed[words[0]] = "$$" if words[1].startswith("$$") else words[1]
        self.keep(record)

    def _fini(self, record: Record) -> None:
        self.finished = record.line
        self.keep(record)

    def _stray(self, record: Record) -> None:
        raise self.fail("CS108", record.line, word=record.word)


def _joined(args: tuple[Argument, ...]) -> str:
    return ",".join(f"{value:g}" if isinstance(value, float) else value for value in args)


def _number_or_text(token: str) -> Argument:
    return float(token) if re.fullmatch(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([Ee][+-]?[0-9]+)?", token) else token


def _is_identity(record: Record) -> bool:
    """Whether a coordinate-changing statement changes nothing: NOMORE, OFF, or all zero."""
    first = record.args[0] if record.args else ""
    return first in ("NOMORE", "OFF") or all(value == 0 for value in record.args if isinstance(value, float))


HANDLERS: Final[dict[str, Callable[[Interpreter, Record], None]]] = {
    "GOTO": Interpreter._goto,
    "FROM": Interpreter._from,
    "GOHOME": Interpreter._gohome,
    "GODLTA": Interpreter._godlta,
    "RAPID": Interpreter._rapid_word,
    "FEDRAT": Interpreter._feed,
    "UNITS": Interpreter._units,
    "UNIT": Interpreter._units,
    "MULTAX": Interpreter._multax,
    "TLAXIS": Interpreter._tlaxis,
    "TOOL PATH": Interpreter._tool_path,
    "CSYS": Interpreter._csys_word,
    "MSYS": Interpreter._msys,
    "CUTCOM": Interpreter._cutcom,
    "CYCLE": Interpreter._cycle,
    "CIRCLE": Interpreter._circle,
    "MOVARC": Interpreter._circle,
    "SET": Interpreter._set_mode,
    "TRNTYP": Interpreter._trntyp,
    "SYN": Interpreter._syn,
    "FINI": Interpreter._fini,
    **dict.fromkeys(FRAME_WORDS, Interpreter._frame),
}
