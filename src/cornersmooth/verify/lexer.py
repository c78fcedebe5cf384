"""How the words of a control are spelt: what `block_tables` asks to read most of a text at once.

A lexer may write words of several characters as single bytes above 127 before a chunk is looked at, line for line.
Such bytes in the text itself are made question marks first, so that nothing can be mistaken for them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

import numpy as np

from cornersmooth.verify.words import MOTION_CODES, MOTION_LETTERS, PLACE_LETTERS, Line, Table, tokenise

#: bytes above 127 to question marks
_PLAIN: Final = bytes(code if code < 128 else ord("?") for code in range(256))

#: blocks with a number and a G word
_NUMBERED: Final = re.compile(rb"\n[ /]*N\d+ *G")

#: bytes at the end of a chunk in which a numbered block is looked for
_TAIL: Final = 1 << 16


class Lexer:
    """Words of one letter and a number: what FANUC and its like write.

    Parameters
    ----------
    letters : str
        Those of motion blocks.
    places : str
        Those of them that make a block move the tool or belong to a curve.
    codes : iterable of float
        G words that a run may contain.
    """

    #: whether a block begins with its bare number
    numbered = False

    def __init__(
        self,
        letters: str = MOTION_LETTERS,
        places: Iterable[str] = PLACE_LETTERS,
        codes: Iterable[float] = MOTION_CODES,
    ) -> None:
        self.letters, self.places, self.codes = frozenset(letters), frozenset(places), tuple(codes)

    def unfolded(self, chunk: bytes) -> bytes:
        """Return the text with every block on one line, and as many lines as before."""
        return chunk

    def respell(self, chunk: bytes) -> bytes:
        """Return the text as `block_tables` is to read it, with the same lines."""
        return chunk

    def cut(self, piece: bytes) -> int:
        """Where to cut a text so that no curve is cut in two: behind a line end; 0 where there is no such place."""
        place = piece.rfind(b"\nG") + 1
        if place:
            return place
        return last_match(_NUMBERED, piece)

    def columns(self, signature: bytes) -> tuple[str, ...] | None:
        """Return a name for every letter of a line; None for a line that is read on its own."""
        text = signature.decode("latin-1")
        if len(set(text)) != len(text) or not set(text) <= self.letters or not set(text) & self.places:
            return None
        return tuple(text)

    def table(self, table: Table) -> Table | None:
        """Return a run as the rest of the reader wants it; None where its lines must be read one by one."""
        code = table.columns.get("G")
        if code is not None and not (np.isnan(code) | np.isin(code, self.codes)).all():
            return None
        return table

    def line(self, text: bytes, number: int, name: str | None) -> Line:
        """Take one line apart, as it was written.

        Raises
        ------
        InputError
            CS501 where it is not made of words.
        """
        return tokenise(text, number, name)


def last_match(pattern: re.Pattern[bytes], piece: bytes) -> int:
    """Place behind the line end with which a pattern was found last; 0 where it is not found near the end."""
    begin = max(len(piece) - _TAIL, 0)
    found = [match.start() for match in pattern.finditer(piece, begin)]
    return found[-1] + 1 if found else 0


def respelt(chunk: bytes, words: Iterable[tuple[bytes, bytes]]) -> bytes:
    """Write words as others, after bytes above 127 have been made harmless."""
    if not chunk.isascii():
        chunk = chunk.translate(_PLAIN)
    for old, new in words:
        chunk = chunk.replace(old, new)
    return chunk
