"""Arrays as text for the page: one block of bytes, compressed, in base64, and a table that says what is where."""

from __future__ import annotations

import base64
import gzip
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: types that a browser has arrays of, by the name of the page
_TYPES = {"f4": np.float32, "i4": np.int32, "u1": np.uint8}

#: starts of arrays are multiples of this: typed arrays want to be aligned
_ALIGNED = 4


class Pack:
    """Arrays by name, for `text` and `table`."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._length = 0
        self.table: dict[str, dict[str, Any]] = {}

    def add(self, name: str, values: NDArray[Any], kind: str, bits: int | None = None) -> None:
        """Add an array (n,) or (n, w) as ``"f4"``, ``"i4"`` or ``"u1"``; to so many binary places it packs better."""
        if bits is not None:
            values = np.ldexp(np.round(np.ldexp(values, bits)), -bits)
        data = np.ascontiguousarray(values, dtype=np.dtype(_TYPES[kind]).newbyteorder("<")).tobytes()
        width = 1 if values.ndim == 1 else values.shape[1]
        self.table[name] = {"type": kind, "at": self._length, "count": len(values), "width": width}
        padding = -len(data) % _ALIGNED
        self._parts.append(data + bytes(padding))
        self._length += len(data) + padding

    def text(self) -> str:
        """Everything in base64 of gzip; the same arrays give the same text."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), 6, mtime=0)).decode("ascii")
