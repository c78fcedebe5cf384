"""The frame of a program: the options of what is around the motion, and comments that say how the text was made.

The comments are enough to verify it without options.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from cornersmooth.settings import OptionFields, option

#: how much of a text may hold its head
HEAD = 1 << 13

#: characters of a line that stays one comment
_LONGEST = 120

_WORDS = re.compile(r"CORNERSMOOTH (?P<version>\S+): (?P<words>[^\r\n)]*)", re.IGNORECASE)
#: parts of a text that have a digest each, and where these stand; zeros until the text is verified
PARTS: Final = 8
PARTS_WORD: Final = re.compile(r"\bPARTS=([0-9a-f.]+)", re.IGNORECASE)
NO_PARTS: Final = ".".join(("000000",) * PARTS)

#: what is no character of a word
_STRANGE: Final = re.compile(r"[^\w.+-]", re.ASCII)
_HASH = re.compile(r"\bSHA256=([0-9a-f]{64})\b", re.IGNORECASE)


@dataclass(frozen=True)
class Provenance:
    """How a text was made."""

    version: str  #: of the program
    #: mm: ε and H
    tolerance: float
    axis_length: float
    method: str
    control: str
    form: str
    machine: str = ""  #: empty for none
    tcp: bool = True  #: whether the control keeps the tool tip
    source: str = ""  #: name of the CL file, without its folder
    sha256: str = ""  #: of the CL file, in hexadecimal digits; empty where it is not known
    #: Those that control points of curves have; None where they may have any.
    weights: tuple[float, ...] | None = (1.0,)
    planned_feeds: bool = False  #: whether feeds are those of a plan, at most the programmed ones
    axis_tolerance: float | None = None  #: degrees: what the tool axis may be off, in place of ε at the axis point
    #: With ``_`` for blanks; ``"none"`` where the text says none, empty for that of the control's own table.
    work_offset: str = ""
    extras: str = ""  #: functions of the control that are on
    parts: bool = False  #: whether there is room for the digests of its parts (`nc_words.parts`)
    operation: int = 0  #: number of the operation of the CL file that it holds alone; 0 for all

    def lines(self) -> tuple[str, ...]:
        """Texts of the comments."""
        values = {word: write(getattr(self, name)) for word, name, write, _ in _FIELDS}
        words = (f"{word}={_STRANGE.sub('_', text)}" for word, text in values.items() if text)
        mark = f"CORNERSMOOTH {self.version}:"
        lines = [mark]
        for word in words:
            if len(f"{lines[-1]} {word}") > _LONGEST and lines[-1] != mark:
                lines.append(mark)
            lines[-1] += f" {word}"
        lines.append(" ".join(([f"SHA256={self.sha256}"] if self.sha256 else []) + [f"CL={self.source}"]))
        if self.parts:
            lines.append(f"PARTS={NO_PARTS}")
        return tuple(lines)


def read_provenance(text: bytes) -> Provenance | None:
    """How a text was made, as its beginning says; None where it says nothing that can be understood."""
    head = text[:HEAD].decode("latin-1")
    found = _WORDS.search(head)
    if found is None:
        return None
    words: dict[str, str] = {}
    for line in _WORDS.finditer(head):  # a long one is several comments
        if line["version"] == found["version"]:
            words = dict(word.partition("=")[::2] for word in line["words"].split()) | words
    digest = _HASH.search(head, found.end())
    known = {name: (words[word], read) for word, name, _, read in _FIELDS if word in words}
    try:
        own: dict[str, Any] = {name: read(text) for name, (text, read) in known.items()}
        return Provenance(version=found["version"], sha256=digest[1].lower() if digest else "", **own)
    except (TypeError, ValueError):
        return None


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.9g}"


def weights_word(weights: tuple[float, ...] | None) -> str:
    """Weights as they are written; nothing where all are 1."""
    if weights is None:
        return "any"
    others = sorted(set(weights) - {1.0})
    return ",".join(f"{weight:g}" for weight in (1.0, *others)) if others else ""


def _weights(word: str) -> tuple[float, ...] | None:
    return None if word == "any" else tuple(float(number) for number in word.split(","))


#: words of the head in their order: the field of each, how it is written (empty for not at all), and how it is read
_FIELDS: Final[tuple[tuple[str, str, Callable[[Any], str], Callable[[str], Any]], ...]] = (
    ("E", "tolerance", _number, float),
    ("H", "axis_length", _number, float),
    ("AXIS", "axis_tolerance", _number, float),
    ("METHOD", "method", str, str),
    ("CONTROL", "control", str, str),
    ("FORM", "form", str, str),
    ("MACHINE", "machine", str, str),
    ("TCP", "tcp", lambda on: "" if on else "no", lambda word: word != "no"),
    ("WEIGHTS", "weights", weights_word, _weights),
    ("FEEDS", "planned_feeds", lambda on: "plan" if on else "", lambda word: word == "plan"),
    ("OFFSET", "work_offset", str, str),
    ("WITH", "extras", str, str),
    ("OPERATION", "operation", lambda number: f"{number}" if number else "", int),
)


@dataclass(frozen=True)
class FrameSettings(OptionFields):
    """Name, work offset, texts, retracts and holes of a program. Lengths in mm."""

    #: None for that of the CL file, or of the control's table
    program: str | None = option(
        None, "Name or number of the NC program. [default: from the name of the CL file]", flags="--program-name"
    )
    block_numbers: bool = option(False, "Number the blocks.")
    #: may have ``{program}``, ``{units}`` and ``{blend}``
    header: tuple[str, ...] = option((), "Lines to write after the head; {program} and {units} are filled in.")
    footer: tuple[str, ...] = option((), "Lines to write before the tail.")
    comments: bool = option(True, "Leave out what the CL file says in words.", flags="--no-comments")
    #: None for that of the control's table, empty for none
    work_offset: str | None = option(
        None,
        "Work offset, such as G55, or the number of a preset; 'none' leaves it out. [default: G54, or preset 1]",
    )
    #: what the program is made of, for comments before the header
    provenance: tuple[str, ...] = ()
    #: name of the CL file without its ending, for `program`; empty for none
    stem: str = ""
    skip_cycles: bool = option(
        False, "Leave out holes whose cycle cannot be written; the program says NOT DRILLED there. [default: an error]"
    )
    #: taps are the control's own cycles anyway
    cycles: str = option(
        "moves",
        "Holes as plain moves, or as the control's own cycles where it has such and the tool stays along Z (or in a "
        "tilted plane).",
    )
    #: 0 for neither. A form with a point on the axis comes down by 20 mm at least.
    approach: float = option(
        0.0,
        "How far the tool comes down along its axis to the first position after a retract. [default: straight down]",
        unit="mm",
    )
    retract: float = option(
        0.0, "How far the tool goes back along its axis before it goes up. [default: straight up]", unit="mm"
    )
    modal: bool = option(False, "Leave out words that repeat from block to block, where the control keeps them.")
    line_ends: str | None = option(
        None, "What each line of the program ends with: lf or crlf. [default: that of the control's table, lf]"
    )
