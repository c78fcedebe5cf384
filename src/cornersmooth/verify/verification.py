"""The whole verification: NC text against CL program."""

from __future__ import annotations

import os
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.model import Floats, Ints, Program
from cornersmooth.settings import BOUNDS
from cornersmooth.verify.blocks import Block, Cut, Matcher
from cornersmooth.verify.deviation import Deviation, Largest, Measured, Meter, Worst
from cornersmooth.verify.feeds import check_feeds
from cornersmooth.verify.holes import divide_at_holes
from cornersmooth.verify.joints import joint_jumps
from cornersmooth.verify.ncprogram import NcProgram, Problem
from cornersmooth.verify.reader import read_nc
from cornersmooth.verify.statements import asked, compare, said
from cornersmooth.verify.stops import Stretches, find_stretches
from cornersmooth.verify.trails import original_motion
from cornersmooth.verify.walking import Track
from cornersmooth.verify.workers import apart

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine


@dataclass(frozen=True)
class Where:
    """A largest value and where it was met.

    Parameters
    ----------
    value : float
    cl_line, nc_line : int
        From 1; 0 where there is none.
    """

    value: float
    cl_line: int
    nc_line: int


@dataclass(frozen=True)
class Verification:
    """What the comparison found.

    Parameters
    ----------
    passed : bool
        Whether nothing is wrong: no problem of any kind.
    tolerance, axis_length : float, mm
    tip, axis_point : Where, mm
        Largest distance between the tip paths, and between the axis-point paths, both ways, in order along the path.
    together_tip, together_axis_point : Where, mm
        The same where tip and axis point are compared with one common pose.
    orientation : Where, degrees
        Largest angle between the tool axes at that pose.
    problems : tuple of Problem
        Sorted by NC line; at most `MOST_PROBLEMS` of each code.
    problem_count : int
        All of them.
    blocks : int
        Blocks of the text.
    elements : int
        Path elements: rapids, lines, arcs, curves.
    curves : int
    poses : int
    shortest : Where, mm
        Shortest feed element that moves (the longer of the ways of tip and axis point); value is inf without one.
    tangent_jump : Where, degrees
        Largest change of direction of the tip path from one element to the next.
    curvature_jump : Where, 1/mm
        Largest change of curvature at an end of a curve or an arc.
    pose_tip, pose_axis_point : (n,) float64, mm
        Distance of every original pose from the written motion, NaN where the tool does not pass at feed.
    pose_angle : (n,) float64, degrees
    pose_nc_line : (n,) int64
        NC line that passes nearest.
    """

    passed: bool
    tolerance: float
    axis_length: float
    tip: Where
    axis_point: Where
    together_tip: Where
    together_axis_point: Where
    orientation: Where
    problems: tuple[Problem, ...]
    problem_count: int
    blocks: int
    elements: int
    curves: int
    poses: int
    shortest: Where
    tangent_jump: Where
    curvature_jump: Where
    pose_tip: Floats = field(repr=False)
    pose_axis_point: Floats = field(repr=False)
    pose_angle: Floats = field(repr=False)
    pose_nc_line: Ints = field(repr=False)

    @property
    def max_tip_deviation_mm(self) -> float:
        """Largest distance between the tip paths."""
        return self.tip.value

    @property
    def max_axis_point_deviation_mm(self) -> float:
        """Largest distance between the axis-point paths."""
        return self.axis_point.value

    @property
    def max_orientation_deviation_deg(self) -> float:
        """Largest angle between the tool axes at common poses."""
        return self.orientation.value

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON; keys carry their unit."""
        places = {
            "max_tip_deviation_mm": self.tip,
            "max_axis_point_deviation_mm": self.axis_point,
            "max_simultaneous_tip_deviation_mm": self.together_tip,
            "max_simultaneous_axis_point_deviation_mm": self.together_axis_point,
            "max_orientation_deviation_deg": self.orientation,
            "shortest_block_mm": self.shortest,
            "max_tangent_jump_deg": self.tangent_jump,
            "max_curvature_jump_per_mm": self.curvature_jump,
        }
        return {
            "schema": "cornersmooth-verification/1",
            "passed": self.passed,
            "tolerance_mm": self.tolerance,
            "axis_length_mm": self.axis_length,
            "poses": self.poses,
            "blocks": self.blocks,
            "elements": self.elements,
            "curves": self.curves,
            "problem_count": self.problem_count,
            **{key: _finite(where.value) for key, where in places.items()},
            "where": {key: {"cl_line": where.cl_line, "nc_line": where.nc_line} for key, where in places.items()},
            "problems": [
                {
                    "code": problem.code,
                    "cl_line": problem.cl_line,
                    "nc_line": problem.nc_line,
                    "text": problem.text,
                    "amount_mm": _finite(problem.amount),
                }
                for problem in self.problems
            ],
        }


#: code of words that want another state of the control
_CONTROL_WORDS = "CS506"

#: place of what stands before the first motion, mm of path
_BEFORE = -1.0

#: problems of one code that are kept
MOST_PROBLEMS = 1000


def verify(
    program: Program,
    nc: NcProgram | bytes | str | os.PathLike[str],
    *,
    tolerance: float,
    axis_length: float = 10.0,
    control: str = "fanuc",
    machine: Machine | None = None,
    tcp: bool = True,
    words: bool = True,
    processes: int = 1,
) -> Verification:
    """Measure an NC text against the CL program it was made from.

    Parameters
    ----------
    program : Program
    nc : NcProgram, bytes or path
    tolerance : float, mm
        ε: what is allowed at tip and axis point.
    axis_length : float, mm
        H: distance of the axis point from the tip.
    control, machine, tcp
        As in `read_nc`.
    words : bool
        Whether words beside the motion must say what the CL file asks for; not where nobody knows what they mean.
    processes : int
        Processes to measure long texts with, where the system can fork; the result does not depend on it.

    Returns
    -------
    Verification

    Raises
    ------
    InputError
        Where the text cannot be read.
    SettingsError
        CS202 for a tolerance or axis length out of bounds.
    """
    for name, value in (("tolerance", tolerance), ("axis_length", axis_length)):
        low, high = BOUNDS[name]
        if not low <= value <= high:
            raise SettingsError("CS202", f"{name} is {value:g}", f"give a value from {low:g} to {high:g}")
    text = nc
    if not isinstance(text, NcProgram):
        text = read_nc(text, control=control, machine=machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length)
    return _Run(program, text, tolerance, axis_length, words=words).result(processes)


@dataclass
class _Joints:
    """Largest jumps of direction (minus the cosine) and curvature, and the shortest element (minus its length)."""

    tangent: Worst = field(default_factory=lambda: Worst(-1.0))
    curvature: Worst = field(default_factory=Worst)
    shortest: Worst = field(default_factory=lambda: Worst(-np.inf))

    def take(self, other: _Joints) -> None:
        """Take over what is larger elsewhere."""
        for name, worst in vars(other).items():
            if worst.value > getattr(self, name).value:
                setattr(self, name, worst)


@dataclass(frozen=True)
class _Examined:
    """What one block shows; see `Meter.measure`, `check_feeds` and `_Run`."""

    measured: Measured
    feeds: list[tuple[float, Problem]]
    places: tuple[slice, Floats]
    joints: _Joints


class _Run:
    """One verification in progress."""

    def __init__(self, program: Program, nc: NcProgram, tolerance: float, axis_length: float, *, words: bool) -> None:
        self.program, self.nc, self.words = program, nc, words
        self.tolerance, self.axis_length = tolerance, axis_length
        self.original = original_motion(program, tolerance, axis_length)
        self.matcher = Matcher(
            self.original, nc, Track.of(self.original.trail.six(axis_length)), tolerance, axis_length
        )
        self.joints = _Joints()

    def result(self, processes: int) -> Verification:
        """Do it."""
        nc = self.nc
        problems = [problem for problem in nc.problems if self.words or problem.code != _CONTROL_WORDS]
        if nc.units != self.program.units:
            text = f"the text is in {nc.units}, the CL file in {self.program.units}"
            problems.append(Problem("CS505", 0, 1, text))
        holes = divide_at_holes(self.original, nc, self.axis_length)
        stretches, found = find_stretches(self.original, nc, self.axis_length, holes.parts)
        problems += holes.problems + found
        problems += self._lost_stretches(stretches)
        meter = Meter(self.matcher, self.tolerance)
        asked_elements = np.unique([event.element - 1 for event in nc.events]).astype(np.int64)
        element_place = self._stop_places(stretches, asked_elements, holes.element_move)
        feeds: list[tuple[float, Problem]] = []

        def examine(item: tuple[Cut, Largest]) -> _Examined:
            block = self.matcher.walked(item[0])
            measured = meter.measure(block, item[1])
            feeds_here = check_feeds(self.matcher, block, measured.off)
            return _Examined(
                replace(measured, off=measured.off[:0]),
                feeds_here,
                self._places(block, asked_elements),
                self._joints(block),
            )

        cuts = ((cut, meter.result.largest.copy()) for cut in self.matcher.cuts(stretches))
        for found_here in apart(examine, cuts, processes, lambda item: item[0].block is not None):
            meter.add(found_here.measured)
            feeds += found_here.feeds
            part, places = found_here.places
            element_place[part] = np.where(np.isnan(element_place[part]), places, element_place[part])
            self.joints.take(found_here.joints)
        deviation = meter.result
        problems += meter.problems()
        problems += [problem for _, problem in feeds]
        problems += self._statements(asked_elements, element_place)
        problems.sort(key=lambda problem: (problem.nc_line, problem.cl_line))
        return self._verification(deviation, problems)

    def _lost_stretches(self, stretches: Stretches) -> list[Problem]:
        """Stretches that only one of the two motions has."""
        nc, original = self.nc, self.original
        theirs = stretches.move_last > stretches.move_first
        ours = stretches.element_last > stretches.element_first
        problems = []
        for k in np.flatnonzero(theirs != ours).tolist():
            if theirs[k]:
                part = slice(int(stretches.move_first[k]), int(stretches.move_last[k]) + 1)
                tip, other = self.program.tip[original.pose[part]], self.program.axis[original.pose[part]]
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
                line = int(self.program.line[original.pose[move]])
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
        place[(k < 0) & np.isnan(place)] = _BEFORE
        at = np.flatnonzero(k >= 0)
        stop = at[stretches.element_first[k[at]] == elements[at]]
        place[stop] = length[last[stretches.move_first[k[stop]]]]
        return place

    def _places(self, block: Block, elements: Ints) -> tuple[slice, Floats]:
        """Which of the given elements lie in this block, and the path length at their ends; NaN where not known."""
        first = block.written.first
        a, b = np.searchsorted(elements, (first, first + len(block.written.trail.last))).tolist()
        vertex = block.written.trail.last[elements[a:b] - first]
        length, segment = self.matcher.track.length, block.segment[vertex]
        here = length[segment] + block.fraction[vertex] * (length[segment + 1] - length[segment])
        return slice(a, b), np.where(block.on[vertex], here, np.nan)

    def _joints(self, block: Block) -> _Joints:
        nc, program, original, found = self.nc, self.program, self.original, _Joints()
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

    def _statements(self, elements: Ints, element_place: Floats) -> list[Problem]:
        original, length = self.original, self.matcher.track.length
        if not self.words or not len(self.nc):  # without any motion nothing has a place
            return []
        statements = self.program.statements
        move = np.searchsorted(original.pose, [statement.pose for statement in statements]) - 1
        moves = len(original.pose)
        end = float(length[-1]) if moves else 0.0
        places = np.where(move >= 0, length[original.trail.last[np.clip(move, 0, None)]] if moves else 0.0, _BEFORE)
        theirs = asked(self.program, places.tolist(), end)
        index = np.searchsorted(elements, [event.element - 1 for event in self.nc.events])
        mine = np.nan_to_num(element_place[index], nan=0.0) if len(elements) else np.zeros(0)
        return compare(theirs, said(self.nc.events, mine.tolist()), self.matcher.margin, self.nc.unsaid)

    def _verification(self, deviation: Deviation, problems: list[Problem]) -> Verification:
        kept: list[Problem] = []
        count: dict[str, int] = {}
        for problem in problems:
            count[problem.code] = count.get(problem.code, 0) + 1
            if count[problem.code] <= MOST_PROBLEMS:
                kept.append(problem)
        tangent = float(np.degrees(np.arccos(np.clip(-self.joints.tangent.value, -1.0, 1.0))))
        largest = deviation.largest
        return Verification(
            passed=not problems,
            tolerance=self.tolerance,
            axis_length=self.axis_length,
            tip=_where(largest.tip),
            axis_point=_where(largest.axis_point),
            together_tip=_where(largest.together_tip),
            together_axis_point=_where(largest.together_axis_point),
            orientation=_where(largest.orientation, float(np.degrees(largest.orientation.value))),
            problems=tuple(kept),
            problem_count=len(problems),
            blocks=self.nc.blocks,
            elements=len(self.nc),
            curves=len(self.nc.curves),
            poses=len(self.program),
            shortest=_where(self.joints.shortest, -self.joints.shortest.value),
            tangent_jump=_where(self.joints.tangent, tangent),
            curvature_jump=_where(self.joints.curvature),
            pose_tip=deviation.pose_tip,
            pose_axis_point=deviation.pose_axis_point,
            pose_angle=np.degrees(deviation.pose_angle),
            pose_nc_line=deviation.pose_nc_line,
        )


def _where(worst: Worst, value: float | None = None) -> Where:
    return Where(worst.value if value is None else value, worst.cl_line, worst.nc_line)


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
