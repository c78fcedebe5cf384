"""What one process does with its sections of a text: read, wait for the truth, compare, hand on, measure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Ints, Move
from cornersmooth.verify.block_tables import read_lines
from cornersmooth.verify.blocks import Matcher, ends, lengths
from cornersmooth.verify.comparison import Comparison
from cornersmooth.verify.deviation import Largest
from cornersmooth.verify.line_patterns import LinePatterns
from cornersmooth.verify.ncprogram import Element, NcProgram
from cornersmooth.verify.reader import CONTROL_WORDS, Reader, Standing, closed
from cornersmooth.verify.ring import LeftAlone, Place
from cornersmooth.verify.sections import Baton, Irregular, Section, Share, Task
from cornersmooth.verify.source import GivenUp, Part
from cornersmooth.verify.stops import Stretches, digit_errors, stops_of_original, stops_of_text
from cornersmooth.verify.style import DIGITS_SAMPLE
from cornersmooth.verify.words import Line, Table

#: bytes of a section
SECTION: Final = 1 << 23

#: a cut is looked for in so many bytes before the end of a section, then in more
_REACHES: Final = (1 << 16, 1 << 20)

#: bytes in front of a section from which its beginning is guessed, and in which of them reading may begin
_BEFORE: Final = 1 << 15
_BEGIN: Final = 1 << 14

#: bytes of the head of the text that tell which modes are in force
_HEAD: Final = 1 << 18

#: bytes read behind a section, in which its next stop, or an anchor, is looked for
_BEHIND: Final = 1 << 18

#: how much longer than the text the original may be
_LONGER: Final = 1.3


def work_on(task: Task, place: Place) -> Share | None:
    """Read and measure every section whose number, modulo the places of the ring, is that of the place.

    Returns
    -------
    Share or None
        None where anything is irregular.
    """
    try:
        return _Worker(task, place).share()
    except (Irregular, InputError):
        task.source.give_up()
    except (GivenUp, LeftAlone):
        pass
    return None


@dataclass
class _Read:
    """One section as it was read.

    Parameters
    ----------
    reader : Reader
        It has read on to the next stop, or some way behind the section.
    length : Baton
        What the section adds, and what holds at its end.
    following : int or None
        Element that is the first stop behind the section, or the end of the text; None where it is farther.
    """

    reader: Reader
    length: Baton
    following: int | None


@dataclass
class _Own:
    """What belongs to a section.

    Parameters
    ----------
    stretches : Stretches
    until : float
        See `Block`.
    comparison : Comparison, optional
        None where nothing belongs to it.
    move : int
        Original move with which the comparison begins.
    length : Baton
        What the section adds, stops and the turn of the next included.
    stop : int
        Element behind the last that belongs to it.
    """

    stretches: Stretches
    until: float
    comparison: Comparison | None
    move: int
    length: Baton
    stop: int


class _Worker:
    """One process."""

    def __init__(self, task: Task, place: Place) -> None:
        self.task, self.place, self.source = task, place, task.source
        self.original, self.exact = task.original, task.exact
        self.lexer = task.style.dialect.lexer
        self.patterns = LinePatterns(self.lexer)
        self.steps = task.style.steps(self.source.read(0, DIGITS_SAMPLE))
        self._head: Standing | None = None
        self._stops: Ints | None = None
        self._largest = Largest()

    def share(self) -> Share:
        """Do it."""
        share, place = Share(), self.place
        for k in count(place.index, place.count):
            start = self._edge(k)
            if start is None:
                break
            stop = self._edge(k + 1)
            baton = Baton() if k == 0 else place.take() if place.count == 1 else None
            read = self._read(start, stop, self._guess(start) if baton is None else baton.standing)
            if baton is None:
                baton = place.take()
                if not read.reader.began_with(baton.standing):
                    read = self._read(start, stop, baton.standing)
            nc = self._program(read, baton)
            own = self._own(nc, read, baton)
            behind = baton.plus(own.length)
            if stop is not None:
                place.give(behind)
            elif behind.stops < len(self._theirs(nc)) or behind.inside is not None:
                raise Irregular
            else:
                share.end = behind
            if own.comparison is not None:
                share.sections[k] = self._compare(own, own.comparison, baton)
                share.manners.add((nc.units, nc.second_is, own.comparison.matcher.margin))
        return share

    def _edge(self, k: int) -> int | None:
        """Where section k begins: where no curve is cut in two; None behind the end of the text."""
        place = k * SECTION
        if k == 0 or self.source.size(place + 1) <= place:
            return None if k else 0
        for reach in _REACHES:
            begin = max(place - reach, 0)
            cut = self.lexer.cut(self.source.read(begin, place))
            if cut:
                return begin + cut
        raise Irregular

    def _reader(self, standing: Standing | None) -> Reader:
        return Reader(self.source.name, self.task.style, self.steps, standing)

    def _lines(self, part: Part, number: int = 1) -> Iterator[Table | Line]:
        return read_lines(part, self.source.name, self.lexer, patterns=self.patterns, number=number)

    def _guess(self, start: int) -> Standing:
        """What may hold where a section begins; its feed is not known."""
        if self._head is None:
            reader = self._reader(None)
            reader.take(self._lines(self.source.part(0, self.lexer.cut(self.source.read(0, _HEAD)))))
            held = reader.standing
            self._head = replace(held, modal=held.modal.but(feed=float("nan")))
        begin = max(start - _BEFORE, 0)
        begin += self.lexer.cut(self.source.read(begin, begin + _BEGIN))
        reader = self._reader(self._head)
        reader.take(self._lines(self.source.part(begin, start)))
        return reader.standing

    def _read(self, start: int, stop: int | None, standing: Standing | None) -> _Read:
        """Read a section, and on to the next stop."""
        reader = self._reader(standing)
        lines = self._lines(self.source.part(start, self.source.size(start) + 1 if stop is None else stop))
        reader.take(self._severed(lines) if start else lines)
        length = Baton(reader.standing, reader.lines, reader.blocks, reader.elements, reader.pile.curves)
        return _Read(reader, length, reader.elements if stop is None else self._read_on(reader, stop))

    def _severed(self, lines: Iterator[Table | Line]) -> Iterator[Table | Line]:
        """Lines of a section, which must not go on with a curve of the one before."""
        for number, item in enumerate(lines):
            if number == 0:
                row = None if isinstance(item, Table) or not item.words else self.task.style.dialect.row(item)
                if (isinstance(item, Table) and not closed(item)) or (row is not None and "G" not in row):
                    raise Irregular
            yield item

    def _read_on(self, reader: Reader, stop: int) -> int | None:
        """Read some way behind a section, and return the first stop there, or the end of the text."""
        before, farthest = reader.elements, stop + _BEHIND
        end = stop + self.lexer.cut(self.source.read(stop, farthest))
        last = self.source.size(farthest + 1) <= farthest
        reader.take(self._lines(self.source.part(stop, farthest if last else end), reader.lines + 1))
        found = reader.next_stop(before)
        return reader.elements if found is None and last else found

    def _program(self, read: _Read, baton: Baton) -> NcProgram:
        """What a section says, with the lines of the whole text."""
        reader, held = read.reader, baton.standing
        if any(self.task.words or problem.code != CONTROL_WORDS for problem in reader.problems):
            raise Irregular
        if held is not None:
            if reader.modal.inch != held.modal.inch:
                raise Irregular
            reader.know_feed(held.modal.feed)
        nc = reader.result()
        return replace(nc, line=nc.line + baton.lines)

    def _theirs(self, nc: NcProgram) -> Ints:
        """Stops of the original."""
        if self._stops is None:
            self._stops = stops_of_original(self.original, self.task.style.axis_length, nc.tip_step)
        return self._stops

    def _own(self, nc: NcProgram, read: _Read, baton: Baton) -> _Own:
        """What belongs to a section, if its stops are exactly those of the original that come next."""
        length, first = read.length, baton.first
        none = np.zeros(0, np.int64)
        if first >= length.elements and baton.lines:  # nothing: the turn is handed on
            length = replace(length, first=first - length.elements, inside=baton.inside)
            return _Own(Stretches(none, none, none, none, np.zeros(0)), np.inf, None, 0, length, first)
        end = len(nc) if read.following is None else read.following
        ours = stops_of_text(nc, first, end - 1)
        theirs, move_last = self._paired(nc, ours if baton.inside is None else ours[1:], baton)
        fraction = np.zeros(len(ours))
        length = replace(length, stops=len(theirs), first=end - length.elements)
        if baton.inside is not None:
            move, fraction[0] = self._move(*baton.inside)
            theirs = np.append(move, theirs)
        if not len(ours):
            return _Own(Stretches(none, none, none, none, fraction), np.inf, None, 0, length, end)
        move_first, element_last = theirs, np.append(ours[1:], end) - 1
        move, until = int(move_first[0]), np.inf
        if read.following is None:
            move_last[-1] = self._reach(nc, int(ours[-1]), int(move_first[-1]), int(move_last[-1]))
        last = int(move_last[-1])
        style = self.task.style
        comparison = Comparison(
            self.original.part(move, last), self.exact[move : last + 1], nc, style.tolerance, style.axis_length
        )
        stretches = Stretches(move_first - move, move_last - move, ours, element_last, fraction)
        if read.following is None:
            end, segment, at = self._anchor(comparison.matcher, stretches, read.length.elements, len(nc) - 1)
            trail = comparison.matcher.original.trail
            stretches.element_last[-1], stretches.move_last[-1] = end, trail.owner[segment + 1]
            until = segment + at
            inside = segment + int(self.original.trail.last[move]), at
            length = replace(length, first=end - length.elements, inside=inside)
        return _Own(stretches, until, comparison, move, length, end)

    def _paired(self, nc: NcProgram, ours: Ints, baton: Baton) -> tuple[Ints, Ints]:
        """Stops of the original for stops of the text, and the last move of every stretch that they divide."""
        original, program = self.original, self.original.program
        stops = self._theirs(nc)
        behind = baton.stops + len(ours)
        theirs = stops[baton.stops : behind]
        pose = original.pose[theirs]
        if len(theirs) < len(ours):
            raise Irregular
        exact, _ = digit_errors(nc, ours, program.tip[pose], program.axis[pose], self.task.style.axis_length)
        if not exact.all():
            raise Irregular
        if not baton.lines and len(nc) and program.kind[original.pose[0]] == Move.RAPID and nc.kind[0] != Element.RAPID:
            raise Irregular
        end = stops[behind] if behind < len(stops) else len(original.pose)
        inside = baton.inside is not None
        return theirs, np.append(theirs if inside else theirs[1:], end)[: len(ours) + inside] - 1

    def _move(self, segment: int, at: float) -> tuple[int, float]:
        """Original move in front of a place, and how much of the next one is in front of it."""
        trail = self.original.trail
        owner = int(trail.owner[segment + 1])
        begin, end = int(trail.last[owner - 1]), int(trail.last[owner])
        return owner - 1, (segment + at - begin) / (end - begin)

    def _reach(self, nc: NcProgram, element: int, move: int, last: int) -> int:
        """Last original move that the text from an element on may come to, at most a given one."""
        length, trail = self.task.length, self.original.trail
        way = _LONGER * lengths(ends(nc, element, len(nc) - 1, self.task.style.axis_length))[-1]
        vertex = int(np.searchsorted(length, length[trail.last[move + 1]] + way, side="right"))
        return min(int(trail.owner[min(vertex, len(trail) - 1)]) + 1, last)

    def _anchor(self, matcher: Matcher, stretches: Stretches, wanted: int, last: int) -> tuple[int, int, float]:
        """End of an element, from `wanted` on, of which there is no doubt where it is: element, segment, fraction."""
        *_, piece = matcher.pieces(stretches)
        found = matcher.anchor((piece[0], last, *piece[2:]), wanted)
        if found is None:
            raise Irregular
        return found

    def _compare(self, own: _Own, comparison: Comparison, baton: Baton) -> Section:
        """Measure a section."""
        # words beside the motion belong to the element in front of them
        before = baton.first if baton.lines else -1
        nc = comparison.nc
        events = [event for event in nc.events if before < event.element <= own.stop and event.letter != "("]
        at = np.array([event.element - 1 for event in events], np.int64)
        elements = np.unique(at)
        compared = comparison.compare(own.stretches, elements, so_far=self._largest, until=own.until)
        if compared.problems:
            raise Irregular
        self._largest = compared.largest
        places = compared.places[np.searchsorted(elements, at)]
        events = [
            replace(event, element=event.element + baton.elements, line=event.line + baton.lines) for event in events
        ]
        return Section(compared, events, places, int(self.original.trail.last[own.move]))
