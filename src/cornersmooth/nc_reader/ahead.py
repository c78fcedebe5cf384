"""Elements of a text as they are read: those that have been read and are still wanted."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from cornersmooth.nc_reader.elements import Elements


class Ahead:
    """Elements of a text as they are read: those that have been read and are still wanted."""

    def __init__(self, chunks: Iterable[Elements]) -> None:
        self._chunks = iter(chunks)
        self._held: Elements | None = None
        #: number of the first element that is kept
        self.base = 0
        #: elements read so far
        self.count = 0

    @property
    def nc(self) -> Elements:
        """What is kept; at least one element must have been read."""
        assert self._held is not None
        return self._held

    def has(self, element: int) -> bool:
        """Whether there is such an element; reads on as far as need be."""
        if element >= self.count:
            # what is long already grows by a half, so that it is not copied too often
            wanted = max(element + 1, self.count + (self.count - self.base) // 2)
            parts = [] if self._held is None else [self._held]
            while self.count < wanted and (chunk := next(self._chunks, None)) is not None:
                self.count += len(chunk)
                parts.append(replace(chunk, tip=chunk.tip.copy(), second=chunk.second.copy()))  # see `put`
            self._held = Elements.joined(parts) if parts else None
        return element < self.count

    def part(self, first: int, stop: int) -> Elements:
        """Elements from `first` to `stop`, the latter excluded, counted anew."""
        return self.nc.part(first - self.base, stop - self.base)

    def put(self, element: int, other: int) -> None:
        """Put an element to where another ends."""
        for values in (self.nc.tip, self.nc.second):
            values[element - self.base] = values[other - self.base]

    def forget(self, element: int) -> None:
        """Drop all elements before one."""
        if element > self.base:
            self._held, self.base = self.part(element, self.count), element
