"""Statements: tool changes, spindle, coolant, stops, dwells and compensation, in order and between the right poses."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from cornersmooth.model import Statement
from cornersmooth.verify.ncprogram import Event, Problem

#: decimals of a spindle speed that count
SPEED_DECIMALS = 3

#: M words without an effect that the CL data speak of
_KNOWN_M = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 30}


@dataclass(frozen=True, slots=True)
class Token:
    """One change of state, or one action.

    Parameters
    ----------
    kind : str
        ``"tool"``, ``"spindle"``, ``"speed"``, ``"coolant"``, ``"compensation"``, ``"stop"``, ``"dwell"``, ``"end"``.
    value : float
    place : float, mm
        Path length from the start of the original motion.
    line : int
        CL or NC line.
    """

    kind: str
    value: float
    place: float
    line: int


_NAMES = {
    "tool": ("tool T{:g}", 551),
    "spindle": ("spindle M{:g}", 552),
    "speed": ("speed S{:g}", 552),
    "coolant": ("coolant M{:g}", 553),
    "compensation": ("cutter compensation G{:g}", 554),
    "stop": ("stop M{:g}", 555),
    "dwell": ("dwell of {:g} ms", 556),
    "end": ("end of program M{:g}", 557),
}

#: what holds before anything is said; repeating it changes nothing
_AT_START = {"spindle": 5.0, "coolant": 9.0, "compensation": 40.0}

_STATES = ("tool", "spindle", "speed", "coolant", "compensation")


def asked(statements: Iterable[Statement], places: Sequence[float], end: float) -> list[Token]:
    """What the CL statements ask for; `places` are where they stand, `end` the length of the path."""
    tokens: list[Token] = []
    running = 3.0

    for statement, place in zip(statements, places, strict=True):
        numbers = [value for value in statement.args if isinstance(value, float)]
        words = [value for value in statement.args if isinstance(value, str) and value]

        def say(kind: str, value: float, place: float = place, line: int = statement.line) -> None:
            tokens.append(Token(kind, value, place, line))

        match statement.word:
            case "LOADTL" | "LOAD" | "TURRET":
                if (
                    (statement.word != "LOAD" or words[:1] == ["TOOL"])
                    and numbers
                    and numbers[0] == int(numbers[0]) >= 0
                ):
                    say("tool", numbers[0])
            case "SPINDL":
                if "OFF" in words:
                    say("spindle", 5.0)
                elif set(words) <= {"RPM", "CLW", "CCLW", "ON"} and len(numbers) <= 1:
                    if "CLW" in words or "CCLW" in words:
                        running = 4.0 if "CCLW" in words else 3.0
                    if numbers:
                        say("speed", round(numbers[0], SPEED_DECIMALS))
                    say("spindle", running)
            case "COOLNT":
                code = {"ON": 8.0, "FLOOD": 8.0, "MIST": 7.0, "OFF": 9.0}.get((words or ["ON"])[0])
                if code is not None:
                    say("coolant", code)
            case "CUTCOM":
                code = {"LEFT": 41.0, "RIGHT": 42.0, "OFF": 40.0}.get((words or [""])[0])
                if code is not None:
                    say("compensation", code)
            case "STOP":
                say("stop", 0.0)
            case "OPSTOP":
                say("stop", 1.0)
            case "DELAY":
                if len(numbers) == 1 and numbers[0] >= 0 and not words:
                    say("dwell", round(1000.0 * numbers[0]))
            case _:
                pass
    tokens.append(Token("end", 30.0, end, statements_end_line(statements)))
    return tokens


def statements_end_line(statements: Iterable[Statement]) -> int:
    """CL line of the end of the program, 0 where the file does not say."""
    return next((item.line for item in statements if item.word in ("FINI", "END")), 0)


def said(events: Iterable[Event], places: Sequence[float]) -> tuple[list[Token], list[Problem]]:
    """What the words of the NC text do; and words that fit nothing, or an H or D that is not the tool's."""
    tokens: list[Token] = []
    problems: list[Problem] = []
    chosen = tool = None
    for event, place in zip(events, places, strict=True):
        value = event.value

        def say(kind: str, value: float, place: float = place, line: int = event.line) -> None:
            tokens.append(Token(kind, value, place, line))

        match event.letter:
            case "T":
                chosen = value
            case "S":
                say("speed", round(value, SPEED_DECIMALS))
            case "M":
                if value == 6 and chosen is not None:
                    tool = chosen
                    say("tool", tool)
                elif value in (3, 4, 5):
                    say("spindle", value)
                elif value in (7, 8, 9):
                    say("coolant", value)
                elif value in (0, 1):
                    say("stop", value)
                elif value in (2, 30):
                    say("end", 30.0)
                elif value not in _KNOWN_M:
                    text = f"{event.text} is nothing that the CL file asks for"
                    problems.append(Problem("CS558", 0, event.line, text))
            case "G":
                if value == 4:
                    say("dwell", round(float(event.text)))
                elif value in (40, 41, 42):
                    say("compensation", value)
            case "H" | "D":
                if value != (1 if tool is None else tool):
                    text = f"{event.text} does not belong to tool T{1 if tool is None else tool:g}"
                    problems.append(Problem("CS559", 0, event.line, text))
            case _:
                pass
    return tokens, problems


def compare(asked_for: list[Token], found: list[Token], room: float) -> list[Problem]:
    """Compare the two, kind by kind.

    Parameters
    ----------
    asked_for, found : list of Token
    room : float, mm
        How far apart along the path the places of the same token may be.
    """
    problems: list[Problem] = []
    for kind, (name, code) in _NAMES.items():
        theirs, ours = _effective(asked_for, kind), _effective(found, kind)
        matcher = difflib.SequenceMatcher(
            None, [token.value for token in theirs], [token.value for token in ours], autojunk=False
        )
        for tag, i0, i1, j0, j1 in matcher.get_opcodes():
            both = min(i1 - i0, j1 - j0)
            for i, j in zip(range(i0, i0 + both), range(j0, j0 + both), strict=True):
                label = name.format(theirs[i].value)
                if tag != "equal":
                    text = f"{name.format(ours[j].value)} where the CL file asks for {label}"
                elif abs(theirs[i].place - ours[j].place) > room:
                    text = f"{label} is {ours[j].place - theirs[i].place:+.3f} mm of path away from its place"
                else:
                    continue
                problems.append(Problem(f"CS{code}", theirs[i].line, ours[j].line, text))
            for i in range(i0 + both, i1):
                near = ours[min(j1, len(ours) - 1)].line if ours else 0
                problems.append(
                    Problem(f"CS{code}", theirs[i].line, near, f"{name.format(theirs[i].value)} is missing")
                )
            for j in range(j0 + both, j1):
                text = f"{name.format(ours[j].value)} is nothing that the CL file asks for"
                problems.append(Problem(f"CS{code}", 0, ours[j].line, text))
    return problems


def _effective(tokens: list[Token], kind: str) -> list[Token]:
    """Tokens of one kind without those that change nothing."""
    mine = [token for token in tokens if token.kind == kind]
    if kind not in _STATES:
        return mine
    kept: list[Token] = []
    state = _AT_START.get(kind)
    for token in mine:
        if token.value != state:
            kept.append(token)
            state = token.value
    return kept
