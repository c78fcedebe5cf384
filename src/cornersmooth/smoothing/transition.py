"""Where the path is rounded and how far each transition reaches (docs/method.md).

Every function works on whole arrays of corners; memory is bounded by working through them in batches.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cornersmooth.methods import METHODS
from cornersmooth.model import Corners, FeedMode, Ints, Move, Program, Status
from cornersmooth.settings import Settings
from cornersmooth.smoothing.corner_table import BATCH, Placed, legs_at
from cornersmooth.smoothing.neighbours import find_neighbours

if TYPE_CHECKING:
    from cornersmooth.smoothing.construction import Construction

#: what a method measures of every transition
_MEASURES = tuple(name for name in Placed.__dataclass_fields__ if name not in ("status", "limited_by", "extra"))

#: batches worked on side by side
THREADS = 2


def place_corners(
    program: Program,
    settings: Settings,
    construction: Construction,
    progress: Callable[[int, int], None] | None = None,
) -> Corners:
    """Round every corner of the program that can be rounded; `progress` takes (corners done, corners in all)."""
    around = find_neighbours(program, settings.axis_length, settings.duplicate_distance)
    pose = np.flatnonzero(around.inner)
    before, after = around.previous[pose], around.following[pose]
    status = _what_forbids(program, settings, pose, after, around.duplicate[pose])

    k = len(pose)
    weights = np.broadcast_to(np.array(settings.weights), (k, 2))
    whole = Placed(
        status=status,
        limited_by=np.zeros(k, np.uint8),
        **{name: np.zeros(k) for name in _MEASURES},
        extra={name: np.full(k, np.nan) for name in construction.extra},
    )
    if METHODS[settings.method].one_parameter:  # the same fractions on both curves: one array
        whole.axis_trim_in, whole.axis_trim_out = whole.trim_in, whole.trim_out

    def settle(start: int) -> int:
        rows = start + np.flatnonzero(status[start : start + BATCH] == Status.SMOOTHED)
        if len(rows):
            legs = legs_at(program, settings.axis_length, pose[rows], before[rows], after[rows])
            part = construction.place(legs, settings)
            for name in ("status", "limited_by", *_MEASURES):
                getattr(whole, name)[rows] = getattr(part, name)
            for name, values in part.extra.items():
                whole.extra[name][rows] = values
        return min(start + BATCH, k)

    with ThreadPoolExecutor(THREADS) as pool:  # numpy leaves the interpreter free; batches share no rows
        for done in (pool.map if k > BATCH else map)(settle, range(0, k, BATCH)):
            if progress is not None:
                progress(done, k)
    ratio = np.broadcast_to(np.float64(settings.ratio), (k,))
    return Corners(pose=pose, before=before, after=after, weights=weights, ratio=ratio, **vars(whole))


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
    acts = np.cumsum(program.acted)
    status[acts[after] > acts[pose]] = Status.STATEMENT
    status[program.keep[pose] != 0] = Status.KEPT
    status[program.kind[pose - 1] == Move.HOLE] = Status.KEPT  # the tool comes from above the hole, not out of its pose
    status[after == 0] = Status.TOO_SHORT
    status[duplicate] = Status.DUPLICATE
    return status
