"""The texts of all controls that can be read back."""

from __future__ import annotations

from importlib import import_module
from typing import Final

from cornersmooth.control.word_tables import CONTROLS, word_table
from cornersmooth.errors import SettingsError
from cornersmooth.nc_reader.dialects.base import Dialect

__all__ = ["CONTROLS", "Dialect", "dialect_of"]

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
