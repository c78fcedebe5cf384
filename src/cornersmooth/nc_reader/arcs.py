"""Circular blocks: centre, axis and sweep from what a text says, and points on them."""

from __future__ import annotations

import numpy as np

from cornersmooth.control.words import Table
from cornersmooth.model import Bools, Floats
from cornersmooth.nc_reader.elements import Problem

#: of circles in G17, G18, G19
_PLANE_NORMAL = {17: (0.0, 0.0, 1.0), 18: (0.0, 1.0, 0.0), 19: (1.0, 0.0, 0.0)}
#: rad: an arc about a centre that ends where it begins goes round once
_FULL_TURN = 2 * np.pi

#: how much the distances of both ends from the centre may differ: more is an alarm on most controls
_UNLIKE = 0.01


def circles(
    table: Table, before: Floats, end: Floats, counterclockwise: Bools, plane: int, problems: list[Problem]
) -> tuple[Floats, Floats, Floats]:
    """Circles of G2 and G3 by radius R or by centre I J K, in units of the text, in the plane 17, 18 or 19.

    `problems` takes CS520, an arc that does not reach its end, or whose ends are not as far from its centre.

    Returns
    -------
    centre, normal : (k, 3) float64
    sweep : (k,) float64
    """
    upright = np.array(_PLANE_NORMAL[plane])
    sense = np.where(counterclockwise, 1.0, -1.0)
    chord = end - before
    chord -= (chord @ upright)[:, None] * upright
    length = np.linalg.norm(chord, axis=1)
    across = np.cross(upright, chord)
    radius = table.column("R")
    by_radius = ~np.isnan(radius)
    half = np.divide(length, 2 * np.abs(radius), out=np.ones_like(length), where=by_radius & (radius != 0))
    # by so much of the radius a half circle may be missed because of printed digits
    slack = np.maximum(1e-6, np.divide(1e-3, np.abs(radius), out=np.zeros_like(length), where=radius != 0))
    for k in np.flatnonzero(by_radius & ((length == 0) | (half > 1 + slack))).tolist():
        text = f"an arc of radius {radius[k]:g} does not reach its end"
        problems.append(Problem("CS520", 0, int(table.line[k]), text))
    rise = np.sqrt(np.maximum(1 - half**2, 0)) * np.abs(np.nan_to_num(radius)) * np.sign(np.nan_to_num(radius))
    towards = np.divide(across, length[:, None], out=np.zeros_like(across), where=length[:, None] > 0)
    centre = before + chord / 2 + (sense * rise)[:, None] * towards
    offsets = np.stack([np.nan_to_num(table.column(letter)) for letter in "IJK"], axis=1)
    offsets -= (offsets @ upright)[:, None] * upright
    centre = np.where(by_radius[:, None], centre, before + offsets)
    first = np.linalg.norm(offsets, axis=1)
    last = np.linalg.norm(chord - offsets, axis=1)
    for k in np.flatnonzero(~by_radius & ((first == 0) | (np.abs(first - last) > _UNLIKE))).tolist():
        text = f"an arc about a centre {first[k]:g} from where it begins and {last[k]:g} from where it ends"
        problems.append(Problem("CS520", 0, int(table.line[k]), text))
    normals = sense[:, None] * upright
    return centre, normals, _sweep(before - centre, end - centre, normals, by_radius)


def _sweep(start: Floats, end: Floats, normal: Floats, by_radius: Bools) -> Floats:
    """Angle from start to end, right-handed about the normals; a full turn for a centre form that comes back."""
    sine = np.einsum("ij,ij->i", np.cross(start, end), normal)
    flat = start - np.einsum("ij,ij->i", start, normal)[:, None] * normal
    cosine = np.einsum("ij,ij->i", flat, end)
    angle = np.arctan2(sine, cosine) % _FULL_TURN
    return np.where(~by_radius & (angle == 0), _FULL_TURN, angle)


def arc_points(start: Floats, end: Floats, centre: Floats, normal: Floats, sweep: Floats, fraction: Floats) -> Floats:
    """Points of arcs at given fractions of their sweep.

    Parameters
    ----------
    start, end, centre, normal : (k, 3) float64
        The axis of each arc goes through `centre` along the unit vector `normal`.
    sweep : (k,) float64, rad
        Right-handed about `normal`.
    fraction : (k,) float64

    Returns
    -------
    (k, 3) float64
        What start, sweep and end contradict each other by (height of a helix, printed digits) grows evenly.
    """
    radius = start - centre
    radius = radius - np.einsum("ij,ij->i", radius, normal)[:, None] * normal
    across = np.cross(normal, radius)

    def turned(angle: Floats) -> Floats:
        return start + (np.cos(angle) - 1)[:, None] * radius + np.sin(angle)[:, None] * across

    rest = end - turned(sweep)
    return turned(fraction * sweep) + fraction[:, None] * rest
