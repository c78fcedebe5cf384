"""Places on the CL path: found by path length, in order, and guided where a stretch is long."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.model import Program
from cornersmooth.verify import verify
from cornersmooth.verify.guide import STRIDE, cut, guide
from cornersmooth.verify.nearest import nearest_from
from cornersmooth.verify.polyline import Polyline

from .writing import HEAD, TAIL, encode, place_g1, rapid, unit, wavy

FAR = 0.03


def trail(count=400, seed=0):
    tip, axis = wavy(count, seed=seed)
    return np.hstack((tip, tip + 10 * axis))


def near(original, count, seed):
    """Points near places of a polyline, in order, and the path lengths of those."""
    path = Polyline.of(original)
    rng = np.random.default_rng(seed)
    place = np.sort(rng.uniform(0, path.length[-1], count))
    place[0], place[-1] = 0.0, path.length[-1]
    segment = np.clip(np.searchsorted(path.length, place, side="right") - 1, 0, len(original) - 2)
    fraction = (place - path.length[segment]) / np.diff(path.length)[segment]
    points = path.point_at(segment, fraction)
    points[1:-1] += rng.uniform(-0.002, 0.002, (count - 2, 6))
    return path, points, place


def limits(count, path):
    return np.zeros(count, np.int64), np.full(count, len(path.six) - 2)


@pytest.mark.parametrize("seed", range(6))
def test_nearest_place_is_found_from_about_where_it_is(seed):
    path, points, place = near(trail(seed=seed), 700, seed)
    about = place + np.random.default_rng(seed).uniform(-0.5, 0.5, len(place))
    segment, fraction, square = nearest_from(points, path, about, *limits(len(place), path))
    assert np.abs(path.length_at(segment, fraction) - place).max() < 0.02
    away = points - path.point_at(segment, fraction)
    np.testing.assert_allclose(np.sqrt(square), np.linalg.norm(away, axis=1), atol=1e-9)


def test_nearest_place_beyond_a_repeated_pose():
    original = np.repeat(trail(40), 3, axis=0)
    path = Polyline.of(original)
    place = np.linspace(0, path.length[-1], 100)
    points = np.stack([np.interp(place, path.length, column) for column in original.T], axis=1)
    _, _, square = nearest_from(points, path, place - 0.3, *limits(100, path))
    assert square.max() < 1e-12


@pytest.mark.parametrize("seed", range(4))
def test_guide_never_drifts(seed):
    """However many corners are cut short, places are found from the last that was found."""
    original = trail(6000, seed=seed)
    written = (original[1:] + original[:-1]) / 2  # shorter at every corner
    written = np.vstack((original[:1], written, original[-1:]))
    path, own = Polyline.of(original), Polyline.of(written)
    assert path.length[-1] - own.length[-1] > 3 * FAR
    far = float(np.linalg.norm(written[1:-1] - original[1:], axis=1).max())
    vertex, place, distance = guide(written, own.length, path, 0.0, (0, len(original) - 2), far)
    assert len(vertex) > 0.95 * len(written) / STRIDE
    true = np.concatenate(([0.0], (path.length[1:] + path.length[:-1]) / 2, path.length[-1:]))
    np.testing.assert_allclose(place, true[vertex], atol=1e-6)
    assert distance.max() < 1e-6


def test_guide_finds_its_way_again():
    """Behind what is left out, or inserted, places are found again."""
    original = trail(6000)
    path = Polyline.of(original)
    off = original[2000:2300] + np.array([0, 0, 5, 0, 0, 5])
    for written, true in (
        (np.vstack((original[:2000], original[2600:])), np.append(np.arange(2000), np.arange(2600, 6000))),
        (np.vstack((original[:2000], off, original[2000:])), None),
    ):
        length = Polyline.of(written).length
        vertex, place, _ = guide(written, length, path, 0.0, (0, len(original) - 2), FAR)
        rows = np.arange(6000 - 600 if true is not None else 6300)
        known = np.append(np.arange(2000), np.arange(2300, 6300)) if true is None else rows
        where = true if true is not None else np.arange(6000)
        behind = np.isin(vertex, known[3500:])
        assert behind.sum() > 40
        expected = path.length[where[np.searchsorted(known, vertex[behind])]]
        np.testing.assert_allclose(place[behind], expected, atol=1e-6)


def test_cut_leaves_no_doubt():
    original = trail(6000)
    path = Polyline.of(original)
    halves = np.empty((11999, 6))
    halves[::2], halves[1::2] = original, path.point_at(np.arange(5999), np.full(5999, 0.5))
    own = Polyline.of(halves)
    limits = 0, 5998
    found = guide(halves, own.length, path, 0.0, limits, FAR)
    rest = 6000, (1e-4, 2 * FAR)
    at_poses = np.arange(len(halves)) % 2 == 0
    assert cut(halves, own.length, found, path, limits, at_poses, *rest) is None
    vertex, place = cut(halves, own.length, found, path, limits, at_poses | True, *rest)
    assert vertex % 2 == 1
    assert 5900 <= vertex <= 6000
    assert place == pytest.approx(own.length[vertex], abs=1e-9)
    halves[vertex] += 0.01  # better before, where the text is on its path
    before, _ = cut(halves, own.length, found, path, limits, at_poses | True, *rest)
    assert before == vertex - 2
    circle = np.radians(np.arange(0.0, 3600.0, 3.0))
    loops = np.stack((np.cos(circle), np.sin(circle), *(0 * circle,) * 4), axis=1) * 5
    path = Polyline.of(loops)
    found = guide(loops, path.length, path, 0.0, (0, len(loops) - 2), FAR)
    np.testing.assert_allclose(found[1], path.length[found[0]], atol=1e-9)


@pytest.mark.parametrize(("off", "kept"), [(0.01, True), (0.0101, False)], ids=["kept", "not kept"])
def test_all_of_the_tolerance_is_no_doubt_where_tip_and_axis_point_are_near_other_places(off, kept, monkeypatch):
    """Tip and axis point lie 0.003 mm apart along the path: nearest to both, the tip is farther off than by itself."""
    from cornersmooth.verify import search

    program = Program.from_poses([[0, 0, 0], [10, 0, 0], [20, 0, 0]], [[0, 0, 1.0]] * 3, feed=100.0)
    tip = np.array([[5, off, 0], [10, 0, 0], [20, 0, 0]])
    axis = unit([[0.003, -off, 10], [0, 0, 1], [0, 0, 1]])
    lines = [*HEAD, "G43.5 H1", rapid(program.tip[0], program.axis[0], 10.0, "g1", decimals=6)]
    lines += ["G1 " + place_g1(*pose, 6) + " F100." * (k == 0) for k, pose in enumerate(zip(tip, axis, strict=True))]
    assigned = []
    monkeypatch.setattr(search, "assign", lambda six, *_: assigned.append(six))
    found = verify(program, encode([*lines, *TAIL]), tolerance=0.01)
    assert found.together_tip.value > off + 5e-5
    assert found.passed == kept
    assert not assigned  # what is not kept is off wherever it is put
    assert found.max_tip_deviation_mm == pytest.approx(off, abs=1e-9)


@pytest.mark.parametrize("off", [0.015, 0.05, 0.5])
def test_what_is_off_in_many_places_is_told_without_assigning_it_anew(off, monkeypatch):
    """Else each of many wrong places would cost as much as a mishap of the search, of which there are few."""
    from cornersmooth.verify import search

    x = np.linspace(0.0, 60.0, 301)
    tip = np.stack((x, np.sin(x / 4), np.zeros_like(x)), axis=1)
    program = Program.from_poses(tip, [[0, 0, 1.0]] * len(x), feed=100.0)
    wrong = np.arange(7, len(x) - 3, 10)
    tip = tip.copy()
    tip[wrong, 2] += off
    lines = [*HEAD, "G43.5 H1", rapid(program.tip[0], program.axis[0], 10.0, "g1", decimals=6)]
    poses = zip(tip[1:], program.axis[1:], strict=True)
    lines += ["G1 " + place_g1(*pose, 6) + " F100." * (k == 0) for k, pose in enumerate(poses)]
    assigned = []
    monkeypatch.setattr(search, "assign", lambda six, *_: assigned.append(six))
    found = verify(program, encode([*lines, *TAIL]), tolerance=0.01)
    named = {problem.nc_line for problem in found.problems if problem.code == "CS521"}
    assert named == set((len(HEAD) + 2 + wrong).tolist())
    assert found.max_tip_deviation_mm == pytest.approx(off, rel=1e-3)
    assert not assigned
