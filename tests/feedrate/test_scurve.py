"""S-curves from rest to rest against published times and against another planner."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.feedrate import timelaw

#: mm and s at 30 mm/s, 1000 mm/s², 5000 mm/s³
ORACLES = ((0.5, 0.147361), (2.0, 0.233921), (2.68, 0.257892), (10.0, 0.488253), (50.0, 1.821586))


def follow(duration: np.ndarray, jerk: np.ndarray) -> tuple[float, float, float, float, float]:
    """Integrate phases: end way, speed and acceleration, and the largest speed and acceleration on the way."""
    x = v = a = fastest = hardest = 0.0
    for t, j in zip(duration, jerk, strict=True):
        x += v * t + a * t * t / 2 + j * t**3 / 6
        v += a * t + j * t * t / 2
        a += j * t
        fastest, hardest = max(fastest, v), max(hardest, abs(a))
    return x, v, a, fastest, hardest


@pytest.mark.parametrize(("distance", "seconds"), ORACLES)
def test_times_of_one_segment(distance: float, seconds: float) -> None:
    duration, _, _ = timelaw.rest_to_rest(np.array([distance]), 30.0, 1000.0, 5000.0)
    assert duration.sum() == pytest.approx(seconds, rel=1e-5)


def random_cases(count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(7)
    return tuple(10.0 ** rng.uniform(low, high, count) for low, high in ((-4, 3), (-1, 3), (1, 4), (2, 6)))


def test_phases_arrive_within_the_limits() -> None:
    distance, speed, accel, jerk = random_cases(400)
    duration, signed, peak = timelaw.rest_to_rest(distance, speed, accel, jerk)
    assert (duration >= 0.0).all()
    for row in range(len(distance)):
        x, v, a, fastest, hardest = follow(duration[row], signed[row])
        assert x == pytest.approx(distance[row], rel=1e-9)
        assert abs(v) < 1e-9 * peak[row] + 1e-12
        assert abs(a) < 1e-9 * accel[row] + 1e-9
        assert fastest <= speed[row] * (1 + 1e-12)
        assert hardest <= accel[row] * (1 + 1e-12)


def test_against_ruckig() -> None:
    ruckig = pytest.importorskip("ruckig")
    distance, speed, accel, jerk = random_cases(60)
    ours = timelaw.rest_to_rest(distance, speed, accel, jerk)[0].sum(axis=1)
    for row in range(len(distance)):
        given = ruckig.InputParameter(1)
        given.current_position, given.target_position = [0.0], [float(distance[row])]
        given.max_velocity, given.max_acceleration = [float(speed[row])], [float(accel[row])]
        given.max_jerk = [float(jerk[row])]
        trajectory = ruckig.Trajectory(1)
        assert ruckig.Ruckig(1).calculate(given, trajectory) == ruckig.Result.Working
        assert ours[row] == pytest.approx(trajectory.duration, rel=1e-6)


def test_stopping_distance_is_half_of_a_motion_without_cruise() -> None:
    speed = np.array([5.0, 30.0, 300.0])
    way = timelaw.stopping_distance(speed, 1000.0, 5000.0)
    assert timelaw.peak_speed(2.0 * way, 1e9, 1000.0, 5000.0) == pytest.approx(speed)
