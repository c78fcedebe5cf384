"""What another reader makes of a program before and after the filter: all but the cuts of runs must be the same."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from oracle.frechet import leash_is_enough
from oracle.interpreter import rows_of

#: kind of a row and its numbers: what a reader says of a program, in order
Row = tuple[str, tuple[float, ...]]


#: words that a filter may add to its runs
_OF_RUNS = {"G1", "G2", "G3", "G17", "G18", "G19", "G90", "G91", "G93", "G94"}

#: planes by their numbers in the interpreter, and axes of G17, G18 and G19 in the order of a right-handed turn
_PLANES = {1: 17, 2: 19, 3: 18}
_AXES = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}

#: mm; how far chords may be off the arcs that they are taken for
_CHORD = 1e-4


def on_arc(start: np.ndarray, end: np.ndarray, centre: np.ndarray, plane: int, clockwise: bool) -> Iterator[np.ndarray]:
    """Points of a helix of less than a turn; a whole one where it ends where it begins. The radius goes evenly over."""
    u, v, w = _AXES[plane]
    before, behind = start[[u, v]] - centre, end[[u, v]] - centre
    first, last = np.arctan2(before[1], before[0]), np.arctan2(behind[1], behind[0])
    turn = (first - last if clockwise else last - first) % (2 * np.pi) or 2 * np.pi
    count = int(np.ceil(turn * np.sqrt(np.hypot(*before) / (8 * _CHORD)))) + 1
    for part in np.linspace(0.0, 1.0, count + 1)[1:]:
        point, angle = end.copy(), first + part * (-turn if clockwise else turn)
        radius = (1 - part) * np.hypot(*before) + part * np.hypot(*behind)
        point[[u, v]] = centre + radius * np.array([np.cos(angle), np.sin(angle)])
        point[w] = (1 - part) * start[w] + part * end[w]
        yield point if part < 1.0 else end


def by_radius(start: np.ndarray, end: np.ndarray, radius: float, plane: int, clockwise: bool) -> np.ndarray:
    """Centre of the arc of at most half a turn."""
    u, v, _ = _AXES[plane]
    a, chord = start[[u, v]], end[[u, v]] - start[[u, v]]
    rise = np.sqrt(max(radius**2 - chord @ chord / 4, 0.0)) / np.hypot(*chord)
    return a + chord / 2 + (-rise if clockwise else rise) * np.array([-chord[1], chord[0]])


#: what the interpreter does not take without the running controller, and the title of other controls
_LEFT_OUT = re.compile(rb"(?m)^((N\d+ )?T\d+ M6|G43 H\d+(?: (?=G|Z))?|M42[89]|M6|O\d+$|T\d+$)")


def by_rs274(text: bytes, folder: Path) -> list[Row]:
    """Rows of LinuxCNC's interpreter; RefusedError where it does not take the program."""
    found: list[Row] = []
    place, plane = np.zeros(3), 17
    for kind, _, *texts in rows_of(_LEFT_OUT.sub(b"", text), folder):
        numbers = tuple(map(float, texts)) if kind.isalpha() else ()
        if kind == "plane":
            plane = _PLANES[int(numbers[0])]
        elif kind == "arc":
            end, centre = np.array(numbers[:3]), 25.4 * np.array(numbers[3:5])
            points = on_arc(place, end, centre, plane, numbers[5] < 0)
            found += [("feed", (*point.tolist(), *numbers[7:10])) for point in points]
            place = end
        elif kind.isalpha():
            found.append((kind, numbers))
            place = np.array(numbers[:3]) if kind in ("feed", "rapid") else place
    return found


def by_words(text: bytes) -> list[Row]:
    """Rows of FANUC's, Haas's, Siemens's and Klartext's plain words: group 01, hole cycles, distances, places.

    What is no motion is a row of its own, as it is written. Modal cycles (G73, G81 to G89) make a hole at each place,
    but for L0; G80 and group 01 end them.
    """
    rows: list[Row] = []
    here = dict.fromkeys("XYZABC", 0.0)
    code, absolute, plane = "", True, 17
    for line in text.decode("latin-1").upper().splitlines():
        plain = re.sub(r"\([^)]*\)|;.*|^\s*(N?\d+\s+|N\d+)|[ABC]3\s*=\s*[-\d.]+|T[XYZ][-+][\d.]+", " ", line).strip()
        klartext = re.match(r"CR\s.*DR([-+])", plain)
        if klartext:
            plain = plain.replace("CR", "G2" if klartext[1] == "-" else "G3", 1).replace(klartext[0][-3:], "")
        if re.match(r"LN?\s", plain):  # Klartext
            code, plain = "0" if "FMAX" in plain.replace(" ", "") else "1", re.sub(r"^LN?|R[0LR]\b|F ?MAX", "", plain)
        words = re.findall(r"([A-Z])\s*=?\s*([-+]?(?:\d+\.?\d*|\.\d+))", plain)
        if not {"G2", "G02", "G3", "G03"} & {letter + value for letter, value in words}:  # a vector of the tool
            words = [word for word in words if word[0] not in "IJK"]
        codes = [f"{float(value):g}" for letter, value in words if letter == "G"]
        arc = code in ("2", "3") or {"2", "3"} & set(codes)
        aside_letters = "XYZABCF" + "IJKR" * bool(arc)
        others = [
            word for word in words if word[0] not in aside_letters and f"{word[0]}{float(word[1]):g}" not in _OF_RUNS
        ]
        for value in codes:
            absolute = absolute if value not in ("90", "91") else value == "90"
            plane = int(value) if value in ("17", "18", "19") else plane
            if value in ("0", "1", "2", "3", "80", "73") or re.fullmatch("8[1-9]", value):
                code = value
        if plain and (others or not words):
            rows.append((plain if not words else " ".join(letter + value for letter, value in others), ()))
        aside = {"28", "30", "53", "10", "92", "52", "4", "68", "5"} & set(codes) or re.search("CYC|SUPA|PLANE", plain)
        places = {letter: float(value) for letter, value in words if letter in here}
        before = np.array([here[letter] for letter in "XYZ"])
        if aside or not places:
            if aside:
                rows.append((plain, ()))
            continue
        for letter, value in places.items():
            if code in ("0", "1", "2", "3") or letter != "Z":  # Z of a cycle is its depth
                here[letter] = value if absolute else here[letter] + value
        if code in ("2", "3"):
            end, given = np.array([here[letter] for letter in "XYZ"]), {letter: float(value) for letter, value in words}
            offset = np.array([given.get(letter, 0.0) for letter in "IJK"])[list(_AXES[plane][:2])]
            centre = before[list(_AXES[plane][:2])] + offset
            if "R" in given:
                centre = by_radius(before, end, given["R"], plane, code == "2")
            turning = tuple(here[letter] for letter in "ABC")
            rows += [("feed", (*point.tolist(), *turning)) for point in on_arc(before, end, centre, plane, code == "2")]
            continue
        kind = {"0": "rapid", "1": "feed", "": "unknown", "80": "unknown"}.get(code, "hole")
        if kind != "hole" or ("L", "0") not in words:
            rows.append((kind, (*here.values(), *((places.get("Z", 0.0),) if kind == "hole" else ()))))
    return rows


def difference(old: Sequence[Row], new: Sequence[Row], tolerance: float) -> str:
    """Say what another reader finds that a filter must not have done; empty for nothing."""
    before, after = list(_stretches(old)), list(_stretches(new))
    for (row, fed), (other, other_fed) in zip(before, after, strict=False):
        if row[0] != other[0] or not np.allclose(row[1], other[1], rtol=0.0, atol=1e-6):
            return f"{row} became {other}"
        if bool(len(fed)) != bool(len(other_fed)):
            return f"cuts after {row} came or went"
        if len(fed) and not leash_is_enough(fed, other_fed, tolerance + 2 * _CHORD):
            return f"cuts after {row} are farther away than {tolerance}"
    return "" if len(before) == len(after) else f"{len(before)} rows became {len(after)}"


def _stretches(rows: Sequence[Row]) -> Iterator[tuple[Row, np.ndarray]]:
    """Each row that is no cut, and the places of the cuts behind it, with where they begin."""
    place, row, fed = np.zeros(3), ("begin", ()), []
    for kind, numbers in rows:
        if kind == "feed":
            fed += [] if fed else [place]
            place = np.array(numbers[:3])
            fed.append(place)
            continue
        yield row, np.array(fed)
        place = np.array(numbers[:3]) if kind in ("rapid", "hole") else place
        row, fed = (kind, numbers), []
    yield row, np.array(fed)
