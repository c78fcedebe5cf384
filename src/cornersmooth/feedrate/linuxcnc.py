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

import re
from dataclasses import dataclass, field

import numpy as np

from cornersmooth.arrays import dot, joined_rows, norm, unit
from cornersmooth.control.program import Act, Stream, Text, line_of
from cornersmooth.control.state import Rows, State
from cornersmooth.control.table import table_of
from cornersmooth.control.words import Lexer, Table, filled
from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine, check_dynamics
from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.dialects import dialect_of
from cornersmooth.nc_reader.tool import circles

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

_AXES = "XYZABC"

#: at words of these letters, and at what is so called in `control.table.LOSES`, the motion stops
_STOPS = frozenset(("M", "T", "dwell", "machine"))

#: centres of arcs that are places, and feeds that the spindle counts
_STRANGE = frozenset(("G90.1", "G95"))

#: G words of group 01
_MOTIONS = (0.0, 1.0, 2.0, 3.0)

#: groups that must be known where an axis moves
_NEEDED = ("distance", "units", "feed", "path", "plane")

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
    """(n,) start and end of every line, s; each must move."""
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

    Whether it is passed at a speed (else it is a parabolic blend or a stop), that speed, the part of its acceleration
    that each line has (half where it blends), and whether the motion stops.
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

    CS263: an axis that lines move has no velocity, or no acceleration.
    """
    limits = {item.name: item.per_second for item in machine.dynamics}
    columns = np.array([limits.get(name, (np.inf,) * 3) for name in _AXES])
    moved: Bools = np.any(np.abs(lines.end - lines.start) >= FUZZ, axis=0)
    moved[:3] |= (np.abs(lines.arc[:, 9:]) < 1.0).any(axis=0)  # NaN for lines
    check_dynamics(machine, [name for name, moves in zip(_AXES, moved, strict=True) if moves])
    return AxisLimits(columns[:, 0], columns[:, 1])


def program_lines(data: bytes, name: str | None = None) -> Lines:
    """Read the moves of a program; the motion stops at words M and T, at G4 and at moves of the machine.

    What a block does, and what holds there, is that of `control.program.Stream`; `name` is that of the file, for
    messages. CS264: it has other motion than lines and arcs, or a line has no feed; what holds there is not known;
    loops, calls of subprograms, variables.
    """
    lexer, reader = dialect_of("linuxcnc", "ABC").lexer, _Reader()
    try:
        for item in Stream(Text.of(data), lexer, State(table_of("linuxcnc"), tuple(_AXES))):
            if isinstance(item, Rows):
                blocks = Table(item.first + 1 + np.arange(len(item)), dict(item.columns))
                reader.move(blocks, item.before, item.feed)
            else:
                reader.act(item, lexer)
    except InputError as error:
        error.file = name
        raise
    return joined_rows(reader.moves) if reader.moves else Lines(*np.zeros((2, 0, 6)), *np.zeros((2, 0)))


def _no_time(line: int, what: str, hint: str = "leave out the time") -> InputError:
    return InputError("CS264", what, hint, line=line)


class _Reader:
    """Moves of a program, and what the machine of `control.state` does not tell of them."""

    def __init__(self) -> None:
        self.moves: list[Lines] = []
        #: last words of the axes, mm and degrees, NaN for none; and last G word of group 01, for the sense of an arc
        self._place, self._code = np.full(len(_AXES), np.nan), np.nan

    def act(self, act: Act, lexer: Lexer) -> None:
        """Take a line that is no plain motion block."""
        number, block = act.line + 1, lexer.comment.sub("", act.text.decode("latin-1").upper()).strip()
        if _WORKED_OUT.search(block):
            raise _no_time(number, "a loop, a call or a variable: how long it takes is not in the program")
        line, after = line_of(act.text, lexer), act.after
        words = () if line is None else line.words
        codes = {word.value for word in words if word.name == "G"}
        self._code = next((code for code in _MOTIONS if code in codes), self._code)
        columns = {word.name: np.array([word.value]) for word in words if word.name != "G"}
        found = act.before.rows(words)
        beside = after.table.arguments.get(after.groups["motion"] or "", frozenset())
        beside = beside.union(*(row.beside for *_, row in found))
        rows = [(word, row) for word, name, row in found if name not in beside]
        does = columns.keys() | frozenset[str]().union(*(row.does for _, row in rows))
        if self.moves and does & _STOPS:
            self.moves[-1].blend[-1] = np.nan
        moving, own = columns.keys() & {*_AXES}, [word.name for word, row in rows if row.does & {"dwell", "place"}]
        lost = after.groups["units"] is None and (moving or line is None)
        odd = moving and ("dwell" in does or {*own} - {"G", "M"})
        if "machine" in does:  # to where that is in places of the part nothing says
            self._place[[53.0 not in codes or axis in columns for axis in _AXES]] = np.nan
        elif strange := [one.spelling for one, row in rows if ("motion", None) in row.sets or one.spelling in _STRANGE]:
            what = f"{strange[0]}: the law of LinuxCNC's planner is known for lines and arcs only"
            raise _no_time(number, what, "leave out the time, or write lines")
        elif lost or odd:
            raise _no_time(number, f"{block}: what it does is not known")
        elif not own:  # else X Y Z belong to these words
            self.move(Table(np.array([number]), columns), after, np.array([after.feed]))

    def move(self, blocks: Table, state: State, feed: Floats) -> None:
        """Take blocks in one state, with their feeds as written."""
        code = filled(blocks.column("G"), self._code if state.groups["motion"] else np.nan)[0]
        words = np.stack([blocks.column(axis) for axis in _AXES], axis=1)
        centres = {letter: state.unit * blocks.column(letter) for letter in "IJKR"}
        unknown = [name for name in _NEEDED if state.groups[name] is None]
        unknown += ["motion"] * bool(np.isnan(code[~np.isnan(words).all(axis=1)]).any())
        if unknown and not np.isnan(words).all():
            raise _no_time(int(blocks.line[0]), f"not known: {', '.join(unknown)}", "say it again, as in G21 G90 G94")
        words[:, :3] *= state.unit
        bent = (code > 1.0) & ~np.isnan([*words[:, :3].T, *centres.values()]).all(axis=0)
        place, self._code = self._place, float(code[-1])
        if state.groups["distance"] == "incremental":  # an axis of which nothing is known begins at 0
            step = np.nan_to_num(words)
            places = np.cumsum(np.vstack((place, step)), axis=0)
            start = np.nan_to_num(places[:-1])
            end = start + step
        else:  # or where it is sent to
            places = np.stack([filled(column, np.nan)[0] for column in np.vstack((place, words)).T], axis=1)
            end = np.nan_to_num(places[1:])
            start = np.where(np.isnan(places[:-1]), end, places[:-1])
        self._place = places[-1]
        rows = np.flatnonzero((start != end).any(axis=1) | bent)
        if not len(rows):
            return
        start, end, code, feed = start[rows], end[rows], code[rows], feed[rows]
        bent, number = bent[rows], blocks.line[rows]
        arc = np.full((len(rows), 12), np.nan)
        if bent.any():
            of_arcs = Table(number[bent], {letter: column[rows][bent] for letter, column in centres.items()})
            arc[bent] = _arcs(of_arcs, start[bent, :3], end[bent, :3], code[bent] == 3.0, state.plane)
        linear, turned = norm((end - start)[:, :3]), norm(end - start)
        if state.groups["feed"] == "inverse":
            speed = np.where(bent, arc[:, 0], np.where(linear > 0.0, linear, turned)) * feed / 60.0
        else:
            speed = np.where(linear > 0.0, state.unit, 1.0) * feed / 60.0
        speed[code == 0.0] = np.inf
        for line in number[~(speed > 0.0)].tolist():
            raise _no_time(line, "a line has no feed", "give it one")
        path = state.groups["path"] or ""
        within = re.search(r"P([\d.]+)", path)  # without P where the program begins, as the whole controller does
        blend = np.nan if path.startswith("G61") else state.unit * float(within[1]) if within else 0.0
        self.moves.append(Lines(start, end, speed, np.full(len(rows), blend), arc, number))


def _arcs(centres: Table, start: Floats, end: Floats, counterclockwise: Bools, plane: int) -> Floats:
    """(k, 12) arcs by radius or by centre, as in `Lines`."""
    centre, normal, turn = circles(centres, start, end, counterclockwise, plane, [])
    spokes, rise = np.stack((start, end)) - centre, dot(end - start, normal)[:, None] * normal
    spokes[1] -= rise
    radius = norm(spokes[0])
    for line in centres.line[radius == 0.0].tolist():
        raise _no_time(line, "an arc has neither a radius nor a centre away from where it begins", "give it one")
    length = np.hypot(radius * turn, norm(rise))
    ways = (np.cross(normal, unit(spokes)) * (radius * turn)[:, None] + rise) / length[:, None]
    return np.column_stack((length, radius, turn, *ways, normal))
