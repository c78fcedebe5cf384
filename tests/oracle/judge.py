"""Verdicts on a whole written program: deviation, poses passed exactly, feeds in place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from oracle.distance import Deviation, deviation, match_poses, match_samples
from oracle.motion import Original, Path, unit, written_path
from oracle.nc_text import TIP_DECIMALS, VECTOR_DECIMALS, Arc, Curve, Line, Written

Floats = NDArray[np.float64]

#: half a printed step, and a hair for the tie
HALF = 0.5 + 1e-6
#: a feed may change up to this far from its pose, in segments: transitions reach the middle
REACH = 0.5 + 1e-3


@dataclass(frozen=True)
class Verdict:
    """The worst run of a program."""

    deviation: Deviation
    run: int


def runs_of(written: Written, axis_length: float, limit: float, turn: str = "vector") -> list[Path]:
    """Written feed motion between rapids; rapids that nothing follows are left out."""
    return [path for path in written_path(written, axis_length, limit, turn) if len(path) > 1]


def judge(paths: list[Path], originals: list[Original], axis_length: float, limit: float) -> Verdict:
    """Worst deviation over all runs; their number must agree."""
    assert len(paths) == len(originals), f"{len(paths)} runs written for {len(originals)}"
    found = [deviation(path, original, axis_length, limit) for path, original in zip(paths, originals, strict=True)]
    run = int(np.argmax([one.worst for one in found]))
    return Verdict(found[run], run)


def vertices(written: Written, path: Path) -> Floats:
    """(k, 6) ends of the straight blocks and arcs of a run, tip in mm and unit axis, as printed."""
    ends = []
    for index in dict.fromkeys(path.block.tolist()):
        block = written.blocks[index]
        if isinstance(block, Line | Arc):
            ends.append(block.end)
        elif isinstance(block, Curve):
            ends.append(block.points[-1])
    six = np.array(ends)
    if written.form == "g6.2":
        six[:, 3:] -= six[:, :3]
    return np.concatenate((six[:, :3], unit(six[:, 3:])), axis=1)


def not_passed(written: Written, path: Path, tip: Floats, axis: Floats, axis_length: float) -> list[int]:
    """Indices of the poses (n,3), (n,3) that no vertex of the run shows to its printed digits."""
    shown = vertices(written, path)
    step = 10.0 ** -TIP_DECIMALS[written.units] * (1.0 if written.units == "mm" else 25.4)
    # an axis point is printed like a tip: its direction is known to a step over H in each coordinate, twice
    turn = 10.0**-VECTOR_DECIMALS if written.form == "g1" else 2 * step / axis_length
    room = np.array([HALF * step + 1e-9] * 3 + [2 * turn] * 3)
    near = cKDTree(shown[:, :3]).query_ball_point(tip, 2 * step)
    return [
        pose
        for pose, found in enumerate(near)
        if not np.all(np.abs(shown[found] - np.concatenate((tip[pose], axis[pose]))) <= room, axis=1).any()
    ]


def feeds_out_of_place(
    written: Written, path: Path, original: Original, feed: Floats, axis_length: float, limit: float
) -> list[str]:
    """Complaints about the feeds of a run: wrong order, wrong value, or changed too far from their pose.

    Parameters
    ----------
    feed : (n,) float64, mm/min
        Feed of the move into each pose; the first is not used.
    """
    # a move to where the tool stands already is not written, and neither is its feed
    moves = np.any(np.diff(np.hstack((original.tip, original.axis)), axis=0) != 0, axis=1)
    moving = np.concatenate(([True], moves))
    original, feed = Original(original.tip[moving], original.axis[moving]), feed[moving]
    where = match_samples(path, original, match_poses(path, original, axis_length, limit), axis_length)
    given = np.array([getattr(written.blocks[index], "feed", None) for index in path.block], dtype=float)[1:]
    complaints = []
    if np.isnan(given).any():
        complaints.append(f"{int(np.isnan(given).sum())} samples without feed")
    after = np.clip(np.ceil(where[1:]).astype(int), 1, len(feed) - 1)
    part = where[1:] - (after - 1)
    here = _same_feed(given, feed[after])
    here |= (part <= REACH) & _same_feed(given, feed[np.maximum(after - 1, 1)])
    here |= (part >= 1 - REACH) & _same_feed(given, feed[np.minimum(after + 1, len(feed) - 1)])
    complaints += [
        f"feed {given[sample]:g} at {where[sample + 1]:.3f}, not {feed[after[sample]]:g}"
        for sample in np.flatnonzero(~here)
    ]
    changes, wanted = _changes(given), _changes(feed[1:])
    if len(changes) != len(wanted) or not _same_feed(changes, wanted).all():
        complaints.append(f"feeds {changes.tolist()} for {wanted.tolist()}")
    return complaints


def _same_feed(one: Floats, other: Floats) -> NDArray[np.bool_]:
    """Whether feeds agree to their four printed decimals."""
    same: NDArray[np.bool_] = np.abs(one - other) <= HALF * 1e-4 * 25.4
    return same


def _changes(feed: Floats) -> Floats:
    """Feeds in order, each repeated one once."""
    return feed[np.concatenate(([True], feed[1:] != feed[:-1]))] if len(feed) else feed
