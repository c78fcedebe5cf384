"""What smoothing saves: both programs planned as they are written, or nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import cornersmooth
from cornersmooth.arrays import unit
from cornersmooth.feedrate import Limits, direct
from cornersmooth.kinematics import load_machine
from cornersmooth.kinematics.machine import Dynamics
from cornersmooth.model import Move, Program, Statement
from cornersmooth.nc import choose_form, fit_settings
from cornersmooth.settings import Settings
from cornersmooth.times import Timing, faster_method, planned_saving, written_text


def winding(count: int) -> Program:
    """A zigzag whose teeth grow along the path, with a rapid and a statement now and then."""
    x = np.arange(count) * 1.0
    tip = np.stack((x, np.where(np.arange(count) % 2, 0.3 + x / count, 0.0), 0.01 * x), axis=1)
    axis = np.stack((0.1 * np.sin(x / 40), 0.0 * x, np.ones(count)), axis=1)
    kind = np.where(np.arange(count) % 29 == 0, Move.RAPID, Move.LINEAR)
    return Program.from_poses(tip, axis, kind=kind, feed=1500.0, statements=(Statement(50, 51, "SPINDL", (100.0,)),))


@pytest.fixture(scope="module")
def program() -> Program:
    return winding(60)


def fitted(form, **more):
    return fit_settings(cornersmooth.Settings(tolerance=0.02, **more), form, "mm")


MACHINE = load_machine("table-ac")


@pytest.fixture(scope="module")
def whole(program):
    form = choose_form(machine=MACHINE)
    return planned_saving(program, fitted(form), form, Limits())


def test_both_programs_are_planned_with_the_axes_of_the_machine(program, whole):
    settings = fitted(choose_form(machine=MACHINE))
    before = direct(program, Limits(), "velocity_jump", settings=settings, machine=MACHINE).total
    assert whole.direct == pytest.approx(before, rel=1e-9)
    assert whole.written < whole.direct


def test_a_path_that_ends_where_its_from_is():
    """The first pose that a text goes to is not its last: all the time between them counts."""
    text = "FROM/0,0,99\nFEDRAT/MMPM,100\nRAPID\nGOTO/0,0,50\nGOTO/0,0,10\nRAPID\nGOTO/0,0,50\nGOHOME/0,0,99\nFINI\n"
    program, form = cornersmooth.read(text.encode()), choose_form(machine=MACHINE)
    found = planned_saving(program, fitted(form), form, Limits())
    assert found.direct > 24.0  # 40 mm at 100 mm/min
    assert found.written == pytest.approx(found.direct, abs=0.05)


@pytest.mark.parametrize("control", ["siemens", "heidenhain", "fanuc"])
def test_every_control(program, control):
    form = choose_form(control, machine=MACHINE)
    found = planned_saving(program, fitted(form), form, Limits())
    assert 0.0 < found.written < found.direct


def test_what_nobody_runs_gets_no_time(program):
    form = choose_form(machine=MACHINE)
    without = Program.from_poses(program.tip, program.axis)
    assert planned_saving(without, fitted(form), form, Limits()) is None
    assert planned_saving(without, fitted(form), form, Limits(feed=900.0)) is not None
    rapids = Program.from_poses(program.tip, program.axis, kind=np.full(len(program), Move.RAPID))
    assert planned_saving(rapids, fitted(form), form, Limits()) is None
    without_axes = choose_form()
    assert planned_saving(program, fitted(without_axes), without_axes, Limits()) is None


def test_limits_of_axes_leave_the_words_as_they_are(program, whole):
    """A program in tool vectors under limits of axes: the direct path takes what it takes in rotary words."""
    vectors = choose_form()
    found = planned_saving(program, fitted(vectors), vectors, Limits(), MACHINE)
    assert found.direct == pytest.approx(whole.direct, rel=1e-9)
    assert found.written != pytest.approx(whole.written, rel=1e-6)
    assert found.limits
    assert found.limits[0][1] <= 1.0


def test_linuxcnc_without_tip_control_has_no_time(program):
    # words of the axes were compared with tips: both times came out as 0.0 s
    form = choose_form("linuxcnc", machine=load_machine("xyzac-trt"), tcp=False)
    assert planned_saving(program, fitted(form), form) is None


def test_linuxcnc_takes_the_time_of_its_own_planner():
    """Of two lines of 10 mm, each from rest to rest, the second begins below the blend speed."""
    limits = replace(MACHINE, dynamics=tuple(Dynamics(name, 6e5, 1000.0, 1e6) for name in "XYZAC"))
    trunnion = replace(load_machine("xyzac-trt"), dynamics=limits.dynamics)
    form = choose_form("linuxcnc", machine=trunnion)
    tip = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]])
    axis = unit(np.array([[0.0, 0.1, 1.0], [0.0, 0.2, 1.0], [0.0, 0.3, 1.0]]))
    program = Program.from_poses(tip, axis, feed=3000.0)
    settings = fitted(form)
    found = planned_saving(program, settings, form, Limits())
    first = 10.0 / 50.0 + 50.0 / 500.0  # at 50 mm/s, 500 mm/s2
    last = 10.0 / 50.0 + 50.0 / 1000.0  # nothing follows that it would blend with
    overlap = 2.0 * np.sqrt(500.0 * 0.02 / np.cos(np.pi / 4.0)) / 500.0  # 2θ is the angle between the lines, 90 degrees
    assert found.direct == pytest.approx(first + last - overlap, rel=1e-3)
    assert "G64 P0.02" in found.against


def test_holes_count_on_neither_side(program, whole):
    """A hole that takes half a minute to drill makes no text slower than its CL file."""
    form = choose_form(machine=MACHINE)
    settings = fitted(form)
    last = program.tip[-1] + np.array([[5.0, 0.0, 30.0], [5.0, 0.0, 0.0]])
    holes = np.vstack((last, last[1:] + [9.0, 0.0, 0.0]))
    tip, axis = np.vstack((program.tip, holes)), np.vstack((program.axis, [[0.0, 0.0, 1.0]] * 3))
    kind = np.append(program.kind, [Move.RAPID, Move.HOLE, Move.HOLE])
    words = (Statement(len(program) + 2, 9, "CYCLE", ("DRILL", "DEPTH", 50.0, "MMPM", 100.0, "CLEAR", 2.0)),)
    drilled = Program.from_poses(tip, axis, kind=kind, feed=1500.0, statements=(*program.statements, *words))
    found = planned_saving(drilled, settings, form, Limits())
    assert found.direct - found.written == pytest.approx(whole.direct - whole.written, abs=0.1)


def row_of_bends(poses: int) -> Program:
    """Dense poses along a wave whose axis sways: curves of whole runs are faster there."""
    at = np.linspace(0.0, 1.0, poses)
    tip = np.stack((60.0 * at, 3.0 * np.sin(9.0 * at), np.cos(13.0 * at)), axis=1)
    axis = np.stack((0.4 * np.sin(5.0 * at) + 0.3, 0.5 * np.cos(7.0 * at), np.ones(poses)), axis=1)
    return Program.from_poses(np.round(tip, 3), axis, feed=1800.0)


def test_lines_have_the_method_whose_program_is_faster(monkeypatch: pytest.MonkeyPatch) -> None:
    program, form, axes = row_of_bends(120), choose_form("fanuc", "g1"), load_machine("table-ac")
    times = {}
    for method in ("proportional", "global"):
        settings = fit_settings(Settings(method=method), form, program.units)
        timing = Timing.of(form, settings, axes=axes)
        assert timing is not None
        times[method] = timing.written(written_text(program, settings, form), program)[0]
    assert times["global"] < 0.98 * times["proportional"]
    assert faster_method(program, Settings(), form, axes).method == "global"
    # a method that is named stays, and so does one whose program nobody times
    assert faster_method(program, Settings(method="zhang2016"), form, axes).method == "zhang2016"
    assert faster_method(row_of_bends(4001), Settings(), form, axes).method == "auto"
    of_linuxcnc = choose_form("linuxcnc", machine=load_machine("xyzac-trt"))
    assert faster_method(program, Settings(), of_linuxcnc, axes).method == "auto"
    monkeypatch.setattr("cornersmooth.times._FASTER", 0.5)
    assert faster_method(program, Settings(), form, axes).method == "auto"
