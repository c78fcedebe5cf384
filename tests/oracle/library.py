"""The three calls of the library, as its users make them, and the program they started from as plain poses."""

from __future__ import annotations

import io
import math

import numpy as np
from numpy.typing import NDArray

import cornersmooth
from cornersmooth.model import Move, Program, SmoothProgram, Status
from cornersmooth.nc import Frame, choose_form
from oracle.motion import Original
from oracle.nc_text import Form, Written, parse

Floats = NDArray[np.float64]

#: share of the limit that a chord of an arc may hide
ARC_SAGITTA_SHARE = 0.02


def write(
    program: Program | bytes, form: Form, tolerance: float, axis_length: float
) -> tuple[Written, SmoothProgram, bytes]:
    """Parsed NC text of a program or of CL text, what it was made from, and the text; numpy faults are errors."""
    stream = io.BytesIO()
    with np.errstate(all="raise", under="ignore"):
        if isinstance(program, bytes):
            program = cornersmooth.read(program)
        wanted = cornersmooth.Settings(tolerance=tolerance, axis_length=axis_length, method="proportional")
        fitted = cornersmooth.fit_settings(wanted, choose_form("fanuc", form), program.units)
        smoothed = cornersmooth.smooth(program, fitted)
        # some real files have cycles that are refused
        cornersmooth.write(smoothed, stream, control="fanuc", form=form, frame=Frame(skip_cycles=True))
    return parse(stream.getvalue(), form), smoothed, stream.getvalue()


def exact_poses(smoothed: SmoothProgram) -> NDArray[np.int64]:
    """Indices of the poses that must be passed: all but the rounded, the repeated and the stated ones, and holes."""
    exact = (smoothed.program.kind != Move.FROM) & (smoothed.program.kind != Move.HOLE)
    status = smoothed.corners.status
    exact[smoothed.corners.pose[(status == Status.SMOOTHED) | (status == Status.DUPLICATE)]] = False
    return np.flatnonzero(exact)


def original_motion(program: Program, limit: float) -> Original:
    """All poses but the merely stated ones, rapids included; arcs as many short chords."""
    tips: list[Floats] = []
    axes: list[Floats] = []
    arc_of = {int(pose): index for index, pose in enumerate(program.arcs.pose)}
    for pose in range(len(program)):
        if program.kind[pose] == Move.FROM:
            continue
        tip = program.tip[pose : pose + 1]
        if pose in arc_of:
            tip = _arc(program, arc_of[pose], limit)
        tips.append(tip)
        axes.append(np.broadcast_to(program.axis[pose], tip.shape))
    return Original(np.concatenate(tips), np.concatenate(axes))


def _arc(program: Program, index: int, limit: float) -> Floats:
    """(m, 3) points of an arc or helix after its start, turned about its axis by Rodrigues' formula."""
    pose = int(program.arcs.pose[index])
    start, end = program.tip[pose - 1], program.tip[pose]
    centre, normal, sweep = program.arcs.centre[index], program.arcs.normal[index], program.arcs.sweep[index]
    arm = start - centre
    arm = arm - normal * (arm @ normal)
    radius = float(np.linalg.norm(arm))
    if radius == 0.0:
        alone: Floats = end[None, :]
        return alone
    step = math.sqrt(8 * ARC_SAGITTA_SHARE * limit / radius)
    part = np.arange(1, (n := max(4, math.ceil(sweep / step))) + 1)[:, None] / n
    turned = arm * np.cos(sweep * part) + np.cross(normal, arm) * np.sin(sweep * part) - arm
    # the end is what the file says; rise of a helix and rounding in the file run linearly
    points: Floats = start + turned + part * (end - start - turned[-1])
    return points
