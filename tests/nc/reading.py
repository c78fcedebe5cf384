"""Strict readers of the texts of all controls, and the motion that each control makes of them.

Nothing here comes from the writers: grammars are regular expressions of what the manuals allow and we write, the
kinematics are rotations by scipy, splines are evaluated by de Boor's recursion from the rules of the manuals.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from oracle.motion import Path, angle_between, axis_step, unit

Floats = NDArray[np.float64]

#: inverse time and its like are read, feeds are checked elsewhere
NUMBER = r"[+-]?(?:\d+\.\d*|\d+|\.\d+)"


class TextError(AssertionError):
    """The text breaks a rule of its control; the message starts with the line number."""


@dataclass(frozen=True)
class Piece:
    """One block's motion: `at` gives tip (m,3) and tool direction (m,3) at shares (m,) of it."""

    line: int
    rapid: bool
    at: Callable[[Floats], tuple[Floats, Floats]]
    samples: int


@dataclass
class Reading:
    """What a reader has understood so far."""

    pieces: list[Piece] = field(default_factory=list)
    codes: list[str] = field(default_factory=list)

    def runs(self, axis_length: float) -> list[Path]:
        """Feed motion between rapids, as the oracle wants it: the end of the rapid first."""
        runs: list[list[Path]] = []
        for index, piece in enumerate(self.pieces):
            shares = np.array([1.0]) if piece.rapid or not runs else np.linspace(0, 1, piece.samples + 1)[1:]
            tip, direction = piece.at(shares)
            path = Path(tip, tip + axis_length * unit(direction), np.full(len(tip), index))
            if piece.rapid or not runs:
                runs.append([path])
            else:
                runs[-1].append(path)
        joined = [run[0].joined(*run[1:]) for run in runs]
        return [run for run in joined if len(run) > 1]


def great_circle(one: Floats, other: Floats, share: Floats) -> Floats:
    """Unit vectors between two, evenly in the angle."""
    angle = float(angle_between(one, other))
    if angle < 1e-9 or angle > np.pi - 1e-6:
        return unit(one + share[:, None] * (other - one))
    weights = np.sin(np.stack((1 - share, share), axis=1) * angle) / np.sin(angle)
    return weights @ np.stack((unit(one), unit(other)))


def straight(one: Floats, other: Floats, share: Floats) -> Floats:
    return one + share[:, None] * (other - one)


# ------------------------------------------------------------------------------------------------ rotary axes


def turned(name: str, angles: dict[str, Floats]) -> Rotation:
    """Rotation of the tool as seen from the part."""
    if name in ("table-ac", "head-ac"):
        return Rotation.from_euler("ZX", np.stack((angles["C"], angles["A"]), axis=-1), degrees=True)
    if name in ("table-bc", "head-table-bc"):
        return Rotation.from_euler("ZY", np.stack((angles["C"], angles["B"]), axis=-1), degrees=True)
    if name == "nutated-bc":
        skew = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)
        return Rotation.from_euler("Z", angles["C"][:, None], degrees=True) * Rotation.from_rotvec(
            np.radians(angles["B"])[:, None] * skew
        )
    raise ValueError(name)


def tool_direction(name: str, angles: dict[str, Floats]) -> Floats:
    """Tool axis in the part; LinuxCNC's formulas are those of its trtfuncs.c (2.9)."""
    sine = {letter: np.sin(np.radians(angle)) for letter, angle in angles.items()}
    cosine = {letter: np.cos(np.radians(angle)) for letter, angle in angles.items()}
    if name == "xyzac-trt":
        return np.stack((sine["C"] * sine["A"], cosine["C"] * sine["A"], cosine["A"]), axis=-1)
    if name == "xyzbc-trt":
        return np.stack((-cosine["C"] * sine["B"], sine["C"] * sine["B"], cosine["B"]), axis=-1)
    return turned(name, angles).apply([0.0, 0.0, 1.0])


def tip_of(name: str, position: Floats, angles: dict[str, Floats]) -> Floats:
    """Tip in the part from positions of the axes of a trunnion whose tables turn about the origin."""
    return turned(name, angles).apply(position)


# ------------------------------------------------------------------------------------------------ readers


@dataclass
class Reader:
    """Reads a text line by line; what differs between controls is given.

    Parameters
    ----------
    line : str
        Pattern of a straight block with groups ``rapid`` and one for every word.
    words : tuple of str
        Words in their order; the first three are X, Y and Z.
    codes : str
        Pattern of blocks without motion.
    turn : {"great circle", "point", "angles", "machine"}
    """

    words: tuple[str, ...]
    codes: str
    turn: str
    machine: str = ""
    rapid: str = "G0"
    feed: str = "G1"
    rapid_end: str = ""
    decimals: tuple[int, ...] = (4,) * 3
    signs: bool = False
    number: str = ""
    scale: float = 1.0
    extra: Callable[[Reader, str, int, Floats | None, Reading], Floats | None] | None = None

    def read(self, text: str, axis_length: float, limit: float) -> Reading:
        """Read a whole text."""
        sign = "[+-]" if self.signs else "-?"
        numbers = [
            rf"{word}({sign}(?:0|[1-9]\d*)\.\d{{{d}}})" for word, d in zip(self.words, self.decimals, strict=True)
        ]
        straight_block = re.compile(
            rf"(?:(?P<rapid>{self.rapid} )|{self.feed} ){' '.join(numbers)}(?P<tail>{self.rapid_end}| F(?P<f>[\d.]+))?"
        )
        codes = re.compile(self.codes)
        reading, position = Reading(), None
        self.step, self.axis_length = axis_step(axis_length, limit), axis_length
        for number, whole in enumerate(text.splitlines(), 1):
            line = whole
            if self.number and whole != "%":
                prefix = self.number.format(number=number - 1)
                if not whole.startswith(prefix):
                    raise TextError(f"{number}: no block number {prefix!r}: {whole!r}")
                line = whole.removeprefix(prefix)
            if match := straight_block.fullmatch(line):
                rapid = match["rapid"] is not None if self.rapid != self.feed else match["tail"] == self.rapid_end
                values = np.array([float(group) for group in match.groups()[1 : 1 + len(self.words)]])
                if any(
                    group.strip("+") in ("-0.0000", "-0.00000") for group in match.groups()[1 : 1 + len(self.words)]
                ):
                    raise TextError(f"{number}: negative zero")
                values[: 6 if self.turn == "point" else 3] *= self.scale
                if position is not None and not rapid and (values == position).all() and match["f"] is None:
                    raise TextError(f"{number}: move of no length")
                reading.pieces.append(self.piece(number, rapid, position if position is not None else values, values))
                position = values
            elif self.extra and (after := self.extra(self, line, number, position, reading)) is not None:
                position = after
            elif codes.fullmatch(line):
                reading.codes.append(line)
            else:
                raise TextError(f"{number}: not a block of this control: {whole!r}")
        return reading

    def direction(self, values: Floats) -> Floats:
        """Tool direction of rotary words, or straight up where there are none."""
        if self.turn == "fixed":
            return np.broadcast_to((0.0, 0.0, 1.0), (len(values), 3))
        return tool_direction(self.machine, dict(zip(self.words[3:], values[:, 3:].T, strict=True)))

    def piece(self, number: int, rapid: bool, start: Floats, end: Floats) -> Piece:
        """Straight block."""

        def at(share: Floats) -> tuple[Floats, Floats]:
            if self.turn == "great circle":
                return straight(start[:3], end[:3], share), great_circle(start[3:], end[3:], share)
            values = straight(start, end, share)
            if self.turn == "point":
                return values[:, :3], values[:, 3:] - values[:, :3]
            if self.turn == "machine":
                angles = dict(zip(self.words[3:], values[:, 3:].T, strict=True))
                return tip_of(self.machine, values[:, :3], angles), self.direction(values)
            return values[:, :3], self.direction(values)

        if self.turn == "fixed":
            turn = 0.0
        elif self.turn in ("angles", "machine"):
            turn = np.radians(np.abs(end[3:] - start[3:]).max())
        elif self.turn == "point":
            turn = float(angle_between(start[3:] - start[:3], end[3:] - end[:3]))
        else:
            turn = float(angle_between(start[3:], end[3:]))
        least = 16 if self.turn == "machine" and turn > 0 else 1
        return Piece(number, rapid, at, max(least, int(np.ceil(turn / self.step))))


def spline_piece(number: int, points: Floats, weights: Floats, knots: Floats) -> Piece:
    """Rational spline of tip and second point at one parameter."""
    homogeneous = np.concatenate((points * weights[:, None], weights[:, None]), axis=1)
    spline = BSpline(knots, homogeneous, 3)

    def at(share: Floats) -> tuple[Floats, Floats]:
        values = spline(knots[3] + share * (knots[-4] - knots[3]))
        six = values[:, :6] / values[:, 6:]
        return six[:, :3], six[:, 3:] - six[:, :3]

    return Piece(number, False, at, 96 * max(1, (len(points) - 1) // 4))


class SiemensSplines:
    """BSPLINE: the block before gives the first point; ``PL`` of block j is u[j+2] − u[j+1] (programming manual).

    A run of blocks is one spline; knots follow from the intervals with four at either end.
    """

    block = re.compile(
        r"(?P<start>BSPLINE SD=3 )?X(-?\d+\.\d{4}) Y(-?\d+\.\d{4}) Z(-?\d+\.\d{4}) XH=(-?\d+\.\d{4}) YH=(-?\d+\.\d{4}) "
        r"ZH=(-?\d+\.\d{4}) PL=(\d+\.?\d*) PW=(\d+\.?\d*)"
    )

    def __init__(self) -> None:
        self.points: list[Floats] = []
        self.weights: list[float] = []
        self.intervals: list[float] = []
        self.begin = 0

    def __call__(
        self, reader: Reader, line: str, number: int, position: Floats | None, reading: Reading
    ) -> Floats | None:
        match = self.block.fullmatch(line)
        if match is None:
            return None
        if match["start"]:
            assert position is not None
            self.points, self.weights, self.intervals, self.begin = [position], [1.0], [], number
        elif number != self.begin + len(self.points) - 1:
            raise TextError(f"{number}: control point outside of a spline")
        six = np.array([float(group) for group in match.groups()[1:7]])
        if not 0 < float(match[9]) <= 3:
            raise TextError(f"{number}: PW out of range")
        self.points.append(six)
        self.intervals.append(float(match[8]))
        self.weights.append(float(match[9]))
        if len(self.points) >= 5 and (len(self.points) - 1) % 4 == 0:
            # the spline so far is complete: knots u[3] = 0, u[j+2] = u[j+1] + PL[j], four equal ones at the end
            knots = [0.0, 0.0, 0.0]
            for interval in self.intervals:
                knots.append(knots[-1] + interval)
            knots += [knots[-1]] * (len(self.points) + 4 - len(knots))
            last = 5
            piece = spline_piece(
                number, np.array(self.points[-last:]), np.array(self.weights[-last:]), np.array(knots[-last - 4 :])
            )
            reading.pieces.append(piece)
        return six


class SiemensPolynomials:
    """POLY: ``PO[X]=(end, a2, a3)``; a0 is where the block before ended, the parameter runs from 0 to PL."""

    block = re.compile(
        "POLY "
        + " ".join(
            rf"PO\[{axis}\]=\((-?\d+\.\d{{4}}),(-?\d+\.\d{{7}}),(-?\d+\.\d{{7}})\)"
            for axis in ("X", "Y", "Z", "XH", "YH", "ZH")
        )
        + " PL=1"
    )

    def __call__(
        self, reader: Reader, line: str, number: int, position: Floats | None, reading: Reading
    ) -> Floats | None:
        match = self.block.fullmatch(line)
        if match is None:
            return None
        assert position is not None
        end, square, cube = np.array([float(group) for group in match.groups()]).reshape(6, 3).T
        first = end - position - square - cube

        def at(share: Floats) -> tuple[Floats, Floats]:
            p = share[:, None]
            six = position + p * (first + p * (square + p * cube))
            return six[:, :3], six[:, 3:] - six[:, :3]

        reading.pieces.append(Piece(number, False, at, 48))
        return end


class HeidenhainSplines:
    """SPL: X(t) = K3·t³ + K2·t² + K1·t + X with t from 1 to 0; it starts within a micrometre of the last end."""

    def __call__(
        self, reader: Reader, line: str, number: int, position: Floats | None, reading: Reading
    ) -> Floats | None:
        ends = " ".join(rf"{word}([+-]\d+\.\d{{{d}}})" for word, d in zip(reader.words, reader.decimals, strict=True))
        factor = r"([+-]\d\.\d{7}|[+-][1-9]\.\d{9}E[+-]\d{3})"
        factors = " ".join(f"K{power}{word}{factor}" for word in reader.words for power in (3, 2, 1))
        match = re.fullmatch(f"SPL {ends} {factors}", line)
        if match is None:
            return None
        assert position is not None
        count = len(reader.words)
        end = np.array([float(group) for group in match.groups()[:count]])
        cube, square, slope = np.array([float(group) for group in match.groups()[count:]]).reshape(count, 3).T
        if np.abs(end + slope + square + cube - position).max() > 1e-3:
            raise TextError(f"{number}: the spline does not start where the block before ended")

        def at(share: Floats) -> tuple[Floats, Floats]:
            t = 1.0 - share[:, None]
            values = end + t * (slope + t * (square + t * cube))
            return values[:, :3], reader.direction(values)

        reading.pieces.append(Piece(number, False, at, 48))
        return end


class RotarySplines:
    """FANUC's G6.2 (B-63324EN/03 4.17) with rotary axes on the curve: as many knots as points and four more."""

    def __init__(self) -> None:
        self.points: list[Floats] = []
        self.weights: list[float] = []
        self.knots: list[float] = []

    def __call__(
        self, reader: Reader, line: str, number: int, position: Floats | None, reading: Reading
    ) -> Floats | None:
        words = " ".join(
            rf"{word}(-?(?:0|[1-9]\d*)\.\d{{{d}}})" for word, d in zip(reader.words, reader.decimals, strict=True)
        )
        if match := re.fullmatch(rf"(G6\.2 P4 )?K(\d+\.\d{{0,3}}) {words} R(\d+\.\d{{0,4}})", line):
            values = np.array([float(group) for group in match.groups()[2:-1]])
            if match[1]:
                if self.points or position is None or (values != position).any():
                    raise TextError(f"{number}: PS1009, not at the first control point")
            elif not self.points:
                raise TextError(f"{number}: control point outside of a curve")
            self.points.append(values)
            self.knots.append(float(match[2]))
            self.weights.append(float(match.groups()[-1]))
            return values
        if not (match := re.fullmatch(r"K(\d+\.\d{0,3})", line)):
            if self.points:
                raise TextError(f"{number}: {line!r} inside a curve")
            return None
        self.knots.append(float(match[1]))
        if len(self.knots) == len(self.points) + 4:
            self.finish(reader, number, reading)
        return position

    def finish(self, reader: Reader, number: int, reading: Reading) -> None:
        knots, weights = np.array(self.knots), np.array(self.weights)
        if not (np.diff(knots) >= 0).all() or len(set(self.knots[:4])) > 1 or len(set(self.knots[-4:])) > 1:
            raise TextError(f"{number}: PS1007, knots {self.knots}")
        homogeneous = np.concatenate((np.array(self.points) * weights[:, None], weights[:, None]), axis=1)
        spline = BSpline(knots, homogeneous, 3)

        def at(share: Floats) -> tuple[Floats, Floats]:
            values = spline(share * knots[-1])
            values = values[:, :-1] / values[:, -1:]
            return values[:, :3], reader.direction(values)

        reading.pieces.append(Piece(number, False, at, 96 + 8 * len(self.points)))
        self.points, self.weights, self.knots = [], [], []


ISO = (
    r"\([^()]*\)|%|O\d{4}|G2[01] G90 G94 G17 G40( G49)? G80|T\d+ M6|T\d+|S[\d.]+ M[34]|M(?:0|1|5|7|8|9|19|30)|G4 P\d+|"
    r"G9[345]"
)

READERS: dict[str, Callable[[str], Reader]] = {
    "fanuc g1": lambda machine: Reader(
        ("X", "Y", "Z", *sorted(machine_letters(machine))),
        ISO + r"|G43\.4 H\d+|G49",
        "angles",
        machine,
        decimals=(4, 4, 4, 5, 5),
    ),
    "fanuc g1 machine": lambda machine: Reader(
        ("X", "Y", "Z", *sorted(machine_letters(machine))),
        ISO + r"|G43 H\d+|G49",
        "machine",
        machine,
        decimals=(4, 4, 4, 5, 5),
    ),
    "fanuc g6.2": lambda machine: Reader(
        ("X", "Y", "Z", *sorted(machine_letters(machine))),
        ISO + r"|G43\.4 H\d+|G49",
        "angles",
        machine,
        decimals=(4, 4, 4, 5, 5),
        extra=RotarySplines(),
    ),
    "mitsubishi g1": lambda machine: READERS["fanuc g1"](machine),
    "haas g1": lambda machine: Reader(
        ("X", "Y", "Z", *sorted(machine_letters(machine))),
        ISO.replace(r"P\d+", r"P[\d.]+") + r"|G234 H\d+|G49",
        "angles",
        machine,
        decimals=(4, 4, 4, 4, 4),
    ),
    "linuxcnc g1": lambda machine: Reader(
        ("X", "Y", "Z", *sorted(machine_letters(machine))),
        ISO.replace(r"P\d+", r"P[\d.]+") + r"|G64 P[\d.]+ Q0|G43 H\d+|G49|M2",
        "angles",
        machine,
        decimals=(4, 4, 4, 5, 5),
    ),
    "generic g1": lambda machine: Reader(
        ("X", "Y", "Z", "I", "J", "K"), ISO, "great circle", decimals=(4, 4, 4, 7, 7, 7)
    ),
    "siemens g1": lambda machine: Reader(
        ("X", "Y", "Z", *(sorted(machine_letters(machine)) if machine else ("A3=", "B3=", "C3="))),
        SIEMENS,
        "angles" if machine else "great circle",
        machine,
        decimals=(4, 4, 4, *((5, 5) if machine else (7, 7, 7))),
    ),
    "siemens bspline": lambda machine: Reader(
        ("X", "Y", "Z", "XH=", "YH=", "ZH="), SIEMENS, "point", decimals=(4,) * 6, extra=SiemensSplines()
    ),
    "siemens poly": lambda machine: Reader(
        ("X", "Y", "Z", "XH=", "YH=", "ZH="), SIEMENS, "point", decimals=(4,) * 6, extra=SiemensPolynomials()
    ),
    "heidenhain spl": lambda machine: Reader(
        ("X", "Y", "Z", *(sorted(machine_letters(machine)) if machine else ())),
        HEIDENHAIN,
        "angles" if machine else "fixed",
        machine,
        rapid="L",
        feed="L",
        rapid_end=" FMAX",
        decimals=(4, 4, 4, *((4, 4) if machine else ())),
        signs=True,
        number="{number} ",
        extra=HeidenhainSplines(),
    ),
    "mitsubishi g6.2": lambda machine: Reader(
        ("X", "Y", "Z"), ISO + r"|G43 H\d+|G49|G5 P10000|G5 P0", "fixed", decimals=(4, 4, 4), extra=RotarySplines()
    ),
    "heidenhain g1": lambda machine: Reader(
        ("X", "Y", "Z", *(sorted(machine_letters(machine)) if machine else ("TX", "TY", "TZ"))),
        HEIDENHAIN,
        "angles" if machine else "great circle",
        machine,
        rapid="L" if machine else "LN",
        feed="L" if machine else "LN",
        rapid_end=" FMAX",
        decimals=(4, 4, 4, *((4, 4) if machine else (7, 7, 7))),
        signs=True,
        number="{number} ",
    ),
}

SIEMENS = (
    r"; .*|G90 G94 G17 G40 G7[01]0|T\d+|M6|D1|S[\d.]+ M[34]|M(?:0|1|5|7|8|9|30)|G4 F[\d.]+|G9[345]|TRAORI|TRAFOOF|"
    r"ORIWKS ORIVECT|ORIWKS ORICURVE|ORIMKS ORIAXES"
)
HEIDENHAIN = (
    r"; .*|BEGIN PGM \w+ (?:MM|INCH)|END PGM \w+ (?:MM|INCH)|TOOL CALL \d+ Z|TOOL CALL Z S\d+|TOOL DEF \d+|STOP|"
    r"M(?:1|3|4|5|8|9|30|136|137)|CYCL DEF 9\.0 DWELL TIME|CYCL DEF 9\.1 DWELL [\d.]+|"
    r"FUNCTION TCPM F TCP AXIS POS PATHCTRL (?:VECTOR|AXIS)|FUNCTION RESET TCPM"
)


def machine_letters(machine: str) -> str:
    """Addresses of the rotary words of a machine."""
    return "BC" if "bc" in machine else "AC"
