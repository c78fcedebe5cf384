"""Lines whose ends are beside the path: both sides of the tolerance are used, and never more of it."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.long_lines import LineLimits, Vertices, fewest_lines
from cornersmooth.smoothing.outside_lines import faster_lines

HEIGHT, TOLERANCE, RADIUS = 10.0, 0.01, 20.0


def axis_of(words: np.ndarray) -> np.ndarray:
    """A tool that leans in XZ by the first word, degrees."""
    angle = np.radians(words[:, 0])
    return np.stack((np.sin(angle), np.zeros(len(words)), np.cos(angle)), axis=1)


LIMITS = LineLimits(TOLERANCE, TOLERANCE, 60.0, HEIGHT, axis_of)


def path(tip: np.ndarray, words: np.ndarray, fixed: tuple[int, ...] = ()) -> Vertices:
    """Rows that are the original motion."""
    axis_point = tip + HEIGHT * axis_of(words)
    step = np.hstack((np.diff(tip, axis=0), np.diff(axis_point, axis=0)))
    parameter = np.concatenate(([0.0], np.cumsum(np.sqrt((step**2).sum(axis=1) / 2.0))))
    stays = np.zeros(len(tip), np.bool_)
    stays[[0, *fixed, -1]] = True
    return Vertices(tip, words, tip, axis_point, parameter, stays)


def arc(count: int, **more: tuple[int, ...]) -> Vertices:
    """A quarter of a circle about Z, with a tool that stands upright."""
    angle = np.linspace(0.0, np.pi / 2.0, count)
    tip = RADIUS * np.stack((np.cos(angle), np.sin(angle), 0.0 * angle), axis=1)
    return path(tip, np.zeros((count, 2)), **more)


def off(rows: Vertices, moved: Vertices, kept: np.ndarray) -> np.ndarray:
    """(r,) larger distance of tip and axis point of lines from the original at its own parameter, by interpolation."""
    s, at = rows.parameter, rows.parameter[kept]
    tip, words = (
        np.stack([np.interp(s, at, column) for column in values[kept].T], axis=1) for values in (moved.tip, moved.words)
    )
    lever = HEIGHT * (axis_of(words) - axis_of(rows.words))
    away = tip - rows.tip
    return np.maximum(np.linalg.norm(away, axis=1), np.linalg.norm(away + lever, axis=1))


def lines_outside(rows: Vertices, limits: LineLimits) -> tuple[Vertices, Ints]:
    """Lines of a control to which every line takes a second."""
    return faster_lines(rows, limits, lambda rows, kept: np.arange(len(kept), dtype=np.float64))


def test_lines_are_beside_the_path_only_where_they_are_faster() -> None:
    """Two arcs, the second of which takes longer where its ends are off the path."""
    rows = arc(401, fixed=(200,))

    def reached(some: Vertices, kept: Ints) -> Floats:
        slow = np.abs(some.tip - rows.tip)[201:].max() > 0.0
        return np.where(kept > 200, 1e3 if slow else 500.0, np.arange(len(kept)))

    moved, kept = faster_lines(rows, LIMITS, reached)
    radius = np.hypot(*moved.tip[:, :2].T)
    assert (radius[kept[(kept > 0) & (kept < 200)]] > RADIUS + 0.5 * TOLERANCE).all()
    assert np.array_equal(moved.tip[200:], rows.tip[200:])
    on_path = fewest_lines(rows, LIMITS)
    assert np.array_equal(kept[kept >= 200], on_path[on_path >= 200])
    assert off(rows, moved, kept).max() <= TOLERANCE * (1.0 + 1e-9)


def test_ends_on_an_arc_are_as_far_outside_as_lines_are_inside() -> None:
    rows = arc(400)
    moved, kept = lines_outside(rows, LIMITS)
    radius = np.hypot(*moved.tip[kept][:, :2].T)
    assert (radius[1:-1] > RADIUS + 0.5 * TOLERANCE).all()
    assert off(rows, moved, kept).max() <= TOLERANCE * (1.0 + 1e-9)
    # lines of twice the sagitta are longer by the root of two, but for the two at the ends
    assert len(kept) <= (len(fewest_lines(rows, LIMITS)) - 1) / np.sqrt(1.7) + 3


@pytest.mark.parametrize("seed", range(6))
def test_no_line_leaves_the_tolerance_and_rows_that_stay_do(seed: int) -> None:
    """Random bends and turns, noise as of poses with few digits, and rows at which something happens."""
    random = np.random.default_rng(seed)
    t = np.linspace(0.0, 1.0, 600)
    waves = random.normal(size=(5, 4)) / np.arange(1, 5) ** 2
    place = sum(np.sin(np.pi * (k + 1) * t[:, None] + k) * waves[:, k] for k in range(4))
    tip = np.column_stack((40.0 * t, 3.0 * place[:, 0], 3.0 * place[:, 1])) + random.normal(size=(600, 3)) * 5e-4
    words = 8.0 * place[:, 2:4] + random.normal(size=(600, 2)) * 1e-3
    stay = (150, 151, 420)
    rows = path(tip, words, fixed=stay)
    moved, kept = lines_outside(rows, LIMITS)
    assert off(rows, moved, kept).max() <= TOLERANCE * (1.0 + 1e-9)
    assert np.isin((0, *stay, 599), kept).all()
    assert moved.tip[[0, *stay, 599]] == pytest.approx(tip[[0, *stay, 599]], abs=0.0)
    assert moved.words[[0, *stay, 599]] == pytest.approx(words[[0, *stay, 599]], abs=0.0)
    assert len(kept) < len(fewest_lines(rows, LIMITS))


def test_what_cannot_be_moved_is_on_the_path() -> None:
    """A zigzag of one row each way by several times the tolerance."""
    tip = np.column_stack((np.arange(50.0), 0.05 * (np.arange(50) % 2), np.zeros(50)))
    rows = path(tip, np.zeros((50, 2)))
    moved, kept = lines_outside(rows, LIMITS)
    assert off(rows, moved, kept).max() <= TOLERANCE * (1.0 + 1e-9)


def test_a_path_of_two_rows_is_one_line() -> None:
    rows = path(np.array([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]), np.zeros((2, 2)))
    moved, kept = lines_outside(rows, LIMITS)
    assert kept.tolist() == [0, 1]
    assert moved.tip.tolist() == rows.tip.tolist()


@pytest.mark.parametrize("count", [1, 3])
def test_a_tool_that_stands_is_where_it_was(count: int) -> None:
    rows = path(np.zeros((count, 3)), np.zeros((count, 2)))
    moved, kept = lines_outside(rows, LIMITS)
    assert np.array_equal(moved.tip, rows.tip)
    assert np.array_equal(kept, fewest_lines(rows, LIMITS))
