"""NC text to `NcProgram`: what a control makes of it, block by block, with nothing known of who wrote it."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from cornersmooth.errors import SettingsError
from cornersmooth.nc_reader.dialects import CONTROLS, Dialect, dialect_of
from cornersmooth.nc_reader.elements import Elements, NcProgram
from cornersmooth.nc_reader.reader import Reader
from cornersmooth.nc_reader.rotary import Rotary
from cornersmooth.nc_reader.source import Source, readable_twice

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

__all__ = ["CONTROLS", "read_nc"]

#: decimals are looked for in so many bytes before the first block is read, and then in all that is read
DIGITS_SAMPLE: Final = 1 << 16

#: share of the tolerance that the rounding of one number, half a step of its last digit, accounts for at most: a
#: control reads ``I0.`` as 0 exactly, however few digits a program shows
DIGITS_SHARE: Final = 0.5


@dataclass(frozen=True)
class Steps:
    """What the last printed digit is worth."""

    tip: float  #: in units of the text
    second: float  #: of the second triple; 0 without any

    def finer(self, other: Steps) -> Steps:
        """Give the finer of two of the same text."""
        seconds = [second for second in (self.second, other.second) if second]
        return Steps(min(self.tip, other.tip), min(seconds, default=0.0))


@dataclass(frozen=True)
class ReadingOptions:
    """How a text is to be understood."""

    control: str
    dialect: Dialect
    machine: Machine | None
    tcp: bool
    #: mm: as in `read_nc`
    tolerance: float
    axis_length: float

    @classmethod
    def of(
        cls, control: str, machine: Machine | None, *, tcp: bool, tolerance: float, axis_length: float
    ) -> ReadingOptions:
        """Choose it.

        Raises
        ------
        SettingsError
            CS204 for an unknown control, CS215 for positions of a machine that is not named.
        """
        without = machine is not None and not machine.names
        if without:
            machine = None
        dialect = dialect_of(control, "".join(machine.names) if machine is not None else "")
        if machine is None and not tcp and not without:
            raise SettingsError("CS215", "machine positions need a machine", "name it with --machine")
        return cls(control, dialect, machine, tcp, tolerance, axis_length)

    def steps(self, sample: bytes) -> Steps:
        """Printed digits of a piece of a text, as its control's format shows them."""
        tip, second = self.dialect.decimals(sample)
        return Steps(10.0**-tip, 0.0 if second is None else 10.0**-second)

    @property
    def widest(self) -> tuple[float, float]:
        """Largest steps of tip (mm) and of a vector of length 1 that are accounted for."""
        widest = 2.0 * DIGITS_SHARE * self.tolerance
        return widest, widest / self.axis_length

    def rotary(self, steps: Steps) -> Rotary | None:
        """What resolves rotary words; None without a machine."""
        if self.machine is None:
            return None
        tip, turn = self.widest
        angle = min(steps.second or 1.0, math.degrees(turn))
        return Rotary(self.machine, self.tcp, self.tolerance, self.axis_length, min(steps.tip, tip), angle)


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
        reader = Reader(label, options, options.steps(source.head(DIGITS_SAMPLE)))
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
        retracts=tuple(reader.retracts.places),
        unlooked=tuple(reader.unlooked),
        coarse=reader.coarse,
    )
