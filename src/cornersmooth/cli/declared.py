"""Every option of every command, once: what it is called, what it may be, and what its help says.

Those of smoothing and limits are declared in `cornersmooth.settings`, those of the frame of a program in
`cornersmooth.frame`, and only named here. Annotations are types here and no texts: options are made of them.
"""

from dataclasses import dataclass, field, fields
from functools import partial
from typing import Annotated, Any, Literal

import click

from cornersmooth.cli.parameters import (
    ControlName,
    Duration,
    Length,
    MachineName,
    Path,
    Processes,
    Spindle,
    ToolShape,
)
from cornersmooth.frame import FrameSettings
from cornersmooth.settings import AUTO, METHODS, Limits, Settings

Count = Annotated[int, click.IntRange(min=1)]
Units = Literal["mm", "inch"]


def option(heading: str, spelled: str, help: str, default: Any = None, **given: Any) -> Any:
    """Field of an option under a heading; `given` is as `click.Option` takes it.

    It is spelled by flags, and by what the help shows in the place of the value. The long flag is the field's name if
    there is none. The default is that of the command line, and of the commands that do not have the option.
    """
    return field(default=default, metadata={"heading": heading, "spelled": spelled, "help": help, **given})


def declared(heading: str, group: type, name: str, shown: str = "", **given: Any) -> Any:
    """Field of an option that a group of `cornersmooth.settings` declares; `shown` is in the place of the value."""
    item = next(item for item in fields(group) if item.name == name)
    about, instead = item.metadata["help"], item.metadata["instead"]
    about += f" [default: that of --{instead.replace('_', '-')}]" if instead else ""
    default = given.pop("default", item.default)
    return option(heading, f"{item.metadata['flags']} {shown}", about, default, **given)


#: parts of the helps in their order; the first holds the options of every day
HEADINGS = (
    "Everyday,Output,Control,Program,Curves,Lines,Holes and planes,Limits,Reading,Verification,Batches,Settings".split(
        ","
    )
)
_everyday, _output, _control, _program, _curves, _lines, _holes, _limits, _reading, _verification, _batches, _ = (
    partial(option, heading) for heading in HEADINGS
)
_limit = partial(declared, "Limits", Limits)
_frame = partial(declared, "Program", FrameSettings)


@dataclass(frozen=True, kw_only=True)
class Declared:
    """Arguments and options as click has read them; the types of the fields say what these may be.

    A command has some of them; the others have their defaults. Lengths are mm, angles degrees, times s.
    """

    # arguments
    inputs: tuple[str, ...] = ()
    source: str = ""
    name: str | None = None  #: of a control, a machine or a code

    tolerance: Length = declared("Everyday", Settings, "tolerance")
    axis_length: Length = declared("Everyday", Settings, "axis_length")
    form: str | None = _everyday(
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
    limits: MachineName | None = _everyday(
        "NAME|FILE",
        "Say the time under the limits of this machine's axes. The form of the words stays as it is; smooth takes the "
        "faster --method for lines by this time. A name that 'cornersmooth machines' lists, or a TOML file with "
        "[dynamics.X] and so on. [default: those of --machine]",
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
    law: Literal["direct_exact_stop", "direct_velocity_jump", "as_written"] = _output(
        "LAW", "Motion that --csv writes: as_written, direct_exact_stop or direct_velocity_jump.", "as_written"
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

    program_name: str | None = _frame("program", "TEXT")
    work_offset: str | None = _frame("work_offset", "WORD")
    approach: Length | None = _frame("approach", default=None)
    retract: Length | None = _frame("retract", default=None)
    rewind: Length | None = _program(
        "",
        "Where a rotary axis would pass its limit in a cut, leave the cut along the tool by this length. "
        "The axis turns back above the retract, and the cut goes on. [default: an error]",
    )
    header: Path | None = _frame("header", "FILE", default=None)
    footer: Path | None = _frame("footer", "FILE", default=None)
    block_numbers: bool = _frame("block_numbers")
    line_ends: Literal["lf", "crlf"] | None = _frame("line_ends")
    modal: bool = _frame("modal")
    no_comments: bool = _frame("comments", default=False)

    method: Annotated[str, click.Choice([AUTO, *METHODS])] = declared("Curves", Settings, "method")
    axis_tolerance: float | None = declared("Curves", Settings, "axis_tolerance", "DEG")

    lines: Literal["dense", "long"] | None = declared("Lines", Settings, "lines")
    chord_tolerance: Length | None = declared("Lines", Settings, "chord_tolerance")
    block_time: Duration | None = declared("Lines", Settings, "block_time")

    skip_cycles: bool = declared("Holes and planes", FrameSettings, "skip_cycles")
    cycles: Literal["moves", "native"] = declared("Holes and planes", FrameSettings, "cycles")
    planes: Literal["none", "tilted"] = _holes(
        "",
        "Whether a tool that keeps a tilted axis between rapids runs in a tilted plane of the control: CYCLE800, "
        "PLANE SPATIAL, G68.2, G254.",
        "none",
    )

    time: bool = _limits("", "Say the time of programs of more than 20,000 poses, too.", False)
    feed_from_plan: bool = _limits(
        "",
        "Give every block the feed that a plan of the program reaches there, within the limits of --machine: for "
        "controls that do not look ahead.",
        False,
    )
    accel: float = _limit("accel", "MM/S2")
    jerk: float = _limit("jerk", "MM/S3")
    centripetal: float | None = _limit("centripetal", "MM/S2")
    period: Duration = _limit("period", "TIME")
    rapid: float = _limit("rapid", "MM/MIN")
    rapid_accel: float | None = _limit("rapid_accel", "MM/S2")
    rapid_jerk: float | None = _limit("rapid_jerk", "MM/S3")
    angular_feed: float = _limit("angular_feed", "DEG/S")
    angular_accel: float = _limit("angular_accel", "DEG/S2")
    angular_jerk: float = _limit("angular_jerk", "DEG/S3")
    look_ahead: Count | None = _limits("BLOCKS", "Blocks within which the control must be able to stop. [default: all]")
    tilt: Annotated[float, click.FloatRange(0.0, 90.0)] = _limits(
        "DEG", "Largest tilt about X and about Y, either way; 0 for none.", 45.0
    )
    no_turn: bool = _limits("", "Do not turn the part about Z. A table that turns without end does that itself.", False)
    plans: Count = _limits("", "Setups that are planned as written.", 6)

    dialect: str | None = _reading(
        "NAME",
        "CL dialect, instead of what the file looks like: nx, catia, creo, solidworks, mfgsuite, hsm, ncl, makino or "
        "plain. A table of points is 'points'.",
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

    no_verify: bool = _verification("", "Do not read the program back and measure it before it takes its place.", False)
    strict: bool = _verification(
        "", "Take no verdict but PASSED: else the program goes to OUT.failed, and 1 is returned.", False
    )
    slower: bool = _verification(
        "--planned-feeds",
        "Feeds of the program may be lower than those of the CL file, as --feed-from-plan of smooth writes them.",
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
    summary: Path | None = _batches("", "Write a row for each file of a batch: .json or .csv.")
    jobs: Processes = _batches(
        "-j", "Processes for several inputs; a bare -j takes all cores. [default: 1]", 1, is_flag=False, flag_value=0
    )
    scheduler: str | None = _batches(
        "ADDRESS|FILE",
        "Have a Dask cluster do the files of a batch: tcp://HOST:8786, or the scheduler's file. See docs/batch.md.",
    )


#: of each option, the long one last
FLAGS = {
    item.name: [*flags, *([] if any(flag.startswith("--") for flag in flags) else [f"--{item.name.replace('_', '-')}"])]
    for item in fields(Declared)
    if item.metadata
    for flags in [[word for word in item.metadata["spelled"].split() if word.startswith("-")]]
}


def under(*headings: str) -> str:
    """Names of the options with some headings."""
    return " ".join(item.name for item in fields(Declared) if item.metadata.get("heading") in headings)


#: limits of plans, in the order of the helps
LIMITS = "feed accel jerk centripetal period rapid rapid_accel rapid_jerk angular_feed angular_accel angular_jerk"
#: those of a plan whose feeds are written, with options and without
PLANNED, PLANNED_ALONE = "accel jerk period", "centripetal"
#: options that several commands have
LINES = under("Lines")
READING = "dialect units arc_rule operation scale flip_axis between_passes cycle_order lenient"
CONTROL = under("Control", "Holes and planes")
WRITING = f"control machine {CONTROL} program_name work_offset approach retract rewind header footer"
#: those that `cornersmooth.toml` and the environment alone give: of shops, not of runs
SHOP_ALONE = "block_numbers line_ends modal no_comments no_size_limit scheduler time"
#: helps of the limits of a plan whose feeds are written
PLANNED_HELPS = {
    item.name: f"With --feed-from-plan: {item.metadata['help'][:1].lower()}{item.metadata['help'][1:]}"
    for item in fields(Declared)
    if item.name in PLANNED.split()
}
#: the feed of commands that only plan
FEED_OF_ALL = {"heading": "Limits", "help": Limits.__dataclass_fields__["feed"].metadata["help"]}
