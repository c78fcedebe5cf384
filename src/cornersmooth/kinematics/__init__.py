"""Machines: their axes and limits, the tool axis that rotary angles give and the angles that give it, positions."""

from cornersmooth.kinematics.machine import (
    Dynamics,
    Machine,
    RotaryAxis,
    Travel,
    check_dynamics,
    endless,
    load_machine,
    machine_names,
    machine_table,
    parse_machine,
    with_dynamics,
)
from cornersmooth.kinematics.poses import (
    Solutions,
    check_travel,
    machine_position,
    nose_position,
    solutions,
    tip_position,
    tool_axis,
)

__all__ = [
    "Dynamics",
    "Machine",
    "RotaryAxis",
    "Solutions",
    "Travel",
    "check_dynamics",
    "check_travel",
    "endless",
    "load_machine",
    "machine_names",
    "machine_position",
    "machine_table",
    "nose_position",
    "parse_machine",
    "solutions",
    "tip_position",
    "tool_axis",
    "with_dynamics",
]
