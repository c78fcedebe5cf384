"""NC text from a smoothed program: the registry of controls and forms, and `write`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cornersmooth.errors import Finding, SettingsError
from cornersmooth.model import Program, SmoothProgram, Units
from cornersmooth.nc import fanuc
from cornersmooth.nc.blocks import BlockWriter
from cornersmooth.nc.circles import Circles, plan_circles
from cornersmooth.nc.control import Form
from cornersmooth.nc.motion import MotionWriter
from cornersmooth.nc.notes import Notes
from cornersmooth.nc.statements import StatementWriter
from cornersmooth.settings import Settings
from cornersmooth.smoothing.sampling import Rows, curve_rows, dense_rows

__all__ = ["FORMS", "Form", "Written", "choose_form", "fit_settings", "write"]

#: every control with its forms; the first is the control's default
FORMS: dict[str, dict[str, Form]] = {"fanuc": {form.name: form for form in (fanuc.G1, fanuc.G62)}}


class Stream(Protocol):
    """What text is written to: any binary stream."""

    def write(self, data: bytes, /) -> object:
        """Write the bytes."""


@dataclass(frozen=True)
class Written:
    """What `write` put out.

    Parameters
    ----------
    blocks : int
        NC blocks, head and tail included.
    findings : tuple of Finding
    """

    blocks: int
    findings: tuple[Finding, ...]


def choose_form(control: str = "fanuc", form: str | None = None) -> Form:
    """Return the form of a control by name; the control's default where `form` is None.

    Raises
    ------
    SettingsError
        Unknown control, or a form that the control does not have.
    """
    forms = FORMS.get(control)
    if forms is None:
        raise SettingsError("CS210", f"unknown control {control!r}", f"choose one of {', '.join(sorted(FORMS))}")
    if form is None:
        return next(iter(forms.values()))
    if form not in forms:
        raise SettingsError("CS211", f"{control} has no form {form!r}", f"choose one of {', '.join(forms)}")
    return forms[form]


def fit_settings(settings: Settings, form: Form, units: Units) -> Settings:
    """Settings that know the digits and the abilities of the output form, so that ε holds for the written numbers."""
    return settings.but(
        tip_resolution=form.tip_resolution(units),
        axis_point_resolution=form.axis_point_resolution(units, settings.axis_length),
        round_feed_changes=settings.round_feed_changes and not form.curves,
    )


def write(
    smoothed: SmoothProgram,
    stream: Stream,
    *,
    control: str = "fanuc",
    form: str | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Written:
    """Write the NC text of a smoothed program.

    Parameters
    ----------
    smoothed : SmoothProgram
        Made with settings that fit the form (`fit_settings`), or ε is exceeded by the rounding.
    stream : binary stream
        Written in blocks; memory does not grow with the program.
    progress : callable, optional
        Called now and then with (poses done, poses in all).

    Raises
    ------
    SettingsError
        Unknown control or form.
    OutputError
        A number that the form cannot hold.
    """
    chosen = choose_form(control, form)
    program, notes = smoothed.program, Notes()
    statements = StatementWriter(fanuc.words(chosen), program, notes)
    circles = plan_circles(program, smoothed.settings, chosen)
    _tell_arcs(circles, program, notes)
    writer = BlockWriter(chosen, program, statements, notes, circles)
    motion = MotionWriter(program, smoothed.settings.axis_length, writer, statements, notes)
    head = fanuc.head(program)
    stream.write(_text(head))
    for rows in _one_ahead(curve_rows(smoothed) if chosen.curves else dense_rows(smoothed, circles.pieces)):
        for text in motion.write(rows):
            stream.write(text)
        if progress is not None and len(rows.move):
            progress(int(rows.move[-1]) + 1, len(program))
    for text in motion.finish():
        stream.write(text)
    tail = fanuc.tail(statements)
    stream.write(_text(tail))
    return Written(len(head) + motion.blocks + writer.blocks + len(tail), notes.findings())


def _one_ahead(blocks: Iterator[Rows]) -> Iterator[Rows]:
    """Compute the next block of rows while the last one is written: numpy leaves the interpreter free meanwhile."""
    with ThreadPoolExecutor(1) as pool:
        coming = pool.submit(next, blocks, None)
        while (rows := coming.result()) is not None:
            coming = pool.submit(next, blocks, None)
            yield rows


def _text(blocks: list[str]) -> bytes:
    return "".join(block + "\n" for block in blocks).encode("ascii")


def _tell_arcs(circles: Circles, program: Program, notes: Notes) -> None:
    for chosen, code, text in (
        (circles.pieces > 0, "CS313", "arc written as G2 or G3"),
        (circles.pieces == 0, "CS314", "arc written as lines"),
    ):
        rows = np.flatnonzero(chosen)
        if len(rows):
            notes.add(code, "note", int(program.line[program.arcs.pose[rows[0]]]), text, len(rows))
