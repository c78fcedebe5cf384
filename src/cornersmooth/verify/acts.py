"""Acts of the CL file, and what of a program does them."""

from __future__ import annotations

from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, Self

import numpy as np

from cornersmooth.arrays import distinct
from cornersmooth.model import Ints, Move
from cornersmooth.nc_reader.elements import Event, Problem
from cornersmooth.nc_reader.tool import beyond_digits
from cornersmooth.statements.asked import NOTHING
from cornersmooth.statements.cycles import Drilling, drillings
from cornersmooth.verify.holes import Hole, HoleLines
from cornersmooth.verify.task import Task

#: words that a hole may have: its dwell and its tap
_IN_HOLES: Final = (("G", 4.0), ("G", 84.0))


@dataclass
class Acts:
    """What a program does, as it is read: moves and elements that belong together."""

    #: rapids, holes and feeds out of holes, two numbers for each: the move and the element that begin it
    begins: array[int] = field(default_factory=lambda: array("q"))
    #: runs of feed moves, four numbers for each: the move and the element that they begin with, and those behind
    runs: array[int] = field(default_factory=lambda: array("q"))
    #: poses within runs where both files have words: moves that statements are before, and elements behind
    cuts: array[int] = field(default_factory=lambda: array("q"))
    holes: list[Hole] = field(default_factory=list)
    #: CS561 for holes that the program leaves out and may leave out if requested, by their moves
    left_out: dict[int, Problem] = field(default_factory=dict)
    rewinds: list[tuple[int, int]] = field(default_factory=list)  #: NC lines where cuts are left, and where they go on
    still: set[int] = field(default_factory=set)  #: elements that lead nowhere
    unlooked: list[tuple[int, str]] = field(default_factory=list)  #: what cannot be decided, and its NC line
    #: CS531 a rapid goes elsewhere, CS532 one is missing, CS533 one too many; CS536 a feed move too many; of holes
    problems: list[Problem] = field(default_factory=list)


@dataclass(frozen=True)
class Stops:
    """Poses of the CL file where acts begin, k of them: holes, rapids that lead anywhere, the very first pose."""

    moves: Ints  #: (k,) the moves that end there
    move: list[int]  #: the same, and one behind all
    hole: list[bool]  #: which are holes, and one behind all
    holes: Ints  #: (h,) which are holes
    fed: list[bool]  #: whether feed moves follow each
    cycles: dict[int, Drilling]  #: by the moves of the holes
    stated: list[int]  #: moves that statements which ask for something are before, ascending
    loads: list[int]  #: poses that tool changes are in front of, ascending

    @classmethod
    def of(cls, task: Task, lines: HoleLines) -> Self:
        """Find them: rapids that move the tool by more than digits show or come out of a hole, from anywhere."""
        original = task.original
        hole, rapid = lines.kind == Move.HOLE, np.flatnonzero(lines.kind == Move.RAPID)
        before = np.maximum(rapid - 1, 0)
        turned = np.linalg.norm(lines.axis[rapid] - lines.axis[before], axis=1) * lines.axis_length > lines.room
        moved = turned | hole[before] | beyond_digits(lines.ahead.nc, lines.tip[rapid] - lines.tip[before])
        chosen = hole.copy()
        chosen[rapid[moved]] = chosen[:1] = True
        fed = ~chosen
        fed[rapid] = False
        moves = np.flatnonzero(chosen)
        cycles = drillings(original.program, original.pose[hole].tolist())
        asks = [one.pose for one in original.program.statements if one.word == "GOHOME" or one.word not in NOTHING]
        stated = np.searchsorted(original.pose, asks)
        tools = [token for token in task.asking.tokens if token.kind == "tool"]
        changes = [one.place for k, one in enumerate(tools) if not k or one.value != tools[k - 1].value]
        return cls(
            moves,
            [*moves.tolist(), len(chosen)],
            [*hole[moves].tolist(), False],
            np.flatnonzero(hole[moves]),
            np.logical_or.reduceat(fed, moves).tolist(),
            dict(zip(np.flatnonzero(hole).tolist(), cycles, strict=True)),
            distinct(stated).tolist(),
            changes,
        )


@dataclass
class Words:
    """What a program says in front of which element, as it is read."""

    events: Sequence[Event]  #: by their elements; more come while the program is read
    _changes: array[int] = field(default_factory=lambda: array("q"))  # elements that tool changes are in front of
    _seen: int = 0  # words that tool changes were looked for in
    _chosen: float = -1.0
    _tool: float = -1.0

    def between(self, first: int, stop: int) -> Sequence[Event]:
        """Words in front of elements, from the first to `stop`, that excluded."""
        places = (bisect_left(self.events, one, key=lambda event: event.element) for one in (first, stop))
        return self.events[slice(*places)]

    def acting(self, element: int) -> bool:
        """Whether words are in front of an element that are neither the dwell nor the tap of a hole."""
        return any((one.letter, one.value) not in _IN_HOLES for one in self.between(element, element + 1))

    def tool_changes(self, element: int) -> int:
        """How many tool changes are in front of an element."""
        for event in self.events[self._seen :]:
            self._chosen = event.value if event.letter == "T" else self._chosen
            if (event.letter, event.value) == ("M", 6.0) and self._chosen != self._tool:
                self._tool = self._chosen
                self._changes.append(event.element)
        self._seen = len(self.events)
        return bisect_right(self._changes, element)
