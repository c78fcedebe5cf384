"""How far a control may round the corners of lines by itself so that what it executes keeps ε.

LinuxCNC with G64 P slows down towards the end of a line and starts the next one meanwhile (tp.c, parabolic blends;
compared with its controller in docs/dev/linuxcnc.md): the line before has b₁·(1 − τ)² left while the next one has gone
b₂·τ², τ from 0 to 1. b₁ is at most half of its line, and at most 4·P/|Δt| for a difference Δt of the unit tangents of
the tip. b₂/b₁ is the ratio of the accelerations; b₂ is at most half of its line. P bounds the tip only, the axis point
is what this module looks after.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import norm, some_rows
from cornersmooth.model import Floats, Ints
from cornersmooth.smoothing.long_lines import LineLimits, Vertices

#: bends of corners are no smaller, so that no blend divided by one is too large a number
_LEAST_BEND = 1e-300

#: b₁ over P/|Δt|: 4, and what its controller was found to go beyond that
_REACH = 4.8

#: where a blend is looked at: where both lines are as far from the corner, 0, and before and after that, -1 and 1
_PLACES = (-0.6, -0.4, -0.2, 0.0, 0.2, 0.4, 0.6)

#: Degrees by which rotary axes may speed up while linear ones do by one mm: machines differ, the largest ratio counts.
_TURNS = (0.1, 0.4, 1.0)

#: least way of a line, so that nothing is divided by zero
_STANDING = 1e-9

#: blend tolerances go in steps of this ratio, so that few lines change them
_STEP = 1.1

#: part of what makes a difference that is as good as all of it
_NEARLY = 0.8

#: part of what a blend may be by proportion that is tried next
_SURELY = 0.95

#: rounds of making blends smaller; what still goes too far gets the smallest
_ROUNDS = 6

#: part of ε that is the least blend tolerance
_LEAST = 0.005


@dataclass(frozen=True)
class _Corners:
    """Vertices between two lines, v of them, and the lines before and after (v, 2, ...)."""

    tip: Floats
    words: Floats
    parameter: Floats
    way: Floats  # unit tangents of the tip
    turn: Floats  # change of words per mm
    rate: Floats  # change of the parameter per mm
    half: Floats  # half of the lengths, mm
    bend: Floats  # |Δt|
    quicker: Floats  # acceleration of the line after over that of the one before

    @classmethod
    def of(cls, rows: Vertices, kept: Ints) -> _Corners:
        tip, words, parameter = rows.tip[kept], rows.words[kept], rows.parameter[kept]
        step = np.diff(tip, axis=0)
        length = norm(step)
        per = np.where(length > 0.0, length, 1.0)
        way, turn, rate = step / per[:, None], np.diff(words, axis=0) / per[:, None], np.diff(parameter) / per
        most_way, most_turn = np.abs(way).max(axis=1), np.abs(turn).max(axis=1)
        slow = [np.maximum(np.maximum(most_way, most_turn / ratio), _STANDING) for ratio in _TURNS]
        quicker = np.max([of_lines[:-1] / of_lines[1:] for of_lines in slow], axis=0)

        way, turn, rate, half = (
            np.stack((values[:-1], values[1:]), axis=1) for values in (way, turn, rate, length / 2.0)
        )
        bend = norm(way[:, 1] - way[:, 0])
        return cls(tip[1:-1], words[1:-1], parameter[1:-1], way, turn, rate, half, bend, quicker)


def largest_blends(rows: Vertices, kept: Ints, limits: LineLimits, most: float, deviation: float) -> Floats:
    """Blend tolerances (k,), mm, with which what the control executes stays near the original motion.

    `kept` (k,) are the rows at which lines end, from `fewest_lines`; `most` is the largest tolerance, `deviation` what
    tip and axis point may be off meanwhile, mm. `LineLimits.blend` is that at both ends and where the tip stands still,
    and the most where a line ends in any case.
    """
    blends = np.full(len(kept), limits.blend)
    if len(kept) < 3:
        return blends
    corners = _Corners.of(rows, kept)
    moving = corners.half.min(axis=1) > 0.0
    enough = np.minimum(corners.half[:, 0] * corners.bend / _REACH, most)  # more makes no difference
    enough[~moving] = 0.0
    found = np.full(len(moving), most)
    open_rows = np.flatnonzero(moving)
    for _ in range(_ROUNDS):
        off = _deviation(rows, limits, some_rows(corners, open_rows), found[open_rows])
        far = off > deviation
        open_rows = open_rows[far]
        if not len(open_rows):
            break
        found[open_rows] = np.minimum(found[open_rows], enough[open_rows]) * (_SURELY * deviation / off[far])
    least = _LEAST * most
    found[open_rows] = least
    found = np.maximum(most * _STEP ** np.floor(np.log(np.maximum(found, least) / most) / np.log(_STEP) + 1e-9), least)
    found = np.where(moving, _carried(found, enough), limits.blend)
    blends[1:-1] = np.where(rows.fixed[kept[1:-1]], np.minimum(found, limits.blend), found)
    return blends


def _carried(blends: Floats, enough: Floats) -> Floats:
    """Blends of corners that lie further apart than needed are those of the corner before, if these are enough."""
    bound = blends < _NEARLY * enough
    last = np.maximum.accumulate(np.where(bound, np.arange(len(blends)), 0))
    before = blends[last]
    return np.where(~bound & bound[last] & (before >= _NEARLY * enough), np.minimum(before, blends), blends)


def _deviation(rows: Vertices, limits: LineLimits, corners: _Corners, blend: Floats) -> Floats:
    """(v,) largest distance of tip or axis point from the original at a common parameter, within blends."""
    bend = np.maximum(corners.bend, _LEAST_BEND)
    before = np.minimum(corners.half[:, 0], _REACH * blend / bend)
    behind = np.minimum(corners.half[:, 1], corners.quicker * before)
    largest = np.zeros(len(blend))
    middle = 1.0 / (1.0 + np.sqrt(behind / np.maximum(before, np.finfo(np.float64).tiny)))
    for place in _PLACES:
        part = middle + place * (middle if place < 0.0 else 1.0 - middle)
        left, gone = -before * (1.0 - part) ** 2, behind * part**2

        def at(place: Floats, per_mm: Floats, left: Floats = left, gone: Floats = gone) -> Floats:
            shape = (-1,) + (1,) * (place.ndim - 1)
            return place + left.reshape(shape) * per_mm[:, 0] + gone.reshape(shape) * per_mm[:, 1]

        tip = at(corners.tip, corners.way)
        axis_point = tip + limits.axis_length * limits.axis_of(at(corners.words, corners.turn))
        original_tip, original_axis_point = _original(rows, at(corners.parameter, corners.rate))
        largest = np.maximum(largest, norm(tip - original_tip))
        largest = np.maximum(largest, norm(axis_point - original_axis_point))
    return largest


def _original(rows: Vertices, parameter: Floats) -> tuple[Floats, Floats]:
    s = rows.parameter
    row = np.clip(np.searchsorted(s, parameter) - 1, 0, len(s) - 2)
    step = s[row + 1] - s[row]
    share = np.clip((parameter - s[row]) / np.where(step > 0.0, step, 1.0), 0.0, 1.0)[:, None]

    def between(values: Floats) -> Floats:
        return values[row] + share * (values[row + 1] - values[row])

    return between(rows.original_tip), between(rows.original_axis_point)
