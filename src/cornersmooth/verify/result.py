"""What verification finds: in a batch, and in all, as plain values."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any, Final, NamedTuple

import numpy as np

from cornersmooth.errors import Verdict
from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.verify.task import Task

#: problems of one code that are kept
MOST_PROBLEMS = 1000

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


@dataclass(frozen=True)
class Verification:
    """What the comparison found."""

    passed: bool  #: whether nothing is wrong: no problem of any kind
    #: mm: ε and H; NaN for H where the tool axis has a tolerance of its own
    tolerance: float
    axis_length: float
    #: degrees: what the tool axis may be off where the tip is within ε; None where the axis point has to keep ε
    axis_tolerance: float | None
    #: mm: largest distance between the tip paths, and between the axis-point paths, both ways, in order along the path;
    #: with an axis tolerance, which axis points are not part of, all of them is NaN
    tip: Where
    axis_point: Where
    #: mm: largest distances at the common poses by which the decision was proved
    together_tip: Where
    together_axis_point: Where
    #: degrees: largest angle between the tool axes there; with an axis tolerance, where that is kept best
    orientation: Where
    problems: tuple[Problem, ...]  #: sorted by NC line; at most `MOST_PROBLEMS` of each code
    problem_count: int  #: all of them
    blocks: int  #: of the text
    elements: int  #: path elements: rapids, lines, arcs, curves
    curves: int
    poses: int
    #: mm: shortest feed element that moves (the longer of the ways of tip and axis point); inf without one
    shortest: Where
    #: degrees: largest change of direction of the tip path from one element to the next
    tangent_jump: Where
    #: (n,) mm: distance of every original pose from the written motion, NaN where the tool does not pass at feed; with
    #: an axis tolerance the latter is what the axis is off, so that its tolerance shows as ε
    pose_tip: Floats = field(repr=False)
    pose_axis_point: Floats = field(repr=False)
    pose_angle: Floats = field(repr=False)  #: (n,) degrees
    pose_nc_line: Ints = field(repr=False)  #: (n,): NC line that passes nearest
    #: NC lines, and blocks of the user's own, that were not compared with the CL file; line 0: all statements of a kind
    trusted: tuple[tuple[int, str], ...] = ()
    #: what of the text was not looked at and may bear on the motion, and its line; empty where all of it was
    unverified: str = ""
    #: NC lines where a cut is left along the tool, and where the tool comes back into it
    rewinds: tuple[tuple[int, int], ...] = ()
    rounding: float = 0.0  #: mm: by how much the control may round on its own: it adds to what is measured
    offset: str = ""  #: work offset that nothing was compared with; empty for none
    parts: str = ""  #: digests of the parts of the program (`nc_words.parts`); empty where its words were not looked at
    left_out: int = 0  #: holes that the text leaves out, as the caller allowed
    taken_from_head: tuple[str, ...] = ()  #: words of the program's own head that say how it is measured: ``E=0.04``
    #: whether tips and axis points were run beside their paths each on its own: not at common poses
    apart: bool = False

    @property
    def motions_part(self) -> bool:
        """Whether the two motions cannot be run beside each other."""
        return any(problem.code in ("CS521", "CS522", "CS523", "CS525", AXIS_OFF) for problem in self.problems)

    @property
    def only_apart(self) -> bool:
        """Whether the motions part though tips and axis points are near each other, each on its own."""
        codes = {problem.code for problem in self.problems}
        return bool(codes & {"CS523", "CS525"}) and not codes & {"CS521", "CS522", AXIS_OFF}

    @property
    def verdict(self) -> Verdict:
        """How the program turned out."""
        return Verdict.of(problems=self.problem_count, unverified=bool(self.unverified), left_out=self.left_out)

    def with_problem(self, problem: Problem) -> Verification:
        """Return the same with one more problem, in front of the others.

        Returns
        -------
        Verification
            A new one, with its count one higher.
        """
        return replace(self, passed=False, problems=(problem, *self.problems), problem_count=self.problem_count + 1)

    def not_verified(self, *what: str) -> Verification:
        """Return the same with more that was not looked at.

        Returns
        -------
        Verification
            A new one, whose `unverified` names both.
        """
        return replace(self, unverified="; ".join(text for text in (self.unverified, *what) if text))

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
        """Plain values for JSON; keys carry their unit.

        Returns
        -------
        dict
            Numbers in mm and degrees, None for what was not measured; lines count from 1.
        """
        places = {
            "max_tip_deviation_mm": self.tip,
            "max_axis_point_deviation_mm": self.axis_point,
            "max_simultaneous_tip_deviation_mm": self.together_tip,
            "max_simultaneous_axis_point_deviation_mm": self.together_axis_point,
            "max_orientation_deviation_deg": self.orientation,
            "shortest_block_mm": self.shortest,
            "max_tangent_jump_deg": self.tangent_jump,
        }
        return {
            "schema": "cornersmooth-verification/1",
            "verdict": str(self.verdict),
            "passed": self.passed,
            "tolerance_mm": self.tolerance,
            "axis_length_mm": _finite(self.axis_length),
            "axis_tolerance_deg": self.axis_tolerance,
            "poses": self.poses,
            "blocks": self.blocks,
            "elements": self.elements,
            "curves": self.curves,
            "problem_count": self.problem_count,
            "not_verified": self.unverified,
            "left_out": self.left_out,
            "not_at_common_poses": self.apart,
            "taken_from_head": list(self.taken_from_head),
            "rewinds": [{"nc_line": out, "back_nc_line": back} for out, back in self.rewinds],
            "trusted": [{"nc_line": line, "text": text} for line, text in self.trusted],
            **{key: _finite(where.value) for key, where in places.items()},
            "where": {key: {"cl_line": where.cl_line, "nc_line": where.nc_line} for key, where in places.items()},
            "problems": [
                {
                    "code": problem.code,
                    "cl_line": problem.cl_line,
                    "nc_line": problem.nc_line,
                    "text": problem.text,
                    "amount_deg" if problem.code == AXIS_OFF else "amount_mm": _finite(problem.amount),
                }
                for problem in self.problems
            ],
        }

    @classmethod
    def of(cls, found: Findings, poses: Floats, problems: list[Problem], task: Task, **counts: Any) -> Verification:
        """Make it of what was found, of all poses (4, n) as in `Findings`, of all problems, and of what is counted.

        Returns
        -------
        Verification
            Deviations in mm and degrees, each with its places in both programs.
        """
        kept: list[Problem] = []
        count: Counter[str] = Counter()
        for problem in sorted(problems, key=lambda problem: (problem.nc_line, problem.cl_line)):
            count[problem.code] += 1
            if count[problem.code] <= MOST_PROBLEMS:
                kept.append(problem)
        worst, own = found.worst, task.own_axis
        orientation = np.degrees(worst["orientation"].value)
        tangent = np.degrees(np.arccos(np.clip(-worst["tangent_jump"].value, -1.0, 1.0)))
        measured = {"orientation": orientation, "tangent_jump": tangent, "shortest": -worst["shortest"].value}
        if own:
            worst = worst | {"orientation": worst["axis_point"]}
            measured |= {"orientation": task.degrees(worst["axis_point"].value)}
            measured |= {"axis_point": np.nan, "together_axis_point": np.nan}
        peaks: dict[str, Any] = {
            name: replace(where, value=float(measured.get(name, where.value))) for name, where in worst.items()
        }
        return cls(
            passed=not problems,
            tolerance=task.tolerance + task.sagitta,
            axis_length=np.nan if own else task.axis_length,
            axis_tolerance=task.axis_tolerance,
            problems=tuple(kept),
            problem_count=len(problems),
            poses=poses.shape[1],
            pose_tip=poses[0],
            pose_axis_point=poses[1],
            pose_angle=np.degrees(poses[2]),
            pose_nc_line=poses[3].astype(np.int64),
            **peaks,
            **counts,
        ).not_verified(*_texts(found.unlooked))


def _texts(unlooked: list[tuple[int, str]]) -> list[str]:
    """What was not looked at: the first line of each kind, and how often."""
    count = Counter(text for _, text in unlooked)
    first: dict[str, int] = {}
    for line, text in sorted(unlooked):
        first.setdefault(text, line)
    return [
        f"{text} at NC line {line}" + (f" and {count[text] - 1:,} more places" if count[text] > 1 else "")
        for text, line in first.items()
    ]


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
