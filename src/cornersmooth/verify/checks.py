"""The checks of a batch, one after another, and where its words stand."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.verify.batches import Batch
from cornersmooth.verify.continuity import measure_continuity
from cornersmooth.verify.deviation import check_breaks, measure_original, measure_written
from cornersmooth.verify.feeds import check_feeds
from cornersmooth.verify.findings import Findings, Largest
from cornersmooth.verify.match import Match
from cornersmooth.verify.passage import AROUND
from cornersmooth.verify.task import Task

#: what every batch goes through, in this order
CHECKS: Final[tuple[Callable[[Match, Findings], None], ...]] = (
    check_breaks,
    measure_written,
    measure_original,
    check_feeds,
    measure_continuity,
)


@dataclass(frozen=True)
class Examined:
    """What a batch shows."""

    findings: Findings
    #: (e,): elements of the whole text at whose ends words stand, as far as they are known to be in this batch
    elements: Ints
    lengths: Floats  #: (e,) mm: CL path length at their places
    #: those of other poses that elements name and may stand for as well, where the path goes to and fro; by element
    others: dict[int, tuple[float, ...]]


def examine(task: Task, batch: Batch, asked: Ints, so_far: Largest) -> Examined:
    """Run all checks of a batch.

    Parameters
    ----------
    asked : (k,) int64
        Elements of the whole text whose places are asked for; ascending.
    so_far : Largest
        What was met before: places with less are not looked at closely.
    """
    match, found = Match(task=task, **vars(batch)), Findings(largest=so_far)
    for check in CHECKS:
        check(match, found)
    return Examined(found, *_places(match, asked, batch.offset))


def _places(match: Match, asked: Ints, offset: int) -> tuple[Ints, Floats, dict[int, tuple[float, ...]]]:
    first, last = match.first + offset, match.motion.last
    own = asked[slice(*np.searchsorted(asked, (first, first + len(last))).tolist())]
    vertex = last[own - first]
    own, vertex = own[match.on[vertex]], vertex[match.on[vertex]]
    length, path = match.path.lengths_at(match.place[vertex]), match.path.length
    others = {}
    for k, (element, here) in enumerate(zip(own.tolist(), vertex.tolist(), strict=True)):
        named = path[_named(match, here)]
        if not len(named):
            continue
        # a word belongs to the pose that the vertex names, not to the place beside it that is as near: both within ε
        close = np.abs(named - length[k]) <= 2.0 * match.tolerance + match.margin
        if close.any():
            length[k] = named[close][np.argmin(np.abs(named[close] - length[k]))]
        beside = np.abs(named - length[k]) > match.margin
        if beside.any():
            poses = np.searchsorted(path, named)
            may = match.reachable.may_be_at(here, poses)
            if (beside & may).any():
                others[element] = tuple(named[beside & may].tolist())
    return own, length, others


def _named(match: Match, vertex: int) -> Ints:
    """Vertices of the CL path around its place that a written vertex names, up to the printed digits."""
    path = match.path
    here, around = path.length_at(float(match.place[vertex])), AROUND * match.tolerance
    low, high = np.searchsorted(path.length, (here - around, here + around)).tolist()
    away = (path.points[low:high] - match.six[vertex]).reshape(-1, 2, 3)
    return low + np.flatnonzero((np.linalg.norm(away, axis=2) <= match.margin).all(axis=1))
