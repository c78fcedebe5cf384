"""Words that are not on the control's list, or not in their place; states that the program never establishes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.control.state import State
from cornersmooth.control.table import UNLISTED, Row, any_of, shown, table_of
from cornersmooth.errors import InputError
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.word_tables import word_table
from cornersmooth.nc_reader.words import Line, Table
from cornersmooth.nc_words.blocks import NOT_LISTED, Ruled, WordRules
from cornersmooth.nc_words.machine_positions import MachinePositions
from cornersmooth.nc_words.parts import Parts
from cornersmooth.nc_words.states import LINEAR, ROTARY, StateRules
from cornersmooth.statements.comparison import KINDS

#: words that bear on no motion: tool, spindle, stops, coolant (ISO 6983-1, M0 to M9 and M19)
_BESIDE_MOTION: Final = re.compile(r"T\d+|S\d+(\.\d*)?|M(\d|19)|TOOL CALL \d+( Z)?( S\d+)?")

#: kinds of statements that bear on the motion: where the path is moved to
_OF_MOTION: Final = frozenset(("compensation", "register", "offset"))

#: blocks that were not looked at and are told one by one
_UNSURE_TOLD: Final = 3

_CONTROL_CHARACTERS: Final = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")

#: mark of the transfer, which a control that shows a program has taken off
_TAPE: Final = "%"

#: versions whose programs have no digests in their head
_NO_DIGESTS: Final = re.compile(r"0\.[0-2]\b")

#: stands for any number in a block of the user's
_ANY: Final = "9075301"

#: addresses of weights; how far one may be from those that are asked for: half of the last decimal that controls keep;
#: weights given out of one run of blocks
_WEIGHTS: Final = ("PW", "R")
_WEIGHT_ROOM: Final = 5e-4
_MOST_WEIGHTS: Final = 100


class WordCheck:
    """Looks at all blocks of a program in order; ε in units of the program, that of the tool axis in degrees.

    Trusted blocks belong where they are because the user says so, any number where they have braces; so do names of
    states that the program leaves to him, and `FRAME` where the blocks around the motion are his. Words in these that
    are accepted move nothing. Control points of curves have one of the weights; any where these are None.
    """

    def __init__(
        self,
        control: str,
        lexer: Lexer,
        tolerance: float,
        trusted: Iterable[str] = (),
        accepted: Set[str] = frozenset(),
        weights: Iterable[float] | None = None,
        positions: MachinePositions | None = None,
        axis_tolerance: float = 0.0,
    ) -> None:
        self._positions = MachinePositions(None, 1.0) if positions is None else positions
        table, keys = self._positions.table(table_of(control)), word_table(control)
        self._rules = WordRules(table, self._positions.rules, lexer, tolerance, axis_tolerance, keys.get("m_words", 1))
        self.lexer = lexer
        trusted = set(trusted)
        own = set(map(self._text, trusted))
        self._own = [re.compile(re.escape(text).replace(_ANY, r"[-+]?[\d.]+")) for text in own if text]
        self._states = StateRules(State(table, ("X", "Y", "Z", *"ABC")), self._positions, trusted | own)
        self._left, self._accepted = trusted, accepted
        self.problems, self._wrong = self._states.problems, self._states.wrong
        #: blocks taken on trust, line and text, and those of them that may bear on the motion
        self.trusted, self.unsure = self._states.trusted, self._states.unsure
        kinds = KINDS & trusted
        self._moving = _own_table(kinds & _OF_MOTION)
        self.trusted += [(0, text) for text in _own_table(kinds - _OF_MOTION)]
        self.parts = Parts(lexer)
        self._line = 0  # of the last block
        #: what stands before the program, what a comment begins with that is obeyed, and blocks of the end
        self._header, self._orders = re.compile(keys.get("header", "(?!)")), keys.get("orders", "(?!)")
        self._ends = tuple(map(re.compile, keys["end"]))
        self._wanted = tuple(map(re.compile, keys["begin"]))  # blocks of the begin that are still to come
        self._opening = ""
        self._tail: list[tuple[int, str]] = []
        self._before: tuple[int, str, Ruled] = 0, "", []
        self._weights = None if weights is None else tuple(weights)
        self._needed, self._whole = keys["grammar"].get("curves_need"), keys.get("whole", "")
        #: by how much the control may round on its own, in units of the program: added to what is measured
        self.rounding = 0.0

    def watch(self, items: Iterable[Table | Line]) -> Iterator[Table | Line]:
        """Give on what the lines say, looked at; what is wrong is in `problems` when all is read."""
        for item in items:
            if isinstance(item, Table):
                self._table(item)
                yield item
            else:
                yield self._block(item)
        self._end()

    @property
    def unlooked(self) -> str:
        """What was not looked at and may bear on the motion; empty for nothing."""
        told = [f"{block}, NC line {line}" for line, block in self.unsure[:_UNSURE_TOLD]]
        if more := len(self.unsure) - len(told):
            told.append(f"{more} more blocks of your own")
        old = "blocks around the motion: the version that wrote them put no digests into the head, write it anew"
        told += [old] * bool(_NO_DIGESTS.match(self._states.made.get("VERSION", "")))
        return "; ".join(filter(None, (*told, *self._moving, self.parts.changed())))

    @property
    def work_offset(self) -> str:
        """The work offset that holds at the end, as it is written; empty for none."""
        return self._states.work_offset

    def _text(self, block: str) -> str:
        """A block of the user's as the lists have it, `_ANY` for what is in braces; empty where it has no words."""
        block = re.sub(r"\{\w+\}", _ANY, re.sub(r"(^| )(?=\{\w+\})", r"\1G", block))  # alone it is a G word
        try:
            line = self.lexer.line(block.encode("latin-1", "replace"), 0, None)
        except InputError:  # no words: the reader will say so where it meets them
            return ""
        return " ".join(word.spelling for word in line.words)

    # runs of motion blocks, and lines

    def _table(self, table: Table) -> None:
        """Look at a run of motion blocks: its words are those of motion, and no others."""
        self._frames(int(table.line[0]), "")
        self._line = int(table.line[-1])
        self._follow(self._line, "", [])
        self._check_weights(table)
        machine = self._states.machine
        self.parts.table(table, machine)
        self._positions.leave(table.columns.keys())
        rows = [len(table)]
        if self._states.attentive:
            linear = ~np.all([np.isnan(table.column(name)) for name in sorted(LINEAR)], axis=0)
            first = int(np.argmax(linear))
            down = int(np.argmax(~np.isnan(table.column("Z")[first:]))) if self._states.above else 0
            rows = sorted({0, first, first + down, len(table)})
        for row in rows:
            given = table.last_before(row + 1, {"G", *ROTARY})
            machine.pass_blocks(given.pop("G", None), given)
            if row < len(table):
                self._move(int(table.line[row]), table.row(row))

    def _check_weights(self, table: Table) -> None:
        """Complain of weights that no curve of the program has; R of an arc is its radius."""
        weights = np.sort(self._weights) if self._weights is not None else np.zeros(0)
        for name in _WEIGHTS if len(weights) else ():
            column = table.column(name)
            off = ~np.isnan(column) & ~np.isin(table.column("G"), (2.0, 3.0))
            if off.any():
                after = np.clip(np.searchsorted(weights, column), 1, len(weights) - 1)
                near = np.minimum(np.abs(column - weights[after - 1]), np.abs(column - weights[after]))
                off &= near > _WEIGHT_ROOM
            for row in np.flatnonzero(off)[:_MOST_WEIGHTS].tolist():
                self._wrong(
                    NOT_LISTED, int(table.line[row]), f"a weight of {column[row]:g}, which no curve of this program has"
                )

    def _block(self, line: Line) -> Line:
        """Look at a line on its own; of one that is taken on trust only what is understood goes on to the reader."""
        number = line.number
        for comment in line.comments:
            self._states.comment(comment)
            self.parts.comment(comment)
            if re.match(self._orders, comment, re.IGNORECASE):
                self._wrong(NOT_LISTED, number, f"a comment that the control obeys: {comment[:40]}")
            if _CONTROL_CHARACTERS.search(comment):
                self._wrong(NOT_LISTED, number, "a comment with a character that ends a block or is none")
        words = [word.spelling for word in line.words] or ["%"] * line.tape
        text = " ".join(words)
        own = bool(words) and any(pattern.fullmatch(text) for pattern in self._own)
        if line.skipped and not own:
            self._wrong(NOT_LISTED, number, "block skip: what the control does depends on a switch")
        if not words:
            return line
        machine, after = self._states.machine, self._executed(line)
        self.parts.line(line, machine, after)
        before, ruled = len(self.problems), self._rules.of(words)
        self._functions(number, words, ruled)
        if not self._frames(number, text):
            self._follow(number, text, ruled)
            metric = self._states.holds("units", "G21") and self._states.holds("feed", "G94")
            self.problems += self._rules.problems(line, words, ruled, self._whole if metric else "")
            self._states.take(number, words, ruled, after)
        self._line = number
        if own:
            trusted = self._on_trust(line, words, ruled, before)
            if trusted is not line:  # what it establishes counts
                self._states.machine, line = machine, trusted
                self._states.machine = self._executed(line)
            ruled = self._rules.of([word.spelling for word in line.words])
        elif self._positions.rules:
            retract = any(row.retract and row not in self._positions.rules for _, row in ruled)
            self.problems += self._positions.take(line, text, retract=retract)
        self._move(number, {word.name: word.value for word in line.words}, [row for _, row in ruled])
        return line

    def _executed(self, line: Line) -> State:
        """What holds after a line."""
        after = self._states.machine.copy()
        after.execute(line)
        return after

    def _functions(self, number: int, words: Sequence[str], ruled: Ruled) -> None:
        """Take note of what the control rounds by words of a block, and of functions that nobody asked for."""
        for word, row in ruled:
            shared = row.pattern.fullmatch(word)
            if shared and (length := shared.groupdict().get("length")):
                # LinuxCNC: without Q lines are merged within P, too
                self.rounding = max(self.rounding, float(length) * (1.0 + ("G64" in words and "Q0" not in words)))
            # a block that counts as a whole says nothing of by how much
            if row.extra and any_of(row.extra, words) and (row.alone or not self._intended(" ".join(words))):
                self.trusted.append((number, " ".join(words)))

    def _intended(self, block: str) -> bool:
        """Whether somebody has asked for a block of a function of the control, or curves need it."""
        made = self._states.made
        return "WITH" in made or (block == self._needed and made.get("FORM") != "G1")

    @property
    def offset(self) -> str:
        """Work offset that nothing was compared with; empty for none."""
        return self._states.unsure_offset

    def _on_trust(self, line: Line, words: Sequence[str], ruled: Ruled, before: int) -> Line:
        """Take a block of the user's on trust if there are problems from a number on, and leave its words out.

        What it establishes counts. With a word that is not on the list, not in its place, or that the CL file would
        have to ask for, the block is taken on trust, and the reader gets no more of it than is understood.
        """
        if not (line.skipped or len(self.problems) > before or any(row.compared for _, row in ruled)):
            return line
        del self.problems[before:]
        block = line.number, " ".join(words)
        self.trusted.append(block)
        if line.skipped or not all(word in self._accepted or _BESIDE_MOTION.fullmatch(word) for word in words):
            self.unsure.append(block)
        if len(ruled) < len(words):
            return line
        left = [row is UNLISTED or row.compared for _, row in ruled]
        tool = "tool" in self._left  # stops for a tool are told by its number
        kept = [word for word, out in zip(line.words, left, strict=True) if not out or (tool and word.name == "T")]
        return replace(line, words=tuple(kept))

    def _move(self, line: int, given: Mapping[str, float], rows: Sequence[Row] = ()) -> None:
        """Look at where the words of a block send the axes; those beside a word that is alone do not move the tool."""
        self._states.turn(line, given)
        moves, drills = any(row.moves for row in rows), any(row.cycle for row in rows)
        if moves or (LINEAR & given.keys() and not any(row.alone for row in rows)):
            self._states.motion(line, given, drills=drills)

    def _follow(self, line: int, text: str, ruled: Ruled) -> None:
        """Look at what a block and that before want of each other."""
        number, before, theirs = self._before
        for _, row in theirs:
            if row.next is not None and not row.next.fullmatch(text):
                self._wrong(NOT_LISTED, number, f"{shown(row.pattern)} without {shown(row.next)} after it")
        for word, row in ruled:
            if row.previous is not None and not row.previous.fullmatch(before):
                self._wrong(NOT_LISTED, line, f"{word} does not follow what it belongs to")
        self._before = line, text, ruled

    # how the program begins and ends

    def _frames(self, number: int, text: str) -> bool:
        """Whether a block is one that begins or ends the program, where it belongs."""
        if not self._line and self._header.fullmatch(text):
            return True
        if wanted := self._wanted:
            place = next((k for k, pattern in enumerate(wanted) if pattern.fullmatch(text)), None)
            missing = [pattern for pattern in wanted[:place] if pattern.pattern != _TAPE]
            if missing:
                self._states.unframed(NOT_LISTED, number, f"the program must begin with {shown(missing[0])}")
            self._wanted = () if place is None else wanted[place + 1 :]
            if place is not None:
                self._opening = self._opening or text
                return True
        if any(pattern.fullmatch(text) for pattern in self._ends):
            self._tail.append((number, text))
            return True
        for line, ending in self._tail:
            self._states.unframed(NOT_LISTED, line, f"{ending} ends the program, and more follows")
        self._tail = []
        return False

    def _end(self) -> None:
        """Look at what holds when all is read."""
        first = self._tail[0][0] if self._tail else self._line
        ends, texts = self._ends, [text for _, text in self._tail]
        if texts and texts[-1] != _TAPE:
            ends = tuple(pattern for pattern in ends if pattern.pattern != _TAPE)
        if len(texts) != len(ends) or not all(map(re.Pattern.fullmatch, ends, texts)):
            self._states.unframed(NOT_LISTED, first, f"the program must end with {', '.join(map(shown, ends))}, once")
        elif self._opening.partition(" ")[2] != texts[-1].partition(" ")[2]:
            self._states.unframed(NOT_LISTED, self._tail[-1][0], f"{texts[-1]} ends what {self._opening} began")
        self._states.end(first)


def _own_table(kinds: Set[str]) -> list[str]:
    return [f"what your own table says of {', '.join(sorted(kinds))}"] if kinds else []
