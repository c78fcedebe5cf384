"""What the written motion is measured against, and the lengths that decide what counts as near."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Self

import numpy as np

from cornersmooth.arrays import some_rows
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Keep, Move, Program
from cornersmooth.nc_reader.elements import Curves, Element, Elements, NcArcs, Problem
from cornersmooth.nc_reader.tool import directions
from cornersmooth.settings import FLIP_ANGLE
from cornersmooth.statements.asked import Asking
from cornersmooth.verify.chain import Path
from cornersmooth.verify.motions import ARITHMETIC, COLUMNS, Metric, Motion, motion_of, side_by_side

#: bend of a segment in tolerances: it is taken off the tolerance where what can be reached is worked out exactly
CL_SHARE: Final = 1.0 / 128.0

#: parts of a CL move at most; what bends more is not proved
_MOST_PARTS: Final = 1 << 13

#: bend of a step of the written motion, in tolerances, and parts of an element, or of a curve between its knots, at
#: first (speed only: steps that are not proved are divided)
WRITTEN_SHARE: Final = 1.0 / 8.0
_WRITTEN_PARTS: Final = 64

#: how many tolerances tip and axis point may be away from one common pose, though each is near its own path
APART: Final = 2.0


@dataclass(frozen=True)
class Trust:
    """What of a program is not compared, or may be otherwise."""

    #: whether words beside the motion must say what the CL file asks for, and be on the list of the control's words;
    #: not where nobody knows what they mean
    words: bool = True
    #: blocks that belong where they are because the user put them there, and names of states or statements that are
    #: his own (`own_words` of a control table)
    trusted: Sequence[str] = ()
    #: words of the user's own that move nothing, as he declares: the program is verified with them
    accepted: Set[str] = frozenset()
    #: those that curves have, where that is known: any other is a problem. Parts of arcs have their own besides
    weights: Sequence[float] | None = None
    #: whether feeds may be below those of the CL file, as in a program with those of a plan
    slower: bool = False
    #: whether the program may leave out holes to be tapped and those of cycles that are not understood
    skip_cycles: bool = False


#: name, in `Trust.trusted`, of a table whose F of a helix does not count in its plane as the control's does
HELICES: Final = "feed of helices"

#: nothing but the program counts
TRUST: Final = Trust()


@dataclass(frozen=True)
class Original:
    """The CL motion: its poses without those that are only stated, as elements and as a polyline."""

    program: Program
    pose: Ints  #: (m,): pose of every move; the first is where the motion starts
    trail: Motion  #: owners are indices into `pose`

    @classmethod
    def of(cls, program: Program, tolerance: float, axis_length: float, *, own_axis: bool = False) -> Self:
        """Make it of the poses of a program."""
        stated = program.kind == Move.FROM
        # an arc wants a start: where that is only stated the tool is sent there
        stated[:-1] &= program.kind[1:] != Move.ARC
        pose = np.flatnonzero(~stated)
        nc = _moves(program, pose)
        return cls(program, pose, motion_of(nc, axis_length, CL_SHARE * tolerance, _MOST_PARTS, own_axis=own_axis))


def _moves(program: Program, pose: Ints) -> Elements:
    """The moves to poses, as elements."""
    chosen, none = selecting(pose), np.broadcast_to(0.0, len(pose))
    kind = np.where(program.kind[chosen] == Move.RAPID, Element.RAPID, Element.LINE).astype(np.uint8)
    row = np.flatnonzero(np.searchsorted(pose, program.arcs.pose))  # but one that begins nowhere
    arcs = some_rows(program.arcs, row)
    shapes = NcArcs(np.searchsorted(pose, arcs.pose), arcs.centre, arcs.normal, arcs.sweep)
    kind[shapes.element] = Element.ARC
    curves = Curves()
    if (given := program.curves) is not None:
        count = len(given)
        points = given.bezier.reshape(-1, 6) - np.pad(given.bezier[..., :3], ((0, 0), (0, 0), (3, 0))).reshape(-1, 6)
        four, knots = np.full(count, 4), np.tile(np.repeat((0.0, 1.0), 4), count)
        curves = Curves(np.searchsorted(pose, given.pose), four, four, points, np.ones(4 * count), knots)
        kind[curves.element] = Element.CURVE
    return Elements(
        kind=kind,
        tip=program.tip[chosen],
        second=program.axis[chosen],
        line=program.line[chosen],
        feed=program.feed[chosen],
        per_revolution=program.feed_mode[chosen] == FeedMode.PER_REVOLUTION,
        other_feed=none,
        least_feed=none > 0.0,
        feed_room=none,
        second_room=none,
        tip_room=none,
        curves=curves,
        arcs=shapes,
    )


@dataclass(frozen=True)
class Task:
    """The CL motion and what is promised of it."""

    original: Original
    path: Path  #: its trail as points
    #: (m,): whether the end of every move must be passed exactly: all but the inner poses of chains at which nothing
    #: acts
    exact: Bools
    #: mm: ε without the sagitta, and H; H is the distance at which the axis tolerance shows as ε, where there is one.
    tolerance: float
    axis_length: float
    #: degrees: That of the tool axis, where it has one of its own. The *axis point* then is H times the axis wherever
    #: the tip is: it is off by ε where the axis is off by its tolerance.
    axis_tolerance: float | None = None
    #: whether tips and axis points need only be within ε each on its own, and within `APART` ε together: the two
    #: curves of the paper do not run at common poses
    apart: bool = False
    #: mm: how far the written motion may leave the lines that stand for it (rotary words)
    sagitta: float = 0.0
    feed_in_plane: bool = False  #: whether F of an arc that rises counts in the plane of its circle alone

    @property
    def own_axis(self) -> bool:
        """Whether the tool axis has a tolerance of its own."""
        return self.axis_tolerance is not None

    @classmethod
    def of(
        cls,
        program: Program,
        tolerance: float,
        axis_length: float,
        axis_tolerance: float | None = None,
        *,
        apart: bool = False,
        sagitta: float = 0.0,
        feed_in_plane: bool = False,
    ) -> Task:
        """Make it of ε; `axis_tolerance` in degrees takes the place of `axis_length`."""
        own_axis = axis_tolerance is not None
        if axis_tolerance is not None:
            axis_length = length_of(tolerance, axis_tolerance)
        tolerance -= sagitta
        original = Original.of(program, tolerance, axis_length, own_axis=own_axis)
        trail = original.trail
        path = Path.of(trail.six, trail.bend, trail.at)
        exact, axis = _exact_poses(original), (axis_length, axis_tolerance)
        return cls(original, path, exact, tolerance, *axis, apart, sagitta, feed_in_plane)

    def motion(self, nc: Elements) -> Motion:
        """Make the polyline of elements of a program."""
        return motion_of(nc, self.axis_length, WRITTEN_SHARE * self.tolerance, _WRITTEN_PARTS, own_axis=self.own_axis)

    def six(self, tip: Floats, axis: Floats) -> Floats:
        """(..., 6) tips and axis points side by side, mm."""
        return side_by_side(tip, axis, self.axis_length, self.own_axis)

    def ends(self, nc: Elements, rows: slice | list[int]) -> Floats:
        """(k, 6) ends of elements."""
        return self.six(nc.tip[rows], directions(nc, nc.tip[rows], nc.second[rows]))

    def degrees(self, off: Floats | float) -> Floats:
        """What axis points that are `off` by so many mm make of the axis, where that has a tolerance of its own."""
        return np.degrees(2.0 * np.arcsin(np.minimum(np.asarray(off) / (2.0 * self.axis_length), 1.0)))

    @property
    def radius(self) -> float:
        """Distance, mm, within which tip and axis point must be at a common pose."""
        return (APART if self.apart else 1.0) * (self.tolerance + ARITHMETIC)

    @cached_property
    def runs(self) -> dict[Metric, tuple[Path, float]]:
        """What is run beside which path, within which radius, mm: both, and, if apart, each on its own as well."""
        found: dict[Metric, tuple[Path, float]] = {"both": (self.path, self.radius)}
        for name in ("tip", "axis_point") if self.apart else ():
            found[name] = self.path.only(COLUMNS[name]), self.tolerance + ARITHMETIC
        return found

    @cached_property
    def asking(self) -> Asking:
        """What the statements of the CL file ask for."""
        return Asking.of(self.original.program)

    @cached_property
    def feed_runs(self) -> tuple[Ints, Ints]:
        """(m,) run of moves with one feed that each move is in, and (r,) their first moves; what stands has no feed."""
        program, pose, last = self.original.program, self.original.pose, self.original.trail.last
        feed, mode = program.feed[pose], program.feed_mode[pose]
        stands = np.diff(self.path.length[last], prepend=-np.inf) <= ARITHMETIC
        moved = np.flatnonzero(~stands)
        other = (mode[moved[1:]] != mode[moved[:-1]]) | ~(
            (feed[moved[1:]] == feed[moved[:-1]]) | (np.isnan(feed[moved[1:]]) & np.isnan(feed[moved[:-1]]))
        )
        begins = np.zeros(len(pose), np.bool_)
        begins[moved[1:][other]] = True
        first = np.append(0, np.flatnonzero(begins))
        return np.cumsum(begins), first


def length_of(tolerance: float, axis_tolerance: float) -> float:
    """Distance from the tip, mm, at which an axis that is off by its tolerance (degrees) is off by the tolerance."""
    return tolerance / (2.0 * math.sin(math.radians(axis_tolerance) / 2.0))


def _exact_poses(original: Original) -> Bools:
    program = original.program
    exact = np.ones(len(program), np.bool_)
    chains = program.chains
    if len(chains):
        steps = np.zeros(len(program) + 1, np.int64)
        np.add.at(steps, chains[:, 0] + 1, 1)
        np.add.at(steps, chains[:, 1], -1)
        exact = np.cumsum(steps[:-1]) == 0
    exact |= (program.keep != Keep.NO) | program.acted[1:]
    return exact[original.pose]


def selecting(pose: Ints) -> slice | Ints:
    """What selects poses (m,): a slice, which copies nothing, where they follow one another, as nearly always."""
    return slice(pose[0], pose[-1] + 1) if len(pose) and pose[-1] - pose[0] == len(pose) - 1 else pose


def half_turns(program: Program) -> list[Problem]:
    """Moves that no text can be measured against, with their CL lines: CS526.

    Between opposite axes there is no great circle, and near them it hangs on the last digits of both.
    """
    found = program.axis_steps(np.isin(program.kind, (Move.LINEAR, Move.ARC)), FLIP_ANGLE)
    text = "the tool axis turns by {:.4g} deg in one move, and which way a control turns is not defined"
    return [
        Problem("CS526", int(program.line[pose]), 0, text.format(turn))
        for pose, turn in zip(*(values.tolist() for values in found), strict=True)
    ]
