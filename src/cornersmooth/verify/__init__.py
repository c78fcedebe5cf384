"""Verification: reads NC text as the control would and measures it against the CL program.

Shares no code with `smoothing` and `nc`::

    found = verify(program, "part.nc", tolerance=0.04, axis_length=10.0)
    found.passed, found.max_tip_deviation_mm, found.problems
"""

from cornersmooth.verify.along import Distribution, deviation_along
from cornersmooth.verify.ncprogram import Event, NcProgram, Problem
from cornersmooth.verify.reader import CONTROLS, read_nc
from cornersmooth.verify.verification import Verification, Where
from cornersmooth.verify.verifying import Verifier, verify

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
    "verify",
]
