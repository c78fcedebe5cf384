"""Every program that a control can run of a part, each written, measured and planned as it is written."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from cornersmooth import nc
from cornersmooth.arrays import some_poses
from cornersmooth.errors import CornersmoothError, SettingsError, Verdict
from cornersmooth.feedrate import BlockLimits
from cornersmooth.feedrate.intervals import ROUGHLY, Resolution
from cornersmooth.kinematics import Machine
from cornersmooth.model import Move, Program
from cornersmooth.nc import Control, Form, choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import CURVES_METHOD, DEFAULT_METHOD, Settings
from cornersmooth.system.processes import map_in_processes, useful_processes
from cornersmooth.times import Timing, without_holes

#: poses of a part that are looked at; of longer ones whole runs from the middle
MOST_POSES = 2000

#: Times over the least that count as that: plans are 0.6 to 3 % above linear programmes (docs/feedrate.md).
EQUAL = 1.03

#: Most by which rough plans are too long: 0.9 to 5.1 % on the first 90 poses of the sample, FANUC with `table-ac`.
ROUGH = 0.06

#: the method as published
_PAPERS = "zhang2016"

#: block time that leaves the number of lines to the chord tolerance, s
_BY_CHORD = 1.0


@dataclass(frozen=True)
class Candidate:
    """A way to write a part."""

    form: Form
    settings: Settings
    #: "fine" as short as the control can take them, "chord" by the chord tolerance alone, or "long"; empty in curves.
    lines: str
    options: tuple[str, ...]  #: What asks `cornersmooth smooth` for it, besides the control and the tolerance


@dataclass(frozen=True)
class Row:
    """What became of a candidate."""

    #: Form of the control; "vectors" or "rotary words of MACHINE"; method; lines as in `Candidate`.
    form: str
    words: str
    method: str
    lines: str
    options: tuple[str, ...]  #: As in `Candidate`
    verdict: str  #: Of verification; what was wrong where it was not written
    blocks: int = 0
    bytes: int = 0
    #: As written, and less than the unsmoothed lines; None where nothing was written.
    seconds: float | None = None
    saved: float | None = None
    #: mm: Largest measured deviation; of the axis point None under an axis tolerance.
    tip: float | None = None
    axis_point: float | None = None
    limits: tuple[tuple[str, float], ...] = ()  #: What the program reaches the longest
    about: bool = False  #: Whether the time is that of a rough plan, up to `ROUGH` too long
    text: Any = field(default=b"", repr=False)  #: The program, where its time is rough

    @classmethod
    def of(cls, candidate: Candidate) -> Row:
        """Row of a candidate of which nothing is known yet."""
        form, settings = candidate.form, candidate.settings
        words = f"rotary words of {form.machine.name}" if form.rotary and form.machine is not None else "vectors"
        return cls(form.name, words, settings.method, candidate.lines, candidate.options, verdict="")

    def as_dict(self) -> dict[str, Any]:
        """Plain values, without the program."""
        return {name: value for name, value in asdict(self).items() if name != "text"}

    @property
    def usable(self) -> bool:
        """Whether the program keeps the tolerance, and has a time."""
        return self.seconds is not None and self.verdict in (Verdict.PASSED, Verdict.INCOMPLETE)


@dataclass(frozen=True)
class Table:
    """All rows, and what they are measured against."""

    unsmoothed: float  #: s: Time of the lines of the CL file
    against: str  #: What these lines are, where that is not the path of the CL file
    share: float  #: Part of the poses that was looked at
    law: str  #: By which lines are planned
    rows: tuple[Row, ...]

    @property
    def best(self) -> int | None:
        """Number of the fastest row that keeps the tolerance; of those that no plan can tell apart the smallest."""
        return self._best(lambda row: True)

    @property
    def best_in_lines(self) -> int | None:
        """Number of the best row that any control with these words runs: without curves."""
        return self._best(lambda row: bool(row.lines))

    def _best(self, wanted: Callable[[Row], bool]) -> int | None:
        usable = [number for number, row in enumerate(self.rows) if row.usable and wanted(row)]
        if not usable:
            return None
        least = min(self.rows[number].seconds or 0.0 for number in usable)
        equal = (number for number in usable if (self.rows[number].seconds or 0.0) <= EQUAL * least)
        return min(equal, key=lambda number: self.rows[number].bytes)

    @property
    def gains(self) -> bool:
        """Whether any program takes less time than the unsmoothed lines, in the digits that are written."""
        best = None if self.best is None else self.rows[self.best].seconds
        return best is not None and round(best, 1) < round(self.unsmoothed, 1)

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        rows = [row.as_dict() | {"best": number == self.best} for number, row in enumerate(self.rows)]
        return {
            "schema": "cornersmooth-compare/1",
            "unsmoothed_seconds": self.unsmoothed,
            "unsmoothed": self.against or "lines of the CL file",
            "share_of_poses": self.share,
            "law": self.law,
            "gains": self.gains,
            "rows": rows,
        }


#: called with the table, without rows first, and after each row
Watch = Callable[[Table], None]


def candidates(control: Control, settings: Settings, machine: Machine | None) -> list[Candidate]:
    """Forms, methods and line densities that a control can run, with tool vectors and with words of the machine."""
    found: list[Candidate] = []
    for name in control.forms:
        for words in dict.fromkeys((None, machine)):
            try:
                form = choose_form(control, name, machine=words)
            except SettingsError:
                continue
            rotary = ("--machine", words.name) if words is not None and form.rotary else ()
            if words is not None and words.names and not rotary:
                continue
            # the paper's, for comparison: no rotary words follow its curves, and one density of lines is enough
            for method in (DEFAULT_METHOD, CURVES_METHOD, *(() if rotary else (_PAPERS,))):
                for lines, changes, more in [*_densities(form)][: 1 if method == _PAPERS else None]:
                    options = ("-f", name, *rotary, "--method", method, *more)
                    found.append(Candidate(form, settings.but(method=method, **changes), lines, options))
    return found


def _densities(form: Form) -> Iterator[tuple[str, dict[str, Any], tuple[str, ...]]]:
    """Names of line densities of a form, what they change of the settings, and their options."""
    if form.curves:
        yield "", {}, ()
        return
    dense = ("--lines", "dense")
    if form.table.lines.block_time:
        yield "fine", {"lines": "dense"}, dense
        yield "chord", {"lines": "dense", "block_time": _BY_CHORD}, (*dense, "--block-time", f"{_BY_CHORD:g}s")
    else:
        yield "chord", {"lines": "dense"}, dense
    if form.long_lines:
        yield "long", {"lines": "long"}, ("--lines", "long")


def compare_programs(
    program: Program,
    tried: list[Candidate],
    axes: Machine,
    blocks: BlockLimits | None = None,
    watch: Watch | None = None,
) -> Table:
    """Write, measure and plan every candidate, of which there is one at least; all moves of the program have a feed.

    Parameters
    ----------
    axes : Machine
        Whose limits, in place of those of the machines of the forms.

    Raises SettingsError CS265: no axis of the machine has limits. CornersmoothError: the unsmoothed lines cannot be
    planned.
    """
    part = without_holes(_middle(program))
    first = next((one for one in tried if Timing.of(one.form, one.settings, axes=axes) is not None), None)
    timing = None if first is None else Timing.of(first.form, first.settings, axes=axes, blocks=blocks)
    if timing is None:
        raise SettingsError("CS265", "no limits of axes are known", "name a machine that has [dynamics] with --limits")
    unsmoothed, against = timing.unsmoothed(part)

    def planned(row: Row, candidate: Candidate, text: bytes, resolution: Resolution | None = None) -> Row:
        """Row with the time of its program; the law of a control takes no rough plan."""
        fitted = nc.fit_settings(candidate.settings, candidate.form, part.units)
        timing = Timing.of(candidate.form, fitted, axes=axes, blocks=blocks)
        if timing is None:
            return replace(Row.of(candidate), verdict="no limits of axes are known")
        about = resolution is not None and not candidate.form.table.lines.planner
        seconds, limits = timing.written(text, part, resolution=resolution)
        kept = text if about else b""
        return replace(row, seconds=seconds, saved=unsmoothed - seconds, limits=limits, about=about, text=kept)

    def work(candidate: Candidate) -> Row:
        row, stream = Row.of(candidate), io.BytesIO()
        try:
            result = postprocess(part, stream, candidate.settings, form=candidate.form, processes=1)
            if (found := result.verification) is None:
                return replace(row, verdict=result.unverified)
            made = replace(
                row,
                verdict=str(result.verdict),
                blocks=result.written.blocks,
                bytes=len(stream.getvalue()),
                tip=found.max_tip_deviation_mm,
                axis_point=None if found.axis_tolerance is not None else found.max_axis_point_deviation_mm,
            )
            return planned(made, candidate, stream.getvalue(), ROUGHLY)
        except CornersmoothError as failure:
            return replace(row, verdict=getattr(failure, "what", str(failure)))

    def closely(number: int) -> Row:
        return planned(table.rows[number], tried[number], table.rows[number].text)

    begun = Table(unsmoothed, against, len(part) / max(len(program), 1), law_of_lines(timing), ())
    table = with_rows(begun, tried, work, watch)
    leading = _leading(table.rows)
    rows = dict(zip(leading, map_in_processes(closely, leading, useful_processes()), strict=True))
    return replace(table, rows=tuple(rows.get(number, row) for number, row in enumerate(table.rows)))


def _leading(rows: Sequence[Row]) -> list[int]:
    """Rows of rough times that may be the best of all, or of those in lines."""
    found = set[int]()
    for some in ([*enumerate(rows)], [(number, row) for number, row in enumerate(rows) if row.lines]):
        times = {number: row.seconds for number, row in some if row.usable and row.seconds is not None}
        found |= {one for one, seconds in times.items() if seconds <= EQUAL * (1.0 + ROUGH) * min(times.values())}
    return sorted(number for number in found if rows[number].about)


def with_rows(table: Table, tried: Sequence[Candidate], work: Callable[[Candidate], Row], watch: Watch | None) -> Table:
    """Add the row of every candidate, by as many processes as are useful."""
    tell = watch or (lambda table: None)
    tell(table)
    for row in map_in_processes(work, tried, useful_processes()):
        table = replace(table, rows=(*table.rows, row))
        tell(table)
    return table


def law_of_lines(timing: Timing) -> str:
    """State the law by which a control is taken to run lines, in one sentence or two."""
    if timing.form.table.lines.planner:
        return f"planner {timing.form.table.lines.planner}: see docs/feedrate.md"
    blocks = timing.blocks
    known = "all blocks" if blocks.look_ahead is None else f"{blocks.look_ahead} blocks"
    return (
        f"where lines meet, no axis of {timing.machine.name} changes its speed by more than its acceleration allows in "
        f"{1000.0 * timing.limits.period:g} ms; block time {1000.0 * blocks.block_time:g} ms; look-ahead {known}"
    )


def _middle(program: Program) -> Program:
    """Whole runs from the middle of a long program, from rapid to rapid as far as these are near enough."""
    if len(program) <= MOST_POSES:
        return program
    rapids = np.flatnonzero(program.kind == Move.RAPID)
    wanted = (len(program) - MOST_POSES) // 2
    before = rapids[(rapids <= wanted) & (rapids > wanted - MOST_POSES)]
    first = int(before[-1]) if len(before) else wanted
    ends = rapids[(rapids > first) & (rapids <= first + MOST_POSES)]
    return some_poses(program, first, int(ends[-1]) if len(ends) else first + MOST_POSES)
