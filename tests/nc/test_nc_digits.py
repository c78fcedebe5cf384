"""Digits of the text: what each control takes, what is asked for, and that ε holds for the written numbers."""

from __future__ import annotations

import io
import re

import numpy as np
import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import Form, choose_form, fit_settings, load_control, write
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from nc.grammars import reader

#: control, form, machine, and decimals of X and of the last word in mm
AGREED = (
    ("fanuc", "g1", "", "", 4, 7),
    ("fanuc", "g1", "", "3", 3, 7),
    ("fanuc", "g1", "table-ac", "IS-B", 3, 3),
    ("fanuc", "g1", "table-ac", "is-e", 6, 6),
    ("fanuc", "g6.2", "", "IS-B", 3, 3),
    ("fanuc", "g6.2", "", "IS-D", 5, 5),
    ("fanuc", "g6.2", "table-ac", "IS-D", 5, 5),
    ("mitsubishi", "g1", "head-ac", "IS-B", 3, 3),
    ("siemens", "bspline", "", "", 6, 6),
    ("siemens", "bspline", "", "3", 3, 3),
    ("siemens", "poly", "", "5", 5, 5),
    ("linuxcnc", "g1", "xyzac-trt", "", 6, 6),
    ("linuxcnc", "g1", "xyzac-trt", "4", 4, 6),
    ("generic", "g6.2", "", "8", 8, 8),
    ("heidenhain", "g1", "", "3", 3, 8),
)


def program(units: str = "mm") -> Program:
    u = np.arange(12) / 3.0
    tip = np.stack((20.0 * u, 10.0 * np.sin(u), np.cos(2.0 * u)), axis=1)
    axis = np.stack((0.2 * np.sin(u), 0.1 * np.cos(1.3 * u), np.ones(12)), axis=1)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return Program.from_poses(tip, axis, feed=3000.0, units=units)


def written(form: Form, units: str = "mm", tolerance: float = 0.02) -> str:
    stream = io.BytesIO()
    result = postprocess(program(units), stream, Settings(tolerance=tolerance), form=form, processes=1)
    assert result.verification is not None
    assert result.verification.passed
    assert not result.unverified
    return stream.getvalue().decode()


def decimals(text: str, word: str) -> set[int]:
    return {len(found) for found in re.findall(rf"^G1 .*\b{word}[-+]?\d+\.(\d+)", text, re.MULTILINE)}


@pytest.mark.parametrize(("control", "form", "machine", "digits", "tip", "other"), AGREED)
def test_text_has_the_digits_asked_for_and_is_verified(
    control: str, form: str, machine: str, digits: str, tip: int, other: int
) -> None:
    chosen = choose_form(control, form, machine=load_machine(machine) if machine else None, digits=digits)
    text = written(chosen).replace("LN ", "G1 ").replace("\nPOLY", "\nG9")
    text = re.sub(r"(?m)^\d+ (?=G1 )", "", text)
    assert decimals(text, "X") == {tip}
    assert decimals(text, chosen.other_words[-1]) == {other}


def test_splines_of_few_digits_begin_where_the_block_before_ended() -> None:
    """A micrometre is allowed, half of which the rounding of an end to three decimals may be."""
    chosen = choose_form("heidenhain", "spl", machine=load_machine("xyzac-trt"), digits="3")
    text = written(chosen)
    assert text.count(" SPL ") > 10
    read = reader("heidenhain", "spl", "xyzac-trt", True, "mm", "3").read(text, 10.0, 0.02)
    assert len(read.pieces) > 20


@pytest.mark.parametrize(("control", "tip"), [("fanuc", 5), ("siemens", 7)])
def test_inches_have_one_more(control: str, tip: int) -> None:
    assert decimals(written(choose_form(control), "inch"), "X") == {tip}


@pytest.mark.parametrize("digits", ["0", "7", "-3", "IS-A", "six", "333"])
def test_other_digits_are_refused(digits: str) -> None:
    with pytest.raises(SettingsError, match="use IS-B, IS-C, IS-D, IS-E, or a number of decimals up to 6"):
        choose_form("fanuc", digits=digits)


def test_digits_too_coarse_for_the_tolerance_are_refused() -> None:
    with pytest.raises(SettingsError, match="finer than the written digits"):
        written(choose_form("fanuc", digits="2"), tolerance=0.005)


def test_a_second_point_stands_a_hundred_millimetres_up_the_axis_or_farther() -> None:
    for length, lever in ((10.0, 100.0), (150.0, 150.0)):
        stream = io.BytesIO()
        settings = Settings(tolerance=0.02, axis_length=length)
        form = choose_form("fanuc", "g6.2")
        assert form.stretch(length) * length == pytest.approx(lever)
        postprocess(program(), stream, settings, form=form, processes=1)
        numbers = re.findall(r"^G1 X(\S+) Y(\S+) Z(\S+) U(\S+) V(\S+) W(\S+)", stream.getvalue().decode(), re.MULTILINE)
        points = np.array(numbers, np.float64)
        reach = np.linalg.norm(points[:, 3:] - points[:, :3], axis=1)
        # chords of the sphere between two poses are shorter than its radius
        assert reach.max() <= lever + 1e-3
        assert reach.min() > 0.98 * lever


def test_systems_are_those_of_the_table() -> None:
    assert list(load_control("fanuc").systems) == ["IS-B", "IS-C", "IS-D", "IS-E"]
    assert load_control("fanuc").systems["IS-C"] == load_control("fanuc").digits
    assert not load_control("siemens").systems


@pytest.mark.parametrize(("digits", "said"), [("IS-B", True), ("", False), ("IS-E", False)])
def test_digits_that_bend_short_curves_are_named(digits: str, said: bool) -> None:
    """Segments of 0.3 mm: control points of transitions are 0.05 mm apart, 50 steps of IS-B and 500 of IS-C."""
    count = 40
    tip = np.cumsum(np.column_stack((np.full(count, 0.3), 0.1 * (np.arange(count) % 2), np.zeros(count))), axis=0)
    program = Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (count, 1)), feed=500.0)
    form = choose_form("fanuc", "g6.2", digits=digits)
    stream = io.BytesIO()
    found = write(smooth(program, fit_settings(Settings(), form, "mm")), stream, form=form).findings
    assert ("CS349" in {finding.code for finding in found}) == said
