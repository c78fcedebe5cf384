"""A finished program in, the same with smooth runs out; any two programs compared, and all ways to smooth one."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any, Final

import numpy as np

from cornersmooth.errors import CornersmoothError, InputError, SettingsError, Verdict
from cornersmooth.filter.checking import Checked, Place, block_time, check, pair, places
from cornersmooth.filter.fewest import fewest
from cornersmooth.filter.motion import Job
from cornersmooth.filter.runs import Left, ProgramReader, Reading
from cornersmooth.filter.spelling import SAMPLE, Spelling
from cornersmooth.filter.times import Times, by_own_law, least_time, no_runs
from cornersmooth.filter.writing import smoothed
from cornersmooth.frame import HEAD
from cornersmooth.kinematics import Machine
from cornersmooth.nc import fit_settings
from cornersmooth.nc.form import Form
from cornersmooth.nc_reader import NcProgram
from cornersmooth.nc_reader.recognition import foreign_kind, is_cl_file
from cornersmooth.settings import Settings
from cornersmooth.system.processes import return_free_memory
from cornersmooth.times import Timing
from cornersmooth.times.comparing import MOST_POSES, Candidate, Row, Table, Watch, law_of_lines, with_rows

#: the machine of a program that names no rotary axis
THREE_AXES: Final = Machine("three axes", ())

#: how many times more cuts than poses of CL files are looked at where times need no plan
_BY_LAW: Final = 10

#: marks of the coding and of the transfer at the begin and at the end of a program: the lines stay
_MARKS: Final = re.compile(rb"\A(\xef\xbb\xbf)?(%[ \t\r]*(?=\n))?|(?<=\n)%[ \t\r\n]*\Z")

#: by what part planned times may differ that are the same, and how much faster it must be with more lines: times are
#: as near to those that are planned closely
_EQUAL: Final = 1e-3
_FASTER: Final = 1e-2

#: words by which a program lets its control round within a tolerance
_OWN: Final = re.compile(
    rb"(G64[ \t]*P|CYCLE832[ \t]*\(|CTOL[ \t]*=|CYCL DEF 32\.1[ \t]*T|G187[^\n(]*E)[ \t]*(\d*\.?\d+)"
    rb"(?:[ \t]*Q[ \t]*(\d*\.?\d+))?"
)


@dataclass(frozen=True)
class Filtered:
    """What became of a program."""

    data: bytes  #: the new program
    lines: int  #: lines, new_lines: of the old program and of the new one
    new_lines: int
    cuts: int  #: cuts, smoothed, runs: cuts of the old program, those of them in runs that were replaced, those runs
    smoothed: int
    runs: int
    left: tuple[Left, ...]  #: why the others stay
    checked: Checked | None  #: None where it was not wanted
    units_said: bool = True  #: whether the program says its units
    seconds: tuple[float, float] | None = None  #: planned time before and after; see `Times`
    #: what the control does in the runs before and after, where that was wanted
    motions: tuple[NcProgram, NcProgram] | None = None
    #: first and last line of each run that was replaced, in the old program and in the new one; of those in `motions`
    changed: tuple[tuple[int, int, int, int], ...] = ()
    #: mm: within what the program lets the control round what has changed, and merge its lines: both add to ε
    own_tolerances: tuple[float, float] = (0.0, 0.0)
    block_time: float = 0.0  #: s: that of `Checked.short`
    untimed: InputError | None = None  #: why the time of the program is not known where it was wanted
    compared: bool = False  #: whether two programs were compared alone, and nothing was to be smoothed

    @property
    def rounding(self) -> float:
        """Sum of the program's own tolerances in mm."""
        return sum(self.own_tolerances)

    @property
    def verdict(self) -> Verdict:
        """How the program turned out."""
        if not self.runs and not self.compared:
            return Verdict.NOT_SMOOTHED
        if self.checked is None:
            return Verdict.NOT_VERIFIED
        return Verdict.of(problems=len(self.checked.wrong))


def filter_program(
    data: bytes,
    form: Form,
    settings: Settings | None = None,
    *,
    tip_from_start: bool = False,
    inch: bool = False,
    verify: bool = True,
    axes: Machine | None = None,
    most: int | None = None,
    paths: bool = False,
    processes: int = 1,
) -> Filtered:
    """Smooth the cutting runs of a finished NC program.

    Parameters
    ----------
    data : bytes
        The program. What is not known in it is let through.
    form : Form
        What `cornersmooth.choose_form` gives for the control, the machine and the form of the new blocks.
    settings : Settings, optional
        ε 0.01 mm, H 10 mm, the proportional method.
    tip_from_start : bool
        Whether tool tip control is on already where the program begins.
    inch : bool
        Whether the program is in inches where it does not say so itself.
    verify : bool
        Whether both programs are read and compared. Runs that do not pass stay as they are.
    axes : Machine, optional
        Take what is fastest under the limits of the axes of this machine, and say its time. Where the time of the
        program is not known (CS264), it gets the fewest blocks, and `Filtered.untimed` says why.
    most : int, optional
        Only whole runs from the middle are smoothed, of no more cuts than this.
    paths : bool
        Whether the motions are given.
    processes : int

    Returns
    -------
    Filtered
        The new program in bytes, counts, why cuts were left, deviations in mm, seconds where `axes` are given.

    Raises
    ------
    SettingsError
        The form cannot hold what the settings ask for, or `axes` does not say how fast its axes may go.
    InputError
        `axes` does not reach a pose; CS594: a CL file, or a table of points; CS595: no program.
    """
    settings = Settings() if settings is None else settings
    alone = settings.lines == "long" and not form.long_lines  # without tip control: from vertex to vertex
    settings = settings.but(lines=None) if alone else settings
    job, old = read_program(data, form, settings, tip_from_start=tip_from_start, inch=inch, processes=processes)
    if most is not None:
        left_all_but(old, most)
    few = settings.lines is None
    texts, why = fewest(job, old, old.runs, arcs=not alone) if few else smoothed(job, old, old.runs)
    times = None if axes is None else Times(job, old, axes)
    untimed = None if times is None else times.unknown()
    times = times if untimed is None else None
    if few and not alone and times is not None and old.runs and not old.absent:
        texts, why = _fastest(job, old, texts, why, times)
    found = _result(job, old, _way(job, old, texts, why, verify=verify), times, paths=paths)
    return replace(found, untimed=untimed)


@dataclass(frozen=True)
class _Way:
    """Texts in the place of runs, read and compared."""

    after: Reading
    where: list[Place]
    why: dict[int, str]  #: why other runs are left, by their first line
    checked: Checked | None

    def text(self, place: Place) -> bytes:
        """Blocks in the place of a run."""
        return self.after.lines(place.first, place.stop)


def _way(job: Job, old: Reading, texts: dict[int, bytes], why: dict[int, str], *, verify: bool) -> _Way:
    """Read and compare a program with some texts; where that fails, a run has lines alone, or stays as it is."""
    return_free_memory()  # verification takes as much again
    why = dict(why)
    for run in old.runs:
        if texts.get(run.first) == old.lines(run.first, run.stop):
            del texts[run.first]
            why[run.first] = "nothing in it is to be rounded"
    again = set[int]()
    while True:
        new, where = _spliced(old, texts)
        texts.clear()  # as long as the new program
        after = job.reader.read(new, [place.stop for place in where])
        checked = check(job, old, after, where) if verify else Checked(())
        bad = {p.run.first: one.text for p in where for one in checked.wrong if p.first < one.nc_line <= p.stop}
        if not bad:
            return _Way(after, where, why, checked if verify else None)
        texts = {p.run.first: after.lines(p.first, p.stop) for p in where if p.run.first not in bad}
        once = [p.run for p in where if p.run.first in bad.keys() - again and job.settings.lines is None]
        again |= bad.keys()
        texts |= fewest(job, old, once, arcs=False)[0]
        why |= {first: f"verification found: {text}" for first, text in bad.items()}


def _fastest(
    job: Job, old: Reading, texts: dict[int, bytes], why: dict[int, str], planned: Times
) -> tuple[dict[int, bytes], dict[int, str]]:
    """Of each run the text with the fewest blocks that is fast, and no slower than the run.

    Corners are smoothed in runs that take longer than their feeds ask for. Lines alone are tried where arcs are slower.
    """
    found: dict[int, list[tuple[float, int, bytes | None]]] = {}

    def try_(job: Job, texts: dict[int, bytes]) -> None:
        way = _way(job, old, texts, {}, verify=False)
        times = planned.of_runs(way.after, way.where).tolist()
        for place, (before, after) in zip(way.where, times, strict=True):
            own = found.setdefault(place.run.first, [(before, place.run.lines, None)])
            own.append((after, place.stop - place.first, way.text(place)))

    try_(job, texts)
    least = {first: min(seconds for seconds, *_ in own) for first, own in found.items()}
    slow = [run for run in old.runs if least.get(run.first, math.inf) > (1.0 + _FASTER) * least_time(job, run)]
    rows = replace(job, spelling=_fine(job.spelling, job.form, job.settings, inch=old.runs[0].state.unit != 1.0))
    try_(rows, smoothed(rows, old, slow)[0])

    def best() -> dict[int, bytes]:
        chosen: dict[int, bytes] = {}
        for first, own in found.items():
            fast = min((1.0 + _FASTER) * min(seconds for seconds, *_ in own), (1.0 + _EQUAL) * own[0][0])
            text = min((one for one in own if one[0] <= fast), key=lambda one: one[1])[2]
            if text is not None:
                chosen[first] = text
        return chosen

    try_(job, fewest(job, old, [run for run in old.runs if run.first in found.keys() - best().keys()], arcs=False)[0])
    chosen = best()
    slower = dict.fromkeys(found.keys() - chosen.keys(), "nothing makes it faster")
    return chosen, {first: text for first, text in why.items() if first not in chosen} | slower


def verify_programs(
    old: bytes,
    new: bytes,
    form: Form,
    settings: Settings | None = None,
    *,
    tip_from_start: bool = False,
    inch: bool = False,
    axes: Machine | None = None,
    paths: bool = False,
    processes: int = 1,
    new_name: str = "the second program",
) -> Filtered:
    """Compare a program with the one that it was made from, whoever made it.

    `new_name` is for messages; the other parameters are those of `filter_program`.
    """
    settings = Settings() if settings is None else settings
    old, new = (_MARKS.sub(b"", data) for data in (old, new))
    job, before = read_program(old, form, settings, tip_from_start=tip_from_start, inch=inch, processes=processes)
    whole = job.reader.read(new)
    refuse_no_program(whole, new_name)
    where, wrong = places(before, whole, job.reader)
    after = job.reader.read(new, [place.stop for place in where])
    checked = Checked(tuple(wrong)) if wrong else check(job, before, after, where)
    way = _Way(after, where, {}, checked)
    times = None if wrong or axes is None else Times(job, before, axes)
    found = _result(job, before, way, times, paths=paths and not wrong)
    return replace(found, compared=True)


def refuse_cl_file(head: bytes, file: str | None = None) -> None:
    """Refuse what is no program by its beginning (InputError CS594: a CL file; CS595: a page, a drawing, a model)."""
    if kind := foreign_kind(head):
        raise InputError("CS595", f"this is {kind}, not an NC program", "give an NC program", file=file)
    if is_cl_file(head):
        hint = "make a program of it: 'cornersmooth smooth'"
        raise InputError("CS594", "this is a CL file, not an NC program", hint, file=file)


def refuse_no_program(reading: Reading, file: str | None = None) -> None:
    """Refuse what `refuse_cl_file` does, and a text without any block that moves or sets anything (CS595)."""
    refuse_cl_file(reading.data[:HEAD], file)
    if not reading.blocks:
        binary = ": this is a binary file, or a text in UTF-16" * (b"\0" in reading.data)
        what = f"no NC block that moves or sets anything was found{binary}"
        raise InputError("CS595", what, "give an NC program, and its control with --control", file=file)


def read_program(
    data: bytes, form: Form, settings: Settings, *, tip_from_start: bool = False, inch: bool = False, processes: int = 1
) -> tuple[Job, Reading]:
    """Read a program, and see how it is to be written; parameters and errors as of `filter_program`."""
    refuse_cl_file(data[:HEAD])
    if form.curves:  # CS241
        line = next(name for name, one in form.table.forms.items() if not one.curve)
        what = f"{form.control} form {form.name} has curves, and a program is smoothed in lines"
        raise SettingsError("CS241", what, f"use -f {line}")
    tcp = form.orientation != "machine"
    reader = ProgramReader(form.table.dialect, form.machine, tcp=tcp, tip_from_start=tip_from_start, inch=inch)
    old = reader.read(data)
    refuse_no_program(old)
    cuts = (old.lines(k, k + 1) for run in old.runs for k in range(run.first, run.stop))
    spelling = Spelling.of(islice(cuts, SAMPLE), len(reader.axes))
    if old.runs and settings.lines is not None:
        spelling = _fine(spelling, form, settings, inch=old.runs[0].state.unit != 1.0)
    return Job(reader, form, spelling, settings, processes), old


def _fine(spelling: Spelling, form: Form, settings: Settings, *, inch: bool) -> Spelling:
    """Give the digits of the program, or where ε is finer than they can hold, those of the control."""
    try:
        fit_settings(settings, spelling.form(form, rounding=False), "inch" if inch else "mm")
    except SettingsError:
        spelling = spelling.with_digits(form.table.digits, inch=inch)
        fit_settings(settings, spelling.form(form, rounding=False), "inch" if inch else "mm")
    return spelling


def _spliced(old: Reading, texts: dict[int, bytes]) -> tuple[bytes, list[Place]]:
    parts: list[bytes] = []
    where: list[Place] = []
    at, line = 0, 0
    for run in old.runs:
        if run.first not in texts:
            continue
        text = texts[run.first]
        parts += [old.lines(at, run.first), text]
        first = line + run.first - at
        line = first + text.count(b"\n") + (not text.endswith(b"\n"))
        where.append(Place(run, first, line))
        at = run.stop
    parts.append(old.lines(at, len(old.why)))
    return b"".join(parts), where


def left_all_but(reading: Reading, most: int) -> None:
    """Leave all runs but some from the middle, of no more cuts than that; one at least."""
    ends = np.cumsum([0, *map(len, reading.runs)])
    first = min(int(np.searchsorted(ends, (ends[-1] - most) / 2)), max(len(reading.runs) - 1, 0))
    stop = max(int(np.searchsorted(ends, ends[first] + most, side="right")) - 1, first + 1)
    for run in (*reading.runs[:first], *reading.runs[stop:]):
        reading.leave(run, "it was not asked for")
    reading.runs[:] = reading.runs[first:stop]


def _result(job: Job, old: Reading, way: _Way, times: Times | None, *, paths: bool) -> Filtered:
    """What became of a program; how long its runs take, and what the control does in them, as far as needed."""
    new, where, why = way.after, way.where, way.why
    for run in old.runs:
        if run.first in why:
            old.leave(run, why[run.first])
    drawn = [place for place in where if place.run.state.unit == where[0].run.state.unit]
    return Filtered(
        data=new.data,
        lines=len(old.why),
        new_lines=len(new.why),
        cuts=old.cuts,
        smoothed=sum(len(place.run) for place in where),
        runs=len(where),
        left=old.left(),
        checked=way.checked,
        units_said="units" in old.said,
        seconds=times.of_change(new, where) if times is not None and where else None,
        motions=pair(job, old, new, drawn) if paths and where else None,
        changed=tuple((place.run.first + 1, place.run.stop, place.first + 1, place.stop) for place in drawn),
        own_tolerances=_own_tolerances(new.data, where[0].run.state.unit) if where else (0.0, 0.0),
        block_time=block_time(job),
    )


def _own_tolerances(data: bytes, unit: float) -> tuple[float, float]:
    """Within what a program lets the control round it, and merge its lines, in mm; 0.0 for unknown."""
    # LinuxCNC without Q merges lines within P, too
    words = _OWN.findall(data.upper())
    found = ((unit * float(p), unit * float(q or p) if word[:3] == b"G64" else 0.0) for word, p, q in words)
    return max(found, key=sum, default=(0.0, 0.0))


def compare_filtered(
    data: bytes,
    tried: Sequence[Candidate],
    axes: Machine,
    watch: Watch | None = None,
    **how: Any,
) -> Table:
    """Smooth, verify and plan the runs of a program in every way; other parameters as of `filter_program`.

    `tried` has at least one, in forms with the words of the program; `watch` as of `compare_programs`.
    CS265: the machine has no limits of axes; CS266: no cut can be smoothed; as `Times`.
    """
    form, settings = tried[0].form, tried[0].settings
    job, old = read_program(data, form, settings, **how)
    timing = Timing.of(form, settings, axes=axes)
    if timing is None:
        raise SettingsError("CS265", "no limits of axes are known", "name a machine that has [dynamics] with --limits")
    most = MOST_POSES * (_BY_LAW if by_own_law(job) else 1)
    if not old.runs:
        raise no_runs()
    cuts = sum(map(len, old.runs))
    left_all_but(old, most)
    share, before = sum(map(len, old.runs)) / cuts, Times(job, old, axes).as_it_is()

    def work(candidate: Candidate) -> Row:
        row = Row.of(candidate)
        try:
            found = filter_program(data, candidate.form, candidate.settings, **how, axes=axes, most=most)
        except CornersmoothError as failure:
            return replace(row, verdict=getattr(failure, "what", str(failure)))
        saved = 0.0 if found.seconds is None else found.seconds[0] - found.seconds[1]
        assert found.checked is not None
        point = found.checked.axis_point
        return replace(
            row,
            verdict=str(found.verdict),
            blocks=found.new_lines,
            bytes=len(found.data),
            seconds=before - saved,
            saved=saved,
            tip=found.checked.tip,
            axis_point=None if point != point else point,
        )

    return with_rows(Table(before, "the program as it is", share, law_of_lines(timing), ()), tried, work, watch)
