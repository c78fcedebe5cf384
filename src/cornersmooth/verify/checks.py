"""The checks of a batch, one after another; each looks at the same distances and adds to the same findings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.backtracking import check_backtracking
from cornersmooth.verify.batches import Batch
from cornersmooth.verify.continuity import measure_continuity
from cornersmooth.verify.deviation import check_curves, check_exact_poses, check_original, check_written
from cornersmooth.verify.distances import Distances
from cornersmooth.verify.feeds import check_feeds
from cornersmooth.verify.findings import Findings, Largest
from cornersmooth.verify.in_order import AROUND, Windows
from cornersmooth.verify.match import Match, match
from cornersmooth.verify.task import Task

#: what every batch goes through, in this order
CHECKS: Final[tuple[Callable[[Distances, Findings], None], ...]] = (
    check_written,
    check_curves,
    check_original,
    check_exact_poses,
    check_backtracking,
    check_feeds,
    measure_continuity,
)


#: words whose places are looked at once more in a batch, and poses looked at for each
_MOST = 1 << 12


@dataclass(frozen=True)
class Examined:
    """What a batch shows.

    Parameters
    ----------
    findings : Findings
    elements : (e,) int64
        Elements of the whole text at whose ends words stand, as far as they are known to be in this batch.
    lengths : (e,) float64, mm
        CL path length at their places.
    others : dict
        Those of other poses that elements name and may stand for as well, where the path goes to and fro; by element.
    """

    findings: Findings
    elements: Ints
    lengths: Floats
    others: dict[int, tuple[float, ...]]


def examine(task: Task, batch: Batch, asked: Ints, so_far: Largest) -> Examined:
    """Match a batch and run all checks.

    Parameters
    ----------
    task : Task
    batch : Batch
    asked : (k,) int64
        Elements of the whole text whose places are asked for; ascending.
    so_far : Largest
        What was met before: places with less are not looked at closely.
    """
    matched = match(task, batch)
    found = Findings(largest=so_far)
    distances = Distances(matched)
    for check in CHECKS:
        check(distances, found)
    return Examined(found, *_places(matched, distances.windows, asked, batch.offset))


def _places(
    matched: Match, windows: Windows, asked: Ints, offset: int
) -> tuple[Ints, Floats, dict[int, tuple[float, ...]]]:
    first = matched.written.first + offset
    last_vertex = matched.written.trail.last
    own = asked[slice(*np.searchsorted(asked, (first, first + len(last_vertex))).tolist())]
    vertex = last_vertex[own - first]
    on = matched.on[vertex]
    vertex = vertex[on]
    length = matched.path.length_at(matched.segment[vertex], matched.fraction[vertex])
    beside = np.isfinite(matched.distance[vertex]) & (matched.distance[vertex] > matched.margin)
    for k in np.flatnonzero(beside)[:_MOST].tolist():
        length[k] = _at_pose(matched, int(vertex[k]), float(length[k]))
    others = {}
    for element, here, place in zip(own[on][:_MOST].tolist(), vertex.tolist(), length.tolist(), strict=False):
        found = _other_poses(matched, windows, here, place)
        if found:
            others[element] = found
    return own[on], length, others


def _at_pose(matched: Match, vertex: int, length: float) -> float:
    """CL path length of the pose that a written vertex names, if there is one near its place; else that of its place.

    Where the path goes to and fro within the tolerance, another segment may be as near.
    """
    lengths = matched.path.length[_named(matched, vertex, length, matched.near)]
    return float(lengths[np.argmin(np.abs(lengths - length))]) if len(lengths) else length


def _named(matched: Match, vertex: int, length: float, around: float) -> Ints:
    """Vertices of the CL path that a written vertex names, as far along it as a length or nearly so."""
    path = matched.path
    low, high = np.searchsorted(path.length, (length - around, length + around)).tolist()
    away = (path.six[low : min(high, low + _MOST)] - matched.six[vertex]).reshape(-1, 2, 3)
    found: Ints = low + np.flatnonzero((np.linalg.norm(away, axis=2) <= matched.margin).all(axis=1))
    return found


def _other_poses(matched: Match, windows: Windows, vertex: int, length: float) -> tuple[float, ...]:
    """CL path lengths of poses that a written vertex names and may stand for, beside the one at a length."""
    named = _named(matched, vertex, length, AROUND * matched.near)
    lengths = matched.path.length[named]
    beside = np.abs(lengths - length) > matched.margin
    if not beside.any():
        return ()
    window = windows.around(vertex)
    return () if window is None else tuple(lengths[beside & window.may_be_at(vertex, named)].tolist())
