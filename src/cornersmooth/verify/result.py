"""What verification found, as plain values."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from cornersmooth.errors import Verdict
from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.verify.findings import AXIS_OFF, Findings, Where
from cornersmooth.verify.task import Task

#: problems of one code that are kept
MOST_PROBLEMS = 1000


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
