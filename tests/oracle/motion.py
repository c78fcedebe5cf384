"""Where the tool is: the written motion of a parsed NC text and the original motion between CL poses, densely.

Written: between G1 blocks tip and vector (or axis point) run linearly with one parameter and the direction is
normalised; on G6.2 both curves are rational cubic B-splines at the same parameter. Original ("ruled"): tip A and axis
point B = A + H·O run linearly with one parameter between poses, the axis is the direction of B - A. Compared are the
tip and b = tip + H·axis at constant H.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from oracle.nc_text import ARC_KNOTS, KNOTS, Arc, Curve, Line, Written

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

KNOT_VECTORS = {len(knots) - 4: np.array([float(knot) for knot in knots]) for knots in (KNOTS, ARC_KNOTS)}
#: parameters of the samples on a curve; u = 1/2 is among them
CURVE_PARAMETERS = np.linspace(0.0, 1.0, 97)
#: share of the limit that a chord may hide of the path of b
SAGITTA_SHARE = 0.2
COARSEST_STEP = math.radians(2)
#: of a segment: the next begins behind
LAST_PART = 1 - 1e-12
FLIP = math.radians(179.9)
#: a block that turns the axis by more has at least so many samples: what happens in its middle counts
STRAIGHT, FEWEST = 1e-3, 4


@dataclass(frozen=True)
class Path:
    """Dense samples in order: tip (m,3), point b (m,3), and for each the index of its block (m,)."""

    tip: Floats
    point: Floats
    block: Ints

    def __len__(self) -> int:
        return len(self.tip)

    def slice(self, start: int, stop: int) -> Path:
        return Path(self.tip[start:stop], self.point[start:stop], self.block[start:stop])

    def joined(self, *others: Path) -> Path:
        parts = (self, *others)
        return Path(
            np.concatenate([part.tip for part in parts]),
            np.concatenate([part.point for part in parts]),
            np.concatenate([part.block for part in parts]),
        )


def length(vectors: Floats) -> Floats:
    """(...) lengths of (..., 3) vectors."""
    lengths: Floats = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
    return lengths


def unit(vectors: Floats) -> Floats:
    """(..., 3) vectors over their lengths."""
    directions: Floats = vectors / length(vectors)[..., None]
    return directions


def angle_between(a: Floats, b: Floats) -> Floats:
    """(...) rad between (..., 3) vectors, exact for small angles too."""
    angles: Floats = np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), np.sum(a * b, axis=-1))
    return angles


def axis_step(axis_length: float, limit: float) -> float:
    """Largest turn in one sample step, rad, so that the chord of b hides at most `SAGITTA_SHARE` of `limit`."""
    return min(COARSEST_STEP, math.sqrt(8 * SAGITTA_SHARE * limit / axis_length))


def fastest_turn(turn: Floats | float) -> Any:
    """Rad per block, in its middle, of a direction that runs linearly between two at the angle `turn`."""
    return 2 * np.tan(np.minimum(turn, FLIP) / 2)


def curve_point(curve: Curve, parameters: Floats) -> Floats:
    """(m, 6) tip and axis point of a rational cubic at the parameters."""
    weights = np.array(curve.weights)[:, None]
    homogeneous = np.concatenate((np.array(curve.points) * weights, weights), axis=1)
    values = BSpline(KNOT_VECTORS[len(curve.points)], homogeneous, 3)(parameters)
    return values[:, :6] / values[:, 6:]


def arc_points(arc: Arc, step: float) -> Floats:
    """(m, 3) points of an arc in R form, the shorter way, the third coordinate linear; without its start."""
    first, second, third = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}[arc.plane]
    start, end = np.array(arc.start[:3]), np.array(arc.end[:3])
    chord = np.array([end[first] - start[first], end[second] - start[second]])
    length = float(np.hypot(*chord))
    height = math.sqrt(max(0.0, arc.radius**2 - length**2 / 4))
    left = np.array([-chord[1], chord[0]]) / length
    middle = np.array([start[first], start[second]]) + chord / 2
    centre = middle + (-left if arc.clockwise else left) * height
    sweep = 2 * math.asin(min(1.0, length / 2 / arc.radius)) * (-1 if arc.clockwise else 1)
    begin = math.atan2(start[second] - centre[1], start[first] - centre[0])
    part = np.arange(1, (n := max(8, math.ceil(abs(sweep) / step))) + 1) / n
    points = np.empty((n, 3))
    points[:, first] = centre[0] + arc.radius * np.cos(begin + sweep * part)
    points[:, second] = centre[1] + arc.radius * np.sin(begin + sweep * part)
    points[:, third] = start[third] + (end[third] - start[third]) * part
    points[-1] = end
    return points


def _turned(start: Floats, end: Floats, part: Floats, turn: str) -> Floats:
    """Direction between vectors at the parts: linear vectors, or a great circle at constant rate."""
    if turn == "vector":
        return unit(start + (end - start) * part)
    angle = angle_between(start, end)[:, None]
    sine = np.where(angle > 1e-6, np.sin(angle), 1.0)
    near = np.where(angle > 1e-6, np.sin((1 - part) * angle) / sine, 1 - part)
    far = np.where(angle > 1e-6, np.sin(part * angle) / sine, part)
    return unit(near * unit(start) + far * unit(end))


def written_path(
    written: Written, axis_length: float, limit: float, turn: str = "vector", *, rapids: bool = False
) -> list[Path]:
    """Feed motion between rapids: one `Path` per rapid, its end position first.

    Parameters
    ----------
    axis_length : float, mm
        H of b = tip + H·axis.
    limit : float, mm
        The tolerance that will be asked for: samples are close enough to judge it.
    turn : {"vector", "great circle"}
        How the control turns the axis inside a G1 block with tool vectors.
    rapids : bool
        Whether rapids are part of the path: then there is one, from the first position to the last.
    """
    step = axis_step(axis_length, limit)
    parts = [_line_path(written, axis_length, step, turn)]
    starts = []
    for index, block in enumerate(written.blocks):
        if isinstance(block, Curve):
            six = curve_point(block, CURVE_PARAMETERS)[1:]
            parts.append(_path(six[:, :3], six[:, 3:] - six[:, :3], axis_length, index))
        elif isinstance(block, Arc):
            tip = arc_points(block, math.sqrt(8 * SAGITTA_SHARE * limit / block.radius))
            end = np.array(block.end)
            axis = end[3:] - end[:3] if written.form == "g6.2" else end[3:]
            parts.append(_path(tip, np.broadcast_to(axis, tip.shape), axis_length, index))
        elif isinstance(block, Line) and ((block.rapid and not rapids) or block.start is None):
            starts.append(index)
    whole = parts[0].joined(*parts[1:])
    order = np.argsort(whole.block, kind="stable")
    whole = Path(whole.tip[order], whole.point[order], whole.block[order])
    # a rapid belongs to a run with its end only
    first = np.searchsorted(whole.block, starts, side="right") - 1
    last = np.append(np.searchsorted(whole.block, starts[1:], side="left"), len(whole))
    return [whole.slice(*run) for run in zip(first.tolist(), last.tolist(), strict=True)]


def _path(tip: Floats, direction: Floats, axis_length: float, index: int) -> Path:
    return Path(tip, tip + axis_length * unit(direction), np.full(len(tip), index, np.int64))


def _line_path(written: Written, axis_length: float, step: float, turn: str) -> Path:
    """Samples of every straight block, its end included and its start not; all blocks at once."""
    lines = [(index, block) for index, block in enumerate(written.blocks) if isinstance(block, Line)]
    end = np.array([block.end for _, block in lines]).reshape(-1, 6)
    start = np.array([block.start or block.end for _, block in lines]).reshape(-1, 6)
    if written.form == "g6.2":  # only the direction counts; both ends of it run linearly
        first, last = start[:, 3:] - start[:, :3], end[:, 3:] - end[:, :3]
    else:
        first, last = start[:, 3:], end[:, 3:]
    turn_by = angle_between(first, last)
    # between opposite vectors there is no way to turn: the ends alone count
    count = np.where(turn_by < FLIP, np.ceil(turn_by / step), 0).astype(int)
    count = np.maximum(count, np.where((turn_by > STRAIGHT) & (turn_by < FLIP), FEWEST, 1))
    offset = np.concatenate(([0], np.cumsum(count)))
    row = np.repeat(np.arange(len(lines)), count)
    part = ((np.arange(offset[-1]) - offset[row] + 1) / count[row])[:, None]
    tip = start[row, :3] + (end - start)[row, :3] * part
    axis = _turned(first[row], last[row], part, "vector" if written.form == "g6.2" else turn)
    return Path(tip, tip + axis_length * axis, np.array([index for index, _ in lines], dtype=np.int64)[row])


@dataclass(frozen=True)
class Original:
    """Ruled motion through n poses: tips A (n,3) and unit axes O (n,3)."""

    tip: Floats
    axis: Floats

    def __len__(self) -> int:
        return len(self.tip)

    def at(self, parameter: Floats, axis_length: float) -> tuple[Floats, Floats]:
        """Tip and b (m,3) at parameters pose + fraction (m,), each from 0 to n - 1."""
        pose = np.clip(np.floor(parameter).astype(int), 0, max(0, len(self) - 2))
        after = np.minimum(pose + 1, len(self) - 1)
        part = (parameter - pose)[:, None]
        tip = self.tip[pose] + (self.tip[after] - self.tip[pose]) * part
        axis = unit(self.axis[pose] + (self.axis[after] - self.axis[pose]) * part)
        return tip, tip + axis_length * axis

    def feet(self, segment: Ints, part: Floats, path: Path, axis_length: float, steps: int) -> Floats:
        """Parts of segments nearest to samples (m,), tip and b together, by steps of Gauss and Newton from parts."""
        start, along = self.tip[segment], self.tip[segment + 1] - self.tip[segment]
        first, turning = self.axis[segment], self.axis[segment + 1] - self.axis[segment]
        for _ in range(steps):
            chord = first + turning * part[:, None]
            size = length(chord)[:, None]
            axis = chord / size
            tip = start + along * part[:, None]
            across = axis_length * (turning - axis * np.einsum("ij,ij->i", axis, turning)[:, None]) / size
            slope = along + across  # of b
            square = np.einsum("ij,ij->i", along, along) + np.einsum("ij,ij->i", slope, slope)
            towards = np.einsum("ij,ij->i", path.tip - tip, along)
            towards += np.einsum("ij,ij->i", path.point - tip - axis_length * axis, slope)
            # short of 1, which would be the next segment to `at`
            part = np.clip(part + towards / np.where(square > 0, square, 1.0), 0.0, LAST_PART)
        return part

    def dense(self, axis_length: float, limit: float) -> tuple[Floats, Floats]:
        """Tip polyline (n,3) and finely sampled path of b (m,3)."""
        if len(self) < 2:
            return self.tip, self.tip + axis_length * self.axis
        step = axis_step(axis_length, limit * 0.005)
        count = np.maximum(1, np.ceil(fastest_turn(angle_between(self.axis[:-1], self.axis[1:])) / step)).astype(int)
        parts = [pose + np.arange(n) / n for pose, n in enumerate(count)]
        return self.tip, self.at(np.append(np.concatenate(parts), len(self) - 1.0), axis_length)[1]
