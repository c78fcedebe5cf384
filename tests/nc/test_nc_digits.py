"""Digits of the text: what each control takes, what is asked for, and that ε holds for the written numbers."""

from __future__ import annotations

import io
import re
from dataclasses import replace

import numpy as np
import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import Form, choose_form, load_control, parse_control
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.grammars import reader

#: control, form, machine, and decimals of X and of the last word in mm
AGREED = (
    ("fanuc", "g1", "", "", 4, 7),
    ("fanuc", "g1", "", "3", 3, 7),
    ("fanuc", "g1", "table-ac", "IS-B", 3, 3),
    ("fanuc", "g1", "table-ac", "is-e", 6, 6),
    ("fanuc", "g6.2", "", "IS-B", 3, 3),
    ("fanuc", "g6.2", "", "IS-D", 5, 5),
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
    path = program(units)
    if form.orientation == "fixed":
        path = replace(path, axis=np.tile((0.0, 0.0, 1.0), (len(path), 1)))
    result = postprocess(path, stream, Settings(tolerance=tolerance, method="proportional"), form=form, processes=1)
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
    chosen = choose_form("heidenhain", "spl", digits="3")
    text = written(chosen)
    assert text.count(" SPL ") > 10
    read = reader("heidenhain", "spl", "", True, "mm", "3").read(text, 10.0, 0.02)
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
        settings = Settings(tolerance=0.02, axis_length=length, method="proportional")
        form = choose_form("fanuc", "g6.2")
        assert form.stretch(length) * length == pytest.approx(lever)
        postprocess(program(), stream, settings, form=form, processes=1)
        numbers = re.findall(r"^G1 X(\S+) Y(\S+) Z(\S+) U(\S+) V(\S+) W(\S+)", stream.getvalue().decode(), re.MULTILINE)
        points = np.array(numbers, np.float64)
        reach = np.linalg.norm(points[:, 3:] - points[:, :3], axis=1)
        # chords of the sphere between two poses are shorter than its radius
        assert reach.max() <= lever + 1e-3
        assert reach.min() > 0.98 * lever


def vectors(text: str) -> np.ndarray:
    numbers = re.findall(r"^G1 .*I(\S+) J(\S+) K(\S+)", text, re.MULTILINE)
    assert len(numbers) > 20
    return np.array(numbers, np.float64)


@pytest.mark.parametrize("control", ["fanuc", "mitsubishi"])
@pytest.mark.parametrize(("digits", "decimals"), [("IS-B", 3), ("IS-C", 4), ("IS-D", 5), ("IS-E", 6)])
@pytest.mark.parametrize("units", ["mm", "inch"])
def test_vectors_lose_nothing_where_the_control_rounds_them_to_its_increment(
    control: str, digits: str, decimals: int, units: str
) -> None:
    """Seven digits of a direction: at the axis point, 10 mm away, they are worth less than a millionth of a mm."""
    long = vectors(written(choose_form(control, digits=digits), units))
    length = np.linalg.norm(long, axis=1)
    assert np.abs(length - 10.0 ** (7 - decimals)).max() <= np.sqrt(3) / 2 * 10.0**-decimals
    assert np.array_equal(np.round(long, decimals), long)
    exact = np.concatenate((program().axis, -program().axis))
    apart = np.linalg.norm(long[:, None] / length[:, None, None] - exact[None], axis=2).min(axis=0)
    assert 0.0 < 10.0 * apart[: len(program())][[0, -1]].max() < 1e-6


def test_a_unit_vector_that_the_control_rounds_turns_the_tool_by_far_more() -> None:
    plain = vectors(written(choose_form("fanuc")))
    cut = np.round(plain, 3)
    off = 10.0 * np.linalg.norm(cut / np.linalg.norm(cut, axis=1, keepdims=True) - plain, axis=1)
    assert off.max() > 0.003


@pytest.mark.parametrize(("length", "decimals"), [(0.1, 7), (3.0, 6), (1000.0, 4), (1234.5, 3)])
def test_length_of_vectors_is_of_no_account_when_read(length: float, decimals: int) -> None:
    text = written(choose_form("fanuc"))

    def longer(match: re.Match[str]) -> str:
        return f"{match[1]}{length * float(match[2]):.{decimals}f}"

    other = re.sub(r"(?<= )([IJK])(\S+)", longer, text)
    assert other != text
    found = verify(program(), other.encode(), tolerance=0.02, axis_length=10.0, control="fanuc")
    assert found.passed, found.problems


@pytest.mark.parametrize("digits", ["IS-B", "IS-C", "IS-E"])
def test_a_long_vector_that_is_wrong_is_found(digits: str) -> None:
    lines = written(choose_form("fanuc", digits=digits)).splitlines()
    length = load_control("fanuc").systems[digits].vector_length
    places = [k for k, line in enumerate(lines) if line.startswith("G1 ")]
    for place in (places[3], places[len(places) // 2], places[-2]):
        wrong = re.sub(r" I(\S+)", lambda found: f" I{float(found[1]) + 0.01 * length:.3f}", lines[place])
        text = "\n".join([*lines[:place], wrong, *lines[place + 1 :]])
        found = verify(program(), text.encode(), tolerance=0.02, axis_length=10.0, control="fanuc")
        assert not found.passed


def test_length_of_vectors_has_to_be_one_at_least() -> None:
    with pytest.raises(SettingsError, match=r"digits.vector_length is 0\nhint: give a whole number from 1 to 1000000"):
        parse_control("like = 'fanuc'\n[digits]\nvector_length = 0\n")


def test_systems_are_those_of_the_table() -> None:
    assert list(load_control("fanuc").systems) == ["IS-B", "IS-C", "IS-D", "IS-E"]
    fanuc = load_control("fanuc")
    assert replace(fanuc.systems["IS-C"], vector=7, vector_length=1) == fanuc.digits
    assert not load_control("siemens").systems
