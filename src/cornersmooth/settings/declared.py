"""The one declaration of an option: a field with its unit, bounds, help and flags.

The command line, keys of ``cornersmooth.toml``, reports and their schema come from it.
"""

from __future__ import annotations

from dataclasses import field
from typing import Any


def option(
    default: Any,
    help: str = "",
    *,
    unit: str = "",
    bounds: tuple[float, float] | None = None,
    flags: str = "",
    instead: str = "",
) -> Any:
    """Field of an option.

    Parameters
    ----------
    help : str
        What it is, as the command line shows it; empty where that has no such option.
    unit : str
        As in ``mm/s2``.
    bounds : (float, float), optional
        Closed, of one number or several.
    flags : str
        On the command line, beside the long one of the field's name; a long one here takes its place.
    instead : str
        Field whose value counts where this one is None.
    """
    return field(
        default=default,
        metadata={"help": help, "unit": unit, "bounds": bounds, "flags": flags, "instead": instead},
    )


def key_of(name: str, unit: str) -> str:
    """Key of an option in a record, with its unit: ``accel_mm_per_s2``."""
    return f"{name}_{unit.replace('/', '_per_')}" if unit else name
