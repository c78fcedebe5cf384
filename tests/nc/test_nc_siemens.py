"""BSPLINE by the rules of the programming manual (12/2019) and POLY by those of the PGA, against the curves themselves.

BSPLINE SD=3: the first control point is where the block before ended, with weight 1; block j carries P_j, PW and
PL = u[j+2] − u[j+1] of the clamped knots u; blocks that follow one another are one spline. `nc.splines` reads that.
"""

from __future__ import annotations

import io

import numpy as np
import pytest

import cornersmooth
from cornersmooth.cl import read
from cornersmooth.geometry import nurbs
from cornersmooth.model import SmoothProgram
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc.curves import _intervals
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from nc.grammars import reader
from nc.promise import written
from nc.reading import Reading
from nc.splines import SplineRun
from oracle.chains import Chain, cl_text

AXIS_LENGTH, TOLERANCE = 10.0, 0.5
#: mm: rounding of control points to six decimals
DIGITS = 1.5e-6
#: axis points over second points, which are written 100 mm up the axis
SHORTER = AXIS_LENGTH / 100.0


def circle(count: int, step: float) -> bytes:
    """Chain of short segments with a turning tool: curves meet in the middle of each."""
    angle = np.arange(count) * step
    tip = np.stack((20 * np.cos(angle), 20 * np.sin(angle), angle), axis=1)
    axis = np.stack((0.3 * np.cos(angle), 0.3 * np.sin(angle), np.ones(count)), axis=1)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    return cl_text([Chain(np.round(tip, 6), np.round(axis, 9), np.full(count, 900.0))])[0]


def text_of(data: bytes, form: str, **settings: object) -> tuple[str, SmoothProgram]:
    chosen = {"tolerance": TOLERANCE, "axis_length": AXIS_LENGTH, "method": "proportional", **settings}
    wanted = Settings(**chosen)  # type: ignore[arg-type]
    return written(read(data, name="part.cls"), choose_form("siemens", form), wanted)


def reading(text: str, form: str) -> Reading:
    return reader("siemens", form).read(text, AXIS_LENGTH, TOLERANCE)


def splines(text: str) -> list[SplineRun]:
    return [piece for piece in reading(text, "bspline").pieces if isinstance(piece, SplineRun)]


@pytest.mark.parametrize(("count", "step"), [(3, 0.3), (4, 0.3), (12, 0.3)])
def test_a_run_of_splines_is_the_curves_one_after_another(count: int, step: float) -> None:
    text, smoothed = text_of(circle(count, step), "bspline")
    rows = np.flatnonzero(smoothed.corners.smoothed)
    assert len(rows) == count - 2
    (run,) = splines(text)
    assert len(run.points) == 4 * len(rows) + 1
    tip_curves, axis_curves = nurbs.control_points(smoothed.program, smoothed.corners, rows, AXIS_LENGTH)
    share = np.linspace(0, 1, 101)[None]
    for index in range(len(rows)):
        tip, direction = run.at((index + share[0]) / len(rows))
        np.testing.assert_allclose(tip, nurbs.evaluate(tip_curves[index : index + 1], share)[0], atol=DIGITS)
        top = nurbs.evaluate(axis_curves[index : index + 1], share)[0]
        np.testing.assert_allclose(tip + SHORTER * direction, top, atol=DIGITS)


def test_intervals_and_weights_stand_in_the_blocks_of_their_points() -> None:
    text, _ = text_of(circle(5, 0.3), "bspline")
    lines = [line for line in text.splitlines() if " PL=" in line]
    assert [line.split()[-2:] for line in lines] == 3 * [
        ["PL=0", "PW=1"],
        ["PL=0.5", "PW=1"],
        ["PL=0.5", "PW=1"],
        ["PL=0", "PW=1"],
    ]
    assert [line.startswith("BSPLINE SD=3 ") for line in lines] == [True] + 11 * [False]
    before = text.splitlines()[text.splitlines().index(lines[0]) - 1]
    assert before.startswith("G1 ")  # the block that reaches P0


def test_isolated_corners_are_splines_of_their_own() -> None:
    data = (
        b"UNITS/MM\nRAPID\nGOTO/0,0,0,0,0,1\nFEDRAT/500,MMPM\nGOTO/90,0,0,0,0,1\nGOTO/90,90,0,0,0.6,0.8\nGOTO/0,90,0\n"
    )
    text, _ = text_of(data, "bspline")
    found = splines(text)
    assert [len(run.points) for run in found] == [5, 5]
    np.testing.assert_array_equal(found[0].knots, [0, 0, 0, 0, 0.5, 1, 1, 1, 1])


@pytest.mark.parametrize(("name", "said"), [("bspline", ["CS325"]), ("poly", [])])
def test_the_rule_of_six_of_ten_blocks_is_named(name: str, said: list[str]) -> None:
    """At least 6 blocks out of every 10 must be spline blocks (programming manual); POLY has no such rule."""
    form = choose_form("siemens", name)
    settings = fit_settings(Settings(tolerance=TOLERANCE, method="proportional"), form, "mm")
    found = write(smooth(read(circle(3, 0.3), name="part.cls"), settings), io.BytesIO(), form=form).findings
    assert [finding.code for finding in found if finding.code == "CS325"] == said


def test_knots_of_neighbours_are_triple() -> None:
    (run,) = splines(text_of(circle(4, 0.3), "bspline")[0])
    np.testing.assert_array_equal(run.knots, [0, 0, 0, 0, 0.5, 1, 1, 1, 1.5, 2, 2, 2, 2])


@pytest.mark.parametrize("change", [("PL=0.5", "PL=0.4"), ("PL=0 PW", "PL=0.1 PW"), ("PW=1", "PW=0.9")])
def test_a_wrong_interval_or_weight_is_another_curve(change: tuple[str, str]) -> None:
    """What the reader makes of the blocks depends on all of them."""
    text, _ = text_of(circle(4, 0.3), "bspline")
    share = np.linspace(0, 1, 201)
    (run,), (other,) = splines(text), splines(text.replace(*change, 1))
    assert np.abs(run.at(share)[0] - other.at(share)[0]).max() > 10 * DIGITS


def test_polynomials_are_the_curve_in_two_blocks() -> None:
    text, smoothed = text_of(circle(6, 0.3), "poly")
    rows = np.flatnonzero(smoothed.corners.smoothed)
    pieces = [piece for piece in reading(text, "poly").pieces if piece.samples == 48]
    assert len(pieces) == 2 * len(rows)
    tip_curves, axis_curves = nurbs.control_points(smoothed.program, smoothed.corners, rows, AXIS_LENGTH)
    share = np.linspace(0, 1, 51)
    for index, piece in enumerate(pieces):
        u = (index % 2 + share[None]) / 2
        tip, direction = piece.at(share)
        for curves, found in zip((tip_curves, axis_curves), (tip, tip + SHORTER * direction), strict=True):
            wanted = nurbs.evaluate(curves[index // 2 : index // 2 + 1], u)[0]
            np.testing.assert_allclose(found, wanted, atol=2 * DIGITS)


def test_cycle832_is_asked_for_by_name() -> None:
    program = read(circle(4, 0.3), name="part.cls")
    form = choose_form("siemens", "g1", extras=("cycle832",))
    text, _ = written(program, form, Settings(tolerance=0.02, axis_length=25.0, method="proportional"))
    lines = text.splitlines()
    assert lines[lines.index("TRAORI") - 1] == "CYCLE832(0.00200,_ORI_FINISH,0.00458)"
    assert lines[lines.index("TRAFOOF", 2) + 1] == "CYCLE832(0,_OFF,1)"


def test_a_control_point_may_be_the_only_one_of_its_rows() -> None:
    """Rows are written in chunks: the last one may hold the last control point of a long curve alone."""
    points = np.array([[0.0, 1.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [3.0, 1.0, 6.0]])
    number = np.arange(1, 5, dtype=np.int8)
    whole = _intervals(points, number)
    assert whole[:, 0].tolist() == [1.0, 2.0, 3.0, 0.0]
    assert _intervals(points[3:], number[3:]).tolist() == whole[3:].tolist()


def test_a_spline_begins_anew_behind_lines_between_two_statements() -> None:
    """What the writer remembers of the block before is forgotten where a run of rows has no spline."""
    goto = "GOTO/{},{},0.0,0.0,0.0,1.0"
    places = [(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (10.0, 5.0), (10.0, 12.0), (20.0, 12.0)]  # turns back twice
    lines = [goto.format(*place) for place in places]
    lines = ["RAPID", lines[0], "FEDRAT/500.0", *lines[1:3], "PPRINT/ONE", lines[3], "PPRINT/TWO", *lines[4:], "FINI"]
    out = io.BytesIO()
    form, settings = choose_form("siemens", "bspline"), cornersmooth.Settings(method="global")
    result = cornersmooth.postprocess(("\n".join(lines) + "\n").encode(), out, settings, form=form)
    assert result.verification is not None
    assert result.verification.passed
    assert out.getvalue().decode().count("BSPLINE SD=3") == 2
