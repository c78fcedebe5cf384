"""Words that are not on the control's list, or not in their place; states that the program never establishes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.control.state import State
from cornersmooth.control.table import UNLISTED, Row, any_of, shown, table_of, word_table
from cornersmooth.control.words import Lexer, Line, Table
from cornersmooth.errors import InputError
from cornersmooth.nc_words.blocks import NOT_LISTED, Block, WordRules, ruled_words
from cornersmooth.nc_words.parts import Parts
from cornersmooth.nc_words.states import LINEAR, ROTARY, MachinePositions, StateRules
from cornersmooth.statements.comparison import KINDS

#: code of positions of the machine that its file does not have, or that are missing
POSITIONS: Final = "CS583"

#: words that bear on no motion: tool, spindle, stops, coolant (ISO 6983-1, M0 to M9 and M19)
_BESIDE_MOTION: Final = re.compile(r"T\d+|S\d+(\.\d*)?|M(\d|19)|TOOL CALL \d+( Z)?( S\d+)?")

#: kinds of statements that bear on the motion: where the path is moved to
_OF_MOTION: Final = frozenset(("compensation", "register", "offset"))

#: blocks that were not looked at and are named one by one
_UNSURE_NAMED: Final = 3

_CONTROL_CHARACTERS: Final = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")

#: mark of the transfer, which a control that shows a program has taken off
_TAPE: Final = "%"

#: versions whose programs have no digests in their head
_NO_DIGESTS: Final = re.compile(r"0\.[0-2]\b")

#: stands for any number in a block of the user's
_ANY: Final = "9075301"

#: addresses of weights; how far one may be from those of the curves: half of the last decimal that controls keep;
#: weights given out of one run of blocks
_WEIGHTS: Final = ("PW", "R")
_WEIGHT_ROOM: Final = 5e-4
_MOST_WEIGHTS: Final = 100


class WordCheck:
    """Looks at all blocks of a program in order; ε in units of the program, that of the tool axis in degrees.

    Trusted blocks belong where they are because the user has them so, any number where they have braces; so do names of
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
        more = keys.get("m_words", 1), keys.get("whole", "")
        self._rules, self.lexer = WordRules(table, lexer, tolerance, axis_tolerance, *more), lexer
        trusted = set(trusted)
        own = set(map(self._text, trusted))
        self._own = [re.compile(re.escape(text).replace(_ANY, r"[-+]?[\d.]+")) for text in own if text]
        self._states = StateRules(State(table, (*"XYZABCIJK",)), self._positions, trusted | own)
        self._left, self._accepted = trusted, accepted
        self.problems, self._wrong = self._states.problems, self._states.wrong
        #: blocks taken on trust, line and text, and those of them that may bear on the motion
        self.trusted, self.unsure = self._states.trusted, self._states.unsure
        kinds = KINDS & trusted
        self._moving = _own_table(kinds & _OF_MOTION)
        self.trusted += [(0, text) for text in _own_table(kinds - _OF_MOTION)]
        self.parts = Parts()
        #: what stands before the program, what a comment begins with that is obeyed, and blocks of the end
        self._header, self._orders = re.compile(keys.get("header", "(?!)")), keys.get("orders", "(?!)")
        self._ends = tuple(map(re.compile, keys["end"]))
        self._wanted = tuple(map(re.compile, keys["begin"]))  # blocks of the begin that are still to come
        self._opening = ""
        self._commented = False  # whether a comment has come
        self._tail: list[tuple[int, str]] = []
        self._before = Block(0)
        self._line = 0  # of the last block
        self._weights = np.sort(() if weights is None else tuple(weights))
        self._needed = keys["grammar"].get("curves_need")
        #: by how much the control may round on its own, in units of the program: added to what is measured
        self.rounding = 0.0

    def watch(self, items: Iterable[Table | Line]) -> Iterator[Table | Line]:
        """Give on all lines, looked at; what is wrong is in `problems` when all is read."""
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
        named = [f"{block}, NC line {line}" for line, block in self.unsure[:_UNSURE_NAMED]]
        if more := len(self.unsure) - len(named):
            named.append(f"{more} more blocks of your own")
        old = "blocks around the motion: the version that wrote them put no digests into the head, write it anew"
        named += [old] * bool(_NO_DIGESTS.match(self._states.made.get("VERSION", "")))
        return "; ".join(filter(None, (*named, *self._moving, self.parts.changed())))

    @property
    def work_offset(self) -> str:
        """The work offset that holds at the end, as it is written; empty for none."""
        last = self._states.machine.last_words.get("offset")
        return "" if last is None else last.text

    @property
    def offset(self) -> str:
        """Work offset that nothing was compared with; empty for none."""
        made = self._states.made
        known = made and made.get("OFFSET") != "NONE" and not self._states.is_left("offset")
        return "" if known else self.work_offset

    def _text(self, block: str) -> str:
        """A block of the user's as the lists have it, `_ANY` for what is in braces; empty where it has no words."""
        block = re.sub(r"\{\w+\}", _ANY, re.sub(r"(^| )(?=\{\w+\})", r"\1G", block))  # alone it is a G word
        try:
            line = self.lexer.line(block.encode("latin-1", "replace"), 0, None)
        except InputError:  # no words: the reader complains where it meets them
            return ""
        return " ".join(word.spelling for word in line.words)

    # runs of motion blocks, and lines

    def _table(self, table: Table) -> None:
        """Look at a run of motion blocks: its words are those of motion, and no others."""
        first, self._line = int(table.line[0]), int(table.line[-1])
        self._frames(first, "")
        self._follow(Block(self._line))
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
        known = self._weights
        for name in _WEIGHTS if len(known) else ():
            column = table.column(name)
            near = known[np.searchsorted((known[1:] + known[:-1]) / 2.0, column)]
            off = (np.abs(column - near) > _WEIGHT_ROOM) & ~np.isin(table.column("G"), (2.0, 3.0))
            for row in np.flatnonzero(off)[:_MOST_WEIGHTS].tolist():
                text = f"a weight of {column[row]:g}, which no curve of this program has"
                self._wrong(NOT_LISTED, int(table.line[row]), text)

    def _block(self, line: Line) -> Line:
        """Look at a line on its own; of one that is taken on trust only what is understood goes on to the reader."""
        number, states = line.number, self._states
        for comment in line.comments:
            states.comment(comment)
            self.parts.comment(comment)
            if re.match(self._orders, comment, re.IGNORECASE):
                self._wrong(NOT_LISTED, number, f"a comment that the control obeys: {comment[:40]}")
            if _CONTROL_CHARACTERS.search(comment):
                self._wrong(NOT_LISTED, number, "a comment with a character that ends a block or is none")
        words = tuple(word.spelling for word in line.words) or (_TAPE,) * line.tape
        block = Block(number, words, ruled_words(states.machine.table, words))
        own = bool(words) and any(pattern.fullmatch(block.text) for pattern in self._own)
        if line.skipped and not own:
            self._wrong(NOT_LISTED, number, "block skip: what the control does depends on a switch")
        if not words:
            self._commented |= bool(line.comments)
            return line
        machine, before = states.machine, len(self.problems)
        after = machine.after(line)
        self.parts.line(line, machine, after)
        self._functions(block)
        if not self._frames(number, block.text):
            self._follow(block)
            metric = {"G21", "G94"} <= {last.text for last in machine.last_words.values()}
            self.problems += self._rules.problems(line, block, metric=metric)
            states.take(block, after)
        self._line, ruled = number, block.ruled
        if own:
            trusted = self._on_trust(line, block, before)
            if trusted is not line:  # what it establishes counts
                states.machine, line = machine.after(trusted), trusted
            ruled = ruled_words(machine.table, tuple(word.spelling for word in line.words))
        given = {word.name: word.value for word in line.words}
        if self._positions and not own:
            self._at_positions(block, given)
        self._move(number, given, [row for _, row in ruled])
        return line

    def _at_positions(self, block: Block, given: Mapping[str, float]) -> None:
        """Look at positions of the machine in a block, and at where the machine is where it wants one."""
        rows, positions = [row for _, row in block.ruled], self._states.machine.table.positions
        if any(row.pattern.fullmatch(block.text) for row in positions):
            free_z = any(row.retract and not row.positions for row in rows)
            for place, wanted in self._positions.go(given, free_z=free_z):
                self._wrong(POSITIONS, block.line, f"{place} of the machine, whose file says {wanted}")
            return
        name, what = "", ""
        if any(row.changes_tool for row in rows):
            name, what = "change", "the tool is changed"
        elif self._tail == [(block.line, block.text)]:
            name, what = "home", "the program ends"
        if off := self._positions.missed(name):
            self._wrong(POSITIONS, block.line, f"{what} away from {off} of the machine, which its file asks for")
        if not name:
            self._positions.leave(given.keys())

    def _functions(self, block: Block) -> None:
        """Take note of what the control rounds by words of a block, and of functions that nobody wanted."""
        made, words = self._states.made, block.words
        wanted = "WITH" in made or (block.text == self._needed and made.get("FORM") != "G1")  # curves need it
        for word, row in block.ruled:
            shared = row.pattern.fullmatch(word)
            if shared and (length := shared.groupdict().get("length")):
                # LinuxCNC: without Q lines are merged within P, too
                self.rounding = max(self.rounding, float(length) * (1.0 + ("G64" in words and "Q0" not in words)))
            # a block that counts as a whole has not by how much
            if row.extra and any_of(row.extra, words) and (row.alone or not wanted):
                self.trusted.append((block.line, block.text))

    def _on_trust(self, line: Line, block: Block, before: int) -> Line:
        """Take a block of the user's on trust if there are problems from a number on, and leave its words out.

        What it establishes counts. With a word that is not on the list, not in its place, or that the CL file would
        have to have, the block is taken on trust, and the reader gets no more of it than is understood.
        """
        if not (line.skipped or len(self.problems) > before or any(row.compared for _, row in block.ruled)):
            return line
        del self.problems[before:]
        self.trusted.append((block.line, block.text))
        if line.skipped or not all(word in self._accepted or _BESIDE_MOTION.fullmatch(word) for word in block.words):
            self.unsure.append((block.line, block.text))
        if len(block.ruled) < len(block.words):
            return line
        tool = "tool" in self._left  # stops for a tool have its number
        kept = [
            word
            for word, (_, row) in zip(line.words, block.ruled, strict=True)
            if not (row is UNLISTED or row.compared) or (tool and word.name == "T")
        ]
        return replace(line, words=tuple(kept))

    def _move(self, line: int, given: Mapping[str, float], rows: Sequence[Row] = ()) -> None:
        """Look at where the words of a block send the axes; those beside a word that is alone do not move the tool."""
        self._states.turn(line, given)
        moves = any(row.cycle and ("motion", None) in row.sets for row in rows)  # a hole cycle, where the tool is
        if moves or (LINEAR & given.keys() and not any(row.alone for row in rows)):
            self._states.motion(line, given, drills=any(row.cycle for row in rows))

    def _follow(self, block: Block) -> None:
        """Look at what a block and that before want of each other."""
        before, self._before = self._before, block
        for _, row in before.ruled:
            if row.next is not None and not row.next.fullmatch(block.text):
                self._wrong(NOT_LISTED, before.line, f"{shown(row.pattern)} without {shown(row.next)} after it")
        for word, row in block.ruled:
            if row.previous is not None and not row.previous.fullmatch(before.text):
                self._wrong(NOT_LISTED, block.line, f"{word} does not follow what it belongs to")

    # how the program begins and ends

    def _frames(self, number: int, text: str) -> bool:
        """Whether a block is one that begins or ends the program, where it belongs."""
        if not self._line and self._header.fullmatch(text):
            return True
        if wanted := self._wanted:
            place = next((k for k, pattern in enumerate(wanted) if pattern.fullmatch(text)), len(wanted))
            missing = [pattern for pattern in wanted[:place] if pattern.pattern != _TAPE]
            if missing:
                self._states.unframed(NOT_LISTED, number, f"the program must begin with {shown(missing[0])}")
            self._wanted = wanted[place + 1 :]
            if text == _TAPE and self._commented:
                self._states.unframed(NOT_LISTED, number, "% where a comment is before it")
            if place < len(wanted):
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
