"""SINUMERIK 840D sl and ONE: TRAORI with A3= B3= C3=, XH= YH= ZH= or rotary words; BSPLINE and POLY."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.verify.dialects.base import AFTER_MOTION, Dialect, State
from cornersmooth.verify.lexer import Lexer, last_match, respelt
from cornersmooth.verify.words import BSPLINE, POLY, Line, Table

#: names of words of several letters: vectors are I J K, second points U V W, as in `motion`
_NAMES: Final = {
    "A3": "I",
    "B3": "J",
    "C3": "K",
    "XH": "U",
    "YH": "V",
    "ZH": "W",
    "PL": "PL",
    "PW": "PW",
    "CR": "R",
    "SD": "SD",
}
_BYTES: Final = {name: bytes([0x81 + place]) for place, name in enumerate(_NAMES)}
_PO: Final = {"X": "X", "Y": "Y", "Z": "Z", "XH": "U", "YH": "V", "ZH": "W"}
_PO_BYTES: Final = {name: bytes([0x91 + place]) for place, name in enumerate(_PO)}
_POLY_BYTE: Final = b"\x90"

_SPELT: Final = (
    *((f"{name}=".encode(), spelt) for name, spelt in _BYTES.items()),
    (b"BSPLINE " + _BYTES["SD"], _BYTES["SD"]),
    (b"POLY PO[", _POLY_BYTE + b"1 PO["),
    *((f"PO[{name}]=(".encode(), spelt) for name, spelt in _PO_BYTES.items()),
    *((b") " + spelt, b" " + spelt) for spelt in (*_PO_BYTES.values(), _BYTES["PL"])),
)
_COLUMNS: Final[Mapping[int, str]] = {
    **{spelt[0]: _NAMES[name] for name, spelt in _BYTES.items()},
    **{spelt[0]: _PO[name] for name, spelt in _PO_BYTES.items()},
    _POLY_BYTE[0]: "POLY",
}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_WORD: Final = re.compile(
    rf"PO\[(?P<po>\w+)\]=\((?P<factors>[-+.\d,\s]+)\)"
    rf"|(?P<name>[A-Z][A-Z]?\d?|SPOS)\s*=\s*(?P<given>{_NUMBER})"
    rf"|(?P<letter>[A-Z])\s*(?P<value>{_NUMBER})(?!=)"
    rf"|(?P<call>[A-Z_][A-Z_0-9]*)\s*(?:\([^()]*\))?"
)
_COMMENT: Final = re.compile(r";(.*)$")
_STARTS: Final = re.compile(rb"\n[ /]*(?:N\d+ *)?(?:G|BSPLINE|POLY)")

#: words and calls that change nothing measured here
_SILENT_CALLS = frozenset(("CYCLE832", "ORIWKS", "ORIMKS", "FFWON", "FFWOF", "SOFT", "BRISK", "STOPRE", "MSG", "CFTCP"))
_SILENT_CODES = frozenset((9.0, 53.0, *map(float, range(54, 60)), 60.0, 64.0, 90.0, *map(float, range(500, 506))))
_SILENT_CODES |= frozenset(map(float, (153, 601, 602, 641, 642, 643, 644, 645)))
_ORIENTATIONS = ("ORIVECT", "ORIPLANE", "ORICURVE", "ORIAXES")
_CODES = (0.0, 1.0, 2.0, 3.0)


class Siemens(Dialect):
    """Words of letters, words with ``=``, and keywords.

    Parameters
    ----------
    rotary : str
        Addresses of the rotary axes; empty without a machine.
    """

    unsaid = frozenset(("offset", "register", ("coolant", 88.0)))
    controls = {  # noqa: RUF012
        "vector": ("TRAORI ORIVECT", "TRAORI ORIPLANE", "TRAORI"),
        "point": ("TRAORI ORICURVE",),
        "angles": ("TRAORI ORIAXES", "TRAORI"),
        "machine": ("",),
    }
    digits = re.compile(rb"(?:([XYZ])|([\x81-\x86]))[-+]?\d*\.(\d*)")

    def __init__(self, rotary: str = "") -> None:
        super().__init__(_Lexer(rotary), rotary)

    def row(self, line: Line) -> dict[str, float] | None:
        """Words of a motion block; None where the line is something else."""
        row = {name: value for name, value, _ in line.words}
        if len(row) != len(line.words) or row.get("G", 1.0) not in _CODES or "=" in row:
            return None
        arc = row.get("G") in (2.0, 3.0)
        known = {"N", "G", "X", "Y", "Z", "F", "PL", "PW", "SD", "POLY", "BSPLINE", *self.rotary}
        known |= {f"{axis}{power}" for axis in "XYZUVW" for power in "23"}
        known |= {"R", "centre I", "centre J", "centre K"} if arc else set() if self.rotary else set("IJKUVW")
        if not set(row) <= known or not set(row) & self.lexer.places:
            return None
        curved = {name for name in row if name[-1] in "23"}
        if (curved and "POLY" not in row) or row.pop("SD", 3.0) != 3.0 or len({"G", "POLY", "BSPLINE"} & set(row)) > 1:
            return None
        for word, code in (("BSPLINE", BSPLINE), ("POLY", POLY)):
            if word in row:
                row["G"] = code
                del row[word]
        row.pop("N", None)
        return {name.removeprefix("centre "): value for name, value in row.items()}

    def words(self, line: Line, state: State) -> None:
        """Interpret a line that is no motion block."""
        if any(name == "G" and value == 4.0 for name, value, _ in line.words):
            given = {name: value for name, value, _ in line.words}
            if "F" not in given:
                state.refuse(line, "a dwell in revolutions", "give it in seconds")
            state.event(line, "G", 4.0, f"{1000.0 * given['F']:.10g}")
            return
        motion: dict[str, float] = {}
        for name, value, text in line.words:
            if name == "G" and value in _CODES:
                motion["G"] = value
            elif name == "G":
                self._mode(value, line, state)
            elif name in ("M", "T", "S"):
                state.event(line, name, value, text, late=name == "M" and value in AFTER_MOTION)
            elif name == "SPOS":
                state.event(line, "M", 19.0, text)
            elif name in ("X", "Y", "Z", "F", *self.rotary):
                motion[name] = value
            elif name in ("TRAORI", "TRAFOOF", *_ORIENTATIONS):
                self._transform(name, state)
            elif name not in ("D", "N") and name not in _SILENT_CALLS:
                self._refuse(line, name, text, state)
        state.move(line, motion)

    def _refuse(self, line: Line, name: str, text: str, state: State) -> None:
        if name in "ABC":
            state.refuse(line, f"{text}: rotary words", "name the machine they are for, with --machine")
        state.refuse(line, f"{text} is not understood here", "see that the control is the one the text is for")

    def _transform(self, name: str, state: State) -> None:
        on = state.tip_control.startswith("TRAORI")
        if name in _ORIENTATIONS:
            state.memory["orientation"] = name
        else:
            on = name == "TRAORI"
        state.tip_control = f"TRAORI {state.memory.get('orientation', '')}".rstrip() if on else ""

    def _mode(self, code: float, line: Line, state: State) -> None:
        if code in (17.0, 18.0, 19.0):
            state.change(line, plane=int(code))
        elif code in (70.0, 71.0, 700.0, 710.0):
            state.change(line, inch=code in (70.0, 700.0))
        elif code in (93.0, 94.0, 95.0):
            state.change(line, per_revolution=code == 95.0, inverse_time=code == 93.0)
        elif code in (40.0, 41.0, 42.0):
            state.event(line, "G", code, f"G{code:g}")
        elif code not in _SILENT_CODES:
            state.refuse(line, f"G{code:g} is not understood", "only absolute milling is read")


class _Lexer(Lexer):
    """Words of several letters as one byte each."""

    def __init__(self, rotary: str) -> None:
        super().__init__("GXYZFN" + rotary, {*"XYZ", *(rotary or "IJKUVW")}, (0.0, 1.0))
        self._known = self.letters | set(_COLUMNS.values()) if not rotary else self.letters

    def respell(self, chunk: bytes) -> bytes:
        """Return the text as `block_tables` is to read it, with the same lines."""
        return respelt(chunk, _SPELT)

    def cut(self, piece: bytes) -> int:
        """Where no curve is cut in two."""
        return last_match(_STARTS, piece)

    def columns(self, signature: bytes) -> tuple[str, ...] | None:
        """Return a name for every letter of a line; None for a line that is read on its own."""
        names: list[str] = []
        for code in signature:
            if code == ord(","):  # the coefficients behind an end
                axis, power = ("", 0) if not names else (names[-1][:1], int(names[-1][1:] or "1"))
                if axis not in "XYZUVW" or power > 2 or "POLY" not in names:
                    return None
                names.append(f"{axis}{power + 1}")
            else:
                names.append(_COLUMNS.get(code, chr(code)))
        known = {name for name in names if name[1:] not in ("2", "3")}
        if len(set(names)) != len(names) or not known <= self._known or not known & self.places:
            return None
        return tuple(names)

    def table(self, table: Table) -> Table | None:
        """Return a run with codes for what is said in words."""
        given = table.columns
        code = table.column("G")
        if "R" in given or not (np.isnan(code) | np.isin(code, self.codes)).all():
            return None
        for name, value, said in (("SD", 3.0, BSPLINE), ("POLY", 1.0, POLY)):
            column = given.get(name)
            if column is None:
                continue
            here = ~np.isnan(column)
            if (column[here] != value).any() or not np.isnan(code[here]).all():
                return None
            code = np.where(here, said, code)
        columns = {name: column for name, column in given.items() if name not in ("SD", "POLY", "N")}
        return Table(table.line, {**columns, "G": code})

    def line(self, text: bytes, number: int, name: str | None) -> Line:
        """Take one line apart, as it was written."""
        line = text.decode("latin-1").strip()
        comments = tuple(comment.strip() for comment in _COMMENT.findall(line))
        rest = _COMMENT.sub("", line).strip().upper().lstrip("/").lstrip()
        if rest.startswith("%"):
            rest = ""
        words: list[tuple[str, float, str]] = []
        place = 0
        while place < len(rest):
            match = _WORD.match(rest, place)
            if match is None:
                raise _no_word(rest[place : place + 20], name, number)
            words += _words_of(match, name, number)
            place = match.end()
            while place < len(rest) and rest[place] in " \t":
                place += 1
        return Line(number, tuple(words), comments)


def _words_of(match: re.Match[str], name: str | None, number: int) -> list[tuple[str, float, str]]:
    """Words of one match: an axis of a polynomial has several."""
    text = match[0].strip()
    if match["po"]:
        factors = [part.strip() for part in match["factors"].split(",")]
        axis = _PO.get(match["po"])
        if axis is None or len(factors) > 3 or not all(re.fullmatch(_NUMBER, part) for part in factors):
            raise _no_word(text, name, number)
        return [(axis + ("", "2", "3")[k], float(part), text) for k, part in enumerate(factors)]
    if match["name"]:
        word = match["name"]
        return [(_NAMES.get(word, word if len(word) == 1 or word == "SPOS" else "="), float(match["given"]), text)]
    if match["letter"]:
        letter = match["letter"]
        return [(f"centre {letter}" if letter in "IJK" else letter, float(match["value"]), text)]
    return [(match["call"], 0.0, text)]


def _no_word(text: str, name: str | None, number: int) -> InputError:
    return InputError(
        "CS501", f"{text!r} is no NC word", "give a file written for this control", file=name, line=number
    )
