"""Verification: reads NC text as the control would and measures it against the CL program.

Shares no code with `smoothing` and `nc`::

    found = verify(program, "part.nc", tolerance=0.04, axis_length=10.0)
    found.passed, found.max_tip_deviation_mm, found.problems

Where is what:

- text to `ncprogram`: `source`, `style`, `dialects`, `lexer`, `words`; `block_tables`, `line_patterns`, `fixed` for
  most lines at once; `reader` holds the modal state; `motion` executes: `arcs`, `splines`, `rotary`, `unknown`;
  `pile` gathers
- the CL motion and the written one as polylines: `trails`, `arcs`, `curves`
- what corresponds to what: `stops`, `holes`, `cycles`; then `blocks` with `gliding`, `anchors`, `walking`, `careful`
- measuring: `comparison`, `deviation`, `gaps`, `nearest`, `farther`, `hulls`, `order`, `joints`, `feeds`, `statements`
- all of it: `verifying`, `verification`; long texts in `sections`, `sectionwork`, with `processes`, `ring`, `workers`;
  `along` for pictures
"""

from cornersmooth.verify.along import Distribution, deviation_along
from cornersmooth.verify.ncprogram import Event, NcProgram, Problem
from cornersmooth.verify.reader import CONTROLS, read_nc
from cornersmooth.verify.result import Verification, Where
from cornersmooth.verify.verifying import Verifier, verify
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
