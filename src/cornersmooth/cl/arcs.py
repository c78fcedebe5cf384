"""Circular moves: what each dialect writes, and the one geometry it is turned into.

The sense of rotation about the normal depends on the dialect: NX and Makino FF (11 numbers and more) turn left-handed,
Creo (7), SolidWorks CAM (6) and HSM's MOVARC right-handed. Neighbouring lines tell whether that is right: an arc that
leaves them by a cusp but would join them smoothly the other way round is a contradiction, and reported.

CATIA and Creo also write arcs as drive surfaces, with CIRCLE or CYLNDR, and HELICAL::

    INDIRV/tx,ty,tz
    TLON,GOFWD/(CIRCLE/xc,yc,zc,r),ON,[2,INTOF,](LINE/x1,y1,z1,x2,y2,z2)

The tool leaves its position along the circle in the direction of INDIRV and stops where the check surface behind ON
(a line, or a plane) is met for the first time, or the second time with 2,INTOF (Dassault, Syntax of Generated APT
Instructions; PostWorks 15.1 appendix G). CAM systems let the line end in the end point of the arc.
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import dot, norm
from cornersmooth.cl.grammar import Record, number
from cornersmooth.cl.messages import error, finding
from cornersmooth.cl.poses import Vector, check_range, triple
from cornersmooth.errors import Finding, InputError
from cornersmooth.model import Arcs, Bools, Floats, Ints, Move

ArcRule = Literal["left", "right", "tangent"]
RULES: Final[tuple[ArcRule, ...]] = ("left", "right", "tangent")

#: start and end may miss the circle by so many printed digits, or by this part of the radius
RADIUS_DIGITS: Final = 10
RADIUS_SHARE: Final = 1e-3

#: an arc whose ends are closer than so many printed digits, but not equal, is a line: with the wrong sense it would be
#: a full circle (NX coremill sample, line 2579: 0.1 um on R 68.9)
SHORTEST_DIGITS: Final = 2

#: decimals of coordinates at least: integers say nothing about the resolution
LEAST_DECIMALS: Final = 3

#: a neighbour is tangent, or exactly opposite, within this angle
TANGENT: Final = math.radians(15)

#: a neighbouring line votes if it is longer than so many printed digits
VOTING_DIGITS: Final = 100

#: more turns than any thread has
MOST_TURNS: Final = 10_000

#: |normal| may miss 1 by
NORMAL_TOLERANCE: Final = 1e-2


#: words before centre, normal and radius
_PARTS_OF_MOVARC: Final = ("CENTER", "AXIS", "RADIUS")


@dataclass(frozen=True, slots=True)
class Arc:
    """A circular move before its ends are known; lengths as written, the rotation right-handed about `normal`."""

    line: int
    word: str
    centre: tuple[float, float, float]
    normal: tuple[float, float, float]
    radius: float  #: NaN where not written
    turns: int = 1  #: the arc is the last of them
    sweep: float = math.nan  #: rad, NaN where not written
    resolution: float = 1e-4  #: step of the printed coordinates
    certain: bool = False  #: the sense of rotation is written out, and no matter of dialect
    passes: tuple[tuple[float, float, float], ...] = ()  #: points on its way
    pose: int = -1  #: that ends it


def read_arc(record: Record, file: str, rule: ArcRule | None, decimals: int) -> Arc:
    """Read CIRCLE or MOVARC (InputError CS106, CS113, CS120, CS124, CS125, CS127).

    The rule overrides the dialect's sense of rotation; "tangent" is settled when the neighbours are known. The dialect
    prints so many decimals at most.
    """
    values, words = record.values, record.words
    if record.word == "MOVARC" and record.args[:9:4] == _PARTS_OF_MOVARC:  # DMG MORI MfgSuite
        words = words[3:]
    for word in words:
        if word not in ("TIMES", "ANGLE"):
            raise error("CS106", file, record.line, word=record.word, token=word)
    check_range(values, file, record.line)
    count = len(values)
    turns, sweep = 1.0, math.nan
    if record.word == "MOVARC":
        named = len(words) < len(record.words)
        wanted, fits = "x,y,z,i,j,k,r,ANGLE,a", count == 8 and words == ["ANGLE"]
        sweep = math.radians(values[-1]) if fits else sweep
        fits = fits or (named and count == 7 and not words)
    else:
        wanted = "x,y,z,i,j,k (and r), or 11 numbers and TIMES,n"
        fits = (count in (6, 7, 11) and not words) or (count == 12 and words == ["TIMES"])
        turns = values[-1] if count == 12 and fits else turns
    if not fits:
        raise error("CS120", file, record.line, word=record.word, count=count, s="s"[: count != 1], want=wanted)
    length = math.hypot(*values[3:6])
    check_normal(length, record, file)
    radius = values[6] if count > 6 else math.nan
    if radius <= 0:
        raise error("CS125", file, record.line, word=record.word, radius=radius)
    if not (1 <= turns <= MOST_TURNS and turns == int(turns)):
        raise error("CS127", file, record.line, word="CIRCLE", value=turns, limit=MOST_TURNS)
    check_sweep(sweep, record, file)
    left = rule == "left" if rule in ("left", "right") else count >= 11
    sign = -1 / length if left else 1 / length
    x, y, z, i, j, k = values[:6]
    normal = sign * i, sign * j, sign * k
    resolution = resolution_of(record.text.partition("/")[2], decimals)
    return Arc(record.line, record.word, (x, y, z), normal, radius, int(turns), sweep, resolution)


def check_normal(length: float, record: Record, file: str) -> None:
    """Refuse a normal that is no unit vector (InputError CS124)."""
    if not abs(length - 1) <= NORMAL_TOLERANCE:
        raise error("CS124", file, record.line, word=record.word, length=length)


def check_sweep(sweep: float, record: Record, file: str) -> None:
    """Refuse a stated sweep, rad, that no arc has (InputError CS127); NaN is none."""
    if not math.isnan(sweep) and not 0 < sweep <= 2 * math.pi * MOST_TURNS:
        raise error("CS127", file, record.line, word=record.word, value=sweep / (2 * math.pi), limit=MOST_TURNS)


def resolution_of(text: str, decimals: int) -> float:
    """Step of the coordinates that a statement begins with; the dialect prints so many decimals at most."""
    printed = max(len(token.partition(".")[2].strip()) for token in text.split(",")[:3])
    return float(10.0 ** -max(printed, decimals, LEAST_DECIMALS))


def resolve(
    table: Sequence[Arc], tip: Floats, kind: NDArray[np.uint8], file: str, rule: ArcRule | None
) -> tuple[Arcs, Ints, Ints, list[Finding]]:
    """Find sweep and sense of all arcs from the poses around them; tips are as written, in the unit of the arcs.

    Poses of arcs that are lines, and of those that contradict their neighbours, come with them, and findings.
    Raises InputError CS123 where an end is not on the circle, CS126 where a stated angle is not the arc's.
    """
    if not table:
        none = np.zeros(0, np.int64)
        return Arcs(), none, none, []
    pose = np.array([arc.pose for arc in table], np.int64)
    centre, normal, radius, resolution, full_turns, stated = (
        np.array([getattr(arc, name) for arc in table], np.float64)
        for name in ("centre", "normal", "radius", "resolution", "turns", "sweep")
    )
    full_turns -= 1
    start, end = tip[pose - 1] - centre, tip[pose] - centre
    start_height, end_height = dot(start, normal), dot(end, normal)
    start = start - start_height[:, None] * normal
    end = end - end_height[:, None] * normal

    start_radius, end_radius = norm(start), norm(end)
    radius = np.where(np.isnan(radius), start_radius, radius)
    allowed = np.maximum(RADIUS_DIGITS * resolution, RADIUS_SHARE * radius)
    for which, distance in (("start", start_radius), ("end", end_radius)):
        off = ~(np.abs(distance - radius) <= allowed) | (distance == 0)
        if off.any():
            first = int(off.argmax())
            if radius[first] == 0:
                raise error("CS125", file, table[first].line, word=table[first].word, radius=0.0)
            values = {"which": which, "distance": distance[first], "radius": radius[first]}
            raise error("CS123", file, table[first].line, **values)

    chord = norm(end - start)
    rise = np.abs(end_height - start_height)
    closed = chord < resolution / 2
    turn = np.arctan2(dot(np.cross(start, end), normal), dot(start, end)) % (2 * np.pi)
    turn = np.where(closed, 2 * np.pi, turn)
    short = (chord < SHORTEST_DIGITS * resolution) & ~closed & (full_turns == 0)
    short &= np.isnan(stated) | (stated < np.pi)
    short |= closed & (rise > 0) & (rise < SHORTEST_DIGITS * resolution) & np.isnan(stated) & (full_turns == 0)
    turn, full_turns = _as_stated(table, turn, full_turns, stated, resolution / radius, short, file)

    agree, against = _votes(tip, kind, pose, start, end, normal, resolution)
    inner = [(row, point) for row, arc in enumerate(table) for point in arc.passes]
    if inner:
        row = np.array([row for row, _ in inner], np.int64)
        spoke = np.array([point for _, point in inner]) - centre[row]
        spoke = spoke - dot(spoke, normal[row])[:, None] * normal[row]
        off = ~(np.abs(norm(spoke) - radius[row]) <= allowed[row])
        if off.any():
            first = int(off.argmax())
            values = {"which": "point", "distance": norm(spoke)[first], "radius": radius[row[first]]}
            raise error("CS123", file, table[row[first]].line, **values)
        passed = np.arctan2(dot(np.cross(start[row], spoke), normal[row]), dot(start[row], spoke)) % (2 * np.pi)
        clear = np.minimum(passed, 2 * np.pi - passed) * radius[row] > VOTING_DIGITS * resolution[row]
        beyond = passed > turn[row] + allowed[row] / radius[row]
        np.add.at(agree, row, clear & ~beyond)
        np.add.at(against, row, clear & beyond)
    certain = np.array([arc.certain for arc in table])
    contrary = (against > 0) & (agree == 0) & ~short & np.isnan(stated) & ~certain
    findings = []
    if rule == "tangent":
        turned = contrary & ~closed
        normal = np.where(contrary[:, None], -normal, normal)
        turn = np.where(turned, 2 * np.pi - turn, turn)
    if contrary.any():
        how = "as the neighbours ask" if rule == "tangent" else "as written"
        first = int(contrary.argmax())
        findings.append(finding("CS142", table[first].line, int(contrary.sum()), how=how))
    if short.any():
        findings.append(finding("CS141", table[int(short.argmax())].line, int(short.sum())))
    good = ~short
    arcs = Arcs(pose[good], centre[good], normal[good], (turn + 2 * np.pi * full_turns)[good])
    return arcs, pose[short], pose[contrary], findings


def _as_stated(
    table: Sequence[Arc], turn: Floats, full_turns: Floats, stated: Floats, noise: Floats, short: Bools, file: str
) -> tuple[Floats, Floats]:
    """Turns of arcs that say their angle: it decides between nothing and a full circle, and adds whole turns."""
    given = ~np.isnan(stated) & ~short
    if not given.any():
        return turn, full_turns
    whole = np.round((stated - turn) / (2 * np.pi))
    miss = np.abs(stated - turn - 2 * np.pi * whole)
    wrong = given & ~(miss <= RADIUS_DIGITS * noise + RADIUS_SHARE * np.maximum(stated, 1))
    if wrong.any():
        first = int(wrong.argmax())
        arc = table[first]
        written, found = math.degrees(arc.sweep), math.degrees(turn[first])
        why = f"its angle is {written:g} degrees, its end stands at {found:g}"
        raise error("CS126", file, arc.line, word=arc.word, why=why)
    return turn, np.where(given, np.maximum(whole, 0), full_turns)


def _votes(
    tip: Floats, kind: NDArray[np.uint8], pose: Ints, start: Floats, end: Floats, normal: Floats, resolution: Floats
) -> tuple[Ints, Ints]:
    """Count, for every arc, the neighbouring lines that it joins smoothly and those it would meet by a cusp."""
    agree, against = np.zeros(len(pose), np.int64), np.zeros(len(pose), np.int64)
    last = len(tip) - 1
    before = np.maximum(pose - 2, 0)
    after = np.minimum(pose + 1, last)
    sides = (
        (tip[pose - 1] - tip[before], start, (pose > 1) & (kind[pose - 1] == Move.LINEAR)),
        (tip[after] - tip[pose], end, (pose < last) & (kind[after] == Move.LINEAR)),
    )
    for line, spoke, there in sides:
        tangent = np.cross(normal, spoke)
        line = line - dot(line, normal)[:, None] * normal
        length, reach = norm(line), norm(tangent)
        there = there & (length > VOTING_DIGITS * resolution) & (reach > 0)
        cosine = dot(line, tangent) / np.where(there, length * reach, 1.0)
        agree += there & (cosine > math.cos(TANGENT))
        against += there & (cosine < -math.cos(TANGENT))
    return agree, against


_SURFACE: Final = re.compile(r"\((CIRCLE|CYLNDR)/(CANON,)?([^()]*)\)", re.IGNORECASE)
#: check surfaces and their numbers, in the order in which they count
_CHECKS: Final = (
    ("LINE", 6, re.compile(r"\(LINE/([^()]*)\)", re.IGNORECASE)),
    ("POINT", 3, re.compile(r"\(POINT/([^()]*)\)", re.IGNORECASE)),
    ("PLANE", 4, re.compile(r"\(PLANE/([^()A-Z]*)\)", re.IGNORECASE)),
)
_MEETING: Final = re.compile(r",([0-9]+),INTOF,", re.IGNORECASE)

Direction = tuple[str, Vector] | None


def read_drive_arc(record: Record, start: Vector, direction: Direction, file: str) -> tuple[Arc, Vector]:
    """Read TLON,GOFWD on a circle or cylinder; return the arc and its end point (InputError CS123, CS125, CS126).

    The tool stands at `start`; INDIRV or INDIRP before it gave the direction.
    """
    surface, _, check = "".join(record.text.split()).partition(",ON,")
    found = _SURFACE.search(surface)
    if found is None or not check:
        raise _refuse(record, file, "only CIRCLE and CYLNDR with a check surface behind ON are understood")
    values = _values(found[3], record, file)
    plain = found[1].upper() == "CIRCLE" and not found[2]
    if len(values) != (4 if plain else 7):
        raise _refuse(record, file, f"{found[1].upper()} has {len(values)} numbers")
    if direction is None:
        raise _refuse(record, file, "no INDIRV or INDIRP says which way round")
    word, vector = direction
    centre = np.array(values[:3])
    normal = np.cross(np.array(start) - centre, np.array(vector) - (start if word == "INDIRP" else 0.0))
    if not plain:
        axis = np.array(values[3:6])
        check_normal(float(np.linalg.norm(axis)), record, file)
        normal = math.copysign(1.0, float(np.dot(normal, axis))) * axis
    size = float(np.linalg.norm(normal))
    if not 0 < size < math.inf:
        raise _refuse(record, file, "its direction points through the centre")
    arc = _arc(record, centre, normal / size, values[-1], found[3], file)
    return arc, _end(record, arc, np.array(start), f",{check}", file)


def read_helix(record: Record, start: Vector, direction: Direction, file: str) -> tuple[Arc, Vector]:
    """Read HELICAL/centre,tangent,axis,pitch,radius[,angle,height,turns],end; return the arc and its end point.

    Raises InputError CS106, CS120, CS124-CS127.
    """
    values = record.values
    if len(values) != len(record.args) or len(values) not in (14, 17):
        want = "centre, tangent, axis, pitch, radius, (angle, height, turns,) end"
        raise error("CS120", file, record.line, word="HELICAL", count=len(values), s="s", want=want)
    check_range(values, file, record.line)
    centre, tangent, axis = np.array(values[:9]).reshape(3, 3)
    pitch, radius = values[9:11]
    end = np.array(values[-3:])
    length = float(np.linalg.norm(axis))
    check_normal(length, record, file)
    axis = axis / length
    side = float(np.dot(np.cross(np.array(start) - centre, tangent), axis))
    if not (side != 0 and math.isfinite(side) and pitch > 0):
        raise _refuse(record, file, "it has no direction or no pitch")
    sweep = 2 * math.pi * abs(float(np.dot(end - np.array(start), axis))) / pitch
    check_sweep(sweep, record, file)
    arc = _arc(record, centre, math.copysign(1.0, side) * axis, radius, record.text.partition("/")[2], file, sweep)
    return arc, triple(end)


def _arc(
    record: Record, centre: Floats, normal: Floats, radius: float, text: str, file: str, sweep: float = math.nan
) -> Arc:
    if not 0 < radius < math.inf:
        raise error("CS125", file, record.line, word=record.word, radius=radius)
    at = triple(centre), triple(normal)
    return Arc(record.line, record.word, *at, radius, 1, sweep, resolution_of(text, 0), certain=True)


def _end(record: Record, arc: Arc, start: Floats, check: str, file: str) -> Vector:
    """End of the arc: a point of the check surface that is on the circle, or where the two meet."""
    centre, normal = np.array(arc.centre), np.array(arc.normal)
    found = _MEETING.search(check)
    wanted = int(found[1]) if found is not None else 1
    near = max(RADIUS_DIGITS * arc.resolution, RADIUS_SHARE * arc.radius)
    shapes = ((name, size, surface.findall(check)) for name, size, surface in _CHECKS)
    name, size, texts = next((shape for shape in shapes if shape[2]), ("", 0, []))
    if not texts:
        raise _refuse(record, file, "its check surface is not understood")
    values = _values(texts[-1], record, file)
    if len(values) != size:
        raise _refuse(record, file, f"{name} has {len(values)} numbers")
    last = None if name == "PLANE" else np.array(values[-3:])
    if last is None:
        plane = np.array(values[:3])
        origin = plane * values[3]
    else:
        origin = np.array(values[:3]) if name == "LINE" else centre
        plane = np.cross(last - origin, normal)
    spoke = start - centre
    if last is not None:
        out = last - centre
        height = float(np.dot(out, normal))
        if abs(float(np.linalg.norm(out - height * normal)) - arc.radius) <= near:
            return triple(last)
    # the plane of the check surface cuts the circle where a·cos + b·sin = c
    spoke = spoke - float(np.dot(spoke, normal)) * normal
    a, b = float(np.dot(spoke, plane)), float(np.dot(np.cross(normal, spoke), plane))
    c = float(np.dot(origin - centre, plane))
    if not 0 < math.hypot(a, b) < math.inf or not abs(c) <= math.hypot(a, b):
        raise _refuse(record, file, "circle and check surface do not meet")
    middle, half = math.atan2(b, a), math.acos(c / math.hypot(a, b))
    least = near / arc.radius
    angles = sorted(least + (middle + side * half - least) % (2 * math.pi) for side in (-1, 1))
    if not 1 <= wanted <= len(angles):
        raise _refuse(record, file, f"there is no meeting {wanted}")
    angle = angles[wanted - 1]
    height = float(np.dot(start - centre, normal))
    turned = math.cos(angle) * spoke + math.sin(angle) * np.cross(normal, spoke)
    return triple(centre + turned + height * normal)


def _values(text: str, record: Record, file: str) -> list[float]:
    values = []
    for token in text.split(","):
        value = number(token)
        if value is None:
            raise error("CS106", file, record.line, word=record.word, token=token)
        values.append(value)
    check_range(values, file, record.line)
    return values


def _refuse(record: Record, file: str, why: str) -> InputError:
    return error("CS126", file, record.line, word=record.word, why=why)
