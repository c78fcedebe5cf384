"""Programs made by hand and the text that is written of them."""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np

from cornersmooth.cl import read
from cornersmooth.model import Arcs, Move, Program
from cornersmooth.nc import Form, Frame, Written, choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

#: a rapid over the next position, at the height of the retract
ABOVE = re.compile(r"G0 X\S+ Y\S+( [^Z].*)?")


def text_of(
    program: Program, form: str = "g1", *, frame: Frame | None = None, **settings: Any
) -> tuple[list[str], Written]:
    """Lines of the NC text without the rapids over its first positions, and what was said of it."""
    chosen = choose_form("fanuc", form)
    smoothed = smooth(program, fit_settings(Settings(**settings), chosen, program.units))
    stream = io.BytesIO()
    written = write(smoothed, stream, form=form, frame=frame)
    lines = stream.getvalue().decode("ascii").splitlines()
    return [line for line in lines if not ABOVE.fullmatch(line)], written


def text_of_cl(cl: str, form: str = "g1", **settings: Any) -> tuple[list[str], Written]:
    """Lines of the NC text of a CL text."""
    return text_of(read(cl.encode(), name="test.cls"), form, **settings)


def lines_of(form: Form, cl: str, *, frame: Frame | None = None, **settings: Any) -> list[str]:
    """Lines of the NC text of a CL text in any form; as many blocks are reported as stand in it."""
    program = read(cl.encode(), name="part.cls")
    smoothed = smooth(program, fit_settings(Settings(tolerance=0.05, **settings), form, program.units))
    stream = io.BytesIO()
    found = write(smoothed, stream, form=form, frame=frame)
    lines = stream.getvalue().decode("ascii").splitlines()
    assert found.blocks == sum(not line.endswith(" ~") for line in lines)
    return lines


#: what is said of fragments that load no tool, start no spindle, begin at feed or tilted
OF_FRAGMENTS = ("CS333", "CS334", "CS335", "CS337")


def codes(written: Written, *, fragment: bool = True) -> dict[str, int]:
    """Findings by code, with their counts; without those of fragments, unless all are asked for."""
    return {
        finding.code: finding.count for finding in written.findings if not (fragment and finding.code in OF_FRAGMENTS)
    }


def one_arc(
    start: Any, end: Any, centre: Any, normal: Any, sweep: float, *, axis: Any = (0, 0, 1), **rest: Any
) -> Program:
    """Program of a rapid to the start and one arc at 300 mm/min."""
    return Program.from_poses(
        [start, end],
        np.broadcast_to(np.array(axis, float), (2, 3)),
        kind=np.array([Move.RAPID, Move.ARC]),
        feed=300.0,
        arcs=Arcs(np.array([1]), np.array([centre], float), np.array([normal], float), np.array([sweep])),
        **rest,
    )
