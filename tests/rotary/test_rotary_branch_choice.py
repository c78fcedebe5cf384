"""The look-ahead against all possibilities tried one by one."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from cornersmooth.rotary.branch_choice import (
    MANY_TURNS,
    REWIND_COST,
    START_TURN_COST,
    NoChoiceError,
    Stretches,
    choose,
    search,
)
from oracle.share import how_many

#: Ties between start turns are broken by less than this.
TIE = 20 * START_TURN_COST
WIDE = 180.0 * MANY_TURNS + 360.0


def random_stretches(rng: np.random.Generator, count: int) -> Stretches:
    first = rng.uniform(-180, 180, (count, 2, 2))
    last = first + rng.choice([20.0, 200.0, 500.0]) * rng.uniform(-1, 1, (count, 2, 2))
    more = rng.uniform(0, 30, (2, count, 2, 2))
    free = np.append(True, rng.random(count - 1) < 0.6)
    dislike = rng.choice([0.0, 1000.0], 2)
    return Stretches(first, last, np.minimum(first, last) - more[0], np.maximum(first, last) + more[1], free, dislike)


def random_limits(rng: np.random.Generator) -> np.ndarray:
    limits = []
    for _ in range(2):
        kind = rng.integers(4)
        if kind == 0:
            limits.append([-np.inf, np.inf])
        elif kind == 1:
            limits.append([-WIDE, WIDE])
        else:
            limits.append([-rng.uniform(50, 400), rng.uniform(50, 400)])
    return np.array(limits)


def turns_in(limits: np.ndarray) -> np.ndarray:
    if not np.isfinite(limits).all():
        return np.zeros(1)
    if limits[1] >= WIDE:  # too many for trying all: those around zero are the cheap ones
        return np.arange(-3, 4.0)
    return np.arange(-2, 3.0)


def cost_of(stretches: Stretches, branch: np.ndarray, turns: np.ndarray, limits: np.ndarray) -> float:
    """Cost by the words of the module, infinite where a limit or the continuity of a cut is broken."""
    total = 0.0
    for p, b in enumerate(branch):
        if (stretches.low[p, b] + 360 * turns[p] < limits[:, 0] - 1e-9).any():
            return np.inf
        if (stretches.high[p, b] + 360 * turns[p] > limits[:, 1] + 1e-9).any():
            return np.inf
        words = stretches.first[p, b] + 360 * turns[p]
        if p == 0:
            total += (
                stretches.dislike[b] + np.abs(stretches.first[p, b]).sum() + START_TURN_COST * np.abs(turns[p]).sum()
            )
            continue
        before = stretches.last[p - 1, branch[p - 1]] + 360 * turns[p - 1]
        step = words - before
        if not stretches.free[p] and (np.abs(step) > 180 + 1e-9).any():
            return np.inf
        total += np.abs(step).sum() + REWIND_COST * (np.abs(step) > 180 + 1e-9).sum()
    return total


def brute_force(stretches: Stretches, limits: np.ndarray) -> float:
    states = list(itertools.product((0, 1), turns_in(limits[0]), turns_in(limits[1])))
    endless = ~np.isfinite(limits).all(axis=1)
    best = np.inf
    for chosen in itertools.product(states, repeat=len(stretches)):
        branch = np.array([state[0] for state in chosen])
        turns = np.array([state[1:] for state in chosen])
        for axis in np.flatnonzero(endless):  # an endless axis just goes on
            for p in range(1, len(stretches)):
                before = stretches.last[p - 1, branch[p - 1], axis] + 360 * turns[p - 1, axis]
                turns[p, axis] = np.round((before - stretches.first[p, branch[p], axis]) / 360)
        best = min(best, cost_of(stretches, branch, turns, limits))
    return best


@pytest.mark.parametrize("seed", range(how_many(15, 60)))
def test_choice_is_the_cheapest_of_all(seed: int):
    rng = np.random.default_rng(seed)
    limits = random_limits(rng)
    states = 2 * len(turns_in(limits[0])) * len(turns_in(limits[1]))
    stretches = random_stretches(rng, 3 if states <= 20 else 2)
    want = brute_force(stretches, limits)
    if np.isinf(want):
        with pytest.raises(NoChoiceError):
            choose(stretches, limits)
        return
    branch, turns = choose(stretches, limits)
    assert cost_of(stretches, branch, turns, limits) == pytest.approx(want, abs=TIE)


def outcome(way, stretches: Stretches, limits: np.ndarray):
    """What a way returns, or the stretch it cannot enter."""
    try:
        return way(stretches, limits)
    except NoChoiceError as stuck:
        return stuck.stretch


@pytest.mark.parametrize("seed", range(40))
def test_fast_way_equals_careful_way(seed: int):
    rng = np.random.default_rng(1000 + seed)
    limits = random_limits(rng)
    stretches = random_stretches(rng, 30)
    outcomes = [outcome(way, stretches, limits) for way in (choose, search)]
    if isinstance(outcomes[0], int):
        assert outcomes[0] == outcomes[1]
        return
    (branch, turns), (careful, fixed) = outcomes
    endless = ~np.isfinite(limits).all(axis=1)
    for axis in np.flatnonzero(endless):
        for p in range(1, 30):
            before = stretches.last[p - 1, careful[p - 1], axis] + 360 * fixed[p - 1, axis]
            fixed[p, axis] = np.round((before - stretches.first[p, careful[p], axis]) / 360)
    got, want = (cost_of(stretches, *way, limits) for way in ((branch, turns), (careful, fixed)))
    assert np.isfinite(want)
    assert got == pytest.approx(want, abs=TIE)


def test_seeds_cover_both_outcomes():
    """The random cases above are of use only if limits bind in some and cannot be kept in others."""
    outcomes = set()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        limits = random_limits(rng)
        states = 2 * len(turns_in(limits[0])) * len(turns_in(limits[1]))
        stretches = random_stretches(rng, 3 if states <= 20 else 2)
        try:
            branch, turns = choose(stretches, limits)
            free = choose(stretches, np.array([[-np.inf, np.inf]] * 2))
            outcomes.add("bound" if (branch != free[0]).any() or (turns != free[1]).any() else "free")
            outcomes.add("rewind" if cost_of(stretches, branch, turns, limits) >= REWIND_COST else "straight")
        except NoChoiceError:
            outcomes.add("none")
    assert outcomes == {"bound", "free", "rewind", "straight", "none"}
