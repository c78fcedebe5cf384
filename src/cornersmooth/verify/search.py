"""Finds the places of the vertices of a batch: in order, by path length, and anew what is then in doubt.

Both motions are nearly equally long, so that the path length tells where about a vertex is, and the nearest segment is
found from there: first for few vertices (`guide`), which tell more exactly where about those between them are. Places
never go back. What is then in doubt is assigned anew, with its neighbours, by the best monotone correspondence
(`assignment`), but for vertices that are off wherever they are put.
"""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.assignment import ROUNDS, assign, doubtful_windows
from cornersmooth.verify.guide import LONG, STRIDE, guide
from cornersmooth.verify.nearest import (
    Metric,
    distance_between,
    foot_share,
    larger_square,
    nearest_from,
    nearest_places,
)
from cornersmooth.verify.polyline import Polyline
from cornersmooth.verify.task import Task

#: how much longer one motion may be than the other between neighbouring vertices, in distances that are doubtful: a
#: rounding is shorter than its corner by no more than twice its deviation
_SHORTCUT = 2.0

#: vertices that are tried where one of few is off the path
_TRIED = 3

#: segments between neighbours of a vertex that is off, on either side of their middle
_BETWEEN = 3

#: one of so many places that are lost where a stretch is gone through evenly is enough to have it guided
_LOST = 8

#: to and fro below this part of the tolerance is settled by itself, and pairs and windows that are looked at for it
_SMALL, _SMALL_PAIRS, _SMALL_WINDOWS = 0.1, 4096, 64

#: digits that are worth more than this part of the tolerance may hide a place that is lost
_COARSE = 0.5

#: windows that are assigned anew, one after another, without much gain: the text itself is off then; a window counts
#: once more for so many vertices that stay in doubt
_MOST_FUTILE, _MANY_DOUBTS = 8, 32

#: pairs of vertices and segments of a stretch that is assigned anew as a whole before that is given up, at most
_ALL_PAIRS = 1_000_000

#: slack of arithmetic on lengths, mm
_ARITHMETIC = 1e-9

#: what may be near its path on its own
_ALONE: tuple[Metric, ...] = ("tip", "axis point")


class Search:
    """The places of one batch while they are being found; the attributes are those of `Match`."""

    def __init__(self, task: Task, six: Floats, rows: np.ndarray, until: float, margin: float) -> None:
        self.task, self.path, self.six, self.rows, self.margin = task, task.path, six, rows, margin
        #: distance of a vertex from its place, in six dimensions, from which on it is looked at with more care, mm
        self.far = float(np.sqrt(2) * task.tolerance + margin)
        count = len(six)
        first, last = rows["first"], rows["last"]
        size = last - first + 1
        index = np.repeat(np.arange(len(rows)), size)
        vertex = np.arange(len(index)) - np.repeat(np.cumsum(size) - size, size) + first[index]
        self.number = np.full(count, -1, np.int64)
        self.low, self.high = np.zeros(count, np.int64), np.zeros(count, np.int64)
        self.number[vertex], self.low[vertex], self.high[vertex] = index, rows["start"][index], rows["stop"][index] - 1
        self.vertex, self.owner = vertex, index
        self.begin = self.path.length_at(rows["start"], rows["fraction"])
        self.end = self.path.length[rows["stop"]]
        #: where the last vertex of a stretch must be, NaN for all others
        self.goal = np.full(count, np.nan)
        self.goal[last] = rows["stop"]
        if np.isfinite(until):
            self.goal[last[-1]] = until
            segment = np.array([min(int(until), len(self.path.six) - 2)])
            self.end[-1] = self.path.length_at(segment, until - segment)[0]
        self.segment, self.fraction = np.zeros(count, np.int64), np.full(count, -1.0)
        self.backward = np.zeros(count, np.bool_)
        #: how far vertices lie behind the one before them, mm
        self.gone_back = np.zeros(count)
        self.distance, self.nearest = np.full(count, np.inf), np.zeros(count, np.bool_)
        self.apart = np.zeros(count, np.bool_)

    def find(self) -> None:
        """Find all places in order."""
        path, rows = self.path, self.rows
        length = Polyline.of(self.six).length
        about = self._about(length)
        inner = np.flatnonzero(self.vertex != rows["first"][self.owner])
        vertex = self.vertex[inner]
        low, high = self.low[vertex], self.high[vertex]
        segment, fraction, square = nearest_from(self.six.take(vertex, axis=0), path, about[inner], low, high)
        self.segment[vertex], self.fraction[vertex] = segment, fraction
        self.segment[rows["first"]], self.fraction[rows["first"]] = rows["start"], rows["fraction"]
        self.nearest[vertex] = True
        self.distance[vertex] = np.sqrt(square)
        self._put_at_the_ends(rows["last"][rows["last"] > rows["first"]])
        self._put_in_order(length)

    def _put_at_the_ends(self, last: Ints) -> None:
        """Put the last vertices of stretches where the stretches end, if they are as near to that as to their places.

        Where the path goes to and fro the digits decide which of its turns is nearest.
        """
        goal = self.goal[last]
        segment = np.clip(np.ceil(goal).astype(np.int64) - 1, 0, len(self.path.six) - 2)
        away = distance_between(self.six[last], self.path.point_at(segment, goal - segment))
        there = away <= self.distance[last] + self.margin
        last = last[there]
        self.segment[last], self.fraction[last] = segment[there], (goal - segment)[there]
        self.distance[last] = away[there]

    def _put_in_order(self, length: Floats) -> None:
        """Let no place be behind one before it, and say which vertices are behind or far along the path.

        Stretches follow one another on the path, so all of them are put in order at once. Vertices that are near the
        path lead. Where one that is off seems to be says little: its place is put between those of its neighbours.
        """
        path, rows, every = self.path, self.rows, self.vertex
        found = path.length_at(self.segment[every], self.fraction[every])
        found = np.clip(found, self.begin[self.owner], None)
        begins = every == rows["first"][self.owner]
        sure = begins | (self.distance[every] <= self.far)
        order = np.arange(len(found))
        off = np.flatnonzero(~sure)
        if len(off):
            leader = _leaders(np.where(sure, found, -np.inf), begins)
            following = np.minimum.accumulate(np.where(sure, order, len(order))[::-1])[::-1][off]
            bounded = following < len(order)
            off, following = off[bounded], leader[following[bounded]]
            beyond = found[off] > found[following]
            off, following = off[beyond], following[beyond]
            found[off] = found[following]
            self._hold(every[off], every[following])
        leader = _leaders(found, begins)
        held = np.flatnonzero(leader != order)
        gone_back = found[leader[held]] - found[held]
        some = gone_back > _ARITHMETIC
        held, gone_back = held[some], gone_back[some]
        self._hold(every[held], every[leader[held]])
        self.backward[every[held]] = gone_back > self.margin
        self.gone_back[every[held]] = gone_back
        place = found[leader]
        # where the text goes aside and comes back it is longer: then it counts how far it has come
        known = np.flatnonzero(sure)
        step, way = np.diff(place[known]), np.diff(length[every[known]])
        aside = np.flatnonzero(np.diff(known) > 1)
        way[aside] = distance_between(self.six[every[known[aside + 1]]], self.six[every[known[aside]]])
        self.apart[every[known[1:]]] = (np.abs(step - way) > _SHORTCUT * self.far) & ~begins[known[1:]]
        tail = np.searchsorted(every, rows["last"])
        self.apart[rows["last"]] |= np.abs(place[tail] - self.end) > _SHORTCUT * self.far

    def _hold(self, vertex: Ints, leader: Ints) -> None:
        """Put vertices where others are."""
        self.segment[vertex], self.fraction[vertex] = self.segment[leader], self.fraction[leader]
        place = self.path.point_at(self.segment[vertex], self.fraction[vertex])
        self.distance[vertex] = distance_between(self.six[vertex], place)
        self.nearest[vertex] = False

    def _about(self, length: Floats) -> Floats:
        """(k,) path length where about each of `self.vertex` is, from path lengths and the places of few."""
        rows = self.rows
        first, last = rows["first"], rows["last"]
        size = last - first
        about, lost = self._evenly(length)
        if (lost & (size <= LONG)).any():  # a text that is off in many places is longer than its path
            other, still = self._evenly(_length_without_detours(self.six, self.far))
            about = np.where((lost & ~still)[self.owner], other, about)
            lost &= still
        path, guided = self.path, lost | (size > LONG)
        edges = np.flatnonzero(np.diff(self.owner, prepend=-1, append=len(rows)))
        for k in np.flatnonzero(guided).tolist():
            part = slice(int(first[k]), int(last[k]) + 1)
            limits = int(rows["start"][k]), int(rows["stop"][k]) - 1
            at, found, _ = guide(self.six[part], length[part], path, self.begin[k], limits, self.far)
            known = np.append(at, size[k])
            off = np.append(found, self.end[k]) - length[part][known]
            own = slice(int(edges[k]), int(edges[k + 1]))
            about[own] = length[part] + np.interp(np.arange(len(length[part])), known, off)
        return about

    def _evenly(self, length: Floats) -> tuple[Floats, Bools]:
        """As `_about`, gone through evenly from end to end; and in which stretches (s,) this has lost the way."""
        rows, owner = self.rows, self.owner
        first, last = rows["first"], rows["last"]
        way, size = length[last] - length[first], last - first
        scale = np.divide(self.end - self.begin, way, out=np.zeros(len(way)), where=way > 0)
        about: Floats = self.begin[owner] + (length[self.vertex] - length[first][owner]) * scale[owner]
        few = np.arange(STRIDE - 1, len(owner), STRIDE)
        few = few[(size <= LONG)[owner[few]]]
        off, sure = self._off_from(about, few)
        for _ in range(1, _TRIED):  # a vertex that is off itself tells nothing: others are near it
            lost = np.flatnonzero(~sure)
            lost = lost[owner[few[lost] - 1] == owner[few[lost]]]
            if not len(lost):
                break
            few[lost] -= 1
            off[lost], sure[lost] = self._off_from(about, few[lost])
        sure[1:] &= (np.abs(np.diff(off)) <= 2 * STRIDE * self.far) | (np.diff(owner[few]) != 0)
        lost = np.bincount(owner[few[~sure]], minlength=len(rows))
        often = lost > np.bincount(owner[few], minlength=len(rows)) / _LOST
        few, off = few[sure], off[sure]
        edges = np.flatnonzero(np.diff(owner, prepend=-1, append=len(rows)))
        ends = np.append(edges[:-1], edges[1:] - 1)
        known = np.append(few, ends)
        order = np.argsort(known, kind="stable")
        about += np.interp(np.arange(len(owner)), known[order], np.append(off, np.zeros(len(ends)))[order])
        return about, often

    def _off_from(self, about: Floats, few: Ints) -> tuple[Floats, Bools]:
        """(k,) how much farther along the path than `about` some of `self.vertex` are, and whether they are near it."""
        chosen, path = self.vertex[few], self.path
        segment, fraction, square = nearest_from(
            self.six.take(chosen, axis=0), path, about[few], self.low[chosen], self.high[chosen]
        )
        return path.length_at(segment, fraction) - about[few], square <= self.far**2

    def look_again(self) -> None:
        """Assign anew, and with more care, what is too far away or in the wrong order."""
        self._settle_small()
        self._settle_doubts()
        if self.margin > _COARSE * self.task.tolerance:
            self._settle_within_digits()

    def _settle_within_digits(self) -> None:
        """Assign anew what is off by less than digits are worth, where these are worth as much as the tolerance."""
        rows = np.flatnonzero(np.isfinite(self.distance) & (self.distance > self.task.tolerance) & (self.number >= 0))
        doubtful = np.zeros(len(self.six), np.bool_)
        doubtful[rows] = ~self._near_alone(rows, self.task.tolerance)
        around, most_pairs, most_windows = ROUNDS[1]
        for first, last in doubtful_windows(doubtful, self.number, around, most_windows):
            before = self.distance[first : last + 1].copy()
            self._assign(first, last, most_pairs, doubtful, wide=False)
            if (self.distance[first : last + 1] == before).all():
                return  # the text itself is off

    def _settle_doubts(self) -> None:
        """Assign anew what is too far away or in the wrong order, with more care round by round."""
        known = np.isfinite(self.distance)
        limit = self.task.tolerance + self.margin
        apart, futile = self.apart, 0
        for around, most_pairs, most_windows in ROUNDS:
            doubtful = (self.backward | apart | (known & (self.distance > self.far))) & (self.number >= 0)
            # both together may be so far, but not one of them alone
            rows = np.flatnonzero(known & ~doubtful & (self.distance > limit))
            away = self.six[rows] - self.path.point_at(self.segment[rows], self.fraction[rows])
            rows = rows[larger_square(away) > limit**2]
            doubtful[rows] = ~self._near_alone(rows, limit)
            doubtful[self._off_anywhere(doubtful, apart, limit)] = False
            apart = np.zeros_like(apart)  # looked at once
            windows = doubtful_windows(doubtful, self.number, around, most_windows + 1)
            if around > ROUNDS[0][0] and len(windows) > most_windows:
                return  # no mishap of the search: the text is off everywhere
            # those in which places are lost first, and of these those with few doubts: others may be futile
            for first, last in sorted(windows[:most_windows], key=lambda ends: self._rank(slice(ends[0], ends[1] + 1))):
                part = slice(first, last + 1)
                before = self._doubts(part)
                self._assign(first, last, most_pairs, doubtful, wide=around > ROUNDS[0][0])
                left = self._doubts(part)
                futile = 0 if 2 * left < before else futile + bool(before) + left // _MANY_DOUBTS
                if futile > _MOST_FUTILE:
                    self._assign_all(first, doubtful)
                    return  # nor here

    def _assign_all(self, vertex: int, doubtful: Bools) -> None:
        """Assign the stretch of a vertex anew, if it is short: its places may be lost where nothing is in doubt yet."""
        own = np.flatnonzero(self.number == self.number[vertex])
        self._assign(int(own[0]), int(own[-1]), _ALL_PAIRS, doubtful, wide=False)

    def _settle_small(self) -> None:
        """Assign anew where the path goes to and fro by far less than the tolerance, which would drown that."""
        small = self.backward & (self.gone_back < _SMALL * self.task.tolerance)
        if not small.any():
            return
        length = self.path.length_at(self.segment, self.fraction)
        edges = np.append(np.flatnonzero(np.diff(self.number, prepend=-2)), len(length))
        done = -1
        for vertex in np.flatnonzero(small).tolist()[:_SMALL_WINDOWS]:
            if vertex <= done:
                continue
            stretch = int(np.searchsorted(edges, vertex, side="right"))
            scale = float(self.gone_back[vertex])
            low, high = np.searchsorted(
                length[edges[stretch - 1] : edges[stretch]], length[vertex] + np.array([-4, 4]) * scale
            )
            first = int(edges[stretch - 1]) + max(int(low) - 1, 0)
            done = min(int(edges[stretch - 1] + high), int(edges[stretch]) - 1)
            self._assign(first, done, _SMALL_PAIRS, small, wide=False, scale=scale)

    def _near_alone(self, rows: Ints, limit: float) -> Bools:
        """(k,) whether tip and axis point each keep the limit from the segment of the place or from one beside it.

        The place nearest to both together is nearest to neither: a corner that uses all of the tolerance seems to miss
        it by a little there, which is no doubt about its place. Places that were held or assigned stay in doubt.
        """
        near = self.nearest[rows]
        six, middle, low, high = self.six[rows], self.segment[rows], self.low[rows], self.high[rows]
        for metric in _ALONE:
            near &= nearest_places(six, self.path.six, middle, 1, low, high, metric)[2] <= limit**2
        return near

    def _off_anywhere(self, doubtful: Bools, apart: Bools, limit: float) -> Ints:
        """Doubtful vertices that are off the path wherever they are put between neighbours that are without doubt.

        There is no mishap of the search then: the text itself is off, be it in ever so many places.
        """
        rows = np.flatnonzero(doubtful)
        if not len(rows):
            return rows
        number = self.number[rows]
        begins = np.append(True, (np.diff(rows) > 1) | (np.diff(number) != 0))
        first = np.flatnonzero(begins)
        run = np.cumsum(begins) - 1
        last = np.append(first[1:], len(rows)) - 1
        before, behind = rows[first] - 1, np.minimum(rows[last] + 1, len(doubtful) - 1)
        # both neighbours are in the same stretch, and near
        known = (before >= 0) & (self.number[before] == number[first]) & (self.number[behind] == number[last])
        known &= ~doubtful[before] & ~doubtful[behind]
        low, high = self.segment[before], self.segment[behind]
        known &= (low <= high) & (high - low <= 2 * _BETWEEN)
        settled = known[run] & ~apart[rows]
        low, high, own = low[run[settled]], high[run[settled]], rows[settled]
        far = self.distance[own] > self.far
        off = np.zeros(len(own), np.bool_)
        for metric, at, room in (("both", far, self.far), *((metric, ~far, limit) for metric in _ALONE)):
            six, around = self.six[own[at]], (low[at] + high[at]) // 2
            square = nearest_places(six, self.path.six, around, _BETWEEN, low[at], high[at], metric)[2]
            off[at] |= square > room**2
        settled[settled] = off
        # all of a run, or none of it
        whole = np.ones(len(first), np.bool_)
        whole[run[~settled]] = False
        found: Ints = rows[whole[run]]
        return found

    def _doubts(self, part: slice) -> int:
        """How many vertices are too far away or in the wrong order."""
        return int(np.count_nonzero(self.backward[part]) + np.count_nonzero(self.distance[part] > self.far))

    def _rank(self, part: slice) -> tuple[bool, int]:
        """What windows are sorted by: whether no vertex is too far away, and how many are in doubt."""
        away = self.distance[part]
        return not (np.isfinite(away) & (away > self.far)).any(), self._doubts(part)

    def _assign(
        self, first: int, last: int, most_pairs: int, doubtful: Bools, *, wide: bool, scale: float | None = None
    ) -> None:
        """Assign a window anew if that is no worse; `scale`: distance that matters there, mm, else the tolerance."""
        part = slice(first, last + 1)
        start, stop = (float(self.segment[k] + self.fraction[k]) for k in (first, last))
        stop = stop if np.isnan(self.goal[last]) else float(self.goal[last])
        found = assign(self.six[part], self.path.six, start, stop, scale or self.task.tolerance, most_pairs)
        if found is None:
            return
        segment, fraction, back = found
        off = distance_between(self.six[part], self.path.point_at(segment, fraction))
        begin, end = 1, len(off)
        if wide:  # most of so wide a window has its place already
            begin, end = self._moved(part, segment, fraction, doubtful[part])
        new, at = slice(begin, end), slice(first + begin, first + end)
        if end <= begin or off[new].max() > self.distance[at].max() + _ARITHMETIC:
            return  # worse, not by the last bit only
        self.segment[at], self.fraction[at], self.distance[at] = segment[new], fraction[new], off[new]
        self.nearest[at] = False
        start_point, end_point = self.path.six[segment], self.path.six[segment + 1]
        free = foot_share(self.six[part] - start_point, end_point - start_point)
        beyond = (fraction - free) * distance_between(end_point, start_point)
        self.backward[at] = (back & (beyond > self.margin))[new]

    def _moved(self, part: slice, segment: Ints, fraction: Floats, doubtful: Bools) -> tuple[int, int]:
        """First vertex of a window, and last plus one, that get another place with the doubtful ones; all in order."""
        old = self.path.length_at(self.segment[part], self.fraction[part])
        new = self.path.length_at(segment, fraction)
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


def _leaders(found: Floats, begins: Bools) -> Ints:
    """(k,) the vertex that is farthest along up to each, from where a stretch begins."""
    order = np.arange(len(found))
    ahead = found > np.maximum.accumulate(np.append(-np.inf, found))[:-1]
    leader: Ints = np.maximum.accumulate(np.where(ahead | begins, order, 0))
    return leader


def _length_without_detours(six: Floats, far: float) -> Floats:
    """(v,) path length up to every vertex as if those that lie aside of their neighbours were between them."""
    way, direct = distance_between(six[1:], six[:-1]), distance_between(six[2:], six[:-2])
    detour = way[:-1] + way[1:] - direct
    around = np.pad(detour, 1, constant_values=-np.inf)
    aside = np.flatnonzero((detour > 2 * far) & (detour > around[:-2]) & (detour >= around[2:]))
    way[aside] = way[aside + 1] = direct[aside] / 2
    return np.append(0.0, np.cumsum(way))
