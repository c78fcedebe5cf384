"""What checks find in a batch: largest values and where, places where a promise is broken, problems, poses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Problem

#: neighbouring violations no farther apart on the original than this many segments are one problem
_SAME_PROBLEM: Final = 3.0

#: code of an axis that is beyond its own tolerance
AXIS_OFF: Final = "CS527"

#: what a violation of each code is called; its amount in mm, that of the tool axis in degrees
_TEXT = {
    "CS521": "the tip leaves its path by {:.6f} mm",
    "CS522": "the axis point leaves its path by {:.6f} mm",
    "CS523": "the path is not run in order within the tolerance",
    "CS525": "tip and axis point are {:.6f} mm from any common pose",
    "CS527": "the tool axis is off by {:.6f} deg where the tip is nearest within its tolerance",
    "CS524": "a pose that must be passed exactly is missed by {:.6f} mm",
}


@dataclass(frozen=True)
class Where:
    """A largest value and where it was met."""

    value: float
    #: from 1; 0 where there is none
    cl_line: int = 0
    nc_line: int = 0


#: largest values, by their fields of `Verification`, before anything is met: the orientation in rad, of jumps of the
#: tangent minus the cosine, of the shortest block minus its length
_NOTHING: Final = {
    **dict.fromkeys(("tip", "axis_point", "together_tip", "together_axis_point", "orientation"), Where(0.0)),
    "tangent_jump": Where(-1.0),
    "shortest": Where(-np.inf),
}


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

    worst: dict[str, Where] = field(default_factory=_NOTHING.copy)  #: largest values: at least what it started from
    violations: list[Violation] = field(default_factory=list)
    breaks: list[int] = field(default_factory=list)  #: NC lines where the motions part
    feeds: Runs = field(default_factory=Runs)  #: of elements with a wrong feed
    #: (5, k) each: poses of the CL program; how far they are from the nearest written pose: tip and axis point, mm, and
    #: axis, rad; NC lines
    poses: list[Floats] = field(default_factory=list)
    unlooked: list[tuple[int, str]] = field(default_factory=list)  #: what was not looked at, and the NC line

    def note(self, name: str, values: Floats, cl_lines: Ints, nc_lines: Ints) -> None:
        """Take the largest of (k,) values, if it is larger than what was met."""
        if len(values):
            k = int(np.argmax(values))
            self.take_worst(name, Where(float(values[k]), int(cl_lines[k]), int(nc_lines[k])))

    def take_worst(self, name: str, where: Where) -> None:
        """Take a value if it is larger than what was met."""
        if where.value > self.worst[name].value:
            self.worst[name] = where

    def take(self, other: Findings) -> None:
        """Take over what is found in the next batch."""
        for name, where in other.worst.items():
            self.take_worst(name, where)
        self.violations += other.violations
        self.breaks += other.breaks
        self.feeds.follow(other.feeds)
        self.poses += other.poses
        self.unlooked += other.unlooked
