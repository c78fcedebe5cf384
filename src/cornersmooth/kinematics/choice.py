"""Which of the two solutions, and in which turn, for every piece of a path: the cheapest choice inside the limits.

A piece is a stretch on which the solution cannot change without a jump. Between pieces stands either a rapid, where
everything may change, or a passage through the pole, where the two solutions meet. The search looks ahead over the
whole path (dynamic programming): the start of a stretch is chosen so that its end still lies inside the limits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Bools, Floats, Ints

#: What a full turn back of an axis in a rapid costs, in degrees of rotation: so much that rotation never outweighs it.
REWIND_COST = 1e9
#: What a start on the solution that is not preferred costs, in degrees of rotation: more than any start turn.
PREFERENCE_COST = 1e3
#: What a piece costs that leaves the limits in every turn.
OUTSIDE_COST = 1e12
#: Words may pass their limits by so much (degrees): rounding of the solution, far below the last digit of a word.
LIMIT_SLACK = 1e-9
#: An axis with room for more turns than this is taken as endless first; only where that fails its turns are searched.
MANY_TURNS = 8


@dataclass(frozen=True)
class Pieces:
    """Angles of p pieces on both branches, unwrapped from the first pose of each piece; degrees.

    Parameters
    ----------
    first, last : (p, 2, 2) float64
        ``[piece, branch, axis]`` at the first pose, in (-180, 180], and at the last.
    low, high : (p, 2, 2) float64
        Extremes over the piece.
    free : (p,) bool
        A rapid leads into the piece; false for a passage through the pole. True for the first piece.
    dislike : (2,) float64
        What a start of the path on either branch costs.
    """

    first: Floats
    last: Floats
    low: Floats
    high: Floats
    free: Bools
    dislike: Floats

    def __len__(self) -> int:
        return len(self.first)


class NoChoiceError(Exception):
    """No choice keeps the path inside the limits.

    Parameters
    ----------
    piece : int
        The first piece that cannot be reached inside the limits.
    states : (s, 3) int64
        Branch and turns of both axes in which that piece can be entered, all of which leave the limits inside it.
    """

    def __init__(self, piece: int, states: Ints) -> None:
        super().__init__(piece, states)
        self.piece = piece
        self.states = states


def choose(pieces: Pieces, limits: Floats) -> tuple[Ints, Floats]:
    """Branch and turns of every piece.

    Parameters
    ----------
    pieces : Pieces
    limits : (2, 2) float64, degrees
        Lowest and highest word of each axis, infinite where there is none.

    Returns
    -------
    branch : (p,) int64
    turns : (p, 2) float64
        Whole turns to add to the angles of the piece.

    Raises
    ------
    NoChoiceError
    """
    branch = _cheapest_branches(pieces, limits)
    turns = _nearest_turns(pieces, branch)
    if _inside(pieces, branch, turns, limits):
        return branch, turns
    finite = np.isfinite(limits[:, 0]) & np.isfinite(limits[:, 1])
    narrow = finite & (limits[:, 1] - limits[:, 0] <= 360 * MANY_TURNS)
    if narrow.any() and (narrow != finite).any():
        branch, fixed = search(pieces, np.where(narrow[:, None], limits, [[-np.inf, np.inf]]))
        turns = _nearest_turns(pieces, branch, fixed, narrow)
        if _inside(pieces, branch, turns, limits):
            return branch, turns
    branch, fixed = search(pieces, limits)
    return branch, _nearest_turns(pieces, branch, fixed, finite)


def _cheapest_branches(pieces: Pieces, limits: Floats) -> Ints:
    """Branches with the least rotation between pieces that fit into the limits, each in some turn: two states each."""
    lowest = np.ceil((limits[:, 0] - LIMIT_SLACK - pieces.low) / 360)  # turns that bring the piece inside
    highest = np.floor((limits[:, 1] + LIMIT_SLACK - pieces.high) / 360)
    outside = np.where((lowest > highest).any(axis=2), OUTSIDE_COST, 0.0)
    step = pieces.first[1:, None, :, :] - pieces.last[:-1, :, None, :]  # [edge, from, to, axis]
    cost = np.abs(step - 360 * np.round(step / 360)).sum(axis=3) + outside[1:, None, :]
    start = (pieces.dislike + np.abs(pieces.first[0]).sum(axis=1) + outside[0]).tolist()
    best, origins = [start[0], start[1]], []
    for (stay0, swap01), (swap10, stay1) in cost.tolist():
        into0, into1 = (best[0] + stay0, best[1] + swap10), (best[0] + swap01, best[1] + stay1)
        origins.append((int(into0[1] < into0[0]), int(into1[0] >= into1[1])))
        best = [min(into0), min(into1)]
    branch = [int(best[1] < best[0])]
    for origin in reversed(origins):
        branch.append(origin[branch[-1]])
    return np.array(branch[::-1], dtype=np.int64)


def _nearest_turns(pieces: Pieces, branch: Ints, fixed: Floats | None = None, known: Bools | None = None) -> Floats:
    """Count the turns without a rewind; those of axes that are `known` are taken as they are."""
    index = np.arange(len(pieces))
    first, last = pieces.first[index, branch], pieces.last[index, branch]
    turns = np.zeros((len(pieces), 2))
    turns[1:] = -np.cumsum(np.round((first[1:] - last[:-1]) / 360), axis=0)
    return turns if fixed is None or known is None else np.where(known, fixed, turns)


def _inside(pieces: Pieces, branch: Ints, turns: Floats, limits: Floats) -> bool:
    index = np.arange(len(pieces))
    low = pieces.low[index, branch] + 360 * turns
    high = pieces.high[index, branch] + 360 * turns
    return bool((low >= limits[:, 0] - LIMIT_SLACK).all() and (high <= limits[:, 1] + LIMIT_SLACK).all())


def search(pieces: Pieces, limits: Floats) -> tuple[Ints, Floats]:
    """Search the careful way: every branch and every turn that the limits allow; axes without limits carry no turns.

    Returns and raises as `choose`, with turns 0 for axes without limits.
    """
    finite = np.isfinite(limits[:, 0]) & np.isfinite(limits[:, 1])
    ranges = [
        _turn_range(low, high) if known else np.zeros(1) for (low, high), known in zip(limits, finite, strict=True)
    ]
    best = np.stack(
        [
            pieces.dislike[b]
            + np.abs(pieces.first[0, b, 0] + 360 * ranges[0])[:, None]
            + np.abs(pieces.first[0, b, 1] + 360 * ranges[1])[None, :]
            for b in (0, 1)
        ]
    )
    shape = best.shape
    origins: list[Ints] = []
    for p in range(len(pieces)):
        if p:
            best, origin = _step(best, pieces, p, ranges, finite)
            origins.append(origin)
        allowed = np.ones(shape, np.bool_)
        for b in (0, 1):
            for axis in (0, 1):
                low = pieces.low[p, b, axis] + 360 * ranges[axis] >= limits[axis, 0] - LIMIT_SLACK
                high = pieces.high[p, b, axis] + 360 * ranges[axis] <= limits[axis, 1] + LIMIT_SLACK
                fits = (low & high) | ~finite[axis]
                allowed[b] &= fits[:, None] if axis == 0 else fits[None, :]
        entered = best
        best = np.where(allowed, best, np.inf)
        if not np.isfinite(best).any():
            states = np.argwhere(np.isfinite(entered))
            states[:, 1] = ranges[0][states[:, 1]]
            states[:, 2] = ranges[1][states[:, 2]]
            raise NoChoiceError(p, states)
    state = int(np.argmin(best))
    path = [state]
    for origin in reversed(origins):
        state = int(origin.flat[state])
        path.append(state)
    branch, turn0, turn1 = np.unravel_index(np.array(path[::-1]), shape)
    return branch.astype(np.int64), np.stack((ranges[0][turn0], ranges[1][turn1]), axis=1)


def _turn_range(low: float, high: float) -> Floats:
    """Whole turns that bring an angle in (-180, 180] inside the limits."""
    return np.arange(np.ceil((low - 180) / 360), np.floor((high + 180) / 360) + 1)


def _step(best: Floats, pieces: Pieces, p: int, ranges: list[Floats], finite: Bools) -> tuple[Floats, Ints]:
    """Costs of all states at piece p, and the state each comes from."""
    reached = np.full(best.shape, np.inf)
    origin = np.zeros(best.shape, np.int64)
    states = np.arange(best.size).reshape(best.shape)
    for b in (0, 1):
        for to in (0, 1):
            step = pieces.first[p, to] - pieces.last[p - 1, b]
            cost, source = best[b], states[b]
            for axis in (0, 1):
                edge = _edge_cost(step[axis], ranges[axis], bool(finite[axis]), bool(pieces.free[p]))
                # Least sum over the old turn of this axis, for every new turn: [old, new] against [old, other axis].
                moved = cost if axis == 0 else cost.T
                names = source if axis == 0 else source.T
                total = moved[:, None, :] + edge[:, :, None]
                pick = total.argmin(axis=0)
                cost = np.take_along_axis(total, pick[None], axis=0)[0]
                source = np.take_along_axis(names, pick, axis=0)
                if axis == 1:
                    cost, source = cost.T, source.T
            better = cost < reached[to]
            reached[to] = np.where(better, cost, reached[to])
            origin[to] = np.where(better, source, origin[to])
    return reached, origin


def _edge_cost(step: float, turns: Floats, finite: bool, free: bool) -> Floats:
    """Cost of every change of turn of one axis: (old, new)."""
    nearest = -np.round(step / 360)
    if not finite:
        return np.array([[abs(step + 360 * nearest)]])
    change = turns[None, :] - turns[:, None]
    natural = change == nearest
    if free:
        cost: Floats = np.abs(step + 360 * change) + np.where(natural, 0.0, REWIND_COST)
        return cost
    return np.where(natural, np.abs(step + 360 * change), np.inf)
