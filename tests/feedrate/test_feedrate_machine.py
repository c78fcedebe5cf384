"""Limits of the axes of a machine, measured from poses over time and the machine's kinematics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path as FilePath

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.feedrate import Limits, between, direct, plan, planner
from cornersmooth.feedrate.intervals import FINER, path_limits
from cornersmooth.feedrate.machine_axes import MachineAxes, follow
from cornersmooth.feedrate.path import Path, build_path
from cornersmooth.feedrate.speed_problem import make_grid
from cornersmooth.feedrate.taylor import poses, shares_at
from cornersmooth.feedrate.timelaw import TimeLaw, rest_to_rest
from cornersmooth.kinematics import Dynamics, Machine, load_machine, machine_position, solutions, tool_axis
from cornersmooth.model import Floats, Ints, Move, Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.files import beginning
from oracle.share import covering_share, share

MACHINES = ("table-ac", "head-ac", "nutated-bc", "xyzbc-trt", "head-table-bc")
IMPELLER = FilePath(__file__).resolve().parents[2] / "samples" / "impeller.cls"
STEP = 2e-4  # s
#: overshoot of differences over time where the jerk has a step
JUMPS = 12


def offset(machine: Machine) -> Machine:
    """The same machine with axes that miss the zero of the part, so that every axis has to move."""
    first, second = machine.axes
    return replace(
        machine,
        axes=(replace(first, point=(20.0, -15.0, 5.0)), replace(second, point=(-4.0, 30.0, -60.0))),
        part_zero=(70.0, 40.0, 10.0),
    )


def observed(law: TimeLaw) -> tuple[Floats, Floats]:
    """Times, and positions (m, 5) by the solution nearest to the one before: nothing of it is the planner's."""
    assert law.machine_axes is not None
    machine = law.machine_axes.machine
    t = np.arange(0.0, law.total, STEP)
    states = law.at(t)
    near = solutions(machine, states.axis).angles
    angles = np.empty((len(t), 2))
    before = law.machine_axes.angles[law.path.start[0]]
    for i, both in enumerate(near):
        turned = both + 360.0 * np.round((before - both) / 360.0)
        before = angles[i] = turned[np.abs(turned - before).sum(axis=1).argmin()]
    return t, np.concatenate((machine_position(machine, states.tip, angles), angles), axis=1)


def used(law: TimeLaw, outliers: int = JUMPS) -> Floats:
    """(3, 5) largest differences over time over the limits."""
    assert law.machine_axes is not None
    _, q = observed(law)
    found = [np.sort(np.abs(np.diff(q, n=k, axis=0)), axis=0) / STEP**k for k in (1, 2, 3)]
    return np.stack((found[0][-1], found[1][-1], found[2][-1 - outliers])) / law.machine_axes.limits


def paths(program: Program, machine: Machine, settings: Settings) -> tuple[Path, MachineAxes]:
    smoothed = smooth(program, settings)
    path = build_path(smoothed.program, smoothed.corners, smoothed.settings, Limits())
    return path, follow(machine, path)


def tilted(program: Program) -> Program:
    """The program with its tool axis leaning away from the pole."""
    return Program.from_poses(program.tip, program.axis + np.array((0.5, 0.3, 0.0)), feed=program.feed)


@pytest.mark.parametrize("name", MACHINES)
def test_derivatives_are_those_of_the_kinematics(chain: Callable[[int], Program], name: str) -> None:
    machine = offset(load_machine(name))
    path, machine_axes = paths(tilted(chain(2)), machine, Settings(tolerance=0.05))
    for kind, size in ((0, 0.02), (1, 0.01)):
        for element in np.flatnonzero((path.kind == kind) & ~path.turning)[2:8]:
            h = size * path.length[element]
            way = 0.4 * path.length[element] + h * np.arange(-3, 4)
            same: Ints = np.full(7, element)
            tip, axis, _ = poses(path, same, way)
            q, one, two, three = machine_axes.orders(same, shares_at(path, same, way))
            assert tool_axis(machine, q[:, 3:]) == pytest.approx(axis, abs=1e-12)
            assert machine_position(machine, tip, q[:, 3:]) == pytest.approx(q[:, :3], abs=1e-9)
            for order, of in ((one, q), (two, one), (three, two)):
                found = (-of[0] + 9 * of[1] - 45 * of[2] + 45 * of[4] - 9 * of[5] + of[6]) / (60 * h)
                assert order[3] == pytest.approx(found, rel=1e-5, abs=1e-6 * np.abs(order).max()), (kind, element)


@pytest.mark.parametrize(("seed", "name"), covering_share(product((1, 2, 5), MACHINES), 9))
def test_limits_hold_on_random_chains(chain: Callable[[int], Program], name: str, seed: int) -> None:
    law = plan(
        smooth(tilted(chain(seed)), Settings(tolerance=0.05)),
        machine=offset(load_machine(name)),
    )
    peaks = used(law)
    assert peaks[0].max() <= 1.001
    assert peaks[1].max() <= 1.001
    assert peaks[2].max() <= 1.005
    assert peaks.max() > 0.9  # a limit is used, not only kept


def test_limits_hold_where_the_tip_all_but_stands() -> None:
    """Turns on the spot in a run: the tip swings within ε while the axes go their whole way."""
    lean = np.array([0.5, 0.5, 0.8, 0.8, 0.4])
    swing = np.array([0.0, 0.0, 0.2, 0.2, 0.0])
    axis = np.stack((np.sin(lean) * np.cos(swing), np.sin(lean) * np.sin(swing), np.cos(lean)), axis=1)
    tip = np.outer([0.0, 4.0, 4.0, 8.0, 8.0], [0.8, 0.6, 0.0])
    smoothed = smooth(Program.from_poses(tip, axis, feed=1800.0), Settings(method="global"))
    assert smoothed.runs is not None
    law = plan(smoothed, machine=load_machine("table-ac"))
    assert law.machine_axes is not None
    # by exact derivatives: those of the tip's way are too large for differences over time
    _, *orders = law.axes_at(np.arange(0.0, law.total, STEP))
    peaks = np.stack([np.abs(order).max(axis=0) for order in orders]) / law.machine_axes.limits
    assert peaks.max() <= 1.001
    assert peaks.max() > 0.9
    t, angles = observed(law)
    assert (np.abs(np.diff(angles, axis=0)).max(axis=0) / STEP <= 1.001 * law.machine_axes.limits[0]).all()
    assert np.ptp(angles[:, 3:], axis=0).min() > 10.0, t[-1]


def test_limits_hold_on_the_fan(corpus: FilePath) -> None:
    name = "hust_5x_toolpath_fan.txt"
    program = read((corpus / name).read_bytes(), name=name, units="mm")
    smoothed = smooth(program, Settings(tolerance=0.02, axis_length=50.0))
    limits = Limits(feed=3000.0, accel=300.0, jerk=3000.0, period=0.001)
    law = plan(smoothed, limits, machine=load_machine("table-ac"))
    peaks = used(law)
    assert peaks[:2].max() <= 1.001
    assert 0.95 < peaks[2].max() <= 1.005
    assert law.total > plan(smoothed, limits).total


@pytest.mark.parametrize("name", ["table-ac", "head-ac"])
def test_limits_hold_on_the_impeller(name: str) -> None:
    """At every period, from the exact derivatives, which the test above holds against the kinematics."""
    program = read(beginning(IMPELLER, 105), name=IMPELLER.name)
    law = plan(smooth(program, Settings()), machine=load_machine(name))
    assert law.machine_axes is not None
    _, *orders = law.axes_at(law.every_period())
    peaks = np.stack([np.abs(order).max(axis=0) for order in orders]) / law.machine_axes.limits
    assert peaks[:2].max() <= 1.001
    assert peaks[2].max() <= 1.005
    assert peaks.max() > 0.9


@pytest.mark.parametrize("aside", share([0.3, 0.03, 0.003, 0.001], 2, 1))
def test_passing_the_pole(aside: float) -> None:
    """The nearer, the more the first axis slows the motion down; its speed is what limits it."""
    lean = np.linspace(-0.2, 0.2, 9)
    axis = np.stack((np.sin(lean), np.full(9, aside), np.cos(lean)), axis=1)
    tip = np.stack((np.linspace(0.0, 40.0, 9), np.sin(np.linspace(0.0, 3.0, 9)), np.zeros(9)), axis=1)
    smoothed = smooth(Program.from_poses(tip, axis, feed=3000.0), Settings())
    law = plan(smoothed, machine=load_machine("table-ac"))
    peaks = used(law)
    assert peaks[:2].max() <= 1.001
    assert peaks[2].max() <= 1.005
    if aside < 0.1:
        turn = np.degrees(2.0 * np.arctan(0.2 / aside))
        assert law.total > turn / 180.0  # the way of C at its largest speed
        assert law.total < turn / 180.0 + 3.0


@pytest.mark.parametrize("aside", [0.01, 0.001, 0.0003])
def test_passing_the_pole_is_no_slower_than_a_stop_there(aside: float) -> None:
    """A tip that comes to rest at the pole, while C turns by half a turn, keeps every limit too."""
    machine = load_machine("table-ac")
    lean = np.linspace(-0.2, 0.2, 4)
    axis = np.stack((np.sin(lean), np.full(4, aside), np.cos(lean)), axis=1)
    program = Program.from_poses(np.outer(np.linspace(0.0, 40.0, 4), (1.0, 0.0, 0.0)), axis, feed=3000.0)
    limits = np.array([[50.0, 1000.0, 5000.0], next(axis.per_second for axis in machine.dynamics if axis.name == "C")])
    way, turn = rest_to_rest(np.array([20.0, 180.0]), *limits.T)[0].sum(axis=1)
    assert plan(smooth(program), machine=machine).total < 2.0 * way + turn


def test_through_the_pole_and_at_it(recwarn: pytest.WarningsRecorder) -> None:
    """Straight through, the other solution goes on without a turn; a tool that stands upright turns nothing."""
    tip = np.stack((np.linspace(0.0, 40.0, 9), np.zeros(9), np.zeros(9)), axis=1)
    for lean in (np.linspace(-0.2, 0.2, 9), np.zeros(9)):
        axis = np.stack((np.sin(lean), np.zeros(9), np.cos(lean)), axis=1)
        smoothed = smooth(Program.from_poses(tip, axis, feed=3000.0), Settings())
        law = plan(smoothed, machine=load_machine("table-ac"))
        assert np.isfinite(law.total)
        assert law.total == pytest.approx(plan(smoothed).total, rel=0.01)
    # 1e-5 rad beside it the control may turn ahead of time: slower, but it neither stops for good nor divides by zero
    lean = np.linspace(-0.2, 0.2, 9)
    axis = np.stack((np.sin(lean), np.full(9, 1e-5), np.cos(lean)), axis=1)
    law = plan(smooth(Program.from_poses(tip, axis, feed=3000.0), Settings()), machine=load_machine("table-ac"))
    assert law.total < 5.0
    assert all(np.isfinite(values).all() for values in law.axes_at(law.every_period()))
    assert not recwarn.list


def test_the_fastest_profile_is_found_beside_near_standstills(chain: Callable[[int], Program]) -> None:
    """Sharp turns of the tip and a tool close to the pole: the solver once stopped at a profile of 234 s."""
    smoothed = smooth(chain(2), Settings(tolerance=0.05))
    assert plan(smoothed, machine=load_machine("table-ac")).total < 9.0


def test_generous_limits_cost_nothing(chain: Callable[[int], Program]) -> None:
    machine = load_machine("table-ac")
    generous = replace(machine, dynamics=tuple(Dynamics(item.name, 1e12, 1e12, 1e12) for item in machine.dynamics))
    for seed in (1, 2, 3):
        program = chain(seed)
        smoothed = smooth(program, Settings(tolerance=0.05))
        # cells are finer with a machine, which may bring a little
        assert 0.995 <= plan(smoothed, machine=generous).total / plan(smoothed).total <= 1.002
        for baseline in ("exact_stop", "velocity_jump"):
            free = direct(program, None, baseline)  # type: ignore[arg-type]
            bound = direct(program, None, baseline, machine=generous)  # type: ignore[arg-type]
            assert 0.995 <= bound.total / free.total <= 1.002


def test_a_linear_axis_alone() -> None:
    """Along X, with an upright tool, the limits of X are those of the path: times of an S-curve."""
    program = Program.from_poses([[0, 0, 0], [50, 0, 0]], [[0, 0, 1]] * 2, feed=60000.0)
    machine = replace(load_machine("table-ac"), dynamics=(Dynamics("X", 1800.0, 1000.0, 5000.0),))
    smoothed = smooth(program, Settings())
    law = plan(smoothed, Limits(accel=1e5, jerk=1e7), machine=machine)
    assert law.total == pytest.approx(1.821586, rel=1e-3)
    slow_y = replace(machine, dynamics=(Dynamics("Y", 1.0, 1.0, 1.0),))
    assert plan(smoothed, machine=slow_y).total == pytest.approx(plan(smoothed).total, rel=2e-3)  # cells


def test_a_rapid_takes_the_time_of_its_turn() -> None:
    """C and A run evenly in a rapid: half a turn at 90 deg/s."""
    kind = np.array([Move.RAPID, Move.RAPID], np.uint8)
    axis = [[0.0, -0.5, 1.0], [0.0, 0.5, 1.0]]
    program = Program.from_poses([[0, 0, 0], [1, 0, 0]], axis, kind=kind)
    base = load_machine("table-ac")
    first, second = base.axes
    machine = replace(base, axes=(first, replace(second, limits=(0.0, 90.0))), dynamics=(Dynamics("C", 90.0 * 60.0),))
    law = plan(smooth(program, Settings()), machine=machine)
    assert law.total >= 2.0
    assert law.total == pytest.approx(2.0, rel=0.25)
    assert np.abs(law.axes_at(law.every_period())[1][:, 3]).max() <= 90.0 * 1.001


def test_jumps_at_corners_keep_the_axes(chain: Callable[[int], Program]) -> None:
    """No axis of the direct path jumps by more than its acceleration allows in one period."""
    machine = offset(load_machine("table-ac"))
    limits = Limits()
    law = direct(tilted(chain(3)), limits, "velocity_jump", machine=machine)
    corners = law.times_at(law.edge[1:-1])
    before, after = (law.axes_at(corners + shift)[1] for shift in (-1e-9, 1e-9))
    assert law.machine_axes is not None
    jumps = np.abs(after - before) / (law.machine_axes.limits[1] * limits.period)
    assert jumps.max() <= 1.001
    assert jumps.max() > 0.5
    assert law.total > direct(tilted(chain(3)), limits, "velocity_jump").total


def test_parts_between_stops_are_planned_as_the_whole(
    chain: Callable[[int], Program], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each part by itself, so that memory does not grow with the number of parts."""
    one = tilted(chain(0))
    tip = np.concatenate([one.tip + (0.0, 0.0, 7.0 * number) for number in range(3)])
    kind = np.tile(np.where(np.arange(len(one)) == 0, Move.RAPID, Move.LINEAR), 3)
    program = Program.from_poses(tip, np.tile(one.axis, (3, 1)), kind=kind, feed=1800.0)
    smoothed, machine = smooth(program, Settings()), load_machine("table-ac")
    whole = plan(smoothed, Limits(), machine=machine)
    monkeypatch.setattr(planner, "PORTION", 2)
    done: list[float] = []
    law = plan(smoothed, Limits(), machine=machine, progress=lambda part, of: done.append(part / of))
    assert law.total == pytest.approx(whole.total, rel=1e-3)
    assert law.way[-1] == pytest.approx(whole.way[-1], rel=1e-12)
    assert len(law.edge) == len(whole.edge)
    t = np.linspace(0.0, law.total, 20_001)[1:-1]
    _, *rates = law.axes_at(t)
    assert law.machine_axes is not None
    for rate, most in zip(rates, law.machine_axes.limits, strict=True):
        assert (np.abs(rate) <= most).all()
    states = law.at(t)
    assert np.abs(np.diff(states.tip, axis=0)).max() <= law.path.speed.max() * (t[1] - t[0]) * 1.001
    assert done == sorted(done)
    assert len(set(done)) > 3
    assert done[-1] == 1.0


def test_refusals() -> None:
    program = Program.from_poses([[0, 0, 0], [5, 0, 0]], [[0, 0, 1], [0, 0.1, -1]], feed=100.0)
    smoothed = smooth(program, Settings())
    with pytest.raises(InputError, match="its limit is"):
        plan(smoothed, machine=load_machine("table-ac"))
    with pytest.raises(SettingsError, match=r"does not say how fast its axes may go\nhint: add \[dynamics.X\]"):
        plan(smoothed, machine=replace(load_machine("table-ac"), dynamics=()))


@pytest.mark.parametrize("steps", [40, 50, 80])  # each found another way astray, on some processors
def test_limits_hold_on_a_run_past_the_pole(steps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """At every moment, from the exact derivatives, and one of them is used all but whole."""
    monkeypatch.setattr(between, "_STEPS", steps)
    rng = np.random.default_rng(3)
    number = np.arange(1560, 1590)
    heading = np.cumsum(0.15 * rng.normal(size=len(number)))
    direction = np.stack((np.cos(heading), np.sin(heading), 0.1 * np.sin(0.01 * number)), axis=1)
    tip = np.cumsum(direction * 0.6 * rng.uniform(0.3, 1.7, (len(number), 1)), axis=0)
    axis = np.stack((0.3 * np.sin(0.02 * number), 0.2 * np.cos(0.013 * number), np.ones(len(number))), axis=1)
    smoothed = smooth(Program.from_poses(tip, axis, feed=3000.0), Settings(tolerance=0.01))
    machine = load_machine("table-ac")
    law = plan(smoothed, Limits(), machine=machine)
    _, *rates = law.axes_at(np.linspace(0.0, law.total, 40_001)[1:-1])
    assert law.machine_axes is not None
    used = [(np.abs(rate) / most).max() for rate, most in zip(rates, law.machine_axes.limits, strict=True)]
    assert 0.98 < max(used) <= 1.0


def test_at_a_stop_the_jerk_is_that_of_the_move_that_ends() -> None:
    """C turns 50 times as fast by the way after the stop: that move has not begun in the last digits before it."""
    angle = np.radians([0.0, 0.2, 10.2])
    axis = np.stack((np.sin(0.5) * np.cos(angle), np.sin(0.5) * np.sin(angle), np.full(3, np.cos(0.5))), axis=1)
    program = Program.from_poses(np.array([[0.0, 0, 0], [10, 0, 0], [20, 0, 0]]), axis, feed=800.0)
    law = direct(program, Limits(), "exact_stop", machine=load_machine("xyzac-trt"))
    stop = law.times_at(law.edge[1:2])[0]
    times = stop - np.geomspace(1e-9, 1e-5, 50)
    assert (law.kinematics(times)[0] == law.edge[1]).any()
    jerk, steady = law.axes_at(times)[3], law.axes_at([stop - 1e-4])[3]
    assert np.abs(jerk - steady).max() <= 0.05 * np.abs(steady).max()


def test_a_tip_that_all_but_stands_is_not_divided_without_end() -> None:
    """The axis turns far while the tip goes less than its digits: derivatives by the way are noise there."""
    turn = np.radians(np.linspace(0.0, 40.0, 30))
    axis = np.column_stack((np.sin(turn), 0.02 * np.cos(40.0 * turn), np.cos(turn)))
    tip = np.column_stack((1e-7 * np.arange(30), np.zeros(30), np.full(30, 1e-8)))
    rows = "\n".join(",".join(f"{value:.9f}" for value in row) for row in np.hstack((tip, axis)).tolist())
    program = read(f"x,y,z,i,j,k\n{rows}\n".encode(), name="creeping.csv").with_feed(1000.0)
    machine = load_machine("nutated-bc")
    path = build_path(program, None, Settings(), Limits(), stop_everywhere=False)
    intervals = path_limits(path, Limits(), follow(machine, path))
    assert len(intervals.cap) < 200 * len(path)


def test_a_slow_corner_is_slow_far_along_the_path() -> None:
    """Cells there are as short as the last digits of the coordinate: a corner on their border counts for both."""
    number = np.arange(60)
    tip = np.stack((4000.0 + 0.3 * number, 0.1 * (number % 2), np.zeros(60)), axis=1)
    lean = 0.3 + 0.1 * (number % 2)
    axis = np.stack((np.sin(lean), np.zeros(60), np.cos(lean)), axis=1)
    tip, axis = np.vstack(([0.0, 0.0, 0.0], tip)), np.vstack((axis[:1], axis))
    law = direct(Program.from_poses(tip, axis, feed=6000.0), baseline="velocity_jump", machine=load_machine("head-ac"))
    inner = slice(2, -1)
    speeds = law.kinematics(law.times_at(law.edge))[1]
    assert (law.path.junction_speed[inner] < 1.0).all()
    assert (speeds[inner] <= 1.001 * law.path.junction_speed[inner]).all()


def test_the_work_does_not_grow_with_the_distance_from_the_table() -> None:
    """Where the linear axes leave the path little jerk its cells are long."""
    number = np.arange(60)
    turn = 0.05 * number
    axis = np.stack((0.2 * np.sin(turn), 0.2 * np.cos(turn), np.ones(60)), axis=1)
    cells = []
    for far in (0.0, 1000.0, 10_000.0):
        tip = np.stack((far + number, far + 2.0 * np.sin(0.2 * number), np.zeros(60)), axis=1)
        program = Program.from_poses(tip, axis, feed=1200.0)
        path = build_path(program, None, Settings(), Limits())
        found = path_limits(path, Limits(), follow(load_machine("table-ac"), path))
        cells.append(len(make_grid(found, np.arange(1), FINER).start))
    assert cells[2] < 10 * cells[1] < 100 * cells[0], cells
