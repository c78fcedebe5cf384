"""NC text to `NcProgram`: what a control makes of it, block by block, with nothing known of who wrote it."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, Final, NoReturn

import numpy as np

from cornersmooth.errors import InputError, SettingsError
from cornersmooth.model import MM_PER_UNIT, Units
from cornersmooth.verify.dialects import CONTROLS, Dialect, dialect_of
from cornersmooth.verify.motion import Modal, Piece, execute
from cornersmooth.verify.ncprogram import Event, NcProgram, Problem, Second
from cornersmooth.verify.pile import Pile
from cornersmooth.verify.rotary import Rotary
from cornersmooth.verify.runs import read_lines
from cornersmooth.verify.words import Line, Table, table_of

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

__all__ = ["CONTROLS", "read_nc"]

#: decimals are looked for in so many bytes from the first motion block on
_DIGITS_SAMPLE: Final = 1 << 16

#: share of the tolerance, at the axis point, that a tool without words for its axis may lean
FIXED_SHARE: Final = 0.1

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
    dialect = dialect_of(control, "".join(machine.names) if machine is not None else "")
    if machine is None and not tcp:
        raise SettingsError("CS215", "machine positions need a machine", "name it with --machine")

    def read(file: BinaryIO, label: str | None) -> NcProgram:
        tip, second = dialect.decimals(file.read(_DIGITS_SAMPLE))
        file.seek(0)
        rotary = None
        if machine is not None:
            rotary = Rotary(machine, tcp, tolerance, axis_length, 10.0**-tip, 10.0 ** -(second or 0))
        reader = _Reader(label, dialect, rotary)
        for item in read_lines(file, label, dialect.spelling):
            if isinstance(item, Table):
                reader.rows(item)
            else:
                reader.line(item)
        reader.flush()
        return reader.result(
            10.0**-tip, 0.0 if second is None else 10.0**-second, FIXED_SHARE * tolerance / axis_length
        )

    if isinstance(data, bytes):
        return read(io.BytesIO(data), name)
    path = Path(data)
    label = name if name is not None else str(path)
    try:
        with path.open("rb") as file:
            return read(file, label)
    except OSError as error:
        raise InputError("CS500", f"cannot read: {error.strerror}", "check name and rights", file=label) from error


class _Reader:
    """Collects what the lines say; holds the modal state of the control (`dialects.State`)."""

    def __init__(self, name: str | None, dialect: Dialect, rotary: Rotary | None) -> None:
        self.name, self.dialect, self.rotary = name, dialect, rotary
        self.modal = Modal(rotary=rotary.names if rotary is not None else "")
        self.tip_control = ""
        self.pile = Pile()
        self.waiting: list[Table | tuple[int, dict[str, float]]] = []
        self.events: list[Event] = []
        self.late: list[tuple[Line, str, float, str]] = []
        self.comments: list[tuple[int, str]] = []
        self.problems: list[Problem] = []
        self.complained: set[tuple[str, str]] = set()
        self.lever = 0.0
        self.elements = 0
        self.blocks = 0

    def rows(self, table: Table) -> None:
        """Take a run of motion blocks."""
        if _closed(table):
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
            self._check_control(table)
            self.problems.extend(piece.problems)
            unit = factor * (self.dialect.inch_feed if before.inch and not before.per_revolution else 1.0)
            unit = 1.0 if before.inverse_time else unit
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
        if set(row) & self.dialect.spelling.places or set(row) & set("XYZIJKUVW"):
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

    def _check_control(self, table: Table) -> None:
        """Complain, once for each state, of words that the control would not take for what they are."""
        letters = table.columns.keys()
        if self.rotary is not None:
            kind = "angles" if self.rotary.tip_control else "machine"
            used = bool(letters & set(self.rotary.names))
        else:
            kind = "point" if self.modal.points else "vector"
            used = bool(letters & set("UVW" if self.modal.points else "IJ"))
        wanted = self.dialect.controls.get(kind)
        if wanted is None or not used or self.tip_control in wanted or (kind, self.tip_control) in self.complained:
            return
        code = table.columns.get("G")
        if kind == "vector" and code is not None and (code >= 2).any():  # I J of an arc
            return
        self.complained.add((kind, self.tip_control))
        need = " or ".join(word or "no tool tip control" for word in wanted)
        text = f"{_NEEDS[kind]} under {self.tip_control or 'no tool tip control'}, where {need} must be in force"
        self.problems.append(Problem("CS506", 0, int(table.line[0]), text))

    def result(self, tip_step: float, second_step: float, fixed_room: float) -> NcProgram:
        """Put all pieces together, in millimetres."""
        second_is: Second = "point" if self.modal.points else "vector"
        scale = MM_PER_UNIT[self.units]
        elements, curves, arcs = self.pile.whole()
        place = np.searchsorted(elements["line"], [number for number, _ in self.comments])
        self.events.extend(
            Event(int(element), number, "(", 0.0, text)
            for element, (number, text) in zip(place, self.comments, strict=True)
        )
        self.events.sort(key=lambda event: event.line)
        steps = (tip_step * scale, second_step * (scale if second_is == "point" else 1.0))
        if self.rotary is not None:
            steps = replace(self.rotary, tip_step=steps[0]).steps(self.lever)
        room = np.zeros(len(elements["kind"]))
        if self.rotary is not None:
            room = self.rotary.pole_room(elements["second"])
        elif second_is == "vector" and not second_step:  # no word says anything of the tool axis
            room += fixed_room
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
    if all(_closed(table) for table in tables):
        return tables
    letters = sorted({letter for table in tables for letter in table.columns})
    line = np.concatenate([table.line for table in tables])
    return [Table(line, {name: np.concatenate([table.column(name) for table in tables]) for name in letters})]


def _closed(table: Table) -> bool:
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
