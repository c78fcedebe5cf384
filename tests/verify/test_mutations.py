"""The mutation test: wrong texts made from correct ones are found at the right line, harmless changes are not."""

from __future__ import annotations

from collections import Counter

import pytest

from cornersmooth.errors import InputError
from cornersmooth.verify import verify

from .mutations import EPS, H, mutants
from .writing import encode


def lines_named(program, text):
    try:
        return [
            (problem.nc_line, problem.text) for problem in verify(program, text, tolerance=EPS, axis_length=H).problems
        ]
    except InputError as error:
        return [(error.line, str(error))]


@pytest.mark.parametrize(("form", "seed"), [("g1", 0), ("g6.2", 0)])
def test_every_mutant_that_matters_is_found(form, seed):
    program, lines, changed = mutants(form, seed)
    assert lines_named(program, encode(lines)) == []
    score, missed = Counter(), []
    for mutant in changed:
        named = lines_named(program, encode(mutant.lines))
        if mutant.where is None:
            good = not named
        else:
            low, high = mutant.where
            good = any(low <= line <= high for line, _ in named)
        score[mutant.kind, good] += 1
        if not good:
            missed.append((mutant.kind, mutant.where, named[:3]))
    kinds = sorted({kind for kind, _ in score})
    print(
        f"\n{form}: "
        + ", ".join(f"{kind} {score[kind, True]}/{score[kind, True] + score[kind, False]}" for kind in kinds)
    )
    total = sum(score.values())
    print(f"{form}: {total - len(missed)} of {total} mutants judged rightly")
    assert missed == []
    assert total >= 200
