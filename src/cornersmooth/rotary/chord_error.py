"""Whether words that run evenly keep the tool on the ruled motion, and into how many parts to divide where not.

An interval is kept whole only where that is proved: by bounds of the derivatives alone (`chord_bounds`), or by so many
samples that the same bounds leave nearly nothing to what lies between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import angle_between, continued, tool_axis
from cornersmooth.kinematics.position import machine_position, tip_position
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.rotary.chord_bounds import axis_bend, ruled_bend, tip_bend
from cornersmooth.vectors import dot, unit

#: Shares of an interval at which its error is looked at first: an error that vanishes at all three is none.
SAMPLES = (0.25, 0.5, 0.75)
#: The most parts that an interval is divided into at once.
PARTS = 64
#: The error of a smooth motion at a quarter of its way is ¾ of its largest. Where that holds to SMOOTH of it, and no
#: axis turns by more than SMOOTH_TURN (degrees), the error falls with the square of the number of parts: the interval
#: is divided at once into as many as bring it to AIM of the tolerance. All others are halved.
SMOOTH, SMOOTH_TURN, AIM = 0.1, 30.0, 0.93
#: An error whose bound is below this share of the tolerance is not looked at; the rest is left to poses at the pole.
SURE = 0.5
#: Share of the tolerance that a proof leaves to what lies between its samples, and the most intervals between them.
PROOF, MOST_SAMPLES = 0.02, 256
#: Squares of vectors that are nearer to 1 are those of unit vectors.
UNIT = 1e-6
#: Samples of proofs that are worked on at a time.
CHUNK = 1 << 15


def ruled(tip: Floats, axis: Floats, segment: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Tip and unit axis of the ruled motion at fractions of segments: both ends of the axis run linearly."""
    share = fraction[:, None]
    direction = axis[segment] * (1 - share) + axis[segment + 1] * share
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    direction = np.where(length > 0, direction / np.where(length > 0, length, 1.0), axis[segment])
    return tip[segment] * (1 - share) + tip[segment + 1] * share, direction


@dataclass(frozen=True)
class Intervals:
    """Parts of segments: where they begin and end, and what stands there."""

    segment: Ints
    start: Floats
    end: Floats
    start_angles: Floats
    end_angles: Floats
    start_branch: Ints
    end_branch: Ints

    @property
    def turn(self) -> Floats:
        """(p, 2) degrees."""
        return np.abs(self.end_angles - self.start_angles)

    def take(self, which: Bools | Ints) -> Intervals:
        """Return the chosen ones."""
        return Intervals(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class _Bends:
    """How far intervals may leave their chords, over the tolerances: (p,) each."""

    axis: Floats
    ruled: Floats
    tip: Floats

    def take(self, which: Ints) -> _Bends:
        return _Bends(self.axis[which], self.ruled[which], self.tip[which])


@dataclass(frozen=True)
class _Look:
    """Errors over their tolerances, at one sample of each of p intervals: (p,) each.

    Parameters
    ----------
    tip, axis : (p,) float64
        Against the ruled motion where it comes nearest to the tip, which is at `along`.
    tip_beside, axis_beside : (p,) float64
        Against the ruled motion at the same share of the interval: where the tip hardly moves the other says nothing.
    along : (p,) float64
        Share of the interval.
    """

    tip: Floats
    axis: Floats
    along: Floats
    tip_beside: Floats
    axis_beside: Floats

    @property
    def least(self) -> Floats:
        """The larger of both errors, where that is smaller."""
        return np.minimum(np.maximum(self.tip, self.axis), np.maximum(self.tip_beside, self.axis_beside))


@dataclass(frozen=True)
class InterpolationError:
    """The path, and how exactly it is to be followed."""

    machine: Machine
    tip: Floats
    axis: Floats
    tolerance: float
    tip_tolerance: float | None
    max_step: float | None

    def parts(self, intervals: Intervals) -> Ints:
        """Into how many parts each interval is to be divided: 1 where it is good as it is."""
        turn = intervals.turn
        parts = np.ones(len(turn), np.int64)
        if self.max_step is not None:
            parts += np.ceil(turn.max(axis=1, initial=0.0) / self.max_step - 1).clip(0).astype(np.int64)
        check = np.flatnonzero(~self._obvious(intervals))
        checked = intervals.take(check)
        bends = self._bends(checked)
        doubtful = np.flatnonzero((bends.axis + bends.ruled > SURE) | (bends.tip > 1.0))
        check = check[doubtful]
        parts[check] = np.maximum(parts[check], self._checked(checked.take(doubtful), bends.take(doubtful)))
        return np.minimum(parts, PARTS)

    def _obvious(self, part: Intervals) -> Bools:
        """Whole segments with turns so small that both motions leave their chord by next to nothing.

        The axis turns by less than the sum of the turns, and so does the ruled one, whose ends are of unit length: its
        bend is 1.3 times the square of that at most, where that is below ½.
        """
        turn = np.radians(part.turn.sum(axis=1))
        small = np.minimum(0.5, np.sqrt(SURE * np.radians(self.tolerance) * 8 / 2.3))
        obvious: Bools = (turn <= small) & (part.end - part.start == 1.0)
        if self.tip_tolerance is not None or not obvious.any():
            return np.zeros(len(turn), np.bool_)
        units = np.abs(dot(self.axis, self.axis) - 1) < UNIT
        obvious &= units[part.segment] & units[part.segment + 1]
        return obvious

    def _checked(self, part: Intervals, bends: _Bends) -> Ints:
        """Into how many parts to divide intervals with errors that may be too large: by what is found on them."""
        ends = self._ends(part)
        excess = np.stack([self._look(part, ends, np.full(len(part.segment), share)).least for share in SAMPLES])
        worst = excess.max(axis=0, initial=0.0)
        smooth = (np.abs(excess[[0, 2]] - 0.75 * excess[1]) <= SMOOTH * excess[1]).all(axis=0)
        smooth &= part.turn.sum(axis=1) <= SMOOTH_TURN
        count = np.where(smooth, np.ceil(np.sqrt(np.minimum(worst, 1e9) / AIM)), 2).astype(np.int64)
        parts = np.where(worst > 1, np.maximum(count, 2), 1)
        samples = np.sqrt(np.maximum(np.maximum(bends.axis + bends.ruled, bends.tip), 0.0) / PROOF)
        samples = np.exp2(np.ceil(np.log2(np.maximum(samples, 1.0))))
        parts[samples > MOST_SAMPLES] = np.maximum(parts[samples > MOST_SAMPLES], 2)
        for number in np.unique(samples[parts == 1]).astype(np.int64).tolist():
            group = np.flatnonzero((parts == 1) & (samples == number))
            size = max(1, CHUNK // (number + 1))
            for begin in range(0, len(group), size):
                some = group[begin : begin + size]
                proved = self._proved(part.take(some), bends.take(some), [end[some] for end in ends], number)
                parts[some[~proved]] = 2
        return parts

    def _proved(self, part: Intervals, bends: _Bends, ends: list[Floats], number: int) -> Bools:
        """Whether the error of intervals keeps its tolerances everywhere: measured in so many even samples and more."""
        count = len(part.segment)
        samples = np.tile(np.arange(number + 1) / number, count)
        repeated = part.take(np.repeat(np.arange(count), number + 1))
        look = self._look(repeated, [np.repeat(end, number + 1, axis=0) for end in ends], samples)
        shape = (count, number + 1)
        proved: Bools = np.zeros(count, np.bool_)
        for along, tip, axis in (
            (samples, look.tip_beside, look.axis_beside),
            (look.along, look.tip, look.axis),
        ):
            # any way of pairing the two motions will do: this one is even between the samples
            step = np.diff(along.reshape(shape), axis=1)
            between = bends.axis / number**2 + bends.ruled * (step**2).max(axis=1)
            fits = tip.reshape(shape).max(axis=1) + bends.tip / number**2 <= 1
            proved |= fits & (axis.reshape(shape).max(axis=1) + between <= 1)
        return proved

    def _bends(self, part: Intervals) -> _Bends:
        """Bounds on how far each interval leaves its chords, over its tolerances."""
        turn = np.radians(part.turn)
        tolerance = np.radians(self.tolerance)
        start, end = (self._lever(part.segment, fraction) for fraction in (part.start, part.end))
        if self.tip_tolerance is None:
            tip = np.zeros(len(turn))
        else:
            _, _, from_, to = self._ends(part)
            tip = tip_bend(self.machine, from_, to, turn) / (8 * self.tip_tolerance)
        return _Bends(
            axis_bend(self.machine, turn, unit(start), unit(end), tolerance) / (8 * tolerance),
            ruled_bend(start, end) / (8 * tolerance),
            tip,
        )

    def _lever(self, segment: Ints, fraction: Floats) -> Floats:
        """Axis of the ruled motion, not of unit length."""
        share = fraction[:, None]
        lever: Floats = self.axis[segment] * (1 - share) + self.axis[segment + 1] * share
        return lever

    def _ends(self, part: Intervals) -> list[Floats]:
        """Tip and linear words at both ends of each interval: four times (p, 3), mm; nothing where the tip is kept."""
        if self.tip_tolerance is None:
            return []
        start, _ = ruled(self.tip, self.axis, part.segment, part.start)
        end, _ = ruled(self.tip, self.axis, part.segment, part.end)
        return [
            start,
            end,
            machine_position(self.machine, start, part.start_angles),
            machine_position(self.machine, end, part.end_angles),
        ]

    def _look(self, part: Intervals, ends: list[Floats], fraction: Floats) -> _Look:
        """Errors at one share of each interval."""
        share = fraction[:, None]
        words = part.start_angles * (1 - share) + part.end_angles * share
        axis = tool_axis(self.machine, words)
        _, wanted = ruled(self.tip, self.axis, part.segment, part.start * (1 - fraction) + part.end * fraction)
        beside = angle_between(axis, wanted) / self.tolerance
        if self.tip_tolerance is None:
            still = np.zeros(len(fraction))
            along = self._swept(part, axis, fraction)
            _, wanted = ruled(self.tip, self.axis, part.segment, part.start + along * (part.end - part.start))
            return _Look(still, angle_between(axis, wanted) / self.tolerance, along, still, beside)
        start, end, from_, to = ends
        real = tip_position(self.machine, from_ * (1 - share) + to * share, words)
        way = end - start
        square = dot(way, way)
        along = dot(real - start, way) / np.where(square > 0, square, 1.0)
        along = np.where(square > 0, np.clip(along, 0, 1), self._swept(part, axis, fraction))
        _, wanted = ruled(self.tip, self.axis, part.segment, part.start + along * (part.end - part.start))
        return _Look(
            tip=np.linalg.norm(real - start - along[:, None] * way, axis=1) / self.tip_tolerance,
            axis=angle_between(axis, wanted) / self.tolerance,
            along=along,
            tip_beside=np.linalg.norm(real - start - share * way, axis=1) / self.tip_tolerance,
            axis_beside=beside,
        )

    def _swept(self, part: Intervals, axis: Floats, fraction: Floats) -> Floats:
        """Share of each interval where the ruled axis is nearest to another, where the tip stands: else `fraction`.

        About a standing tip nothing says when the axis is where: all that counts is the great circle that it sweeps.
        """
        still = np.flatnonzero((self.tip[part.segment] == self.tip[part.segment + 1]).all(axis=1))
        along = fraction.copy()
        if len(still):
            some = part.take(still)
            start, end = self._lever(some.segment, some.start), self._lever(some.segment, some.end)
            normal = np.cross(start, end)
            gone, left = (dot(np.cross(*pair), normal) for pair in ((start, axis[still]), (axis[still], end)))
            whole = gone + left
            swept = np.divide(gone, whole, out=fraction[still].copy(), where=whole > 0.0)
            along[still] = np.clip(swept, 0.0, 1.0)
        return along

    def divide(self, intervals: Intervals, count: Ints) -> tuple[Intervals, Intervals]:
        """Divide each interval into so many equal parts: the new intervals, and those that start with a new point."""
        owner = np.repeat(np.arange(len(count)), count)
        number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
        share = (number / count[owner])[:, None]
        old = intervals.take(owner)
        start = old.start + (old.end - old.start) * share[:, 0]
        words = old.start_angles * (1 - share) + old.end_angles * share
        branch = old.start_branch.copy()
        new = np.flatnonzero(number > 0)
        # A point between a pose in the cone and one outside is on the branch of the latter.
        at = old.take(new)
        known = np.where(at.start_branch < 0, at.end_branch, at.start_branch)
        known[(at.start_branch >= 0) & (at.end_branch >= 0) & (at.start_branch != at.end_branch)] = -1
        _, axis = ruled(self.tip, self.axis, at.segment, start[new])
        words[new], branch[new] = continued(self.machine, axis, words[new], known, self.tolerance / 2)
        last = number == count[owner] - 1
        end, end_words, end_branch = old.end.copy(), old.end_angles.copy(), old.end_branch.copy()
        end[~last], end_words[~last], end_branch[~last] = start[new], words[new], branch[new]
        divided = Intervals(old.segment, start, end, words, end_words, branch, end_branch)
        return divided, divided.take(new)
