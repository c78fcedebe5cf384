"""Verification: measures NC text, as a control would run it, against the CL program.

Shares no code with `smoothing` and `nc`::

    found = verify(program, "part.nc", tolerance=0.04, axis_length=10.0)
    found.passed, found.max_tip_deviation_mm, found.problems

One way for every text::

    elements (from `nc_reader`) -> batches -> matches -> checks -> result

================= =====================================================================================================
word              meaning
================= =====================================================================================================
trail, vertex     a motion as a polyline, and a point of it: inner points only where it is curved
place             segment and fraction of the CL path; its *length* is the path length up to there
stop              end of a rapid, or the first pose: named exactly by the text, it divides the motion
stretch           feed moves between two stops
batch             elements that are matched and measured at once; both ends of its stretches are known places
match             a batch with the place of every vertex
margin            what printed digits account for, mm; *slack* is that and what polylines cut short
================= =====================================================================================================

Where is what:

- what is measured against: `task`, `polyline`
- elements to batches: `batches`, with `rapids`, `drilling` (`hole_lines`, `hole_search`, `hole_check`, tool changes of
  `statements`), and `guide` for long stretches
- where everything is: `match`, found by `search` with `nearest` and `assignment`
- checks (`checks` lists them): `deviation`, `backtracking`, `feeds`, `continuity`; they share `distances`, with
  `wide_search`, `hull_bounds`; what they find is in `findings`
- words: `word_check` against `nc_reader.word_list`; `word_places`: where those beside the motion stand, for the package
  `statements`, which compares what they say
- all of it: `verifier`, `result`
"""

from cornersmooth.processes import useful_processes
from cornersmooth.verify.result import Verification, Where
from cornersmooth.verify.verifier import Verifier, verify

__all__ = [
    "Verification",
    "Verifier",
    "Where",
    "useful_processes",
    "verify",
]
