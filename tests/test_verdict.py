"""The verdicts and their order."""

from __future__ import annotations

import pytest

from cornersmooth.errors import Verdict


@pytest.mark.parametrize(
    ("how", "word"),
    [
        ({}, "PASSED"),
        ({"left_out": 3}, "INCOMPLETE"),
        ({"left_out": 3, "unverified": True}, "NOT VERIFIED"),
        ({"left_out": 3, "unverified": True, "problems": 1}, "FAILED"),
    ],
)
def test_the_worst_that_applies_is_the_verdict(how: dict[str, int], word: str) -> None:
    assert Verdict.of(**how) == word
