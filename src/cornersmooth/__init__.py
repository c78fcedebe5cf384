"""Rounds the corners of five-axis tool paths within a tolerance.

What the command does, in one call: read, smooth, write, measure the text, and only then replace the file::

    result = cornersmooth.postprocess("part.cls", "part.nc", cornersmooth.Settings(tolerance=0.04))
    result.verification.max_tip_deviation_mm, result.findings, result.report()

Step by step, with the numbers in between; the form says which digits the control keeps::

    form = cornersmooth.choose_form("fanuc", "g1")
    program = cornersmooth.read("part.cls")  # or cornersmooth.from_poses(tips, axes, feed=1500)
    smoothed = cornersmooth.smooth(program, cornersmooth.Settings(tolerance=0.04), form=form)
    with open("part.nc", "wb") as stream:
        cornersmooth.write(smoothed, stream, form=form)
    found = cornersmooth.verify(program, "part.nc", tolerance=0.04)

- `sample` gives points on the smoothed path, `corner_table` its corners
- `filter_program` smooths the runs of a finished NC program
- `plan` and `direct` say how long a machine takes for the smoothed and the original path
- `choose_form`, `load_control` and `load_machine` take names or TOML files; `Frame` holds what stands around the motion
- `CornersmoothError` is raised for input, settings and output; its text says where, what, and what to do

Nothing is imported before it is used, so that the command line answers at once.
"""

from __future__ import annotations

import sys

TYPE_CHECKING = False  # typing takes longer to load than all the rest
if TYPE_CHECKING:
    from typing import Any

    from cornersmooth.cl import read as read
    from cornersmooth.errors import CornersmoothError as CornersmoothError
    from cornersmooth.errors import Finding as Finding
    from cornersmooth.errors import Verdict as Verdict
    from cornersmooth.errors import VerdictError as VerdictError
    from cornersmooth.feedrate import Limits as Limits
    from cornersmooth.feedrate import TimeLaw as TimeLaw
    from cornersmooth.feedrate import direct as direct
    from cornersmooth.feedrate import plan as plan
    from cornersmooth.filter import filter_program as filter_program
    from cornersmooth.kinematics import load_machine as load_machine
    from cornersmooth.model import Corners as Corners
    from cornersmooth.model import Program as Program
    from cornersmooth.model import SmoothProgram as SmoothProgram
    from cornersmooth.model import Statement as Statement
    from cornersmooth.nc import Frame as Frame
    from cornersmooth.nc import choose_form as choose_form
    from cornersmooth.nc import fit_settings as fit_settings
    from cornersmooth.nc import load_control as load_control
    from cornersmooth.nc import write as write
    from cornersmooth.pipeline import Result as Result
    from cornersmooth.pipeline import postprocess as postprocess
    from cornersmooth.pipeline import smooth as smooth
    from cornersmooth.report.tables import corner_table as corner_table
    from cornersmooth.settings import Settings as Settings
    from cornersmooth.smoothing.sampling import PathPoints as PathPoints
    from cornersmooth.smoothing.sampling import sample as sample
    from cornersmooth.verify import Verification as Verification
    from cornersmooth.verify import verify as verify

    from_poses = Program.from_poses

__version__ = "0.4.0.dev0"

#: module of each public name
_HOME = {
    name: module
    for module, names in {
        "cl": "read",
        "errors": "CornersmoothError Finding Verdict VerdictError",
        "feedrate": "Limits TimeLaw direct plan",
        "filter": "filter_program",
        "kinematics": "load_machine",
        "model": "Corners Program SmoothProgram Statement from_poses",
        "nc": "Frame choose_form fit_settings load_control write",
        "smoothing.sampling": "PathPoints sample",
        "pipeline": "Result postprocess smooth",
        "report.tables": "corner_table",
        "settings": "Settings",
        "verify": "Verification verify",
    }.items()
    for name in names.split()
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    from importlib import import_module

    if name not in _HOME:
        raise AttributeError(f"module 'cornersmooth' has no attribute {name!r}")
    module = import_module(f"cornersmooth.{_HOME[name]}")
    return module.Program.from_poses if name == "from_poses" else getattr(module, name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]


class _Package(type(sys)):  # type: ignore[misc]  # the type of modules
    """The package, whose functions are not hidden by the packages of the same name that they come from."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOME and isinstance(value, type(sys))):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
