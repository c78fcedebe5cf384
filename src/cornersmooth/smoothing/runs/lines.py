"""Runs as lines: points of the curves at every pose and, where chords would leave the curve, between.

A line between two points of the curve that belong to one segment of the original motion is no farther from it than its
ends: the deviation at the common parameter is linear in between. So a point for every pose keeps the promise, and more
are put only where lines would cut the curve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.model import Floats, Ints, Runs
from cornersmooth.settings import Settings
from cornersmooth.smoothing.runs.polylines import Polylines
from cornersmooth.smoothing.runs.ranges import spread, starts
from cornersmooth.smoothing.runs.samples import Pieces
from cornersmooth.smoothing.runs.splines import Splines
from cornersmooth.smoothing.segments import turn_limit
from cornersmooth.vectors import angle_between, norm, unit

#: share of ε that turning the axis inside a line may take; `global_runs` leaves it free
TURNING = 0.02

#: mm of a piece in which the tip stands, however short the piece is
_STANDING = 1e-30

#: pieces measured together
_TOGETHER = 8192

#: most lines for one segment
_MOST_LINES = 20_000


def polylines_of(runs: Runs, tip: Floats, axis_point: Floats) -> Polylines:
    """The original motion of the runs; `tip` and `axis_point` (n, 3) are those of all poses of the program."""
    return Polylines(np.hstack((tip[runs.pose], axis_point[runs.pose])), runs.count, runs.s, runs.step)


def points_at(control: Floats, splines: Splines, span: Ints, s: Floats) -> tuple[Floats, Floats]:
    """Tips (mm) and unit axes (m, 3) on the curves at places s of the spans."""
    basis = splines.basis(span, s)
    points = np.einsum("mk,mkd->md", basis, control[splines.span_control[span][:, None] + np.arange(4)])
    return points[:, :3], unit(points[:, 3:] - points[:, :3])


def largest_curvature(lines: Polylines, splines: Splines, control: Floats) -> Floats:
    """(n,) 1/mm: largest curvature of the tip curves in the halves of the segments beside each pose of the runs."""
    largest = np.zeros(len(lines.s))
    pieces = Pieces.of(splines, lines)
    at = np.linspace(0.0, 1.0, 9)
    slope = np.stack(((1.0 - at) ** 2, 2.0 * at * (1.0 - at), at**2), axis=1)
    bend = np.stack((1.0 - at, at), axis=1)
    for begin in range(0, len(pieces.span), _TOGETHER):
        rows = slice(begin, begin + _TOGETHER)
        span, segment, low, high = pieces.span[rows], pieces.segment[rows], pieces.low[rows], pieces.high[rows]
        points = control[splines.span_control[span][:, None] + np.arange(4), :3]
        hull = splines.bernstein(span, low, high) @ points
        first, second = 3.0 * slope @ np.diff(hull, axis=1), 6.0 * bend @ np.diff(hull, 2, axis=1)
        speed = norm(first)
        # where the tip all but stands there is no curvature to speak of
        least = np.maximum(1e-6 * (high - low)[:, None] * lines.step, _STANDING)
        curvature = np.divide(norm(np.cross(first, second)), speed**3, out=np.zeros_like(speed), where=speed > least)
        middle = (lines.s[segment] + lines.s[segment + 1])[:, None] / 2.0
        nearer = segment[:, None] + (low[:, None] + at * (high - low)[:, None] > middle)
        np.maximum.at(largest, nearer, curvature)
    return largest


@dataclass(frozen=True)
class LinePlaces:
    """Where the lines that runs are written as end: m places in path order.

    Parameters
    ----------
    pose : (m,) int64
        Pose that the segment of each line ends in.
    span : (m,) int64
        Of the curves of all runs.
    s : (m,) float64, steps
    end : (m,) int64
        Row of the polylines that a place at the end of a run is, -1 for the others.
    """

    pose: Ints
    span: Ints
    s: Floats
    end: Ints


def run_lines(runs: Runs, lines: Polylines, settings: Settings) -> tuple[Ints, Floats, Floats]:
    """Ends of the lines that runs are written as.

    Returns
    -------
    pose : (m,) int64
        Pose that the segment of each line ends in.
    tip, axis : (m, 3) float64
        mm, and unit vectors. The last of a run are its last pose.
    """
    found = line_places(runs, lines, settings)
    tip, axis = points_at(runs.control, Splines(runs.knot, runs.knot_count), found.span, found.s)
    at = np.flatnonzero(found.end >= 0)
    ends = lines.point[found.end[at]]  # which are passed exactly
    tip[at], axis[at] = ends[:, :3], unit(ends[:, 3:] - ends[:, :3])
    return found.pose, tip, axis


def line_places(runs: Runs, lines: Polylines, settings: Settings) -> LinePlaces:
    """Places on the curves where the lines end that runs are written as."""
    splines = Splines(runs.knot, runs.knot_count)
    pieces = Pieces.of(splines, lines)
    if not len(pieces.segment):  # no run has been left with a curve
        none = np.zeros(0, np.int64)
        return LinePlaces(none, none, np.zeros(0), none)
    segment, first = np.unique(pieces.segment, return_index=True)  # one piece or more for every segment
    effort = _effort(runs, splines, lines, pieces, settings)
    number = np.clip(np.ceil(np.add.reduceat(effort, first) - 1e-9), 1, _MOST_LINES).astype(np.int64)
    row, place = spread(number)
    last = place == number[row] - 1
    # equal shares of the effort; a little is added so that it grows everywhere
    grown = effort + 1e-9 * (pieces.high - pieces.low) / np.repeat(
        np.add.reduceat(pieces.high - pieces.low, first), np.diff(np.append(first, len(effort)))
    )
    reached = np.concatenate(([0.0], np.cumsum(grown)))
    begin, end = reached[first], reached[np.append(first[1:], len(grown))]
    target = begin[row] + (place + 1) / number[row] * (end - begin)[row]
    piece = np.clip(
        np.searchsorted(reached, target, side="left") - 1, first[row], np.append(first[1:], len(grown))[row] - 1
    )
    share = (target - reached[piece]) / grown[piece]
    s = pieces.low[piece] + np.clip(share, 0.0, 1.0) * (pieces.high - pieces.low)[piece]
    final = np.append(first[1:], len(grown)) - 1
    s[last], piece[last] = pieces.high[final], final
    ends = starts(runs.count)[1:] - 1
    pose_row = segment[row] + 1
    end = np.where(last & np.isin(pose_row, ends), pose_row, -1)
    return LinePlaces(runs.pose[pose_row], pieces.span[piece], s, end)


def _effort(runs: Runs, splines: Splines, lines: Polylines, pieces: Pieces, settings: Settings) -> Floats:
    """(p,) lines that each piece asks for: by its bend and the chord tolerance, and by the turn of the axis."""
    controls = runs.control[splines.span_control[pieces.span][:, None] + np.arange(4)]
    hull = splines.bernstein(pieces.span, pieces.low, pieces.high) @ controls
    bends = 6.0 * np.diff(hull, 2, axis=1)  # second derivatives at both ends, over the whole piece
    size = np.maximum(norm(bends[..., :3]), norm(bends[..., 3:])).max(axis=1)
    by_chord = np.sqrt(size / (8.0 * settings.chord))
    levers = lines.point[:, 3:] - lines.point[:, :3]
    turn = np.concatenate((angle_between(levers[:-1], levers[1:]), [0.0]))[pieces.segment]
    turned = angle_between(hull[:, 0, 3:] - hull[:, 0, :3], hull[:, 3, 3:] - hull[:, 3, :3])
    by_turn = turned / turn_limit(settings, turn / 2.0, TURNING * settings.tolerance)
    effort: Floats = np.maximum(by_chord, by_turn)
    return effort
