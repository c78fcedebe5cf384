"""Neighbouring passes of a finishing path must be smoothed alike: else rows show on the surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cornersmooth import Program, Settings, SmoothProgram, read
from cornersmooth.arrays import unit
from cornersmooth.geometry.bsplines import Splines
from cornersmooth.model import Floats
from cornersmooth.smoothing import smooth
from oracle.chains import random_chains

#: passes, poses of each, and distance of passes, mm
PASSES, POSES, PITCH = 10, 94, 0.09
#: mm: radius of a ball cutter, whose centre makes the surface
RADIUS = 2.0
#: places looked at in each segment, and poses beside the turns that are left out
SHARES, TURN = np.array([0.0, 0.25, 0.5, 0.75]), 4


@pytest.fixture(scope="module")
def path(corpus: Path) -> Program:
    """To and fro between the first two rows of a real blade, so that poses of all passes stand side by side."""
    program = read(corpus / "hecc_point_zigzag.csv")
    (tip, next_tip), (axis, next_axis) = (
        (part[:POSES], part[POSES : 2 * POSES][::-1]) for part in (program.tip, program.axis)
    )
    apart = np.linalg.norm(next_tip - tip, axis=1).mean()
    tips, axes = [], []
    for number in range(PASSES):
        share = number * PITCH / apart
        way = slice(None, None, -1 if number % 2 else 1)
        tips.append((tip + share * (next_tip - tip))[way])
        axes.append(unit(axis + share * (next_axis - axis))[way])
    return Program.from_poses(np.concatenate(tips), np.concatenate(axes), feed=1800.0)


def centre(points: Floats) -> Floats:
    """Centres of the ball, from tips and axis points side by side."""
    return points[..., :3] + RADIUS * unit(points[..., 3:] - points[..., :3])


def deviations(smoothed: SmoothProgram) -> Floats:
    """(passes, places) mm: how far the ball's centre is off across the surface, places of all passes side by side."""
    runs, program = smoothed.runs, smoothed.program
    assert len(runs.count) == 1
    assert runs.count[0] == len(program)
    point = np.hstack((program.tip, program.tip + smoothed.settings.axis_length * program.axis))
    original = point[:-1, None] + SHARES[:, None] * np.diff(point, axis=0)[:, None]
    s = runs.s[:-1, None] + SHARES * np.diff(runs.s)[:, None]
    splines = Splines(runs.knot, runs.knot_count)
    span = np.clip(np.searchsorted(runs.knot, s.ravel(), side="right") - 1, 0, len(runs.knot) - 2)
    taps = runs.control[splines.span_control[span, None] + np.arange(4)]
    curve = np.einsum("mk,mkd->md", splines.basis(span, s.ravel()), taps).reshape(original.shape)
    off, place = (centre(curve) - centre(original)).reshape(-1, 3), centre(original).reshape(-1, 3)
    each = len(SHARES) * np.arange(PASSES)[:, None] * POSES
    forth = each + np.arange(len(SHARES) * (POSES - 1))
    back = each + len(SHARES) * (POSES - 1) - np.arange(len(SHARES) * (POSES - 1))
    inner = slice(len(SHARES) * TURN, -len(SHARES) * TURN)
    rows = np.where(np.arange(PASSES)[:, None] % 2 == 0, forth, back)[:, inner]
    off, place = off[rows], place[rows]
    normal = unit(np.cross(np.gradient(place.mean(axis=0), axis=0), place[-1] - place[0]))
    return np.einsum("pmd,md->pm", off, normal)


@pytest.mark.corpus
@pytest.mark.parametrize(("tolerance", "most"), [(0.01, 0.0003), (0.04, 0.0006)])
def test_neighbouring_passes_differ_by_little(path: Program, tolerance: float, most: float) -> None:
    off = deviations(smooth(path, Settings(tolerance=tolerance, method="global")))
    assert np.sqrt(np.mean(np.diff(off, axis=0) ** 2)) < most
    assert np.abs(off).max() < tolerance / 2.0


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("tolerance", [0.01, 0.15])
def test_a_pass_there_and_back_is_the_same_curve(seed: int, tolerance: float) -> None:
    """To far below the digits that any control takes, whatever the chain: also on rings."""
    chain = random_chains(seed, 1, corners=12)[0]
    tip, axis = chain.tip, chain.original.axis
    if seed % 2:
        tip, axis = np.vstack((tip, tip[:1])), np.vstack((axis, axis[:1]))
    settings = Settings(method="global", tolerance=tolerance)
    there, back = (
        smooth(Program.from_poses(tip[way], axis[way], feed=900.0), settings).runs
        for way in (slice(None), slice(None, None, -1))
    )
    assert there is not None
    assert back is not None
    np.testing.assert_allclose(back.control[::-1], there.control, rtol=0.0, atol=1e-9)
    length = np.repeat(back.knot[np.cumsum(back.knot_count) - 1], back.knot_count)
    np.testing.assert_array_equal((length - back.knot)[::-1], there.knot)
