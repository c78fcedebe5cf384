"""Whether a hole is drilled as its cycle asks for: depth, feeds, and rapids above what is cut."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Move
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.statements.cycles import Drilling
from cornersmooth.verify.hole_lines import HoleLines
from cornersmooth.verify.task import ARITHMETIC


def check_hole(lines: HoleLines, move: int, group: list[int], cycle: Drilling, *, alone: bool) -> list[Problem]:
    """Depth, feeds and rapids of one hole; `alone`: it is drilled once."""
    cl_line, feeds = int(lines.line[move]), lines.feeds(group)
    known = not np.isnan(cycle.depth)
    if not feeds:
        if known and cycle.depth > lines.room:
            near = lines.nc_line(group[0]) if group else 0
            return [Problem("CS561", cl_line, near, "a hole of the CL file is not drilled")]
        return []
    if not known:
        return [Problem("CS564", cl_line, lines.nc_line(feeds[0]), "the cycle does not say what is fed here")]
    problems = []
    before, *heights = lines.heights(move, np.array([max(group[0] - 1, 0), *group])).tolist()
    height = dict(zip(group, heights, strict=True))
    deepest = min(feeds, key=lambda k: height[k])
    off = height[deepest] + cycle.depth
    if abs(off) > lines.room:
        text = f"a hole is {abs(off):.4f} mm too {'shallow' if off > 0 else 'deep'}"
        problems.append(Problem("CS562", cl_line, lines.nc_line(deepest), text, abs(off)))
    behind = [k for k in group if k > deepest][:1]
    if cycle.feed_out and behind and not lines.feeds(behind):
        line = lines.nc_line(behind[0])
        problems.append(Problem("CS563", cl_line, line, "a rapid leaves a hole that the tool is to leave at feed"))
    problems += _sideways(lines, move, group, cycle, height, before)
    drilled = 0.0
    free = 0.0 if np.isnan(cycle.clearance) else cycle.clearance  # height down to which rapids may go
    for k in group:
        line = lines.nc_line(k)
        if not lines.feeds([k]):
            if height[k] < free - lines.room and not _own_rapid(lines, move, k):
                amount = free - height[k]
                where = "into the uncut hole" if free <= 0.0 else "below the height where the feed begins (RAPTO)"
                problems.append(Problem("CS563", cl_line, line, f"a rapid goes {amount:.4f} mm {where}", amount))
        else:
            if k == group[0] and np.isnan(before):
                problems.append(Problem("CS563", cl_line, line, "a feed move enters a hole from the side"))
            if lines.wrong_feed(k, cycle):
                text = f"the feed is {lines.ahead.nc.feed[k - lines.ahead.base]:g}, the cycle says {cycle.feed:g}"
                problems.append(Problem("CS541", cl_line, line, text))
            down = height.get(k - 1, np.inf) > height[k]
            if alone and down and drilled > lines.room and lines.room < -height[k] <= drilled + ARITHMETIC:
                problems.append(Problem("CS562", cl_line, line, "a hole is drilled again"))
            drilled, free = max(drilled, -height[k]), min(free, height[k])
    if height[group[-1]] < -lines.room:
        text = "the tool leaves a hole sideways"
        problems.append(Problem("CS563", cl_line, lines.nc_line(group[-1]), text, -height[group[-1]]))
    return problems


def _sideways(
    lines: HoleLines, move: int, group: list[int], cycle: Drilling, height: dict[int, float], before: float
) -> list[Problem]:
    """Rapids between the line of a hole and others must not run lower than the cycle says."""
    found = []

    def low(element: int, amount: float) -> None:
        if lines.room < amount < cycle.level + lines.room:  # what is in the hole is said as such
            text = f"a rapid beside a hole runs {amount:.4f} mm below the height of its cycle (RTRCTO, RAPTO)"
            found.append(Problem("CS563", int(lines.line[move]), lines.nc_line(element), text, amount))

    last = group[-1]
    if move + 1 < len(lines.tip) and not lines.in_line(move, move + 1):
        low(last, cycle.level - height[last])
    first = group[0]
    if move and lines.kind[move - 1] == Move.HOLE and np.isnan(before) and not lines.feeds([first]):
        turned = float(np.linalg.norm(lines.axis[move] - lines.axis[move - 1]))
        if turned * lines.axis_length <= 2 * lines.room:
            lower = min(float((lines.tip[move - 1] - lines.tip[move]) @ lines.axis[move]), 0.0)
            low(first, cycle.level + lower - height[first])
    return found


def _own_rapid(lines: HoleLines, move: int, element: int) -> bool:
    """Whether the CL file itself goes there in rapid just before the hole, wherever that is."""
    while move > 0 and lines.kind[move - 1] == Move.RAPID:
        move -= 1
        if lines.stays(move, element):
            return True
    return False
