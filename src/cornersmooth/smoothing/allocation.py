"""`allocation="fair"`: how neighbouring corners share the segment between them.

With half of a segment each, neighbours keep out of each other's way without knowing of one another. Here a corner that
needs less leaves the rest to its neighbour, and where both want more than there is they share it so that both can be
passed at the same speed: with the curvature 2·sin β/(L·cos² β) of a transition of length L (design 3.4), 2β the turn,
v² ~ L·cos² β/sin β.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Floats, Ints

#: share of a segment that a corner may take where nobody wants the other end
_ALONE = 0.9

#: least share of a segment for a corner that wants it
_FLOOR = 0.25

#: rounds of handing on what is left over; what a fourth would change is below 1e-6 of a length
_ROUNDS = 3

#: relative size of what is only arithmetic
_EXACT = 1e-14

#: smallest sin² β and cos² β told from zero
_FLAT = 1e-12


def fair_room(pose: Ints, after: Ints, length_in: Floats, length_out: Floats, wanted: Floats, cosine: Floats) -> Floats:
    """Transition lengths such that neighbours never overlap.

    Parameters
    ----------
    pose, after : (k,) int64
        Poses of the corners in path order, and the distinct poses behind them.
    length_in, length_out : (k,) float64, mm
        Six-dimensional lengths of the segments before and after each corner.
    wanted : (k,) float64, mm
        Lengths that the tolerance allows; 0 for corners that stay sharp.
    cosine : (k,) float64
        Cosines of the six-dimensional turns.

    Returns
    -------
    (k,) float64, mm
        Room of each corner; 0 where `wanted` is 0. The rooms of two corners on one segment sum to at most its length.
    """
    rows = np.flatnonzero(wanted > 0.0)
    if not len(rows):
        return np.zeros(len(pose))
    wanted = wanted[rows]
    # corner i and corner i + 1 share a segment, or each has a sharp end on the other side
    shared = after[rows[:-1]] == pose[rows[1:]]
    joined = np.concatenate(([False], shared, [False]))
    segment_in = np.where(joined[:-1], length_in[rows], _ALONE * length_in[rows])
    segment_out = np.where(joined[1:], length_out[rows], _ALONE * length_out[rows])
    wanted = np.minimum(wanted, np.minimum(segment_in, segment_out))

    room = np.minimum(wanted, _by_speed(segment_in, segment_out, wanted, cosine[rows], joined))
    left, right = joined[:-1], joined[1:]
    for _ in range(_ROUNDS):
        before = np.concatenate(([0.0], room[:-1]))
        behind = np.concatenate((room[1:], [0.0]))
        free_in = np.maximum(segment_in - room - np.where(left, before, 0.0), 0.0)
        free_out = np.maximum(segment_out - room - np.where(right, behind, 0.0), 0.0)
        more = wanted - room
        # how far a corner would go if the neighbour on one side had no use for what is left there
        claim_in, claim_out = np.minimum(more, free_out), np.minimum(more, free_in)
        theirs_in = np.where(left, np.concatenate(([0.0], claim_out[:-1])), 0.0)
        theirs_out = np.where(right, np.concatenate((claim_in[1:], [0.0])), 0.0)
        room = room + np.minimum(
            more, np.minimum(_portion(free_in, claim_in, theirs_in), _portion(free_out, claim_out, theirs_out))
        )
    room = np.where(room >= wanted * (1.0 - _EXACT), wanted, room)
    everywhere = np.zeros(len(pose))
    everywhere[rows] = room
    return everywhere


def _by_speed(
    segment_in: Floats, segment_out: Floats, wanted: Floats, cosine: Floats, joined: NDArray[np.bool_]
) -> Floats:
    """Lengths that let the corners at both ends of every segment be passed at one speed."""
    half_cosine = 0.5 + 0.5 * cosine  # cos² β
    need = np.sqrt(np.maximum(0.5 - 0.5 * cosine, _FLAT)) / np.maximum(half_cosine, _FLAT)
    segment = segment_out[:-1]
    share = np.clip(need[:-1] / (need[:-1] + need[1:]), _FLOOR, 1.0 - _FLOOR) * segment
    # a corner that wants less leaves the rest, but no corner gets more than it wants
    share = np.minimum(np.maximum(share, segment - wanted[1:]), wanted[:-1])
    inner = joined[1:-1]
    out = np.append(np.where(inner, share, segment), segment_out[-1])
    into = np.append(segment_in[0], np.where(inner, segment - share, segment_in[1:]))
    lengths: Floats = np.minimum(into, out)
    return lengths


def _portion(free: Floats, mine: Floats, theirs: Floats) -> Floats:
    """What is mine of what is free when both claim it: all that I claim, or a part in proportion to the claims."""
    both = mine + theirs
    crowded = both > free
    return np.where(crowded, free * mine / np.where(crowded, both, 1.0), mine)
