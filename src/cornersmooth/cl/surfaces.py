"""Arcs written as drive surfaces: CATIA's and Creo's TLON,GOFWD with CIRCLE or CYLNDR, CATIA's HELICAL.

::

    INDIRV/tx,ty,tz
    TLON,GOFWD/(CIRCLE/xc,yc,zc,r),ON,[2,INTOF,](LINE/x1,y1,z1,x2,y2,z2)

The tool leaves its position along the circle in the direction of INDIRV and stops where the check surface behind ON
(a line, or a plane) is met for the first time, or the second time with 2,INTOF (Dassault, Syntax of Generated APT
Instructions; PostWorks 15.1 appendix G). CAM systems let the line end in the end point of the arc.
"""

from __future__ import annotations

import math
import re
from typing import Final

import numpy as np

from cornersmooth.cl.arcs import RADIUS_DIGITS, RADIUS_SHARE, Arc, check_normal, check_sweep, resolution_of
from cornersmooth.cl.grammar import Record, number
from cornersmooth.cl.messages import error
from cornersmooth.cl.poses import Vector, check_range, triple
from cornersmooth.errors import InputError
from cornersmooth.model import Floats

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
