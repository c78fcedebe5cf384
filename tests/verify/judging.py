"""Judges mutants of a text, each in a text of its own: none hides another, and what one does is not taken for the next.

Verification takes as long as a text is: several mutants in a text of as many jobs were judged no faster.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from cornersmooth.errors import InputError

from .mutations import Mutant

#: what is named: its line, and what is said
Named = list[tuple[int, str]]


@dataclass
class Score:
    """What became of the mutants of a text."""

    judged: Counter[tuple[str, bool]] = field(default_factory=Counter)
    missed: list[tuple[object, ...]] = field(default_factory=list)

    def __str__(self) -> str:
        total = sum(self.judged.values())
        return f"{total - len(self.missed)} of {total} mutants judged rightly"


def judge(mutants: Sequence[Mutant], named_in: Callable[[list[str]], Named]) -> Score:
    """Score of mutants; `named_in` is what verification finds in a text, or InputError where it cannot be read."""
    score = Score()
    for one in mutants:
        try:
            found = named_in(one.lines)
        except InputError as error:
            found = [(error.line or 0, str(error))]
        low, high = one.where or (1, 0)
        good = not found if one.where is None else any(low <= line <= high for line, _ in found)
        score.judged[one.kind, good] += 1
        if not good:
            score.missed.append((one.kind, one.where, found[:3]))
    return score
