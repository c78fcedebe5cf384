"""What a CL file holds, and what smoothing it at a given tolerance would meet: the `info` command."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final, Literal

import numpy as np

from cornersmooth.cl.operations import Operation, find_operations
from cornersmooth.errors import Finding
from cornersmooth.model import Bools, Corners, FeedMode, Floats, LimitedBy, Move, Program, Status, Trait
from cornersmooth.settings import Settings
from cornersmooth.smoothing.axis_steps import axis_step_findings
from cornersmooth.smoothing.construction import construction_of
from cornersmooth.surface.tool import tools_of
from cornersmooth.vectors import angle_between, dot, norm

SCHEMA: Final = "cornersmooth-info/2"

#: change of the axis, rad, below which it is seen as standing still: six printed decimals leave 1e-6
AXIS_NOISE: Final = 1e-5

#: a corner that turns by more than this, rad, is a sharp one to the machine: of real paths, 91 to 99 % turn by less
SHARP: Final = np.radians(10.0)

PERCENTS: Final = (0, 5, 50, 95, 100)

#: last printed decimal of CL files, units of the file; an arc that rises by more is a helix
PRINT_STEP: Final = 1e-4

Axes = Literal["fixed", "indexed", "simultaneous"]


@dataclass(frozen=True)
class Spread:
    """Percentiles of a quantity over `count` places; None where there are no places.

    The unit is in the name of the field that holds the spread.
    """

    count: int
    min: float | None
    p5: float | None
    p50: float | None
    p95: float | None
    max: float | None

    @classmethod
    def of(cls, values: Floats) -> Spread:
        """Spread of the values, which hold no NaN."""
        if not len(values):
            return cls(0, None, None, None, None, None)
        return cls(len(values), *np.percentile(values, PERCENTS).tolist())


@dataclass(frozen=True)
class Motion:
    """Moves and the path they make.

    Parameters
    ----------
    moves : dict
        Kind of move to how many there are.
    feed_length_mm, rapid_length_mm : float
        Lengths of linear feed moves and of rapids; arcs are not among them.
    box_min_mm, box_max_mm : list of 3 floats
        Corners of the box around all tips.
    feeds_mm_per_min, feeds_mm_per_rev : list of float
        The different feeds, ascending.
    segment_length_mm : Spread
        Lengths of the linear feed segments of the chains.
    """

    moves: dict[str, int]
    chains: int
    longest_chain_poses: int
    feed_length_mm: float
    rapid_length_mm: float
    box_min_mm: list[float]
    box_max_mm: list[float]
    feeds_mm_per_min: list[float]
    feeds_mm_per_rev: list[float]
    feed_moves_without_feed: int
    segment_length_mm: Spread


@dataclass(frozen=True)
class AxisMotion:
    """What the tool axis does on the linear feed segments.

    Parameters
    ----------
    kind : {"fixed", "indexed", "simultaneous"}
        One direction for the whole file; several, but none changes during a feed segment; turning while cutting.
    tilt_deg : Spread
        Angle between axis and +Z over all poses.
    step_deg : Spread
        Change of the axis over the segments that turn it.
    translations, rotations, repetitions : int
        Segments that do not turn the axis; that only turn it; that do neither.
    """

    kind: Axes
    tilt_deg: Spread
    step_deg: Spread
    translations: int
    rotations: int
    repetitions: int


@dataclass(frozen=True)
class ArcSummary:
    """Circular moves: how many, how many of them rise (helices), their sizes."""

    count: int
    helices: int
    radius_mm: Spread
    sweep_deg: Spread


@dataclass(frozen=True)
class CornerSummary:
    """What smoothing would meet at the given tolerance.

    Parameters
    ----------
    tolerance_mm, axis_length_mm : float
        ε and H this holds for.
    tip_turn_deg : Spread
        Turn of the tip path at the corners that have a tip segment on both sides.
    sharp : int
        Corners whose tip path turns by more than 10 degrees.
    not_smoothed : dict
        Reason to count.
    deviation_mm : Spread
        The larger deviation of tip and axis point at the smoothed corners.
    """

    tolerance_mm: float
    axis_length_mm: float
    count: int
    smoothed: int
    tip_turn_deg: Spread
    sharp: int
    limited_by_tolerance: int
    limited_by_segment: int
    not_smoothed: dict[str, int]
    deviation_mm: Spread


@dataclass(frozen=True)
class OperationSummary:
    """One operation.

    Parameters
    ----------
    name : str
        Empty where the file gives none.
    tool : int or None
        Number of its tool.
    first_line, last_line : int
        In the CL file.
    feed_length_mm : float
        Of its linear feed moves.
    axis : {"fixed", "indexed", "simultaneous"}
    """

    number: int
    name: str
    tool: int | None
    first_line: int
    last_line: int
    poses: int
    feed_length_mm: float
    axis: Axes


@dataclass(frozen=True)
class ToolSummary:
    """One tool: its number, None where none is loaded; its shape, empty where the file does not describe it."""

    number: int | None
    shape: str
    operations: list[int]


@dataclass(frozen=True)
class Info:
    """Description of a program; `as_dict` gives the JSON form."""

    name: str
    format: str
    dialect: str
    units: str
    poses: int
    statements: dict[str, int]
    operations: list[OperationSummary]
    tools: list[ToolSummary]
    motion: Motion
    axis: AxisMotion
    arcs: ArcSummary
    corners: CornerSummary
    findings: tuple[Finding, ...]

    def as_dict(self) -> dict[str, Any]:
        """Plain values; keys carry their unit."""
        return {"schema": SCHEMA, **asdict(self)}


def describe(program: Program, tolerance: float, axis_length: float) -> Info:
    """Describe a program and what would limit the rounding of its corners.

    Parameters
    ----------
    tolerance : float, mm
        ε.
    axis_length : float, mm
        H.

    Raises
    ------
    SettingsError
        A tolerance or length out of bounds.
    """
    settings = Settings(tolerance=tolerance, axis_length=axis_length)
    segments = _Segments.of(program)
    operations = find_operations(program)
    words = Counter(statement.word for statement in program.statements)
    return Info(
        name=program.source.name,
        format=program.source.format,
        dialect=program.source.dialect,
        units=program.units,
        poses=len(program),
        statements=dict(sorted(words.items(), key=lambda item: (-item[1], item[0]))),
        operations=[_operation(program, segments, operation) for operation in operations],
        tools=_tools(program, operations),
        motion=_motion(program, segments),
        axis=_axis(program, segments),
        arcs=_arcs(program),
        corners=_corners(program, settings),
        findings=(*program.findings, *axis_step_findings(program, settings)),
    )


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


def _operation(program: Program, segments: _Segments, operation: Operation) -> OperationSummary:
    own = slice(max(operation.first - 1, 0), max(operation.stop - 1, 0))  # steps into its poses
    segments = _Segments(segments.length[own], segments.turn[own], segments.linear[own])
    return OperationSummary(
        operation.number,
        operation.name,
        operation.tool,
        operation.first_line,
        operation.last_line,
        int(np.count_nonzero(program.kind[operation.first : operation.stop] != Move.FROM)),
        float(segments.length[segments.linear].sum()),
        _axes(segments),
    )


def _tools(program: Program, operations: Sequence[Operation]) -> list[ToolSummary]:
    """Tools by number, in the order in which they come, with the last shape described before their first cut."""
    described = tools_of(program)
    found: dict[int | None, ToolSummary] = {}
    for operation in operations:
        shapes = [tool.describe() for pose, tool, _ in described if pose < operation.stop]
        tool = found.setdefault(operation.tool, ToolSummary(operation.tool, shapes[-1] if shapes else "", []))
        tool.operations.append(operation.number)
    return list(found.values())


def _axes(segments: _Segments) -> Axes:
    turns = segments.turn > AXIS_NOISE
    return "simultaneous" if turns[segments.linear].any() else "indexed" if turns.any() else "fixed"


def _motion(program: Program, segments: _Segments) -> Motion:
    chains = program.chains
    cutting = np.isin(program.kind, (Move.LINEAR, Move.ARC))
    feeds = [
        np.unique(program.feed[cutting & (program.feed_mode == mode) & np.isfinite(program.feed)]) for mode in FeedMode
    ]
    corner = np.zeros(3)
    return Motion(
        moves={kind.name.lower(): count for kind in Move if (count := int(np.count_nonzero(program.kind == kind)))},
        chains=len(chains),
        longest_chain_poses=int((chains[:, 1] - chains[:, 0] + 1).max(initial=0)),
        feed_length_mm=float(segments.length[segments.linear].sum()),
        rapid_length_mm=float(segments.length[program.kind[1:] == Move.RAPID].sum()),
        box_min_mm=(program.tip.min(axis=0) if len(program) else corner).tolist(),
        box_max_mm=(program.tip.max(axis=0) if len(program) else corner).tolist(),
        feeds_mm_per_min=feeds[FeedMode.PER_MINUTE].tolist(),
        feeds_mm_per_rev=feeds[FeedMode.PER_REVOLUTION].tolist(),
        feed_moves_without_feed=int(np.count_nonzero(cutting & np.isnan(program.feed))),
        segment_length_mm=Spread.of(segments.length[segments.linear]),
    )


def _axis(program: Program, segments: _Segments) -> AxisMotion:
    length, turn = segments.length[segments.linear], segments.turn[segments.linear]
    turning, moving = turn > AXIS_NOISE, length > Settings().duplicate_distance
    up = np.broadcast_to((0.0, 0.0, 1.0), program.axis.shape)
    return AxisMotion(
        kind=_axes(segments),
        tilt_deg=Spread.of(np.degrees(angle_between(program.axis, up))),
        step_deg=Spread.of(np.degrees(turn[turning])),
        translations=int(np.count_nonzero(moving & ~turning)),
        rotations=int(np.count_nonzero(~moving & turning)),
        repetitions=int(np.count_nonzero(~moving & ~turning)),
    )


def _arcs(program: Program) -> ArcSummary:
    arcs = program.arcs
    spoke = program.tip[arcs.pose] - arcs.centre
    spoke = spoke - dot(spoke, arcs.normal)[:, None] * arcs.normal
    rise = dot(program.tip[arcs.pose] - program.tip[arcs.pose - 1], arcs.normal)
    return ArcSummary(
        count=len(arcs),
        helices=int(np.count_nonzero(np.abs(rise) > PRINT_STEP * program.mm_per_unit)),
        radius_mm=Spread.of(norm(spoke)),
        sweep_deg=Spread.of(np.degrees(arcs.sweep)),
    )


def _corners(program: Program, settings: Settings) -> CornerSummary:
    # a program with a move that smoothing refuses is described all the same
    settings = settings.with_method()
    corners = construction_of(settings.method).smooth(program, settings).corners
    turn = _tip_turn(program, corners)
    done = corners.rounded
    return CornerSummary(
        tolerance_mm=settings.tolerance,
        axis_length_mm=settings.axis_length,
        count=len(corners),
        smoothed=int(done.sum()),
        tip_turn_deg=Spread.of(np.degrees(turn)),
        sharp=int(np.count_nonzero(turn > SHARP)),
        limited_by_tolerance=int(np.count_nonzero(corners.limited_by == LimitedBy.TOLERANCE)),
        limited_by_segment=int(np.count_nonzero(corners.limited_by == LimitedBy.SEGMENT)),
        not_smoothed={
            status.key: count
            for status in Status
            if not status.traits & Trait.ROUNDED and (count := int(np.count_nonzero(corners.status == status)))
        },
        deviation_mm=Spread.of(np.maximum(corners.tip_error, corners.axis_error)[done]),
    )


def _tip_turn(program: Program, corners: Corners) -> Floats:
    """Turn of the tip path, rad, at the corners with a tip segment on both sides."""
    rows = (corners.after >= 0) & (corners.before >= 0) & (corners.status != Status.DUPLICATE)
    pose, tip = corners.pose[rows], program.tip
    leg_in, leg_out = tip[pose] - tip[corners.before[rows]], tip[corners.after[rows]] - tip[pose]
    proper = (norm(leg_in) > 0.0) & (norm(leg_out) > 0.0)
    return angle_between(leg_in[proper], leg_out[proper])
