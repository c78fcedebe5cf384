"""NC text to `NcProgram`: what a control makes of it, block by block, with nothing known of who wrote it."""

from __future__ import annotations

import io
import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NoReturn

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import MM_PER_UNIT, Units
from cornersmooth.verify.block_tables import read_lines
from cornersmooth.verify.dialects import CONTROLS
from cornersmooth.verify.dialects.base import HIGH_SPEED
from cornersmooth.verify.motion import Modal, Piece, execute
from cornersmooth.verify.ncprogram import Element, Event, NcProgram, Problem, Second
from cornersmooth.verify.pile import Pile
from cornersmooth.verify.source import readable_twice, unreadable
from cornersmooth.verify.stops import moving_rapids
from cornersmooth.verify.style import DIGITS_SAMPLE, Steps, Style
from cornersmooth.verify.unknown import settle
from cornersmooth.verify.words import NURBS, Line, Table, table_of

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

__all__ = ["CONTROLS", "read_nc"]

#: share of the tolerance, at the axis point, that a tool without words for its axis may lean
FIXED_SHARE: Final = 0.1

#: code of words that want another state of the control
CONTROL_WORDS: Final = "CS506"

#: runs of fewer blocks are executed together: each folded block of Klartext is a run of its own
FEW_ROWS: Final = 64

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
    return read_styled(data, Style.of(control, machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length), name)


def read_styled(data: bytes | str | os.PathLike[str], style: Style, name: str | None = None) -> NcProgram:
    """Read an NC text; see `read_nc`."""

    def read(file: BinaryIO, label: str | None) -> NcProgram:
        steps = style.steps(file.read(DIGITS_SAMPLE))
        file.seek(0)
        reader = Reader(label, style, steps)
        reader.take(read_lines(file, label, style.dialect.lexer))
        return reader.result()

    label = name if name is not None or isinstance(data, bytes) else str(data)
    data = readable_twice(data)
    if isinstance(data, bytes):
        return read(io.BytesIO(data), label)
    path = Path(data)
    try:
        with path.open("rb") as file:
            return read(file, label)
    except OSError as error:
        raise unreadable(error, label) from error


@dataclass(frozen=True)
class Standing:
    """All that holds at a place of a text where no curve is open.

    Parameters
    ----------
    modal : Modal
    tip_control : str
        See `dialects.State`.
    memory : dict
        See `dialects.State`.
    """

    modal: Modal
    tip_control: str = ""
    memory: dict[str, Any] = field(default_factory=dict)


class Reader:
    """Collects what the lines say; holds the modal state of the control (`dialects.State`).

    Parameters
    ----------
    name : str or None
        For messages.
    style : Style
    steps : Steps
    standing : Standing, optional
        What holds in front of the first line.
    """

    def __init__(self, name: str | None, style: Style, steps: Steps, standing: Standing | None = None) -> None:
        self.name, self.style, self.dialect, self.steps = name, style, style.dialect, steps
        self.rotary = style.rotary(steps)
        if standing is None:
            standing = Standing(Modal(rotary=self.rotary.names if self.rotary is not None else ""))
        self.began = standing
        self.modal, self.tip_control, self.memory = standing.modal, standing.tip_control, dict(standing.memory)
        self.pile = Pile()
        self.waiting: list[Table | tuple[int, dict[str, float]]] = []
        self.events: list[Event] = []
        self.late: list[tuple[Line, str, float, str]] = []
        self.comments: list[tuple[int, str]] = []
        self.problems: list[Problem] = []
        self.complained: set[tuple[str, str]] = set()
        self.feed_units: set[float] = set()
        self.lines = 0
        self.lever = 0.0
        self.elements = self.pointless = 0
        self.blocks = 0

    def take(self, items: Iterable[Table | Line]) -> None:
        """Take runs of motion blocks and other lines, to the end of a text or to where no curve is open."""
        for item in items:
            self.take_one(item)
        self.flush()

    def take_one(self, item: Table | Line) -> None:
        """Take a run of motion blocks, or another line."""
        if isinstance(item, Table):
            self.rows(item)
            self.lines = int(item.line[-1])
        else:
            self.line(item)
            self.lines = item.number

    @property
    def standing(self) -> Standing:
        """What holds now, all lines being executed."""
        return Standing(self.modal, self.tip_control, dict(self.memory))

    def began_with(self, standing: Standing | None) -> bool:
        """Whether all would be the same if this had held in front of the first line, but for feeds not known there."""
        if standing is None or (self.began.tip_control, self.began.memory) != (standing.tip_control, standing.memory):
            return False
        mine, true = self.began.modal, standing.modal
        if math.isnan(mine.feed):
            mine = mine.but(feed=true.feed)
        return repr(mine) == repr(true) and len(self.feed_units) <= 1  # NaN is not equal to itself

    def know_feed(self, feed: float) -> None:
        """Say which feed, in units of the text, held in front of the first line, where that was not known."""
        if math.isnan(self.began.modal.feed) and self.feed_units:
            rows = self.pile.feed.rows
            rows[np.isnan(rows) & (self.pile.kind.rows != Element.RAPID)] = feed * next(iter(self.feed_units))

    def next_stop(self, first: int) -> int | None:
        """First element from `first` on that is rapid and moves the tool; None where there is none yet."""
        pile = self.pile
        if first == 0 and self.elements:
            began, factor = self.began.modal, MM_PER_UNIT[self.units]
            place = [factor * value for value in began.tip]
            second = [factor * value for value in began.second] if began.points else began.second
            moves = (pile.tip.rows[0] != place).any() or (pile.second.rows[0] != second).any()
            if moves and pile.kind.rows[0] == Element.RAPID:
                return 0
        found = moving_rapids(pile.kind.rows, pile.tip.rows, pile.second.rows, max(first, 1), self.elements)
        return int(found[0]) if len(found) else None

    def rows(self, table: Table) -> None:
        """Take a run of motion blocks."""
        if closed(table) and len(table) + len(self.waiting) > FEW_ROWS:
            self.flush()
        self.waiting.append(table)
        self.blocks += len(table)

    def line(self, line: Line) -> None:
        """Take a line of another kind."""
        if line.words:
            self.blocks += 1
        self.comments.extend((line.number, text) for text in line.comments)
        row = self.dialect.row(line) if line.words else None
        if row is not None:
            self.waiting.append((line.number, row))
        elif line.words:
            self.flush()
            self.dialect.words(line, self)
            self.events += [Event(self.elements, *self._event(*late)) for late in self.late]
            self.late = []

    def flush(self) -> None:
        """Execute the motion blocks that wait."""
        if not self.waiting:
            return
        factor = MM_PER_UNIT[self.units]
        for table in _joined(self.waiting):
            before = self.modal
            piece, self.modal = execute(table, before)
            self._check_control(table, before.code)
            if self.modal.points and not before.points:
                self.pointless = self.elements
            self.problems.extend(piece.problems)
            unit = factor * (self.dialect.inch_feed if before.inch and not before.per_revolution else 1.0)
            unit = 1.0 if before.inverse_time else unit
            if math.isnan(before.feed):
                self.feed_units.add(1.0 if factor == 1.0 else unit)
            piece = _in_mm(piece, factor, unit, points=self.modal.points)
            piece.feed_room += self.dialect.feed_step / 2 * unit
            if self.rotary is not None:
                start = before.but(tip=tuple(factor * value for value in before.tip))
                rotary = replace(self.rotary, tip_step=factor * self.rotary.tip_step)
                piece = rotary.resolve(piece, start, inverse_time=before.inverse_time)
                levers = self.rotary.levers(piece.tip)
                self.lever = max(self.lever, float(levers.max(initial=0.0, where=~np.isnan(levers))))
            self.pile.add(piece)
            self.elements += len(piece.kind)
        self.waiting = []

    @property
    def units(self) -> Units:
        """Units in force."""
        return "inch" if self.modal.inch else "mm"

    def event(self, line: Line, letter: str, value: float, text: str = "", *, late: bool = False) -> None:
        """Say a word that stands beside the motion; a late one acts after the motion of its block."""
        if late:
            self.late.append((line, letter, value, text))
        else:
            self.events.append(Event(self.elements, *self._event(line, letter, value, text)))

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

    def wrong(self, code: str, line: Line, text: str) -> None:
        """Note what breaks the rules of the control."""
        self.problems.append(Problem(code, 0, line.number, text))

    def refuse(self, line: Line, what: str, hint: str) -> NoReturn:
        """Give up: words that make it impossible to tell where the tool is."""
        raise InputError("CS503", what, hint, file=self.name, line=line.number)

    def _check_control(self, table: Table, code: float) -> None:
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
        if not len(rows):
            return
        self.complained.add((kind, self.tip_control))
        need = " or ".join(word or "no tool tip control" for word in wanted)
        text = f"{_NEEDS[kind]} under {self.tip_control or 'no tool tip control'}, where {need} must be in force"
        self.problems.append(Problem(CONTROL_WORDS, 0, int(table.line[rows[0]]), text))

    def result(self) -> NcProgram:
        """Put all pieces together, in millimetres."""
        second_is: Second = "point" if self.modal.points else "vector"
        scale = MM_PER_UNIT[self.units]
        elements, curves, arcs = self.pile.whole()
        elements["second"][: self.pointless] = np.nan
        line = settle(elements, ("tip", "second"))
        if line is not None:
            hint = "say X Y Z, and U V W where there are any, before the first feed"
            raise InputError(
                "CS503", "a feed move where not all of the position is known", hint, file=self.name, line=line
            )
        place = np.searchsorted(elements["line"], [number for number, _ in self.comments])
        self.events.extend(
            Event(int(element), number, "(", 0.0, text)
            for element, (number, text) in zip(place, self.comments, strict=True)
        )
        self.events.sort(key=lambda event: event.line)
        steps = (self.steps.tip * scale, self.steps.second * (scale if second_is == "point" else 1.0))
        if self.rotary is not None:
            steps = replace(self.rotary, tip_step=steps[0]).steps(self.lever)
        room = np.zeros(len(elements["kind"]))
        if self.rotary is not None:
            room = self.rotary.pole_room(elements["second"])
        elif second_is == "vector" and not self.steps.second:  # no word says anything of the tool axis
            room += FIXED_SHARE * self.style.tolerance / self.style.axis_length
        return NcProgram(
            **elements,
            curves=curves,
            arcs=arcs,
            events=tuple(self.events),
            problems=tuple(self.problems),
            units=self.units,
            second_is=second_is,
            tip_step=steps[0],
            second_step=steps[1],
            blocks=self.blocks,
            second_room=room,
            rotary=self.rotary is not None,
            unsaid=self.dialect.unsaid,
        )


def _joined(waiting: list[Table | tuple[int, dict[str, float]]]) -> Iterable[Table]:
    """Neighbouring tables and single rows as one table; curves must not be cut between two of them."""
    tables: list[Table] = []
    rows: list[tuple[int, dict[str, float]]] = []
    for item in waiting:
        if isinstance(item, Table):
            if rows:
                tables.append(table_of(rows))
                rows = []
            tables.append(item)
        else:
            rows.append(item)
    if rows:
        tables.append(table_of(rows))
    if all(closed(table) for table in tables) and sum(map(len, tables)) > FEW_ROWS * len(tables):
        return tables
    letters = sorted({letter for table in tables for letter in table.columns})
    line = np.concatenate([table.line for table in tables])
    return [Table(line, {name: np.concatenate([table.column(name) for table in tables]) for name in letters})]


def closed(table: Table) -> bool:
    """Whether a table starts with a G word, so that what stands before it ends no curve in it."""
    first = table.columns.get("G")
    return first is not None and not np.isnan(first[0])


def _in_mm(piece: Piece, factor: float, feed: float, *, points: bool) -> Piece:
    """Lengths in millimetres; a factor of one leaves the numbers untouched."""
    if factor == 1.0:
        return piece
    columns = slice(0, 6 if points else 3)
    piece.curves.control[:, columns] *= factor
    return replace(
        piece,
        tip=piece.tip * factor,
        second=piece.second * factor if points else piece.second,
        feed=piece.feed * feed,
        arc_centre=piece.arc_centre * factor,
    )
