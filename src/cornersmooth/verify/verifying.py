"""The whole verification: NC text against CL program."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from types import TracebackType
from typing import TYPE_CHECKING, Final, Self

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.model import Floats, Program, Units
from cornersmooth.settings import BOUNDS
from cornersmooth.verify.comparison import BEFORE, Compared, Comparison, Joints
from cornersmooth.verify.deviation import Largest, exact_poses
from cornersmooth.verify.farther import way_apart
from cornersmooth.verify.holes import divide_at_holes
from cornersmooth.verify.ncprogram import Event, NcProgram, Problem
from cornersmooth.verify.processes import can_fork
from cornersmooth.verify.reader import CONTROL_WORDS, read_styled
from cornersmooth.verify.ring import Place, Ring
from cornersmooth.verify.sections import Found, Task, put_together
from cornersmooth.verify.sectionwork import work_on
from cornersmooth.verify.source import Source, readable_twice
from cornersmooth.verify.statements import asked, compare, said, way_between
from cornersmooth.verify.stops import find_stretches
from cornersmooth.verify.style import Style
from cornersmooth.verify.trails import Original, original_motion
from cornersmooth.verify.verification import Verification

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: poses of programs whose text is looked at in sections
LONG: Final = 30_000


def verify(
    program: Program,
    nc: NcProgram | bytes | str | os.PathLike[str],
    *,
    tolerance: float,
    axis_length: float = 10.0,
    control: str = "fanuc",
    machine: Machine | None = None,
    tcp: bool = True,
    words: bool = True,
    processes: int = 1,
) -> Verification:
    """Measure an NC text against the CL program it was made from.

    Parameters
    ----------
    program : Program
    nc : NcProgram, bytes or path
    tolerance : float, mm
        ε: what is allowed at tip and axis point.
    axis_length : float, mm
        H: distance of the axis point from the tip.
    control, machine, tcp
        As in `read_nc`.
    words : bool
        Whether words beside the motion must say what the CL file asks for; not where nobody knows what they mean.
    processes : int
        Processes to work on long texts with, where the system can fork; the result does not depend on it.

    Returns
    -------
    Verification

    Raises
    ------
    InputError
        Where the text cannot be read.
    SettingsError
        CS202 for a tolerance or axis length out of bounds; as in `read_nc`.
    """
    if isinstance(nc, NcProgram):
        _check_bounds(tolerance, axis_length)
        original = original_motion(program, tolerance, axis_length)
        return _whole(original, nc, tolerance, axis_length, words, processes)
    with Verifier(
        program,
        nc,
        tolerance=tolerance,
        axis_length=axis_length,
        control=control,
        machine=machine,
        tcp=tcp,
        words=words,
        processes=processes,
    ) as verifier:
        return verifier.result()


class Verifier:
    """A verification that begins while the text is still being written.

    A context manager: processes of its own read the text as it grows, until `result` is asked for or the block ends::

        with Verifier(program, path, tolerance=0.04) as verifier:
            ...  # write to path
            found = verifier.result()

    Parameters
    ----------
    As `verify`, but for `nc`: bytes or path; the file must be there.
    """

    def __init__(
        self,
        program: Program,
        nc: bytes | str | os.PathLike[str],
        *,
        tolerance: float,
        axis_length: float = 10.0,
        control: str = "fanuc",
        machine: Machine | None = None,
        tcp: bool = True,
        words: bool = True,
        processes: int = 1,
    ) -> None:
        _check_bounds(tolerance, axis_length)
        self._name = None if isinstance(nc, bytes) else str(nc)
        nc = readable_twice(nc)
        self._program, self._nc, self._words, self._processes = program, nc, words, processes
        self._style = Style.of(control, machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length)
        self._source = Source(nc)
        self._task: Task | None = None
        if len(program) >= LONG:
            self._task = Task.of(program, self._source, self._style, words=words)
        self._ring: Ring | None = None

    def __enter__(self) -> Self:
        if self._task is not None and self._processes > 1 and can_fork():
            with contextlib.suppress(OSError):  # without them it takes longer
                self._ring = Ring(partial(work_on, self._task), self._processes)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._ring is not None:
            self._ring.end()
        self._source.close()

    def result(self) -> Verification:
        """Say what was found; the text must be complete.

        Raises
        ------
        InputError
            Where the text cannot be read.
        """
        self._source.finish()
        if self._task is not None:
            if self._ring is None:
                shares = [work_on(self._task, Place())]
            else:
                _ = self._task.length  # while the others are still at work
                shares = self._ring.results()
            found = put_together(shares)
            verification = None if found is None else self._of_sections(self._task, found)
            if verification is not None:
                return verification
        nc = read_styled(self._nc, self._style, self._name)
        return _whole(self._original, nc, self._style.tolerance, self._style.axis_length, self._words, self._processes)

    @cached_property
    def _original(self) -> Original:
        if self._task is not None:
            return self._task.original
        return original_motion(self._program, self._style.tolerance, self._style.axis_length)

    def _of_sections(self, task: Task, found: Found) -> Verification | None:
        """Put the sections together; None where something is wrong."""
        original, length, style, program = task.original, task.length, task.style, task.program
        problems = _units_problems(program, found.units)
        compared = Compared(Largest(), Joints(), [], [], np.zeros(0))
        events: list[Event] = []
        places: list[Floats] = []
        for section in found.sections:
            compared.largest.take(section.compared.largest)
            compared.joints.take(section.compared.joints)
            compared.poses += section.compared.poses
            events += section.events
            places.append(section.places + length[section.vertex])
        if self._words:
            unsaid = style.dialect.unsaid
            whole = np.concatenate(places)
            rooms = np.zeros(len(whole))
            problems += _statement_problems(original, length, events, whole, rooms, found.margin, unsaid)
        if problems:
            return None
        return Verification.of(
            compared,
            [],
            tolerance=style.tolerance,
            axis_length=style.axis_length,
            poses=len(program),
            blocks=found.end.blocks,
            elements=found.end.elements,
            curves=found.end.curves,
        )


def _whole(
    original: Original, nc: NcProgram, tolerance: float, axis_length: float, words: bool, processes: int
) -> Verification:
    """Measure a text that has been read as a whole."""
    program = original.program
    problems = [problem for problem in nc.problems if words or problem.code != CONTROL_WORDS]
    problems += _units_problems(program, nc.units)
    holes = divide_at_holes(original, nc, axis_length)
    stretches, found = find_stretches(original, nc, axis_length, holes.parts)
    problems += holes.problems + found
    own = np.array([event.element - 1 for event in nc.events], np.int64)
    elements = np.unique(own)
    comparison = Comparison(original, exact_poses(original), nc, tolerance, axis_length)
    compared = comparison.compare(stretches, elements, holes=holes.element_move, processes=processes)
    problems += compared.problems
    if words and len(nc):  # without any motion nothing has a place
        places = compared.places[np.searchsorted(elements, own)]
        length, margin = comparison.matcher.track.length, comparison.matcher.margin
        rooms = np.where(nc.rotary & (own >= 0), axis_length * nc.second_room[own], 0.0)
        apart = partial(way_apart, comparison.matcher.track)
        problems += _statement_problems(original, length, nc.events, places, rooms, margin, nc.unsaid, apart)
    return Verification.of(
        compared,
        problems,
        tolerance=tolerance,
        axis_length=axis_length,
        poses=len(program),
        blocks=nc.blocks,
        elements=len(nc),
        curves=len(nc.curves),
    )


def _statement_problems(
    original: Original,
    length: Floats,
    events: Sequence[Event],
    places: Floats,
    rooms: Floats,
    margin: float,
    unsaid: frozenset[str | tuple[str, float]],
    apart: Callable[[float, float], float] = way_between,
) -> list[Problem]:
    """What words beside the motion say wrongly; `length` is that of the original path up to its vertices."""
    program = original.program
    move = np.searchsorted(original.pose, [statement.pose for statement in program.statements]) - 1
    moves = len(original.pose)
    end = float(length[-1]) if moves else 0.0
    asked_at = np.where(move >= 0, length[original.trail.last[np.clip(move, 0, None)]] if moves else 0.0, BEFORE)
    theirs = asked(program, asked_at.tolist(), end)
    ours = said(events, np.nan_to_num(places, nan=0.0).tolist(), rooms.tolist())
    return compare(theirs, ours, margin, unsaid, apart)


def _units_problems(program: Program, units: Units) -> list[Problem]:
    if units == program.units:
        return []
    return [Problem("CS505", 0, 1, f"the text is in {units}, the CL file in {program.units}")]


def _check_bounds(tolerance: float, axis_length: float) -> None:
    for name, value in (("tolerance", tolerance), ("axis_length", axis_length)):
        low, high = BOUNDS[name]
        if not low <= value <= high:
            raise SettingsError("CS202", f"{name} is {value:g}", f"give a value from {low:g} to {high:g}")
