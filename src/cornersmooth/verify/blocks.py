"""A block of the two motions with its correspondence: what all measurements start from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.careful import assign, doubtful_windows
from cornersmooth.verify.ncprogram import NcProgram
from cornersmooth.verify.stops import Stretches
from cornersmooth.verify.trails import CHORD_SHARE, Original, Written, written_motion
from cornersmooth.verify.walking import Lanes, Track, cut_lane, walk

#: path elements in a block
BLOCK = 1 << 17

#: written vertices between anchors
LANE = 300

#: blocks are cut at anchors that are no nearer to the ends of their original segment than this part of it: there is no
#: doubt then in which of two blocks an original vertex belongs
_INNER = 0.2

#: last printed digits by which the next segment must be nearer to be taken
MARGIN_STEPS = 4.0

#: parts of blocks beyond which nothing is looked for
MOST_PARTS = 16

Lane = tuple[int, int, int, int, float]


@dataclass(frozen=True)
class Block:
    """Part of the written motion and where its vertices are on the original.

    Parameters
    ----------
    written : Written
    six : (v, 6) float64
        Its vertices: tip and axis point.
    on : (v,) bool
        Whether a vertex belongs to a stretch of feed moves.
    piece : (v,) int64
        Number of the stretch in this block.
    segment : (v,) int64
        Segment of the original trail.
    fraction : (v,) float64
        On that segment.
    backward : (v,) bool
    distance : (v,) float64, mm
        See `walking.walk`.
    low, high : (v,) int64
        First and last original segment of the stretch a vertex belongs to.
    until : float
        Where on the original trail the next block goes on with the last stretch; inf where that ends in this block.
    """

    written: Written
    six: Floats
    on: Bools
    piece: Ints
    segment: Ints
    fraction: Floats
    backward: Bools
    distance: Floats
    low: Ints
    high: Ints
    until: float

    @cached_property
    def place(self) -> Floats:
        """(v,) segment plus fraction, where `on`."""
        where: Floats = self.segment + self.fraction
        return where


@dataclass(frozen=True)
class Cut:
    """Part of the written motion, cut in lanes that can be walked on their own.

    Parameters
    ----------
    written : Written
    six : (v, 6) float64
    lanes : Lanes
    spans : list of (first, last, start, stop)
        Vertices of each stretch, first original segment and last one plus one.
    until : float
        See `Block`.
    """

    written: Written
    six: Floats
    lanes: Lanes
    spans: list[tuple[int, int, int, int]]
    until: float


@dataclass(frozen=True)
class Matcher:
    """The two motions and the lengths that decide what counts as near.

    Parameters
    ----------
    original : Original
    nc : NcProgram
    track : Track
        Of the original trail.
    tolerance, axis_length : float, mm
    """

    original: Original
    nc: NcProgram
    track: Track
    tolerance: float
    axis_length: float

    @property
    def margin(self) -> float:
        """Distance that printed digits may account for, mm."""
        axis_step = self.nc.second_step * (self.axis_length if self.nc.second_is == "vector" else 1.0)
        return MARGIN_STEPS * max(self.nc.tip_step, axis_step)

    @property
    def slack(self) -> float:
        """Distance by which places on the trails may be wrong, mm: more than `margin` where they cut curves short."""
        bare = len(self.original.trail) == len(self.original.pose) and not len(self.nc.curves) and not len(self.nc.arcs)
        return self.margin if bare else self.margin + 2 * CHORD_SHARE * self.tolerance

    @cached_property
    def parts(self) -> int:
        """Elements that blocks have become at most, up to `MOST_PARTS`: more than one in rotary words only."""
        edges = np.flatnonzero(np.append(np.diff(self.nc.line) != 0, True))
        return min(int(np.diff(edges, prepend=-1).max(initial=1)), MOST_PARTS)

    @property
    def near(self) -> float:
        """Distance within which a written vertex is taken to be on its way, mm."""
        return 2.0 * self.tolerance + self.margin

    def blocks(self, stretches: Stretches) -> Iterator[Block]:
        """Give out all stretches, in blocks of about `BLOCK` elements, each vertex with its place."""
        return map(self.walked, self.cuts(stretches))

    def cuts(self, stretches: Stretches) -> Iterator[Cut]:
        """Give out all stretches, in parts of about `BLOCK` elements."""
        last_vertex = self.original.trail.last
        pending: list[tuple[int, int, int, int, float]] = []
        columns = (
            stretches.move_first,
            stretches.move_last,
            stretches.element_first,
            stretches.element_last,
            stretches.fraction,
        )
        for move_first, move_last, first, last, share in zip(*(column.tolist() for column in columns), strict=True):
            if move_first == move_last or first == last:
                continue
            start, stop = int(last_vertex[move_first]), int(last_vertex[move_last])
            along = share * (last_vertex[move_first + 1] - start)  # in vertices; the walker finds the rest
            start, fraction = start + int(along), float(along - int(along))
            if start == stop:
                start, fraction = stop - 1, 1.0
            while True:
                if pending and last - pending[0][0] > BLOCK:
                    done, _ = self._cut(pending, open_end=False)
                    pending = []
                    yield done
                if last - first <= BLOCK + BLOCK // 2:
                    pending.append((first, last, start, stop, fraction))
                    break
                done, rest = self._cut([(first, first + BLOCK, start, stop, fraction)], open_end=True)
                yield done
                first, start, fraction = rest
        if pending:
            done, _ = self._cut(pending, open_end=False)
            yield done

    def _cut(
        self, pieces: list[tuple[int, int, int, int, float]], *, open_end: bool
    ) -> tuple[Cut, tuple[int, int, float]]:
        """Make one part; with an open end only up to the last anchor, and say where the rest begins."""
        first, last = pieces[0][0], pieces[-1][1]
        written = written_motion(self.nc, first, last, self.tolerance, self.axis_length)
        six = written.trail.six(self.axis_length)
        difference = six[1:] - six[:-1]
        length = np.concatenate(([0.0], np.cumsum(np.sqrt(np.einsum("ij,ij->i", difference, difference)))))
        ends = written.trail.last
        lanes: list[Lane] = []
        spans = []
        rest: tuple[int, int, float] | None = None
        for piece in pieces:
            lane = (int(ends[piece[0] - first]), int(ends[piece[1] - first]), piece[2], piece[3], piece[4])
            cut = [lane]
            if lane[1] - lane[0] > 2 * LANE:
                cut = cut_lane(six, length, self.track, lane, LANE, self.near, ends if open_end else None)
            if open_end and len(cut) > 1:
                while len(cut) > 2 and not _INNER <= cut[-1][-1] <= 1 - _INNER:
                    cut.pop()
                vertex, _, start, _, fraction = cut.pop()
                rest = int(written.trail.owner[vertex]), start, fraction
            lanes += cut
            spans.append((lane[0], cut[-1][1], lane[2], cut[-1][3]))
        table = Lanes(*(np.array(column) for column in zip(*lanes, strict=True)))
        done = Cut(written, six, table, spans, rest[1] + rest[2] if rest else np.inf)
        if rest is None and open_end:  # no anchor: only the walk tells where the rest begins
            block, tail = self.walked(done), spans[-1][1]
            rest = int(written.trail.owner[tail]), int(block.segment[tail]), float(block.fraction[tail])
            done = replace(done, until=rest[1] + rest[2])
        return done, rest or (last, 0, 0.0)

    def walked(self, cut: Cut) -> Block:
        """Assign a place on the original to every vertex of a part."""
        six, spans = cut.six, cut.spans
        segment, fraction, backward, distance = walk(six, self.track, cut.lanes, self.margin, self.near)
        on = fraction >= 0
        number = np.full(len(six), -1, np.int64)
        low, high = np.zeros(len(six), np.int64), np.zeros(len(six), np.int64)
        if len(spans) == 1:
            a, b, start, stop = spans[0]
            number[a : b + 1], low[a : b + 1], high[a : b + 1] = 0, start, stop - 1
        else:
            firsts, lasts, starts, stops = np.array(spans).T
            size = lasts - firsts + 1
            index = np.repeat(np.arange(len(spans)), size)
            vertex = np.repeat(firsts - np.cumsum(size) + size, size) + np.arange(len(index))
            number[vertex], low[vertex], high[vertex] = index, starts[index], stops[index] - 1
        self._look_again(six, number, segment, fraction, backward, distance)
        return Block(cut.written, six, on, number, segment, fraction, backward, distance, low, high, cut.until)

    def _look_again(
        self, six: Floats, piece: Ints, segment: Ints, fraction: Floats, backward: Bools, distance: Floats
    ) -> None:
        """Assign anew, and with more care, what the walker has found too far away or in the wrong order."""
        known = np.isfinite(distance)
        doubtful = backward | (known & (distance > np.sqrt(2) * self.tolerance + self.margin))
        for first, last in doubtful_windows(doubtful & (piece >= 0), piece):
            part = slice(first, last + 1)
            start, stop = (float(segment[k] + fraction[k]) for k in (first, last))
            found = assign(six[part], self.track, start, stop, self.tolerance)
            if found is None:
                continue
            row = self.track.row[found[0]]
            away = six[part] - row[:, :6] - found[1][:, None] * row[:, 6:12]
            off = np.sqrt(np.einsum("ij,ij->i", away, away))
            if off[1:].max() <= distance[first + 1 : last + 1].max():
                segment[part], fraction[part] = found[0], found[1]
                distance[first + 1 : last + 1] = off[1:]
                length = self.track.length[found[0] + 1] - self.track.length[found[0]]
                behind = np.einsum("ij,ij->i", six[part] - row[:, :6], row[:, 6:12]) * row[:, 12]
                backward[part] = found[2] & ((found[1] - np.clip(behind, 0.0, 1.0)) * length > self.margin)
