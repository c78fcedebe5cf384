"""The comparison of direct and smoothed motion, and published paths."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import get_args

import numpy as np
import pytest
from linear_programmes import reference_time

from cornersmooth.cl import read
from cornersmooth.feedrate import Limits, TimeLaw, direct, plan
from cornersmooth.feedrate.planner import Baseline
from cornersmooth.model import Program
from cornersmooth.settings import METHODS, Settings
from cornersmooth.smoothing import smooth
from cornersmooth.times import BASELINES, Comparison
from oracle.share import share

TABLE_1 = Path(__file__).resolve().parents[2] / "samples" / "paper_table1.csv"

#: file, units, feed and limits, ε, H, and the published or independently computed times: exact stop, and smoothed with
#: a standstill of the acceleration at every corner, which ours must not exceed by more than 3 %
PUBLISHED = {
    "tulsyan": (
        "cnclite_tulsyan_altintas.apt",
        {"feed": 1200.0, "accel": 150.0, "jerk": 3000.0},
        0.05,
        10.0,
        11.892,
        6.998,
    ),
    "fan": (
        "hust_5x_toolpath_fan.txt",
        {"feed": 3000.0, "accel": 300.0, "jerk": 3000.0, "period": 0.001},
        0.02,
        50.0,
        13.379,
        10.55,
    ),
    "iso_s": (
        "cnclite_iso_S_test.apt",
        {"feed": 3000.0, "accel": 200.0, "jerk": 2000.0, "period": 0.0044},
        0.04,
        10.0,
        8.605,
        4.671,
    ),
}


def compare(program: Program, settings: Settings, limits: Limits) -> Comparison:
    """The path with stops and with jumps of velocity, and the ideal curves of every method."""
    laws = {
        base: direct(program, limits, kind, settings=settings)
        for base, kind in zip(BASELINES, get_args(Baseline), strict=True)
    }
    for name in METHODS:
        laws[name] = plan(smooth(program, settings.but(method=name)), limits)
    return Comparison(program, settings, limits, laws)


def read_table_1() -> Program:
    return read(TABLE_1)


@pytest.mark.parametrize("tolerance", [0.078, 0.15])
def test_paper_table_1(tolerance: float) -> None:
    compared = compare(read_table_1(), Settings(tolerance=tolerance), Limits(feed=1800.0))
    seconds = compared.seconds
    assert seconds["direct_exact_stop"] == pytest.approx(0.778, abs=5e-4)
    assert compared.constant_feed_seconds == pytest.approx(0.278, abs=5e-4)
    assert compared.constant_feed_seconds < seconds["proportional"] < 0.468
    assert seconds["zhang2016"] < 0.468
    assert seconds["proportional"] < seconds["direct_velocity_jump"] < seconds["direct_exact_stop"]


def keeps(law: TimeLaw, fastest: float) -> bool:
    """Whether a law keeps its limits at the multiples of the period, with a feed of at most so many mm/min."""
    states, limits = law.at(law.every_period()), law.limits
    bounds = (
        (states.v[~states.turning], fastest / 60.0),
        (states.a[~states.turning], limits.accel),
        (states.centripetal[~states.turning], limits.accel),
        (states.j[~states.turning], limits.jerk),
        (np.degrees(states.v[states.turning]), limits.angular_feed),
    )
    return all(np.abs(values).max(initial=0.0) <= 1.001 * most for values, most in bounds)


@pytest.mark.corpus
@pytest.mark.parametrize("case", share(PUBLISHED, 2))
def test_published_paths(corpus: Path, case: str) -> None:
    name, given, tolerance, height, stop, smoothed_time = PUBLISHED[case]
    units = {"units": "mm"} if name.endswith(".txt") else {}
    program, limits = read(corpus / name, **units), Limits(**given)
    assert direct(program, limits).total == pytest.approx(stop, abs=1e-3)
    law = plan(smooth(program, Settings(tolerance=tolerance, axis_length=height)), limits)
    reference = reference_time(law.path, limits)
    assert 0.995 * reference <= law.total <= 1.03 * reference
    assert law.total <= 1.03 * smoothed_time
    assert keeps(law, limits.feed)


@pytest.mark.corpus
@pytest.mark.parametrize(
    "name",
    share(
        (
            "hust_5x_impeller_yelun.cls",
            "nx_clsf_cutcom_arcs.cls",
            "nx_clsf_varcontour5x_ust_a.cls",
            "hecc_flank_nx.cls",
            "hust_5x_PathPointsFile.cls",
        ),
        3,
    ),
)
def test_limits_on_real_files(corpus: Path, name: str) -> None:
    limits = Limits(feed=1800.0)
    compared = compare(read(corpus / name), Settings(), limits)
    for law in compared.laws.values():
        assert keeps(law, limits.rapid)
        assert law.total >= compared.constant_feed_seconds * 0.99


def test_contents(chain: Callable[[int], Program]) -> None:
    compared = compare(chain(2), Settings(tolerance=0.05), Limits())
    contents = json.loads(json.dumps(compared.as_dict(), allow_nan=False))
    assert list(contents["seconds"]) == [
        "direct_exact_stop",
        "direct_velocity_jump",
        "zhang2016",
        "proportional",
        "global",
    ]
    saved = contents["saving_percent"]["proportional"]["direct_exact_stop"]
    seconds = contents["seconds"]
    assert saved == pytest.approx(100 * (1 - seconds["proportional"] / seconds["direct_exact_stop"]))
