"""What the CL file asks for: tool changes, spindle, coolant, stops, dwells and compensation as tokens."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Self

import numpy as np

from cornersmooth.control.state import is_off
from cornersmooth.control.table import Means
from cornersmooth.model import Ints, Move, Program, Statement
from cornersmooth.statements import work_offset_of
from cornersmooth.statements.tokens import SPEED_DECIMALS, Token, of_m

#: cutting speeds in mm per minute
_MM_PER_MINUTE = {"SMM": 1000.0, "SFM": 304.8}

#: words that ask for nothing, whatever is behind them. Any other word is compared, or is not understood
NOTHING = frozenset(
    # texts, names, numbers of statements
    "$$ PARTNO PPRINT REMARK LETTER TPRINT DISPLY END-OF-PATH OPNAME HEADER CSI_TOOL_PATH OPERTN ISN SEQNO "
    # screen and plotter of the CAM system
    "PAINT PLOT OVPLOT PPLOT PLABEL LPRINT DRAFT DEBUG GOUGCK PALETTE "
    # tolerances of the path as it was made, stock, name of the machine
    "INTOL OUTTOL TOLER LINTOL CSI_PATH_TOLERANCE STOCK MATERL MACHIN "
    # the shape of the tool
    "CSI_SET_FLUTE_LENGTH CSI_SET_EXTENSION_LENGTH "
    # what the reader puts into the poses, or refuses
    "UNIT UNITS MULTAX TLAXIS MSYS SYS CSYS CAMERA MCS MCSYS TRNTYP SYN CLEARP CLRSRF FINI "
    # what is compared elsewhere: cycles with the holes, the way home with the motion
    "CYCLE GOHOME".split()
) | {"TOOL PATH"}

#: texts that SolidWorks CAM writes with INSERT: tool and stock
_NOTE = re.compile(r"\s*(\[HOLDER=[^\]]*\]|[\d.]+ ?(MM|IN|INCH)\b|STOCK SIZE\b)", re.IGNORECASE)

#: words that say that a tool, a file or a speed is for a lathe
_TURNING = {"TURN", "LATHE", "TURRET", "SETOOL", "GROOVE"}

#: words of SPINDL for gears
_GEARS = {"RANGE", "HIGH", "LOW", "MEDIUM"}

#: so many statements are named, and so many characters of each
_NAMED, _LONGEST = 3, 60

#: planes of cutter compensation
_PLANES = {"XYPLAN", "ZXPLAN", "YZPLAN"}

#: one word for those that ask for the same
_ALIKE = {"ON": "FLOOD", "NOMORE": "OFF"}

#: words and numbers of a statement, and itself; says whether all of it is understood
Handler = Callable[[list[str], list[float], Statement], bool]


class Asking:
    """Goes through the CL statements and notes what they ask for, and those that are not understood."""

    def __init__(self, program: Program) -> None:
        self.program = program
        self.tokens: list[Token] = []
        self.not_understood: list[Statement] = []  #: nothing is compared with them
        self.in_part: list[Statement] = []  #: what is understood of them is compared
        self.place, self.line = 0, 0
        self.running, self.speed, self.diameter = "CLW", 0.0, 0.0
        self.tool, self.offset = -1.0, 1.0
        stated = {statement.word for statement in program.statements}
        sides = [one for one in program.statements if one.word == "CUTCOM"]
        #: CUTCOM/ON right before that with a side, as Autodesk's CAMplete post writes it
        self.announcing = {
            id(one) for one, after in pairwise(sides) if one.pose == after.pose and {"LEFT", "RIGHT"} & {*after.args}
        }
        self.lathe = "TURRET" in stated  # cutting speeds are those at the part
        self.loads_alone = not stated & {"LOADTL", "LOAD", "TURRET"}
        self.handlers: dict[str, Handler] = {
            "LOADTL": self.load,
            "LOAD": self.load,
            "TURRET": self.load,
            "TOOLNO": self.toolno,
            "SELECT": self.select,
            "SPINDL": self.spindle,
            "COOLNT": self.coolant,
            "CUTCOM": self.compensation,
            "DELAY": self.delay,
            "CUTTER": self.cutter,
            "TLDATA": self.cutter,
            "AUXFUN": self.auxiliary,
            "ZERO": lambda words, numbers, statement: work_offset_of(program) is not None,  # compared with the words
            "INSERT": lambda words, numbers, statement: _NOTE.match(" ".join(words)) is not None,
            "PPWORD": lambda words, numbers, statement: (
                len(words) == len(numbers) == 1 and words[0].isalpha() and len(words[0]) > 2
            ),
            "MODE": lambda words, numbers, statement: words in (["MILL"], ["ABSOL"]) and not numbers,
            "SET": lambda words, numbers, statement: words == ["MODE", "ABSOL"] and not numbers,
            "REWIND": lambda words, numbers, statement: self.at_end(statement),
            "END": self.end,
            "STOP": self.halt,
            "OPSTOP": self.halt,
        }

    @classmethod
    def of(cls, program: Program) -> Self:
        """Go through all of them; tokens are placed by the poses that they are in front of."""
        asking = cls(program)
        for statement in program.statements:
            asking.take(statement, statement.pose)
        return asking

    @property
    def in_doubt(self) -> list[Statement]:
        """Statements that are not understood, or only in part, in their order."""
        both = {id(statement): statement for statement in (*self.not_understood, *self.in_part)}
        return sorted(both.values(), key=lambda statement: statement.line)

    @cached_property
    def moving(self) -> Ints:
        """(m,) poses that are moved to."""
        return np.flatnonzero(self.program.kind != Move.FROM)

    def take(self, statement: Statement, place: int) -> None:
        """Note one statement."""
        if statement.word in NOTHING and not turns(statement):
            return
        handler = self.handlers.get(statement.word)
        numbers = [value for value in statement.args if isinstance(value, float)]
        words = [value for value in statement.args if isinstance(value, str) and value]
        self.place, self.line = place, statement.line
        if handler is None or turns(statement) or not handler(words, numbers, statement):
            self.not_understood.append(statement)

    def say(self, kind: str, value: float | str) -> None:
        """Note a token."""
        self.tokens.append(Token(kind, value, self.place, self.line))

    def load(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Change the tool; ADJUST or OSETNO, or the last number of Autodesk's, names another length register."""
        if statement.word == "LOAD" and words[:1] != ["TOOL"]:
            return False
        registers = [_behind(statement, word) for word in ("ADJUST", "OSETNO")]
        before = ("", *statement.args)
        numbers = [  # what stands behind such a word is no tool
            value
            for k, value in enumerate(statement.args)
            if isinstance(value, float) and before[k] not in ("ADJUST", "OSETNO", "LENGTH")
        ]
        rest = set(words) - {"TOOL", "ADJUST", "OSETNO", "LENGTH"}
        if not numbers and words and words[0][:1] == "T" and words[0][1:].isdigit():
            numbers = [float(words[0][1:])]
            rest.discard(words[0])
        if not numbers or not _whole(numbers[0]):
            return False
        if len(numbers) == 4 and not numbers[1]:  # LOADTL/tool,0,length,register of Autodesk's ISO 4343 post
            registers.append(numbers[3])
            numbers = numbers[:1]
        offset = next((number for number in registers if number is not None), numbers[0])
        self.tool, self.offset = numbers[0], offset if _whole(offset) else numbers[0]
        self.say("tool", self.tool)
        self.say("offset", self.offset)
        # CATIA: LOADTL/tool,correction, where 1 is the first one of the tool (NC Manufacturing, NC_COMPENSATION)
        first = numbers[1:] in ([], [1.0], numbers[:1])
        return _whole(offset) and (statement.word == "TOOLNO" or (first and not rest))

    def toolno(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Describe the tool that another statement loads; load it where there is no such statement."""
        return not self.loads_alone or self.load(words, numbers, statement)

    def select(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Bring the next tool near."""
        if words != ["TOOL"] or len(numbers) != 1 or not _whole(numbers[0]):
            return False
        if numbers[0] != self.tool:
            self.say("next tool", numbers[0])
        return True

    def spindle(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Start, stop or orient the spindle, at revolutions or at a cutting speed of a cutter whose diameter is known.

        The gear of RANGE is in no program; MAXRPM is kept where the speed is not higher.
        """
        limits = {word: _behind(statement, word) for word in ("RANGE", "MAXRPM") if word in words}
        for limit in limits.values():
            if limit is not None:
                numbers.remove(limit)
        if "RANGE" in words:
            self.in_part.append(statement)
        chosen = set(words) - {"MAXRPM"} - (_GEARS if "RANGE" in words else set())
        if len(numbers) > 1 or any(number < 0 for number in numbers):
            return False
        if chosen in ({"LOCK"}, {"ORIENT"}) and numbers in ([], [0.0]):
            self.say("spindle", "ORIENT")
            return True
        turning = chosen <= {"RPM", "CLW", "CCLW", "ON", "SFM", "SMM"} and not {"CLW", "CCLW"} <= chosen
        if chosen in ({"OFF"}, {"NOMORE"}) or (turning and numbers == [0.0]):
            self.say("spindle", "OFF")
            return True
        units = chosen & {"RPM", "SFM", "SMM"}
        if not turning or len(units) > 1:
            return False
        speed = numbers[0] if numbers else None
        cutting = next((_MM_PER_MINUTE[word] for word in words if word in _MM_PER_MINUTE), None)
        if cutting is not None and speed is not None:
            if not self.diameter > 0 or self.lathe:
                return False
            speed = float(round(speed * cutting / (math.pi * self.diameter)))
        if speed is not None and speed > (limits.get("MAXRPM") or math.inf):
            return False
        if {"CLW", "CCLW"} & chosen:
            self.running = "CCLW" if "CCLW" in chosen else "CLW"
        if speed is not None:
            self.speed = speed
            self.say("speed", round(speed, SPEED_DECIMALS))
        self.say("spindle", self.running)
        return True

    def coolant(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Coolant on, of a kind, or off."""
        if not words and not numbers and "/" in statement.text:  # an empty list says nothing
            return True
        words = words or ["ON"]
        kinds = [word for word in words if word != "ON"] or ["ON"]
        if len(kinds) > 1 or numbers:
            return False
        self.say("coolant", _ALIKE.get(kinds[0], kinds[0]))
        return True

    def compensation(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Cutter compensation left, right or off."""
        if words == ["ON"] and not numbers and id(statement) in self.announcing:
            return True
        side = _ALIKE.get(words[0], words[0]) if words else ""
        register = (numbers or [self.offset])[0]
        if (
            side not in ("LEFT", "RIGHT", "OFF")
            or not set(words[1:]) <= _PLANES
            or len(numbers) > 1
            or not _whole(register)
        ):
            return False
        self.say("compensation", side)
        if side != "OFF":
            self.say("register", register)
        return True

    def delay(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Wait for seconds or revolutions."""
        if len(numbers) != 1 or numbers[0] < 0 or words not in ([], ["DWELL"], ["REV"]):
            return False
        turns = words == ["REV"]
        if turns and not self.speed:
            return False
        seconds = numbers[0] * (60.0 / self.speed if turns else 1.0)
        if seconds:
            self.say("dwell", max(1, round(1000.0 * seconds)))
        return True

    def cutter(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """Keep the diameter, for cutting speeds; of the shape of the tool the program says nothing."""
        mill = statement.word == "CUTTER" or {"MILL", "DRILL"} & set(words)
        self.diameter = numbers[0] * self.program.mm_per_unit if mill and numbers else 0.0
        return True

    def auxiliary(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """An M word by its number, unless it would end or change more than a word may."""
        if len(numbers) != 1 or words or not _whole(numbers[0]) or numbers[0] in (2, 6, 30, 98, 99):
            return False
        self.say("auxiliary", numbers[0])
        return True

    def halt(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """STOP or OPSTOP."""
        self.say("stop", statement.word)
        return not words and not numbers

    def at_end(self, statement: Statement) -> bool:
        """Whether nothing moves behind a statement."""
        return not len(self.moving) or statement.pose > self.moving[-1]

    def end(self, words: list[str], numbers: list[float], statement: Statement) -> bool:
        """END in the middle of the path is a stop."""
        if not self.at_end(statement):
            self.say("stop", "STOP")
        return not words and not numbers


def turns(statement: Statement) -> bool:
    """Whether a statement is one for a lathe."""
    return statement.word in ("LOAD", "LOADTL", "TURRET", "TOOLNO", "TLDATA", "MODE", "MACHIN") and not (
        _TURNING.isdisjoint(statement.args)
    )


def not_understood_text(asking: Asking) -> str:
    """Say which CL statements are not understood, and their lines; empty for none."""
    found = asking.in_doubt
    named = [f"{' '.join((one.text or one.word).split())[:_LONGEST]} in CL line {one.line}" for one in found[:_NAMED]]
    more = f" and {len(found) - _NAMED:,} more" if len(found) > _NAMED else ""
    return f"not understood: {', '.join(named)}{more}" if found else ""


def asked(asking: Asking, poses: Ints, means: Means) -> list[Token]:
    """What the CL statements ask for, and the end; each is placed by the move that it is in front of.

    Parameters
    ----------
    poses : array
        (m,) where the moves end.
    means : mapping
        What words of the control say, as of `Table.means`: it is for AUXFUN.
    """
    statements = asking.program.statements
    stated = [one.pose for one in statements]
    move = dict(zip(stated, np.searchsorted(poses, stated).tolist(), strict=True))
    tokens = [replace(one, place=move[one.place]) for one in asking.tokens]
    for k, one in enumerate(tokens):
        if one.kind == "auxiliary":
            kind, value = of_m(float(one.value), means)
            tokens[k] = replace(one, kind=kind, value="OFF" if is_off(value) else value)
    homes = {move[one.pose]: one.line for one in reversed(statements) if one.word == "GOHOME" and not one.args}
    tokens += [Token("home", "", place, line) for place, line in homes.items()]
    line = max((item.line for item in statements if item.word in ("FINI", "END")), default=0)
    return [*sorted(tokens, key=lambda token: (token.place, token.line)), Token("end", "", len(poses), line)]


def _behind(statement: Statement, word: str) -> float | None:
    """Return the number right behind a word."""
    args = statement.args
    place = args.index(word) + 1 if word in args else len(args)
    following = args[place] if place < len(args) else None
    return following if isinstance(following, float) else None


def _whole(number: float) -> bool:
    return 0 <= number < 1e9 and number == int(number)
