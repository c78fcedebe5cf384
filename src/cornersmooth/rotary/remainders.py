"""The smoothed motion in rotary angles outside its curves: poses, joints, and the straight motion between them.

A segment whose angles may run evenly from pose to pose within the tolerance does so: a corner between two such segments
is rounded in its angles exactly as it is in its tip. On all others the joints have the angles of the ruled motion, and
the straight remainder is divided as `cornersmooth.rotary.subdivision` says.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.errors import Finding
from cornersmooth.geometry import nurbs
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import angle_between, continued, pole_distance, tool_axis
from cornersmooth.model import Bools, Floats, Ints, SmoothProgram
from cornersmooth.rotary.angle_path import rapid_moves, rotary_angles, still_poses
from cornersmooth.rotary.subdivision import Insertions, insertions
from cornersmooth.smoothing.segments import Segments, segments_of
from cornersmooth.vectors import unit

#: Samples at which each transition is followed, as a rule and where the first rotary axis may turn fast.
FEW_SAMPLES, MANY_SAMPLES = 3, 17
#: It may where the pole is nearer than so many times the axis step at the corner, and so many degrees.
NEAR_POLE, NEAR_POLE_DEGREES = 5.0, 1.0
#: Samples on a segment where even angles are compared with the ruled motion, and the share of the tolerance they keep.
SEGMENT_SAMPLES, SEGMENT_SHARE = tuple(j / 8 for j in range(1, 8)), 0.8
#: Least share of the tolerance that axes at the pole and at the edge of reach have to keep.
STRICTEST_SHARE = 0.1
#: Step of the derivatives of the ruled angles, in fractions of the segment.
DIFFERENCE = 1e-3
#: Samples worked on at a time: their intermediate arrays fit the processor's cache.
CHUNK = 1 << 15


@dataclass(frozen=True)
class Ends:
    """Angles at one end of the straight remainder of the segment into each of n poses, degrees."""

    fraction: Floats  # of the segment, (n,)
    angles: Floats  # (n, 2)
    slope: Floats  # first derivative by the fraction
    bend: Floats  # second derivative


@dataclass(frozen=True)
class Followed:
    """Angles at samples of the transitions, chosen with the whole path in view: c smoothed corners, m rows in all."""

    #: first, count: (c,); the samples of corner i are rows ``first[i]`` to ``first[i] + count[i] - 1``, at even
    #: parameters from 0 to 1
    first: Ints
    count: Ints
    angles: Floats  #: (m, 2), degrees
    branch: Ints  #: (m,) as in `Solutions.angles`, -1 at the pole

    def interpolated(self, corner: Ints, u: Floats) -> tuple[Floats, Ints]:
        """Angles (g, m, 2) evenly between the samples, and branches (g, m), of some corners at common parameters."""
        sample = u * (self.count[corner, None] - 1)
        left = np.minimum(sample.astype(np.int64), self.count[corner, None] - 2)
        share = (sample - left)[:, :, None]
        left += self.first[corner, None]
        angles = self.angles[left] * (1 - share) + self.angles[left + 1] * share
        one, other = self.branch[left], self.branch[left + 1]
        branch = np.where(one == other, one, np.where(one < 0, other, np.where(other < 0, one, -1)))
        return angles, branch


@dataclass(frozen=True)
class RotaryMotion:
    """What the curves have to join."""

    rows: Ints  #: (c,) rows of `Corners` of the smoothed corners
    segments: Segments
    #: (n, 2), degrees; at a smoothed corner what the axis there would need; NaN where nothing is written
    pose_angles: Floats
    even: Bools  #: (n,) the segment into the pose runs evenly in its angles
    #: start, end: with the rates of the first and last line of the straight remainders; NaN where there is no segment
    start: Ends
    end: Ends
    #: ruled_start, ruled_end: the same with the rates of the ruled motion, which differ where points are inserted
    ruled_start: Ends
    ruled_end: Ends
    followed: Followed
    #: into the straight remainders: `segment` is the pose that each leads to, `fraction` that of the whole segment.
    #: `unsolved` are poses into which no division helps.
    inserted: Insertions
    cone: float  #: degrees; within this angle of the pole the first rotary angle is free
    findings: tuple[Finding, ...]


def rotary_motion(
    smoothed: SmoothProgram, machine: Machine, tolerance: float, allowance: Floats, angle_resolution: float
) -> RotaryMotion:
    """Rotary angles of the smoothed motion outside its curves; parameters and errors are those of `rotary_curves`."""
    corners, segments, rows = (
        smoothed.corners,
        segments_of(smoothed, dense=False),
        np.flatnonzero(smoothed.corners.smoothed),
    )
    path = _Path(smoothed, machine, segments, rows)
    strictest = max(float(allowance[rows].min(initial=tolerance)), STRICTEST_SHARE * tolerance)
    followed, pose_angles, findings = path.follow(strictest, angle_resolution)
    allowed = np.full(len(smoothed.program), tolerance)  # on the segment into each pose
    allowed[corners.pose[rows]] = allowance[rows]
    allowed[corners.after[rows]] = np.minimum(allowed[corners.after[rows]], allowance[rows])
    even = path.even_segments(pose_angles, allowed)
    start, end = path.exact_ends(followed, pose_angles)
    path.level(pose_angles, even, start, end)
    inserted = path.divide(even, start, end, tolerance)
    cone = strictest / 2
    ruled_start = path.ruled(even, start, cone)
    ruled_end = path.ruled(even, end, cone)
    joined = np.flatnonzero((segments.start >= 0) & ~segments.has_line)
    for side in (end, ruled_end, start):  # transitions that meet without a line between share one joint
        for name in ("angles", "slope", "bend"):
            getattr(side, name)[joined] = getattr(ruled_start, name)[joined]
    ends = start, end, ruled_start, ruled_end
    return RotaryMotion(rows, segments, pose_angles, even, *ends, followed, inserted, cone, findings)


@dataclass(frozen=True)
class _Path:
    """The smoothed path, and the rows of `Corners` of its smoothed corners."""

    smoothed: SmoothProgram
    machine: Machine
    segments: Segments
    rows: Ints

    def follow(self, tolerance: float, angle_resolution: float) -> tuple[Followed, Floats, tuple[Finding, ...]]:
        """Rotary angles along the whole smoothed path, a few samples on every transition."""
        program, corners = self.smoothed.program, self.smoothed.corners
        pose, axis = corners.pose[self.rows], program.axis
        step = np.maximum(
            angle_between(axis[corners.before[self.rows]], axis[pose]),
            angle_between(axis[pose], axis[corners.after[self.rows]]),
        )
        near = pole_distance(self.machine, axis[pose]) < NEAR_POLE * step + NEAR_POLE_DEGREES
        count = np.where(near, MANY_SAMPLES, FEW_SAMPLES)
        counts = np.where(self.segments.skip, 0, 1)
        counts[pose] = count
        owner = np.repeat(np.arange(len(program)), counts)
        last = np.cumsum(counts)
        first = last[pose] - count
        path_tip, path_axis = program.tip[owner], axis[owner]
        for number in (FEW_SAMPLES, MANY_SAMPLES):
            of_number = np.flatnonzero(count == number)
            for chosen in np.array_split(of_number, max(1, len(of_number) * number // CHUNK)):
                where = first[chosen, None] + np.arange(number)
                weights, u = corners.weights[self.rows[chosen]], np.linspace(0.0, 1.0, number)
                path_tip[where] = nurbs.evaluate(tip_points(self.smoothed, self.rows[chosen]), weights, u)
                path_axis[where] = unit(nurbs.evaluate(lever_points(self.smoothed, self.rows[chosen]), weights, u))
        rapid = rapid_moves(program.kind)[owner]
        rapid[1:] &= owner[1:] != owner[:-1]
        path = rotary_angles(
            self.machine,
            path_tip,
            path_axis,
            tolerance=tolerance,
            rapid=rapid,
            still=still_poses(program.kind)[owner],
            still_tolerance=angle_resolution,
            line=program.line[owner],
            file=program.source.name,
        )
        branch = path.branch.astype(np.int64)
        followed = Followed(first, count, path.angles, branch)
        pose_angles = np.full((len(program), 2), np.nan)
        written = np.flatnonzero(~self.segments.skip)
        pose_angles[written] = path.angles[last[written] - 1]
        middle = first + count // 2
        pose_angles[pose], _ = continued(self.machine, axis[pose], path.angles[middle], branch[middle], tolerance / 2)
        return followed, pose_angles, path.findings

    def even_segments(self, angles: Floats, tolerance: Floats) -> Bools:
        """Segments on which even angles from pose to pose keep their tolerances (n,)."""
        axis = self.smoothed.program.axis
        even = (self.segments.start >= 0) & ~self.segments.skip
        pose = np.flatnonzero(even)
        start = self.segments.start[pose]
        turn = np.abs(angles[pose] - angles[start]).sum(axis=1)
        # Path on the sphere and great circle both leave their chord by less than (turn)²/8; poses at the pole deviate.
        exact = np.maximum(
            angle_between(tool_axis(self.machine, angles[pose]), axis[pose]),
            angle_between(tool_axis(self.machine, angles[start]), axis[start]),
        )
        bound = np.radians(turn) ** 2 / 4 + np.radians(exact)
        doubtful = np.flatnonzero(~(bound <= np.radians(tolerance[pose]) * SEGMENT_SHARE))
        pose, start = pose[doubtful], start[doubtful]
        worst = np.zeros(len(pose))
        for share in SEGMENT_SAMPLES:
            words = angles[start] * (1 - share) + angles[pose] * share
            wanted = unit(axis[start] * (1 - share) + axis[pose] * share)
            worst = np.maximum(worst, angle_between(tool_axis(self.machine, words), wanted))
        even[pose[~(worst <= tolerance[pose] * SEGMENT_SHARE)]] = False
        return even

    def exact_ends(self, followed: Followed, pose_angles: Floats) -> tuple[Ends, Ends]:
        """Ends of the remainders with the angles of the ruled motion; without slopes."""
        corners = self.smoothed.corners
        nothing = np.full(pose_angles.shape, np.nan)
        linear = np.flatnonzero((self.segments.start >= 0) & ~self.segments.skip)
        start = Ends(self.segments.entry, nothing.copy(), nothing.copy(), np.zeros_like(nothing))
        end = Ends(self.segments.exit, nothing.copy(), nothing.copy(), np.zeros_like(nothing))
        start.angles[linear] = pose_angles[self.segments.start[linear]]
        end.angles[linear] = pose_angles[linear]
        end.angles[corners.pose[self.rows]] = followed.angles[followed.first]
        start.angles[corners.after[self.rows]] = followed.angles[followed.first + followed.count - 1]
        return start, end

    def level(self, pose_angles: Floats, even: Bools, start: Ends, end: Ends) -> None:
        """Put the joints of even segments on their line."""
        pose = np.flatnonzero(even)
        origin = pose_angles[self.segments.start[pose]]
        turn = pose_angles[pose] - origin
        for side in (start, end):
            side.angles[pose] = origin + side.fraction[pose, None] * turn
            side.slope[pose] = turn

    def divide(self, even: Bools, start: Ends, end: Ends, tolerance: float) -> Insertions:
        """Points for the remainders that do not run evenly, and the slopes of their first and last parts."""
        program = self.smoothed.program
        pose = np.flatnonzero((self.segments.start >= 0) & ~self.segments.skip & self.segments.has_line & ~even)
        origin = self.segments.start[pose]
        rows, both = np.repeat(pose, 2), np.zeros((2 * len(pose), 2))
        tip, lever = np.zeros((2, 2 * len(pose), 3))
        for offset, side in enumerate((start, end)):
            share = side.fraction[pose, None]
            tip[offset::2] = program.tip[origin] * (1 - share) + program.tip[pose] * share
            # not of unit length: what is ruled between these is the ruled motion between the poses, at its own rate
            lever[offset::2] = program.axis[origin] * (1 - share) + program.axis[pose] * share
            both[offset::2] = side.angles[pose]
        rapid = np.arange(2 * len(pose)) % 2 == 0
        found = insertions(
            self.machine,
            tip,
            lever,
            both,
            tolerance=tolerance,
            rapid=rapid,
            line=program.line[rows],
            file=program.source.name,
        )
        remainder = found.segment // 2
        entry, span = start.fraction[pose], end.fraction[pose] - start.fraction[pose]
        fraction = entry[remainder] + found.fraction * span[remainder]
        counts = np.bincount(remainder, minlength=len(pose))
        last = np.cumsum(counts)
        for side, other, neighbour in ((start, end, last - counts), (end, start, last - 1)):
            some = counts > 0
            next_angles, next_fraction = other.angles[pose], other.fraction[pose]
            next_angles[some], next_fraction[some] = found.angles[neighbour[some]], fraction[neighbour[some]]
            side.slope[pose] = (next_angles - side.angles[pose]) / (next_fraction - side.fraction[pose])[:, None]
        return Insertions(pose[remainder], fraction, found.angles, pose[found.unsolved // 2])

    def ruled(self, even: Bools, side: Ends, cone: float) -> Ends:
        """Return the same ends with the derivatives of the ruled motion, but for even self.segments."""
        program = self.smoothed.program
        pose = np.flatnonzero((self.segments.start >= 0) & ~self.segments.skip & ~even)
        origin, fraction, here = self.segments.start[pose], side.fraction[pose], side.angles[pose]
        beside = []
        for step in (-DIFFERENCE, DIFFERENCE):
            share = (fraction + step)[:, None]
            axis = unit(program.axis[origin] * (1 - share) + program.axis[pose] * share)
            beside.append(continued(self.machine, axis, here, np.full(len(pose), -1), cone)[0])
        before, behind = beside
        slope, bend = side.slope.copy(), side.bend.copy()
        slope[pose] = (behind - before) / (2 * DIFFERENCE)
        bend[pose] = (behind - 2 * here + before) / DIFFERENCE**2
        return Ends(side.fraction, side.angles, slope, bend)


def tip_points(smoothed: SmoothProgram, rows: Ints) -> Floats:
    """Control points of the tip curves of some rows of `Corners`: (g, 5, 3) mm."""
    legs = nurbs.trimmed_legs(smoothed.program.tip, smoothed.corners, rows)
    return nurbs.five_points(*legs, smoothed.corners.ratio[rows])


def lever_points(smoothed: SmoothProgram, rows: Ints) -> Floats:
    """Those of (Q − P)/H, where P and Q are trimmed by the same share: (g, 5, 3)."""
    legs = nurbs.trimmed_legs(smoothed.program.axis, smoothed.corners, rows)
    return nurbs.five_points(*legs, smoothed.corners.ratio[rows])
