"""Processes in a ring: each works on its own, and hands something on to the next."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from cornersmooth.verify.processes import CONTEXT, end_all, forked


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
        links = [CONTEXT.Pipe(duplex=False) for _ in range(processes)]
        reports = [CONTEXT.Pipe(duplex=False) for _ in range(processes)]
        every = [end for pair in (*links, *reports) for end in pair]
        self._reports = [receiving for receiving, _ in reports]
        self._processes: list[BaseProcess] = []
        try:
            for k in range(processes):
                place = Place(k, processes, links[k][0], links[(k + 1) % processes][1])
                own = (place.before, place.behind, reports[k][1])
                others = [end for end in every if end not in own]
                self._processes.append(forked(_take_part, work, place, reports[k][1], others))
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
        end_all(self._processes)


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
