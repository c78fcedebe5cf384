"""What a CL file holds, and what smoothing it at a given tolerance would meet: the `info` command."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

import numpy as np

from cornersmooth.arrays import angle_between, dot, norm
from cornersmooth.cl.operations import Operation, find_operations
from cornersmooth.geometry.arcs import arc_radii
from cornersmooth.geometry.tool import tools_of
from cornersmooth.kinematics import Machine
from cornersmooth.model import Bools, Corners, FeedMode, Floats, Move, Program, Status
from cornersmooth.report import rotary_marks
from cornersmooth.report.tables import counts_of
from cornersmooth.settings import Settings
from cornersmooth.smoothing import axis_step_findings
from cornersmooth.smoothing.construction import construction_of

SCHEMA: Final = "cornersmooth-info/2"

#: change of the axis, rad, below which it is seen as standing still: six printed decimals leave 1e-6
AXIS_NOISE: Final = 1e-5

#: a corner that turns by more than this, rad, is a sharp one to the machine: of real paths, 91 to 99 % turn by less
SHARP: Final = np.radians(10.0)

#: levels of a spread: least, 5 %, median, 95 %, most
PERCENTS: Final = (0, 5, 50, 95, 100)

#: last printed decimal of CL files, units of the file; an arc that rises by more is a helix
PRINT_STEP: Final = 1e-4

Record = dict[str, Any]


def spread(values: Floats) -> Record:
    """Percentiles of values without NaN; None where there are none. The key that holds them names the unit."""
    levels = np.percentile(values, PERCENTS).tolist() if len(values) else [None] * len(PERCENTS)
    return {"count": len(values), **dict(zip(("min", "p5", "p50", "p95", "max"), levels, strict=True))}


def describe(program: Program, tolerance: float, axis_length: float, machine: Machine | None = None) -> Record:
    """Describe a program and what would limit the rounding of its corners at ε and H, mm; keys carry their unit.

    With a machine, where its rotary axes accelerate most.
    """
    settings = Settings(tolerance=tolerance, axis_length=axis_length)
    segments = _Segments.of(program)
    operations = find_operations(program)
    words = Counter(statement.word for statement in program.statements)
    return {
        "schema": SCHEMA,
        "name": program.source.name,
        "format": program.source.format,
        "dialect": program.source.dialect,
        "units": program.units,
        "poses": len(program),
        "statements": dict(sorted(words.items(), key=lambda item: (-item[1], item[0]))),
        "operations": [_operation(program, segments, operation) for operation in operations],
        "tools": _tools(program, operations),
        "motion": _motion(program, segments),
        "axis": _axis(program, segments) | {"rotary_marks": rotary_marks(program, machine)},
        "arcs": _arcs(program),
        "corners": _corners(program, settings),
        "findings": [asdict(one) for one in (*program.findings, *axis_step_findings(program, settings))],
    }


@dataclass(frozen=True)
class _Segments:
    """Steps into every pose but the first, and which of them are linear feed segments of a chain."""

    length: Floats  #: (n-1,) mm
    turn: Floats  #: (n-1,) rad
    linear: Bools  #: (n-1,)

    @classmethod
    def of(cls, program: Program) -> _Segments:
        step = np.diff(program.tip, axis=0)
        linear = program.kind[1:] == Move.LINEAR
        linear &= program.kind[:-1] != Move.FROM
        return cls(norm(step), angle_between(program.axis[:-1], program.axis[1:]), linear)


def _operation(program: Program, segments: _Segments, operation: Operation) -> Record:
    own = slice(max(operation.first - 1, 0), max(operation.stop - 1, 0))  # steps into its poses
    segments = _Segments(segments.length[own], segments.turn[own], segments.linear[own])
    return {
        "number": operation.number,
        "name": operation.name,  # empty where the file gives none
        "tool": operation.tool,
        "first_line": operation.first_line,
        "last_line": operation.last_line,
        "poses": int(np.count_nonzero(program.kind[operation.first : operation.stop] != Move.FROM)),
        "feed_length_mm": float(segments.length[segments.linear].sum()),
        "axis": _axes(segments),
    }


def _tools(program: Program, operations: Sequence[Operation]) -> list[Record]:
    """Tools by number, in the order in which they come, with the last shape described before their first cut."""
    described = tools_of(program)
    found: dict[int | None, Record] = {}
    for operation in operations:
        shapes = [tool.describe() for pose, tool, _ in described if pose < operation.stop]
        own: Record = {"number": operation.tool, "shape": shapes[-1] if shapes else "", "operations": []}
        found.setdefault(operation.tool, own)["operations"].append(operation.number)
    return list(found.values())


def _axes(segments: _Segments) -> str:
    """One direction for all; several, but none changes during a feed segment; or turning while cutting."""
    turns = segments.turn > AXIS_NOISE
    return "simultaneous" if turns[segments.linear].any() else "indexed" if turns.any() else "fixed"


def _motion(program: Program, segments: _Segments) -> Record:
    chains = program.chains
    cutting = np.isin(program.kind, (Move.LINEAR, Move.ARC))
    feeds = [
        np.unique(program.feed[cutting & (program.feed_mode == mode) & np.isfinite(program.feed)]) for mode in FeedMode
    ]
    return {
        "moves": {kind.name.lower(): count for kind in Move if (count := int(np.count_nonzero(program.kind == kind)))},
        "chains": len(chains),
        "longest_chain_poses": int((chains[:, 1] - chains[:, 0] + 1).max(initial=0)),
        "feed_length_mm": float(segments.length[segments.linear].sum()),
        "rapid_length_mm": float(segments.length[program.kind[1:] == Move.RAPID].sum()),
        "box_min_mm": program.tip.min(axis=0).tolist(),
        "box_max_mm": program.tip.max(axis=0).tolist(),
        "feeds_mm_per_min": feeds[FeedMode.PER_MINUTE].tolist(),
        "feeds_mm_per_rev": feeds[FeedMode.PER_REVOLUTION].tolist(),
        "feed_moves_without_feed": int(np.count_nonzero(cutting & np.isnan(program.feed))),
        "segment_length_mm": spread(segments.length[segments.linear]),
    }


def _axis(program: Program, segments: _Segments) -> Record:
    length, turn = segments.length[segments.linear], segments.turn[segments.linear]
    turning, moving = turn > AXIS_NOISE, length > Settings().duplicate_distance
    up = np.broadcast_to((0.0, 0.0, 1.0), program.axis.shape)
    return {
        "kind": _axes(segments),
        "tilt_deg": spread(np.degrees(angle_between(program.axis, up))),
        "step_deg": spread(np.degrees(turn[turning])),
        "translations": int(np.count_nonzero(moving & ~turning)),
        "rotations": int(np.count_nonzero(~moving & turning)),
        "repetitions": int(np.count_nonzero(~moving & ~turning)),
    }


def _arcs(program: Program) -> Record:
    arcs = program.arcs
    rise = dot(program.tip[arcs.pose] - program.tip[arcs.pose - 1], arcs.normal)
    return {
        "count": len(arcs),
        "helices": int(np.count_nonzero(np.abs(rise) > PRINT_STEP * program.mm_per_unit)),
        "radius_mm": spread(arc_radii(program)),
        "sweep_deg": spread(np.degrees(arcs.sweep)),
    }


def _corners(program: Program, settings: Settings) -> Record:
    # a program with a move that smoothing refuses is described all the same
    settings = settings.with_method()
    corners = construction_of(settings.method).smooth(program, settings).corners
    turn = _tip_turn(program, corners)
    done = corners.rounded
    return {
        "tolerance_mm": settings.tolerance,
        "axis_length_mm": settings.axis_length,
        "count": len(corners),
        "smoothed": int(done.sum()),
        "tip_turn_deg": spread(np.degrees(turn)),
        "sharp": int(np.count_nonzero(turn > SHARP)),
        **counts_of(corners),
        "deviation_mm": spread(np.maximum(corners.tip_error, corners.axis_error)[done]),
    }


def _tip_turn(program: Program, corners: Corners) -> Floats:
    """Turn of the tip path, rad, at the corners with a tip segment on both sides."""
    rows = (corners.after >= 0) & (corners.before >= 0) & (corners.status != Status.DUPLICATE)
    pose, tip = corners.pose[rows], program.tip
    leg_in, leg_out = tip[pose] - tip[corners.before[rows]], tip[corners.after[rows]] - tip[pose]
    proper = (norm(leg_in) > 0.0) & (norm(leg_out) > 0.0)
    return angle_between(leg_in[proper], leg_out[proper])
