"""A block of the two motions with its correspondence: what all measurements start from."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.anchors import cut_finely, cut_lane, find_anchor
from cornersmooth.verify.careful import ROUNDS, assign, doubtful_windows
from cornersmooth.verify.gliding import glide
from cornersmooth.verify.ncprogram import NcProgram
from cornersmooth.verify.stops import ARITHMETIC, Stretches
from cornersmooth.verify.trails import CHORD_SHARE, Original, Written, directions, written_motion
from cornersmooth.verify.walking import Lane, Lanes, Track, Walked, nowhere, walk

#: path elements in a block
BLOCK = 1 << 16

#: written vertices between anchors
LANE = 300

#: blocks are cut at anchors that are no nearer to the ends of their original segment than this part of it: there is no
#: doubt then in which of two blocks an original vertex belongs
_INNER = 0.2

#: path elements between the anchors that lead to where a block is cut
_HOP = 1 << 12

#: elements between those tried for an anchor behind a given one
_STRIDE = 3

#: last printed digits by which the next segment must be nearer to be taken
MARGIN_STEPS = 4.0

#: parts of blocks beyond which nothing is looked for
MOST_PARTS = 16


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
    nearest : bool
        Whether no segment next to that of a vertex is nearer.
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
    nearest: bool
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
    """Part of the written motion that can be looked at on its own.

    Parameters
    ----------
    pieces : list of (first, last, start, stop, fraction)
        Elements of each stretch, at the end of which it begins and ends; the original segment and the fraction of it
        where it begins, and the last segment plus one.
    until : float
        See `Block`.
    block : Block, optional
        Where it had to be made at once.
    """

    pieces: list[Lane]
    until: float = np.inf
    block: Block | None = None


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
        if bare and not self.nc.rotary:
            return self.margin
        # rotary words may let the tool swing by as much
        return self.margin + 2 * CHORD_SHARE * self.tolerance

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

    def cuts(self, stretches: Stretches, until: float = np.inf) -> Iterator[Cut]:
        """Give out all stretches, in parts of about `BLOCK` elements; see `Block.until` for the end of the last."""
        pending: list[Lane] = []
        for first, last, start, stop, fraction in self.pieces(stretches):
            while True:
                if pending and last - pending[0][0] > BLOCK:
                    yield Cut(pending)
                    pending = []
                if last - first <= BLOCK + BLOCK // 2:
                    pending.append((first, last, start, stop, fraction))
                    break
                done, (first, start, fraction) = self._begin((first, first + BLOCK, start, stop, fraction))
                yield done
        if pending:
            yield Cut(pending, until)

    def pieces(self, stretches: Stretches) -> Iterator[Lane]:
        """Give out the stretches in which both motions move, with vertices of the original."""
        last_vertex = self.original.trail.last
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
            yield first, last, start, stop, fraction

    def _begin(self, piece: Lane) -> tuple[Cut, tuple[int, int, float]]:
        """Cut off the beginning of a stretch, at an anchor if there is one, and say where the rest begins."""
        first, last, start, stop, fraction = piece
        six = ends(self.nc, first, last, self.axis_length)
        lanes = cut_lane(six, lengths(six), self.track, (0, last - first, start, stop, fraction), _HOP, self.near)
        while len(lanes) > 2 and not _INNER <= lanes[-1][-1] <= 1 - _INNER:
            lanes.pop()
        if len(lanes) > 1:
            end, _, segment, _, at = lanes[-1]
            return Cut([(first, first + end, start, segment + 1, fraction)], segment + at), (first + end, segment, at)
        block = self._match([piece], np.nan)  # only the walk tells where the rest begins
        tail = block.written.trail.last[-1]
        segment, at = int(block.segment[tail]), float(block.fraction[tail])
        return Cut([piece], segment + at, replace(block, until=segment + at)), (last, segment, at)

    def anchor(self, piece: Lane, wanted: int) -> tuple[int, int, float] | None:
        """Find an anchor on a stretch, at the end of element `wanted` or soon behind: element, segment, fraction."""
        first, last, start, stop, fraction = piece
        six = ends(self.nc, first, last, self.axis_length)
        length = lengths(six)
        begin, _, segment, _, at = cut_lane(
            six, length, self.track, (0, wanted - first, start, stop, fraction), _HOP, self.near
        )[-1]
        for vertex in range(max(wanted - first, begin + 1), len(six), _STRIDE):
            found = find_anchor(six[vertex], length[vertex] - length[begin], self.track, segment, at, stop, self.near)
            if found is not None and _INNER <= found[1] <= 1 - _INNER:
                return first + vertex, *found
        return None

    def walked(self, cut: Cut) -> Block:
        """Assign a place on the original to every vertex of a part."""
        return cut.block or self._match(cut.pieces, cut.until)

    def _match(self, pieces: list[Lane], until: float) -> Block:
        first, last = pieces[0][0], pieces[-1][1]
        written = written_motion(self.nc, first, last, self.tolerance, self.axis_length)
        six = written.trail.six(self.axis_length)
        length = lengths(six)
        last_vertex = written.trail.last
        lanes = [
            (int(last_vertex[a - first]), int(last_vertex[b - first]), start, stop, at)
            for a, b, start, stop, at in pieces
        ]
        (segment, fraction, backward, distance), nearest = self._places(six, length, lanes, last_vertex)
        on = fraction >= 0
        number = np.full(len(six), -1, np.int64)
        low, high = np.zeros(len(six), np.int64), np.zeros(len(six), np.int64)
        if len(lanes) == 1:
            a, b, start, stop, _ = lanes[0]
            number[a : b + 1], low[a : b + 1], high[a : b + 1] = 0, start, stop - 1
        else:
            firsts, lasts, starts, stops = np.array([lane[:4] for lane in lanes]).T
            size = lasts - firsts + 1
            index = np.repeat(np.arange(len(lanes)), size)
            vertex = np.repeat(firsts - np.cumsum(size) + size, size) + np.arange(len(index))
            number[vertex], low[vertex], high[vertex] = index, starts[index], stops[index] - 1
        goal = np.where(np.append(number[1:] != number[:-1], np.isinf(until)), high + 1.0, np.nan)
        self._look_again(six, number, goal, segment, fraction, backward, distance)
        return Block(written, six, on, number, segment, fraction, backward, distance, nearest, low, high, until)

    def _places(self, six: Floats, length: Floats, lanes: list[Lane], candidates: Ints) -> tuple[Walked, bool]:
        """Place of every vertex of the lanes, as `walk` returns it, and whether it is nearest for all of them.

        Lanes in which not everything can be told at once are cut at anchors, for which there are candidates; and what
        is then still in doubt is walked.
        """
        found = nowhere(len(six))
        segment, fraction, _, distance = found
        for again in (False, True):
            if again:
                lanes = self._cut(six, length, lanes, candidates)
            table = Lanes.of(lanes)
            segment[table.first], fraction[table.first] = table.start, table.fraction
            vertex, *places, good = glide(six, length, self.track, table, self.doubtful)
            sure = np.repeat(good, table.last - table.first)
            own = vertex[sure]
            segment[own], fraction[own], distance[own] = (values[sure] for values in places)
            lanes = [lane for lane, well in zip(lanes, good.tolist(), strict=True) if not well]
            if not lanes:
                return found, True
        walked = walk(six, self.track, Lanes.of(lanes), self.margin, self.near)
        rest = vertex[~sure]
        for values, theirs in zip(found, walked, strict=True):
            values[rest] = theirs[rest]
        return found, False

    def _cut(self, six: Floats, length: Floats, lanes: list[Lane], candidates: Ints) -> list[Lane]:
        """Cut long lanes at anchors."""
        cut: list[Lane] = []
        for lane in lanes:
            if lane[1] - lane[0] > 2 * LANE:
                cut += cut_finely(six, length, self.track, lane, LANE, self.near, candidates)
            else:
                cut.append(lane)
        return cut

    @property
    def doubtful(self) -> float:
        """Distance of a vertex from its place, in six dimensions, from which on it is looked at with more care, mm."""
        return float(np.sqrt(2) * self.tolerance + self.margin)

    def _look_again(
        self,
        six: Floats,
        piece: Ints,
        goal: Floats,
        segment: Ints,
        fraction: Floats,
        backward: Bools,
        distance: Floats,
    ) -> None:
        """Assign anew, and with more care, what the walker has found too far away or in the wrong order.

        `goal` is where the last vertex of a stretch must be, NaN for all others.
        """
        known = np.isfinite(distance)
        for around, most_pairs, most_windows in ROUNDS:
            doubtful = (backward | (known & (distance > self.doubtful))) & (piece >= 0)
            # both together may be so far, but not one of them alone
            rows = np.flatnonzero(known & ~doubtful & (distance > self.tolerance + self.margin))
            away = self.track.away(six[rows], segment[rows], fraction[rows])
            square = np.maximum(
                np.einsum("ij,ij->i", away[:, :3], away[:, :3]), np.einsum("ij,ij->i", away[:, 3:], away[:, 3:])
            )
            doubtful[rows] = square > (self.tolerance + self.margin) ** 2
            windows = doubtful_windows(doubtful, piece, around, most_windows + 1)
            if around > ROUNDS[0][0] and len(windows) > most_windows:
                return  # no mishap of the walk: the text is off everywhere
            for first, last in windows[:most_windows]:
                part = slice(first, last + 1)
                start, stop = (float(segment[k] + fraction[k]) for k in (first, last))
                stop = stop if np.isnan(goal[last]) else float(goal[last])
                found = assign(six[part], self.track, start, stop, self.tolerance, most_pairs)
                if found is None:
                    continue
                row = self.track.row[found[0]]
                away = self.track.away(six[part], found[0], found[1])
                off = np.sqrt(np.einsum("ij,ij->i", away, away))
                begin, end = 1, len(off)
                if around > ROUNDS[0][0]:  # most of so wide a window has its place already
                    begin, end = self._moved(segment[part], fraction[part], found[0], found[1], doubtful[part])
                new, at = slice(begin, end), slice(first + begin, first + end)
                if end > begin and off[new].max() <= distance[at].max() + ARITHMETIC:  # no worse, not to the last bit
                    segment[at], fraction[at], distance[at] = found[0][new], found[1][new], off[new]
                    length = self.track.length[found[0] + 1] - self.track.length[found[0]]
                    behind = np.einsum("ij,ij->i", six[part] - row[:, :6], row[:, 6:12]) * row[:, 12]
                    backward[at] = (found[2] & ((found[1] - np.clip(behind, 0.0, 1.0)) * length > self.margin))[new]

    def _moved(
        self, segment: Ints, fraction: Floats, new_segment: Ints, new_fraction: Floats, doubtful: Bools
    ) -> tuple[int, int]:
        """First vertex of a window, and last plus one, that get another place with the doubtful ones; all in order."""
        old, new = self.track.way(segment, fraction), self.track.way(new_segment, new_fraction)
        rows = np.flatnonzero(doubtful[1:]) + 1
        if not len(rows):
            return 0, 0
        kept = np.flatnonzero(np.abs(new - old) <= self.margin)
        before, behind = kept[kept < rows[0]], kept[kept > rows[-1]]
        begin = int(before[-1]) + 1 if len(before) else 1
        end = int(behind[0]) if len(behind) else len(new)
        while begin > 1 and old[begin - 1] > new[begin]:
            begin -= 1
        while end < len(new) and new[end - 1] > old[end]:
            end += 1
        return begin, end


def ends(nc: NcProgram, first: int, last: int, axis_length: float) -> Floats:
    """(k, 6) tips and axis points at the ends of elements, both included."""
    part = slice(first, last + 1)
    tip = nc.tip[part]
    return np.hstack((tip, tip + axis_length * directions(nc, tip, nc.second[part])))


def lengths(six: Floats) -> Floats:
    """(v,) path length up to every vertex of a trail."""
    step = six[1:] - six[:-1]
    lengths: Floats = np.concatenate(([0.0], np.cumsum(np.sqrt(np.einsum("ij,ij->i", step, step)))))
    return lengths
