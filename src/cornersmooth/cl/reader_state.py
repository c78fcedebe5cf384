"""The state that statements act on: what is pending, what is modal, what was noticed.

RAPID holds for one motion (PostWorks 4.3), a feed until the next FEDRAT, an axis until the next one, CYCLE and CUTCOM
until OFF; an arc is completed by the GOTO after it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from cornersmooth.cl.arcs import Arc, ArcRule, ArcTable
from cornersmooth.cl.builder import Builder
from cornersmooth.cl.dialects import Dialect
from cornersmooth.cl.grammar import Argument, Record, number
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.nurbs import Curve
from cornersmooth.cl.systems import System, Vector
from cornersmooth.errors import Finding, InputError
from cornersmooth.model import Move, Statement, Units


@dataclass
class ReaderState:
    """State of the reading of one file."""

    file: str  #: for messages
    dialect: Dialect
    builder: Builder  #: takes the poses
    arc_rule: ArcRule | None = None  #: overrides the dialect's sense of rotation
    lenient: bool = False  #: go on where that is safe
    arcs: ArcTable = field(default_factory=ArcTable)
    statements: list[Statement] = field(default_factory=list)
    stated_units: list[tuple[int, Units, int]] = field(default_factory=list)  #: line, units, pose
    unitless_feeds: set[int] = field(default_factory=set)  #: rows of `Builder.feed` in units of the file
    feed_units: list[Units] = field(default_factory=list)
    rapid: bool = False  #: the next motion is rapid
    rapid_on: bool = False  #: all motions are
    hole: bool = False  #: every position is a hole
    arc: Arc | None = None  #: waits for its end
    curve: Curve | None = None  #: waits for more control points
    direction: tuple[str, Vector] | None = None  #: INDIRV or INDIRP, for the arc after it
    first_system: tuple[tuple[Argument, ...], System | None] | None = None  #: MSYS, MCS or MCSYS as written, and read
    offsets: dict[str, tuple[Argument, ...]] = field(default_factory=dict)  #: FIXTURE, WCS; $$-> CSYS, $$*CATIA0
    rows: list[str] | None = None  #: numbers after $$*CATIA0
    clearance: tuple[Vector | None, Vector] | None = None  #: normal of the plane of RETRCT (None: the tool axis), point
    renamed: dict[str, str] = field(default_factory=dict)  #: SYN
    finished: bool = False  #: FINI was met
    _findings: dict[str, Finding] = field(default_factory=dict)

    @property
    def stopped(self) -> bool:
        """Whether the rest of the file is of no interest."""
        return self.finished and self.lenient

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What was noticed, equal texts once, in the order in which they were first met."""
        return tuple(self._findings.values())

    def note(self, code: str, line: int, **values: object) -> None:
        """Count a finding."""
        new = finding(code, line, 1, **values)
        old = self._findings.get(new.text)
        if old is not None:
            new = Finding(old.code, old.severity, old.line, old.text, old.count + 1)
        self._findings[new.text] = new

    def fail(self, code: str, line: int, **values: object) -> InputError:
        """Return the error, to be raised."""
        return error(code, self.file, line, **values)

    def keep(self, record: Record) -> None:
        """Keep a statement in its place."""
        word = record.word or "?"
        self.statements.append(Statement(self.builder.n, record.line, word, record.args, record.text))

    def numbers(self, record: Record, args: tuple[Argument, ...] | None = None, line: int = 0) -> list[float]:
        """Return arguments (of the statement, or of a line after it) that must all be numbers (InputError CS106).

        They are separated by commas, or all by blanks.
        """
        given = record.args if args is None else args
        if len(given) == 1 and isinstance(given[0], str) and len(parts := given[0].split()) > 1:
            values = [number(part) for part in parts]
            if None not in values:
                self.note("CS134", line or record.line)
                return [value for value in values if value is not None]
        for value in given:
            if isinstance(value, str):
                raise self.fail("CS106", line or record.line, word=record.word, token=value)
        return [float(value) for value in given]

    def vector(self, record: Record) -> Vector:
        """Return the three numbers of a statement that has a vector (InputError CS106, CS110)."""
        values = self.numbers(record)
        if len(values) != 3:
            raise self.count(record, len(values), "i,j,k", record.line)
        return values[0], values[1], values[2]

    def count(self, record: Record, count: int, want: str, line: int) -> InputError:
        """Return the error for a wrong number of numbers, to be raised."""
        return self.fail("CS110", line, word=record.word, count=count, s="s"[: count != 1], want=want)

    def add(self, tip: Vector, axis: Vector | None, line: int) -> None:
        """Append a pose that a feed motion or the pending RAPID reaches."""
        self.builder.add(tip, axis, line)
        self.arrived()

    def arrived(self) -> None:
        """Settle how the last pose was reached."""
        pose = self.builder.n - 1
        if self.arc is not None:
            self.arcs.add(pose, self.arc)
            self.builder.special[pose] = Move.ARC
            self.arc = None
        elif self.rapid and not self.hole:
            self.builder.special[pose] = Move.RAPID
        self.rapid = False

    def set_kind(self) -> None:
        """Let the modal kind of motion hold from here on."""
        kind = Move.HOLE if self.hole else Move.RAPID if self.rapid_on else Move.LINEAR
        self.builder.kind.set(self.builder.n, float(kind))
