"""How a text is to be understood: its control and machine, the tolerance, the digits that it is printed with."""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Final

from cornersmooth.control.table import CONTROLS, Table, word_table
from cornersmooth.errors import SettingsError
from cornersmooth.nc_reader.dialects.base import Dialect
from cornersmooth.nc_reader.rotary import Rotary

if TYPE_CHECKING:
    from cornersmooth.kinematics.machine import Machine

#: classes of the modules of these names, each of which is loaded when a program in its words is read
_SPELLINGS: Final = {"iso": "Iso", "siemens": "Siemens", "heidenhain": "Heidenhain"}


def dialect_of(control: str, rotary: str = "") -> Dialect:
    """Dialect of a control.

    Parameters
    ----------
    rotary : str
        Addresses of the rotary axes of a machine; empty for texts without rotary words.

    Raises
    ------
    SettingsError
        CS204 for an unknown control.
    """
    if control not in CONTROLS:
        raise SettingsError("CS204", f"unknown control {control!r}", f"use one of {', '.join(CONTROLS)}")
    spelling = word_table(control).get("spelling", "iso")
    module = import_module(f"{__name__}.{spelling}")
    found: Dialect = getattr(module, _SPELLINGS[spelling])(control, rotary)
    return found


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
    table: Table  #: of words, with those that switch tip control of the machine's kinematics
    machine: Machine | None
    tcp: bool
    #: mm: as in `read_nc`
    tolerance: float
    axis_length: float

    @classmethod
    def of(
        cls, control: str, machine: Machine | None, *, tcp: bool, tolerance: float, axis_length: float
    ) -> ReadingOptions:
        """Choose it; errors as in `read_nc`."""
        dialect = dialect_of(control, "".join(machine.names) if machine is not None else "")
        if machine is None and not tcp:
            raise SettingsError("CS215", "machine positions need a machine", "name it with --machine")
        turns = machine is not None and len(machine.names) > 0
        switch = machine.tip_control if machine is not None and turns and dialect.switches else None
        table = dialect.table.switched(switch or ())
        return cls(control, dialect, table, machine if turns else None, tcp, tolerance, axis_length)

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
