"""The motion of a program in blocks: rows as they come, the approach of a tool, retracts, where the tool is.

Python runs per stretch of rows, never per row.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cornersmooth.arrays import any_of, some_rows
from cornersmooth.kinematics import solutions
from cornersmooth.kinematics.poses import continued
from cornersmooth.model import Floats, Ints, Move, Program
from cornersmooth.nc.blocks import Blocks
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.coordinates import BlockRows, Coordinates
from cornersmooth.nc.curves import bezier_points
from cornersmooth.nc.messages import Findings, refused
from cornersmooth.nc.modals import Modals
from cornersmooth.nc.planes import turned_part
from cornersmooth.nc.rotary_words import UPRIGHT, machine_of, rows_that_swing
from cornersmooth.smoothing.runs.rows import Rows

NOWHERE = 1 << 62  #: a pose that no program has
#: Z of a turned part for each mm of Z of the machine, below which a block from the retract may come from below its end
_FLAT = 0.7


@dataclass
class Motion:
    """Writes rows, and remembers where the tool is."""

    program: Program
    tilting: Coordinates  #: of tools under tool tip control
    modals: Modals
    blocks: Blocks
    findings: Findings
    #: approach, retract: mm; along the tool, after a retract and before one
    approach: float = 0.0
    retract: float = 0.0
    at: Coordinates = field(init=False)  #: those of the tool at hand
    position: Ints | None = None  #: where the tool is, in ticks; None where it may be elsewhere
    last: Ints | None = None  #: what was written last, before a tool change too
    last_at: Coordinates | None = None  #: and in which coordinates
    text: list[bytes] = field(default_factory=list)  #: that is not handed on yet
    repeated: int = 0  #: rows that move nothing
    return_to: int = NOWHERE  #: first pose after a tool change, until it is reached
    _begun: int = -1  #: last move after a hole or a FROM that has been begun
    _noted: set[str] = field(default_factory=set)  #: codes of what is noted once, or once for each tool

    def __post_init__(self) -> None:
        self.at = self.tilting

    def say(self, blocks: Sequence[str]) -> None:
        """Write blocks that are no rows; G06.2 takes none before a G1."""
        if blocks and self.modals["spline"] and self.at.form.curve == "g6.2":
            self.modals.now["spline"], blocks = False, [self.at.motion.line, *blocks]
        self.blocks.written += len(blocks)
        if blocks:
            self.text.append(("\n".join(blocks) + "\n").encode("ascii"))

    def take(self, at: Coordinates) -> None:
        """Take the coordinates of another tool, or of another tilted plane."""
        if at is not self.at:
            self.at, self.modals.mode = at, at.form.mode
            self.modals.tilt = at.plane.words if at.plane is not None else {}
            self.stand(None)

    def change_tool(self, pose: int) -> None:
        """Take note that the machine is elsewhere, and that another tool may begin at a pose."""
        self.return_to = pose
        self.stand(None)
        self._noted.discard("CS335b")  # noted for each tool

    def lines(self, rows: Rows) -> None:
        """Write rows of one kind."""
        move, arc, program, at = rows.move, self.blocks.circles.of(rows.move), self.program, self.at
        first, kind, start = int(move[0]), program.kind, None
        ticks = at.ticks(rows.tip, rows.other)
        self._go_back(first, rows.other[:1])
        # after a tool change, a hole or a FROM the tool is not at the start of rows
        elsewhere = first not in (0, self._begun) and kind[first - 1] in (Move.FROM, Move.HOLE)
        self._begun = first if elsewhere else self._begun
        if rows.curve[0] == 1 and kind[first] == Move.ARC:
            start = ticks[:1]
        elif (arc is not None and arc[0] >= 0) or (elsewhere and tuple(kind[first - 1 :][:2]) == (Move.FROM, Move.ARC)):
            start = self.ticks_at(rows, program.tip[move[:1] - 1], np.zeros(1, np.int64))
        if start is not None:
            self.emit(self.moving(BlockRows.straight(program, start, move[:1])))
        joined = np.flatnonzero(rows.joined)  # they follow without a line, and have the digits of the row before
        if len(joined) and joined[0] == 0:
            ticks[0] = ticks[0] if self.position is None else self.position
            joined = joined[1:]
        ticks[joined] = ticks[joined - 1]
        feed, mode, bezier = program.feed[move], program.feed_mode[move].astype(np.int64), None
        if rows.rate is not None and at.plane is None:
            timed = ~np.isnan(rows.rate)
            feed, mode = np.where(timed, rows.rate, feed), np.where(timed, INVERSE_TIME, mode)
        if at.form.curve in ("poly", "spl") and rows.spline is not None and (rows.curve > 0).any():
            bezier = bezier_points(at.numbers(rows.tip, rows.other), rows.curve, rows.spline)
        rapid, rest = kind[move] == Move.RAPID, {"spline": rows.spline, "blend": rows.blend, "left": rows.left}
        whole = BlockRows(ticks, move, rapid, feed, mode, rows.curve, arc=arc, bezier=bezier, **rest)  # type: ignore[arg-type]
        moving = self.moving(whole.with_programmed_feed(program) if elsewhere else whole)
        self.repeated += len(whole) - len(moving)
        self.emit_above(moving)

    def _go_back(self, move: int, near: Floats) -> None:
        """Go to the pose after a tool change even if it repeats the last one before, and so is no row."""
        program, at, begin = self.program, self.at, self.return_to
        self.return_to = NOWHERE
        passed = begin + np.flatnonzero(program.kind[begin:move] != Move.FROM)[:1]
        if self.last is None or not len(passed) or program.kind[begin - 1] == Move.HOLE:  # which none repeats
            return
        ticks = self.last[None]
        if self.last_at is not at:
            other = program.axis[passed]
            if at.form.rotary:
                other = continued(machine_of(at.form), other, near, np.array([-1]), 0.0)[0]
            ticks = at.ticks(program.tip[passed], other)
        self.emit(BlockRows.straight(program, ticks, np.array([move])))

    def ticks_at(self, rows: Rows, tips: Floats, own: Ints) -> Ints:
        """Ticks of tips reached with the orientation of rows, which `own` names for each of them."""
        other = rows.other[own]
        if self.at.form.orientation == "point":
            other = other + (tips - rows.tip[own])
        return self.at.ticks(tips, other)

    def rotary_blocks(self, ticks: Ints, *, unwind: bool = True) -> dict[str, tuple[str, ...]]:
        """Blocks of the rotary axes, with where a row has them; a tool that stays along Z has them at zero."""
        if self.at.plane is not None and self.at.plane.angles is not None:
            ticks = self.tilting.ticks(np.zeros((1, 3)), self.at.plane.angles[None])[0]
        return self.tilting.rotary_blocks(ticks, unwind=unwind)

    def moving(self, rows: BlockRows) -> BlockRows:
        """Leave out the rows that do not move the tool in the written digits."""
        ticks = rows.ticks
        new = np.ones(len(ticks), np.bool_)
        new[1:] = any_of(ticks[1:] != ticks[:-1])
        if self.position is not None:
            new[0] = bool((ticks[0] != self.position).any())
        kept = new | (rows.curve > 0)
        return rows if kept.all() else some_rows(rows, kept)

    def emit_above(self, rows: BlockRows, dwell: Sequence[str] = ()) -> None:
        """Write rows; where rotary axes swing the tool in a rapid, or turn back in a cut, the tool goes up before."""
        first = 0
        for row, in_cut in self._turns(rows):
            if row > first:
                self.emit(some_rows(rows, slice(first, row)), dwell)
            if in_cut:
                self._leave_cut(some_rows(rows, slice(row, row + 1)))
            else:
                self.go_home()
            first = row + in_cut
        self.emit(some_rows(rows, slice(first, None)) if first else rows, dwell)

    def emit(self, rows: BlockRows, dwell: Sequence[str] = (), above: float = 0.0) -> None:
        """Write rows; after a retract the tool comes down along its axis from so many mm above."""
        if not len(rows):
            return
        first, pose, at, modals = rows.ticks[0], int(rows.move[0]), self.at, self.modals
        if modals.comes_first and not above:
            self._note_first(pose, rapid=bool(rows.rapid[0]))
        if not modals.begun:
            self.say(modals.begin(self.rotary_blocks(first)))
        self.say(modals.go_on())
        if modals["high"]:
            modals.now["high"] = False
            height = above or self.approach * bool(rows.rapid[0])
            self._note_tilted(first, pose)
            self._approach_first(first, height)
            rows = rows if above else rows.with_programmed_feed(self.program)
        if not modals.tool:
            self._once("CS334" if modals.tool is None else "CS382", pose)
        if not rows.rapid.all():
            self.note_cut(int(rows.move[np.argmin(rows.rapid)]), turning=bool(modals["spindle"]))
        self.stand(rows.ticks[-1])
        self.last_at, modals.halted = at, False
        words, modals.waiting = modals.waiting, ""
        self.text.append(self.blocks.text(rows, at, words, dwell))

    def stand(self, ticks: Ints | None) -> None:
        """Take note of where the tool is, and how it would go back along its axis from there."""
        self.position, self.modals.along = ticks, ()
        if ticks is not None:
            self.last = ticks
            if self.retract:
                self.modals.along = (self.at.rapid(self.at.lifted(ticks, self.retract)),)

    def go_home(self) -> None:
        """Go to the height of the retract, first back along the tool."""
        if self.modals.goes_back and self.modals.along and self.position is not None:
            self.position = self.at.lifted(self.position, self.retract)
        self.say(self.modals.go_home())

    def _turns(self, rows: BlockRows) -> list[tuple[int, bool]]:
        """Rows before which the tool goes up so that rotary axes turn there, and whether that is within a cut."""
        turns = [] if rows.left is None else [(row, True) for row in np.flatnonzero(rows.left).tolist()]
        if self.at.form.rotary and rows.rapid.any():
            before = rows.ticks[:1] if self.position is None else self.position[None]
            angles, possible = self.at.angles(np.concatenate((before, rows.ticks))), self.modals.can_rewind
            found = rows_that_swing(machine_of(self.at.form), angles, np.append(False, rows.rapid)) - 1
            self.findings.note_each("CS341" if possible else "CS340", self.program.line[rows.move[found]])
            turns += [(row, False) for row in found.tolist() if possible]
        return sorted(turns)

    def _leave_cut(self, back: BlockRows) -> None:
        """Leave a cut along the tool, and come back to the row where it goes on, with other rotary words, at feed."""
        assert self.position is not None
        if self.modals["compensation"]:
            raise refused("CS377", self.program, int(self.program.line[back.move[0]]))
        away = self.at.form.rewind
        self.say([self.at.rapid(self.at.lifted(self.position, away))])
        self.say(self.modals.go_home(along=False))
        self.emit(back, above=away)

    def _approach_first(self, first: Ints, above: float) -> None:
        """Bring the tool over its first position, and to where it comes down along its axis."""
        at, down = self.at, bool(above) and self.modals.can_rewind
        start = at.lifted(first, above) if down else first
        # a tilted tool under tool tip control, or in a tilted plane, goes there in one block: X Y alone would run in
        # the plane of the part, which tables have tilted, far aside or down. So do words of a second point, which
        # would turn the tool elsewhere without Z
        if at.form.orientation != "point" and at.tool_axis(start)[2] >= UPRIGHT:
            self.say([at.rapid(start, chosen=np.arange(len(start)) != 2)])
        if down:
            words, self.modals.waiting = self.modals.waiting, ""
            self.say([at.rapid(start, words)])

    def _note_tilted(self, first: Ints, pose: int) -> None:
        """Warn where the block that leads a tilted tool from the retract may come from below its end (CS392).

        Tables have turned the part: for each mm of Z of the machine it goes up by less, and maybe aside by more.
        """
        at, form, axis = self.at, self.at.form, self.at.tool_axis(first)
        if form.orientation not in ("angles", "fixed") or axis[2] >= UPRIGHT or "{rotary_zero}" in form.begin:
            return
        rise = float(axis[2])
        if form.machine is not None:
            known = at.angles(first[None])[0] if at.plane is None else at.plane.angles
            ways = solutions(form.machine, axis[None]).angles[0] if known is None else [known]
            rise = min(float(turned_part(form.machine, angles)[2, 2]) for angles in ways)
        if rise < _FLAT:
            self.findings.note("CS392", int(self.program.line[pose]))

    def _once(self, code: str, pose: int, **values: object) -> None:
        if code not in self._noted:
            self._noted.add(code)
            self.findings.note(code, int(self.program.line[pose]), 1, **values)

    def _note_first(self, pose: int, *, rapid: bool) -> None:
        """Say that the control turns the tool on its own before its first position, or feeds to it."""
        form, line = self.at.form, int(self.program.line[pose])
        if self.program.axis[pose][2] < UPRIGHT:
            if form.orientation in ("vector", "point"):
                self.findings.note("CS337", line)
            elif form.orientation == "angles" and "{rotary_zero}" in form.begin:
                self.findings.note("CS337b", line)
        if not rapid:
            where = "down from the height of the retract" if form.table.program.retract else "from where the machine is"
            self.findings.note("CS333", line, where=where)

    def note_cut(self, pose: int, *, turning: bool) -> None:
        """Say that a tool cuts while the spindle stands."""
        if not turning:
            self._once("CS335b", pose)
