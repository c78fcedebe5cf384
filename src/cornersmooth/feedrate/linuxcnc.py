"""When LinuxCNC runs each line of a program: the law of its trajectory planner, in closed form.

The law is that of LinuxCNC 2.9 (``tp.c``, ``tc.c``, ``blendmath.c``, ``emccanon.cc``):

1. Speed and acceleration of a line are limited by the axes in program space: its length over the largest share of an
   axis. The length is that of X Y Z; only where these do not move, that of the rotary words.
2. Where a rotary axis moves, there is no look-ahead: every line is planned from rest to rest, with half of its
   acceleration: ``v = min(F, axes, sqrt(a L / 2))``.
3. A line starts when the line before it brakes below a blend speed. G64 P bounds that speed:
   ``2 sqrt(a/2 · P / cos θ)``, where 2θ is the angle between the lines. At most two lines run at once.
4. Where no rotary axis moves on both lines, a corner is passed at a speed: of a small velocity jump, or of the arc that
   fits within P. The planner looks ahead over such corners.
5. Between rapid and feed, and in exact stop mode, the motion stops.
6. An arc is a line of its own length, whose direction turns. Across it at most √3/2 of the smallest acceleration of an
   axis is used (``tpAddCircle``, ``tcUpdateCircleAccRatio``), so ``v = sqrt(√3/2 · a · R)``; half is left along it.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine
from cornersmooth.model import MM_PER_UNIT, Bools, Floats, Ints

#: ``CARTFUZZ`` of posemath, mm or degrees: an axis that moves by less does not move
FUZZ = 1e-8
#: ``tpSetupTangent``: part of the acceleration that the velocity jump at a tangent corner may take
_KINK = 0.1
#: ``tpSetupTangent``: lines that turn by more than 180° less this angle are reversals
_REVERSAL = np.radians(2.0)
#: ``BLEND_ACC_RATIO_NORMAL`` of blendmath.c, sqrt(3)/2: what an arc may take of the acceleration across the path
_ARC_SHARE = np.sqrt(3.0) / 2.0

_COMMENT = re.compile(r"\([^)]*\)|;.*")
_WORD = re.compile(r"([A-Z])\s*([-+]?\d*\.?\d+)")
_AXES = "XYZABC"

#: axes of G17, G18 and G19 in the order in which a right-handed turn about the third goes round, and letters of centres
_PLANES = {17: ((0, 1, 2), "IJ"), 18: ((2, 0, 1), "KI"), 19: ((1, 2, 0), "JK")}

#: G codes of motion that the law does not hold for: splines, threads, cycles, and feed per revolution
_UNKNOWN = frozenset((5, 5.1, 5.2, 33, 33.1, 38.2, 76, *range(81, 90), 95, 96))


@dataclass(frozen=True)
class AxisLimits:
    """Limits of a LinuxCNC configuration."""

    #: (6,): ``[AXIS_*] MAX_VELOCITY`` and ``MAX_ACCELERATION`` of X Y Z A B C; inf for none
    velocity: Floats
    acceleration: Floats
    linear_velocity: float = np.inf  #: ``[TRAJ] MAX_LINEAR_VELOCITY``
    servo_period: float = 0.001  #: s: ``[EMCMOT] SERVO_PERIOD``


@dataclass(frozen=True)
class Lines:
    """Lines of a program, n of them, one after another."""

    #: (n, 6): words X Y Z A B C
    start: Floats
    end: Floats
    feed: Floats  #: (n,): inf for a rapid
    blend: Floats  #: (n,) mm: P of G64; 0 for G64 without P; NaN in exact stop mode.
    #: (n, 8): length, radius, and directions at the start and at the end, of arcs; NaN for lines
    arc: Floats = field(default_factory=lambda: np.zeros((0, 8)))
    number: Ints = field(default_factory=lambda: np.zeros(0, np.int64))  #: (n,): lines of the text, from 1

    def __post_init__(self) -> None:
        if len(self.arc) != len(self):
            object.__setattr__(self, "arc", np.full((len(self), 8), np.nan))

    def __len__(self) -> int:
        return len(self.feed)


def line_times(lines: Lines, limits: AxisLimits) -> tuple[Floats, Floats]:
    """(n,) start and end of every line, s.

    Parameters
    ----------
    lines : Lines
        Each must move.
    """
    if not len(lines):
        return np.zeros(0), np.zeros(0)
    length, speed, acceleration, direction, turning = _moves(lines, limits)
    tangent, corner_speed, braked, stop = _corners(lines, limits, length, speed, acceleration, direction, turning)
    acceleration = acceleration * braked
    out = _final_speeds(length, speed, acceleration, np.where(tangent, corner_speed, 0.0))
    into = np.concatenate(([0.0], out[:-1]))
    peak = np.minimum(speed, np.sqrt(acceleration * length + (into**2 + out**2) / 2.0))
    peak = np.maximum(peak, np.maximum(into, out))
    ramps = (2.0 * peak**2 - into**2 - out**2) / (2.0 * acceleration)
    taken = (2.0 * peak - into - out) / acceleration + np.maximum(length - ramps, 0.0) / peak
    overlap = np.where(tangent | stop, 0.0, _blend_speeds(lines, length, speed, acceleration, direction) / acceleration)
    return _in_turn(taken, overlap)


def _moves(lines: Lines, limits: AxisLimits) -> tuple[Floats, Floats, Floats, Floats, Bools]:
    """Length, greatest speed, acceleration, directions of X Y Z, and whether a rotary axis moves (``emccanon.cc``).

    Directions (2, n, 3) are those at the start and at the end.
    """
    step = lines.end - lines.start
    share = np.abs(step)
    share[share < FUZZ] = 0.0
    linear, rotary = np.linalg.norm(share[:, :3], axis=1), np.linalg.norm(share[:, 3:], axis=1)
    moves = linear > 0.0
    length = np.where(moves, linear, rotary)
    axes = length / (share / limits.velocity).max(axis=1)
    speed = np.minimum(np.minimum(axes, lines.feed), length / limits.servo_period)
    speed = np.where(moves, np.minimum(speed, limits.linear_velocity), speed)
    acceleration = length / (share / limits.acceleration).max(axis=1)
    straight = np.where(moves[:, None], step[:, :3] / np.where(moves, linear, 1.0)[:, None], (1.0, 0.0, 0.0))
    round_ = ~np.isnan(lines.arc[:, 0])
    weakest, slowest = limits.acceleration[:3].min(), limits.velocity[:3].min()
    length = np.where(round_, lines.arc[:, 0], length)
    across = np.sqrt(_ARC_SHARE * weakest * np.where(round_, lines.arc[:, 1], 1.0))
    on_arc = np.minimum(np.minimum(lines.feed, min(slowest, limits.linear_velocity)), length / limits.servo_period)
    speed = np.where(round_, np.minimum(on_arc, across), speed)
    acceleration = np.where(round_, weakest / 2.0, acceleration)
    direction = np.stack(
        [np.where(round_[:, None], lines.arc[:, part], straight) for part in (slice(2, 5), slice(5, 8))]
    )
    return length, speed, acceleration, direction, rotary > 0.0


def _corners(
    lines: Lines,
    limits: AxisLimits,
    length: Floats,
    speed: Floats,
    acceleration: Floats,
    direction: Floats,
    turning: Bools,
) -> tuple[Bools, Floats, Floats, Bools]:
    """What happens at the end of each line (``tpSetupTangent``, ``tpChooseBestBlend``, ``handleModeChange``).

    Returns
    -------
    tangent : (n,) bool
        Passed at a speed; else a parabolic blend or a stop.
    corner_speed : (n,) float64
        That speed.
    braked : (n,) float64
        Part of its acceleration that each line has: half where it blends.
    stop : (n,) bool
    """
    rapid = np.isinf(lines.feed)
    stop = np.isnan(lines.blend)
    stop[:-1] |= rapid[:-1] != rapid[1:]
    ahead, behind = slice(1, None), slice(None, -1)
    plain = ~(stop[behind] | turning[behind] | turning[ahead])
    before, after = direction[1, :-1], direction[0, 1:]
    cosine = np.clip(np.einsum("ij,ij->i", before, after), -1.0, 1.0)
    reversal = plain & (cosine < _REVERSAL**2 / 2.0 - 1.0)
    stop[behind] |= reversal
    plain &= ~reversal
    both = np.minimum(speed[behind], speed[ahead])
    jump = np.abs(after - before) * (both / limits.servo_period + acceleration[ahead])[:, None]
    kink = (jump / limits.acceleration[:3]).max(axis=1)
    kink_speed = np.where(kink < _KINK, both, both * _KINK / np.maximum(kink, _KINK))
    arc_speed = np.minimum(_arc_speeds(lines, limits, length, cosine), both)
    shorter = np.minimum(length[behind], length[ahead])
    small = kink < _KINK
    arc = ~small & (arc_speed >= kink_speed)
    slow = ~small & ~arc & (kink_speed > 0.5 * np.sqrt(acceleration[behind] * shorter / 2.0))
    tangent = np.append(plain & (small | arc | slow), False)
    corner_speed = np.append(np.where(arc, arc_speed, kink_speed), 0.0)
    used = np.append(np.where(plain & (small | slow), np.minimum(kink, _KINK), 0.0), 0.0)
    parabolic = np.append(plain, False) & ~tangent
    halved = ~tangent & ~stop
    halved[ahead] |= parabolic[behind]
    braked = (1.0 - np.maximum(used, np.concatenate(([0.0], used[:-1])))) * np.where(halved, 0.5, 1.0)
    return tangent, corner_speed, braked, stop


def _arc_speeds(lines: Lines, limits: AxisLimits, length: Floats, cosine: Floats) -> Floats:
    """(n − 1,) speeds on the arcs that round corners within P (``blendComputeParameters``); inf where all is straight.

    Both lines give up at most half of their length.
    """
    half = np.arccos(-cosine) / 2.0
    widest = np.fmin(
        *(np.where(lines.blend[part] > 0.0, lines.blend[part], np.inf) for part in (slice(1, None), slice(-1)))
    )
    height = widest / np.maximum(1.0 - np.sin(half), np.finfo(np.float64).tiny)
    reach = np.minimum(np.minimum(length[:-1], length[1:]) / 2.0, np.cos(half) * height)
    return np.sqrt(_ARC_SHARE * limits.acceleration[:3].min() * np.tan(half) * reach)


def _final_speeds(length: Floats, speed: Floats, acceleration: Floats, corner: Floats) -> Floats:
    """(n,) speed at the end of each line, from which the following lines can stop (``tpRunOptimization``)."""
    cap = np.minimum(corner, np.minimum(speed, np.append(speed[1:], 0.0))) ** 2
    braking = np.concatenate(([0.0], np.cumsum(2.0 * acceleration[1:] * length[1:])))
    least = np.minimum.accumulate((cap + braking)[::-1])[::-1]
    return np.sqrt(np.maximum(np.minimum(least - braking, cap), 0.0))


def _blend_speeds(lines: Lines, length: Floats, speed: Floats, acceleration: Floats, direction: Floats) -> Floats:
    """(n,) speed below which the next line starts (``tpComputeBlendVelocity``)."""
    reach = np.minimum(np.sqrt(acceleration * length), speed)
    through, ramp = length / reach, reach / acceleration
    time = np.minimum(np.minimum(through, np.roll(through, -1)), np.maximum(ramp, np.roll(ramp, -1)))
    found = np.minimum(reach, time * acceleration)
    cosine = np.einsum("ij,ij->i", direction[1], np.roll(direction[0], -1, axis=0))
    across = np.sqrt(np.maximum((1.0 - cosine) / 2.0, 0.0))  # cos θ
    bounded = (lines.blend > 0.0) & (across > np.sin(1e-3))  # the planner's own limit for straight on
    allowed = 2.0 * np.sqrt(acceleration * np.where(bounded, lines.blend, 0.0) / np.where(bounded, across, 1.0))
    return np.where(bounded, np.minimum(found, allowed), found)


def _in_turn(taken: Floats, overlap: Floats) -> tuple[Floats, Floats]:
    """Start and end of lines that take so long, each of which starts before the end of the one before it.

    A line starts only when the line before the one before it has ended (``tpRunCycle`` runs two lines).
    """
    begin, end, now, last = [], [], 0.0, 0.0
    for needs, shared in zip(taken.tolist(), overlap.tolist(), strict=True):
        done = now + needs
        begin.append(now)
        end.append(done)
        now, last = max(done - shared, last), done
    return np.array(begin), np.array(end)


def axis_limits(machine: Machine) -> AxisLimits:
    """Limits of the axes of a machine, as ``[AXIS_*]`` of its configuration has them."""
    limits = {item.name: item.per_second for item in machine.dynamics}
    columns = np.array([limits.get(name, (np.inf,) * 3) for name in _AXES])
    return AxisLimits(columns[:, 0], columns[:, 1])


def program_lines(text: str, name: str | None = None) -> Lines:
    """Read the moves of a program; the motion stops at words M and T, at G4 and at moves of the machine.

    Parameters
    ----------
    name : str, optional
        File name for messages.

    Raises
    ------
    InputError
        CS264: it has other motion than lines and arcs, or a line has no feed.
    """
    # it begins in G64 without P: on the whole controller a relief took 3.52 s with and without the word
    place, feed, blend, timed, unit, code, plane = [np.nan] * 6, np.nan, 0.0, False, MM_PER_UNIT["mm"], 0.0, 17
    rows: list[tuple[list[float], list[float], float, float, list[float], int]] = []
    for number, line in enumerate(text.upper().splitlines(), 1):
        words = [(letter, float(value)) for letter, value in _WORD.findall(_COMMENT.sub("", line))]
        codes = {value for letter, value in words if letter == "G"}
        if strange := codes & _UNKNOWN:
            what = f"G{min(strange):g}: the law of LinuxCNC's planner is known for lines and arcs only"
            raise InputError("CS264", what, "leave out the time, or write lines", file=name, line=number)
        if rows and (codes & {4, 53} or any(letter in "MT" for letter, _ in words)):
            rows[-1] = (*rows[-1][:3], np.nan, *rows[-1][4:])
        unit = MM_PER_UNIT["inch" if 20 in codes else "mm"] if codes & {20, 21} else unit
        timed = (93 in codes) if codes & {93, 94} else timed
        code = next(iter(codes & {0.0, 1.0, 2.0, 3.0}), code)
        plane = int(next(iter(codes & {17.0, 18.0, 19.0}), plane))
        given = {letter: value * (unit if letter in "XYZIJKR" else 1.0) for letter, value in words}
        feed = given.get("F", feed)
        if codes & {61, 61.1}:
            blend = np.nan
        elif 64 in codes:
            blend = given.get("P", 0.0) * unit
        target = [given.get(axis, old) for axis, old in zip(_AXES, place, strict=True)]
        if 53 in codes:  # in coordinates of the machine: where that is in those of the part, nothing says
            place = [np.nan if axis in given else old for axis, old in zip(_AXES, place, strict=True)]
            continue
        ends = [0.0 if np.isnan(value) else value for value in target]
        begins = [end if np.isnan(old) else old for old, end in zip(place, ends, strict=True)]
        place = target
        round_ = code > 1.0 and bool(given.keys() & set("XYZIJKR"))
        if begins == ends and not round_:
            continue
        arc = _arc(begins, ends, given, plane, clockwise=code == 2.0) if round_ else [np.nan] * 8
        if code == 0.0:
            speed = np.inf
        elif timed:
            away = np.subtract(ends, begins)
            length = arc[0] if round_ else float(np.linalg.norm(away[:3]) or np.linalg.norm(away))
            speed = length * feed / 60.0
        else:
            speed = feed * (unit if begins[:3] != ends[:3] else 1.0) / 60.0
        if not speed > 0.0:
            raise InputError("CS264", "a line has no feed", "give it one", file=name, line=number)
        rows.append((begins, ends, float(speed), blend, arc, number))
    starts, targets, speeds, blends, arcs, numbers = zip(*rows, strict=True) if rows else ((), (), (), (), (), ())
    start, end = (np.array(places, np.float64).reshape(-1, 6) for places in (starts, targets))
    shapes = np.array(arcs, np.float64).reshape(-1, 8)
    limits, rounding = np.array(speeds, np.float64), np.array(blends, np.float64)
    return Lines(start, end, limits, rounding, shapes, np.array(numbers, np.int64))


def _arc(
    start: list[float], end: list[float], given: Mapping[str, float], plane: int, *, clockwise: bool
) -> list[float]:
    """Length, radius and directions of an arc by radius or by centre, as in `Lines`."""
    (u, v, w), letters = _PLANES[plane]
    chord, rise = complex(end[u] - start[u], end[v] - start[v]), end[w] - start[w]
    if "R" in given:
        size = given["R"]
        half = math.sqrt(max(size**2 - abs(chord) ** 2 / 4.0, 0.0)) * (1 if size > 0.0 else -1)
        centre = chord / 2.0 + (-half if clockwise else half) * 1j * chord / (abs(chord) or 1.0)
    else:
        centre = complex(given.get(letters[0], 0.0), given.get(letters[1], 0.0))
    sense, radius = -1.0 if clockwise else 1.0, abs(centre)
    turn = (sense * (cmath.phase(chord - centre) - cmath.phase(-centre))) % math.tau or math.tau
    length = math.hypot(radius * turn, rise)
    found = [length, radius]
    for spoke in (-centre, chord - centre):
        way, tangent = [0.0] * 3, sense * 1j * spoke / (abs(spoke) or 1.0) * radius * turn / (length or 1.0)
        way[u], way[v], way[w] = tangent.real, tangent.imag, rise / (length or 1.0)
        found += way
    return found
