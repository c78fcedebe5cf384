"""HEIDENHAIN Klartext: LN with TX TY TZ, L with rotary words, SPL of the iTNC 530, under FUNCTION TCPM."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Final

from cornersmooth.control.state import VECTOR
from cornersmooth.control.words import (
    NOT_NEGATIVE,
    NUMBER,
    POSITIVE,
    SPL,
    ZERO,
    Columns,
    Lexer,
    Line,
    Word,
    fixed,
    number_of,
    numbers,
    refused,
)
from cornersmooth.nc_reader.acts import (
    Acts,
    Beside,
    HoleCycle,
    Move,
    Running,
    Tilt,
    TiltedPlane,
    ToMachine,
    drill,
    wrong,
)
from cornersmooth.nc_reader.dialects import Dialect

_VECTOR: Final = {"TX": "I", "TY": "J", "TZ": "K"}
_PATHS: Final = ("L", "LN", "SPL")

_TOOL_CALL: Final = re.compile(rf"TOOL CALL(?: (\d+))?(?: [XYZ])?(?: S({NUMBER}))?(?: F{NUMBER})?(?: D.*)?")
#: turns about the fixed axes X, Y and Z in this order, which are turns about its own Z, Y and X
_SPATIAL: Final = re.compile(rf"PLANE SPATIAL SPA({NUMBER}) SPB({NUMBER}) SPC({NUMBER}) TURN FMAX")
_FOLDED: Final = re.compile(rb"[^\n]*~[ \r]*\n(?:[^\n]*~[ \r]*\n)*[^\n]*\n?")

#: blocks that change nothing measured here
_SILENT = (
    "BEGIN PGM",
    "END PGM",
    "BLK FORM",
    "CYCL DEF 32",
    "CYCL DEF 9.0",
    "CYCL DEF 247",
    "LBL",
)
#: hole cycles with their parameters, in the order of the control
_TOP: Final = rf"Q203=(?P<top>{NUMBER}) Q204=(?P<above>{NUMBER})"
_HOLE: Final = rf"Q200=(?P<setup>{NUMBER}) Q201=(?P<depth>-{NOT_NEGATIVE}|{ZERO})"
_FEED, _DWELL = rf"Q206=(?P<feed>{NUMBER})", rf"Q211=(?P<dwell>{NOT_NEGATIVE})"
_CYCLES: Final = {
    "200": rf"DRILLING {_HOLE} {_FEED} Q202=(?P<step>{POSITIVE}) Q210={ZERO} {_TOP} {_DWELL}",
    "201": rf"REAMING {_HOLE} {_FEED} {_DWELL} Q208=(?P<back>(?P=feed)) {_TOP}",
    "207": rf"RIGID TAPPING NEW {_HOLE} Q239=(?P<pitch>{POSITIVE}) {_TOP}",
}

_SIDES = {"R0": 40.0, "RL": 41.0, "RR": 42.0}


class Heidenhain(Dialect):
    """Blocks that say in words what they are."""

    lexer: _KlartextLexer
    beside = frozenset(("M", "S", "side"))
    others = ()
    quiet = frozenset(("M99",))

    def __init__(self, control: str, rotary: str = "") -> None:
        super().__init__(control, rotary)
        self.lexer = _KlartextLexer(rotary)

    def alone(self, line: Line, state: Running) -> Acts | None:
        """As `Dialect.alone`: blocks that are words, and positions of the machine."""
        if line.words[0].name == "block":
            return self._block(line.words[0].text, line, state)
        return self._to_machine(line) if any(word[:2] == ("M", 91.0) for word in line.words) else None

    def moves(self, word: Word) -> bool:
        """As `Dialect.moves`."""
        return word.name in self.lexer.names or word.name in ("circle", "centre", "turn", "R")

    @staticmethod
    def event(word: Word) -> Beside:
        """As `Dialect.event`."""
        return Beside("G" if word.name == "side" else word.name, word.value, word.text)

    def motion(self, given: dict[str, float], line: Line, state: Running) -> Acts:
        """As `Dialect.motion`."""
        if "centre" in given:
            state.centre = {axis: given[axis] for axis in "XY" if axis in given}
        elif "circle" in given:
            yield Move(self._circle(given, line, state))
        else:
            if given.keys() - {"F"} and not given.keys() & set(_PATHS):
                raise refused(line, "words of a path without L, LN or SPL", "give the whole block")
            columns = self.lexer.coded({word.name: word for word in line.words if word.name in given})
            if columns is None:
                hint = "give L, LN or SPL what belongs to it"
                raise refused(line, "words that this kind of block does not take", hint)
            yield Move(numbers(columns))
        if any(word[:2] == ("M", 99.0) for word in line.words):  # calls the cycle that was defined last, at the end
            if state.cycle is None:
                raise refused(line, "M99 without a cycle before it", "define the cycle that it calls")
            if state.tip_control:
                yield wrong("CS506", line, f"a hole cycle under {state.tip_control}")
            yield from drill(state.cycle, state.modal.tip[0], state.modal.tip[1], line, state)

    def _to_machine(self, line: Line) -> Acts:
        """M91: a rapid in machine coordinates."""
        sides = {word for word in line.words if word.name == "side"}
        for word in sides:
            yield Beside("G", word.value, word.text)
        beside = {("L", 0.0), ("RAPID", 1.0), ("M", 91.0), *(word[:2] for word in sides)}
        axes = self.machine_axes(line, beside)
        if all(word.name != "RAPID" for word in line.words):
            raise refused(line, "M91 without FMAX", "positions of the machine are read in rapids only")
        yield ToMachine(axes)

    def _circle(self, motion: dict[str, float], line: Line, state: Running) -> dict[str, float]:
        """C: about the centre that CC has written, in the plane XY; CR: with a radius."""
        centre = state.centre
        by_radius = line.words[0].text == "CR"
        known = "R" in motion if by_radius else "R" not in motion and len(centre) == 2
        if "turn" not in motion or not known or {*motion} & {"Z", *self.rotary}:
            raise refused(line, "an arc that is not in the plane XY about a CC or with a radius", "write it as lines")
        x, y, _ = state.modal.tip
        row: dict[str, float] = {name: motion[name] for name in ("X", "Y", "F", "R") if name in motion}
        if by_radius:
            return {**row, "G": motion["turn"]}
        return {**row, "G": motion["turn"], "I": centre["X"] - x, "J": centre["Y"] - y}

    def _block(self, text: str, line: Line, state: Running) -> Acts:
        """Blocks that are words: tools, cycles, functions."""
        if text.startswith(("BEGIN PGM", "END PGM")):
            if text.split()[-1] not in ("MM", "INCH"):
                raise refused(line, f"{text}: no units", "name MM or INCH at its end")
        elif match := _TOOL_CALL.fullmatch(text):
            if match[1] is not None:
                yield Beside("T", float(match[1]), text)
                yield Beside("M", 6.0, text)
            if match[2] is not None:
                yield Beside("S", float(match[2]), text)
        elif match := re.fullmatch(r"TOOL DEF (\d+)(?: .*)?", text):
            yield Beside("T", float(match[1]), text)
        elif match := re.fullmatch(rf"CYCL DEF 9\.1 (?:DWELL|V\.ZEIT) ?({NUMBER})", text):
            yield Beside("G", 4.0, f"{1000.0 * float(match[1]):.10g}")
        elif match := re.match(r"CYCL DEF (200|201|207) ", text):
            pattern = _CYCLES[match[1]]
            cycle = re.fullmatch(rf"CYCL DEF {match[1]} {pattern}", text)
            if cycle is None:
                names = ", ".join(re.findall(r"Q\d+", pattern))
                hint = f"give {names}, in this order, and no others; Q210 is 0"
                raise refused(line, f"CYCL DEF {match[1]} with parameters that are not understood", hint)
            state.cycle = HoleCycle.written(cycle)
        elif match := _SPATIAL.fullmatch(text):
            angles = match.groups()
            turns = [(axis, float(angle)) for axis, angle in zip("ZYX", angles[::-1], strict=True)]
            yield Tilt(TiltedPlane.by(turns, angles))
        elif text == "PLANE RESET STAY":
            yield Tilt(None)
        elif text == "STOP":
            yield Beside("M", 0.0, text)
        elif not text.startswith(_SILENT) and "tip" not in dict(state.machine.table.row(text).sets):
            raise refused(line, f"{text} is not understood", "see that the control is the one the text is for")


class _KlartextLexer(Lexer):
    """Blocks that begin with their number and with what they are."""

    word = re.compile(
        rf"(?P<factor>K[123][XYZABC])(?P<of>{NUMBER}(?:E[-+]?\d+)?)|(?P<vector>T[XYZ])(?P<part>{NUMBER})"
        rf"|(?P<rapid>F ?MAX\b)|(?P<turn>DR[-+])|(?P<side>R[0LR])(?!\w)|(?P<letter>[A-Z])(?P<value>{NUMBER})"
    )
    #: headings are no blocks either
    comment = re.compile(r";(.*)$|(?<!\S)\* ?-(.*)$")
    block_number = re.compile(r"(\d+)(?:[ \t]+|$)")

    def __init__(self, rotary: str) -> None:
        axes = "XYZ" + rotary
        self.factors = frozenset(f"K{power}{axis}" for axis in axes for power in "321")
        self.names = frozenset((*axes, "F", "RAPID", *_PATHS, *self.factors, *(() if rotary else "IJK")))
        self.places = frozenset("XYZ" + (rotary or "IJK"))

    def words(self, rest: str, place: int) -> list[Word]:
        """Words of a line from a place on, or the whole block as one; raises CS501."""
        head = next(iter(rest[place:].split()), "")
        if not head:
            return []
        heads = {"C": "circle", "CR": "circle", "CC": "centre"} | dict(zip(_PATHS, _PATHS, strict=True))
        if head in heads:
            tail = place + len(head)
            tail += len(rest[tail:]) - len(rest[tail:].lstrip())
            return [Word(heads[head], 0.0, head), *super().words(rest, tail)]
        if not re.match(rf"[A-Z]{NUMBER}(?:[ \t]|$)", rest[place:]):
            return [Word("block", 0.0, " ".join(rest[place:].split()))]
        return super().words(rest, place)

    def named(self, match: re.Match[str]) -> list[Word]:
        """Word of one match."""
        if match["factor"]:
            return [number_of(match, "of", match["factor"])]
        if match["vector"]:
            return [number_of(match, "part", _VECTOR[match["vector"]])]
        if match["rapid"]:
            return [fixed(match, "RAPID", 1.0)]
        if match["turn"]:
            return [fixed(match, "turn", 3.0 if match[0].endswith("+") else 2.0)]
        if match["side"]:
            return [fixed(match, "side", _SIDES[match["side"]])]
        return [number_of(match, "value", match["letter"])]

    def block(self, given: Mapping[str, Word]) -> Columns | None:
        """Columns of a block with such words; None where they are no motion block."""
        if not given.keys() <= self.names or not given.keys() & self.places or not given.keys() & set(_PATHS):
            return None
        return self.coded(given)

    def coded(self, given: Mapping[str, Word]) -> Columns | None:
        """Words of a path with its code; None where they do not go together."""
        spline, vector = "SPL" in given, len(given.keys() & VECTOR)
        # all of it stands in each LN block ("Definition of a normalized vector"): what a part is worth nobody says
        if (vector and ("LN" not in given or vector < len(VECTOR))) or (
            given.keys() & self.factors and (not spline or "RAPID" in given)
        ):
            return None
        columns: Columns = {name: word for name, word in given.items() if name not in (*_PATHS, "RAPID")}
        if given.keys() & set(_PATHS):
            columns["G"] = SPL if spline else 0.0 if "RAPID" in given else 1.0
        return columns

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

    def cut(self, piece: bytes) -> int:
        """Where no block is cut in two."""
        place = piece.rfind(b"\n")
        while place > 0 and piece[:place].rstrip(b" \r").endswith(b"~"):
            place = piece.rfind(b"\n", 0, place)
        return place + 1
