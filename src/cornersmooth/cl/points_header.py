"""Which column of a point file is what: names of header lines, and the shapes that need no header."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from cornersmooth.cl.messages import error
from cornersmooth.errors import InputError
from cornersmooth.model import Units

#: what the second three columns hold; "values" leaves it to the numbers
Meaning = Literal["none", "vectors", "points", "values"]
Triple = tuple[int, int, int]

_TIPS = (
    *("x y z", "xa ya za", "x1 y1 z1", "px py pz", "xp yp zp", "posx posy posz", "tipx tipy tipz"),
    *("pointx pointy pointz", "xt yt zt", "ax ay az", "pxw pyw pzw"),
)
_SECOND: dict[Meaning, tuple[str, ...]] = {
    "vectors": (
        *("i j k", "nx ny nz", "ox oy oz", "ti tj tk", "vx vy vz", "axisx axisy axisz", "ax ay az", "tx ty tz"),
        *("ux uy uz", "dx dy dz", "vi vj vk", "ai aj ak", "ii jj kk", "xv yv zv", "dirx diry dirz", "vecx vecy vecz"),
        *("toolaxisx toolaxisy toolaxisz", "normalx normaly normalz", "toolx tooly toolz", "oiw ojw okw"),
    ),
    "points": ("xb yb zb", "x2 y2 z2", "bx by bz", "qx qy qz", "xq yq zq", "axispointx axispointy axispointz"),
    "values": ("u v w",),
}
_FEEDS = ("f", "feed", "feedrate", "fedrat", "vf", "feedmmmin", "feedratemmmin", "feedmmpm")

#: columns that say which moves are rapid: a flag (1, true), a G code (0 is rapid), or a word
Rapid = Literal["flag", "code", "word"]
_RAPIDS: dict[str, Rapid] = {
    **dict.fromkeys(("rapid", "israpid", "rapidmove", "rapidflag", "g0", "isg0"), "flag"),
    **dict.fromkeys(("g", "gcode", "code", "cmd", "command"), "code"),
    **dict.fromkeys(
        ("type", "movetype", "motiontype", "movement", "motion", "move", "mode", "kind", "feedtype"), "word"
    ),
}
#: columns that number passes
_PASSES = frozenset(
    """
    pass passno passid passnumber passindex path pathid pathno strip layer curve contour cut cutno track stroke block
    section operation op toolpath polyline segment seg group
    """.split()
)
_COUNTERS = ("n", "no", "nr", "num", "number", "id", "idx", "index", "line", "row", "point", "pose", "t", "time")
#: columns that order a tool, a speed, coolant or a function, which a table of positions does not carry to the control
_ORDERS = frozenset(
    """
    t tool toolno toolnr toolnumber toolid toolname toolindex s spindle spindlespeed rpm coolant mist flood m mcode
    mfunction aux
    """.split()
)

#: units a header may state after a name, as in ``x [mm]``
_LENGTHS: dict[str, tuple[Units, float]] = {
    **dict.fromkeys(("in", "inch", "inches"), ("inch", 1.0)),
    **{
        name: ("mm", factor)
        for name, factor in (("mm", 1.0), ("m", 1000.0), ("cm", 10.0), ("um", 0.001), ("µm", 0.001))
    },
}
_FEED_UNITS: dict[str, tuple[Units, float]] = {
    **dict.fromkeys(("mm/min", "mmpm"), ("mm", 1.0)),
    **dict.fromkeys(("in/min", "ipm", "inch/min"), ("inch", 1.0)),
    "m/min": ("mm", 1000.0),
    "mm/s": ("mm", 60.0),
    "m/s": ("mm", 60000.0),
}
_UNIT = re.compile(r"[\[(<]\s*([^\])>]*?)\s*[\])>]|[_/](mm|in|inch|deg|rad)$")

#: degrees in the unit of an angle
_ANGLES = {
    **dict.fromkeys(("deg", "degree", "degrees", "°"), 1.0),
    **dict.fromkeys(("rad", "radian", "radians"), 180.0 / math.pi),
}

#: spellings that mean the tool axis, and those that mean a surface normal beside such a one
_SURELY_AXES = {"i j k", "axisx axisy axisz", "toolaxisx toolaxisy toolaxisz", "toolx tooly toolz"}
_NORMALS = {"nx ny nz", "normalx normaly normalz"}


@dataclass(frozen=True)
class Columns:
    """Columns of a point file, counted from 0."""

    width: int  #: columns of every row
    tip: Triple
    second: Triple | None = None  #: axis vector or second point, see `meaning`
    meaning: Meaning = "none"
    feed: int | None = None
    rapid: int | None = None  #: says which moves are rapid, as `rapid_as` has it
    rapid_as: Rapid = "word"
    passes: int | None = None  #: numbers the passes
    orders: tuple[int, ...] = ()  #: of a tool, a speed or a function
    names: tuple[str, ...] = ()  #: of all columns, for messages
    unused: tuple[str, ...] = ()  #: names of columns that are not read; counters and times are not counted among them
    units: Units | None = None  #: what the header says about units
    factor: float = 1.0  #: of lengths, to `units`
    #: of the rotary axes of a machine, in place of a tool axis, in their order, and the degrees in their units
    angles: tuple[int, ...] = ()
    degrees: tuple[float, ...] = ()
    feed_factor: float | None = None  #: of feeds per minute; None where the header says nothing of them

    @property
    def wanted(self) -> tuple[int, ...]:
        """Columns of tip and axis, which must hold a number in every row."""
        return (*self.tip, *(self.second or ()), *self.angles)


def from_width(width: int, file: str, line: int) -> Columns:
    """Columns of a file without a header: 3, 6 or 7 columns (InputError CS159 for any other number)."""
    if width == 3:
        return Columns(3, (0, 1, 2))
    if width in (6, 7):
        return Columns(width, (0, 1, 2), (3, 4, 5), "values", 6 if width == 7 else None)
    raise error("CS159", file, line, got=width)


def from_header(text: str, file: str, line: int, rotary: tuple[str, ...] = ()) -> Columns:
    """Columns that a header line names; the rotary axes of a machine may take the place of a tool axis.

    Raises InputError CS156 where the names leave tip or axis open, CS162 for unknown units, CS165 for a quaternion.
    """

    def refuse(why: str) -> InputError:
        return error("CS156", file, line, why=why)

    names = _split(text, r"[,;\t]") if re.search(r"[,;\t]", text) else _split(text, r"\s+")
    if len(names) < 3 or not _find(_TIPS, _plain(names)):
        names = _split(text, r"[,;\s]+")
    plain = _plain(names)
    if twice := sorted({name for name in plain if name and plain.count(name) > 1}):
        raise refuse(f"{twice[0]!r} stands there twice")
    tip = _find(_TIPS, plain)
    if tip is None:
        raise refuse(f"no x, y and z in {text.strip()[:60]!r}")
    left = [name if column not in tip else "" for column, name in enumerate(plain)]
    second, meaning = _second(names, left, refuse)
    feed = next((left.index(name) for name in _FEEDS if name in left), None)
    rapid = next((left.index(name) for name in _RAPIDS if name in left), None)
    angles = tuple(left.index(name.lower()) for name in rotary if name.lower() in left) if second is None else ()
    angles = angles if len(angles) == len(rotary) else ()
    degrees = tuple(_ANGLES[unit] for column in angles if (unit := _unit(names[column])) in _ANGLES)
    if len(degrees) < len(angles):
        raise refuse(f"{', '.join(sorted(rotary))} are angles without [deg] or [rad] behind their names")
    used = {*tip, *(second or ()), *angles, feed, rapid}
    rest = {c: name for c, name in enumerate(left) if name and c not in used and name not in _COUNTERS}
    others = {*rest.values()}
    unused = tuple(names[c].strip() for c in rest)
    if second is None and not angles and not others <= _PASSES:
        # an axis in a spelling we do not know must not become +Z in silence
        more = "; angles of its rotary axes need --machine" if len(others & {"a", "b", "c"}) > 1 else ""
        raise refuse(f"no tool axis in {', '.join(unused)}{more}")
    axis = [left[c] for c in second or ()]
    if scalar := _scalar(list(rest.values()), set(axis)):
        raise error("CS165", file, line, names=", ".join((*axis, scalar)))
    lengths = {*tip, *(second if second and meaning == "points" else ())}
    found: dict[bool, set[tuple[Units, float]]] = {False: set(), True: set()}
    for column in sorted(lengths) + ([] if feed is None else [feed]):
        unit = _unit(names[column])
        known = (_FEED_UNITS if column == feed else _LENGTHS).get(unit)
        if unit and known is None:
            raise error("CS162", file, line, column=names[column].strip(), unit=unit)
        found[column == feed] |= {known} if known else set()
    both = {units for units, _ in found[False] | found[True]}
    if len(both) > 1 or len(found[False]) > 1:
        raise refuse(f"{'mm and inch' if len(both) > 1 else 'two units'} in one header")
    return Columns(
        *(len(names), tip, second, meaning, feed, rapid),
        rapid_as="word" if rapid is None else _RAPIDS[left[rapid]],
        passes=next((c for c, name in rest.items() if name in _PASSES), None),
        orders=tuple(c for c, name in enumerate(left) if name in _ORDERS and c not in used),
        names=tuple(name.strip() for name in names),
        unused=unused,
        units=next(iter(both), None),
        factor=next((factor for _, factor in found[False]), 1.0),
        angles=angles,
        degrees=degrees,
        feed_factor=next((factor for _, factor in found[True]), None),
    )


def _second(names: list[str], left: list[str], refuse: Callable[[str], InputError]) -> tuple[Triple | None, Meaning]:
    """Columns of the tool axis or of second points, and which of both they are."""
    spelled: dict[str, tuple[Triple, Meaning]] = {
        spelling: (found, meaning)
        for meaning, spellings in _SECOND.items()
        for spelling in spellings
        if (found := _find((spelling,), left))
    }
    surely = [spelling for spelling in spelled if spelling in _SURELY_AXES]
    named = [found for spelling, found in spelled.items() if len(surely) != 1 or spelling not in _NORMALS]
    if len({found for found, _ in named}) > 1:  # a surface normal is no tool axis
        which = " and ".join(",".join(names[c].strip() for c in found) for found, _ in named)
        raise refuse(f"{which} may each be the tool axis")
    return named[0] if named else (None, "none")


def _unit(name: str) -> str:
    """Unit that a name of a column states; empty for none."""
    found = _UNIT.search(name.lower().strip(" \"'"))
    return (found[1] or found[2] or "").replace(" ", "").replace('"', "in") if found else ""


def is_header(text: str) -> bool:
    """Whether a line of text names at least the three columns of the tip."""
    return any(_find(_TIPS, _plain(_split(text, pattern))) for pattern in (r"[,;\t]", r"[,;\s]+"))


def _split(text: str, pattern: str) -> list[str]:
    """Cells of a header; a blank before a unit in brackets does not separate."""
    return re.split(pattern, re.sub(r"\s+(?=[\[(<])", "", text.strip()))


def _plain(names: list[str]) -> list[str]:
    """Bare names: lower case, no quotes, units, underscores or blanks."""
    return [re.sub(r"[^a-z0-9]", "", _UNIT.sub("", name.lower().strip(" \"'"))) for name in names]


def _scalar(names: list[str], axis: set[str]) -> str:
    """Name of the scalar part of a quaternion, whose other parts pass for an axis; empty where there is none."""
    q = "qx" in axis
    also = [name for name in names if q and (name.startswith("q") or name in ("s", "scalar", "real"))]
    return next((name for name in names if name == "w" or name in also or name.replace("w", "x") in axis), "")


def _find(spellings: tuple[str, ...], names: list[str]) -> Triple | None:
    for spelling in spellings:
        x, y, z = spelling.split()
        if x in names and y in names and z in names:
            if spelling == "ax ay az" and spellings is _TIPS and "bx" not in names:
                continue  # then it is the axis
            return names.index(x), names.index(y), names.index(z)
    return None
