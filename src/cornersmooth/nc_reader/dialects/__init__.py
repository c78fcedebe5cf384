"""The texts of all controls that can be read back."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from cornersmooth.errors import SettingsError
from cornersmooth.nc_reader.dialects.base import Dialect
from cornersmooth.nc_reader.dialects.heidenhain import Heidenhain
from cornersmooth.nc_reader.dialects.iso import Iso
from cornersmooth.nc_reader.dialects.siemens import Siemens

__all__ = ["CONTROLS", "Dialect", "dialect_of"]

_DIALECTS: Final[dict[str, Callable[[str], Dialect]]] = {
    **{name: partial(Iso, name) for name in ("fanuc", "generic", "haas", "linuxcnc", "mitsubishi")},
    "heidenhain": Heidenhain,
    "siemens": Siemens,
}

#: controls whose texts are read
CONTROLS: Final = tuple(sorted(_DIALECTS))


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
    if control not in _DIALECTS:
        raise SettingsError("CS204", f"unknown control {control!r}", f"use one of {', '.join(CONTROLS)}")
    return _DIALECTS[control](rotary)
