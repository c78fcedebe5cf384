"""What checks find in a batch: largest values and where, places where a promise is broken, problems, poses."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final, Self

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Problem

#: neighbouring violations no farther apart on the original than this many segments are one problem
_SAME_PROBLEM: Final = 3.0

#: number of the code of an axis that is beyond its own tolerance
AXIS_OFF: Final = 527

#: what a violation of each code is said to be; its amount in mm, that of the tool axis in degrees
_TEXT = {
    "CS521": "the tip leaves its path by {:.6f} mm",
    "CS522": "the axis point leaves its path by {:.6f} mm",
    "CS523": "the path is not run in order within the tolerance",
    "CS525": "tip and axis point are {:.6f} mm from any common pose",
    "CS527": "the tool axis is off by {:.6f} deg where the tip is nearest within its tolerance",
    "CS524": "a pose that must be passed exactly is missed by {:.6f} mm",
}


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
        """Add k places, or none."""
        if not len(place):
            return
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
                Problem(name := f"CS{code[k]}", int(cl_line[k]), int(nc_line[k]), _TEXT[name].format(value), value)
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
    """Largest deviations."""

    #: mm: distance of the two tip paths, and of the two axis-point paths, in order along the path
    tip: Worst = field(default_factory=Worst)
    axis_point: Worst = field(default_factory=Worst)
    #: mm: the same at one common pose of the tool line
    together_tip: Worst = field(default_factory=Worst)
    together_axis_point: Worst = field(default_factory=Worst)
    orientation: Worst = field(default_factory=Worst)  #: rad: at the common pose

    def copy(self) -> Largest:
        """Return the same values, to go on from."""
        return Largest(*(replace(worst) for worst in vars(self).values()))


@dataclass
class Continuity(Peaks):
    """Largest jumps of direction (minus the cosine) and curvature, and the shortest element (minus its length)."""

    tangent: Worst = field(default_factory=lambda: Worst(-1.0))
    curvature: Worst = field(default_factory=Worst)
    shortest: Worst = field(default_factory=lambda: Worst(-np.inf))


@dataclass(frozen=True)
class Poses:
    """Distances of original poses from the nearest written pose."""

    pose: Ints  #: (k,): Poses of the CL program, and for each of them:
    tip: Floats  #: (k,) mm
    axis_point: Floats  #: (k,) mm
    angle: Floats  #: (k,) rad
    nc_line: Ints  #: (k,)

    @classmethod
    def nowhere(cls, count: int) -> Poses:
        """All poses of a program, none of them passed: NaN."""
        nan = np.full(count, np.nan)
        return cls(np.arange(count), nan, nan.copy(), nan.copy(), np.zeros(count, np.int64))

    def put(self, part: Poses) -> None:
        """Put the poses of a part in their places among all."""
        for name in ("tip", "axis_point", "angle", "nc_line"):
            getattr(self, name)[part.pose] = getattr(part, name)


@dataclass
class Runs:
    """Problems of runs of elements; a run that goes on in the next batch is one problem.

    Parameters
    ----------
    problems : list of Problem
        One for each run.
    begins, ends : bool
        Whether the first, and the last element that was looked at, belong to a run.
    """

    problems: list[Problem] = field(default_factory=list)
    begins: bool = False
    ends: bool = False

    def follow(self, other: Runs) -> None:
        """Add the runs of the next batch."""
        self.problems += other.problems[int(self.ends and other.begins) :]
        self.ends = other.ends


@dataclass
class Findings:
    """What the checks of a batch find, or those of all batches so far."""

    largest: Largest = field(default_factory=Largest)  #: at least what it started from
    continuity: Continuity = field(default_factory=Continuity)
    violations: Violations = field(default_factory=Violations)
    feeds: Runs = field(default_factory=Runs)  #: of elements with a wrong feed
    poses: list[Poses] = field(default_factory=list)
    unlooked: list[tuple[int, str]] = field(default_factory=list)  #: what was not looked at, and the NC line

    def take(self, other: Findings) -> None:
        """Take over what is found elsewhere."""
        self.largest.take(other.largest)
        self.continuity.take(other.continuity)
        self.violations.extend(other.violations)
        self.feeds.follow(other.feeds)
        self.poses += other.poses
        self.unlooked += other.unlooked
