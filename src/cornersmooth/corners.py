"""What smoothing makes of a program: its corners, what became of each, and the curves of whole runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Flag, IntEnum, auto
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import Bools, Floats, Ints

if TYPE_CHECKING:
    from cornersmooth.errors import Finding
    from cornersmooth.model import Program
    from cornersmooth.settings import Settings


class Trait(Flag):
    """What follows from a status."""

    NOTHING = 0
    ROUNDED = auto()  #: a curve is in its place
    NO_CORNER = auto()  #: the path goes straight on, or repeats a pose
    PASSED_BY = auto()  #: long lines may pass by it; all others are passed exactly
    ENDS_RUN = auto()  #: no curve of a whole run goes through it


class Status(IntEnum):
    """What became of a corner (`Corners.status`): an entry holds all that the rest of the program has to know of it."""

    traits: Trait

    def __new__(cls, code: int, traits: Trait = Trait.NOTHING) -> Status:
        """Member with its code and what follows from it."""
        member = int.__new__(cls, code)
        member._value_, member.traits = code, traits
        return member

    SMOOTHED = 0, Trait.ROUNDED | Trait.PASSED_BY
    #: turns by less than the output can show
    STRAIGHT = 1, Trait.NO_CORNER | Trait.PASSED_BY
    #: turns by more than `Settings.reversal_angle`
    REVERSAL = 2, Trait.ENDS_RUN
    #: the axis turns by more than `Settings.max_axis_step` on one side
    AXIS_STEP = 3, Trait.ENDS_RUN
    #: the feed changes here and the output form cannot change it inside a curve
    FEED_CHANGE = 4, Trait.ENDS_RUN
    #: `Program.keep` asks for the pose itself
    KEPT = 5, Trait.ENDS_RUN
    #: repeats the pose before it
    DUPLICATE = 6, Trait.NO_CORNER | Trait.PASSED_BY
    #: no room for a transition, or less than the output can show
    TOO_SHORT = 7, Trait.PASSED_BY
    #: the output form has no curves at a feed per revolution
    FEED_PER_REVOLUTION = 8, Trait.ENDS_RUN
    #: rounded together with its neighbours, by the curves of `SmoothProgram.runs`
    IN_RUN = 9, Trait.ROUNDED
    #: the method's own construction would leave the path by more than it promises
    STRAYS = 10
    #: a statement acts here (`ACTING_WORDS`)
    STATEMENT = 11, Trait.ENDS_RUN
    #: an arc meets a line or another arc here; no row of `Corners`
    ARC = 12
    #: a rapid that leads nowhere is between two cuts; no row of `Corners`
    RAPID = 13

    @property
    def key(self) -> str:
        """Its name in reports; on the screen blanks stand for the underscores."""
        return self.name.lower()

    @classmethod
    def having(cls, trait: Trait) -> tuple[Status, ...]:
        """All with a trait."""
        return tuple(status for status in cls if trait & status.traits)


class LimitedBy(IntEnum):
    """What set the length of a transition (`Corners.limited_by`)."""

    NOTHING = 0  #: not smoothed
    TOLERANCE = 1
    SEGMENT = 2

    @property
    def key(self) -> str:
        """Its name in reports; empty for nothing."""
        return self.name.lower() if self else ""


@dataclass(frozen=True)
class Corners:
    """One row for every inner pose of every chain, k rows in path order.

    The five control points of a smoothed row follow from it (`cornersmooth.geometry.nurbs.control_points`): with X
    the pose, D⁻ and D⁺ the segments to its neighbours `before` and `after`, the tip curve P has
    ``X − trim_in·D⁻, X − ⅔·trim_in·D⁻, X, X + ⅔·trim_out·D⁺, X + trim_out·D⁺``, and the axis-point curve Q the
    same with the axis points and `axis_trim_*`.
    """

    #: (k,): The corner's pose and the distinct poses next to it.
    pose: Ints
    before: Ints
    after: Ints
    status: NDArray[np.uint8]  #: (k,): `Status`
    limited_by: NDArray[np.uint8]  #: (k,): `LimitedBy`
    #: (k,): Fraction of the tip segment taken by the transition before and after the corner; 0 where not smoothed.
    trim_in: Floats
    trim_out: Floats
    #: (k,): The same for the axis-point segments; the same numbers where one parameter drives both curves.
    axis_trim_in: Floats
    axis_trim_out: Floats
    #: (k,), mm: Largest distance between both motions at a common parameter: at the tip, and at b = tip + H·axis. The
    #: paths themselves are at least as near (`report.tables.path_distances`). With an axis tolerance the latter is
    #: what the axis turns, at `Settings.axis_scale` from the tip.
    tip_error: Floats
    axis_error: Floats
    #: (k,), rad: Largest angle between the axis on the transition and on the original motion at the common parameter.
    orientation_error: Floats
    #: What only the method knows of its transitions, NaN where not smoothed; the method's module says what it is.
    extra: Mapping[str, Floats] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.pose)

    @property
    def smoothed(self) -> Bools:
        """(k,) bool: rows with a transition of their own."""
        return self.status == Status.SMOOTHED

    @property
    def rounded(self) -> Bools:
        """(k,) bool: smoothed rows, and those that the curve of a run rounds."""
        return np.isin(self.status, Status.having(Trait.ROUNDED))


@dataclass(frozen=True)
class Runs:
    """Pairs of cubic B-splines, tip and axis point, that each replace a whole run of segments: r runs in path order.

    Poses and knots stand at whole steps of the parameter s, which is the six-dimensional length (docs/method.md)
    but for the rounding to `step`. Knots of a run start at 0; the first and the last stand four-fold in its knot
    vector, so a run with m + 1 knots has m + 3 control points.
    """

    pose: Ints  #: (n,): The distinct poses of all runs, first and last of each included; those two are passed exactly
    count: Ints  #: (r,): Poses of each run
    s: Floats  #: (n,), steps
    step: float  #: mm
    knot: Floats  #: (k,), steps: Distinct knots of all runs
    knot_count: Ints  #: (r,)
    control: Floats  #: (c, 6), mm
    #: (r,), mm: Proven bounds of the deviation at common parameters: of the tip, and of b = tip + H·axis.
    tip_bound: Floats
    axis_bound: Floats

    def __len__(self) -> int:
        return len(self.count)


@dataclass(frozen=True)
class SmoothProgram:
    """A program with its rounded corners: what writers, report and feedrate planning work from."""

    program: Program  #: The original motion
    corners: Corners
    settings: Settings  #: What it was made with
    findings: tuple[Finding, ...] = ()  #: Those of the reader and those of the smoothing
    runs: Runs | None = None  #: Curves of whole runs; their corners have the status `Status.IN_RUN`
