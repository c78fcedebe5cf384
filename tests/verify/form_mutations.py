"""Wrong texts made from correct ones, for every control and form: the text is the writer's, the mistakes are ours.

As `mutations`, which knows FANUC's two forms by heart; here words are found by what they look like in each control.
"""

from __future__ import annotations

import re

import numpy as np

from cornersmooth.model import Program
from nc.cases import Case

from .mutations import Mutant, distance_to_chord
from .writing import job

EPS, H = 0.02, 10.0

NUMBER = r"[-+]?\d+\.?\d*"
PLACE = re.compile(rf"(?<![A-Z0-9\[])([XYZ])({NUMBER})")
TURN = {
    "fanuc": rf"(?<![A-Z0-9])([IJABCUVW])({NUMBER})",
    "siemens": rf"(?<![A-Z0-9])([ABC]3=|[XYZ]H=|[ABC])({NUMBER})",
    "heidenhain": rf"(?<![A-Z0-9])(T[XYZ]|[ABC])({NUMBER})",
}
RAPID = {"heidenhain": " FMAX"}


def program_of() -> Program:
    """Program with everything in it."""
    return job("g1", EPS, H, 0)[0]


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


def mutants(case: Case, lines: list[str]) -> list[Mutant]:
    """Mutants of the text of `program_of`."""
    text, rng = Text(case, lines), np.random.default_rng(7)
    found = [*of_numbers(text, rng), *of_blocks(text, rng), *of_words(text)]
    if text.curved:
        found += of_curves(text, rng)
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
        else:
            yield Mutant("point", text.changed(i, match, value + float(rng.choice([-3, 2]))), text.near(i))
    for _ in range(12 if text.case.tcp else 0):
        i = int(rng.choice(text.straight))
        if not {i - 1, i + 1} <= set(text.straight):
            continue
        way = np.cross(text.tip(i + 1) - text.tip(i - 1), rng.normal(size=3))
        if not way.any():
            continue
        moved, new = text.tip(i) + 2 * EPS * way / np.linalg.norm(way), list(text.lines)
        for match, value in reversed(list(zip(PLACE.finditer(text.lines[i]), moved, strict=True))):
            new = Text(text.case, new).changed(i, match, float(value))
        yield Mutant("bump", new, text.near(i))


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
            yield Mutant("interval", text.with_line(i, re.sub(r"PL=[\d.]+", other, line)), (i - 10, i + 14))
            yield Mutant("weight zero", text.with_line(i, re.sub(r"PW=[\d.]+", "PW=0", line)), (i - 10, i + 14))
            yield Mutant("weight above 3", text.with_line(i, re.sub(r"PW=[\d.]+", "PW=3.5", line)), (i - 10, i + 14))
            yield Mutant("weight lost", text.with_line(i, re.sub(r" PW=[\d.]+", "", line)), None)
            yield Mutant("interval lost", text.with_line(i, re.sub(r" PL=[\d.]+", "", line)), (i - 10, i + 14))
        elif "PO[" in line:
            axis = str(rng.choice(["X", "Y", "Z", "XH", "YH", "ZH"]))
            new = re.sub(rf"(PO\[{axis}\]=\(-?[\d.]+),(-?)", r"\1,1\2", line)
            new = re.sub(r",1-", ",-1", new)
            yield Mutant("coefficient", text.with_line(i, new), (i - 2, i + 3))
            yield Mutant("length", text.with_line(i, line.replace("PL=1", "PL=0")), (i - 2, i + 3))
        elif " SPL " in line and "~" not in line:
            factors = list(re.finditer(rf"(K[123][XYZ])({NUMBER})", line))
            match = factors[int(rng.integers(len(factors)))]
            yield Mutant("coefficient", text.changed(i, match, float(match[2]) + 1.0), (i - 2, i + 3))
        elif line.startswith(("K", "G6.2")):
            yield Mutant("weight zero", text.with_line(i, re.sub(r"R[\d.]+", "R0.", line)), (i - 10, i + 14))
            yield Mutant("knot", text.with_line(i, re.sub(r"K[\d.]+", "K7.", line)), (i - 10, i + 14))
            if "K0. " in line:  # without a later one there is a curve of fewer points, and it may be as good
                yield Mutant("point lost", [*lines[:i], *lines[i + 1 :]], (i - 10, i + 14))
