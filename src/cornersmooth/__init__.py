"""Rounds the corners of five-axis tool paths within a tolerance.

The whole program in three calls::

    program = cornersmooth.read("part.cls")
    smoothed = cornersmooth.smooth(program, cornersmooth.Settings(tolerance=0.04))
    with open("part.nc", "wb") as stream:
        cornersmooth.write(smoothed, stream)

`cornersmooth.verify.verify` measures NC text against a program, `cornersmooth.report.report` tells the whole story as
a dictionary, `cornersmooth.plan` says how long a machine takes. Nothing is imported before it is used, so that the
command line answers at once.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cornersmooth.cl import read
    from cornersmooth.errors import CornersmoothError, Finding
    from cornersmooth.feedrate import Limits, TimeLaw, compare, direct, plan
    from cornersmooth.model import Corners, Program, SmoothProgram, Statement
    from cornersmooth.nc import fit_settings, write
    from cornersmooth.settings import Settings
    from cornersmooth.smoothing import smooth

__version__ = "0.1.0"

_HOME = {
    "read": "cl",
    "smooth": "smoothing",
    "fit_settings": "nc",
    "write": "nc",
    "Settings": "settings",
    "plan": "feedrate",
    "direct": "feedrate",
    "compare": "feedrate",
    "Limits": "feedrate",
    "TimeLaw": "feedrate",
    "CornersmoothError": "errors",
    "Finding": "errors",
    "Corners": "model",
    "Program": "model",
    "SmoothProgram": "model",
    "Statement": "model",
}

__all__ = [
    "Corners",
    "CornersmoothError",
    "Finding",
    "Limits",
    "Program",
    "Settings",
    "SmoothProgram",
    "Statement",
    "TimeLaw",
    "compare",
    "direct",
    "fit_settings",
    "plan",
    "read",
    "smooth",
    "write",
]


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _HOME:
        raise AttributeError(f"module 'cornersmooth' has no attribute {name!r}")
    return getattr(import_module(f"cornersmooth.{_HOME[name]}"), name)
