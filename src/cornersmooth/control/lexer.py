"""Lines to words, and which words make a motion block: each control's grammar, written once.

A grammar reads one line. For texts of millions of lines it reads once for every kind of line (`line_patterns`):
it says where in such a line the numbers stand and what their columns are called.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Final

from cornersmooth.control.words import Columns, Line, Word
from cornersmooth.errors import InputError

#: a number as controls write it
NUMBER: Final = r"[-+]?(?:\d+\.?\d*|\.\d+)"

#: such that are zero, not below zero, above zero
ZERO: Final = r"\+?(?:0+\.?0*|\.0+)"
NOT_NEGATIVE: Final = r"\+?(?:\d+\.?\d*|\.\d+)"
POSITIVE: Final = rf"(?=[+\d.]*[1-9]){NOT_NEGATIVE}"

#: no control reads so many digits before the point
_LARGEST: Final = 1e12

#: bytes at the end of a chunk in which the begin of a block is looked for first, and next
_TAILS: Final = 1 << 11, 1 << 16

_HEAD: Final = re.compile(r"[ \t]*(/\d?)?[ \t]*")


class Lexer:
    """How a control spells its words."""

    #: one word at a time, in upper case
    word: re.Pattern[str]
    #: what the machine does not read
    comment: re.Pattern[str]
    #: the number of a block, before its words
    block_number = re.compile(r"N[ \t]*(\d+)[ \t]*")
    #: what a line begins with that can begin a curve, behind a line end
    begins: re.Pattern[bytes]
    #: lines between motion blocks that say nothing of the motion
    aside = re.compile(rb"[ \t\r]*")
    #: names of words that make a block move the tool or belong to a curve
    places: frozenset[str] = frozenset()
    #: names of words that are worth something else without a decimal point: read on their own, to be complained of
    points: frozenset[str] = frozenset()

    def line(self, text: bytes, number: int, name: str | None) -> Line:
        """Take one line apart.

        Raises
        ------
        InputError
            CS501 where it is not made of words.
        """
        text = text.removesuffix(b"\n").removesuffix(b"\r")
        line = text.decode("latin-1")
        comments = tuple(next(filter(None, match.groups()), "").strip(" \t") for match in self.comment.finditer(line))
        rest = self.comment.sub(lambda match: " " * len(match[0]), text.upper().decode("latin-1")).rstrip(" \t")
        head = _HEAD.match(rest)
        place = head.end() if head else 0
        block_number = None
        if found := self.block_number.match(rest, place):
            block_number = Word("N", float(found[1]), found[0].strip(), *found.span(1))
            place = found.end()
        tape = rest[place:] == "%"
        words = [] if tape else self.words(rest, place, number, name)
        return Line(number, tuple(words), comments, block_number, bool(head and head[1]), tape)

    def words(self, rest: str, place: int, number: int, name: str | None) -> list[Word]:
        """Words of a line from a place on; raises CS501."""
        words: list[Word] = []
        while place < len(rest):
            match = self.word.match(rest, place)
            found = self.named(match) if match else None
            if match is None or found is None or any(abs(word.value) > _LARGEST for word in found):
                raise InputError(
                    "CS501",
                    f"{rest[place : place + 20]!r} is no NC word",
                    "give a file written for this control",
                    file=name,
                    line=number,
                )
            words += found
            place = match.end()
            while place < len(rest) and rest[place] in " \t":
                place += 1
        return words

    def named(self, match: re.Match[str]) -> Iterable[Word] | None:
        """Words of one match of `word`; None where it is none after all."""
        raise NotImplementedError

    def motion(self, line: Line) -> Columns | None:
        """Columns of a motion block; None where the line is something else."""
        given = {word.name: word for word in line.words}
        code = given["G"].text if "G" in given else ""
        # no control knows a code with a sign: such a line is read on its own, to be complained of
        signed = code[:1] == "G" and ("-" in code or "+" in code)
        alone = signed or len(given) < len(line.words) or any(map(self.without_point, line.words))
        return None if alone else self.block(given)

    def without_point(self, word: Word) -> bool:
        """Whether a number may be counted in the least increment of the control; zero is zero in any case."""
        return word.name in self.points and word.value != 0.0 and "." not in word.text

    def block(self, given: Mapping[str, Word]) -> Columns | None:
        """Columns of a block with such words; None where they are no motion block."""
        raise NotImplementedError

    def unfolded(self, chunk: bytes) -> bytes:
        """Return the text with every block on one line, and as many lines as before."""
        return chunk

    def cut(self, piece: bytes) -> int:
        """Where to cut a text so that no curve is cut in two: behind a line end; 0 where there is no such place."""
        for tail in (*_TAILS, len(piece)):
            found = [match.start() for match in self.begins.finditer(piece, max(len(piece) - tail, 0))]
            if found:
                return found[-1] + 1
        return 0


def number_of(match: re.Match[str], group: str | int, name: str) -> Word:
    """Word whose number is a group of a match."""
    start, stop = match.span(group)
    return Word(name, float(match[group]), match[0].strip(), start, stop)


def fixed(match: re.Match[str], name: str, value: float) -> Word:
    """Word that is always written alike."""
    return Word(name, value, match[0].strip())
