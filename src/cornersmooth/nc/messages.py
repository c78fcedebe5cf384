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

#: texts of warnings by code; with a ``b`` behind it another text of the same code
WARNINGS: Final = {
    # the program
    "CS326": (
        "the tool axis turns by more than {angle:g} deg in a rapid, and which way a control turns is not defined; keep "
        "clear of the part there, or insert a pose in between"
    ),
    "CS388": "feed beyond the F{largest:.10g} mm/min that the control takes; give a lower one",
    "CS323": "feed per revolution without tool tip control counts along the machine's axes; give feeds per minute",
    "CS393": (
        "the machine file names no blocks that switch tip control on and off: the kinematics must keep the tip from "
        'the start; write tip_control = ["M428", "M429"], or [] if they do'
    ),
    "CS394": (
        "{control} rounds the corners of lines by itself; lines of the method {method} took it 10 to 50 % longer, and "
        "once it left the tolerance there; use --method {default}"
    ),
    "CS395": (
        "axis points U V W in G6.2 need the option of dual NURBS interpolation (a second curve for the tool axis); see "
        "that the control has it, else it stops with an alarm, or use -f g1"
    ),
    "CS339": "{name} was asked for: {warning}",
    # feeds and rows
    "CS311": "feed move without a feed in the CL file: most controls stop with an alarm; give one with --feed",
    "CS324": "feed per revolution while no spindle speed is given: controls stop there or stand still",
    # statements
    "CS310": "{word} is not translated: written as a comment; see whether the machine needs it",
    "CS318": "END comes before the last motion: written as a program stop; see that this is meant",
    "CS319": (
        "cutter compensation is left to the control, which offsets the path in the plane and not along the tool; see "
        "that {also}the register holds what the CAM system meant"
    ),
    "CS320": "INSERT is written as a comment; put them in by hand where the machine needs them",
    "CS331": "{what} not given again in translated words after a tool change: on as before",
    "CS332": "GOHOME without coordinates is no motion in this program; see where the tool goes",
    "CS332b": "GOHOME without coordinates is written as the retract of the control's table",
    "CS335": "the spindle is started without a speed: a control takes the one that holds from before",
    "CS335b": "the spindle is not started before the first cut of a tool; put SPINDL before it",
    "CS345": (
        "cutter compensation begins on a move of {length:g} mm in the plane: where the register holds the whole radius "
        "of the tool, the control refuses it, or cuts into the part"
    ),
    "CS359": "AUXFUN/{number} clamps a rotary axis or lets it turn: left out, the machine's file says where",
    "CS383": "a dwell under feed per revolution: it counts turns of the spindle {where}",
    # tools
    "CS337": "the first motion of a tool turns it to a tilted axis; see that it is free to, or name the machine",
    "CS337b": "the first motion of a tool turns it to a tilted axis; see that tool and table are free to",
    "CS333": "the first motion of a tool is a feed move: it feeds {where}; put a RAPID before it",
    "CS358": (
        "tool tip control after a tilted tool: the rotary axes are where it has left them. The part program may turn "
        "with them (WKP); name the machine, so that they go to zero before"
    ),
    "CS334": (
        "the CL file loads no tool before it moves: the tool in the spindle is taken, with length register 1; see that "
        "it is the right one, or load it with LOADTL"
    ),
    "CS382": "tool 0 moves: controls take T0 for an empty spindle, and H0 for no length; give it a number",
    # holes
    "CS315": "hole not drilled, the tool only goes over it: {why}",
    "CS348": "a tap is left to the control's cycle: see that it turns the spindle with the feed",
    "CS384": "the tool turns on its way to a hole to where feeding begins; see that it is free to, or give RTRCTO",
    "CS321": "CYCLE with pecks does not say how deep they are; see that the tool may drill in one feed",
    # tilted planes and rotary axes
    "CS357": "no tilted plane: {why}: under tool tip control as other motion",
    "CS379": "a tilted plane stays within the travel with {angles} only; see that the control takes these angles",
    "CS340": "rotary axes swing the tilted tool in a rapid, and the control's table has no retract: keep clear there",
    "CS346": (
        "words of {names} beyond 0 to 360 deg: a modulo axis takes them only where the builder allows it (MD30455 bit "
        "0, else alarm 16830); where not, write modulo = true for the axis in a machine file"
    ),
    "CS369": "the tool axis jumps further than rotary axes can follow within the tolerance; see what it does there",
    "CS371": "block slowed down: it is shorter than F{fastest:.10g} of inverse time (G93) can say",
    "CS376": (
        "the cut is left along the tool and gone on with where {name} has turned by {turn:.4g} deg above the retract: "
        "expect a mark on the part"
    ),
    "CS392": (
        "the first block of a tool may come from below its end, as the part is turned far; see that table and fixture "
        "are clear of it"
    ),
}
NOTES: Final = {
    "CS396": (
        "rounded corners are many short lines, and a control that does not look ahead slows down on them; give --with "
        "{name}, unless the machine has such a function on"
    ),
    "CS325": "SINUMERIK joins curves well where six of ten blocks are BSPLINE; -f poly (vectors) has no such rule",
    "CS313": "arc written as circular blocks",
    "CS313b": "arc written as curves",
    "CS314": "arc written as lines",
    "CS312": "move of zero length in the written digits left out",
    "CS317": "PAINT is left out: it only says what the CAM screen shows",
    "CS322": "SPINDL in {unit} is written as revolutions at the cutter's diameter",
    "CS316": "hole of a cycle written as plain moves",
    "CS347": "hole written as a cycle of the control",
    "CS356": "run with one axis of the tool written in a tilted plane of the control",
    "CS341": "retract before a rapid in which rotary axes swing the tilted tool: they turn at its height",
    "CS367": "point inserted so that {names} keep the tool within the tolerance",
    "CS372": "block merged with its neighbour: shorter than inverse time (G93) can say",
}
#: code: (what is wrong, what to do)
REFUSALS: Final[dict[str, tuple[str, str]]] = {
    "CS336": (
        "{control} is given no cutter compensation, and the path would be cut without it",
        "let the CAM system put the cutter's radius into the path",
    ),
    "CS336b": (
        "cutter compensation in {plane}: controls are given it in XYPLAN alone",
        "let the CAM system put the cutter's radius into the path",
    ),
    "CS342": (
        "the hole cycle is not written: {why}",
        "give --skip-cycles to leave its holes out; the program says NOT DRILLED where they are",
    ),
    "CS343": ("a feed move before any feed, which the control refuses", "give one with --feed"),
    "CS343b": (
        "feed per revolution while no spindle speed is given: controls stop there or stand still",
        "give the spindle its speed in the CL file",
    ),
    "CS344": (
        "cutter compensation begins on a move without any way in the plane, which the control refuses",
        "let the CAM system lead in on a line, or put the cutter's radius into the path",
    ),
    "CS354": (
        "the tool change of the control table has {{speed}}, and the CL file gives tool {tool} none",
        "add SPINDL, or --spindle",
    ),
    "CS377": (
        "a rotary axis would have to turn back in a cut with cutter compensation",
        "let the CAM system put the cutter's radius into the path",
    ),
}


def refused(code: str, program: Program, line: int, **values: object) -> InputError:
    """Error of what is refused at a line of the CL file, ready to be raised."""
    what, hint = REFUSALS[code]
    return InputError(code[:5], what.format(**values), hint.format(**values), file=program.source.name, line=line)


@dataclass
class Findings:
    """Findings of one output, in the order in which they were first met."""

    _found: dict[tuple[str, str], Finding] = field(default_factory=dict)

    def note(self, code: str, line: int, count: int = 1, **values: object) -> None:
        """Count something that was noticed."""
        severity: Severity = "warning" if code in WARNINGS else "note"
        text = (WARNINGS | NOTES)[code].format(**values)
        self.add_all([Finding(code[:5], severity, line, text, count)])

    def note_each(self, code: str, lines: Ints, **values: object) -> None:
        """Count what was noticed at each of some lines of the CL file, if any."""
        if len(lines):
            self.note(code, int(lines[0]), len(lines), **values)

    def add_all(self, others: Iterable[Finding]) -> None:
        """Count what was noticed elsewhere."""
        for one in others:
            old = self._found.get((one.code, one.text))
            self._found[one.code, one.text] = one if old is None else replace(old, count=old.count + one.count)

    def all(self) -> tuple[Finding, ...]:
        """Everything that was noticed."""
        return tuple(self._found.values())
