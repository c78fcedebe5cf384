"""Where vertices may be if two polylines are run in order within a distance: against a search on a fine grid."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from cornersmooth.cl import read
from cornersmooth.verify import verify
from cornersmooth.verify.in_order import passage
from oracle.share import how_many, share
from verify.random_programs import trial
from verify.sweep import judged
from verify.writing import simple_text

Floats = NDArray[np.float64]

#: parts of a segment of the path, and of one of the other motion, on the grid
FINE = 24


def fine(points: Floats) -> Floats:
    """Points on a polyline, `FINE` on each segment, and its end."""
    share = np.arange(FINE) / FINE
    inner = points[:-1, None] + share[:, None] * np.diff(points, axis=0)[:, None]
    return np.vstack((inner.reshape(-1, points.shape[1]), points[-1:]))


def reached(near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What is reached from the first corner of a grid by steps ahead on either motion or on both."""
    found = np.zeros_like(near)
    found[0, 0] = near[0, 0]
    for i in range(near.shape[0]):
        for j in range(near.shape[1]):
            before = found[max(i - 1, 0), j] | found[i, max(j - 1, 0)] | found[max(i - 1, 0), max(j - 1, 0)]
            found[i, j] = near[i, j] & (found[i, j] | before)
    return found


def on_grid(own: Floats, path: Floats, radius: float) -> NDArray[np.bool_]:
    """(n, m·FINE + 1) whether vertices of the one may be at points of the other."""
    away = (fine(own)[:, None] - fine(path)[None]).reshape(len(fine(own)), -1, 2, 3)
    near = np.linalg.norm(away, axis=3).max(axis=2) <= radius
    both = reached(near) & reached(near[::-1, ::-1])[::-1, ::-1]
    return both[::FINE]


def motions(seed: int) -> tuple[Floats, Floats, float]:
    """A path that goes to and fro, and one near it that leaves some of it out."""
    rng = np.random.default_rng(seed)
    path = np.cumsum(rng.normal(size=(6, 6)) * rng.choice([0.2, 1.0], (6, 1)), axis=0)
    inner = [k for k in range(1, 5) if rng.random() < 0.6]
    own = np.vstack((path[:1], path[inner] + 0.2 * rng.normal(size=(len(inner), 6)), path[-1:]))
    return own, path, float(rng.uniform(0.3, 2.0))


@pytest.mark.parametrize("seed", range(how_many(12, 200)))
def test_places_are_those_of_a_fine_grid(seed: int) -> None:
    own, path, radius = motions(seed)
    coarse = max(np.linalg.norm(np.diff(line, axis=0), axis=1).max() for line in (own, path)) / FINE
    low, high = passage(own, path, (0.0, float(len(path) - 1)), radius)
    least, most = on_grid(own, path, radius), on_grid(own, path, radius + 2.0 * coarse)
    for vertex in range(len(own)):
        place = np.arange(least.shape[1]) / FINE
        segment = np.minimum(place.astype(int), len(path) - 2)
        share = place - segment
        inside = (low[vertex, segment] <= share + 1e-9) & (share <= high[vertex, segment] + 1e-9)
        assert inside[least[vertex]].all(), "a place of the grid is not found"
        assert most[vertex][inside].all(), "what is found is not near any place of the grid"


def test_nothing_is_found_where_the_path_is_left() -> None:
    path = np.zeros((3, 6))
    path[:, 0] = [0.0, 5.0, 10.0]
    own = path.copy()
    own[1, 1] = 1.5
    low, _ = passage(own, path, (0.0, 2.0), 1.0)
    assert np.isnan(low).all()
    low, high = passage(own, path, (0.0, 2.0), 2.0)
    assert low[1].tolist() == pytest.approx([1.0 - np.sqrt(1.75) / 5.0, 0.0])
    assert high[1].tolist() == pytest.approx([1.0, np.sqrt(1.75) / 5.0])


def test_a_turn_may_be_waited_for_but_not_run_backwards() -> None:
    path = np.zeros((4, 6))
    path[:, 0] = [0.0, 3.0, 2.0, 6.0]
    straight = path[[0, 3]]
    assert not np.isnan(passage(straight, path, (0.0, 3.0), 0.6)[0][1]).all()  # at 2.5 until the path is back there
    assert np.isnan(passage(straight, path, (0.0, 3.0), 0.4)[0]).all()


def in_order(cl: list[float], order: list[float], tolerance: float) -> bool:
    """Whether a text along a line is taken to be in order with a CL file along it."""
    goto = [f"GOTO/{x:.4f},0,0,0,0,1" for x in cl]
    program = read("\n".join(["UNITS/MM", "RAPID", goto[0], "FEDRAT/500,MMPM", *goto[1:], "FINI"]).encode())
    tip = np.array([[x, 0.0, 0.0] for x in order])
    axis = np.tile([0.0, 0.0, 1.0], (len(order), 1))
    text = simple_text(tip, axis, tolerance, 10.0, "g1", feed=500.0, sharp=range(1, len(order) - 1))
    found = verify(program, text, tolerance=tolerance, axis_length=10.0)
    return all(one.code != "CS523" for one in found.problems)


def test_a_long_way_run_in_a_wrong_order_is_found() -> None:
    """Every vertex is on the path, but between one turn and the next they are run backwards."""
    cl = [0.0, 0.94, 1.0, -3.0, -4.0, -3.94]
    assert in_order(cl, [0.0, 1.0, -4.0, -3.94], 0.2)
    assert not in_order(cl, [0.0, 0.94, -4.0, -3.0, 1.0, -3.94], 0.2)


@pytest.mark.parametrize(
    ("cl", "order", "tolerance"),
    [
        (
            [0.4, 0.34, 1.04, 1.24, 0.84, 4.84, 5.04, 4.34, 5.34, 5.14, 6.14],
            [0.4, 0.34, 1.04, 1.24, 0.84, 4.84, 5.14, 5.34, 4.34, 5.04, 6.14],
            0.2,
        ),
        (
            [-0.4, -0.8, 0.2, -3.8, -4.8, -4.1, -4.3, -5.0, -4.3, -4.1, -4.04, -3.64],
            [-0.4, -0.8, 0.2, -3.8, -4.8, -4.1, -4.3, -4.04, -3.64],
            0.2,
        ),
        (
            [0.05, 0.047, -0.153, -0.203, -0.168, -0.148, -0.128, -0.148, -0.151, -0.116, -0.166],
            [0.05, 0.047, -0.153, -0.203, -0.168, -0.148, -0.116, -0.151, -0.148, -0.128, -0.166],
            0.01,
        ),
    ],
    ids=["turns the other way round", "a turn is left out", "the last turns come first"],
)
def test_every_turn_must_be_passed_in_its_order(cl: list[float], order: list[float], tolerance: float) -> None:
    """All vertices of either are near the other, and what joins them is, too."""
    assert in_order(cl, cl, tolerance)
    assert not in_order(cl, order, tolerance)
    # within a wider tolerance nothing of it is missing
    assert in_order(cl, order, 3.0 * tolerance)


@pytest.mark.parametrize("seed", share([600796, 600961], 2))
def test_tips_and_axis_points_each_in_order_pass_where_no_pose_is_near_both(seed: int) -> None:
    """`zhang2016`: where a window begins, the tip or the axis point is off the place of both by more than ε."""
    one = trial(seed)
    assert judged(one, read(one.cl.encode()), oracle=False) == ("passed", "")
