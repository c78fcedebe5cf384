"""Runs measured densely with scipy's splines: shares nothing with the code on trial."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from cornersmooth.smoothing.runs.polylines import Polylines
from cornersmooth.smoothing.runs.solving import RunCurves
from oracle.chains import random_chains
from oracle.motion import unit

Floats = NDArray[np.float64]


def through(*runs: Floats, step: float = 1e-5) -> Polylines:
    """Runs through points (n, 6), each."""
    return Polylines.through(np.concatenate(runs), np.array([len(run) for run in runs]), step)


def random_runs(seed: int, count: int, corners: int, axis_length: float, *, tame: bool = False) -> Polylines:
    """Runs from random chains of every character, repeated poses left out."""
    runs = []
    for chain in random_chains(seed, count, corners, tame=tame):
        points = np.hstack((chain.tip, chain.tip + axis_length * unit(chain.axis)))
        points = points[np.concatenate(([True], np.abs(np.diff(points, axis=0)).max(axis=1) > 1e-6))]
        if len(points) > 2:
            runs.append(points)
    return through(*runs)


def spline_of(curves: RunCurves, run: int) -> BSpline:
    """scipy's spline of a run, tip and axis point."""
    splines = curves.splines
    knots = splines.knot[splines.first[run] : splines.first[run + 1]]
    control = curves.control[splines.control_first[run] : splines.control_first[run + 1]]
    return BSpline(np.concatenate(([knots[0]] * 3, knots, [knots[-1]] * 3)), control, 3)


def deviation(curves: RunCurves, run: int, axis_length: float, per_piece: int = 9) -> tuple[float, float]:
    """Largest distance at a common parameter of the tips, and of the points at constant H on the axes."""
    lines, splines = curves.lines, curves.splines
    own = slice(lines.first[run], lines.first[run + 1])
    s, points = lines.s[own], lines.point[own]
    cuts = np.unique(np.concatenate((s, splines.knot[splines.first[run] : splines.first[run + 1]])))
    at = (cuts[:-1, None] + np.diff(cuts)[:, None] * np.linspace(0, 1, per_piece)).ravel()
    original = np.stack([np.interp(at, s, points[:, column]) for column in range(6)], axis=1)
    found = spline_of(curves, run)(at)
    tips = np.linalg.norm(found[:, :3] - original[:, :3], axis=1)
    tops = [six[:, :3] + axis_length * unit(six[:, 3:] - six[:, :3]) for six in (found, original)]
    return float(tips.max()), float(np.linalg.norm(tops[0] - tops[1], axis=1).max())
