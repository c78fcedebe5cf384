"""Work on several pieces in processes of their own, one after another as they come."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any, Final, TypeVar

from cornersmooth.verify.processes import CONTEXT, can_fork, end_all, forked

Item = TypeVar("Item")
Result = TypeVar("Result")

#: items taken ahead of what has been given out, whatever the number of processes: what comes out never depends on it
_AHEAD: Final = 5


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
            ours, theirs = CONTEXT.Pipe()
            own = [member.connection for member in self.members] + [ours]
            self.members.append(_Member(forked(_serve, work, theirs, own), ours))
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
        end_all([member.process for member in self.members])


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
