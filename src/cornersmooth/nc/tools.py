"""Tools of a program: the statements that load them, where each begins, and travel with the length of each."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Final

import numpy as np

from cornersmooth.kinematics import Machine, check_travel
from cornersmooth.model import Floats, Ints, Program, Statement
from cornersmooth.nc.statement_args import number_after, whole_number, words_of

#: words that load a tool
TOOL_WORDS: Final = frozenset({"LOADTL", "LOAD", "TURRET"})

#: words of `TOOL_WORDS` with the number of a length register
_REGISTERS: Final = ("ADJUST", "OSETNO")

#: words at which the program waits for time or the operator
_WAITING: Final = frozenset({"STOP", "OPSTOP", "DELAY"})


def loaded_tool(statement: Statement) -> tuple[int, int] | None:
    """Tool and length register of LOADTL/n, LOAD/TOOL,n[,ADJUST,m], TURRET/n[,OSETNO,m]; None where it loads none.

    A number after ADJUST, OSETNO or LENGTH is no tool: LOADTL/ADJUST,3 names none.
    """
    words = words_of(statement)
    if statement.word == "LOAD" and words[:1] != ["TOOL"]:
        return None
    registers = [value for word in _REGISTERS for value in number_after(statement, word)]
    behind = pairwise(("", *statement.args))
    numbers = [value for word, value in behind if isinstance(value, float) and word not in (*_REGISTERS, "LENGTH")]
    if not numbers and statement.word == "LOADTL" and words and words[0][:1] == "T" and words[0][1:].isdigit():
        numbers = [float(words[0][1:])]
    number = whole_number(numbers[:1])
    if number is None:
        return None
    if len(numbers) == 4 and not numbers[1]:  # LOADTL/tool,0,length,register of Autodesk's ISO 4343 post
        registers.append(numbers[3])
    offset = whole_number(registers[:1])
    return number, number if offset is None else offset


def tool_loads(program: Program) -> list[tuple[int, tuple[int, int]]]:
    """Pose, and tool and length register, of every statement that loads a tool."""
    words = TOOL_WORDS if TOOL_WORDS & {statement.word for statement in program.statements} else {"TOOLNO"}
    loads = [(statement.pose, loaded_tool(statement)) for statement in program.statements if statement.word in words]
    return [(pose, tool) for pose, tool in loads if tool is not None]


def ahead_of_tools(program: Program) -> frozenset[int]:
    """Last statements of each word ahead of the first tool, if no motion and no wait comes before it; by identity."""
    found: dict[str, int] = {}
    for statement in program.statements:
        if statement.pose > program.statements[0].pose or statement.word in _WAITING:
            return frozenset()
        if statement.word in TOOL_WORDS and loaded_tool(statement) is not None:
            return frozenset(found.values())
        found[statement.word] = id(statement)
    return frozenset()


def tool_starts(program: Program) -> list[int]:
    """Poses at which another tool begins, the first pose among them; ascending."""
    starts, tool = [0], None
    for pose, loaded in tool_loads(program):
        if loaded != tool:
            starts.append(pose)
            tool = loaded
    return sorted({min(pose, len(program)) for pose in starts})


@dataclass(frozen=True)
class ToolTravel:
    """The travel of a machine for the tools of a program, each with its own length."""

    program: Program
    machine: Machine

    @cached_property
    def _tools(self) -> Ints:
        """(n,) number of the tool that moves to each pose, -1 before the first."""
        loads = tool_loads(self.program) if self.machine.tool_lengths else []
        begins = np.array([pose for pose, _ in loads], np.int64)
        numbers = np.array([-1, *(number for _, (number, _) in loads)], np.int64)
        return numbers[np.searchsorted(begins, np.arange(len(self.program)), side="right")]

    def check(self, tip: Floats, angles: Floats, move: Ints) -> None:
        """Refuse rows (r,) of poses, tips in mm and angles in degrees, that the linear axes cannot reach (CS374)."""
        if not self.machine.travel:
            return
        tools, file = self._tools[move], self.program.source.name
        for number in np.unique(tools).tolist():
            rows = tools == number
            check_travel(self.machine.with_tool(number), tip[rows], angles[rows], self.program.line[move[rows]], file)
