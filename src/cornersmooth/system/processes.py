"""Processes of their own: how many, how they begin and end, work that they share, and memory that they give back.

Between small arrays the interpreter is the bottleneck, and threads only wait for one another. A forked process has all
data of its parent without copying it.
"""

from __future__ import annotations

import ctypes
import mmap
import os
import pickle
import signal
import sys
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any, Final, TypeVar

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

Item = TypeVar("Item")
Result = TypeVar("Result")

#: more find too little to do
MOST_PROCESSES: Final = 4

#: items taken ahead of what has been given out, whatever the number of processes: what comes out never depends on it
_AHEAD: Final = 5

#: bytes that a process shares with another for the arrays of an item, which take memory only as they are used
_ROOM: Final = 32 << 20
_ALIGNED: Final = 64

#: how processes begin; elsewhere as the system has it: a process of a batch begins anew there
_START: Final = "fork" if sys.platform == "linux" else None

#: after so many seconds a wait looks for signals: Windows ends it for Ctrl-C only
_LOOK: Final = 0.5

#: the message of a process that has gone without a word, which is what a system short of memory does
_ENDED: Final = "a process that helped was ended"


def useful_processes() -> int:
    """Processes that this computer has room for."""
    linux = sys.platform == "linux" and hasattr(os, "sched_getaffinity")
    allowed = len(os.sched_getaffinity(0)) if linux else os.cpu_count() or 1
    return max(1, min(MOST_PROCESSES, allowed))


def can_fork() -> bool:
    """Whether the system can fork a process with numpy in it safely."""
    return sys.platform == "linux" and hasattr(os, "fork")


class Helper:
    """A process that works on what it is sent; it has all that this one has, and may fork unless it is a daemon.

    It has one item at a time: a pipe full both ways would stand still. `others` are helpers that are there already.
    """

    def __init__(self, work: Callable[[Any], Any], others: Iterable[Helper] = (), *, daemon: bool = False) -> None:
        from multiprocessing import get_context  # a small program needs no other process, and this takes long to load

        context = get_context(_START)
        self.connection, other_end = context.Pipe()
        self._room = mmap.mmap(-1, _ROOM) if can_fork() else None  # which both have
        ends = [*(other.connection for other in others), self.connection]
        with warnings.catch_warnings():  # newer Pythons warn of threads, of which only numpy's idle ones are left
            warnings.simplefilter("ignore", DeprecationWarning)
            self._process = context.Process(target=_serve, args=(work, other_end, ends, self._room), daemon=daemon)
            self._process.start()
        self.pid = self._process.pid
        other_end.close()
        self._found = deque[Any]()
        self._working = False

    @property
    def works(self) -> bool:
        """Whether it has not found yet what it was given."""
        return self._working and not self.connection.poll()

    def start(self, item: Any = None) -> None:
        """Send an item, after what was found for the one before has been taken in."""
        self._take()
        try:
            self.connection.send(_packed(item, self._room))
        except BrokenPipeError:
            raise MemoryError(_ENDED) from None
        self._working = True

    def result(self) -> Any:
        """Wait for what the work returns, in the order of the items, or raise what it raised.

        Raises MemoryError: the process has been ended from outside, which is what a system short of memory does.
        """
        if not self._found:
            self._take()
        return self._found.popleft()

    def _take(self) -> None:
        if not self._working:
            return
        self._working = False
        try:
            good, found = self.connection.recv()
        except (EOFError, ConnectionResetError):
            raise MemoryError(_ENDED) from None
        if not good:
            raise found
        self._found.append(found)

    def end(self) -> int:
        """End the process, whatever it is at; return its exit code, or the number of its signal with a minus."""
        self.connection.close()
        self._process.terminate()
        self._process.join()
        code = self._process.exitcode or 0
        self._process.close()
        return code

    def kill(self) -> None:
        """End the process without its consent; for signal handlers, too."""
        self._process.kill()
        self._process.join(1.0)


def first_ready(helpers: Iterable[Helper]) -> list[Helper]:
    """Wait until one or more have ended their work."""
    from multiprocessing.connection import wait

    by_connection = {helper.connection: helper for helper in helpers}
    while not (ready := wait([*by_connection], _LOOK)):
        pass
    return [by_connection[one] for one in ready]  # type: ignore[index]


def map_in_processes(work: Callable[[Item], Result], items: Iterable[Item], processes: int) -> Iterator[Result]:
    """Give out what `work` makes of each item, in order, as `processes` processes find it.

    Items are taken as they are needed, a fixed number ahead; none before the processes have been forked, which would
    keep copies of them. Nothing leaves this process where there is to be only one or the system cannot fork safely.

    Raises MemoryError where a process has been ended from outside, which is what a system short of memory does.
    """
    crew: list[Helper] = []
    for _ in range(processes) if processes > 1 and can_fork() else ():
        crew.append(Helper(work, crew, daemon=True))
    waiting: deque[Callable[[], Result]] = deque()

    def start(item: Item) -> Callable[[], Result]:
        if not crew:
            found = work(item)
            return lambda: found
        free = next((member for member in crew if not member.works), None) or first_ready(crew)[0]
        crew.remove(free)
        crew.append(free)  # all have their turn
        free.start(item)
        return free.result

    try:
        for item in items:
            if len(waiting) == _AHEAD:
                yield waiting.popleft()()
            waiting.append(start(item))
            del item
        while waiting:
            yield waiting.popleft()()
    finally:
        for member in crew:
            member.end()


def _packed(item: Any, room: mmap.mmap | None) -> tuple[bytes, list[slice]]:
    """Pickle an item, its arrays put into a room as far as they fit: in a pipe they would be copied seven times."""
    parts: list[slice] = []

    def put(buffer: pickle.PickleBuffer) -> bool:
        data, start = buffer.raw(), -(-parts[-1].stop // _ALIGNED) * _ALIGNED if parts else 0
        if room is None or start + len(data) > len(room):
            return True  # it stays with the rest
        parts.append(slice(start, start + len(data)))
        room[parts[-1]] = data
        return False

    return pickle.dumps(item, protocol=5, buffer_callback=put), parts


def _serve(
    work: Callable[[Any], Any], connection: Connection, parents: list[Connection], room: mmap.mmap | None
) -> None:
    """Work on what comes until nothing more can come.

    The parent can end this process; an interruption ends the parent only, which does so.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for other in parents:  # else the end of the parent would not be seen
        other.close()
    while True:
        try:
            text, parts = connection.recv()
            item = pickle.loads(text, buffers=[memoryview(room)[part] for part in parts])  # type: ignore[arg-type]
        except (EOFError, OSError):
            return
        try:
            found = True, work(item)
        except BaseException as error:
            found = False, error
        del item
        try:
            connection.send(found)
        except (BrokenPipeError, OSError):
            return
        del found


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
