"""What another reader makes of a program before and after the filter: all but the cuts of runs must be the same."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from oracle.frechet import leash_is_enough

#: kind of a row and its numbers: what a reader says of a program, in order
Row = tuple[str, tuple[float, ...]]

PYTHON = Path("/usr/bin/python3")
CANON = Path(__file__).parents[1] / "nc" / "linuxcnc_canon.py"


#: words that a filter may add to its runs
_OF_RUNS = {"G1", "G90", "G91", "G93", "G94"}

#: what the interpreter does not take without the running controller, and the title of other controls
_LEFT_OUT = re.compile(rb"(?m)^((N\d+ )?T\d+ M6|G43 H\d+(?: (?=G|Z))?|M42[89]|M6|O\d+$|T\d+$)")


def by_rs274(text: bytes, folder: Path) -> list[Row]:
    """Rows of LinuxCNC's interpreter."""
    file = folder / "program.ngc"
    file.write_bytes(_LEFT_OUT.sub(b"", text))
    result = subprocess.run([PYTHON, CANON, file], capture_output=True, text=True, check=False, timeout=120)
    assert result.returncode == 0, result.stderr
    rows = [line.split() for line in result.stdout.splitlines()]
    return [(row[0], tuple(map(float, row[2:]))) for row in rows if row[0].isalpha()]


def by_words(text: bytes) -> list[Row]:
    """Rows of FANUC's, Haas's, Siemens's and Klartext's plain words: group 01, hole cycles, distances, places.

    What is no motion is a row of its own, as it is written. Modal cycles (G73, G81 to G89) make a hole at each place,
    but for L0; G80 and group 01 end them.
    """
    rows: list[Row] = []
    here = dict.fromkeys("XYZABC", 0.0)
    code, absolute = "", True
    for line in text.decode("latin-1").upper().splitlines():
        plain = re.sub(r"\([^)]*\)|;.*|^\s*(N?\d+\s+|N\d+)|[ABC]3\s*=\s*[-\d.]+|T[XYZ][-+][\d.]+", " ", line).strip()
        if re.match(r"LN?\s", plain):  # Klartext
            code, plain = "0" if "FMAX" in plain.replace(" ", "") else "1", re.sub(r"^LN?|R[0LR]\b|F ?MAX", "", plain)
        words = re.findall(r"([A-Z])\s*=?\s*([-+]?(?:\d+\.?\d*|\.\d+))", plain)
        if not {"G2", "G02", "G3", "G03"} & {letter + value for letter, value in words}:  # a vector of the tool
            words = [word for word in words if word[0] not in "IJK"]
        codes = [f"{float(value):g}" for letter, value in words if letter == "G"]
        others = [word for word in words if word[0] not in "XYZABCF" and f"{word[0]}{float(word[1]):g}" not in _OF_RUNS]
        for value in codes:
            absolute = absolute if value not in ("90", "91") else value == "90"
            if value in ("0", "1", "2", "3", "80", "73") or re.fullmatch("8[1-9]", value):
                code = value
        if plain and (others or not words):
            rows.append((plain if not words else " ".join(letter + value for letter, value in others), ()))
        aside = {"28", "30", "53", "10", "92", "52", "4", "68", "5"} & set(codes) or re.search("CYC|SUPA|PLANE", plain)
        places = {letter: float(value) for letter, value in words if letter in here}
        if aside or not places:
            if aside:
                rows.append((plain, ()))
            continue
        for letter, value in places.items():
            if code in ("0", "1", "2", "3") or letter != "Z":  # Z of a cycle is its depth
                here[letter] = value if absolute else here[letter] + value
        kind = {"0": "rapid", "1": "feed", "2": "arc", "3": "arc", "": "unknown", "80": "unknown"}.get(code, "hole")
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
        if len(fed) and not leash_is_enough(fed, other_fed, tolerance):
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
        place = np.array(numbers[:3]) if kind in ("rapid", "hole", "arc") else place
        row, fed = (kind, numbers), []
    yield row, np.array(fed)
