"""CL statements as NC words: what the program says between its moves."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from cornersmooth.errors import Finding
from cornersmooth.model import Statement
from cornersmooth.nc.comments import comment_lines
from cornersmooth.text import format_number

#: words that describe the file, the tool or the display: comments, nothing to warn of
_DESCRIBING = frozenset(
    "$$ PARTNO PPRINT REMARK TPRINT LETTER DISPLY PAINT TLDATA MSYS CSYS CUTTER INTOL OUTTOL MULTAX UNITS UNIT MACHIN "
    "END-OF-PATH FINI END REWIND SELECT TLAXIS TRNTYP MODE SYN PPFUN ISN TOOLNO".split()
) | {"TOOL PATH"}

_COOLANT = {"ON": "M8", "FLOOD": "M8", "MIST": "M7", "OFF": "M9"}
_COMPENSATION = {"LEFT": "G41", "RIGHT": "G42", "OFF": "G40"}


@dataclass
class StatementWriter:
    """Turns statements into NC blocks, remembering tool and spindle.

    Parameters
    ----------
    tool_words : tuple of (str, str)
        Blocks that end and start tool tip control around a tool change; ``{tool}`` is the tool number.
    """

    tool_words: tuple[str, str]
    tool: int | None = None
    tip_control: bool = False
    spindle: str = "M3"
    not_understood: Counter[str] = field(default_factory=Counter)
    first_line: dict[str, int] = field(default_factory=dict)

    def blocks(self, statement: Statement) -> list[str]:
        """NC blocks of one statement, without line ends."""
        handler = _HANDLERS.get(statement.word)
        written = handler(self, statement) if handler else None
        if written is None:
            if handler or statement.word not in _DESCRIBING:
                self.not_understood[statement.word] += 1
                self.first_line.setdefault(statement.word, statement.line)
            text = statement.text.removeprefix("$$").strip() if statement.word == "$$" else statement.text
            return comment_lines(text or statement.word)
        return written

    def begin_motion(self) -> list[str]:
        """Blocks needed before the next motion: tool tip control, where it is off."""
        if self.tip_control:
            return []
        self.tip_control = True
        return [self.tool_words[1].format(tool=self.tool or 1)]

    def end_motion(self) -> list[str]:
        """Blocks that switch tool tip control off, where it is on."""
        if not self.tip_control:
            return []
        self.tip_control = False
        return [self.tool_words[0]]

    def findings(self) -> list[Finding]:
        """One counted warning for every word that only became a comment."""
        return [
            Finding(
                "CS310",
                "warning",
                self.first_line[word],
                f"{word} is not translated; written as a comment",
                count,
            )
            for word, count in self.not_understood.items()
        ]


def _numbers(statement: Statement) -> list[float]:
    return [value for value in statement.args if isinstance(value, float)]


def _words(statement: Statement) -> list[str]:
    return [value for value in statement.args if isinstance(value, str) and value]


def _tool(writer: StatementWriter, statement: Statement) -> list[str] | None:
    words = _words(statement)
    if statement.word == "LOAD" and words[:1] != ["TOOL"]:
        return None
    numbers = _numbers(statement)
    if not numbers or numbers[0] != int(numbers[0]) or numbers[0] < 0:
        return None
    number = int(numbers[0])
    if number == writer.tool:  # CATIA loads a tool twice: at the change and in the operation
        return comment_lines(statement.text)
    blocks = [*writer.end_motion(), f"T{number} M6"]
    writer.tool = number
    return blocks


def _spindle(writer: StatementWriter, statement: Statement) -> list[str] | None:
    words, numbers = _words(statement), _numbers(statement)
    if "OFF" in words:
        return ["M5"]
    if any(word not in ("RPM", "CLW", "CCLW", "ON", "SFM", "SMM") for word in words) or len(numbers) > 1:
        return None
    if "SFM" in words or "SMM" in words:
        return None
    if "CLW" in words or "CCLW" in words:
        writer.spindle = "M4" if "CCLW" in words else "M3"
    speed = f"S{format_number(numbers[0], 3, trim=True).rstrip('.')} " if numbers else ""
    return [speed + writer.spindle]


def _coolant(writer: StatementWriter, statement: Statement) -> list[str] | None:
    words = _words(statement) or ["ON"]
    code = _COOLANT.get(words[0])
    return [code] if code else None


def _delay(writer: StatementWriter, statement: Statement) -> list[str] | None:
    numbers = _numbers(statement)
    if len(numbers) != 1 or numbers[0] < 0 or _words(statement):
        return None
    return [f"G4 P{format_number(1000.0 * numbers[0], 0).rstrip('.')}"]


def _compensation(writer: StatementWriter, statement: Statement) -> list[str] | None:
    code = _COMPENSATION.get((_words(statement) or [""])[0])
    if code is None:
        return None
    return [code if code == "G40" else f"{code} D{writer.tool or 1}"]


_HANDLERS: dict[str, Callable[[StatementWriter, Statement], list[str] | None]] = {
    "LOADTL": _tool,
    "LOAD": _tool,
    "TURRET": _tool,
    "SPINDL": _spindle,
    "COOLNT": _coolant,
    "DELAY": _delay,
    "CUTCOM": _compensation,
    "STOP": lambda writer, statement: ["M0"],
    "OPSTOP": lambda writer, statement: ["M1"],
}
