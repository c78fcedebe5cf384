"""What one process does with its sections of a text: read, wait for the truth, compare, hand on, measure."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import count
from typing import Final

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.model import Ints, Move
from cornersmooth.verify.comparison import Comparison
from cornersmooth.verify.deviation import Largest
from cornersmooth.verify.layouts import Layouts
from cornersmooth.verify.ncprogram import Element, NcProgram
from cornersmooth.verify.reader import CONTROL_WORDS, Reader, Standing, closed
from cornersmooth.verify.ring import LeftAlone, Place
from cornersmooth.verify.runs import CHUNK, read_lines
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

#: bytes read at a time behind a section, up to its next stop, and sections to look for one in
_BEHIND: Final = 1 << 17
_SECTIONS_BEHIND: Final = 2


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
        It has read on to the next stop.
    length : Baton
        What the section adds, and what holds at its end.
    first, stop : int
        Its own elements: from its first stop to the first behind it (excluded).
    """

    reader: Reader
    length: Baton
    first: int
    stop: int


class _Worker:
    """One process."""

    def __init__(self, task: Task, place: Place) -> None:
        self.task, self.place, self.source = task, place, task.source
        self.original, self.exact = task.original, task.exact
        self.spelling = task.style.dialect.spelling
        self.layouts = Layouts(self.spelling.columns, numbered=self.spelling.numbered)
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
            stretches = self._stretches(nc, read, baton)
            behind = baton.plus(read.length, len(stretches))
            if stop is not None:
                place.give(behind)
            elif behind.stops < len(self._theirs(nc)):
                raise Irregular
            else:
                share.end = behind
            if len(stretches):
                share.sections[k], margin = self._compare(read, baton, nc, stretches)
                share.manners.add((nc.units, nc.second_is, margin))
        return share

    def _edge(self, k: int) -> int | None:
        """Where section k begins: where no curve is cut in two; None behind the end of the text."""
        place = k * SECTION
        if k == 0 or self.source.size(place + 1) <= place:
            return None if k else 0
        for reach in _REACHES:
            begin = max(place - reach, 0)
            cut = self.spelling.cut(self.source.read(begin, place))
            if cut:
                return begin + cut
        raise Irregular

    def _reader(self, standing: Standing | None) -> Reader:
        return Reader(self.source.name, self.task.style, self.steps, standing)

    def _lines(self, part: Part, number: int = 1, size: int = CHUNK) -> Iterator[Table | Line]:
        return read_lines(part, self.source.name, self.spelling, layouts=self.layouts, number=number, size=size)

    def _guess(self, start: int) -> Standing:
        """What may hold where a section begins; its feed is not known."""
        if self._head is None:
            reader = self._reader(None)
            reader.take(self._lines(self.source.part(0, self.spelling.cut(self.source.read(0, _HEAD)))))
            held = reader.standing
            self._head = replace(held, modal=held.modal.but(feed=float("nan")))
        begin = max(start - _BEFORE, 0)
        begin += self.spelling.cut(self.source.read(begin, begin + _BEGIN))
        reader = self._reader(self._head)
        reader.take(self._lines(self.source.part(begin, start)))
        return reader.standing

    def _read(self, start: int, stop: int | None, standing: Standing | None) -> _Read:
        """Read a section, and on to the next stop."""
        reader = self._reader(standing)
        lines = self._lines(self.source.part(start, self.source.size(start) + 1 if stop is None else stop))
        reader.take(self._severed(lines) if start else lines)
        length = Baton(reader.standing, reader.lines, reader.blocks, reader.elements, reader.pile.curves)
        first = reader.next_stop(0) if start else 0
        following = reader.elements if stop is None else self._read_on(reader, stop)
        return _Read(reader, length, following if first is None else first, following)

    def _severed(self, lines: Iterator[Table | Line]) -> Iterator[Table | Line]:
        """Lines of a section, which must not go on with a curve of the one before."""
        for number, item in enumerate(lines):
            if number == 0:
                row = None if isinstance(item, Table) or not item.words else self.task.style.dialect.row(item)
                if (isinstance(item, Table) and not closed(item)) or (row is not None and "G" not in row):
                    raise Irregular
            yield item

    def _read_on(self, reader: Reader, stop: int) -> int:
        """Read behind a section to the next stop, and return its element."""
        looked, farthest = reader.elements, stop + _SECTIONS_BEHIND * SECTION
        for item in self._lines(self.source.part(stop, farthest), reader.lines + 1, _BEHIND):
            reader.take_one(item)
            found = reader.next_stop(looked)
            if found is not None:
                return found
            looked = max(looked, reader.elements)
        reader.flush()
        found = reader.next_stop(looked)
        if found is None and self.source.size(farthest + 1) > farthest:
            raise Irregular
        return reader.elements if found is None else found

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

    def _stretches(self, nc: NcProgram, read: _Read, baton: Baton) -> Stretches:
        """What lies between the stops of a section, if these are exactly those of the original that come next."""
        original, program = self.original, self.original.program
        ours = stops_of_text(nc, read.first, read.stop - 1)
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
        size = len(ours)
        move_last = np.append(theirs[1:], end)[:size] - 1
        element_last = np.append(ours[1:], read.stop)[:size] - 1
        return Stretches(theirs, move_last, ours, element_last, np.zeros(size))

    def _compare(self, read: _Read, baton: Baton, nc: NcProgram, stretches: Stretches) -> tuple[Section, float]:
        """Measure a section; also its margin."""
        style, whole = self.task.style, self.original
        first, last = int(stretches.move_first[0]), int(stretches.move_last[-1])
        stretches = replace(stretches, move_first=stretches.move_first - first, move_last=stretches.move_last - first)
        # words beside the motion belong to the element in front of them
        before = read.first if baton.lines else -1
        events = [event for event in nc.events if before < event.element <= read.stop and event.letter != "("]
        own = np.array([event.element - 1 for event in events], np.int64)
        elements = np.unique(own)
        comparison = Comparison(
            whole.part(first, last), self.exact[first : last + 1], nc, style.tolerance, style.axis_length
        )
        compared = comparison.compare(stretches, elements, so_far=self._largest)
        if compared.problems:
            raise Irregular
        self._largest = compared.largest
        places = compared.places[np.searchsorted(elements, own)]
        events = [
            replace(event, element=event.element + baton.elements, line=event.line + baton.lines) for event in events
        ]
        return Section(compared, events, places, int(whole.trail.last[first])), comparison.matcher.margin
