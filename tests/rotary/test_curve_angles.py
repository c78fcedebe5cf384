"""Angles of whole runs on the knots of the curves: bounds, knots, joints, poles, limits; the text by the oracle."""

from __future__ import annotations

import io
import itertools
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BSpline

import cornersmooth
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.kinematics import Machine, load_machine
from cornersmooth.model import Program, Runs
from cornersmooth.nc import Form, choose_form, fit_settings
from cornersmooth.rotary import rotary_angles
from cornersmooth.rotary.curve_angles import CurveAngles, Curves, Guide, curve_angles
from cornersmooth.smoothing.runs.rows import line_places, polylines_of
from nc.cases import MACHINES, Case
from nc.promise import random_verdict
from nc.rotations import machine_letters, tool_direction
from oracle.motion import unit
from oracle.share import covering_share, how_many, share

SAMPLES = Path(__file__).parents[2] / "samples"
FORMS = {"fanuc": "g6.2", "siemens": "bspline", "heidenhain": "spl"}
CASES = [Case(control, form, machine) for machine in MACHINES for control, form in FORMS.items()]


def waves(count: int = 60, tilt: float = 0.4) -> Program:
    """A calm path on which both axes of every machine turn; `tilt` is where the tool leans to, in its mean."""
    t = np.linspace(0.0, 3.0, count)
    tip = np.stack((30 * np.cos(t), 30 * np.sin(t), 2 * np.sin(3 * t)), axis=1)
    axis = unit(np.stack((tilt + 0.2 * np.cos(2 * t), 0.3 * np.sin(t), np.ones(count)), axis=1))
    return Program.from_poses(np.round(tip, 4), axis, feed=800.0)


def form_of(control: str, machine: str | Machine) -> Form:
    chosen = load_machine(machine) if isinstance(machine, str) else machine
    return choose_form(control, FORMS[control], machine=chosen)


def smoothed_runs(program: Program, form: Form, tolerance: float = 0.01) -> tuple[cornersmooth.SmoothProgram, Runs]:
    settings = fit_settings(cornersmooth.Settings(method="global", tolerance=tolerance), form, "mm")
    smoothed = cornersmooth.smooth(program, settings)
    assert smoothed.runs is not None
    return smoothed, smoothed.runs


def guide_of(
    program: Program, runs: Runs, smoothed: cornersmooth.SmoothProgram, machine: Machine, cone: float
) -> Guide:
    """Angles at the places of the lines of one run."""
    from cornersmooth.smoothing.runs.rows import points_at

    lines = polylines_of(runs, program, smoothed.settings.axis_length)
    places = line_places(runs, lines, smoothed.program, smoothed.settings)
    tip, axis = points_at(runs.control, Splines(runs.knot, runs.knot_count), places.span, places.s)
    tip, axis = np.vstack((program.tip[:1], tip)), np.vstack((program.axis[:1], axis))
    path = rotary_angles(machine, tip, axis, tolerance=cone)
    s = np.append(0.0, places.s)
    return Guide(np.zeros(len(s), np.int64), s, path.angles, path.branch.astype(np.int64))


def fitted(runs: Runs, machine: Machine, guide: Guide, *, tolerance: float, cone: float) -> CurveAngles:
    """Angles of one run."""
    control = runs.control
    points = np.hstack((control[:, :3], control[:, 3:] - control[:, :3], np.ones((len(control), 1))))
    ends = np.full((2, 1, 3, 2), np.nan)
    ends[:, 0, 0] = guide.angles[[0, -1]]
    curves = Curves(Splines(runs.knot, runs.knot_count), points, ends, np.array([tolerance]))
    return curve_angles(curves, machine, guide, cone=cone)


def off_the_lever(found: CurveAngles, name: str) -> np.ndarray:
    """(spans, 60) degrees between the axis that the angles give, by scipy, and the lever: closely in every span."""
    knot = found.curves.splines.knot
    knots = np.concatenate(([knot[0]] * 3, knot, [knot[-1]] * 3))
    share = np.linspace(0.0, 1.0, 60)
    s = knot[:-1, None] + np.diff(knot)[:, None] * share
    words = BSpline(knots, found.angles, 3)(s.ravel())
    names = load_machine(name).names
    axis = unit(tool_direction(name, dict(zip(names, words.T, strict=True))))
    lever = unit(BSpline(knots, found.curves.points[:, 3:6], 3)(s.ravel()))
    return np.degrees(2 * np.arcsin(np.linalg.norm(axis - lever, axis=1) / 2)).reshape(s.shape)


@pytest.mark.parametrize("name", covering_share(MACHINES, 3))
@pytest.mark.parametrize("tolerance", [0.04, 2e-7])
def test_bounds_hold_and_knots_are_put_in_until_the_tolerance_is_kept(name: str, tolerance: float) -> None:
    program, machine = waves(), load_machine(name)
    smoothed, runs = smoothed_runs(program, form_of("fanuc", name))
    assert len(runs) == 1
    found = fitted(runs, machine, guide_of(program, runs, smoothed, machine, 1e-3), tolerance=tolerance, cone=1e-3)
    assert (found.error <= tolerance).all()
    off = off_the_lever(found, name).max(axis=1)
    assert (off <= found.error).all()
    assert off.max() > 1e-8  # something has been measured
    more = len(found.curves.splines.knot) - len(runs.knot)
    assert (more == 0) == (tolerance == 0.04), more
    # the curves have stayed what they were
    before, after = (
        BSpline(np.concatenate(([knot[0]] * 3, knot, [knot[-1]] * 3)), tip, 3)
        for knot, tip in ((runs.knot, runs.control[:, :3]), (found.curves.splines.knot, found.curves.points[:, :3]))
    )
    s = np.linspace(0.0, runs.knot[-1], 500)
    np.testing.assert_allclose(after(s), before(s), atol=1e-9)


def test_spans_that_ask_for_too_many_samples_are_not_proved() -> None:
    """Through the pole itself both axes jump: no bound is given, none is guessed."""
    t = np.linspace(-1.0, 1.0, 30)
    axis = unit(np.stack((0.3 * t, 1e-3 + 0 * t, np.ones(30)), axis=1))
    program = Program.from_poses(np.stack((20 * t, t**2, 0 * t), axis=1), axis, feed=500.0)
    machine = load_machine("table-ac")
    smoothed, runs = smoothed_runs(program, form_of("fanuc", "table-ac"))
    found = fitted(runs, machine, guide_of(program, runs, smoothed, machine, 1e-6), tolerance=1e-4, cone=1e-6)
    good = found.error <= 1e-4
    assert good.any()
    assert not good.all()
    off = off_the_lever(found, "table-ac").max(axis=1)
    assert (off <= found.error).all()


def text_of(program: Program, form: Form, tolerance: float = 0.01) -> tuple[str, cornersmooth.Result]:
    out = io.BytesIO()
    settings = cornersmooth.Settings(method="global", tolerance=tolerance)
    result = cornersmooth.postprocess(program, out, settings, form=form)
    assert result.verification is not None
    assert result.verification.passed
    return out.getvalue().decode(), result


@pytest.mark.parametrize("case", covering_share(CASES, 3), ids=str)
def test_random_chains_keep_the_tolerance(case: Case) -> None:
    """By strict readers and rotations that share no code with the program."""
    tolerance = 0.05
    settings = cornersmooth.Settings(method="global", tolerance=tolerance)
    found = random_verdict(case, settings, 40 + MACHINES.index(case.machine), how_many(2, 8))
    assert found.deviation.worst <= tolerance, found


@pytest.mark.parametrize("control", ["fanuc", "siemens"])
def test_a_calm_run_is_curves_alone_with_fewer_blocks_than_poses(control: str) -> None:
    program = waves(200)
    text, result = text_of(program, form_of(control, "nutated-bc"))
    assert "CS378" not in {finding.code for finding in result.written.findings}
    assert text.count("G1 ") <= 1
    assert result.written.blocks < 150
    letters = machine_letters("nutated-bc")
    curved = [line for line in text.splitlines() if " PL=" in line or re.search(r"K[\d.]+ X", line)]
    assert all(re.search(rf" {letter}-?[\d.]+", line) for line in curved for letter in letters)
    assert any(finding.code == "CS370" for finding in result.written.findings)


def test_blocks_in_rotary_words_are_hardly_more_than_with_second_points() -> None:
    program, blocks = cornersmooth.read(SAMPLES / "impeller.cls"), []
    for machine in (load_machine("table-ac"), None):
        form, settings = choose_form("fanuc", "g6.2", machine=machine), cornersmooth.Settings(method="global")
        blocks.append(cornersmooth.postprocess(program, io.BytesIO(), settings, form=form, verify=False).written.blocks)
    assert blocks[0] <= 1.32 * len(program)
    assert blocks[0] <= 1.07 * blocks[1]


def test_sections_of_angles_meet_with_their_first_two_derivatives() -> None:
    from cornersmooth.smoothing.runs.rows import section_rows

    program, machine = waves(900, tilt=0.6), load_machine("table-ac")
    smoothed, runs = smoothed_runs(program, form_of("siemens", "table-ac"), tolerance=0.0001)
    guide = guide_of(program, runs, smoothed, machine, 1e-3)
    found = fitted(runs, machine, guide, tolerance=1e-3, cone=1e-3)
    splines, control = found.curves.splines, np.hstack((found.curves.points[:, :3], found.angles))
    rows = section_rows(replace(runs, knot=splines.knot, knot_count=splines.count, control=control), program)
    begin = np.flatnonzero(rows.number == 1)
    assert len(begin) > 1
    sections = []
    for start, end in zip(begin, np.append(begin[1:], len(rows.number)), strict=True):
        knots = np.concatenate((rows.knot[start:end], [rows.last_knot[end - 1]] * 4))
        sections.append(BSpline(knots, rows.points[start:end], 3))
    for one, other in itertools.pairwise(sections):
        for order in (0, 1, 2):
            left, right = one(one.t[-1], nu=order), other(0.0, nu=order)
            np.testing.assert_allclose(left, right, rtol=1e-9, atol=1e-9 * max(1.0, np.abs(left).max()))


def test_near_the_pole_lines_take_the_place_of_curves_that_cannot_follow() -> None:
    t = np.linspace(-1.0, 1.0, 400)
    axis = unit(np.stack((0.6 * t, 2e-4 + 0 * t, np.ones(400)), axis=1))
    program = Program.from_poses(np.stack((80 * t, 10 * t**2, 3 * np.sin(9 * t)), axis=1), axis, feed=500.0)
    text, result = text_of(program, form_of("fanuc", "table-ac"), tolerance=0.002)
    assert sum(finding.count for finding in result.written.findings if finding.code == "CS378") >= 1
    assert text.count("G6.2") >= 1
    assert text.count("G1 ") >= 10


def test_a_limit_that_control_points_pass_is_kept_by_lines() -> None:
    program = waves(80)
    machine = load_machine("table-ac")
    text, _ = text_of(program, form_of("fanuc", machine))
    words = [float(found) for found in re.findall(r" A(-?[\d.]+)", text)]
    largest = max(words, key=abs)
    first, second = machine.axes
    tilting = first if first.name == "A" else second
    # the limit is where the farthest control point stands, a hair inside
    edge = abs(largest) - 1e-3
    limits = (-edge, tilting.limits[1]) if largest < 0 else (tilting.limits[0], edge)  # type: ignore[index]
    axes = tuple(replace(axis, limits=limits) if axis.name == "A" else axis for axis in machine.axes)
    narrow = replace(machine, axes=axes)
    try:
        text, result = text_of(program, form_of("fanuc", narrow))
    except InputError as refusal:  # the path itself goes there
        assert refusal.code == "CS362"  # noqa: PT017
        return
    low, high = limits
    assert all(low <= float(found) <= high for found in re.findall(r" A(-?[\d.]+)", text))
    assert result.verification is not None


def test_weights_are_refused_where_splines_have_rotary_words() -> None:
    settings = cornersmooth.Settings(weights=(2.0, 1.0))
    with pytest.raises(SettingsError, match="weights 1 only"):
        fit_settings(settings, form_of("siemens", "table-ac"), "mm")


def changed(line: str, word: str, value: float) -> str:
    """The line with another number behind a word of one letter."""
    return re.sub(rf"( |^){word}-?[\d.]+", lambda found: f"{found[1]}{word}{value:.4f}", line)


def mutants(lines: list[str], at: int, letter: str) -> dict[str, list[str]]:
    """Texts with one fault in the control point of a line, which is not the first of its curve nor beside an end."""
    line, following = lines[at : at + 2]
    knot = "PL=" if " PL=" in line else "K"
    step = re.search(rf"{knot}[\d.]+", line)[0]  # type: ignore[index]
    angle = float(re.search(rf" {letter}(-?[\d.]+)", line)[1])  # type: ignore[index]
    found = {
        "an angle that is off": [changed(line, letter, angle + 1.0), following],
        "a whole turn": [changed(line, letter, angle + 360.0), following],
        "a missing word": [re.sub(rf" {letter}-?[\d.]+", "", line), following],
        "a missing knot": [line.replace(step, "").strip(), following],
        "a knot that is off": [line.replace(step, f"{knot}{100.0 * float(step.removeprefix(knot)):g}"), following],
        "an exchange of control points": [following, line],
    }
    return {name: [*lines[:at], *pair, *lines[at + 2 :]] for name, pair in found.items()}


@pytest.mark.parametrize("control", share(["fanuc", "siemens"], 2, 1))
def test_faults_in_control_points_of_angles_are_found(control: str) -> None:
    program, form = waves(9), form_of(control, "table-ac")
    lines = text_of(program, form)[0].splitlines()
    curved = [k for k, line in enumerate(lines) if " PL=" in line or re.match(r"K[\d.]+ X", line)]

    def passes(text: list[str]) -> bool:
        data = ("\n".join(text) + "\n").encode()
        return cornersmooth.verify(program, data, tolerance=0.01, control=control, machine=form.machine).passed

    assert passes(lines)
    letter = {"fanuc": "A", "siemens": "C"}[control]
    words = [float(re.search(rf" {letter}(-?[\d.]+)", lines[k])[1]) for k in curved]  # type: ignore[index]
    steep = int(np.argmax(np.abs(np.diff(words[2:-3])))) + 3  # where leaving the word out is most
    points = np.array([[float(re.search(rf"{x}(-?[\d.]+)", lines[k])[1]) for x in "XYZ"] for k in curved])  # type: ignore[index]
    bend = np.linalg.norm(np.diff(points, 2, axis=0), axis=1)
    sharp = np.argsort(-bend[2:-3])[:5] + 3  # on a straight line, and in some corners, a knot may be anywhere
    assert not all(passes(mutants(lines, curved[k], letter)["a knot that is off"]) for k in sharp)
    for name, text in mutants(lines, curved[steep], letter).items():
        assert text != lines, name
        assert name == "a knot that is off" or not passes(text), (name, lines[curved[steep]])
    if control == "siemens":
        assert not passes([line for line in lines if not line.startswith("SPLINEPATH")])
        assert not passes([line.replace("SPLINEPATH(1,X,Y,Z,A,C)", "SPLINEPATH(1,X,Y,Z)") for line in lines])
