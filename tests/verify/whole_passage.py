"""The decision of `cornersmooth.verify.passage` for two whole polylines."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from cornersmooth.model import Floats
from cornersmooth.verify.chain import Path, Sections
from cornersmooth.verify.free_space import Inner
from cornersmooth.verify.passage import Passage, Walk

#: own vertices that are looked at together
CHUNK = 8192


def whole_section(last: int, stop: int, *, open_end: bool = False) -> Sections:
    """All of both motions."""
    return Sections(np.array([0]), np.array([last]), np.array([0.0]), np.array([float(stop)]), open_end)


def passage(
    own: Floats,
    path: Floats,
    radius: float,
    *,
    own_bend: Floats | None = None,
    path_bend: Floats | None = None,
    inner: Inner | None = None,
    chunk: int = CHUNK,
) -> Passage:
    """Decide whether two polylines can be run beside each other within a radius, both forward only.

    Parameters
    ----------
    own, path : (n, 3h), (m + 1, 3h) float64, mm
        Vertices: h triples of coordinates, each of which has to keep the radius by itself: tips alone (h = 1), or tips
        and axis points (h = 2). At least one vertex each.
    radius : float, mm
    own_bend, path_bend : (n - 1,), (m,) float64, mm, optional
        By how much the motions may leave each segment: an eighth of the largest second derivative by its fraction.
        They are proved to be within the radius, not their chords.
    inner : callable, optional
        As of `Walk.take`; vertices are counted in `own`.
    chunk : int
        Own vertices that are looked at together; the verdict does not depend on it.

    Returns
    -------
    Passage
        ``passed`` is a proof. Time is about linear: 0.2 µs for a vertex where the polylines are near, 20 µs where what
        can be reached has to be worked out.
    """
    if len(path) == 1:
        path, path_bend = np.repeat(path, 2, axis=0), None
    if len(own) == 1:
        found = passage(np.repeat(own, 2, axis=0), path, radius, path_bend=path_bend)
        return Passage(found.place[:1], tuple(replace(one, row=0) for one in found.breaks[:1]), found.whole)
    walk = Walk(Path.of(path, path_bend), radius)
    bend = np.zeros(len(own) - 1) if own_bend is None else own_bend
    place, breaks, whole = [], [], True
    for first in range(0, len(own) - 1, chunk):
        rows = slice(first, min(first + chunk, len(own) - 1) + 1)
        sections = whole_section(rows.stop - rows.start - 1, len(path) - 1, open_end=rows.stop < len(own))
        within = None if inner is None else partial(_within, inner, rows)
        part = walk.take(own[rows], bend[rows.start : rows.stop - 1], sections, within)
        place.append(part.place[1 if first else 0 :])
        breaks += [replace(one, row=one.row + first) for one in part.breaks]
        whole = whole and part.whole
        if not whole:
            place.append(np.full(len(own) - rows.stop, np.nan))
            break
    return Passage(np.concatenate(place), tuple(breaks), whole)


def _within(inner: Inner, rows: slice, number: Floats) -> Floats:
    """Points at numbers of a chunk, which knows no others."""
    assert (number >= 0).all()
    assert (number <= rows.stop - rows.start - 1).all()
    return inner(number + rows.start)
