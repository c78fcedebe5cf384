"""The whole verification: NC text against CL program."""

from __future__ import annotations

import contextlib
import math
import os
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from inspect import signature
from itertools import count
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, ParamSpec, Self, TypeVar, cast

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.model import Ints, Program, Units
from cornersmooth.nc_reader.block_tables import read_lines
from cornersmooth.nc_reader.elements import Element, Elements, Event, NcProgram, Problem
from cornersmooth.nc_reader.hole_cycles import NOT_DRILLED
from cornersmooth.nc_reader.machine_positions import MachinePositions
from cornersmooth.nc_reader.needed_states import CONTROL_WORDS
from cornersmooth.nc_reader.reader import Reader
from cornersmooth.nc_reader.reading_options import DIGITS_SAMPLE, ReadingOptions
from cornersmooth.nc_reader.source import Source, readable_twice
from cornersmooth.processes import Helper, can_fork, map_in_processes
from cornersmooth.settings import BOUNDS
from cornersmooth.statements.asked import asked
from cornersmooth.statements.comparison import KINDS, compare
from cornersmooth.statements.said import said
from cornersmooth.statements.tokens import TAP, Token
from cornersmooth.verify.batches import Batch, Batches
from cornersmooth.verify.checks import Examined, examine
from cornersmooth.verify.findings import Findings, Largest, Poses
from cornersmooth.verify.half_turns import half_turns
from cornersmooth.verify.own_rapids import OwnRapids
from cornersmooth.verify.rapids import leads_somewhere
from cornersmooth.verify.result import Verification
from cornersmooth.verify.task import Task, length_of
from cornersmooth.verify.wide_search import way_apart
from cornersmooth.verify.word_check import GONE_ON, WordCheck

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")

#: poses from which on it is worth while to let other processes work
_LONG: Final = 30_000

#: CL path length of what stands before the first motion, mm
_BEFORE: Final = -1.0


class Verifier:
    """Measures an NC text against the CL program it was made from, and may begin while the text is still being written.

    A context manager: processes of its own read the text as it grows, until `result` is asked for or the block ends::

        with Verifier(program, path, tolerance=0.04) as verifier:
            ...  # write to path
            found = verifier.result()

    Parameters
    ----------
    program : Program
    nc : NcProgram, bytes or path
        A file must be there, but need not be whole.
    tolerance : float, mm
        ε: what is allowed at tip and axis point.
    axis_length : float, mm
        H: distance of the axis point from the tip.
    axis_tolerance : float, degrees, optional
        What the tool axis may be off where the tip is within ε: takes the place of the axis point and H.
    control, machine, tcp
        As in `read_nc`.
    words : bool
        Whether words beside the motion must say what the CL file asks for, and be on the list of the control's words;
        not where nobody knows what they mean.
    trusted : sequence of str
        Blocks that belong where they stand because the user put them there: what they do is taken on trust. Names of
        states or statements that are his own; `own_words` of a control table says them.
    weights : sequence of float, optional
        Those that curves have, where that is known: any other is a problem, even if the curve stays within ε.
    slower : bool
        Whether feeds may be below those of the CL file, as where the text has those of a plan.
    processes : int
        Processes to work on long texts with, where the system can fork; the result does not depend on it.

    Raises
    ------
    InputError
        Where the text cannot be read.
    SettingsError
        CS202 for a tolerance or axis length out of bounds; as in `read_nc`.
    """

    def __init__(
        self,
        program: Program,
        nc: NcProgram | bytes | str | os.PathLike[str],
        *,
        tolerance: float,
        axis_length: float = 10.0,
        axis_tolerance: float | None = None,
        control: str = "fanuc",
        machine: Machine | None = None,
        tcp: bool = True,
        words: bool = True,
        trusted: Sequence[str] = (),
        weights: Sequence[float] | None = None,
        slower: bool = False,
        processes: int = 1,
    ) -> None:
        self._axis_tolerance = axis_tolerance
        if axis_tolerance is not None:
            _check_bounds(axis_tolerance=axis_tolerance)
            axis_length = length_of(tolerance, axis_tolerance)
        _check_bounds(tolerance=tolerance, axis_length=axis_length)
        self._program, self._words = program, words
        self._processes = processes if can_fork() and len(program) >= _LONG else 1
        self._trusted, self._weights, self._slower = tuple(trusted), weights, slower
        self._machine = machine
        said = () if machine is None else (word for axis in machine.axes for word in axis.clamp or ())
        self._clamps = frozenset(float(word[1:]) for word in said)
        self._options = ReadingOptions.of(control, machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length)
        self._text = nc if isinstance(nc, NcProgram) else Source(readable_twice(nc))
        self._name = None if isinstance(nc, NcProgram | bytes) else str(nc)
        self._helper: Helper | None = None

    def __enter__(self) -> Self:
        if self._processes > 1 and isinstance(self._text, Source):
            with contextlib.suppress(OSError):  # without it it takes longer
                self._helper = Helper(self._work)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._helper is not None:
            self._helper.end()
        if isinstance(self._text, Source):
            self._text.close()

    def result(self) -> Verification:
        """Say what was found; the text must be complete.

        Raises
        ------
        InputError
            Where the text cannot be read.
        """
        if isinstance(self._text, Source):
            self._text.finish()
        if self._helper is None:
            return self._work()
        found: Verification = self._helper.result()
        return found

    def _work(self) -> Verification:
        """Read and measure the text as far as it goes."""
        options = self._options
        task = Task.of(self._program, options.tolerance, options.axis_length, self._axis_tolerance)
        return self._of_text(task, self._text) if isinstance(self._text, Source) else self._of_read(task, self._text)

    def _of_read(self, task: Task, nc: NcProgram) -> Verification:
        elements, events = OwnRapids(task).left_out(nc)
        text = _Text(iter([elements.at_most() if self._slower else elements]), events)
        measured = _measure(task, text, words=self._words, processes=self._processes)
        found = measured.verification(list(nc.problems), nc.units, nc.unsaid, blocks=nc.blocks, curves=len(nc.curves))
        unverified = "the words of the text: they are looked at where it is read, not afterwards"
        return replace(found, unverified=unverified, rewinds=tuple((out, back) for *_, out, back in nc.left_cuts))

    def _of_text(self, task: Task, source: Source) -> Verification:
        options = self._options
        steps = options.steps(source.head(DIGITS_SAMPLE))
        rotary = options.rotary(steps)
        lever = None
        if rotary is not None:
            lever = float(rotary.levers(task.original.trail.tip).max(initial=0.0))
        reader = Reader(self._name, options, steps, lever)
        lines = read_lines(source, self._name, options.dialect.lexer)
        room = options.tolerance / self._program.mm_per_unit
        machine = self._machine if options.dialect.retracts else None
        positions = MachinePositions(machine, self._program.mm_per_unit)
        check = WordCheck(options.control, options.dialect.lexer, room, self._trusted, self._weights, positions)
        own_rapids = OwnRapids(task)
        reader.way_back.added, reader.left_cuts.asked = own_rapids.added, own_rapids.goes_to
        chunks = reader.chunks(check.watch(lines) if self._words else lines)
        text = _Text((part.at_most() for part in chunks) if self._slower else chunks, reader.events)
        measured = _measure(task, text, words=self._words, processes=self._processes)
        problems = [*reader.problems, *check.problems]
        own = KINDS & set(self._trusted)
        measured.own, measured.clamps = own, self._clamps
        found = measured.verification(
            problems, reader.units, reader.dialect.unsaid, blocks=reader.blocks, curves=reader.curves
        )
        unverified = f"what your own table says of {', '.join(sorted(own))}" if own else ""
        if not self._words:
            unverified = "words beside the motion, which a table of your own may define"
        rewinds = tuple((out, back) for *_, out, back in reader.left_cuts.found)
        return replace(found, trusted=tuple(check.trusted), unverified=unverified, rewinds=rewinds)


def _taking_what(kind: Callable[_Given, object]) -> Callable[[Callable[..., _Found]], Callable[_Given, _Found]]:
    """Say of a function that it takes what another takes: type checkers and `help` show those parameters."""

    def decorate(function: Callable[..., _Found]) -> Callable[_Given, _Found]:
        own = signature(function).return_annotation
        cast(Any, function).__signature__ = signature(kind).replace(return_annotation=own)
        return function

    return decorate


@_taking_what(Verifier)
def verify(*args: Any, **how: Any) -> Verification:
    """Measure an NC text, that is whole, against the CL program it was made from.

    Parameters
    ----------
    As `Verifier`.

    Raises
    ------
    InputError, SettingsError
        As `Verifier`.
    """
    with Verifier(*args, **how) as verifier:
        return verifier.result()


@dataclass(frozen=True)
class _Text:
    """The path elements of a text as they are read, and the words between those that have been given out."""

    chunks: Iterator[Elements]
    events: list[Event]


@dataclass
class _Measured:
    """What all batches show together."""

    task: Task
    batches: Batches
    findings: Findings
    poses: Poses  #: of the whole CL program
    lengths: dict[int, float]  #: CL path length, mm, at elements that have words behind them, where batches tell
    rooms: dict[int, float]  #: how far that is uncertain, mm
    others: dict[int, tuple[float, ...]]  #: at other poses that elements may stand for
    still: set[int]  #: rapids that lead nowhere
    events: list[Event]
    words: bool
    margin: float = 0.0
    own: frozenset[str] = frozenset()  #: kinds of statements that the user says in words of his own
    clamps: frozenset[float] = frozenset()  #: M words that clamp a rotary axis or let it turn

    def verification(
        self,
        problems: list[Problem],
        units: Units,
        unsaid: frozenset[str | tuple[str, float]],
        *,
        blocks: int,
        curves: int,
    ) -> Verification:
        """Put everything together; `problems` are those of the text alone, the rest is as of `NcProgram`."""
        program = self.task.original.program
        problems = [problem for problem in problems if self.words or problem.code != CONTROL_WORDS]
        if units != program.units:
            text = f"the text is in {units}, the CL file in {program.units}"
            problems.append(Problem("CS505", 0, 1, text))
        problems += self.batches.problems + self.findings.feeds.problems + self.findings.violations.problems()
        problems += half_turns(program)
        left_out = sum(event.letter == "(" and event.text.startswith(NOT_DRILLED) for event in self.events)
        if left_out < len(self.batches.untapped):
            problems += self.batches.untapped
        if self.words and self.batches.elements:  # without any motion nothing has a place
            of_statements, at_home = self._statement_problems(unsaid)
            problems = [one for one in problems if one.text != GONE_ON or one.nc_line not in at_home] + of_statements
        return Verification.of(
            self.findings,
            self.poses,
            problems,
            task=self.task,
            poses=len(program),
            blocks=blocks,
            elements=self.batches.elements,
            curves=curves,
        )

    def _statement_problems(self, unsaid: frozenset[str | tuple[str, float]]) -> tuple[list[Problem], set[int]]:
        """What words beside the motion say wrongly, and the NC lines of those where the CL file has GOHOME."""
        original, length = self.task.original, self.task.path.length
        program = original.program
        move = np.searchsorted(original.pose, [statement.pose for statement in program.statements]) - 1
        moves = len(original.pose)
        end = float(length[-1]) if moves else 0.0
        there = length[original.trail.last[np.clip(move, 0, None)]] if moves else 0.0

        def length_at(move: int) -> float:
            return float(length[original.trail.last[move]])

        dwells = [
            Token("dwell", time, length_at(move), int(program.line[original.pose[move]]))
            for move, time in self.batches.dwells
        ]
        dwells += [
            Token("tap", TAP, length_at(move), int(program.line[original.pose[move]])) for move in self.batches.taps
        ]
        before = np.where(move >= 0, there, _BEFORE).tolist()
        theirs = asked(program, before, end, dwells)
        # clamps of rotary axes stand where the machine wants them, not where AUXFUN has them
        theirs = [token for token in theirs if token.kind != "auxiliary" or token.value not in self.clamps]
        known = self.lengths | self.batches.stops.lengths()
        holes = self.batches.holes
        known |= {element: length_at(move) for element, move in holes.items()}
        order = sorted(known)
        first = order[0] if order else 0

        def stands(element: int) -> int:
            """The element at whose end one leaves the tool that leads nowhere, as a second rapid to the same place."""
            at = bisect_right(order, element) - 1
            return order[at] if element >= first and at >= 0 else element

        def place(element: int) -> float:
            return known.get(stands(element), _BEFORE if element < first else 0.0)

        begins = {element: length_at(max(move - 1, 0)) for element, move in self.batches.latest.items()}
        begins = {element + 1: place for element, place in self.batches.stops.lengths().items()} | begins
        begins |= self.batches.stops.begins()
        begins[self.batches.elements] = end
        places = [
            length_at(holes[event.element])  # that which is fed next
            if (event.letter, event.value) == ("G", TAP) and event.element in holes
            else place(event.element - 1)
            for event in self.events
        ]

        def next_of(element: int) -> int:
            return next(k for k in count(element) if k not in self.still)

        # between two elements the text may have passed all that leaves nothing in it
        reaches = [
            max(begins.get(next_of(event.element), -math.inf) - here, 0.0)
            for event, here in zip(self.events, places, strict=True)
        ]
        rooms = [self.rooms.get(stands(event.element - 1), 0.0) for event in self.events]
        others = [self.others.get(stands(event.element - 1), ()) for event in self.events]
        apart: Callable[[float, float], float] = partial(way_apart, self.task.path)
        homes = [place for place, one in zip(before, program.statements, strict=True) if one.word == "GOHOME"]
        at_home = {
            event.line
            for event, here, room, reach in zip(self.events, places, rooms, reaches, strict=True)
            if any(-self.margin - room <= home - here <= reach + self.margin + room for home in homes)
        }
        found = said(self.events, places, rooms, reaches, others)
        return compare(theirs, found, self.margin, unsaid, apart, self.own), at_home


def _measure(task: Task, text: _Text, *, words: bool, processes: int) -> _Measured:
    """Match and measure all that is read."""
    batches = Batches(task, text.events)
    program = task.original.program
    found = _Measured(task, batches, Findings(), Poses.nowhere(len(program)), {}, {}, {}, set(), text.events, words)

    def items() -> Iterator[tuple[Batch, Ints, Largest]]:
        for batch in batches.of(_noted(text, found)):
            own = _elements(text.events, batch.offset, batch.offset + batch.last)
            yield batch, np.unique(own), found.findings.largest.copy()

    def work(item: tuple[Batch, Ints, Largest]) -> Examined:
        return examine(task, *item)

    for examined in map_in_processes(work, items(), processes):
        for poses in examined.findings.poses:
            found.poses.put(poses)
        examined.findings.poses = []
        found.findings.take(examined.findings)
        for element, length in zip(examined.elements.tolist(), examined.lengths.tolist(), strict=True):
            found.lengths.setdefault(element, length)
        found.others = examined.others | found.others
    return found


def _elements(events: list[Event], first: int, last: int) -> Ints:
    """Elements from `first` to `last` with words behind them, ascending."""
    low = bisect_left(events, first + 1, key=lambda event: event.element)
    high = bisect_right(events, last + 1, key=lambda event: event.element)
    return np.array([event.element - 1 for event in events[low:high]], np.int64)


def _noted(text: _Text, found: _Measured) -> Iterable[Elements]:
    """Give out the elements of a text, and take down what is to be known of those with words behind them."""
    offset = 0
    before = np.full((1, 6), np.inf)
    for nc in text.chunks:
        found.margin = found.task.margin(nc)
        six = np.concatenate((before, np.hstack((nc.tip, nc.second))))
        rapid = np.flatnonzero(nc.kind == Element.RAPID)
        ways = np.hsplit(six[rapid + 1] - six[rapid], 2)
        found.still.update((offset + rapid[~leads_somewhere(nc, *ways)]).tolist())
        before = six[-1:]
        if len(nc) and (nc.rotary or nc.tip_room.any()):
            last = offset + len(nc) - 1
            for element in {*_elements(text.events, offset, last).tolist(), last}:  # words behind it are still to come
                row = element - offset
                found.rooms[element] = found.task.axis_length * float(nc.second_room[row]) + float(nc.tip_room[row])
        offset += len(nc)
        yield nc


def _check_bounds(**values: float) -> None:
    for name, value in values.items():
        low, high = BOUNDS[name]
        if not low <= value <= high:
            raise SettingsError("CS202", f"{name} is {value:g}", f"give a value from {low:g} to {high:g}")
