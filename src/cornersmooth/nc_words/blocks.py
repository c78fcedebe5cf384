"""Which row of the control's table a word of a block falls under, and what may not be together in one block."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

from cornersmooth.control.table import UNLISTED, Row, Table, any_of, shown
from cornersmooth.control.words import Lexer, Line
from cornersmooth.nc_reader.elements import Problem

#: words of a block, or the block as a whole, with their rows
Ruled = list[tuple[str, Row]]

#: code of words that are not on the list or not in their place
NOT_LISTED: Final = "CS571"

#: blocks, and words, whose rows are remembered
_REMEMBERED: Final = 4096


@dataclass(frozen=True)
class Block:
    """A line that is no motion block."""

    line: int
    words: tuple[str, ...] = ()  #: as tables have them
    ruled: Ruled = field(default_factory=list)

    @property
    def text(self) -> str:
        """The whole block."""
        return " ".join(self.words)


@lru_cache(_REMEMBERED)
def ruled_words(table: Table, words: tuple[str, ...]) -> Ruled:
    """Rows of the words of a block, or of the whole block where that is on the list.

    Most blocks beside the motion are alike; those of cycles are not, but most of their words are.
    """
    text, ruled = " ".join(words), Ruled()
    for row in table.blocks:
        if row.pattern.fullmatch(text):
            return [(text, row)]
    for k, word in enumerate(words):
        others = words[:k] + words[k + 1 :]
        fitting = [row for row in table.accepting(word) if row.needs is None or any_of(row.needs, others)]
        # what belongs beside another word comes first
        ruled.append((word, min(fitting, key=lambda row: row.needs is None, default=UNLISTED)))
    return ruled


class WordRules:
    """Looks at blocks one by one, whatever is before them.

    Parameters
    ----------
    tolerance : float
        ε in units of the text.
    axis_tolerance : float
        That of the tool axis, degrees.
    m_words : int
        How many M words of spindle and coolant a block may have.
    whole : str
        Addresses whose numbers need no point in a program in millimetres per minute.
    """

    def __init__(
        self,
        table: Table,
        lexer: Lexer,
        tolerance: float,
        axis_tolerance: float = 0.0,
        m_words: int = 1,
        whole: str = "",
    ) -> None:
        self._table, self._lexer, self._m_words, self._whole = table, lexer, m_words, whole
        self._rooms = {"length": tolerance, "angle": axis_tolerance}

    def problems(self, line: Line, block: Block, *, metric: bool) -> Iterator[Problem]:
        """What is wrong with a block by itself: words off the list, twice, without others or beside others."""
        words, ruled = block.words, block.ruled

        def wrong(text: str) -> Problem:
            return Problem(NOT_LISTED, 0, block.line, text)

        for word, row in ruled:
            if row is UNLISTED and self._table.accepting(word):
                yield wrong(f"{word} is beside nothing that it belongs to")
            elif row is UNLISTED:
                yield wrong(f"{word} is not on the list of words for this control")
        for spelt in line.words:
            if self._lexer.without_point(spelt) and not (metric and spelt.name in self._whole):
                yield wrong(f"{spelt.text} without a decimal point: the control may count it in its least increment")
        names = [word.name for word in line.words if word.name not in "GM"]
        names += [word for word in words if word[0] in "GM"]
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield wrong(f"{name} is twice in one block")
        functions = [row.group for word, row in ruled if word[:1] == "M"]
        if len(functions) > (self._m_words if set(functions) <= {"spindle", "coolant"} else 1):
            yield wrong("two M words in one block")
        groups = [row.sets[0][0] for _, row in ruled if row.sets and not row.changes_tool]
        if len(set(groups)) < len(groups):
            yield wrong("two words of one group in one block")
        for k, (word, row) in enumerate(ruled):
            if row.must is not None and not any_of(row.must, (*words[:k], *words[k + 1 :])):
                yield wrong(f"{word} without {shown(row.must)}")
            if row.alone:
                belong = [bool(other.needs and other.needs.fullmatch(word)) for _, other in ruled]
                for (other, _), belongs in zip(ruled, belong, strict=True):
                    if other != word and (not belongs or sum(belong) > 1):
                        yield wrong(f"{other} in the block of {word}")
            shared = row.pattern.fullmatch(word) if row.share is not None else None
            for name, number in shared.groupdict().items() if shared else ():
                room = (row.share or 0.0) * self._rooms[name] * (1 + 1e-9) + 1e-5
                if number is not None and float(number) > room:
                    yield wrong(f"{word} is more than {row.share:g} of the tolerance")
                elif number is not None and not float(number):
                    yield wrong(f"{word}: 0 is no tolerance, and the control rounds as it likes")
