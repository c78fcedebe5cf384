"""A sample of the mutants of holes; `hole_mutations` judges all of them."""

from __future__ import annotations

import pytest

from nc.cases import Case

from .hole_mutations import mutants, named_in, text_of

CASES = (Case("fanuc", "g1"), Case("heidenhain", "g1", "table-bc"), Case("haas", "g1", "table-bc", tcp=False))
#: which of the mutants of a case
EVERY = 5


@pytest.mark.parametrize("case", CASES, ids=str)
def test_a_sample_of_the_mutants_is_found_at_its_line(case: Case) -> None:
    assert named_in(case, text_of(case)) == []
    chosen = list(mutants(case))[CASES.index(case) :: EVERY]
    assert len({mutant.kind for mutant in chosen}) > 5
    for mutant in chosen:
        assert mutant.where is not None
        low, high = mutant.where
        assert any(low <= line <= high for line, _ in named_in(case, mutant.lines)), mutant.kind
