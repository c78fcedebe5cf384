"""NC text from a smoothed program: controls and their forms, and `write`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from cornersmooth.errors import Finding, SettingsError
from cornersmooth.model import FeedMode, Move, SmoothProgram, Units, rapid_moves
from cornersmooth.nc.blocks import Blocks
from cornersmooth.nc.circles import Circles, plan_circles
from cornersmooth.nc.control import Control
from cornersmooth.nc.control_tables import (
    control_aliases,
    control_names,
    control_table,
    find_control,
    load_control,
    own_words,
    parse_control,
)
from cornersmooth.nc.coordinates import Coordinates
from cornersmooth.nc.form import Form, check_program, choose_form
from cornersmooth.nc.hole_cycles import plan_drilling
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.modals import Modals
from cornersmooth.nc.motion import Motion
from cornersmooth.nc.planes import Planes, check_travel_of_words, plan_planes
from cornersmooth.nc.program_frame import BLEND_STEP, POINT_APPROACH, Frame, Stream
from cornersmooth.nc.rotary_words import UPRIGHT, rotary_way, within_reach
from cornersmooth.nc.script import Script
from cornersmooth.nc.statement_args import spindle_orders, tool_starts
from cornersmooth.nc.statement_writer import StatementWriter
from cornersmooth.settings import CURVES_METHOD, DEFAULT_METHOD, FLIP_ANGLE, Settings
from cornersmooth.smoothing.runs.rows import Rows
from cornersmooth.smoothing.sampling import all_dense_rows, curve_rows, dense_rows

__all__ = [
    "Control",
    "Form",
    "Frame",
    "Written",
    "choose_form",
    "control_aliases",
    "control_names",
    "control_table",
    "find_control",
    "fit_settings",
    "load_control",
    "own_words",
    "parse_control",
    "within_reach",
    "write",
]


#: curve styles of controls that may turn the tool in their own way on a line between two axis points
_TURNING = ("bspline", "poly")


@dataclass(frozen=True)
class Written:
    """What `write` put out."""

    blocks: int  #: NC blocks, head and tail included
    findings: tuple[Finding, ...]


def fit_settings(settings: Settings, form: Form, units: Units) -> Settings:
    """Settings that know the digits and the abilities of the output form, so that ε holds for the written numbers.

    Returns
    -------
    Settings
        With `tip_resolution` and `axis_point_resolution` in mm, and the chord that the form asks for.

    Raises
    ------
    SettingsError
        The form cannot hold what the settings ask for.
    """
    long = form.table.lines
    lines = settings.lines or (long.lines if form.long_lines else "dense")
    if lines == "long":
        if not form.long_lines:
            raise SettingsError(
                "CS223",
                f"{form.control} form {form.name} cannot be written in long lines",
                "leave out --lines; lines with the tip under tool tip control can be",
            )
        settings = settings.but(curve_share=long.curve_share, line_share=long.line_share, blend_share=long.blend_share)
    block_time = long.block_time if settings.block_time is None else settings.block_time
    if form.orientation == "machine" and form.mode.fastest:  # no block is passed sooner than inverse time can say
        block_time = max(block_time, 60.0 / form.mode.fastest)
    return settings.with_method(curves=form.curves).but(
        lines=lines,
        block_time=block_time,
        tip_resolution=form.tip_resolution(units, settings),
        axis_point_resolution=form.axis_point_resolution(units, settings),
        round_feed_changes=settings.round_feed_changes and not form.curves,
    )


def check_fitted(settings: Settings, form: Form, units: Units) -> None:
    """Refuse settings that know less of the written digits than `fit_settings` would (CS205): they would exceed ε."""
    fitted = fit_settings(settings, form, units)
    if (
        settings.tip_resolution < fitted.tip_resolution
        or settings.axis_point_resolution < fitted.axis_point_resolution
        or (settings.round_feed_changes and not fitted.round_feed_changes)
    ):
        raise SettingsError(
            "CS205",
            f"the path was smoothed without regard to what {form.control} form {form.name} can hold",
            "smooth it for the form that it is written in: smooth(program, settings, form=...)",
        )


def write(
    smoothed: SmoothProgram,
    stream: Stream,
    *,
    control: str = "fanuc",
    form: str | Form | None = None,
    frame: Frame | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Written:
    """Write the NC text of a smoothed program.

    Parameters
    ----------
    smoothed : SmoothProgram
        Made with settings that fit the form (`fit_settings`).
    stream : binary stream
        Written in blocks; memory does not grow with the program.
    control : str
        Name or TOML file; of no account where `form` is a `Form`.
    form : str or Form, optional
        The control's default, or what `choose_form` gave.
    frame : Frame, optional
        Program name, block numbers, texts before and after.
    progress : callable, optional
        Called now and then with (poses done, poses in all).

    Returns
    -------
    Written
        The number of blocks, and what was noticed on the way.

    Raises
    ------
    SettingsError
        Unknown control or form; CS205 where ε would be exceeded, as the settings do not fit the form.
    InputError
        The form or its machine cannot follow the program.
    OutputError
        A number that the form cannot hold.
    """
    chosen = form if isinstance(form, Form) else choose_form(control, form)
    program, findings = smoothed.program, Findings()
    check_fitted(smoothed.settings, chosen, program.units)
    check_program(chosen, program, smoothed.settings)
    frame = frame or Frame()
    values = frame.values(chosen, program, smoothed.settings)
    frame.refuse_tool(chosen, program)
    modals = Modals(chosen, values, frame.texts(chosen, values), findings, program.units)
    modals.now["blend"] = usual_blend = round(float(values["blend"]) / BLEND_STEP) if chosen.table.lines.rounding else 0
    orders, native = spindle_orders(program), frame.cycles == "native"
    drillings = plan_drilling(program, orders, findings)
    statements = StatementWriter(chosen, program, findings, modals, orders, comments=frame.comments)
    planes = plan_planes(program, smoothed.settings, chosen, findings, drillings, drills=native)
    check_travel_of_words(planes, program, chosen, findings)
    rows, circles = _rows(smoothed, chosen, planes, findings)
    _add_warnings(chosen, smoothed, circles, planes, findings)
    stretch = chosen.stretch(smoothed.settings.axis_length)
    tilting = Coordinates(chosen, program.units, stretch, modal=frame.modal)
    blocks = Blocks(program, circles, modals, findings, usual_blend=usual_blend)
    approach = max(frame.approach, POINT_APPROACH) if chosen.orientation == "point" else frame.approach
    motion = Motion(program, tilting, modals, blocks, findings, approach, frame.retract)
    script = Script(statements, motion, planes, drillings, frame.skip_cycles, native)
    text = frame.start(stream, chosen)
    motion.say(modals.expand(chosen.table.program.start))
    for some in rows:
        script.run(some)
        script.hand_on(text)
        if progress is not None and len(some.move):
            progress(int(some.move[-1]) + 1, len(program))
    script.finish()
    script.hand_on(text)
    return Written(blocks.written, findings.all())


def _add_warnings(form: Form, smoothed: SmoothProgram, circles: Circles, planes: Planes, findings: Findings) -> None:
    """Note what a user of the form should know of the program."""
    program, style = smoothed.program, form.table.lines
    lines = program.line[program.arcs.pose]
    findings.note_each("CS313", lines[(circles.blocks > 0) & ~circles.curved])
    findings.note_each("CS313b", lines[circles.curved])
    findings.note_each("CS314", lines[circles.blocks == 0])
    findings.note_each("CS317", np.array([one.line for one in program.statements if one.word == "PAINT"], np.int64))
    rapid = rapid_moves(program.kind)
    if not form.rotary:  # rotary words say which way to turn; feed moves that turn so far are refused before
        poses, _ = program.axis_steps(rapid, FLIP_ANGLE)
        findings.note_each("CS326", program.line[poses], angle=FLIP_ANGLE)
    if not form.rotary and "{rotary_zero}" in form.table.program.begin:  # and no words bring them back
        tilted = np.logical_or.accumulate((program.kind != Move.FROM) & (program.axis[:, 2] < UPRIGHT))
        moving = np.flatnonzero(program.kind != Move.FROM)
        begins = moving[[k for k in np.searchsorted(moving, tool_starts(program)[1:]) if k < len(moving)]]
        findings.note_each("CS358", program.line[begins[tilted[begins - 1] & (planes.of[begins] < 0)]])
    largest = form.mode.largest_feed
    beyond = ~rapid & (program.feed_mode == FeedMode.PER_MINUTE) & (program.feed > (largest or np.inf))
    findings.note_each("CS388", program.line[beyond], largest=largest)
    if form.orientation == "machine":
        findings.note_each("CS323", program.line[~rapid & (program.feed_mode == FeedMode.PER_REVOLUTION)])
    if "{kinematics_on}" in form.mode.within_on and form.machine is not None and form.machine.tip_control is None:
        findings.note("CS393", 0)
    if style.lag and smoothed.settings.lines == "long" and smoothed.settings.method == CURVES_METHOD:
        findings.note("CS394", 0, control=form.control, method=CURVES_METHOD, default=DEFAULT_METHOD)
    if (
        form.curve == "g6.2"
        and form.orientation == "point"
        and not ((planes.of >= 0) | (program.kind == Move.FROM)).all()
    ):
        findings.note("CS395", 0)
    if form.curve == "bspline":
        findings.note("CS325", 0)
    rounded = bool(smoothed.corners.smoothed.any()) or smoothed.runs is not None
    if rounded and not form.curves and smoothed.settings.lines == "dense" and not form.extras:
        able = [name for name, extra in form.table.extras.items() if not extra.forms or form.name in extra.forms]
        for name in able[:1]:
            findings.note("CS396", 0, name=name)
    for extra in form.extras:
        if extra.warning:
            findings.note("CS339", 0, name=extra.name, warning=extra.warning)


def _rows(smoothed: SmoothProgram, form: Form, planes: Planes, findings: Findings) -> tuple[Iterator[Rows], Circles]:
    """Rows as they come, and how their arcs are written."""
    program, settings = smoothed.program, smoothed.settings
    circles, long = plan_circles(program, settings, form, planes), settings.lines == "long"
    if form.curves:
        rows = curve_rows(smoothed, circles, divide=form.curve in _TURNING)
    elif form.rotary:
        from cornersmooth.nc.rotary_rows import arc_angles, coarse_rows, rotary_rows  # long to load, and for few forms

        while True:  # arcs on which rotary axes would turn, or stand where the control wants no circle, become lines
            whole, seen = (coarse_rows if long else all_dense_rows)(smoothed, circles), Findings()
            way = rotary_way(whole, smoothed, form, seen)
            known = plan_circles(program, settings, form, planes, arc_angles(way, program, form))
            before, circles = circles.blocks, replace(known, blocks=np.minimum(known.blocks, circles.blocks))
            if (circles.blocks == before).all():
                break
        findings.add_all(seen.all())
        inside = planes.of >= 0 if planes.planes else None
        rows = rotary_rows(way, smoothed, form, findings, long=long, in_planes=inside)
    elif long:
        from cornersmooth.nc.rotary_rows import coarse_rows, long_rows

        rows = long_rows(coarse_rows(smoothed, circles), smoothed, form)
    else:
        rows = dense_rows(smoothed, circles)
    return rows, circles
