"""The CL motion as a polyline with a bound of how far it leaves it.

Nothing is put into straight moves that hardly turn the axis, which are nearly all; arcs, curves and large turns get
inner vertices, as many as keep the bend of each part (see `bending`) within a share of the tolerance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints, Move, Program
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.tool import CurveGroup, arc_points, between, unit
from cornersmooth.settings import FLIP_ANGLE
from cornersmooth.verify.bending import arc_bend, curve_bend, turn_bend

#: bend of a segment in tolerances: it is taken off the tolerance where what can be reached is worked out exactly
CL_SHARE: Final = 1.0 / 128.0

#: bend of what has none, as where the axis turns over, mm: it is not proved and not divided
UNBOUND: Final = 1e9

#: parts of a motion between two poses at most; what bends more is not proved
_MOST_PARTS: Final = 1 << 13


@dataclass(frozen=True)
class Trail:
    """Vertices of a motion, v of them: what their points belong to."""

    owner: Ints  #: (v,): index of the move that leads to each vertex
    fraction: Floats  #: (v,): where on it, 1 at its end
    last: Ints  #: (m,): vertex at the end of each move
    bend: Floats  #: (v - 1,) mm: of the segment to the next vertex

    def __len__(self) -> int:
        return len(self.owner)


@dataclass(frozen=True)
class Original:
    """The CL motion: its poses without those that are only stated, as a trail."""

    program: Program
    pose: Ints  #: (m,): pose of every move; the first is where the motion starts
    trail: Trail  #: owners are indices into `pose`
    pieces: CurveGroup | None  #: what moves near curves of the file are: their index is that of the pose

    def pose_at(self, place: Floats) -> tuple[Floats, Floats]:
        """Tip and unit axis (k, 3) at places of the trail, each a segment plus a fraction of it."""
        return self.at(*self.move_at(place))

    def move_at(self, place: Floats) -> tuple[Ints, Floats]:
        """(k,) moves at places of the trail, and fractions of them."""
        trail = self.trail
        segment = np.minimum(place.astype(np.int64), max(len(trail) - 2, 0))
        after = np.minimum(segment + 1, len(trail) - 1)
        owner, end = trail.owner[after], trail.fraction[after]
        start = np.where(trail.owner[segment] == owner, trail.fraction[segment], 0.0)
        return owner, start + (place - segment) * (end - start)

    def arcs_of(self, owner: Ints) -> Ints:
        """(k,) rows of the program's arcs that moves are, -1 for straight ones and for where the motion starts."""
        return np.where(owner > 0, _found(self.program.arcs.pose, self.pose[owner]), -1)

    def at(self, owner: Ints, fraction: Floats) -> tuple[Floats, Floats]:
        """Tip and unit axis (k, 3) at a fraction of moves: the ruled motion, or the true arc or curve."""
        program = self.program
        end = self.pose[owner]
        start = self.pose[np.maximum(owner - 1, 0)]
        tip = between(program.tip, start, end, fraction)
        row = self.arcs_of(owner)
        curved = np.flatnonzero(row >= 0)
        if len(curved):
            arcs, r = program.arcs, row[curved]
            tip[curved] = arc_points(
                program.tip[start[curved]],
                program.tip[end[curved]],
                arcs.centre[r],
                arcs.normal[r],
                arcs.sweep[r],
                fraction[curved],
            )
        axis = between(program.axis, start, end, fraction)
        if self.pieces is not None:
            row = _found(self.pieces.index, end)
            curved = np.flatnonzero((row >= 0) & (fraction < 1.0))
            point = self.pieces.at_own(row[curved], fraction[curved])
            tip[curved], axis[curved] = point[:, :3], point[:, 3:] - point[:, :3]
        return tip, unit(axis)


def _found(keys: Ints, wanted: Ints) -> Ints:
    """(k,) places of numbers among ascending keys, -1 for none."""
    if not len(keys):
        return np.full(len(wanted), -1)
    row = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[row] == wanted, row, -1)


def _pieces(program: Program) -> CurveGroup | None:
    """The pieces of curves of the file."""
    if program.curves is None:
        return None
    knots, points = np.repeat((0.0, 1.0), 4), program.curves.bezier
    return CurveGroup(program.curves.pose, 4, knots, points, np.ones(points.shape[:2]))


def original_motion(program: Program, tolerance: float, axis_length: float) -> tuple[Original, Floats, Floats]:
    """Make the trail of the CL motion, with tips (mm) and unit axes (v, 3) of its vertices."""
    stated = program.kind == Move.FROM
    # an arc wants a start: where that is only stated the tool is sent there
    stated[:-1] &= program.kind[1:] != Move.ARC
    pose = np.flatnonzero(~stated)
    chosen = selecting(pose)
    tip, axis = program.tip[chosen], program.axis[chosen]
    bend = np.zeros(len(pose))
    bend[1:] = axis_length * turn_bend(axis[:-1], axis[1:])
    curved = np.searchsorted(pose, program.arcs.pose)
    row = np.flatnonzero(curved > 0)
    curved = curved[row]
    if len(curved):
        radius = np.linalg.norm(np.cross(tip[curved - 1] - program.arcs.centre[row], program.arcs.normal[row]), axis=1)
        bend[curved] += arc_bend(radius, program.arcs.sweep[row])
    pieces = _pieces(program)
    if pieces is not None:
        bend[np.searchsorted(pose, pieces.index)] = curve_bend(pieces, "point", axis_length)[:, 0]
    bend = np.minimum(bend, UNBOUND)
    bend[program.kind[chosen] == Move.RAPID] = 0.0  # the way of a rapid is the machine's
    cuts = parts_of(bend, CL_SHARE * tolerance, _MOST_PARTS)
    index = np.arange(len(pose))
    bare = Original(program, pose, Trail(index, np.broadcast_to(1.0, len(pose)), index, bend[1:]), pieces)
    if not len(pose) or cuts.max() == 1:
        return bare, tip, axis
    owner, fraction, last = divided(cuts)
    tip, axis = tip.take(owner, axis=0), axis.take(owner, axis=0)
    inner = np.flatnonzero(fraction < 1)
    tip[inner], axis[inner] = bare.at(owner[inner], fraction[inner])
    return Original(program, pose, Trail(owner, fraction, last, (bend / cuts**2)[owner][1:]), pieces), tip, axis


def selecting(pose: Ints) -> slice | Ints:
    """What selects poses (m,): a slice, which copies nothing, where they follow one another, as nearly always."""
    return slice(pose[0], pose[-1] + 1) if len(pose) and pose[-1] - pose[0] == len(pose) - 1 else pose


def parts_of(bend: Floats, share: float, most: int) -> Ints:
    """(k,) number of equal parts whose bends are at most `share`; no more than `most`, then they bend more."""
    parts = np.ceil(np.sqrt(np.minimum(bend / share, float(most) ** 2)))
    return np.where(bend < UNBOUND, np.clip(parts, 1, most), 1).astype(np.int64)


def divided(cuts: Ints) -> tuple[Ints, Floats, Ints]:
    """Owner and fraction of every vertex, and each owner's last vertex, for given numbers of parts."""
    last = np.cumsum(cuts) - 1
    owner = np.repeat(np.arange(len(cuts)), cuts)
    part = np.arange(len(owner)) - np.repeat(last + 1 - cuts, cuts) + 1
    return owner, part / np.repeat(cuts, cuts), last


def half_turns(program: Program) -> list[Problem]:
    """Moves that no text can be measured against, with their CL lines: CS526.

    Between opposite axes there is no great circle, and near them it hangs on the last digits of both.
    """
    found = program.axis_steps(np.isin(program.kind, (Move.LINEAR, Move.ARC)), FLIP_ANGLE)
    text = "the tool axis turns by {:.4g} deg in one move, and which way a control turns is not defined"
    return [
        Problem("CS526", int(program.line[pose]), 0, text.format(turn))
        for pose, turn in zip(*(values.tolist() for values in found), strict=True)
    ]
