"""`allocation="fair"`: neighbours never overlap, nobody is left with less than it could have, nothing else changes."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from cornersmooth.model import LimitedBy, Program, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.smoothing.segments import segments_of
from oracle.share import covering_share
from smoothing.paths import grid_program, random_program, simultaneous_deviation

FAIR = Settings(allocation="fair")


def zigzag(turns: list[float], lengths: list[float]) -> Program:
    """Segments in the XY plane, axis +Z; the path turns left and right in turn, by degrees."""
    signs = np.where(np.arange(len(turns)) % 2 == 0, 1.0, -1.0)
    heading = np.radians(np.concatenate(([0.0], np.cumsum(signs * turns))))
    steps = np.asarray(lengths)[:, None] * np.stack((np.cos(heading), np.sin(heading), 0 * heading), axis=1)
    tips = np.concatenate((np.zeros((1, 3)), np.cumsum(steps, axis=0)))
    return Program.from_poses(tips, np.tile([0.0, 0.0, 1.0], (len(tips), 1)))


def shares_taken(corners) -> np.ndarray:
    """Part of every segment between two corners that their transitions take."""
    neighbours = corners.after[:-1] == corners.pose[1:]
    return (corners.trim_out[:-1] + corners.trim_in[1:])[neighbours]


@pytest.mark.parametrize(("tolerance", "shape"), covering_share(product([0.01, 0.3, 5.0], ["paper", "auto"]), 3))
def test_transitions_never_overlap_and_keep_the_tolerance(tolerance, shape):
    smoothed = smooth(random_program(5, 2000, wobble=0.1), FAIR.but(tolerance=tolerance, shape=shape))
    corners = smoothed.corners
    assert shares_taken(corners).max() <= 1.0 + 1e-12
    assert max(corners.trim_in[0], corners.trim_out[-1]) <= 0.9 + 1e-12
    rows = np.flatnonzero(corners.smoothed)
    tip, top = simultaneous_deviation(smoothed, rows, np.linspace(0, 1, 201))
    assert tip.max() <= tolerance * (1 + 1e-9)
    assert top.max() <= tolerance * (1 + 1e-9)


@hypothesis_settings(deadline=None)
@given(grid_program(), st.sampled_from([0.01, 0.3, 3.0]))
def test_coarse_grids_never_overlap(program, tolerance):
    with np.errstate(all="raise", under="ignore"):
        corners = smooth(program, FAIR.but(tolerance=tolerance)).corners
    assert np.isfinite(corners.trim_in).all()
    taken = shares_taken(corners)
    assert not len(taken) or taken.max() <= 1.0 + 1e-12
    half = smooth(program, Settings(tolerance=tolerance)).corners
    sharp = [Status.REVERSAL, Status.AXIS_STEP, Status.DUPLICATE, Status.STRAIGHT]
    assert ((corners.status == half.status) | ~np.isin(half.status, sharp)).all()


def test_a_corner_that_needs_little_leaves_the_rest():
    """The sharp corner reaches its tolerance on 0.27 mm; the gentle one then has 9.73 of the 10 mm."""
    program = zigzag([3.0, 90.0, 3.0], [20.0, 10.0, 10.0, 20.0])
    half = smooth(program, Settings(tolerance=0.065)).corners
    fair = smooth(program, FAIR.but(tolerance=0.065)).corners
    need = 3 * 0.065 / np.sin(np.radians(45))
    assert fair.trim_in[1] * 10.0 == pytest.approx(need)
    assert half.trim_out[0] * 10.0 == pytest.approx(5.0)
    wanted = 3 * 0.065 / np.sin(np.radians(1.5))
    assert wanted == pytest.approx(7.449, abs=1e-3)
    assert fair.trim_out[0] * 10.0 == pytest.approx(wanted)
    assert fair.limited_by.tolist() == [LimitedBy.TOLERANCE] * 3


def test_equal_corners_meet_in_the_middle():
    fair = smooth(zigzag([20.0] * 4, [3.0] * 5), FAIR.but(tolerance=5.0)).corners
    assert fair.trim_out[1:2] == pytest.approx(0.5)
    assert fair.trim_in[1:3] == pytest.approx(0.5)


def test_where_both_want_more_they_get_the_same_speed():
    """v² ~ L·cos²(β)/sin(β), design 3.4, unless the gentler one came below a quarter."""
    fair = smooth(zigzag([20.0, 40.0], [50.0, 3.0, 50.0]), FAIR.but(tolerance=5.0)).corners
    beta = np.radians([10.0, 20.0])
    room = 3.0 * np.array([fair.trim_out[0], fair.trim_in[1]])
    assert room.sum() == pytest.approx(3.0)
    speed = room * np.cos(beta) ** 2 / np.sin(beta)
    assert speed[0] == pytest.approx(speed[1])
    steep = smooth(zigzag([2.0, 120.0], [50.0, 3.0, 50.0]), FAIR.but(tolerance=5.0)).corners
    assert steep.trim_out[0] == pytest.approx(0.25)


def test_corners_beside_an_end_take_more_than_half_of_it():
    fair = smooth(zigzag([30.0], [2.0, 10.0]), FAIR.but(tolerance=1.0)).corners
    assert fair.trim_in[0] == pytest.approx(0.9)
    assert fair.limited_by[0] == LimitedBy.SEGMENT


def test_transitions_that_touch_have_no_line_between():
    smoothed = smooth(random_program(5, 500, wobble=0.05), FAIR.but(tolerance=10.0, axis_length=1.0))
    corners, segments = smoothed.corners, segments_of(smoothed, dense=False)
    rows = np.flatnonzero((corners.after[:-1] == corners.pose[1:]) & corners.smoothed[:-1] & corners.smoothed[1:])
    rest = 1.0 - corners.trim_out[rows] - corners.trim_in[rows + 1]
    assert (np.abs(rest) < 1e-12).mean() > 0.5
    assert not segments.has_line[corners.pose[rows + 1][np.abs(rest) < 1e-12]].any()


def test_reversing_the_path_commutes():
    program = random_program(9, 400, wobble=0.1)
    settings = FAIR.but(tolerance=0.5)
    there = smooth(program, settings).corners
    back = smooth(Program.from_poses(program.tip[::-1], program.axis[::-1]), settings).corners
    assert back.trim_in[::-1] == pytest.approx(there.trim_out, rel=1e-9, abs=1e-12)


def test_slowest_corner_is_no_slower_than_with_halves():
    """Lengths beyond half go to those who need them: the least L·cos²(β)/sin(β) of a chain does not fall."""
    for seed in range(20):
        program = random_program(seed, 60, wobble=0.02)
        least = []
        for settings in (Settings(tolerance=1.0), FAIR.but(tolerance=1.0)):
            corners = smooth(program, settings).corners
            rows = np.flatnonzero(corners.smoothed)
            into = program.tip[corners.pose[rows]] - program.tip[corners.before[rows]]
            out = program.tip[corners.after[rows]] - program.tip[corners.pose[rows]]
            lengths = np.linalg.norm(into, axis=1), np.linalg.norm(out, axis=1)
            cosine = np.einsum("kd,kd->k", into, out) / (lengths[0] * lengths[1])
            room = corners.trim_in[rows] * lengths[0]
            least.append((room * (1 + cosine) / 2 / np.sqrt((1 - cosine) / 2)).min())
        assert least[1] >= 0.99 * least[0]
