"""Memory of this process: what becomes of arrays that nobody uses any more."""

from __future__ import annotations

import ctypes
import sys

#: arrays of so many bytes get memory of their own: those with a row for every pose of a large program do, those of a
#: batch do not
_LARGE = 4 << 20

#: free memory behind all that is used is given back from so many bytes on
_TRIMMED = 64 << 20

#: parameters of mallopt (malloc.h)
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8


def return_large_arrays() -> None:
    """Have large arrays given back to the system as soon as they are free; for the whole process, with glibc.

    The allocator of glibc raises the size from which it does so to 32 MB by itself. What is free but kept is copied
    after a fork by whichever process writes there, and kept by the others.
    """
    if sys.platform == "linux" and (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)) is not None:
        mallopt(_M_MMAP_THRESHOLD, _LARGE)
        mallopt(_M_TRIM_THRESHOLD, _TRIMMED)
        mallopt(_M_ARENA_MAX, 1)  # what one thread frees another takes


def return_free_memory() -> None:
    """Give back what is free between arrays that are in use; with glibc."""
    if sys.platform == "linux" and (trim := getattr(ctypes.CDLL(None), "malloc_trim", None)) is not None:
        trim(0)
