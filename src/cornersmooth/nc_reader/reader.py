"""NC text to `NcProgram`: lines are read one after another, and path elements are given out as they come."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from typing import Final, NoReturn

import numpy as np

from cornersmooth.control.source import Readable, read_lines
from cornersmooth.control.state import State
from cornersmooth.control.words import MOTION_CODES, NURBS, Line, Table, joined_tables, table_of
from cornersmooth.errors import InputError
from cornersmooth.model import MM_PER_UNIT, Floats, Units
from cornersmooth.nc_reader.acts import ASIDE, NOT_ABOVE, Act, Beside, Move, Running, Tilt, TiltedPlane, ToMachine
from cornersmooth.nc_reader.dialects import ReadingOptions, Steps
from cornersmooth.nc_reader.elements import RETRACT, Element, Elements, Event, Problem, Second
from cornersmooth.nc_reader.execution import Modal, execute, in_mm
from cornersmooth.nc_reader.needed_states import (
    AS_WRITTEN,
    UNWRAPPED,
    Run,
    clamp_problems,
    control_problems,
    kinematics_problems,
    plane_problems,
)
from cornersmooth.nc_reader.retracts import Retracts
from cornersmooth.nc_reader.rotary import MOST_LINES

#: groups that are known where the tool moves
_HOLDS: Final = tuple("units feed distance plane tip tool_length orientation coordinates way smoothing".split())

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

    def __init__(self, name: str | None, options: ReadingOptions, lever: float | None = None) -> None:
        self.name, self.options, self.dialect, self.steps = name, options, options.dialect, Steps()
        rotary = options.rotary(self.steps)
        clamped = {} if rotary is None else {axis.name: True for axis in rotary.machine.axes if axis.clamp is not None}
        modal = Modal(rotary="" if rotary is None else rotary.names)
        self.state = Running(State(options.table, (*"XYZABCIJK",)), modal, rotary, clamped=clamped)
        self._lost = ""  # words since the last motion that may have changed what holds
        self._tool = -1.0  # that has been chosen
        self._left_at: Floats | None = None  # where a tool of another length has left
        self._waiting: list[Table] = []
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
        self.retracts = Retracts(name, self.problems, np.zeros(2) if rotary is None else rotary.zero)
        self._last: Floats | None = None  # where the last element that was given out ends

    def lines(self, source: Readable) -> Iterator[Table | Line]:
        """Read lines, and take note of the digits of all of them."""
        return read_lines(source, self.name, self.dialect.lexer, show=self.note_digits)

    def note_digits(self, lines: Iterable[bytes]) -> None:
        """Take the digits of some lines where they are finer than those before."""
        finer, before = self.steps.finer(self.dialect.steps(lines)), self.state.rotary
        rotary = self.options.rotary(finer) if finer != self.steps else None
        if before is not None and rotary is not None:  # the tool stays
            self.state.rotary = replace(rotary, machine=before.machine)
        self.steps = finer

    def chunks(self, items: Iterable[Table | Line]) -> Iterator[Elements]:
        """Take runs of motion blocks and other lines, and give out the path elements as they come."""
        for item in items:
            if isinstance(item, Table):
                self._rows(item)
            elif item.words:
                self._line(item)
            if self.placed and self.elements - self.given_out >= GIVEN_OUT:
                yield self._collected()
        self._flush()
        free = [name for name, clamped in self.state.clamped.items() if not clamped]
        self.problems += [Problem("CS538", 0, 0, f"{name} is not clamped at the end") for name in free]
        self.retracts.end(turned=False)
        self._settle()
        if self.ready:
            yield self._collected()

    # what comes in: runs of motion blocks, which wait until another line wants their state, and other lines

    def _rows(self, table: Table) -> None:
        """Take a run of motion blocks."""
        # the first block that moves Z behind a retract is looked at with what it leads to
        leads = self.retracts.open and sum(map(len, self._waiting)) <= FEW_ROWS
        if table.closed and len(table) + len(self._waiting) > FEW_ROWS and not leads:
            self._flush()
        self._waiting.append(table)
        self.blocks += len(table)

    def _line(self, line: Line) -> None:
        """Take a line that is not part of a run."""
        self.blocks += 1
        self._flush()
        if self.state.modal.code == NURBS and not any(
            word[:1] == ("G",) and word.value in MOTION_CODES for word in line.words
        ):
            self._wrong("CS511", line, "words after a curve, which takes control points alone until G1 or G0 ends it")
        units, elements = self.units, self.elements
        self._take(line)
        try:
            for act in self.dialect.acts(line, self.state):
                self._carry_out(line, act)
        except InputError as error:
            raise InputError(error.code, error.what, error.hint, file=self.name, line=error.line) from None
        if elements and self.units != units:
            self._wrong("CS504", line, "units are changed in the middle of the path")
        if self.elements > elements and self.state.modal.code != 0.0 and not self.dialect.order:
            means, words = self.dialect.means, [word.spelling for word in line.words]
            text = "{} beside a feed move, which the machine runs before, with or after it"
            spindle = [text.format(word) for word in words if means.get(word, ("",))[0] == "spindle"]
            self.unlooked += [(line.number, one) for one in spindle]
        self.events += [replace(event, element=self.elements) for event in self.late]
        self.late = []

    def _take(self, line: Line) -> None:
        """Change what holds; what is not known any more is taken to hold, and motion under it was not looked at."""
        if self.blocks == 1 and line.words[0].name == "O":  # the name of the program
            return
        machine, before = self.state.machine, self.state.machine.groups
        self.state.machine = machine = machine.after(line)
        lost = [name for name in _HOLDS if machine.groups.get(name) is None and before.get(name) is not None]
        if lost:
            self._lost = " ".join(word.text for word in line.words)
            machine.groups |= {name: before[name] for name in lost}

    def _carry_out(self, line: Line, act: Act) -> None:
        """Carry out what a line does."""
        match act:
            case Move():
                self._move(line, act.columns, later=act.later)
            case Beside():
                self._beside(line, act)
            case Tilt(plane, turn):
                self._turn_to_plane(line) if turn else self._tilt(line, plane)
            case ToMachine():
                self._leave(line, act.axes)
            case Problem():
                self._note([act])

    def _move(self, line: Line, row: Mapping[str, float], *, later: bool) -> None:
        """Execute a single motion block, `later` with those behind it; one without position only changes what holds."""
        if row.keys() & self.dialect.lexer.places or row.keys() & set("XYZIJKUVW"):
            self._waiting.append(table_of([(line.number, row)]))
            if not later:
                self._flush()
        else:
            modal = self.state.modal
            self.state.modal = replace(modal, code=row.get("G", modal.code), feed=row.get("F", modal.feed))

    def _beside(self, line: Line, word: Beside) -> None:
        """Take a word that stands beside the motion."""
        self._flush()
        letter, value, rotary = word.letter, word.value, self.state.rotary
        if letter == "T":
            self._tool = value
        elif letter == "S":
            self.state.speed = value
        elif letter == "M" and rotary is not None:
            if value == 6.0:
                self._take_tool()
            for axis in rotary.machine.axes:
                clamp = [float(text[1:]) for text in axis.clamp or ()]
                if value in clamp:
                    self.state.clamped[axis.name] = value == clamp[0]
                    return
        event = Event(self.elements, line.number, *word)
        (self.late if self.dialect.after_motion(letter, value) else self.events).append(event)

    def _take_tool(self) -> None:
        """Go on with the length of another tool."""
        assert self.state.rotary is not None
        before, last = self.state.rotary.machine, self.ready[-1].tip[-1] if self.ready else self._last
        machine = before.with_tool(int(self._tool))
        self.state.rotary = replace(self.state.rotary, machine=machine)
        if machine.tool_length != before.tool_length:
            self._left_at = last

    def _tilt(self, line: Line, plane: TiltedPlane | None) -> None:
        """Switch a tilted plane on, or the one that is on off (None)."""
        state, before = self.state, self.state.plane
        if plane is None and before is None:
            return
        if plane is not None and before is not None:
            self._wrong("CS506", line, "a tilted plane within another")
        if state.tip_control:
            under = f"a tilted plane under {state.tip_control}"
            self._wrong("CS506", line, under if plane is not None else f"the end of {under}")
        ends = "a tilted plane ends where the tool is not retracted"
        self._above(line, ends if plane is None else "a tilted plane where the tool is not retracted")
        self.retracts.end(turned=True)
        state.plane, state.left_turned = plane, plane is None
        if plane is not None:
            self._told = set()
            self._leave(line, "XYZ")
            self._turn(line, plane)
        elif before is not None:
            state.modal = before.left(state.modal, rotary=state.rotary is not None)

    def _turn_to_plane(self, line: Line) -> None:
        """Turn the rotary axes to the tilted plane that is on."""
        if self.state.plane is None or self.state.plane.turned:
            self._wrong("CS506", line, "the tool is turned to a tilted plane, and none waits for it")
            return
        self._above(line, "the tool is turned to a tilted plane where it is not retracted")
        self._turn(line, replace(self.state.plane, turned=True))

    def _turn(self, line: Line, plane: TiltedPlane) -> None:
        """Switch a tilted plane on; rotary axes that it turns must not be clamped."""
        self.state.plane = plane
        for name in [name for name, clamped in self.state.clamped.items() if clamped and plane.turned]:
            self._wrong("CS538", line, f"{name} turns to a tilted plane while it is clamped")

    def _above(self, line: Line, text: str) -> None:
        """Complain where the tool is not above a retract."""
        if not self.retracts.open:
            self._wrong(NOT_ABOVE, line, text)

    def _leave(self, line: Line, axes: str) -> None:
        """Say that axes go to positions of the machine."""
        state = self.state
        self.retracts.leave(self.elements, self._words(state.modal))
        self.events.append(Event(self.elements, line.number, RETRACT, 0.0))
        gone = "XYZ" if state.plane is not None else axes
        tip = (math.nan if axis in gone else at for axis, at in zip("XYZ", state.modal.tip, strict=True))
        state.modal = replace(state.modal, tip=tuple(tip))

    def _wrong(self, code: str, line: Line, text: str) -> None:
        """Note what breaks the rules of the control."""
        self.problems.append(Problem(code, 0, line.number, text))

    def _note(self, problems: Iterable[Problem], *, once: bool = False) -> None:
        """Note problems, those that come `once` only where their texts are new; without a code it was not looked at."""
        for problem in problems:
            if not problem.code:
                self.unlooked.append((problem.nc_line, problem.text))
            elif not (once and problem.text in self._told):
                self.problems.append(problem)
                self._told |= {problem.text} if once else set()

    # what waits becomes path elements

    def _flush(self) -> None:
        """Execute the motion blocks that wait."""
        if self._waiting:
            for table in joined_tables(self._waiting, sys.maxsize if self.retracts.open else FEW_ROWS):
                self._execute(table)
            self._waiting = []

    def _execute(self, table: Table) -> None:
        state, before = self.state, self.state.modal
        if self._lost:
            self.unlooked.append((int(table.line[0]), f"motion after {self._lost}, which may change what holds"))
            self._lost = ""
        if state.machine.groups["distance"] == "incremental":
            what, hint = "motion in incremental words (G91)", "write G90 after a position of the machine"
            raise InputError("CS503", what, hint, file=self.name, line=int(table.line[0]))
        elements, state.modal = execute(table, before, state.machine, self.problems)
        run = Run(table, elements, before, state, self.dialect)
        if state.rotary is not None:
            self._note(clamp_problems(run))
        if self.retracts.coming:
            run = self._come_back(run)
            if not len(run.elements):
                if state.rotary is None:  # a vector is no rapid's on the way back either
                    self._note(control_problems(run), once=True)
                return
        if state.plane is not None:
            self._note(plane_problems(run), once=True)
            self._add(state.plane.in_part(self._in_mm(run), MM_PER_UNIT[self.units]))
            return
        self._note(control_problems(run), once=True)
        if state.modal.points and not before.points:  # what was written before of the axis is no point on it
            if self.placed:
                self._refuse_unknown(int(run.elements.line[0]))
            for part in self.ready:
                part.second[:] = np.nan
        elements = self._in_mm(run)
        self._add(elements if state.rotary is None else self._resolved(replace(run, elements=elements)))

    def _come_back(self, run: Run) -> Run:
        """Leave out what is on the way back from a retract."""
        state, whole = self.state, run.elements
        alone = state.machine.groups["tip"] == "off" and (self.dialect.asks_tip or not state.tip_control)
        free = state.rotary is not None and alone
        kept = self.retracts.arrive(whole, self._words(run.before), free=free)
        approach = frozenset(whole.line.tolist()).difference(kept.line.tolist())
        before = run.before
        if state.rotary is not None and 0 < len(kept) < len(whole):  # on the way back axes turn, too
            before = replace(before, second=tuple(whole.second[-len(kept) - 1].tolist()))
        return replace(run, elements=kept, before=before, approach=approach)

    def _words(self, modal: Modal) -> Floats:
        """(6,) words of tip and second triple that hold; without any word of a vector the tool is upright."""
        unsaid = not (modal.rotary or modal.points) and math.isnan(modal.second[0])
        return np.array((*modal.tip, *((0.0, 0.0, 1.0) if unsaid else modal.second)))

    def _in_mm(self, run: Run) -> Elements:
        inch_feed, step = self.dialect.inch_feed, self.dialect.feed_step
        points = self.state.modal.points
        return in_mm(run.elements, self.state.machine, points=points, inch_feed=inch_feed, feed_step=step)

    def _resolved(self, run: Run) -> Elements:
        """Elements of a run in rotary words, in mm, as tips and tool vectors."""
        elements, before, factor = run.elements, run.before, MM_PER_UNIT[self.units]
        if run.machine.names and len(elements.curves):
            line = int(elements.line[elements.curves.element[0]])
            raise InputError("CS503", "a curve in rotary words", "write it as lines", file=self.name, line=line)
        self._note(chain.from_iterable(rule(run) for rule in AS_WRITTEN))
        self._note(kinematics_problems(run), once=True)
        elements = replace(elements, second=run.rotary.unwrapped(elements.second, before.second))
        run = replace(run, elements=elements)
        if len(elements):
            self._note(chain.from_iterable(rule(run) for rule in UNWRAPPED))
        self.state.left_turned = False
        rotary = replace(run.rotary, tip_step=factor * run.rotary.tip_step)
        start = replace(before, tip=tuple(factor * value for value in before.tip))
        inverse_time = self.state.machine.groups["feed"] == "inverse"
        found = rotary.resolve(elements, start, inverse_time=inverse_time)
        lines, count = np.unique(found.line, return_counts=True)
        turned = "the way of a block that turns very far"
        self.unlooked += [(line, turned) for line in lines[count >= MOST_LINES].tolist()]
        levers = run.rotary.levers(found.tip)
        self.lever = max(self.lever, float(levers.max(initial=0.0, where=~np.isnan(levers))))
        return found

    # what comes out

    def _add(self, run: Elements) -> None:
        """Take over the elements of a run."""
        if not len(run):
            return
        state, plane, rotary = self.state, self.state.plane, self.state.rotary
        second_is: Second = "point" if state.modal.points else "vector"
        scale = MM_PER_UNIT[self.units]
        length = state.modal.vector_length if math.isfinite(state.modal.vector_length) else 1.0
        steps = (self.steps.tip * scale, self.steps.second * (scale if second_is == "point" else 1.0 / length))
        if rotary is not None:
            lever = self.lever if self._given_lever is None else self._given_lever
            steps = replace(rotary, tip_step=steps[0]).steps(lever)
        widest, turn = self.options.widest
        self.coarse = (self.coarse or int(run.line[0])) if steps[0] > widest else 0
        steps = min(steps[0], widest), min(steps[1], widest if second_is == "point" else turn)
        if rotary is not None:
            left_at, self._left_at = self._left_at, None
            if left_at is not None and np.linalg.norm(run.tip[0] - left_at) <= steps[0]:
                run.tip[0] = left_at  # another tool is put to where the one before has left
            run = replace(run, rotary=rotary.machine, tip_control=rotary.tip_control)
        run = replace(run, second_is=second_is, tip_step=steps[0], second_step=steps[1])
        if plane is not None:
            run.second_room[:], run.tip_room[:] = min(plane.room, turn / 2.0), ASIDE * run.tip_step
        self.ready.append(run)
        self.elements += len(run)
        self.curves += len(run.curves)
        if not self.placed and (run.kind != Element.RAPID).any():
            self._settle()

    def _settle(self) -> None:
        """Put the tool where words of the position that come late send it first, as long as it moves at rapid only."""
        if self.placed or not self.ready:
            return
        whole = Elements.joined(self.ready)
        whole = replace(whole, tip=whole.tip.copy(), second=whole.second.copy())
        feed = whole.kind != Element.RAPID
        for values in (whole.tip, whole.second):
            unknown = np.isnan(values)
            if not unknown[0].any():  # what has been written holds
                continue
            first = np.where(unknown.all(axis=0), len(values), unknown.argmin(axis=0))
            if feed[: int(first.max()) + 1].any():
                # the first move has no start that could be known, but it has an end
                row = max(int(feed.argmax()), int(first.min()))
                self._refuse_unknown(int(whole.line[min(row, len(values) - 1)]))
            for column, begin in zip(values.T, first.tolist(), strict=True):
                column[:begin] = column[begin] if begin < len(column) else 0.0
        self.ready, self.placed = [whole], bool(feed.any())

    def _refuse_unknown(self, line: int) -> NoReturn:
        hint = "say X Y Z, and U V W where there are any, before the first feed"
        raise InputError("CS503", "a feed move where not all of the position is known", hint, file=self.name, line=line)

    @property
    def nothing(self) -> Elements:
        """No elements at all."""
        none, _ = execute(table_of([(0, {"G": 0.0})]), self.state.modal, self.state.machine, [])
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
        return "inch" if self.state.machine.groups["units"] == "inch" else "mm"
