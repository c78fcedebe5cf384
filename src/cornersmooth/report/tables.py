"""Tables: corners, a row each (docs/smooth.md), and what was planned, verified and measured on the surface.

They are CSV text, a block of rows at a time, and lines to read.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import angle_between, dot, norm, square, unit
from cornersmooth.errors import InputError
from cornersmooth.geometry import nurbs
from cornersmooth.kinematics.machine import LINEAR
from cornersmooth.model import Corners, Floats, Ints, LimitedBy, SmoothProgram, Status, Trait
from cornersmooth.settings import METHODS
from cornersmooth.smoothing.construction import RUN_CURVATURE, construction_of, legs_at
from cornersmooth.smoothing.sampling import nodes
from cornersmooth.smoothing.segments import lines_of

if TYPE_CHECKING:
    from cornersmooth.feedrate.timelaw import TimeLaw
    from cornersmooth.model import Program
    from cornersmooth.surface import SurfaceMap
    from cornersmooth.verify import Verification


#: rows of text made at a time
_BLOCK = 10_000


#: columns by name: how values are written (``"%.6f"``), and the values
Columns = dict[str, tuple[str, NDArray[Any]]]


def csv_text(count: int, columns: Callable[[slice], Columns]) -> Iterator[str]:
    """Header, then `count` rows: the function gives the columns of a slice."""
    forms = {name: form for name, (form, _) in columns(slice(0)).items()}
    yield ",".join(forms) + "\n"
    form = ",".join(forms.values()) + "\n"
    for begin in range(0, count, _BLOCK):
        block = columns(slice(begin, min(begin + _BLOCK, count))).values()
        yield "".join(map(form.__mod__, zip(*(values.tolist() for _, values in block), strict=True)))


def _written(form: str, names: str, *values: NDArray[Any]) -> Columns:
    """Columns that are written in one way."""
    return {name: (form, column) for name, column in zip(names.split(), values, strict=True)}


def or_empty(form: str, values: NDArray[Any]) -> NDArray[Any]:
    """Numbers as text; what is not known is empty."""
    return np.array(["" if value != value else form % value for value in values.tolist()], np.str_)


def timelaw_csv(law: TimeLaw) -> Iterator[str]:
    """The law at all multiples of its period and at its end as CSV text, a block of rows at a time.

    Way, speed, acceleration and jerk are in rad where the tip stands still and only the axis turns. For a law that was
    planned for a machine the positions of its axes follow: linear ones as without tool centre point control
    (`cornersmooth.kinematics.machine_position`), rotary ones unwrapped.
    """
    names = () if law.machine_axes is None else law.machine_axes.names
    own = " ".join(f"machine_{name.lower()}_{'mm' if name in LINEAR else 'deg'}" for name in names)
    times = law.every_period()

    def columns(part: slice) -> Columns:
        now = law.at(times[part])
        found = (now.t, now.s, now.v, now.a, now.j, now.centripetal, *now.tip.T, *now.axis.T)
        axes = law.axes_at(times[part])[0].T if names else ()
        # digits that third differences over a period of 1 ms still need; adding 0.0 turns -0.0 into 0.0
        return (
            _written(
                "%.14g",
                "t_s s_mm v_mm_per_s a_mm_per_s2 j_mm_per_s3 centripetal_mm_per_s2 x_mm y_mm z_mm i j k",
                *(one + 0.0 for one in found),
            )
            | _written("%d", "turning line", now.turning, now.line)
            | _written("%.14g", own, *(one + 0.0 for one in axes))
        )

    return csv_text(len(times), columns)


def verification_csv(program: Program, found: Verification) -> Iterator[str]:
    """Header, then a row for every pose that is passed at feed, in blocks of text; lengths are mm."""
    poses = np.flatnonzero(np.isfinite(found.pose_tip))

    def columns(part: slice) -> Columns:
        rows = poses[part]
        axis = found.pose_axis_point[rows] if found.axis_tolerance is None else np.full(len(rows), np.nan)
        return (
            _written("%d", "pose cl_line nc_line", rows, program.line[rows], found.pose_nc_line[rows])
            | _written("%.6f", "x y z", *program.tip[rows].T)
            | _written("%.7f", "tip_deviation_mm", found.pose_tip[rows])
            | _written("%s", "axis_point_deviation_mm", or_empty("%.7f", axis))
            | _written("%.7f", "orientation_deviation_deg", found.pose_angle[rows])
        )

    return csv_text(len(poses), columns)


def surface_csv(surface: SurfaceMap) -> Iterator[str]:
    """Header, then a row for every point, in blocks of text; lengths are mm, overcut is negative, unknown is empty."""
    points = surface.points

    def columns(part: slice) -> Columns:
        side = np.where(points.side[part] == 0, "left", "right")
        return (
            _written("%d", "cl_line station level", points.line[part], points.station[part], points.level[part])
            | _written("%s", "side", side)
            | _written("%.6f", "x y z", *points.point[part].T)
            | _written("%.7f", "nx ny nz", *points.normal[part].T)
            | _written("%s", "off_mm", or_empty("%.7f", surface.off[part]))
        )

    return csv_text(len(surface), columns)


def surface_lines(surface: SurfaceMap) -> Iterator[str]:
    """Table to read."""
    values = surface.as_dict()
    yield f"{'tool':<18}{surface.tool.describe()}, cutting edge {surface.edge:g} mm"
    elsewhere = values["points_cut_away_elsewhere"]
    yield f"{'points':<18}{values['points']:,}; {elsewhere:,} more are cut away by other moves"
    if values["points_beyond_reach"]:
        yield f"{'not reached':<18}{values['points_beyond_reach']:,} points, farther off than {surface.reach:g} mm"
    for name in ("overcut", "undercut"):
        own = values[name]
        where = f" at CL line {own['cl_line']}" if own["cl_line"] else ""
        yield (
            f"{name:<18}largest {own['max_mm']:.6f} mm{where}, 95 % within {own['percentile_95_mm']:.6f} mm, "
            f"mean {own['mean_mm']:.6f} mm, {own['points']:,} points"
        )
    if values["rms_mm"] is not None:
        yield f"{'all':<18}mean {values['mean_mm']:.6f} mm, root mean square {values['rms_mm']:.6f} mm"
        yield f"{'within':<18}{values['within_tolerance_percent']:.4g} % of the points within {surface.tolerance:g} mm"


Column = NDArray[Any]

#: parameters at which the curvature of a transition is looked at; it peaks at or near the middle
_CURVATURE_AT = np.array([0.2, 0.3, 0.38, 0.44, 0.48, 0.5, 0.52, 0.56, 0.62, 0.7, 0.8])

#: corners looked at together
_BATCH = 2048

#: lines per half that stand for a curve: their distance is larger than that of the curve by 1e-4 of it at most
_FINE = 64

#: parameters beside the middle, and the cosine between the path there and the way to the corner below which the middle
#: is the nearest point
_MIDDLE = np.array([0.5 - 1e-5, 0.5, 0.5 + 1e-5])
_SQUARE = 1e-5

#: corners that a report lists as the worst
_WORST = 20

#: corners whose errors are found together
_TOGETHER = 4096


def corner_table(smoothed: SmoothProgram, rows: Ints | None = None, *, dense: bool = True) -> dict[str, Column]:
    """Corners as a table: place, angles, lengths, errors, curvature, what limits them.

    Parameters
    ----------
    rows : (g,) int64, optional
        Rows of `smoothed.corners`; all of them by default.
    dense : bool
        Whether transitions are written as lines, not as curves.

    Returns
    -------
    dict
        Column name, with its unit, to an array of g values; those of docs/smooth.md, and those
        that only the method has. NaN: with an axis tolerance the axis point has no path.

    Raises
    ------
    InputError
        CS167: there are no such rows.
    """
    program, corners, settings = smoothed.program, smoothed.corners, smoothed.settings
    rows = np.arange(len(corners)) if rows is None else np.asarray(rows)
    if rows.ndim != 1 or not np.isin(rows, np.arange(len(corners))).all():
        hint = f"give a list of whole numbers from 0 to {len(corners) - 1}"
        raise InputError("CS167", "rows of corner_table are none of the corners", hint)
    rows = rows.astype(np.int64)
    pose, before, after = corners.pose[rows], corners.before[rows], corners.after[rows]
    legs = legs_at(program, settings.axis_length, pose, before, np.where(after < 0, pose, after))
    tip_in, tip_out = legs.tip_in, legs.tip_out
    axis_in, axis_out = tip_in + legs.turn_in, tip_out + legs.turn_out
    tip_error, axis_error = path_distances(smoothed, rows, dense=dense)
    columns: dict[str, Column] = {
        "corner": pose.astype(np.int64),
        "line": program.line[pose],
        "x": program.tip[pose, 0],
        "y": program.tip[pose, 1],
        "z": program.tip[pose, 2],
        "tip_angle_deg": np.degrees(angle_between(tip_in, tip_out)),
        "axis_angle_deg": np.degrees(angle_between(axis_in, axis_out)),
        "tip_length_in_mm": norm(tip_in) * corners.trim_in[rows],
        "tip_length_out_mm": norm(tip_out) * corners.trim_out[rows],
        "axis_length_in_mm": norm(axis_in) * corners.axis_trim_in[rows],
        "axis_length_out_mm": norm(axis_out) * corners.axis_trim_out[rows],
        "tip_error_mm": tip_error,
        "axis_error_mm": axis_error if settings.axis_tolerance is None else np.full(len(rows), np.nan),
        "orientation_error_deg": np.degrees(corners.orientation_error[rows]),
        "curvature_max_per_mm": _largest_curvature(smoothed, rows),
        "limited_by": _names(LimitedBy, corners.limited_by[rows]),
        "status": _names(Status, corners.status[rows]),
    }
    columns.update(construction_of(settings.method).report_columns(corners, rows))
    return columns


def counts_of(corners: Corners) -> dict[str, Any]:
    """How many corners are limited by what, and how many stay sharp for which reason."""
    return {
        "limited_by_tolerance": int(np.count_nonzero(corners.limited_by == LimitedBy.TOLERANCE)),
        "limited_by_segment": int(np.count_nonzero(corners.limited_by == LimitedBy.SEGMENT)),
        "not_smoothed": {
            status.key: count
            for status in Status
            if not status.traits & Trait.ROUNDED and (count := int(np.count_nonzero(corners.status == status)))
        },
    }


def _names(kind: type[Status] | type[LimitedBy], codes: NDArray[np.uint8]) -> NDArray[np.str_]:
    return np.array([each.key for each in kind])[codes]


def _largest_curvature(smoothed: SmoothProgram, rows: Ints) -> Floats:
    """Largest curvature of the tip curve, 1/mm; 0 where it has no length and where nothing is rounded."""
    curvature = np.zeros(len(rows))
    for block in np.array_split(np.arange(len(rows)), max(1, len(rows) // 8192)):
        chosen = rows[block]
        curve, _ = nurbs.control_points(smoothed.program, smoothed.corners, chosen, smoothed.settings.axis_length)
        _, first, second = nurbs.derivatives(curve, _CURVATURE_AT)
        speed = norm(first)
        swing = norm(np.cross(first, second))
        bent = np.divide(swing, speed**3, out=np.zeros_like(speed), where=speed > 1e-12)
        curvature[block] = bent.max(axis=1)
    in_runs = smoothed.corners.extra.get(RUN_CURVATURE)
    if in_runs is None:
        return curvature
    return np.where(np.isnan(in_runs[rows]), curvature, in_runs[rows])


def worst_corners(smoothed: SmoothProgram, *, dense: bool = True) -> tuple[float, float, Ints]:
    """Largest errors of all corners, tip and axis point, mm, and rows (g,) of the `_WORST` worst; ties in path order.

    Most corners are settled by what bounds their errors.
    """
    corners = smoothed.corners
    rows = np.flatnonzero(corners.rounded)
    bound = np.maximum(corners.tip_error[rows], corners.axis_error[rows])
    order = np.argsort(-bound, kind="stable")
    tip, axis_point, larger = np.zeros((3, 0))
    for begin in range(0, len(order), _TOGETHER):
        known = np.sort(larger)[-_WORST] if len(larger) >= _WORST else -np.inf
        if bound[order[begin]] < min(known, tip.max(initial=-np.inf), axis_point.max(initial=-np.inf)):
            break
        more_tip, more_axis_point = path_distances(smoothed, rows[order[begin : begin + _TOGETHER]], dense=dense)
        tip, axis_point = np.append(tip, more_tip), np.append(axis_point, more_axis_point)
        larger = np.maximum(tip, axis_point)
    seen = rows[order[: len(larger)]]
    best = np.lexsort((seen, -larger))[:_WORST]
    return float(tip.max(initial=0.0)), float(axis_point.max(initial=0.0)), seen[best]


def path_distances(smoothed: SmoothProgram, rows: Ints, *, dense: bool) -> tuple[Floats, Floats]:
    """Distances (g,) of tip path and axis-point path from the original ones at some corners, mm; 0 where not smoothed.

    That is what a measurement of the program finds. `Corners.tip_error` and `Corners.axis_error` compare both motions
    at a common parameter. Where the legs are unequal, the curve passes the corner nearest beside u = ½. The distance
    from the corner itself decides, as the path runs on the inner side of it and turns in one sense. For the paper's
    method they are the errors by its equation (10). With `dense`, transitions are written as lines.
    """
    corners, settings = smoothed.corners, smoothed.settings
    errors = corners.tip_error[rows].copy(), corners.axis_error[rows].copy()
    if not METHODS[settings.method].one_parameter:
        return errors
    # with a tolerance of its own the axis has no path
    found = errors if settings.axis_tolerance is None else errors[:1]
    for begin in range(0, len(rows), _BATCH):
        chosen = begin + np.flatnonzero(corners.smoothed[rows[begin : begin + _BATCH]])
        aslant = np.zeros(len(chosen), np.bool_)
        for point, _, _ in _seen_from_corners(smoothed, rows[chosen], _MIDDLE)[: len(found)]:
            along, off = point[:, 3] - point[:, 1], point[:, 2]
            aslant |= np.abs(dot(along, off)) > _SQUARE * norm(along) * norm(off)
        chosen = chosen[aslant]
        number = lines_of(smoothed, rows[chosen]) if dense else np.full(len(chosen), _FINE)
        for lines in sorted(set(number.tolist())):
            some = chosen[number == lines]
            seen = _seen_from_corners(smoothed, rows[some], nodes(int(lines)))
            for error, (point, tip, lever) in zip(found, seen, strict=False):
                error[some] = np.minimum(error[some], _passing(point, tip, lever))
    return errors


def _seen_from_corners(smoothed: SmoothProgram, rows: Ints, u: Floats) -> tuple[tuple[Floats, Floats, Floats], ...]:
    """Tips and axis points (g, 1 + m, 3) on transitions, less those of the corners, each with its tips and levers."""
    program, pose, height = smoothed.program, smoothed.corners.pose[rows], smoothed.settings.axis_length
    tips, levers = construction_of(smoothed.settings.method).points(smoothed, rows, u)
    tips, levers = tips - program.tip[pose][:, None], height * unit(levers)
    tops = tips - height * program.axis[pose][:, None]
    return (tips, tips, np.zeros_like(tips)), (tops + levers, tops, levers)


def _passing(point: Floats, tip: Floats, lever: Floats) -> Floats:
    """(g,) least distance from 0 of lines through points (g, m, 3); the control turns the lever between their ends."""
    start, way = point[:, :-1], np.diff(point, axis=1)
    size = square(way)
    share = np.clip(np.divide(-dot(start, way), size, out=np.zeros_like(size), where=size > 0), 0.0, 1.0)[..., None]
    turned = unit(lever[:, :-1] + share * np.diff(lever, axis=1)) * norm(lever[:, :1])[..., None]
    return norm(tip[:, :-1] + share * np.diff(tip, axis=1) + turned).min(axis=1)
