"""Work on several pieces at once: numpy leaves the interpreter free while it works on large arrays."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import islice
from typing import Final, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

#: more threads only wait for one another: the interpreter runs one of them at a time between the arrays
MOST_THREADS: Final = 4


#: items taken ahead of what has been given out, whatever the number of threads: what comes out never depends on it
_AHEAD: Final = 5


def threads() -> int:
    """Threads to work with."""
    return max(1, min(MOST_THREADS, os.cpu_count() or 1))


def ahead(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Give out what `work` makes of each item, in order, while the next ones are worked on.

    Items are taken as they are needed, by the caller's thread; few are in flight at any time.
    """
    source = iter(items)
    first = list(islice(source, 2))
    if len(first) < 2:  # not worth a thread
        yield from map(work, first)
        return
    waiting: deque[Future[Result]] = deque()
    with ThreadPoolExecutor(threads()) as pool:
        try:
            waiting.extend(pool.submit(work, item) for item in first)
            for item in source:
                waiting.append(pool.submit(work, item))
                if len(waiting) >= _AHEAD:
                    yield waiting.popleft().result()
            while waiting:
                yield waiting.popleft().result()
        finally:
            for future in waiting:
                future.cancel()
