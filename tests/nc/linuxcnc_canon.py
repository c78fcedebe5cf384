"""Prints every position that LinuxCNC's interpreter makes of a program: kind, line, X Y Z in mm, A B C in degrees.

Arcs, dwells and tools too, with the numbers that the interpreter gives, and offsets in units of the program.

Runs under Debian's Python, which has LinuxCNC's modules. It takes names of files from standard input, a line each, and
answers each with the exit code, where FILE.rows has the positions and FILE.errors the interpreter's words for an error.
A copy of this process reads each, so that no program knows of another; `oracle.interpreter` asks it.
"""

import os
import sys
import tempfile

import gcode

MM_PER_INCH = 25.4


class Canon:
    """What the interpreter calls; names and arguments are its own."""

    def __init__(self, parameters):
        self.parameter_file = parameters
        self.line = 0
        self.scale = MM_PER_INCH
        self.plane = 17

    def next_line(self, state):
        self.line = state.sequence_number

    def _show(self, kind, numbers):
        values = [value * self.scale for value in numbers[:3]] + list(numbers[3:6])
        print(kind, self.line, *(repr(value) for value in values))

    def straight_feed(self, *numbers):
        self._show("feed", numbers)

    def straight_traverse(self, *numbers):
        self._show("rapid", numbers)

    def _say(self, kind, *numbers):
        print(kind, self.line, *map(repr, numbers))

    def arc_feed(self, first, second, *rest):
        """The end as X Y Z, then the numbers that the interpreter gives."""
        along = rest[3]
        ends = {17: (first, second, along), 18: (second, along, first), 19: (along, first, second)}
        self._say("arc", *(value * self.scale for value in ends[self.plane]), *rest)

    def dwell(self, seconds):
        self._say("dwell", seconds)

    def set_feed_rate(self, rate):
        """In mm, or degrees, a minute; of no kind that others count."""
        self._say("feed_rate", rate * self.scale)

    def change_tool(self, pocket):
        self._say("tool", pocket)

    def set_g5x_offset(self, *numbers):
        self._say("g5x", *numbers)

    def set_g92_offset(self, *numbers):
        self._say("g92", *numbers)

    def tool_offset(self, *numbers):
        self._say("length", *numbers)

    def set_plane(self, plane):
        self.plane = {1: 17, 2: 19, 3: 18}[plane]
        self._say("plane", plane)

    def get_tool(self, pocket):
        return (-1,) + (0.0,) * 12 + (0,)

    def get_axis_mask(self):
        return 0x3F

    def get_external_length_units(self):
        return 1.0

    def get_external_angular_units(self):
        return 1.0

    def get_block_delete(self):
        return False

    def check_abort(self):
        return False

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        return lambda *numbers: None


def show(name):
    """Print the rows of a program."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "parameters.var")
        open(path, "w").close()
        result, last = gcode.parse(name, Canon(path), "G21", "")
    if result > gcode.MIN_ERROR:
        sys.exit(f"line {last}: {gcode.strerror(result)}")


for line in sys.stdin:
    program = line.rstrip("\n")
    child = os.fork()
    if not child:
        for number, ending in ((1, ".rows"), (2, ".errors")):
            os.dup2(os.open(program + ending, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        show(program)
        break
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
