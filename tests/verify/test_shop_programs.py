"""Random programs for limited axes, one axis and none: passed or refused for a reason, never falsely alarmed."""

from __future__ import annotations

import pytest

from oracle.share import how_many
from verify.shop_programs import outcome, shop_trial, with_options


@pytest.mark.parametrize("seed", range(how_many(5, 120)))
def test_random_programs_for_these_machines(seed: int) -> None:
    one = shop_trial(seed)
    word, why, _ = outcome(one)
    assert word in ("passed", "refused"), f"{one}: {why}"
    assert word == "passed" or "the method turns the tool" in why or "or give --rewind" in why, why


@pytest.mark.parametrize("seed", range(how_many(6, 60)))
def test_random_programs_with_options_of_all_kinds(seed: int) -> None:
    one = with_options(shop_trial(seed))
    word, why, _ = outcome(one)
    assert word in ("passed", "refused"), f"{one}: {why}"
