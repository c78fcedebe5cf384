"""The verdict in one line, in the same words on the terminal, in batches, on the page and in reports.

It names corners that stay sharp: the tool cuts on in another direction, and nothing rounds the path there. Most are
rows of `Corners`. The others are between moves of different kinds, which no method rounds.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cornersmooth.arrays import angle_between
from cornersmooth.errors import Finding, Verdict
from cornersmooth.geometry.arcs import arc_series
from cornersmooth.model import Floats, Ints, Move, Program, SmoothProgram, Status, Trait
from cornersmooth.report.tables import corner_table
from cornersmooth.smoothing.construction import BATCH, STRAIGHT_ON, legs_at
from cornersmooth.smoothing.proportional import CornerLengths

if TYPE_CHECKING:
    from cornersmooth.verify import Verification

#: sharp corners that a report lists
_LISTED = 100

#: limits that the sentence about times names
LIMITS_TOLD = 2
_LEAST_TOLD = 0.005


def sharp_rows(smoothed: SmoothProgram) -> Ints:
    """Rows of `Corners` that are not rounded although the path turns there, ascending.

    What forbids to round a pose says nothing of its turn, so that is looked at here, as `Status.STRAIGHT` is found.
    """
    corners, program, settings = smoothed.corners, smoothed.program, smoothed.settings
    rows = np.flatnonzero(~corners.rounded & ~np.isin(corners.status, Status.having(Trait.NO_CORNER)))
    turns = corners.after[rows] >= 0
    known = rows[turns]
    straight = [np.zeros(0, np.bool_)]
    for part in np.split(known, np.arange(BATCH, len(known), BATCH)):
        legs = legs_at(program, settings.axis_length, corners.pose[part], corners.before[part], corners.after[part])
        measured = CornerLengths(legs, settings)
        straight.append(measured.status == Status.STRAIGHT)
    turns[turns] = ~np.concatenate(straight)
    return rows[turns]


class OtherCorners(NamedTuple):
    """Corners between moves of different kinds, g of them in path order."""

    pose: Ints
    status: NDArray[np.uint8]  # `Status.ARC` or `Status.RAPID`
    tip_turn: Floats  # change of direction of the tip path, degrees
    axis_turn: Floats  # the same of the axis-point path


def other_corners(program: Program, axis_length: float) -> OtherCorners:
    """Find the corners of a path that are no poses inside a chain, where it turns by more than `STRAIGHT_ON`."""
    arc, step = program.kind == Move.ARC, np.diff(program.tip, axis=0, prepend=program.tip[:1])
    turn = axis_length * np.diff(program.axis, axis=0, prepend=program.axis[:1])
    cuts = arc | (program.kind == Move.LINEAR)
    cuts[:1] = False  # nothing to come from
    cuts[1:] &= ~np.isin(program.kind[:-1], (Move.FROM, Move.HOLE))
    still = (cuts & ~arc) | (program.kind == Move.RAPID)
    still[still] = ~(step[still].any(axis=1) | turn[still].any(axis=1))
    moving = np.flatnonzero(~still)
    one, other = moving[:-1], moving[1:]
    rapids = np.cumsum(still & (program.kind == Move.RAPID))
    meet = cuts[one] & cuts[other] & (arc[one] | arc[other] | (rapids[other] > rapids[one]))
    one, other = one[meet], other[meet]
    begins, ends = step.copy(), step
    rows = np.arange(len(program.arcs))
    begins[program.arcs.pose], ends[program.arcs.pose] = (arc_series(program, rows, share)[1] for share in (0.0, 1.0))
    tip = np.degrees(angle_between(ends[one], begins[other]))
    axis = np.degrees(angle_between(ends[one] + turn[one], begins[other] + turn[other]))
    bent = np.maximum(tip, axis) > STRAIGHT_ON
    status = np.where(arc[one] | arc[other], Status.ARC, Status.RAPID).astype(np.uint8)
    return OtherCorners(one[bent], status[bent], tip[bent], axis[bent])


def sharp_corners(smoothed: SmoothProgram) -> tuple[int, list[dict[str, Any]]]:
    """Number of corners that stay sharp, and the first of them in path order: CL line, reason, turn.

    The turn is that of the tip path, or of the axis-point path where the tip goes straight on.
    """
    rows, others = sharp_rows(smoothed), other_corners(smoothed.program, smoothed.settings.axis_length)
    table = corner_table(smoothed, rows[:_LISTED])
    pose = np.append(table["corner"], others.pose[:_LISTED])
    tip = np.append(table["tip_angle_deg"], others.tip_turn[:_LISTED])
    axis = np.append(table["axis_angle_deg"], others.axis_turn[:_LISTED])
    status = [*table["status"].tolist(), *(Status(code).key for code in others.status[:_LISTED])]
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
    """Planned times of a program as it was and as it is written."""

    direct: float  #: s
    written: float  #: s
    #: what the written program reaches, and the part of the cutting time, as `feedrate.limiting` gives them
    limits: tuple[tuple[str, float], ...] = ()
    against: str = ""  #: what the program as it was is, where that is not the path of the CL file

    @property
    def gains(self) -> bool:
        """Whether the program as it is written takes less time, in the digits that are written."""
        return round(self.written, 1) < round(self.direct, 1)

    @property
    def advice(self) -> str:
        """What to do where nothing is gained, after a semicolon; else nothing."""
        return "" if self.gains else "; no time is gained, leave the program as it was"


@dataclass(frozen=True)
class Judgement:
    """A verdict and what it rests on."""

    verdict: Verdict
    to_check: int  #: warnings that bear on the metal
    left_out: int  #: holes that an option left out
    unverified: str  #: what was not looked at; empty for nothing
    what: str  #: one clause: what was found

    @property
    def head(self) -> str:
        """The verdict, and how much is to check: ``PASSED, 3 to check``."""
        return self.verdict + (f", {self.to_check:,} to check" if self.to_check else "")

    @property
    def text(self) -> str:
        """The first line of every output."""
        return f"{self.head}: {self.what}"


def judge(found: Verification | None, findings: Iterable[Finding] = (), unverified: str = "") -> Judgement:
    """Give the verdict on a program from what verification found, and what was noticed on the way to the program.

    `unverified` is what was not looked at, where `found` does not say it.
    """
    findings = tuple(findings)
    out = [finding for finding in findings if finding.leaves_out]
    left_out = max(sum(finding.count for finding in out), 0 if found is None else found.left_out)
    unverified = unverified or ("nothing was measured" if found is None else found.unverified)
    problems = 0 if found is None else found.problem_count
    parts = []
    if found is not None and problems:
        parts.append(_problems_text(found))
    if unverified:
        parts.append(f"not verified: {unverified}" if parts else unverified)
    if left_out:
        first = min((finding.line for finding in out if finding.line), default=0)
        holes = f"{left_out:,} hole{'s' * (left_out != 1)} not drilled"
        parts.append(holes + (f", first CL line {first}" if first else ""))
    if found is not None and not problems:
        axis = "" if found.axis_tolerance is None else f" and {found.axis_tolerance:g} deg"
        more = f", {found.tolerance + found.rounding:g} mm with what the control rounds itself" * bool(found.rounding)
        parts.append(f"{'the rest ' if parts else ''}within {found.tolerance:g} mm{axis} everywhere{more}")
        parts += [f"offset {found.offset}, not compared"] if found.offset else []
    return Judgement(
        Verdict.of(problems=problems, unverified=bool(unverified), left_out=left_out),
        sum(finding.to_check for finding in findings),
        left_out,
        unverified,
        "; ".join(parts),
    )


def _problems_text(found: Verification) -> str:
    count = found.problem_count
    text = f"{count:,} {'problem' if count == 1 else 'problems'}"
    first = found.problems[0]
    line = f" in NC line {first.nc_line}" if first.nc_line else ""
    return f"{text}, first{line}: {first.text.partition('; ')[0]}"


def trusted_blocks(found: Verification) -> Iterator[Finding]:
    """Blocks of the user's own that nothing was compared with: one finding for each block."""
    lines: dict[str, list[int]] = {}
    for line, block in found.trusted:
        lines.setdefault(block, []).append(line)
    for block, where in lines.items():
        text = f"not compared with the CL file: {block}" + (f", NC line {where[0]}" if where[0] else "")
        yield Finding("CS573", "warning", 0, text, len(where))


def sharp_line(contents: Mapping[str, Any]) -> str:
    """Say how many corners stay sharp."""
    count = contents["summary"]["sharp"]
    if not count:
        return "no corner stays sharp"
    stay = "corner stays" if count == 1 else "corners stay"
    return f"{count:,} {stay} sharp, first {sharp_text(contents['sharp'][0])}"


def time_text(saving: Saving, limits: str | None) -> str:
    """Say the planned time, in place of which, under whose limits, and what limits it."""
    share = f" ({100.0 * (saving.written / saving.direct - 1.0):+.0f} %)" if saving.direct else ""
    against = f" of {saving.against}" if saving.against else ""
    where = f" on {limits}" if limits else ""
    text = f"time{where} {saving.written:.1f} s instead of {saving.direct:.1f} s{against}{share}{saving.advice}"
    return text + limits_text(saving.limits) + ("" if limits else f"; {limits_of(None)}")


def limits_of(machine: str | None) -> str:
    """Say whose limits a time keeps: the same program is far more of a gain where those of the axes count, too."""
    return "limits of the tip alone, --limits MACHINE adds the axes" if machine is None else f"limits of {machine}"


def method_text(summary: Mapping[str, Any]) -> str:
    """Say which method made the curves, for how many runs, and what was done in another way, and why."""
    text = summary["method"]
    if runs := summary.get("runs"):
        text += f", {runs:,} {'run' if runs == 1 else 'runs'} with {summary['corners_in_runs']:,} corners"
    return "; ".join((text, *(f"{one['text']} ({one['count']:,} times)" for one in summary["instead"])))


def limits_text(limits: Sequence[tuple[str, float]]) -> str:
    """Say which limits are reached the longest, after a semicolon; empty where none is."""
    parts = [f"{name} {100.0 * part:.0f} %" for name, part in limits[:LIMITS_TOLD] if part >= _LEAST_TOLD]
    return f"; limited by {', '.join(parts)} of the cutting time" if parts else ""


def times_text(seconds: Mapping[str, float], limits: Sequence[tuple[str, float]]) -> str:
    """Say what the program as written saves of the planned time, and what limits the motion then.

    Times are those of `feedrate.Comparison`, limits those of `feedrate.limiting`.
    """
    stops, jumps, written = (seconds[key] for key in ("direct_exact_stop", "direct_velocity_jump", "as_written"))
    saved = jumps - written
    share = f" ({100.0 * abs(saved) / jumps:.0f} %)" if jumps else ""
    gain = f"saves {saved:.1f} s of" if saved >= 0.0 else f"takes {-saved:.1f} s more than"
    direct = f"the {jumps:.1f} s of the direct path{share}, which takes {stops:.1f} s with stops at corners"
    return f"as written {gain} {direct}{limits_text(limits)}"
