"""Curves in NC text: what the manuals say of G6.2, BSPLINE, POLY and SPL, for `nc.reading`."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.interpolate import BSpline, PPoly

from nc.reading import Floats, Piece, Reader, Reading, TextError

#: samples of a knot interval; an even number, so that the middle is one
SAMPLES = 48
#: share of ε by which chords between samples of a long curve may leave it
CHORD = 2e-3
#: last knots of curves at one corner
ENDS = (1.0, 2.0, 4.0)
#: mm and degrees from the end of the block before to the start of an SPL: rounding of its factors; 1e-3 is allowed
SPL_START = 2e-6

#: a feed behind a block; only the first block of a curve of G6.2 may have one
FEED = r"(?: F(?:0|[1-9]\d*)(?:\.\d*)?)?"


def rational(points: Floats, weights: Floats, knots: Floats, parameters: Floats) -> Floats:
    """(m, c) points of a rational cubic spline."""
    homogeneous = np.concatenate((points * weights[:, None], weights[:, None]), axis=1)
    values: Floats = BSpline(knots, homogeneous, 3)(parameters)
    return values[:, :-1] / values[:, -1:]


def long_places(reader: Reader, points: Floats, weights: Floats, knots: Floats) -> Floats:
    """Parameters at which a curve through many corners is looked at, so close that chords leave it by a hair of ε.

    Its second derivative is linear between knots, so it is largest at them. Rotary words count with the axis length.
    """
    assert (weights == 1.0).all()
    scale = np.ones(points.shape[1])
    if reader.turn == "angles":
        scale[3:] = np.radians(reader.axis_length)
    columns = [PPoly.from_spline(BSpline(knots, column, 3)) for column in (points * scale).T]
    x, factors = columns[0].x, np.stack([column.c for column in columns], axis=2)
    width = np.diff(x)
    some = width > 0
    low, width = x[:-1][some], width[some]
    cube, square, slope = (factors[k][some] for k in range(3))
    begin, end = 2 * square, 2 * square + 6 * cube * width[:, None]
    size = np.maximum(np.linalg.norm(begin, axis=1), np.linalg.norm(end, axis=1))
    if reader.turn == "angles":
        last = slope + (begin + end) / 2 * width[:, None]
        fastest = np.maximum(np.abs(slope), np.abs(last))[:, 3:].sum(axis=1)
        size += (1.5 * fastest) ** 2 / reader.axis_length
    many = np.sqrt(size * width**2 / (8 * CHORD * reader.limit))
    counts = np.clip(np.ceil(many), 4, 4000).astype(int)
    parts = [start + step * np.arange(n) / n for start, step, n in zip(low, width, counts, strict=True)]
    return np.append(np.concatenate(parts), low[-1] + width[-1])


def number(decimals: int) -> str:
    return rf"(-?(?:0|[1-9]\d*)\.\d{{{decimals}}})"


@dataclass
class SplineRun:
    """BSPLINE blocks that follow one another: one curve, whatever happens in it. Stands for a `Piece`."""

    line: int
    reader: Reader
    points: list[Floats]
    weights: list[float] = field(default_factory=lambda: [1.0])
    intervals: list[float] = field(default_factory=list)
    rapid: bool = False
    feed: float | None = None
    mode: str = ""
    ends: None = None

    @property
    def knots(self) -> Floats:
        """Three at the start, u[j+2] = u[j+1] + PL of block j, and two more at the end."""
        inner = np.cumsum([0.0, *self.intervals])
        return np.concatenate(([0.0, 0.0], inner, inner[-1:], inner[-1:]))

    @property
    def samples(self) -> int:
        return len(self.places) - 1

    @cached_property
    def places(self) -> Floats:
        """Parameters at which the curve is looked at; a run is complete when it is asked for them."""
        weights = np.array(self.weights)
        if (weights == 1.0).all() and not set(self.intervals) <= {0.0, 0.5}:
            return long_places(self.reader, np.array(self.points), weights, self.knots)
        count = SAMPLES * int(np.count_nonzero(self.intervals))
        # an arc is one long curve: so many that chords leave its tips by a hair of ε, by what they leave at first
        twice = rational(np.array(self.points), weights, self.knots, np.linspace(0.0, self.knots[-4], 2 * count + 1))
        chords = np.linalg.norm((twice[:-2:2] + twice[2::2]) / 2 - twice[1::2], axis=1)
        finer = np.sqrt(chords.max() / (CHORD * self.reader.limit))
        return np.linspace(0.0, self.knots[-4], count * int(np.clip(np.ceil(finer), 1, 4000 // SAMPLES)) + 1)

    def at(self, share: Floats) -> tuple[Floats, Floats]:
        knots = self.knots
        places = np.interp(share, np.linspace(0, 1, len(self.places)), self.places)
        values = rational(np.array(self.points), np.array(self.weights), knots, places)
        return values[:, :3], self.reader.direction(values)


class SiemensSplines:
    """BSPLINE (programming manual 12/2019): P0 is where the block before ended and has weight 1.

    Block j carries point P_j, its weight PW and the knot interval PL = u[j+2] − u[j+1]. The mode ends with G0 or G1.
    """

    def __init__(self) -> None:
        self.run: SplineRun | None = None
        self.last = 0

    def __call__(self, reader: Reader, line: str, at: int, position: Floats | None, reading: Reading) -> Floats | None:
        words = " ".join(f"{word}{number(d)}" for word, d in zip(reader.words, reader.decimals, strict=True))
        pattern = rf"(BSPLINE SD=3 )?{words} PL=(0|0\.\d*[1-9]|[1-9]\d*\.?\d*) PW=(\d+(?:\.\d{{1,4}})?){FEED}"
        match = re.fullmatch(pattern, line)
        if match is None:
            if line.startswith(";") and self.last == at - 1:
                self.last = at  # a comment is no block
            if re.match(r"G[01]\b", line):
                self.run = None
            return None
        if not match[1] and self.run is None:
            raise TextError(f"{at}: control point outside of a spline")
        if match[1] or self.last != at - 1:  # statements part two splines: the mode goes on
            assert position is not None
            self.run = SplineRun(at, reader, [position])
            reading.pieces.append(self.run)  # type: ignore[arg-type]
        assert self.run is not None
        weight = float(match.groups()[-1])
        if not 0 < weight <= 3:
            raise TextError(f"{at}: PW out of range")
        six = reader.numbers(at, match.groups()[1 : 1 + len(reader.words)])
        self.run.points.append(six)
        self.run.intervals.append(float(match.groups()[-2]))
        self.run.weights.append(weight)
        self.last = at
        return six


class SiemensPolynomials:
    """POLY: ``PO[X]=(end, a2, a3)``; a0 is where the block before ended, the parameter runs from 0 to PL."""

    def __call__(self, reader: Reader, line: str, at: int, position: Floats | None, reading: Reading) -> Floats | None:
        tip = reader.decimals[0]
        words = " ".join(
            rf"PO\[{word.rstrip('=')}\]=\({number(tip)},{number(7)},{number(7)}\)" for word in reader.words
        )
        match = re.fullmatch(f"POLY {words} PL=1{FEED}", line)
        if match is None:
            return None
        assert position is not None
        end, square, cube = reader.scale * np.array([float(group) for group in match.groups()]).reshape(6, 3).T
        first = end - position - square - cube

        def curve(share: Floats) -> tuple[Floats, Floats]:
            p = share[:, None]
            six = position + p * (first + p * (square + p * cube))
            return six[:, :3], six[:, 3:] - six[:, :3]

        reading.pieces.append(Piece(at, False, curve, SAMPLES))
        return end


class HeidenhainSplines:
    """SPL: X(t) = K3·t³ + K2·t² + K1·t + X with t from 1 to 0; it starts within a micrometre of the last end.

    Five axes at most; a linear block stands before the first (iTNC 530 manual, 12.7).
    """

    def __call__(self, reader: Reader, line: str, at: int, position: Floats | None, reading: Reading) -> Floats | None:
        ends = " ".join(rf"{word}([+-]\d+\.\d{{{d}}})" for word, d in zip(reader.words, reader.decimals, strict=True))
        factor = r"([+-]\d\.\d{8}|[+-][1-9]\.\d{8}E[+-]\d{3})"
        factors = " ".join(f"K{power}{word}{factor}" for word in reader.words for power in (3, 2, 1))
        match = re.fullmatch(f"SPL {ends} {factors}{FEED}", line)
        if match is None:
            return None
        if position is None:
            raise TextError(f"{at}: no linear block before the spline")
        count = len(reader.words)
        scale = np.array([reader.scale] * 3 + [1.0] * (count - 3))
        end = scale * np.array([float(group) for group in match.groups()[:count]])
        factors_of = np.array([float(group) for group in match.groups()[count:]]).reshape(count, 3)
        cube, square, slope = (scale[:, None] * factors_of).T
        if np.abs(end + slope + square + cube - position).max() > SPL_START:
            raise TextError(f"{at}: the spline does not start where the block before ended")

        def curve(share: Floats) -> tuple[Floats, Floats]:
            t = 1.0 - share[:, None]
            values = end + t * (slope + t * (square + t * cube))
            return values[:, :3], reader.direction(values)

        reading.pieces.append(Piece(at, False, curve, SAMPLES))
        return end


@dataclass
class KnotSplines:
    """FANUC's G6.2 (B-63324EN/03 4.17): as many knots as points and four more, in whatever axes the blocks name.

    Neither dwell nor any other word may stand inside; not under G93 or G95 (PS1006), nor with cutter compensation.
    """

    weight_decimals: int
    points: list[Floats] = field(default_factory=list)
    weights: list[float] = field(default_factory=list)
    knots: list[float] = field(default_factory=list)

    def __call__(self, reader: Reader, line: str, at: int, position: Floats | None, reading: Reading) -> Floats | None:
        words = " ".join(f"{word}{number(d)}" for word, d in zip(reader.words, reader.decimals, strict=True))
        knot, weight = r"K(\d+\.\d{0,3})", rf"R(\d+\.\d{{0,{self.weight_decimals}}})"
        block = rf"{knot} {words} {weight}"
        if match := re.fullmatch(rf"(G6\.2 P4 ){block}{FEED}", line) or re.fullmatch(rf"(){block}", line):
            values = reader.numbers(at, match.groups()[2:-1])
            if match[1]:
                if self.points or position is None or (values != position).any():
                    raise TextError(f"{at}: PS1009, not at the first control point")
                if reader.mode != reader.modes[0] or reader.compensation:
                    raise TextError(f"{at}: PS1006, G6.2 under {reader.mode}, compensation {reader.compensation}")
            elif not self.points:
                raise TextError(f"{at}: control point outside of a curve")
            self.points.append(values)
            self.knots.append(float(match[2]))
            self.weights.append(float(match.groups()[-1]))
            if not self.weights[-1] > 0:
                raise TextError(f"{at}: R is not positive")
            return values
        if not (match := re.fullmatch(knot, line)):
            if self.points:
                raise TextError(f"{at}: {line!r} inside a curve")
            return None
        self.knots.append(float(match[1]))
        if len(self.knots) == len(self.points) + 4:
            self.finish(reader, at, reading)
        return position

    def finish(self, reader: Reader, at: int, reading: Reading) -> None:
        knots, weights, points = np.array(self.knots), np.array(self.weights), np.array(self.points)
        if not (np.diff(knots) >= 0).all() or len(set(self.knots[:4])) > 1 or len(set(self.knots[-4:])) > 1:
            raise TextError(f"{at}: PS1007, knots {self.knots}")

        plain = bool((weights == 1.0).all()) and knots[-1] not in ENDS
        places = long_places(reader, points, weights, knots) if plain else np.array((0.0, knots[-1]))
        count = len(places) - 1 if plain else 2 * SAMPLES + 8 * len(points)

        def curve(share: Floats) -> tuple[Floats, Floats]:
            values = rational(points, weights, knots, np.interp(share, np.linspace(0, 1, len(places)), places))
            return values[:, :3], reader.direction(values)

        reading.pieces.append(Piece(at, False, curve, count))
        self.points, self.weights, self.knots = [], [], []
