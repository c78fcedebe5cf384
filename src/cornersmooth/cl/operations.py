"""Operations of a CL file: stretches with a name or a tool of their own, one of them as a program, a tool for it.

An operation begins at a name (``TOOL PATH/NAME`` of NX, ``$$ OPERATION NAME : X`` of CATIA, ``$$-> FEATNO / N`` of
Creo, ``PPRINT OPERATION: X``, PARTNO where a file has several) and where a tool is loaded after a move. A stretch
without a move belongs to the operation after it, the last one to that before it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.arrays import some_poses
from cornersmooth.cl.messages import error, finding
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.model import Move, Program, Statement
from cornersmooth.statements.asked import Asking

_LOADS = ("LOADTL", "LOAD", "TURRET", "TOOLNO")
_NAMED_TEXT = re.compile(r"\s*/?\s*OPERATION(?: NAME)?\s*[:=]\s*(.*\S)", re.IGNORECASE)
_FEATURE = re.compile(r"\s*->\s*(FEATNO)\s*/\s*(\d+)", re.IGNORECASE)

#: statements whose last one holds
_LASTING = {
    **{word: word for word in ("PARTNO", "MACHIN", "MULTAX", "TOOLNO", "CYCLE", "CUTCOM")},
    **dict.fromkeys(("UNITS", "UNIT"), "units"),
    **dict.fromkeys(("LOADTL", "LOAD", "TURRET"), "tool"),
    **dict.fromkeys(("CUTTER", "TLDATA"), "cutter"),
}
_OFF = frozenset(("OFF", "NOMORE"))

#: statements that say nothing about what comes after them, or what poses hold already
_PASSING = frozenset(
    """
    $$ CSYS DELAY DISPLY END END-OF-PATH FEDRAT FINI FROM GOHOME INTOL ISN LETTER MSYS OPSTOP OUTTOL PAINT PPFUN PPRINT
    RAPID REMARK REWIND SELECT STOP SYN TLAXIS TOLER TPRINT TRNTYP
    """.split()
) | {"TOOL PATH"}


@dataclass(frozen=True)
class Operation:
    """A stretch of a CL file: its lines, poses and statements."""

    number: int  #: from 1
    name: str  #: empty where the file gives none
    tool: int | None  #: Number of the tool that it begins with; None where none is loaded.
    first_line: int
    last_line: int  #: included
    first: int
    stop: int
    first_statement: int
    last_statement: int  #: not included

    @property
    def called(self) -> str:
        """Number and name, for lists in messages."""
        return f"{self.number} {self.name}".rstrip()


def find_operations(program: Program) -> tuple[Operation, ...]:
    """Operations of a program in order; none where it goes nowhere."""
    statements = program.statements
    moved = np.concatenate(([0], np.cumsum(program.kind != Move.FROM)))
    begins, names = zip(*_begins(program, moved.tolist()), strict=True)
    found: list[Operation] = []
    poses = [*(statement.pose for statement in statements), len(program)]
    start, name, asking, taken = 0, "", Asking(program), 0
    for called, end in zip(names, (*begins[1:], len(statements)), strict=True):
        name = called or name
        first = poses[start] if start else 0
        stop = poses[end]
        if moved[stop] == moved[first]:
            continue
        first_move = int(np.searchsorted(moved, moved[first] + 1)) - 1
        for statement in statements[taken:end]:
            if statement.pose > first_move:
                break
            asking.take(statement, statement.pose)
            taken += 1
        lines = [*(one.line for one in statements[start:end]), *program.line[[first, stop - 1]].tolist()]
        tool = int(asking.tool) if asking.tool >= 0 else None
        found.append(Operation(len(found) + 1, name, tool, min(lines), max(lines), first, stop, start, end))
        start, name = end, ""
    if found:
        last_line = max((found[-1].last_line, *(one.line for one in statements[found[-1].first_statement :])))
        found[-1] = replace(found[-1], last_line=last_line, stop=len(program), last_statement=len(statements))
    return tuple(found)


def one_operation(program: Program, which: str) -> Program:
    """Take one operation alone, with the tool, spindle, coolant and cycle that hold where it begins.

    `which` is its name, in any case, or its number. Raises InputError CS168: there is no such operation, or several are
    called so; CS169: it cannot be written alone.
    """
    own = _chosen(program, find_operations(program), which)
    statements = program.statements[own.first_statement : own.last_statement]
    first_move = own.first + int(np.argmax(program.kind[own.first : own.stop] != Move.FROM))
    at_once = [statement for statement in statements if statement.pose <= first_move]
    lasting, unknown = _held(program.statements[: own.first_statement], at_once)
    if any(statement.word == "CUTCOM" for statement in lasting):
        raise error("CS169", program.source.name, own.first_line, name=own.called, how="under cutter compensation")
    if own.first and program.kind[own.first] == Move.ARC:
        how = "with an arc from the end of the operation before it"
        raise error("CS169", program.source.name, int(program.line[own.first]), name=own.called, how=how)
    findings = [one for one in program.findings if not one.line or own.first_line <= one.line <= own.last_line]
    if unknown:
        words = ", ".join(dict.fromkeys(statement.word for statement in unknown))
        findings.append(finding("CS178", unknown[0].line, len(unknown), words=words))
    return replace(
        some_poses(program, own.first, own.stop),
        statements=tuple(
            replace(statement, pose=max(statement.pose - own.first, 0)) for statement in (*lasting, *statements)
        ),
        findings=tuple(findings),
        source=replace(program.source, operation=own.number, operation_name=own.name),
    )


def with_tool(program: Program, number: int | None, spindle: tuple[float, str] | None) -> Program:
    """Return the program with a tool, and a spindle speed and direction (CLW, CCLW), of its own; None keeps its own.

    Raises SettingsError CS248: the program has such statements itself.
    """
    line = int(program.line[0]) if len(program) else 0
    given: list[Statement] = []
    if number is not None:
        _refuse_own(program, _LOADS, "loads a tool", "--tool-number")
        given.append(Statement(0, line, "LOADTL", (float(number),), f"LOADTL/{number}"))
    if spindle is not None:
        speed, direction = spindle
        _refuse_own(program, ("SPINDL",), "starts the spindle", "--spindle")
        given.append(Statement(0, line, "SPINDL", (speed, direction), f"SPINDL/{speed:g},{direction}"))
    return replace(program, statements=(*given, *program.statements)) if given else program


def _refuse_own(program: Program, words: Sequence[str], what: str, option: str) -> None:
    own = next((statement for statement in program.statements if statement.word in words), None)
    if own is not None:
        name = program.source.name
        raise SettingsError("CS248", f"the input {what} itself", f"leave out {option}", file=name, line=own.line)


def _begins(program: Program, moved: Sequence[int]) -> Iterator[tuple[int, str]]:
    """First statement of each stretch, and the name that it gives."""
    several = sum(statement.word == "PARTNO" for statement in program.statements) > 1
    at = 0
    yield 0, ""
    for number, statement in enumerate(program.statements):
        name = _name(statement, several)
        loads = statement.word in _LOADS and moved[min(statement.pose, len(program))] > at
        if name or loads:
            at = moved[min(statement.pose, len(program))]
            yield number, name


def _name(statement: Statement, several_parts: bool) -> str:
    """Name that a statement gives to what follows; empty for none."""
    text = str(statement.args[0]) if statement.args and isinstance(statement.args[0], str) else ""
    if statement.word == "TOOL PATH":
        return text.partition(",")[0].strip()
    if statement.word == "PARTNO" and several_parts:
        return text.strip(" /")
    if statement.word in ("$$", "PPRINT", "REMARK"):
        if feature := _FEATURE.match(text):
            return f"{feature[1].upper()} {feature[2]}"
        if named := _NAMED_TEXT.match(text):
            return named[1]
    return ""


def _chosen(program: Program, operations: Sequence[Operation], which: str) -> Operation:
    wanted = " ".join(which.split())
    for same in (
        [one for one in operations if one.name == which],
        [one for one in operations if " ".join(one.name.split()).upper() == wanted.upper()],
        [one for one in operations if wanted.isdecimal() and one.number == int(wanted)],
    ):
        if len(same) == 1:
            return same[0]
        if same:
            numbers = ", ".join(str(one.number) for one in same)
            what, hint = f"several operations are called {which}", f"give a number: {numbers}"
            raise InputError("CS168", what, hint, file=program.source.name)
    names = ", ".join(one.called for one in operations)
    raise InputError("CS168", f"there is no operation {which}", f"it has {names or 'none'}", file=program.source.name)


def _held(before: Sequence[Statement], at_once: Sequence[Statement]) -> tuple[list[Statement], list[Statement]]:
    """Statements that hold on where an operation begins, in order, and those of which nobody knows whether they do.

    What the operation says itself before its first move, `at_once`, takes the place of what was in force.
    """
    last: dict[str, int] = {}
    spindle: list[int] = []
    coolant: list[int] = []
    unknown: list[Statement] = []
    off = False
    for number, statement in enumerate(before):
        if statement.word in _LASTING:
            last[_LASTING[statement.word]] = number
        elif statement.word == "SPINDL":
            off = _switches_off(statement)
            spindle = spindle if off else [number] if _starts(statement) else [*spindle, number]
        elif statement.word == "COOLNT":
            coolant = [] if _switches_off(statement) else [*coolant, number]
        elif statement.word not in _PASSING:
            unknown.append(statement)
    replaced = {_LASTING[statement.word] for statement in at_once if statement.word in _LASTING}
    again = [statement for statement in at_once if statement.word == "SPINDL"]
    cooled = [statement.args for statement in at_once if statement.word == "COOLNT"]
    kept = [number for key, number in last.items() if key not in replaced and not _switches_off(before[number])]
    if not ((again and _starts(again[0])) or (off and not again)):
        kept += spindle
    kept += [number for number in coolant if not (cooled and "tool" in replaced) and before[number].args not in cooled]
    return [before[number] for number in sorted(kept)], unknown


def _switches_off(statement: Statement) -> bool:
    return bool(_OFF & set(statement.args)) or (statement.word == "SPINDL" and 0.0 in statement.args)


def _starts(statement: Statement) -> bool:
    """Whether a SPINDL has speed and direction."""
    return bool({"CLW", "CCLW"} & set(statement.args)) and any(isinstance(value, float) for value in statement.args)
