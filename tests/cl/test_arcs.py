"""Circular moves: sense of rotation of every dialect, degenerate arcs, curves written as surfaces."""

from __future__ import annotations

import io
import math
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cornersmooth import postprocess, verify
from cornersmooth.cl import read
from cornersmooth.errors import InputError, Verdict
from cornersmooth.model import Arcs, Keep, Move, Program
from cornersmooth.nc import choose_form
from cornersmooth.report.verdict import sharp_rows
from cornersmooth.settings import Settings

HALF = math.sqrt(0.5)


def program(text: str, **options: object) -> Program:
    return read(text.encode(), name="x.cls", **options)  # type: ignore[arg-type]


def codes(result: Program) -> dict[str, int]:
    return {finding.code: finding.count for finding in result.findings if finding.code != "CS132"}


def on_arc(result: Program, row: int, share: float) -> NDArray[np.float64]:
    """Point of an arc, by Rodrigues' rotation of its start; the height grows with the angle."""
    arcs: Arcs = result.arcs
    start, end = result.tip[arcs.pose[row] - 1], result.tip[arcs.pose[row]]
    centre, normal = arcs.centre[row], arcs.normal[row]
    spoke = start - centre
    height = spoke @ normal
    angle = share * arcs.sweep[row]
    turned = math.cos(angle) * (spoke - height * normal) + math.sin(angle) * np.cross(normal, spoke)
    rise = (end - start) @ normal
    return centre + turned + (height + share * rise) * normal


NX = ",0.0600,0.5000,10.0000,0.0000"


@pytest.mark.parametrize(
    ("circle", "middle"),
    [
        (f"CIRCLE/0.0000,0.0000,0.0000,0.0000000,0.0000000,1.0000000,1.0000{NX}", [HALF, -HALF, 0]),  # NX: left
        (f"CIRCLE/0.0000,0.0000,0.0000,0.0000000,0.0000000,-1.0000000,1.0000{NX}", [-HALF, HALF, 0]),
        ("CIRCLE / 0.0, 0.0, 0.0, $\n0.0, 0.0, 1.0, 1.0", [-HALF, HALF, 0]),  # Creo: right
        ("CIRCLE/0,0,0,0,0,1.", [-HALF, HALF, 0]),  # SolidWorks CAM: right
        ("CIRCLE/0,0,0,0,0,-1.", [HALF, -HALF, 0]),
        ("MOVARC/0, 0, 0, 0, 0, 1, 1, ANGLE, 270", [-HALF, HALF, 0]),  # HSM: right
        ("MOVARC/0, 0, 0, 0, 0, -1, 1, ANGLE, 90", [HALF, -HALF, 0]),
        ("MOVARC/ CENTER, 0, 0, 0, AXIS, 0, 0, 1, RADIUS, 1", [-HALF, HALF, 0]),  # MfgSuite: right
    ],
)
def test_sense_of_rotation(circle: str, middle: list[float]) -> None:
    """From (1,0) to (0,-1): a quarter one way, three quarters the other."""
    result = program(f"GOTO/1,0,0\n{circle}\nGOTO/0,-1,0\nGOTO/5,5,5\n")
    short = middle[0] > 0
    assert result.kind.tolist() == [Move.LINEAR, Move.ARC, Move.LINEAR]
    assert result.arcs.pose.tolist() == [1]
    assert result.arcs.sweep[0] == pytest.approx(math.pi / 2 if short else 3 * math.pi / 2)
    assert on_arc(result, 0, 0.5) == pytest.approx(np.array(middle), abs=1e-12)
    assert on_arc(result, 0, 1.0) == pytest.approx(result.tip[1], abs=1e-12)


@pytest.mark.parametrize(("rule", "sweep"), [("left", 0.5), ("right", 1.5)])
def test_rule_overrides_the_dialect(rule: str, sweep: float) -> None:
    for circle in (f"CIRCLE/0.,0.,0.,0.,0.,1.,1.{NX}", "CIRCLE/0.,0.,0.,0.,0.,1.,1.", "CIRCLE/0.,0.,0.,0.,0.,1."):
        result = program(f"GOTO/1,0,0\n{circle}\nGOTO/0,-1,0\n", arc_rule=rule)
        assert result.arcs.sweep[0] == pytest.approx(sweep * math.pi)


def test_units_scale_arcs() -> None:
    result = program("UNITS/INCHES\nGOTO/1,0,0\nCIRCLE/0,0,0,0,0,1.,1.\nGOTO/0,1,2\n")
    assert result.arcs.centre.tolist() == [[0, 0, 0]]
    assert on_arc(result, 0, 1.0) == pytest.approx(np.array([0, 25.4, 50.8]))


def test_helix_and_turns() -> None:
    circle = f"CIRCLE/0.0000,0.0000,0.0000,0.0000000,0.0000000,-1.0000000,10.0000{NX}"
    result = program(
        f"GOTO/10.0000,0.0000,5.0000\n{circle}\nGOTO/0.0000,10.0000,3.0000\n{circle},TIMES,3\nGOTO/-10.,0.,0.\n"
        f"{circle}\nGOTO/-10.,0.,-1.\n{circle},TIMES,2\nGOTO/-10.,0.,-1.\n"
    )
    turns = result.arcs.sweep / (2 * math.pi)
    assert turns == pytest.approx([0.25, 2.25, 1.0, 2.0])
    for row in range(4):
        assert on_arc(result, row, 1.0) == pytest.approx(result.tip[row + 1], abs=1e-9)


def test_full_circle_and_degenerate_arc() -> None:
    """Equal ends are a full circle; ends one printed digit apart are a line, whatever the sense (NX coremill)."""
    for sign in ("1.0000000", "-1.0000000"):
        circle = f"CIRCLE/0.0000,0.0000,0.0000,0.0000000,0.0000000,{sign},10.0000{NX}"
        result = program(f"GOTO/10.0000,0.0000,0.0000\n{circle}\nGOTO/10.0000,0.0000,0.0000\n")
        assert result.arcs.sweep == pytest.approx([2 * math.pi])
        result = program(f"GOTO/10.0000,0.0000,0.0000\n{circle}\nGOTO/10.0000,0.0001,0.0000\n")
        assert result.kind.tolist() == [Move.LINEAR, Move.LINEAR]
        assert len(result.arcs) == 0
        assert codes(result) == {"CS141": 1}


def test_full_circle_by_its_stated_angle() -> None:
    head = "MODE/MILL\nGOTO/1, 0, 0\nMOVARC/0, 0, 0, 0, 0, 1, 1, ANGLE, "
    assert program(f"{head}360\nGOTO/1, 0.000001, 0\n").arcs.sweep == pytest.approx([2 * math.pi], abs=1e-5)
    assert program(f"{head}720\nGOTO/1, 0, -1\n").arcs.sweep == pytest.approx([4 * math.pi])
    assert program(f"{head}450\nGOTO/0, 1, -1\n").arcs.sweep == pytest.approx([2.5 * math.pi])
    with pytest.raises(InputError, match="its angle is 80 degrees, its end stands at 90"):
        program(f"{head}80\nGOTO/0, 1, 0\n")


def test_creo_points_on_the_arc_end_with_the_last() -> None:
    head = "$$*         Pro/CLfile\nGOTO / 1, 0, 0\nCIRCLE / 0, 0, 0, 0, 0, 1, 1\n"
    result = program(f"{head}GOTO / 0.70710678, 0.70710678, 0\n0, 1, 0\n-1, 0, 0\nGOTO / -1, -1, 0\n")
    assert result.kind.tolist() == [2, 3, 2]
    assert result.tip[1].tolist() == [-1, 0, 0]
    assert result.arcs.sweep == pytest.approx([math.pi])
    assert codes(result) == {}
    wrong = program(f"{head}GOTO / 0.70710678, -0.70710678, 0\n0, 1, 0\n")
    assert codes(wrong) == {"CS142": 1}
    with pytest.raises(InputError, match=r":3: error\[\w+\]: point of the arc is 0.5 from its centre, not 1"):
        program(f"{head}GOTO / 0.5, 0, 0\n0, 1, 0\n")


def test_state_between_arc_and_end() -> None:
    result = program(
        "GOTO/1,0,0\nCIRCLE/0,0,0,0,0,1.,1.\n$$ x\nPAINT/COLOR,31\nFEDRAT/MMPM,7\nGOTO/0,1,0\nRAPID\nGOTO/0,5,0\n"
    )
    assert result.kind.tolist() == [2, 3, 1]
    assert result.feed[1] == 7


def test_neighbours_contradict() -> None:
    """Along x, a quarter to the left, along y: with the wrong normal it is three quarters with two cusps."""
    text = "GOTO/-5.,0.,0.\nGOTO/0.,0.,0.\nCIRCLE/0.,1.,0.,0,0,{}1.\nGOTO/1.,1.,0.\nGOTO/1.,5.,0.\n"
    good = program(text.format(""))
    assert (codes(good), good.keep.tolist()) == ({}, [0] * 4)
    bad = program(text.format("-"))
    assert bad.arcs.sweep == pytest.approx([1.5 * math.pi])
    assert codes(bad) == {"CS142": 1}
    assert bad.keep.tolist() == [0, Keep.CONTRADICTION, Keep.CONTRADICTION, 0]
    turned = program(text.format("-"), arc_rule="tangent")
    assert turned.arcs.sweep == pytest.approx(good.arcs.sweep)
    assert turned.arcs.normal == pytest.approx(good.arcs.normal)
    assert codes(turned) == {"CS142": 1}


def test_axis_that_turns_along_an_arc_is_pointed_out() -> None:
    assert codes(program("GOTO/1,0,0,0,0,1\nCIRCLE/0,0,0,0,0,1.,1.\nGOTO/0,1,0,0,.6,.8\n")) == {"CS147": 1}


CATIA = "$$     CATIA APT VERSION 1.0\nGOTO  /   20.40000,    0.00000,  -30.00000\nAUTOPS\n"


@pytest.mark.parametrize(
    ("drive", "end", "degrees"),
    [
        (
            "INDIRV/ 0.,0.,1.\nTLON,GOFWD/ (CIRCLE/ 25.00000, 0.00000, -30.00000,$\n 4.60000),ON,(LINE/ 25.00000,"
            " 0.00000, -30.00000,$\n 25.00000, 0.00000, -25.40000)",
            [25, 0, -25.4],
            90,
        ),
        (
            "INDIRV/0.,0.,-1.\nTLON,GOFWD/(CIRCLE/25.,0.,-30.,4.6),ON,2,INTOF,(LINE/25.,0.,-30.,25.,0.,-25.4)",
            [25, 0, -25.4],
            270,
        ),
        (
            "INDIRP/20.4,0.,-20.\nTLON,GOFWD/(CIRCLE/CANON,25.,0.,-30.,0.,1.,0.,4.6),ON,(PLANE/0.,0.,1.,-30.)",
            [29.6, 0, -30],
            180,
        ),
        ("INDIRV/0.,0.,1.\nTLON,GOFWD/(CIRCLE/25.,0.,-30.,4.6),ON,(LINE/25.,0.,-30.,25.,0.,0.)", [25, 0, -25.4], 90),
        (
            "PSIS/(PLANE/(POINT/1.,2.,3.),PERPTO,(VECTOR/0.,1.,0.))\nINDIRV/0.,0.,1.\nTLON,GOFWD/(CYLNDR/25.,0.,-30.,$\n"
            "0.,1.,0.,4.6),ON,(PLANE/PERPTO,(PLANE/0.,1.,0.,0.),(POINT/25.,0.,-30.),(POINT/25.,0.,-25.4))",
            [25, 0, -25.4],
            90,
        ),
    ],
)
def test_drive_surfaces(drive: str, end: list[float], degrees: float) -> None:
    result = program(f"{CATIA}{drive}\nGOTO/0,0,0\n")
    assert result.kind.tolist() == [2, 3, 2]
    assert result.tip[1] == pytest.approx(np.array(end), abs=1e-9)
    assert np.degrees(result.arcs.sweep) == pytest.approx([degrees])
    assert on_arc(result, 0, 1.0) == pytest.approx(np.array(end), abs=1e-9)
    assert result.statements[1:] == ()


def test_helical() -> None:
    text = "GOTO/10.,0.,5.\nHELICAL/0.,0.,0.,0.,1.,0.,0.,0.,1.,2.,10.,0.,10.,0.5\n"
    result = program(text)  # half a millimetre a quarter: 4.5 mm down at pitch 2 are 2.25 turns
    assert result.arcs.sweep / (2 * math.pi) == pytest.approx([2.25])
    assert result.arcs.normal.tolist() == [[0, 0, 1]]
    with pytest.raises(InputError, match="its angle is"):
        program(text.replace("10.,0.5", "10.,0.1"))


def test_nurbs_of_a_straight_line_and_of_a_parabola() -> None:
    """One Bezier piece: a cubic through (0,0), (1,1), (2,1), (3,0) is the parabola y = x - x²/3."""
    text = "GOTO/0.0000,0.0000,0.0000\nNURBS/\nKNOT/1.0\nCNTRL/1.0000,1.0000,0.0000\nCNTRL/2.0000,1.0000,0.0000\n"
    result = program(text + "CNTRL/3.0000,0.0000,0.0000\nPAINT/COLOR,31\nGOTO/9.0000,0.0000,0.0000\n")
    x, y = result.tip[:-1, 0], result.tip[:-1, 1]
    assert y == pytest.approx(x - x**2 / 3, abs=1e-12)
    assert (x[-1], result.tip[-1, 0]) == (3, 9)
    middle = (x[1:] + x[:-1]) / 2
    sag = np.abs(middle - middle**2 / 3 - (y[1:] + y[:-1]) / 2)
    assert 1e-5 < sag.max() <= 5e-4
    assert (result.kind == Move.LINEAR).all()
    assert result.line[1] == 4
    assert result.statements[0].pose == len(result) - 1
    straight = program("GOTO/0,0,0\nNURBS/\nKNOT/1.\nCNTRL/1,0,0\nCNTRL/2,0,0\nCNTRL/3,0,0\n")
    assert straight.tip[:, 0].tolist() == [0, 3]


@pytest.mark.parametrize("units", ["", "UNITS/INCHES\n"])
def test_lines_near_a_curve_in_inches_of_few_digits(units: str) -> None:
    text = "GOTO/0.,0.,0.\nNURBS/\nKNOT/1.\nCNTRL/1.,1.,0.\nCNTRL/2.,1.,0.\nCNTRL/3.,0.,0.\n"
    result = program(units + ("" if units else "FEDRAT/IPM,30.\n") + text)
    x, y = result.tip[:, 0] / 25.4, result.tip[:, 1] / 25.4
    middle = (x[1:] + x[:-1]) / 2
    sag = 25.4 * np.abs(middle - middle**2 / 3 - (y[1:] + y[:-1]) / 2)
    assert 1e-4 < sag.max() <= 5e-4


@pytest.mark.parametrize(("control", "form"), [("fanuc", "g1"), ("fanuc", "g6.2"), ("siemens", "bspline")])
@pytest.mark.parametrize("tolerance", [0.02, 0.001])
def test_what_is_written_keeps_the_tolerance_of_the_curve_itself(control: str, form: str, tolerance: float) -> None:
    """Not of its chords; and corners where it begins and ends are rounded."""
    text = "FEDRAT/MMPM,500.\nGOTO/-10.,0.,0.\nGOTO/0.,0.,0.\nNURBS/\nKNOT/1.\nCNTRL/10.,10.,0.\nCNTRL/20.,10.,0.\n"
    result, stream = program(text + "CNTRL/30.,0.,0.\nGOTO/40.,0.,0.\n"), io.BytesIO()
    made = postprocess(result, stream, Settings(tolerance=tolerance), form=choose_form(control, form))
    assert made.verdict is Verdict.PASSED
    assert len(sharp_rows(made.smoothed)) == 0
    if form == "g1":
        places = np.array(re.findall(rb"X(\S+) Y(\S+)", stream.getvalue()), float)
        inside = places[(places[:, 0] > 1.0) & (places[:, 0] < 29.0)]
        x, y = inside.T
        slope = 1.0 - x / 15.0
        off = np.abs(y - x + x**2 / 30.0) / np.hypot(1.0, slope)
        assert len(inside) > 20
        assert off.max() < tolerance
        wrong = stream.getvalue().replace(b"Y%.4f" % y[9], b"Y%.4f" % (y[9] + 0.1))
        found = verify(result, wrong, tolerance=tolerance, axis_length=10.0, control=control)
        assert found.verdict is Verdict.FAILED


def test_nx_nurbs_file(corpus: Path) -> None:
    """Curves leave the lines before them without a kink, and end where the file says."""
    result = read(corpus / "nx_clsf_nurbs.cls")
    text = (corpus / "nx_clsf_nurbs.cls").read_text().splitlines()
    ends = [i for i, line in enumerate(text, 1) if line.startswith("CNTRL") and not text[i].startswith("CNTRL")]
    assert len(ends) == 70
    for end in ends:
        at = np.flatnonzero(result.line == end)[-1]
        assert result.tip[at].tolist() == [float(number) for number in text[end - 1].partition("/")[2].split(",")]


def test_coremill_has_no_gouge(corpus: Path) -> None:
    result = read(corpus / "nx_clsf_coremill_steptools.cls")
    assert result.kind[result.line == 2579].tolist() == [Move.LINEAR]
    assert len(result.arcs) == 613
    assert np.degrees(result.arcs.sweep).max() == pytest.approx(90, abs=0.01)


@pytest.mark.parametrize(
    ("name", "arcs", "contradictions"),
    [
        ("nx_clsf_cutcom_arcs.cls", 140, 0),
        ("nx_clsf_helix_times_gohome.cls", 6, 0),
        ("steptools_plane_1.cldata", 29, 0),
        ("swcam_shimemcunha.apt", 28, 0),
        ("swcam_teste_metrologia.apt", 65, 24),
    ],
)
def test_arcs_of_the_corpus_fit_their_neighbours(corpus: Path, name: str, arcs: int, contradictions: int) -> None:
    """All arcs of NX and Makino are left-handed; turned round, they contradict the lines next to them."""
    result = read(corpus / name)
    assert len(result.arcs) == arcs
    assert codes(result).get("CS142", 0) == contradictions
    other = read(corpus / name, arc_rule="right" if name.startswith(("nx", "step")) else "left")
    assert codes(other).get("CS142", 0) > 0 or name.startswith("nx_clsf_helix")


def test_catia_turning_file(corpus: Path) -> None:
    result = read(corpus / "catia_demo5.aptsource", lenient=True)
    assert result.kind.tolist() == [2, 2, 2, 3, 3, 2, 3, 2]
    assert np.degrees(result.arcs.sweep) == pytest.approx([90, 90, 90], abs=0.01)
    assert result.tip[4].tolist() == [30.4, 0, -20]


def test_three_dialects_give_the_same_poses(corpus: Path) -> None:
    nx, catia, creo = (read(corpus / f"hecc_flank_{name}") for name in ("nx.cls", "catia.aptsource", "creo.ncl"))
    for other in (catia, creo):
        feed = np.flatnonzero(other.kind == Move.LINEAR)
        assert len(feed) == 145
        near = np.abs(nx.tip[:, None] - other.tip[feed]).max(axis=2).argmin(axis=0)  # NX has approaches in between
        assert (np.diff(near) > 0).all()
        assert nx.tip[near] == pytest.approx(other.tip[feed], abs=6e-5)
        assert nx.axis[near] == pytest.approx(other.axis[feed], abs=6e-7)
