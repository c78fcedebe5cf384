"""Jerk-limited motion from rest to rest over one distance: the seven-phase S-curve in closed form.

The time-optimal law under limits of speed, acceleration and jerk has the phases jerk J, 0, −J, cruise, −J, 0, J. With
peak speed v each half takes T(v) = v/A + A/J, or 2·√(v/J) where the acceleration limit A is not reached (v < A²/J), and
covers v·T(v)/2.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Floats


def ramp_time(speed: Floats, accel: Floats, jerk: Floats) -> Floats:
    """Time from rest to `speed` with zero acceleration at both ends, s."""
    return np.where(speed * jerk >= accel * accel, speed / accel + accel / jerk, 2.0 * np.sqrt(speed / jerk))


def stopping_distance(speed: Floats, accel: Floats, jerk: Floats) -> Floats:
    """Distance in which `speed` is reached from rest, or comes to rest, with zero acceleration at both ends."""
    return 0.5 * speed * ramp_time(speed, accel, jerk)


def peak_speed(distance: Floats, speed: Floats, accel: Floats, jerk: Floats) -> Floats:
    """Largest speed of the fastest motion from rest to rest over `distance`, at most `speed`."""
    triangular = np.cbrt(0.25 * distance * distance * jerk)  # acceleration limit not reached
    corner = accel / jerk
    trapezoidal = 0.5 * accel * (np.sqrt(corner * corner + 4.0 * distance / accel) - corner)
    return np.minimum(speed, np.where(triangular * jerk >= accel * accel, trapezoidal, triangular))


def rest_to_rest(distance: Floats, speed: Floats, accel: Floats, jerk: Floats) -> tuple[Floats, Floats, Floats]:
    """Phases of the fastest motions from rest to rest.

    Parameters
    ----------
    distance : (n,) float64
        Greater than zero.
    speed, accel, jerk : (n,) float64 or float
        Limits, in units that agree with the distance.

    Returns
    -------
    duration : (n, 7) float64, s
        Phases that are not needed have zero duration.
    signed_jerk : (n, 7) float64
    peak : (n,) float64
        Speed in the fourth phase.
    """
    distance = np.asarray(distance, np.float64)
    speed, accel, jerk = (np.broadcast_to(np.asarray(x, np.float64), distance.shape) for x in (speed, accel, jerk))
    peak = peak_speed(distance, speed, accel, jerk)
    limited = peak * jerk >= accel * accel
    jerk_phase = np.where(limited, accel / jerk, np.sqrt(peak / jerk))
    steady = np.where(limited, np.maximum(peak / accel - accel / jerk, 0.0), 0.0)
    ramp = 2.0 * jerk_phase + steady
    cruise = np.maximum(distance / peak - ramp, 0.0)
    duration = np.stack((jerk_phase, steady, jerk_phase, cruise, jerk_phase, steady, jerk_phase), axis=-1)
    return duration, jerk[:, None] * np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0]), peak
