"""What the verification found, as CSV and as lines to read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Program
from cornersmooth.report.csv_text import csv_text
from cornersmooth.report.deviation_profile import Distribution
from cornersmooth.verify import Verification

#: columns of the table, and how they are written; lengths are mm
CSV_COLUMNS = {
    **dict.fromkeys(("pose", "cl_line", "nc_line"), "%d"),
    **dict.fromkeys(("x", "y", "z"), "%.6f"),
    **dict.fromkeys(("tip_deviation_mm", "axis_point_deviation_mm", "orientation_deviation_deg"), "%.7f"),
}

#: classes of the histogram as parts of the tolerance, and the width of its longest bar
_CLASSES, _BAR = 10, 40

#: rows of the table along the path
_ROWS = 20


def verification_csv(program: Program, found: Verification) -> Iterator[str]:
    """Header, then a row for every pose that is passed at feed, in blocks of text."""
    poses = np.flatnonzero(np.isfinite(found.pose_tip))

    def columns(part: slice) -> Iterable[NDArray[Any]]:
        rows = poses[part]
        yield from (rows, program.line[rows], found.pose_nc_line[rows], *program.tip[rows].T)
        yield from (found.pose_tip[rows], found.pose_axis_point[rows], found.pose_angle[rows])

    return csv_text(CSV_COLUMNS, len(poses), columns)


def histogram_lines(found: Verification) -> list[str]:
    """How many poses are how far off: the larger deviation of tip and axis point, in tenths of the tolerance."""
    larger = np.fmax(found.pose_tip, found.pose_axis_point)
    larger = larger[np.isfinite(larger)]
    if not len(larger):
        return []
    step = found.tolerance / _CLASSES
    counts = np.bincount(np.minimum((larger / step).astype(np.int64), _CLASSES), minlength=_CLASSES + 1)
    most = int(counts.max())
    lines = []
    for k, count in enumerate(counts.tolist()):
        if k == _CLASSES and not count:
            continue
        label = f"over {found.tolerance:.5g}" if k == _CLASSES else f"{k * step:.5f} - {(k + 1) * step:.5f}"
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
