"""Long lines: as few as ε allows, for every control whose tip runs straight on them."""

from __future__ import annotations

from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import SettingsError
from cornersmooth.model import Program
from cornersmooth.nc import choose_form, fit_settings
from cornersmooth.settings import Settings
from nc.cases import CHOSEN, Case
from nc.promise import random_verdict, runs_of, verdict, without_holes, written
from oracle.share import covering_share, how_many

SAMPLES = Path(__file__).parents[2] / "samples"

LONG = [case for case in CHOSEN if case.choose().long_lines]
LIMITS = ((0.002, 10.0), (0.05, 50.0), (0.01, 10.0))


@pytest.mark.parametrize(("seed", "case"), covering_share(product([0, 1], LONG), 8), ids=str)
def test_random_chains_keep_the_tolerance(case: Case, seed: int) -> None:
    tolerance, axis_length = LIMITS[(len(str(case)) + seed) % 3]
    settings = Settings(tolerance=tolerance, axis_length=axis_length, lines="long")
    found = random_verdict(case, settings, 7 * seed + len(str(case)), how_many(5, 16))
    assert found.deviation.worst <= tolerance, found


@pytest.mark.parametrize("case", covering_share(LONG, 7, 1), ids=str)
def test_sample_keeps_the_tolerance(case: Case) -> None:
    program = without_holes(read((SAMPLES / "impeller.cls").read_bytes(), name="impeller.cls"))
    settings = Settings(tolerance=0.02, axis_length=20.0, lines="long")
    found = verdict(program, runs_of(program, 0.02), case, case.choose(endless=True), settings)
    assert found.deviation.worst <= 0.02, found


def test_line_out_of_the_pole_keeps_the_axis() -> None:
    """The turntable turns by 90 degrees at the pole: spread over the long line behind it, it would swing the axis."""
    axis = np.array([[0.25, 0.25, 0.935], [0.0, 0.0, 1.0], [-0.25, 0.25, 0.935]])
    tip = np.array([[0.0, 0.0, 0.0], [-8.0, 0.0, -8.0], [0.0, 8.0, -16.0]])
    program = Program.from_poses(tip, axis / np.linalg.norm(axis, axis=1)[:, None], feed=1000.0)
    case = next(case for case in LONG if str(case) == "linuxcnc-g1-xyzbc-trt")
    settings = Settings(tolerance=0.1, axis_length=16.0, lines="long")
    found = verdict(program, runs_of(program, 0.1), case, case.choose(endless=True), settings)
    assert found.deviation.worst <= 0.1, found


def dense_arc(count: int) -> Program:
    """A turn of 90 degrees about (0, 0, 1) with a radius of 50 mm, the tool leaning 20 degrees outwards."""
    angle = np.linspace(0.0, np.pi / 2.0, count)
    tip = np.stack((50.0 * np.cos(angle), 50.0 * np.sin(angle), np.zeros(count)), axis=1)
    lean = np.radians(20.0)
    out = np.sin(lean)
    axis = np.stack((out * np.cos(angle), out * np.sin(angle), np.full(count, np.cos(lean))), axis=1)
    return Program.from_poses(tip, axis, feed=1000.0)


def lines_of(program: Program, settings: Settings) -> int:
    text, _ = written(program, choose_form("fanuc", "g1"), settings)
    return sum(line.startswith("G1") or line[:1] in "XYZIJK" for line in text.splitlines())


def test_number_of_lines_is_that_of_the_geometry() -> None:
    """A chord between two points ε outside of a circle of radius r may reach ε inside of it: 2·sqrt(8·ε·r/2) long.

    Here both ends lie on the circle or inside of it, so a chord of sqrt(8·ε·r) is the longest: the axis point, which
    runs on a circle of r + H·sin 20°, sets it.
    """
    tolerance, height = 0.01, 10.0
    program = dense_arc(2001)
    settings = Settings(tolerance=tolerance, axis_length=height, lines="long")
    radius = 50.0 + height * np.sin(np.radians(20.0))
    step = 2.0 * np.arccos(1.0 - tolerance / radius)
    fewest = np.pi / 2.0 / step
    found = lines_of(program, settings)
    assert fewest <= found <= 1.15 * fewest + 2
    assert lines_of(program, settings.but(lines="dense")) > 20 * found


def test_more_poses_of_the_same_path_make_no_more_lines() -> None:
    settings = Settings(tolerance=0.01, lines="long")
    few, many = (lines_of(dense_arc(count), settings) for count in (501, 8001))
    assert abs(few - many) <= 0.1 * few + 8001 * 3 // 512


def test_feeds_and_statements_stay_at_their_poses() -> None:
    text = """TOOL PATH/A
FEDRAT/MMPM,1000
GOTO/0,0,0,0,0,1
GOTO/10,0.001,0,0,0,1
GOTO/20,0,0,0,0,1
FEDRAT/MMPM,500
GOTO/30,0.001,0,0,0,1
GOTO/40,0,0,0,0,1
PPRINT/HERE
GOTO/50,0.001,0,0,0,1
COOLNT/ON
GOTO/60,0,0,0,0,1
GOTO/70,0.001,0,0,0,1
END-OF-PATH
"""
    program = read(text.encode(), name="a.cls")
    lines, _ = written(program, choose_form("fanuc", "g1"), Settings(tolerance=0.01, lines="long"))
    order = [line for line in lines.splitlines() if line.startswith(("X", "G1", "(", "M8"))]
    places = [
        next(index for index, line in enumerate(order) if key in line)
        for key in ("X20.", "F500", "X40.", "HERE", "X50.", "M8", "X70.")
    ]
    assert places == sorted(places)
    assert not any("X10." in line or "X30." in line for line in order)


@pytest.mark.parametrize(("control", "form"), [("fanuc", "g6.2"), ("siemens", "bspline")])
def test_curves_have_no_long_lines(control: str, form: str) -> None:
    with pytest.raises(SettingsError, match="cannot be written in long lines") as caught:
        fit_settings(Settings(lines="long"), choose_form(control, form), "mm")
    assert caught.value.code == "CS223"


def told_blends(text: str) -> list[tuple[float, str]]:
    """What G64 says while each motion block runs."""
    blend, found = 0.0, []
    for line in text.splitlines():
        if line.startswith("G64 "):
            blend = float(line.split()[1][1:])
        elif line.startswith(("G0 ", "G1 ")):
            found.append((blend, line))
    return found


def test_every_corner_has_its_own_blend() -> None:
    """More than the usual one where lines leave room, never more than the tolerance, and the usual one in rapids."""
    program = without_holes(read((SAMPLES / "impeller.cls").read_bytes(), name="impeller.cls"))
    settings = Settings(tolerance=0.02)
    form = Case("linuxcnc", "g1", "xyzac-trt").choose(endless=True)
    text, _ = written(program, form, settings)
    told = told_blends(text)
    usual = round(0.27 * settings.tolerance, 5)
    assert all(1e-5 <= blend <= settings.tolerance for blend, _ in told)
    assert {blend for blend, line in told if line.startswith("G0 ")} == {usual}
    assert np.mean([blend > usual for blend, _ in told]) > 0.5
    blocks = [line for line in text.splitlines() if line.startswith("G64 ")]
    assert all(one != other for one, other in pairwise(blocks))
    dense, _ = written(program, form, settings.but(lines="dense"))
    assert dense.count("G64 ") == 1


def test_no_blend_is_told_while_the_cutter_is_compensated() -> None:
    """LinuxCNC refuses G64 there."""
    rows = "".join(f"GOTO/{x},{0.02 * (x % 3)},0,{0.02 * (x % 4)},0,1\n" for x in range(1, 30))
    text = f"CUTCOM/LEFT,XYPLAN,1\n{rows}CUTCOM/OFF\n{rows}"
    program = read(f"FEDRAT/MMPM,500\nGOTO/-9,0,0,0,0,1\n{text}FINI\n".encode(), name="a.cls")
    form = Case("linuxcnc", "g1", "xyzac-trt").choose(endless=True)
    lines, _ = written(program, form, Settings(tolerance=0.05))
    inside = lines[lines.index("G41") : lines.index("G40", lines.index("G41"))]
    assert "G1 " in inside
    assert "G64" not in inside
    assert "G64" in lines[lines.index("G40", lines.index("G41")) :]
