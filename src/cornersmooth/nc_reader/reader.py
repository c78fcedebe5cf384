"""Holds the modal state of a control while lines are read, and gives out path elements as they come."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NoReturn

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import MM_PER_UNIT, Floats, Units
from cornersmooth.nc_reader.acts import (
    Act,
    Beside,
    ModalState,
    Modes,
    Move,
    Tilt,
    ToMachine,
    TurnToPlane,
    Unknown,
    Wrong,
)
from cornersmooth.nc_reader.elements import RETRACT, Element, Elements, Event, NcProgram, Problem, Second, settle
from cornersmooth.nc_reader.execution import Modal, execute, in_mm
from cornersmooth.nc_reader.needed_states import (
    away_problems,
    axis_problems,
    clamp_problems,
    control_problems,
    idle_turns,
    kinematics_problems,
    late_turns,
    take_clamp,
    turn_problems,
)
from cornersmooth.nc_reader.options import DIGITS_SAMPLE, ReadingOptions, Steps
from cornersmooth.nc_reader.planes import ASIDE, NOT_ABOVE, TiltedPlane
from cornersmooth.nc_reader.retracts import Retracts
from cornersmooth.nc_reader.rotary import MOST_LINES
from cornersmooth.nc_reader.source import Readable, Source, read_lines, readable_twice
from cornersmooth.nc_reader.word_tables import word_table
from cornersmooth.nc_reader.words import MOTION_CODES, Line, Table, joined_tables, table_of

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: share of the tolerance, at the axis point, that a tool without words for its axis may lean
FIXED_SHARE: Final = 0.1

#: runs of fewer blocks are executed together
FEW_ROWS: Final = 64

#: elements that are given out together
GIVEN_OUT: Final = 1 << 15


class Reader:
    """Collects what the lines say; holds the modal state of the control, for the dialects.

    Parameters
    ----------
    lever : float, optional
        Longest distance, mm, at which rotary axes move the tip; as far as the text goes by default.
    """

    def __init__(self, name: str | None, options: ReadingOptions, steps: Steps, lever: float | None = None) -> None:
        self.name, self.options, self.dialect, self.steps = name, options, options.dialect, steps
        rotary = options.rotary(steps)
        clamps = rotary.machine.axes if rotary is not None else ()
        clamped = {axis.name: True for axis in clamps if axis.clamp is not None}
        self.state = ModalState(Modal(rotary="" if rotary is None else rotary.names), rotary, clamped=clamped)
        self._tool = -1.0  # that has been chosen
        self._idle = np.zeros(2)  # degrees that rotary axes have turned while the tool axis stands
        self._left_at: Floats | None = None  # where a tool of another length has left
        self.waiting: list[Table | tuple[int, dict[str, float]]] = []
        self.ready: list[Elements] = []
        self.events: list[Event] = []
        self.late: list[Event] = []
        self.problems: list[Problem] = []
        self._told: set[str] = set()  # texts of problems that come once for each tilted plane
        self.lever, self._given_lever = 0.0, lever
        self.elements = self.given_out = self.curves = 0
        #: whether the tool has been fed from a position that was known
        self.placed = False
        self.blocks = 0
        #: NC line from which on digits of X Y Z are too few for the tolerance; 0 for none
        self.coarse = 0
        #: what was not looked at, and the NC line
        self.unlooked: list[tuple[int, str]] = []
        zero = [min(max(0.0, np.ceil(axis.low)), np.floor(axis.high)) for axis in clamps]
        self.retracts = Retracts(name, self.problems, zero)
        #: the tilted plane that is on
        self.plane: TiltedPlane | None = None
        #: whether a plane that is off again has left the rotary axes where no word says
        self._left_turned = False
        self._last: Floats | None = None  # where the last element that was given out ends

    def lines(self, source: Readable) -> Iterator[Table | Line]:
        """Read lines, and take note of the digits of all of them."""
        return read_lines(source, self.name, self.dialect.lexer, show=self.note_digits)

    def note_digits(self, lines: bytes) -> None:
        """Take the digits of some lines where they are finer than those before."""
        finer = self.steps.finer(self.options.steps(lines))
        if finer != self.steps:
            self.steps, self.state.rotary = finer, self.options.rotary(finer)

    def chunks(self, items: Iterable[Table | Line]) -> Iterator[Elements]:
        """Take runs of motion blocks and other lines, and give out the path elements as they come."""
        for item in items:
            if isinstance(item, Table):
                self.rows(item)
            else:
                self.line(item)
            if self.placed and self.elements - self.given_out >= GIVEN_OUT:
                yield self._collected()
        self.flush()
        free = [name for name, clamped in self.state.clamped.items() if not clamped]
        self.problems += [Problem("CS538", 0, 0, f"{name} is not clamped at the end") for name in free]
        self.retracts.end(turned=False)
        self._settle()
        if self.ready:
            yield self._collected()

    def rows(self, table: Table) -> None:
        """Take a run of motion blocks."""
        # the first block that moves Z behind a retract is looked at with what it leads to
        leads = self.retracts.open and bool(self.waiting) and not isinstance(self.waiting[-1], Table)
        if not leads and len(table) + len(self.waiting) > FEW_ROWS and (table.closed or self._code in MOTION_CODES[:4]):
            self.flush()
        self.waiting.append(table)
        self.blocks += len(table)

    def line(self, line: Line) -> None:
        """Take a line of another kind."""
        if line.words:
            self.blocks += 1
        row = self.dialect.row(line) if line.words else None
        if row is not None:
            self.waiting.append((line.number, row))
        elif line.words:
            self.flush()
            try:
                for act in self.dialect.acts(line, self.state):
                    self._carry_out(line, act)
            except InputError as error:
                raise InputError(error.code, error.what, error.hint, file=self.name, line=error.line) from None
            self.events += [replace(event, element=self.elements) for event in self.late]
            self.late = []

    def flush(self) -> None:
        """Execute the motion blocks that wait."""
        if not self.waiting:
            return
        factor = MM_PER_UNIT[self.units]
        for table in joined_tables(self.waiting, sys.maxsize if self.retracts.open else FEW_ROWS):
            before = self.state.modal
            if self.state.incremental:
                what, hint = "motion in incremental words (G91)", "write G90 after a position of the machine"
                raise InputError("CS503", what, hint, file=self.name, line=int(table.line[0]))
            run, self.state.modal = execute(table, before, self.problems)
            if self.state.rotary is not None:
                self.problems += clamp_problems(run, before.second, self.state.rotary.machine, self.state)
            approach: frozenset[int] = frozenset()
            if self.retracts.coming:
                whole, run = run, self.retracts.arrive(run, self._words(before), free=self._turns_alone)
                approach = frozenset(whole.line.tolist()).difference(run.line.tolist())
                if not len(run.kind):
                    if self.state.rotary is None:  # a vector is no rapid's on the way back either
                        how = self.state, self.dialect, before.code, approach, self.unlooked
                        self._tell_once(control_problems(table, *how))
                    continue
                if self.state.rotary is not None and len(run.kind) < len(whole.kind):  # on the way back axes turn, too
                    before = before.but(second=tuple(whole.second[-len(run.kind) - 1].tolist()))
            if self.plane is not None:
                self._in_plane(table, run, self.plane, factor, before)
                continue
            self._tell_once(control_problems(table, self.state, self.dialect, before.code, approach, self.unlooked))
            if self.state.modal.points and not before.points:
                self._know_points(run)
            run = self._in_mm(run, before)
            if self.state.rotary is not None:
                start = before.but(tip=tuple(factor * value for value in before.tip))
                rotary = replace(self.state.rotary, tip_step=factor * self.state.rotary.tip_step)
                machine, way = rotary.machine, self.dialect.shorter_way
                if machine.names and len(run.curves):
                    line = int(run.line[run.curves.element[0]])
                    raise InputError("CS503", "a curve in rotary words", "write it as lines", file=self.name, line=line)
                self.problems += axis_problems(table, machine, way, self.state, rotary.angle_step)
                bare = rotary.tip_control and self.state.tip_control in self.dialect.controls.get("machine", ())
                if bare and machine.names and not self.dialect.switches:
                    self._tell_once(away_problems(run, machine, rotary.angle_step))
                if self.dialect.switches:
                    tip_control = rotary.tip_control
                    self._tell_once(kinematics_problems(run, machine, self.state, tip_control=tip_control))
                run = replace(run, second=rotary.unwrapped(run.second, before.second))
                self.problems += turn_problems(run, before.second, machine)
                if machine.names:
                    self.unlooked += idle_turns(run, before.second, machine, rotary.angle_step, self._idle)
                self.problems += late_turns(run, before, machine, left_turned=self._left_turned)
                self._left_turned = False
                if self.dialect.retracts:
                    text = "rotary axes swing the tilted tool in a rapid that is not above a retract"
                    lines = run.line[rotary.swung(run, start)]
                    self.problems += [Problem("CS537", 0, line, text) for line in lines.tolist()]
                words = np.nan_to_num(np.vstack((before.second, run.second)))
                at = run.arcs.element
                on_arc = at[(words[at + 1] != words[at]).any(axis=1)]
                self.unlooked += [(line, "an arc on which an axis turns") for line in run.line[on_arc].tolist()]
                run = rotary.resolve(run, start, inverse_time=before.inverse_time)
                lines, count = np.unique(run.line, return_counts=True)
                turned = "the way of a block that turns very far"
                self.unlooked += [(line, turned) for line in lines[count >= MOST_LINES].tolist()]
                levers = self.state.rotary.levers(run.tip)
                self.lever = max(self.lever, float(levers.max(initial=0.0, where=~np.isnan(levers))))
            self._add(run)
        self.waiting = []

    def _in_plane(self, table: Table, run: Elements, plane: TiltedPlane, factor: float, before: Modal) -> None:
        """Take over a run in a tilted plane."""
        axis_words = self.state.rotary.names if self.state.rotary is not None else "IJKUVW"
        self._tell_once(plane.problems(table, run, self.state.tip_control, axis_words))
        self._add(plane.in_part(self._in_mm(run, before), factor), plane)

    def _in_mm(self, run: Elements, before: Modal) -> Elements:
        inch_feed, step = self.dialect.inch_feed, self.dialect.feed_step
        return in_mm(run, before, points=self.state.modal.points, inch_feed=inch_feed, feed_step=step)

    def _tilt(self, line: Line, plane: TiltedPlane) -> None:
        """Switch a tilted plane on."""
        if self.plane is not None:
            self._wrong("CS506", line, "a tilted plane within another")
        if self.state.tip_control:
            self._wrong("CS506", line, f"a tilted plane under {self.state.tip_control}")
        self._above(line, "a tilted plane where the tool is not retracted")
        self.plane, self._told, self._left_turned = plane, set(), False
        self.retracts.end(turned=True)
        self._leave(line, "XYZ")
        if plane.turned:
            self._turn(line)

    def _turn_to_plane(self, line: Line) -> None:
        """Turn the rotary axes to the tilted plane that is on."""
        if self.plane is None or self.plane.turned:
            self._wrong("CS506", line, "the tool is turned to a tilted plane, and none waits for it")
            return
        self._above(line, "the tool is turned to a tilted plane where it is not retracted")
        self.plane = replace(self.plane, turned=True)
        self._turn(line)

    def _level(self, line: Line) -> None:
        """Switch the tilted plane off, where one is on."""
        if self.plane is None:
            return
        if self.state.tip_control:
            self._wrong("CS506", line, f"the end of a tilted plane under {self.state.tip_control}")
        self._above(line, "a tilted plane ends where the tool is not retracted")
        self.retracts.end(turned=True)
        self.state.modal, self.plane = self.plane.left(self.state.modal, rotary=self.state.rotary is not None), None
        self._left_turned = True

    def _above(self, line: Line, text: str) -> None:
        """Complain where the tool is not above a retract."""
        if not self.retracts.open:
            self._wrong(NOT_ABOVE, line, text)

    def _turn(self, line: Line) -> None:
        """Complain of rotary axes that are clamped where a plane turns them."""
        for name, clamped in self.state.clamped.items():
            if clamped:
                self._wrong("CS538", line, f"{name} turns to a tilted plane while it is clamped")

    @property
    def _code(self) -> float:
        """G word of group 01 behind what waits."""
        for item in reversed(self.waiting):
            words = item.column("G") if isinstance(item, Table) else np.array([item[1].get("G", np.nan)])
            known = words[~np.isnan(words)]
            if len(known):
                return float(known[-1])
        return self.state.modal.code

    def _words(self, modal: Modal) -> Floats:
        """(6,) words of tip and second triple that hold; without any word of a vector the tool is upright."""
        unsaid = not (modal.rotary or modal.points) and math.isnan(modal.second[0])
        return np.array((*modal.tip, *((0.0, 0.0, 1.0) if unsaid else modal.second)))

    @property
    def _turns_alone(self) -> bool:
        """Whether rotary words turn their axes, and the tip stays behind."""
        alone = self.state.tip_control in self.dialect.controls.get("machine", ("",))
        return self.state.rotary is not None and alone and not self.state.keeps_tip

    def _take_tool(self) -> None:
        """Go on with the length of another tool."""
        assert self.state.rotary is not None
        before, last = self.state.rotary.machine, self.ready[-1].tip[-1] if self.ready else self._last
        machine = before.with_tool(int(self._tool))
        self.state.rotary = replace(self.state.rotary, machine=machine)
        if machine.tool_length != before.tool_length:
            self._left_at = last

    def _know_points(self, run: Elements) -> None:
        """From here on U V W are a point on the axis: what was written before of the axis is no such point."""
        if self.placed:
            self._refuse_unknown(int(run.line[0]))
        for part in self.ready:
            part.second[:] = np.nan

    def _add(self, run: Elements, plane: TiltedPlane | None = None) -> None:
        """Take over the elements of a run, in a tilted plane or in none."""
        if not len(run.kind):
            return
        second_is: Second = "point" if self.state.modal.points else "vector"
        scale = MM_PER_UNIT[self.units]
        length = self.state.modal.vector_length if math.isfinite(self.state.modal.vector_length) else 1.0
        steps = (self.steps.tip * scale, self.steps.second * (scale if second_is == "point" else 1.0 / length))
        if self.state.rotary is not None:
            lever = self.lever if self._given_lever is None else self._given_lever
            steps = replace(self.state.rotary, tip_step=steps[0]).steps(lever)
        widest = self._widest(second_is)
        self.coarse = (self.coarse or int(run.line[0])) if steps[0] > widest[0] else 0
        steps = min(steps[0], widest[0]), min(steps[1], widest[1])
        if self.state.rotary is not None:
            left_at, self._left_at = self._left_at, None
            if left_at is not None and np.linalg.norm(run.tip[0] - left_at) <= steps[0]:
                run.tip[0] = left_at  # another tool is put to where the one before has left
        rotary = self.state.rotary is not None
        elements = replace(run, second_is=second_is, tip_step=steps[0], second_step=steps[1], rotary=rotary)
        if plane is not None:
            room = min(plane.room, self._widest("vector")[1] / 2.0)
            elements.second_room[:], elements.tip_room[:] = room, ASIDE * elements.tip_step
        self.ready.append(elements)
        self.elements += len(run.kind)
        self.curves += len(run.curves)
        if not self.placed and (run.kind != Element.RAPID).any():
            self._settle()

    def _widest(self, second_is: Second) -> tuple[float, float]:
        """Largest steps of the last printed digits, of tip and second triple, that are accounted for."""
        tip, turn = self.options.widest
        return tip, tip if second_is == "point" else turn

    def _settle(self) -> None:
        """Where words of the position come late, put the tool where they send it first."""
        if self.placed or not self.ready:
            return
        whole = Elements.joined(self.ready)
        whole = replace(whole, tip=whole.tip.copy(), second=whole.second.copy())
        line = settle(whole)
        if line is not None:
            self._refuse_unknown(line)
        self.ready = [whole]
        self.placed = bool((whole.kind != Element.RAPID).any())

    def _refuse_unknown(self, line: int) -> NoReturn:
        hint = "say X Y Z, and U V W where there are any, before the first feed"
        raise InputError("CS503", "a feed move where not all of the position is known", hint, file=self.name, line=line)

    @property
    def nothing(self) -> Elements:
        """No elements at all."""
        none, _ = execute(table_of([(0, {"G": 0.0})]), self.state.modal, [])
        return replace(none, tip_step=self.steps.tip, second_step=self.steps.second)

    def _collected(self) -> Elements:
        """Give out what is ready."""
        found = Elements.joined(self.ready)
        self.ready, self.given_out = [], self.elements
        self._last = found.tip[-1].copy()
        room = np.zeros(len(found))
        if self.state.rotary is not None:
            room = self.state.rotary.pole_room(found.second)
        elif found.second_is == "vector" and not self.steps.second:  # no word says anything of the tool axis
            room += FIXED_SHARE * self.options.tolerance / self.options.axis_length
        return replace(found, second_room=np.where(found.tip_room > 0.0, found.second_room, room))

    @property
    def units(self) -> Units:
        """Units in force."""
        return "inch" if self.state.modal.inch else "mm"

    def _carry_out(self, line: Line, act: Act) -> None:
        """Carry out what a line does."""
        match act:
            case Move():
                self._move(line, act.columns, later=act.later)
            case Modes():
                self._change(line, act.values)
            case Beside():
                self._beside(line, act.letter, act.value, act.text)
            case Tilt(None):
                self._level(line)
            case Tilt(TiltedPlane() as plane):
                self._tilt(line, plane)
            case TurnToPlane():
                self._turn_to_plane(line)
            case ToMachine():
                self._leave(line, act.axes)
            case Wrong():
                self._wrong(act.code, line, act.text)
            case Unknown():
                self.unlooked.append((line.number, act.text))

    def _beside(self, line: Line, letter: str, value: float, text: str) -> None:
        """Take a word that stands beside the motion."""
        self.flush()
        if letter == "T":
            self._tool = value
        elif letter == "S":
            self.state.speed = value
        elif (letter, value) == ("M", 6.0) and self.state.rotary is not None:
            self._take_tool()
        if letter == "M" and self.state.rotary is not None and take_clamp(value, self.state.rotary.machine, self.state):
            return
        event = Event(self.elements, line.number, letter, value, text)
        (self.late if self.dialect.after_motion(letter, value) else self.events).append(event)

    def _move(self, line: Line, row: Mapping[str, float], *, later: bool) -> None:
        """Execute a single motion block, `later` with those behind it; one without position only changes what holds."""
        if row.keys() & self.dialect.lexer.places or row.keys() & set("XYZIJKUVW"):
            self.waiting.append((line.number, dict(row)))
            if not later:
                self.flush()
        elif row.keys() & {"G", "F"}:
            self.state.modal = self.state.modal.but(
                code=row.get("G", self.state.modal.code), feed=row.get("F", self.state.modal.feed)
            )

    def _change(self, line: Line, modes: Mapping[str, Any]) -> None:
        """Change what holds from block to block."""
        self.flush()
        if self.elements and modes.get("inch", self.state.modal.inch) != self.state.modal.inch:
            self._wrong("CS504", line, "units are changed in the middle of the path")
        if modes.get("inverse_time") and self.state.rotary is None:
            what = "inverse time feed (G93) without rotary words"
            raise InputError("CS503", what, "name the machine with --machine", file=self.name, line=line.number)
        self.state.modal = self.state.modal.but(**modes)

    def _leave(self, line: Line, axes: str) -> None:
        """Say that axes go to positions of the machine."""
        self.retracts.leave(self.elements, self._words(self.state.modal))
        self.events.append(Event(self.elements, line.number, RETRACT, 0.0))
        gone = "XYZ" if self.plane is not None else axes
        tip = tuple(math.nan if axis in gone else at for axis, at in zip("XYZ", self.state.modal.tip, strict=True))
        self.state.modal = self.state.modal.but(tip=tip)

    def _wrong(self, code: str, line: Line, text: str) -> None:
        """Note what breaks the rules of the control."""
        self.problems.append(Problem(code, 0, line.number, text))

    def _tell_once(self, problems: Iterable[Problem]) -> None:
        """Note problems whose texts are new."""
        for problem in problems:
            if problem.text not in self._told:
                self._told.add(problem.text)
                self.problems.append(problem)


def read_nc(
    data: bytes | str | os.PathLike[str],
    *,
    control: str = "fanuc",
    machine: Machine | None = None,
    tcp: bool = True,
    name: str | None = None,
    tolerance: float = 0.01,
    axis_length: float = 10.0,
) -> NcProgram:
    """Read an NC text.

    Parameters
    ----------
    data : bytes or path
        The text itself, or the file that holds it.
    control : str
        One of `CONTROLS`.
    machine : Machine, optional
        That the rotary words of the text are for; without one it has tool vectors, axis points or a fixed tool.
    tcp : bool
        Whether X Y Z are the tip, or positions of the machine's axes.
    name : str, optional
        Name for messages; the file's own by default.
    tolerance, axis_length : float, mm
        How fine motion in rotary words is resolved: to a two-hundredth of `tolerance` at tip and axis point.

    Returns
    -------
    NcProgram
        What breaks the rules of the control is in `NcProgram.problems`, as far as the rest can be understood.

    Raises
    ------
    InputError
        CS501 where the text is not made of words, CS503 for words that make it impossible to tell where the tool is.
    SettingsError
        CS204 for an unknown control, CS215 for positions of a machine that is not named.
    """
    options = ReadingOptions.of(control, machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length)
    label = name if name is not None or isinstance(data, bytes) else str(data)
    source = Source(readable_twice(data))
    try:
        source.finish()
        reader = Reader(label, options, options.steps(source.head(DIGITS_SAMPLE)))
        return program_of(reader, list(reader.chunks(reader.lines(source))))
    finally:
        source.close()


def program_of(reader: Reader, parts: list[Elements]) -> NcProgram:
    """Put together what was given out, and what the text says beside the motion."""
    elements = Elements.joined(parts) if parts else reader.nothing
    return NcProgram(
        **vars(elements),
        events=tuple(sorted(reader.events, key=lambda event: event.line)),
        problems=tuple(reader.problems),
        units=reader.units,
        blocks=reader.blocks,
        means=reader.dialect.means,
        feed_in_plane=word_table(reader.dialect.control).get("feed_in_plane", False),
        retracts=tuple(reader.retracts.places),
        unlooked=tuple(reader.unlooked),
        coarse=reader.coarse,
    )
