"""How a program spells its blocks, and a form of the control that spells them alike."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Final

from cornersmooth.nc.control import Digits, Mode
from cornersmooth.nc.form import Form
from cornersmooth.text import format_number

#: cuts that are looked at
SAMPLE: Final = 5000

#: digits of a feed, at most
_FEED_DIGITS: Final = 9

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
    codes: bool  #: whether most blocks say that they are lines
    line: str  #: the word of lines, such as ``G01``; empty where none is written
    numbered: bool  #: whether most blocks have numbers
    end: bytes  #: line end

    @classmethod
    def of(cls, cuts: Iterable[bytes], words: int) -> Spelling:
        """See how cuts are spelt; `words` is the number of words of the axes that a full block has."""
        raw = list(cuts)
        heads = [_LINE_NUMBER.match(line) for line in map(bytes.upper, raw)]
        texts = [line.upper()[head.end() if head else 0 :] for line, head in zip(raw, heads, strict=True)]
        blocks = [_WORD.findall(text) for text in texts]
        every = [pair for block in blocks for pair in block]
        feeds = [number for word, number in every if word == b"F"]
        line = next((f"G{number.decode()}" for word, number in every if word == b"G" and float(number) == 1.0), "")
        places = [(word, number.lstrip(b"+-")) for word, number in every if word not in (b"F", b"G")]
        tips = [_decimals(number) for word, number in places if word in _AXES]
        others = [_decimals(number) for word, number in places if word not in _AXES]
        # a control may count numbers without a point in increments: one digit behind it keeps it
        pointed = int(any(b"." in number for _, number in places))
        signs = sum(number.startswith(b"+") for word, number in every if word not in (b"F", b"G"))
        short = sum(number.startswith(b".") and number != b"." for _, number in places)
        zeros = sum(number.startswith(b"0.") and len(number) > 2 for _, number in places)
        spaced = sum(text.strip().count(b" ") + text.count(b"\t") > 0 for text in texts)
        missing = sum(sum(word not in (b"F", b"G") for word, _ in block) < words for block in blocks)
        return cls(
            tip=max(*tips, pointed) if tips else 0,
            other=max(*others, pointed) if others else 0,
            feed=max(map(_decimals, feeds), default=0),
            signs=2 * signs > len(tips),
            spaces=2 * spaced > len(raw),
            leading_zeros=zeros >= short,
            trailing_zeros=any(tips + others) and len(set(tips)) < 2 and len(set(others)) < 2,
            feed_point=not feeds or any(b"." in number for number in feeds),
            modal=2 * missing > len(raw),
            codes=2 * sum(any(word == b"G" for word, _ in block) for block in blocks) > len(raw),
            line=line,
            numbered=2 * sum(head is not None for head in heads) > len(raw),
            end=b"\r\n" if raw and raw[-1].endswith(b"\r\n") else b"\n",
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
        digits = replace(digits, feed=max(digits.feed, self.feed))
        layout = replace(table.layout, block_number="", longest_block=0)
        lines = table.lines if rounding else replace(table.lines, rounding="")
        bare = replace(table, program=program, digits=digits, layout=layout, lines=lines)
        mode = replace(form.mode, on=(), off=(), within_on=(), within_off=(), begin=None, tool_end=None)
        return replace(form, table=bare, mode=self.motion(mode), upright=None, plane=None, extras=())

    def with_digits(self, digits: Digits, *, inch: bool) -> Spelling:
        """Return the same with no fewer digits than a control has."""
        tip = max(self.tip, digits.inch if inch else digits.mm)
        return replace(self, tip=tip, other=max(self.other, digits.angle))

    def motion(self, mode: Mode) -> Mode:
        """Give the words of a control as these blocks have them."""
        own = replace(
            mode,
            signs=self.signs,
            spaces=self.spaces,
            leading_zeros=self.leading_zeros,
            trailing_zeros=self.trailing_zeros,
            feed_point=self.feed_point,
            with_z="",
        )
        if mode.line != "G1" or not self.line:
            return own
        zero = self.line[1:-1]
        return replace(own, line=self.line, clockwise=f"G{zero}2", counterclockwise=f"G{zero}3")

    def text(self, old: bytes, blocks: list[bytes]) -> bytes:
        """Text that takes the place of an old one, with its numbers and line ends."""
        text = b"".join(line + self.end for line in (_numbered(blocks, old) if self.numbered else blocks))
        return text if old.endswith(b"\n") else text.removesuffix(self.end)

    def feed_text(self, feed: float) -> str:
        """Number of a feed in the digits of the program, or in as many as it has."""
        digits = next((k for k in range(self.feed, _FEED_DIGITS) if float(f"{feed:.{k}f}") == feed), _FEED_DIGITS)
        text = format_number(feed, digits, trim=True)
        return text if self.feed_point else text.rstrip(".")


def _decimals(number: bytes) -> int:
    return len(number.partition(b".")[2])


def _numbered(lines: list[bytes], old: bytes) -> list[bytes]:
    """Give lines the block numbers that old lines have, in order and evenly; lines between have none.

    No number occurs twice, and the first line has the first: who starts in the middle of the program finds it.
    """
    numbers = [match[0] for match in map(_LINE_NUMBER.match, old.splitlines()) if match]
    count, have = len(lines), len(numbers)
    places = [k * have // count for k in range(count)]
    new = [k == 0 or places[k] != places[k - 1] for k in range(count)]
    return [numbers[p] + line if fresh and have else line for p, fresh, line in zip(places, new, lines, strict=True)]
