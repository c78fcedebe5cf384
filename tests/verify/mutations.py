"""Wrong texts made from correct ones. Each mutant says on which lines it should be found, or that it is harmless."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from oracle.frechet import frechet_distance

from .writing import job, number

EPS, H = 0.02, 10.0


@dataclass(frozen=True)
class Mutant:
    """A text, how it was made, and the lines (from 1) of which a problem must name one; None: it must pass."""

    kind: str
    lines: list
    where: tuple[int, int] | None


WORD = re.compile(r"([A-Z])(-?\d+\.?\d*)")


def words(line):
    return {letter: float(value) for letter, value in WORD.findall(line)}


def replaced(line, letter, value, decimals):
    return re.sub(rf"\b{letter}-?\d+\.?\d*", f"{letter}{number(value, decimals)}", line)


def with_line(lines, i, new):
    return [*lines[:i], new, *lines[i + 1 :]]


def is_motion(line):
    return (line[:1] == "G" and line.split()[0] in ("G0", "G1", "G6.2")) or (line[:1] == "K" and "X" in line)


def group(lines, i):
    """First and last line number (from 1) that a problem of line i may name: its curve, and a neighbour."""
    first = last = i
    while lines[first][0] == "K":
        first -= 1
    while lines[last + 1][0] == "K":
        last += 1
    return first, last + 2


def place(line, form):
    w = words(line)
    tip = np.array([w["X"], w["Y"], w["Z"]])
    if form == "g1":
        axis = np.array([w["I"], w["J"], w["K"]])
        return tip, tip + H * axis / np.linalg.norm(axis)
    return tip, np.array([w["U"], w["V"], w["W"]])


def distance_to_chord(a, p, b):
    d = b - a
    t = np.clip((p - a) @ d / max(d @ d, 1e-30), 0, 1)
    return np.linalg.norm(a + t * d - p)


def goes_back(tip, path):
    """Whether four tips with the inner two swapped cannot be run beside the CL path within ε: what can is harmless."""
    return frechet_distance(tip[[0, 2, 1, 3]], piece(path, tip[0], tip[3])) > EPS + 1e-4


def piece(path, start, end):
    """Of a polyline (n, 3), from where it is nearest to one point to where it is nearest to another."""
    feet = []
    for point in (start, end):
        d = np.diff(path, axis=0)
        t = np.clip(((point - path[:-1]) * d).sum(1) / np.maximum((d * d).sum(1), 1e-30), 0, 1)
        foot = path[:-1] + t[:, None] * d
        k = int(np.linalg.norm(foot - point, axis=1).argmin())
        feet.append((k + t[k], foot[k]))
    (first, a), (last, b) = feet
    return np.vstack((a, path[int(first) + 1 : int(np.ceil(last))], b))


def motion_mutants(form, lines, path, rng):
    motion = [i for i, line in enumerate(lines) if is_motion(line)]
    straight = [i for i in motion if lines[i].startswith("G1 ")]
    letters = "XYZIJK" if form == "g1" else "XYZUVW"
    # digits
    for _ in range(60):
        i = int(rng.choice(motion))
        letter = str(rng.choice(list(letters)))
        if lines[i][0] == "K" and letter == "K":
            continue
        w = words(lines[i])
        decimals = 7 if letter in "IJK" else 4
        unit = 10.0 ** -int(rng.integers(0, decimals + 1))
        change = unit * int(rng.integers(1, 10)) * int(rng.choice([-1, 1]))
        moved = abs(change) * (H if letter in "IJK" else 1.0)
        value = w[letter] + change
        new = replaced(lines[i], letter, value, decimals)
        curved = (
            lines[i][0] == "K"
            or lines[i].startswith("G6.2")
            or (i + 1 < len(lines) and lines[i + 1].startswith("G6.2"))
        )
        needed = 3.2 * EPS * (8 if curved else 1)  # a control point counts a quarter, or less
        if letter in "IJK" and moved > 3:  # a vector that is nearly one component barely turns by changing it
            continue
        if letter != "K" and moved > needed:
            yield Mutant("digit", with_line(lines, i, new), group(lines, i))
    # last digit only
    for _ in range(15):
        i = int(rng.choice(straight[3:-3]))
        if form == "g6.2" or lines[i + 1][:2] != "G1" or lines[i - 1][:2] != "G1":
            continue
        before, here, after = (place(lines[k], form)[0] for k in (i - 1, i, i + 1))
        if distance_to_chord(before, here, after) < 1e-3:
            continue  # may be a pose that must be exact
        w = words(lines[i])
        yield Mutant("last digit", with_line(lines, i, replaced(lines[i], "X", w["X"] + 1e-4, 4)), None)
    # sign
    for _ in range(15):
        i = int(rng.choice(motion))
        letter = str(rng.choice(list(letters)))
        w = words(lines[i])
        moved = 2 * abs(w[letter]) * (H if letter in "IJK" else 1.0)
        if moved > 16 * EPS and not (lines[i][0] in "K" and letter == "K") and not (form == "g6.2" and letter == "K"):
            decimals = 7 if letter in "IJK" else 4
            yield Mutant("sign", with_line(lines, i, replaced(lines[i], letter, -w[letter], decimals)), group(lines, i))
    # bump of two tolerances
    for _ in range(25):
        i = int(rng.choice(straight))
        tip, point = place(lines[i], form)
        side = np.cross(rng.normal(size=3), point - tip)
        # at right angles to the way through this pose, so that the bump is a deviation
        way = (
            place(lines[i + 1], form)[0] - place(lines[i - 1], form)[0]
            if is_motion(lines[i + 1]) and is_motion(lines[i - 1])
            else np.zeros(3)
        )
        if way @ way > 0:
            side = np.cross(way, rng.normal(size=3))
        side *= 2 * EPS / np.linalg.norm(side)
        new = lines[i]
        for k, letter in enumerate("XYZ"):
            new = replaced(new, letter, (tip + side)[k], 4)
        if form == "g6.2":
            for k, letter in enumerate("UVW"):
                new = replaced(new, letter, (point + side)[k], 4)
        yield Mutant("bump", with_line(lines, i, new), group(lines, i))
    # dropped, doubled, swapped
    for _ in range(40):
        i = int(rng.choice(straight))
        if not (is_motion(lines[i - 1]) and lines[i + 1][:2] == "G1"):
            continue
        before, here, after = (place(lines[k], form) for k in (i - 1, i, i + 1))
        off = max(distance_to_chord(before[k], here[k], after[k]) for k in (0, 1))
        if off > 2.2 * EPS:
            yield Mutant("dropped", [*lines[:i], *lines[i + 1 :]], (i - 1, i + 2))
        if " F" not in lines[i]:
            yield Mutant("doubled", [*lines[: i + 1], lines[i], *lines[i + 1 :]], None)
    for _ in range(25):
        i = int(rng.choice(straight))
        if lines[i + 1][:2] != "G1" or not is_motion(lines[i - 1]) or " F" in lines[i] + lines[i + 1]:
            continue
        tip = np.array([place(line, form)[0] for line in lines[i - 1 : i + 3]])
        if goes_back(tip, path):
            yield Mutant("swapped", [*lines[:i], lines[i + 1], lines[i], *lines[i + 2 :]], (i, i + 4))
    # a piece run twice, or left out
    for _ in range(40):
        i = int(rng.choice(straight[:-14]))
        j = i + int(rng.integers(3, 12 if form == "g1" else 60))
        if any(not is_motion(line) and line[0] != "K" for line in lines[i : j + 1]) or lines[i][0] != "G":
            continue
        if lines[j][:2] != "G1" or any(line.startswith("G0") or " F" in line for line in lines[i : j + 1]):
            continue
        way = np.linalg.norm(place(lines[j], form)[0] - place(lines[i], form)[0])
        if way < 0.2:
            continue
        yield Mutant("run twice", [*lines[: j + 1], *lines[i : j + 1], *lines[j + 1 :]], (i - 2, j + 1 + j - i + 10))
        points = [place(line, form)[0] for line in lines[i:j] if "X" in line]
        start, end = place(lines[i - 1], form)[0] if is_motion(lines[i - 1]) else points[0], place(lines[j], form)[0]
        if max(distance_to_chord(start, p, end) for p in points) > 4 * EPS:
            yield Mutant("left out", [*lines[:i], *lines[j:]], (i - 2, i + 12))
    # rapid as feed, feed as rapid
    rapids = [i for i, line in enumerate(lines) if line.startswith("G0 ")]
    for i in rapids:
        yield Mutant("rapid as feed", with_line(lines, i, "G1" + lines[i][2:]), (i - 1, i + 4))
        if i > rapids[0]:
            yield Mutant("rapid lost", [*lines[:i], *lines[i + 1 :]], (i - 2, i + 4))
    for _ in range(10):
        i = int(rng.choice(straight))
        yield Mutant("feed as rapid", with_line(lines, i, "G0" + lines[i][2:].split(" F")[0]), (i, i + 3))
    # tip and axis point exchanged
    if form == "g6.2":
        for _ in range(10):
            i = int(rng.choice(motion))
            new = lines[i].translate(str.maketrans("XYZUVW", "UVWXYZ"))
            yield Mutant("exchanged", with_line(lines, i, new), group(lines, i))


def curve_mutants(lines, rng):
    starts = [i for i, line in enumerate(lines) if line.startswith("G6.2")]
    for _ in range(14):
        i = int(rng.choice(starts))
        # third control point drawn in, as in a corner limited by the tolerance: c = 1/(3 (1 + w)) grows from 1/6
        a, x, b = (place(lines[i + k], "g6.2") for k in (0, 2, 4))
        middle = max(np.linalg.norm((p + q) / 2 - c) for p, c, q in zip(a, x, b, strict=True))
        yield (
            Mutant("weight", with_line(lines, i + 2, lines[i + 2].replace("R1.", "R0.05")), (i + 1, i + 10))
            if (middle / 3 * 1.9 > 1.15 * EPS)
            else Mutant("weight 1 written out", with_line(lines, i + 2, lines[i + 2].replace("R1.", "R1.000")), None)
        )
        yield Mutant("weight zero", with_line(lines, i + 1, lines[i + 1].replace("R1.", "R0.")), (i + 1, i + 10))
        yield Mutant("last knot", with_line(lines, i + 8, "K2."), (i + 1, i + 10))
        yield Mutant("first knot", with_line(lines, i + 1, lines[i + 1].replace("K0.", "K0.1")), (i + 1, i + 10))
        yield Mutant("falling knot", with_line(lines, i + 4, lines[i + 4].replace("K0.5", "K1.5")), (i + 1, i + 10))
        yield Mutant("knot lost", [*lines[: i + 8], *lines[i + 9 :]], (i + 1, i + 11))
        yield Mutant("word inside", [*lines[: i + 3], "M8", *lines[i + 3 :]], (i + 1, i + 11))
        yield Mutant("control point lost", [*lines[: i + 2], *lines[i + 3 :]], (i + 1, i + 10))
        w = words(lines[i])
        moved = replaced(lines[i], "Y", w["Y"] + 1e-4, 4)
        yield Mutant("first point", with_line(lines, i, moved), (i + 1, i + 2))


def word_mutants(lines, rng):
    def index(text):
        return next(i for i, line in enumerate(lines) if line.startswith(text))

    for text, others in (
        ("T3 M6", ["T4 M6", "T3", None]),
        ("S12000 M3", ["S1200 M3", "S12000 M4", "S12000", None]),
        ("M8", ["M9", "M7", None]),
        ("M1", ["M0", None]),
        ("G4 P1500", ["G4 P150", "G4 X15.", None]),
        ("M9", ["M8", None]),
        ("M7", ["M8", None]),
        ("M5", ["M3", None]),
        ("M30", [None]),
    ):
        i = index(text)
        for other in others:
            new = [*lines[:i], *([other] if other else []), *lines[i + 1 :]]
            yield Mutant("statement", new, (0, len(lines)))
        if i > index("G0 ") and text != "M30":
            for step in (-1, 1, 3, -4):
                j = i
                for _ in range(abs(step)):
                    j += int(np.sign(step))
                    while 0 < j < len(lines) - 4 and lines[j][0] == "K":
                        j += int(np.sign(step))
                rest = [*lines[:i], *lines[i + 1 :]]
                if not 0 < j < len(rest) - 3:
                    continue
                while rest[j][0] == "K":
                    j += 1
                moved = [*rest[:j], text, *rest[j:]]
                if sum(is_motion(line) for line in lines[min(i, j) : max(i, j)]):
                    yield Mutant("statement moved", moved, (min(i, j) - 1, max(i, j) + 4))
    for text, other in (("G43", None), ("G21", "G20 G90 G94 G17 G40 G49 G80"), ("G21", "G21 G90 G95 G17 G40 G49 G80")):
        i = index(text)
        if other:
            yield Mutant("units or feed mode", with_line(lines, i, other), (0, len(lines)))
        else:
            yield Mutant("tool offset", with_line(lines, i, lines[i].replace("H3", "H4")), (i + 1, i + 1))
    for i, line in enumerate(lines):
        if " F" in line:
            head, feed = line.rsplit(" F", 1)
            for other in ("", f" F{float(feed) + 7:g}", " F1" + feed):
                if i > index("G0 ") + 1 or other:
                    yield Mutant("feed", with_line(lines, i, head + other), (i - 9, i + 11))
    plain = [i for i, line in enumerate(lines) if line.startswith("G1 ") and " F" not in line]
    for _ in range(8):
        i = int(rng.choice(plain))
        yield Mutant("feed added", with_line(lines, i, lines[i] + " F333."), (i - 1, i + 11))
        feed = next(line.rsplit(" F", 1)[1] for line in reversed(lines[:i]) if " F" in line)
        yield Mutant("same feed again", with_line(lines, i, f"{lines[i]} F{feed}"), None)
    # nothing that matters
    yield Mutant("comment", [*lines[:6], "(A COMMENT WITH X1.2345678)", *lines[6:]], None)
    yield Mutant("block numbers", [f"N{i} {line}" if line[0] in "GK" else line for i, line in enumerate(lines)], None)
    yield Mutant("no blanks", [line.replace(" ", "") if line[0] in "GK" else line for line in lines], None)
    yield Mutant("lower case", [line.lower() for line in lines], None)
    yield Mutant("M8 again", [*lines[: index("M8")], "M8", *lines[index("M8") :]], None)


def mutants(form, seed):
    """Program and mutants of one base text."""
    program, lines = job(form, EPS, H, seed)
    rng = np.random.default_rng(1000 + seed)
    found = [*motion_mutants(form, lines, program.tip, rng), *word_mutants(lines, rng)]
    if form == "g6.2":
        found += curve_mutants(lines, rng)
    return program, lines, found
