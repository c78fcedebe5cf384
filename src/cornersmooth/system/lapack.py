"""LAPACK's solvers of symmetric positive definite systems with few diagonals.

`scipy.linalg` loads much that is not used here: half as long as all else that a short run loads. Its compiled module
alone loads in a hundredth of that; where another version of SciPy keeps it elsewhere, `scipy.linalg` is loaded.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.machinery import PathFinder
from importlib.util import module_from_spec
from pathlib import Path
from typing import Any

import scipy

_NAMES = ("dpbsv", "dpbtrf", "dpbtrs")


def _solvers() -> list[Callable[..., Any]]:
    spec = PathFinder.find_spec("_flapack", [str(Path(folder, "linalg")) for folder in scipy.__path__])
    if spec is not None and spec.loader is not None:
        try:
            module = module_from_spec(spec)
            spec.loader.exec_module(module)
        except ImportError:
            pass
        else:
            if all(hasattr(module, name) for name in _NAMES):
                return [getattr(module, name) for name in _NAMES]
    from scipy.linalg import lapack

    return [getattr(lapack, name) for name in _NAMES]


#: ``dpbsv(bands, right, lower=0, overwrite_ab=0)``: the factors, the solution, and 0 where all pivots are positive;
#: ``dpbtrf(bands)``: the factors, and 0; ``dpbtrs(factors, right)``: the solution, and 0
dpbsv, dpbtrf, dpbtrs = _solvers()
