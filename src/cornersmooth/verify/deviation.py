"""Measures the deviation of a whole text and keeps what a user wants to know: how much, and where."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from cornersmooth.model import Bools, Floats, Ints, Keep
from cornersmooth.verify.blocks import Block, Matcher
from cornersmooth.verify.farther import passed_nearby
from cornersmooth.verify.gaps import (
    Reached,
    from_original,
    from_written,
    own_gaps_of_original,
    own_gaps_of_written,
)
from cornersmooth.verify.hulls import hull_gaps
from cornersmooth.verify.ncprogram import Problem
from cornersmooth.verify.order import original_backwards, written_backwards
from cornersmooth.verify.stops import ARITHMETIC, digit_errors
from cornersmooth.verify.trails import Original

#: rows of a block for which tip and axis point are looked at each on its own: at a time, and at most
_OWN_ROWS, _MOST_OWN_ROWS = 64, 2048

#: neighbouring violations no farther apart on the original than this many segments are one problem
_SAME_PROBLEM = 3.0

#: how many tolerances tip and axis point may be away from one common pose, though each is near its own path
TOGETHER = 2.0


@dataclass
class Worst:
    """Largest value met, and where: CL line and NC line."""

    value: float = 0.0
    cl_line: int = 0
    nc_line: int = 0

    def update(self, values: Floats, cl_line: Ints, nc_line: Ints) -> None:
        """Take the largest of (k,) values, if it is larger than what was met."""
        if len(values):
            k = int(np.argmax(values))
            if values[k] > self.value:
                self.value, self.cl_line, self.nc_line = float(values[k]), int(cl_line[k]), int(nc_line[k])


@dataclass
class Violations:
    """Places where a promise is broken, in columns."""

    place: list[Floats] = field(default_factory=list)
    cl_line: list[Ints] = field(default_factory=list)
    nc_line: list[Ints] = field(default_factory=list)
    amount: list[Floats] = field(default_factory=list)
    code: list[Ints] = field(default_factory=list)

    def add(self, code: int, place: Floats, cl_line: Ints, nc_line: Ints, amount: Floats) -> None:
        """Add k places."""
        self.place.append(place)
        self.cl_line.append(cl_line)
        self.nc_line.append(nc_line)
        self.amount.append(amount)
        self.code.append(np.full(len(place), code))

    def extend(self, other: Violations) -> None:
        """Add the places of another."""
        for name, columns in vars(other).items():
            getattr(self, name).extend(columns)

    def problems(self) -> list[Problem]:
        """One problem for each group of neighbouring places with the same code, at its worst place."""
        if not self.place:
            return []
        place, code = np.concatenate(self.place), np.concatenate(self.code)
        cl_line, nc_line = np.concatenate(self.cl_line), np.concatenate(self.nc_line)
        amount = np.concatenate(self.amount)
        order = np.lexsort((place, code))
        place, code, amount = place[order], code[order], amount[order]
        cl_line, nc_line = cl_line[order], nc_line[order]
        new = np.append(True, (np.diff(place) > _SAME_PROBLEM) | (np.diff(code) != 0))
        found = []
        for rows in np.split(np.arange(len(place)), np.flatnonzero(new)[1:]):
            k = int(rows[np.argmax(amount[rows])])
            value = float(amount[k])
            found.append(
                Problem(f"CS{code[k]}", int(cl_line[k]), int(nc_line[k]), _TEXT[int(code[k])].format(value), value)
            )
        return found


class Peaks:
    """Largest values of several kinds: every field is a `Worst`."""

    def take(self, other: Self) -> None:
        """Take over what is larger elsewhere."""
        for name, worst in vars(other).items():
            if worst.value > getattr(self, name).value:
                setattr(self, name, worst)


@dataclass
class Largest(Peaks):
    """Largest deviations.

    Parameters
    ----------
    tip, axis_point : Worst, mm
        Distance of the two tip paths, and of the two axis-point paths, in order along the path.
    together_tip, together_axis_point : Worst, mm
        The same at one common pose of the tool line.
    orientation : Worst, rad
        At the common pose.
    """

    tip: Worst = field(default_factory=Worst)
    axis_point: Worst = field(default_factory=Worst)
    together_tip: Worst = field(default_factory=Worst)
    together_axis_point: Worst = field(default_factory=Worst)
    orientation: Worst = field(default_factory=Worst)

    def copy(self) -> Largest:
        """Return the same values, to go on from."""
        return Largest(*(replace(worst) for worst in vars(self).values()))


@dataclass
class Measured:
    """What one block shows.

    Parameters
    ----------
    largest : Largest
        At least what it started from.
    violations : Violations
    off : (v,) float64, mm
        Distance of every written vertex from the original.
    poses : Poses
    """

    largest: Largest
    violations: Violations
    off: Floats
    poses: Poses


@dataclass(frozen=True)
class Poses:
    """Distances of original poses from the nearest written pose.

    Parameters
    ----------
    pose : (k,) int64
        Poses of the CL program, and for each of them:
    tip, axis_point : (k,) float64, mm
    angle : (k,) float64, rad
    nc_line : (k,) int64
    """

    pose: Ints
    tip: Floats
    axis_point: Floats
    angle: Floats
    nc_line: Ints

    @classmethod
    def of_all(cls, parts: list[Poses], count: int) -> Poses:
        """Put the poses of all parts in their places among `count`; NaN where the tool does not pass at feed."""
        nan = np.full(count, np.nan)
        whole = cls(np.arange(count), nan, nan.copy(), nan.copy(), np.zeros(count, np.int64))
        for part in parts:
            for name in ("tip", "axis_point", "angle", "nc_line"):
                getattr(whole, name)[part.pose] = getattr(part, name)
        return whole


class Meter:
    """Measures blocks.

    Parameters
    ----------
    matcher : Matcher
    exact : (m,) bool
        Whether the end of every original move must be passed exactly (`exact_poses`).
    """

    def __init__(self, matcher: Matcher, exact: Bools) -> None:
        self.matcher, self.exact = matcher, exact
        self.limit = matcher.tolerance + ARITHMETIC
        self.together = TOGETHER * matcher.tolerance + matcher.margin

    def measure(self, block: Block, so_far: Largest) -> Measured:
        """Measure one block; what is not larger than what was met so far is not looked at closely."""
        largest, violations = so_far.copy(), Violations()
        matcher = self.matcher
        written = from_written(matcher, block)
        theirs = from_original(matcher, block)
        original = matcher.original
        rows = np.minimum(written.place.astype(np.int64) + 1, len(original.trail) - 1)
        cl_line = original.program.line[original.pose[original.trail.owner[rows]]]
        nc_line = matcher.nc.line[block.written.trail.owner[written.vertex]]
        part = _Part(self, block, largest, violations)
        part.take(written, cl_line, nc_line, written.place, mine=True)
        part.take_hulls()

        pose = original.pose[original.trail.owner[theirs.vertex]]
        cl_line = original.program.line[pose]
        segment = np.minimum(theirs.place.astype(np.int64) + 1, len(block.six) - 1)
        nc_line = matcher.nc.line[block.written.trail.owner[segment]]
        part.take(theirs, cl_line, nc_line, theirs.vertex.astype(np.float64), mine=False)
        whole = original.trail.fraction[theirs.vertex] == 1
        part.check_exact(theirs, whole)
        for found in (written_backwards(matcher, block, written), original_backwards(matcher, block, theirs)):
            if found is not None:
                violations.add(523, *found)
        off = np.zeros(len(block.six))
        off[written.vertex] = written.gap.larger
        gap = theirs.gap
        poses = Poses(pose[whole], gap.tip[whole], gap.axis_point[whole], gap.angle[whole], nc_line[whole])
        return Measured(largest, violations, off, poses)


@dataclass(frozen=True)
class _Part:
    """One block being measured."""

    meter: Meter
    block: Block
    largest: Largest
    violations: Violations

    def take(self, reached: Reached, cl_line: Ints, nc_line: Ints, place: Floats, *, mine: bool) -> None:
        """Take what the vertices of one of the two motions found."""
        result, gap, limit = self.largest, reached.gap, self.meter.limit
        result.together_tip.update(gap.tip, cl_line, nc_line)
        result.together_axis_point.update(gap.axis_point, cl_line, nc_line)
        result.orientation.update(gap.angle, cl_line, nc_line)
        own_gaps = own_gaps_of_written if mine else own_gaps_of_original
        known = np.zeros(len(gap.tip), np.bool_)
        tip, axis = gap.tip.copy(), gap.axis_point.copy()

        def look(rows: Ints) -> None:
            tip[rows], axis[rows] = own_gaps(self.meter.matcher, self.block, reached, rows)
            known[rows] = True

        over = np.flatnonzero(gap.larger > limit)
        if len(over):
            look(over[np.argsort(-gap.larger[over])[:_MOST_OWN_ROWS]])
        for values, worst in ((tip, result.tip), (axis, result.axis_point)):
            looked = 0
            while looked < _MOST_OWN_ROWS:
                best = max(worst.value, float(values[known].max(initial=0.0)))
                rows = np.flatnonzero(~known & (values > best))
                if not len(rows):
                    break
                if len(rows) > _OWN_ROWS:
                    rows = rows[np.argpartition(-values[rows], _OWN_ROWS)[:_OWN_ROWS]]
                look(rows)
                looked += len(rows)
            rows = np.flatnonzero(known)
            worst.update(values[rows], cl_line[rows], nc_line[rows])
        over = over[known[over]]
        apart = over[(gap.larger[over] > self.meter.together) & (np.maximum(tip, axis)[over] <= limit)]
        if len(apart):
            self.violations.add(525, place[apart], cl_line[apart], nc_line[apart], gap.larger[apart])
        for code, values in ((521, tip), (522, axis)):
            broken = over[values[over] > limit]
            if len(broken):
                self.violations.add(code, place[broken], cl_line[broken], nc_line[broken], values[broken])

    def take_hulls(self) -> None:
        """Deviations of curves between their knots, where they may be larger than at the knots."""
        matcher, limit = self.meter.matcher, self.meter.limit
        found = hull_gaps(matcher, self.block, limit)
        if found is None:
            return
        place, element, tip, axis = found
        original = matcher.original
        rows = np.minimum(place.astype(np.int64) + 1, len(original.trail) - 1)
        cl_line = original.program.line[original.pose[original.trail.owner[rows]]]
        nc_line = matcher.nc.line[element]
        for code, values, worst in ((521, tip, self.largest.tip), (522, axis, self.largest.axis_point)):
            worst.update(values, cl_line, nc_line)
            broken = np.flatnonzero(values > limit)
            if len(broken):
                self.violations.add(code, place[broken], cl_line[broken], nc_line[broken], values[broken])

    def check_exact(self, theirs: Reached, whole: Bools) -> None:
        """Poses that may not be rounded must be ends of elements, to the printed digits."""
        matcher, block = self.meter.matcher, self.block
        original = matcher.original
        rows = np.flatnonzero(whole)
        move = original.trail.owner[theirs.vertex[rows]]
        rows = rows[self.meter.exact[move]]
        if not len(rows):
            return
        move = original.trail.owner[theirs.vertex[rows]]
        pose = original.pose[move]
        tip, axis = original.program.tip[pose], original.program.axis[pose]
        trail, first = block.written.trail, block.written.first
        owner = trail.owner[np.minimum(theirs.place[rows].astype(np.int64) + 1, len(trail) - 1)]
        exact = np.zeros(len(rows), np.bool_)
        amount, nearest = np.full(len(rows), np.inf), owner
        for step in range(-2, 2):
            element = np.clip(owner + step, first, first + len(trail.last) - 1)
            same, off = digit_errors(matcher.nc, element, tip, axis, matcher.axis_length)
            exact |= same
            nearest = np.where(off < amount, element, nearest)
            amount = np.minimum(amount, off)
        missed = np.flatnonzero(~exact)
        exact[missed] = passed_nearby(matcher, block, theirs.vertex[rows[missed]], tip[missed], axis[missed])
        missed = np.flatnonzero(~exact)
        if len(missed):
            self.violations.add(
                524,
                theirs.vertex[rows[missed]].astype(np.float64),
                original.program.line[pose[missed]],
                matcher.nc.line[nearest[missed]],
                amount[missed],
            )


def exact_poses(original: Original) -> Bools:
    """(m,) whether the end of every original move must be passed exactly: all but the inner poses of chains."""
    program = original.program
    exact = np.ones(len(program), np.bool_)
    chains = program.chains
    if len(chains):
        steps = np.zeros(len(program) + 1, np.int64)
        np.add.at(steps, chains[:, 0] + 1, 1)
        np.add.at(steps, chains[:, 1], -1)
        exact = np.cumsum(steps[:-1]) == 0
    exact |= program.keep != Keep.NO
    chosen: Bools = exact[original.pose]
    return chosen


#: what a violation of each code is said to be; its amount in mm
_TEXT = {
    521: "the tip leaves its path by {:.6f} mm",
    522: "the axis point leaves its path by {:.6f} mm",
    523: "the path is not run in order: {:.6f} mm backwards",
    525: "tip and axis point are {:.6f} mm from any common pose",
    524: "a pose that must be passed exactly is missed by {:.6f} mm",
}
