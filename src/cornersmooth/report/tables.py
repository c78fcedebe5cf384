"""What was planned, verified and measured on the surface: CSV text, a block of rows at a time, and lines to read."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.kinematics.machine import LINEAR

if TYPE_CHECKING:  # they take long to load
    from cornersmooth.feedrate.timelaw import TimeLaw
    from cornersmooth.model import Program
    from cornersmooth.report.paths import Distribution
    from cornersmooth.surface import PassDifference, SurfaceMap
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


#: width of the longest bar of a histogram, and classes: parts of the tolerance, and of the span of the surface
_BAR, _PARTS, _CLASSES = 40, 10, 20

#: rows of the table along the path
_ROWS = 20


def verification_csv(program: Program, found: Verification) -> Iterator[str]:
    """Header, then a row for every pose that is passed at feed, in blocks of text; lengths are mm."""
    poses = np.flatnonzero(np.isfinite(found.pose_tip))

    def columns(part: slice) -> Columns:
        rows = poses[part]
        off = found.pose_tip[rows], found.pose_axis_point[rows], found.pose_angle[rows]
        return (
            _written("%d", "pose cl_line nc_line", rows, program.line[rows], found.pose_nc_line[rows])
            | _written("%.6f", "x y z", *program.tip[rows].T)
            | _written("%.7f", "tip_deviation_mm axis_point_deviation_mm orientation_deviation_deg", *off)
        )

    return csv_text(len(poses), columns)


def histogram_lines(found: Verification) -> list[str]:
    """How many poses are how far off: the larger deviation of tip and axis point, in tenths of the tolerance."""
    larger = np.fmax(found.pose_tip, found.pose_axis_point)
    larger = larger[np.isfinite(larger)]
    if not len(larger):
        return []
    step = found.tolerance / _PARTS
    counts = np.bincount(np.minimum((larger / step).astype(np.int64), _PARTS), minlength=_PARTS + 1)
    most = int(counts.max())
    lines = []
    for k, count in enumerate(counts.tolist()):
        if k == _PARTS and not count:
            continue
        label = f"over {found.tolerance:.5g}" if k == _PARTS else f"{k * step:.5f} - {(k + 1) * step:.5f}"
        bar = "#" * max(round(_BAR * count / most), int(count > 0))
        lines.append(f"{label:>19} mm {count:>9} {bar}".rstrip())
    return lines


def along_lines(found: Distribution, tolerance: float) -> list[str]:
    """Table along the path: the largest deviations in each of a number of equal parts of it."""
    if not len(found):
        return []
    edges = np.linspace(found.way[0], found.way[-1], _ROWS + 1)
    part = np.clip(np.searchsorted(edges, found.way, side="right") - 1, 0, _ROWS - 1)
    lines = [f"{'path mm':>21} {'tip mm':>10} {'axis pt mm':>10} {'axis deg':>9} {'CL line':>8} {'NC line':>8}"]
    for k in range(_ROWS):
        rows = np.flatnonzero(part == k)
        if not len(rows):
            continue
        worst = rows[int(np.argmax(np.maximum(found.tip[rows], found.axis_point[rows])))]
        larger = max(float(found.tip[worst]), float(found.axis_point[worst]))
        bar = "#" * round(_BAR / 2 * min(larger / tolerance, 1.0))
        lines.append(
            f"{edges[k]:>10.3f}-{edges[k + 1]:>10.3f} {found.tip[rows].max():>10.6f} "
            f"{found.axis_point[rows].max():>10.6f} {found.angle[rows].max():>9.5f} "
            f"{found.cl_line[worst]:>8} {found.nc_line[worst]:>8} {bar}".rstrip()
        )
    return lines


def surface_csv(surface: SurfaceMap) -> Iterator[str]:
    """Header, then a row for every point, in blocks of text; lengths are mm, overcut is negative, unknown is empty."""
    points = surface.points

    def columns(part: slice) -> Columns:
        off = np.array(["" if value != value else f"{value:.7f}" for value in surface.off[part].tolist()], np.str_)
        side = np.where(points.side[part] == 0, "left", "right")
        return (
            _written("%d", "cl_line station level", points.line[part], points.station[part], points.level[part])
            | _written("%s", "side", side)
            | _written("%.6f", "x y z", *points.point[part].T)
            | _written("%.7f", "nx ny nz", *points.normal[part].T)
            | _written("%s", "off_mm", off)
        )

    return csv_text(len(surface), columns)


def surface_lines(surface: SurfaceMap) -> Iterator[str]:
    """Table and histogram to read."""
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
    yield f"{'passes':<18}{passes_text(surface.passes)}"
    if values["rms_mm"] is not None:
        yield f"{'all':<18}mean {values['mean_mm']:.6f} mm, root mean square {values['rms_mm']:.6f} mm"
        yield f"{'within':<18}{values['within_tolerance_percent']:.4g} % of the points within {surface.tolerance:g} mm"
        yield ""
        yield from _histogram(surface)


def passes_text(passes: PassDifference | None) -> str:
    """Say how differently neighbouring passes are off: where they are, rows show."""
    if passes is None:
        return "no pass has a neighbour"
    return (
        f"neighbours, {passes.apart_mm:.3g} mm apart, differ by {passes.rms_mm:.6f} mm (root mean square), "
        f"95 % by at most {passes.percentile_95_mm:.6f} mm, the most {passes.max_mm:.6f} mm at CL line {passes.cl_line}"
    )


def _histogram(surface: SurfaceMap) -> Iterator[str]:
    edges, counts = surface.histogram(_CLASSES)
    most = max(int(counts.max(initial=0)), 1)
    for count, low, high in zip(counts.astype(int).tolist(), edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        bar = "#" * -(-count * _BAR // most)
        yield f"{low:>10.5f} to {high:>9.5f} mm {count:>8}  {bar}".rstrip()
