"""NC text to `NcProgram`: what a control makes of it, block by block, with nothing known of who wrote it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, NoReturn

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import MM_PER_UNIT, Floats, Ints, Units
from cornersmooth.nc_reader.block_tables import read_lines
from cornersmooth.nc_reader.dialects import CONTROLS
from cornersmooth.nc_reader.dialects.base import HIGH_SPEED, INCREMENTAL
from cornersmooth.nc_reader.elements import (
    Curves,
    Element,
    Elements,
    Event,
    NcArcs,
    NcProgram,
    Problem,
    Second,
    settle,
)
from cornersmooth.nc_reader.execution import Executed, Modal, execute
from cornersmooth.nc_reader.reading_options import DIGITS_SAMPLE, ReadingOptions, Steps
from cornersmooth.nc_reader.source import Source, readable_twice
from cornersmooth.nc_reader.way_back import WayBack
from cornersmooth.nc_reader.words import MOTION_CODES, NURBS, Line, Table, joined_tables

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

__all__ = ["CONTROLS", "read_nc"]

#: share of the tolerance, at the axis point, that a tool without words for its axis may lean
FIXED_SHARE: Final = 0.1

#: code of words that want another state of the control
CONTROL_WORDS: Final = "CS506"

#: runs of fewer blocks are executed together: each folded block of Klartext is a run of its own
FEW_ROWS: Final = 64

#: elements that are given out together
GIVEN_OUT: Final = 1 << 15

#: words that say what is in force when it must be
_NEEDS = {
    "vector": "a tool vector",
    "point": "a second point on the tool axis",
    "angles": "tip and rotary words",
    "machine": "words of the machine's axes",
}


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
    return read_styled(
        data, ReadingOptions.of(control, machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length), name
    )


def read_styled(data: bytes | str | os.PathLike[str], options: ReadingOptions, name: str | None = None) -> NcProgram:
    """Read an NC text; see `read_nc`."""
    label = name if name is not None or isinstance(data, bytes) else str(data)
    source = Source(readable_twice(data))
    try:
        source.finish()
        reader = Reader(label, options, options.steps(source.head(DIGITS_SAMPLE)))
        reader.comments = []
        reader.way_back.added = reader.note_along_tool
        parts = list(reader.chunks(read_lines(source, label, options.dialect.lexer)))
        return reader.program(parts)
    finally:
        source.close()


class Reader:
    """Collects what the lines say; holds the modal state of the control (`dialects.State`).

    Parameters
    ----------
    name : str or None
        For messages.
    options : ReadingOptions
    steps : Steps
    lever : float, optional
        Longest distance, mm, at which rotary axes move the tip; as far as the text goes by default.
    """

    def __init__(self, name: str | None, options: ReadingOptions, steps: Steps, lever: float | None = None) -> None:
        self.name, self.options, self.dialect, self.steps = name, options, options.dialect, steps
        self.rotary = options.rotary(steps)
        self.modal = Modal(rotary=self.rotary.names if self.rotary is not None else "")
        self.tip_control = ""
        self.memory: dict[str, Any] = {}
        self.waiting: list[Table | tuple[int, dict[str, float]]] = []
        self.ready: list[Elements] = []
        self.events: list[Event] = []
        self.late: list[tuple[Line, str, float, str]] = []
        self.comments: list[tuple[int, str]] | None = None
        self.problems: list[Problem] = []
        self.complained: set[tuple[str, str]] = set()
        self.lever, self._given_lever = 0.0, lever
        self.elements = self.given_out = self.curves = 0
        #: elements before any word of a second point on the axis
        self.pointless = 0
        #: whether the tool has been fed from a position that was known
        self.placed = False
        self.blocks = 0
        self.way_back = WayBack(name)
        #: the last element that was given out, if any
        self.given: list[Elements] = []
        #: elements up to a rapid along the tool before a retract that nobody asked for
        self.withdrawn = -1
        #: see `NcProgram.along_tool`
        self.along_tool: list[tuple[int, bool]] = []

    def note_along_tool(self, start: Floats, end: Floats, step: float, near: Floats) -> bool:
        """Note a rapid along the tool beside a retract; whether the CL file has it must be found out later."""
        back = np.array_equal(start, near)
        self.along_tool.append((self.elements - back, bool(back)))
        return False

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
        self._settle()
        if self.ready:
            yield self._collected()

    def rows(self, table: Table) -> None:
        """Take a run of motion blocks."""
        if len(table) + len(self.waiting) > FEW_ROWS and (table.closed or self._code in MOTION_CODES[:4]):
            self.flush()
        self.waiting.append(table)
        self.blocks += len(table)

    def line(self, line: Line) -> None:
        """Take a line of another kind."""
        if line.words:
            self.blocks += 1
        if self.comments is not None:
            self.comments.extend((line.number, text) for text in line.comments)
        row = self.dialect.row(line) if line.words else None
        if row is not None:
            self.waiting.append((line.number, row))
        elif line.words:
            self.flush()
            self.dialect.words(line, self)
            self.events += [Event(self._place, *self._event(*late)) for late in self.late]
            self.late = []

    def flush(self) -> None:
        """Execute the motion blocks that wait."""
        if not self.waiting:
            return
        factor = MM_PER_UNIT[self.units]
        for table in joined_tables(self.waiting, FEW_ROWS):
            before = self.modal
            if self.memory.get(INCREMENTAL):
                hint = "write G90 behind a position of the machine"
                raise InputError(
                    "CS503", "motion in incremental words (G91)", hint, file=self.name, line=int(table.line[0])
                )
            run, self.modal = execute(table, before)
            approach: frozenset[int] = frozenset()
            if self.way_back.open:
                lines = set(run.line.tolist())
                run = self.way_back.arrive(run, self.problems)
                approach = frozenset(lines.difference(run.line.tolist()))
                if not len(run.kind):
                    continue
            self._check_control(table, before.code, approach)
            if self.modal.points and not before.points:
                self._know_points(run)
            self.problems.extend(run.problems)
            unit = factor * (self.dialect.inch_feed if before.inch and not before.per_revolution else 1.0)
            unit = 1.0 if before.inverse_time else unit
            run = _in_mm(run, factor, unit, points=self.modal.points)
            run.feed_room += self.dialect.feed_step / 2 * unit
            if self.rotary is not None:
                start = before.but(tip=tuple(factor * value for value in before.tip))
                rotary = replace(self.rotary, tip_step=factor * self.rotary.tip_step)
                if self.dialect.retracts:
                    self._check_swings(rotary.swung(run, start), run)
                run = rotary.resolve(run, start, inverse_time=before.inverse_time)
                levers = self.rotary.levers(run.tip)
                self.lever = max(self.lever, float(levers.max(initial=0.0, where=~np.isnan(levers))))
            self._add(run)
        self.waiting = []

    @property
    def _code(self) -> float:
        """G word of group 01 behind what waits."""
        for item in reversed(self.waiting):
            words = item.column("G") if isinstance(item, Table) else np.array([item[1].get("G", np.nan)])
            known = words[~np.isnan(words)]
            if len(known):
                return float(known[-1])
        return self.modal.code

    def _know_points(self, run: Executed) -> None:
        """From here on U V W are a point on the axis: what was said before of the axis is no such point."""
        if self.placed:
            self._refuse_unknown(int(run.line[0]))
        for part in self.ready:
            part.second[:] = np.nan

    def _add(self, run: Executed) -> None:
        """Take over the elements of a run."""
        if not len(run.kind):
            return
        second_is: Second = "point" if self.modal.points else "vector"
        scale = MM_PER_UNIT[self.units]
        steps = (self.steps.tip * scale, self.steps.second * (scale if second_is == "point" else 1.0))
        if self.rotary is not None:
            lever = self.lever if self._given_lever is None else self._given_lever
            steps = replace(self.rotary, tip_step=steps[0]).steps(lever)
        curves = run.curves
        size = curves.points + curves.order
        self.ready.append(
            Elements(
                kind=run.kind,
                tip=run.tip,
                second=run.second,
                line=run.line,
                feed=run.feed,
                per_revolution=run.per_revolution,
                feed_room=run.feed_room,
                second_room=np.zeros(len(run.kind)),
                curves=Curves(
                    run.curve_element,
                    curves.order,
                    np.cumsum(curves.points) - curves.points,
                    curves.points,
                    np.cumsum(size) - size,
                    curves.control,
                    curves.weight,
                    curves.knot,
                ),
                arcs=NcArcs(run.arc_element, run.arc_centre, run.arc_normal, run.arc_sweep),
                second_is=second_is,
                tip_step=steps[0],
                second_step=steps[1],
                rotary=self.rotary is not None,
            )
        )
        self.way_back.look_along(self.ready[-1])
        self.elements += len(run.kind)
        self.curves += len(curves)
        if not self.placed and (run.kind != Element.RAPID).any():
            self._settle()

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

    def _collected(self) -> Elements:
        """Give out what is ready."""
        found = Elements.joined(self.ready)
        self.ready, self.given_out = [], self.elements
        self.given = [found.part(max(len(found) - 1, 0), len(found))]
        room = np.zeros(len(found))
        if self.rotary is not None:
            room = self.rotary.pole_room(found.second)
        elif found.second_is == "vector" and not self.steps.second:  # no word says anything of the tool axis
            room += FIXED_SHARE * self.options.tolerance / self.options.axis_length
        return replace(found, second_room=room)

    @property
    def units(self) -> Units:
        """Units in force."""
        return "inch" if self.modal.inch else "mm"

    @property
    def _place(self) -> int:
        """Element that words stand before."""
        return self.elements - (self.elements == self.withdrawn)

    def event(self, line: Line, letter: str, value: float, text: str = "", *, late: bool = False) -> None:
        """Say a word that stands beside the motion; a late one acts after the motion of its block."""
        if late:
            self.late.append((line, letter, value, text))
        else:
            self.events.append(Event(self._place, *self._event(line, letter, value, text)))

    @staticmethod
    def _event(line: Line, letter: str, value: float, text: str) -> tuple[int, str, float, str]:
        return line.number, letter, value, text

    def move(self, line: Line, row: dict[str, float]) -> None:
        """Execute a single motion block; one without words of position only changes what holds."""
        if set(row) & self.dialect.lexer.places or set(row) & set("XYZIJKUVW"):
            self.waiting.append((line.number, row))
            self.flush()
        elif row:
            self.modal = self.modal.but(code=row.get("G", self.modal.code), feed=row.get("F", self.modal.feed))

    def change(self, line: Line, **modes: Any) -> None:
        """Change what holds from block to block."""
        if self.elements and modes.get("inch", self.modal.inch) != self.modal.inch:
            self.wrong("CS504", line, "units are changed in the middle of the path")
        if modes.get("inverse_time") and self.rotary is None:
            self.refuse(line, "inverse time feed (G93) without rotary words", "name the machine with --machine")
        self.modal = self.modal.but(**modes)

    def leave(self, axes: str) -> None:
        """Say that axes go to positions of the machine."""
        if self.way_back.look_back(self.given, self.ready):  # words behind it belong where it comes from
            self.withdrawn = self.elements
            place = len(self.events)
            while place and self.events[place - 1].element == self.elements:
                place -= 1
            self.events[place:] = [replace(event, element=event.element - 1) for event in self.events[place:]]
        self.modal = self.way_back.leave(self.modal, axes)

    def _check_swings(self, elements: Ints, run: Executed) -> None:
        """Complain of rapids in which rotary axes lead the tool far round."""
        text = "rotary axes swing the tilted tool in a rapid that is not above a retract"
        self.problems += [Problem("CS537", 0, int(run.line[element]), text) for element in elements.tolist()]

    def wrong(self, code: str, line: Line, text: str) -> None:
        """Note what breaks the rules of the control."""
        self.problems.append(Problem(code, 0, line.number, text))

    def refuse(self, line: Line, what: str, hint: str) -> NoReturn:
        """Give up: words that make it impossible to tell where the tool is."""
        raise InputError("CS503", what, hint, file=self.name, line=line.number)

    def _check_control(self, table: Table, code: float, approach: frozenset[int] = frozenset()) -> None:
        """Complain, once for each state, of words that the control would not take for what they are."""
        needed = self.dialect.curves_need
        if needed and not self.memory.get(HIGH_SPEED) and (curves := np.flatnonzero(table.column("G") == NURBS)).size:
            text = f"a curve where {needed} must be in force"
            self.problems.append(Problem(CONTROL_WORDS, 0, int(table.line[curves[0]]), text))
        letters = table.columns.keys()
        if self.rotary is not None:
            kind = "angles" if self.rotary.tip_control else "machine"
            used = letters & set(self.rotary.names)
        else:
            kind = "point" if self.modal.points else "vector"
            used = letters & set("UVW" if self.modal.points else "IJ")
        wanted = self.dialect.controls.get(kind)
        if wanted is None or not used or self.tip_control in wanted or (kind, self.tip_control) in self.complained:
            return
        rows = table.rows_with(used, code)
        if approach:  # from the height of a retract rotary axes turn before the control is told of the tip
            rows = rows[[int(number) not in approach for number in table.line[rows]]]
        if not len(rows):
            return
        self.complained.add((kind, self.tip_control))
        need = " or ".join(word or "no tool tip control" for word in wanted)
        text = f"{_NEEDS[kind]} under {self.tip_control or 'no tool tip control'}, where {need} must be in force"
        self.problems.append(Problem(CONTROL_WORDS, 0, int(table.line[rows[0]]), text))

    def program(self, parts: list[Elements]) -> NcProgram:
        """Put all that was given out together."""
        elements = Elements.joined(parts) if parts else _nothing(self.steps)
        events = list(self.events)
        comments = self.comments or []
        place = np.searchsorted(elements.line, [number for number, _ in comments])
        events.extend(
            Event(int(element), number, "(", 0.0, text) for element, (number, text) in zip(place, comments, strict=True)
        )
        events.sort(key=lambda event: event.line)
        return NcProgram(
            **vars(elements),
            events=tuple(events),
            problems=tuple(self.problems),
            units=self.units,
            blocks=self.blocks,
            unsaid=self.dialect.unsaid,
            along_tool=tuple(self.along_tool),
        )


def _nothing(steps: Steps) -> Elements:
    """No elements at all."""
    none, rows = np.zeros(0), np.zeros((0, 3))
    return Elements(
        kind=np.zeros(0, np.uint8),
        tip=rows,
        second=rows,
        line=np.zeros(0, np.int64),
        feed=none,
        per_revolution=np.zeros(0, np.bool_),
        feed_room=none,
        second_room=none,
        curves=Curves(),
        arcs=NcArcs(),
        second_is="vector",
        tip_step=steps.tip,
        second_step=steps.second,
    )


def _in_mm(run: Executed, factor: float, feed: float, *, points: bool) -> Executed:
    """Lengths in millimetres; a factor of one leaves the numbers untouched."""
    if factor == 1.0:
        return run
    columns = slice(0, 6 if points else 3)
    run.curves.control[:, columns] *= factor
    return replace(
        run,
        tip=run.tip * factor,
        second=run.second * factor if points else run.second,
        feed=run.feed * feed,
        arc_centre=run.arc_centre * factor,
    )
