"""Runs of motion blocks, executed by arrays: as `State.execute` does with one, for all of them at once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cornersmooth.control.state import MOTIONS, VECTOR, State
from cornersmooth.control.words import filled
from cornersmooth.model import Bools, Floats

#: what stands for motions in a column; NaN stands for all others
_CODES: Final = {"rapid": 0.0, "line": 1.0, "arc": 2.0}


@dataclass(frozen=True)
class Rows:
    """r motion blocks that follow one another, with c axes (`State.axes`)."""

    first: int  #: line of the first, from 0; they are on neighbouring lines
    before: State
    code: Floats  #: (r,) 0 rapid, 1 line, 2 and 3 arcs; others are motions that are not known
    place: Floats  #: (r + 1, c) words before the first and after each, NaN where not known
    feed: Floats  #: (r,) as written, NaN where not known
    moves: Bools  #: (r,) whether an axis is named
    odd: Bools  #: (r,) whether it has other words than places, as arcs have
    lost: Bools  #: (r,) whether it leads to a place that is not known

    def __len__(self) -> int:
        return len(self.code)

    def after(self, count: int) -> State:
        """Return the state after so many blocks."""
        if count == 0:
            return self.before.copy()
        place = dict(zip(self.before.axes, self.place[count].tolist(), strict=True))
        groups = self.before.groups | {"motion": MOTIONS.get(float(self.code[count - 1]))}
        return replace(self.before, groups=groups, place=place, feed=float(self.feed[count - 1]))


def execute_rows(state: State, first: int, columns: Mapping[str, Floats], *, weak_feed: bool = False) -> Rows:
    """Execute motion blocks; `columns` as `nc_reader` has them, NaN where a block has no such word.

    `weak_feed` says that the control may count feeds of these blocks in another unit.
    """
    count = len(next(iter(columns.values())))
    blank = np.full(count, np.nan)
    code, _ = filled(columns.get("G", blank), _CODES.get(state.groups["motion"] or "", np.nan))
    feed, _ = filled(columns.get("F", blank), state.feed)
    if state.groups["feed"] == "inverse":
        feed = columns.get("F", blank)
    elif weak_feed:
        feed = blank
    arc = (code == 2.0) | (code == 3.0)
    odd = np.zeros(count, np.bool_)
    for name in columns.keys() - {"G", "F", *state.axes}:
        odd |= ~np.isnan(columns[name])
    named = [~np.isnan(columns.get(letter, blank)) for letter in state.axes]
    lost = (odd & ~arc) | (~(arc | (code == 0.0) | (code == 1.0)) & np.any(named, axis=0))
    if {*state.axes} >= VECTOR:  # what missing words of a vector are is not known
        given = np.sum([~np.isnan(columns.get(letter, blank)) for letter in sorted(VECTOR)], axis=0)
        lost |= ~arc & (given > 0) & (given < len(VECTOR))
    place, moves = np.empty((count + 1, len(state.axes))), np.zeros(count, np.bool_)
    for k, letter in enumerate(state.axes):
        words = columns.get(letter, blank)
        words = np.where(arc, np.nan, words) if letter in VECTOR else words
        moves |= ~np.isnan(words)
        place[0, k] = state.place[letter]
        place[1:, k] = _places(words, state, letter, lost)
    return Rows(first, state, code, place, feed, moves, odd, lost)


def _places(words: Floats, state: State, letter: str, lost: Bools) -> Floats:
    """(r,) where an axis is after each block."""
    distance = state.groups["distance"]
    if distance is None:
        lost = lost | ~np.isnan(words)
    if distance == "incremental" and letter not in VECTOR:
        known = np.where(np.logical_or.accumulate(lost), np.nan, 0.0)
        return state.place[letter] + np.cumsum(np.nan_to_num(words)) + known
    value, last = filled(np.where(lost, np.nan, words), state.place[letter])
    gone = np.maximum.accumulate(np.where(lost, np.arange(len(words)), -1))
    return np.where((gone >= 0) & (gone >= last), np.nan, value)
