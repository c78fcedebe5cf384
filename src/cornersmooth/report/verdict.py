"""The outcome in one sentence, in the same words on the terminal and on the page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cornersmooth.model import SmoothProgram
from cornersmooth.report.corners import corner_table
from cornersmooth.smoothing.sharp import STRAIGHT_ON, other_corners, sharp_rows

#: sharp corners that a report lists
_LISTED = 100

#: part of the time below which an estimated saving is none
_ALIKE = 0.005

#: limits that the sentence about times names
_LIMITS_TOLD = 2
_LEAST_TOLD = 0.005


def sharp_corners(smoothed: SmoothProgram) -> tuple[int, list[dict[str, Any]]]:
    """Number of corners that stay sharp, and the first of them in path order: CL line, reason, turn.

    The turn is that of the tip path, or of the axis-point path where the tip goes straight on. The reason is a status,
    or one of `OtherCorners`.
    """
    rows, others = sharp_rows(smoothed), other_corners(smoothed.program, smoothed.settings.axis_length)
    table = corner_table(smoothed, rows[:_LISTED])
    pose = np.concatenate((np.asarray(table["corner"]), others.pose[:_LISTED]))
    tip = np.concatenate((np.asarray(table["tip_angle_deg"], np.float64), others.tip_turn[:_LISTED]))
    axis = np.concatenate((np.asarray(table["axis_angle_deg"], np.float64), others.axis_turn[:_LISTED]))
    status = [*table["status"].tolist(), *others.reason[:_LISTED].tolist()]
    turn, line = np.where(tip < STRAIGHT_ON, axis, tip), smoothed.program.line[pose]
    return len(rows) + len(others.pose), [
        {"line": int(line[k]), "status": status[k], "turn_deg": float(turn[k])}
        for k in np.argsort(pose, kind="stable")[:_LISTED].tolist()
    ]


def sharp_text(corner: Mapping[str, Any]) -> str:
    """One sharp corner in words: ``:387 reversal 176°``."""
    return f":{corner['line']} {corner['status'].replace('_', ' ')} {corner['turn_deg']:.0f}°"


@dataclass(frozen=True)
class Saving:
    """Planned times of a program as it was and as it is written.

    Parameters
    ----------
    direct, written : float, s
    part : float
        Part of the poses that was planned; below 1 both times are estimated from it.
    """

    direct: float
    written: float
    part: float = 1.0


def verdict(contents: Mapping[str, Any], saving: Saving | None = None) -> str:
    """Say how it went.

    Parameters
    ----------
    contents : mapping
        The report.
    saving : Saving, optional
    """
    found, unverified = contents.get("verification"), contents.get("not_verified", "")
    parts = ["NOT VERIFIED" + (f": {unverified}" if unverified else "")] if found is None else [kept_text(found)]
    if found is not None and unverified:
        parts.append(f"not verified: {unverified}")
    count = contents["summary"]["sharp"]
    if count:
        stay = "corner stays" if count == 1 else "corners stay"
        parts.append(f"{count:,} {stay} sharp, first {sharp_text(contents['sharp'][0])}")
    else:
        parts.append("no corner stays sharp")
    if saving is not None:
        parts.append(saving_text(saving))
    return "; ".join(parts)


def kept_text(found: Mapping[str, Any]) -> str:
    """Say whether the promise is kept, from what verification found (`Verification.to_dict`)."""
    if found["passed"]:
        axis = found.get("axis_tolerance_deg")
        return f"OK: within {found['tolerance_mm']:g} mm{'' if axis is None else f' and {axis:g} deg'} everywhere"
    count, problems = found["problem_count"], found["problems"]
    text = f"BROKEN: {count:,} {'problem' if count == 1 else 'problems'}"
    if problems:
        first = problems[0]
        line = f" in NC line {first['nc_line']}" if first["nc_line"] else ""
        text += f", first{line}: {first['text']}"
    return text


def saving_text(saving: Saving) -> str:
    """Say what smoothing saves of the time of the direct path."""
    direct, written, saved = saving.direct, saving.written, saving.direct - saving.written
    if saving.part < 1.0:
        share = max(100.0 * saving.part, 0.01)
        source = f"estimated from {share:.{1 if share >= 1.0 else 2}f} % of the path"
        if abs(saved) < _ALIKE * direct:
            return f"takes about {direct:.0f} s as the direct path does ({source})"
        if saved > 0.0:
            return f"saves about {saved:.0f} s of {direct:.0f} s ({source})"
        return f"takes about {-saved:.0f} s more than {direct:.0f} s ({source})"
    if abs(saved) < 0.05:
        return f"takes {written:.1f} s as the direct path does"
    return f"saves {saved:.1f} s of {direct:.1f} s" if saved > 0.0 else f"takes {-saved:.1f} s more than {direct:.1f} s"


def times_text(seconds: Mapping[str, float], names: Sequence[str], limits: Sequence[tuple[str, float]] = ()) -> str:
    """Say what smoothing saves of the planned time, and what limits the motion then.

    Parameters
    ----------
    seconds : mapping of str to float
        Planned times, as `feedrate.Comparison` has them.
    names : sequence of str
        Methods, and the text as written, to choose the fastest from.
    limits : sequence of (str, float), optional
        Limits that the fastest reaches, and the part of the cutting time, as `feedrate.limiting` gives them.
    """
    stops, jumps = seconds["direct_exact_stop"], seconds["direct_velocity_jump"]
    best = min(names, key=lambda name: seconds[name])
    saved = jumps - seconds[best]
    share = f" ({100.0 * abs(saved) / jumps:.0f} %)" if jumps else ""
    told = f"saves {saved:.1f} s of" if saved >= 0.0 else f"takes {-saved:.1f} s more than"
    text = f"{best} {told} the {jumps:.1f} s of the direct path{share}, which takes {stops:.1f} s with stops at corners"
    parts = [f"{name} {100.0 * part:.0f} %" for name, part in limits[:_LIMITS_TOLD] if part >= _LEAST_TOLD]
    return text + (f"; limited by {', '.join(parts)} of the cutting time" if parts else "")
