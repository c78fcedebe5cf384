"""Which arcs are written as G2 and G3, and how.

A circular block gives its end point and its radius; the control makes of them, and of the point it stands at, a circle
in the plane that is selected. So an arc is written that way where its axis is a coordinate axis and the tool axis
stays, and where the circle through the rounded numbers is within the tolerance of the arc; else it becomes lines.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.arrays.vectors import norm
from cornersmooth.geometry.arcs import arc_points, arc_radii, divided
from cornersmooth.model import Bools, Floats, Ints, Keep, Program
from cornersmooth.nc.form import Form
from cornersmooth.nc.planes import Planes
from cornersmooth.settings import Settings
from cornersmooth.smoothing.sampling import Rows
from cornersmooth.text import to_ticks

#: largest turn of one circular block: in R form a control cannot tell which way to go near 180 degrees
_LARGEST_SWEEP = math.radians(120.0)

#: mm; a radius beyond is a straight line to most controls, or too long a number
_LARGEST_RADIUS = 1e5

#: shortest chord of a circular block in steps of the last digit: rounding turns the direction of a shorter one too far
_SHORTEST_CHORD = 20

#: how far an arc's axis may lean from a coordinate axis; the deviation is measured besides
_UPRIGHT = 1e-6

#: shares of a block at which its deviation is measured
_PROBES = np.linspace(0.0, 1.0, 9)

#: axes of the planes G17, G18 and G19 in the order in which a right-handed turn about the third goes round:
#: X to Y about Z, Z to X about Y, Y to Z about X
PLANES = np.array([[0, 1, 2], [2, 0, 1], [1, 2, 0]])
FIRST_PLANE = 17


@dataclass(frozen=True)
class Circles:
    """How the arcs of a program are written, k rows."""

    blocks: Ints  #: (k,) circular blocks of each arc; 0 where it becomes lines
    plane: Ints  #: (k,) 17, 18 or 19
    clockwise: Bools  #: (k,) G2 rather than G3, seen from the positive end of the axis that stands on the plane
    radius: Ints  #: (k,) in steps of the last written digit


def plan_circles(program: Program, settings: Settings, form: Form, planes: Planes, upright: Bools) -> Circles:
    """Choose the arcs that a form can write as circles within the tolerance, at the tip and at the axis point.

    In a tilted plane arcs are those of its own coordinates. `upright` (n,) are poses of tools without tool tip control.
    """
    arcs = program.arcs
    frames, tilted = planes.frames(arcs.pose), planes.of[arcs.pose] >= 0
    normal = _local(arcs.normal, frames)
    plane = np.array([2, 1, 0])[np.argmax(np.abs(normal), axis=1)] if len(arcs) else np.zeros(0, np.int64)
    third = PLANES[plane, 2]
    height = np.take_along_axis(normal, third[:, None], axis=1)[:, 0]
    radius = arc_radii(program)
    unit = program.mm_per_unit
    decimals = form.tip_decimals(program.units)
    ticks = to_ticks(np.minimum(radius, _LARGEST_RADIUS) / unit, decimals)
    digits = form.table.digits
    vectors = to_ticks(digits.vector_length * program.axis, digits.vector)
    modes = [(upright[arcs.pose], form.upright), (tilted, form.plane)]
    flat, circular, in_xy = (
        np.full(len(tilted), value)
        for value in (bool(form.mode.motion.arc_directions), form.mode.circles, form.mode.circles_in_xy)
    )
    for here, mode in modes:
        if mode is not None:
            flat[here], circular[here] = bool(mode.motion.arc_directions), mode.circles
            in_xy[here] = mode.circles_in_xy
    fits = (
        circular
        & (~(flat | in_xy) | (plane == 0))
        & (np.abs(height) > 1.0 - _UPRIGHT)
        & (radius < _LARGEST_RADIUS)
        & (ticks > 0)
        & (tilted | (vectors[arcs.pose] == vectors[arcs.pose - 1]).all(axis=1))
        # the plane of cutter compensation must not change under it, and it is XY
        & ((plane == 0) | (program.keep[arcs.pose] != Keep.CUTTER_COMPENSATION))
    )
    blocks = np.where(fits, np.ceil(arcs.sweep / _LARGEST_SWEEP - 1e-9), 0.0).astype(np.int64)
    if fits.any():
        step = float(unit * 10.0**-decimals)
        tolerance = min(settings.tip_tolerance, settings.axis_point_tolerance)
        written: Floats = ticks.astype(np.float64) * step
        deviation = _deviation(program, blocks, PLANES[plane], height > 0.0, written, step, frames, flat)
        blocks[deviation > tolerance] = 0
    return Circles(blocks, plane + FIRST_PLANE, height < 0.0, ticks)


def with_arcs(rows: Iterator[Rows], program: Program, circles: Circles) -> Iterator[Rows]:
    """Rows with `Rows.arc`: all rows of a pose that an arc leads to are on it."""
    if not (circles.blocks > 0).any():
        yield from rows
        return
    own = np.full(len(program), -1, np.int64)
    own[program.arcs.pose] = np.where(circles.blocks > 0, np.arange(len(circles.blocks)), -1)
    for part in rows:
        yield replace(part, arc=own[part.move])


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
    """(k,) mm from the written circles to the arcs at equal shares; infinite for a block that is too short.

    Infinite, too, where the ends of an arc that has to be flat differ in height.
    """
    rows, share = divided(blocks)
    before = share - 1.0 / blocks[rows]
    frames = frames[rows]
    start, end = (step * np.rint(_local(arc_points(program, rows, at)[0], frames) / step) for at in (before, share))
    first, second, third = planes[rows].T
    own = np.arange(len(rows))
    chord = np.stack([end[own, axis] - start[own, axis] for axis in (first, second, third)], axis=1)
    length = np.hypot(chord[:, 0], chord[:, 1])
    size, left = radius[rows], np.where(counterclockwise[rows], 1.0, -1.0)
    proper = (
        (length >= _SHORTEST_CHORD * step)
        & (length < 2.0 * size)
        & ~(flat[rows] & (np.rint(chord[:, 2] / step) != 0.0))
    )
    safe = np.where(proper, length, 1.0)
    across = np.stack((-chord[:, 1], chord[:, 0]), axis=1) / safe[:, None]
    rise = np.sqrt(np.maximum(size**2 - length**2 / 4.0, 0.0))
    to_centre = chord[:, :2] / 2.0 + (left * rise)[:, None] * across
    turn = 2.0 * left * np.arcsin(np.minimum(length / 2.0 / size, 1.0))
    worst = np.zeros(len(rows))
    for probe in _PROBES:
        cosine, sine = np.cos(turn * probe), np.sin(turn * probe)
        x, y = -to_centre.T
        point = start.copy()
        point[own, first] += to_centre[:, 0] + cosine * x - sine * y
        point[own, second] += to_centre[:, 1] + sine * x + cosine * y
        point[own, third] += probe * chord[:, 2]
        arc, _ = arc_points(program, rows, before + probe * (share - before))
        worst = np.maximum(worst, norm(point - _local(arc, frames)))
    worst[~proper] = np.inf
    deviation = np.zeros(len(blocks))
    np.maximum.at(deviation, rows, worst)
    return deviation


def _local(vectors: Floats, frames: Floats) -> Floats:
    """(k, 3) vectors in the coordinates of (k, 3, 3) frames."""
    return np.einsum("ki,kij->kj", vectors, frames)
