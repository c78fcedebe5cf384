"""The whole verification: NC text against CL program."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields, replace
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final, Self

import numpy as np

from cornersmooth.arrays import distinct
from cornersmooth.control.source import Source, readable_twice
from cornersmooth.control.table import word_table
from cornersmooth.errors import SettingsError
from cornersmooth.model import Program
from cornersmooth.nc_reader import program_of
from cornersmooth.nc_reader.dialects import ReadingOptions, Steps
from cornersmooth.nc_reader.elements import Element, Elements, Event, NcProgram, Problem
from cornersmooth.nc_reader.needed_states import CONTROL_WORDS
from cornersmooth.nc_reader.reader import Reader
from cornersmooth.nc_reader.rotary import sagitta
from cornersmooth.nc_words.check import WordCheck
from cornersmooth.nc_words.states import FRAME, GONE_ON, MachinePositions
from cornersmooth.settings import BOUNDS
from cornersmooth.statements import spellings, work_offset_of
from cornersmooth.statements.asked import not_understood_text
from cornersmooth.statements.comparison import KINDS
from cornersmooth.system.processes import Helper, can_fork, map_in_processes
from cornersmooth.verify.batches import Batches
from cornersmooth.verify.compensated import Compensated
from cornersmooth.verify.continuity import measure_continuity
from cornersmooth.verify.deviation import check_breaks, measure_original, measure_written
from cornersmooth.verify.feeds import check_feeds
from cornersmooth.verify.match import Batch, Match
from cornersmooth.verify.passage import MOST_BREAKS
from cornersmooth.verify.result import Findings, Verification, Where, problems_of
from cornersmooth.verify.task import HELICES, TRUST, Task, Trust, half_turns, length_of
from cornersmooth.verify.word_places import WordPlaces

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: what every batch goes through, in this order; `measure_continuity` besides, where that is wanted
CHECKS: Final[tuple[Callable[[Match, Findings], None], ...]] = (
    check_breaks,
    measure_written,
    measure_original,
    check_feeds,
)

#: what the message has of a text without feeds, which both files may agree on
NO_FEED: Final = "no F before the first feed move, and most controls stop there with an alarm (smooth --feed gives one)"

#: poses from which on it is worth while to let other processes work
_LONG: Final = 30_000

#: processes that who reads the text finds work for
_READ_FOR: Final = 2

#: how often parts of arcs may be halved, and one
_HALVED: Final = 5


class Verifier:
    """Measures an NC text against the CL program it was made from, and may begin while the text is still being written.

    A context manager: processes of its own read the text as it grows, until `result` is wanted or the block ends::

        with Verifier(program, path, tolerance=0.04) as verifier:
            ...  # write to path
            found = verifier.result()

    Parameters
    ----------
    nc : NcProgram, bytes or path
        A file must be there, but need not be whole. Of what was read before only the motion is measured; there is no
        way around a retract in it that the CL file has not.
    tolerance : float, mm
        ε: what is allowed at tip and axis point.
    axis_length : float, mm
        H: distance of the axis point from the tip.
    axis_tolerance : float, degrees, optional
        What the tool axis may be off where the tip is within ε: takes the place of the axis point and H.
    control, machine, tcp
        As in `read_nc`.
    trust : Trust
        What is not compared, or may be otherwise.
    continuity : bool
        Whether the shortest block and the largest change of direction are looked for; NaN where not.
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
        trust: Trust = TRUST,
        continuity: bool = True,
        processes: int = 1,
    ) -> None:
        self._axis_tolerance = axis_tolerance
        if axis_tolerance is not None:
            _check_bounds(axis_tolerance=axis_tolerance)
            axis_length = length_of(tolerance, axis_tolerance)
        _check_bounds(tolerance=tolerance, axis_length=axis_length)
        self._program, self._trust, self._machine = program, trust, machine
        self._continuity = continuity
        self._processes = processes if can_fork() and len(program) >= _LONG else 1
        self._options = ReadingOptions.of(control, machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length)
        self._text = nc if isinstance(nc, NcProgram) else Source(readable_twice(nc))
        self._name = None if isinstance(nc, NcProgram | bytes) else str(nc)
        self._helper: Helper | None = None

    def __enter__(self) -> Self:
        if self._processes > 1 and isinstance(self._text, Source):
            with contextlib.suppress(OSError):  # without it it takes longer
                self._helper = Helper(lambda _: self._work())
                self._helper.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._helper is not None:
            self._helper.end()
        if isinstance(self._text, Source):
            self._text.close()

    def result(self) -> Verification:
        """Say what was found; the text must be complete. Errors as above."""
        if isinstance(self._text, Source):
            self._text.finish()
        found: Verification = self._work() if self._helper is None else self._helper.result()
        if not found.motions_part or self._axis_tolerance is not None:
            return found
        alone = self._work(apart=True)
        better = not alone.motions_part or (found.only_apart and not alone.only_apart)
        return replace(alone, apart=True) if better else found

    def _work(self, *, apart: bool = False) -> Verification:
        """Read and measure the text as far as it goes; `apart`: with tips and axis points on their own."""
        options, text = self._options, self._text
        if isinstance(text, NcProgram):
            elements = Elements(**{column.name: getattr(text, column.name) for column in fields(Elements)})
            task = self._task(rotary=text.rotary is not None, apart=apart, feed_in_plane=text.feed_in_plane)
            read = text, len(text.curves)
            found = self._found(task, iter([elements]), list(text.events), text.retracts, lambda: read)
            words = "the words of the text: they are looked at where it is read, not afterwards"
            return found.not_verified(words if self._trust.words else "")
        text.begin()
        feed_in_plane = word_table(options.dialect.control).get("feed_in_plane", False)
        feed_in_plane &= HELICES not in self._trust.trusted
        # while the text begins
        task = self._task(rotary=options.machine is not None, apart=apart, feed_in_plane=feed_in_plane)
        rotary = options.rotary(Steps())
        lever = None if rotary is None else float(rotary.levers(task.path.points[:, :3]).max(initial=0.0))
        reader = Reader(self._name, options, lever)
        machine = self._machine if options.dialect.retracts else None
        scale, trust = self._program.mm_per_unit, self._trust
        positions = MachinePositions(machine, scale, switches=options.dialect.switches, tcp=options.tcp)
        own_axis, (tip, length) = self._axis_tolerance, (options.tolerance, options.axis_length)
        turn = math.degrees(tip / length) if own_axis is None else own_axis
        weights = None if trust.weights is None else (*trust.weights, *_arc_weights(self._program))
        own = trust.trusted, trust.accepted, weights
        check = WordCheck(options.control, options.dialect.lexer, tip / scale, *own, positions, turn)
        lines = reader.lines(text)
        chunks = reader.chunks(check.watch(lines) if self._trust.words else lines)

        def said() -> tuple[NcProgram, int]:
            nc = program_of(reader, [])
            problems = (*nc.problems, *check.problems, *self._wrong_offset(check.work_offset))
            return replace(nc, problems=problems), reader.curves

        found = self._found(task, chunks, reader.events, reader.retracts.places, said)
        unlooked = (
            check.unlooked if self._trust.words else "words beside the motion, which a table of your own may define"
        )
        found = replace(found.not_verified(unlooked), rounding=scale * check.rounding, offset=check.offset)
        return replace(found, trusted=tuple(check.trusted), parts=check.parts.digests if self._trust.words else "")

    def _wrong_offset(self, found: str) -> list[Problem]:
        """What is wrong with the work offset of the text, where the CL file names one."""
        number = (
            work_offset_of(self._program) if self._trust.words and "work offset" not in self._trust.trusted else None
        )
        if number is None or found in spellings(number):
            return []
        text = f"work offset {found or 'none'} where the CL file asks for number {number}, {spellings(number)[0]}"
        return [Problem("CS559", 0, 0, text)]

    def _task(self, *, rotary: bool, apart: bool, feed_in_plane: bool) -> Task:
        options = self._options
        lengths = options.tolerance, options.axis_length, self._axis_tolerance
        taken = sagitta(options.tolerance) if rotary else 0.0
        return Task.of(self._program, *lengths, apart=apart, sagitta=taken, feed_in_plane=feed_in_plane)

    def _found(
        self,
        task: Task,
        chunks: Iterator[Elements],
        events: list[Event],
        retracts: Sequence[int],
        said: Callable[[], tuple[NcProgram, int]],
    ) -> Verification:
        """Measure all that is read, and put everything together; `said`: of the text and its curves, then."""
        program, batches, findings = self._program, Batches(task, events, retracts), Findings()
        checks = CHECKS
        if self._continuity:
            checks += (measure_continuity,)
        else:
            findings.worst |= dict.fromkeys(("tangent_jump", "shortest"), Where(math.nan))
        places = WordPlaces(batches, events)
        poses = np.empty((4, len(program)))
        if self._trust.slower:
            chunks = (part.at_most() for part in chunks)
        chunks = Compensated(task, events, findings).watch(_watch_feeds(chunks, findings))

        def items() -> Iterator[tuple[Batch | None, dict[str, Where]]]:
            poses[:3], poses[3] = np.nan, 0.0  # not before other processes are forked, which would keep them
            for batch in batches.of(chunks):
                yield batch if len(findings.breaks) < MOST_BREAKS else None, findings.worst.copy()

        def work(item: tuple[Batch | None, dict[str, Where]]) -> Findings:
            batch, found = item[0], Findings(item[1])
            if batch is not None:
                match = Match.of(task, batch)
                for check in checks:
                    check(match, found)
            return found

        for found in map_in_processes(work, items(), min(self._processes, _READ_FOR)):
            if len(findings.breaks) >= MOST_BREAKS:
                continue
            for some in found.poses:
                poses[:, some[0].astype(np.int64)] = some[1:]
            found.poses = []
            findings.take(found)
            if len(findings.breaks) >= MOST_BREAKS:
                text = f"what comes after {len(findings.breaks)} places where the motions part"
                findings.unlooked.append((findings.breaks[-1], text))
        nc, curves = said()
        findings.unlooked += [*nc.unlooked, *batches.acts.unlooked]
        problems = [problem for problem in nc.problems if self._trust.words or problem.code != CONTROL_WORDS]
        if nc.units != program.units:
            text = f"the program is in {nc.units}, the CL file in {program.units}"
            problems.append(Problem("CS505", 0, 1, text))
        unsaid = ""
        # where the motion leaves the CL path, no place tells which feed is right
        off = {violation.nc_line for violation in findings.violations}
        feeds = [problem for problem in findings.feeds.problems if problem.nc_line not in off]
        problems += batches.acts.problems + feeds + problems_of(findings.violations)
        problems += half_turns(program)
        if not self._trust.skip_cycles:
            problems += batches.acts.left_out.values()
        if self._trust.words and batches.elements:  # without any motion nothing has a place
            axes = () if self._machine is None else self._machine.axes
            clamps = {float(word[1:]) for axis in axes for word in axis.clamp or ()}
            up = self._options.dialect.retracts and FRAME not in self._trust.trusted
            of_statements, at_home, unsaid = places.problems(
                findings, nc.means, KINDS & set(self._trust.trusted), clamps, retracts=up
            )
            problems = [one for one in problems if one.text != GONE_ON or one.nc_line not in at_home] + of_statements
        if nc.coarse:  # a pose missed within the tolerance where digits are too few for it is not verified
            limit = task.tolerance
            missed = [one for one in problems if one.code in ("CS524", "CS531") and one.amount <= limit]
            text = f"exact poses: the digits are too few for {limit:g} mm"
            findings.unlooked += [(one.nc_line, text) for one in missed]
            problems = [one for one in problems if one not in missed] if missed else problems
        return Verification.of(
            findings,
            poses,
            problems,
            task,
            blocks=nc.blocks,
            elements=batches.elements,
            curves=curves,
            left_out=len(batches.acts.left_out) if self._trust.skip_cycles else 0,
            rewinds=tuple(batches.acts.rewinds),
        ).not_verified(not_understood_text(task.asking), unsaid)


def verify(program: Program, nc: NcProgram | bytes | str | os.PathLike[str], **how: Any) -> Verification:
    """Measure an NC text, that is whole, against the CL program it was made from.

    `how` and errors are as in `Verifier`; fields of `Trust` may be given by themselves.

    Returns
    -------
    Verification
        The verdict, problems in the order of the program, and the largest deviations in mm and degrees.

    Raises
    ------
    InputError, SettingsError
        The text cannot be read as a program, or a tolerance is out of its bounds.
    """
    trust = {one.name: how.pop(one.name) for one in fields(Trust) if one.name in how}
    with Verifier(program, nc, trust=Trust(**trust), **how) as verifier:
        return verifier.result()


def _watch_feeds(chunks: Iterator[Elements], findings: Findings) -> Iterator[Elements]:
    """Give out the elements of a text; note the first feed move that no F has come before."""
    for nc in chunks:
        without = (nc.kind != Element.RAPID) & np.isnan(nc.feed) & np.isnan(nc.other_feed)
        if without.any() and NO_FEED not in [text for _, text in findings.unlooked]:
            findings.unlooked.append((int(nc.line[without.argmax()]), NO_FEED))
        yield nc


def _arc_weights(program: Program) -> list[float]:
    """Inner weights of rational cubics that are a circle, for the arcs of a program in parts of 120 degrees at most.

    With its degree raised the quadratic curve with the weights 1, w, 1 has 1, (1 + 2 w) / 3, the same, and 1, where w
    is the cosine of half of the turn (Piegl and Tiller, The NURBS Book, 7.3). Parts may be halved.
    """
    sweep = program.arcs.sweep
    parts = np.outer(np.ceil(sweep / (2.0 * np.pi / 3.0) - 1e-9), 2.0 ** np.arange(_HALVED))
    found: list[float] = distinct((1.0 + 2.0 * np.cos(sweep[:, None] / parts / 2.0)) / 3.0).tolist()
    return found


def _check_bounds(**values: float) -> None:
    for name, value in values.items():
        low, high = BOUNDS[name]
        if not low <= value <= high:
            raise SettingsError("CS202", f"{name} is {value:g}", f"give a value from {low:g} to {high:g}")
