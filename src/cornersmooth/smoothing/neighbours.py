"""Which poses are next to each other once repeated poses are seen as one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.geometry.ragged import ranges
from cornersmooth.model import Bools, Ints, Move, Program
from cornersmooth.vectors import norm


@dataclass(frozen=True)
class Neighbours:
    """Distinct neighbours of each of n poses inside its chain."""

    previous: Ints  # the pose that the linear move into it starts from, -1 where it is not reached inside a chain
    following: Ints  # the next distinct pose of an inner pose of a chain, else -1
    inner: Bools  # inner poses of chains, repeated ones included: the corners
    duplicate: Bools  # repeats the pose before it in the same chain, but for a hole


def find_neighbours(program: Program, axis_length: float, distance: float) -> Neighbours:
    """Distinct neighbours of all poses; poses within `distance` (mm, tip and axis point) of each other are one.

    A run of poses that creep on by less than `distance` each but by more in total is not merged.
    """
    n, own = len(program), np.arange(len(program))
    chains = program.chains
    length = chains[:, 1] - chains[:, 0]
    members = ranges(chains[:, 0] + 1, length)  # reached by a linear move inside a chain
    first, last = np.full((2, n), -1, np.int64)
    first[members], last[members] = np.repeat(chains[:, 0], length), np.repeat(chains[:, 1], length)
    inner = (first >= 0) & (own != last)

    duplicate = first >= 0
    duplicate[1:] &= _closer(program, own[1:], own[:-1], axis_length, distance)
    duplicate[1:] &= program.kind[:-1] != Move.HOLE  # the tool has left the hole, and comes back to its pose
    representative = np.maximum.accumulate(np.where(duplicate, 0, own))
    repeats = np.flatnonzero(duplicate)
    away = repeats[~_closer(program, repeats, representative[repeats], axis_length, distance)]
    duplicate[repeats[np.isin(representative[repeats], representative[away])]] = False  # those creep
    representative = np.maximum.accumulate(np.where(duplicate, 0, own))

    previous, following = np.full((2, n), -1, np.int64)
    previous[members] = np.maximum(representative[members - 1], first[members])
    distinct = np.minimum.accumulate(np.where(duplicate, n, own)[::-1])[::-1]
    following[inner] = distinct[np.flatnonzero(inner) + 1]
    following[following > last] = -1
    return Neighbours(previous, following, inner, duplicate)


def _closer(program: Program, one: Ints, other: Ints, axis_length: float, distance: float) -> Bools:
    step = program.tip[one] - program.tip[other]
    turn = axis_length * (program.axis[one] - program.axis[other])
    return (norm(step) <= distance) & (norm(step + turn) <= distance)
