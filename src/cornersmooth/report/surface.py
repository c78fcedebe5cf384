"""The machined surface as text and CSV."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.report.csv_text import csv_text
from cornersmooth.surface import PassDifference, SurfaceMap

#: columns of the table, and how they are written; lengths are mm
_COLUMNS = {
    **dict.fromkeys(("cl_line", "station", "level"), "%d"),
    "side": "%s",
    **dict.fromkeys(("x", "y", "z"), "%.6f"),
    **dict.fromkeys(("nx", "ny", "nz"), "%.7f"),
    "off_mm": "%s",
}

#: width of the longest bar of the histogram on a terminal, and its classes
_BAR, _CLASSES = 40, 20


def surface_csv(surface: SurfaceMap) -> Iterator[str]:
    """Header, then a row for every point, in blocks of text; overcut is negative, unknown is empty."""
    points = surface.points

    def columns(part: slice) -> Iterable[NDArray[Any]]:
        off = np.array(["" if value != value else f"{value:.7f}" for value in surface.off[part].tolist()])
        side = np.where(points.side[part] == 0, "left", "right")
        yield from (points.line[part], points.station[part], points.level[part], side)
        yield from (*points.point[part].T, *points.normal[part].T, off)

    return csv_text(_COLUMNS, len(surface), columns)


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
