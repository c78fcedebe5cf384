"""Messages about rotary axes: poses out of reach, limits, the pole, rewinds, changes of solution."""

from __future__ import annotations

import numpy as np

from cornersmooth.arrays.vectors import norm
from cornersmooth.errors import Finding, InputError
from cornersmooth.kinematics.machine import Machine
from cornersmooth.kinematics.poses import pole_distance
from cornersmooth.model import Bools, Floats, Ints

#: A cut counts as near the pole where the first rotary axis turns by so many times what the tool axis turns by.
NEAR_POLE = 20.0
NO_TURN = 1e-6  #: Turns of a rotary axis below this (degrees) are rounding.
CHUNK = 1 << 15  #: Poses looked at at a time.


def reach_error(machine: Machine, axis: Floats, beyond: float, line: int, file: str | None) -> InputError:
    """Say that no rotary angles give this axis."""
    vector = ", ".join(f"{number:.6f}" for number in axis)
    return InputError(
        "CS361",
        f"tool axis ({vector}) is {beyond:.3f} deg beyond the reach of {' and '.join(machine.names)} of {machine.name}",
        "turn the part or use a machine that reaches it",
        file=file,
        line=line or None,
    )


def limit_error(
    machine: Machine, both: Floats, words: Floats | None, line: int, file: str | None, since: int = 0
) -> InputError:
    """Say that a rotary word leaves its limits: with either solution alone, or because the cut began on the other one.

    `both` (2, 2) are the solutions of the pose, `words` (2,) those at which the furthest choice leaves the limits; the
    cut starts at the line `since`, 0 where unknown.
    """
    limits = machine.limits
    turned = both + 360 * np.round((limits.clip(-1e6, 1e6).mean(axis=1) - both) / 360)
    excess = np.maximum(np.maximum(limits[:, 0] - turned, turned - limits[:, 1]), 0.0)
    alone = bool((excess.max(axis=1) > NO_TURN).all())
    shown = turned[int(np.argmin(excess.max(axis=1)))] if alone or words is None else words
    over = np.maximum(limits[:, 0] - shown, shown - limits[:, 1])
    axis = int(np.argmax(over))
    name = machine.names[axis]
    limit = limits[axis, 0] if shown[axis] < limits[axis, 0] else limits[axis, 1]
    text = f"{name} would have to go to {shown[axis]:.3f} deg, its limit is {limit:g} deg"
    if alone or words is None:
        hint = "turn the part or use a machine with more travel"
    else:
        text += f", in a cut from line {since} on" if since else ", in one cut"
        hint = (
            "interrupt the cut with a retract in rapid before, so that the axis can turn back, or give --rewind, "
            "for a control that has a retract"
        )
    return InputError("CS362", text, hint, file=file, line=line or None)


def pole_finding(
    machine: Machine, tip: Floats, axis: Floats, angles: Floats, rapid: Bools, line: Ints
) -> tuple[Finding, ...]:
    """Cuts near the pole, where the first rotary axis turns fast: where, how close, how fast."""
    if len(machine.names) < 2:
        return ()
    found = [np.zeros(0, np.int64)]
    for begin in range(0, len(axis) - 1, CHUNK):
        here = slice(begin, begin + CHUNK + 1)
        turn, tilt = np.abs(np.diff(angles[here, 0])), norm(np.diff(axis[here], axis=0))
        fast = (turn > NO_TURN) & (turn > NEAR_POLE * np.degrees(tilt)) & ~rapid[here][1:]
        found.append(begin + np.flatnonzero(fast))
    edges = np.concatenate(found)
    if not len(edges):
        return ()
    turns = np.abs(angles[edges + 1, 0] - angles[edges, 0])
    lengths = norm(tip[edges + 1] - tip[edges])
    rates = np.where(lengths > 0, turns / np.where(lengths > 0, lengths, 1.0), np.inf)
    worst = int(np.argmax(rates))
    closest = float(min(pole_distance(machine, axis[edges]).min(), pole_distance(machine, axis[edges + 1]).min()))
    name = machine.names[0]
    speed = f"{rates[worst]:.4g} deg/mm" if np.isfinite(rates[worst]) else "with the tip standing still"
    text = (
        f"the tool axis comes within {closest:.3g} deg of the pole of {name}, which turns fast there: "
        f"{turns[worst]:.4g} deg in one move, {speed}"
    )
    passages = 1 + int(np.count_nonzero(np.diff(edges) > 1))
    return (Finding("CS363", "warning", int(line[edges[worst] + 1]), text, passages),)


def rewind_finding(machine: Machine, angles: Floats, rapid: Bools, line: Ints) -> tuple[Finding, ...]:
    """Rapids in which an axis turns back by whole turns to stay inside its limits."""
    rapids = np.flatnonzero(rapid[1:])
    step, findings = np.abs(angles[rapids + 1] - angles[rapids]), list[Finding]()
    for axis, name in enumerate(machine.names):
        moves = np.flatnonzero(step[:, axis] > 180 + NO_TURN)
        if len(moves):
            text = f"{name} turns back by {step[moves[0], axis]:.4g} deg in a rapid, to stay inside its limits"
            findings.append(Finding("CS364", "warning", int(line[rapids[moves[0]] + 1]), text, len(moves)))
    return tuple(findings)


def swap_finding(machine: Machine, swaps: Ints, line: Ints) -> tuple[Finding, ...]:
    """Rapids in which the rotary axes go over to their other solution."""
    if not len(swaps):
        return ()
    text = f"{' and '.join(machine.names)} go over to their other solution in a rapid: keep clear of the part there"
    return (Finding("CS365", "note", int(line[swaps[0]]), text, len(swaps)),)
