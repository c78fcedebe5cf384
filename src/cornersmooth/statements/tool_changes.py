"""Tool changes, by which text and CL file are divided alike: what is between two of them belongs together."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from typing import Final

from cornersmooth.model import Program
from cornersmooth.nc_reader.elements import Event
from cornersmooth.statements.asked import Asking

#: an element that no text has
NEVER: Final = 1 << 62


class ToolChanges:
    """Pairs the tool changes of a text, as it is read, with those of the CL file: as long as the tools are the same.

    Parameters
    ----------
    events : sequence of Event
        Words of the text, which grow as it is read.
    """

    def __init__(self, program: Program, events: Sequence[Event]) -> None:
        self._events, self._read = events, 0
        asking = Asking(program)
        for statement in program.statements:
            asking.take(statement, statement.pose)
        tools = [token for token in asking.tokens if token.kind == "tool"]
        changes = [k for k, token in enumerate(tools) if not k or token.value != tools[k - 1].value]
        self._asked = [tools[k].value for k in changes]
        self._asked_at = [int(tools[k].place) for k in changes]
        self._chosen: float | None = None
        self._tool: float | None = None
        self._alike = True
        #: where those that are paired are among the words
        self._place: list[int] = []

    def elements_of(self, pose: int) -> tuple[int, int]:
        """First element that may move to a pose, and the first behind those that may; `NEVER` where not read yet."""
        self._look()
        before = bisect_right(self._asked_at, pose)
        paired = len(self._place)
        first = self._events[self._place[min(before, paired) - 1]].element if before and paired else 0
        stop = self._events[self._place[before]].element if before < paired else NEVER
        return NEVER if self._alike and before > paired else first, stop

    def _look(self) -> None:
        """Take the words that have been read since."""
        for place in range(self._read, len(self._events)):
            event = self._events[place]
            if event.letter == "T":
                self._chosen = event.value
            elif event.letter == "M" and event.value == 6 and self._chosen not in (None, self._tool):
                self._tool = self._chosen
                self._pair(place)
        self._read = len(self._events)

    def _pair(self, place: int) -> None:
        """Pair one more change with the next of the CL file."""
        number = len(self._place)
        self._alike = self._alike and number < len(self._asked) and self._asked[number] == self._tool
        if self._alike:
            self._place.append(place)
