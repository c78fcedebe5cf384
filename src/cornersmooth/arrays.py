"""Arrays: what their types are called, vectors along the last axis, rows of different length, some rows of columns."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypeVar

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
Array = TypeVar("Array", bound=NDArray[Any])


def dot(one: Floats, other: Floats) -> Floats:
    """Scalar products."""
    return np.einsum("...i,...i->...", one, other)


def square(vectors: Floats) -> Floats:
    """Squared lengths."""
    return dot(vectors, vectors)


def norm(vectors: Floats) -> Floats:
    """Lengths."""
    return np.sqrt(dot(vectors, vectors))


def unit(vectors: Floats) -> Floats:
    """Vectors of length one with the same directions; a vector of no length stays as it is."""
    length = norm(vectors)[..., None]
    return vectors / np.where(length > 0.0, length, 1.0)


def cross(one: Floats, other: Floats) -> Floats:
    """Vector products: those of ``np.cross``, bit by bit, in a quarter of its time for a few vectors."""
    (a, b, c), (x, y, z) = ((vectors[..., 0], vectors[..., 1], vectors[..., 2]) for vectors in (one, other))
    found = np.empty(np.broadcast_shapes(one.shape, other.shape))
    found[..., 0], found[..., 1], found[..., 2] = b * z - c * y, c * x - a * z, a * y - b * x
    return found


def angle_between(one: Floats, other: Floats) -> Floats:
    """Angles between vectors, rad; accurate for small angles too."""
    return np.arctan2(norm(cross(one, other)), dot(one, other))


def any_of(flags: Bools) -> Bools:
    """(n,) whether any of a few flags (n, k) is set: a tenth of the time of ``any(axis=1)``."""
    return np.logical_or.reduce([*flags.T])


def distinct(values: Array) -> Array:
    """Different numbers, ascending; `np.unique` loads masked arrays, a twentieth of what a short run loads."""
    ordered = np.sort(values, axis=None)
    return ordered[np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)]]


def starts(counts: Ints) -> Ints:
    """(k + 1,) where each row begins, and where the last ends."""
    return np.concatenate((np.zeros(1, np.int64), np.cumsum(counts, dtype=np.int64)))


def spread(counts: Ints) -> tuple[Ints, Ints]:
    """Row of every element, and its place within the row."""
    row = np.repeat(np.arange(len(counts)), counts)
    return row, np.arange(len(row)) - np.repeat(starts(counts)[:-1], counts)


def ranges(begin: Ints, counts: Ints) -> Ints:
    """Concatenation of ``begin[i] .. begin[i] + counts[i] - 1``."""
    row, place = spread(counts)
    return begin[row] + place


def batches(counts: Ints, size: int) -> Ints:
    """Rows at which batches of about `size` elements begin, a row or more in each, and the end of the last."""
    return np.append(np.flatnonzero(np.diff(np.cumsum(counts) // size, prepend=-1)), len(counts))


def split(rows: Ints, counts: Ints, size: int) -> list[Ints]:
    """Some rows in parts of about `size` elements each, of which a row has its count."""
    gone = np.cumsum(counts)
    return [part for part in np.split(rows, np.searchsorted(gone, np.arange(size, gone[-1:].sum(), size))) if len(part)]


def search(values: Floats, counts: Ints, row: Ints, place: Floats, side: Literal["left", "right"] = "left") -> Ints:
    """`np.searchsorted` within rows: indices (m,) into values (n,), which are from 0 on and ascending in each row."""
    last = values[starts(counts)[1:] - 1]
    base = starts(np.floor(last).astype(np.int64) + 2)[:-1].astype(np.float64)
    inside = np.clip(place, -0.5, last[row] + 0.5)  # rows lie more than 1 apart
    return np.searchsorted(values + np.repeat(base, counts), inside + base[row], side=side)


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
    """Those of moves between poses, which are counted from the first one on."""
    own = some_rows(curves, (curves.pose > first) & (curves.pose < stop))
    return replace(own, pose=own.pose - first)


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
