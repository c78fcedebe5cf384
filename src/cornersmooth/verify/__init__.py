"""Verification: reads NC text as the control would and measures it against the CL program.

Shares no code with `smoothing` and `nc`::

    found = verify(program, "part.nc", tolerance=0.04, axis_length=10.0)
    found.passed, found.max_tip_deviation_mm, found.problems
"""

from cornersmooth.verify.ncprogram import Event, NcProgram, Problem
from cornersmooth.verify.reader import read_nc
from cornersmooth.verify.verification import Verification, Where, verify

__all__ = ["Event", "NcProgram", "Problem", "Verification", "Where", "read_nc", "verify"]
