"""Time laws of programs: limits at every period, geometry, stops, windows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.feedrate import Limits, TimeLaw, between, direct, plan, planner
from cornersmooth.feedrate.intervals import Resolution
from cornersmooth.feedrate.speed_problem import make_grid
from cornersmooth.model import Arcs, Move, Program, Statement
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.share import how_many, share

SPEED, JERK = 1.001, 1.005  # what the acceptance allows
FINER_CELLS = Resolution(part=0.04, growth=0.03)
METHODS = ("proportional", "zhang2016")


def check_limits(law: TimeLaw, limits: Limits, feed: float) -> None:
    """Speed, acceleration and jerk each period; jerk also by differences of the acceleration."""
    states = law.at(law.every_period())
    moving = ~states.turning
    assert states.v[moving].max() <= feed * SPEED
    assert np.abs(states.a[moving]).max() <= limits.accel * SPEED
    assert np.abs(states.j[moving]).max() <= limits.jerk * SPEED
    steps = np.diff(states.a) / np.maximum(np.diff(states.t), 1e-9)
    whole = moving[1:] & moving[:-1] & (np.diff(states.t) > 0.5 * limits.period)
    assert np.abs(steps[whole]).max() <= limits.jerk * JERK


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("seed", range(how_many(4, 20)))
def test_limits_hold_every_period(chain: Callable[[int], Program], seed: int, method: str) -> None:
    program, limits = chain(seed), Limits()
    law = plan(smooth(program, Settings(tolerance=0.02, method=method)), limits)
    check_limits(law, limits, float(program.feed[0]) / 60.0)
    assert law.total >= law.length / float(program.feed[0]) * 60.0
    assert law.kinematics(np.array([0.0, law.total]))[1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("seed", share(range(20), 2))
def test_acceleration_of_the_positions(chain: Callable[[int], Program], seed: int) -> None:
    """Second differences of the tip, which know nothing of curvature, against both parts of the acceleration."""
    program, limits = chain(seed), Limits(accel=800.0, centripetal=300.0)
    law = plan(smooth(program, Settings(tolerance=0.05)), limits)
    if np.isfinite(law.path.junction_speed[1:-1]).any():
        pytest.skip("a corner stays sharp")
    fine = 1e-4
    t = np.arange(0.0, law.total - fine, fine)
    tip = law.at(t).tip
    vector = np.diff(tip, n=2, axis=0) / fine**2
    velocity = np.diff(tip, axis=0) / fine
    speed = np.linalg.norm(velocity, axis=1)
    fast = (speed[1:] > 1.0) & (speed[:-1] > 1.0)
    along = velocity[1:] / np.maximum(speed[1:], 1e-9)[:, None]
    tangential = np.einsum("ij,ij->i", vector, along)
    centripetal = np.linalg.norm(vector - tangential[:, None] * along, axis=1)
    assert np.abs(tangential[fast]).max() <= limits.accel * 1.02
    assert centripetal[fast].max() <= limits.centripetal_accel * 1.02


@pytest.mark.parametrize("baseline", ["exact_stop", "velocity_jump"])
@pytest.mark.parametrize("seed", range(5))
def test_direct_path(chain: Callable[[int], Program], seed: int, baseline: str) -> None:
    program, limits = chain(seed), Limits()
    law = direct(program, limits, baseline)  # type: ignore[arg-type]
    check_limits(law, limits, float(program.feed[0]) / 60.0)
    assert law.length == pytest.approx(np.linalg.norm(np.diff(program.tip, axis=0), axis=1).sum())
    way = np.concatenate(([0.0], np.cumsum(law.path.length)))
    states = law.at(law.times_at(way))
    assert states.tip == pytest.approx(program.tip, abs=1e-6)
    assert states.axis == pytest.approx(program.axis, abs=1e-6)
    turn = np.diff(program.tip, axis=0) / np.linalg.norm(np.diff(program.tip, axis=0), axis=1)[:, None]
    jump = states.v[1:-1, None] * (turn[1:] - turn[:-1])
    allowed = 0.0 if baseline == "exact_stop" else limits.accel * limits.period
    assert np.linalg.norm(jump, axis=1).max() <= allowed * SPEED + 1e-3


@pytest.mark.parametrize("step", [0.004, 0.03])
def test_short_lines_of_a_circle_are_as_fast_as_the_circle(step: float) -> None:
    """Lines that a period covers many of may not jump in speed one by one: together they turn as an arc does."""
    radius, limits = 1.0, Limits(jerk=1e6)
    angle = np.arange(0.0, 1.6, step / radius)
    tip = radius * np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
    program = Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (len(tip), 1)), feed=60.0 * 500.0)
    law = direct(program, limits, "velocity_jump")
    assert law.at(law.every_period()).v.max() == pytest.approx(np.sqrt(limits.accel * radius), rel=1e-3)


def test_order_of_the_times(chain: Callable[[int], Program]) -> None:
    for seed in range(10):
        program = chain(seed)
        stop, jump = direct(program).total, direct(program, baseline="velocity_jump").total
        smoothed = plan(smooth(program, Settings(tolerance=0.05))).total
        assert smoothed < jump <= stop


def test_one_straight_line_is_the_closed_form() -> None:
    program = Program.from_poses([[0, 0, 0], [4, 0, 0], [10, 0, 0]], [[0, 0, 1]] * 3, feed=1800.0)
    assert plan(smooth(program)).total == pytest.approx(0.488253, rel=1e-5)
    assert direct(program).total > 0.6


@pytest.mark.parametrize("length", [0.5, 10.0, 50.0])
def test_cells_reach_the_closed_form(length: float) -> None:
    """A feed change too small to matter takes the run through the grid."""
    program = Program.from_poses([[0, 0, 0], [length / 2, 0, 0], [length, 0, 0]], [[0, 0, 1]] * 3, feed=1800.0)
    program.feed[2] = 1800.0 * (1 + 1e-9)
    law = plan(smooth(program))
    assert (law.rate != 0.0).any()
    exact = {0.5: 0.147361, 10.0: 0.488253, 50.0: 1.821586}[length]
    assert exact * (1 - 1e-6) <= law.total <= exact * 1.002


def test_windows_agree_with_the_whole(chain: Callable[[int], Program], monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    angle = np.cumsum(rng.normal(size=300) * 0.3)
    step = np.stack((np.cos(angle), np.sin(angle), 0.1 * np.sin(angle)), axis=1) * rng.uniform(0.1, 2.0, (300, 1))
    program = Program.from_poses(np.cumsum(step, axis=0), np.tile([0.0, 0.0, 1.0], (300, 1)), feed=3000.0)
    smoothed, limits = smooth(program, Settings(tolerance=0.02)), Limits()
    whole = plan(smoothed, limits)
    monkeypatch.setattr(between, "WINDOW", 2400)
    calls = []
    windowed = plan(smoothed, limits, progress=lambda done, total: calls.append((done, total)))
    assert len(calls) > 3
    assert calls[-1][0] == calls[-1][1]
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)
    check_limits(windowed, limits, 50.0)
    assert windowed.total == pytest.approx(whole.total, rel=3e-3)


def test_finer_cells_gain_little(chain: Callable[[int], Program], monkeypatch: pytest.MonkeyPatch) -> None:
    smoothed = [smooth(chain(seed), Settings(tolerance=0.02)) for seed in range(6)]
    coarse = [plan(one).total for one in smoothed]
    monkeypatch.setattr(planner, "make_grid", lambda limits, runs, _: make_grid(limits, runs, FINER_CELLS))
    assert coarse == pytest.approx([plan(one).total for one in smoothed], rel=0.01)
    assert coarse != [plan(one).total for one in smoothed]


def test_states_are_consistent(chain: Callable[[int], Program]) -> None:
    law = plan(smooth(chain(2), Settings(tolerance=0.05)))
    t = np.linspace(0.0, law.total, 20_001)
    s, v, a, _ = law.kinematics(t)
    dt = t[1]
    assert np.diff(s) / dt == pytest.approx(0.5 * (v[1:] + v[:-1]), abs=1e-4)
    assert np.diff(v) / dt == pytest.approx(0.5 * (a[1:] + a[:-1]), abs=0.5)
    states = law.at(t)
    chords = np.linalg.norm(np.diff(states.tip, axis=0), axis=1)
    assert chords.sum() == pytest.approx(law.length, rel=1e-6)
    assert (chords <= np.diff(states.s) * (1 + 1e-6) + 1e-9).all()
    assert np.linalg.norm(states.axis, axis=1) == pytest.approx(1.0)
    assert law.times_at(s[::500]) == pytest.approx(t[::500], abs=1e-5)


@pytest.mark.parametrize("method", METHODS)
def test_pose_is_continuous(chain: Callable[[int], Program], method: str) -> None:
    program = chain(3)
    law = plan(smooth(program, Settings(tolerance=0.02, method=method)))
    states = law.at(np.linspace(0.0, law.total, 40_001))
    assert np.linalg.norm(np.diff(states.tip, axis=0), axis=1).max() < 5e-3
    # the paper's method leaves small jumps of the axis at the joints, and says how large
    corners = law.path.corners
    allowed = 1e-4 + (
        np.nanmax([corners.extra["jump_in"], corners.extra["jump_out"]]) if method == "zhang2016" else 0.0
    )
    assert np.linalg.norm(np.diff(states.axis, axis=0), axis=1).max() < allowed
    assert states.tip[[0, -1]] == pytest.approx(program.tip[[0, -1]])


def stops_within(law: TimeLaw) -> int:
    return int((law.path.junction_speed[1:-1] == 0.0).sum())


def test_statements_stop_and_comments_do_not() -> None:
    tip = np.cumsum(np.tile([2.0, 0.0, 0.0], (6, 1)), axis=0)
    axis = np.tile([0.0, 0.0, 1.0], (6, 1))
    for word, stops in (("SPINDL", 1), ("PPRINT", 0)):
        program = Program.from_poses(tip, axis, feed=1000.0, statements=(Statement(3, 9, word),))
        for law in (plan(smooth(program)), direct(program, baseline="velocity_jump")):
            assert stops_within(law) == stops


def test_pure_rotation_has_its_own_limits() -> None:
    tip = [[0, 0, 0], [5, 0, 0], [5, 0, 0], [10, 0, 0]]
    axis = [[0, 0, 1], [0, 0, 1], [0, 1, 0], [0, 1, 0]]
    program, limits = Program.from_poses(tip, axis, feed=1000.0), Limits(angular_feed=45.0)
    law = direct(program, limits)
    states = law.at(np.linspace(0.0, law.total, 5001))
    assert states.turning.any()
    assert states.v[states.turning].max() == pytest.approx(np.radians(45.0))
    assert np.ptp(states.tip[states.turning], axis=0).max() == 0.0
    assert states.s[-1] == pytest.approx(10.0)
    assert law.total > 90.0 / 45.0 + 10.0 / 1000.0 * 60.0


def test_arc_is_driven_with_its_curvature() -> None:
    """Half a circle of radius 2 between tangent lines, √(a·r) < feed."""
    arcs = Arcs(
        pose=np.array([2]),
        centre=np.array([[5.0, 2.0, 0.0]]),
        normal=np.array([[0.0, 0.0, 1.0]]),
        sweep=np.array([np.pi]),
    )
    program = Program.from_poses(
        [[0, 0, 0], [5, 0, 0], [5, 4, 0], [0, 4, 0]],
        [[0, 0, 1]] * 4,
        kind=np.array([Move.LINEAR, Move.LINEAR, Move.ARC, Move.LINEAR], np.uint8),
        feed=6000.0,
        arcs=arcs,
    )
    limits = Limits(centripetal=200.0)
    law = plan(smooth(program), limits)
    assert law.length == pytest.approx(10.0 + 2.0 * np.pi)
    states = law.at(np.linspace(0.0, law.total, 2001))
    bowed = (states.s > 5.0) & (states.s < 5.0 + 2.0 * np.pi)
    assert 0.98 * np.sqrt(200.0 * 2.0) <= states.v[bowed].max() <= np.sqrt(200.0 * 2.0) * SPEED
    assert np.linalg.norm(states.tip[bowed] - [5.0, 2.0, 0.0], axis=1) == pytest.approx(2.0)
    assert stops_within(law) == 0


def test_rapids_have_their_own_limits() -> None:
    kind = np.array([Move.RAPID, Move.RAPID, Move.LINEAR], np.uint8)
    program = Program.from_poses([[0, 0, 0], [300, 0, 0], [310, 0, 0]], [[0, 0, 1]] * 3, kind=kind, feed=600.0)
    law = direct(program, Limits(rapid=12000.0, rapid_accel=4000.0, rapid_jerk=50000.0))
    states = law.at(np.linspace(0.0, law.total, 3001))
    assert states.v.max() == pytest.approx(200.0)
    assert states.v[states.s > 300.0].max() == pytest.approx(10.0)
    assert 2500.0 < np.abs(states.a).max() <= 4000.0 * SPEED


def test_feed_change_inside_a_chain() -> None:
    program = Program.from_poses([[0, 0, 0], [20, 0, 0], [40, 20, 0]], [[0, 0, 1]] * 3, feed=[600.0, 600.0, 3000.0])
    law = plan(smooth(program, Settings(tolerance=0.1)))
    states = law.at(np.linspace(0.0, law.total, 4001))
    corner = law.path.length[: int(np.argmax(law.path.speed > 20.0))].sum()
    assert states.v[states.s < corner].max() <= 10.0 * SPEED
    assert states.v.max() == pytest.approx(50.0, rel=0.01)
    check_limits(law, Limits(), 50.0)


def test_missing_feed_is_said_with_its_line() -> None:
    program = Program.from_poses([[0, 0, 0], [1, 0, 0]], [[0, 0, 1]] * 2, line=[7, 8])
    with pytest.raises(SettingsError, match=r":8: error\[\w+\]: no feed .*\n.*--feed"):
        plan(smooth(program))
    assert plan(smooth(program), Limits(feed=1000.0)).total > 0.06


def test_wrong_limits_are_refused() -> None:
    with pytest.raises(SettingsError, match="jerk is -1"):
        Limits(jerk=-1.0)
    with pytest.raises(SettingsError, match="feed is inf"):
        Limits(feed=float("inf"))


def test_a_program_without_motion() -> None:
    program = Program.from_poses(np.zeros((1, 3)), np.tile([0.0, 0.0, 1.0], (1, 1)), feed=100.0)
    for law in (plan(smooth(program)), direct(program)):
        assert law.total == 0.0
        assert len(law.at(law.every_period()).t) >= 1


def test_a_slow_start_far_along_the_path_has_a_time() -> None:
    """The cell next to a stop may be shorter there than the digits of the way."""
    tip = [[0, 0, 0], [900, 0, 0], [900, 1e-5, 0], [900, 5, 0]]
    stop = Statement(2, 3, "STOP", ())
    program = Program.from_poses(tip, [[0, 0, 1]] * 4, feed=[6000.0, 6000.0, 1e-7, 6000.0], statements=(stop,))
    law = direct(program, Limits(), "velocity_jump")
    assert np.isfinite(law.total)
    assert law.total >= 1e-5 / (1e-7 / 60.0)
