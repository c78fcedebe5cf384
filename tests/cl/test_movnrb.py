"""MOVNRB of Creo: the points behind its curves are the motion; and the pieces that a curve is cut into."""

from __future__ import annotations

import io

import numpy as np
import pytest

from cornersmooth import postprocess
from cornersmooth.cl import read
from cornersmooth.cl.nurbs import cubic
from cornersmooth.errors import InputError, Verdict
from cornersmooth.model import Floats, Move

LOW = np.array([[0, 0, 0], [10, 0, 0], [20, 5, 0], [30, 5, 1], [38, 0, 2], [45, -3, 2.0]])
KNOTS = [0.0, 0, 0, 0, 0.3, 0.65, 1, 1, 1, 1]
POINTS = "GOTO / 11.0, 0.8, 0.0, $\n 0.0, 0.1, 0.99498744\nGOTO / 24.0, 3.5, 0.5\nGOTO / 45.0, -3.0, 2.0\n"

TEXT = f"""$$*         Pro/CLfile  Version 10.0
UNITS / MM
LOADTL / 7
SPINDL / RPM, 6000.0,  CLW
MULTAX / ON
RAPID
GOTO / 0.0, 0.0, 30.0, 0.0, 0.0, 1.0
FEDRAT / 800.0,  MMPM
GOTO / 0.0, 0.0, 0.0, 0.0, 0.0, 1.0
MOVNRB / M5AXIS, LENGTH, 10.0
MOVNRB / ON, 4, 10, 0, 6, 47.0
MOVNRB / 1, 0.0, 0.0, 0.0, 0.0
MOVNRB / 1, 0.3, 0.65, 1.0, 1.0, 1.0, 1.0
MOVNRB / 2, 0, 0, 0, 10, 0, 0, 20, 5, 0, $
 30, 5, 1, 38, 0, 2, 45, -3, 2
MOVNRB / 3, 0, 0, 10, 10, 1, 10, 22, 5, 10, 33, 5, 10, 42, 0, 11, 50, -3, 11
MOVNRB / NEXT
{POINTS}MOVNRB / OFF
GOTO / 60.0, -3.0, 2.0
FINI
"""


def point_of(control: Floats, u: float) -> Floats:
    """De Boor's recursion, written by definition."""

    def basis(i: int, order: int) -> float:
        if order == 1:
            last = u == KNOTS[-1] and KNOTS[i] < KNOTS[i + 1] == u
            return float(KNOTS[i] <= u < KNOTS[i + 1] or last)
        low, high = KNOTS[i + order - 1] - KNOTS[i], KNOTS[i + order] - KNOTS[i + 1]
        left = (u - KNOTS[i]) / low * basis(i, order - 1) if low else 0.0
        return left + ((KNOTS[i + order] - u) / high * basis(i + 1, order - 1) if high else 0.0)

    return sum(basis(i, 4) * row for i, row in enumerate(control))  # type: ignore[return-value]


def changed(old: str, new: str) -> bytes:
    assert old in TEXT
    return TEXT.replace(old, new).encode()


def test_pieces_are_the_curve() -> None:
    found = cubic(np.array(KNOTS), LOW, 5e-4)
    assert found is not None
    middle = (found.u[1:] + found.u[:-1]) / 2
    at = found.bezier.transpose(0, 2, 1) @ np.array([1, 3, 3, 1]) / 8
    assert np.abs(at - np.array([point_of(LOW, float(u)) for u in middle])).max() < 1e-12
    assert set(KNOTS) <= set(found.u)
    away = np.linalg.norm(at - (found.bezier[:, 0] + found.bezier[:, 3]) / 2, axis=1)
    assert 2e-4 < away.max() <= 5e-4


def test_its_points_are_read() -> None:
    program = read(TEXT.encode(), name="x.ncl")
    rows = [[0, 0, 30], [0, 0, 0], [11, 0.8, 0], [24, 3.5, 0.5], [45, -3, 2], [60, -3, 2]]
    assert program.tip.tolist() == rows
    assert program.axis[2].tolist() == pytest.approx([0, 0.1, 0.99498744])
    assert program.curves is None
    assert [(one.code, one.severity, one.line, one.count) for one in program.findings] == [("CS192", "note", 11, 1)]
    assert (program.kind[1:] == Move.LINEAR).all()
    found = postprocess(TEXT.encode(), io.BytesIO())
    assert found.verdict is Verdict.PASSED


def test_a_rapid_before_it_is_made_at_feed() -> None:
    program = read(changed("MOVNRB / M5AXIS", "RAPID\nMOVNRB / M5AXIS"), name="x.ncl")
    assert (program.kind[2:] == Move.LINEAR).all()
    assert "CS140" in {one.code for one in program.findings}


def test_a_feed_among_its_points_holds_from_there_on() -> None:
    program = read(changed("GOTO / 24.0", "FEDRAT / 500.0, MMPM\nGOTO / 24.0"), name="x.ncl")
    assert program.feed[1:].tolist() == [800, 800, 500, 500, 500]


@pytest.mark.parametrize(
    ("data", "line", "why"),
    [
        (changed(POINTS, ""), 18, "MOVNRB has no points"),
        (changed("MOVNRB / OFF\n", ""), 11, "MOVNRB/OFF is missing"),
        (changed("MOVNRB / NEXT", "MOVNRB / 4, 1.0"), 17, "MOVNRB/4 is not understood here"),
        (changed("MOVNRB / 3, 0", "MOVNRB / ON, 4, 10, 0"), 16, "MOVNRB/ON is not understood here"),
    ],
)
def test_a_record_whose_points_may_be_lost_is_an_error(data: bytes, line: int, why: str) -> None:
    with pytest.raises(InputError, match=rf"x.ncl:{line}: error\[CS128\]: .*{why}"):
        read(data, name="x.ncl")
