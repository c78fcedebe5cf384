"""Arcs and helices as points."""

from __future__ import annotations

import math

import numpy as np

from cornersmooth.model import Arcs, Floats, Program


def arc_points(program: Program, index: int, chord: float) -> Floats:
    """End points of the lines that stand for one arc or helix, within `chord` of it: (m, 3) mm."""
    arcs: Arcs = program.arcs
    pose = int(arcs.pose[index])
    start, end, normal = program.tip[pose - 1], program.tip[pose], arcs.normal[index]
    radius_vector = start - arcs.centre[index]
    radius_vector = radius_vector - (radius_vector @ normal) * normal
    radius = float(np.linalg.norm(radius_vector))
    sweep = float(arcs.sweep[index])
    step = 2.0 * math.acos(max(-1.0, 1.0 - min(chord / radius, 1.0))) if radius > 0.0 else math.pi
    number = max(1, math.ceil(sweep / min(step, math.pi / 2.0) - 1e-9))
    share = np.arange(1, number + 1) / number
    angle = sweep * share[:, None]
    side = np.cross(normal, radius_vector)
    turned = radius_vector * np.cos(angle) + side * np.sin(angle)
    # what rounding in the file leaves between the turned start and the end is spread over the arc, with the helix
    closing = (end - start) - (turned[-1] - radius_vector)
    points: Floats = start + (turned - radius_vector) + share[:, None] * closing
    points[-1] = end
    return points
