"""Where curves of corners in rotary words meet straight motion: the angles there, and their derivatives.

A segment whose angles may run evenly from pose to pose within the tolerance does so: a corner between two of them is
rounded in its angles exactly as it is in its tip. On all others the joints have the angles of the ruled motion, and the
curve goes on with the rate of the straight line beside it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cornersmooth.geometry import nurbs
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.kinematics.poses import continued
from cornersmooth.model import Bools, Corners, Floats, Ints, Move, SmoothProgram
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_rows import largest_turn
from cornersmooth.nc.rotary_words import RotaryWay, machine_of
from cornersmooth.rotary.curve_angles import Curves
from cornersmooth.rotary.subdivision import insertions, runs_evenly
from cornersmooth.settings import Settings
from cornersmooth.slices import some_rows
from cornersmooth.smoothing.segments import segments_of

#: share of what rotary axes may take of ε that a curve may use: the rest is for the digits of its control points
SHARE = 0.95

#: share of that which even angles may take on the segments beside a corner
_EVEN_SHARE = 0.9

#: steps of the parameter of a corner, and those that three decimals hold as the parameter 1 / 8
STEPS = float(1 << 15)

#: corners whose angles are found at a time
_TOGETHER = 1 << 13


def left_to_axes(settings: Settings, form: Form, taken: Floats) -> Floats:
    """What ε leaves to rotary axes where so much of it, mm, is taken at the axis point: degrees."""
    left = settings.tolerance - math.sqrt(3.0) / 2.0 * settings.tip_resolution - taken
    return SHARE * np.degrees(left / settings.axis_scale) - form.angle_rounding


@dataclass(frozen=True)
class _Legs:
    """The segments into each corner, then those out of it: m legs of m / 2 corners."""

    inward: Bools
    #: of, to: poses at both ends
    of: Ints
    to: Ints
    joint: Ints  #: row of the way
    line: Bools  #: whether a part of the segment is written as a line
    #: entry, leave: fractions of the segment between which straight motion is left
    entry: Floats
    leave: Floats


@dataclass(frozen=True)
class Joints:
    """What the joints of corners go by."""

    smoothed: SmoothProgram
    form: Form
    way: RotaryWay  #: angles and axes at joints change in place
    #: has_line, entry, leave: (n,) as in `Segments`
    has_line: Bools
    entry: Floats
    leave: Floats
    least: float  #: degrees that rotary axes may take of ε in any case
    straight: float  #: and on straight motion
    angles: Floats  #: (n, 2), degrees; at each pose, NaN where none is written
    free: Ints  #: rows of the way before which solution and turn may have changed
    allowed: Floats  #: (n,), degrees; on the straight motion to each pose and on curves beside it

    @classmethod
    def of(cls, smoothed: SmoothProgram, form: Form, way: RotaryWay, corner: Ints) -> Joints:
        """Work out what concerns all joints; `corner` are the rows of the corners that are smoothed."""
        program, settings, corners, n = smoothed.program, smoothed.settings, smoothed.corners, len(smoothed.program)
        least = form.rotary_tolerance(settings.tolerance, settings.axis_scale)
        straight = float(left_to_axes(settings, form, np.zeros(1))[0])
        # the last row of the move to a corner is in the middle of its curve
        angles, branch = np.full((n, 2), np.nan), np.full(n, -1, np.int8)
        angles[way.move], branch[way.move] = way.angles, way.branch
        allowed = np.full(n, straight)
        for begin in range(0, len(corner), _TOGETHER):
            own = corner[begin : begin + _TOGETHER]
            pose = corners.pose[own]
            known = angles[pose], branch[pose].astype(np.int64)
            angles[pose], _ = continued(machine_of(form), program.axis[pose], *known, least / 2)
            taken = np.maximum(left_to_axes(settings, form, corners.axis_error[own]), least)
            for beside in (pose, corners.after[own]):
                np.minimum.at(allowed, beside, taken)
        lines = segments_of(smoothed, dense=False)
        ends = lines.has_line, lines.entry, lines.exit
        return cls(smoothed, form, way, *ends, least, straight, angles, np.flatnonzero(way.free), allowed)

    def turns(self, row: Ints) -> Ints:
        """(m,) how often solution and turn may have changed up to rows of the way."""
        return np.searchsorted(self.free, row, side="right")

    def tolerance(self, rows: slice) -> Floats:
        """(m,) degrees: that of some rows of the way, which is another on straight lines."""
        line = np.isnan(self.way.place[rows]) & (self.smoothed.program.kind[self.way.move[rows]] == Move.LINEAR)
        return np.where(line, self.straight, self.way.tolerance[rows])

    def curves(self, corners: Corners, begin: Ints, end: Ints) -> Curves:
        """Curves of some corners between rows of the way; joints of even segments are put on their lines."""
        program, settings, way, count = self.smoothed.program, self.smoothed.settings, self.way, len(corners)
        legs = self._legs(corners, begin, end)
        from_angles, to_angles, even = self._pose_angles(legs)
        of, to = legs.of[even], legs.to[even]
        even[even] = runs_evenly(
            machine_of(self.form),
            program.axis[of],
            program.axis[to],
            from_angles[even],
            to_angles[even],
            _EVEN_SHARE * self.allowed[to],
        )
        # without a line both curves meet where the first one ends; even ones differ by less than the shortest line
        share = np.where(legs.inward & (legs.line | even), legs.leave, legs.entry)[:, None]
        turn = to_angles - from_angles
        angles = np.where(even[:, None], from_angles + share * turn, way.angles[legs.joint])
        way.angles[legs.joint] = angles
        # not of unit length: the ruled motion between these is that between the poses, at its own rate
        way.axis[legs.joint] = program.axis[legs.of] * (1.0 - share) + program.axis[legs.to] * share
        # rates by the fraction of the segment: of even motion, of the line beside, of the parabola through the joint
        before, behind = (angles - from_angles) / share, (to_angles - angles) / (1.0 - share)
        rate, bent = before * (1.0 - share) + behind * share, 2.0 * (behind - before)
        rate[even], bent[even | legs.line] = turn[even], 0.0
        beside = np.flatnonzero(legs.line & ~even)
        rate[beside] = self._line_rates(some_rows(legs, beside))
        # by the parameter of the curve, times its weight
        weight = nurbs.full_weights(corners.weights)
        slope, bend, weight_slope, weight_bend = (
            np.tile(part, 2)[:, None] for part in nurbs.leg_derivatives(weight, corners.ratio)
        )
        sign = np.where(legs.inward, 1.0, -1.0)[:, None]
        gone = np.concatenate((corners.trim_in, corners.trim_out))[:, None] * slope
        one = rate * gone
        two = sign * one * bend / slope + bent * gone**2
        jets = angles, sign * weight_slope * angles + one, weight_bend * angles + 2.0 * sign * weight_slope * one + two
        ends = np.stack([jet.reshape(2, count, 2) / STEPS**order for order, jet in enumerate(jets)], axis=2)
        tip, axis_point = nurbs.control_points(program, corners, slice(None), settings.axis_length)
        points = np.concatenate((tip, axis_point - tip, np.ones_like(tip[..., :1])), axis=2) * weight[:, :, None]
        splines = Splines(np.tile((0.0, STEPS / 2, STEPS), count), np.full(count, 3))
        tolerance = np.maximum(left_to_axes(settings, self.form, corners.axis_error), SHARE * self.least)
        return Curves(splines, points.reshape(-1, 7), ends, tolerance)

    def _legs(self, corners: Corners, begin: Ints, end: Ints) -> _Legs:
        """Legs of corners whose curves lie between these rows."""
        of, to = np.concatenate((corners.before, corners.pose)), np.concatenate((corners.pose, corners.after))
        inward, joint = np.arange(len(to)) < len(corners), np.concatenate((begin, end))
        return _Legs(inward, of, to, joint, self.has_line[to], self.entry[to], self.leave[to])

    def _pose_angles(self, legs: _Legs) -> tuple[Floats, Floats, Bools]:
        """Angles (m, 2) at both ends of legs, and whether one follows from the other in a cut."""
        program, machine = self.smoothed.program, machine_of(self.form)
        from_angles, stated = self.angles[legs.of], np.isnan(self.angles[legs.of, 0])  # no row leads to such a pose
        near, axis = self.way.angles[legs.joint[stated]], program.axis[legs.of[stated]]
        from_angles[stated], _ = continued(machine, axis, near, np.full(len(near), -1), self.least / 2)
        of, to = (self.turns(np.searchsorted(self.way.move, pose, side="right") - 1) for pose in (legs.of, legs.to))
        return from_angles, self.angles[legs.to], (of == to) & ~stated

    def _line_rates(self, legs: _Legs) -> Floats:
        """(m, 2) degrees by the fraction of the segment: rates of lines beside joints, as they will be divided."""
        row = legs.joint - legs.inward
        if not len(row):
            return np.zeros((0, 2))
        first, last = int(row.min()), int(row.max())
        rows = slice(first, last + 2)
        way, rapid = some_rows(self.way, rows), np.ones(last + 2 - first, np.bool_)
        rapid[row + 1 - first] = False
        more = insertions(
            machine_of(self.form),
            way.tip,
            way.axis,
            way.angles,
            tolerance=self.tolerance(rows),
            rapid=rapid,
            max_step=largest_turn(self.smoothed.settings),
            line=self.smoothed.program.line[way.move],
            file=self.smoothed.program.source.name,
        )
        segment = more.segment + first
        nearest = np.where(
            legs.inward, np.searchsorted(segment, row, side="right") - 1, np.searchsorted(segment, row, side="left")
        )
        share, other = 1.0 - legs.inward, self.way.angles[row + ~legs.inward]
        found = np.isin(row, segment)
        share[found], other[found] = more.fraction[nearest[found]], more.angles[nearest[found]]
        place = legs.entry + share * (legs.leave - legs.entry)
        return (other - self.way.angles[legs.joint]) / (place - np.where(legs.inward, legs.leave, legs.entry))[:, None]
