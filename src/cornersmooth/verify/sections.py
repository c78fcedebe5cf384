"""A long text, read and measured section by section, by several processes at once, also while it is being written.

A text is cut at fixed distances into *sections*. What a section is to be measured against is known from the stops:
when the stops of all sections so far are exactly those of the CL file, one after the other, then so are its own. Where
there is no stop near a cut, an anchor takes its place: an end of a block of which there is no doubt where on the
original it is. And what holds at the beginning of a section - the modal state of the control - is what held at the end
of the section before. A process need not wait for that: it guesses, from the head of the text and a few lines in front
of its section, reads, and compares with the truth when it is handed on; a section that was read from a wrong guess is
read again.

All this is for texts that are as they should be. Whenever something is not, the attempt is abandoned, and the text is
read and measured as a whole: sections find out nothing but that nothing is wrong.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from cornersmooth.model import Bools, Floats, Move, Program, Units
from cornersmooth.verify.comparison import Compared
from cornersmooth.verify.deviation import exact_poses
from cornersmooth.verify.ncprogram import Event, Second
from cornersmooth.verify.reader import Standing
from cornersmooth.verify.source import Source
from cornersmooth.verify.style import Style
from cornersmooth.verify.trails import Original, original_motion


class Irregular(Exception):  # noqa: N818 - no error: the text is looked at as a whole then
    """The text is not, or may not be, as it should be."""


@dataclass(frozen=True)
class Task:
    """What all processes know.

    Parameters
    ----------
    program : Program
    source : Source
    style : Style
    words : bool
        See `verify`.
    """

    program: Program
    source: Source
    style: Style
    words: bool

    @classmethod
    def of(cls, program: Program, source: Source, style: Style, *, words: bool) -> Task | None:
        """Make it; None for what is not looked at in sections: texts for a machine's axes, and CL files with holes."""
        if style.machine is not None or (program.kind == Move.HOLE).any() or (program.kind == Move.FROM).all():
            return None
        return cls(program, source, style, words)

    @cached_property
    def original(self) -> Original:
        """The CL motion; every process makes it for itself, while there is no text yet."""
        return original_motion(self.program, self.style.tolerance, self.style.axis_length)

    @cached_property
    def length(self) -> Floats:
        """Length of the original path up to its vertices, mm."""
        return self.original.trail.lengths(self.style.axis_length)

    @cached_property
    def exact(self) -> Bools:
        """(m,) moves whose end must be passed exactly."""
        return exact_poses(self.original)


@dataclass(frozen=True)
class Baton:
    """What is known where a section begins.

    Parameters
    ----------
    standing : Standing
    lines, blocks, elements, curves : int
        In front of it.
    stops : int
        Stops of the original that belong to what is in front of it.
    first : int
        Element at the end of which it is the section's turn, counted from where the section begins.
    inside : (segment, fraction), optional
        Where on the original that is, if it is no stop.
    """

    standing: Standing | None = None
    lines: int = 0
    blocks: int = 0
    elements: int = 0
    curves: int = 0
    stops: int = 0
    first: int = 0
    inside: tuple[int, float] | None = None

    def plus(self, length: Baton) -> Baton:
        """Return what is known behind a section that adds so much; a feed not known there is the one held here."""
        standing = length.standing
        if standing is not None and self.standing is not None and np.isnan(standing.modal.feed):
            standing = replace(standing, modal=standing.modal.but(feed=self.standing.modal.feed))
        return Baton(
            standing,
            self.lines + length.lines,
            self.blocks + length.blocks,
            self.elements + length.elements,
            self.curves + length.curves,
            self.stops + length.stops,
            length.first,
            length.inside,
        )


@dataclass
class Section:
    """What one section shows.

    Parameters
    ----------
    compared : Compared
    events : list of Event
        With the elements of the whole text.
    places : (e,) float64, mm
        Of the events, on the path from the stop that the section begins with.
    vertex : int
        Vertex of the original trail at that stop.
    """

    compared: Compared
    events: list[Event]
    places: Floats
    vertex: int


@dataclass
class Found:
    """What all sections show together.

    Parameters
    ----------
    sections : list of Section
        In order.
    end : Baton
        Behind the last.
    units, second_is, margin
        As of `NcProgram` and `Matcher`.
    """

    sections: list[Section]
    end: Baton
    units: Units
    second_is: Second
    margin: float


@dataclass
class Share:
    """What one process has found: sections by their number, and the end, if it came upon it."""

    sections: dict[int, Section] = field(default_factory=dict)
    end: Baton | None = None
    manners: set[tuple[Units, Second, float]] = field(default_factory=set)


def put_together(shares: Iterable[Share | None]) -> Found | None:
    """All sections in order; None where anything is irregular."""
    sections: dict[int, Section] = {}
    manners: set[tuple[Units, Second, float]] = set()
    end: Baton | None = None
    for share in shares:
        if share is None:
            return None
        sections |= share.sections
        manners |= share.manners
        end = end or share.end
    if end is None or len(manners) != 1:
        return None
    return Found([sections[k] for k in sorted(sections)], end, *manners.pop())
