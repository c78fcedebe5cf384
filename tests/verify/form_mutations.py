"""Wrong texts made from correct ones, for every control and form: the text is the writer's, the mistakes are ours.

As `mutations`, which knows FANUC's two forms by heart; here words are found by what they look like in each control.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np

from cornersmooth.model import Program
from nc.cases import Case

from .mutations import Mutant, distance_to_chord
from .writing import job

EPS, H = 0.02, 10.0

NUMBER = r"[-+]?\d+\.?\d*"
PLACE = re.compile(rf"(?<![A-Z0-9\[])([XYZ])({NUMBER})")
SECOND = re.compile(rf"(?<![A-Z0-9\[])([UVW])({NUMBER})")
TURN = {
    "fanuc": rf"(?<![A-Z0-9])([IJABCUVW])({NUMBER})",
    "siemens": rf"(?<![A-Z0-9])([ABC]3=|[XYZ]H=|[ABC])({NUMBER})",
    "heidenhain": rf"(?<![A-Z0-9])(T[XYZ]|[ABC])({NUMBER})",
}
RAPID = {"heidenhain": " FMAX"}


@cache
def program_of(case: Case) -> Program:
    """Program with everything in it; the tool is parallel to Z where the form has no words for its axis."""
    program: Program = job("g1", EPS, H, 0)[0]
    if not is_fixed(case):
        return program
    return replace(program, axis=np.tile((0.0, 0.0, 1.0), (len(program), 1)))


def is_fixed(case: Case) -> bool:
    """Whether the form has no words for the tool axis."""
    return case.choose().orientation == "fixed"


class Text:
    """Lines of a text, and what each of them is."""

    def __init__(self, case: Case, lines: list[str]) -> None:
        self.case, self.lines = case, lines
        self.heidenhain = case.control == "heidenhain"
        self.turn = re.compile(TURN.get(case.control, TURN["fanuc"]))
        self.motion = [i for i, line in enumerate(lines) if self.is_motion(line)]
        self.rapids = [i for i in self.motion if self.is_rapid(lines[i])]
        self.straight = [i for i in self.motion if self.is_straight(lines[i]) and i not in self.rapids]
        self.curved = [i for i in self.motion if not self.is_straight(lines[i])]

    def is_motion(self, line: str) -> bool:
        return bool(PLACE.search(line) or "PO[" in line) and "(" not in line.replace("=(", "") and "FROM" not in line

    def is_rapid(self, line: str) -> bool:
        return line.endswith(" FMAX") if self.heidenhain else line.startswith("G0 ")

    def is_straight(self, line: str) -> bool:
        if self.heidenhain:
            return " SPL " not in line
        return line.startswith(("G0 ", "G1 "))

    def tip(self, i: int) -> np.ndarray:
        found = dict(PLACE.findall(self.lines[i]))
        return np.array([float(found[letter]) for letter in "XYZ"])

    def near(self, i: int, room: int = 2) -> tuple[int, int]:
        """Lines, from 1, that a problem of line i may name."""
        return (i - 10, i + 14) if not self.is_straight(self.lines[i]) or self.beside_curve(i) else (i, i + 1 + room)

    def beside_curve(self, i: int) -> bool:
        return bool({i - 1, i, i + 1, i + 2} & set(self.curved)) or self.lines[i - 1].startswith("K")

    def with_line(self, i: int, new: str) -> list[str]:
        return [*self.lines[:i], new, *self.lines[i + 1 :]]

    def changed(self, i: int, match: re.Match[str], value: float) -> list[str]:
        line, old = self.lines[i], match[2]
        decimals = len(old.partition(".")[2])
        sign = "+" if self.heidenhain and value >= 0 else ""
        return self.with_line(i, f"{line[: match.start(2)]}{sign}{value:.{decimals}f}{line[match.end(2) :]}")

    def moved(self, i: int, tip: np.ndarray) -> list[str]:
        """Text with another position in one line, for a second point 100 mm up the axis with the same axis point."""
        new = list(self.lines)
        places, seconds = list(PLACE.finditer(self.lines[i])), list(SECOND.finditer(self.lines[i]))
        way = np.array([float(place[2]) for place in places]) - tip
        values = [*tip, *(float(second[2]) + 9.0 * off for second, off in zip(seconds, way, strict=False))]
        for match, value in reversed(list(zip([*places, *seconds], values, strict=True))):
            new = Text(self.case, new).changed(i, match, float(value))
        return new


def mutants(case: Case, lines: list[str]) -> list[Mutant]:
    """Mutants of the text of `program_of`."""
    text, rng = Text(case, lines), np.random.default_rng(7)
    found = [*of_numbers(text, rng), *of_blocks(text, rng), *of_words(text)]
    if text.curved:
        found += of_curves(text, rng)
    if any(line.startswith("G6.2") for line in lines):
        found += of_knots(text, rng)
    if text.heidenhain and text.curved:
        found += of_splines(text, rng)
    if is_fixed(case):
        found += of_fixed(text)
    return found


def of_numbers(text: Text, rng: np.random.Generator):
    for _ in range(14):
        i = int(rng.choice(text.motion))
        places = list(PLACE.finditer(text.lines[i]))
        if places:
            match = places[int(rng.integers(len(places)))]
            value = float(match[2])
            yield Mutant("digit", text.changed(i, match, value + float(rng.choice([-3, 1, 2, 20]))), text.near(i))
            if abs(value) > 2:
                yield Mutant("sign", text.changed(i, match, -value), text.near(i))
        turns = list(text.turn.finditer(text.lines[i]))
        if not turns:
            continue
        match = turns[int(rng.integers(len(turns)))]
        value, name = float(match[2]), match[1]
        if name in "ABC" and text.case.machine:
            # the axis nearest to the part only turns the tool about where it points when that is the pole
            if name != "C":
                yield Mutant("angle", text.changed(i, match, value + float(rng.choice([-2, 3, 10]))), text.near(i))
                if abs(value) > 3:
                    yield Mutant("sign of an angle", text.changed(i, match, -value), text.near(i))
        elif name in ("I", "J", "A3=", "B3=", "TX", "TY"):
            yield Mutant("vector", text.changed(i, match, value + float(rng.choice([-0.2, 0.1]))), text.near(i))
            if abs(value) > 0.05:
                yield Mutant("sign of a vector", text.changed(i, match, -value), text.near(i))
        else:  # second points stand 100 mm up the axis
            yield Mutant("point", text.changed(i, match, value + float(rng.choice([-30, 20]))), text.near(i))
    start = text.rapids[0]
    for match in [match for match in PLACE.finditer(text.lines[start]) if match[1] in "XZ"]:
        lost = text.with_line(start, text.lines[start].replace(match[0], ""))
        yield Mutant("start not known", lost, (start + 1, start + 3))
    for i in rng.choice(text.straight, 2, replace=False).tolist() if text.case.tcp and not text.case.machine else []:
        turns = list(text.turn.finditer(text.lines[i]))
        new = text.lines[i]
        for match, value in zip(reversed(turns), reversed(text.tip(i)), strict=False):
            same = f"{value:.4f}" if match[1] in ("U", "V", "W", "XH=", "YH=", "ZH=") else "0.0"
            new = new[: match.start(2)] + same + new[match.end(2) :]
        if turns:
            yield Mutant("axis without length", text.with_line(i, new), text.near(i))
    for _ in range(12 if text.case.tcp else 0):
        i = int(rng.choice(text.straight))
        if not {i - 1, i + 1} <= set(text.straight):
            continue
        way = np.cross(text.tip(i + 1) - text.tip(i - 1), rng.normal(size=3))
        if not way.any():
            continue
        bump = text.moved(i, text.tip(i) + 2 * EPS * way / np.linalg.norm(way))
        yield Mutant("bump", bump, text.near(i))


def of_blocks(text: Text, rng: np.random.Generator):
    lines = text.lines
    for _ in range(20 if text.case.tcp else 0):
        i = int(rng.choice(text.straight))
        if not {i - 1, i + 1, i + 2} <= set(text.straight) or " F" in lines[i] + lines[i + 1]:
            continue
        yield Mutant("doubled", [*lines[: i + 1], lines[i], *lines[i + 1 :]], None)
        if distance_to_chord(text.tip(i - 1), text.tip(i), text.tip(i + 1)) > 2.2 * EPS:
            yield Mutant("dropped", [*lines[:i], *lines[i + 1 :]], (i - 1, i + 3))
        if np.linalg.norm(text.tip(i + 1) - text.tip(i)) > 0.05:
            yield Mutant("swapped", [*lines[:i], lines[i + 1], lines[i], *lines[i + 2 :]], (i - 1, i + 5))
    for i in text.rapids:
        feed = lines[i].removesuffix(" FMAX") if text.heidenhain else "G1" + lines[i][2:]
        yield Mutant("rapid as feed", text.with_line(i, feed), (i - 1, i + 4))
        if i > text.rapids[0]:
            yield Mutant("rapid lost", [*lines[:i], *lines[i + 1 :]], (i - 2, i + 4))
    for _ in range(4):
        i = int(rng.choice(text.straight))
        plain = re.sub(r" F[\d.]+$", "", lines[i])
        yield Mutant(
            "feed as rapid", text.with_line(i, plain + " FMAX" if text.heidenhain else "G0" + plain[2:]), (i, i + 3)
        )
    for i in [i for i in text.straight if re.search(r" F[\d.]+$", lines[i])][:6]:
        head, feed = lines[i].rsplit(" F", 1)
        other = f"{float(feed) * 1.5:.3f}"
        yield Mutant("feed", text.with_line(i, f"{head} F{other}"), (i - 9, i + 11))


def of_words(text: Text):
    lines = text.lines
    last = len(lines)
    words = {
        "siemens": [("T3", "T4"), ("S12000 M3", "S1200 M3"), ("M8", "M9"), ("M1", "M0"), ("G4 F1.5", "G4 F15")],
        "heidenhain": [
            ("TOOL CALL 3 Z", "TOOL CALL 4 Z"),
            ("TOOL CALL Z S12000", "TOOL CALL Z S1200"),
            ("M3", "M4"),
            ("M8", "M9"),
            ("M1", "STOP"),
            ("CYCL DEF 9.1 DWELL 1.5", "CYCL DEF 9.1 DWELL 15"),
        ],
    }.get(
        text.case.control,
        [("T3 M6", "T4 M6"), ("S12000 M3", "S12000 M4"), ("M8", "M9"), ("M1", "M0"), ("G4 P1", "G4 P9")],
    )
    spoken = {
        re.sub(r"^\d+ ", "", line) if text.heidenhain else line: i for i, line in reversed(list(enumerate(lines)))
    }
    for old, new in words:
        i = next(place for said, place in spoken.items() if said.startswith(old))
        yield Mutant("statement", text.with_line(i, lines[i].replace(old, new, 1)), (0, last))
        yield Mutant("statement lost", [*lines[:i], *lines[i + 1 :]], (0, last))
    i = next(place for said, place in spoken.items() if said.startswith("M1") and said[:3] not in ("M19", "M13"))
    for j in (i - 6, i + 7):
        rest = [*lines[:i], *lines[i + 1 :]]
        while rest[j].startswith("K") or not PLACE.search(rest[j]):
            j += 1
        yield Mutant("statement moved", [*rest[:j], lines[i], *rest[j:]], (min(i, j) - 14, max(i, j) + 14))
    for old, new in (("G21", "G20"), ("G710", "G700"), (" MM", " INCH")):
        for i in [i for i, line in enumerate(lines[:5]) if old in line][:1]:
            yield Mutant("units", text.with_line(i, lines[i].replace(old, new)), (0, last))
    for old in ("G43.4", "G43.5", "G234", "TRAORI", "ORICURVE", "FUNCTION TCPM"):
        for i in [i for i, line in enumerate(lines) if old in line and "CYCLE" not in line][:1]:
            if text.case.control in ("generic", "linuxcnc"):
                continue
            yield Mutant("tip control lost", [*lines[:i], *lines[i + 1 :]], (0, last))
    i = text.straight[3]
    for strange in (" X1.0", " \x84\x31", " Q", " Ä1", " (=1", " A3=", " U1.0.0", " ++1"):
        yield Mutant("strange word", text.with_line(i, lines[i] + strange), (i + 1, i + 1))
    yield Mutant("lower case", [line.lower() for line in lines], None)


def of_curves(text: Text, rng: np.random.Generator):
    lines = text.lines
    for _ in range(12):
        i = int(rng.choice(text.curved))
        line = lines[i]
        if "PL=" in line and "PO[" not in line:
            other = "PL=0.5" if "PL=0 " in line else "PL=0"
            if not text.case.machine:  # with another interval a curve in rotary words may keep the tolerance
                yield Mutant("interval", text.with_line(i, re.sub(r"PL=[\d.]+", other, line)), (i - 10, i + 14))
            yield Mutant("weight zero", text.with_line(i, re.sub(r"PW=[\d.]+", "PW=0", line)), (i - 10, i + 14))
            yield Mutant("weight above 3", text.with_line(i, re.sub(r"PW=[\d.]+", "PW=3.5", line)), (i - 10, i + 14))
            yield Mutant("weight lost", text.with_line(i, re.sub(r" PW=[\d.]+", "", line)), None)
            yield Mutant("interval lost", text.with_line(i, re.sub(r" PL=[\d.]+", "", line)), (i - 10, i + 14))
        elif "PO[" in line:
            axis = str(rng.choice(["X", "Y", "Z", "XH", "YH"]))  # along the axis the second point may be anywhere
            new = re.sub(rf"(PO\[{axis}\]=\(-?[\d.]+),(-?)", r"\1,1\2", line)
            new = re.sub(r",1-", ",-1", new)
            yield Mutant("coefficient", text.with_line(i, new), (i - 2, i + 3))
            yield Mutant("length", text.with_line(i, line.replace("PL=1", "PL=0")), (i - 2, i + 3))
        elif " SPL " in line:
            factors = list(re.finditer(rf"(K[123][XYZ])({NUMBER})", line))
            match = factors[int(rng.integers(len(factors)))]
            yield Mutant("coefficient", text.changed(i, match, float(match[2]) + 1.0), (i - 2, i + 3))
        elif line.startswith(("K", "G6.2")):
            yield Mutant("weight zero", text.with_line(i, re.sub(r"R[\d.]+", "R0.", line)), (i - 10, i + 14))
            yield Mutant("knot", text.with_line(i, re.sub(r"K[\d.]+", "K7.", line)), (i - 10, i + 14))
            if "K0. " in line:  # without a later one there is a curve of fewer points, and it may be as good
                yield Mutant("point lost", [*lines[:i], *lines[i + 1 :]], (i - 10, i + 14))


def of_knots(text: Text, rng: np.random.Generator):
    """FANUC's G6.2 and its like: what must stand in which block of a curve."""
    lines = text.lines
    starts = [i for i in text.curved if lines[i].startswith("G6.2")]
    for i in rng.choice(starts, 5, replace=False).tolist():
        behind = next(j for j in range(i + 1, len(lines)) if not lines[j].startswith("K"))
        knots = behind - 4  # the first of the blocks that only have a knot
        whole = (i + 1, behind + 1)
        rest = [*lines[:i], *lines[behind:]]
        yield Mutant("order", text.with_line(i, lines[i].replace("P4", "P3")), whole)
        yield Mutant("order left out", text.with_line(i, lines[i].replace("P4 ", "")), None)
        yield Mutant("first knot", text.with_line(i, lines[i].replace("K0.", "K0.1")), whole)
        yield Mutant("last knot", text.with_line(behind - 1, "K9."), whole)
        yield Mutant("knot lost", [*lines[: behind - 1], *lines[behind:]], (i + 1, behind))
        yield Mutant("knot too many", [*lines[:behind], lines[behind - 1], *lines[behind:]], whole)
        bare = re.sub(r"^K\S+ ", "", lines[i + 1])
        yield Mutant("block without a knot", text.with_line(i + 1, bare), whole)
        yield Mutant("word inside", [*lines[: i + 2], "M8", *lines[i + 2 :]], (i + 1, behind + 2))
        match = PLACE.search(lines[i])
        yield Mutant("first point", text.changed(i, match, float(match[2]) + 1e-4), (i + 1, i + 2))
        late = re.sub(rf" Z{NUMBER}", "", lines[i])
        yield Mutant("axis that comes late", text.with_line(i, late), whole)
        yield Mutant("start lost", text.with_line(i, lines[i].replace("G6.2 P4 ", "")), whole)
        plain = [re.sub(r"^G6\.2 P4 |K\S+ ?| R\S+", "", line) for line in lines[i:behind]]
        without = [*lines[:i], *(re.sub(r" R\S+", "", line) for line in lines[i:behind]), *lines[behind:]]
        if all("R1." in line for line in lines[i:knots]):
            yield Mutant("weights 1 left out", without, None)
        yield Mutant(
            "start and weights lost", [*without[:i], without[i].replace("G6.2 P4 ", ""), *without[i + 1 :]], whole
        )
        yield Mutant("curve twice", [*lines[:behind], *lines[i:behind], *lines[behind:]], (i + 1, 2 * behind - i + 1))
        if text.case.machine or knots != i + 5:
            continue
        # the control points are those of a corner, on the straight ways beside it
        first, second, corner, fourth, last = (text.tip(j) for j in range(i, knots))
        yield Mutant("polygon", [*lines[:i], *filter(None, plain), *lines[behind:]], None)
        inward = (second + fourth) / 2 - corner
        far = float(np.linalg.norm((first + last) / 2 - corner))
        outward = corner - 0.002 * inward / np.linalg.norm(inward)
        yield Mutant("drawn out a little", text.moved(i + 2, outward), None)
        # half of what the third point moves by is how far the curve moves
        yield Mutant("drawn out", text.moved(i + 2, corner - 6 * EPS * inward / np.linalg.norm(inward)), whole)
        if far > 1.5 * EPS:
            yield Mutant("curve lost", rest, (i, i + 2))
        if far / 3 > 0.9 * EPS:  # the weight of the corner halves how far the curve goes there
            yield Mutant("weight", text.with_line(i + 2, lines[i + 2].replace("R1.", "R0.3")), whole)


def of_splines(text: Text, rng: np.random.Generator):
    """Heidenhain's SPL: where a spline begins follows from its coefficients."""
    lines = text.lines
    # the control's own rule: no more than a micrometre beside the end of the block before
    # with a machine each corner is many splines, and the text long
    for i in rng.choice([i for i in text.curved if i - 1 in text.straight], 6, replace=False).tolist():
        line, here = lines[i], (i + 1, i + 3)
        rest = lines[i + 1 :]
        slope = {match[1][2]: match for match in re.finditer(rf"(K1[XYZ])({NUMBER})", line)}
        match = slope[str(rng.choice(list("XYZ")))]
        yield Mutant("gap of 2 micrometres", text.changed(i, match, float(match[2]) + 0.002), here)
        # a spline that follows a line is farthest from the corner where it ends, and there nothing changes
        yield Mutant("gap of half a micrometre", text.changed(i, match, float(match[2]) + 0.0005), None)
        long = max(slope.values(), key=lambda match: abs(float(match[2])))
        yield Mutant("coefficient lost", text.with_line(i, line[: long.start()] + line[long.end() :]), here)
        spelt = text.with_line(i, re.sub(rf"(K[123][XYZ])({NUMBER})", exponent, line))
        yield Mutant("coefficients with exponents", spelt, None)
        yield Mutant("exponent", text.with_line(i, f"{line[: long.end()]}E+001{line[long.end() :]}"), here)
        # the axis along which the spline advances least: the way there and back is a deviation
        short = min(slope, key=lambda axis: abs(float(slope[axis][2])))
        bulge = 16 * EPS
        new = text.changed(i, slope[short], float(slope[short][2]) - bulge)
        square = re.search(rf"(K2{short})({NUMBER})", line)
        yield Mutant("bulge", Text(text.case, new).changed(i, square, float(square[2]) + bulge), (i, i + 3))
        yield Mutant("spline lost", [*lines[:i], *rest], here)
        yield Mutant("line with coefficients", text.with_line(i, line.replace(" SPL ", " L ")), (i + 1, i + 1))
        yield Mutant("spline without its word", text.with_line(i, line.replace(" SPL ", " ")), (i + 1, i + 1))
        yield Mutant("spline at rapid", text.with_line(i, line + " FMAX"), (i + 1, i + 2))
        yield Mutant("feed on a spline", text.with_line(i, line + " F77"), (i - 1, i + 14))
        yield Mutant("coefficient without a number", text.with_line(i, line.replace(long[0], long[1])), here)
        yield Mutant("spline twice", [*lines[:i], line, *lines[i:]], here)
        at = line.index(" K1Y")
        yield Mutant("folded", [*lines[:i], line[:at] + " ~", line[at + 1 :], *rest], None)
        yield Mutant("spline as a line", text.with_line(i, re.sub(r" K.*", "", line).replace(" SPL ", " L ")), None)
        chord = line
        for axis in "XYZ":
            total = sum(float(found) for found in re.findall(rf"K[123]{axis}({NUMBER})", line))
            chord = re.sub(rf" K3{axis}.*? K1{axis}{NUMBER}", f" K1{axis}{total:+.7f}", chord)
        yield Mutant("straight spline", text.with_line(i, chord), None)


def exponent(match: re.Match[str]) -> str:
    """Coefficient as the control's manual writes it."""
    return f"{match[1]}{float(match[2]):+.9E}"


def of_fixed(text: Text):
    """Words that turn or shift what is taken to stand still."""
    lines = text.lines
    if text.heidenhain:
        words = [" A+5.0", " C-30.0", " TX+0.1 TY+0.0 TZ+0.995", " RL", " RR", " M91", " M92"]
        blocks = [
            "CYCL DEF 7.1 X+10",
            "CYCL DEF 8.1 X",
            "CYCL DEF 10.1 ROT+35",
            "CYCL DEF 11.1 SCL 0.5",
            "PLANE SPATIAL SPA+0 SPB+10 SPC+0 STAY",
            "CALL LBL 1",
            "L IX+1.0",
        ]
    else:
        words = [" A5.", " I0.1 J0. K1.", " J0.5", " U0.5", " B2."]
        blocks = ["G52 X1.", "G92 X0.", "G68 X0. Y0. R10.", "G51.1 X0.", "G91", "G95", "G20", "G41 D1", "M98 P2"]
        i = next(i for i, line in enumerate(lines) if line.startswith("G43"))
        yield Mutant("tool offset", text.with_line(i, "G43 H4"), (i + 1, i + 1))
        yield Mutant("tool offset lost", [*lines[:i], *lines[i + 1 :]], (0, len(lines)))
        i = lines.index("G5 P10000")
        yield Mutant("high speed mode lost", [*lines[:i], *lines[i + 1 :]], (0, len(lines)))
    for k, word in enumerate(words):
        i = text.straight[3 + k]
        line = lines[i].replace(" L ", " LN ") if " TX" in word else lines[i]
        yield Mutant("tool axis or side", text.with_line(i, line + word), (i + 1, i + 2))
    for k, block in enumerate(blocks):
        i = text.straight[5 + k]
        yield Mutant("frame", [*lines[:i], block, *lines[i:]], (i + 1, i + 2))
