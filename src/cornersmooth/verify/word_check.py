"""Words that are not on the control's list, or not in their place; states that the program never establishes."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Set
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.nc_reader.block_texts import any_numbers, numbers_in, said, shown, text_of
from cornersmooth.nc_reader.curve_weights import odd_weights
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.machine_positions import MachinePositions
from cornersmooth.nc_reader.own_frame import OwnFrame, shadowed
from cornersmooth.nc_reader.word_list import WordList, WordRule, word_list
from cornersmooth.nc_reader.word_rules import NOT_LISTED, WordRules
from cornersmooth.nc_reader.words import Line, Table

#: what is said of a retract with the same tool, which only GOHOME of the CL file asks for
GONE_ON: Final = "a retract that another motion of the same tool follows"

#: code of states that the program never establishes
NOT_ESTABLISHED: Final = "CS572"

#: words of positions along the linear axes: with them a block is a motion that the states count for
_LINEAR: Final = frozenset("XYZ")

#: words of rotary axes
_ROTARY: Final = frozenset("ABC")

#: name of the blocks around the motion, among what is left to the user
FRAME: Final = "program frame"

#: a block that takes another tool, and words that start and stop the spindle
_TOOL_CALL: Final = re.compile(r"TOOL CALL \d")
_SPINDLE: Final = re.compile(r"M[345]")

#: words that bear on no motion: tool, spindle, stops, coolant (ISO 6983-1, M0 to M9 and M19)
_BESIDE_MOTION: Final = re.compile(r"T\d+|S\d+(\.\d*)?|M(\d|19)|TOOL CALL \d+( Z)?( S\d+)?")

_CONTROL_CHARACTERS: Final = re.compile(r"[\x00-\x08\x0a-\x1f\x7f]")


class WordCheck:
    """Looks at all blocks of a text in order.

    Parameters
    ----------
    tolerance : float
        ε in units of the text.
    trusted : iterable of str
        Blocks that belong where they stand because the user says so, any number where they have braces; names of states
        that the text leaves to him, and `FRAME` where the blocks around the motion are his.
    accepted : set of str
        Words in these that move nothing because the user says so.
    weights : iterable of float, optional
        Those that control points of curves have; None where they may have any.
    positions : MachinePositions, optional
        Those of the machine's file.
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
    ) -> None:
        self._positions = MachinePositions(None, 1.0) if positions is None else positions
        listed = word_list(control)
        self.list: WordList = replace(listed, words=(*self._positions.switch, *listed.words))
        self._rules = WordRules(self.list, self._positions.rules, lexer, tolerance)
        self.lexer = lexer
        self.problems: list[Problem] = []
        #: blocks taken on trust, line and text, and those of them that may bear on the motion
        self.trusted: list[tuple[int, str]] = []
        self.unsure: list[tuple[int, str]] = []
        trusted = tuple(trusted)
        self._left, self._accepted = set(trusted), accepted
        plain = [block for block in trusted if "{" not in block]
        self._own = {text_of(words) for words in map(self._words_of, plain) if words}
        templates = [(self._words_of(numbers_in(block))) for block in set(trusted) - set(plain)]
        #: what texts of our own say beyond that
        self._frame = OwnFrame(self.list, self._left | self._own, self._positions)
        self._own_patterns = [any_numbers(text_of(words)) for words in templates if words]
        self._blocks = 0
        self._begun, self._opening = 0, ""
        self._tail: list[tuple[int, str]] = []
        self._state: dict[str, tuple[str, int]] = {}
        self._first: dict[str, str] | None = None
        self._complained: set[tuple[str, int]] = set()
        self._changed = True
        self._said: set[str] = set()
        self._before = ""
        self._then: tuple[WordRule, int] | None = None
        self._retract = 0
        self._high = False
        #: whether Z stands where a retract has left it, and states that may be said as late as with its next word
        self._above = False
        self._late = {rule.state for rule in self.list.words if rule.late}
        self._deferred: set[str] = set()
        #: states that an approach establishes again
        self._approach = {rule.state for rule in self.list.words if rule.off} | {"work offset", "cutting edge"}
        #: where the rotary axes have been sent, as far as that is said
        self._angles: dict[str, float] = {}
        self._arc: tuple[str, int] | None = None
        #: states that a word has made the control forget, with that word
        self._dropped: dict[str, str] = {}
        #: whether the spindle has been started since the tool last moved
        self._started = False
        #: the tool change that has stopped it since, with its line, if it is not started again
        self._stopped: tuple[str, int] | None = None
        #: complaints that count only where the text has no hole cycles; None where it has
        self._by_tool: list[Problem] | None = []
        self._code = -1.0
        self._weights = None if weights is None else np.array(tuple(weights))
        self._line = 0

    def watch(self, items: Iterable[Table | Line]) -> Iterator[Table | Line]:
        """Give on what the lines say, looked at; what is wrong stands in `problems` when all is read."""
        for item in items:
            if isinstance(item, Table):
                self._table(item)
                yield item
            else:
                yield self._block(item)
        self._end()

    def _words_of(self, text: str) -> list[str]:
        try:
            line = self.lexer.line(text.encode("latin-1", "replace"), 0, None)
        except InputError:  # no words: the reader will say so where it meets them
            return []
        return [said(word) for word in line.words]

    def _is_own(self, text: str) -> bool:
        return text in self._own or any(pattern.fullmatch(text) for pattern in self._own_patterns)

    def _wrong(self, code: str, line: int, text: str) -> None:
        self.problems.append(Problem(code, 0, line, text))

    def _unframed(self, code: str, line: int, text: str) -> None:
        """Complain of the blocks around the motion; where they are the user's own, it is taken on trust."""
        if FRAME in self._left:
            self.trusted.append((line, text))
            self.unsure.append((line, text))
        else:
            self._wrong(code, line, text)

    def _unframe(self, line: int, texts: Iterable[str]) -> None:
        for text in texts:
            self._unframed(NOT_LISTED, line, text)

    def _table(self, table: Table) -> None:
        """Look at a run of motion blocks: its words are those of motion, and no others."""
        self._start(int(table.line[0]), "")
        self._blocks += len(table)
        self._line = int(table.line[-1])
        self._next_block("", int(table.line[0]))
        codes = table.column("G")
        known = np.flatnonzero(~np.isnan(codes))
        if self._weights is not None:
            for line, weight in odd_weights(table, self._weights):
                self._wrong(NOT_LISTED, line, f"a weight of {weight:g}, which no curve of this program has")
        linear = ~np.all([np.isnan(table.column(name)) for name in sorted(_LINEAR)], axis=0)
        if linear.any():
            self._spindle_at_motion()
        self._unframe(int(table.line[0]), self._frame.turns(table.row(0)))
        self._positions.leave(table.columns.keys())
        if (self._changed or self._high or self._retract or self._arc or self._above) and linear.any():
            row = int(np.argmax(linear))
            down = ~np.isnan(table.column("Z"))
            rows = [row, row + int(np.argmax(down[row:]))] if self._above and not down[row] and down.any() else [row]
            for row in rows:
                given = known[known <= row]
                self._frame.angles(self._angles | table.last_before(row, _ROTARY))
                self._unframe(int(table.line[row]), self._frame.moved(table.row(row)))
                code = float(codes[given[-1]]) if len(given) else self._code
                self._moved(int(table.line[row]), code, bool(down[row]))
        if len(known):
            self._code = float(codes[known[-1]])
        self._angles |= table.last_before(len(table), _ROTARY)
        self._frame.angles(self._angles)

    def _block(self, line: Line) -> Line:
        """Look at a line on its own; of one that is taken on trust only what is understood goes on to the reader."""
        for comment in line.comments:
            self._frame.comment(comment)
            if self.list.orders is not None and self.list.orders.match(comment):
                self._wrong(NOT_LISTED, line.number, f"a comment that the control obeys: {comment[:40]}")
            if _CONTROL_CHARACTERS.search(comment):
                self._wrong(NOT_LISTED, line.number, "a comment with a character that ends a block or is none")
        if not line.words and not line.tape:
            if line.skipped:
                self._wrong(NOT_LISTED, line.number, "block skip: what the control does depends on a switch")
            return line
        words = [said(word) for word in line.words] or ["%"]
        text = text_of(words)
        self._line = line.number
        if self._is_own(text):
            return self._users_block(line, words, text)
        if line.skipped:
            self._wrong(NOT_LISTED, line.number, "block skip: what the control does depends on a switch")
        self._judge(line, words, text)
        if self._positions.rules:
            own = any(rule.retract and rule.pattern.fullmatch(text) for rule in self.list.blocks)
            self.problems += self._positions.take(line, text, retract=own)
        self._blocks += 1
        self._note(line, words)
        return line

    def _judge(self, line: Line, words: list[str], text: str) -> None:
        """Look at the words of a block and their places, and take over the states that they change."""
        if self._start(line.number, text):
            return
        rules = self._rules.of(words, text)
        before = self._next_block(text, line.number)
        self._said |= set(words)
        self.problems += self._rules.problems(line, words, rules)
        self._places(line.number, words, rules, before)
        self._states(line.number, words, rules)
        changes_tool = any(rule is not None and rule.compared and (rule.high or rule.after) for rule in rules)
        self._unframe(line.number, self._frame.block(words, rules, changes_tool=changes_tool))

    def _users_block(self, line: Line, words: list[str], text: str) -> Line:
        """Look at a block that the user wants where it stands.

        What it establishes counts. With a word that is not on the list, not in its place, or that the CL file would
        have to ask for, the block is taken on trust, and the reader gets no more of it than is understood.
        """
        before = len(self.problems)
        self._judge(line, words, text)
        rules = self._rules.of(words, text)
        whole = len(rules) == len(words)
        if line.skipped or len(self.problems) > before or any(rule is not None and rule.compared for rule in rules):
            del self.problems[before:]
            self.trusted.append((line.number, text))
            if line.skipped or not all(word in self._accepted or _BESIDE_MOTION.fullmatch(word) for word in words):
                self.unsure.append((line.number, text))
            if whole:
                kept = [rule is not None and not rule.compared for rule in rules]
                if "tool" in self._left:  # stops for a tool are told by it
                    kept = [keep or word.name == "T" for keep, word in zip(kept, line.words, strict=True)]
                line = replace(line, words=tuple(word for word, keep in zip(line.words, kept, strict=True) if keep))
        self._blocks += 1
        self._note(line, [said(word) for word in line.words])
        return line

    def _note(self, line: Line, words: list[str]) -> None:
        """Keep the motion of a block on its own."""
        self._angles |= {word.name: word.value for word in line.words if word.name in _ROTARY}
        self._frame.angles(self._angles)
        self._unframe(line.number, self._frame.turns({word.name for word in line.words}))
        codes = [word.value for word in line.words if word.name == "G" and word.value in (0.0, 1.0, 2.0, 3.0)]
        self._code = codes[-1] if codes else self._code
        rules = [rule for rule in self._rules.of(words, text_of(words)) if rule is not None]
        moves, drills = any(rule.moves for rule in rules), any(rule.cycle for rule in rules)
        if moves or (not self._rules.stands(words) and any(word.name in _LINEAR for word in line.words)):
            at = {word.name: word.value for word in line.words}
            self._unframe(line.number, self._frame.moved(at, drills=drills))
            self._moved(line.number, 1.0 if moves else self._code, moves or "Z" in at)

    # the frame of the program

    def _start(self, number: int, text: str) -> bool:
        """Whether a block is one that begins or ends the program, where it belongs."""
        if self._blocks == 0 and self.list.header is not None and self.list.header.fullmatch(text):
            return True
        if self._begun < len(self.list.begin):
            wanted = self.list.begin[self._begun :]
            place = next((k for k, pattern in enumerate(wanted) if pattern.fullmatch(text)), None)
            if place != 0:
                self._unframed(NOT_LISTED, number, f"the program must begin with {shown(wanted[0])}")
            if place is None:
                self._begun = len(self.list.begin)
            else:
                self._opening = self._opening or text
                self._begun += place + 1
                return True
        if any(pattern.fullmatch(text) for pattern in self.list.end):
            self._tail.append((number, text))
            return True
        for line, ending in self._tail:
            self._unframed(NOT_LISTED, line, f"{ending} ends the program, and more follows")
        self._tail = []
        return False

    def _end(self) -> None:
        """Look at what holds when all is read."""
        self.problems += self._by_tool or []
        texts = [text for _, text in self._tail]
        whole = len(texts) == len(self.list.end) and all(
            pattern.fullmatch(text) for pattern, text in zip(self.list.end, texts, strict=True)
        )
        if not whole:
            wanted = ", ".join(map(shown, self.list.end))
            self._unframed(
                NOT_LISTED, self._tail[0][0] if self._tail else self._line, f"the program must end with {wanted}, once"
            )
        elif self._opening.partition(" ")[2] != texts[-1].partition(" ")[2]:
            self._unframed(NOT_LISTED, self._tail[-1][0], f"{texts[-1]} ends what {self._opening} began")
        last = self._tail[0][0] if self._tail else self._line
        off = {rule.state for rule in self.list.words if rule.off}
        for state in sorted(off & self._state.keys()):
            word, line = self._state[state]
            if not self._is_off(state, word):
                self._unframed(NOT_ESTABLISHED, last, f"{state}: {word} of line {line} still holds at the end")
        if not self._high and any(rule.high for rule in self.list.words if not shadowed(self.list, rule)):
            self._unframed(NOT_ESTABLISHED, last, "the tool is not retracted at the end")
        self._unframe(last, self._frame.end())

    def _is_off(self, state: str, word: str) -> bool:
        return any(rule.state == state and rule.off and rule.pattern.fullmatch(word) for rule in self.list.words)

    # the words of a block

    def _places(self, number: int, words: list[str], rules: list[WordRule | None], before: str) -> None:
        """Complain of words that are not in their place in the program."""
        for k, rule in enumerate(rules):
            if rule is None:
                continue
            word = words[k] if len(rules) == len(words) else text_of(words)
            if rule.after is not None:
                if not any(rule.after.fullmatch(said_before) for said_before in self._said):
                    self._wrong(NOT_LISTED, number, f"{word} without {shown(rule.after)} before it")
                self._said = {told for told in self._said if not rule.after.fullmatch(told)}
            if rule.behind is not None and not rule.behind.fullmatch(before):
                self._wrong(NOT_LISTED, number, f"{word} does not follow what it belongs to")
            if rule.cycle:
                self._by_tool = None
            if rule.then is not None:
                self._then = (rule, number)
            if rule.zero and (not self._angles or self._positions.away(self._angles)):
                self._unframed(NOT_LISTED, number, f"{word} without the rotary axes at zero before it")
            if rule.high and not self._high:
                self._unframed(NOT_LISTED, number, f"{word} without a retract before it")
            if rule.turns:
                self._angles = {}
            if rule.retract:
                self._retract, self._high, self._above = number, True, True
            if rule.after is not None or word.startswith("TOOL CALL "):
                self._retract = 0
            if rule.after is not None or _TOOL_CALL.match(word):
                self._change_tool(number, word)
            if _SPINDLE.fullmatch(word):
                self._started, self._stopped = word != "M5", None
            if rule.outside and (holding := self._holding()):
                self._wrong(NOT_LISTED, number, f"{word} under {holding}")

    def _change_tool(self, number: int, word: str) -> None:
        """Look at what must not be where another tool is taken."""
        if holding := self._holding():
            self._unframed(NOT_LISTED, number, f"{word} under {holding}")
        if self._started:
            self._started, self._stopped = False, (word, number)

    def _spindle_at_motion(self) -> None:
        """Look whether the spindle that was started still turns where the tool moves."""
        if self._stopped is not None:
            word, number = self._stopped
            self._wrong(NOT_LISTED, number, f"{word} stops the spindle that was started before it")
        self._started, self._stopped = False, None

    def _holding(self) -> str:
        """Word in force that must be switched off before the tool is changed; empty for none."""
        held = ((rule, self._state.get(rule.state, ("", 0))[0]) for rule in self.list.words if rule.ends)
        return next((word for rule, word in held if rule.pattern.fullmatch(word)), "")

    def _next_block(self, text: str, number: int) -> str:
        """Look at whether the block before wanted this one; return it."""
        if self._then is not None:
            rule, line = self._then
            if rule.then is not None and not rule.then.fullmatch(text):
                self._wrong(NOT_LISTED, line, f"{shown(rule.pattern)} without {shown(rule.then)} after it")
            self._then = None
        before, self._before = self._before, text
        return before

    # states

    def _states(self, number: int, words: list[str], rules: list[WordRule | None]) -> None:
        """Take over what a block changes."""
        if len(rules) != len(words):
            words, rules = [text_of(words)], rules[:1]
        for word, rule in zip(words, rules, strict=True):
            if rule is not None and rule.drops in self._state:
                self._dropped[rule.drops] = word
            if rule is None or not rule.state:
                continue
            beside = [
                other
                for other, theirs in zip(words, rules, strict=True)
                if theirs and theirs.needs and theirs.needs.fullmatch(word) and not (theirs.compared or theirs.varies)
            ]
            self._state[rule.state] = (" ".join([word, *beside]), number)
            self._changed = True
            self._dropped.pop(rule.state, None)
            if not rule.off and rule.state in self._approach:  # GOHOME: the same tool comes back as a new one does
                self._retract = 0
            if rule.before and self._first is not None and word != self._first.get(rule.state):
                self._arc = (word, number)

    def _waiting(self) -> set[str]:
        return {state for state in self._late & self._state.keys() if self._is_off(state, self._state[state][0])}

    def _moved(self, number: int, code: float, down: bool) -> None:
        """Look at what holds where the tool moves, Z among its axes or not."""
        self._spindle_at_motion()
        late = self._waiting() if self._above and code == 0.0 and not down else set()
        self._above &= code == 0.0 and not down
        self._changed, self._high = bool(late), False
        for state, word in self._dropped.items():
            if state not in self._left:
                self._unframed(NOT_ESTABLISHED, number, f"{state}: it must come after {word}, which deselects it")
        self._dropped = {}
        if self._first is None:
            self._first, self._deferred = {state: word for state, (word, _) in self._state.items()}, late
            for state, rules in self.list.heads.items():
                spoken = {word for word in self._said if any(rule.pattern.fullmatch(word) for rule in rules)}
                if not spoken and state not in self._left:
                    wanted = " or ".join(shown(rule.pattern) for rule in rules)
                    self._unframed(NOT_ESTABLISHED, number, f"{state}: {wanted} must come before the first motion")
            self._retract, self._arc = 0, None
            return
        for state in self._deferred - late:
            self._first[state] = self._state[state][0]
        self._deferred &= late
        if self._retract and not late:
            self._wrong(NOT_LISTED, self._retract, GONE_ON)
            self._retract = 0
        if self._arc is not None:
            word, line = self._arc
            if code not in (2.0, 3.0):
                self._wrong(NOT_LISTED, line, f"{word} where no arc follows")
            self._arc = None
        following = {rule.state for rule in self.list.words if rule.follows}
        for state, (word, line) in self._state.items():
            if state in following | late or word == self._first.get(state) or (state, line) in self._complained:
                continue
            self._complained.add((state, line))
            before = self._first.get(state, "nothing")
            text = f"{state}: {word} where {before} holds for the whole program"
            if any(rule.state == state and rule.tool and rule.pattern.fullmatch(word) for rule in self.list.words):
                if self._by_tool is not None:
                    self._by_tool.append(Problem(NOT_LISTED, 0, line, text))
            else:
                self._wrong(NOT_LISTED, line, text)
