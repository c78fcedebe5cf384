"""Verification: reads NC text as the control would and measures it against the CL program.

Shares no code with `smoothing` and `nc`::

    found = verify(program, "part.nc", tolerance=0.04, axis_length=10.0)
    found.passed, found.max_tip_deviation_mm, found.problems

One way for every text::

    bytes -> chunks -> tables -> elements -> batches -> matches -> checks -> result

================= =====================================================================================================
word              meaning
================= =====================================================================================================
block             an NC block: a line of the text
chunk, table      bytes read at a time; a run of motion blocks as columns of words
element           what a motion block does: rapid, line, arc or curve; rotary words may make several lines of one block
event             a word that stands beside the motion
trail, vertex     a motion as a polyline, and a point of it: inner points only where it is curved
place             segment and fraction of the CL path; its *length* is the path length up to there
stop              end of a rapid, or the first pose: named exactly by the text, it divides the motion
stretch           feed moves between two stops
batch             elements that are matched and measured at once; both ends of its stretches are known places
match             a batch with the place of every vertex
margin            what printed digits account for, mm; *slack* is that and what polylines cut short
================= =====================================================================================================

Where is what:

- bytes to elements: `source`, `reading_options`, `dialects`, `lexer`, `words`, `block_tables`, `line_patterns`;
  `reader` holds the modal state, `execution` executes: `arcs`, `splines`, `rotary`; `elements` is what comes out
- what is measured against: `task`, `polyline`
- elements to batches: `batches`, with `rapids`, `drilling`, and `guide` for long stretches
- where everything is: `match`, with `nearest` and `assignment`
- checks (`checks` lists them): `deviation`, `backtracking`, `feeds`, `continuity`; they share `distances`, with
  `wide_search`, `hull_bounds`, `curves`; what they find is in `findings`
- words beside the motion: `statements`
- all of it: `verifier`, `result`, with `workers`; `along` for pictures
"""

from cornersmooth.verify.along import Distribution, deviation_along
from cornersmooth.verify.elements import Event, NcProgram, Problem
from cornersmooth.verify.reader import CONTROLS, read_nc
from cornersmooth.verify.result import Verification, Where
from cornersmooth.verify.verifier import Verifier, verify
from cornersmooth.verify.workers import useful_processes

__all__ = [
    "CONTROLS",
    "Distribution",
    "Event",
    "NcProgram",
    "Problem",
    "Verification",
    "Verifier",
    "Where",
    "deviation_along",
    "read_nc",
    "useful_processes",
    "verify",
]
