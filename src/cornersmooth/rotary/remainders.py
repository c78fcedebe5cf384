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
    smoothed: SmoothProgram,
    machine: Machine,
    tolerance: float,
    allowance: Floats,
    angle_resolution: float,
    file: str | None,
) -> RotaryMotion:
    """Rotary angles of the smoothed motion outside its curves; parameters and errors are those of `rotary_curves`."""
    segments = segments_of(smoothed, dense=False)
    corners = smoothed.corners
    rows = np.flatnonzero(corners.smoothed)
    strictest = max(float(allowance[rows].min(initial=tolerance)), STRICTEST_SHARE * tolerance)
    followed, pose_angles, findings = _follow(smoothed, machine, segments, rows, strictest, angle_resolution, file)
    allowed = np.full(len(smoothed.program), tolerance)  # on the segment into each pose
    allowed[corners.pose[rows]] = allowance[rows]
    allowed[corners.after[rows]] = np.minimum(allowed[corners.after[rows]], allowance[rows])
    even = _even_segments(smoothed, machine, segments, pose_angles, allowed)
    start, end = _exact_ends(smoothed, segments, rows, followed, pose_angles)
    _level(segments, pose_angles, even, start, end)
    inserted = _divide_remainders(smoothed, machine, segments, even, start, end, tolerance, file)
    cone = strictest / 2
    ruled_start = _ruled(smoothed, machine, segments, even, start, cone)
    ruled_end = _ruled(smoothed, machine, segments, even, end, cone)
    joined = np.flatnonzero((segments.start >= 0) & ~segments.has_line)
    for side in (end, ruled_end, start):  # transitions that meet without a line between share one joint
        for name in ("angles", "slope", "bend"):
            getattr(side, name)[joined] = getattr(ruled_start, name)[joined]
    ends = start, end, ruled_start, ruled_end
    return RotaryMotion(rows, segments, pose_angles, even, *ends, followed, inserted, cone, findings)


def _follow(
    smoothed: SmoothProgram,
    machine: Machine,
    segments: Segments,
    rows: Ints,
    tolerance: float,
    angle_resolution: float,
    file: str | None,
) -> tuple[Followed, Floats, tuple[Finding, ...]]:
    """Rotary angles along the whole smoothed path, a few samples on every transition."""
    program, corners = smoothed.program, smoothed.corners
    pose, axis = corners.pose[rows], program.axis
    step = np.maximum(
        angle_between(axis[corners.before[rows]], axis[pose]), angle_between(axis[pose], axis[corners.after[rows]])
    )
    near = pole_distance(machine, axis[pose]) < NEAR_POLE * step + NEAR_POLE_DEGREES
    count = np.where(near, MANY_SAMPLES, FEW_SAMPLES)
    counts = np.where(segments.skip, 0, 1)
    counts[pose] = count
    owner = np.repeat(np.arange(len(program)), counts)
    last = np.cumsum(counts)
    first = last[pose] - count
    path_tip, path_axis = program.tip[owner], axis[owner]
    for number in (FEW_SAMPLES, MANY_SAMPLES):
        of_number = np.flatnonzero(count == number)
        for chosen in np.array_split(of_number, max(1, len(of_number) * number // CHUNK)):
            where = first[chosen, None] + np.arange(number)
            weights, u = corners.weights[rows[chosen]], np.linspace(0.0, 1.0, number)
            path_tip[where] = nurbs.evaluate(tip_points(smoothed, rows[chosen]), weights, u)
            path_axis[where] = unit(nurbs.evaluate(lever_points(smoothed, rows[chosen]), weights, u))
    rapid = rapid_moves(program.kind)[owner]
    rapid[1:] &= owner[1:] != owner[:-1]
    path = rotary_angles(
        machine,
        path_tip,
        path_axis,
        tolerance=tolerance,
        rapid=rapid,
        still=still_poses(program.kind)[owner],
        still_tolerance=angle_resolution,
        line=program.line[owner],
        file=file,
    )
    branch = path.branch.astype(np.int64)
    followed = Followed(first, count, path.angles, branch)
    pose_angles = np.full((len(program), 2), np.nan)
    written = np.flatnonzero(~segments.skip)
    pose_angles[written] = path.angles[last[written] - 1]
    middle = first + count // 2
    pose_angles[pose], _ = continued(machine, axis[pose], path.angles[middle], branch[middle], tolerance / 2)
    return followed, pose_angles, path.findings


def _even_segments(
    smoothed: SmoothProgram, machine: Machine, segments: Segments, angles: Floats, tolerance: Floats
) -> Bools:
    """Segments on which even angles from pose to pose keep their tolerances (n,)."""
    axis = smoothed.program.axis
    even = (segments.start >= 0) & ~segments.skip
    pose = np.flatnonzero(even)
    start = segments.start[pose]
    turn = np.abs(angles[pose] - angles[start]).sum(axis=1)
    # Path on the sphere and great circle both leave their chord by less than (turn)²/8; poses at the pole deviate.
    exact = np.maximum(
        angle_between(tool_axis(machine, angles[pose]), axis[pose]),
        angle_between(tool_axis(machine, angles[start]), axis[start]),
    )
    bound = np.radians(turn) ** 2 / 4 + np.radians(exact)
    doubtful = np.flatnonzero(~(bound <= np.radians(tolerance[pose]) * SEGMENT_SHARE))
    pose, start = pose[doubtful], start[doubtful]
    worst = np.zeros(len(pose))
    for share in SEGMENT_SAMPLES:
        words = angles[start] * (1 - share) + angles[pose] * share
        wanted = unit(axis[start] * (1 - share) + axis[pose] * share)
        worst = np.maximum(worst, angle_between(tool_axis(machine, words), wanted))
    even[pose[~(worst <= tolerance[pose] * SEGMENT_SHARE)]] = False
    return even


def _exact_ends(
    smoothed: SmoothProgram, segments: Segments, rows: Ints, followed: Followed, pose_angles: Floats
) -> tuple[Ends, Ends]:
    """Ends of the remainders with the angles of the ruled motion; without slopes."""
    corners = smoothed.corners
    nothing = np.full(pose_angles.shape, np.nan)
    linear = np.flatnonzero((segments.start >= 0) & ~segments.skip)
    start = Ends(segments.entry, nothing.copy(), nothing.copy(), np.zeros_like(nothing))
    end = Ends(segments.exit, nothing.copy(), nothing.copy(), np.zeros_like(nothing))
    start.angles[linear] = pose_angles[segments.start[linear]]
    end.angles[linear] = pose_angles[linear]
    end.angles[corners.pose[rows]] = followed.angles[followed.first]
    start.angles[corners.after[rows]] = followed.angles[followed.first + followed.count - 1]
    return start, end


def _level(segments: Segments, pose_angles: Floats, even: Bools, start: Ends, end: Ends) -> None:
    """Put the joints of even segments on their line."""
    pose = np.flatnonzero(even)
    origin = pose_angles[segments.start[pose]]
    turn = pose_angles[pose] - origin
    for side in (start, end):
        side.angles[pose] = origin + side.fraction[pose, None] * turn
        side.slope[pose] = turn


def _divide_remainders(
    smoothed: SmoothProgram,
    machine: Machine,
    segments: Segments,
    even: Bools,
    start: Ends,
    end: Ends,
    tolerance: float,
    file: str | None,
) -> Insertions:
    """Points for the remainders that do not run evenly, and the slopes of their first and last parts."""
    program = smoothed.program
    pose = np.flatnonzero((segments.start >= 0) & ~segments.skip & segments.has_line & ~even)
    origin = segments.start[pose]
    rows, both = np.repeat(pose, 2), np.zeros((2 * len(pose), 2))
    tip, lever = np.zeros((2, 2 * len(pose), 3))
    for offset, side in enumerate((start, end)):
        share = side.fraction[pose, None]
        tip[offset::2] = program.tip[origin] * (1 - share) + program.tip[pose] * share
        # not of unit length: what is ruled between these is the ruled motion between the poses, at its own rate
        lever[offset::2] = program.axis[origin] * (1 - share) + program.axis[pose] * share
        both[offset::2] = side.angles[pose]
    rapid = np.arange(2 * len(pose)) % 2 == 0
    found = insertions(machine, tip, lever, both, tolerance=tolerance, rapid=rapid, line=program.line[rows], file=file)
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


def _ruled(smoothed: SmoothProgram, machine: Machine, segments: Segments, even: Bools, side: Ends, cone: float) -> Ends:
    """Return the same ends with the derivatives of the ruled motion, but for even segments."""
    program = smoothed.program
    pose = np.flatnonzero((segments.start >= 0) & ~segments.skip & ~even)
    origin, fraction, here = segments.start[pose], side.fraction[pose], side.angles[pose]
    beside = []
    for step in (-DIFFERENCE, DIFFERENCE):
        share = (fraction + step)[:, None]
        axis = unit(program.axis[origin] * (1 - share) + program.axis[pose] * share)
        beside.append(continued(machine, axis, here, np.full(len(pose), -1), cone)[0])
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
