"""A batch with the place of each of its vertices on the CL path; `search` finds them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.elements import Elements
from cornersmooth.verify.batches import Batch
from cornersmooth.verify.polyline import CHORD_SHARE, Original, Polyline, Written, written_motion
from cornersmooth.verify.search import Search
from cornersmooth.verify.task import Task

#: parts of NC blocks beyond which nothing is looked for
_MOST_PARTS = 16


@dataclass(frozen=True)
class Match:
    """A batch of elements, and where its vertices are on the CL path.

    Parameters
    ----------
    task : Task
    nc : Elements
    written : Written
    six : (v, 6) float64
        Its vertices: tip and axis point.
    on : (v,) bool
        Whether a vertex belongs to a stretch of feed moves.
    stretch : (v,) int64
        Number of the stretch in this batch; -1 for none.
    segment : (v,) int64
        Segment of the CL path.
    fraction : (v,) float64
        On that segment.
    backward : (v,) bool
        Whether the vertex lies by more than the margin behind the one before it, as seen from its place.
    distance : (v,) float64, mm
        From its place, in six dimensions: neither tip nor axis point is farther; inf where a stretch begins.
    nearest : (v,) bool
        Whether no segment next to that of the vertex is nearer.
    low, high : (v,) int64
        First and last segment of the CL path in the stretch a vertex belongs to.
    until : float
        Place on the CL path where the next batch goes on with the last stretch; inf where that ends in this one.
    continued : bool
        See `Batch`.
    """

    task: Task
    nc: Elements
    written: Written
    six: Floats
    on: Bools
    stretch: Ints
    segment: Ints
    fraction: Floats
    backward: Bools
    distance: Floats
    nearest: Bools
    low: Ints
    high: Ints
    until: float
    continued: bool

    @cached_property
    def place(self) -> Floats:
        """(v,) segment plus fraction, where `on`."""
        where: Floats = self.segment + self.fraction
        return where

    @property
    def original(self) -> Original:
        """The CL motion."""
        return self.task.original

    @property
    def path(self) -> Polyline:
        """The CL path."""
        return self.task.path

    @property
    def tolerance(self) -> float:
        """ε, mm."""
        return self.task.tolerance

    @cached_property
    def margin(self) -> float:
        """Distance that printed digits may account for, mm."""
        return self.task.margin(self.nc)

    @cached_property
    def slack(self) -> float:
        """Distance by which places may be wrong, mm: more than `margin` where polylines cut curves short."""
        trail, nc = self.original.trail, self.nc
        bare = len(trail) == len(self.original.pose) and not len(nc.curves) and not len(nc.arcs)
        if bare and not nc.rotary:
            return self.margin
        # rotary words may let the tool swing by as much
        return self.margin + 2 * CHORD_SHARE * self.tolerance

    @cached_property
    def parts(self) -> int:
        """Elements that an NC block has become at most, up to `_MOST_PARTS`: more than one in rotary words only."""
        edges = np.flatnonzero(np.append(np.diff(self.nc.line) != 0, True))
        return min(int(np.diff(edges, prepend=-1).max(initial=1)), _MOST_PARTS)

    @property
    def near(self) -> float:
        """Distance within which a written vertex is taken to be on its way, mm."""
        return 2.0 * self.tolerance + self.margin


def match(task: Task, batch: Batch) -> Match:
    """Find the place of every vertex of a batch."""
    nc = batch.elements
    written = written_motion(nc, batch.first, batch.last, task.tolerance, task.axis_length)
    six = task.six(written.trail.tip, written.trail.axis)
    last_vertex = written.trail.last
    rows = batch.stretches.copy()
    rows["first"], rows["last"] = (last_vertex[rows[name] - batch.first] for name in ("first", "last"))
    search = Search(task, six, rows, batch.until, task.margin(nc))
    search.find()
    search.look_again()
    number = search.number
    return Match(
        task,
        nc,
        written,
        six,
        number >= 0,
        number,
        search.segment,
        search.fraction,
        search.backward,
        search.distance,
        search.nearest,
        search.low,
        search.high,
        batch.until,
        batch.continued,
    )
