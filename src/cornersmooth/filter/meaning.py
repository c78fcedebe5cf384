"""What lines of a program say, whatever their spelling: two programs are compared by it.

Block numbers, blanks, comments, leading zeros and the order of words in a block are no difference. Numbers of blocks
count where the program may jump to them.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from cornersmooth.control.state import State
from cornersmooth.control.words import Word
from cornersmooth.errors import InputError
from cornersmooth.filter.runs import ProgramReader, Reading

#: what a line says: its words, in order
Meaning = tuple[tuple[str, str], ...]

#: comments that a control acts on (LinuxCNC: MSG, DEBUG, PROBEOPEN, LOG, PY, ABORT)
_ACTING: Final = re.compile(r"\s*([A-Za-z]+\s*,|PROBE|LOG)", re.IGNORECASE)

#: words that may jump or call
_JUMPS: Final = re.compile(r"GOTO|REPEAT|(?<!TOOL )CALL|\bM0*9[6-9]|\bM198|\bG0*6[56]\b|\bG7[0-3]\b.*P")

#: groups that blocks of a run may set
_OF_MOTION: Final = frozenset(("motion", "distance", "feed", "plane", "path"))


@dataclass
class Meanings:
    """Reads lines of a program by what they say."""

    reader: ProgramReader
    state: State
    numbers: bool  #: whether numbers of blocks count

    @classmethod
    def of(cls, reader: ProgramReader, program: Reading) -> Meanings:
        """Make it for a program and those that are compared with it."""
        stream = reader.stream(program)
        plain = (reader.lexer.comment.sub(" ", line.decode("latin-1").upper()) for _, line in stream.others)
        return cls(reader, reader.start, any(_JUMPS.search(line) for line in plain))

    def of_line(self, text: bytes) -> Meaning:
        """What a line says; empty for nothing."""
        lexer = self.reader.lexer
        try:
            line = lexer.line(text, 0, None)
        except InputError:
            plain = lexer.comment.sub(" ", text.decode("latin-1").upper())
            plain = plain if self.numbers else re.sub(r"^\s*N\d+\s*", "", plain)
            return (("line", " ".join(plain.split())),) if plain.strip() else ()
        words = sorted(map(self._of_word, line.words))
        words += [("comment", one) for one in line.comments if _ACTING.match(one)]
        words += [("skipped", "")] * line.skipped + [("tape", "")] * line.tape
        number = line.block_number
        return (*([("N", f"{number.value:g}")] if number and self.numbers else []), *words)

    def _of_word(self, word: Word) -> tuple[str, str]:
        if len(word.name) > 1:
            return word.name, re.sub(r"\s+", "", word.text.upper())
        return word.name, f"{word.value!r}{' without point' * self.reader.lexer.without_point(word)}"

    def is_motion(self, text: bytes) -> bool:
        """Whether a line has words of motion and feed alone."""
        try:
            line = self.reader.lexer.line(text, 0, None)
        except InputError:
            return not self.of_line(text)
        if line.skipped or line.tape or any(_ACTING.match(one) for one in line.comments):
            return False
        rows = self.state.rows(line.words)
        beside = frozenset[str]().union(*(row.beside for _, _, row in rows), *self.state.table.arguments.values())
        return all(
            (bool(row.sets) and not row.does and {group for group, _ in row.sets} <= _OF_MOTION) or name in beside
            for _, name, row in rows
        )
