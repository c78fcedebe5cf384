"""Arrays: what their types are called, arithmetic of vectors, some rows of some columns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from cornersmooth.model import Curves, Program, Runs

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]
#: rows and poses where there are millions: half the memory
Numbers: TypeAlias = NDArray[np.int32]

Columns = TypeVar("Columns")


def some_rows(columns: Columns, which: slice | Bools | Ints) -> Columns:
    """Rows of a dataclass whose fields are arrays of the same length; what is no array stays."""
    arrays = {item.name: getattr(columns, item.name) for item in fields(columns)}  # type: ignore[arg-type]
    own: dict[str, Any] = {name: column[which] for name, column in arrays.items() if isinstance(column, np.ndarray)}
    return replace(columns, **own)  # type: ignore[type-var]


def joined_rows(parts: Iterable[Columns]) -> Columns:
    """Rows of some such dataclasses, one or more, after one another; what is no array is that of the first."""
    some = list(parts)
    names = [name for name, column in vars(some[0]).items() if isinstance(column, np.ndarray)]
    return replace(some[0], **{name: np.concatenate([getattr(one, name) for one in some]) for name in names})  # type: ignore[type-var]


def some_poses(program: Program, first: int, stop: int) -> Program:
    """Poses from `first` to before `stop`, with the arcs, curves and statements between them.

    An arc that ends at the first pose is left out: it begins outside. Earlier statements come before the first pose.
    """
    arcs = some_rows(program.arcs, (program.arcs.pose > first) & (program.arcs.pose < stop))
    return replace(
        some_rows(program, slice(first, stop)),
        arcs=replace(arcs, pose=arcs.pose - first),
        curves=None if program.curves is None else _some_curves(program.curves, first, stop),
        statements=tuple(
            replace(statement, pose=max(statement.pose - first, 0))
            for statement in program.statements
            if statement.pose < stop
        ),
    )


def _some_curves(curves: Curves, first: int, stop: int) -> Curves:
    """Those of moves between poses, which are counted from the first one on; whole runs only."""
    runs = curves.runs
    if runs is not None:
        end = np.cumsum(runs.count)
        runs = some_runs(runs, (runs.pose[end - runs.count] >= first) & (runs.pose[end - 1] < stop))
        runs = replace(runs, pose=runs.pose - first) if len(runs) else None
    own = some_rows(curves, (curves.pose > first) & (curves.pose < stop))
    return replace(own, pose=own.pose - first, runs=runs)


def some_runs(runs: Runs, which: Bools | Ints) -> Runs:
    """Some runs, or all in another order, at the poses they have."""
    own = np.arange(len(runs))[which]

    def of(counts: Ints) -> Ints:
        size, first = counts[own], np.cumsum(counts) - counts
        return np.repeat(first[own] - np.cumsum(size) + size, size) + np.arange(size.sum())

    poses, knots = of(runs.count), of(runs.knot_count)
    return replace(
        runs,
        pose=runs.pose[poses],
        count=runs.count[own],
        s=runs.s[poses],
        knot=runs.knot[knots],
        knot_count=runs.knot_count[own],
        control=runs.control[of(runs.knot_count + 2)],
        tip_bound=runs.tip_bound[own],
        axis_bound=runs.axis_bound[own],
    )
