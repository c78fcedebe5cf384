"""Points to insert so that axes which move linearly in their words keep the tool on the ruled motion.

In a straight block every axis runs evenly from word to word. With tool centre point control the tip then runs straight,
but the tool axis follows its rotary angles and not the shortest turn, and near the pole the two differ much; without it
the tip leaves its line too.

Which division is enough is for `cornersmooth.rotary.chord_error` to say, and to prove.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import solutions, wrap
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.rotary.axis_findings import limit_error
from cornersmooth.rotary.chord_error import InterpolationError, Intervals, ruled

#: Rounds of division.
ROUNDS = 28


@dataclass(frozen=True)
class Insertions:
    """Points to insert into a path of n poses; m rows in path order.

    Parameters
    ----------
    segment : (m,) int64
        The segment from pose ``segment`` to pose ``segment + 1``.
    fraction : (m,) float64
        Share of the segment behind the point, in (0, 1).
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

    def only(self, rows: Ints) -> FilledPath:
        """The path without its other rows."""
        return FilledPath(self.pose[rows], self.inserted[rows], self.tip[rows], self.axis[rows], self.angles[rows])


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
    motion = InterpolationError(machine, tip, axis, tolerance, tip_tolerance, max_step)
    found: list[Intervals] = []
    open_ = _segments(machine, axis, angles, np.flatnonzero(~rapid[1:]), None)
    for number in range(ROUNDS + 1):
        parts = motion.parts(open_)
        open_, parts = open_.take(parts > 1), parts[parts > 1]
        if not len(parts) or number == ROUNDS:
            break
        if not number:
            open_ = _segments(machine, axis, angles, open_.segment, tolerance / 2)
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
    """Path with the points of `more` put in: n + m rows."""
    n = len(tip)
    if not len(more):
        return FilledPath(np.arange(n), np.zeros(n, np.bool_), tip, axis, angles)
    pose = np.concatenate((np.arange(n), more.segment + 1))
    position = np.concatenate((np.arange(n, dtype=np.float64), more.segment + more.fraction))
    inserted = np.arange(len(pose)) >= n
    order = np.argsort(position, kind="stable")
    new_tip, new_axis = ruled(tip, axis, more.segment, more.fraction)
    return FilledPath(
        pose[order],
        inserted[order],
        np.concatenate((tip, new_tip))[order],
        np.concatenate((axis, new_axis))[order],
        np.concatenate((angles, more.angles))[order],
    )


def _segments(machine: Machine, axis: Floats, angles: Floats, segment: Ints, cone: float | None) -> Intervals:
    """Whole segments, with the branches that the angles at both ends are on: -1 in the cone, or if there is none."""
    count = len(segment)
    branch = np.full((2, count), -1)
    if cone is not None:
        for side, pose in enumerate((segment, segment + 1)):
            found = solutions(machine, axis[pose])
            off = np.abs(wrap(found.angles - angles[pose, None, :])).sum(axis=2)
            branch[side] = np.where(found.pole_distance <= cone, -1, np.argmin(off, axis=1))
    return Intervals(
        segment=segment,
        start=np.zeros(count),
        end=np.ones(count),
        start_angles=angles[segment],
        end_angles=angles[segment + 1],
        start_branch=branch[0],
        end_branch=branch[1],
    )
