"""The decision of the theorem, judged by the whole free-space diagram."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cornersmooth.verify import passage as module
from cornersmooth.verify.chain import Path, Sections
from cornersmooth.verify.motions import UNBOUND
from cornersmooth.verify.passage import Passage
from oracle.free_space import passes
from verify.whole_passage import passage, whole_section

SEEDS = st.integers(0, 2**32 - 1)


def walk(rng: np.random.Generator, kind: str, n: int) -> np.ndarray:
    """A motion of tip and axis point in steps of about 1."""
    if kind == "wander":
        return np.cumsum(rng.normal(size=(n, 6)), axis=0)
    if kind == "fold":
        x, y = (np.cumsum(rng.choice([-1.0, 0.0, 1.0, 1.0], n)) for _ in range(2))
        return np.stack((x, 0 * x, 0 * x, y, 0 * x, 0 * x), axis=1)
    if kind == "spiral":
        t = np.cumsum(rng.uniform(0.0, 0.6, n))
        tip = np.stack((np.cos(t), np.sin(t), 0.02 * t), axis=1) * (1 + 0.05 * t[:, None])
        return np.hstack((tip, tip + [0, 0, 1]))
    if kind == "tip stands":
        other = np.cumsum(rng.normal(size=(n, 3)), axis=0)
        return np.hstack((np.zeros((n, 3)), other))
    if kind == "repeated":
        return np.cumsum(np.repeat(rng.normal(size=((n + 2) // 3, 6)), 3, axis=0)[:n], axis=0)
    places = np.cumsum(rng.normal(size=(n, 6)), axis=0)
    return places[rng.integers(0, n, n)]  # to and fro between the same poses


KINDS = ("wander", "fold", "spiral", "tip stands", "repeated", "to and fro")


def written(rng: np.random.Generator, path: np.ndarray) -> np.ndarray:
    """The motion with more vertices, some left out; two exchanged, or a piece run twice; and noise of digits."""
    if len(path) == 1:
        return np.repeat(path, rng.integers(1, 4), axis=0)
    points = [path[0]]
    for start, end in pairwise(path):
        points += [start + f * (end - start) for f in np.sort(rng.uniform(0, 1, rng.integers(0, 4)))]
        points += [end] if rng.random() < 0.7 else []
    own = np.array([*points, path[-1]])
    fault = rng.integers(4)
    if fault == 1 and len(own) > 6:
        i = rng.integers(1, len(own) - 3)
        own[[i, i + 1]] = own[[i + 1, i]]
    if fault == 2 and len(own) > 9:
        i = rng.integers(1, len(own) - 5)
        own = np.insert(own, i + 3, own[i : i + 3], axis=0)
    return own + rng.normal(size=own.shape) * rng.choice([0.0, 1e-9, 0.01, 0.1, 0.4])


@settings(deadline=None)
@given(
    seed=SEEDS,
    kind=st.sampled_from(KINDS),
    radius=st.sampled_from([1e-6, 0.02, 0.1, 0.3, 0.6, 1.0, 2.0]),
    columns=st.sampled_from([slice(0, 6), slice(0, 3), slice(3, 6)]),
)
def test_verdict_is_that_of_the_whole_diagram(seed, kind, radius, columns):
    rng = np.random.default_rng(seed)
    path = walk(rng, kind, rng.integers(1, 14))
    own, path = written(rng, path)[:, columns], path[:, columns]

    def judge(share):
        return passes(own.tolist(), path.tolist(), share * radius)

    if judge(1 - 1e-9) != judge(1 + 1e-9):
        return  # nobody can tell
    found = passage(own, path, radius)
    assert (not found.breaks) is judge(1.0)
    if not found.breaks and len(own) > 1:
        assert (np.diff(found.place) >= -1e-9).all()
        k = np.minimum(found.place.astype(int), max(len(path) - 2, 0))
        end = path[np.minimum(k + 1, len(path) - 1)]
        away = (own - path[k] - (found.place - k)[:, None] * (end - path[k])).reshape(len(own), -1, 3)
        assert np.linalg.norm(away, axis=2).max() <= radius * (1 + 1e-6)


def arcs(rng: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A motion of parabolas: vertices, second derivatives, and dense points."""
    own = np.cumsum(rng.normal(size=(n, 6)), axis=0)
    second = rng.normal(size=(n - 1, 6)) * rng.choice([0.0, 0.1, 1.0], (n - 1, 1))
    t = np.linspace(0, 1, 21)[:-1, None, None]
    dense = own[:-1] + t * (own[1:] - own[:-1]) - second * t * (1 - t) / 2
    return own, second, np.concatenate((dense.transpose(1, 0, 2).reshape(-1, 6), own[-1:]))


@settings(deadline=None)
@given(
    seed=SEEDS,
    radius=st.sampled_from([0.02, 0.05, 0.1, 0.3]),
    divided=st.booleans(),
)
def test_bent_motions_pass_only_where_they_keep_the_radius(seed, radius, divided):
    rng = np.random.default_rng(seed)
    own, second, dense = arcs(rng, 5)
    path = dense[:: rng.choice([1, 4, 10])] + rng.normal(size=6) * rng.choice([0.0, 0.02])
    bend = np.linalg.norm(second.reshape(-1, 2, 3), axis=2).max(axis=1) / 8

    def inner(number):
        k = number.astype(int)
        t = (number - k)[:, None]
        return own[k] + t * (own[k + 1] - own[k]) - second[k] * t * (1 - t) / 2

    found = passage(own, path, radius, own_bend=bend, inner=inner if divided else None)
    assert len(found.place) == len(own)
    if not found.breaks:  # chords of a twentieth are off by a four-hundredth of the bend
        assert passes(dense.tolist(), path.tolist(), radius + bend.max() / 400)
    elif divided:
        close = 0.99 * radius - bend.max() / 400
        assert not passes(dense.tolist(), path.tolist(), close)


def test_a_step_without_a_bend_is_not_divided():
    """Where the axis turns over, dividing proves nothing: it would be millions of parts."""
    path, asked = straight(3), []

    def inner(number):
        asked.extend(number)
        return path[1] + (number - 1)[:, None] * (path[2] - path[1])

    found = passage(path, path, 0.1, own_bend=np.array([0.0, UNBOUND]), inner=inner)
    assert found.breaks
    assert len(asked) < 1000


def straight(n: int) -> np.ndarray:
    x = np.arange(n, dtype=float)
    tip = np.stack((x, np.sin(x), 0 * x), axis=1)
    return np.hstack((tip, tip + [0, 0, 10]))


def test_every_fault_is_named_where_it_is():
    path = straight(200)
    own = path.copy()
    for row in (20, 90, 150):
        own[row, 2] += 0.5
    found = passage(own, path, 0.1)
    assert [one.row for one in found.breaks] == [20, 90, 150]
    assert all(row - 1 <= one.place <= row for one, row in zip(found.breaks, (20, 90, 150), strict=True))
    assert found.breaks[0].proved
    assert np.isnan(found.place[[20, 90, 150]]).all()
    assert np.isfinite(found.place[[19, 25, 89, 149, 160]]).all()


def test_goes_on_behind_what_is_left_out_and_what_is_run_twice():
    path = straight(300)
    own = np.concatenate((path[:50], path[80:200], path[170:]))
    rows = [one.row for one in passage(own, path, 0.1).breaks]
    assert rows[0] == 50
    assert any(165 <= row <= 175 for row in rows)


def test_stops_after_the_last_break_it_names(monkeypatch):
    path = straight(200)
    own = path.copy()
    own[10::10, 2] += 0.5
    monkeypatch.setattr(module, "MOST_BREAKS", 3)
    found = passage(own, path, 0.1)
    assert len(found.breaks) == 3
    assert np.isnan(found.place[41:]).all()


def test_what_lies_too_far_back_is_not_proved(monkeypatch):
    """The motion stands where all ways of a path to and fro are near, and then goes to and fro once more than it."""
    path = np.zeros((4, 3))
    path[:, 0] = 0, 5, 0, 5
    path[2:, 1] = 0.5
    stand = np.repeat([[2.5, -0.1, 0.0]], 40, axis=0)
    own = np.concatenate(([path[0]], stand, path[1:], path[2:]))
    monkeypatch.setattr(module, "LOOK_BACK", (3, 8))
    found = passage(own, path, 1.0)
    assert found.breaks
    assert found.breaks[0].row == 44
    assert not found.breaks[0].proved
    monkeypatch.setattr(module, "LOOK_BACK", (3, 2048))
    assert passage(own, path, 1.0).breaks[0].proved


@settings(deadline=None)
@given(seed=SEEDS, radius=st.sampled_from([0.1, 0.3, 1.0]), off=st.sampled_from([0.0, 0.1, 2.0]))
def test_a_guessed_place_proves_only_what_is_so(seed, radius, off):
    """A motion that is cut, and whose place there is guessed, passes only if it passes as a whole."""
    rng = np.random.default_rng(seed)
    path = walk(rng, rng.choice(KINDS), rng.integers(2, 12))
    own = written(rng, path)
    cut, end = int(rng.integers(1, len(own))), len(path) - 1.0
    guess = np.argmin(np.linalg.norm(path - own[cut], axis=1)) + off * rng.uniform(-1.0, 1.0)
    guess = float(np.clip(guess, 0.0, end))
    parts = (own[: cut + 1], 0.0, guess), (own[cut:], guess, end)
    breaks = []
    for part, start, stop in parts:
        section = whole_section(len(part) - 1, start, stop, guessed=True)
        breaks += Passage(part, np.zeros(len(part) - 1), Path.of(path), radius, section).breaks
    if not breaks:
        assert passes(own.tolist(), path.tolist(), radius * (1 + 1e-9))
    assert not any(one.proved for one in breaks)


def test_the_verdict_does_not_need_one_speed():
    """One motion stands while the other goes on."""
    path = np.zeros((3, 6))
    path[1:, 0], path[:, 5] = (0.05, 10.0), 10.0
    path[1:, 3] = 0.05, 10.0
    assert not passage(np.repeat(path, [40, 3, 1], axis=0), path, 0.01).breaks
    assert not passage(path, np.repeat(path, [1, 30, 2], axis=0), 0.01).breaks


@settings(deadline=None)
@given(seed=SEEDS, radius=st.sampled_from([0.1, 0.3, 1.0]))
def test_sections_are_judged_each_by_itself(seed, radius):
    """One after the other in one motion, and with something between that nobody looks at."""
    rng = np.random.default_rng(seed)
    pairs = []
    for kind in rng.choice(KINDS, 4):
        path = walk(rng, kind, rng.integers(2, 9))
        pairs.append((path, written(rng, path)))
    verdicts = []
    for path, own in pairs:
        judged = {passes(own.tolist(), path.tolist(), r) for r in (radius, radius * (1 - 1e-9))}
        if len(judged) > 1:
            return
        verdicts += judged
    between = rng.normal(size=(2, 6))
    own = np.concatenate([part for _, one in pairs for part in (one, between)])
    last = np.cumsum([len(one) + 2 for _, one in pairs]) - 3
    stop = np.cumsum([len(path) for path, _ in pairs]) - 1
    sizes = np.array([[len(one), len(path)] for path, one in pairs])
    path = np.concatenate([path for path, _ in pairs])
    places = stop + 1.0 - sizes[:, 1], stop.astype(float)
    sections = Sections(last + 1 - sizes[:, 0], last, *places, np.zeros(4, np.bool_))
    found = Passage(own, np.zeros(len(own) - 1), Path.of(path), radius, sections)
    number, inside = sections.of(np.arange(len(own)))
    assert np.isnan(found.place[~inside]).all()
    rows = np.array([one.row for one in found.breaks], int)
    assert inside[rows].all()
    assert sorted(set(number[rows].tolist())) == [k for k, verdict in enumerate(verdicts) if not verdict]
