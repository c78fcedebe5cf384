"""Rotary angles of whole runs as cubic B-splines on the knots of the curves: further axes of the same curve.

On the knots of tip and lever (docs/global.md) both angles get control points of their own: the blossom of the cubic
that meets the angles at four places between its knots (T. Lyche, L. L. Schumaker, "Local spline approximation methods",
J. Approx. Theory 15, 1975). What is left over is fitted in the same way twice more.

Where their tool axis leaves the lever by more than the tolerance, spans are halved: tip and lever stay what they are.
What is not within the tolerance then is for lines to follow.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import search, starts
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import angle_between, continued, tool_axis
from cornersmooth.model import Floats, Ints, Runs
from cornersmooth.rotary.chord_bounds import axis_curve_bend, lever_bend
from cornersmooth.vectors import unit

#: rounds in which spans are halved, and steps below which one is not
ROUNDS, NARROWEST = 5, 8.0
#: fits of what those before have left over
FITS = 3
#: share of the tolerance that a proof leaves to what lies between its samples, and the most stretches of a span
PROOF, MOST_SAMPLES = 0.1, 64
#: places of a cubic, as shares of the way between the outer ones of three knots
SHARES = np.array([0.0, 1.0, 2.0, 3.0]) / 3.0
#: coefficients of u and u² of the cubic through four values at these shares
LINEAR = np.array([-5.5, 9.0, -4.5, 1.0])
SQUARE = np.array([9.0, -22.5, 18.0, -4.5])
#: control points or samples worked on at a time
CHUNK = 1 << 14


@dataclass(frozen=True)
class Guide:
    """Angles known along the runs, m places in path order; both ends of every run are among them."""

    run: Ints  #: (m,)
    s: Floats  #: (m,), steps
    angles: Floats  #: (m, 2), degrees; unwrapped, as `rotary_angles` gives them
    branch: Ints  #: (m,) which solution they are, -1 at the pole

    def between(self, run: Ints, s: Floats) -> tuple[Floats, Ints]:
        """Angles (k, 2) evenly between the known ones, and the branch (k,) of both neighbours, -1 for none."""
        counts = np.bincount(self.run)
        first = starts(counts)
        before = np.clip(search(self.s, counts, run, s, side="right") - 1, first[run], first[run + 1] - 2)
        share = (s - self.s[before]) / (self.s[before + 1] - self.s[before])
        angles = self.angles[before] + share[:, None] * (self.angles[before + 1] - self.angles[before])
        one, other = self.branch[before], self.branch[before + 1]
        return angles, np.where((one == other) | (other < 0), one, np.where(one < 0, other, -1))


@dataclass(frozen=True)
class RunAngles:
    """Runs with angles."""

    runs: Runs  #: the same curves, on more knots where the angles need them
    angles: Floats  #: (c, 2), degrees; control points, those of `runs.control`
    #: (spans,), degrees; bound on the angle between the tool axis of the angles and that of the run in each span
    error: Floats


def run_angles(runs: Runs, machine: Machine, guide: Guide, *, tolerance: float, cone: float) -> RunAngles:
    """Angles of runs on a machine with two rotary axes, within a tolerance as far as halving spans brings them there.

    The tolerance, degrees, is between the tool axis of the angles and that of the run. Within the cone of the pole,
    degrees, the first angle follows the guide, as in `continued`.
    """
    splines, control = Splines(runs.knot, runs.knot_count), runs.control
    for left in range(ROUNDS, -1, -1):
        angles = _fitted(machine, splines, control, guide, cone)
        error = _bounds(machine, splines, control, angles, tolerance)
        halved = np.flatnonzero((error > tolerance) & (splines.width >= NARROWEST))
        if not left or not len(halved):
            break
        at = splines.span_knot[halved]
        middle = np.floor((splines.knot[at] + splines.knot[at + 1]) / 2.0)
        more = np.bincount(splines.span_run[halved], minlength=len(splines.count))
        refined = Splines(np.insert(splines.knot, at + 1, middle), splines.count + more)
        splines, control = refined, splines.on_knots(refined, control)
    changed = replace(runs, knot=splines.knot, knot_count=splines.count, control=control)
    return RunAngles(changed, angles, error)


def lever_at(splines: Splines, control: Floats, run: Ints, s: Floats) -> Floats:
    """(m, 3) mm from the tip to the axis point at places of runs; `control` (c, 6)."""
    return splines.points(control[:, 3:] - control[:, :3], splines.span_at(run, s), s)


def _fitted(machine: Machine, splines: Splines, control: Floats, guide: Guide, cone: float) -> Floats:
    """(c, 2) control points of the angles."""
    knots, run = splines.inner_knots, splines.control_run
    count = len(knots)
    wanted, points, change = np.empty((count, len(SHARES), 2)), np.zeros((count, 2)), np.empty((count, 2))
    parts = [slice(begin, begin + CHUNK) for begin in range(0, count, CHUNK)]
    for part in parts:
        s, of = _places(knots[part], run[part])
        guess, branch = guide.between(of, s)
        angles, _ = continued(machine, unit(lever_at(splines, control, of, s)), guess, branch, cone)
        wanted[part] = angles.reshape(-1, len(SHARES), 2)
    first = splines.control_first
    ends = np.concatenate((first[:-1], first[1:] - 1))  # passed exactly
    at = starts(np.bincount(guide.run))
    for _ in range(FITS):
        for part in parts:
            s, of = _places(knots[part], run[part])
            off = wanted[part] - splines.points(points, splines.span_at(of, s), s).reshape(-1, len(SHARES), 2)
            change[part] = _blossoms(knots[part], off)
        points += change
        points[ends] = guide.angles[np.concatenate((at[:-1], at[1:] - 1))]
    return points


def _places(knots: Floats, run: Ints) -> tuple[Floats, Ints]:
    """Where control points between these knots (c, 3) look at the angles, and the runs of these places."""
    s = knots[:, :1] + (knots[:, 2:] - knots[:, :1]) * SHARES
    return s.ravel(), np.repeat(run, len(SHARES))


def _blossoms(knots: Floats, values: Floats) -> Floats:
    """(c, 2) blossoms at the knots (c, 3) of the cubics through four values (c, 4, 2) between the outer ones."""
    low, width = knots[:, 0], knots[:, 2] - knots[:, 0]
    middle = np.divide(knots[:, 1] - low, width, out=np.zeros_like(width), where=width > 0)[:, None]
    # the blossom of a + b u + c u² + d u³ at 0, m and 1
    slope, bend = np.einsum("k,mkd->md", LINEAR, values), np.einsum("k,mkd->md", SQUARE, values)
    found: Floats = values[:, 0] + (1.0 + middle) / 3.0 * slope + middle / 3.0 * bend
    return np.where(width[:, None] > 0.0, found, values[:, 0])


def _bounds(machine: Machine, splines: Splines, control: Floats, angles: Floats, tolerance: float) -> Floats:
    """(spans,) degrees: no axis in a span is farther off than this; infinite where that takes too many samples."""
    count = len(splines.span_run)
    bounds = np.full(count, np.inf)
    for begin in range(0, count, CHUNK):
        span = np.arange(begin, min(begin + CHUNK, count))
        ends = splines.knot[splines.span_knot[span]], splines.knot[splines.span_knot[span] + 1]
        lever, words = (splines.bezier(points, span, *ends) for points in (control[:, 3:] - control[:, :3], angles))
        bend = lever_bend(lever) + axis_curve_bend(machine, np.radians(words))
        least = np.sqrt(bend / (8.0 * PROOF * np.radians(tolerance)))
        number = np.exp2(np.ceil(np.log2(np.clip(least, 2.0, 2.0 * MOST_SAMPLES)))).astype(np.int64)
        for samples in np.unique(number[number <= MOST_SAMPLES]).tolist():
            chosen = np.flatnonzero(number == samples)
            size = max(1, CHUNK // samples)
            for part in (chosen[i : i + size] for i in range(0, len(chosen), size)):
                off = _off(machine, lever[part], words[part], samples)
                bounds[span[part]] = off + np.degrees(bend[part] / (8.0 * samples**2))
    return bounds


def _off(machine: Machine, lever: Floats, words: Floats, samples: int) -> Floats:
    """(k,) degrees: largest angle between both axes at even samples of spans with these Bézier points (k, 4, d)."""
    t = np.linspace(0.0, 1.0, samples + 1)
    share = np.stack(((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3), axis=1)
    given = tool_axis(machine, (share @ words).reshape(-1, 2))
    largest: Floats = angle_between(given, unit((share @ lever).reshape(-1, 3))).reshape(-1, samples + 1).max(axis=1)
    return largest
