"""How smoothly the written elements follow one another: the largest change of direction, and the shortest element."""

from __future__ import annotations

from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements
from cornersmooth.nc_reader.tool import written_at
from cornersmooth.verify.match import Match
from cornersmooth.verify.motions import largest_square
from cornersmooth.verify.result import Findings

#: fraction of a bent element from whose first and last two parts its directions are worked out
_SHORT: Final = 1e-4


def measure_continuity(match: Match, found: Findings) -> None:
    """Take down the largest change of direction and the shortest element."""
    nc, first, last = match.nc, match.first, match.motion.last
    element, cosine = _changes(match)
    _note(match, found, "tangent_jump", -cosine, element)
    # a block in rotary words may have become several elements: its length is from its start to its end
    lines = nc.line[first : first + len(last)]
    chosen = np.flatnonzero(np.append(lines[1:] != lines[:-1], True))
    ends = last[chosen]
    six = match.six[ends] if len(ends) < len(match.six) else match.six
    square = largest_square((six[1:] - six[:-1]).T)
    square[(square == 0) | ~match.on[ends[1:]] | ~match.on[ends[:-1]]] = np.inf
    run = match.runs[0][ends]
    square[run[1:] != run[:-1]] = np.inf
    _note(match, found, "shortest", -np.sqrt(square), chosen[1:] + first)


def _note(match: Match, found: Findings, name: str, values: Floats, element: Ints) -> None:
    """Take down the largest of the values of elements."""
    if len(values):
        k = [int(np.argmax(values))]
        place = match.place[match.motion.last[element[k] - match.first]]
        found.note(name, values[k], match.cl_lines(np.floor(place) + 1.0), match.nc.line[element[k]])


def _changes(match: Match) -> tuple[Ints, Floats]:
    """(k,) elements behind joints of neighbouring feed elements, and cosines of the angles between the directions."""
    nc, lead = match.nc, int(match.continued)  # an element in front, if the batch begins in a stretch
    first, end = match.first - lead, match.motion.last
    part = slice(first, match.first + len(end))
    leave = np.diff(nc.tip[part], axis=0, prepend=nc.tip[first : first + 1])
    arrive, kind = leave, nc.kind[part]
    bent = np.flatnonzero((kind == Element.ARC) | (kind == Element.CURVE))
    if len(bent := bent[bent > 0]):
        arrive = leave.copy()
        leave[bent], arrive[bent] = _directions(nc, bent + first)
    feeding = np.concatenate((np.zeros(1, np.bool_), np.ones(lead, np.bool_), match.feeding))
    stretch = match.section[end]  # that in which the next element begins
    stretch = np.concatenate((stretch[: 1 + lead], stretch[:-1]))
    size_in, size_out = (np.linalg.norm(way, axis=1) for way in (arrive, leave))
    moving = np.flatnonzero(feeding & (size_in > 0) & (size_out > 0))
    joined = stretch[moving[1:]] == stretch[moving[:-1]]
    before, behind = moving[:-1][joined], moving[1:][joined]
    cosine = np.einsum("ij,ij->i", arrive[before], leave[behind]) / (size_in[before] * size_out[behind])
    return behind + first, np.clip(cosine, -1.0, 1.0)


def _directions(nc: Elements, element: Ints) -> tuple[Floats, Floats]:
    """(k, 3) ways of the tip where bent elements begin, and where they end, from a parabola through three points."""
    found = []
    for end, side in ((0.0, 1.0), (1.0, -1.0)):
        share = (np.full(len(element), end + side * part * _SHORT) for part in range(3))
        here, near, far = (written_at(nc, element, one)[0] for one in share)
        found.append(side * (4.0 * near - far - 3.0 * here) / (2.0 * _SHORT))
    return found[0], found[1]
