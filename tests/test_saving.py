"""What smoothing saves: of short programs planned, of long ones estimated."""

from __future__ import annotations

import numpy as np
import pytest

import cornersmooth
from cornersmooth.feedrate import Limits, direct, plan
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Arcs, Move, Program, Statement
from cornersmooth.nc import choose_form, fit_settings
from cornersmooth.saving import estimate_saving, feed_times
from oracle.share import share


def winding(count: int) -> Program:
    """A zigzag whose teeth grow along the path, with a rapid and a statement now and then."""
    x = np.arange(count) * 1.0
    tip = np.stack((x, np.where(np.arange(count) % 2, 0.3 + x / count, 0.0), 0.01 * x), axis=1)
    axis = np.stack((0.1 * np.sin(x / 40), 0.0 * x, np.ones(count)), axis=1)
    kind = np.where(np.arange(count) % 97 == 0, Move.RAPID, Move.LINEAR)
    return Program.from_poses(tip, axis, kind=kind, feed=1500.0, statements=(Statement(50, 51, "SPINDL", (100.0,)),))


@pytest.fixture(scope="module")
def program() -> Program:
    return winding(600)


def fitted(form, **more):
    return fit_settings(cornersmooth.Settings(tolerance=0.02, **more), form, "mm")


@pytest.fixture(scope="module")
def whole(program):
    form = choose_form()
    return estimate_saving(program, fitted(form), form, Limits(), poses=600, stretches=1)


def test_a_whole_program_is_planned(program, whole):
    settings, found = fitted(choose_form()), whole
    assert found.part == 1.0
    assert found.direct == pytest.approx(direct(program, Limits(), "velocity_jump", settings=settings).total, rel=1e-9)
    ideal = plan(cornersmooth.smooth(program, settings), Limits()).total
    # lines may jump in speed where they meet, curves may not: they can be a little faster
    assert ideal * 0.98 < found.written < found.direct


def test_a_path_that_ends_where_its_from_is():
    """The first pose that a text goes to is not its last: all the time between them counts."""
    text = "FROM/0,0,99\nFEDRAT/MMPM,100\nRAPID\nGOTO/0,0,50\nGOTO/0,0,10\nRAPID\nGOTO/0,0,50\nGOHOME/0,0,99\nFINI\n"
    program, form = cornersmooth.read(text.encode()), choose_form()
    found = estimate_saving(program, fitted(form), form, Limits(), poses=100, stretches=1)
    assert found.direct > 24.0  # 40 mm at 100 mm/min
    assert found.written == pytest.approx(found.direct, abs=0.05)


def test_stretches_tell_of_the_whole(program, whole):
    form = choose_form()
    settings = fitted(form)
    found = estimate_saving(program, settings, form, Limits(), poses=240, stretches=6)
    assert found.part == pytest.approx(0.4)
    assert found.direct == pytest.approx(whole.direct, rel=0.03)
    assert found.direct - found.written == pytest.approx(whole.direct - whole.written, rel=0.15)


@pytest.mark.parametrize("control", share(["siemens", "heidenhain"], 2))
def test_every_control(program, control):
    form = choose_form(control)
    found = estimate_saving(program, fitted(form), form, Limits(), poses=90, stretches=3)
    assert 0.0 < found.written < found.direct


def test_no_saving_is_told_for_linuxcnc(program):
    form = choose_form("linuxcnc", machine=load_machine("table-ac"))
    assert estimate_saving(program, fitted(form), form, Limits(), poses=90, stretches=3) is None


def test_curves_and_machines(program):
    curves = choose_form("fanuc", "g6.2")
    found = estimate_saving(program, fitted(curves), curves, Limits(), poses=90, stretches=3)
    assert 0.0 < found.written < found.direct
    turning = choose_form("fanuc", machine=load_machine("table-ac"))
    axes = estimate_saving(program, fitted(turning), turning, Limits(), poses=90, stretches=3)
    assert axes.written < axes.direct


def test_what_cannot_be_planned_is_not_told(program):
    form = choose_form()
    without = Program.from_poses(program.tip, program.axis)
    assert estimate_saving(without, fitted(form), form, Limits(), poses=90, stretches=3) is None
    assert estimate_saving(without, fitted(form), form, Limits(feed=900.0), poses=90, stretches=3) is not None
    rapids = Program.from_poses(program.tip, program.axis, kind=np.full(len(program), Move.RAPID))
    found = estimate_saving(rapids, fitted(form), form, Limits(), poses=90, stretches=3)
    assert found is None
    empty = Program.from_poses(np.zeros((0, 3)), np.zeros((0, 3)))
    assert estimate_saving(empty, fitted(form), form, Limits(), poses=90, stretches=3) is None


def test_arcs_stay_with_their_stretch():
    angle = np.linspace(0.0, 12.0, 241)
    tip = np.stack((10 * np.cos(angle), 10 * np.sin(angle), 0.2 * angle), axis=1)
    kind = np.full(241, Move.LINEAR)
    poses = np.arange(5, 241, 5)
    kind[poses] = Move.ARC
    up, centre = np.tile([0.0, 0.0, 1.0], (len(poses), 1)), np.zeros((len(poses), 3))
    program = Program.from_poses(
        tip,
        np.tile([0.0, 0.0, 1.0], (241, 1)),
        kind=kind,
        feed=1000.0,
        arcs=Arcs(poses, centre, up, np.full(len(poses), 0.05)),
    )
    form = choose_form()
    whole = estimate_saving(program, fitted(form), form, Limits(), poses=241, stretches=1)
    found = estimate_saving(program, fitted(form), form, Limits(), poses=120, stretches=4)
    # four stretches of 15 mm begin and end at rest
    assert whole.direct < found.direct < 1.15 * whole.direct


def test_times_at_programmed_feed():
    tip = [[0, 0, 0], [0, 0, 10], [30, 0, 10], [30, 40, 10]]
    kinds = np.array([Move.RAPID, Move.RAPID, Move.LINEAR, Move.LINEAR])
    program = Program.from_poses(tip, [[0, 0, 1]] * 4, kind=kinds, feed=[np.nan, np.nan, 600.0, 1200.0])
    assert feed_times(program, Limits(rapid=6000.0)) == pytest.approx([0.0, 0.1, 3.0, 2.0])
    assert feed_times(program, Limits(feed=300.0, rapid=6000.0)) == pytest.approx([0.0, 0.1, 6.0, 8.0])


def test_holes_count_on_neither_side(program, whole):
    """A hole that takes half a minute to drill makes no text slower than its CL file."""
    form = choose_form()
    settings = fitted(form)
    last = program.tip[-1] + np.array([[5.0, 0.0, 30.0], [5.0, 0.0, 0.0]])
    holes = np.vstack((last, last[1:] + [9.0, 0.0, 0.0]))
    tip, axis = np.vstack((program.tip, holes)), np.vstack((program.axis, [[0.0, 0.0, 1.0]] * 3))
    kind = np.append(program.kind, [Move.RAPID, Move.HOLE, Move.HOLE])
    words = (Statement(602, 9, "CYCLE", ("DRILL", "DEPTH", 50.0, "MMPM", 100.0, "CLEAR", 2.0)),)
    drilled = Program.from_poses(tip, axis, kind=kind, feed=1500.0, statements=(*program.statements, *words))
    found = estimate_saving(drilled, settings, form, Limits(), poses=700, stretches=1)
    assert found.direct - found.written == pytest.approx(whole.direct - whole.written, abs=0.1)
