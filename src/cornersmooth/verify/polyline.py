"""The two motions as trails: vertices in order, each with what it belongs to.

A *trail* is a polyline through points of a motion, dense enough that its segments stay close to the motion: nothing is
inserted in straight moves with little change of axis, which are nearly all; arcs, curves and large turns get inner
vertices. Trails only serve to find what corresponds to what; deviations are measured on the motion itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Move, Program
from cornersmooth.nc_reader.arcs import arc_points
from cornersmooth.nc_reader.curves import CurveGroup, groups
from cornersmooth.nc_reader.elements import Element, Elements
from cornersmooth.nc_reader.tool import between, directions, unit

#: how far, relative to the tolerance, a trail may stay off the motion it stands for
CHORD_SHARE = 0.1

#: the same for arcs of the CL file: chords of the text may end at the same points, and show no error there
ARC_SHARE = 0.025

#: square of the cosine of half a turn below which a move is divided no more: the axis comes near to turning over
_STEEPEST = 1e-6


def points_on(vertices: Floats, segment: Ints, fraction: Floats) -> Floats:
    """(k, d) points of a polyline (v, d) at fractions (k,) of segments (k,)."""
    start = vertices.take(segment, axis=0)
    point: Floats = vertices.take(segment + 1, axis=0)
    point -= start
    point *= fraction[:, None]
    point += start
    return point


@dataclass(frozen=True)
class Trail:
    """Vertices of a motion, v of them.

    Parameters
    ----------
    tip, axis : (v, 3) float64
        mm, unit vectors.
    owner : (v,) int64
        What each vertex is reached by: index of the original move or of the path element.
    fraction : (v,) float64
        Where on it, 1 at its end; on a curve of the written motion its parameter at a knot, and elsewhere as for lines.
    last : (m,) int64
        Vertex at the end of each owner, counted from the trail's first owner.
    """

    tip: Floats
    axis: Floats
    owner: Ints
    fraction: Floats
    last: Ints

    def __len__(self) -> int:
        return len(self.tip)


@dataclass(frozen=True)
class Polyline:
    """Vertices of a trail as points, with path lengths; segment k runs from vertex k to vertex k + 1.

    A *place* on it is a segment and a fraction of it.

    Parameters
    ----------
    six : (v, 6) float64, mm
        Tip and axis point.
    length : (v,) float64, mm
        Path length up to every vertex, of tip and axis point together.
    """

    six: Floats
    length: Floats

    @classmethod
    def of(cls, six: Floats) -> Polyline:
        """Make it from vertices (v, 6)."""
        step = six[1:] - six[:-1]
        length = np.zeros(len(six))
        np.cumsum(np.sqrt(np.einsum("ij,ij->i", step, step)), out=length[1:])
        return cls(six, length)

    def length_at(self, segment: Ints, fraction: Floats) -> Floats:
        """(k,) path length up to places, mm."""
        start = self.length.take(segment)
        length: Floats = start + fraction * (self.length.take(segment + 1) - start)
        return length

    def point_at(self, segment: Ints, fraction: Floats) -> Floats:
        """(k, 6) points at places."""
        return points_on(self.six, segment, fraction)

    def place_at(self, length: float) -> tuple[int, float]:
        """Return segment and fraction at a path length."""
        last = max(len(self.length) - 2, 0)
        segment = min(max(int(np.searchsorted(self.length, length, side="right")) - 1, 0), last)
        start, end = self.length[segment : segment + 2]
        return segment, float(np.clip((length - start) / (end - start), 0.0, 1.0)) if end > start else 0.0


@dataclass(frozen=True)
class Original:
    """The CL motion: its poses without those that are only stated, as a trail.

    Parameters
    ----------
    program : Program
    pose : (m,) int64
        Pose of every move; the first is where the motion starts.
    trail : Trail
        Owners are indices into `pose`.
    """

    program: Program
    pose: Ints
    trail: Trail

    def arcs_of(self, owner: Ints) -> Ints:
        """(k,) rows of the program's arcs that moves are, -1 for straight ones and for where the motion starts."""
        pose, arcs = self.pose[owner], self.program.arcs.pose
        if not len(arcs):
            return np.full(len(pose), -1)
        row = np.minimum(np.searchsorted(arcs, pose), len(arcs) - 1)
        return np.where((arcs[row] == pose) & (owner > 0), row, -1)

    def at(self, owner: Ints, fraction: Floats) -> tuple[Floats, Floats]:
        """Tip and unit axis (k, 3) at a fraction of moves: the ruled motion, or the true arc."""
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
        return tip, unit(axis)


def original_motion(program: Program, tolerance: float, axis_length: float) -> Original:
    """Make the trail of the CL motion."""
    stated = program.kind == Move.FROM
    # an arc wants a start: where that is only stated the tool is sent there
    stated[:-1] &= program.kind[1:] != Move.ARC
    pose = np.flatnonzero(~stated)
    # nearly always all poses but the first: no copy then
    chosen = slice(pose[0], pose[-1] + 1) if len(pose) and pose[-1] - pose[0] == len(pose) - 1 else pose
    tip, axis = program.tip[chosen], program.axis[chosen]
    cuts = turn_cuts(axis, tolerance, axis_length)
    curved = np.searchsorted(pose, program.arcs.pose)
    row = np.flatnonzero(curved > 0)
    curved = curved[row]
    if len(curved):
        start = tip[curved - 1] - program.arcs.centre[row]
        normal = program.arcs.normal[row]
        radius = np.linalg.norm(start - np.einsum("ij,ij->i", start, normal)[:, None] * normal, axis=1)
        sweep = program.arcs.sweep[row]
        cuts[curved] = np.maximum(cuts[curved], arc_cuts(radius, sweep, ARC_SHARE * tolerance))
    bare = Original(program, pose, Trail(tip, axis, np.arange(len(pose)), np.ones(len(pose)), np.arange(len(pose))))
    if not len(pose) or cuts.max() == 1:
        return bare
    owner, fraction, last = divided(cuts)
    tip, axis = tip.take(owner, axis=0), axis.take(owner, axis=0)
    inner = np.flatnonzero(fraction < 1)
    tip[inner], axis[inner] = bare.at(owner[inner], fraction[inner])
    return Original(program, pose, Trail(tip, axis, owner, fraction, last))


def turn_cuts(axis: Floats, tolerance: float, axis_length: float) -> Ints:
    """(m,) number of parts of every straight move, so that the axis point runs straight enough within a part."""
    cuts = np.ones(len(axis), np.int64)
    if len(axis) > 1:
        step = axis[1:] - axis[:-1]
        turn = np.sqrt(np.einsum("ij,ij->i", step, step))
        largest = np.sqrt(8 * CHORD_SHARE * tolerance / axis_length)
        many = np.flatnonzero(turn > largest)
        # parts are equal in the fraction, and the axis turns fastest in the middle: by 2 tan(θ/2) per move
        sine = turn[many] / 2
        fastest = turn[many] / np.sqrt(np.maximum(1 - sine * sine, _STEEPEST))
        cuts[many + 1] = np.ceil(fastest / largest)
    return cuts


def arc_cuts(radius: Floats, sweep: Floats, error: float) -> Ints:
    """(k,) number of chords of every arc, so that they stay within an error, mm."""
    largest = np.sqrt(8 * error / np.maximum(radius, error))
    return np.maximum(np.ceil(sweep / np.minimum(largest, 1.0)), 1).astype(np.int64)


def divided(cuts: Ints) -> tuple[Ints, Floats, Ints]:
    """Owner and fraction of every vertex, and each owner's last vertex, for given numbers of parts."""
    last = np.cumsum(cuts) - 1
    owner = np.repeat(np.arange(len(cuts)), cuts)
    part = np.arange(len(owner)) - np.repeat(last + 1 - cuts, cuts) + 1
    return owner, part / np.repeat(cuts, cuts), last


@dataclass(frozen=True)
class Written:
    """A stretch of the written motion: elements ``first`` to ``last``, both included, as a trail.

    Parameters
    ----------
    nc : Elements
    first : int
        The trail starts with the end of this element.
    trail : Trail
        Owners are element indices.
    curves : tuple of CurveGroup
        Those of the stretch.
    straight : (m,) bool
        Whether each element is a line.
    """

    nc: Elements
    first: int
    trail: Trail
    curves: tuple[CurveGroup, ...]
    straight: Bools


def written_motion(nc: Elements, first: int, last: int, tolerance: float, axis_length: float) -> Written:
    """Make the trail of a stretch of the written motion."""
    part = slice(first, last + 1)
    tip, second, kind = nc.tip[part], nc.second[part], nc.kind[part]
    axis = directions(nc, tip, second)
    count = len(tip)
    cuts = turn_cuts(axis, tolerance, axis_length)
    cuts[kind == Element.RAPID] = 1
    a0, a1 = np.searchsorted(nc.arcs.element, (first + 1, last + 1))
    c0, c1 = np.searchsorted(nc.curves.element, (first + 1, last + 1))
    arc_at = nc.arcs.element[a0:a1] - first
    if len(arc_at):
        radius = np.linalg.norm(tip[arc_at - 1] - nc.arcs.centre[a0:a1], axis=1)
        cuts[arc_at] = np.maximum(cuts[arc_at], arc_cuts(radius, nc.arcs.sweep[a0:a1], CHORD_SHARE * tolerance))
    curve_groups = tuple(groups(nc.curves, np.arange(c0, c1)))
    for group in curve_groups:
        cuts[nc.curves.element[group.index] - first] = max(len(group.spans) - 1, 1)
    straight = kind <= Element.LINE
    if count == 0 or (cuts.max() == 1 and not len(arc_at) and not curve_groups):
        index = np.arange(count)
        return Written(nc, first, Trail(tip, axis, index + first, np.ones(count), index), (), straight)
    cuts[0] = 1
    owner, fraction, ends = divided(cuts)
    before = np.maximum(owner - 1, 0)
    new_tip, new_second = np.empty((len(owner), 3)), np.empty((len(owner), 3))
    new_tip[ends], new_second[ends] = tip, second
    is_curve = kind == Element.CURVE
    inner = np.flatnonzero((fraction < 1) & ~is_curve[owner])
    new_tip[inner] = between(tip, before[inner], owner[inner], fraction[inner])
    new_second[inner] = between(second, before[inner], owner[inner], fraction[inner])
    if len(arc_at):
        row = np.full(count, -1)
        row[arc_at] = np.arange(a0, a1)
        on = np.flatnonzero((row[owner] >= 0) & (fraction < 1))
        r = row[owner[on]]
        arcs = nc.arcs
        new_tip[on] = arc_points(
            tip[before[on]], tip[owner[on]], arcs.centre[r], arcs.normal[r], arcs.sweep[r], fraction[on]
        )
    for group in curve_groups:
        spans = group.spans
        end = ends[nc.curves.element[group.index] - first]
        fraction[end] = spans[-1]
        for k, u in enumerate(spans[-2:0:-1]):
            points = group.at(np.array([u]))[:, 0]
            new_tip[end - k - 1], new_second[end - k - 1] = points[:, :3], points[:, 3:]
            fraction[end - k - 1] = u
    trail = Trail(new_tip, directions(nc, new_tip, new_second), owner + first, fraction, ends)
    return Written(nc, first, trail, curve_groups, straight)
