"""Everything that a page shows, as arrays and plain values."""

from __future__ import annotations

import base64
import gzip
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import some_rows
from cornersmooth.feedrate import Limits
from cornersmooth.geometry.tool import Tool, tools_of
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Floats, Ints, Program, SmoothProgram
from cornersmooth.nc_reader import NcProgram
from cornersmooth.page.corners import KINDS, CornerList, measured_corners, smoothed_corners
from cornersmooth.page.planned_speeds import (
    NOT_PLANNED,
    Planned,
    axis_loads,
    clock,
    ends_of_steps,
    feed_seconds,
    looks,
    plan_all,
    speeds_over,
)
from cornersmooth.report.paths import OriginalPath, WrittenPath, original_path, thinned, written_path
from cornersmooth.settings import Settings
from cornersmooth.verify import Verification

if TYPE_CHECKING:
    from cornersmooth.surface import SurfaceMap

#: types that a browser has arrays of, by the name of the page
_TYPES = {"f4": np.float32, "i4": np.int32, "u1": np.uint8}

#: starts of arrays are multiples of this: typed arrays want to be aligned
_ALIGNED = 4


class Pack:
    """Arrays by name, for `text` and `table`."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._length = 0
        self.table: dict[str, dict[str, Any]] = {}

    def add(self, name: str, values: NDArray[Any], kind: str, bits: int | None = None) -> None:
        """Add an array (n,) or (n, w) as ``"f4"``, ``"i4"`` or ``"u1"``; to so many binary places it packs better."""
        if bits is not None:
            values = np.ldexp(np.round(np.ldexp(values, bits)), -bits)
        data = np.ascontiguousarray(values, dtype=np.dtype(_TYPES[kind]).newbyteorder("<")).tobytes()
        width = 1 if values.ndim == 1 else values.shape[1]
        self.table[name] = {"type": kind, "at": self._length, "count": len(values), "width": width}
        padding = -len(data) % _ALIGNED
        self._parts.append(data + bytes(padding))
        self._length += len(data) + padding

    def text(self) -> str:
        """Everything in base64 of gzip; the same arrays give the same text."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), 6, mtime=0)).decode("ascii")


SCHEMA = "cornersmooth-page/1"

#: about so many points of each path are drawn
MOST_POINTS = 250_000

#: poses on either side of a listed corner that are drawn
_BESIDE = 1

#: steps of the charts: this many, or so many for each pose where that is more, but no more than the last
_STEPS, _STEPS_PER_POSE, _MOST_STEPS = 2000, 6, 12_000

#: binary places of unit vectors and of angles, degrees: what nobody sees
_FINE = 18

#: points along the axis of a program without a length of anything
_NO_WAY = 1e-9


@dataclass(frozen=True)
class Subject:
    """What a page is made of."""

    program: Program
    nc: NcProgram  #: the written text, read back
    settings: Settings  #: at least tolerance and axis length count
    verification: Verification | None = None
    smoothed: SmoothProgram | None = None  #: where the text was made here
    dense: bool = True  #: whether transitions are written as lines
    machine: Machine | None = None
    planner: str = ""  #: of the control's table: with a law of its own no speeds are planned
    tool: Tool | None = None  #: instead of those in the file
    surface: SurfaceMap | None = None
    #: of a filtered program: first and last line of each run, in the old program and in the new one
    runs: Sequence[tuple[int, int, int, int]] | None = None
    #: of a filtered program cuts that stay as they are: how many, first line, reason
    left: Sequence[Mapping[str, Any]] = ()
    limited_by: Sequence[str] = ()  #: limits that the verdict names, such as ``"jerk of C"``


@dataclass(frozen=True)
class _View:
    """What is drawn: both paths with their corners and times, from a point in the middle."""

    subject: Subject
    original: OriginalPath
    written: WrittenPath
    planned: Planned
    corners: CornerList
    seconds: Floats  #: (m,) s: of the points of the written path, planned or as programmed
    places: Ints  #: (n,): the point of the written path that is the last on the move into each pose
    centre: Floats

    @classmethod
    def of(cls, subject: Subject) -> _View:
        """Both paths of a subject, planned; deviations at poses are those that were measured there."""
        program, settings, found = subject.program, subject.settings, subject.verification
        original = original_path(program)
        written = written_path(program, subject.nc, original, settings)
        planned = Planned({}, {}, None, (NOT_PLANNED,))
        if not subject.planner:
            machine = subject.machine
            planned = plan_all(program, original, written, subject.nc, machine=machine, settings=settings)
        if subject.smoothed is not None:
            corners = smoothed_corners(subject.smoothed, found, dense=subject.dense)
        else:
            assert found is not None
            corners = measured_corners(program, found)
        if subject.runs is not None:
            corners = replace(some_rows(corners, np.zeros(0, np.int64)), counts={})
        centre = 0.5 * (program.tip.min(axis=0) + program.tip.max(axis=0))
        seconds = feed_seconds(written, Limits.rapid) if planned.seconds is None else planned.seconds
        reached = np.maximum.accumulate(written.pose)
        places = np.maximum(np.searchsorted(reached, np.arange(len(program)), side="right") - 1, 0)
        if found is not None:
            for off, of_poses in ((written.tip_off, found.pose_tip), (written.axis_off, found.pose_axis_point)):
                poses = np.flatnonzero(np.isfinite(of_poses) & np.isfinite(off[places]))
                np.maximum.at(off, places[poses], of_poses[poses])
        return cls(subject, original, written, planned, corners, seconds, places, centre)


def page_values(subject: Subject, story: Mapping[str, Any]) -> tuple[dict[str, Any], Pack]:
    """Plain values and arrays of a page; `story` is what it says in words, its notes last."""
    view, pack = _View.of(subject), Pack()
    original, planned, seconds, corners = view.original, view.planned, view.seconds, view.corners
    _add_original(pack, view)
    _add_written(pack, view)
    charts = _add_charts(pack, view)
    _add_corners(pack, view)
    meta: dict[str, Any] = {
        "schema": SCHEMA,
        **story,
        "notes": [*story["notes"], *planned.left_out, *_thinning_note(len(view.written), original)],
        "tolerance": subject.settings.tolerance,
        "axis_length": subject.settings.axis_length,
        "axis_name": "axis point" if subject.settings.axis_tolerance is None else "tool axis as a share of ε",
        "centre": view.centre.tolist(),
        "seconds": float(seconds[-1]),
        "timed": planned.seconds is not None,
        "way": float(original.way[-1]),
        "totals": {name: law.total for name, law in planned.laws.items()},
        "corners": None
        if subject.runs is not None
        else {"kinds": list(KINDS), "reasons": list(corners.reasons), "counts": corners.counts},
        "charts": charts,
        "tools": _tools(view),
    }
    if subject.runs is not None:
        meta["runs"] = _runs(subject.runs, view.written, planned)
        meta["left"] = [dict(one) for one in subject.left]
    if subject.surface is not None:
        meta["surface"] = _add_surface(pack, subject.surface, view.centre)
    return meta, pack


def _add_original(pack: Pack, view: _View) -> None:
    original, program = view.original, view.subject.program
    must = original.breaks | original.rapid
    must[:-1] |= original.rapid[1:] | original.breaks[1:]
    if len(must) > MOST_POINTS and must.sum() > MOST_POINTS:
        must = original.breaks.copy()
    must |= _seen(view.corners, np.arange(len(program)), len(program))[original.pose]
    rows = thinned(original.tip, np.zeros(len(must)), must, MOST_POINTS)
    pack.add("o_tip", original.tip[rows] - view.centre, "f4")
    pack.add("o_axis", original.axis[rows], "f4", _FINE)
    pack.add("o_way", original.way[original.pose[rows]], "f4")
    pack.add("o_move", np.where(original.breaks, 0, np.where(original.rapid, 1, 2))[rows], "u1")


def _add_written(pack: Pack, view: _View) -> None:
    written, planned = view.written, view.planned
    larger, most = np.fmax(written.tip_off, written.axis_off), MOST_POINTS
    must = written.rapid.copy()
    must[:-1] |= written.rapid[1:]
    if must.sum() > MOST_POINTS:
        must[:] = False
    seen, kind = _seen(view.corners, view.places, len(written)), _kinds(written, view.corners, view.places)
    must |= (larger > view.subject.settings.tolerance) | seen
    most -= min(int(seen.sum()), most // 2) if len(written) > most else 0
    rows = thinned(written.tip, larger, must, most)
    speed = np.full(len(written), np.nan)
    if planned.seconds is not None:
        speed = speeds_over(planned.laws["written"], planned.seconds)
    pack.add("w_tip", written.tip[rows] - view.centre, "f4")
    pack.add("w_axis", written.axis[rows], "f4", _FINE)
    pack.add("w_kind", kind[rows], "u1")
    pack.add("w_rapid", written.rapid[rows], "u1")
    pack.add("w_angle", written.angle_off[rows], "f4", _FINE)
    for name, values in (
        ("w_way", written.way),
        ("w_time", view.seconds),
        ("w_off", written.tip_off),
        ("w_axis_off", written.axis_off),
        ("w_feed", written.feed),
        ("w_speed", speed),
        ("w_curvature", written.curvature),
    ):
        pack.add(name, values[rows], "f4")
    pack.add("w_line", written.cl_line[rows], "i4")
    pack.add("w_nc", written.nc_line[rows], "i4")


def _seen(corners: CornerList, places: Ints, count: int) -> Bools:
    """(count,) rows of a path that belong to listed corners; `places` (n,) is the row of each pose, ascending.

    All of it about those out of tolerance, and about as many of the others as fit.
    """
    first = places[np.maximum(corners.pose - _BESIDE, 0)]
    # the vertex at a pose may count as the first point of the next move
    last = np.minimum(places[np.minimum(corners.pose + _BESIDE, len(places) - 1)] + 1, count - 1)
    fits = (corners.kind == 0) | (np.cumsum(last + 1 - first) <= MOST_POINTS // 8)
    ends = [np.bincount(rows[fits], minlength=count + 1)[: count + 1] for rows in (first, last + 1)]
    seen: Bools = np.cumsum(ends[0] - ends[1])[:count] > 0
    seen[places[corners.pose]] = True
    return seen


def _kinds(written: WrittenPath, corners: CornerList, places: Ints) -> Ints:
    """What the corner is that each written point belongs to: those within half its length of it; 255 for none."""
    kind = np.full(len(written), 255, np.int64)
    at = places[corners.pose]
    half = 0.5 * np.nan_to_num(corners.length, nan=0.0)
    low = np.searchsorted(written.way, written.way[at] - half - _NO_WAY)
    high = np.maximum(np.searchsorted(written.way, written.way[at] + half + _NO_WAY, side="right"), at + 1)
    for rank in np.argsort(-corners.kind, kind="stable").tolist():
        kind[low[rank] : high[rank]] = corners.kind[rank]
    return kind


def _add_corners(pack: Pack, view: _View) -> None:
    corners, program = view.corners, view.subject.program
    pack.add("c_tip", program.tip[corners.pose] - view.centre, "f4")
    pack.add("c_axis", program.axis[corners.pose], "f4", _FINE)
    pack.add("c_kind", corners.kind, "u1")
    pack.add("c_reason", corners.reason, "u1")
    pack.add("c_way", view.original.way[corners.pose], "f4")
    for name in ("turn", "axis_turn", "length", "tip_off", "axis_off"):
        pack.add(f"c_{name.removeprefix('tip_')}", getattr(corners, name), "f4")
    pack.add("c_line", corners.cl_line, "i4")
    pack.add("c_nc", corners.nc_line, "i4")


def _add_charts(pack: Pack, view: _View) -> dict[str, Any]:
    """Series of the charts along the way and over time; values come in pairs, so that no peak is lost."""
    original, written, planned, seconds = view.original, view.written, view.planned, view.seconds
    count = int(np.clip(_STEPS_PER_POSE * len(original.way), _STEPS, _MOST_STEPS))
    charts: dict[str, Any] = {}
    end = max(float(original.way[-1]), _NO_WAY)
    longest = max((law.total for law in planned.laws.values()), default=0.0)
    longest = max(longest, float(seconds[-1]), _NO_WAY)
    for scale, last, where in (("way", end, written.way), ("time", longest, seconds)):
        steps = np.linspace(0.0, last, count + 1)
        pack.add(f"{scale}_x", np.linspace(0.0, last, 2 * count, endpoint=False), "f4")
        for name, values in (("off", written.tip_off), ("axis_off", written.axis_off)):
            pack.add(f"{scale}_{name}", np.repeat(_highest(values, where, steps), 2), "f4")
        times = np.linspace(0.0, last, 2 * count, endpoint=False)
        along, loads = scale == "way", {}
        for name, law in planned.laws.items():
            seen = clock(planned, name, looks(steps)) if along else times
            speed = speeds_over(law, seen)
            own = axis_loads(law, seen, np.isfinite(speed))
            if along:  # the lowest and the highest of each step
                speed, own = ends_of_steps(speed), {axis: ends_of_steps(load) for axis, load in own.items()}
            pack.add(f"{scale}_speed_{name}", np.round(speed, 1), "f4")
            loads[name] = {axis: np.round(load, 1) for axis, load in own.items()}
            for axis, load in loads[name].items():
                pack.add(f"{scale}_{axis}_{name}", load, "f4")
        if {"direct", "written"} <= set(loads):
            ways = times if along else np.interp(times, seconds, written.way, right=np.nan)
            saved = clock(planned, "direct", ways) - clock(planned, "written", ways)
            pack.add(f"{scale}_saved", np.round(saved, 3), "f4")
        if along:
            changes = {axis: _change(loads, axis) for axis in loads.get("written", ())}
            # the axis that the verdict names first
            named = [text[-1] for text in view.subject.limited_by if text[-5:-1] == " of "]
            rank = {axis: named.index(axis) if axis in named else len(named) for axis in changes}
            charts["axes"] = sorted(filter(changes.get, changes), key=lambda axis: (rank[axis], -changes[axis]))
    charts["speeds"] = list(planned.laws)
    return charts


def _runs(runs: Sequence[tuple[int, int, int, int]], written: WrittenPath, planned: Planned) -> list[dict[str, Any]]:
    """What each run of a filtered program is off, and its time before and after where both are planned, s."""
    off = np.nan_to_num(np.fmax(written.tip_off, written.axis_off), nan=-1.0)
    found = []
    for first, last, nc_first, nc_last in runs:
        rows = np.flatnonzero((written.nc_line >= nc_first) & (written.nc_line <= nc_last) & ~written.rapid)
        if not len(rows):
            continue
        way = written.way[[max(rows[0] - 1, 0), rows[-1]]]
        times = [np.diff(clock(planned, law, way)) for law in ("direct", "written") if law in planned.laws]
        before, after = (float(time[0]) for time in times) if len(times) == 2 else (None, None)
        found.append(
            {
                "first": first,
                "last": last,
                "nc_first": nc_first,
                "nc_last": nc_last,
                "way": way.tolist(),
                "off": float(off[rows].max()),
                "before": before,
                "after": after,
            }
        )
    return found


def _change(loads: Mapping[str, Mapping[str, Floats]], axis: str) -> float:
    """How much an axis runs otherwise than before, on the average."""
    before, after = (np.nan_to_num(laws.get(axis, 0.0)) for laws in (loads.get("direct", {}), loads["written"]))
    return float(np.abs(after - before).mean())


def _highest(values: Floats, where: Floats, steps: Floats) -> Floats:
    """Largest value at places within each step; between places that of the next; NaN where there is none."""
    first = np.minimum(np.searchsorted(where, steps)[:-1], len(values) - 1)
    bare = np.where(np.isfinite(values), values, -1.0)
    top = np.maximum.reduceat(bare, first)
    return np.where(top < 0.0, np.nan, top)


def _tools(view: _View) -> list[dict[str, Any]]:
    """Tools with the time from which each is used, and their outline for drawing."""
    subject, seconds = view.subject, view.seconds
    own = subject.tool if subject.surface is None else subject.surface.tool
    found = tools_of(subject.program) if own is None else [(0, own, 0)]
    reached = np.maximum.accumulate(view.written.pose)
    tools = []
    for pose, tool, line in found:
        place = min(int(np.searchsorted(reached, pose)), len(seconds) - 1)
        length = max(3.0 * tool.diameter, 1.5 * subject.settings.axis_length)
        length = min(length, tool.length) if tool.length > tool.side_from else length
        steep = np.radians(tool.taper)
        low = 90.0 - tool.tip_angle
        sine = np.sin(np.linspace(np.radians(low), steep, 9)) if tool.corner_radius else np.zeros(0)
        out, up, _ = tool.profile(sine, np.array([tool.side_from, max(length, tool.side_from + 1e-3)]))
        tools.append(
            {
                "from_second": float(seconds[place]),
                "text": tool.describe(),
                "line": line,
                "outline": [[0.0, 0.0], *np.stack((np.maximum(out, 0.0), up), axis=1).round(6).tolist()],
            }
        )
    if tools:
        tools[0]["from_second"] = 0.0
    return tools


def _add_surface(pack: Pack, surface: SurfaceMap, centre: Floats) -> dict[str, Any]:
    known = np.flatnonzero(surface.known)
    points = surface.points
    edges, counts = surface.histogram()
    keep = thinned(points.point[known], np.abs(surface.off[known]), np.zeros(len(known), np.bool_), MOST_POINTS)
    rows = known[keep]
    pack.add("s_tip", points.point[rows] - centre, "f4")
    pack.add("s_off", surface.off[rows], "f4")
    pack.add("s_station", points.station[rows], "i4")
    pack.add("s_level", 2 * points.level[rows] + points.side[rows], "u1")
    pack.add("h_edges", edges, "f4")
    pack.add("h_counts", counts, "f4")
    return {"span": surface.span, **surface.as_dict()}


def _thinning_note(points: int, original: OriginalPath) -> list[str]:
    if max(points, len(original.tip)) <= MOST_POINTS:
        return []
    return [
        f"Of {points:,} points of the written path about {MOST_POINTS:,} are drawn: ends and bends of the path, the "
        "largest deviation of every stretch, and all that is out of tolerance. Charts are of all points."
    ]
