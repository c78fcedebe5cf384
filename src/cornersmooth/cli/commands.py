"""All commands: arguments, options and helps. The work of each is `run_NAME`, in the module of its name or another."""

from __future__ import annotations

from cornersmooth.cli.command import EXIT_CODES_OF_READERS, EXIT_CODES_OF_WRITERS, new_command
from cornersmooth.cli.declared import (
    FEED_OF_ALL,
    LIMITS,
    LINES,
    PLANNED,
    PLANNED_ALONE,
    PLANNED_HELPS,
    READING,
    SHOP_ALONE,
    WRITING,
)

SMOOTH = new_command(
    "smooth",
    "IN...",
    "tolerance output form axis_length axis_tolerance directory glob summary jobs reports "
    f"as_json tool {WRITING} method {LINES} feed feed_from_plan {PLANNED} limits "
    f"{READING} tool_number spindle no_verify strict force quiet verbose",
    """
    Round the corners of the CL files IN and write NC programs.

    IN is an APT/CL file (NX, CATIA, Creo, ...) or a table of points (x y z i j k, or two points); - is standard input.
    The written path stays within the tolerance of the CL path, at the tool tip and at the axis point.

    \b
    Examples:
      cornersmooth smooth part.cls -e 0.04 -o part.nc
      cornersmooth smooth part.cls -e 0.04 -o part.nc --report part.html
      cornersmooth smooth part.cls -e 0.04 -f g6.2 -o part.nc --report part.csv
      cornersmooth smooth part.cls --control siemens -f bspline -o part.mpf
      cornersmooth smooth part.cls --method global -f g6.2 -o part.nc
      cornersmooth smooth part.cls --control linuxcnc --machine xyzac-trt -o p.ngc
      cornersmooth smooth part.ncl -e 0.0005in -H 25 -o part.nc
      cornersmooth smooth *.cls -e 0.04 -d out/ -j 2
      cornersmooth smooth cl/ -e 0.04 -d nc/ -j --summary made.csv
      cat part.cls | cornersmooth smooth - -e 0.04 > part.nc
    """,
    settings=f"{PLANNED_ALONE} {SHOP_ALONE}",
    epilog=f"{EXIT_CODES_OF_WRITERS} With several inputs: that of the worst.",
    **PLANNED_HELPS,
)

FILTER = new_command(
    "filter",
    "IN...",
    "tolerance output control machine no_tcp tip_control units form axis_length axis_tolerance directory glob reports "
    f"as_json method {LINES} limits no_verify strict force quiet verbose",
    """
    Smooth the cutting runs of the finished NC programs IN; every other byte stays.

    Runs of plain cuts are replaced where the state of the control is surely known. What the program does there today
    is what the new blocks stay within the tolerance of. Both programs are read again and compared. All other cuts stay
    as they are, and a table says why. - is standard input.

    \b
    Examples:
      cornersmooth filter part.ngc --control linuxcnc --machine xyzac-trt -o n.ngc
      cornersmooth filter part.mpf --control siemens -e 0.01 -o smooth.mpf
      cornersmooth filter part.nc -e 0.01 --lines long -o smooth.nc
      cornersmooth filter *.mpf --control siemens -d smooth/
      cat part.nc | cornersmooth filter - > smooth.nc
    """,
    epilog=f"{EXIT_CODES_OF_WRITERS} With several inputs: that of the worst.",
    reports="Write what was done: .json, or .html for a page to look at. May be repeated; {stem} is the input's name.",
    units="Units of a program that does not say them.",
)

VERIFY = new_command(
    "verify",
    "IN NC",
    "tolerance axis_length axis_tolerance control machine no_tcp trusted work_offset slower skip_cycles strict "
    f"{READING} tool_number spindle tip_control reports as_json tool force quiet verbose",
    """
    Measure the NC program NC against the CL file IN, whoever wrote it.

    Tip and axis point must stay within the tolerance of their paths, in order; rapids, statements, feeds and exact
    poses must be where the CL file has them. Shares no code with what smooths and writes.

    A program that cornersmooth has written says in its head how it was made; options come before it. What is taken
    from the head is named, and where it loosens the check without an option the verdict is NOT VERIFIED.

    \b
    Examples:
      cornersmooth verify part.cls part.nc
      cornersmooth verify part.cls part.nc -e 0.04 -H 25 --report poses.csv
      cornersmooth verify part.cls part.mpf -e 0.04 --control siemens
      cornersmooth verify part.cls part.ngc -e 0.04 --control linuxcnc
      cornersmooth verify part.cls part.nc -e 0.04 --report found.html
    """,
    epilog="Exit codes: 0 PASSED or INCOMPLETE; 1 FAILED or NOT VERIFIED, and INCOMPLETE under --strict; "
    "2 wrong usage or configuration; 3 an input cannot be read or is not valid; 4 output cannot be written.",
    strict="Take no verdict but PASSED: else 1 is returned.",
    work_offset={
        "heading": "Verification",
        "metavar": "none",
        "help": "'none': the program selects no work offset, as --work-offset none of smooth writes it.",
    },
    reports="Write what was found: .json for the results, .csv for a row per pose, .html for a page to look at. May be "
    "repeated.",
    verbose="More: every problem.",
)

SURFACE = new_command(
    "surface",
    "IN NC",
    f"tolerance axis_length tool stations levels control machine no_tcp {READING} reports as_json force quiet",
    """
    Measure the surface that the NC program NC leaves against that of the CL file IN.

    Points are taken on the envelope of the original motion of the tool, up to the length of its cutting edge (-H). At
    each the distance to the volume that the written motion sweeps says whether metal is cut below the surface (overcut)
    or left on it (undercut). The tool is that of the file (CUTTER, TLDATA) or of --tool.

    \b
    Examples:
      cornersmooth surface part.cls part.nc -e 0.04 -H 12
      cornersmooth surface part.cls part.nc --tool 10,5 --report map.html
      cornersmooth surface part.cls part.nc --tool 12,0,3 --report points.csv
    """,
    epilog="Exit codes: 0 the surface is within the tolerance; 1 it is not; 2 wrong usage or configuration; 3 an input "
    "cannot be read or is not valid; 4 output cannot be written.",
    module="verify",
    reports="Write what was found: .json, .csv for a row per point, .html for a page to look at. May be repeated.",
)

COMPARE = new_command(
    "compare",
    "IN",
    f"tolerance axis_length axis_tolerance control machine limits look_ahead feed {READING} tip_control "
    "as_json quiet verbose",
    """
    Write the CL file IN in every form, method and line density that the control can run, and compare the times.

    Every program is verified and planned as it is written, under the limits of the axes of --limits, or of --machine.
    Rows appear as they are ready. A time with ~ is that of a rough plan, up to 6 % too long; the best are planned
    closely. The best row is the fastest that keeps the tolerance; the command that writes it follows, and that of the
    best in lines. Of parts of more than 2,000 poses whole runs from the middle are compared. -v states by which law
    lines are planned. IN may be a finished NC program: every way in which filter can smooth it.

    \b
    Examples:
      cornersmooth compare part.cls --control siemens --limits table-ac
      cornersmooth compare part.cls --control fanuc --limits mill.toml --json
      cornersmooth compare part.cls --control linuxcnc --machine xyzac-trt -v
      cornersmooth compare part.ngc --control linuxcnc --machine xyzac-trt
    """,
    module="times",
)

TIME = new_command(
    "time",
    "IN",
    f"tolerance axis_length axis_tolerance {LIMITS} control form machine method limits text block_time "
    f"look_ahead {READING} tip_control as_json law csv force quiet",
    """
    Plan the CL file IN as it is and the program that the options write, under the same limits.

    The path of the CL file is planned twice: with a stop at the end of every move, and without. At corners, the
    velocity may then jump by what the acceleration allows in one period. The program is that of smooth with the same
    options, or --text. Delays, tool changes and the strokes of hole cycles are not counted. Limits are those of the
    tip, and of the axes of --limits or --machine.
    IN may be a finished NC program: its time as it is, and as filter smooths it, or beside that of --text.

    \b
    Examples:
      cornersmooth time part.cls -e 0.04 --limits table-ac
      cornersmooth time part.cls -e 0.04 --feed 1800 --accel 1000 --json
      cornersmooth time part.cls -e 0.04 --csv motion.csv
      cornersmooth time part.cls -e 0.04 --machine mill.toml --csv axes.csv
      cornersmooth time part.cls --text part.nc --block-time 1ms --look-ahead 200
      cornersmooth time part.ngc --control linuxcnc --machine xyzac-trt
    """,
    module="times",
    feed=FEED_OF_ALL,
    block_time="Shortest time that the control takes for one block, of lines to write and in the plan. [default: that "
    "of the control's table for lines, none in the plan]",
    csv="Write the motion, a row every period.",
)

SETUP = new_command(
    "setup",
    "IN",
    "limits tolerance axis_length axis_tolerance control form tilt no_turn plans "
    f"{LIMITS} method {LINES} {READING} as_json quiet",
    """
    Find how to clamp the part of the CL file IN so that its program takes the least time.

    The part is turned about Z and tilted about X and Y of the machine. Many setups are estimated; the best are
    smoothed, written and planned under the limits of the machine's axes, and compared with today's. Fixture, reach of
    the tool and collisions are not looked at: they are yours.

    \b
    Examples:
      cornersmooth setup part.cls --limits mill.toml
      cornersmooth setup part.cls --limits mill.toml --control siemens
      cornersmooth setup part.cls --limits table-ac --tilt 20 --json
    """,
    module="times",
    feed=FEED_OF_ALL,
    limits={
        "heading": "Everyday",
        "required": True,
        "help": "Machine that the program runs on: a name that 'cornersmooth machines' lists (its numbers are "
        "examples), or a TOML file with [dynamics.X] and so on.",
    },
)

INFO = new_command(
    "info",
    "IN",
    f"tolerance axis_length machine {READING} as_json",
    """
    Say what the CL file IN holds: dialect, moves, lengths, turns, axis changes, arcs, statements, findings.

    IN is an APT/CL file or a table of points; - is standard input. -e and -H do not write anything: they tell how many
    corners that tolerance would round, and what would limit them. --machine tells where its rotary axes accelerate
    most.

    \b
    Examples:
      cornersmooth info part.cls
      cornersmooth info part.ncl -e 0.05 -H 25
      cornersmooth info part.cls --json > part.json
    """,
    module="lookup",
)

CONTROLS = new_command(
    "controls",
    "[CONTROL]",
    "table as_json",
    """
    List the controls with their forms, or check and describe one.

    A TOML file of your own is like one of them and says only what is different; see docs/controls.md.

    \b
    Examples:
      cornersmooth controls
      cornersmooth controls siemens
      cornersmooth controls siemens --table > mine.toml
      cornersmooth controls mine.toml
    """,
    module="lookup",
)

MACHINES = new_command(
    "machines",
    "[MACHINE]",
    "table as_json pose",
    """
    List the machines that come with the program, or check and describe one.

    A machine has up to two rotary axes, each in a table or a head, with direction, point and limits. A TOML file
    describes your own. It may be like one of these and hold only what is different.

    \b
    Examples:
      cornersmooth machines
      cornersmooth machines xyzac-trt
      cornersmooth machines table-ac --table > mine.toml
      cornersmooth machines mine.toml
      cornersmooth machines mine.toml --pose A30,C45
      cornersmooth machines mine.toml --json
    """,
    module="lookup",
)

CONFIG = new_command(
    "config",
    "[IN]",
    "as_json",
    """
    Say which values 'cornersmooth smooth' would use for the file or folder IN, and where each comes from.

    Options come first, then the environment (CORNERSMOOTH_TOLERANCE), the file cornersmooth.toml in the folder of the
    input or above it, ~/.config/cornersmooth/cornersmooth.toml, and the defaults.

    \b
    Examples:
      cornersmooth config
      cornersmooth config jobs/part.cls
    """,
    module="lookup",
)

EXPLAIN = new_command(
    "explain",
    "[CODE]",
    "stream control machine no_tcp tip_control units as_json",
    """
    Explain the code of a message: its cause, what to do, and how it is printed. Without a code, list them all.

    With --stream, show a finished program as its control understands it: what each block sets and where it leads.

    \b
    Examples:
      cornersmooth explain
      cornersmooth explain CS337
      cornersmooth explain 337 --json
      cornersmooth explain --stream part.nc --control haas --machine table-bc
    """,
    module="lookup",
    epilog=EXIT_CODES_OF_READERS,
    units="Units of a program that does not say them.",
)

#: as the list of them shows them
GROUPS = {
    "Make programs": (SMOOTH, FILTER),
    "Check programs": (VERIFY, SURFACE),
    "Save time": (COMPARE, TIME, SETUP),
    "Look up": (INFO, CONTROLS, MACHINES, CONFIG, EXPLAIN),
}
COMMANDS = {str(command.name): command for commands in GROUPS.values() for command in commands}
