"""Holes that a text leaves out on purpose, as its comments say: it only goes over them."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Move, Program
from cornersmooth.nc_reader.elements import Element, NcProgram
from cornersmooth.nc_reader.hole_cycles import NOT_DRILLED
from cornersmooth.statements.cycles import drillings
from cornersmooth.statements.tokens import TAP

#: numbers behind X, Y and Z
_PLACE: Final = re.compile(r"([XYZ])([-+]?[\d.]+)")

#: mm by which a printed place may be off, and the text beside the line of the hole; the same for directions
_ROOM: Final = 0.002


def may_be_left_out(program: Program) -> dict[int, bool]:
    """Poses of holes that a text need not drill, and whether they are to be tapped: other cycles are not understood."""
    poses = np.flatnonzero(program.kind == Move.HOLE).tolist()
    cycles = zip(poses, drillings(program, poses), strict=True)
    return {pose: cycle.tap for pose, cycle in cycles if cycle.tap or np.isnan(cycle.depth)}


def gone_over(program: Program, nc: NcProgram, *, stays: bool) -> Program | None:
    """The CL program with holes that a text leaves out as rapids to where the text goes over them.

    Which rapids of a text belong to such a hole is open where others are along its line. The text says in comments
    where it leaves a hole out; the rapid behind one goes over it, or the tool is there already. It `stays` where it is
    over the hole, or goes on along its line.

    Returns
    -------
    Program or None
        None where the text leaves no hole out, its comments name others than the CL file has, or a tap is neither said
        to be left out nor there.
    """
    said = [event for event in nc.events if event.letter == "(" and event.text.startswith(NOT_DRILLED)]
    taps = may_be_left_out(program)
    left = list(taps)
    tip, axis, kind = program.tip.copy(), program.axis.copy(), program.kind.copy()
    k = 0
    for number, event in enumerate(said):
        place = np.array([float(value) for _, value in _PLACE.findall(event.text)]) * program.mm_per_unit
        if len(place) != 3:
            return None
        while k < len(left) and np.abs(program.tip[left[k]] - place).max() > _ROOM:
            k += 1
        if k == len(left):
            return None
        pose, k = left[k], k + 1
        behind = said[number + 1].element if number + 1 < len(said) else len(nc.kind)
        kind[pose] = Move.RAPID
        goes = event.element < behind and nc.kind[event.element] == Element.RAPID
        places = [event.element - 1] * (event.element > 0) + [event.element] * bool(goes)
        over = [one for one in places if _is_over(program.tip[pose], program.axis[pose], nc, one)]
        if over:
            tip[pose] = nc.tip[over[0 if stays else -1]]
        elif pose:
            tip[pose], axis[pose] = tip[pose - 1], axis[pose - 1]
    tapped = sum((event.letter, event.value) == ("G", TAP) for event in nc.events)
    if not said or sum(taps[pose] for pose in left if kind[pose] == Move.HOLE) > tapped:
        return None
    return replace(program, tip=tip, axis=axis, kind=kind)


def _is_over(tip: Floats, axis: Floats, nc: NcProgram, element: int) -> bool:
    """Whether an element ends over a hole, in its line."""
    away = nc.tip[element] - tip
    height = float(away @ axis)
    second = nc.second[element] - (nc.tip[element] if nc.second_is == "point" else 0.0)
    turned = second / np.linalg.norm(second) - axis
    beside = np.linalg.norm(away - height * axis)
    return bool(height >= -_ROOM and beside <= _ROOM + _ROOM * height and np.linalg.norm(turned) <= _ROOM)
