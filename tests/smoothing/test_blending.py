"""How far a control may round the corners of lines: against closed forms, and against a blend followed step by step."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.smoothing.blending import largest_blends
from cornersmooth.smoothing.long_lines import LineLimits, Vertices

HEIGHT, USUAL = 10.0, 0.002


def axis_of(words: np.ndarray) -> np.ndarray:
    """A tool that leans in XZ by the first word, degrees."""
    angle = np.radians(words[:, 0])
    return np.stack((np.sin(angle), np.zeros(len(words)), np.cos(angle)), axis=1)


LIMITS = LineLimits(0.01, 0.01, 60.0, HEIGHT, axis_of, blend=USUAL)


def path(tip: np.ndarray, words: np.ndarray) -> Vertices:
    """Lines that are the original motion."""
    axis_point = tip + HEIGHT * axis_of(words)
    step = np.hstack((np.diff(tip, axis=0), np.diff(axis_point, axis=0)))
    parameter = np.concatenate(([0.0], np.cumsum(np.sqrt((step**2).sum(axis=1) / 2.0))))
    fixed = np.zeros(len(tip), np.bool_)
    fixed[[0, -1]] = True
    return Vertices(tip, words, tip, axis_point, parameter, fixed)


def blends(rows: Vertices, most: float, deviation: float) -> np.ndarray:
    return largest_blends(rows, np.arange(len(rows.parameter)), LIMITS, most, deviation)


@pytest.mark.parametrize("turn", [0.2, 1.0, 2.0])
def test_blend_of_a_corner_is_the_deviation(turn: float) -> None:
    """Lines of equal length without rotary motion: the control is P off the corner, and 0.2 P farther at most."""
    tip = np.array([[-50.0, 0.0, 0.0], [0.0, 0.0, 0.0], [50.0 * np.cos(turn), 50.0 * np.sin(turn), 0.0]])
    found = blends(path(tip, np.zeros((3, 2))), 1.0, 0.01)[1]
    assert 0.01 / 1.2 / 1.5 / 1.1 <= found <= 0.01 / 1.2


def test_turn_of_the_axis_alone_is_what_counts_on_a_straight_line() -> None:
    """The tip turns by 0.001, the axis point by so much that the blend must be small."""
    tip = np.array([[-20.0, 0.0, 0.0], [0.0, 0.0, 0.0], [20.0, 0.02, 0.0]])
    still, turning = (
        blends(path(tip, np.array([[0.0, 0.0], [0.0, 0.0], [turn, 0.0]])), 0.01, 0.008) for turn in (0, 20)
    )
    assert still[1] == 0.01
    assert turning[1] < 0.001


def test_ends_and_exact_corners_keep_the_usual_blend() -> None:
    tip = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 5.0, 0.0], [10.0, 5.0, 0.0]])
    rows = path(tip, np.zeros((4, 2)))
    rows.fixed[1] = True
    found = blends(rows, 0.01, 0.009)
    assert found[[0, 1, 3]].tolist() == [USUAL] * 3
    assert found[2] > USUAL


def test_standing_tip_has_the_usual_blend() -> None:
    tip = np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [5.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    words = np.array([[0.0, 0.0], [0.0, 0.0], [5.0, 0.0], [5.0, 0.0]])
    assert blends(path(tip, words), 0.01, 0.009)[1:3].tolist() == [USUAL] * 2


def slowness(unit: np.ndarray, turn: np.ndarray) -> float:
    """Time that a line takes to speed up, relatively, where rotary axes do by 0.4 deg as others do by 1 mm."""
    return max(float(np.abs(unit).max()), float(np.abs(turn).max()) / 0.4)


@pytest.mark.parametrize("seed", range(12))
def test_a_blend_followed_step_by_step_keeps_the_deviation(seed: int) -> None:
    """Both lines speed up and slow down evenly, with accelerations that the axes allow, and the first begins with P."""
    rng = np.random.default_rng(seed)
    tip = np.cumsum(rng.normal(size=(7, 3)) * rng.uniform(0.2, 4.0, (7, 1)), axis=0)
    words = np.cumsum(np.column_stack((rng.uniform(-8, 8, 7), np.zeros(7))), axis=0)
    deviation = 0.009
    found = blends(path(tip, words), 0.01, deviation)
    for k in range(1, 6):
        ways, turns = np.diff(tip[k - 1 : k + 2], axis=0), np.diff(words[k - 1 : k + 2], axis=0)
        lengths = np.linalg.norm(ways, axis=1)
        units, turns = ways / lengths[:, None], turns / lengths[:, None]
        quicker = slowness(units[0], turns[0]) / slowness(units[1], turns[1])
        bend = np.linalg.norm(units[1] - units[0])
        before = min(lengths[0] / 2.0, lengths[1] / quicker / 2.0, 4.0 * found[k] / bend)
        for part in np.linspace(0.1, 0.9, 17):
            left, gone = before * (1.0 - part) ** 2, before * quicker * part**2
            here = tip[k] - left * units[0] + gone * units[1]
            lever = HEIGHT * axis_of((words[k] - left * turns[0] + gone * turns[1])[None])[0]
            assert off_path(here, lever, tip[k - 1 : k + 2], words[k - 1 : k + 2]) <= 1.06 * deviation


def off_path(here: np.ndarray, lever: np.ndarray, tip: np.ndarray, words: np.ndarray) -> float:
    """Distance of tip or axis point, the larger one, from the place of two lines where it is smallest."""
    share = np.linspace(0.0, 2.0, 1601)
    there = np.stack([np.interp(share, (0, 1, 2), column) for column in tip.T], axis=1)
    turned = np.stack([np.interp(share, (0, 1, 2), column) for column in words.T], axis=1)
    off = here - there
    both = np.linalg.norm(off, axis=1), np.linalg.norm(off + lever - HEIGHT * axis_of(turned), axis=1)
    return float(np.maximum(*both).min())
