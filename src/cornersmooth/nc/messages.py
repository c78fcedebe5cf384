"""What the writers say: one table for warnings and notes, and one for what they refuse in a program.

Texts take their values by `str.format`. `Findings` counts what was noticed: one finding for each code and text, at the
line where it was first met.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Final

from cornersmooth.errors import Finding, InputError, Severity
from cornersmooth.model import Ints, Program

#: code: (kind, text)
FINDINGS: Final[dict[str, tuple[Severity, str]]] = {
    # the program
    "CS326": (
        "warning",
        "the tool axis turns by more than {angle:g} deg in a rapid, and which way a control turns is not defined; "
        "keep clear of the part there, or insert a pose in between",
    ),
    "CS388": ("warning", "feed beyond the F{largest:.10g} mm/min that the control takes; give a lower one"),
    "CS323": (
        "warning",
        "feed per revolution without tool tip control counts along the machine's axes; give feeds per minute",
    ),
    "CS393": (
        "warning",
        "the machine file names no blocks that switch tip control on and off: the kinematics must keep the tip from "
        'the start; write tip_control = ["M428", "M429"], or [] if they do',
    ),
    "CS394": (
        "warning",
        "{control} rounds the corners of lines by itself; lines of the method {method} took it 10 to 50 % longer, "
        "and once it left the tolerance there; use --method {default}",
    ),
    "CS395": (
        "warning",
        "axis points U V W in G6.2 need the option of dual NURBS interpolation (a second curve for the tool axis); see "
        "that the control has it, else it stops with an alarm, or use -f g1",
    ),
    "CS396": (
        "note",
        "rounded corners are many short lines, and a control that does not look ahead slows down on them; "
        "give --with {name}, unless the machine has such a function on",
    ),
    "CS339": ("warning", "{name} was asked for: {warning}"),
    "CS313": ("note", "arc written as circular blocks"),
    "CS314": ("note", "arc written as lines"),
    # feeds and rows
    "CS311": (
        "warning",
        "feed move without a feed in the CL file: most controls stop with an alarm; give one with --feed",
    ),
    "CS312": ("note", "move of zero length in the written digits left out"),
    "CS324": ("warning", "feed per revolution while no spindle speed is given: controls stop there or stand still"),
    "CS325": (
        "warning",
        "fewer than six of ten blocks are BSPLINE, which SINUMERIK wants; -f poly (vectors) has no such rule",
    ),
    # statements
    "CS310": ("warning", "{word} is not translated: written as a comment; see whether the machine needs it"),
    "CS317": ("note", "PAINT is left out: it only says what the CAM screen shows"),
    "CS318": ("warning", "END comes before the last motion: written as a program stop; see that this is meant"),
    "CS319": (
        "warning",
        "cutter compensation is left to the control, which offsets the path in the plane and not along the tool; see"
        " that {also}the register holds what the CAM system meant",
    ),
    "CS320": (
        "warning",
        "INSERT is written as a comment; put them in by hand where the machine needs them",
    ),
    "CS322": ("note", "SPINDL in {unit} is written as revolutions at the cutter's diameter"),
    "CS331": ("warning", "{what} not given again in translated words after a tool change: on as before"),
    "CS332": (
        "warning",
        "GOHOME without coordinates is no motion in this program; see where the tool goes",
    ),
    "CS335": (
        "warning",
        "the spindle is started without a speed: a control takes the one that holds from before",
    ),
    "CS345": (
        "warning",
        "cutter compensation begins on a move of {length:g} mm in the plane: the control refuses it where the "
        "register holds the whole radius of the tool",
    ),
    "CS359": (
        "warning",
        "AUXFUN/{number} clamps a rotary axis or lets it turn: left out, the machine's file says where",
    ),
    "CS383": ("warning", "a dwell under feed per revolution: it counts turns of the spindle {where}"),
    # tools
    "CS337": (
        "warning",
        "the first motion of a tool turns it to a tilted axis; see that it is free to, or name the machine",
    ),
    "CS333": ("warning", "the first motion of a tool is a feed move: it feeds {where}; put a RAPID before it"),
    "CS358": (
        "warning",
        "tool tip control after a tilted tool: the rotary axes are where it has left them. The part program may turn"
        " with them (WKP); name the machine, so that they go to zero before",
    ),
    "CS334": (
        "warning",
        "the CL file loads no tool before it moves: the tool in the spindle is taken, with length register 1; see "
        "that it is the right one, or load it with LOADTL",
    ),
    "CS382": ("warning", "tool 0 moves: controls take T0 for an empty spindle, and H0 for no length; give it a number"),
    # holes
    "CS315": ("warning", "hole not drilled, the tool only goes over it: {why}"),
    "CS316": ("note", "hole of a cycle written as plain moves"),
    "CS347": ("note", "hole written as a cycle of the control"),
    "CS348": ("warning", "a tap is left to the control's cycle: see that it turns the spindle with the feed"),
    "CS384": (
        "warning",
        "the tool turns on its way to a hole to where feeding begins; see that it is free to, or give RTRCTO",
    ),
    "CS321": ("warning", "CYCLE with pecks does not say how deep they are; see that the tool may drill in one feed"),
    "CS385": (
        "warning",
        "CYCLE without words is read as depth, feed, clearance; see that the positions are tops of holes",
    ),
    # tilted planes and rotary axes
    "CS356": ("note", "run with one axis of the tool written in a tilted plane of the control"),
    "CS357": ("warning", "no tilted plane: {why}: under tool tip control as other motion"),
    "CS379": (
        "warning",
        "a tilted plane stays within the travel with {angles} only; see that the control takes these angles",
    ),
    "CS340": (
        "warning",
        "rotary axes swing the tilted tool in a rapid, and the control's table has no retract: keep clear there",
    ),
    "CS341": ("note", "retract before a rapid in which rotary axes swing the tilted tool: they turn at its height"),
    "CS346": (
        "warning",
        "words of {names} beyond 0 to 360 deg: a modulo axis takes them only where the builder allows it (MD30455 "
        "bit 0, else alarm 16830); where not, write modulo = true for the axis in a machine file",
    ),
    "CS367": ("note", "point inserted so that {names} keep the tool within the tolerance"),
    "CS369": (
        "warning",
        "the tool axis jumps further than rotary axes can follow within the tolerance; see what it does there",
    ),
    "CS371": ("warning", "block slowed down: it is shorter than F{fastest:.10g} of inverse time (G93) can say"),
    "CS372": ("note", "block merged with its neighbour: shorter than inverse time (G93) can say"),
    "CS376": (
        "warning",
        "the cut is left along the tool and gone on with where {name} has turned by {turn:.4g} deg above the "
        "retract: expect a mark on the part",
    ),
    "CS391": (
        "warning",
        "the first block of a tool leaves the travel from some places of X and Y at the height of the retract; move "
        "X and Y near the position before, or give [tool_change] X and Y in the machine file",
    ),
    "CS392": (
        "warning",
        "the first block of a tool may come from below its end, as the part is turned far; see that table and "
        "fixture are clear of it, or bring X and Y near before",
    ),
}

#: other texts of the same codes
OTHER_FINDINGS: Final[dict[str, tuple[Severity, str]]] = {
    "CS313": ("note", "arc written as curves"),
    "CS332": ("warning", "GOHOME without coordinates is written as the retract of the control's table"),
    "CS335": ("warning", "the spindle is not started before the first cut of a tool; put SPINDL before it"),
}

#: code: (what is wrong, what to do)
REFUSALS: Final[dict[str, tuple[str, str]]] = {
    "CS336": (
        "{control} is given no cutter compensation, and the path would be cut without it",
        "let the CAM system put the cutter's radius into the path",
    ),
    "CS342": (
        "the hole cycle is not written: {why}",
        "give --skip-cycles to leave its holes out; the program says NOT DRILLED where they are",
    ),
    "CS343": ("a feed move before any feed, which the control refuses", "give one with --feed"),
    "CS344": (
        "cutter compensation begins on a move without any way in the plane, which the control refuses",
        "let the CAM system lead in on a line, or put the cutter's radius into the path",
    ),
    "CS354": (
        "the tool change of the control table has {{speed}}, and the CL file gives tool {tool} none",
        "add SPINDL, or --spindle",
    ),
    "CS361": (
        "the method turns the tool out of what {axis} of {machine} reaches, within the tolerance",
        "use --method proportional, which does not",
    ),
    "CS377": (
        "a rotary axis would have to turn back in a cut with cutter compensation",
        "let the CAM system put the cutter's radius into the path",
    ),
}

#: another text of the same code
OTHER_REFUSALS: Final[dict[str, tuple[str, str]]] = {
    "CS343": (
        "feed per revolution while no spindle speed is given: controls stop there or stand still",
        "give the spindle its speed in the CL file",
    ),
}


def refused(code: str, program: Program, line: int, which: int = 0, **values: object) -> InputError:
    """Error of what is refused at a line of the CL file, ready to be raised."""
    what, hint = (REFUSALS, OTHER_REFUSALS)[which][code]
    return InputError(code, what.format(**values), hint.format(**values), file=program.source.name, line=line)


@dataclass
class Findings:
    """Findings of one output, in the order in which they were first met."""

    _found: dict[tuple[str, str], Finding] = field(default_factory=dict)

    def note(self, code: str, line: int, count: int = 1, which: int = 0, **values: object) -> None:
        """Count something that was noticed; `which` says whether by the other text of its code."""
        severity, text = (FINDINGS, OTHER_FINDINGS)[which][code]
        self.add_all([Finding(code, severity, line, text.format(**values), count)])

    def note_each(self, code: str, lines: Ints, which: int = 0, **values: object) -> None:
        """Count what was noticed at each of some lines of the CL file, if any."""
        if len(lines):
            self.note(code, int(lines[0]), len(lines), which, **values)

    def add_all(self, others: Iterable[Finding]) -> None:
        """Count what was noticed elsewhere."""
        for one in others:
            old = self._found.get((one.code, one.text))
            self._found[one.code, one.text] = one if old is None else replace(old, count=old.count + one.count)

    def all(self) -> tuple[Finding, ...]:
        """Everything that was noticed."""
        return tuple(self._found.values())
