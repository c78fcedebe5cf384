"""The blocks of a control around the motion, and the steps that stand among them."""

from __future__ import annotations

from dataclasses import dataclass

from cornersmooth.tables import Pattern

#: lines of a program, with places in braces
Blocks = tuple[str, ...]


@dataclass(frozen=True)
class ProgramTable:
    """The blocks around the motion, in the order in which they are written.

    An item that is nothing but a name in braces is a step (`STEPS`); all others are blocks, with ``{program}``,
    ``{units}`` and ``{blend}``, a tenth of ε.
    """

    name: str = "O0001"  #: name or number of the program where neither the user nor the name of the CL file gives one
    #: the same from the name of the CL file, with ``{stem}``, its letters and digits in capitals with underscores
    #: between, or ``{number}``, the digits that it ends in, four at least; empty where `name` is for all files
    file_name: str = ""
    name_pattern: Pattern = ""  #: regular expression of the names that the control takes; empty for any
    work_offset: str = ""  #: what ``{work_offset}`` stands for where the user gives nothing
    work_offset_pattern: Pattern = ""  #: regular expression of what it may be
    work_offset_block: Blocks = ()  #: with ``{work_offset}``
    #: blocks that bring the tool to a height that clears everything; none where the control is told nothing
    retract: Blocks = ()
    #: block with ``{position}``, words of a position of the machine; empty where the control has no such
    position: str = ""
    start: Blocks = ("{header}",)  #: before everything else
    begin: Blocks = ("{tip_control_on}",)  #: before the first motion of each tool, and after a retract
    tool_end: Blocks = ("{tip_control_off}",)  #: after the last motion of each tool
    #: behind `tool_end`, before another tool than the first, where the CL file does not stop there anyway
    between_tools: Blocks = ()
    end: Blocks = ("{footer}",)  #: after everything else, `tool_end` included


#: steps that `ProgramTable` may name; what is off already, or not asked for, is no block
STEPS = {
    "retract": "the blocks of `retract`, where the tool is not there yet",
    "work_offset": "the block of the work offset",
    "rotary_zero": "both rotary axes to zero, with a machine only",
    "rotary_start": "both rotary axes to the angles of the first motion, with a machine only",
    "plane_reset": "a tilted plane that another program has left, off; where such planes are asked for",
    "tip_control_on": "functions that stand outside, tool tip control or the length of the tool, functions within",
    "functions_off": "functions within tool tip control off",
    "tip_control_off": "tool tip control or the length of the tool off, then functions that stand outside",
    "kinematics_on": "tip control of the kinematics on, by the block that the machine's table has for it",
    "kinematics_off": "the same off",
    "spindle_off": "the spindle, where it turns",
    "coolant_off": "the coolant, where it flows",
    "header": "the user's lines of --header",
    "footer": "the user's lines of --footer",
}
