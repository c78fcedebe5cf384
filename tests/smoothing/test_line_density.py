"""How many lines follow a curve: by the chord tolerance, and by the time that the control takes for a block."""

from __future__ import annotations

import numpy as np
import pytest

import cornersmooth
from cornersmooth.model import Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing.segments import FINEST_CHORD, lines_per_half


def halves(feed: float, **more: float) -> tuple[int, float]:
    """Lines per half of a corner of 90 degrees, and the way of the tip in a half, mm."""
    tip, axis = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]]), np.array([[0.0, 0.0, 1.0]] * 3)
    program = Program.from_poses(tip, axis, feed=feed)
    smoothed = cornersmooth.smooth(program, Settings(tolerance=0.01, lines="dense", **more))
    return abs(int(lines_per_half(smoothed)[0])), 10.0 * float(smoothed.corners.trim_in[0])


def test_lines_are_divided_for_jumps_and_none_is_passed_sooner_than_the_control_takes_a_block() -> None:
    """In each half the direction turns by half of the chord of 90 degrees; a jump of 2 mm/s needs no division."""
    by_chord, way = halves(1000.0)
    jump = np.sqrt(2.0) / 2.0 / 2.0  # lines per mm/s
    finer = np.sqrt(5e-4 / FINEST_CHORD)
    finest, _ = halves(60.0 * 1000.0, block_time=1e-7)
    assert finest == pytest.approx(by_chord * finer, abs=1 + finer)
    for_jumps, _ = halves(60.0 * 1.7 * by_chord / jump, block_time=1e-7)
    assert for_jumps == pytest.approx(1.7 * by_chord, abs=1)
    for_blocks, _ = halves(60.0 * 1000.0, block_time=way / (1000.0 * 1.7 * by_chord))
    assert for_blocks == np.ceil(1.7 * by_chord - 1e-9)
    for feed, block_time in ((60.0, 1e-7), (60.0 * 1000.0, 1.0), (np.nan, 1e-7)):
        assert halves(feed, block_time=block_time)[0] == by_chord
    assert halves(60.0 * 1000.0, block_time=1e-7, chord_tolerance=0.004)[0] == pytest.approx(finest, abs=1)
