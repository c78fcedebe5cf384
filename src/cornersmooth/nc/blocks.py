"""Runs of rows as text: the words of every block, many rows at a time.

Ticks are the one rounding; words come from tables. Python runs per change of state and per run of circular blocks,
never per row.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, FeedMode, Floats, Ints, Program
from cornersmooth.nc.circles import Circles
from cornersmooth.nc.control import Form
from cornersmooth.nc.notes import Notes
from cornersmooth.nc.statements import StatementWriter
from cornersmooth.text import RowFormat, format_number, to_ticks

#: knot written with each of the five control points: u0 to u4; u5 to u8 have blocks of their own
_KNOT = (b"K0. ", b"K0. ", b"K0. ", b"K0. ", b"K0.5 ")
_LAST_KNOTS = b"K1.\n" * 4


@dataclass(frozen=True)
class Run:
    """Rows that nothing interrupts, r of them: what each block says.

    Parameters
    ----------
    ticks : (r, 6) int64
        Numbers in steps of their last digit.
    move : (r,) int64
        Pose, for messages.
    rapid : (r,) bool
    feed : (r,) float64
        mm/min or mm/rev, NaN where there is none.
    mode : (r,) int64
        `FeedMode`.
    curve : (r,) int8
        As in `Rows`.
    weights : (r, 2) float64 or None
    arc : (r,) int64 or None
    dwell : (r,) bool or None
        Where the tool waits after the block.
    """

    ticks: Ints
    move: Ints
    rapid: Bools
    feed: Floats
    mode: Ints
    curve: NDArray[np.int8]
    weights: Floats | None = None
    arc: Ints | None = None
    dwell: Bools | None = None

    def __len__(self) -> int:
        return len(self.ticks)

    def only(self, chosen: Bools) -> Run:
        """Return the chosen rows."""
        columns: dict[str, Any] = {
            name: None if column is None else column[chosen] for name, column in vars(self).items()
        }
        return Run(**columns)


@dataclass
class BlockWriter:
    """Writes runs and remembers what a control remembers: feed, feed mode, plane.

    Parameters
    ----------
    form : Form
    program : Program
    statements : StatementWriter
        Knows the plane, which statements change too, and the words of the control.
    notes : Notes
    circles : Circles
        How arcs are written.
    """

    form: Form
    program: Program
    statements: StatementWriter
    notes: Notes
    circles: Circles
    blocks: int = 0
    _feed: int = -1  # ticks and feed mode of the last F, as one number
    _mode: int = FeedMode.PER_MINUTE
    _format: RowFormat = field(init=False)
    _arc_format: RowFormat = field(init=False)

    def __post_init__(self) -> None:
        words = (*self.form.coordinate_words, *self.form.other_words)
        decimals = self.form.decimals(self.program.units)
        self._format = RowFormat(
            words=tuple(word if i == 0 else b" " + word for i, word in enumerate(words)), decimals=decimals
        )
        self._arc_format = RowFormat(words=(*self._format.words[:3], b" R"), decimals=decimals[:3] + decimals[:1])

    def ticks(self, tip: Floats, other: Floats) -> Ints:
        """(r, 6) numbers of rows in steps of their last digit."""
        unit = self.program.mm_per_unit
        numbers = np.concatenate((tip, other), axis=1)
        if unit != 1.0:
            numbers[:, : 3 if self.form.vectors else 6] /= unit
        ticks: Ints = to_ticks(numbers, self._format.decimals)
        return ticks

    def text(self, run: Run, dwell: int = 0) -> bytes:
        """Text of a run that is not empty; `dwell` in milliseconds."""
        prefix, prefix_id, extra = self._prefixes(run)
        suffix, suffix_id = self._suffixes(run, dwell)
        self.blocks += len(run.ticks) + extra + 4 * int(np.count_nonzero(run.curve == 5))
        if run.arc is None or not (circular := run.arc >= 0).any():
            return self._format.rows(run.ticks, prefix, prefix_id, suffix, suffix_id)[0]
        straight = ~circular
        ticks = np.column_stack((run.ticks[circular, :3], self.circles.radius[run.arc[circular]]))
        return _interleave(
            circular,
            self._format.rows(run.ticks[straight], prefix, prefix_id[straight], suffix, suffix_id[straight]),
            self._arc_format.rows(ticks, prefix, prefix_id[circular], suffix, suffix_id[circular]),
        )

    def _prefixes(self, run: Run) -> tuple[list[bytes], Ints, int]:
        """Table of what stands before the numbers, an entry for each row, and the blocks hidden in the prefixes."""
        table = [b"G1 ", b"G0 ", b"G6.2 P4 " + _KNOT[0], *_KNOT[1:], b"G2 ", b"G3 "]
        chosen = np.where(run.curve > 0, run.curve + 1, run.rapid).astype(np.int64)
        before: dict[int, bytes] = {}  # blocks before some rows
        feeding = np.flatnonzero(~run.rapid)
        modes = run.mode[feeding]
        for place in np.flatnonzero(np.diff(modes, prepend=self._mode)).tolist():
            self._mode = int(modes[place])
            before[int(feeding[place])] = self.statements.words.feed_mode[FeedMode(self._mode)].encode() + b"\n"
        extra = len(before)
        if run.arc is not None:
            rows = np.flatnonzero(run.arc >= 0)
            arcs = run.arc[rows]
            chosen[rows] = np.where(self.circles.clockwise[arcs], len(table) - 2, len(table) - 1)
            planes = self.circles.plane[arcs]
            changes = np.flatnonzero(np.diff(planes, prepend=self.statements.plane)).tolist()
            for place in changes:
                block = self.statements.words.plane[int(planes[place])].encode() + b"\n"
                before[int(rows[place])] = before.get(int(rows[place]), b"") + block
            if len(planes):
                self.statements.plane = int(planes[-1])
            extra += len(changes)
        entries: dict[bytes, int] = {}
        for row, blocks in before.items():
            text = blocks + table[chosen[row]]
            entry = entries.setdefault(text, len(table))
            if entry == len(table):
                table.append(text)
            chosen[row] = entry
        return table, chosen, extra

    def _suffixes(self, run: Run, dwell: int) -> tuple[list[bytes], Ints]:
        """Table of what stands behind the numbers, feed or weight, and an entry for each row."""
        table = [b"\n"]
        chosen = np.zeros(len(run.move), np.int64)
        feeding = np.flatnonzero(~run.rapid & (run.curve == 0))
        if len(feeding):
            feed = run.feed[feeding]
            missing = np.isnan(feed)
            if missing.any():
                self._count_missing(run.move[feeding[missing]])
            unit = np.where(missing, 0.0, feed) / self.program.mm_per_unit
            ticks = to_ticks(unit, self.form.feed_decimals)[~missing]
            given = feeding[~missing]
            # F is given again with its unit: the same number per minute and per revolution is not the same feed
            keys = 2 * ticks + run.mode[given]
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
        if run.weights is not None and (run.curve > 0).any():
            _add_weights(table, chosen, run.curve, run.weights)
        if run.dwell is not None and run.dwell.any():
            wait = "".join(block + "\n" for block in self.statements.dwell(dwell)).encode()
            chosen[run.dwell] += len(table)
            table += [end + wait for end in table]
            self.blocks += int(np.count_nonzero(run.dwell))
        return table, chosen

    def _count_missing(self, moves: Ints) -> None:
        text = "feed move without a feed in the CL file; most controls stop with an alarm, give one with --feed"
        self.notes.add("CS311", "warning", int(self.program.line[moves[0]]), text, len(moves))


def _add_weights(table: list[bytes], chosen: Ints, curve: NDArray[np.int8], weights: Floats) -> None:
    column = np.array([0, -1, 0, 1, 0, -1])[curve]
    on_curve = curve > 0
    number = np.where(column < 0, 1.0, weights[np.arange(len(curve)), np.maximum(column, 0)])
    values, which = np.unique(number[on_curve], return_inverse=True)
    ends = [b" R" + format_number(value, 3, trim=True).encode() + b"\n" for value in values.tolist()]
    base = len(table)
    table += ends
    table += [end + _LAST_KNOTS for end in ends]
    chosen[on_curve] = base + which.reshape(-1) + np.where(curve[on_curve] == 5, len(ends), 0)


def _interleave(second: Bools, *texts: tuple[bytes, Ints]) -> bytes:
    """Put two texts of rows together; `second` says for each row which of them it is in."""
    edges = [0, *(1 + np.flatnonzero(second[1:] != second[:-1])).tolist(), len(second)]
    at = [0, 0]
    pieces = []
    for first, last in pairwise(edges):
        which = int(second[first])
        text, offsets = texts[which]
        stop = at[which] + last - first
        pieces.append(text[offsets[at[which]] : offsets[stop]])
        at[which] = stop
    return b"".join(pieces)
