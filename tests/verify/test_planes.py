"""Random 3+2 programs in tilted planes of the control: no false alarm."""

from __future__ import annotations

import pytest

from oracle.share import how_many
from verify.plane_programs import judged, trial


@pytest.mark.parametrize("seed", [*range(how_many(8, 200)), 5005])
def test_random_programs_in_planes_are_right(seed: int) -> None:
    assert judged(trial(seed))[0] == ""
