"""Rows of the smoothed motion as NC blocks, with the statements in their places.

Whole blocks of rows at a time: ticks (the one rounding), words by table, one join. Python runs per statement and per
block of rows, never per row.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, FeedMode, Floats, Ints, Move, Program, Statement
from cornersmooth.nc.control import Form
from cornersmooth.nc.statements import StatementWriter
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.text import RowFormat, format_number, to_ticks

_FEED_MODE_BLOCK = {FeedMode.PER_MINUTE: b"G94\n", FeedMode.PER_REVOLUTION: b"G95\n"}

#: knot written with each of the five control points: u0 to u4; u5 to u8 have blocks of their own
_KNOT = (b"K0. ", b"K0. ", b"K0. ", b"K0. ", b"K0.5 ")
_LAST_KNOTS = b"K1.\n" * 4


@dataclass
class MotionWriter:
    """Writes rows in order and remembers what a control remembers: position, feed, feed mode.

    Parameters
    ----------
    form : Form
    program : Program
    statements : StatementWriter
    """

    form: Form
    program: Program
    statements: StatementWriter
    blocks: int = 0
    repeated: int = 0
    without_feed: int = 0
    without_feed_line: int = 0
    _position: NDArray[np.int64] | None = None
    _feed: int = -1  # ticks and feed mode of the last F, as one number
    _mode: int = FeedMode.PER_MINUTE
    _next_statement: int = 0
    _format: RowFormat = field(init=False)

    def __post_init__(self) -> None:
        words = (*self.form.coordinate_words, *self.form.other_words)
        self._format = RowFormat(
            words=tuple(word if i == 0 else b" " + word for i, word in enumerate(words)),
            decimals=self.form.decimals(self.program.units),
        )

    def write(self, rows: Rows) -> Iterator[bytes]:
        """Text of a block of rows and of the statements that stand before and between them."""
        moves = rows.move
        waiting = self._statements_until(int(moves[-1])) if len(moves) else []
        start = 0
        for statement in waiting:
            stop = int(np.searchsorted(moves, statement.pose))
            if stop > start:
                yield from self._lines(rows, start, stop)
                start = stop
            yield from self._say(statement)
        yield from self._lines(rows, start, len(moves))

    def finish(self) -> Iterator[bytes]:
        """Text of the statements behind the last row."""
        for statement in self.program.statements[self._next_statement :]:
            yield from self._say(statement)
        self._next_statement = len(self.program.statements)

    def _statements_until(self, pose: int) -> Sequence[Statement]:
        begin = self._next_statement
        statements = self.program.statements
        while self._next_statement < len(statements) and statements[self._next_statement].pose <= pose:
            self._next_statement += 1
        return statements[begin : self._next_statement]

    def _say(self, statement: Statement) -> Iterator[bytes]:
        tool = self.statements.tool
        text = self.statements.blocks(statement)
        if self.statements.tool != tool:
            self._position = None  # a tool change leaves the machine elsewhere
        self.blocks += len(text)
        if text:
            yield ("\n".join(text) + "\n").encode("ascii")

    def _lines(self, rows: Rows, start: int, stop: int) -> Iterator[bytes]:
        if start >= stop:
            return
        for block in self.statements.begin_motion():
            self.blocks += 1
            yield block.encode("ascii") + b"\n"
        part = slice(start, stop)
        move, curve = rows.move[part], rows.curve[part]
        ticks = self._ticks(rows.tip[part], rows.other[part])
        self._join(ticks, rows.joined[part])
        kept = self._new_positions(ticks) | (curve > 0)
        self.repeated += int(np.count_nonzero(~kept))
        self._position = ticks[-1]
        if not kept.all():
            ticks, move, curve = ticks[kept], move[kept], curve[kept]
        if not len(ticks):
            return
        weights = rows.weights[part][kept] if rows.weights is not None else None
        prefix, prefix_id, extra = self._prefixes(move, curve)
        suffix, suffix_id = self._suffixes(move, curve, weights)
        text, _ = self._format.rows(ticks, prefix, prefix_id, suffix, suffix_id)
        self.blocks += len(ticks) + extra + 4 * int(np.count_nonzero(curve == 5))
        yield text

    def _ticks(self, tip: Floats, other: Floats) -> Ints:
        unit = self.program.mm_per_unit
        numbers = np.concatenate((tip, other), axis=1)
        if unit != 1.0:
            numbers[:, : 3 if self.form.vectors else 6] /= unit
        ticks: Ints = to_ticks(numbers, self._format.decimals)
        return ticks

    def _join(self, ticks: Ints, joined: Bools) -> None:
        """Give first control points that follow without a line the digits of the row before."""
        places = np.flatnonzero(joined)
        if not len(places):
            return
        if places[0] == 0:
            if self._position is not None:
                ticks[0] = self._position
            places = places[1:]
        ticks[places] = ticks[places - 1]

    def _new_positions(self, ticks: Ints) -> Bools:
        new = np.ones(len(ticks), np.bool_)
        new[1:] = (ticks[1:] != ticks[:-1]).any(axis=1)
        if self._position is not None:
            new[0] = bool((ticks[0] != self._position).any())
        return new

    def _positioning(self, move: Ints) -> Bools:
        """Rows reached by rapid: rapids, and the positions of holes."""
        kind = self.program.kind[move]
        rapid: Bools = (kind == Move.RAPID) | (kind == Move.HOLE)
        return rapid

    def _prefixes(self, move: Ints, curve: NDArray[np.int8]) -> tuple[list[bytes], Ints, int]:
        """Table of what stands before the numbers, an entry for each row, and the blocks hidden in the prefixes."""
        rapid = self._positioning(move)
        table = [b"G1 ", b"G0 ", b"G6.2 P4 " + _KNOT[0], *_KNOT[1:]]
        chosen = np.where(curve > 0, curve + 1, rapid).astype(np.int64)
        extra = 0
        feeding = np.flatnonzero(~rapid)
        modes = self.program.feed_mode[move[feeding]].astype(np.int64)
        for place in np.flatnonzero(np.diff(modes, prepend=self._mode)).tolist():
            self._mode = FeedMode(int(modes[place]))
            row = feeding[place]
            table.append(_FEED_MODE_BLOCK[self._mode] + table[chosen[row]])
            chosen[row] = len(table) - 1
            extra += 1
        return table, chosen, extra

    def _suffixes(self, move: Ints, curve: NDArray[np.int8], weights: Floats | None) -> tuple[list[bytes], Ints]:
        """Table of what stands behind the numbers, feed or weight, and an entry for each row."""
        table = [b"\n"]
        chosen = np.zeros(len(move), np.int64)
        feeding = np.flatnonzero(~self._positioning(move) & (curve == 0))
        if len(feeding):
            feed = self.program.feed[move[feeding]]
            missing = np.isnan(feed)
            if missing.any():
                self._count_missing(move[feeding[missing]])
            unit = np.where(missing, 0.0, feed) / self.program.mm_per_unit
            ticks = to_ticks(unit, self.form.feed_decimals)[~missing]
            given = feeding[~missing]
            # F is given again with its unit: the same number per minute and per revolution is not the same feed
            keys = 2 * ticks + self.program.feed_mode[move[given]]
            changed = np.flatnonzero(np.diff(keys, prepend=self._feed))
            if len(changed):
                values, which = np.unique(ticks[changed], return_inverse=True)
                scale = 10.0**self.form.feed_decimals
                table += [
                    b" F" + format_number(value / scale, self.form.feed_decimals, trim=True).encode() + b"\n"
                    for value in values.tolist()
                ]
                chosen[given[changed]] = 1 + which.reshape(-1)
                self._feed = int(keys[-1])
        if weights is not None and (curve > 0).any():
            self._add_weights(table, chosen, curve, weights)
        return table, chosen

    def _count_missing(self, moves: Ints) -> None:
        if not self.without_feed:
            self.without_feed_line = int(self.program.line[moves[0]])
        self.without_feed += len(moves)

    def _add_weights(self, table: list[bytes], chosen: Ints, curve: NDArray[np.int8], weights: Floats) -> None:
        column = np.array([0, -1, 0, 1, 0, -1])[curve]
        on_curve = curve > 0
        number = np.where(column < 0, 1.0, weights[np.arange(len(curve)), np.maximum(column, 0)])
        values, which = np.unique(number[on_curve], return_inverse=True)
        ends = [b" R" + format_number(value, 3, trim=True).encode() + b"\n" for value in values.tolist()]
        base = len(table)
        table += ends
        table += [end + _LAST_KNOTS for end in ends]
        chosen[on_curve] = base + which.reshape(-1) + np.where(curve[on_curve] == 5, len(ends), 0)
