"""Where the path is rounded and how far each transition reaches: design 3.1 to 3.3.

Every function works on whole arrays of corners; memory is bounded by working through them in blocks.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Corners, FeedMode, Floats, Ints, Move, Program, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.allocation import fair_room
from cornersmooth.smoothing.legs import Legs, Placed, legs_at
from cornersmooth.smoothing.neighbours import find_neighbours
from cornersmooth.smoothing.proportional import Wanted, place_proportional, wanted
from cornersmooth.smoothing.shape import corner_weight
from cornersmooth.smoothing.zhang2016 import place_zhang2016

#: corners worked on at once: their intermediate arrays fit the processor's cache
BLOCK = 16384

#: blocks worked on side by side
THREADS = 2


def place_corners(program: Program, settings: Settings, progress: Callable[[int, int], None] | None = None) -> Corners:
    """Round every corner of the program that can be rounded.

    Parameters
    ----------
    progress : callable, optional
        Called with (corners done, corners in all) after each block.

    Returns
    -------
    Corners
        One row for every inner pose of every chain.
    """
    around = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    pose = np.flatnonzero(around.inner)
    before, after = around.previous[pose], around.following[pose]
    status = _what_forbids(program, settings, pose, after, around.duplicate[pose])
    work = _Work(program, settings, pose, before, after, status)
    room = fair_room(pose, after, *work.needs()) if settings.allocation == "fair" else None

    k = len(pose)
    automatic = settings.shape == "auto"
    weights = np.ones((k, 2)) if automatic else np.broadcast_to(np.array(settings.weights), (k, 2))
    whole = Placed(
        status=status,
        limited_by=np.zeros(k, np.uint8),
        **{
            name: np.zeros(k)
            for name in Placed.__dataclass_fields__
            if name not in ("status", "limited_by", "sync_residual", "jump_in", "jump_out")
        },
        **{name: np.full(k, np.nan) for name in ("sync_residual", "jump_in", "jump_out")},
    )
    if settings.method == "proportional":  # the same fractions on both curves: one array
        whole.axis_trim_in, whole.axis_trim_out = whole.trim_in, whole.trim_out

    def settle(block: tuple[int, Ints]) -> int:
        start, rows = block
        if len(rows):
            part, shape = work.place(rows, None if room is None else room[rows])
            if automatic:
                weights[rows] = shape
            for name in Placed.__dataclass_fields__:
                getattr(whole, name)[rows] = getattr(part, name)
        return min(start + BLOCK, k)

    with ThreadPoolExecutor(THREADS) as pool:  # numpy leaves the interpreter free; blocks share no rows
        for done in pool.map(settle, work.blocks()):
            if progress is not None:
                progress(done, k)
    ratio = np.broadcast_to(np.float64(settings.ratio), (k,))
    return Corners(pose=pose, before=before, after=after, weights=weights, ratio=ratio, **vars(whole))


class _Work(NamedTuple):
    """The corners of a program, worked on in blocks."""

    program: Program
    settings: Settings
    pose: Ints
    before: Ints
    after: Ints
    status: NDArray[np.uint8]

    def blocks(self) -> Iterator[tuple[int, Ints]]:
        """Start of each block and its rows that nothing forbids to smooth."""
        for start in range(0, len(self.pose), BLOCK):
            yield start, start + np.flatnonzero(self.status[start : start + BLOCK] == Status.SMOOTHED)

    def place(self, rows: Ints, room: Floats | None) -> tuple[Placed, Floats]:
        """Transitions and weights of some corners; without `room` half of each segment is theirs."""
        if self.settings.method == "zhang2016":
            legs, weights, ratio = self._shaped(rows)
            return place_zhang2016(legs, weights, ratio, self.settings), weights
        asked = self._wanted(rows)
        if room is None:
            room = np.minimum(asked.length_in, asked.length_out) / 2.0
        return place_proportional(asked, room, self.settings), asked.bends.weights

    def needs(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Segment lengths m(D⁻), m(D⁺), wanted transition lengths and cosines of the turn, (k,) each.

        Corners that stay sharp want no length.
        """
        length_in, length_out, length, cosine = np.zeros((4, len(self.pose)))
        for _, rows in self.blocks():
            if len(rows):
                asked = self._wanted(rows)
                length_in[rows], length_out[rows], cosine[rows] = asked.length_in, asked.length_out, asked.cosine
                length[rows] = np.where(
                    asked.status == Status.SMOOTHED, np.minimum(asked.by_tolerance, asked.by_orientation), 0.0
                )
        return length_in, length_out, length, cosine

    def _shaped(self, rows: Ints) -> tuple[Legs, Floats, Floats]:
        legs = legs_at(self.program, self.settings.axis_length, self.pose[rows], self.before[rows], self.after[rows])
        weights = np.broadcast_to(np.array(self.settings.weights), (len(rows), 2))
        if self.settings.shape == "auto":
            weights = np.stack((np.ones(len(rows)), corner_weight(legs)), axis=1)
        return legs, weights, np.broadcast_to(np.float64(self.settings.ratio), (len(rows),))

    def _wanted(self, rows: Ints) -> Wanted:
        return wanted(*self._shaped(rows), self.settings)


def _what_forbids(
    program: Program, settings: Settings, pose: Ints, after: Ints, duplicate: NDArray[np.bool_]
) -> NDArray[np.uint8]:
    """Status of every corner as far as its surroundings decide it, geometry apart."""
    status = np.full(len(pose), Status.SMOOTHED, np.uint8)
    after = np.maximum(after, 0)
    feed_in, feed_out = program.feed[pose], program.feed[after]
    same = (feed_in == feed_out) | (np.isnan(feed_in) & np.isnan(feed_out))
    same_mode = program.feed_mode[pose] == program.feed_mode[after]
    status[~same_mode | (~same & (not settings.round_feed_changes))] = Status.FEED_CHANGE
    if not settings.round_feed_changes:
        status[program.feed_mode[pose] == FeedMode.PER_REVOLUTION] = Status.FEED_PER_REVOLUTION
    status[program.keep[pose] != 0] = Status.KEPT
    status[program.kind[pose - 1] == Move.HOLE] = Status.KEPT  # the tool comes from above the hole, not out of its pose
    status[after == 0] = Status.TOO_SHORT
    status[duplicate] = Status.DUPLICATE
    return status
