"""Work on several pieces in processes of their own.

Between small arrays the interpreter is the bottleneck, and threads only wait for one another. A forked process has all
data of its parent without copying it, and gives back what it found through a pipe.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import warnings
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from multiprocessing import get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Final, TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")

#: more find too little to do
MOST_PROCESSES: Final = 4

#: items taken ahead of what has been given out, whatever the number of processes: what comes out never depends on it
_AHEAD: Final = 5


def useful_processes() -> int:
    """Processes that this computer has room for."""
    return max(1, min(MOST_PROCESSES, os.cpu_count() or 1))


def apart(
    work: Callable[[Item], Result], items: Iterable[Item], processes: int, here: Callable[[Item], bool]
) -> Iterator[Result]:
    """Give out what `work` makes of each item, in order, as `processes` processes find it.

    Items are taken as they are needed, a fixed number ahead. Few items, and those that are to be worked on `here`, do
    not leave this process; nor does any where there is only one process or the system cannot fork safely.

    Raises
    ------
    MemoryError
        A process has been ended from outside, which is what a system short of memory does.
    """
    source = iter(items)
    first = list(islice(source, _AHEAD))
    alone = processes < 2 or not can_fork() or len(first) < _AHEAD
    crew = None if alone else _Crew(work, processes)
    waiting: deque[Callable[[], Result]] = deque()

    def start(item: Item) -> Callable[[], Result]:
        if crew is not None and not here(item):
            return crew.start(item)
        found = work(item)
        return lambda: found

    try:
        waiting.extend(start(item) for item in first)
        for item in source:
            yield waiting.popleft()()
            waiting.append(start(item))
        while waiting:
            yield waiting.popleft()()
    finally:
        if crew is not None:
            crew.end()


class _Member:
    """A process at the other end of a pipe, with one item at a time: a pipe full both ways would stand still."""

    def __init__(self, process: BaseProcess, connection: Connection) -> None:
        self.process, self.connection = process, connection
        self.given, self.found = 0, deque[tuple[bool, Any]]()
        self.fetched = 0

    def start(self, item: Any) -> None:
        """Send an item, after what was found for the one before has been taken in."""
        self.take()
        try:
            self.connection.send(item)
        except BrokenPipeError:
            raise MemoryError("a process of the verification was ended") from None
        self.given += 1

    def take(self) -> None:
        """Receive what is still to come."""
        if self.fetched < self.given:
            try:
                self.found.append(self.connection.recv())
            except EOFError:
                raise MemoryError("a process of the verification was ended") from None
            self.fetched += 1

    def result(self) -> Any:
        """Next result, in the order of the items."""
        if not self.found:
            self.take()
        good, found = self.found.popleft()
        if not good:
            raise found
        return found


class _Crew:
    """Processes that take turns."""

    def __init__(self, work: Callable[[Any], Any], processes: int) -> None:
        self.members: list[_Member] = []
        self.turn = 0
        for _ in range(processes):
            ours, theirs = _CONTEXT.Pipe()
            own = [member.connection for member in self.members] + [ours]
            self.members.append(_Member(_forked(_serve, work, theirs, own), ours))
            theirs.close()

    def start(self, item: Any) -> Callable[[], Any]:
        """Send an item to whose turn it is; the result is to be fetched by calling what is returned."""
        member = self.members[self.turn]
        self.turn = (self.turn + 1) % len(self.members)
        member.start(item)
        return member.result

    def end(self) -> None:
        """Let all go home; whoever is still at work is sent away."""
        for member in self.members:
            member.connection.close()
        _end([member.process for member in self.members])


class Ring:
    """Processes of which each hands something on to the next, the last to the first, while all work.

    Parameters
    ----------
    work : callable
        Called with a `Place` in each process; what it returns is the process's result.
    processes : int

    Raises
    ------
    OSError
        The system allows no more processes.
    """

    def __init__(self, work: Callable[[Place], Any], processes: int) -> None:
        links = [_CONTEXT.Pipe(duplex=False) for _ in range(processes)]
        reports = [_CONTEXT.Pipe(duplex=False) for _ in range(processes)]
        every = [end for pair in (*links, *reports) for end in pair]
        self._reports = [receiving for receiving, _ in reports]
        self._processes: list[BaseProcess] = []
        try:
            for k in range(processes):
                place = Place(k, processes, links[k][0], links[(k + 1) % processes][1])
                own = (place.before, place.behind, reports[k][1])
                others = [end for end in every if end not in own]
                self._processes.append(_forked(_take_part, work, place, reports[k][1], others))
        except OSError:
            self.end()
            raise
        finally:
            for end in every:
                if end not in self._reports:
                    end.close()

    def results(self) -> list[Any]:
        """Wait for the results of all; the first exception of any is raised.

        Raises
        ------
        MemoryError
            A process has been ended from outside, which is what a system short of memory does.
        """
        found: list[tuple[bool, Any]] = []
        for report in self._reports:
            try:
                found.append(report.recv())
            except EOFError:
                raise MemoryError("a process of the verification was ended") from None
        for good, value in found:
            if not good and not isinstance(value, LeftAlone):
                raise value
        return [value for _, value in found]

    def end(self) -> None:
        """Let all go home; whoever is still at work is sent away."""
        for report in self._reports:
            report.close()
        _end(self._processes)


class LeftAlone(Exception):  # noqa: N818 - its cause is the error
    """The neighbour in a ring has ended without handing on what was waited for."""


class Place:
    """A place in a ring; without connections, the only one.

    Parameters
    ----------
    index, count : int
        The place, from 0, and how many there are.
    before, behind : Connection, optional
        To whom something is taken from and handed on.
    """

    def __init__(
        self, index: int = 0, count: int = 1, before: Connection | None = None, behind: Connection | None = None
    ) -> None:
        self.index, self.count = index, count
        self.before, self.behind = before, behind
        self._held: list[Any] = []

    def take(self) -> Any:
        """Wait for what the one before hands on.

        Raises
        ------
        LeftAlone
        """
        if self.before is None:
            return self._held.pop()
        try:
            return self.before.recv()
        except (EOFError, OSError):
            raise LeftAlone from None

    def give(self, item: Any) -> None:
        """Hand something on."""
        if self.behind is None:
            self._held.append(item)
            return
        with contextlib.suppress(BrokenPipeError, OSError):  # who is not there any more says so in its report
            self.behind.send(item)


#: only used where the system can fork
_CONTEXT: Final = get_context("fork" if sys.platform == "linux" else None)


def can_fork() -> bool:
    """Whether the system can fork a process with numpy in it safely."""
    return sys.platform == "linux"


def _forked(target: Callable[..., None], *args: Any) -> BaseProcess:
    with warnings.catch_warnings():  # newer Pythons warn of threads, of which only numpy's idle ones are left
        warnings.simplefilter("ignore", DeprecationWarning)
        process: BaseProcess = _CONTEXT.Process(target=_obeying, args=(target, args), daemon=True)
        process.start()
    return process


def _end(processes: list[BaseProcess]) -> None:
    for process in processes:
        process.terminate()
    for process in processes:
        process.join()
        process.close()


def _obeying(target: Callable[..., None], args: tuple[Any, ...]) -> None:
    """Work so that the parent can end this process, and an interruption ends the parent only, which does so."""
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    target(*args)


def _serve(work: Callable[[Any], Any], connection: Connection, parents: list[Connection]) -> None:
    """Work on what comes until nothing more can come."""
    for other in parents:  # else the end of the parent would not be seen
        other.close()
    while True:
        try:
            item = connection.recv()
        except (EOFError, OSError):
            return
        try:
            found = True, work(item)
        except BaseException as error:
            found = False, error
        try:
            connection.send(found)
        except (BrokenPipeError, OSError):
            return


def _take_part(work: Callable[[Place], Any], place: Place, report: Connection, others: list[Connection]) -> None:
    """Work at a place of a ring and report."""
    for other in others:  # else the end of a neighbour would not be seen
        other.close()
    found: tuple[bool, Any]
    try:
        found = True, work(place)
    except BaseException as error:
        found = False, error
    for end in (place.before, place.behind):
        if end is not None:
            end.close()
    with contextlib.suppress(BrokenPipeError, OSError):
        report.send(found)
