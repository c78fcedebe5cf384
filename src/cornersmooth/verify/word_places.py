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

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements, Event, Problem
from cornersmooth.nc_reader.tool import leads_somewhere
from cornersmooth.statements.asked import asked
from cornersmooth.statements.comparison import compare
from cornersmooth.statements.said import said
from cornersmooth.statements.tokens import TAP, Place, Token
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
        here = list(map(places.of, self.events))
        found = compare(theirs, said(self.events, here), self.margin, unsaid, self.task.path.way_apart, own)
        said_there = zip(statements, self.task.original.program.statements, strict=True)
        homes = [length for length, statement in said_there if statement.word == "GOHOME"]
        at_home = {
            event.line
            for event, place in zip(self.events, here, strict=True)
            for room in [self.margin + place.room]
            if any(-room <= home - place.at <= place.reach + room for home in homes)
        }
        return found, at_home


class _Places:
    """CL path lengths, mm, where elements of the program end and begin, as far as they are known."""

    def __init__(self, words: WordPlaces, batches: Batches) -> None:
        self._task, self._words, stops = words.task, words, batches.stops
        length = self._task.path.length
        self.end = float(length[-1]) if len(self._task.original.pose) else 0.0
        hole, move, after = np.frombuffer(batches.holes, np.int64).reshape(-1, 3).T.copy()
        stop, there = np.frombuffer(stops.element, np.int64), np.frombuffer(stops.length)
        begin = np.frombuffer(stops.begin)
        self._holes = frozenset(hole.tolist())
        # what is known best comes last
        self._ends = words._lengths | _by_element(stop, there) | _by_element(hole, self.of_moves(move))
        self._ended = sorted(self._ends)
        self._begins = _by_element(stop + 1, there)
        self._begins |= _by_element(hole, self.of_moves(np.maximum(after - 1, 0)))
        self._begins |= _by_element(stop, begin) | {batches.elements: self.end}

    def of_moves(self, moves: Ints) -> Floats:
        """(k,) where moves of the CL file end."""
        return self._task.path.length[self._task.original.trail.last[moves]]

    def of(self, event: Event) -> Place:
        """Where a word is: at the end of the element before it; that of a tap at the hole that is fed next.

        Between that and where the next element that leads somewhere begins, at the latest, the program may have passed
        all that leaves nothing in it. An element that leads nowhere, as a second rapid to the same place does, is one
        with that before it.
        """
        before = event.element - 1
        known = bisect_right(self._ended, before)
        before = self._ended[known - 1] if known else before
        at = self._ends.get(before, _BEFORE)
        if (event.letter, event.value) == ("G", TAP) and event.element in self._holes:
            at = self._ends[event.element]
        following = next(k for k in count(event.element) if k not in self._words._still)
        reach = max(self._begins.get(following, -math.inf) - at, 0.0)
        return Place(at, self._words._rooms.get(before, 0.0), reach, self._words._others.get(before, ()))


def _by_element(elements: Ints, lengths: Floats) -> dict[int, float]:
    return dict(zip(elements.tolist(), lengths.tolist(), strict=True))


def _statement_lengths(task: Task) -> list[float]:
    """CL path length, mm, where every statement of the CL file stands."""
    original = task.original
    move = np.searchsorted(original.pose, [statement.pose for statement in original.program.statements]) - 1
    if not len(original.pose):
        return [_BEFORE] * len(move)
    there = task.path.length[original.trail.last[np.clip(move, 0, None)]]
    return np.where(move >= 0, there, _BEFORE).tolist()


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
