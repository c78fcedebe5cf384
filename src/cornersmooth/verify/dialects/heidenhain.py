"""HEIDENHAIN Klartext: LN with TX TY TZ, L with rotary words, SPL of the iTNC 530, under FUNCTION TCPM."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.verify.dialects.base import AFTER_MOTION, Dialect, State
from cornersmooth.verify.lexer import Lexer, respelt
from cornersmooth.verify.words import SPL, Line, Table

_AXES: Final = "XYZABC"
_VECTOR: Final = {"TX": "I", "TY": "J", "TZ": "K"}
_FACTORS: Final = tuple(f"K{power}{axis}" for axis in _AXES for power in "321")

#: what a block begins with, and the bytes that stand for words
_LINES: Final = {"L": 1.0, "LN": 2.0, "SPL": 3.0}
_PATH, _RAPID = b"\x84", b"\x85"
_BYTES: Final = {
    **{name: bytes([0x81 + place]) for place, name in enumerate(_VECTOR)},
    **{name: bytes([0x91 + place]) for place, name in enumerate(_FACTORS)},
}
_SPELT: Final = (
    *((f" {word} ".encode(), b" " + _PATH + b"%d " % value) for word, value in _LINES.items()),
    (b" FMAX", b" " + _RAPID + b"1"),
    *((name.encode(), spelt) for name, spelt in _BYTES.items()),
    *((spelt + b"+", spelt) for spelt in (*_BYTES.values(), *(axis.encode() for axis in _AXES), b"E")),
)
_COLUMNS: Final[Mapping[int, str]] = {
    **{spelt[0]: _VECTOR.get(name, name) for name, spelt in _BYTES.items()},
    _PATH[0]: "PATH",
    _RAPID[0]: "RAPID",
}
_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)"
_WORD: Final = re.compile(
    rf"(?P<factor>K[123][XYZABC])(?P<of>{_NUMBER}(?:E[-+]?\d+)?)|(?P<vector>T[XYZ])(?P<part>{_NUMBER})"
    rf"|(?P<rapid>F ?MAX\b)|(?P<turn>DR[-+])|(?P<side>R[0LR])(?!\w)|(?P<letter>[A-Z])(?P<value>{_NUMBER})"
)
_TOOL_CALL: Final = re.compile(rf"TOOL CALL(?: (\d+))?(?: [XYZ])?(?: S({_NUMBER}))?(?: F{_NUMBER})?(?: D.*)?")
_COMMENT: Final = re.compile(r";(.*)$")
_START: Final = re.compile(r"(?P<number>\d+)\s+(?P<rest>.*)|(?P<bare>.*)")
_FOLDED: Final = re.compile(rb"[^\n]*~[ \r]*\n(?:[^\n]*~[ \r]*\n)*[^\n]*\n?")

#: blocks that change nothing measured here
_SILENT = ("BEGIN PGM", "END PGM", "BLK FORM", "CYCL DEF 32", "CYCL DEF 9.0", "* -", "*-", "LBL")
_SIDES = {"R0": 40.0, "RL": 41.0, "RR": 42.0}


class Heidenhain(Dialect):
    """Blocks that say in words what they are.

    Parameters
    ----------
    rotary : str
        Addresses of the rotary axes; empty without a machine.
    """

    feed_step = 1e-3
    inch_feed = 0.1
    unsaid = frozenset(("offset", "compensation", "register", ("spindle", 19.0), ("coolant", 7.0), ("coolant", 88.0)))
    controls = {"vector": ("TCPM VECTOR", "M128"), "angles": ("TCPM AXIS", "M128"), "machine": ("",)}  # noqa: RUF012
    digits = re.compile(rb"(?:([XYZ])|([\x81-\x83]))[-+]?\d*\.(\d*)")

    def __init__(self, rotary: str = "") -> None:
        super().__init__(_Lexer(rotary), rotary)

    def row(self, line: Line) -> dict[str, float] | None:
        """Words of a motion block; None where the line is something else."""
        row = {name: value for name, value, _ in line.words}
        if len(row) != len(line.words) or not {*row} <= self.lexer.letters or "PATH" not in row:
            return None
        if not {*row} & self.lexer.places:
            return None
        return _coded(row)

    def words(self, line: Line, state: State) -> None:
        """Interpret a line that is no motion block."""
        name, value, text = line.words[0]
        if name == "block":
            self._block(text, line, state)
            return
        motion: dict[str, float] = {}
        for name, value, text in line.words:
            if name == "M":
                self._miscellaneous(value, text, line, state)
            elif name == "side":
                state.event(line, "G", value, text)
            elif name == "S":
                state.event(line, "S", value, text)
            elif name in self.lexer.letters or name in ("circle", "centre", "turn"):
                motion[name] = value
            elif name in "ABC":
                state.refuse(line, f"{text}: rotary words", "name the machine they are for, with --machine")
            else:
                state.refuse(line, f"{text} is not understood here", "see that the control is the one the text is for")
        if "centre" in motion:
            state.memory["centre"] = {axis: motion[axis] for axis in "XY" if axis in motion}
        elif "circle" in motion:
            state.move(line, self._circle(motion, line, state))
        else:
            if motion and "PATH" not in motion and motion.keys() - {"F"}:
                state.refuse(line, "words of a path without L, LN or SPL", "give the whole block")
            coded = _coded(motion)
            if coded is None:
                state.refuse(
                    line, "words that this kind of block does not take", "give L, LN or SPL what belongs to it"
                )
            state.move(line, coded or {})

    def _circle(self, motion: dict[str, float], line: Line, state: State) -> dict[str, float]:
        """C: about the centre that CC has said, in the plane XY."""
        centre = state.memory.get("centre", {})
        if "turn" not in motion or len(centre) != 2 or {*motion} & {"Z", *self.rotary}:
            state.refuse(line, "an arc that is not in the plane XY about a CC", "write it as lines")
        x, y, _ = state.modal.tip
        row: dict[str, float] = {name: motion[name] for name in ("X", "Y", "F") if name in motion}
        return {**row, "G": motion["turn"], "I": centre["X"] - x, "J": centre["Y"] - y}

    def _miscellaneous(self, value: float, text: str, line: Line, state: State) -> None:
        if value in (136.0, 137.0):
            state.change(line, per_revolution=value == 136.0)
        elif value in (128.0, 129.0):
            state.tip_control = "M128" if value == 128.0 else ""
        elif value in (91.0, 92.0):
            state.refuse(line, f"{text}: positions of the machine", "only positions of the part are read")
        else:
            state.event(line, "M", value, text, late=value in AFTER_MOTION)

    def _block(self, text: str, line: Line, state: State) -> None:
        """Blocks that are words: tools, cycles, functions."""
        if text.startswith(("BEGIN PGM", "END PGM")):
            unit = text.split()[-1]
            if unit not in ("MM", "INCH"):
                state.refuse(line, f"{text}: no units", "name MM or INCH at its end")
            if text.startswith("BEGIN"):
                state.change(line, inch=unit == "INCH")
        elif match := _TOOL_CALL.fullmatch(text):
            if match[1] is not None:
                state.event(line, "T", float(match[1]), text)
                state.event(line, "M", 6.0, text)
            if match[2] is not None:
                state.event(line, "S", float(match[2]), text)
        elif match := re.fullmatch(r"TOOL DEF (\d+)(?: .*)?", text):
            state.event(line, "T", float(match[1]), text)
        elif match := re.fullmatch(rf"CYCL DEF 9\.1 (?:DWELL|V\.ZEIT) ?({_NUMBER})", text):
            state.event(line, "G", 4.0, f"{1000.0 * float(match[1]):.10g}")
        elif text == "STOP":
            state.event(line, "M", 0.0, text, late=True)
        elif match := re.fullmatch(r"FUNCTION TCPM F (?:TCP|CONT) AXIS POS PATHCTRL (AXIS|VECTOR)(?: .*)?", text):
            state.tip_control = f"TCPM {match[1]}"
        elif text == "FUNCTION RESET TCPM":
            state.tip_control = ""
        elif not text.startswith(_SILENT):
            state.refuse(line, f"{text} is not understood", "see that the control is the one the text is for")


class _Lexer(Lexer):
    """Words of several letters as one byte each; blocks begin with their number."""

    numbered = True

    def __init__(self, rotary: str) -> None:
        known = {*"XYZF", *rotary, "PATH", "RAPID", *(() if rotary else _VECTOR.values())}
        known |= {name for name in _FACTORS if name[2] in "XYZ" + rotary}
        super().__init__("", {*"XYZ", *(rotary or "IJK")})
        self.letters = frozenset(known)

    def unfolded(self, chunk: bytes) -> bytes:
        """Return the text with every block on one line, and as many lines as before."""
        if b"~" not in chunk:
            return chunk

        def joined(match: re.Match[bytes]) -> bytes:
            parts = match[0].split(b"\n")
            if parts[0].lstrip(b" 0123456789")[:1] == b";":
                return match[0]
            whole = b" ".join(part.rstrip(b" \r").rstrip(b"~").strip() for part in parts)
            return whole + b"\n" * (len(parts) - 1)

        return _FOLDED.sub(joined, chunk)

    def respell(self, chunk: bytes) -> bytes:
        """Return the text as `block_tables` is to read it, with the same lines."""
        if b"++" in chunk or b"+-" in chunk or b"-+" in chunk:  # no numbers: read line by line, they are refused
            return respelt(chunk, ())
        return respelt(chunk, _SPELT)

    def cut(self, piece: bytes) -> int:
        """Where no block is cut in two."""
        place = piece.rfind(b"\n")
        while place > 0 and piece[:place].rstrip(b" \r").endswith(b"~"):
            place = piece.rfind(b"\n", 0, place)
        return place + 1

    def columns(self, signature: bytes) -> tuple[str, ...] | None:
        """Return a name for every letter of a line; None for a line that is read on its own."""
        names: list[str] = []
        for code in signature:
            exponent = code == ord("E") and bool(names)
            names.append(f"{names[-1]} E" if exponent else _COLUMNS.get(code, chr(code)))
        known = {name for name in names if not name.endswith(" E")}
        if any(name[:-2] not in _FACTORS for name in names if name.endswith(" E")):
            return None
        if len(set(names)) != len(names) or not known <= self.letters or not known & self.places:
            return None
        return tuple(names) if "PATH" in known else None

    def table(self, table: Table) -> Table | None:
        """Return a run with codes for what is said in words."""
        path, rapid = table.column("PATH"), table.column("RAPID")
        columns = {name: column for name, column in table.columns.items() if name not in ("PATH", "RAPID")}
        for name in [name for name in columns if name.endswith(" E")]:
            exponent = columns.pop(name)
            columns[name[:-2]] = columns[name[:-2]] * 10.0 ** np.nan_to_num(exponent)
        vectors = ~np.isnan(np.stack([table.column(name) for name in "IJK"])).all(axis=0)
        factors = np.zeros(len(table), np.bool_)
        for name in columns.keys() & set(_FACTORS):
            factors |= ~np.isnan(columns[name])
        if (vectors & (path != _LINES["LN"])).any() or (factors & (path != _LINES["SPL"])).any():
            return None
        code = np.where(np.isnan(rapid), 1.0, 0.0)
        if (~np.isnan(rapid) & (path == _LINES["SPL"])).any():
            return None
        columns["G"] = np.where(path == _LINES["SPL"], SPL, code)
        return Table(table.line, columns)

    def line(self, text: bytes, number: int, name: str | None) -> Line:
        """Take one line apart, as it was written."""
        line = text.decode("latin-1").strip()
        comments = tuple(comment.strip() for comment in _COMMENT.findall(line))
        rest = _COMMENT.sub("", line).strip().upper().lstrip("/").lstrip()
        match = _START.fullmatch(rest)
        rest = (match["rest"] if match and match["number"] else rest).strip()
        if not rest or rest == "%" or rest.isdigit():
            return Line(number, (), comments)
        head, _, tail = rest.partition(" ")
        known: dict[str, tuple[str, float]] = {"C": ("circle", 0.0), "CC": ("centre", 0.0)}
        known |= {word: ("PATH", value) for word, value in _LINES.items()}
        words: list[tuple[str, float, str]] = []
        if head in known:
            words.append((*known[head], head))
            rest = tail.strip()
        elif not re.match(rf"[A-Z]{_NUMBER}(?:\s|$)", rest):
            return Line(number, (("block", 0.0, " ".join(rest.split())),), comments)
        place = 0
        while place < len(rest):
            found = _WORD.match(rest, place)
            if found is None:
                what = f"{rest[place : place + 20]!r} is no word of Klartext"
                raise InputError("CS501", what, "give a file written for this control", file=name, line=number)
            words.append(_word_of(found))
            place = found.end()
            while place < len(rest) and rest[place] in " \t":
                place += 1
        return Line(number, tuple(words), comments)


def _word_of(found: re.Match[str]) -> tuple[str, float, str]:
    text = found[0].strip()
    if found["factor"]:
        return found["factor"], float(found["of"]), text
    if found["vector"]:
        return _VECTOR[found["vector"]], float(found["part"]), text
    if found["rapid"]:
        return "RAPID", 1.0, text
    if found["turn"]:
        return "turn", 3.0 if text.endswith("+") else 2.0, text
    if found["side"]:
        return "side", _SIDES[text], text
    return found["letter"], float(found["value"]), text


def _coded(row: Mapping[str, float]) -> dict[str, float] | None:
    """Words of a path with its code; None where they do not go together."""
    path = row.get("PATH", 0.0)
    if ({"I", "J", "K"} & row.keys() and path != _LINES["LN"]) or (
        row.keys() & set(_FACTORS) and (path != _LINES["SPL"] or "RAPID" in row)
    ):
        return None
    coded = {name: value for name, value in row.items() if name not in ("PATH", "RAPID")}
    if path:
        coded["G"] = SPL if path == _LINES["SPL"] else 0.0 if "RAPID" in row else 1.0
    return coded
