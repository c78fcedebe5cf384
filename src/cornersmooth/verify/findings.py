"""What checks find in a batch: largest values and where, places where a promise is broken, problems, poses."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Final, NamedTuple, Self

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Problem

#: neighbouring violations no farther apart on the original than this many segments are one problem
_SAME_PROBLEM: Final = 3.0

#: code of an axis that is beyond its own tolerance
AXIS_OFF: Final = "CS527"

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

    def take(self, value: float, cl_line: int, nc_line: int) -> None:
        """Take a value if it is larger than what was met."""
        if value > self.value:
            self.value, self.cl_line, self.nc_line = value, cl_line, nc_line

    def update(self, values: Floats, cl_line: Ints, nc_line: Ints) -> None:
        """Take the largest of (k,) values, if it is larger than what was met."""
        if len(values):
            k = int(np.argmax(values))
            self.take(float(values[k]), int(cl_line[k]), int(nc_line[k]))


class Violation(NamedTuple):
    """Where a promise is broken."""

    code: str
    place: float  #: on the CL path: segment plus fraction
    cl_line: int
    nc_line: int
    amount: float


def problems_of(violations: list[Violation]) -> list[Problem]:
    """One problem for each group of neighbouring places with the same code, at its worst place."""
    groups: list[list[Violation]] = []
    for one in sorted(violations):
        last = groups[-1][-1] if groups else None
        if last is None or one.code != last.code or one.place - last.place > _SAME_PROBLEM:
            groups.append([])
        groups[-1].append(one)
    worst = [max(group, key=lambda one: one.amount) for group in groups]
    return [Problem(one.code, *one[2:4], _TEXT[one.code].format(one.amount), one.amount) for one in worst]


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

    pose: Ints  #: (k,): poses of the CL program; none where the rows are all of them, in order
    tip: Floats  #: (k,) mm
    axis_point: Floats  #: (k,) mm
    angle: Floats  #: (k,) rad
    nc_line: Ints  #: (k,)

    @classmethod
    def nowhere(cls, count: int) -> Poses:
        """All poses of a program, none of them passed: NaN."""
        nan = np.full(count, np.nan)
        return cls(np.zeros(0, np.int64), nan, nan.copy(), nan.copy(), np.zeros(count, np.int64))

    def put(self, part: Poses) -> None:
        """Put the poses of a part in their places among all."""
        for name in ("tip", "axis_point", "angle", "nc_line"):
            getattr(self, name)[part.pose] = getattr(part, name)


@dataclass
class Runs:
    """Problems of runs of elements; a run that goes on in the next batch is one problem."""

    problems: list[Problem] = field(default_factory=list)  #: One for each run
    #: Whether the first, and the last element that was looked at, belong to a run.
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
    violations: list[Violation] = field(default_factory=list)
    feeds: Runs = field(default_factory=Runs)  #: of elements with a wrong feed
    poses: list[Poses] = field(default_factory=list)
    unlooked: list[tuple[int, str]] = field(default_factory=list)  #: what was not looked at, and the NC line

    def take(self, other: Findings) -> None:
        """Take over what is found elsewhere."""
        self.largest.take(other.largest)
        self.continuity.take(other.continuity)
        self.violations += other.violations
        self.feeds.follow(other.feeds)
        self.poses += other.poses
        self.unlooked += other.unlooked
