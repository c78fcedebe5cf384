"""Machines and their rotary angles."""

from cornersmooth.kinematics.dynamics import Dynamics
from cornersmooth.kinematics.findings import axis_rates
from cornersmooth.kinematics.insertion import FilledPath, Insertions, fill, insertions
from cornersmooth.kinematics.machine import Machine, RotaryAxis
from cornersmooth.kinematics.machine_files import load_machine, machine_names, parse_machine
from cornersmooth.kinematics.orientation import Solutions, solutions, tool_axis
from cornersmooth.kinematics.position import inverse_time, machine_position, tip_position
from cornersmooth.kinematics.route import RotaryPath, rapid_moves, rotary_angles

__all__ = [
    "Dynamics",
    "FilledPath",
    "Insertions",
    "Machine",
    "RotaryAxis",
    "RotaryPath",
    "Solutions",
    "axis_rates",
    "fill",
    "insertions",
    "inverse_time",
    "load_machine",
    "machine_names",
    "machine_position",
    "parse_machine",
    "rapid_moves",
    "rotary_angles",
    "solutions",
    "tip_position",
    "tool_axis",
]
