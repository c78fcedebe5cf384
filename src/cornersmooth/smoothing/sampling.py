"""The smoothed motion as rows: dense lines (tip and axis vector) or lines and curves (control points).

u = ½ is always a point of the dense lines, so they keep the deviation of the curve: on either half the curve's distance
from its leg is convex, and a chord of it lies no farther from the leg than its ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import joined_rows, ranges, some_rows, starts, unit
from cornersmooth.geometry import nurbs
from cornersmooth.geometry.arcs import arc_curves, arc_lines, arc_points, arc_weights, divided
from cornersmooth.model import Bools, Floats, Ints, Numbers, SmoothProgram
from cornersmooth.smoothing.construction import BATCH, construction_of
from cornersmooth.smoothing.runs.rows import Rows, run_lines, section_rows, some_at_once
from cornersmooth.smoothing.segments import Segments, lines_per_half, segments_of


@dataclass(frozen=True)
class ArcBlocks:
    """How the arcs of a program are written, k of them."""

    blocks: Ints  #: (k,) circles or curves of each; 0 where it becomes lines
    curved: Bools  #: (k,) whether these are curves of four control points
    decimals: int | None  #: of the weights of curves; None where all are 1


@dataclass(frozen=True)
class _Batch:
    """Poses begin to end − 1 and the rows they make, filled in place."""

    poses: Ints
    first: Ints  # row of the first, for each pose
    last: Ints  # row after the last
    rows: Rows


#: knots that go with the control points of a transition; the last four are 1
KNOTS = (0.0, 0.0, 0.0, 0.0, 0.5)

#: control points of a curve that is a part of an arc
_POINTS = 4


def dense_rows(smoothed: SmoothProgram, arcs: ArcBlocks | None = None) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines with tool vectors, in batches of `BATCH` poses."""
    return _Layout.of(smoothed, divide=True, arcs=arcs).parts()


def all_dense_rows(smoothed: SmoothProgram, arcs: ArcBlocks | None = None) -> Rows:
    """All rows of `dense_rows` at once, made in the place where they stay."""
    layout = _Layout.of(smoothed, divide=True, arcs=arcs)
    whole = layout.rows(slice(None))
    for _ in layout.parts(whole):
        pass
    return whole


def curve_rows(smoothed: SmoothProgram, arcs: ArcBlocks | None, *, divide: bool) -> Iterator[Rows]:
    """Rows of the smoothed motion as lines and curve pairs with axis points, in batches of `BATCH` poses.

    `divide` says whether lines in which the axis turns much are divided: not all controls run the axis point straight.
    """
    return _Layout.of(smoothed, curves=True, divide=divide, arcs=arcs).parts()


@dataclass(frozen=True)
class _Layout:
    """How many rows each of n poses makes, and what of."""

    smoothed: SmoothProgram
    segments: Segments
    halves: Numbers  # (k,) lines for each half of the transitions; none in curves
    counts: Numbers  # (n,) rows
    runs: Rows | None  # whole runs: ends of lines or control points of sections
    replaced: Bools  # (n,) poses with rows of runs
    curves: bool
    divide: bool  # whether lines in which the axis turns much are several
    arcs: ArcBlocks

    @classmethod
    def of(cls, smoothed: SmoothProgram, *, curves: bool = False, divide: bool, arcs: ArcBlocks | None) -> _Layout:
        program = smoothed.program
        segments = segments_of(smoothed, dense=divide, curves=curves)
        halves = np.zeros(0, np.int32) if curves else lines_per_half(smoothed)
        replaced, runs, whole = np.zeros(len(program), np.bool_), None, smoothed.runs
        if whole is not None:
            replaced[np.delete(whole.pose, starts(whole.count)[:-1])] = True
            parts, settings = some_at_once(whole), smoothed.settings
            runs = joined_rows(section_rows(p, program) if curves else run_lines(p, program, settings) for p in parts)
        segments.lines[replaced] = 1
        counts = np.where(segments.has_line, segments.lines, 0)
        rounded = np.flatnonzero(segments.row >= 0)
        counts[rounded] += 5 if curves else 2 * np.abs(halves[segments.row[rounded]])
        counts[segments.skip] = 0
        if runs is not None:
            counts[replaced] = np.bincount(runs.move, minlength=len(counts))[replaced]
        number = len(program.arcs)
        arcs = ArcBlocks(np.zeros(number, np.int64), np.zeros(number, np.bool_), None) if arcs is None else arcs
        if number:
            lines, several = arc_lines(program, smoothed.settings), np.where(arcs.curved, _POINTS, 1)
            counts[program.arcs.pose] = np.where(arcs.blocks > 0, several * arcs.blocks, lines)
        return cls(smoothed, segments, halves, counts, runs, replaced, curves, divide, arcs)

    def parts(self, whole: Rows | None = None) -> Iterator[Rows]:
        """Rows of `BATCH` poses after those of as many others, which are those of the whole where it is given."""
        stop = 0
        for own in (slice(begin, begin + BATCH) for begin in range(0, len(self.counts), BATCH)):
            begin, stop = stop, stop + int(self.counts[own].sum())
            yield self.filled(own, self.rows(own) if whole is None else some_rows(whole, slice(begin, stop)))

    def rows(self, own: slice) -> Rows:
        """Rows of some poses, to be filled."""
        counts = self.counts[own]
        total = int(counts.sum())
        return Rows(
            np.zeros((total, 3)),
            np.zeros((total, 3)),
            np.repeat(self._poses(own), counts),
            np.zeros(total, np.int8),
            np.zeros(total, np.bool_),
            spline=np.tile((0.0, 1.0, 0.0), (total, 1)) if self.curves else None,
        )

    def _poses(self, own: slice) -> Ints:
        return np.arange(*own.indices(len(self.counts)))

    def filled(self, own: slice, rows: Rows) -> Rows:
        """The rows of some poses, which are filled in place."""
        smoothed, segments, runs = self.smoothed, self.segments, self.runs
        program, counts = smoothed.program, self.counts[own].astype(np.int64)
        last = np.cumsum(counts)
        batch = _Batch(self._poses(own), last - counts, last, rows)
        sharp = (segments.row[own] < 0) & (batch.last > batch.first)
        pose, at = batch.poses[sharp], batch.last[sharp] - 1
        rows.tip[at], rows.other[at] = program.tip[pose], program.axis[pose]
        if self.divide:
            _fill_divided(smoothed, segments, batch)
        _fill_arcs(smoothed, batch, self.counts, self.arcs)
        if self.curves:
            rows.other[:] = rows.tip + smoothed.settings.axis_length * rows.other
            _fill_curves(smoothed, segments, batch)
        else:
            _fill_transitions(smoothed, segments, batch, self.halves)
        if runs is not None:
            here = np.flatnonzero(self.replaced[own])
            at = ranges(batch.first[here], counts[here])
            part = some_rows(runs, slice(*np.searchsorted(runs.move, (batch.poses[0], batch.poses[-1] + 1))))
            for name in ("tip", "other", "curve", "joined", *(("spline",) if self.curves else ())):
                getattr(rows, name)[at] = getattr(part, name)
        return rows


def _fill_arcs(smoothed: SmoothProgram, batch: _Batch, counts: Numbers, arcs: ArcBlocks) -> None:
    program, rows = smoothed.program, batch.rows
    pose = program.arcs.pose
    inside = (pose >= batch.poses[0]) & (pose <= batch.poses[-1])
    straight = np.flatnonzero(inside & ~arcs.curved)
    if len(straight):
        local, share = divided(counts[pose[straight]].astype(np.int64))
        at = np.flatnonzero(np.isin(rows.move, pose[straight]))
        rows.tip[at], rows.other[at] = arc_points(program, straight[local], share)
    curved = np.flatnonzero(inside & arcs.curved)
    if len(curved):
        assert rows.spline is not None
        local, share = divided(arcs.blocks[curved])
        own, part = curved[local], 1.0 / arcs.blocks[curved[local]]
        weight = arc_weights(program.arcs.sweep[own] * part, arcs.decimals)
        of_curves = np.flatnonzero(np.isin(rows.move, pose[curved])).reshape(-1, _POINTS)
        rows.tip[of_curves] = arc_curves(program, own, share - part, share, weight)
        rows.other[of_curves], rows.curve[of_curves] = program.axis[pose[own]][:, None], np.arange(1, 1 + _POINTS)
        rows.joined[of_curves[:, 0]] = True
        rows.spline[of_curves[:, 1:3], 1], rows.spline[of_curves[:, -1], 2] = weight[:, None], 1.0


def _fill_curves(smoothed: SmoothProgram, segments: Segments, batch: _Batch) -> None:
    corners, rows = smoothed.corners, batch.rows
    here = segments.row[batch.poses] >= 0
    pose, first = batch.poses[here], batch.last[here] - 5
    row, at = segments.row[pose].astype(np.int64), first[:, None] + np.arange(5)
    tip, top = nurbs.control_points(smoothed.program, corners, row, smoothed.settings.axis_length)
    if segments.axis_entry is segments.entry:
        _meet(smoothed, segments, row, tip, top)
    rows.tip[at], rows.other[at], rows.curve[at] = tip, top, np.arange(1, 6)
    assert rows.spline is not None
    rows.spline[at, 0], rows.spline[at[:, -1], 2] = KNOTS, 1.0
    line = segments.has_line[pose]
    rows.joined[first] = ~line
    rows.tip[first[line] - 1], rows.other[first[line] - 1] = tip[line, 0], top[line, 0]


def _meet(smoothed: SmoothProgram, segments: Segments, row: Ints, tip: Floats, top: Floats) -> None:
    """Let control points (g, 5, 3) of transitions begin and end where these meet their neighbours, in place."""
    program, corners = smoothed.program, smoothed.corners
    ends = (0, corners.pose[row], segments.exit), (-1, corners.after[row], segments.entry)
    for end, segment, fraction in ends:
        meets = np.flatnonzero(~segments.has_line[segment])
        own = segment[meets]
        start, share = segments.start[own], fraction[own, None]
        tip[meets, end] = program.tip[start] + share * (program.tip[own] - program.tip[start])
        axis = program.axis[start] + share * (program.axis[own] - program.axis[start])
        top[meets, end] = tip[meets, end] + smoothed.settings.axis_length * axis


def nodes(lines: int) -> Floats:
    """Parameters u of the points of a transition after its first: both halves, the middle, the end."""
    number = abs(lines)
    s = (np.arange(1, number + 1) / number) ** (2.0 / 3.0 if lines > 0 else 1.0)
    u = 0.5 * s
    return np.concatenate((u, 1.0 - u[-2::-1], [1.0]))


def _fill_transitions(smoothed: SmoothProgram, segments: Segments, batch: _Batch, halves: Numbers) -> None:
    """Points of the transitions of the batch, first point included; corners of equal count together."""
    construction = construction_of(smoothed.settings.method)
    here = segments.row[batch.poses] >= 0
    poses, last = batch.poses[here], batch.last[here]
    rows = segments.row[poses].astype(np.int64)
    number = halves[rows]
    for lines in sorted(set(number.tolist())):
        chosen = np.flatnonzero(number == lines)
        u = nodes(int(lines))
        points, levers = construction.points(smoothed, rows[chosen], u)
        where = (last[chosen] - len(u))[:, None] + np.arange(len(u))
        batch.rows.tip[where], batch.rows.other[where] = points[:, 1:], unit(levers[:, 1:])
        batch.rows.move[where[:, len(u) // 2 :]] = smoothed.corners.after[rows[chosen]][:, None]
        first = segments.has_line[poses[chosen]]
        at = where[first, 0] - 1
        batch.rows.tip[at], batch.rows.other[at] = points[first, 0], unit(levers[first, 0])


def _fill_divided(smoothed: SmoothProgram, segments: Segments, batch: _Batch) -> None:
    """Inner points of the straight remainders that are written as several lines."""
    construction, tip = construction_of(smoothed.settings.method), smoothed.program.tip
    lines = np.where(segments.has_line[batch.poses] & (batch.last > batch.first), segments.lines[batch.poses], 1)
    for number in sorted(set(lines.tolist())):
        if number < 2:
            continue
        pose, first = batch.poses[lines == number], batch.first[lines == number]
        rows, start = first[:, None] + np.arange(number - 1), segments.start[pose]
        fraction, batch.rows.other[rows] = construction.divide(smoothed, segments, pose, int(number))
        batch.rows.tip[rows] = tip[start][:, None] + fraction[..., None] * (tip[pose] - tip[start])[:, None]


@dataclass(frozen=True)
class PathPoints:
    """Points in path order, m rows; between them the tool moves straight within the chord tolerance."""

    tip: Floats  #: (m, 3), mm
    axis: Floats  #: (m, 3): Unit tool axis vectors
    pose: Ints  #: (m,): Pose of the program whose move the point belongs to
    kind: NDArray[np.uint8]  #: (m,): `Move`: how the point is reached

    def __len__(self) -> int:
        return len(self.tip)


def sample(smoothed: SmoothProgram, *, chord: float | None = None) -> PathPoints:
    """Points on the smoothed path, as near to one another as the chord tolerance asks for.

    Parameters
    ----------
    chord : float, mm, optional
        Largest distance between the curves and the lines through the points; that of the settings by default.

    Returns
    -------
    PathPoints
        m points in path order: tips (m, 3) in mm, unit axes (m, 3), and the pose (m,) each belongs to.

    Raises
    ------
    SettingsError
        CS202 for a chord tolerance out of bounds.
    """
    if chord is not None:
        smoothed = replace(smoothed, settings=smoothed.settings.but(chord_tolerance=chord))
    kind = smoothed.program.kind
    none = PathPoints(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int64), kind[:0])
    some = (PathPoints(rows.tip, rows.other, rows.move, kind[rows.move]) for rows in dense_rows(smoothed))
    return joined_rows((none, *some))
