"""Where the tool is at any time: a time law of closed-form phases, and what it reaches of the limits.

Where nothing else limits the motion, the phases are the seven of the S-curve: jerk J, 0, −J, cruise, −J, 0, J. With
peak speed v each half takes T(v) = v/A + A/J, or 2·√(v/J) where the acceleration limit A is not reached (v < A²/J), and
covers v·T(v)/2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.feedrate.machine_axes import MachineAxes
from cornersmooth.feedrate.path import Path
from cornersmooth.feedrate.taylor import poses, shares_at
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.settings import Limits

#: rounds of halving: the time is exact in its last digit
_HALVINGS = 60


@dataclass(frozen=True)
class States:
    """The motion at some times, m rows."""

    t: Floats  #: (m,) s
    s: Floats  #: (m,) mm: way of the tip since the start
    #: (m,): path speed, tangential acceleration and jerk; in rad where `turning`
    v: Floats
    a: Floats
    j: Floats
    centripetal: Floats  #: (m,): κ·v² of the tip
    turning: Bools  #: (m,): The tip stands still and the axis turns: `v`, `a`, `j` are angular.
    line: Ints  #: (m,): CL line of the move under way
    tip: Floats  #: (m, 3) mm
    axis: Floats  #: (m, 3)


@dataclass(frozen=True)
class TimeLaw:
    """A motion over time, p phases.

    In a phase either the jerk is constant (`rate` 0), or the acceleration is linear in the way x, a = a₀ + rate·(x−x₀),
    so that the motion is the solution of x″ = a: hyperbolic or circular functions of √|rate|·t, with jerk rate·v.

    Parameters
    ----------
    time : (p + 1,) float64, s
        Starts of the phases, and the end.
    way : (p + 1,) float64
        Path coordinate, mm (rad where the tip stands still), running on over all elements.
    speed, accel, jerk, rate : (p,) float64
        At the start of each phase; `jerk` is that of phases with constant jerk.
    edge : (m + 1,) float64
        Path coordinate of the elements' ends.
    machine_axes : MachineAxes or None
        The axes of the machine that it was planned for.
    """

    time: Floats
    way: Floats
    speed: Floats
    accel: Floats
    jerk: Floats
    rate: Floats
    path: Path
    limits: Limits
    edge: Floats
    machine_axes: MachineAxes | None = None

    @property
    def total(self) -> float:
        """Duration, s; without delays, tool changes and the strokes of hole cycles."""
        return float(self.time[-1])

    @property
    def length(self) -> float:
        """Way of the tip, mm."""
        return float(self.path.length[~self.path.turning].sum())

    def kinematics(self, t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Path coordinate, speed, acceleration and jerk at times t (m,).

        Returns
        -------
        tuple of arrays
            (m,) each: mm (rad in pure turns), mm/s, mm/s² and mm/s³ along the path.
        """
        t = self._clipped(t)
        if not len(self.speed):
            return (np.zeros_like(t),) * 4
        phase = self._phases(t)
        return self._inside(phase, t - self.time[phase])

    def _clipped(self, t: Floats) -> Floats:
        return np.clip(np.atleast_1d(np.asarray(t, np.float64)), 0.0, self.total)

    def _phases(self, t: Floats) -> Ints:
        phase: Ints = np.clip(np.searchsorted(self.time, t, side="right") - 1, 0, len(self.speed) - 1)
        return phase

    def _elements(self, t: Floats, x: Floats) -> tuple[Ints, Floats]:
        """(m,) element at times and path coordinates (m,), of those that the phase goes through, and the way on it.

        A tip that comes to a stand is at the edge, in the last digit, before the phase ends: jerk is that of the phase.
        """
        last = np.searchsorted(self.edge, self.way[self._phases(t) + 1], side="left") - 1
        element = np.clip(np.minimum(np.searchsorted(self.edge, x, side="right") - 1, last), 0, len(self.path) - 1)
        return element, np.clip(x - self.edge[element], 0.0, self.path.length[element])

    def _inside(self, phase: Ints, tau: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        v, a, j, rate = self.speed[phase], self.accel[phase], self.jerk[phase], self.rate[phase]
        c, s1, s2 = _solution(rate, tau)
        x = self.way[phase] + v * s1 + a * s2 + j * tau**3 / 6.0
        speed = v * c + a * s1 + 0.5 * j * tau**2
        accel = a * c + rate * v * s1 + j * tau
        x = np.clip(x, self.way[phase], self.way[phase + 1])
        return x, np.maximum(speed, 0.0), accel, j + rate * speed

    def times_at(self, way: Floats) -> Floats:
        """Times at which path coordinates (m,) are reached, s.

        Returns
        -------
        Floats
            (m,) s, from 0 to `total`.
        """
        if not len(self.speed):  # nothing moves
            return np.zeros(np.shape(way))
        way = np.clip(np.asarray(way, np.float64), self.way[0], self.way[-1])
        phase = np.clip(np.searchsorted(self.way, way, side="right") - 1, 0, len(self.speed) - 1)
        gone = way - self.way[phase]
        v, rate = self.speed[phase], self.rate[phase]
        squared = v * v + gone * (2.0 * self.accel[phase] + rate * gone)
        both = v + np.sqrt(np.maximum(squared, 0.0))
        moving = both > 0.0
        tau = crossing_time(np.where(moving, gone, 0.0), np.where(moving, both, 1.0), rate)
        hard = np.flatnonzero((self.jerk[phase] != 0.0) & (gone > 0.0))
        tau[hard] = self._halve(phase[hard], way[hard])
        # coming to rest, the time hangs on the last digits of the way: the end itself is exact
        tau = np.where(way >= self.way[-1], np.inf, tau)
        return np.asarray(self.time[phase] + np.minimum(tau, self.time[phase + 1] - self.time[phase]), np.float64)

    def _halve(self, phase: Ints, way: Floats) -> Floats:
        """Times inside phases of constant jerk by halving: the way never runs backwards."""
        low, high = np.zeros(len(way)), self.time[phase + 1] - self.time[phase]
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            before = self._inside(phase, middle)[0] < way
            low, high = np.where(before, middle, low), np.where(before, high, middle)
        return 0.5 * (low + high)

    def at(self, t: Floats) -> States:
        """State at times t (m,), clipped to the duration.

        Returns
        -------
        States
            m rows: tips in mm, unit axes, and speed, accelerations and jerk in mm and s.
        """
        t, (x, v, a, j), path = self._clipped(t), self.kinematics(t), self.path
        if not len(path):
            nothing = np.zeros((len(t), 3))
            return States(t, x, v, a, j, x, x > 0.0, x.astype(np.int64), nothing, nothing)
        element, local = self._elements(t, x)
        travel = np.concatenate(([0.0], np.cumsum(np.where(path.turning, 0.0, path.length))))
        turning = path.turning[element]
        s = travel[element] + np.where(turning, 0.0, local)
        tip, axis, kappa = poses(path, element, local)
        line = path.program.line[path.move[element]]
        return States(t, s, v, a, j, np.where(turning, 0.0, kappa * v * v), turning, line, tip, axis)

    def axes_at(self, t: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Position, speed, acceleration and jerk (m, 5) of the machine's axes at times t (m,), in mm, degrees and s.

        From exact derivatives. On all transitions the axis point is taken at the parameter of the tip.

        Returns
        -------
        tuple of arrays
            (m, 5) each, in the order of the names of the machine: mm and degrees, per s, s² and s³.

        Raises
        ------
        ValueError
            The law was not planned for a machine.
        """
        if self.machine_axes is None:
            raise ValueError("the law was not planned for a machine")
        t, (x, *orders) = self._clipped(t), self.kinematics(t)
        if not len(self.path):
            return (np.zeros((len(x), 5)),) * 4
        element, local = self._elements(t, x)
        v, a, j = (order[:, None] for order in orders)
        q, one, two, three = self.machine_axes.orders(element, shares_at(self.path, element, local))
        # a tip that comes to a stand has no derivatives by its way
        one, two, three = (np.where(np.isfinite(order), order, 0.0) for order in (one, two, three))
        return q, one * v, two * v * v + one * a, three * v**3 + 3.0 * two * v * a + one * j

    def every_period(self) -> Floats:
        """Times at the multiples of the interpolation period, and the end, s.

        Returns
        -------
        Floats
            (m,) s, ascending from 0.
        """
        period = self.limits.period
        steps = int(np.floor(self.total / period * (1.0 - 1e-12)))
        return np.append(np.arange(steps + 1) * period, self.total)


def _solution(rate: Floats, tau: Floats) -> tuple[Floats, Floats, Floats]:
    """cosh(ωτ), sinh(ωτ)/ω and (cosh(ωτ) − 1)/ω² for ω² = rate, continued to rates of zero and below."""
    y = rate * tau * tau
    root = np.sqrt(np.abs(y))
    small = np.abs(y) < 1e-3
    safe = np.where(small, 1.0, root)
    square = np.where(small, 1.0, y)
    up = y > 0.0
    grown = np.where(up, root, 0.0)
    c = np.where(up, np.cosh(grown), np.cos(root))
    s1 = np.where(small, 1.0 + y / 6.0 + y * y / 120.0, np.where(up, np.sinh(grown), np.sin(root)) / safe)
    s2 = np.where(small, 0.5 + y / 24.0 + y * y / 720.0, (c - 1.0) / square)
    return c, tau * s1, tau * tau * s2


def crossing_time(width: Floats, speeds: Floats, rate: Floats) -> Floats:
    """Time to cross cells of linear acceleration: tanh(ωτ/2)/ω = width/(v₀ + v₁) with ω² = rate.

    Follows from v″ = rate·v by integrating over the cell; `speeds` is v₀ + v₁.
    """
    half = width / speeds
    y = rate * half * half
    root = np.sqrt(np.abs(y))
    small = np.abs(y) < 1e-4
    safe = np.where(small, 1.0, root)
    up = np.arctanh(np.where(y > 0.0, np.minimum(root, 1.0 - 1e-15), 0.0)) / safe
    factor = np.where(small, 1.0 + y / 3.0 + y * y / 5.0, np.where(y > 0.0, up, np.arctan(root) / safe))
    time: Floats = 2.0 * half * factor
    return time


def stopping_distance(speed: Floats, accel: Floats, jerk: Floats) -> Floats:
    """Distance in which `speed` is reached from rest, or comes to rest, with zero acceleration at both ends."""
    time = np.where(speed * jerk >= accel * accel, speed / accel + accel / jerk, 2.0 * np.sqrt(speed / jerk))
    return 0.5 * speed * time


def peak_speed(distance: Floats, speed: Floats, accel: Floats, jerk: Floats) -> Floats:
    """Largest speed of the fastest motion from rest to rest over `distance`, at most `speed`."""
    triangular = np.cbrt(0.25 * distance * distance * jerk)  # acceleration limit not reached
    corner = accel / jerk
    trapezoidal = 0.5 * accel * (np.sqrt(corner * corner + 4.0 * distance / accel) - corner)
    return np.minimum(speed, np.where(triangular * jerk >= accel * accel, trapezoidal, triangular))


def rest_to_rest(distance: Floats, speed: Floats, accel: Floats, jerk: Floats) -> tuple[Floats, Floats, Floats]:
    """Phases of the fastest motions from rest to rest over distances (n,) above zero, in units that agree.

    Durations (n, 7), s, zero for phases that are not needed; the jerk of each with its sign; speeds (n,) in the fourth
    phase.
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


#: part of a limit from which it counts as reached
_REACHED = 0.98

#: times looked at, spread evenly over the motion: for each element, at least and at most
_EACH, _FEWEST, _MOST = 64, 2_000, 20_000

_ORDERS = ("speed", "acceleration", "jerk")


def limiting(law: TimeLaw) -> list[tuple[str, float]]:
    """Limits that are reached while the tool cuts, and the part of the cutting time, the longest first.

    Several may be reached at once, so that the parts need not add up to 1. A limit counts from 98 % of it on.

    Returns
    -------
    list of (str, float)
        Such as ``("the programmed feed", 0.6)``, ``("acceleration of A", 0.2)``.
    """
    path = law.path
    if not len(path) or law.total <= 0.0:
        return []
    times = np.linspace(0.0, law.total, min(max(_EACH * len(path), _FEWEST), _MOST))
    states = law.at(times)
    way = law.kinematics(times)[0]
    element = np.clip(np.searchsorted(law.edge, way, side="right") - 1, 0, len(path) - 1)
    cutting = ~path.rapid[element] & ~states.turning
    if not cutting.any():
        return []
    limits = law.limits
    fastest = states.v >= _REACHED * path.speed[element]
    feed = path.program.feed_at(path.move) if limits.feed is None else np.full(len(path), limits.feed)
    slower = (60.0 * path.speed < _REACHED * feed)[element]  # what the control makes of its blocks
    reached: dict[str, Bools] = {
        "the programmed feed": fastest & ~slower,
        "block time or look-ahead": fastest & slower,
        "acceleration along the path": _at(states.a, limits.accel),
        "jerk along the path": _at(states.j, limits.jerk),
        "acceleration across the path": _at(states.centripetal, limits.centripetal_accel),
    }
    if law.machine_axes is not None:
        _, *orders = law.axes_at(times)
        for word, values, most in zip(_ORDERS, orders, law.machine_axes.limits, strict=True):
            for name, column, bound in zip(law.machine_axes.names, values.T, most, strict=True):
                reached[f"{word} of {name}"] = _at(column, float(bound))
    shares = ((name, float(rows[cutting].mean())) for name, rows in reached.items())
    return sorted((pair for pair in shares if pair[1] > 0.0), key=lambda pair: -pair[1])


def _at(values: Floats, limit: float) -> Bools:
    return np.abs(values) >= _REACHED * limit
