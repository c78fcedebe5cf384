"""What stands around the motion: head and tail, program name, block numbers, the user's own texts; planned feeds.

Planned feeds are for controls that do not look ahead themselves.
"""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from cornersmooth.errors import OutputError, SettingsError
from cornersmooth.frame import FrameSettings
from cornersmooth.model import Floats, Ints, Move, Program
from cornersmooth.nc.control import (
    INVERSE_TIME,
    INVERSE_TIME_DECIMALS,
    LINE_ENDS,
    Blocks,
    Control,
    ProgramTable,
    TextStyle,
)
from cornersmooth.nc.control_tables import control_names, load_control
from cornersmooth.nc.form import Form
from cornersmooth.nc.statement_args import tool_loads
from cornersmooth.settings import Settings
from cornersmooth.statements import spellings, work_offset_of
from cornersmooth.tables import filled as filled_in
from cornersmooth.text import format_number

_BLEND_DECIMALS = 5  #: decimals of how far the control may round the corners of lines, and the step of the last
BLEND_STEP = 10.0**-_BLEND_DECIMALS
#: mm along the tool in forms with a point on the axis, which go to their first position on all axes at once
POINT_APPROACH = 20.0
_LONGEST_NAME = 24  #: characters of a name from that of a file: SINUMERIK takes 24
#: numbers of programs from names of files: FANUC's parameters NE8 and NE9 lock those from 8000 to 9999
_HIGHEST_NUMBER = 7999


#: a word that loads a tool, and what of a line is a comment
_TOOL_WORD = re.compile(r"(?<![A-Z])T[ ]?[\d#\[]", re.IGNORECASE)
_COMMENT = re.compile(r"\([^)]*\)|;.*")
_LONGEST = 120  #: characters of a comment's text in one block; controls truncate or refuse long ones
#: brackets end a comment, ``%`` a file, ``;`` a block on some controls; ``~`` lets a block go on in the next line
_REPLACED = str.maketrans("()%;~", "[]/,-")
_SPELLED = {"ß": "ss", "Ø": "O", "ø": "o", "Æ": "AE", "æ": "ae", "Œ": "OE", "œ": "oe", "đ": "d", "Đ": "D", "ł": "l"}


#: figures of a planned feed: the fifth changes the time of a block by less than 0.1 %
_PLANNED_FIGURES = 4
_ALL_BUT = 0.999  #: part of the programmed feed from which on it is that one: fewer words, 0.1 % of the time
_FEED = re.compile(rb" ?F(\d+\.?\d*|\.\d+)$")  #: feed word at the end of a line, with its number


class Stream(Protocol):
    """What a program is written to: any binary stream."""

    def write(self, data: bytes, /) -> object:
        """Write the bytes."""


@dataclass(frozen=True)
class Frame(FrameSettings):
    """What a user wants around the motion, as blocks."""

    def values(self, form: Form, program: Program, settings: Settings) -> dict[str, str]:
        """What stands for braces in blocks around the motion and in those of extras.

        CS216: the control takes no such program name.
        """
        table = form.table.program
        if self.program is not None and not re.fullmatch(table.name_pattern or ".*", self.program):
            raise SettingsError(
                "CS216", f"{form.control} takes no program name {self.program!r}", f"use one like {table.name}"
            )
        turn = math.degrees(settings.blend_share * settings.tolerance / settings.axis_scale)
        return {
            "program": self.program_of(form),
            "units": form.table.layout.units[program.units],
            "blend": blend_word(settings.blend_share * settings.tolerance / program.mm_per_unit),
            "turn": format_number(max(turn, 10.0**-_BLEND_DECIMALS), _BLEND_DECIMALS),
        }

    def program_of(self, form: Form) -> str:
        """Name or number of the program, given or from the name of the CL file."""
        table = form.table.program
        return self.program or name_of_file(self.stem, table) or table.name

    def kept_as(self, form: Form) -> str | None:
        """Name or number by which the control keeps the program; None where only a comment says it."""
        blocks = [block for block in form.table.program.start if "{program}" in block]
        comment = form.table.layout.comment[0].strip()
        return self.program_of(form) if any(not block.startswith(comment) for block in blocks) else None

    def texts(self, form: Form, values: dict[str, str]) -> dict[str, Blocks]:
        """Blocks of the steps that a user gives, by the name of the step: work offset, header and footer.

        CS216: the control has no such work offset, no retract to go to or come from along the tool, or no step for
        header or footer; or a line of these has unknown braces or characters that an NC program cannot hold.
        """
        table = form.table.program
        if (self.approach or self.retract) and not table.retract:
            what = f"{form.control} has no retract that the tool could come from or go to along its axis"
            raise SettingsError("CS216", what, "leave out --approach and --retract")
        offset = table.work_offset if self.work_offset is None else self.work_offset
        if self.work_offset and not (
            table.work_offset_block and re.fullmatch(table.work_offset_pattern, self.work_offset)
        ):
            hint = f"use one like {table.work_offset}" if table.work_offset_block else "leave it out"
            raise SettingsError("CS216", f"{form.control} takes no work offset {self.work_offset!r}", hint)
        blocks = table.work_offset_block if offset else ()
        switch = (form.machine.tip_control if form.machine is not None and form.rotary else None) or ()
        layout, texts = form.table.layout, self.provenance if self.comments else ()
        made_of = [line for text in texts for line in comment_lines(text, layout.comment, layout.comment_orders)]
        steps = (*table.start, *table.begin, *table.tool_end, *table.end)
        for name, lines in (("header", self.header), ("footer", self.footer)):
            if lines and f"{{{name}}}" not in steps:
                raise SettingsError("CS216", f"{form.control} has no step for a {name}", f'write "{{{name}}}" into it')
        return {
            "work_offset": tuple(block.format(work_offset=offset) for block in blocks),
            "kinematics_on": switch[:1],
            "kinematics_off": switch[1:],
            "plane_reset": () if form.plane is None else form.plane.reset,
            "header": (*made_of, *_filled(self.header, values)),
            "footer": tuple(_filled(self.footer, values)),
        }

    def refuse_tool(self, form: Form, program: Program) -> None:
        """Refuse a header that loads a tool where the program then takes the length of another (CS249)."""
        moving = program.kind != Move.FROM
        loaded = any(not moving[: load.pose].any() for load, _ in tool_loads(program))
        if loaded or not any("{offset}" in block for block in form.mode.on):
            return
        for line in self.header:
            if _TOOL_WORD.search(_COMMENT.sub("", line)):
                what = f"the header loads a tool, {line!r}, and the program takes the length of tool 1"
                raise SettingsError("CS249", what, "leave it out of the header, and give --tool-number")

    def with_offset_of(self, program: Program, form: Form) -> Frame:
        """Return the same with the work offset that a program asks for, if any.

        CS216: the control has no such work offset. CS248: another is given.
        """
        number = work_offset_of(program)
        if number is None or self.work_offset == "":
            return self
        if self.work_offset is not None:
            raise SettingsError("CS248", "the input names its work offset itself", "leave out --work-offset")
        pattern = form.table.program.work_offset_pattern
        name = next((name for name in spellings(number) if re.fullmatch(pattern, name)), None)
        if name is None:
            hint = "leave it out: --work-offset none"
            raise SettingsError("CS216", f"{form.control} takes no work offset number {number}", hint)
        return replace(self, work_offset=name)

    def named_offset(self, table: Control) -> str:
        """Work offset for the head of a text; empty for that of the table that the control's is like."""
        offset = table.program.work_offset if self.work_offset is None else self.work_offset
        usual = load_control(table.dialect).program.work_offset if table.dialect in control_names() else ""
        return "" if offset == usual else offset.replace(" ", "_") or "none"

    def start(self, stream: Stream, form: Form) -> FramedText:
        """One text, nothing written yet."""
        layout = form.table.layout
        number = layout.block_number or ("N{number} " if self.block_numbers else "")
        end = LINE_ENDS[self.line_ends or layout.line_ends]
        return FramedText(stream, number=number, layout=layout, end=end, next_number=layout.number_start)


def name_of_file(stem: str, table: ProgramTable) -> str:
    """Name or number of a program from the name of its CL file; empty where that gives none that the control takes."""
    words = re.sub(r"[^A-Z0-9]+", "_", stem.upper()).strip("_")[:_LONGEST_NAME].rstrip("_")
    digits = re.search(r"\d+$", stem)
    number = int(digits[0]) if digits else 0
    if not table.file_name or not words or ("{number}" in table.file_name and not 0 < number <= _HIGHEST_NUMBER):
        return ""
    name = table.file_name.format(stem=words, number=f"{number:04d}")
    return name if re.fullmatch(table.name_pattern or ".*", name) else ""


def blend_word(blend: float) -> str:
    """How far the control may round the corners of lines; never zero, which would lift all limits."""
    return format_number(max(blend, 10.0**-_BLEND_DECIMALS), _BLEND_DECIMALS)


@dataclass
class FramedText:
    """Writes one text; numbers its blocks where wanted."""

    stream: Stream
    number: str  #: with ``{number}``; empty for none
    layout: TextStyle
    end: bytes  #: what lines end with
    next_number: int

    def write(self, text: bytes) -> None:
        """Write whole lines."""
        if self.number:
            text = self._numbered(text)
        longest = self.layout.longest_block
        if longest and max(map(len, text.split(b"\n"))) > longest:
            text = b"".join(self._folded(line) for line in text.splitlines(keepends=True))
        self.stream.write(text if self.end == b"\n" else text.replace(b"\n", self.end))

    def _numbered(self, text: bytes) -> bytes:
        parts = []
        number, layout = self.next_number, self.layout
        for line in text.decode().splitlines(keepends=True):
            if line in ("%\n", "\n") or (layout.unnumbered and re.match(layout.unnumbered, line)):
                parts.append(line)
            else:
                parts.append(self.number.format(number=number) + line)
                number += layout.number_step
                if layout.number_last and number > layout.number_last:
                    number = layout.number_start
        self.next_number = number
        return "".join(parts).encode()

    def _folded(self, line: bytes) -> bytes:
        """Line in parts that are short enough, where the control knows such."""
        longest, end = self.layout.longest_block, self.layout.continuation.encode()
        parts = []
        rest = line[:-1]
        while len(rest) > longest:
            at = rest.rfind(b" ", 0, longest - len(end) + 1) if end else -1
            if at <= 0:
                raise OutputError(
                    "CS302",
                    f"a block of {len(rest)} characters is too long for the control, which takes {longest}",
                    "shorten it: " + rest[:40].decode("ascii") + " ...",
                )
            parts.append(rest[:at] + end)
            rest = rest[at + 1 :]
        return b"\n".join([*parts, rest]) + b"\n"


def _filled(lines: Sequence[str], values: dict[str, str]) -> list[str]:
    filled = []
    for line in lines:
        try:
            text = filled_in(line, values) if "{" in line or "}" in line else line
        except ValueError as error:
            known = ", ".join(f"{{{name}}}" for name in values)
            raise SettingsError("CS216", f"{line!r} has unknown braces", f"use {known}") from error
        if not (text.isascii() and text.isprintable()):
            raise SettingsError("CS216", f"{line!r} has characters that an NC program cannot hold", "use ASCII")
        filled.append(text)
    return filled


def plain_text(text: str) -> str:
    """Return the text in the characters that controls accept in a comment; what has no such form becomes ``?``."""
    text = "".join(_SPELLED.get(letter, letter) for letter in text)
    decomposed = unicodedata.normalize("NFKD", text)
    kept = "".join(letter for letter in decomposed if not unicodedata.combining(letter))
    ascii_text = kept.encode("ascii", "replace").decode("ascii")
    printable = "".join(letter if letter.isprintable() else " " for letter in ascii_text)
    return " ".join(printable.translate(_REPLACED).split())


def comment_lines(text: str, marks: tuple[str, str] = ("(", ")"), orders: tuple[str, ...] = ()) -> list[str]:
    """Text as one or more comments between marks; none for an empty text. `orders` are words that would be obeyed."""
    plain, at = plain_text(text), 0
    lines = []
    while at < len(plain):
        part = plain[at : at + _LONGEST]
        at += _LONGEST
        at += plain[at : at + 1] == " "  # there are no two blanks side by side
        if part.upper().startswith(orders):
            part = f"- {part}"
        lines.append(f"{marks[0]}{part}{marks[1]}".rstrip())
    return lines


def with_planned_feeds(
    text: bytes, form: Form, program: Program, line: Ints, feed: Floats, minutes: Floats, programmed: Floats
) -> bytes:
    """Return the text with a feed word wherever the feed changes, none above the programmed one.

    Of b blocks, by their NC lines, which ascend: the feed of the plan, mm/min, NaN where it says none, as where the tip
    stands still; what the block takes, more than nothing, over which those under inverse time (G93) get one; and the
    programmed feed, mm/min, which holds where the plan says none.
    """
    motion, digits = form.mode, form.table.digits
    scale = 10.0**digits.feed
    unit = (motion.inch_feed if program.units == "inch" else 1) / program.mm_per_unit
    given = np.rint(programmed * unit * scale)
    planned = np.fmin(feed, programmed) * unit * scale
    # not more figures than say anything, rounded down
    step = np.maximum(10.0 ** np.floor(np.log10(np.maximum(planned, 1.0)) - _PLANNED_FIGURES + 1), 1.0)
    planned = np.where(planned >= _ALL_BUT * given, given, np.maximum(np.floor(planned / step) * step, 1.0))
    ticks = np.where(np.isnan(feed), given, planned)
    rate = np.floor(10.0**INVERSE_TIME_DECIMALS / minutes)
    end = b"\r\n" if b"\r\n" in text else b"\n"
    lines = text.split(end)
    word = (" " if motion.spaces else "") + motion.feed

    def feed_word(value: float, decimals: int) -> bytes:
        number = format_number(value / 10.0**decimals, decimals, trim=True)
        return (word + (number if motion.feed_point else number.rstrip("."))).encode()

    modes = {block.encode(): key for key, block in form.table.words.feed_mode.items()}
    row, goes_on = {int(one) - 1: k for k, one in enumerate(line)}, form.table.layout.continuation.encode()
    timed, current = False, b""
    for place, block in enumerate(text.split(end)):
        if block in modes:
            timed, current = modes[block] == INVERSE_TIME, b""
        elif place in row:
            last, k = place, row[place]
            while goes_on and lines[last].endswith(goes_on):
                last += 1
            old = _FEED.search(lines[last])
            bare = lines[last][: old.start()] if old else lines[last]
            if timed:
                known = float(old[1]) * 10.0**INVERSE_TIME_DECIMALS if old else np.inf
                new = feed_word(max(min(float(rate[k]), known), 1.0), INVERSE_TIME_DECIMALS)
            else:
                new = feed_word(float(ticks[k]), digits.feed)
            lines[last] = bare if new == current else bare + new
            current = b"" if timed else new
        elif b"F" in block and _FEED.search(block):
            current = b""  # another feed since the last block
    return end.join(lines)
