"""Every control in every form, with and without a machine, with and without tool tip control."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache
from itertools import product

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import Machine, load_machine
from cornersmooth.nc import Form, choose_form, control_names, load_control

MACHINES = ("table-ac", "table-bc", "xyzac-trt", "xyzbc-trt", "head-table-bc", "head-ac", "nutated-bc")


@dataclass(frozen=True)
class Case:
    """What is asked for on the command line."""

    control: str
    form: str
    machine: str = ""
    tcp: bool = True

    def __str__(self) -> str:
        parts = [self.control, self.form, self.machine, "" if self.tcp else "axes"]
        return "-".join(part for part in parts if part)

    def choose(self, *, endless: bool = False) -> Form:
        """Form of the control; SettingsError where it has none such. `endless` takes the limits off the machine."""
        return _form(self, endless)

    @property
    def runs(self) -> bool:
        """Whether the control can run it."""
        try:
            self.choose()
        except SettingsError:
            return False
        return True


@cache
def _machine(name: str) -> Machine:
    return load_machine(name)


@cache
def _form(case: Case, endless: bool) -> Form:
    machine = _machine(case.machine) if case.machine else None
    if machine is not None and endless:
        machine = without_limits(machine)
    return choose_form(case.control, case.form, machine=machine, tcp=case.tcp)


def without_limits(machine: Machine) -> Machine:
    """Machine whose axes go round without end: real files were made for others."""
    first, second = (replace(axis, limits=None) for axis in machine.axes)
    return replace(machine, axes=(first, second))


#: everything that can be asked for
ALL = [
    Case(control, form, machine, tcp)
    for control in control_names()
    for form in load_control(control).forms
    for machine, tcp in product(("", *MACHINES), (True, False))
]

#: everything that can be run
RUNNABLE = [case for case in ALL if case.runs]


def _chosen() -> list[Case]:
    """What no machine is needed for, and each control with one machine or two, all machines among them."""
    machines = {  # with tool tip control, and one without
        "fanuc": ("table-ac", "table-bc"),
        "generic": ("xyzbc-trt", "head-table-bc"),
        "haas": ("table-bc", "nutated-bc", "table-bc"),
        "heidenhain": ("table-bc", ""),
        "linuxcnc": ("xyzac-trt", "xyzbc-trt", "xyzac-trt"),
        "mitsubishi": ("head-ac", "nutated-bc"),
        "siemens": ("table-ac", "table-bc"),
    }
    chosen = [Case(control, "g1", name) for control, names in machines.items() for name in names[:-1]]
    chosen += [Case(control, "g1", names[-1], tcp=False) for control, names in machines.items() if names[-1]]
    return [case for case in RUNNABLE if not case.machine] + chosen


#: what tests run; `nc.sweep --all` runs all of `RUNNABLE`
CHOSEN = _chosen()
