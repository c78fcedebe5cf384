"""Judges mutants of one text, several in one text where none can hide another.

The text that they share runs the same job several times, with a calm cut far from it between; each mutant changes a run
of its own. Something must be named where each of those that matter was made, nothing in a run with a harmless one, and
nothing in the calm cuts: what one mistake does to the text behind it is not taken for the next being found. Whatever is
in doubt is judged again in a text of its own, with the job alone.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Move, Program

from .mutations import Mutant

#: runs of the job in one text
RUNS = 6
#: lines behind a run where its end may be named
BEHIND = 3
#: feed of the calm cuts, mm/min
CALM_FEED = 77.0
#: every which pose of the job a rapid goes back through
BACK = 3

#: kinds after which reading ends, or rapids far from them are taken for others
ALONE = (
    "rapid",
    "feed as rapid",
    "start",
    "strange word",
    "frame",
    "tool axis or side",
    "line with",
    "coefficient without",
    "spline without",
    "spline at rapid",
)

#: what is named: its line, and what is said
Named = list[tuple[int, str]]


@dataclass
class Score:
    """What became of the mutants of a text."""

    judged: Counter[tuple[str, bool]] = field(default_factory=Counter)
    missed: list[tuple[object, ...]] = field(default_factory=list)
    texts: int = 0  #: how many were verified

    def __str__(self) -> str:
        total = sum(self.judged.values())
        return f"{total - len(self.missed)} of {total} mutants judged rightly, in {self.texts} texts"


# ---------------------------------------------------------------- the job several times


def calm_cut(program: Program) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Tips, axes and kinds between two runs: a straight cut far away, then rapids that wind the axes back."""
    back = program.axis[::-BACK]
    axis = np.concatenate((np.tile(back[0], (2, 1)), back))
    tip = program.tip[0] + np.outer(np.arange(len(axis)), (-10.0, 0, 0)) + (-300.0, 0, 50.0)
    kind = np.full(len(axis), Move.RAPID, np.uint8)
    kind[1:3] = Move.LINEAR
    return tip, axis, kind


def repeated(program: Program, runs: int) -> Program:
    """Program that runs another several times, with a calm cut before each run but the first."""
    cut = calm_cut(program)
    calm = (*cut, np.full(len(cut[0]), CALM_FEED), program.line[-1] + 1 + np.arange(len(cut[0])))
    parts, statements, begin = [], [], 0
    for run in range(runs):
        if run:
            parts.append((*calm[:4], calm[4] + 10_000 * (run - 1)))
            begin += len(calm[0])
        parts.append((program.tip, program.axis, program.kind, program.feed, program.line + 10_000 * run))
        statements += [
            replace(one, pose=one.pose + begin, line=one.line + 10_000 * run)
            for one in program.statements
            if one.word != "FINI" or run == runs - 1
        ]
        begin += len(program)
    tip, axis, kind, feed, line = (np.concatenate(column) for column in zip(*parts, strict=True))
    return Program.from_poses(tip, axis, kind=kind, feed=feed, line=line, statements=tuple(statements))


@dataclass(frozen=True)
class Runs:
    """Where a text of several runs repeats the text of one.

    Lines `first` to `last` of the one, counted from 0 and without the last, stand in the other from each of `starts`.
    """

    once: list[str]
    several: list[str]
    first: int
    last: int
    starts: list[int]

    @classmethod
    def of(cls, once: list[str], several: list[str]) -> Runs:
        """Find them; block numbers do not count."""
        one, all_ = ([re.sub(r"^N?\d+ ", "", line) for line in lines] for lines in (once, several))
        motion = [i for i, line in enumerate(one) if re.search(r"(?<![A-Z0-9\[])X", line)]
        # from the first change of feed: before it the words of the start may differ
        first, last = motion[2], motion[-1] + 1
        part = one[first:last]
        starts = [i for i, line in enumerate(all_) if line == part[0] and all_[i : i + len(part)] == part]
        while starts and first > 0 and all(all_[i - 1] == one[first - 1] for i in starts):
            first, starts = first - 1, [i - 1 for i in starts]
        return cls(once, several, first, last, starts)


# ---------------------------------------------------------------- mutants


@dataclass(frozen=True)
class Edit:
    """Lines first to last (from 0, without the last) of the text, and what stands there in the mutant."""

    mutant: Mutant
    first: int
    last: int
    new: list[str]

    @property
    def longer(self) -> int:
        """By how many lines the text grows."""
        return len(self.new) - (self.last - self.first)


def edit(lines: list[str], mutant: Mutant) -> Edit:
    """Where a mutant differs from the text."""
    first, new = 0, mutant.lines
    shorter = min(len(lines), len(new))
    while first < shorter and lines[first] == new[first]:
        first += 1
    same = 0
    while same < shorter - first and lines[-1 - same] == new[-1 - same]:
        same += 1
    return Edit(mutant, first, len(lines) - same, new[first : len(new) - same])


@dataclass(frozen=True)
class Shared:
    """A text with a mutant in each of its first runs: lines of each run, and where each must be found, from 1."""

    lines: list[str]
    runs: list[tuple[int, int]]
    windows: list[tuple[int, int] | None]

    @classmethod
    def of(cls, runs: Runs, edits: Sequence[Edit]) -> Shared:
        text, own, windows, behind, shift = [], [], [], 0, 0
        for one, start in zip(edits, runs.starts, strict=False):
            to = start - runs.first
            text += runs.several[behind : one.first + to] + one.new
            behind = one.last + to
            low, high = to + runs.first + shift + 1, to + runs.last + shift + one.longer + BEHIND
            own.append((low, high))
            where = one.mutant.where
            windows.append(where and (max(where[0] + to + shift, low), min(where[1] + to + shift, high)))
            shift += one.longer
        return cls(text + runs.several[behind:], own, windows)

    def judged_rightly(self, found: Named) -> list[bool]:
        """For each mutant whether it is, where nothing beside the runs is named."""
        at = [line for line, _ in found]
        return [
            not any(low <= line <= high for line in at)
            if window is None
            else any(window[0] <= line <= window[1] for line in at)
            for (low, high), window in zip(self.runs, self.windows, strict=True)
        ]


def judge(
    program: Program,
    lines: list[str],
    mutants: Sequence[Mutant],
    written: Callable[[Program], list[str]],
    named_in: Callable[[Program, list[str]], Named],
) -> Score:
    """Score of the mutants of the text of a program.

    Parameters
    ----------
    written : callable
        Text of a program that runs the job several times.
    named_in : callable
        What verification finds in a text; InputError where it cannot be read.
    """
    score, many = Score(), repeated(program, RUNS)
    runs = Runs.of(lines, written(many))
    assert named_in(many, runs.several) == []

    def named(of: Program, text: list[str]) -> tuple[Named, bool]:
        score.texts += 1
        try:
            return named_in(of, text), True
        except InputError as error:
            return [(error.line or 0, str(error))], False

    def alone(one: Edit) -> None:
        found, _ = named(program, one.mutant.lines)
        where = one.mutant.where
        good = not found if where is None else any(where[0] <= line <= where[1] for line, _ in found)
        score.judged[one.mutant.kind, good] += 1
        if not good:
            score.missed.append((one.mutant.kind, where, found[:3], one.new[:1]))

    def together(edits: list[Edit]) -> None:
        if len(edits) < 2:
            for one in edits:
                alone(one)
            return
        shared = Shared.of(runs, edits)
        found, readable = named(many, shared.lines)
        beside = [line for line, _ in found if not any(low <= line <= high for low, high in shared.runs)]
        if not readable and not beside:  # reading ended in the run of one
            at = next(k for k, (low, high) in enumerate(shared.runs) if low <= found[0][0] <= high)
            alone(edits[at])
            together(edits[:at] + edits[at + 1 :])
        elif beside:
            together(edits[: len(edits) // 2])
            together(edits[len(edits) // 2 :])
        else:
            for one, good in zip(edits, shared.judged_rightly(found), strict=True):
                if good:
                    score.judged[one.mutant.kind, True] += 1
                else:
                    alone(one)

    edits = [edit(lines, mutant) for mutant in mutants]
    sharing = [
        one
        for one in edits
        if not one.mutant.kind.startswith(ALONE) and runs.first <= one.first and one.last <= runs.last
    ]
    for one in edits:
        if one not in sharing:
            alone(one)
    count = max(len(runs.starts), 1)
    for first in range(0, len(sharing), count):
        together(sharing[first : first + count])
    return score
