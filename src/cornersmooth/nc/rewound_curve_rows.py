"""Rows of curves in rotary words, in lines where a cut is left so that a rotary axis turns back.

What lies between rapids is written in one way: as curves, or, where its cut is left, as lines. Both choose their own
rotary angles; where one follows the other there is a rapid, in which they may turn.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cornersmooth.model import Bools, Move, Runs, SmoothProgram
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_curve_rows import rotary_curve_rows
from cornersmooth.nc.rotary_rows import rotary_rows
from cornersmooth.nc.rotary_run_rows import rotary_run_rows
from cornersmooth.nc.rotary_words import rotary_way
from cornersmooth.slices import some_poses, some_rows, some_runs
from cornersmooth.smoothing.sampling import Rows, dense_rows


def curve_rows_of(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows of corners or of whole runs in curves, as the method has made them."""
    return (rotary_curve_rows if smoothed.runs is None else rotary_run_rows)(smoothed, form, findings)


def rewound_curve_rows(smoothed: SmoothProgram, form: Form, findings: Findings) -> Iterator[Rows]:
    """Rows of curves, and of lines (CS381) between the rapids around a place where a cut is left.

    Raises InputError where the machine cannot follow the path.
    """
    program = smoothed.program
    in_lines = _left(smoothed, form)
    if not in_lines.any():
        yield from curve_rows_of(smoothed, form, findings)
        return
    edges = 1 + np.flatnonzero(in_lines[1:] != in_lines[:-1])
    for first, stop in pairwise([0, *edges.tolist(), len(program)]):
        part = _part(smoothed, first, stop)
        if in_lines[first]:
            text = "cut between rapids written in lines, not in curves: it is left where a rotary axis turns back"
            findings.add("CS381", "note", int(program.line[first]), text)
            way = rotary_way(dense_rows(part), part, form, findings)
            rows: Iterator[Rows] = (lines for lines, _ in rotary_rows(way, part, form, findings))
        else:
            rows = curve_rows_of(part, form, findings)
        for some in rows:
            yield replace(some, move=some.move + first)


def _left(smoothed: SmoothProgram, form: Form) -> Bools:
    """(n,) poses between rapids, these included, around a place where a cut is left."""
    kind = smoothed.program.kind
    way = rotary_way(dense_rows(smoothed), smoothed, form, Findings())
    cut = np.cumsum((kind != Move.LINEAR) & (kind != Move.ARC))
    in_lines: Bools = np.isin(cut, cut[way.move[way.left]])
    return in_lines


def _part(smoothed: SmoothProgram, first: int, stop: int) -> SmoothProgram:
    """Poses from `first` to before `stop`, both at rapids; statements before the first pose stay before it."""
    corners, runs = smoothed.corners, smoothed.runs
    own = (corners.pose >= first) & (corners.pose < stop)
    part = some_rows(corners, own)
    moved = {name: getattr(part, name) - first for name in ("pose", "before", "after")}
    extra = {name: column[own] for name, column in corners.extra.items()}
    return replace(
        smoothed,
        program=some_poses(smoothed.program, first, stop),
        corners=replace(part, **moved, extra=extra),
        runs=None if runs is None else _runs(runs, first, stop),
    )


def _runs(runs: Runs, first: int, stop: int) -> Runs | None:
    """Those runs that lie between these poses; None where there are none."""
    begins = runs.pose[np.cumsum(runs.count) - runs.count]
    own = (begins >= first) & (begins < stop)
    if not own.any():
        return None
    found = some_runs(runs, own)
    return replace(found, pose=found.pose - first)
