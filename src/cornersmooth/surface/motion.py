"""The cutting motion as segments: tip and axis point move evenly, the axis is the direction between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays.vectors import norm, unit
from cornersmooth.geometry.arcs import divided, poses_and_arcs
from cornersmooth.geometry.ragged import spread
from cornersmooth.model import Bools, Floats, Ints, Move, Program
from cornersmooth.nc_reader import NcProgram
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.tool import directions, written_at

#: largest turn of an arc within one segment, rad: off the arc by its radius times 3e-7
_ARC_STEP = 1.5e-3

#: segments of one written curve
_CURVE_PARTS = 64


@dataclass(frozen=True)
class RuledMotion:
    """Segments of a cutting motion, m rows in order."""

    #: (m, 2, 3): mm and unit vectors at start and end
    tip: Floats
    axis: Floats
    line: Ints  #: (m,): CL or NC line
    joined: Bools  #: (m,): whether the segment goes on where the one before ends

    def __len__(self) -> int:
        return len(self.line)

    def at(self, segment: Ints, share: Floats) -> tuple[Floats, Floats]:
        """Tip and unit axis (k, 3) at shares (k,) of segments (k,)."""
        tip, axis = self.tip[segment], self.axis[segment]
        place = tip[:, 0] + share[:, None] * (tip[:, 1] - tip[:, 0])
        leaning = axis[:, 0] + share[:, None] * (axis[:, 1] - axis[:, 0])
        return place, unit(leaning)

    def parts(self, longest: float, height: float, aside: float) -> Parts:
        """Cut into parts in which the tip and the point at `height` move about `longest` mm at most.

        `aside` is the distance from the axis up to which points are of interest.
        """
        step = self.tip[:, 1] - self.tip[:, 0]
        top = step + height * (self.axis[:, 1] - self.axis[:, 0])
        count = np.maximum(np.ceil(np.maximum(norm(step), norm(top)) / longest), 1.0).astype(np.int64)
        segment, number = spread(count)
        low, high = number / count[segment], (number + 1) / count[segment]
        ends = [self.at(segment, share) for share in (low, high)]
        turn = ends[1][1] - ends[0][1]
        ways = [norm(ends[1][0] - ends[0][0] + up * turn) for up in (0.0, height)]
        return Parts(self, segment, low, high, np.maximum(*ways) + aside * norm(turn))


@dataclass(frozen=True)
class Parts:
    """Parts of the segments of a motion, p of them."""

    motion: RuledMotion
    segment: Ints  #: (p,)
    #: (p,): shares of the segment where the part begins and ends
    low: Floats
    high: Floats
    way: Floats  #: (p,) mm: how far any point of interest moves at most

    def __len__(self) -> int:
        return len(self.segment)

    def at(self, part: Ints, share: Floats) -> tuple[Floats, Floats]:
        """Tip and unit axis (k, 3) at shares (k,) of parts (k,)."""
        low = self.low[part]
        return self.motion.at(self.segment[part], low + share * (self.high[part] - low))


def original_cuts(program: Program) -> RuledMotion:
    """Feed moves of a CL program; arcs in short chords."""
    cutting = (program.kind == Move.LINEAR) | (program.kind == Move.ARC)
    cutting[:1] = False
    cutting[1:] &= (program.kind[:-1] != Move.FROM) | (program.kind[1:] == Move.ARC)
    pose, tip, axis = poses_and_arcs(program, _ARC_STEP)
    return _segments(tip, axis, program.line[pose], cutting[pose])


def written_cuts(nc: NcProgram) -> RuledMotion:
    """Feed elements of an NC text; arcs and curves in short chords."""
    pieces = np.ones(len(nc), np.int64)
    pieces[nc.arcs.element] = np.maximum(np.ceil(nc.arcs.sweep / _ARC_STEP), 1.0).astype(np.int64)
    pieces[nc.curves.element] = _CURVE_PARTS
    if pieces.max(initial=1) == 1:
        tip, axis, element = nc.tip, directions(nc, nc.tip, nc.second), np.arange(len(nc))
    else:
        element, share = divided(pieces)
        tip, axis = written_at(nc, element, share)
    cutting = nc.kind != Element.RAPID
    cutting[:1] = False
    return _segments(tip, axis, nc.line[element], cutting[element])


def _segments(tip: Floats, axis: Floats, line: Ints, cutting: Bools) -> RuledMotion:
    """Segments into those poses (n, 3) that are reached cutting; without those that do not move."""
    moved = np.ones(len(tip), np.bool_)
    moved[1:] = (tip[1:] != tip[:-1]).any(axis=1) | (axis[1:] != axis[:-1]).any(axis=1)
    end = np.flatnonzero(cutting & moved)
    end = end[end > 0]
    joined = np.zeros(len(end), np.bool_)
    # nothing between two segments but poses that repeat
    travelled = np.cumsum(moved & ~cutting)
    joined[1:] = travelled[end[1:]] == travelled[end[:-1]]
    tips, axes = (np.stack((each[end - 1], each[end]), axis=1) for each in (tip, axis))
    return RuledMotion(tips, axes, line[end], joined)
