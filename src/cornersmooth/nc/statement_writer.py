"""CL statements as NC words: what the program says between its moves.

What a machinist reads becomes a comment without its CL word (PPRINT, REMARK, TPRINT and the like); what describes the
file or the tool becomes a comment as it stands; PAINT only tells the CAM screen what to draw and is left out. Whatever
is not understood becomes a comment and a counted warning, never an NC word by guess; `statements.asked` decides that.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from cornersmooth.geometry.arcs import FIRST_PLANE
from cornersmooth.model import FeedMode, Move, Program, Statement
from cornersmooth.nc.control import Blocks, Words
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings, refused
from cornersmooth.nc.modals import Modals
from cornersmooth.nc.program_frame import comment_lines
from cornersmooth.nc.statement_args import (
    GEARS,
    TOOL_WORDS,
    Orders,
    ahead_of_tools,
    cutting_unit,
    ends,
    milliseconds,
    numbers_of,
    spoken_text,
    tool_loads,
    whole_number,
    words_of,
)
from cornersmooth.statements.asked import Asking
from cornersmooth.text import format_number

#: words whose text is for the machinist: comments without the word
_TEXT_WORDS = frozenset("$$ PPRINT REMARK TPRINT LETTER DISPLY".split())
_PLANES = {"XYPLAN", "ZXPLAN", "YZPLAN"}  #: words for planes
_SILENT = frozenset({"END-OF-PATH", "FINI", "REWIND"})  #: words that say nothing beside what the text shows anyway


@dataclass
class StatementWriter:
    """Turns statements into NC blocks, remembering what the machine would."""

    form: Form
    program: Program
    findings: Findings  #: takes what is noticed
    modals: Modals  #: what the control remembers
    orders: Orders
    comments: bool = True  #: whether comments are written
    changed: bool = False  #: a tool change, or the way home, left the machine elsewhere
    direction: str = "clockwise"  #: field of the words for the way in which the spindle turns, as it was named last
    words: Words = field(init=False)
    _loads: dict[int, tuple[int, int]] = field(init=False)  #: tool and length register of statements, by identity
    _ahead_of_tools: frozenset[int] = field(init=False)
    _unknown: frozenset[int] = field(init=False)  #: statements that are not understood, by identity

    def __post_init__(self) -> None:
        self.words = self.form.table.words
        self._loads = {id(statement): tool for statement, tool in tool_loads(self.program)}
        self._ahead_of_tools = ahead_of_tools(self.program)
        self._unknown = frozenset(map(id, Asking.of(self.program).in_doubt))

    def blocks(self, statement: Statement) -> list[str]:
        """NC blocks of one statement, without line ends."""
        word, known = statement.word, id(statement) not in self._unknown
        handler = _HANDLERS.get(word)
        written = None if handler is None else handler(self, statement)
        if word in _TEXT_WORDS:
            return self.comment(spoken_text(statement))
        if word in _SILENT or (word == "CUTCOM" and written is None and known):  # CUTCOM/ON before the side
            return []
        if written is None:
            if (handler is not None and word != "TOOLNO") or not known:  # that describes what another word loads
                self.findings.note("CS310", statement.line, word=word)
            return self.comment(statement.text or word)
        # words that no block says: gears, lengths, holders
        words = set(words_of(statement))
        rest = word in TOOL_WORDS and any(isinstance(value, str) for value in statement.args[1:])
        rest = rest and not words <= {"TOOL", "ADJUST", "OSETNO"}
        return [*written, *(self.comment(statement.text) if rest or (word == "SPINDL" and words & GEARS) else ())]

    def comment(self, text: str) -> list[str]:
        """Comments that hold a text."""
        return self.warning_comment(text) if self.comments else []

    def warning_comment(self, text: str) -> list[str]:
        """Comments that are written in any case."""
        layout = self.form.table.layout
        return comment_lines(text, layout.comment, layout.comment_orders)

    def load(self, statement: Statement) -> list[str] | None:
        """LOADTL/n, LOAD/TOOL,n[,ADJUST,m], TURRET/n[,OSETNO,m]."""
        if id(statement) not in self._loads:
            return None
        number, offset = self._loads[id(statement)]
        if (number, offset) == (self.modals.tool, self.modals.offset):  # CATIA loads a tool twice
            return self.comment(statement.text)
        blocks = self.modals.end_tool(statement.line, another=self.modals.tool not in (None, number))
        if number != self.modals.tool:
            blocks += [block for z in (False, True) for block in self.modals.to_position("tool_change", z=z)]
            blocks += self._tool_change(number, statement)
        self.changed = True
        self.modals.tool, self.modals.offset = number, offset
        return blocks

    def _tool_change(self, number: int, statement: Statement) -> list[str]:
        """Blocks of a tool change; a speed in them is the first that the tool is given, or else what holds."""
        order, loads = self.program.statements, self._loads
        behind = order[next(k for k, one in enumerate(order) if one is statement) + 1 :]
        others = (k for k, one in enumerate(behind) if loads.get(id(one), loads[id(statement)]) != loads[id(statement)])
        end = next(others, None)
        between, after = behind[:end], None if end is None else loads[id(behind[end])][0]
        selected = after in (None, number) or any(one.word == "SELECT" for one in between)
        staged = self.words.tool_select if self.words.stage_tool and not selected else ()
        speed = None
        if any("{speed}" in block for block in self.words.tool_change):
            orders = (self.orders.get(id(one)) or ("", None) for one in between)
            speed = next((speed for _, speed in orders if speed), self.modals.speed)
            if not speed:
                raise refused("CS354", self.program, statement.line, tool=number)
        blocks = [block.format(tool=number, speed=self._speed_text(speed or 0.0)) for block in self.words.tool_change]
        return blocks + [block.format(tool=after) for block in staged]

    def _speed_text(self, speed: float) -> str:
        return format_number(speed, self.form.table.digits.speed, trim=True).rstrip(".")

    def go_home(self, statement: Statement) -> list[str]:
        """GOHOME without coordinates: to the height of the retract."""
        blocks = self.modals.go_home()
        self.changed |= self.modals.can_rewind
        self.findings.note("CS332b" if self.modals.can_rewind else "CS332", statement.line)
        return [*self.comment(statement.text), *blocks]

    def select(self, statement: Statement) -> list[str] | None:
        """SELECT/TOOL,n: brings the next tool near."""
        number = whole_number(numbers_of(statement))
        if number is None or words_of(statement) != ["TOOL"]:
            return None
        if number == self.modals.tool:
            return self.comment(statement.text)
        blocks = [block.format(tool=number) for block in self.words.tool_select]
        return blocks or self.comment(statement.text)

    def spindle(self, statement: Statement) -> list[str] | None:
        """SPINDL in every order of its words."""
        order = self.orders[id(statement)]
        if order is None or (order[0] == "ORIENT" and not self.words.spindle_orient):
            return None
        turn, speed = order
        if turn in ("ORIENT", "OFF"):
            self.modals.switch("spindle", ())
            return list(self.words.spindle_orient if turn == "ORIENT" else self.words.spindle_off) or None
        if speed is not None and (unit := cutting_unit(statement)):
            self.findings.note("CS322", statement.line, unit=unit)
        self.direction = {"CLW": "clockwise", "CCLW": "counterclockwise"}.get(turn, self.direction)
        direction = getattr(self.words, self.direction)
        if speed is None and self.modals.speed is None:
            self.findings.note("CS335", statement.line)
            self.modals.switch("spindle", (direction,))
            return [direction]
        self.modals.speed = self.modals.speed if speed is None else speed
        digits = self._speed_text(self.modals.speed or 0.0)
        turning = tuple(block.format(speed=digits, direction=direction) for block in self.words.spindle_speed)
        if not self.modals["spindle"] and id(statement) in self._ahead_of_tools:
            return self.modals.later("spindle", turning)
        self.modals.switch("spindle", turning)
        if speed is None:
            return [direction]
        before = self.modals.pause() if self.words.speed_without_tip_control else []
        self.changed |= bool(before) and self.modals["high"]
        return [*before, *turning]

    def coolant(self, statement: Statement) -> list[str] | None:
        """COOLNT/ON, OFF, FLOOD, MIST and what else the control has; a bare COOLNT means ON."""
        words = words_of(statement)
        if not words and "/" not in statement.text:
            words = ["ON"]
        kinds = [word for word in words if word != "ON"] or words[:1]
        if numbers_of(statement) or len(kinds) != 1:
            return None
        if kinds[0] in ("OFF", "NOMORE"):
            off = self.modals.coolant_end()
            self.modals.switch("coolant", ())
            return list(off) or None
        blocks = self.words.coolant.get(kinds[0])
        if blocks is None:
            return None
        if not self.modals["coolant"] and id(statement) in self._ahead_of_tools:
            return self.modals.later("coolant", blocks)
        return self.modals.flow(blocks)

    def halt(self, blocks: Blocks) -> list[str] | None:
        """STOP and OPSTOP; None where the control has no words for it."""
        if blocks:
            self.modals.halt()
        return list(blocks) or None

    def delay(self, statement: Statement) -> list[str] | None:
        """DELAY/seconds, DELAY/DWELL,seconds (ISO 4343 5.13) and DELAY/n,REV."""
        numbers, words = numbers_of(statement), words_of(statement)
        if len(numbers) != 1 or words not in ([], ["DWELL"], ["REV"]):
            return None
        time = milliseconds(numbers[0], "REV" in words, self.modals.speed)
        if time is None:
            return None
        per_turn = self.modals["feed_mode"] == FeedMode.PER_REVOLUTION
        return self.dwell(time, statement.line, per_turn=per_turn) if self.words.dwell else None

    def dwell(self, time: int, line: int, *, per_turn: bool) -> list[str]:
        """Blocks that wait for so many milliseconds, for a line of the CL file; under feed per revolution or not."""
        seconds = format_number(time / 1000.0, 3, trim=True)
        if time and per_turn and self.words.dwell_turns:
            self.findings.note("CS383", line, where=self.words.dwell_turns)
        return [block.format(milliseconds=time, seconds=seconds) for block in self.words.dwell] if time else []

    def compensation(self, statement: Statement) -> list[str] | None:
        """CUTCOM/LEFT|RIGHT[,XYPLAN][,n] and CUTCOM/OFF; CS336 for another plane, and a control that is given none."""
        if ends(statement):
            return (self.modals.set(compensation=()) or list(self.words.compensation_off)) or None
        names, numbers, words = words_of(statement), numbers_of(statement), self.words
        if not words.compensation_left and names[:1] in (["LEFT"], ["RIGHT"]):
            raise refused("CS336", self.program, statement.line, control=self.form.control)
        side = {"LEFT": words.compensation_left, "RIGHT": words.compensation_right}.get((names or [""])[0])
        register = whole_number(numbers or [float(self.modals.offset)])
        if not side or len(names) > 2 or not set(names[1:]) <= _PLANES or register is None:
            return None
        if names[1:] not in ([], ["XYPLAN"]):
            raise refused("CS336b", self.program, statement.line, plane=names[1])
        entry = self.program.tip[max(statement.pose - 1, 0) : statement.pose + 1, :2]
        length = math.dist(*entry) if len(entry) == 2 else math.inf
        if words.compensation_entry and not length:
            raise refused("CS344", self.program, statement.line)
        _, diameter = self.orders[id(statement)] or ("", None)
        if length <= (diameter or 0.0) / 2.0:
            self.findings.note("CS345", statement.line, length=length)
        tip = self.modals.mode is not self.form.upright and self.form.orientation not in ("fixed", "machine")
        also = "it may be used with tool tip control (--cycles native does without, along Z), and that " if tip else ""
        self.findings.note("CS319", statement.line, also=also)
        change = self.modals.set(plane=FIRST_PLANE)
        begun = self.modals.now["compensation"] = tuple(block.format(register=register) for block in side)
        return [*change, *begun]

    def end(self, statement: Statement) -> list[str]:
        """END: the end of the text; in the middle of the path a stop."""
        if not (self.program.kind[statement.pose :] != Move.FROM).any():
            return []
        self.findings.note("CS318", statement.line)
        return [*self.comment(statement.text), *(self.halt(self.words.stop) or ())]

    def insert(self, statement: Statement) -> list[str]:
        """INSERT: text for the NC file; as a comment, since its meaning is not known."""
        text = spoken_text(statement)
        if id(statement) in self._unknown:
            self.findings.note("CS320", statement.line)
        return self.comment(text)

    def auxiliary(self, statement: Statement) -> list[str] | None:
        """AUXFUN/n: M code n, unless it ends the program or calls another."""
        number = whole_number(numbers_of(statement))
        if number is None or words_of(statement) or number in (2, 6, 30, 98, 99):
            return None
        blocks = (f"M{number}",)
        if any(blocks[0] in pair for pair in self.modals.clamps):
            self.findings.note("CS359", statement.line, number=number)
            return self.comment(statement.text)
        if number in (3, 4, 5):
            self.modals.switch("spindle", () if number == 5 else blocks)
        off = {self.words.coolant.get("OFF"), *self.words.coolant_off.values()}
        if blocks not in off | set(self.words.coolant.values()):
            return list(blocks)
        return self.modals.flow(blocks, off=blocks in off)


Handler = Callable[[StatementWriter, Statement], list[str] | None]
_HANDLERS: dict[str, Handler] = {
    **dict.fromkeys(TOOL_WORDS, StatementWriter.load),
    "TOOLNO": StatementWriter.load,
    "SELECT": StatementWriter.select,
    "CUTTER": lambda writer, statement: writer.comment(statement.text),
    "TLDATA": lambda writer, statement: writer.comment(statement.text),
    "SPINDL": StatementWriter.spindle,
    "COOLNT": StatementWriter.coolant,
    "DELAY": StatementWriter.delay,
    "CUTCOM": StatementWriter.compensation,
    "CYCLE": lambda writer, statement: [] if ends(statement) else writer.comment(statement.text),  # see `Drillings`
    "STOP": lambda writer, statement: writer.halt(writer.words.stop),
    "OPSTOP": lambda writer, statement: writer.halt(writer.words.optional_stop),
    "GOHOME": StatementWriter.go_home,
    "END": StatementWriter.end,
    "INSERT": StatementWriter.insert,
    "AUXFUN": StatementWriter.auxiliary,
}
