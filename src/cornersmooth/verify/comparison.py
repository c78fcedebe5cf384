"""Everything that is measured between two motions whose stops correspond: deviation, feeds, joints, places."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.blocks import Block, Cut, Matcher
from cornersmooth.verify.deviation import Largest, Measured, Meter, Peaks, Poses, Violations, Worst
from cornersmooth.verify.feeds import check_feeds
from cornersmooth.verify.joints import joint_jumps
from cornersmooth.verify.ncprogram import NcProgram, Problem
from cornersmooth.verify.stops import Stretches
from cornersmooth.verify.trails import Original
from cornersmooth.verify.walking import Track
from cornersmooth.verify.workers import apart

#: place of what stands before the first motion, mm of path
BEFORE = -1.0


@dataclass
class Joints(Peaks):
    """Largest jumps of direction (minus the cosine) and curvature, and the shortest element (minus its length)."""

    tangent: Worst = field(default_factory=lambda: Worst(-1.0))
    curvature: Worst = field(default_factory=Worst)
    shortest: Worst = field(default_factory=lambda: Worst(-np.inf))


@dataclass
class Compared:
    """What comparing shows.

    Parameters
    ----------
    largest : Largest
    joints : Joints
    poses : list of Poses
    problems : list of Problem
        Unsorted.
    places : (e,) float64, mm
        Length of the original path at the ends of the elements asked for, `BEFORE` in front of the first.
    """

    largest: Largest
    joints: Joints
    poses: list[Poses]
    problems: list[Problem]
    places: Floats


@dataclass(frozen=True)
class _Examined:
    """What one block shows; see `Meter.measure`, `check_feeds` and `Comparison`."""

    measured: Measured
    feeds: list[tuple[float, Problem]]
    places: tuple[slice, Floats]
    joints: Joints


class Comparison:
    """Two motions to compare.

    Parameters
    ----------
    original : Original
    exact : (m,) bool
        Moves whose end must be passed exactly (`exact_poses`).
    nc : NcProgram
    tolerance, axis_length : float, mm
    """

    def __init__(self, original: Original, exact: Bools, nc: NcProgram, tolerance: float, axis_length: float) -> None:
        self.original, self.nc, self.axis_length = original, nc, axis_length
        track = Track.of(original.trail.six(axis_length))
        self.matcher = Matcher(original, nc, track, tolerance, axis_length)
        self._exact = exact

    def compare(
        self,
        stretches: Stretches,
        elements: Ints,
        *,
        holes: dict[int, int] | None = None,
        so_far: Largest | None = None,
        until: float = np.inf,
        processes: int = 1,
    ) -> Compared:
        """Measure all stretches.

        Parameters
        ----------
        stretches : Stretches
        elements : (e,) int64
            Elements whose places on the original path are asked for; sorted, -1 stands before the first.
        holes : dict of int to int
            Move of the hole that an element belongs to.
        so_far : Largest
            What was met before: places with less are not looked at closely.
        until : float
            Where on the original the last stretch ends when it goes on elsewhere; see `Block`.
        processes : int
            To work with, see `workers.apart`.
        """
        meter = Meter(self.matcher, self._exact)
        found = Compared(
            (so_far or Largest()).copy(),
            Joints(),
            [],
            self._lost_stretches(stretches),
            self._stop_places(stretches, elements, holes or {}),
        )
        violations = Violations()

        def examine(item: tuple[Cut, Largest]) -> _Examined:
            block = self.matcher.walked(item[0])
            measured = meter.measure(block, item[1])
            feeds = check_feeds(self.matcher, block, measured.off)
            measured = replace(measured, off=measured.off[:0])
            return _Examined(measured, feeds, self._places(block, elements), self._joints(block))

        cuts = ((cut, found.largest.copy()) for cut in self.matcher.cuts(stretches, until))
        for here in apart(examine, cuts, processes, lambda item: item[0].block is not None):
            found.largest.take(here.measured.largest)
            violations.extend(here.measured.violations)
            found.poses.append(here.measured.poses)
            found.joints.take(here.joints)
            found.problems += [problem for _, problem in here.feeds]
            part, places = here.places
            found.places[part] = np.where(np.isnan(found.places[part]), places, found.places[part])
        found.problems += violations.problems()
        return found

    def _lost_stretches(self, stretches: Stretches) -> list[Problem]:
        """Stretches that only one of the two motions has."""
        nc, original = self.nc, self.original
        theirs = stretches.move_last > stretches.move_first
        ours = stretches.element_last > stretches.element_first
        problems = []
        for k in np.flatnonzero(theirs != ours).tolist():
            if theirs[k]:
                part = slice(int(stretches.move_first[k]), int(stretches.move_last[k]) + 1)
                tip, other = (
                    self.original.program.tip[original.pose[part]],
                    self.original.program.axis[original.pose[part]],
                )
                extent = np.abs(tip - tip[0]).max() + self.axis_length * np.abs(other - other[0]).max()
                if len(tip) == 2:
                    extent *= 1.0 - stretches.fraction[k]
                text, code = "feed moves of the CL file are missing", "CS535"
            else:
                part = slice(int(stretches.element_first[k]), int(stretches.element_last[k]) + 1)
                tip, second = nc.tip[part], nc.second[part]
                scale = self.axis_length if nc.second_is == "vector" else 1.0
                extent = np.abs(tip - tip[0]).max() + scale * np.abs(second - second[0]).max()
                text, code = "feed moves that the CL file does not have", "CS536"
            if extent > self.matcher.margin:
                move = min(int(stretches.move_first[k]) + 1, len(original.pose) - 1)
                element = min(int(stretches.element_first[k]) + 1, len(nc) - 1)
                line = int(self.original.program.line[original.pose[move]])
                problems.append(Problem(code, line, int(nc.line[element]), text, float(extent)))
        return problems

    def _stop_places(self, stretches: Stretches, elements: Ints, holes: dict[int, int]) -> Floats:
        """Path length at the ends of the given elements as far as stops tell; NaN inside stretches."""
        length, last = self.matcher.track.length, self.original.trail.last
        place = np.full(len(elements), np.nan)
        for row, element in enumerate(elements.tolist() if holes else []):
            if element in holes:
                place[row] = length[last[holes[element]]]
        k = np.searchsorted(stretches.element_first, elements, side="right") - 1
        place[(k < 0) & np.isnan(place)] = BEFORE
        at = np.flatnonzero(k >= 0)
        stop = at[stretches.element_first[k[at]] == elements[at]]
        if not holes:  # a stretch that begins on its way does so at no stop
            stop = stop[stretches.fraction[k[stop]] == 0]
        place[stop] = length[last[stretches.move_first[k[stop]]]]
        return place

    def _places(self, block: Block, elements: Ints) -> tuple[slice, Floats]:
        """Which of the given elements lie in this block, and the path length at their ends; NaN where not known."""
        first = block.written.first
        a, b = np.searchsorted(elements, (first, first + len(block.written.trail.last))).tolist()
        vertex = block.written.trail.last[elements[a:b] - first]
        here = self.matcher.track.way(block.segment[vertex], block.fraction[vertex])
        return slice(a, b), np.where(block.on[vertex], here, np.nan)

    def _joints(self, block: Block) -> Joints:
        nc, original, found = self.nc, self.original, Joints()
        program = original.program
        element, cosine, curved, jump = joint_jumps(self.matcher, block)
        trail = block.written.trail

        def cl_line(elements: Ints) -> Ints:
            vertex = trail.last[elements - block.written.first]
            lines: Ints = program.line[original.pose[original.trail.owner[block.segment[vertex] + 1]]]
            return lines

        for worst, values, where in ((found.tangent, -cosine, element), (found.curvature, jump, curved)):
            if len(values):
                k = int(np.argmax(values))
                worst.update(values[k : k + 1], cl_line(where[k : k + 1]), nc.line[where[k : k + 1]])
        # a block in rotary words may have become several elements: its length is from its start to its end
        lines = nc.line[block.written.first : block.written.first + len(trail.last)]
        chosen = np.flatnonzero(np.append(lines[1:] != lines[:-1], True))
        ends = trail.last[chosen]
        six = block.six[ends] if len(ends) < len(block.six) else block.six
        step = six[1:] - six[:-1]
        square = np.maximum(
            np.einsum("ij,ij->i", step[:, :3], step[:, :3]), np.einsum("ij,ij->i", step[:, 3:], step[:, 3:])
        )
        square[(square == 0) | ~block.on[ends[1:]] | ~block.on[ends[:-1]]] = np.inf
        square[block.piece[ends[1:]] != block.piece[ends[:-1]]] = np.inf
        if len(square):
            k = int(np.argmin(square))
            own = chosen[k + 1 : k + 2] + block.written.first
            found.shortest.update(-np.sqrt(square[k : k + 1]), cl_line(own), nc.line[own])
        return found
