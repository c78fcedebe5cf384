"""Points to insert so that axes which move linearly in their words keep the tool on the ruled motion.

In a straight block every axis runs evenly from word to word. With tool centre point control the tip then runs straight,
but the tool axis follows its rotary angles and not the shortest turn; without it the tip leaves its line too.

A division is enough only where that is proved: by bounds of the derivatives alone, or by so many
samples that the same bounds leave nearly nothing to what lies between them. They say, too, how many parts to try.

A vector function on [0, 1] with |f″| ≤ M leaves its chord on a stretch of length h by at most M·h²/8. So the difference
of two motions is between N + 1 even samples no larger than at them but for (M₁ + M₂)/(8 N²).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import dot, joined_rows, norm, some_rows, spread, unit
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import (
    angle_between,
    continued,
    machine_position,
    solutions,
    tip_position,
    tool_axis,
    wrap,
)
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.rotary.branch_choice import limit_error, ruled_axis

ROUNDS = 28  #: Rounds of division.
PARTS = 64  #: The most parts that an interval is divided into at once.
#: The error of a smooth motion at a quarter of its way is ¾ of its largest. Where that holds to SMOOTH of it, and no
#: axis turns by more than SMOOTH_TURN (degrees), the error falls with the square of the number of parts, to AIM.
SMOOTH, SMOOTH_TURN, AIM = 0.1, 30.0, 0.93
#: An error whose bound is below this share of the tolerance is not looked at; the rest is left to poses at the pole.
SURE = 0.5
#: Share of the tolerance that a proof leaves to what lies between its samples, and the most intervals between them.
PROOF, MOST_SAMPLES = 0.02, 256
JUMP = 1e-12  #: A way that comes nearer to the origin than this share of its length goes through it.
CHUNK = 1 << 15  #: Samples that are worked on at a time.


@dataclass(frozen=True)
class FilledPath:
    """A path with its inserted points: m rows, exact points of the ruled motion."""

    pose: Ints  # of the original path that each row is, or that it leads to
    inserted: Bools
    tip: Floats
    axis: Floats
    angles: Floats  # degrees


def filled_path(
    machine: Machine,
    tip: Floats,
    axis: Floats,
    angles: Floats,
    *,
    tolerance: float | Floats,
    rapid: Bools | None = None,
    tip_tolerance: float | None = None,
    max_step: float | None = None,
    line: Ints | None = None,
    file: str | None = None,
) -> tuple[FilledPath, Ints]:
    """Path with the points that straight blocks between its rotary words need to stay on the ruled motion.

    Tips (n, 3) are in mm, axes unit vectors, angles (n, 2) degrees from `rotary_angles`. The tool axis may be off that
    of the ruled motion by the tolerance, degrees, on the way to each point (n,), and the tip off its line by
    `tip_tolerance`, mm, None where the control keeps it there. A rotary axis may turn by `max_step` degrees in one
    block. `rapid` moves (n,) need no points. CS362: a rotary axis would leave its limits between two poses within them.
    Besides come the segments (u,), by the pose before each, that no division brought within the tolerances.
    """
    rapid = np.zeros(len(axis), np.bool_) if rapid is None else rapid
    motion = RuledMotion(machine, tip, axis, np.broadcast_to(tolerance, len(axis)), tip_tolerance, max_step)
    found: list[Intervals] = []
    open_ = motion.segments(angles, np.flatnonzero(~rapid[1:]), branches=False)
    for number in range(ROUNDS + 1):
        parts = motion.parts(open_)
        open_, parts = some_rows(open_, parts > 1), parts[parts > 1]
        if not len(parts) or number == ROUNDS:
            break
        if not number:
            open_ = motion.segments(angles, open_.segment, branches=True)
        open_, divided = motion.divide(open_, parts)
        found.append(divided)
    new = joined_rows((some_rows(open_, slice(0)), *found))
    new = some_rows(new, np.lexsort((new.share[:, 0], new.segment)))
    segment, fraction, inner = new.segment, new.share[:, 0], new.angles[:, 0]
    limits = machine.limits
    inside = np.clip(inner, limits[:, 0], limits[:, 1])
    # At the pole the second axis may stop at its limit; anywhere else the way itself is outside.
    outside = np.abs(inner - inside).max(axis=1, initial=0.0) > motion.tolerance[segment + 1] / 2
    if outside.any():
        first = int(np.argmax(outside))
        here = slice(first, first + 1)
        both = solutions(machine, ruled(tip, axis, segment[here], fraction[here])[1]).angles[0]
        number = 0 if line is None else int(line[segment[first] + 1])
        raise limit_error(machine, both, inner[first], number, file)
    at = segment + 1
    pose, inserted = np.insert(np.arange(len(tip)), at, at), np.insert(np.zeros(len(tip), np.bool_), at, True)
    pairs = zip((tip, axis, angles), (*ruled(tip, axis, segment, fraction), inside), strict=True)
    whole = (np.insert(old, at, new, axis=0) for old, new in pairs)
    return FilledPath(pose, inserted, *whole), np.unique(open_.segment)


def ruled(tip: Floats, axis: Floats, segment: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Tip and unit axis of the ruled motion at fractions of segments: both ends of the axis run linearly."""
    share = fraction[:, None]
    return tip[segment] * (1 - share) + tip[segment + 1] * share, ruled_axis(axis[segment], axis[segment + 1], share)


@dataclass(frozen=True)
class Intervals:
    """Parts of segments: where they begin and end, with angles and branches."""

    segment: Ints  #: (p,)
    share: Floats  #: (p, 2) of the segment
    angles: Floats  #: (p, 2, 2) degrees
    branch: Ints  #: (p, 2), -1 in the cone of the pole

    @property
    def turn(self) -> Floats:
        """(p, 2) degrees."""
        return np.abs(self.angles[:, 1] - self.angles[:, 0])


@dataclass(frozen=True)
class RuledMotion:
    """The path, and how exactly it is to be followed."""

    machine: Machine
    tip: Floats
    axis: Floats
    tolerance: Floats  #: (n,), degrees; on the way to each point
    tip_tolerance: float | None
    max_step: float | None

    def segments(self, angles: Floats, segment: Ints, *, branches: bool) -> Intervals:
        """Whole segments, on request with the branches of their ends: -1 in the cone of the pole."""
        ends = np.stack((segment, segment + 1), axis=1)
        branch = np.full(ends.shape, -1)
        for side in (0, 1) if branches else ():
            found = solutions(self.machine, self.axis[ends[:, side]])
            off = np.abs(wrap(found.angles - angles[ends[:, side], None, :])).sum(axis=2)
            cone = self.tolerance[segment + 1] / 2
            branch[:, side] = np.where(found.pole_distance <= cone, -1, np.argmin(off, axis=1))
        return Intervals(segment, np.tile((0.0, 1.0), (len(segment), 1)), angles[ends], branch)

    def parts(self, intervals: Intervals) -> Ints:
        """Into how many parts each interval is to be divided: 1 where it is good as it is."""
        parts = np.ones(len(intervals.segment), np.int64)
        if self.max_step is not None:
            turn = intervals.turn.max(axis=1, initial=0.0)
            parts += np.ceil(turn / self.max_step - 1).clip(0).astype(np.int64)
        bends = self._bends(intervals)
        doubtful = np.flatnonzero((bends[0] + bends[1] > SURE) | (bends[2] > 1.0))
        samples = np.sqrt(np.maximum(bends[0] + bends[1], bends[2])[doubtful] / PROOF)
        samples = np.exp2(np.ceil(np.log2(samples.clip(4.0, MOST_SAMPLES)))).astype(np.int64)
        for number in np.unique(samples).tolist():
            group = doubtful[samples == number]
            size = max(1, CHUNK // (number + 1))
            for some in (group[begin : begin + size] for begin in range(0, len(group), size)):
                parts[some] = np.maximum(parts[some], self._needed(some_rows(intervals, some), bends[:, some], number))
        return np.minimum(parts, PARTS)

    def _needed(self, part: Intervals, bends: Floats, number: int) -> Ints:
        """Into how many parts to divide intervals, by errors in 4, 8, 16 ... even samples; 1 where they are good."""
        shape = (len(part.segment), number + 1)
        samples = np.tile(np.arange(number + 1) / number, shape[0])
        repeated = some_rows(part, np.repeat(np.arange(shape[0]), number + 1))
        ends = [np.repeat(end, number + 1, axis=0) for end in self._ends(part)]
        proved, least = np.zeros(shape[0], np.bool_), np.full(shape, np.inf)
        for along, tip, axis in (
            [values.reshape(shape) for values in errors] for errors in self._errors(repeated, ends, samples)
        ):
            # any way of pairing the two motions will do: this one is even between the samples
            between = bends[0] / number**2 + bends[1] * (np.diff(along, axis=1) ** 2).max(axis=1)
            proved |= (tip.max(axis=1) + bends[2] / number**2 <= 1) & (axis.max(axis=1) + between <= 1)
            np.minimum(least, np.maximum(tip, axis), out=least)
        quarter, half, last = least[:, number // 4 : -1 : number // 4].T
        worst = np.maximum(np.maximum(quarter, half), last)
        smooth = np.maximum(np.abs(quarter - 0.75 * half), np.abs(last - 0.75 * half)) <= SMOOTH * half
        smooth &= (part.turn.sum(axis=1) <= SMOOTH_TURN) & (worst > 1)
        count = np.where(smooth, np.ceil(np.sqrt(np.minimum(worst, 1e9) / AIM)), 2).astype(np.int64)
        return np.where(proved, 1, np.maximum(count, 2))

    def _bends(self, part: Intervals) -> Floats:
        """(3, p) how far intervals may leave their chords over the tolerances: real axis, ruled axis, tip."""
        turn = np.radians(part.turn)
        tolerance = np.radians(self.tolerance[part.segment + 1])
        start, end = (self._lever(part.segment, share) for share in part.share.T)
        bends = np.zeros((3, len(turn)))
        bends[0] = axis_bend(self.machine, turn, unit(start), unit(end), tolerance) / (8 * tolerance)
        bends[1] = ruled_bend(start, end) / (8 * tolerance)
        if self.tip_tolerance is not None:
            _, _, from_, to = self._ends(part)
            bends[2] = tip_bend(self.machine, from_, to, turn) / (8 * self.tip_tolerance)
        return bends

    def _lever(self, segment: Ints, fraction: Floats) -> Floats:
        """Axis of the ruled motion, not of unit length."""
        share = fraction[:, None]
        return self.axis[segment] * (1 - share) + self.axis[segment + 1] * share

    def _ends(self, part: Intervals) -> list[Floats]:
        """Tip and linear words at both ends of each interval: four times (p, 3), mm; nothing where the tip is kept."""
        if self.tip_tolerance is None:
            return []
        tips = [ruled(self.tip, self.axis, part.segment, share)[0] for share in part.share.T]
        return [*tips, *(machine_position(self.machine, tip, part.angles[:, end]) for end, tip in enumerate(tips))]

    def _errors(self, part: Intervals, ends: list[Floats], fraction: Floats) -> Iterator[tuple[Floats, Floats, Floats]]:
        """Errors at one share of each interval, the ruled motion paired with the real one in two ways."""
        share = fraction[:, None]
        words = part.angles[:, 0] * (1 - share) + part.angles[:, 1] * share
        axis = tool_axis(self.machine, words)
        nearest = self._swept(part, axis, fraction)
        if self.tip_tolerance is not None:
            start, end, from_, to = ends
            real, way = tip_position(self.machine, from_ * (1 - share) + to * share, words) - start, end - start
            square = dot(way, way)
            foot = dot(real, way) / np.where(square > 0, square, 1.0)
            nearest = np.where(square > 0, np.clip(foot, 0, 1), nearest)
        for along in (fraction, nearest):
            _, wanted = ruled(self.tip, self.axis, part.segment, part.share[:, 0] + along * np.diff(part.share)[:, 0])
            tip = np.zeros(len(along))
            if self.tip_tolerance is not None:
                tip = np.linalg.norm(real - along[:, None] * way, axis=1) / self.tip_tolerance
            yield along, tip, angle_between(axis, wanted) / self.tolerance[part.segment + 1]

    def _swept(self, part: Intervals, axis: Floats, fraction: Floats) -> Floats:
        """Share of each interval where the ruled axis is nearest to another, where the tip stands: else `fraction`."""
        still = np.flatnonzero((self.tip[part.segment] == self.tip[part.segment + 1]).all(axis=1))
        along = fraction.copy()
        if len(still):
            some = some_rows(part, still)
            start, end = (self._lever(some.segment, share) for share in some.share.T)
            normal = np.cross(start, end)
            gone, left = (dot(np.cross(*pair), normal) for pair in ((start, axis[still]), (axis[still], end)))
            whole = gone + left
            swept = np.divide(gone, whole, out=fraction[still].copy(), where=whole > 0.0)
            along[still] = np.clip(swept, 0.0, 1.0)
        return along

    def divide(self, intervals: Intervals, count: Ints) -> tuple[Intervals, Intervals]:
        """Divide each interval into so many equal parts: the new intervals, and those that start with a new point."""
        owner, number = spread(count)
        divided, new = some_rows(intervals, owner), np.flatnonzero(number > 0)
        at = some_rows(divided, new)
        part = number[new] / count[owner[new]]
        share = at.share[:, 0] + np.diff(at.share)[:, 0] * part
        words = at.angles[:, 0] * (1 - part[:, None]) + at.angles[:, 1] * part[:, None]
        # A point between a pose in the cone and one outside is on the branch of the latter.
        known = np.where(at.branch[:, 0] < 0, at.branch[:, 1], at.branch[:, 0])
        known[(at.branch >= 0).all(axis=1) & (at.branch[:, 0] != at.branch[:, 1])] = -1
        _, axis = ruled(self.tip, self.axis, at.segment, share)
        words, known = continued(self.machine, axis, words, known, self.tolerance[at.segment + 1] / 2)
        for values, point in ((divided.share, share), (divided.angles, words), (divided.branch, known)):
            values[new, 0] = values[new - 1, 1] = point
        return divided, some_rows(divided, new)


def axis_bend(machine: Machine, turn: Floats, start: Floats, end: Floats, slack: Floats) -> Floats:
    """Bound (n,) on the second derivative of the tool axis when both rotary axes turn evenly, by `turn` (n, 2) rad.

    Tool axes (n, 3) at both ends may be off by the slack, rad.
    """
    turn = np.abs(turn)
    away = np.minimum(np.maximum(_sine(machine, start), _sine(machine, end)) + slack + turn[:, 1] / 2, 1.0)
    bound: Floats = away * turn[:, 0] ** 2 + 2 * turn[:, 0] * turn[:, 1] + turn[:, 1] ** 2
    return bound


def ruled_bend(start: Floats, end: Floats) -> Floats:
    """Bound (n,) on the second derivative of the direction of points that run evenly from `start` to `end` (n, 3).

    Infinite where the point comes to the origin: the direction jumps there.
    """
    way = end - start
    square = dot(way, way)
    nearest = np.clip(-dot(start, way) / np.where(square > 0, square, 1.0), 0.0, 1.0)
    shortest = np.linalg.norm(start + nearest[:, None] * way, axis=1)
    moving = shortest > np.sqrt(square) * JUMP
    shortest = np.where(moving, shortest, 1.0)
    # With the distance h of the line from the origin the direction turns at ω = h|way|/r², and |ω′| = 2ω|r′|/r.
    turning = np.linalg.norm(np.cross(start, way), axis=1) / shortest**2
    outwards = np.maximum(_along(start, way), _along(end, way))
    return np.where(moving, turning**2 + 2 * turning * outwards / shortest, np.where(square > 0, np.inf, 0.0))


def tip_bend(machine: Machine, start: Floats, end: Floats, turn: Floats) -> Floats:
    """Bound (n,) on the second derivative of the tip in the part when all five axes run evenly, mm.

    `start` and `end` (n, 3), mm, are words of the linear axes (`machine_position`); turns (n, 2) are in rad.
    """
    turn = np.abs(turn)
    size, speed, bend = np.zeros((3, len(turn)))  # of the way of the tip and its derivatives, as `poses._swing` goes
    for index in (1, 0):
        axis = machine.axes[index]
        if axis.carrier == "head":
            lever = float(np.linalg.norm(machine.tool_length * machine.tool + np.array(axis.point)))
            size, speed, bend = _turned(size + lever, speed, bend, turn[:, index])
            size = size + lever
    before = np.zeros(3)  # the point that the size counts from
    speed = speed + np.linalg.norm(end - start, axis=1)
    swing, first = size, True
    for index in (1, 0):
        axis = machine.axes[index]
        if axis.carrier == "table":
            point = np.array(axis.point)
            if first:  # both ends of the straight way of the linear axes
                words = [np.linalg.norm(side + machine.part_zero - point, axis=1) for side in (start, end)]
                size, first = swing + np.maximum(*words), False
            else:
                size = size + float(np.linalg.norm(point - before))
            size, speed, bend = _turned(size, speed, bend, turn[:, index])
            before = point
    return bend


def _turned(size: Floats, speed: Floats, bend: Floats, turn: Floats) -> tuple[Floats, Floats, Floats]:
    """Size and derivatives of R(q) p, with q′ = `turn`, from those of p."""
    return size, turn * size + speed, turn**2 * size + 2 * turn * speed + bend


def _sine(machine: Machine, axis: Floats) -> Floats:
    """Sine of the angle between the tool axis and the first rotary axis."""
    x, y, z = machine.axes[0].unit
    return norm(axis @ np.array(((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))))


def _along(point: Floats, way: Floats) -> Floats:
    """Speed with which a point that runs along `way` leaves the origin."""
    length = np.linalg.norm(point, axis=1)
    return np.abs(dot(point, way)) / np.where(length > 0, length, 1.0)
