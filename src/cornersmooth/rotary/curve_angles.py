"""Rotary angles of curves as further axes of the same curves: control points on the knots and weights of the tip.

Both angles get control points of their own: the blossom of the cubic that meets the angles at four places between its
knots (T. Lyche, L. L. Schumaker, "Local spline approximation methods", J. Approx. Theory 15, 1975). What is left over
is fitted in the same way twice more. Where a curve has to join straight motion with its first two derivatives, its
three outer control points follow from them.

Where their tool axis leaves the lever by more than the tolerance, spans are halved: tip and lever stay what they are.
What is not within the tolerance then is for lines to follow.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.geometry.bsplines import Splines
from cornersmooth.geometry.ragged import search, starts
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import angle_between, continued, tool_axis
from cornersmooth.model import Bools, Floats, Ints
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
#: control points at each end that value, first and second derivative determine
FIXED = 3
#: degrees by which the one in the middle may differ for both ends
SAME = 1e-9
#: control points or samples worked on at a time
CHUNK = 1 << 14


@dataclass(frozen=True)
class Curves:
    """Rational curves of tip and axis point: r of them, c control points in all."""

    splines: Splines  #: with whole steps as knots
    #: (c, 7): control points of the tip, mm, of the lever from the tip to the axis point, mm, both times their weight,
    #: and the weight, which is 1 at both ends
    points: Floats
    #: (2, r, 3, 2): angles, degrees, and their first two derivatives by the parameter at the starts and at the ends,
    #: all times the weight; NaN where only the angles have to be met
    ends: Floats
    tolerance: Floats  #: (r,), degrees

    def lever(self, curve: Ints, s: Floats) -> Floats:
        """(m, 3) the lever at places of curves, times a weight."""
        return self.splines.points(self.points[:, 3:6], self.splines.span_at(curve, s), s)

    def some(self, kept: Bools) -> Curves:
        """The curves (r,) that are kept."""
        count = self.splines.count
        splines = Splines(self.splines.knot[np.repeat(kept, count)], count[kept])
        points = self.points[np.repeat(kept, count + 2)]
        return Curves(splines, points, self.ends[:, kept], self.tolerance[kept])


def joined(parts: Sequence[Curves]) -> Curves:
    """Some curves after others."""
    knots, counts = (
        np.concatenate(column) for column in zip(*((p.splines.knot, p.splines.count) for p in parts), strict=True)
    )
    points, tolerance = np.concatenate([p.points for p in parts]), np.concatenate([p.tolerance for p in parts])
    return Curves(Splines(knots, counts), points, np.concatenate([p.ends for p in parts], axis=1), tolerance)


@dataclass(frozen=True)
class Guide:
    """Angles known along the curves, m places in the order of the curves; both ends of every curve are among them."""

    curve: Ints  #: (m,)
    s: Floats  #: (m,), steps
    angles: Floats  #: (m, 2), degrees; unwrapped, as `rotary_angles` gives them
    branch: Ints  #: (m,) which solution they are, -1 at the pole

    def between(self, curve: Ints, s: Floats) -> tuple[Floats, Ints]:
        """Angles (k, 2) evenly between the known ones, and the branch (k,) of both neighbours, -1 for none."""
        counts = np.bincount(self.curve)
        first = starts(counts)
        before = np.clip(search(self.s, counts, curve, s, side="right") - 1, first[curve], first[curve + 1] - 2)
        share = (s - self.s[before]) / (self.s[before + 1] - self.s[before])
        angles = self.angles[before] + share[:, None] * (self.angles[before + 1] - self.angles[before])
        one, other = self.branch[before], self.branch[before + 1]
        return angles, np.where((one == other) | (other < 0), one, np.where(one < 0, other, -1))

    def some(self, kept: Bools) -> Guide:
        """Those of the curves (r,) that are kept."""
        own = kept[self.curve]
        return Guide(np.cumsum(kept)[self.curve[own]] - 1, self.s[own], self.angles[own], self.branch[own])


@dataclass(frozen=True)
class CurveAngles:
    """Curves with angles."""

    curves: Curves  #: the same curves, on more knots where the angles need them
    angles: Floats  #: (c, 2), degrees times the weight; control points, those of `curves.points`
    #: (spans,), degrees; bound on the angle between the tool axis of the angles and the lever in each span
    error: Floats

    @property
    def control(self) -> Floats:
        """(c, 6) control points of tip and angles, times the weight, and the weight."""
        return np.hstack((self.curves.points[:, :3], self.angles, self.curves.points[:, 6:]))


def curve_angles(curves: Curves, machine: Machine, guide: Guide, *, cone: float, rounds: int = ROUNDS) -> CurveAngles:
    """Angles of curves on a machine, within their tolerances as far as halving spans brings them there.

    The tolerance is between the tool axis of the angles and the lever. Within the cone of the pole, degrees, the first
    angle follows the guide, as in `continued`.
    """
    splines = curves.splines
    if not len(splines.count):
        return CurveAngles(curves, np.zeros((0, 2)), np.zeros(0))
    angles, apart = _fitted(machine, curves, guide, cone)
    error = _bounds(machine, curves, angles)
    error[apart[splines.span_run]] = np.inf
    halved = (error > curves.tolerance[splines.span_run]) & (splines.width >= NARROWEST)
    found = CurveAngles(curves, angles, error)
    if not rounds or not halved.any():
        return found
    again = np.bincount(splines.span_run[halved], minlength=len(splines.count)) > 0
    more, own = curves.some(again), halved[again[splines.span_run]]
    at = more.splines.span_knot[own]
    middle = np.floor((more.splines.knot[at] + more.splines.knot[at + 1]) / 2.0)
    count = more.splines.count + np.bincount(more.splines.span_run[own], minlength=len(more.splines.count))
    finer = Splines(np.insert(more.splines.knot, at + 1, middle), count)
    refined = replace(more, splines=finer, points=more.splines.on_knots(finer, more.points))
    return _replaced(found, again, curve_angles(refined, machine, guide.some(again), cone=cone, rounds=rounds - 1))


def _replaced(old: CurveAngles, which: Bools, new: CurveAngles) -> CurveAngles:
    """The old curves (r,) with the new ones in the place of some."""
    one, other = old.curves.splines, new.curves.splines
    number, count = np.flatnonzero(which), one.count.copy()
    count[which] = other.count

    def merged(ours: Floats, theirs: Floats, extra: int) -> Floats:
        owner = np.repeat(np.arange(len(which)), one.count + extra)
        kept = ~which[owner]
        order = np.argsort(np.concatenate((owner[kept], np.repeat(number, other.count + extra))), kind="stable")
        return np.concatenate((ours[kept], theirs))[order]

    splines = Splines(merged(one.knot, other.knot, 0), count)
    curves = replace(old.curves, splines=splines, points=merged(old.curves.points, new.curves.points, 2))
    return CurveAngles(curves, merged(old.angles, new.angles, 2), merged(old.error, new.error, -1))


def _fitted(machine: Machine, curves: Curves, guide: Guide, cone: float) -> tuple[Floats, Bools]:
    """(c, 2) control points of the angles, and curves (r,) with too few of them for both ends."""
    splines, weight = curves.splines, curves.points[:, 6:]
    points, free = np.zeros((len(weight), 2)), np.ones(len(weight), np.bool_)
    first = splines.control_first
    at = np.stack((first[:-1, None] + np.arange(FIXED), first[1:, None] - 1 - np.arange(FIXED)))
    last = splines.knot[splines.first[1:] - 1]
    t = splines.inner_knots[at] - np.stack((np.zeros_like(last), last))[:, :, None, None]
    # blossoms of the first terms of Taylor's series
    pairs = (t[..., 0] * t[..., 1] + t[..., 0] * t[..., 2] + t[..., 1] * t[..., 2]) / 6.0
    value, slope, bend = (curves.ends[:, :, None, k] for k in range(3))
    fixed = value + t.mean(axis=3)[..., None] * slope + pairs[..., None] * bend
    fixed[:, :, 0] = value[:, :, 0]
    known = ~np.isnan(fixed[..., 0])
    points[at[known]], free[at[known]] = fixed[known], False
    shared = (at[0, :, -1] >= at[1, :, -1]) & known[:, :, -1].all(axis=0)
    apart = shared & (np.abs(fixed[0, :, -1] - fixed[1, :, -1]).max(axis=1) > SAME)

    inner, run, rows = splines.inner_knots, splines.control_run, np.flatnonzero(free)
    parts = [slice(begin, begin + CHUNK) for begin in range(0, len(rows), CHUNK)]
    wanted, change = np.empty((len(rows), len(SHARES), 2)), np.empty((len(rows), 2))
    for part in parts:
        s, of = _places(inner[rows[part]], run[rows[part]])
        guess, branch = guide.between(of, s)
        angles, _ = continued(machine, unit(curves.lever(of, s)), guess, branch, cone)
        points[rows[part]] = weight[rows[part]] * _blossoms(inner[rows[part]], angles.reshape(-1, len(SHARES), 2))
        angles *= splines.points(weight, splines.span_at(of, s), s)
        wanted[part] = angles.reshape(-1, len(SHARES), 2)
    for _ in range(FITS - 1):
        for part in parts:
            s, of = _places(inner[rows[part]], run[rows[part]])
            off = wanted[part] - splines.points(points, splines.span_at(of, s), s).reshape(-1, len(SHARES), 2)
            change[part] = _blossoms(inner[rows[part]], off)
        points[rows] += change
    return points, apart


def _places(knots: Floats, run: Ints) -> tuple[Floats, Ints]:
    """Where control points between these knots (c, 3) look at the angles, and the curves of these places."""
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


def _bounds(machine: Machine, curves: Curves, angles: Floats) -> Floats:
    """(spans,) degrees: no axis in a span is farther off than this; infinite where that takes too many samples."""
    splines = curves.splines
    control = np.hstack((curves.points[:, 3:], angles))
    count = len(splines.span_run)
    bounds = np.full(count, np.inf)
    for begin in range(0, count, CHUNK):
        span = np.arange(begin, min(begin + CHUNK, count))
        hull = splines.hulls(control, span)
        lever, weight, words = hull[..., :3], hull[..., 3], hull[..., 4:]
        bend = lever_bend(lever, weight) + axis_curve_bend(machine, np.radians(words), weight)
        least = np.sqrt(bend / (8.0 * PROOF * np.radians(curves.tolerance[splines.span_run[span]])))
        number = np.exp2(np.ceil(np.log2(np.clip(least, 2.0, 2.0 * MOST_SAMPLES)))).astype(np.int64)
        for samples in np.unique(number[number <= MOST_SAMPLES]).tolist():
            chosen = np.flatnonzero(number == samples)
            size = max(1, CHUNK // samples)
            for part in (chosen[i : i + size] for i in range(0, len(chosen), size)):
                off = _off(machine, hull[:, part], samples)
                bounds[span[part]] = off + np.degrees(bend[part] / (8.0 * samples**2))
    return bounds


def _off(machine: Machine, hull: Floats, samples: int) -> Floats:
    """(k,) degrees: largest angle between both axes at even samples of spans with these Bézier points (4, k, 6)."""
    t = np.linspace(0.0, 1.0, samples + 1)
    share = np.stack(((1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t**2 * (1 - t), t**3), axis=1)
    points = np.tensordot(share, hull, 1).reshape(-1, 6)
    apart = angle_between(tool_axis(machine, points[:, 4:] / points[:, 3:4]), unit(points[:, :3]))
    return apart.reshape(samples + 1, -1).max(axis=0)
