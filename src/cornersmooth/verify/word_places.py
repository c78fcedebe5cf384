"""Where on the CL path the words beside the motion stand, and whether they say there what the CL file asks for.

A word stands between two elements of the text: behind the end of one, and before the next one begins.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Set
from dataclasses import replace
from itertools import count
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints
from cornersmooth.nc_reader.elements import Element, Elements, Event, Problem
from cornersmooth.nc_reader.tool import leads_somewhere
from cornersmooth.nc_reader.word_tables import Means
from cornersmooth.statements.asked import asked
from cornersmooth.statements.comparison import compare, without_word
from cornersmooth.statements.tokens import TAP, Place, Token, said
from cornersmooth.verify.batches import Batches, elements_with_words
from cornersmooth.verify.findings import Findings
from cornersmooth.verify.match import Match
from cornersmooth.verify.passage import AROUND

#: CL path length of what stands before the first motion, mm
_BEFORE: Final = -1.0


def place_words(match: Match, found: Findings) -> None:
    """Take down where the elements with words behind them are, as far as they are known to be in a batch."""
    first, last = match.first + match.offset, match.motion.last
    vertex = last[match.words - first]
    element, vertex = match.words[match.on[vertex]], vertex[match.on[vertex]]
    length, path = match.path.lengths_at(match.place[vertex]), match.path.length
    for one, here, at in zip(element.tolist(), vertex.tolist(), length.tolist(), strict=True):
        named = path[_named(match, here, at)]
        # a word belongs to the pose that the vertex names, not to the place beside it that is as near: both within ε
        close = named[np.abs(named - at) <= 2.0 * match.tolerance + match.margin]
        at = close[np.argmin(np.abs(close - at))] if len(close) else at
        beside = named[np.abs(named - at) > match.margin]
        if len(beside):
            beside = beside[match.may_be_at(here, np.searchsorted(path, beside))]
        found.words[one] = float(at), tuple(beside.tolist())


def _named(match: Match, vertex: int, length: float) -> Ints:
    """Vertices of the CL path around its place that a written vertex names, up to the printed digits."""
    path, around = match.path, AROUND * match.tolerance
    low, high = np.searchsorted(path.length, (length - around, length + around)).tolist()
    away = (path.points[low:high] - match.six[vertex]).reshape(-1, 2, 3)
    return low + np.flatnonzero((np.linalg.norm(away, axis=2) <= match.margin).all(axis=1))


class WordPlaces:
    """Takes down what is known of the elements that have words behind them as they are read; then compares these."""

    def __init__(self, batches: Batches, events: list[Event]) -> None:
        self._batches, self._task, self._events = batches, batches.task, events
        self.margin = 0.0  # what printed digits account for, mm
        self._rooms: dict[int, float] = {}  # how far the lengths at the ends of elements are uncertain, mm
        self._still: set[int] = set()  # rapids that lead nowhere
        # CL path lengths, mm, where elements end and begin, as far as they are known
        self._ends: dict[int, float] = {}
        self._begins: dict[int, float] = {}
        self._others: dict[int, tuple[float, ...]] = {}  # at other poses that elements may stand for

    def watch(self, chunks: Iterable[Elements]) -> Iterable[Elements]:
        """Give out the elements of a text, and take down how sure those with words behind them are."""
        offset = 0
        before = np.full((1, 6), np.inf)
        for nc in chunks:
            self.margin = self._task.margin(nc)
            six = np.concatenate((before, np.hstack((nc.tip, nc.second))))
            rapid = np.flatnonzero(nc.kind == Element.RAPID)
            ways = np.hsplit(six[rapid + 1] - six[rapid], 2)
            self._still.update((offset + rapid[~leads_somewhere(nc, *ways)]).tolist())
            before = six[-1:]
            if len(nc) and (nc.rotary or nc.tip_room.any()):
                last = offset + len(nc) - 1
                # words behind the last are still to come
                for element in {*elements_with_words(self._events, offset, last).tolist(), last}:
                    row = element - offset
                    self._rooms[element] = self._task.axis_length * float(nc.second_room[row]) + float(nc.tip_room[row])
            offset += len(nc)
            yield nc

    def problems(
        self,
        found: Findings,
        means: Means,
        own: frozenset[str],
        clamps: Set[float],
        *,
        retracts: bool,
    ) -> tuple[list[Problem], set[int], str]:
        """What words say wrongly, the NC lines of those where the CL file has GOHOME, and what no word can say.

        Of all batches it is known what was `found`, of the control what its words mean (see `NcProgram`). The user says
        some kinds of statements in words of his `own`. M words that clamp a rotary axis or let it turn stand where the
        machine wants them, not where AUXFUN has them. GOHOME asks for a retract, where the program can have `retracts`.
        """
        batches, path, original = self._batches, self._task.path, self._task.original
        still = batches.still
        self._still |= still
        program = original.program
        length = float(path.length[-1]) if len(original.pose) else 0.0
        # CL path lengths where the moves end; before the first, `_BEFORE`
        moves = np.append(_BEFORE, path.length[original.trail.last])
        hole, move, after = np.frombuffer(batches.holes, np.int64).reshape(-1, 3).T.copy()
        stop, there, begin = np.frombuffer(batches.stops).reshape(-1, 3).T.copy()
        # what is known best comes last
        self._ends = {element: at for element, (at, _) in found.words.items()}
        # an element that reaches several stops is at the first of them, and where the next begins at the last
        self._ends |= _by_element(stop[::-1], there[::-1]) | _by_element(hole, moves[move + 1])
        self._begins = _by_element(stop + 1, there) | _by_element(hole, moves[np.maximum(after, 1)])
        self._begins |= _by_element(stop, begin) | {batches.elements: length}
        self._others = {element: others for element, (_, others) in found.words.items() if others}
        self._ended, self._holes = sorted(self._ends), frozenset(hole.tolist())
        statements = moves[np.searchsorted(original.pose, [one.pose for one in program.statements])].tolist()
        theirs = asked(program, statements, length, means, self._of_holes(moves))
        theirs = [token for token in theirs if token.kind != "auxiliary" or token.value not in clamps]
        here = list(map(self._of, self._events))
        # behind a rapid that leads nowhere they belong with those before it
        of = [replace(one, element=one.element - 1) if one.element - 1 in still else one for one in self._events]
        ours = said(of, here, means)
        drilled = [(int(program.line[original.pose[at]]), element) for at, element in batches.leaving]
        wrong = compare(theirs, ours, self.margin, means, path.way_apart, own, drilled)
        homes = {at: one for at, one in zip(statements, program.statements, strict=True) if one.word == "GOHOME"}
        up = [self._retract(element, length) for element in batches.retracts] if homes else []
        for home, statement in homes.items() if retracts else ():
            room = [self.margin + place.room for place in up]
            found_there = (-near <= home - at.at <= at.reach + near for at, near in zip(up, room, strict=True))
            if not statement.args and not any(found_there):
                text = "GOHOME of the CL file is missing: the tool does not go up to a retract"
                wrong.append(Problem("CS532", statement.line, 0, text))
        at_home = {
            event.line
            for event, place in zip(self._events, here, strict=True)
            for room in [self.margin + place.room]
            if any(-room <= home - place.at <= place.reach + room for home in homes)
        }
        return wrong, at_home, without_word(theirs, ours, means, own)

    def _of(self, event: Event) -> Place:
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
        following = next(k for k in count(event.element) if k not in self._still)
        reach = max(self._begins.get(following, -math.inf) - at, 0.0)
        return Place(at, self._rooms.get(before, 0.0), reach, self._others.get(before, ()))

    def _retract(self, element: int, end: float) -> Place:
        """Place of a retract; after a run whose end is not located, up to what is located next."""
        place, known = self._of(Event(element, 0, "", math.nan)), bisect_right(self._ended, element - 1)
        if element - 1 in self._ends:
            return place
        following = self._ends[self._ended[known]] if known < len(self._ended) else end
        return place._replace(reach=max(place.reach, following - place.at))

    def _of_holes(self, moves: Floats) -> list[Token]:
        """What the cycles of holes ask for: to wait at the bottom, and to tap."""
        original = self._task.original
        asked_for = [("dwell", float(time), move) for move, time in self._batches.dwells]
        asked_for += [("tap", TAP, move) for move in self._batches.taps]
        line = original.program.line[original.pose]
        return [Token(kind, value, float(moves[move + 1]), int(line[move])) for kind, value, move in asked_for]


def _by_element(elements: Ints | Floats, lengths: Floats) -> dict[int, float]:
    return dict(zip(elements.astype(np.int64).tolist(), lengths.tolist(), strict=True))
