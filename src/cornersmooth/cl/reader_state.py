"""The state that statements act on: what is pending, what is modal, what was noticed.

RAPID holds for one motion (PostWorks 4.3), a feed until the next FEDRAT, an axis until the next one, CYCLE and CUTCOM
until OFF; an arc is completed by the GOTO after it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from cornersmooth.cl.arcs import Arc, ArcRule
from cornersmooth.cl.grammar import Argument, Record, joined, number
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.nurbs import Cubic, Curve
from cornersmooth.cl.poses import Poses, System, Vector
from cornersmooth.errors import Finding, InputError
from cornersmooth.model import Move, Statement, Units


@dataclass(kw_only=True)
class ReaderState(Poses):
    """State of the reading of one file."""

    wanted_units: Units | None = None  #: override those of the file
    arc_rule: ArcRule | None = None  #: overrides the dialect's sense of rotation
    cycle_order: tuple[str, ...] = ()  #: what the numbers without a word of CYCLE are
    arcs: list[Arc] = field(default_factory=list)  #: in the order of their end poses
    curves: list[Cubic] = field(default_factory=list)
    statements: list[Statement] = field(default_factory=list)
    stated_units: list[tuple[int, Units, int]] = field(default_factory=list)  #: line, units, pose
    unitless_feeds: set[int] = field(default_factory=set)  #: rows of `Poses.feed` in units of the file
    feed_units: list[Units] = field(default_factory=list)
    rapid: bool = False  #: the next motion is rapid
    rapid_on: bool = False  #: all motions are
    hole: bool = False  #: every position is a hole
    cycle: tuple[Argument, ...] = ()  #: arguments of the last CYCLE that says what to drill
    arc: Arc | None = None  #: waits for its end
    curve: Curve | None = None  #: waits for more control points
    points_from: tuple[int, int] | None = None  #: line of MOVNRB/ON, and poses before it; None behind MOVNRB/OFF
    direction: tuple[str, Vector] | None = None  #: INDIRV or INDIRP, for the arc after it
    first_system: tuple[tuple[Argument, ...], System | None] | None = None  #: MSYS, MCS or MCSYS as written, and read
    offsets: dict[str, tuple[Argument, ...]] = field(default_factory=dict)  #: FIXTURE, WCS; $$-> CSYS, $$*CATIA0
    matrix: list[str] | None = None  #: numbers after $$*CATIA0
    clearance: tuple[Vector | None, Vector] | None = None  #: normal of the plane of RETRCT (None: the tool axis), point
    renamed: dict[str, str] = field(default_factory=dict)  #: SYN
    finished: bool = False  #: FINI was met
    findings: dict[str, Finding] = field(default_factory=dict)  #: by text, in the order in which they were first met

    def note(self, code: str, line: int, **values: object) -> None:
        """Count a finding; equal texts are one."""
        new = finding(code, line, 1, **values)
        old = self.findings.get(new.text)
        self.findings[new.text] = new if old is None else replace(old, count=old.count + 1)

    def fail(self, code: str, record: Record | Arc, line: int = 0, **values: object) -> InputError:
        """Return the error of a statement, to be raised; `line` where it is not the first one of the statement."""
        values = {"word": record.word} | values
        if isinstance(record, Record):
            values = {"text": joined(record.args)} | values
        return error(code, self.file, line or record.line, **values)

    def keep(self, record: Record) -> None:
        """Keep a statement in its place."""
        self.statements.append(Statement(self.n, record.line, record.word or "?", record.args, record.text))

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
                raise self.fail("CS106", record, line, token=value)
        return [float(value) for value in given]

    def vector(self, record: Record, want: str = "i,j,k") -> Vector:
        """Return the three numbers of a statement that has a vector (InputError CS106, CS110)."""
        values = self.numbers(record)
        if len(values) != 3:
            raise self.count(record, len(values), want)
        return values[0], values[1], values[2]

    def count(self, record: Record, count: int, want: str, line: int = 0) -> InputError:
        """Return the error for a wrong number of numbers, to be raised."""
        return self.fail("CS110", record, line, count=count, s="s"[: count != 1], want=want)

    def add(self, tip: Vector, axis: Vector | None, line: int, move: Move | None = None) -> None:
        """Append a pose that this move reaches: by default a feed motion, or the pending RAPID."""
        if move is None:
            self.arrive()
        else:
            self._reach(move)
        self.append(tip, axis, line)

    def arrive(self) -> None:
        """Settle how the next pose is reached."""
        if self.arc is not None:
            self.arcs.append(replace(self.arc, pose=self.n))
            self._reach(Move.ARC)
            self.arc = None
        elif self.rapid and not self.hole:
            self._reach(Move.RAPID)
        self.rapid = False

    def _reach(self, move: Move) -> None:
        """Let one pose be reached by another move than those after it."""
        self.kind.append(self.n, move)
        self.set_kind(self.n + 1)

    def set_kind(self, pose: int) -> None:
        """Let the modal kind of motion hold from a pose on."""
        self.kind.append(pose, Move.HOLE if self.hole else Move.RAPID if self.rapid_on else Move.LINEAR)
