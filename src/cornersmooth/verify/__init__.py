"""Verification: whether an NC program runs the motion of the CL file, as a control would run it.

Shares no code with `smoothing` and `nc`::

    found = verify(program, "part.nc", tolerance=0.04, axis_length=10.0)
    found.passed, found.max_tip_deviation_mm, found.problems

A program is verified when the written motion can be run beside the motion of the CL file, both forward only, so that at
every moment the tips are within the tolerance and the axis points are within the tolerance. One way for every program::

    elements (from `nc_reader`) -> stretches -> passage -> checks -> result

=================== ===================================================================================================
what is decided     where
=================== ===================================================================================================
both as polylines   `task`, `motions`; how far they leave their chords, proved: `bending`
run beside another  `passage`: by a `chain` of nearest places, where that fails exactly (`free_space`)
stretch by stretch  `parse`: which elements do the acts; `batches` cuts long stretches; `match`: its places
retracts            `along_tool`: rapids beside them that posts add, and cuts that are left for them
holes               `holes`; poses that are named by their digits: `motions`; tool changes: `parse`
what parts          `deviation`: the lines and the distances; poses that must be exact
feeds               `feeds`; where a vertex may also be: `match`
words               package `nc_words`; what the CL file asks for: `statements`, and where: `word_places`
findings            `result`; the driver: `verifier`
=================== ===================================================================================================

A *place* is a segment of the CL path and a fraction of it. A *stop* is the end of a rapid, or the first pose.
A *stretch* is the run of feed moves between two stops. The *bend* of a step is how far the motion may leave its chord.
"""

from cornersmooth.system.processes import useful_processes
from cornersmooth.verify.result import Verification, Where
from cornersmooth.verify.task import Trust
from cornersmooth.verify.verifier import Verifier, verify

__all__ = [
    "Trust",
    "Verification",
    "Verifier",
    "Where",
    "useful_processes",
    "verify",
]
