"""Points on the surface that a moving tool leaves: its envelope, by closed form.

On the circle of height h and radius ρ the points of the envelope are those whose velocity lies in the tool surface.
With the outward normal N = cos ψ·n − sin ψ·O (n the radial unit vector, ψ the drop of the normal) and the tool turning
without spin, N·velocity = 0 becomes

    n · [cos ψ (A′ + h O′) + ρ sin ψ O′] = sin ψ (O · A′),

an equation p cos φ + q sin φ = c for the angle of n about the axis: two points, left and right of the motion, or none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cornersmooth.arrays.vectors import dot, norm
from cornersmooth.geometry.tool import Tool
from cornersmooth.model import Floats, Ints
from cornersmooth.surface.motion import RuledMotion

#: a step that is shorter, mm, has no direction
_NO_WAY = 1e-12


@dataclass(frozen=True)
class EnvelopePoints:
    """Points on an envelope, k of them."""

    #: (k, 3): mm; outward unit normal of the tool, so into the material
    point: Floats
    normal: Floats
    station: Ints  #: (k,): where along the path, counted from 0
    level: Ints  #: (k,): which point of the tool's profile, from the lowest
    side: Ints  #: 0 left of the motion, seen against the tool axis, 1 right
    line: Ints  #: (k,): CL line

    def __len__(self) -> int:
        return len(self.station)


def envelope_points(
    motion: RuledMotion, tool: Tool, edge: float, *, levels: int = 7, stations: int = 2000
) -> EnvelopePoints:
    """Points on the envelope of a motion, up to the cutting `edge`, mm, over the tip.

    There are `levels` points on the flank, and as many on a corner arc, at about `stations` places along the path:
    middles of segments, and the corners between them, where the normal is that halfway between both sides.
    """
    out, up, drop = _levels(tool, edge, levels)
    middle, corner = _stations(motion, stations)
    sides = [_normals(motion, middle, np.full(len(middle), 0.5), out, up, drop)]
    place = [motion.at(middle, np.full(len(middle), 0.5))]
    order = [2 * middle]
    if len(corner):
        before = _normals(motion, corner - 1, np.ones(len(corner)), out, up, drop)
        after = _normals(motion, corner, np.zeros(len(corner)), out, up, drop)
        both = before + after
        size = norm(both)[..., None]
        sides.append(np.divide(both, size, out=np.full_like(both, np.nan), where=size > 1e-6))
        place.append(motion.at(corner, np.zeros(len(corner))))
        order.append(2 * corner - 1)
    normal = np.concatenate(sides)  # (stations, sides, levels, 3)
    tip, axis = (np.concatenate(parts) for parts in zip(*place, strict=True))
    key = np.concatenate(order)
    rank = np.argsort(key, kind="stable")
    normal, tip, axis, key = normal[rank], tip[rank], axis[rank], key[rank]
    centre = tip[:, None] + up[:, None] * axis[:, None]
    point = centre[:, None] + out[:, None] * normal
    outward = np.sqrt(1.0 - drop * drop)[:, None] * normal - drop[:, None] * axis[:, None, None]
    there = np.isfinite(point).all(axis=-1)
    station, side, level = np.nonzero(there)
    return EnvelopePoints(
        point=point[there],
        normal=outward[there],
        station=station,
        level=level,
        side=side,
        line=motion.line[(key + 1) // 2][station] if len(key) else np.zeros(0, np.int64),
    )


def _levels(tool: Tool, edge: float, levels: int) -> tuple[Floats, Floats, Floats]:
    low = tool.side_from
    # in the middle of bands: an edge at the lower end belongs to the bottom as well
    flank = low + (edge - low) * (np.arange(levels) + 0.5) / levels if edge > low else np.zeros(0)
    arc = np.zeros(0)
    if tool.corner_radius > 0.0:
        lowest, highest = np.radians(90.0 - tool.tip_angle), np.radians(tool.taper)
        arc = np.sin(np.linspace(lowest, highest, levels + 1)[: levels + (not len(flank))])
        arc = arc[1:] if tool.centre_out == 0.0 else arc  # a ball's lowest point belongs to both sides
    elif not len(flank):
        flank = np.array([low])
    return tool.profile(arc, flank)


def _stations(motion: RuledMotion, stations: int) -> tuple[Ints, Ints]:
    """Segments whose middles, and segments at whose starts points are taken: evenly among all."""
    every = np.arange(len(motion))
    corner = every[motion.joined]
    few = max(stations // 2, 1)
    return tuple(  # type: ignore[return-value]
        rows if len(rows) <= few else rows[np.unique(np.linspace(0, len(rows) - 1, few).astype(np.int64))]
        for rows in (every, corner)
    )


def _normals(motion: RuledMotion, segment: Ints, share: Floats, out: Floats, up: Floats, drop: Floats) -> Floats:
    """Radial unit vectors (s, 2, l, 3) of the envelope's points, left and right; NaN where there is none."""
    tip, axis = motion.tip[segment], motion.axis[segment]
    way = tip[:, 1] - tip[:, 0]
    leaning = axis[:, 0] + share[:, None] * (axis[:, 1] - axis[:, 0])
    length = norm(leaning)[:, None]
    o = leaning / length
    turn = (axis[:, 1] - axis[:, 0]) / length
    turn = turn - dot(turn, o)[:, None] * o
    cosine = np.sqrt(1.0 - drop * drop)
    lever = (cosine * up + out * drop)[:, None]
    wanted = cosine[:, None] * way[:, None] + lever * turn[:, None]  # (s, l, 3)
    along = drop * dot(way, o)[:, None]
    flat = wanted - dot(wanted, o[:, None])[..., None] * o[:, None]
    size = norm(flat)
    size = np.where(size > _NO_WAY, size, np.nan)
    ahead, share_ahead = flat / size[..., None], along / size
    with np.errstate(invalid="ignore"):
        share_aside = np.sqrt(1.0 - share_ahead**2)  # NaN where the whole circle goes ahead or behind
    left = np.cross(o[:, None], ahead)
    sides = [share_ahead[..., None] * ahead + sign * share_aside[..., None] * left for sign in (1.0, -1.0)]
    return np.stack(sides, axis=1)
