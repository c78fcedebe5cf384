"""Rotary words as they are written: through the pole, without tool tip control, timed by inverse time."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cornersmooth.kinematics import Machine, load_machine, machine_names, tip_position, tool_axis
from cornersmooth.kinematics.poses import angle_between
from cornersmooth.model import Program
from cornersmooth.nc import Form, choose_form, fit_settings, write
from cornersmooth.nc.rotary_rows import LARGEST_TURN
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.share import covering_share

TOLERANCE, AXIS_LENGTH = 0.01, 10.0


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def over_the_pole(aside: float, bend: float, n: int = 21) -> Program:
    """The axis comes down to `aside` rad of the pole and leaves it on the other side, turned by `bend` degrees."""
    tilt = np.radians(np.linspace(-20, 20, n))
    way = np.radians(np.where(tilt < 0, 0.0, bend) + 33.0)
    axis = np.stack((np.sin(tilt) * np.cos(way), np.sin(tilt) * np.sin(way), np.cos(tilt)), axis=1)
    axis += aside * np.array([-np.sin(np.radians(33.0)), np.cos(np.radians(33.0)), 0])
    tip = np.stack((np.linspace(0, 60, n), 3 * np.sin(np.arange(n)), np.zeros(n)), axis=1)
    return Program.from_poses(tip, unit(axis), feed=np.full(n, 600.0))


def blocks(program: Program, form: Form) -> tuple[np.ndarray, np.ndarray, set[str]]:
    """Words X Y Z and both rotary ones in the order of the machine's axes, F of every G1, codes of findings."""
    smoothed = smooth(program, fit_settings(Settings(tolerance=TOLERANCE), form, "mm"))
    stream = io.BytesIO()
    found = write(smoothed, stream, form=form)
    assert form.machine is not None
    state, rows, feeds = dict.fromkeys("XYZABCF", np.nan), [], []
    for line in stream.getvalue().decode().splitlines():
        words = dict(re.findall(r"([XYZABCF])(-?[0-9.]+)", line))
        if line.startswith("G1 ") or (rows and words and re.match(r"[XYZABC]", line)):
            state.update({letter: float(number) for letter, number in words.items()})
            rows.append([state[letter] for letter in ("X", "Y", "Z", *form.machine.names)])
            feeds.append(float(words["F"]) if "F" in words else np.nan)
    return np.array(rows), np.array(feeds), {finding.code for finding in found.findings}


def endless(name: str) -> Machine:
    machine = load_machine(name)
    return replace(machine, axes=tuple(replace(axis, limits=None) for axis in machine.axes))


def farthest(machine: Machine, program: Program, tip: np.ndarray, words: np.ndarray) -> tuple[float, float]:
    """Largest distances of tip and axis point from the ruled motion of the program, each place from its nearest."""
    share = np.linspace(0, 1, 2001)[:, None, None]
    axis = unit(program.axis[:-1] * (1 - share) + program.axis[1:] * share)
    old_tip = (program.tip[:-1] * (1 - share) + program.tip[1:] * share).transpose(1, 0, 2).reshape(-1, 3)
    old = np.concatenate((old_tip, old_tip + AXIS_LENGTH * axis.transpose(1, 0, 2).reshape(-1, 3)), axis=1)
    new = np.concatenate((tip, tip + AXIS_LENGTH * tool_axis(machine, words)), axis=1)
    _, near = cKDTree(old).query(new)
    gap = old[near] - new
    return float(np.linalg.norm(gap[:, :3], axis=1).max()), float(np.linalg.norm(gap[:, 3:], axis=1).max())


@pytest.mark.parametrize(
    ("name", "aside", "bend"), covering_share(product(machine_names(), [0.0, 1e-9, 1e-4, 2e-3], [0.0, 90.0, 180.0]), 5)
)
def test_written_path_through_the_pole(name: str, aside: float, bend: float):
    """Within the tolerance all along the blocks, and no block turns an axis by more than the stated limit."""
    machine, program = endless(name), over_the_pole(aside, bend)
    rows, _, codes = blocks(program, choose_form("fanuc", "g1", machine=machine))
    step = np.abs(np.diff(rows[:, 3:], axis=0))
    assert step.max() <= LARGEST_TURN + 1e-5
    share = np.linspace(0, 1, 9)[:, None, None]
    along = (rows[:-1] * (1 - share) + rows[1:] * share).reshape(-1, 5)
    tip_error, axis_error = farthest(machine, program, along[:, :3], along[:, 3:])
    grain = 60 / 20 / 2000  # of the points that the original is sampled at
    assert tip_error <= TOLERANCE + grain
    assert axis_error <= TOLERANCE + grain
    assert "CS369" not in codes
    fast = bend == 90.0 or (bend == 0.0 and aside > 1e-4)
    assert "CS363" in codes or not fast or name == "nutated-bc"


@pytest.mark.parametrize("name", ["table-ac", "head-ac", "head-table-bc", "nutated-bc", "xyzbc-trt"])
@pytest.mark.parametrize("aside", [2e-3, 0.1])
def test_machine_positions_are_timed_for_the_tip(name: str, aside: float):
    """Without tool tip control: all five axes run evenly, the tip keeps its line, and F is one over the minutes."""
    plain = endless(name)
    axes = tuple(replace(axis, point=(11.0, -6.0, 140.0)) for axis in plain.axes)
    machine = replace(plain, axes=axes, tool_length=70.0, part_zero=(30.0, 20.0, -5.0))
    program = over_the_pole(aside, 0.0)
    rows, feeds, _ = blocks(program, choose_form("fanuc", "g1", machine=machine, tcp=False))
    share = np.linspace(0, 1, 9)[:, None, None]
    along = rows[:-1] * (1 - share) + rows[1:] * share
    flat = along.reshape(-1, 5)
    tip = tip_position(machine, flat[:, :3], flat[:, 3:])
    tip_error, axis_error = farthest(machine, program, tip, flat[:, 3:])
    grain = 60 / 20 / 2000
    assert tip_error <= TOLERANCE + grain
    assert axis_error <= TOLERANCE + grain
    # the tip at the ends of the blocks runs with 600 mm/min, unless an axis would turn faster than 36 000 deg/min
    ends = tip_position(machine, rows[:, :3], rows[:, 3:])
    length = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    turn = np.abs(np.diff(rows[:, 3:], axis=0)).max(axis=1)
    minutes = np.maximum(np.maximum(length / 600.0, turn / 36_000.0), 1.0 / 9999.999)  # F says no more
    timed = length > 0.05  # the rounding of the words counts in shorter blocks
    assert timed.sum() > 15
    assert not np.isnan(feeds[1:]).any()
    np.testing.assert_allclose(1 / feeds[1:][timed], minutes[timed], rtol=0.01)


def test_bound_of_the_angle_is_that_of_the_tolerance():
    """What is left to rotary words is a tenth of the tolerance at the axis point."""
    form = choose_form("fanuc", "g1", machine=load_machine("table-ac"))
    one, two = np.array([[0, 0, 1.0]]), unit(np.array([[0, np.radians(form.rotary_tolerance(0.01, 10.0)), 1.0]]))
    assert np.linalg.norm(10 * (one - two)) == pytest.approx(0.001, rel=1e-6)
    assert angle_between(one, two)[0] == pytest.approx(form.rotary_tolerance(0.01, 10.0))
