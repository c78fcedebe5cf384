"""Programs of a few holes, right and damaged, against all ways to divide their elements among the holes."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cornersmooth.errors import Verdict
from cornersmooth.model import Move, Statement
from cornersmooth.verify import verify
from oracle.share import share

from .test_statements import said, text

DEPTH, CLEARANCE, RETRACT = 8.0, 2.0, 4.0
# pecks of any depth
CYCLE = ("DRILL", "DEEP", "FEDTO", DEPTH, "MMPM", 100.0, "RAPTO", CLEARANCE, "RTRCTO", RETRACT)

Element = tuple[str, float, float]  # code, x, z
Hole = tuple[float, float]  # x, z


def drawn(rng: np.random.Generator) -> tuple[list[Hole], list[Element]]:
    """Holes, some of them in one line or the same, and a program of them: damaged in up to two places."""
    holes = [(float(rng.choice([0, 15])), float(rng.choice([0, 0, -5]))) for _ in range(int(rng.integers(1, 4)))]
    lines: list[Element] = [("G0", holes[0][0], 20.0)]
    for x, z in holes:
        lines += [("G0", x, 20.0), ("G0", x, z + CLEARANCE)]
        if rng.random() < 0.4:
            lines += [("G1", x, z - 3.0), ("G0", x, z + CLEARANCE), ("G0", x, z - 2.5)]
        lines += [("G1", x, z - DEPTH), ("G0", x, float(rng.choice([z + RETRACT, 20.0])))]
    lines.append(("G0", holes[-1][0], 30.0))
    for _ in range(int(rng.integers(0, 3))):
        k, other = (int(rng.integers(1, len(lines))) for _ in range(2))
        code, x, z = lines[k]
        match int(rng.integers(5)):
            case 0:
                del lines[k]
            case 1:
                lines.insert(k, lines[other])
            case 2:
                lines[k], lines[other] = lines[other], lines[k]
            case 3:
                lines[k] = code, x, z + float(rng.choice([-5, -1, 1, 5]))
            case _:
                lines[k] = "G1" if code == "G0" else "G0", x, z
    moved = [one for k, one in enumerate(lines) if not k or one[1:] != lines[k - 1][1:]]
    return holes, moved


def is_drilled(holes: list[Hole], i: int, group: list[Element], before: Element) -> bool:
    """Whether elements drill a hole, after another element."""
    x, z = holes[i]
    if any(one[1] != x for one in group) or not any(code == "G1" for code, *_ in group):
        return False
    heights = [one[2] - z for one in group]
    drilled, free = 0.0, CLEARANCE
    entered = before[1] == x
    if group[0][0] == "G1" and (not entered or (i and before[2] < z)):
        return False
    if i and holes[i - 1][0] != x and not entered and heights[0] < RETRACT + min(holes[i - 1][1] - z, 0.0):
        return False
    if not entered and before[2] != group[0][2]:  # no rapid between holes goes aslant
        return False
    fed = next(k for k, (code, *_) in enumerate(group) if code == "G1")
    if (heights[fed - 1] if fed else before[2] - z) > CLEARANCE:  # feeding begins there at the latest
        return False
    last = np.inf
    for (code, *_), height in zip(group, heights, strict=True):
        if code == "G1":
            if height > last:  # it is left in rapid
                return False
            if height < last and (height > RETRACT or drilled == DEPTH or 0.0 < -height <= drilled):
                return False
            drilled, free = max(drilled, -height), min(free, height)
        elif height < free or (height < last and 0.0 < drilled <= -height):  # a rapid onto the bottom
            return False
        last = height
    leaves = RETRACT if i + 1 < len(holes) and holes[i + 1][0] != x else 0.0
    return drilled == DEPTH and heights[-1] >= leaves


def is_right(holes: list[Hole], lines: list[Element]) -> bool:
    """Whether there is a way to divide the elements among the holes."""
    over, end = ("G0", holes[0][0], 20.0), ("G0", holes[-1][0], 30.0)
    if lines[0] != over:
        return False
    for cuts in itertools.combinations(range(2, len(lines) + 1), len(holes)):
        rest, stop = lines[cuts[-1] :], lines[cuts[-1] - 1]
        if not (rest == [end] or (rest == [] and stop == end)):
            continue
        begins = (1, *cuts)
        good = True
        for i, (begin, cut) in enumerate(itertools.pairwise(begins)):
            group, before = lines[begin:cut], lines[begin - 1]
            shared = lines[cut : cut + 1]  # the way out may be the next hole's, too
            groups = [group, group + shared] if shared and shared[0][0] == "G0" else [group]
            good = good and any(is_drilled(holes, i, one, before) for one in groups)
        if good:
            return True
    return False


@pytest.mark.parametrize("seed", share(range(300), 10))
def test_a_program_passes_where_its_elements_can_be_divided_among_the_holes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    holes, lines = drawn(rng)
    tip = [[holes[0][0], 0.0, 20.0], *([x, 0.0, z] for x, z in holes), [holes[-1][0], 0.0, 30.0]]
    kind = [Move.RAPID, *[Move.HOLE] * len(holes), Move.RAPID]
    off = Statement(len(holes) + 1, 9, "CYCLE", ("OFF",))
    program = said(Statement(1, 3, "CYCLE", CYCLE), off, kind=kind, tip=tip)
    nc = text("G43.5 H1", *((code, x, 0.0, z) for code, x, z in lines))
    found = verify(program, nc, tolerance=0.01)
    # holes above one another in one line: a wrong one may be NOT VERIFIED
    assert (found.verdict is Verdict.PASSED) == is_right(holes, lines), (holes, lines, found.problems)
