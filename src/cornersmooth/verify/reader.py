"""NC text to `NcProgram`: what a FANUC control makes of it, block by block, with nothing known of who wrote it."""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import BinaryIO, Final, Literal

import numpy as np

from cornersmooth.errors import InputError, SettingsError
from cornersmooth.model import MM_PER_UNIT, Units
from cornersmooth.verify.motion import Modal, execute
from cornersmooth.verify.ncprogram import Event, NcProgram, Problem, Second
from cornersmooth.verify.pile import Pile
from cornersmooth.verify.runs import read_lines
from cornersmooth.verify.words import Line, Table, motion_row, table_of

Form = Literal["g1", "g6.2"]

CONTROLS: Final = ("fanuc",)

#: letters whose words are events
_EVENT_LETTERS = "TSMHD"

#: M words that act after the motion of their block (FANUC: stops, spindle off, coolant off, end)
_AFTER_MOTION = (0.0, 1.0, 2.0, 5.0, 9.0, 30.0)

#: G words that change nothing measured here: planes of work, cancellations, work offsets
_SILENT = {80.0, 90.0, *map(float, range(54, 60))}
_COMPENSATION = {41.0, 42.0}
_TIP_CONTROL = {43.0, 43.4, 43.5}

#: decimals are looked for in so many bytes from the first motion block on
_DIGITS_SAMPLE = 1 << 16
_BRACKETS: Final = re.compile(rb"\([^)\n]*\)")
_FRACTION: Final = re.compile(rb"([XYZIJUVW])[-+]?\d*\.(\d*)")


def read_nc(data: bytes | str | os.PathLike[str], *, control: str = "fanuc", name: str | None = None) -> NcProgram:
    """Read an NC text.

    Parameters
    ----------
    data : bytes or path
        The text itself, or the file that holds it.
    control : {"fanuc"}
    name : str, optional
        Name for messages; the file's own by default.

    Returns
    -------
    NcProgram
        What breaks the rules of the control is in `NcProgram.problems`, as far as the rest can be understood.

    Raises
    ------
    InputError
        CS501 where the text is not made of words, CS503 for words that make it impossible to tell where the tool is.
    SettingsError
        CS204 for an unknown control.
    """
    if control not in CONTROLS:
        raise SettingsError("CS204", f"unknown control {control!r}", f"use one of {', '.join(CONTROLS)}")
    if isinstance(data, bytes):
        return _read(io.BytesIO(data), name)
    path = Path(data)
    label = name if name is not None else str(path)
    try:
        with path.open("rb") as file:
            return _read(file, label)
    except OSError as error:
        raise InputError("CS500", f"cannot read: {error.strerror}", "check name and rights", file=label) from error


def _read(file: BinaryIO, name: str | None) -> NcProgram:
    reader = _Reader(name)
    steps = _steps(file.read(_DIGITS_SAMPLE))
    file.seek(0)
    for item in read_lines(file, name):
        if isinstance(item, Table):
            reader.rows(item)
        else:
            reader.line(item)
    reader.flush()
    return reader.result(*steps)


class _Reader:
    """Collects what the lines say; holds the modal state of the control."""

    def __init__(self, name: str | None) -> None:
        self.name = name
        self.modal = Modal()
        self.pile = Pile()
        self.waiting: list[Table | tuple[int, dict[str, float]]] = []
        self.events: list[Event] = []
        self.comments: list[tuple[int, str]] = []
        self.problems: list[Problem] = []
        self.elements = 0
        self.blocks = 0
        self.units_said = False

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
        row = motion_row(line)
        if row is not None:
            self.waiting.append((line.number, row))
            return
        if line.words:
            self.flush()
            self._words(line)

    def flush(self) -> None:
        """Execute the motion blocks that wait."""
        if not self.waiting:
            return
        for table in _joined(self.waiting):
            piece, self.modal = execute(table, self.modal)
            self.pile.add(piece, MM_PER_UNIT[self.units])
            self.elements += len(piece.kind)
            self.problems.extend(piece.problems)
        self.waiting = []

    @property
    def units(self) -> Units:
        """Units in force."""
        return "inch" if self.modal.inch else "mm"

    def _words(self, line: Line) -> None:
        motion: dict[str, float] = {}
        after: list[Event] = []
        given = {letter: value for letter, value, _ in line.words}
        for letter, value, text in line.words:
            if letter == "G":
                if value in (0.0, 1.0, 2.0, 3.0, 6.2):
                    motion["G"] = value
                elif value == 4.0:
                    dwell = given.get("P", 1000.0 * given.get("X", given.get("U", 0.0)))
                    self.events.append(Event(self.elements, line.number, "G", 4.0, f"{dwell:g}"))
                    return
                else:
                    self._mode(value, line.number)
            elif letter in _EVENT_LETTERS:
                event = Event(self.elements, line.number, letter, value, text)
                if letter == "M" and value in _AFTER_MOTION:
                    after.append(event)
                else:
                    self.events.append(event)
            elif letter in "XYZIJKUVWFRP":
                motion[letter] = value
            elif letter not in "NO":
                raise InputError(
                    "CS503",
                    f"{text} is not understood",
                    "only the words of milling with tool vectors or axis points are read",
                    file=self.name,
                    line=line.number,
                )
        if set(motion) & set("XYZIJKUVW"):
            self.waiting.append((line.number, motion))
            self.flush()
        elif motion:
            self.modal = self.modal.but(code=motion.get("G", self.modal.code), feed=motion.get("F", self.modal.feed))
        self.events.extend(Event(self.elements, event.line, event.letter, event.value, event.text) for event in after)

    def _mode(self, code: float, number: int) -> None:
        """Take a G word outside group 01 that changes the state."""
        if code in (17.0, 18.0, 19.0):
            self.modal = self.modal.but(plane=int(code))
        elif code in (20.0, 21.0):
            inch = code == 20.0
            if self.elements and inch != self.modal.inch:
                text = f"G{code:g} after the first motion; units are changed in the middle of the path"
                self.problems.append(Problem("CS504", 0, number, text))
            self.modal = self.modal.but(inch=inch)
            self.units_said = True
        elif code in (94.0, 95.0):
            self.modal = self.modal.but(per_revolution=code == 95.0)
        elif code in _TIP_CONTROL:
            self.modal = self.modal.but(vectors=code == 43.5)
            self.events.append(Event(self.elements, number, "G", code, f"G{code:g}"))
        elif code == 49.0:
            self.modal = self.modal.but(vectors=False)
            self.events.append(Event(self.elements, number, "G", code, "G49"))
        elif code in _COMPENSATION or code == 40.0:
            self.events.append(Event(self.elements, number, "G", code, f"G{code:g}"))
        elif code not in _SILENT:
            raise InputError(
                "CS503",
                f"G{code:g} is not understood",
                "only absolute milling with tool vectors or axis points is read",
                file=self.name,
                line=number,
            )

    def result(self, tip_step: float, second_step: float) -> NcProgram:
        """Put all pieces together, in millimetres."""
        second_is: Second = "point" if self.modal.points else "vector"
        scale = MM_PER_UNIT[self.units]
        elements, curves, arcs = self.pile.whole(points=second_is == "point")
        place = np.searchsorted(elements["line"], [number for number, _ in self.comments])
        self.events.extend(
            Event(int(element), number, "(", 0.0, text)
            for element, (number, text) in zip(place, self.comments, strict=True)
        )
        self.events.sort(key=lambda event: event.line)
        return NcProgram(
            **elements,
            curves=curves,
            arcs=arcs,
            events=tuple(self.events),
            problems=tuple(self.problems),
            units=self.units,
            second_is=second_is,
            tip_step=tip_step * scale,
            second_step=second_step * (scale if second_is == "point" else 1.0),
            blocks=self.blocks,
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


def _steps(sample: bytes) -> tuple[float, float]:
    """Value of the last printed digit of X Y Z and of I J K or U V W, from a sample of the text."""
    decimals = {b"XYZ": 0, b"IJUVW": 0}
    for letter, fraction in _FRACTION.findall(_BRACKETS.sub(b"", sample)):
        for letters in decimals:
            if letter in letters:
                decimals[letters] = max(decimals[letters], len(fraction))
    tip, second = decimals.values()
    return 10.0**-tip, 10.0**-second
