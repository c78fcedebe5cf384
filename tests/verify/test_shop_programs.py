"""Random programs for limited axes, one axis and none: passed or refused for a reason, never falsely alarmed."""

from __future__ import annotations

import io

import numpy as np
import pytest

from cornersmooth.kinematics import parse_machine
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from oracle.share import how_many
from verify.shop_programs import outcome, shop_trial, with_forms, with_options


@pytest.mark.parametrize("seed", range(how_many(3, 120)))
def test_random_programs_for_these_machines(seed: int) -> None:
    one = shop_trial(seed)
    word, why, _ = outcome(one)
    assert word in ("passed", "refused"), f"{one}: {why}"
    assert word == "passed" or "--method proportional turns the tool" in why or "or give --rewind" in why, why


def test_blocks_are_not_merged_past_a_corner_of_two_parameters() -> None:
    """Seed 251151: `zhang2016`, whose axis point is nearest to a corner at another row than the tip."""
    assert outcome(shop_trial(251151))[0] == "passed"


@pytest.mark.parametrize("seed", range(how_many(4, 60)))
def test_random_programs_with_options_of_all_kinds(seed: int) -> None:
    one = with_options(shop_trial(seed))
    word, why, _ = outcome(one)
    assert word in ("passed", "refused"), f"{one}: {why}"


@pytest.mark.parametrize("seed", range(how_many(3, 60)))
def test_random_programs_in_curves_and_neutral_text(seed: int) -> None:
    one = with_forms(shop_trial(seed))
    word, why, _ = outcome(one)
    assert word in ("passed", "refused"), f"{one}: {why}"


@pytest.mark.parametrize("tcp", [True, False])
def test_poses_a_little_beyond_one_axis_pass(tcp: bool) -> None:
    """Tool axes 0.01 degrees out of the plane that the axis turns them in: a tenth of what the tolerance is worth."""
    axis = {"name": "A", "direction": [1, 0, 0], "carrier": "table", "point": [0.0, 0.0, 0.0]}
    machine = parse_machine({"tool_length": 50.0, "axis": [axis]})
    turn = np.radians([0.0, 3.0, 8.0, 12.0, 9.0])
    beyond = np.radians([0.01, -0.01, 0.0, 0.01, -0.01])
    vectors = np.stack((np.sin(beyond), np.cos(beyond) * np.sin(turn), np.cos(beyond) * np.cos(turn)), axis=1)
    rows = [f"GOTO/{5 * k},{k % 2},0,{x:.7f},{y:.7f},{z:.7f}" for k, (x, y, z) in enumerate(vectors.tolist())]
    cl = "\n".join(["UNITS/MM", "LOADTL/1", "RAPID", rows[0], "FEDRAT/500,MMPM", *rows[1:], "FINI", ""])
    form = choose_form("fanuc", machine=machine, tcp=tcp)
    result = postprocess(cl.encode(), io.BytesIO(), Settings(tolerance=0.1, axis_length=10.0), form=form)
    assert result.verification is not None
    assert result.verification.problems == ()
