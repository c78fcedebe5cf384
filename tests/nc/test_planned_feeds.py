"""Feeds of a plan in the text: never above the programmed ones, as fast as the plan, and verified as such."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import Limits, block_feeds, plan_text
from cornersmooth.frame import read_provenance
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import Form, choose_form
from cornersmooth.nc_reader import read_nc
from cornersmooth.pipeline import postprocess, reading_back
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from oracle.share import covering_share

CASES = (
    ("fanuc", "g1", "", True),
    ("fanuc", "g6.2", "", True),
    ("fanuc", "g1", "table-ac", False),
    ("siemens", "bspline", "", True),
    ("siemens", "poly", "", True),
    ("heidenhain", "g1", "", True),
    ("heidenhain", "g1", "table-ac", True),
    ("linuxcnc", "g1", "xyzac-trt", True),
    ("haas", "g1", "table-ac", True),
)
LIMITS = Limits(accel=500.0, jerk=5000.0)


def program(units: str = "mm") -> Program:
    """Corners of all angles, and a change of the feed."""
    u = np.arange(14) / 2.0
    tip = np.stack((4.0 * u, 3.0 * np.sin(2.0 * u), 0.2 * np.cos(2.0 * u)), axis=1)
    axis = np.stack((0.1 * np.sin(u), 0.3 + 0.05 * np.cos(1.3 * u), np.ones(14)), axis=1)
    whole = Program.from_poses(tip, axis / np.linalg.norm(axis, axis=1, keepdims=True), feed=6000.0, units=units)
    return replace(whole, feed=np.where(np.arange(14) > 8, 3000.0, whole.feed))


def form_of(control: str, form: str, machine: str, tcp: bool) -> Form:
    return choose_form(control, form, machine=load_machine(machine) if machine else None, tcp=tcp)


def made(form: Form, units: str = "mm", *, planned: bool = True) -> bytes:
    stream = io.BytesIO()
    limits = LIMITS if planned else None
    settings = Settings(tolerance=0.02, method="proportional" if form.curve == "g6.2" else "auto")
    result = postprocess(program(units), stream, settings, form=form, plan_feeds=limits, processes=1)
    assert result.verification is not None
    assert result.verification.passed
    return stream.getvalue()


@pytest.mark.parametrize(
    ("control", "form", "machine", "tcp", "units"),
    covering_share([(*case, units) for units in ("mm", "inch") for case in CASES], 9),
)
def test_blocks_have_the_mean_speed_of_the_plan(control: str, form: str, machine: str, tcp: bool, units: str) -> None:
    chosen = form_of(control, form, machine, tcp)
    back = reading_back(chosen)
    how = {key: value for key, value in back.items() if key not in ("trusted", "accepted")} | {"tolerance": 0.02}
    plain, text = (read_nc(made(chosen, units, planned=planned), **how) for planned in (False, True))
    np.testing.assert_array_equal(plain.tip, text.tip)
    axes = None if chosen.machine is None or not chosen.machine.dynamics else chosen.machine
    line, feed, _ = block_feeds(plan_text(plain, LIMITS, machine=axes))
    element = np.searchsorted(plain.line, line)
    said = text.feed[element]
    room = np.where(plain.least_feed[element], 10.0, plain.feed_room[element])
    assert (said <= plain.feed[element] * (1 + 1e-9) + room).all()
    known = ~np.isnan(feed)
    assert known.sum() > 10
    # four figures, or three decimals of inverse time
    np.testing.assert_allclose(said[known], np.minimum(feed, plain.feed[element])[known], rtol=2e-3, atol=0.05)
    assert said.min() < 0.9 * said.max()


def test_the_head_says_it_and_verification_goes_by_that() -> None:
    form = choose_form("fanuc")
    text = made(form)
    found = read_provenance(text)
    assert found is not None
    assert found.planned_feeds
    how = {"tolerance": 0.02}
    assert verify(program(), text, slower=True, **how).passed
    assert {problem.code for problem in verify(program(), text, **how).problems} == {"CS541"}
    plain = made(form, planned=False)
    before = read_provenance(plain)
    assert before is not None
    assert not before.planned_feeds
    faster = re.sub(rb"F6000\.", b"F6001.", plain)
    assert {problem.code for problem in verify(program(), faster, slower=True, **how).problems} == {"CS541"}
    no_feed = re.sub(rb" F[\d.]+", b"", plain)
    assert {problem.code for problem in verify(program(), no_feed, slower=True, **how).problems} == {"CS542"}
    stands = re.sub(rb"F6000\.", b"F0.", plain)
    assert "CS541" in {problem.code for problem in verify(program(), stands, slower=True, **how).problems}


def test_feeds_that_the_plan_reaches_stay_as_they_are() -> None:
    """A long line at a feed that it reaches at once needs no other word."""
    tip = np.array([[0.0, 0.0, 0.0], [400.0, 0.0, 0.0], [800.0, 0.0, 0.0]])
    line = Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (3, 1)), feed=300.0)
    stream = io.BytesIO()
    postprocess(line, stream, Settings(tolerance=0.02), form=choose_form("fanuc"), plan_feeds=Limits(), processes=1)
    assert set(re.findall(rb"F[\d.]+", stream.getvalue())) == {b"F300."}


def test_a_block_that_takes_no_time_has_a_feed() -> None:
    path = SimpleNamespace(
        rapid=np.array([False, False]),
        program=SimpleNamespace(line=np.array([7, 8])),
        move=np.array([0, 1]),
        turning=np.array([False, False]),
        length=np.array([100.0, 3.0]),
    )
    law = SimpleNamespace(path=path, edge=np.array([0.0, 1.0, 2.0]), times_at=lambda edge: np.array([0.0, 0.0, 6.0]))
    line, feed, minutes = block_feeds(law)  # type: ignore[arg-type]
    assert line.tolist() == [7, 8]
    assert np.isfinite(feed).all()
    assert (minutes > 0.0).all()
    assert feed[1] == pytest.approx(30.0)


def test_a_curve_of_g6_2_has_one_feed_in_its_first_block() -> None:
    """FANUC B-63324EN/03 4.17: F stands in the first block of a curve, so no curve of a whole run can have a plan's."""
    form, stream = choose_form("fanuc", "g6.2"), io.BytesIO()
    result = postprocess(program(), stream, Settings(tolerance=0.02), form=form, plan_feeds=LIMITS, processes=1)
    assert result.smoothed.settings.method == "proportional"
    blocks = [line for line in stream.getvalue().decode().splitlines() if line.startswith("K")]
    assert blocks
    assert not any("F" in line for line in blocks)
    with pytest.raises(SettingsError, match="one feed"):
        postprocess(program(), io.BytesIO(), Settings(method="global"), form=form, plan_feeds=LIMITS)
