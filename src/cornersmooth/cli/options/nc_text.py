"""Options about the NC text, its control and its machine."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli import completing
from cornersmooth.cli.headings import flag, option
from cornersmooth.cli.options.parameters import LENGTH, PATH, all_of
from cornersmooth.errors import SettingsError

if TYPE_CHECKING:
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Control

form = option(
    "Everyday",
    "-f",
    "--form",
    metavar="g1|g6.2|...",
    shell_complete=completing.forms,
    help="Dense lines, or curves in the control's own form; 'cornersmooth controls' lists them. [default: g1]",
)
control = option(
    "Everyday",
    "--control",
    metavar="NAME|FILE",
    shell_complete=completing.controls,
    default="fanuc",
    help="Control that the program is for: a name that 'cornersmooth controls' lists, or a TOML file.",
)
machine = option(
    "Everyday",
    "--machine",
    metavar="NAME|FILE",
    shell_complete=completing.machines,
    help="Write rotary words of this machine instead of tool vectors: a name that 'cornersmooth machines' "
    "lists, or a TOML file.",
)
no_tcp = flag(
    "Control", "--no-tcp", help="Positions of the machine's axes, for controls that do not keep the tool tip."
)
extras = option(
    "Control",
    "--with",
    "extras",
    metavar="NAME",
    multiple=True,
    help="Switch a function of the control on, such as cycle832; 'cornersmooth controls' lists them. May be repeated.",
)
program_name = option(
    "Program",
    "--program-name",
    metavar="TEXT",
    help="Name or number of the NC program. [default: from the name of the CL file]",
)
line_ends = option(
    "Program",
    "--line-ends",
    type=click.Choice(["lf", "crlf"]),
    help="What each line of the program ends with. [default: that of the control's table, lf]",
)
work_offset = option(
    "Program",
    "--work-offset",
    metavar="WORD",
    help="Work offset, such as G55, or the number of a preset; 'none' leaves it out. [default: G54, or preset 1]",
)
approach = option(
    "Program",
    "--approach",
    type=LENGTH,
    help="How far the tool comes down along its axis to the first position after a retract. [default: straight down]",
)
retract = option(
    "Program",
    "--retract",
    type=LENGTH,
    help="How far the tool goes back along its axis before it goes up. [default: straight up]",
)
rewind = option(
    "Program",
    "--rewind",
    type=LENGTH,
    help="Where a rotary axis would pass its limit in a cut, leave the cut along the tool by this length. "
    "The axis turns back above the retract, and the cut goes on. [default: an error]",
)
skip_cycles = flag(
    "Holes and planes",
    "--skip-cycles",
    help="Leave out holes whose cycle cannot be written; the program says NOT DRILLED there. [default: an error]",
)
cycles = option(
    "Holes and planes",
    "--cycles",
    type=click.Choice(["moves", "native"]),
    default="moves",
    help="Holes as plain moves, or as the control's own cycles where it has such and the tool stays along Z (or in a "
    "tilted plane).",
)
planes = option(
    "Holes and planes",
    "--planes",
    type=click.Choice(["none", "tilted"]),
    default="none",
    help="Whether a tool that keeps a tilted axis between rapids runs in a tilted plane of the control: CYCLE800, "
    "PLANE SPATIAL, G68.2, G254.",
)
header = option(
    "Program",
    "--header",
    type=PATH,
    metavar="FILE",
    help="Lines to write after the head; {program} and {units} are filled in.",
)
footer = option("Program", "--footer", type=PATH, metavar="FILE", help="Lines to write before the tail.")
slower = flag(
    "Verification",
    "--planned-feeds",
    "slower",
    help="Feeds of the program may be lower than those of the CL file, as --feedrate plan of smooth writes them.",
)
trusted = option(
    "Verification",
    "--trust",
    "trusted",
    type=PATH,
    multiple=True,
    metavar="FILE",
    help="Lines of the program that you put there, as with --header and --footer of smooth. May be repeated.",
)
digits = option(
    "Control",
    "--digits",
    metavar="N|NAME",
    default="",
    help="Decimals of lengths in mm (in inches one more), or an increment system of the control, as in IS-B. "
    "[default: what the control takes; fanuc IS-C]",
)
block_numbers = flag("Program", "--block-numbers", help="Number the blocks.")
modal = flag(
    "Program", "--modal", help="Leave out words that repeat from block to block, where the control keeps them."
)
no_comments = flag("Program", "--no-comments", help="Leave out what the CL file says in words.")
no_verify = flag(
    "Verification", "--no-verify", help="Do not read the program back and measure it before it takes its place."
)
strict = flag(
    "Verification",
    "--strict",
    help="Take no verdict but PASSED: else the program goes to OUT.failed, and 1 is returned.",
)
strict_verdict = flag("Verification", "--strict", help="Take no verdict but PASSED: else 1 is returned.")


def writing_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """Options of every command that writes NC text, besides its form."""
    return all_of(
        function,
        (
            control,
            machine,
            no_tcp,
            extras,
            digits,
            program_name,
            work_offset,
            approach,
            retract,
            rewind,
            skip_cycles,
            cycles,
            planes,
            header,
            footer,
            block_numbers,
            line_ends,
            modal,
            no_comments,
        ),
    )


def control_of(given: Mapping[str, Any]) -> Control:
    """Control of that name, of that file, or of the shop settings."""
    from cornersmooth.nc import load_control

    control: str | Control = given["control"]
    return load_control(control) if isinstance(control, str) else control


def machine_of(given: Mapping[str, Any], option: str = "machine") -> Machine | None:
    """Machine of that name, of that file, or of the shop settings; None where none is named."""
    from cornersmooth.kinematics import load_machine

    machine: str | Machine | None = given[option]
    return load_machine(machine) if isinstance(machine, str) and machine else machine or None


def reading_back_of(given: Mapping[str, Any]) -> dict[str, Any]:
    """Keyword arguments of `cornersmooth.nc_reader.read_nc` for a text that somebody wrote.

    Raises
    ------
    SettingsError
        CS204: nobody knows how the control's text is read; or the control or the machine is unknown.
    """
    from cornersmooth.nc_reader import CONTROLS

    control = control_of(given)
    if control.dialect not in CONTROLS:
        raise SettingsError(
            "CS204", f"{control.name} is like no control that can be read", 'say like = "fanuc" or another in it'
        )
    return {"control": control.dialect, "machine": machine_of(given), "tcp": not given["no_tcp"]}
