"""Every option of every command, once: what it is called, what it may be, what its help says, what it stands for."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass, field, fields
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal

import click

from cornersmooth.cli.files import read_input
from cornersmooth.cli.parameters import (
    ControlName,
    Duration,
    FormName,
    Length,
    MachineName,
    Path,
    Processes,
    Spindle,
    ToolShape,
    Weights,
)
from cornersmooth.errors import SettingsError
from cornersmooth.methods import AUTO, METHODS

if TYPE_CHECKING:
    from cornersmooth.feedrate import Limits
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Control, Form
    from cornersmooth.settings import Settings

#: arguments of `cornersmooth.read` that options give
_ARGUMENTS = (
    "format dialect units arc_rule operation lenient tool_number spindle scale flip_axis between_passes cycle_order"
).split()

Count = Annotated[int, click.IntRange(min=1)]
Units = Literal["mm", "inch"]


def option(heading: str, spelled: str, help: str, default: Any = None, **given: Any) -> Any:
    """Field of an option under a heading; `given` is as `click.Option` takes it.

    It is spelled by flags, and by what the help shows in the place of the value. The long flag is the field's name if
    there is none. The default is that of the command line, and of the commands that do not have the option.
    """
    return field(default=default, metadata={"heading": heading, "spelled": spelled, "help": help, **given})


#: parts of the helps in their order; the first holds the options of every day
HEADINGS = "Everyday,Output,Control,Program,Curves,Lines,Holes and planes,Limits,Reading,Verification,Batches".split(
    ","
)
_everyday, _output, _control, _program, _curves, _lines, _holes, _limits, _reading, _verification, _batches = (
    partial(option, heading) for heading in HEADINGS
)


#: of plans, in the order of the helps, and of a plan whose feeds are written
LIMITS = "feed accel jerk centripetal period rapid rapid_accel rapid_jerk angular_feed angular_accel angular_jerk"
PLANNED = "accel jerk centripetal period"


@dataclass(frozen=True, kw_only=True)
class Options:
    """What was asked for, as click has read it: fields are arguments and options, their types say what these may be.

    A command has some of them; the others have their defaults. Lengths are mm, angles degrees, times s.
    """

    # arguments
    inputs: tuple[str, ...] = ()
    source: str = ""
    name: str | None = None  #: of a control, a machine, a code or a shell

    tolerance: Length = _everyday("-e", "Largest deviation of the written path.", 0.01)
    axis_length: Length = _everyday(
        "-H",
        "Distance from the tool tip to the second point that keeps the tolerance: the length of the cutting edge.",
        10.0,
    )
    method: Annotated[str, click.Choice([AUTO, *METHODS])] = _everyday(
        "",
        "How the curves are made. With auto: global in curves (g6.2, bspline, poly, spl), proportional in lines. "
        + " ".join(f"With {item.name}: {item.summary}." for item in METHODS.values())
        + " Global takes less time on the machine and about a block a pose in curves; on LinuxCNC it takes more time.",
        AUTO,
    )
    form: FormName | None = _everyday(
        "-f g1|g6.2|...",
        "Dense lines, or curves in the control's own form; 'cornersmooth controls' lists them. [default: g1]",
    )
    control: ControlName = _everyday(
        "NAME|FILE",
        "Control that the program is for: a name that 'cornersmooth controls' lists, or a TOML file.",
        "fanuc",
    )
    machine: MachineName | None = _everyday(
        "NAME|FILE",
        "Write rotary words of this machine instead of tool vectors: a name that 'cornersmooth machines' "
        "lists, or a TOML file.",
    )
    feed: float | None = _everyday("MM/MIN", "Feed for moves that the CL file gives none for.")
    output: Path | None = _everyday("-o", "NC file, - for standard output. [default: - for a single input]")
    reports: tuple[Path, ...] = _everyday(
        "--report",
        "Write a report; .json, .csv or .html (a page to look at) decides the form. May be repeated; {stem} is "
        "the input's name.",
        (),
    )
    force: bool = _everyday("", "Replace existing files.", False)
    text: Path = _everyday(
        "NC", "Plan this NC program in place of the one that these options write: its lines, digits and feeds.", ""
    )

    as_json: bool = _output("--json", "One JSON object instead of lines to read.", False)
    table: bool = _output("", "Print the table of the name: what a TOML file of your own starts from.", False)
    pose: str | None = _output(
        "A..,C..",
        "Say which way the tool points at these rotary angles, and where the linear axes stand: A30,C45, with the tip "
        "on the part A30,C45,X10,Y0,Z5, or bare angles in alphabetical order.",
    )
    quiet: bool = _output("-q", "Only errors.", False)
    verbose: int = _output("-v", "More: every finding, times of the stages.", 0, count=True)
    law: Annotated[str, click.Choice(["direct_exact_stop", "direct_velocity_jump", *METHODS, "as_written"])] = _output(
        "LAW",
        "Motion that --csv writes: as_written, direct_exact_stop, direct_velocity_jump, or the curves of a method "
        f"({', '.join(METHODS)}).",
        "as_written",
    )
    csv: Path | None = _output("", "Write the rows.")
    stations: Annotated[int, click.IntRange(1, 1_000_000)] = _output("N", "Places along the path.", 2000)
    levels: Annotated[int, click.IntRange(1, 60)] = _output("N", "Points along the cutting edge.", 7)

    no_tcp: bool = _control("", "Positions of the machine's axes, for controls that do not keep the tool tip.", False)
    extras: tuple[str, ...] = _control(
        "--with NAME",
        "Switch a function of the control on, such as cycle832; 'cornersmooth controls' lists them. May be repeated.",
        (),
    )
    digits: str = _control(
        "N|NAME",
        "Decimals of lengths in mm (in inches one more), or an increment system of the control, as in IS-B. "
        "[default: what the control takes; fanuc IS-C]",
        "",
    )

    program_name: str | None = _program(
        "TEXT", "Name or number of the NC program. [default: from the name of the CL file]"
    )
    work_offset: str | None = _program(
        "WORD", "Work offset, such as G55, or the number of a preset; 'none' leaves it out. [default: G54, or preset 1]"
    )
    approach: Length | None = _program(
        "", "How far the tool comes down along its axis to the first position after a retract. [default: straight down]"
    )
    retract: Length | None = _program(
        "", "How far the tool goes back along its axis before it goes up. [default: straight up]"
    )
    rewind: Length | None = _program(
        "",
        "Where a rotary axis would pass its limit in a cut, leave the cut along the tool by this length. "
        "The axis turns back above the retract, and the cut goes on. [default: an error]",
    )
    header: Path | None = _program("FILE", "Lines to write after the head; {program} and {units} are filled in.")
    footer: Path | None = _program("FILE", "Lines to write before the tail.")
    block_numbers: bool = _program("", "Number the blocks.", False)
    line_ends: Literal["lf", "crlf"] | None = _program(
        "", "What each line of the program ends with. [default: that of the control's table, lf]"
    )
    modal: bool = _program("", "Leave out words that repeat from block to block, where the control keeps them.", False)
    no_comments: bool = _program("", "Leave out what the CL file says in words.", False)

    axis_tolerance: float | None = _curves(
        "DEG",
        "Largest deviation of the tool axis where the tip is within -e, in place of -e at the axis point (-H): for"
        " ball-end mills, whose centre is all that counts.",
    )
    weights: Weights = _curves("", "Weights w1,w2 of the curves, up to 3. [default: 1,1]", (1.0, 1.0))
    reversal_angle: float = _curves("DEG", "Corners that turn by more stay sharp.", 170.0)

    lines: Literal["dense", "long"] | None = _lines(
        "", "Lines close to the curves, or as few as -e allows. [default: what suits the control]"
    )
    chord_tolerance: Length | None = _lines(
        "--chord", "Largest distance between the written lines and the curve. [default: a tenth of -e, at most 0.0005]"
    )
    block_time: Duration | None = _lines(
        "",
        "Shortest time in which the control takes a block, as in 1ms. At the programmed feed, no line along a curve "
        "takes less. [default: that of the control's table]",
    )
    axis_step: float | None = _lines("DEG", "Largest change of the tool axis in one line beside a rounded corner.")

    skip_cycles: bool = _holes(
        "",
        "Leave out holes whose cycle cannot be written; the program says NOT DRILLED there. [default: an error]",
        False,
    )
    cycles: Literal["moves", "native"] = _holes(
        "",
        "Holes as plain moves, or as the control's own cycles where it has such and the tool stays along Z (or in a "
        "tilted plane).",
        "moves",
    )
    planes: Literal["none", "tilted"] = _holes(
        "",
        "Whether a tool that keeps a tilted axis between rapids runs in a tilted plane of the control: CYCLE800, "
        "PLANE SPATIAL, G68.2, G254.",
        "none",
    )

    limits: MachineName | None = _limits(
        "NAME|FILE",
        "Say the time under the limits of this machine's axes; the words of the program stay as they are. A name that "
        "'cornersmooth machines' lists, or a TOML file with [dynamics.X] and so on. [default: those of --machine]",
    )
    time: bool = _limits("", "Say the time of programs of more than 20,000 poses, too.", False)
    feed_from_plan: bool = _limits(
        "",
        "Give every block the feed that a plan of the program reaches there, within --accel, --jerk and the limits of "
        "--machine: for controls that do not look ahead.",
        False,
    )
    accel: float = _limits("MM/S2", "Acceleration along the path.", 1000.0)
    jerk: float = _limits("MM/S3", "Jerk along the path.", 5000.0)
    centripetal: float | None = _limits("MM/S2", "Acceleration across the path. [default: that of --accel]")
    period: Duration = _limits(
        "TIME",
        "Interpolation period, as in 2ms: at corners that stay sharp the velocity changes by at most accel times "
        "period. [default: 2ms]",
        0.002,
    )
    rapid: float = _limits("MM/MIN", "Speed of rapid moves.", 10000.0)
    rapid_accel: float | None = _limits("MM/S2", "Acceleration of rapids. [default: that of --accel]")
    rapid_jerk: float | None = _limits("MM/S3", "Jerk of rapids. [default: that of --jerk]")
    angular_feed: float = _limits("DEG/S", "Speed of moves that only turn the tool axis.", 30.0)
    angular_accel: float = _limits("DEG/S2", "Their acceleration.", 150.0)
    angular_jerk: float = _limits("DEG/S3", "Their jerk.", 3000.0)
    look_ahead: Count | None = _limits("BLOCKS", "Blocks within which the control must be able to stop. [default: all]")
    tilt: Annotated[float, click.FloatRange(0.0, 90.0)] = _limits(
        "DEG", "Largest tilt about X and about Y, either way; 0 for none.", 45.0
    )
    no_turn: bool = _limits("", "Do not turn the part about Z. A table that turns without end does that itself.", False)
    plans: Count = _limits("", "Setups that are planned as written.", 6)

    format: Literal["apt", "points"] | None = _reading(
        "--input-format", "Form of the input, instead of what it looks like."
    )
    dialect: str | None = _reading(
        "NAME",
        "CL dialect, instead of what the file looks like: nx, catia, creo, solidworks, hsm, ncl, makino or plain.",
    )
    units: Units | None = _reading("", "Units of the input, where it does not say or says it wrong.")
    arc_rule: Literal["left", "right", "tangent"] | None = _reading("", "Sense of CIRCLE about its axis.")
    operation: str | None = _reading(
        "N|NAME",
        "Take one operation of the CL file alone, with the tool, spindle and coolant that hold there; "
        "'cornersmooth info' lists them.",
    )
    scale: Annotated[float, click.FloatRange(1e-6, 1e6)] = _reading(
        "", "Factor of all lengths of a table of points: 1000 where they are metres.", 1.0
    )
    flip_axis: bool = _reading("", "Turn the tool axes of a table round: they point into the part.", False)
    between_passes: Length | None = _reading(
        "MM",
        "Between the passes of a table, back along the tool axis by so much, over in rapid, and down at feed. A blank "
        "line, a comment, or another number in a column pass begins a pass.",
    )
    cycle_order: str | None = _reading(
        "WORD,...",
        "What the numbers without a word of CYCLE are, as the post-processor table of CATIA has them: DEPTH, FEED, "
        "PITCH, CLEAR, RAPTO, RETURN, STEP, DWELL or SKIP.",
    )
    lenient: bool = _reading("", "Go on after errors in the input where it is safe.", False)
    no_size_limit: bool = _reading("", "Read inputs of more than 2 GB, and gzip files that grow 200-fold.", False)
    tool_number: Annotated[int, click.IntRange(1, 99999999)] | None = _reading(
        "N", "Tool that is loaded first, with its length, for inputs that load none."
    )
    spindle: Spindle | None = _reading(
        "RPM[,CCLW]", "Speed of the spindle, clockwise or with CCLW counterclockwise, for inputs that start none."
    )
    tip_control: bool = _reading(
        "", "Tool tip control is on where the NC program begins: a subprogram, or kinematics that are always on.", False
    )
    stream: Path | None = _reading("PROGRAM", "Show what the control does in each block of a program; ? is not known.")
    tool: ToolShape = _reading(
        "D[,R[,TAPER[,LENGTH]]]",
        "Shape of the tool: diameter, corner radius, taper in degrees, length. [default: that of the file]",
    )
    text_machine: MachineName | None = _reading(
        "NAME|FILE", "Machine whose rotary words --text has. [default: that of its head, else --machine]"
    )

    no_verify: bool = _verification("", "Do not read the program back and measure it before it takes its place.", False)
    strict: bool = _verification(
        "", "Take no verdict but PASSED: else the program goes to OUT.failed, and 1 is returned.", False
    )
    slower: bool = _verification(
        "--planned-feeds",
        "Feeds of the program may be lower than those of the CL file, as --feedrate plan of smooth writes them.",
        False,
    )
    trusted: tuple[Path, ...] = _verification(
        "--trust FILE",
        "Lines of the program that you put there, as with --header and --footer of smooth. May be repeated.",
        (),
    )

    directory: Path | None = _batches(
        "-d", "Folder for the NC files of several inputs, made where missing; folders below an input stay folders."
    )
    glob: tuple[str, ...] = _batches(
        "PATTERN", "Files to take from folders, as in '*.cls'. May be repeated. [default: names of CL files]", ()
    )
    skip_existing: bool = _batches("", "Leave outputs that exist as they are, whatever they were made of.", False)
    summary: Path | None = _batches("", "Write a row for each file of a batch: .json or .csv.")
    jobs: Processes = _batches(
        "-j", "Processes for several inputs; a bare -j takes all cores. [default: 1]", 1, is_flag=False, flag_value=0
    )
    scheduler: str | None = _batches(
        "ADDRESS|FILE",
        "Have a Dask cluster do the files of a batch: tcp://HOST:8786, or the scheduler's file. See docs/batch.md.",
    )

    def load_control(self) -> Control:
        """Control of that name, of that file, or of the shop settings."""
        from cornersmooth.nc import load_control

        control: str | Control = self.control
        return load_control(control) if isinstance(control, str) else control

    def load_machine(self) -> Machine | None:
        """Machine of that name, of that file, or of the shop settings; None where none is named."""
        return _machine(self.machine)

    def load_limits(self) -> Machine | None:
        """Machine whose limits count, in place of those of the machine of the words."""
        return _machine(self.limits)

    def choose_form(self) -> Form:
        """Form of the control that the options ask for."""
        from cornersmooth.nc import choose_form

        with _named_as_typed():
            return choose_form(
                self.load_control(),
                self.form,
                machine=self.load_machine(),
                tcp=not self.no_tcp,
                extras=self.extras,
                digits=self.digits,
                rewind=self.rewind or 0.0,
                planes=self.planes == "tilted",
            )

    def settings(self) -> Settings:
        """How to smooth; options that a command does not have keep their defaults."""
        from cornersmooth.settings import Settings

        self.check_axis()
        names = (item.name for item in fields(Settings) if hasattr(self, item.name))
        with _named_as_typed():
            return Settings(**{name: getattr(self, name) for name in names})

    def check_axis(self) -> None:
        """Refuse a length and a tolerance of the axis in one command: the one takes the place of the other."""
        if self.axis_tolerance is not None and typed("axis_length") and typed("axis_tolerance"):
            raise click.UsageError("--axis-tolerance takes the place of -H/--axis-length: give one of them")

    def path_limits(self, names: str = LIMITS) -> Limits:
        """What the machine can do."""
        from cornersmooth.feedrate import Limits

        with _named_as_typed():
            return Limits(**{name: getattr(self, name) for name in names.split()})

    def planned_limits(self) -> Limits | None:
        """Limits of the plan whose feeds are written; None where they are the programmed ones (and UsageError)."""
        if self.feed_from_plan:
            return self.path_limits(PLANNED)
        for name in filter(typed, PLANNED.split()):
            raise click.UsageError(f"--{name} is for --feed-from-plan")
        return None

    def reading(self) -> dict[str, Any]:
        """Keyword arguments of `cornersmooth.read`."""
        more = {"size_limit": not self.no_size_limit, "machine": self.load_machine()}
        return {name: getattr(self, name) for name in _ARGUMENTS} | more

    def read(self) -> tuple[bytes, str, bool]:
        """Contents and name of the input, and whether it is an NC program; options of the other kind are refused."""
        from cornersmooth.nc_reader.recognition import first_block
        from cornersmooth.provenance import HEAD

        data, name = read_input(self.source, size_limit=not self.no_size_limit)
        program = first_block(data[:HEAD]) is not None
        for param in click.get_current_context().command.params:
            option = str(param.name)
            if not typed(option) or not getattr(self, option):
                continue
            if program and option in {"feed", *_ARGUMENTS} - {"units"}:
                what = f"{param.opts[-1]} is for CL files, and the input is an NC program; leave it out"
                raise click.UsageError(what)
            if not program and option == "tip_control":
                raise click.UsageError("--tip-control is for NC programs, and the input is a CL file; leave it out")
        return data, name, program

    def reading_back(self) -> dict[str, Any]:
        """Keyword arguments of `nc_reader.read_nc` for a program that somebody wrote (SettingsError CS204)."""
        from cornersmooth.nc_reader import CONTROLS

        control = self.load_control()
        if control.dialect not in CONTROLS:
            raise SettingsError(
                "CS204", f"{control.name} is like no control that can be read", 'say like = "fanuc" or another in it'
            )
        return {"control": control.dialect, "machine": self.load_machine(), "tcp": not self.no_tcp}


def _machine(machine: Any) -> Machine | None:
    from cornersmooth.kinematics import load_machine

    return load_machine(machine) if isinstance(machine, str) and machine else machine or None


@contextlib.contextmanager
def _named_as_typed() -> Iterator[None]:
    """Errors about a value name its option; those of the library name its field."""

    def spelled(text: str) -> str:
        return " ".join(FLAGS.get(word, [word])[-1] for word in text.split(" "))

    try:
        yield
    except SettingsError as wrong:
        field_name, verb, rest = wrong.what.partition(" is ")
        what = spelled(field_name) + verb + rest if wrong.code in ("CS202", "CS260") else wrong.what
        hint = spelled(wrong.hint) if wrong.code == "CS207" else wrong.hint
        raise SettingsError(wrong.code, what, hint, file=wrong.file, line=wrong.line) from None


def typed(name: str) -> bool:
    """Whether an option of the command that runs was given on the command line."""
    context = click.get_current_context(silent=True)
    return context is not None and context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE


#: of each option, the long one last
FLAGS = {
    item.name: [*flags, *([] if any(flag.startswith("--") for flag in flags) else [f"--{item.name.replace('_', '-')}"])]
    for item in fields(Options)
    if item.metadata
    for flags in [[word for word in item.metadata["spelled"].split() if word.startswith("-")]]
}


def under(*headings: str) -> str:
    """Names of the options with some headings."""
    return " ".join(item.name for item in fields(Options) if item.metadata.get("heading") in headings)


#: options that several commands have
CURVES, LINES = under("Curves"), under("Lines")
READING = "format dialect units arc_rule operation scale flip_axis between_passes cycle_order lenient no_size_limit"
WRITING = f"control machine {under('Control', 'Program', 'Holes and planes')}"
#: the feed of commands that only plan
FEED_OF_ALL = {"heading": "Limits", "help": "Feed of all feed moves instead of the programmed ones."}
#: helps of the limits of a plan whose feeds are written
PLANNED_HELPS = {
    item.name: str(item.metadata["help"])[:1].lower() + str(item.metadata["help"])[1:]
    for item in fields(Options)
    if item.name in PLANNED.split()
}
