"""How a text is read back: which dialect a control's name or table stands for, and with which machine."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cornersmooth.kinematics import Machine


@dataclass(frozen=True)
class Readback:
    """How a text is to be read.

    Parameters
    ----------
    control : str
        Dialect; empty where none is known.
    own : bool
        Whether the control is a table of the user's own, whose words may mean what nobody else knows.
    machine : Machine or None
    tcp : bool
    """

    control: str
    own: bool
    machine: Machine | None
    tcp: bool

    @property
    def reading(self) -> dict[str, Any]:
        """Keyword arguments of `verify.read_nc`."""
        return {"control": self.control, "machine": self.machine, "tcp": self.tcp}


def readback(control: str, machine: str | Machine | None, *, tcp: bool) -> Readback:
    """How to read a text of a control, by its name or its TOML file.

    Raises
    ------
    SettingsError
        Unknown names, or files that cannot be read.
    """
    from cornersmooth.kinematics import load_machine

    own = _is_file(control)
    chosen = load_machine(machine) if isinstance(machine, str) else machine
    return Readback(_base(control) if own else control, own, chosen, tcp)


def _is_file(control: str) -> bool:
    return control.endswith(".toml") or "/" in control or "\\" in control


def _base(path: str) -> str:
    """Name of the built-in control that a table is like; empty for none."""
    from cornersmooth.nc import load_control
    from cornersmooth.verify import CONTROLS

    like = load_control(path).like
    return like if like in CONTROLS else ""
