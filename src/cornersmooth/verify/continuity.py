"""How smoothly the written elements follow one another: jumps of tangent and curvature, and the shortest element."""

from __future__ import annotations

import numpy as np

from cornersmooth.model import Bools, Floats, Ints
from cornersmooth.nc_reader.curves import CurveGroup, groups
from cornersmooth.nc_reader.elements import Element, Elements
from cornersmooth.verify.findings import Findings
from cornersmooth.verify.match import Match
from cornersmooth.verify.nearest import largest_square


def measure_continuity(match: Match, found: Findings) -> None:
    """Take down the largest jumps and the shortest element."""
    element, cosine, curved, jump = _jumps(match)
    _note(match, found, "tangent_jump", -cosine, element)
    _note(match, found, "curvature_jump", jump, curved)
    # a block in rotary words may have become several elements: its length is from its start to its end
    last, first = match.motion.last, match.first
    lines = match.nc.line[first : first + len(last)]
    chosen = np.flatnonzero(np.append(lines[1:] != lines[:-1], True))
    ends = last[chosen]
    six = match.six[ends] if len(ends) < len(match.six) else match.six
    square = largest_square((six[1:] - six[:-1]).T)
    square[(square == 0) | ~match.on[ends[1:]] | ~match.on[ends[:-1]]] = np.inf
    square[match.section[ends[1:]] != match.section[ends[:-1]]] = np.inf
    _note(match, found, "shortest", -np.sqrt(square), chosen[1:] + first)


def _note(match: Match, found: Findings, name: str, values: Floats, element: Ints) -> None:
    """Take down the largest of the values of elements."""
    if len(values):
        k = [int(np.argmax(values))]
        place = match.place[match.motion.last[element[k] - match.first]]
        found.note(name, values[k], match.cl_lines(np.floor(place) + 1.0), match.nc.line[element[k]])


def _jumps(match: Match) -> tuple[Ints, Floats, Ints, Floats]:
    """Jumps between neighbouring feed elements of a batch.

    Returns the elements (k,) behind the joints and the cosines of the angles between the tangents; those (c,) behind
    joints of which at least one side is a curve or an arc, and the differences of the curvatures there, 1/mm.
    """
    nc, lead = match.nc, int(match.continued)  # an element in front, if the batch begins in a stretch
    first = match.first - lead
    last = match.first + len(match.motion.last) - 1
    part = slice(first, last + 1)
    tip, kind = nc.tip[part], nc.kind[part]
    count = len(tip)
    leave = np.zeros((count, 3))
    leave[1:] = tip[1:] - tip[:-1]
    arrive = leave
    bend_in = bend_out = np.zeros(count)
    bent: Bools = (kind == Element.ARC) | (kind == Element.CURVE)
    if bent.any():
        arrive, bend_in, bend_out = leave.copy(), np.zeros(count), np.zeros(count)
        inside = (nc.curves.element >= first + lead) & (nc.curves.element <= last)
        for group in groups(nc.curves, np.flatnonzero(inside)):
            _add_curves(nc, group, first, (leave, bend_out), (arrive, bend_in))
        _add_arcs(nc, first, last, leave, arrive, bend_in, bend_out)
    end = match.motion.last
    feeding = np.zeros(count, np.bool_)
    stretch = match.section[end]
    feeding[lead + 1 :] = match.feeding
    stretch = np.concatenate((stretch[:lead], stretch))
    if lead:
        feeding[lead] = True
    size_in = np.sqrt(np.einsum("ij,ij->i", arrive, arrive))
    size_out = size_in if arrive is leave else np.sqrt(np.einsum("ij,ij->i", leave, leave))
    moving = np.flatnonzero(feeding & (size_in > 0) & (size_out > 0))
    joined = stretch[moving[1:]] == stretch[moving[:-1]]
    before, behind = moving[:-1][joined], moving[1:][joined]
    cosine = np.einsum("ij,ij->i", arrive.take(before, axis=0), leave.take(behind, axis=0)) / (
        size_in[before] * size_out[behind]
    )
    curved = bent[before] | bent[behind]
    jump = np.abs(bend_in[before[curved]] - bend_out[behind[curved]])
    return behind + first, np.clip(cosine, -1.0, 1.0), behind[curved] + first, jump


def _curvature(slope: Floats, bend: Floats) -> Floats:
    speed = np.sqrt(np.einsum("ij,ij->i", slope, slope))
    cross = np.cross(slope, bend)
    size = np.sqrt(np.einsum("ij,ij->i", cross, cross))
    return np.divide(size, speed**3, out=np.zeros_like(speed), where=speed > 0)


def _add_curves(
    nc: Elements, group: CurveGroup, first: int, leave: tuple[Floats, Floats], arrive: tuple[Floats, Floats]
) -> None:
    """Put tangents and curvatures at both ends of curves in their places."""
    at = nc.curves.element[group.index] - first
    for u, (tangent, bend) in ((group.spans[0], leave), (group.spans[-1], arrive)):
        _, slope, second = group.jet(float(u), slice(0, 3))
        tangent[at] = slope
        bend[at] = _curvature(slope, second)


def _add_arcs(
    nc: Elements, first: int, last: int, leave: Floats, arrive: Floats, bend_in: Floats, bend_out: Floats
) -> None:
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
