"""NC text read back: what a control makes of it, with nothing known of who wrote it.

Verification, plans of written texts, pages and the machined surface all start from it. Shares no code with
`smoothing` and `nc`, which make such texts::

    bytes -> chunks -> tables -> elements

================= =====================================================================================================
word              meaning
================= =====================================================================================================
block             an NC block: a line of the text
chunk, table      bytes read at a time; a run of motion blocks as columns of words
element           what a motion block does: rapid, line, arc or curve; rotary words may make several lines of one block
event             a word that stands beside the motion
================= =====================================================================================================

Where is what:

- bytes to tables: `control` (lines, words and what they mean), `dialects` (grammar), `acts` (what a block does)
- tables to elements: `reader` goes through the text, `execution` executes, with `splines` and
  `rotary`; `needed_states` says which words want another state; `retracts` leads back from them
- what comes out: `elements`; `tool` says where the tool is
"""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from cornersmooth.control.source import Source, readable_twice
from cornersmooth.control.table import CONTROLS, word_table
from cornersmooth.nc_reader.dialects import ReadingOptions
from cornersmooth.nc_reader.elements import Elements, Event, NcProgram, Problem
from cornersmooth.nc_reader.reader import Reader

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

__all__ = ["CONTROLS", "Event", "NcProgram", "Problem", "read_nc"]


def read_nc(
    data: bytes | str | os.PathLike[str],
    *,
    control: str = "fanuc",
    machine: Machine | None = None,
    tcp: bool = True,
    name: str | None = None,
    tolerance: float = 0.01,
    axis_length: float = 10.0,
) -> NcProgram:
    """Read an NC text.

    Parameters
    ----------
    data : bytes or path
        The text itself, or the file that holds it.
    control : str
        One of `CONTROLS`.
    machine : Machine, optional
        That the rotary words of the text are for; without one it has tool vectors, axis points or a fixed tool.
    tcp : bool
        Whether X Y Z are the tip, or positions of the machine's axes.
    name : str, optional
        Name for messages; the file's own by default.
    tolerance, axis_length : float, mm
        How fine motion in rotary words is resolved: to a two-hundredth of `tolerance` at tip and axis point.

    Returns
    -------
    NcProgram
        What breaks the rules of the control is in `NcProgram.problems`, as far as the rest can be understood.

    Raises
    ------
    InputError
        CS501 where the text is not made of words, CS503 for words that make it impossible to tell where the tool is.
    SettingsError
        CS204 for an unknown control, CS215 for positions of a machine that is not named.
    """
    options = ReadingOptions.of(control, machine, tcp=tcp, tolerance=tolerance, axis_length=axis_length)
    label = name if name is not None or isinstance(data, bytes) else str(data)
    source = Source(readable_twice(data))
    try:
        source.finish()
        reader = Reader(label, options)
        return program_of(reader, list(reader.chunks(reader.lines(source))))
    finally:
        source.close()


def program_of(reader: Reader, parts: list[Elements]) -> NcProgram:
    """Put together what was given out, and what the text says beside the motion."""
    elements = Elements.joined(parts) if parts else reader.nothing
    return NcProgram(
        **vars(elements),
        events=tuple(sorted(reader.events, key=lambda event: event.line)),
        problems=tuple(reader.problems),
        units=reader.units,
        blocks=reader.blocks,
        means=reader.dialect.means,
        feed_in_plane=word_table(reader.dialect.control).get("feed_in_plane", False),
        retracts=tuple(reader.retracts.places),
        unlooked=tuple(reader.unlooked),
        coarse=reader.coarse,
    )
