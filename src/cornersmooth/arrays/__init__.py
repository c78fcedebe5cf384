"""Arrays: what their types are called, arithmetic of vectors, some rows of some columns."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Ints: TypeAlias = NDArray[np.int64]
Bools: TypeAlias = NDArray[np.bool_]
#: rows and poses where there are millions: half the memory
Numbers: TypeAlias = NDArray[np.int32]
