"""Where on the CL path the words beside the motion stand, and whether they say there what the CL file asks for.

A word stands between two elements of the text: behind the end of one, and before the next one begins.
"""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Iterable
from dataclasses import dataclass, field
from itertools import count
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints, Program
from cornersmooth.nc_reader.elements import Element, Elements, Event, Problem
from cornersmooth.nc_reader.tool import leads_somewhere
from cornersmooth.statements.asked import asked
from cornersmooth.statements.comparison import compare
from cornersmooth.statements.said import said
from cornersmooth.statements.tokens import TAP, Token
from cornersmooth.verify.batches import Batches
from cornersmooth.verify.checks import Examined
from cornersmooth.verify.task import Task

#: CL path length of what stands before the first motion, mm
_BEFORE: Final = -1.0


@dataclass
class WordPlaces:
    """Takes down what is known of the elements that have words behind them, while they are read and measured."""

    task: Task
    events: list[Event]  #: words of the text, which grow as it is read
    margin: float = 0.0  #: what printed digits account for, mm
    _lengths: dict[int, float] = field(default_factory=dict)  #: CL path length, mm, at the ends of elements
    _rooms: dict[int, float] = field(default_factory=dict)  #: how far that is uncertain, mm
    _others: dict[int, tuple[float, ...]] = field(default_factory=dict)  #: at other poses that elements may stand for
    _still: set[int] = field(default_factory=set)  #: rapids that lead nowhere

    def watch(self, chunks: Iterable[Elements]) -> Iterable[Elements]:
        """Give out the elements of a text, and take down how sure those with words behind them are."""
        offset = 0
        before = np.full((1, 6), np.inf)
        for nc in chunks:
            self.margin = self.task.margin(nc)
            six = np.concatenate((before, np.hstack((nc.tip, nc.second))))
            rapid = np.flatnonzero(nc.kind == Element.RAPID)
            ways = np.hsplit(six[rapid + 1] - six[rapid], 2)
            self._still.update((offset + rapid[~leads_somewhere(nc, *ways)]).tolist())
            before = six[-1:]
            if len(nc) and (nc.rotary or nc.tip_room.any()):
                last = offset + len(nc) - 1
                for element in {*self.elements(offset, last).tolist(), last}:  # words behind it are still to come
                    row = element - offset
                    self._rooms[element] = self.task.axis_length * float(nc.second_room[row]) + float(nc.tip_room[row])
            offset += len(nc)
            yield nc

    def elements(self, first: int, last: int) -> Ints:
        """Elements from `first` to `last` with words behind them, ascending, each once."""
        low = bisect_left(self.events, first + 1, key=lambda event: event.element)
        high = bisect_right(self.events, last + 1, key=lambda event: event.element)
        return np.unique(np.array([event.element - 1 for event in self.events[low:high]], np.int64))

    def take(self, examined: Examined) -> None:
        """Take down where the elements of a batch are."""
        for element, length in zip(examined.elements.tolist(), examined.lengths.tolist(), strict=True):
            self._lengths.setdefault(element, length)
        self._others = examined.others | self._others

    def problems(
        self,
        batches: Batches,
        unsaid: frozenset[str | tuple[str, float]],
        own: frozenset[str],
        clamps: frozenset[float],
    ) -> tuple[list[Problem], set[int]]:
        """What words say wrongly, and the NC lines of those where the CL file has GOHOME.

        Parameters
        ----------
        batches : Batches
            All given out.
        unsaid : frozenset
            As of `NcProgram`.
        own : frozenset of str
            Kinds of statements that the user says in words of his own.
        clamps : frozenset of float
            M words that clamp a rotary axis or let it turn: they stand where the machine wants them, not where AUXFUN
            has them.
        """
        places = _Places(self, batches)
        statements = _statement_lengths(self.task)
        theirs = asked(self.task.original.program, statements, places.end, _of_holes(batches, places))
        theirs = [token for token in theirs if token.kind != "auxiliary" or token.value not in clamps]
        here = [places.behind(event) for event in self.events]
        reaches = [max(places.next_begin(event) - at, 0.0) for event, at in zip(self.events, here, strict=True)]
        standing = [places.standing(event.element - 1) for event in self.events]
        rooms = [self._rooms.get(element, 0.0) for element in standing]
        ours = said(self.events, here, rooms, reaches, [self._others.get(element, ()) for element in standing])
        found = compare(theirs, ours, self.margin, unsaid, self.task.path.way_apart, own)
        homes = _lengths_of("GOHOME", self.task.original.program, statements)
        at_home = {
            event.line
            for event, at, room, reach in zip(self.events, here, rooms, reaches, strict=True)
            if any(-self.margin - room <= home - at <= reach + self.margin + room for home in homes)
        }
        return found, at_home


class _Places:
    """CL path lengths, mm, where elements of the text end and begin, as far as they are known."""

    def __init__(self, words: WordPlaces, batches: Batches) -> None:
        self._task, self._still, stops = words.task, words._still, batches.stops
        length = self._task.path.length
        self.end = float(length[-1]) if len(self._task.original.pose) else 0.0
        holes = np.frombuffer(batches.holes, np.int64).reshape(-1, 3)
        self._holes = holes[:, 0].copy()  # searched often
        stop, there = np.frombuffer(stops.element, np.int64), np.frombuffer(stops.length)
        known = sorted(words._lengths)
        seen = np.array(known, np.int64), np.array([words._lengths[element] for element in known])
        self._ends = _Lengths((self._holes, self.of_moves(holes[:, 1])), (stop, there), seen)
        self._begins = _Lengths(
            (np.array([batches.elements]), np.array([self.end])),
            (stop, np.frombuffer(stops.begin)),
            (self._holes, self.of_moves(np.maximum(holes[:, 2] - 1, 0))),
            (stop + 1, there),
        )

    def of_moves(self, moves: Ints) -> Floats:
        """(k,) where moves of the CL file end."""
        ends: Floats = self._task.path.length[self._task.original.trail.last[moves]]
        return ends

    def standing(self, element: int) -> int:
        """The element at whose end one leaves the tool that leads nowhere, as a second rapid to the same place does."""
        return max(self._ends.up_to(element), default=element)

    def behind(self, event: Event) -> float:
        """Where a word stands: at the end of the element before it; that of a tap at the hole that is fed next."""
        if (event.letter, event.value) == ("G", TAP) and event.element in _up_to(self._holes, event.element):
            return self._ends.at(event.element, 0.0)
        before = event.element - 1
        return self._ends.at(self.standing(before), 0.0 if self._ends.up_to(before) else _BEFORE)

    def next_begin(self, event: Event) -> float:
        """Where the next element that leads somewhere begins at the latest; -inf where that is not known.

        Between the two the text may have passed all that leaves nothing in it.
        """
        return self._begins.at(next(k for k in count(event.element) if k not in self._still), -math.inf)


class _Lengths:
    """CL path lengths of elements: sources of both, elements ascending, of which the first that knows one counts."""

    def __init__(self, *sources: tuple[Ints, Floats]) -> None:
        self._sources = sources

    def up_to(self, element: int) -> list[int]:
        """The last element that each source knows before another, or that itself."""
        return [last for known, _ in self._sources for last in _up_to(known, element)]

    def at(self, element: int, otherwise: float) -> float:
        """Length of an element, if it is known."""
        for known, length in self._sources:
            if element in _up_to(known, element):
                return float(length[np.searchsorted(known, element, side="right") - 1])
        return otherwise


def _up_to(ascending: Ints, value: int) -> list[int]:
    """The last of some values that is not larger than another, if there is one."""
    stop = int(np.searchsorted(ascending, value, side="right"))
    known: list[int] = ascending[stop - 1 : stop].tolist() if stop else []
    return known


def _statement_lengths(task: Task) -> list[float]:
    """CL path length, mm, where every statement of the CL file stands."""
    original = task.original
    move = np.searchsorted(original.pose, [statement.pose for statement in original.program.statements]) - 1
    if not len(original.pose):
        return [_BEFORE] * len(move)
    there = task.path.length[original.trail.last[np.clip(move, 0, None)]]
    lengths: list[float] = np.where(move >= 0, there, _BEFORE).tolist()
    return lengths


def _lengths_of(word: str, program: Program, lengths: list[float]) -> list[float]:
    return [length for length, one in zip(lengths, program.statements, strict=True) if one.word == word]


def _of_holes(batches: Batches, places: _Places) -> list[Token]:
    """What the cycles of holes ask for: to wait at the bottom, and to tap."""
    original = batches.task.original
    asked_for = [("dwell", float(time), move) for move, time in batches.dwells]
    asked_for += [("tap", TAP, move) for move in batches.taps]
    line = original.program.line
    there = places.of_moves(np.array([move for _, _, move in asked_for], np.int64)).tolist()
    return [
        Token(kind, value, at, int(line[original.pose[move]]))
        for (kind, value, move), at in zip(asked_for, there, strict=True)
    ]
