"""Every way in which the runs of a program can be smoothed on a control, each verified and planned."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from cornersmooth.comparing import MOST_POSES, Candidate, Row, Table, law_of_lines, rows_of
from cornersmooth.errors import CornersmoothError, SettingsError
from cornersmooth.filter.program import filter_program, left_all_but, read_program
from cornersmooth.filter.times import by_own_law, no_runs, time_as_it_is
from cornersmooth.kinematics import Machine
from cornersmooth.saving import Timing

#: how many times more cuts are looked at where times need no plan
_BY_LAW = 10


def compare_filtered(
    data: bytes,
    tried: Sequence[Candidate],
    axes: Machine,
    *,
    tip_from_start: bool = False,
    inch: bool = False,
    processes: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Table:
    """Smooth, verify and plan the runs of a program in every way; other parameters as of `filter_program`.

    `tried` has at least one, in forms with the words of the program; `progress` gets rows done and rows in all.
    CS265: the machine has no limits of axes; CS266: no cut can be smoothed; as `planned_times`.
    """
    first = tried[0]
    job, old = read_program(data, first.form, first.settings, tip_from_start=tip_from_start, inch=inch)
    timing = Timing.of(first.form, first.settings, axes=axes)
    if timing is None:
        raise SettingsError("CS265", "no limits of axes are known", "name a machine that has [dynamics] with --limits")
    most = MOST_POSES * (_BY_LAW if by_own_law(job) else 1)
    cuts = max(sum(map(len, old.runs)), 1)
    left_all_but(old, most)
    if not old.runs:
        raise no_runs()
    share = sum(map(len, old.runs)) / cuts
    before = time_as_it_is(job, old, axes)

    def work(candidate: Candidate) -> Row:
        row, form, settings = Row.of(candidate), candidate.form, candidate.settings
        try:
            found = filter_program(data, form, settings, tip_from_start=tip_from_start, inch=inch, axes=axes, most=most)
        except CornersmoothError as failure:
            return replace(row, verdict=getattr(failure, "what", str(failure)))
        saved = 0.0 if found.seconds is None else found.seconds[0] - found.seconds[1]
        checked = found.checked
        return replace(
            row,
            verdict=str(found.verdict),
            blocks=found.new_lines,
            bytes=len(found.data),
            seconds=before - saved,
            saved=saved,
            tip=None if checked is None else checked.tip,
            axis_point=None if checked is None or checked.axis_point != checked.axis_point else checked.axis_point,
        )

    rows = rows_of(tried, work, processes, progress)
    return Table(before, "the program as it is", share, law_of_lines(timing), rows)
