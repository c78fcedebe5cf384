"""How smoothly the written elements follow one another: jumps of tangent and curvature of the tip path."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.verify.blocks import Block, Matcher
from cornersmooth.verify.ncprogram import Element


def joint_jumps(matcher: Matcher, block: Block) -> tuple[Ints, Floats, Ints, Floats]:
    """Jumps between neighbouring feed elements of a block.

    Returns
    -------
    element : (k,) int64
        Elements behind the joints.
    cosine : (k,) float64
        Of the angle between the tangents.
    curved : (c,) int64
        Elements behind joints of which at least one side is a curve or an arc.
    curvature : (c,) float64, 1/mm
        Difference of the curvatures there.
    """
    nc, first = matcher.nc, block.written.first
    last = first + len(block.written.trail.last) - 1
    part = slice(first, last + 1)
    tip, kind = nc.tip[part], nc.kind[part]
    count = len(tip)
    leave = np.zeros((count, 3))
    leave[1:] = tip[1:] - tip[:-1]
    arrive = leave
    bend_in = bend_out = np.zeros(count)
    if block.written.curves or (kind == Element.ARC).any():
        arrive, bend_in, bend_out = leave.copy(), np.zeros(count), np.zeros(count)
        _add_curves(matcher, block, leave, arrive, bend_in, bend_out)
        _add_arcs(matcher, first, last, leave, arrive, bend_in, bend_out)
    end = block.written.trail.last
    feeding = np.zeros(count, np.bool_)
    feeding[1:] = block.on[end[1:]] & block.on[end[:-1]] & (block.piece[end[1:]] == block.piece[end[:-1]])
    size_in = np.sqrt(np.einsum("ij,ij->i", arrive, arrive))
    size_out = size_in if arrive is leave else np.sqrt(np.einsum("ij,ij->i", leave, leave))
    moving = np.flatnonzero(feeding & (size_in > 0) & (size_out > 0))
    joined = block.piece[end[moving[1:]]] == block.piece[end[moving[:-1]]]
    before, behind = moving[:-1][joined], moving[1:][joined]
    cosine = np.einsum("ij,ij->i", arrive.take(before, axis=0), leave.take(behind, axis=0)) / (
        size_in[before] * size_out[behind]
    )
    bent = _bent(kind)
    curved = bent[before] | bent[behind]
    jump = np.abs(bend_in[before[curved]] - bend_out[behind[curved]])
    return behind + first, np.clip(cosine, -1.0, 1.0), behind[curved] + first, jump


def _bent(kind: NDArray[np.uint8]) -> Bools:
    bent: Bools = (kind == Element.ARC) | (kind == Element.CURVE)
    return bent


def _curvature(slope: Floats, bend: Floats) -> Floats:
    speed = np.sqrt(np.einsum("ij,ij->i", slope, slope))
    cross = np.cross(slope, bend)
    size = np.sqrt(np.einsum("ij,ij->i", cross, cross))
    curvature: Floats = np.divide(size, speed**3, out=np.zeros_like(speed), where=speed > 0)
    return curvature


def _add_curves(
    matcher: Matcher, block: Block, leave: Floats, arrive: Floats, bend_in: Floats, bend_out: Floats
) -> None:
    for group in block.written.curves:
        at = matcher.nc.curves.element[group.index] - block.written.first
        for u, tangent, bend in ((group.spans[0], leave, bend_out), (group.spans[-1], arrive, bend_in)):
            _, slope, second = group.jet(float(u), slice(0, 3))
            tangent[at] = slope
            bend[at] = _curvature(slope, second)


def _add_arcs(
    matcher: Matcher, first: int, last: int, leave: Floats, arrive: Floats, bend_in: Floats, bend_out: Floats
) -> None:
    nc = matcher.nc
    rows = np.flatnonzero((nc.arcs.element > first) & (nc.arcs.element <= last))
    element = nc.arcs.element[rows]
    centre, normal, sweep = nc.arcs.centre[rows], nc.arcs.normal[rows], nc.arcs.sweep[rows][:, None]
    height = np.einsum("ij,ij->i", nc.tip[element] - nc.tip[element - 1], normal)[:, None] * normal
    for end, tangent, bend in ((nc.tip[element - 1], leave, bend_out), (nc.tip[element], arrive, bend_in)):
        radius = end - centre
        radius -= np.einsum("ij,ij->i", radius, normal)[:, None] * normal
        slope = np.cross(normal, radius) * sweep + height
        tangent[element - first] = slope
        bend[element - first] = _curvature(slope, -radius * sweep**2)
