"""Parts of what travels: some rows of any columns, some poses of a program, some of its runs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from cornersmooth.model import Arcs, Bools, Ints, Program, Runs

Columns = TypeVar("Columns")


def some_rows(columns: Columns, which: slice | Bools | Ints) -> Columns:
    """Rows of a dataclass whose fields are arrays of the same length; what is no array stays."""
    own: dict[str, Any] = {
        name: column[which] for name, column in vars(columns).items() if isinstance(column, np.ndarray)
    }
    return replace(columns, **own)  # type: ignore[type-var]


def some_poses(program: Program, first: int, stop: int) -> Program:
    """Poses from `first` to before `stop`, with the arcs and statements between them.

    Parameters
    ----------
    first, stop : int
        An arc that ends at the first pose is left out: it begins outside. Earlier statements come
        before the first pose.
    """
    rows, arcs = slice(first, stop), program.arcs
    own = (arcs.pose > first) & (arcs.pose < stop)
    return replace(
        program,
        tip=program.tip[rows],
        axis=program.axis[rows],
        kind=program.kind[rows],
        feed=program.feed[rows],
        line=program.line[rows],
        feed_mode=program.feed_mode[rows],
        keep=program.keep[rows],
        arcs=Arcs(arcs.pose[own] - first, arcs.centre[own], arcs.normal[own], arcs.sweep[own]),
        statements=tuple(
            replace(statement, pose=max(statement.pose - first, 0))
            for statement in program.statements
            if statement.pose < stop
        ),
    )


def some_runs(runs: Runs, kept: Bools) -> Runs:
    """The runs (r,) that are kept, at the poses they have."""
    poses, knots = np.repeat(kept, runs.count), np.repeat(kept, runs.knot_count)
    return replace(
        runs,
        pose=runs.pose[poses],
        count=runs.count[kept],
        s=runs.s[poses],
        knot=runs.knot[knots],
        knot_count=runs.knot_count[kept],
        control=runs.control[np.repeat(kept, runs.knot_count + 2)],
        tip_bound=runs.tip_bound[kept],
        axis_bound=runs.axis_bound[kept],
    )
