"""The lines of a LinuxCNC program, read from its words, for the law of its planner."""

from __future__ import annotations

import re

import numpy as np

from cornersmooth.errors import InputError
from cornersmooth.feedrate.linuxcnc import AxisLimits, Lines
from cornersmooth.kinematics import Machine
from cornersmooth.model import MM_PER_UNIT

_COMMENT = re.compile(r"\([^)]*\)|;.*")
_WORD = re.compile(r"([A-Z])\s*([-+]?\d*\.?\d+)")
_AXES = "XYZABC"

#: G codes of motion that the law does not hold for: arcs, splines, threads, cycles, and feed per revolution
_UNKNOWN = frozenset((2, 3, 5, 5.1, 5.2, 33, 33.1, 38.2, 76, *range(81, 90), 95, 96))


def axis_limits(machine: Machine) -> AxisLimits:
    """Limits of the axes of a machine, as ``[AXIS_*]`` of its configuration has them."""
    limits = {item.name: item.per_second for item in machine.dynamics}
    columns = np.array([limits.get(name, (np.inf,) * 3) for name in _AXES])
    return AxisLimits(columns[:, 0], columns[:, 1])


def program_lines(text: str, name: str | None = None) -> Lines:
    """Read the moves of a program; the motion stops at words M and T, at G4 and at moves of the machine.

    Parameters
    ----------
    name : str, optional
        File name for messages.

    Raises
    ------
    InputError
        CS264: it has other motion than lines, or a line has no feed.
    """
    place, feed, blend, timed, unit, rapid = [np.nan] * 6, np.nan, np.nan, False, MM_PER_UNIT["mm"], True
    rows: list[tuple[list[float], list[float], float, float]] = []
    for number, line in enumerate(text.upper().splitlines(), 1):
        words = [(letter, float(value)) for letter, value in _WORD.findall(_COMMENT.sub("", line))]
        codes = {value for letter, value in words if letter == "G"}
        if strange := codes & _UNKNOWN:
            what = f"G{min(strange):g}: the law of LinuxCNC's planner is known for lines only"
            raise InputError("CS264", what, "leave out the time, or write lines", file=name, line=number)
        if rows and (codes & {4, 53} or any(letter in "MT" for letter, _ in words)):
            rows[-1] = (*rows[-1][:3], np.nan)
        unit = MM_PER_UNIT["inch" if 20 in codes else "mm"] if codes & {20, 21} else unit
        timed = (93 in codes) if codes & {93, 94} else timed
        rapid = (0 in codes) if codes & {0, 1} else rapid
        given = {letter: value * (unit if letter in "XYZ" else 1.0) for letter, value in words}
        feed = given.get("F", feed)
        if codes & {61, 61.1}:
            blend = np.nan
        elif 64 in codes:
            blend = given.get("P", 0.0) * unit
        target = [given.get(axis, old) for axis, old in zip(_AXES, place, strict=True)]
        if 53 in codes:  # in coordinates of the machine: where that is in those of the part, nothing says
            place = [np.nan if axis in given else old for axis, old in zip(_AXES, place, strict=True)]
            continue
        ends = [0.0 if np.isnan(value) else value for value in target]
        begins = [end if np.isnan(old) else old for old, end in zip(place, ends, strict=True)]
        place = target
        if begins == ends:
            continue
        if rapid:
            speed = np.inf
        elif timed:
            away = np.subtract(ends, begins)
            speed = float(np.linalg.norm(away[:3]) or np.linalg.norm(away)) * feed / 60.0
        else:
            speed = feed * (unit if begins[:3] != ends[:3] else 1.0) / 60.0
        if not speed > 0.0:
            raise InputError("CS264", "a line has no feed", "give it one", file=name, line=number)
        rows.append((begins, ends, float(speed), blend))
    starts, targets, speeds, blends = zip(*rows, strict=True) if rows else ((), (), (), ())
    start, end = (np.array(places, np.float64).reshape(-1, 6) for places in (starts, targets))
    return Lines(start, end, np.array(speeds, np.float64), np.array(blends, np.float64))
