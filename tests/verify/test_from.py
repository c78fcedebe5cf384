"""Arcs that start at a position that is only stated."""

from __future__ import annotations

import io

import numpy as np
import pytest

from cornersmooth.model import Arcs, Move, Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify


def program_of(kinds: list[Move]) -> Program:
    """Straight moves and FROM to (10, 0, 0), a quarter circle to (0, 10, 0), a line."""
    before = [(5.0 * k, -3.0, 0.0) for k in range(len(kinds))]
    tip = [*before, (10.0, 0.0, 0.0), (0.0, 10.0, 0.0), (-20.0, 10.0, 0.0)]
    kind = [*kinds, Move.FROM, Move.ARC, Move.LINEAR]
    arc = len(kinds) + 1
    return Program.from_poses(
        tip,
        np.broadcast_to((0.0, 0.0, 1.0), (len(tip), 3)),
        kind=np.array(kind),
        feed=np.full(len(tip), 300.0),
        line=np.arange(len(tip)) + 10,
        arcs=Arcs(np.array([arc]), np.zeros((1, 3)), np.array([[0.0, 0.0, 1.0]]), np.array([np.pi / 2])),
    )


@pytest.mark.parametrize("kinds", [[], [Move.RAPID, Move.LINEAR]], ids=["first", "later"])
@pytest.mark.parametrize("form", ["g1", "g6.2"])
def test_arc_behind_from_is_read_back(form: str, kinds: list[Move]) -> None:
    program, chosen = program_of(kinds), choose_form("fanuc", form)
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(tolerance=0.01), chosen, "mm")), stream, form=chosen)
    text = stream.getvalue()
    assert verify(program, text, tolerance=0.01).problems == ()
    lines = text.decode().splitlines()
    start = next(i for i, line in enumerate(lines) if "G1 X10.0000 Y0.0000" in line)
    moved = [*lines[:start], lines[start].replace("Y0.0000", "Y1.0000"), *lines[start + 1 :]]
    problems = verify(program, ("\n".join(moved) + "\n").encode(), tolerance=0.01).problems
    assert any(0 <= problem.nc_line - start - 1 <= 1 for problem in problems)
