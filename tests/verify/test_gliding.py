"""Places found at once: those that a walk finds, and none where there is doubt."""

from __future__ import annotations

import numpy as np
import pytest

from cornersmooth.verify.blocks import lengths
from cornersmooth.verify.gliding import glide
from cornersmooth.verify.walking import Lanes, Track, walk

from .writing import wavy

FAR = 0.03


def both(original, written):
    """Glide and walk over a written trail, as one lane."""
    track = Track.of(original)
    ends = (np.array([value]) for value in (0, len(written) - 1, 0, len(original) - 1))
    lanes = Lanes(*ends, np.array([0.0]))
    return track, glide(written, lengths(written), track, lanes, FAR), walk(written, track, lanes, 1e-4, 0.05)


def trail(count=400, seed=0):
    tip, axis = wavy(count, seed=seed)
    return np.hstack((tip, tip + 10 * axis))


@pytest.mark.parametrize("seed", range(6))
def test_places_are_those_of_the_walk(seed):
    original = trail(seed=seed)
    rng = np.random.default_rng(seed)
    place = np.linspace(0, len(original) - 1, 700)
    place[1:-1] += rng.uniform(-0.2, 0.2, 698)
    segment = np.minimum(place.astype(int), len(original) - 2)
    share = (place - segment)[:, None]
    written = original[segment] + share * (original[segment + 1] - original[segment])
    written[1:-1] += rng.uniform(-0.002, 0.002, (len(place) - 2, 6))
    track, (vertex, found, fraction, distance, good), (walked, at, _, _) = both(original, written)
    assert good.all()
    np.testing.assert_array_equal(vertex, np.arange(1, len(written)))
    way = track.length[found] + fraction * (track.length[found + 1] - track.length[found])
    theirs = track.length[walked] + at * (track.length[walked + 1] - track.length[walked])
    assert np.abs(way - theirs[1:]).max() < 0.02
    point = original[found] + fraction[:, None] * (original[found + 1] - original[found])
    np.testing.assert_allclose(distance, np.linalg.norm(written[1:] - point, axis=1), atol=1e-9)


def test_doubt_is_left_to_the_walk():
    original = trail()
    assert both(original, original)[1][-1].all()
    far = original.copy()
    far[200, :3] += 0.1
    back = np.vstack((original[:200], original[199:150:-1], original[150:]))
    turn = np.radians(np.arange(0, 361, 15))
    circle = 5 * np.stack((np.cos(turn), np.sin(turn), *(0 * turn,) * 4), axis=1)
    circle[:, 3:] = circle[:, :3] + [0, 0, 10]
    loops = np.vstack((circle, circle[1:], circle[1:]))
    for path, written in ((original, far), (original, back), (loops, loops[: -len(circle) + 1]), (loops, circle)):
        assert not both(path, written)[1][-1].any()
    assert not both(loops, np.vstack((loops, circle[1:])))[1][-1].any()


def test_lanes_do_not_mix():
    """A lane in doubt does not spoil its neighbours."""
    original = trail()
    written = original.copy()
    written[150, :3] += 0.1
    edges = np.array([0, 100, 200, 300, 399])
    lanes = Lanes(edges[:-1], edges[1:], edges[:-1], edges[1:], np.zeros(4))
    vertex, segment, fraction, distance, good = glide(written, lengths(written), Track.of(original), lanes, FAR)
    assert good.tolist() == [True, False, True, True]
    np.testing.assert_array_equal(vertex, np.arange(1, 400))
    sure = (vertex <= 100) | (vertex > 200)
    np.testing.assert_allclose((segment + fraction)[sure], vertex[sure], atol=1e-9)
    assert distance[sure].max() < 1e-9
