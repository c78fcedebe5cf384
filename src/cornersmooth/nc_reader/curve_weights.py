"""Weights of control points that no curve of a text has."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.nc_reader.words import Table

#: how far a weight may be from one that is asked for: half of the last decimal that controls keep
_ROOM: Final = 5e-4

#: addresses; R of an arc is its radius
_WORDS: Final = ("PW", "R")

#: weights given out of one run of blocks
_MOST: Final = 100


def odd_weights(table: Table, weights: Floats) -> Iterator[tuple[int, float]]:
    """Line and value of weights in a run of motion blocks that are none of those (w,) that its curves may have."""
    codes = table.column("G")
    for name in _WORDS:
        if name not in table.columns:
            continue
        column = table.columns[name]
        off = ~np.isnan(column)
        for weight in weights.tolist():
            off &= np.abs(column - weight) > _ROOM
        rows = np.flatnonzero(off)
        rows = rows[~np.isin(codes[rows], (2.0, 3.0))]
        yield from ((int(table.line[row]), float(column[row])) for row in rows[:_MOST].tolist())
