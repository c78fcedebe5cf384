"""How a program spells its blocks, and a form of the control that spells them alike."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from cornersmooth.nc.control import Digits, Mode
from cornersmooth.nc.form import Form

#: cuts that are looked at
SAMPLE: Final = 5000

_NUMBER: Final = rb"[-+]?(?:\d+\.?\d*|\.\d+)"
_WORD: Final = re.compile(rb"(T[XYZ]|[A-Z]+\d?[ \t]*=|[A-Z])[ \t]*(" + _NUMBER + rb")")
_LINE_NUMBER: Final = re.compile(rb"[ \t]*(N[ \t]*\d+|\d+(?=[ \t]))[ \t]*")
_AXES: Final = (b"X", b"Y", b"Z")


@dataclass(frozen=True)
class Spelling:
    """How plain cuts look; what is not explained is as in `cornersmooth.nc.control.Motion`."""

    tip: int  #: tip, other, feed: decimals at most of X Y Z, of the words of the tool axis, and of F
    other: int
    feed: int
    signs: bool
    spaces: bool
    leading_zeros: bool
    trailing_zeros: bool
    feed_point: bool
    modal: bool  #: whether words that repeat are left out
    line: str  #: the word of lines, such as ``G01``; empty where none is said
    numbered: bool  #: whether most blocks have numbers
    end: bytes  #: line end

    @classmethod
    def of(cls, cuts: Iterable[bytes], words: int) -> Spelling:
        """See how cuts are spelt; `words` is the number of words of the axes that a full block has."""
        decimals: dict[bool, list[int]] = {True: [], False: []}
        feeds: list[bytes] = []
        signs = spaced = short = zeros = numbered = count = missing = 0
        line, end = "", b"\n"
        for raw in cuts:
            text = raw.upper()
            end = b"\r\n" if raw.endswith(b"\r\n") else b"\n"
            match = _LINE_NUMBER.match(text)
            numbered += match is not None
            text = text[match.end() if match else 0 :]
            said = 0
            for word, number in _WORD.findall(text):
                if word == b"F":
                    feeds.append(number)
                elif word == b"G":
                    line = f"G{number.decode()}" if float(number) == 1.0 and not line else line
                else:
                    said += 1
                    decimals[word in _AXES].append(len(number.partition(b".")[2]))
                    signs += number.startswith(b"+")
                    digits = number.lstrip(b"+-")
                    short += digits.startswith(b".") and digits != b"."
                    zeros += digits.startswith(b"0.") and len(digits) > 2
            spaced += text.strip().count(b" ") + text.count(b"\t") > 0
            missing += said < words
            count += 1
        tip, other = (max(decimals[key], default=0) for key in (True, False))
        same = all(k == tip for k in decimals[True]) and all(k == other for k in decimals[False])
        return cls(
            tip=tip,
            other=other,
            feed=max((len(number.partition(b".")[2]) for number in feeds), default=0),
            signs=2 * signs > len(decimals[True]),
            spaces=2 * spaced > count,
            leading_zeros=zeros >= short,
            trailing_zeros=same,
            feed_point=not feeds or any(b"." in number for number in feeds),
            modal=2 * missing > count,
            line=line,
            numbered=2 * numbered > count,
            end=end,
        )

    def form(self, form: Form, *, rounding: bool) -> Form:
        """Give a form of the control without head and tail whose blocks look like these.

        With `rounding`, words may say how far the control rounds corners: what holds after them is put back.
        """
        table = form.table
        program = replace(
            table.program, retract=(), position="", start=(), begin=(), tool_end=(), between_tools=(), end=()
        )
        tip, other = self.tip or table.digits.mm, self.other or table.digits.angle
        inch, vector = self.tip or table.digits.inch, max(other, table.digits.vector)
        digits = replace(table.digits, mm=tip, inch=inch, angle=other, vector=vector, vector_length=1)
        layout = replace(table.layout, block_number="", longest_block=0)
        lines = table.lines if rounding else replace(table.lines, rounding="")
        bare = replace(table, program=program, digits=digits, layout=layout, lines=lines)
        return replace(form, table=bare, mode=self._mode(form.mode), upright=None, plane=None, extras=())

    def with_digits(self, digits: Digits, *, inch: bool) -> Spelling:
        """Return the same with no fewer digits than a control has."""
        tip = max(self.tip, digits.inch if inch else digits.mm)
        return replace(self, tip=tip, other=max(self.other, digits.angle))

    def _mode(self, mode: Mode) -> Mode:
        motion = replace(
            mode.motion,
            signs=self.signs,
            spaces=self.spaces,
            leading_zeros=self.leading_zeros,
            trailing_zeros=self.trailing_zeros,
            feed_point=self.feed_point,
            with_z="",
            modal=mode.motion.modal or (),
        )
        if mode.motion.line == "G1" and self.line:
            motion = replace(motion, line=self.line)
        return replace(mode, on=(), off=(), within_on=(), within_off=(), begin=None, tool_end=None, motion=motion)


def numbers_of(lines: Iterable[bytes]) -> list[bytes]:
    """Block numbers of lines that have one, as they are written, with what stands behind them."""
    return [match[0] for match in map(_LINE_NUMBER.match, lines) if match]


def numbered(lines: list[bytes], numbers: list[bytes]) -> list[bytes]:
    """Give lines the numbers that others had, in order and evenly; lines between have none.

    No number occurs twice, and the first line has the first: who starts in the middle of the program finds it.
    """
    count, have = len(lines), len(numbers)
    places = [k * have // count for k in range(count)]
    new = [k == 0 or places[k] != places[k - 1] for k in range(count)]
    return [numbers[p] + line if fresh and have else line for p, fresh, line in zip(places, new, lines, strict=True)]
