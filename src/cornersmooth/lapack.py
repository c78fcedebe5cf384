"""LAPACK's solver of symmetric positive definite systems with few diagonals, at once.

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


def _solver() -> Callable[..., Any]:
    spec = PathFinder.find_spec("_flapack", [str(Path(folder, "linalg")) for folder in scipy.__path__])
    if spec is not None and spec.loader is not None:
        try:
            module = module_from_spec(spec)
            spec.loader.exec_module(module)
        except ImportError:
            pass
        else:
            if hasattr(module, "dpbsv"):
                return module.dpbsv  # type: ignore[no-any-return]
    from scipy.linalg.lapack import dpbsv

    return dpbsv


#: ``dpbsv(bands, right, lower=0, overwrite_ab=0)``: the factors, the solution, and 0 where all pivots are positive
dpbsv = _solver()
