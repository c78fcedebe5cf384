"""Points to insert so that axes which move linearly in their words keep the tool on the ruled motion.

In a straight block every axis runs evenly from word to word. With tool centre point control the tip then runs straight,
but the tool axis follows its rotary angles and not the shortest turn, and near the pole the two differ much; without it
the tip leaves its line too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.kinematics.findings import limit_error
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.orientation import angle_between, continued, solutions, tool_axis, wrap
from cornersmooth.kinematics.position import machine_position, tip_position
from cornersmooth.model import Bools, Floats, Ints

#: A segment is looked at in these places; its error vanishes in all of them only if it is none.
PLACES = (0.25, 0.5, 0.75)
#: Rounds of division, and the most parts that a segment is divided into in one of them.
ROUNDS, PARTS = 24, 64
#: A smooth motion errs ¾ of its largest error at a quarter of its way; one as near to that, and without a large turn
#: (degrees), is divided at once into as many parts as the square law of its error says for AIM of the tolerance. All
#: others are halved.
SMOOTH, SMOOTH_TURN, AIM = 0.1, 30.0, 0.95
#: The largest error lies beside the places looked at: what is found there is held to this share of the tolerance.
SMOOTH_SHARE, ROUGH_SHARE = 0.98, 0.8


@dataclass(frozen=True)
class Insertions:
    """Points to insert into a path of n poses; m rows in path order.

    Parameters
    ----------
    segment : (m,) int64
        The segment from pose ``segment`` to pose ``segment + 1``.
    fraction : (m,) float64
        Place on it, in (0, 1).
    angles : (m, 2) float64, degrees
    unsolved : (u,) int64
        Segments that no division brought within the tolerances: the axis jumps there.
    """

    segment: Ints
    fraction: Floats
    angles: Floats
    unsolved: Ints

    def __len__(self) -> int:
        return len(self.segment)

    def counts(self, n: int) -> Ints:
        """Points to insert into each of the n - 1 segments: (n-1,)."""
        return np.bincount(self.segment, minlength=max(n - 1, 0)).astype(np.int64)


@dataclass(frozen=True)
class FilledPath:
    """A path with its inserted points.

    Parameters
    ----------
    pose : (m,) int64
        The pose of the original path that each row is, or that it leads to.
    inserted : (m,) bool
    tip, axis : (m, 3) float64
        Exact points of the ruled motion.
    angles : (m, 2) float64, degrees
    """

    pose: Ints
    inserted: Bools
    tip: Floats
    axis: Floats
    angles: Floats


def insertions(
    machine: Machine,
    tip: Floats,
    axis: Floats,
    angles: Floats,
    *,
    tolerance: float,
    rapid: Bools | None = None,
    tip_tolerance: float | None = None,
    max_step: float | None = None,
    line: Ints | None = None,
    file: str | None = None,
) -> Insertions:
    """Points that a path needs so that straight blocks between its rotary words stay on the ruled motion.

    Parameters
    ----------
    tip, axis : (n, 3) float64, mm and unit vectors
    angles : (n, 2) float64, degrees
        From `rotary_angles` with the same tolerance.
    tolerance : float, degrees
        Bound on the angle between the tool axis and that of the ruled motion.
    rapid : (n,) bool
        Moves that need no points.
    tip_tolerance : float or None, mm
        Bound on the distance of the tip from its line, for a control without tool centre point control: all five axes
        run linearly. None where the control keeps the tip on its line.
    max_step : float or None, degrees
        Largest turn of a rotary axis in one block.
    line, file : (n,) int64 and str, optional
        For messages.

    Raises
    ------
    InputError
        A rotary axis would leave its limits on the way between two poses within them (CS362).
    """
    rapid = np.zeros(len(axis), np.bool_) if rapid is None else rapid
    branch = _branches(machine, axis, angles, tolerance / 2)
    segment = np.flatnonzero(~rapid[1:])
    open_ = _Intervals(
        segment=segment,
        start=np.zeros(len(segment)),
        end=np.ones(len(segment)),
        start_angles=angles[segment],
        end_angles=angles[segment + 1],
        start_branch=branch[segment],
        end_branch=branch[segment + 1],
    )
    found: list[_Intervals] = []
    motion = _Motion(machine, tip, axis, tolerance, tip_tolerance, max_step)
    for _ in range(ROUNDS):
        parts = motion.parts(open_)
        open_, parts = open_.take(parts > 1), parts[parts > 1]
        if not len(parts):
            break
        open_, inserted = motion.divide(open_, parts)
        found.append(inserted)
    segment = np.concatenate([part.segment for part in found] or [np.zeros(0, np.int64)])
    fraction = np.concatenate([part.start for part in found] or [np.zeros(0)])
    inner = np.concatenate([part.start_angles for part in found] or [np.zeros((0, 2))])
    order = np.lexsort((fraction, segment))
    segment, fraction, inner = segment[order], fraction[order], inner[order]
    limits = machine.limits
    inside = np.clip(inner, limits[:, 0], limits[:, 1])
    # At the pole the second axis may stop at its limit; anywhere else the way itself is outside.
    outside = np.abs(inner - inside).max(axis=1, initial=0.0) > tolerance / 2
    if outside.any():
        first = int(np.argmax(outside))
        here = slice(first, first + 1)
        both = solutions(machine, ruled(tip, axis, segment[here], fraction[here])[1]).angles[0]
        number = 0 if line is None else int(line[segment[first] + 1])
        raise limit_error(machine, both, limits, inner[first], number, 0, file)
    return Insertions(segment, fraction, inside, np.unique(open_.segment))


def fill(tip: Floats, axis: Floats, angles: Floats, more: Insertions) -> FilledPath:
    """Path with the points of `more` at their places: n + m rows."""
    n = len(tip)
    pose = np.concatenate((np.arange(n), more.segment + 1))
    place = np.concatenate((np.arange(n, dtype=np.float64), more.segment + more.fraction))
    inserted = np.arange(len(pose)) >= n
    order = np.argsort(place, kind="stable")
    new_tip, new_axis = ruled(tip, axis, more.segment, more.fraction)
    return FilledPath(
        pose[order],
        inserted[order],
        np.concatenate((tip, new_tip))[order],
        np.concatenate((axis, new_axis))[order],
        np.concatenate((angles, more.angles))[order],
    )


def ruled(tip: Floats, axis: Floats, segment: Ints, fraction: Floats) -> tuple[Floats, Floats]:
    """Tip and unit axis of the ruled motion at places on segments: both ends of the axis run linearly."""
    share = fraction[:, None]
    direction = axis[segment] * (1 - share) + axis[segment + 1] * share
    length = np.linalg.norm(direction, axis=1, keepdims=True)
    direction = np.where(length > 0, direction / np.where(length > 0, length, 1.0), axis[segment])
    return tip[segment] * (1 - share) + tip[segment + 1] * share, direction


@dataclass(frozen=True)
class _Intervals:
    """Parts of segments: their places and what stands at both ends."""

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

    def take(self, which: Bools | Ints) -> _Intervals:
        return _Intervals(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class _Motion:
    """The path, and how exactly it is to be followed."""

    machine: Machine
    tip: Floats
    axis: Floats
    tolerance: float
    tip_tolerance: float | None
    max_step: float | None

    def parts(self, intervals: _Intervals) -> Ints:
        """Into how many parts each interval is to be divided: 1 where it is good as it is."""
        turn = intervals.turn
        parts = np.ones(len(turn), np.int64)
        if self.max_step is not None:
            parts += np.ceil(turn.max(axis=1, initial=0.0) / self.max_step - 1).clip(0).astype(np.int64)
        check = np.arange(len(turn))
        if self.tip_tolerance is None:
            # Path on the sphere and great circle both leave their chord by less than (turn)²/8.
            check = np.flatnonzero(np.radians(turn.sum(axis=1)) ** 2 / 4 > np.radians(self.tolerance))
        checked = intervals.take(check)
        ends = None if self.tip_tolerance is None else self._ends(checked)
        excess = np.stack([self._excess_at(checked, place, ends) for place in PLACES])
        worst = excess.max(axis=0, initial=0.0)
        smooth = (np.abs(excess[[0, 2]] - 0.75 * excess[1]) <= SMOOTH * excess[1]).all(axis=0)
        smooth &= checked.turn.sum(axis=1) <= SMOOTH_TURN
        worst /= np.where(smooth, SMOOTH_SHARE, ROUGH_SHARE)
        count = np.where(smooth, np.ceil(np.sqrt(worst / AIM)), 2).astype(np.int64)
        parts[check] = np.where(worst > 1, np.maximum(count, 2), parts[check])
        return np.minimum(parts, PARTS)

    def _ends(self, part: _Intervals) -> tuple[Floats, Floats, Floats, Floats]:
        """Tip and linear words at both ends of each interval: four times (p, 3), mm."""
        start, _ = ruled(self.tip, self.axis, part.segment, part.start)
        end, _ = ruled(self.tip, self.axis, part.segment, part.end)
        words = (
            machine_position(self.machine, start, part.start_angles),
            machine_position(self.machine, end, part.end_angles),
        )
        return start, end, *words

    def _excess_at(self, part: _Intervals, place: float, ends: tuple[Floats, Floats, Floats, Floats] | None) -> Floats:
        """Error at one place of each interval over its tolerance: (p,)."""
        words = part.start_angles * (1 - place) + part.end_angles * place
        fraction = part.start * (1 - place) + part.end * place
        off: Floats = np.zeros(len(fraction))
        if ends is not None and self.tip_tolerance is not None:
            start, end, from_, to = ends
            real = tip_position(self.machine, from_ * (1 - place) + to * place, words)
            way = end - start
            square = np.einsum("ij,ij->i", way, way)
            along = np.einsum("ij,ij->i", real - start, way) / np.where(square > 0, square, 1.0)
            along = np.where(square > 0, np.clip(along, 0, 1), place)
            off = np.linalg.norm(real - start - along[:, None] * way, axis=1) / self.tip_tolerance
            fraction = part.start + along * (part.end - part.start)
        _, wanted = ruled(self.tip, self.axis, part.segment, fraction)
        return np.maximum(off, angle_between(tool_axis(self.machine, words), wanted) / self.tolerance)

    def divide(self, intervals: _Intervals, count: Ints) -> tuple[_Intervals, _Intervals]:
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
        divided = _Intervals(old.segment, start, end, words, end_words, branch, end_branch)
        return divided, divided.take(new)


def _branches(machine: Machine, axis: Floats, angles: Floats, cone: float) -> Ints:
    """Branch that the angles of each pose are on, -1 in the cone of the pole."""
    found = solutions(machine, axis)
    off = np.abs(wrap(found.angles - angles[:, None, :])).sum(axis=2)
    return np.where(found.pole_distance <= cone, -1, np.argmin(off, axis=1)).astype(np.int64)
