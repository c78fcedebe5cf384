"""The mutation test: wrong texts made from correct ones are found at the right line, harmless changes are not."""

from __future__ import annotations

from functools import partial

import pytest

from cornersmooth.errors import InputError
from cornersmooth.verify import verify
from oracle.share import how_many, share_of_kinds

from .judging import judge
from .mutations import EPS, H, Mutant, mutants
from .writing import encode


def named_in(program, lines):
    found = verify(program, encode(lines), tolerance=EPS, axis_length=H)
    return [(problem.nc_line, problem.text) for problem in found.problems]


@pytest.mark.parametrize(("form", "seed"), [("g1", 0), ("g6.2", 0)])
def test_every_mutant_that_matters_is_found(form, seed):
    program, lines, changed = mutants(form, seed)
    assert named_in(program, lines) == []
    changed = share_of_kinds(changed, lambda mutant: mutant.kind, 12)
    score = judge(changed, partial(named_in, program))
    judged = score.judged
    print(f"\n{form}: " + ", ".join(f"{kind} {judged[kind, True]}" for kind in sorted({kind for kind, _ in judged})))
    print(f"{form}: {score}")
    assert score.missed == []
    assert sum(judged.values()) >= how_many(30, 100)


@pytest.mark.parametrize(("where", "named"), [((3, 5), []), ((3, 5), [2, 6]), (None, [4]), ((3, 5), [InputError])])
def test_a_mutant_that_is_missed_is_counted(where, named):
    def found(_):
        if named == [InputError]:
            raise InputError("CS500", "what", "what to do", line=6)
        return [(line, "") for line in named]

    score = judge([Mutant("digit", [], where), Mutant("digit", [], None if named == [] else (2, 6))], found)
    assert [missed[:2] for missed in score.missed] == [("digit", where)]
    assert score.judged == {("digit", False): 1, ("digit", True): 1}
