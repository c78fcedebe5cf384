"""Cubic B-splines on clamped knots, many in flat arrays: basis, derivatives, Bézier points, blossoms.

A spline with m spans has m + 1 distinct knots, the first and the last four-fold, and m + 3 control points. Span i lies
between knots i and i + 1 and belongs to the control points i to i + 3 (de Boor, A Practical Guide to Splines, IX).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cornersmooth.arrays import ranges, search, spread, starts
from cornersmooth.model import Floats, Ints


@dataclass(frozen=True)
class Splines:
    """Knot vectors of r splines."""

    knot: Floats  #: (k,): distinct knots of all splines, ascending from 0 in each
    count: Ints  #: (r,): distinct knots of each spline, at least 2

    @cached_property
    def first(self) -> Ints:
        """(r + 1,) where the knots of each run begin."""
        return starts(self.count)

    @cached_property
    def span_run(self) -> Ints:
        """(spans,) run of every span."""
        return spread(self.count - 1)[0]

    @cached_property
    def span_knot(self) -> Ints:
        """(spans,) index of the knot that each span starts at."""
        return ranges(self.first[:-1], self.count - 1)

    @cached_property
    def span_control(self) -> Ints:
        """(spans,) index of the first of the four control points of each span."""
        return ranges(self.control_first[:-1], self.count - 1)

    @cached_property
    def control_first(self) -> Ints:
        """(r + 1,) where the control points of each run begin."""
        return starts(self.count + 2)

    @cached_property
    def span_first(self) -> Ints:
        """(r + 1,) where the spans of each run begin."""
        return starts(self.count - 1)

    @cached_property
    def control_run(self) -> Ints:
        """(controls,) run of every control point."""
        return spread(self.count + 2)[0]

    @property
    def ends(self) -> Floats:
        """(2, spans) knots at which each span begins and ends."""
        return np.stack((self.knot[self.span_knot], self.knot[self.span_knot + 1]))

    @cached_property
    def width(self) -> Floats:
        """(spans,) steps."""
        return self.knot[self.span_knot + 1] - self.knot[self.span_knot]

    @cached_property
    def _extended(self) -> Floats:
        """Knots with the ends repeated: control point j of run r has the knots j to j + 4 from 4 r places on."""
        run, place = spread(self.count + 6)
        inner = np.clip(place - 3, 0, self.count[run] - 1)
        return self.knot[self.first[run] + inner]

    def around(self, span: Ints) -> Floats:
        """(m, 6) the three knots up to the start of each span and the three from its end on."""
        begin = self.span_control[span] + 4 * self.span_run[span]
        return self._extended[begin[:, None] + np.arange(1, 7)]

    @cached_property
    def greville(self) -> Floats:
        """(controls,) mean of the three knots whose blossom each control point is; those of a line lie there."""
        begin = np.arange(len(self.control_run)) + 4 * self.control_run
        return self._extended[begin[:, None] + np.arange(1, 4)].sum(axis=1) / 3.0

    def span_at(self, run: Ints, s: Floats) -> Ints:
        """Span (m,) of the splines `run` (m,) that each parameter s (m,) lies in."""
        knot = search(self.knot, self.count, run, s, side="right") - 1
        return np.clip(knot, self.first[run], self.first[run + 1] - 2) - run

    def taps(self, span: Ints) -> Ints:
        """(m, 4) the control points of spans."""
        return self.span_control[span][:, None] + np.arange(4)

    def points(self, control: Floats, span: Ints, s: Floats) -> Floats:
        """Points (m, d) in spans at the parameters s (m,), from control points (controls, d)."""
        return np.einsum("mk,mkd->md", self.basis(span, s), control[self.taps(span)])

    def basis(self, span: Ints, s: Floats) -> Floats:
        """(m, 4) basis functions of the spans at the parameters s."""
        k, values = self.around(span), np.ones((len(s), 1))
        left, right = s[:, None] - k[:, 2::-1], k[:, 3:] - s[:, None]  # to the knots behind, nearest first, and ahead
        for degree in range(1, 4):
            behind, ahead = left[:, degree - 1 :: -1], right[:, :degree]
            share, grown = values / (ahead + behind), np.zeros((len(s), degree + 1))
            grown[:, :-1] = share * ahead
            grown[:, 1:] += share * behind
            values = grown
        return values

    @cached_property
    def third(self) -> Floats:
        """(spans, 4) coefficients of the third derivative, which is constant in each span."""
        k = self.around(np.arange(len(self.span_run)))
        taps = np.broadcast_to(np.eye(4), (len(k), 4, 4))  # control points, then their divided differences
        for degree, low, high in ((3, (0, 1, 2), (3, 4, 5)), (2, (1, 2), (3, 4)), (1, (2,), (3,))):
            gap = k[:, list(high)] - k[:, list(low)]
            taps = degree * np.diff(taps, axis=1) / gap[:, :, None]
        return np.ascontiguousarray(taps[:, 0])

    def bernstein(self, span: Ints, low: Floats, high: Floats) -> Floats:
        """(m, 4, 4) matrices from the four control points of a span to the Bernstein points of its part low..high.

        Each is the blossom at (low, low, low), (low, low, high), (low, high, high), (high, high, high).
        """
        knots, eye = self.around(span), np.broadcast_to(np.eye(4), (len(span), 4, 4))
        rows = [np.stack([high if level < row else low for level in range(3)], axis=1) for row in range(4)]
        return np.stack([_blossom(knots, arguments, eye) for arguments in rows], axis=1)

    def bezier(self, control: Floats, span: Ints, low: Floats, high: Floats) -> Floats:
        """(m, 4, d) Bézier points of the parts low..high of spans, from control points (controls, d)."""
        return self.bernstein(span, low, high) @ control[self.taps(span)]

    def blossom(self, span: Ints, arguments: Floats, control: Floats) -> Floats:
        """(m, d) blossoms of the spans' cubics at three arguments (m, 3) each, from control points (controls, d)."""
        return _blossom(self.around(span), arguments, control[self.taps(span)])


def _blossom(knots: Floats, arguments: Floats, values: Floats) -> Floats:
    """(m, d) blossoms at three arguments (m, 3), from control points (m, 4, d) and the knots around them (m, 6)."""
    for level in range(3):
        begin, end = knots[:, level:3], knots[:, 3 : 6 - level]
        share = ((arguments[:, level, None] - begin) / (end - begin))[:, :, None]
        values = (1.0 - share) * values[:, :-1] + share * values[:, 1:]
    return values[:, 0]
