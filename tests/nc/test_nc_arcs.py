"""Arcs in the text: which way, how far, how exactly; with an evaluator that knows nothing of the writer."""

from __future__ import annotations

import cmath
import io
import math
import re
from collections.abc import Callable
from itertools import pairwise, product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cornersmooth.cl import read
from cornersmooth.errors import InputError
from cornersmooth.geometry.arcs import arc_points
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.nc import choose_form, fit_settings, parse_control, write
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.block_counts import FORMS, MOST, blocks_of
from nc.cases import without_limits
from nc.grammars import reader
from nc.writing import codes, one_arc, text_of, text_of_cl
from oracle.files import cl_file, of_corpus
from oracle.judge import judge
from oracle.motion import Original, unit
from oracle.share import covering_share, how_many

Floats = NDArray[np.float64]

WORD = re.compile(r"([A-Z])(-?\d+\.?\d*)")
#: the planes of the standard: seen from the positive third axis, first and second lie like X and Y
PLANE = {"G17": "XYZ", "G18": "ZXY", "G19": "YZX"}


def walk(lines: list[str], samples: int = 17) -> Floats:
    """Points of the feed motion, from circular blocks the way controls read them: the shorter arc of radius R."""
    where, plane, points = dict.fromkeys("XYZ", 0.0), "G17", []
    for line in lines:
        if line in PLANE:
            plane = line
        if not re.match(r"G[0123] ", line):
            continue
        words = {letter: float(number) for letter, number in WORD.findall(line)}
        end = {letter: words[letter] for letter in "XYZ"}
        if line[:2] in ("G2", "G3"):
            u, v, w = PLANE[plane]
            a, b = complex(where[u], where[v]), complex(end[u], end[v])
            chord, radius = abs(b - a), words["R"]
            assert 0.0 < chord < 2.0 * radius, line
            left = 1 if line[:2] == "G3" else -1
            centre = (a + b) / 2 + left * 1j * (b - a) / chord * math.sqrt(radius**2 - chord**2 / 4)
            turn = cmath.phase((b - centre) / (a - centre))
            assert turn * left > 0.0, line
            assert abs(turn) < math.radians(125), line
            for share in np.linspace(0, 1, samples)[1:]:
                point = centre + (a - centre) * cmath.exp(1j * turn * share)
                here = {u: point.real, v: point.imag, w: where[w] + share * (end[w] - where[w])}
                points.append([here[letter] for letter in "XYZ"])
        else:
            points.append([end[letter] for letter in "XYZ"])
        where = end
    return np.array(points)


def turned(axis: Floats, vector: Floats, angle: float) -> Floats:
    return (
        math.cos(angle) * vector
        + math.sin(angle) * np.cross(axis, vector)
        + (1 - math.cos(angle)) * (axis @ vector) * axis
    )


def arc_about(number: int, seed: int) -> tuple[Program, Callable[[float], Floats]]:
    """A random arc about a coordinate axis, and its point at a share."""
    rng = np.random.default_rng(seed)
    normal = np.eye(3)[number] * rng.choice([-1.0, 1.0])
    radius, sweep = 10 ** rng.uniform(-0.5, 2.5), math.radians(rng.uniform(2, 719))
    height = rng.choice([0.0, 0.03, -0.2]) * radius * sweep
    centre = rng.uniform(-100, 100, 3)
    arm = turned(normal, np.roll(np.eye(3)[number], 1) * radius, rng.uniform(0, 6))

    def at(share: float) -> Floats:
        return centre + turned(normal, arm, sweep * share) + height * share * normal

    return one_arc(at(0), at(1), centre, normal, sweep, axis=rng.normal(size=3)), at


@pytest.mark.parametrize(("tolerance", "number"), covering_share(product([0.01, 0.0005], [0, 1, 2]), 4))
def test_circles_keep_the_tolerance(number: int, tolerance: float) -> None:
    """At equal shares of the way, so both ways and in order."""
    for seed in range(how_many(10, 40)):
        program, at = arc_about(number, seed)
        lines, written = text_of(program, tolerance=tolerance, axis_length=50.0)
        assert codes(written) == {"CS313": 1}
        path = walk(lines)[1:]
        for index, point in enumerate(path, 1):
            assert np.linalg.norm(point - at(index / len(path))) <= tolerance, (number, seed)
        np.testing.assert_allclose(path[-1], program.tip[1], atol=0.51e-4)


def nearest(point: Floats, path: Floats) -> float:
    """Distance from a point to a polyline."""
    start, step = path[:-1], np.diff(path, axis=0)
    size = np.einsum("ij,ij->i", step, step)
    share = np.clip(np.einsum("ij,ij->i", point - start, step) / np.where(size > 0, size, 1), 0, 1)
    return float(np.linalg.norm(start + share[:, None] * step - point, axis=1).min())


def farthest(points: Floats, path: Floats) -> float:
    """Largest distance from points to a polyline of many even lines: to that with the nearest middle, no less."""
    line = cKDTree((path[1:] + path[:-1]) / 2).query(points)[1]
    step, way = path[line + 1] - path[line], points - path[line]
    share = np.clip((way * step).sum(axis=1) / (step**2).sum(axis=1), 0, 1)
    return float(np.linalg.norm(way - share[:, None] * step, axis=1).max())


@pytest.mark.parametrize(
    ("normal", "start", "end", "expected"),
    [
        ((0, 0, 1), (10, 0, 0), (0, 10, 0), "G3 X0.0000 Y10.0000 Z0.0000 R10.0000 F300."),
        ((0, 0, -1), (0, 10, 0), (10, 0, 0), "G2 X10.0000 Y0.0000 Z0.0000 R10.0000 F300."),
        # about +Y a right-handed turn goes from Z to X: in G18, seen from +Y, Z lies like X does in G17
        ((0, 1, 0), (0, 0, 10), (10, 0, 0), "G3 X10.0000 Y0.0000 Z0.0000 R10.0000 F300."),
        ((0, -1, 0), (10, 0, 0), (0, 0, 10), "G2 X0.0000 Y0.0000 Z10.0000 R10.0000 F300."),
        ((1, 0, 0), (0, 10, 0), (0, 0, 10), "G3 X0.0000 Y0.0000 Z10.0000 R10.0000 F300."),
        ((-1, 0, 0), (0, 0, 10), (0, 10, 0), "G2 X0.0000 Y10.0000 Z0.0000 R10.0000 F300."),
    ],
)
def test_direction_is_seen_from_the_positive_third_axis(
    normal: tuple[int, ...], start: tuple[int, ...], end: tuple[int, ...], expected: str
) -> None:
    lines, _ = text_of(one_arc(start, end, (0, 0, 0), normal, math.pi / 2))
    arc = next(index for index, line in enumerate(lines) if line[:2] in ("G2", "G3") and " X" in line)
    assert lines[arc] == expected
    plane = {0: "G19", 1: "G18", 2: None}[int(np.argmax(np.abs(normal)))]
    assert (lines[arc - 1] if lines[arc - 1] in PLANE else None) == plane


def test_full_circle_and_turns_are_divided() -> None:
    """R form cannot hold a half turn or more."""
    for turns, blocks in ((1, 3), (2.25, 7)):
        end = turned(np.array([0.0, 0, 1]), np.array([10.0, 0, 0]), 2 * math.pi * turns)
        lines, _ = text_of(one_arc((10, 0, 0), (end[0], end[1], 3.0), (0, 0, 0), (0, 0, 1), 2 * math.pi * turns))
        assert sum(line.startswith("G3 ") for line in lines) == blocks


@pytest.mark.parametrize(
    ("why", "program"),
    [
        ("tilted plane", one_arc((10, 0, 0), (0, 10, 0), (0, 0, 0), (0.0, 0.1, 0.995), math.pi / 2)),
        ("too small", one_arc((1e-3, 0, 0), (0, 1e-3, 0), (0, 0, 0), (0, 0, 1), math.pi / 2)),
        ("huge", one_arc((2e5, 0, 0), (2e5, 1, 0), (0, 0, 0), (0, 0, 1), 5e-6)),
        ("radii differ", one_arc((10, 0, 0), (0, 10.05, 0), (0, 0, 0), (0, 0, 1), math.pi / 2)),
    ],
)
def test_what_no_circle_can_be_becomes_lines(why: str, program: Program) -> None:
    lines, written = text_of(program)
    assert codes(written) == {"CS314": 1}, why
    assert not [line for line in lines if line[:3] in ("G2 ", "G3 ")]


@pytest.mark.parametrize(("control", "arcs"), [("fanuc", [True, False]), ("siemens", [True, True])])
def test_a_steep_helix_is_lines_where_f_counts_in_its_plane(control: str, arcs: list[bool]) -> None:
    """FANUC (1403#5 HTG 0) ran a rise of 15 mm on a quarter circle of 10 mm at 415 mm/min for F300."""
    for rise, circles in zip((3.0, 15.0), arcs, strict=True):
        program = one_arc((10.0, 0, 0), (0, 10.0, rise), (0, 0, 0), (0, 0, 1), math.pi / 2)
        form, stream = choose_form(control, "g1"), io.BytesIO()
        write(smooth(program, fit_settings(Settings(), form, "mm")), stream, form=form)
        assert (b"\nG3 " in stream.getvalue()) is circles


def test_a_table_whose_f_counts_along_a_helix_has_it_as_an_arc() -> None:
    """FANUC with HTG 1: `verify` takes its word for it, and says 415 mm/min without."""
    form = choose_form(parse_control('like = "fanuc"\n[motion]\nfeed_in_plane = false\n'), "g1")
    program = one_arc((10.0, 0, 0), (0, 10.0, 15.0), (0, 0, 0), (0, 0, 1), math.pi / 2)
    stream = io.BytesIO()
    found = postprocess(program, stream, form=form, processes=1)
    assert b"\nG3 " in stream.getvalue()
    assert found.verification is not None
    assert found.verification.problems == ()
    assert {one.code for one in verify(program, stream.getvalue(), tolerance=0.01).problems} == {"CS541"}


def test_turning_tool_axis_becomes_lines_with_the_axis_spread() -> None:
    """A circular block has no room for a tool vector."""
    program = one_arc((10, 0, 0), (0, 10, 0), (0, 0, 0), (0, 0, 1), math.pi / 2)
    turned_axis = program.axis.copy()
    turned_axis[1] = (0.6, 0.0, 0.8)
    lines, written = text_of(Program(**{**vars(program), "axis": turned_axis}), tolerance=0.05)
    assert codes(written) == {"CS314": 1}
    vectors = np.array([[float(n) for n in re.findall(r"[IJK](-?[\d.]+)", line)] for line in lines if " I" in line])
    assert len(vectors) > 5
    assert np.diff(vectors[:, 0]).max() < 0.3
    np.testing.assert_allclose(vectors[-1], (0.6, 0.0, 0.8))


@pytest.mark.parametrize("chord", [None, 0.05])
def test_lines_for_an_arc_stay_within_the_tolerance(chord: float | None) -> None:
    """Even where lines on curves may be coarser than the tolerance."""
    normal = np.array([0.0, 0.6, 0.8])
    arm = np.array([25.0, 0, 0])
    shares = np.linspace(0, 1, 2001)
    points = np.array([turned(normal, arm, 4.0 * s) for s in shares])
    program = one_arc(points[0], points[-1], (0, 0, 0), normal, 4.0)
    lines, _ = text_of(program, tolerance=0.01, chord_tolerance=chord)
    path = walk(lines)
    worst = max(nearest(point, path) for point in points)
    assert worst <= 0.01
    assert (worst > 5e-4) or chord is None, "finer than asked for"


#: a whole turn, a helix, a tilted axis of the arc, an arc across a tilted tool
LEANING = (0.6, 0.0, 0.8)
BENT = {
    "turn": one_arc((25.0, 0, 0), (25.0, 0, 0), (0, 0, 0), (0, 0, 1), 2 * math.pi, axis=LEANING),
    "helix": one_arc((25.0, 0, 0), (-25.0, 0, 12.0), (0, 0, 0), (0, 0, -1), 5 * math.pi, axis=LEANING),
    "tilted": one_arc((25.0, 0, 0), (0, 20.0, -15.0), (0, 0, 0), (0, -0.6, -0.8), 1.5 * math.pi),
    "inside": one_arc((2.0, 0, 0), (0, 2.0, 0), (0, 0, 0), (0, 0, 1), math.pi / 2, axis=LEANING),
}


@pytest.mark.parametrize(
    ("control", "form", "most"),
    [("fanuc", "g6.2", 4), ("generic", "g6.2", 4), ("siemens", "bspline", 3), ("siemens", "poly", 4)],
)
@pytest.mark.parametrize("name", BENT)
def test_arcs_are_curves_where_a_point_of_the_axis_goes_along(name: str, control: str, form: str, most: int) -> None:
    """Rational ones are circles but for the rounding of their weights; so many rows for 120 degrees are enough."""
    program = BENT[name]
    chosen = choose_form(control, form)
    settings = Settings(tolerance=0.002, chord_tolerance=0.0005)
    smoothed = smooth(program, fit_settings(settings, chosen, program.units))
    stream = io.BytesIO()
    written = write(smoothed, stream, form=chosen)
    text = stream.getvalue().decode("ascii")
    assert [one.text for one in written.findings if one.code == "CS313"] == ["arc written as curves"]
    assert "CS314" not in codes(written)
    points = len(re.findall(r" (?:R|PW=)[01]|POLY", text))
    assert points <= most * 2 * math.ceil(3 * program.arcs.sweep[0] / (2 * math.pi))
    (path,) = reader(control, form).read(text, settings.axis_length, settings.tolerance).runs(10.0)
    tip, axis = arc_points(program, np.zeros(4001, np.int64), np.linspace(0.0, 1.0, 4001))
    assert farthest(path.tip, tip) <= 0.0007  # chord tolerance, and rounding
    assert np.linalg.norm(path.point - path.tip - 10.0 * axis[0], axis=1).max() <= 3e-4
    way = np.linalg.norm(np.diff(path.tip, axis=0), axis=1).sum()
    assert way == pytest.approx(np.linalg.norm(np.diff(tip, axis=0), axis=1).sum(), rel=2e-3)


def test_no_curve_where_the_control_refuses_it() -> None:
    """PS1006: G06.2 under G95, and under cutter compensation."""
    cl = "UNITS/MM\nSPINDL/900,RPM,CLW\nFEDRAT/0.1,MMPR\nRAPID\nGOTO/10,0,0,0.6,0,0.8\n{}FEDRAT/{}\nGOTO/20,0,0\n"
    cl += "CIRCLE/20,10,0,0,0,1,10\nGOTO/30,10,0\nFINI\n"
    for before, feed, curves in (("", "90,MMPM", 1), ("", "0.1,MMPR", 0), ("CUTCOM/LEFT\n", "90,MMPM", 0)):
        lines, _ = text_of_cl(cl.format(before, feed), "g6.2")
        assert sum(line.startswith("G6.2") for line in lines) == curves


def test_g62_ends_before_anything_but_control_points() -> None:
    """Its mode takes no other commands (B-63324EN/03 4.17): G1 stands before them."""
    cl = "UNITS/MM\nFEDRAT/90,MMPM\nRAPID\nGOTO/10,0,0,0.6,0,0.8\nGOTO/20,0,0\nCIRCLE/20,10,0,0,0,1,10\n"
    lines, _ = text_of_cl(cl + "GOTO/30,10,0\nDELAY/2\nGOTO/30,20,0\nFINI\n", "g6.2")
    last = max(index for index, line in enumerate(lines) if re.fullmatch(r"K\d+\.\d*", line))
    assert lines[last + 1 : last + 3] == ["G1", "G4 P2000"]


def test_a_tool_along_z_needs_no_axis_point() -> None:
    """Then arcs are circles in curve forms, and taps the cycle of the control."""
    cl = (
        "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nFEDRAT/90,MMPM\nRAPID\nGOTO/10,0,50\nGOTO/10,0,5\n"
        "GOTO/20,0,5\nCIRCLE/20,10,5,0,0,1,10\nGOTO/30,10,5\nRAPID\nGOTO/30,10,50\n"
        "CYCLE/TAP,DEPTH,9,MMPR,1.5,CLEAR,5\nGOTO/40,0,0\nCYCLE/OFF\nFINI\n"
    )
    lines, written = text_of_cl(cl, "g6.2")
    assert not [line for line in lines if " U" in line]
    assert any(re.fullmatch(r"G3 X30\.0+ Y10\.0+ Z5\.0+ R10\.0+", line) for line in lines)
    assert any(line.startswith("G98 G84 X40.0000 Y0.0000 Z-9.0000") for line in lines)
    assert not {"CS315", "CS395"} & codes(written).keys()  # left out; axis points


def test_tools_have_axis_points_all_or_none() -> None:
    """U V W stay as they are from tool to tool, and no word says where a tool without them leaves them."""
    cl = (
        "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nFEDRAT/90,MMPM\nRAPID\nGOTO/10,0,50,0,0,1\nGOTO/10,0,5\n"
        "GOTO/20,0,5\nCIRCLE/20,10,5,0,0,1,10\nGOTO/30,10,5\nRAPID\nGOTO/30,10,50\n{}"
        "LOADTL/2\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,0,50,0.6,0,0.8\nGOTO/0,30,50\nGOTO/30,30,50,0,0.6,0.8\nFINI\n"
    )
    chosen, settings, stream = choose_form("fanuc", "g6.2"), Settings(tolerance=0.01), io.BytesIO()
    program = read(cl.format("").encode(), name="two.cls")
    fitted = fit_settings(settings, chosen, program.units)
    write(smooth(program, fitted), stream, form=chosen)
    text = stream.getvalue()
    places = [line for line in text.decode().splitlines() if re.search(r" X\S+ Y\S+ Z", line)]
    assert len(places) > 10
    assert all(re.search(r" U\S+ V\S+ W", line) for line in places), places
    found = verify(program, text, tolerance=fitted.tolerance, axis_length=fitted.axis_length, control="fanuc")
    assert found.passed, found.problems
    tap = "CYCLE/TAP,DEPTH,9,MMPR,1.5,CLEAR,5\nGOTO/40,0,0\nCYCLE/OFF\n"
    with pytest.raises(InputError, match="a tap, and a tool of the program tilts") as refusal:
        text_of_cl(cl.format(tap), "g6.2")
    assert refusal.value.code == "CS342"


@pytest.mark.parametrize(
    ("control", "name", "tcp", "axis", "normal", "circles"),
    [
        ("fanuc", "table-ac", True, (0, 0, 1), 2, 1),
        ("fanuc", "table-ac", True, (0, -1, 0), 1, 0),  # the table has tilted the plane: PS5421 where WKP is 1
        ("fanuc", "head-ac", True, (0, -1, 0), 1, 1),  # "no restriction ... on a tool rotation axis"
        ("fanuc", "head-ac", True, (0, -0.6, 0.8), 2, 1),
        ("fanuc", "table-ac", False, (0, -1, 0), 1, 1),  # along Z of the machine
        ("fanuc", "table-ac", False, (0, -0.6, 0.8), 2, 0),  # tilted in X Y Z of the machine
        ("siemens", "table-ac", True, (0, -1, 0), 1, 1),
        ("linuxcnc", "xyzac-trt", True, (0, 0, 1), 2, 1),
        ("heidenhain", "table-bc", True, (0, 0, 1), 2, 1),
        ("heidenhain", "table-bc", True, (0, 0, 1), 0, 0),  # CR lies in XY
        ("haas", "table-bc", True, (0, 0, 1), 2, 0),
        ("haas", "table-bc", False, (0, 0, 1), 2, 1),
    ],
)
def test_arcs_are_circles_where_rotary_axes_stand(
    control: str, name: str, tcp: bool, axis: tuple[float, ...], normal: int, circles: int
) -> None:
    """And where the control takes them; the text means the arc."""
    start = np.roll(np.eye(3)[normal] * 20.0, 1)
    about = np.eye(3)[normal]
    end = turned(about, start, 1.5)
    text_start = "{:.6f},{:.6f},{:.6f}".format(*start)
    cl = "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/{},{},{},{}\n".format(text_start, *axis)
    cl += "FEDRAT/90,MMPM\nCIRCLE/0,0,0,{:.0f},{:.0f},{:.0f},20\n".format(*about)
    cl += "GOTO/{:.6f},{:.6f},{:.6f}\nFINI\n".format(*end)
    machine = without_limits(load_machine(name))
    chosen, program = choose_form(control, "g1", machine=machine, tcp=tcp), read(cl.encode(), name="arc.cls")
    settings = Settings(tolerance=0.01)
    stream = io.BytesIO()
    written = write(smooth(program, fit_settings(settings, chosen, program.units)), stream, form=chosen)
    assert codes(written).get("CS313", 0) == circles
    found = reader(control, "g1", name, tcp).read(stream.getvalue().decode(), 10.0, settings.tolerance)
    share = np.linspace(0.0, 1.0, 2001)
    tip = np.array([turned(about, start, 1.5 * s) for s in share])
    original = Original(tip, np.broadcast_to(unit(np.array([axis], np.float64)), tip.shape))
    verdict = judge(found.runs(10.0), [original], 10.0, settings.tolerance)
    assert verdict.deviation.worst <= settings.tolerance, verdict


def test_an_arc_on_which_an_axis_would_turn_is_lines() -> None:
    """Near the pole the first axis turns ahead of time, on the arc, too: there is no circle then."""
    cl = (
        "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,0,0,0,-0.6,0.8\nFEDRAT/90,MMPM\nGOTO/20,0,0,0,0,1\n"
        "CIRCLE/20,10,0,0,0,1,10\nGOTO/30,10,0\nGOTO/30,40,0,0.6,0,0.8\nFINI\n"
    )
    chosen = choose_form("siemens", "g1", machine=load_machine("table-ac"))
    program = read(cl.encode(), name="pole.cls")
    stream = io.BytesIO()
    written = write(smooth(program, fit_settings(Settings(tolerance=0.01), chosen, "mm")), stream, form=chosen)
    assert codes(written)["CS314"] == 1
    assert not re.search(r"^G[23] ", stream.getvalue().decode(), re.MULTILINE)


def test_planes_change_only_when_they_must() -> None:
    lines, _ = text_of_cl(
        "UNITS/MM\nFEDRAT/100,MMPM\nRAPID\nGOTO/10,0,0\n"
        "CIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\nCIRCLE/0,0,0,0,0,1,10\nGOTO/-10,0,0\n"
        "CIRCLE/0,0,0,0,1,0,10\nGOTO/0,0,10\nGOTO/0,0,20\nCIRCLE/0,0,0,0,-1,0,20\nGOTO/-20,0,0\n"
        "CIRCLE/0,0,0,0,0,-1,20\nGOTO/0,20,0\nFINI\n"
    )
    assert [line for line in lines if line in PLANE] == ["G18", "G17"]
    assert [line[:2] for line in lines if re.match("G[23] ", line)] == ["G3", "G3", "G3", "G2", "G2"]


def test_no_other_plane_under_cutter_compensation() -> None:
    lines, written = text_of_cl(
        "UNITS/MM\nFEDRAT/100,MMPM\nRAPID\nGOTO/5,0,0\nCUTCOM/LEFT,XYPLAN\nGOTO/5,5,0\nCIRCLE/0,5,0,0,1,0,5\n"
        "GOTO/0,5,-5\nCIRCLE/0,0,-5,0,0,1,5\nGOTO/-5,0,-5\nCUTCOM/OFF\nGOTO/0,9,0\nFINI\n"
    )
    assert codes(written) == {"CS313": 1, "CS314": 1, "CS319": 1}
    assert not [line for line in lines if line in PLANE]
    assert "G3 X-5.0000 Y0.0000 Z-5.0000 R5.0000" in lines


def test_arc_after_a_tool_change_is_approached() -> None:
    """A circular block starts where the tool is, and after a tool change nobody knows where."""
    lines, _ = text_of_cl(
        "UNITS/MM\nFEDRAT/100,MMPM\nRAPID\nGOTO/10,0,0\nLOADTL/2\nCIRCLE/0,0,0,0,0,1,10\nGOTO/0,10,0\nFINI\n"
    )
    arc = next(index for index, line in enumerate(lines) if line.startswith("G3 "))
    assert lines[arc - 1].startswith("G1 X10.0000 Y0.0000 Z0.0000 ")


@pytest.mark.parametrize(
    ("name", "arcs"),
    [
        ("nx_pocket.cls", 6),
        ("makino_contour.cldata", 2),
        ("solidworks_bracket.apt", 2),
        *of_corpus(
            [
                ("nx_clsf_coremill_steptools.cls", 21),
                ("swcam_teste_metrologia.apt", 21),
                ("steptools_plane_1.cldata", 21),
            ]
        ),
    ],
)
def test_arcs_in_files_are_on_their_circles(name: str, arcs: int) -> None:
    lines, written = text_of_cl(cl_file(name).read_bytes().decode("cp1252"))
    assert codes(written)["CS313"] >= arcs
    path = walk(lines)
    assert np.isfinite(path).all()
    feeds = [line for line in lines if re.match("G[123] ", line)]
    assert all(one != other for one, other in pairwise(feeds))


@pytest.mark.parametrize("name", ["nx_pocket.cls", "makino_contour.cldata", "catia_profile.aptsource"])
def test_no_form_makes_many_blocks_of_arcs(name: str) -> None:
    """27 times as many it once was; `python -m nc.block_counts` has all files."""
    first, *others = (blocks_of(cl_file(name), form, 0.02) for form in FORMS)
    assert isinstance(first, int)
    assert all(isinstance(count, int) and count <= MOST * first for count in others)


@pytest.mark.parametrize(
    ("control", "form", "extras", "hinted"),
    [("fanuc", "g1", (), "aicc"), ("siemens", "g1", (), "cycle832"), ("heidenhain", "g1", (), "cycle32"),
     ("fanuc", "g1", ("hpcc",), ""), ("fanuc", "g6.2", (), ""), ("mitsubishi", "g1", (), "")],
)  # fmt: skip
def test_many_short_lines_want_a_control_that_looks_ahead(
    control: str, form: str, extras: tuple[str, ...], hinted: str
) -> None:
    cl = "UNITS/MM\nFEDRAT/90,MMPM\nRAPID\nGOTO/0,0,0\nGOTO/20,0,0\nGOTO/20,{},0\nFINI\n"
    chosen = choose_form(control, form, extras=extras)
    for second, corner in ((20, True), (0, False)):
        program = read(cl.format(second).encode(), name="part.cls")
        smoothed = smooth(program, fit_settings(Settings(tolerance=0.05), chosen, program.units))
        texts = [one.text for one in write(smoothed, io.BytesIO(), form=chosen).findings if one.code == "CS396"]
        assert [f"--with {hinted}," in text for text in texts] == [True] * bool(hinted and corner)
