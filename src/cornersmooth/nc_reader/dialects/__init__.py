"""The texts of all controls that can be read back."""

from __future__ import annotations

from typing import Final

from cornersmooth.control.word_tables import CONTROLS, word_table
from cornersmooth.errors import SettingsError
from cornersmooth.nc_reader.dialects.base import Dialect
from cornersmooth.nc_reader.dialects.heidenhain import Heidenhain
from cornersmooth.nc_reader.dialects.iso import Iso
from cornersmooth.nc_reader.dialects.siemens import Siemens

__all__ = ["CONTROLS", "Dialect", "dialect_of"]

_SPELLINGS: Final[dict[str, type[Dialect]]] = {"iso": Iso, "siemens": Siemens, "heidenhain": Heidenhain}


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
    return _SPELLINGS[word_table(control).get("spelling", "iso")](control, rotary)
