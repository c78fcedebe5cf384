"""Which arcs are written as G2 and G3 or as curves, and how.

A circular block gives its end point and its radius; the control makes of them, and of the point it stands at, a circle
in the plane that is selected. So an arc is written that way where its axis is a coordinate axis of the words, where
tool axis and rotary axes stand, and where the circle through the rounded numbers is within the tolerance of the arc.
Where F counts in the plane of the circle alone, it must not rise by more than `STEEPEST`: the tool would be too fast.
Where words of a second point would have to move with the tip, arcs are curves. All others become lines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays import dot, norm
from cornersmooth.geometry.arcs import (
    FIRST_PLANE,
    PLANES,
    arc_lines,
    arc_points,
    arc_radii,
    arc_weights,
    curve_deviation,
    divided,
)
from cornersmooth.model import Bools, FeedMode, Floats, Ints, Keep, Program
from cornersmooth.nc.form import Form
from cornersmooth.nc.planes import Planes, turned_part
from cornersmooth.settings import Settings
from cornersmooth.smoothing.sampling import ArcBlocks
from cornersmooth.text import to_ticks

#: largest turn of one circular block: in R form a control cannot tell which way to go near 180 degrees
_LARGEST_SWEEP = math.radians(120.0)

#: mm; a radius beyond is a straight line to most controls, or too long a number
_LARGEST_RADIUS = 1e5

#: shortest chord of a circular block in steps of the last digit: rounding turns the direction of a shorter one too far
_SHORTEST_CHORD = 20

#: how far an arc's axis may lean from a coordinate axis; the deviation is measured besides
_UPRIGHT = 1e-6

#: rad; slope up to which an arc rises where F counts in its plane alone: the tool is 2 % faster there than F says, less
#: what the rounding of its numbers may add
STEEPEST = math.acos(1.0 / 1.0199)

#: curve styles with weights
_RATIONAL = ("g6.2", "bspline")

#: part of the tolerance that curves may use, and how often their number is doubled
_MOST_OF_TOLERANCE, _ROUNDS = 0.9, 4

#: shares of a block at which its deviation is measured
_PROBES = np.linspace(0.0, 1.0, 9)


@dataclass(frozen=True)
class Circles(ArcBlocks):
    """How the arcs of a program are written, k rows."""

    plane: Ints  #: (k,) 17, 18 or 19
    clockwise: Bools  #: (k,) G2 rather than G3, seen from the positive end of the axis that stands on the plane
    radius: Ints  #: (k,) in steps of the last written digit
    pose: Ints  #: (k,) that each leads to, ascending

    def of(self, move: Ints) -> Ints | None:
        """(r,) circle that rows of moves are on, -1 for none; None where the program has none."""
        circular = np.flatnonzero((self.blocks > 0) & ~self.curved)
        if not len(circular):
            return None
        found = circular[np.minimum(np.searchsorted(self.pose[circular], move), len(circular) - 1)]
        return np.where(self.pose[found] == move, found, -1)


def plan_circles(
    program: Program,
    settings: Settings,
    form: Form,
    planes: Planes,
    rotary: tuple[Floats, Bools] | None = None,
) -> Circles:
    """Choose the arcs that a form can write as circles or curves within the tolerance, at the tip and the axis point.

    In a plane arcs are those of its own coordinates, and where X Y Z are axes of the machine, of what these make of the
    part. Without `rotary` words that a form has, arcs that might be circles are taken for such. They are angles (k, 2),
    degrees, in the order of the machine's axes, and (k,) whether these stand on all of an arc, and its blocks have
    feeds per minute.
    """
    arcs, of = program.arcs, planes.of[program.arcs.pose]
    frames, inside = planes.frames(arcs.pose), of >= 0
    turned = form.rotary & ~inside
    unknown = turned & (rotary is None) & (form.orientation == "machine")
    if rotary is not None and form.machine is not None and form.orientation == "machine":
        distinct, which = np.unique(rotary[0][turned], axis=0, return_inverse=True)
        parts = np.array([np.eye(3), *(turned_part(form.machine, angles) for angles in distinct)])
        frames[turned] = parts[1 + which.reshape(-1)]
    normal = _local(arcs.normal, frames)
    plane = np.array([2, 1, 0])[np.argmax(np.abs(normal), axis=1)] if len(arcs) else np.zeros(0, np.int64)
    height = np.take_along_axis(normal, PLANES[plane, 2][:, None], axis=1)[:, 0]
    radius = arc_radii(program)
    unit = program.mm_per_unit
    decimals = form.tip_decimals(program.units)
    ticks = to_ticks(np.minimum(radius, _LARGEST_RADIUS) / unit, decimals)
    digits = form.table.digits
    vectors = to_ticks(digits.vector_length * program.axis, digits.vector)
    modes = (form.mode, *(form.in_plane(upright=plane.upright) for plane in planes.planes))
    able = [(bool(mode.arc_directions), mode.circles, mode.circles_in_xy, mode.feed_in_plane) for mode in modes]
    flat, circular, in_xy, feed_in_plane = np.array(able)[of + 1].T
    keeps = inside | (vectors[arcs.pose] == vectors[arcs.pose - 1]).all(axis=1)
    if rotary is not None:
        keeps &= ~turned | (rotary[1] & _may_turn(form, rotary[0], plane))
    keeps &= (radius < _LARGEST_RADIUS) & (ticks > 0)
    offset = program.keep[arcs.pose] == Keep.CUTTER_COMPENSATION
    rise = np.abs(dot(program.tip[arcs.pose] - program.tip[arcs.pose - 1], arcs.normal))
    steep = rise > math.tan(STEEPEST) * radius * arcs.sweep
    fits = circular & keeps & ~(steep & feed_in_plane)
    # the plane of cutter compensation must not change under it, and it is XY
    fits &= unknown | (~(flat | in_xy | offset) | (plane == 0)) & (np.abs(height) > 1.0 - _UPRIGHT)
    blocks = np.where(fits, np.ceil(arcs.sweep / _LARGEST_SWEEP - 1e-9), 0.0).astype(np.int64)
    if fits.any():
        step = float(unit * 10.0**-decimals)
        tolerance = min(settings.tip_tolerance, settings.axis_point_tolerance)
        written: Floats = ticks.astype(np.float64) * step
        deviation = _deviation(program, blocks, PLANES[plane], height > 0.0, written, step, frames, flat)
        blocks[(deviation > tolerance) & ~unknown] = 0
    curved = np.zeros(len(blocks), np.bool_)
    weight = digits.weight if form.curve in _RATIONAL else None
    if form.curves:
        per_minute = program.feed_mode[arcs.pose] == FeedMode.PER_MINUTE  # PS1006: G06.2 under G95
        curves = _curves(program, settings, np.flatnonzero(keeps & per_minute & ~offset & (blocks == 0)), weight)
        curved = curves > 0
        blocks += curves
    return Circles(blocks, curved, weight, plane + FIRST_PLANE, height < 0.0, ticks, arcs.pose)


def _may_turn(form: Form, angles: Floats, plane: Ints) -> Bools:
    """(k,) whether tables stand at zero that would tilt the plane of an arc, where the control wants that."""
    free = np.ones(len(plane), np.bool_)
    if form.mode.circles_at_zero and form.machine is not None:
        for k, axis in enumerate(form.machine.axes[: len(form.machine.names)]):
            if axis.carrier == "table":
                across = np.abs(axis.unit[PLANES[plane, 2]]) < 1.0 - _UPRIGHT
                free &= ~across | (to_ticks(angles[:, k], form.table.digits.angle) == 0)
    return free


def _curves(program: Program, settings: Settings, rows: Ints, decimals: int | None) -> Ints:
    """(k,) curves of arcs `rows`, as many as the chord tolerance asks for; 0 where lines are no more rows."""
    chord = min(settings.chord, _MOST_OF_TOLERANCE * min(settings.tip_tolerance, settings.axis_point_tolerance))
    found = np.zeros(len(program.arcs), np.int64)
    found[rows] = np.ceil(program.arcs.sweep[rows] / _LARGEST_SWEEP - 1e-9)
    for _ in range(_ROUNDS):
        local, share = divided(found[rows])
        own = rows[local]
        part = 1.0 / found[own]
        weight = arc_weights(program.arcs.sweep[own] * part, decimals)
        deviation = np.zeros(len(found))
        np.maximum.at(deviation, own, curve_deviation(program, own, share - part, share, weight))
        if not (deviation > chord).any():
            break
        found[deviation > chord] *= 2
    found[(deviation > chord) | (4 * found >= arc_lines(program, settings))] = 0
    return found


def _deviation(
    program: Program,
    blocks: Ints,
    planes: Ints,
    counterclockwise: Bools,
    radius: Floats,
    step: float,
    frames: Floats,
    flat: Bools,
) -> Floats:
    """(k,) mm from the written circles to the arcs at equal shares; infinite for a block that is too short."""
    rows, share = divided(blocks)
    before = share - 1.0 / blocks[rows]

    def placed(at: Floats) -> Floats:
        """(b, 3) places of arcs along the axes of their planes, the one across last."""
        return np.take_along_axis(_local(arc_points(program, rows, at)[0], frames[rows]), planes[rows], axis=1)

    start, end = (step * np.rint(placed(at) / step) for at in (before, share))
    chord = end - start
    length = np.hypot(chord[:, 0], chord[:, 1])
    size, left = radius[rows], np.where(counterclockwise[rows], 1.0, -1.0)
    proper = (length >= _SHORTEST_CHORD * step) & (length < 2.0 * size)
    proper &= ~(flat[rows] & (np.rint(chord[:, 2] / step) != 0.0))
    across = np.stack((-chord[:, 1], chord[:, 0]), axis=1) / np.where(proper, length, 1.0)[:, None]
    rise = np.sqrt(np.maximum(size**2 - length**2 / 4.0, 0.0))
    to_centre = chord[:, :2] / 2.0 + (left * rise)[:, None] * across
    turn = 2.0 * left * np.arcsin(np.minimum(length / 2.0 / size, 1.0))
    worst, (x, y) = np.zeros(len(rows)), -to_centre.T
    for probe in _PROBES:
        cosine, sine = np.cos(turn * probe), np.sin(turn * probe)
        gone = np.stack((cosine * x - sine * y - x, sine * x + cosine * y - y, probe * chord[:, 2]), axis=1)
        worst = np.maximum(worst, norm(start + gone - placed(before + probe * (share - before))))
    worst[~proper] = np.inf
    deviation = np.zeros(len(blocks))
    np.maximum.at(deviation, rows, worst)
    return deviation


def _local(vectors: Floats, frames: Floats) -> Floats:
    """(k, 3) vectors in the coordinates of (k, 3, 3) frames."""
    return np.einsum("ki,kij->kj", vectors, frames)
