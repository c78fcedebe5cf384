"""When LinuxCNC runs each line of a program: the law of its trajectory planner, in closed form.

The law is that of LinuxCNC 2.9 (``tp.c``, ``tc.c``, ``blendmath.c``, ``emccanon.cc``):

1. Speed and acceleration of a line are limited by the axes in program space: its length over the largest share of an
   axis. The length is that of X Y Z; only where these do not move, that of the rotary words.
2. Where a rotary axis moves, there is no look-ahead: every line is planned from rest to rest, with half of its
   acceleration: ``v = min(F, axes, sqrt(a L / 2))``.
3. A line starts when the line before it brakes below a blend speed. G64 P bounds that speed:
   ``2 sqrt(a/2 · P / cos θ)``, where 2θ is the angle between the lines. At most two lines run at once.
4. Where no rotary axis moves on both lines, a corner may be passed at a speed: of a small velocity jump, or of the arc
   that fits within P, whichever is faster than half of that of 3. The planner looks ahead over such corners.
5. Between rapid and feed, and in exact stop mode, the motion stops.
6. An arc is a line of its own length, whose direction turns. Across it at most √3/2 of the smallest acceleration of an
   axis is used (``tcUpdateCircleAccRatio``), and along it what that leaves. A jump of velocity beside an arc counts
   twice. Only in one plane is there an arc that rounds its corner: an arc that rises meets others as 3 says.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from cornersmooth.arrays import dot, norm, unit
from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine, check_dynamics
from cornersmooth.model import MM_PER_UNIT, Bools, Floats, Ints

#: ``CARTFUZZ`` of posemath, mm or degrees: an axis that moves by less does not move
FUZZ = 1e-8
#: ``tpSetupTangent``: part of the acceleration that the velocity jump at a tangent corner may take
_KINK = 0.1
#: ``tpSetupTangent``: lines that turn by more than 180° less this angle are reversals
_REVERSAL = np.radians(2.0)
#: ``BLEND_ACC_RATIO_NORMAL`` of blendmath.c, sqrt(3)/2: what an arc may take of the acceleration across the path
_ARC_SHARE = np.sqrt(3.0) / 2.0
#: ``TP_ANGLE_EPSILON``, rad: planes that lean by less are one
_ONE_PLANE = 1e-6

_COMMENT = re.compile(r"\([^)]*\)|;.*")
_WORD = re.compile(r"([A-Z])\s*([-+]?\d*\.?\d+)")
_AXES = "XYZABC"

#: axes of G17, G18 and G19 in the order in which a right-handed turn about the third goes round, and letters of centres
_PLANES = {17: ((0, 1, 2), "IJ"), 18: ((2, 0, 1), "KI"), 19: ((1, 2, 0), "JK")}

#: G codes of motion that the law does not hold for: splines, threads, cycles, absolute centres, and feed per revolution
_UNKNOWN = frozenset((5, 5.1, 5.2, 33, 33.1, 38.2, 76, *range(81, 90), 90.1, 95, 96))

#: loops, calls, and values that the control works out: what it runs is not in the text
_WORKED_OUT = re.compile(r"[#\[]|^\s*/?\s*(N\s*\d+\s*)?O\s*(\d+|<[^>]*>)\s*[A-Z]|M\s*0*9[789](?![\d.])")


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
    #: (n, 12): length, radius, angle, directions at the start and at the end, and axis, of arcs; NaN for lines
    arc: Floats = field(default_factory=lambda: np.zeros((0, 12)))
    number: Ints = field(default_factory=lambda: np.zeros(0, np.int64))  #: (n,): lines of the text, from 1

    def __post_init__(self) -> None:
        if len(self.arc) != len(self):
            object.__setattr__(self, "arc", np.full((len(self), 12), np.nan))

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
    moves = _Moves.of(lines, limits)
    tangent, corner_speed, braked, stop = _corners(lines, limits, moves)
    length, (speed, acceleration) = moves.length, moves.braked(braked)
    out = _final_speeds(length, speed, acceleration, np.where(tangent, corner_speed, 0.0))
    into = np.concatenate(([0.0], out[:-1]))
    peak = np.minimum(speed, np.sqrt(acceleration * length + (into**2 + out**2) / 2.0))
    peak = np.maximum(peak, np.maximum(into, out))
    ramps = (2.0 * peak**2 - into**2 - out**2) / (2.0 * acceleration)
    taken = (2.0 * peak - into - out) / acceleration + np.maximum(length - ramps, 0.0) / peak
    blends = _blend_speeds(lines, moves, np.minimum(np.sqrt(acceleration * length), speed), acceleration)[0]
    return _in_turn(taken, np.where(tangent | stop, 0.0, blends / acceleration))


@dataclass(frozen=True)
class _Moves:
    """What a line is by itself (``emccanon.cc``)."""

    length: Floats  #: (n,)
    fastest: Floats  #: (n,): greatest speed by the limits
    speed: Floats  #: (n,): the same, and by the feed
    acceleration: Floats  #: (n,): limit of all of it
    direction: Floats  #: (2, n, 3): of X Y Z, at the start and at the end
    push: Floats  #: (2, n, 3): of the acceleration there, as blends take it (``tcGetStartAccelUnitVector``)
    turning: Bools  #: (n,): whether a rotary axis moves
    round: Bools  #: (n,): arcs
    radius: Floats  #: (n,): of arcs, else inf

    @classmethod
    def of(cls, lines: Lines, limits: AxisLimits) -> _Moves:
        step = lines.end - lines.start
        share = np.abs(step)
        share[share < FUZZ] = 0.0
        linear, rotary = norm(share[:, :3]), norm(share[:, 3:])
        moves, arc = linear > 0.0, lines.arc
        length = np.where(moves, linear, rotary)
        fastest = length / (share / limits.velocity).max(axis=1)
        acceleration = length / (share / limits.acceleration).max(axis=1)
        straight = np.where(moves[:, None], step[:, :3] / np.where(moves, linear, 1.0)[:, None], (1.0, 0.0, 0.0))
        round_ = ~np.isnan(arc[:, 0])
        weakest, slowest = limits.acceleration[:3].min(), limits.velocity[:3].min()
        length, radius = np.where(round_, arc[:, 0], length), np.where(round_, arc[:, 1], np.inf)
        fastest = np.where(round_, np.minimum(slowest, np.sqrt(_ARC_SHARE * weakest * radius)), fastest)
        fastest = np.minimum(fastest, length / limits.servo_period)
        fastest = np.where(moves | round_, np.minimum(fastest, limits.linear_velocity), fastest)
        acceleration = np.where(round_, weakest, acceleration)
        speed = np.minimum(fastest, lines.feed)
        direction, axis = np.tile(straight, (2, 1, 1)), arc[round_, 9:]
        direction[:, round_] = np.stack((arc[round_, 3:6], arc[round_, 6:9]))
        push = direction.copy()
        flat = unit(np.cross(np.cross(axis, direction[:, round_]), axis))  # without the rise
        inward = (speed / 2.0)[round_] ** 2 / radius[round_] / weakest
        push[:, round_] = np.stack((unit(flat[0] + inward[:, None] * np.cross(axis, flat[0])), flat[1]))
        return cls(length, fastest, speed, acceleration, direction, push, rotary > 0.0, round_, radius)

    def braked(self, part: Floats) -> tuple[Floats, Floats]:
        """Speeds, and accelerations along the lines, with a part of the accelerations (``pmCircleActualMaxVel``)."""
        whole = part * self.acceleration
        across = np.minimum(self.fastest**2 / self.radius / whole, _ARC_SHARE)
        return np.minimum(self.speed, np.sqrt(_ARC_SHARE * whole * self.radius)), whole * np.sqrt(1.0 - across**2)


def _corners(lines: Lines, limits: AxisLimits, moves: _Moves) -> tuple[Bools, Floats, Floats, Bools]:
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
    rapid, speed, turning = np.isinf(lines.feed), moves.speed, moves.turning
    stop = np.isnan(lines.blend)
    stop[:-1] |= rapid[:-1] != rapid[1:]
    ahead, behind = slice(1, None), slice(None, -1)
    plain = ~(stop[behind] | turning[behind] | turning[ahead])
    before, after = moves.direction[1, :-1], moves.direction[0, 1:]
    cosine = np.clip(dot(before, after), -1.0, 1.0)
    reversal = plain & (cosine < _REVERSAL**2 / 2.0 - 1.0)
    stop[behind] |= reversal
    plain &= ~reversal
    both = np.minimum(speed[behind], speed[ahead])
    jump = np.abs(after - before) * (both / limits.servo_period + moves.acceleration[ahead])[:, None]
    kink = (jump / limits.acceleration[:3]).max(axis=1) * np.where(moves.round[behind] | moves.round[ahead], 2.0, 1.0)
    kink_speed = np.where(kink < _KINK, both, both * _KINK / np.maximum(kink, _KINK))
    arc_speed = np.minimum(_arc_speeds(lines, limits, moves, cosine), both)
    # as good as a parabolic blend, of which each line may use half: what is halved there slows the next one, too
    reached, along = moves.braked(np.full(len(lines), (1.0 - _KINK) / 2.0))
    parabola = (
        _blend_speeds(lines, moves, np.minimum(np.sqrt(along * moves.length / 2.0), reached), along)[1][:-1] / 2.0
    )
    small = kink < _KINK
    arc = ~small & (arc_speed > np.maximum(kink_speed, parabola))
    slow = ~small & ~arc & (kink_speed > parabola)
    tangent = np.append(plain & (small | arc | slow), False)
    corner_speed = np.append(np.where(arc, arc_speed, kink_speed), 0.0)
    used = np.append(np.where(plain & (small | slow), np.minimum(kink, _KINK), 0.0), 0.0)
    parabolic = np.append(plain, False) & ~tangent
    halved = ~tangent & ~stop
    halved[ahead] |= parabolic[behind]
    braked = (1.0 - np.maximum(used, np.concatenate(([0.0], used[:-1])))) * np.where(halved, 0.5, 1.0)
    return tangent, corner_speed, braked, stop


def _arc_speeds(lines: Lines, limits: AxisLimits, moves: _Moves, cosine: Floats) -> Floats:
    """(n − 1,) speeds on the arcs that round corners within P (``blendInit3From...``, ``blendComputeParameters``).

    Lines give up at most half of their length, arcs a third of their angle at the start and two at the end. 0 beside an
    arc that is not in the plane of the corner.
    """
    before, after = moves.direction[1, :-1], moves.direction[0, 1:]
    across = np.cross(before, after)
    across /= np.maximum(norm(across), np.finfo(np.float64).tiny)[:, None]
    whole = np.arccos(-cosine) / 2.0
    half, reach, tolerance, flat = whole, np.full(len(cosine), np.inf), np.full(len(cosine), np.inf), whole >= 0.0
    for part, own, other, share, sense in (
        (slice(None, -1), before, after, 2.0 / 3.0, 1.0),
        (slice(1, None), after, before, 1.0 / 3.0, -1.0),
    ):
        (radius, angle), axis, bent = lines.arc[part, 1:3].T, lines.arc[part, 9:], moves.round[part]
        inside = sense * dot(np.cross(axis, own), other) > 0.0  # the corner turns as the arc does
        angle = np.minimum(share * angle, np.where(inside, whole, np.pi / 2.0))
        half = np.where(bent & inside, np.minimum(half, whole - angle / 4.0), half)
        given_up = radius * np.where(inside, np.sin(angle / 4.0), angle)
        length, blend = moves.length[part], lines.blend[part]
        reach = np.minimum(reach, np.where(bent, given_up, length / 2.0))
        tolerance = np.fmin(tolerance, np.minimum(np.where(blend > 0.0, blend, np.inf), length / 4.0))
        flat = flat & (~bent | (norm(np.cross(across, axis)) < _ONE_PLANE))
    # cos/(1 − sin), where straight on would be 0/0; rounded to floats no cosine here is 0
    reach = np.minimum(reach, tolerance * (1.0 + np.sin(half)) / np.cos(half))
    return np.where(flat, np.sqrt(_ARC_SHARE * limits.acceleration[:3].min() * np.tan(half) * reach), 0.0)


def _final_speeds(length: Floats, speed: Floats, acceleration: Floats, corner: Floats) -> Floats:
    """(n,) speed at the end of each line, from which the following lines can stop (``tpRunOptimization``)."""
    cap = np.minimum(corner, np.minimum(speed, np.append(speed[1:], 0.0))) ** 2
    braking = np.concatenate(([0.0], np.cumsum(2.0 * acceleration[1:] * length[1:])))
    least = np.minimum.accumulate((cap + braking)[::-1])[::-1]
    return np.sqrt(np.maximum(np.minimum(least - braking, cap), 0.0))


def _blend_speeds(lines: Lines, moves: _Moves, reach: Floats, acceleration: Floats) -> tuple[Floats, Floats]:
    """(n,) speed below which the next line starts, and that along the blend (``tpComputeBlendVelocity``)."""
    through, ramp = moves.length / reach, reach / acceleration
    time = np.minimum(np.minimum(through, np.roll(through, -1)), np.maximum(ramp, np.roll(ramp, -1)))
    cosine = np.clip(dot(moves.push[1], np.roll(moves.push[0], -1, axis=0)), -1.0, 1.0)
    across, along = np.sqrt((1.0 - cosine) / 2.0), np.sqrt((1.0 + cosine) / 2.0)  # cos θ, sin θ
    bounded = (lines.blend > 0.0) & (across > np.sin(1e-3))  # the planner's own limit for straight on
    allowed = 2.0 * np.sqrt(acceleration * np.where(bounded, lines.blend, 0.0) / np.where(bounded, across, 1.0))
    most = np.where(bounded, allowed, np.inf)
    this = np.minimum(np.minimum(reach, time * acceleration), most)
    following = np.minimum(np.minimum(np.roll(reach, -1), time * np.roll(acceleration, -1)), most)
    return this, along * (this + following) / 2.0


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


def axis_limits(machine: Machine, lines: Lines) -> AxisLimits:
    """Limits of the axes of a machine, as ``[AXIS_*]`` of its configuration has them.

    Raises
    ------
    SettingsError
        CS263: an axis that lines move has no velocity, or no acceleration.
    """
    limits = {item.name: item.per_second for item in machine.dynamics}
    columns = np.array([limits.get(name, (np.inf,) * 3) for name in _AXES])
    moved: Bools = np.any(np.abs(lines.end - lines.start) >= FUZZ, axis=0)
    moved[:3] |= (np.abs(lines.arc[:, 9:]) < 1.0).any(axis=0)  # NaN for lines
    check_dynamics(machine, [name for name, moves in zip(_AXES, moved, strict=True) if moves])
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
        CS264: it has other motion than lines and arcs, or a line has no feed; loops, calls of subprograms, variables.
    """
    # it begins in G64 without P: on the whole controller a relief took 3.52 s with and without the word
    place, feed, blend, timed, unit, code, plane = [np.nan] * 6, np.nan, 0.0, False, MM_PER_UNIT["mm"], 0.0, 17
    relative = False
    rows: list[tuple[list[float], list[float], float, float, list[float], int]] = []
    for number, line in enumerate(text.upper().splitlines(), 1):
        block = _COMMENT.sub("", line)
        if _WORKED_OUT.search(block):
            what = "a loop, a call or a variable: how long it takes is not in the program"
            raise InputError("CS264", what, "leave out the time", file=name, line=number)
        words = [(letter, float(value)) for letter, value in _WORD.findall(block)]
        codes = {value for letter, value in words if letter == "G"}
        if strange := codes & _UNKNOWN:
            what = f"G{min(strange):g}: the law of LinuxCNC's planner is known for lines and arcs only"
            raise InputError("CS264", what, "leave out the time, or write lines", file=name, line=number)
        if rows and (codes & {4, 28, 30, 53} or any(letter in "MT" for letter, _ in words)):
            rows[-1] = (*rows[-1][:3], np.nan, *rows[-1][4:])
        unit = MM_PER_UNIT["inch" if 20 in codes else "mm"] if codes & {20, 21} else unit
        timed = (93 in codes) if codes & {93, 94} else timed
        relative = (91 in codes) if codes & {90, 91} else relative
        code = next(iter(codes & {0.0, 1.0, 2.0, 3.0}), code)
        plane = int(next(iter(codes & {17.0, 18.0, 19.0}), plane))
        given = {letter: value * (unit if letter in "XYZIJKR" else 1.0) for letter, value in words}
        feed = given.get("F", feed)
        if codes & {61, 61.1}:
            blend = np.nan
        elif 64 in codes:
            blend = given.get("P", 0.0) * unit
        if codes & {28, 30, 53}:  # in coordinates of the machine: where that is in those of the part, nothing says
            some = given if 53 in codes else _AXES
            place = [np.nan if axis in some else old for axis, old in zip(_AXES, place, strict=True)]
            continue
        if relative:
            target = [old + given.get(axis, 0.0) for axis, old in zip(_AXES, place, strict=True)]
            begins = [0.0 if np.isnan(old) else old for old in place]
            ends = [old + given.get(axis, 0.0) for axis, old in zip(_AXES, begins, strict=True)]
        else:
            target = [given.get(axis, old) for axis, old in zip(_AXES, place, strict=True)]
            ends = [0.0 if np.isnan(value) else value for value in target]
            begins = [end if np.isnan(old) else old for old, end in zip(place, ends, strict=True)]
        place = target
        round_ = code > 1.0 and bool(given.keys() & set("XYZIJKR"))
        if begins == ends and not round_:
            continue
        arc = _arc(begins, ends, given, plane, clockwise=code == 2.0) if round_ else [np.nan] * 12
        if arc[1] == 0.0:
            what = "an arc has neither a radius nor a centre away from where it begins"
            raise InputError("CS264", what, "give it one", file=name, line=number)
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
    shapes = np.array(arcs, np.float64).reshape(-1, 12)
    limits, rounding = np.array(speeds, np.float64), np.array(blends, np.float64)
    return Lines(start, end, limits, rounding, shapes, np.array(numbers, np.int64))


def _arc(
    start: list[float], end: list[float], given: Mapping[str, float], plane: int, *, clockwise: bool
) -> list[float]:
    """Row of an arc by radius or by centre, as in `Lines`."""
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
    found = [length, radius, turn]
    for spoke in (-centre, chord - centre):
        way, tangent = [0.0] * 3, sense * 1j * spoke / (abs(spoke) or 1.0) * radius * turn / (length or 1.0)
        way[u], way[v], way[w] = tangent.real, tangent.imag, rise / (length or 1.0)
        found += way
    return [*found, *(sense * (axis == w) for axis in range(3))]
