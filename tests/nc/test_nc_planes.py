"""Tilted planes of controls: their words, the frame that the manuals make of them, and which mutants are found."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Travel, load_machine, nose_position, solutions
from cornersmooth.model import Move
from cornersmooth.nc import Form, Frame, choose_form, fit_settings, parse_control, write
from cornersmooth.nc.planes import rotations_frame, tilting_angles
from cornersmooth.nc_reader import read_nc
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.cases import Case
from oracle.share import covering_share, share

EPS, H = 0.02, 10.0

#: a cut from above, a cut and holes in one tilted plane, a cut in another; then another tool that tilts in its cut
CL = """PARTNO FACES
UNITS/MM
LOADTL/1
SPINDL/2000,RPM,CLW
RAPID
GOTO/0,0,80,0,0,1
FEDRAT/MMPM,300
GOTO/0,0,0
GOTO/30,0,0
GOTO/30,20,0
RAPID
GOTO/30,20,80
RAPID
GOTO/50,10,60,0.48,0.36,0.8
GOTO/20,-12.5,10
GOTO/26,-20.5,10
GOTO/30,-18,6
RAPID
GOTO/50,10,60
CYCLE/DRILL,FEDTO,12,MMPM,150,RAPTO,3,RTRCTO,20
GOTO/20,5,1
GOTO/14,13,1
CYCLE/DEEP,FEDTO,25,STEP,10,MMPM,90,RAPTO,3
GOTO/28,18,1
CYCLE/OFF
RAPID
GOTO/50,10,60
RAPID
GOTO/50,10,60,-0.6,0,0.8
FEDRAT/MMPM,300
GOTO/20,10,10
GOTO/28,10,16
GOTO/28,20,16
RAPID
GOTO/0,10,80
LOADTL/2
SPINDL/900,RPM,CLW
RAPID
GOTO/0,10,80,0,0,1
GOTO/0,10,10
GOTO/10,10,10,0.1,0,0.9949874
GOTO/20,10,10,0,0,1
RAPID
GOTO/0,10,80,0,0,1
FINI
"""

CASES = [
    Case("fanuc", "g1"),
    Case("siemens", "g1"),
    Case("heidenhain", "g1"),
    Case("haas", "g1", "table-bc"),
    Case("mitsubishi", "g1", "table-ac"),
    Case("fanuc", "g1", "table-ac", tcp=False),
    Case("siemens", "g1", "head-ac"),
    Case("heidenhain", "g1", "nutated-bc"),
]

#: what the words of a plane are, and the frame that the manual of the control makes of its numbers
PLANES: dict[str, tuple[str, str, Callable[..., Rotation]]] = {
    "iso": (
        r"G68\.2 X0\. Y0\. Z0\. I(\S+) J(\S+) K(\S+)",
        "G69",
        lambda i, j, k: Rotation.from_euler("ZXZ", (i, j, k), degrees=True),
    ),
    "siemens": (
        r'CYCLE800\(0,"",0,57,0,0,0,([-\d.]+),([-\d.]+),([-\d.]+),0,0,0,-1\)',
        r"CYCLE800\(\)",
        lambda a, b, c: Rotation.from_euler("XYZ", (a, b, c), degrees=True),
    ),
    "heidenhain": (
        r"\d+ PLANE SPATIAL SPA(\S+) SPB(\S+) SPC(\S+) TURN FMAX",
        r"\d+ PLANE RESET STAY",
        lambda a, b, c: Rotation.from_euler("xyz", (a, b, c), degrees=True),  # about the fixed axes
    ),
    # B7.125 C0 is the tool along (+0.124, 0, 0.992), B35.22 C-.548 along (+0.577, -0.006, 0.817)
    "haas": (
        r"G0 B(\S+) C(\S+)",
        "G255",
        lambda b, c: Rotation.from_euler("ZY", (c, b), degrees=True),
    ),
}


def form_of(case: Case, **more: str) -> Form:
    machine = load_machine(case.machine) if case.machine else None
    return choose_form(case.control, case.form, machine=machine, tcp=case.tcp, planes=True, **more)


def words_of(case: Case) -> tuple[str, str, Callable[..., Rotation]]:
    return PLANES.get(case.control, PLANES["iso"])


@cache
def text_of(case: Case, cl: str = CL, cycles: str = "native", digits: str = "") -> tuple[list[str], dict[str, int]]:
    """Lines of a text in planes, and what was said of it."""
    form, program, stream = form_of(case, digits=digits), read(cl.encode(), name="part.cls"), io.BytesIO()
    settings = fit_settings(Settings(tolerance=EPS, axis_length=H), form, program.units)
    written = write(
        smooth(program, settings), stream, form=form, frame=Frame(cycles=cycles, skip_cycles=False, comments=False)
    )
    lines = stream.getvalue().decode("ascii").splitlines()
    assert written.blocks == sum(not line.endswith(" ~") for line in lines)
    return lines, {finding.code: finding.count for finding in written.findings}


def problems(case: Case, lines: list[str], cl: str = CL, eps: float = EPS) -> list[str]:
    """What is wrong with a text."""
    try:
        found = verify(
            read(cl.encode(), name="part.cls"),
            ("\n".join(lines) + "\n").encode(),
            tolerance=eps,
            axis_length=H,
            control=case.control,
            machine=form_of(case).machine,
            tcp=case.tcp,
        )
    except InputError as error:
        return [str(error)]
    return [f"{problem.code} {problem.text}" for problem in found.problems]


@pytest.mark.parametrize(("cycles", "case"), covering_share(product(["native", "moves"], CASES), 2), ids=str)
def test_texts_in_planes_are_right(case: Case, cycles: str) -> None:
    lines, said = text_of(case, cycles=cycles)
    on, off, _ = words_of(case)
    assert sum(bool(re.fullmatch(off, line)) for line in lines) == 3
    assert re.fullmatch(
        off, next(line for line in lines if re.fullmatch(rf"{off}|{_RETRACT}", line))
    )  # at the start, too
    assert sum(bool(re.fullmatch(on, line)) for line in lines) >= 2
    assert said["CS356"] == 2
    assert any(re.match("CYCLE8[1-5]", line) or "G98" in line or "M99" in line for line in lines) is (
        cycles == "native"
    )
    assert problems(case, lines) == []


def positions(case: Case) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Places of blocks in planes in the coordinates of the part, and the tool axis there, by the manual's frame."""
    on, off, frame = words_of(case)
    turned: Rotation | None = None
    inside, place = False, np.full(3, np.nan)
    for line in text_of(case, cycles="moves")[0]:
        if match := re.fullmatch(on, line):
            turned, inside = frame(*map(float, match.groups())), case.control != "haas"
        elif line == "G254":
            inside = True
        elif re.fullmatch(off, line):
            inside = False
        elif inside and (move := re.fullmatch(r"(?:\d+ |G43 H\d+ )?(?:G[01]|L) (X\S+) (Y\S+) (Z\S+)(?: F.*)?", line)):
            assert turned is not None
            place = np.array([float(word[1:]) for word in move.groups()])
            yield turned.apply(place), turned.apply([0.0, 0.0, 1.0])


@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_manuals_frame_leads_every_block_to_the_part(case: Case) -> None:
    program, found = read(CL.encode(), name="part.cls"), list(positions(case))
    tips, axes = np.array([tip for tip, _ in found]), np.array([axis for _, axis in found])
    form = form_of(case)
    room = np.radians(1.0) * 10.0**-form.table.digits.angle
    in_planes = np.arange(6, 19)  # poses of both tilted runs
    for pose in in_planes.tolist():
        near = np.linalg.norm(axes - program.axis[pose], axis=1) < room
        assert near.any()
        height = 3.0 if program.kind[pose] == Move.HOLE else 0.0
        way = np.linalg.norm(tips[near] - program.tip[pose] - height * program.axis[pose], axis=1)
        assert way.min() < EPS + 1e-3
    assert (np.min(np.linalg.norm(axes[:, None] - program.axis[None], axis=2), axis=1) < room).all()


@pytest.mark.parametrize("rotations", ["zxz", "xyz", "zyx", "zyz", "yxz", "yxy", "xyx"])
def test_angles_lead_z_to_the_tool_for_every_order(rotations: str) -> None:
    rng = np.random.default_rng(5)
    axes = rng.normal(size=(50, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    for axis in [*axes, *np.eye(3), *-np.eye(3)]:
        angles = tilting_angles(rotations, axis)
        scipy = Rotation.from_euler(rotations.upper(), angles, degrees=True).as_matrix()
        frame = rotations_frame(rotations, list(angles))
        np.testing.assert_allclose(frame, scipy, atol=1e-12)
        np.testing.assert_allclose(frame[:, 2], axis, atol=1e-7)


def test_far_from_zero_the_tip_keeps_its_digits_whatever_the_angles() -> None:
    cl = "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/800,700,100,0.6123,0.2345,{z}\nFEDRAT/MMPM,300\n"
    cl = cl.format(z=f"{np.sqrt(1 - 0.6123**2 - 0.2345**2):.7f}")
    cl += "GOTO/800,700,0\nGOTO/900,720,7\nGOTO/901,700,7\nFINI\n"
    for case in CASES[:4]:
        lines, _ = text_of(case, cl)
        assert problems(case, lines, cl) == []


def test_angles_too_coarse_for_the_tolerance_leave_a_run_under_tip_control() -> None:
    form = form_of(Case("fanuc", "g1"), digits="IS-B")
    program, stream = read(CL.encode(), name="part.cls"), io.BytesIO()
    settings = fit_settings(Settings(tolerance=0.004, axis_length=300.0), form, "mm")
    written = write(smooth(program, settings), stream, form=form)
    said = {finding.code: finding for finding in written.findings}
    assert said["CS357"].count == 2
    assert "3 decimals" in said["CS357"].text
    assert b"G68.2" not in stream.getvalue()


@pytest.mark.parametrize("control", ["generic", "linuxcnc"])
def test_controls_without_planes_say_so(control: str) -> None:
    machine = load_machine("xyzac-trt")
    with pytest.raises(SettingsError, match="no tilted planes") as refused:
        choose_form(control, "g1", machine=machine, planes=True)
    assert refused.value.code == "CS232"


def test_forms_and_machines_without_planes_say_so() -> None:
    with pytest.raises(SettingsError, match="use -f g1"):
        choose_form("siemens", "bspline", planes=True)
    with pytest.raises(SettingsError, match="has a head"):
        choose_form("haas", "g1", machine=load_machine("nutated-bc"), planes=True)


@pytest.mark.parametrize(
    "cut",
    [
        "GOTO/0,0,80,0,0,1\nGOTO/0,0,40,0.6,0,0.8\nGOTO/9,0,0\n",  # turned to its axis at feed
        "GOTO/0,0,40,0.6,0,0.8\nGOTO/9,0,0\nGOTO/19,0,0,0,0,1\n",  # turned away at feed
        "GOTO/0,0,40,0.6,0,0.8\nGOTO/9,0,0,0.6,0.0001,0.8\n",  # a little
        "GOTO/0,0,40\nGOTO/9,0,0\n",  # upright
        "GOTO/0,0,40\nLOADTL/2\nGOTO/9,0,0,0.6,0,0.8\nGOTO/19,0,0\n",  # another tool, turned to its axis at feed
        "GOTO/0,0,40,0.6,0,0.8\nRAPID\nGOTO/9,0,0\n",  # nothing is cut
    ],
)
def test_what_is_no_run_between_rapids_is_written_as_ever(cut: str) -> None:
    cl = f"UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nFEDRAT/MMPM,300\nRAPID\n{cut}RAPID\nGOTO/0,0,99\nFINI\n"
    for case in (*CASES[:3], CASES[4]):
        lines, said = text_of(case, cl)
        assert "CS356" not in said
        plain, stream = replace(form_of(case), plane=None), io.BytesIO()
        program = read(cl.encode(), name="part.cls")
        settings = fit_settings(Settings(tolerance=EPS, axis_length=H), form_of(case), "mm")
        write(
            smooth(program, settings),
            stream,
            form=plain,
            frame=Frame(cycles="native", skip_cycles=False, comments=False),
        )
        lines = [line for line in lines if line not in form_of(case).table.forms["g1"].plane.reset]
        assert lines == stream.getvalue().decode("ascii").splitlines()


ARC = """UNITS/MM
LOADTL/1
SPINDL/900,RPM,CLW
FEDRAT/MMPM,300
RAPID
GOTO/{start},0.6,0,0.8
GOTO/{first}
CIRCLE/{centre},0.6,0,0.8,10
GOTO/{last}
RAPID
GOTO/{start}
FINI
"""


def test_arcs_are_circles_in_the_plane() -> None:
    frame = np.array([[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]])  # rows X', Y', Z'
    places = {
        "centre": np.array([50.0, 10, 5]) @ frame,
        "first": np.array([60.0, 10, 5]) @ frame,
        "last": np.array([50.0, 20, 5]) @ frame,
        "start": np.array([60.0, 10, 50]) @ frame,
    }
    cl = ARC.format(**{name: ",".join(f"{value:.7f}" for value in place) for name, place in places.items()})
    for case in CASES[:4]:
        lines, said = text_of(case, cl)
        circles = [line for line in lines if re.match(r"G[23] |\d+ CR ", line)]
        assert said["CS313"] == 1
        assert len(circles) == 1
        if case.control == "heidenhain":
            assert re.match(r"\d+ CR X\S+ Y\S+ R\+10\.0+ DR\+$", circles[0])
        else:
            assert re.match(r"G3 X\S+ Y\S+ Z(-?5\.0+|-?\S+) (R|CR=)10\.0+( F300\.)?$", circles[0])
        assert problems(case, lines, cl) == []


def arcs(back: float, height: float = 0.0) -> str:
    """A semicircle and one the other way round in a tilted plane, `back` times as far round, the latter a helix."""
    frame = np.array([[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]])

    def said(*place: float) -> str:
        return ",".join(f"{value:.7f}" for value in np.array(place) @ frame)

    angle = np.pi * (1.0 - back)
    last = said(10 * np.cos(angle), 40 + 10 * np.sin(angle), height)
    return (
        "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nFEDRAT/MMPM,300\nRAPID\n"
        f"GOTO/{said(10, 0, 50)},0.6,0,0.8\nGOTO/{said(10, 0, 0)}\nCIRCLE/{said(0, 0, 0)},0.6,0,0.8,10\n"
        f"GOTO/{said(-10, 0, 0)}\nGOTO/{said(-10, 40, 0)}\nCIRCLE/{said(0, 40, 0)},-0.6,0,-0.8,10\n"
        f"GOTO/{last}\nRAPID\nGOTO/{said(0, 0, 60)}\nFINI\n"
    )


def test_klartext_arcs_go_round_as_they_should() -> None:
    """CR, at most 120 degrees each; a helix has no words there."""
    case = CASES[2]
    for cl, blocks in (
        (arcs(1.0), {"DR+": 2, "DR-": 2}),
        (arcs(0.5), {"DR+": 2, "DR-": 1}),
        (arcs(1.0, 2.0), {"DR+": 2}),
    ):
        lines, _ = text_of(case, cl)
        found = [line for line in lines if " CR " in line]
        assert {turn: sum(line.count(turn) for line in found) for turn in blocks} == blocks
        assert len(found) == sum(blocks.values())
        assert problems(case, lines, cl) == []


@pytest.mark.parametrize(
    ("old", "new"),
    share(
        [
            (r"DR\+", "DR-"),
            (r"DR-", "DR+"),
            (r"R\+10\.0000", "R+10.5000"),
            (r"R\+10\.0000", "R-10.0000"),
            (r" R\+10\.0000", ""),
            (r" DR[-+]", ""),
            (r"(CR X\S+ Y\S+)", r"\1 Z+1.0000"),
            (r"CR X(\S+)", r"CR X\g<1>1"),
            ("CR ", "C "),
            ("CR ", "L "),
        ],
        2,
    ),
)
def test_mutants_of_klartext_arcs_are_found(old: str, new: str) -> None:
    cl = arcs(1.0)
    lines, _ = text_of(CASES[2], cl)
    for k, line in enumerate(lines):
        if " CR " in line and (wrong := re.sub(old, new, line)) != line:
            if wrong.endswith("01 DR+") or "X" in old:
                wrong = re.sub(r"X([-+]\d+)\.(\d)", lambda found: f"X{int(found[1]) + 1}.{found[2]}", line)
            assert problems(CASES[2], [*lines[:k], wrong, *lines[k + 1 :]], cl), wrong


TOP = """UNITS/MM
LOADTL/1
SPINDL/500,RPM,CLW
RAPID
GOTO/0,0,80,0,0,1
CYCLE/DRILL,FEDTO,12,MMPM,150,RAPTO,3,RTRCTO,20
GOTO/5,5,0
GOTO/14,13,0
CYCLE/OFF
RAPID
GOTO/30,20,80
RAPID
GOTO/50,10,60,0.48,0.36,0.8
FEDRAT/MMPM,300
GOTO/20,-12.5,10
GOTO/26,-20.5,10
RAPID
GOTO/50,10,60
RAPID
GOTO/30,20,80,0,0,1
CYCLE/TAP,FEDTO,12,MMPM,500,RAPTO,3,RTRCTO,20
GOTO/7,5,0
CYCLE/OFF
RAPID
GOTO/30,20,80
RAPID
GOTO/10,20,70,0.1,0,0.9949874
GOTO/10,22,70,0.2,0,0.9797959
RAPID
GOTO/10,22,90
FINI
"""


@pytest.mark.parametrize("case", CASES, ids=str)
def test_holes_along_z_of_a_tool_that_tilts_are_cycles_in_a_plane_that_does_not(case: Case) -> None:
    lines, said = text_of(case, TOP)
    on, _, _ = words_of(case)
    planes = [match.groups() for line in lines if (match := re.fullmatch(on, line))]
    level = [words for words in planes if all(float(word) == 0.0 for word in words)]
    assert said["CS356"] == 3
    assert len(level) >= 2
    assert said["CS347"] == 3
    assert said["CS348"] == 1
    assert problems(case, lines, TOP) == []


@pytest.mark.parametrize("case", [*CASES[:4]], ids=str)
def test_a_tool_along_z_needs_no_plane_where_no_hole_is_a_cycle(case: Case) -> None:
    cl = TOP.replace("CYCLE/TAP", "CYCLE/DRILL")
    assert text_of(case, cl, cycles="moves")[1]["CS356"] == 1


@pytest.mark.parametrize("case", CASES[:3], ids=str)
def test_mutants_of_planes_that_do_not_tilt_are_found(case: Case) -> None:
    lines, _ = text_of(case, TOP)
    on, off, _ = words_of(case)
    off_first = next(k for k, line in enumerate(lines) if re.fullmatch(_RETRACT, line) and k > 12)
    wrong = []
    for k in range(off_first, len(lines)):  # before the first tilted plane one that does not tilt changes nothing
        if re.fullmatch(rf"{_ABOUT}|{_RETRACT}", lines[k]) and not re.fullmatch(off, lines[k]):
            end = k + 1 + lines[k].startswith("G91 G28")
            if not re.match(r"M30|\d+ M30|G49$|M5|\d+ M5|TRAFOOF", lines[end]) or re.fullmatch(_ABOUT, lines[k]):
                wrong.append((f"{k} {lines[k]}", [*lines[:k], *lines[k + 1 :]]))
        if re.fullmatch(on, lines[k]) and (case.control != "haas" or lines[k + 1] == "G254"):
            word = list(re.finditer(r"[-+]?\d+\.\d+", lines[k]))[-2]
            sign = "+" if case.control == "heidenhain" else ""
            turned = f"{lines[k][: word.start()]}{sign}1.0000{lines[k][word.end() :]}"
            wrong.append((turned, [*lines[:k], turned, *lines[k + 1 :]]))
    assert len(wrong) >= 4
    assert [kind for kind, text in wrong if not problems(case, text, TOP)] == []


TAP = """UNITS/MM
LOADTL/3
SPINDL/500,RPM,CLW
RAPID
GOTO/50,0,60,0.6,0,0.8
CYCLE/TAP,FEDTO,15,MMPM,500,RAPTO,5
GOTO/20,5,1
CYCLE/OFF
SPINDL/700,RPM,CLW
CYCLE/TAP,FEDTO,15,MMPM,700,RAPTO,5
GOTO/21,7,1
CYCLE/OFF
RAPID
GOTO/50,0,60
FINI
"""


def test_taps_are_cut_in_planes() -> None:
    for case in CASES[:5]:
        lines, said = text_of(case, TAP)
        assert said["CS348"] == 2
        assert problems(case, lines, TAP) == []
    form, program = choose_form("fanuc", "g1"), read(TAP.encode(), name="part.cls")
    smoothed = smooth(program, fit_settings(Settings(), form, "mm"))
    with pytest.raises(InputError, match="along Z"):
        write(smoothed, io.BytesIO(), form=form, frame=Frame(skip_cycles=False))


def test_clamped_axes_turn_to_a_plane_and_stand_in_it() -> None:
    machine = load_machine("table-ac")
    first, second = machine.axes
    machine = replace(machine, axes=(replace(first, clamp=("M10", "M11")), replace(second, clamp=("M12", "M13"))))
    form = choose_form("fanuc", "g1", machine=machine, planes=True)
    program, stream = read(CL.encode(), name="part.cls"), io.BytesIO()
    write(smooth(program, fit_settings(Settings(tolerance=EPS), form, "mm")), stream, form=form)
    text = stream.getvalue().decode("ascii")
    lines = text.splitlines()
    at = lines.index("G53.1")
    assert {"M11", "M13"} <= set(lines[:at])
    assert {"M10", "M12"} <= set(lines[at : at + 5])

    def judged(text: str) -> list[str]:
        found = verify(program, text.encode(), tolerance=EPS, control="fanuc", machine=machine)
        return [problem.code for problem in found.problems]

    assert judged(text) == []
    last = max(k for k, line in enumerate(lines) if line == "G53.1")
    free = max(k for k, line in enumerate(lines[:last]) if line == "M11")
    assert "CS538" in judged("\n".join([*lines[:free], *lines[free + 1 :]]) + "\n")


def test_vectors_behind_a_plane_are_warned_of_where_the_table_must_be_at_zero() -> None:
    assert "CS358" in text_of(CASES[0])[1]
    assert all("CS358" not in text_of(case)[1] for case in CASES[1:])


#: what each control's words of planes are turned into, besides what is dropped, doubled or moved
CHANGED: dict[str, list[tuple[str, str]]] = {
    "iso": [
        (r"^(G68\.2 .*)I(\S+) J(\S+)", r"\1I\3 J\2"),
        (r"^(G68\.2 .*)J(\S+) K(\S+)", r"\1J\3 K\2"),
        (r"^G68\.2 X0\.", "G68.2 X5."),
        (r"^G68\.2", "G68.3"),
        (r"^G68\.2 (.*) K0\.0+$", r"G68.2 \1"),
        (r"^G53\.1$", "G53.6"),
        (r"^G53\.1$", "G53.1 G0 X5. Y5."),
        (r"^G69$", "G68"),
    ],
    "haas": [
        (r"^G254$", "G255"),
        (r"^G255$", "G254"),
        (r"^G254$", "G0 B1.0 C1.0\nG254"),
        (r"^G254$", "G254 X0. Y0."),
    ],
    "siemens": [
        (",57,", ",39,"),
        (",57,", ",27,"),
        (",57,", ",121,"),
        (r"57,0,0,0,([-.\d]+),([-.\d]+),", r"57,0,0,0,\2,\1,"),
        (r"57,0,0,0,([-.\d]+),([-.\d]+),([-.\d]+),", r"57,0,0,0,\1,\3,\2,"),
        ("57,0,0,0,", "57,5,0,0,"),
        (",0,0,0,-1", ",0,0,9,-1"),
        (",-1\\)", ",0)"),
        (r"CYCLE800\(0,", "CYCLE800(3,"),
        (r",0,57", ",1,57"),
        (r",0,57", ",10,57"),
        (r"^CYCLE800\(\)$", 'CYCLE800(0,"0")'),
    ],
    "heidenhain": [
        (r"SPA(\S+) SPB(\S+)", r"SPA\2 SPB\1"),
        (r"SPB(\S+) SPC(\S+)", r"SPB\2 SPC\1"),
        ("TURN FMAX", "STAY"),
        ("TURN FMAX", "TURN F500"),
        (r" SPA\S+", ""),
        ("PLANE SPATIAL", "PLANE EULER"),
        ("PLANE RESET STAY", "PLANE RESET TURN"),
    ],
}
#: blocks of planes, and those about them that must be where they are
_ON = r"G68\.2 .*|G254|CYCLE800\(0.*|\d+ PLANE SPATIAL .*"
_ABOUT = rf"{_ON}|G53\.1|G69|G255|CYCLE800\(\)|\d+ PLANE RESET STAY"
_RETRACT = r"G91 G28 Z0\.|G53 G0 Z0\.|SUPA G0 Z0 D0|\d+ L Z-1 R0 FMAX M91"
#: motion under tool tip control, and other words that want another state
_INSERTED = {
    "siemens": ["TRAORI", "G0 X1. Y2. Z90. A3=0 B3=0 C3=1"],
    "heidenhain": ["FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR", "LN X+1. Y+2. Z+90. TX+0 TY+0 TZ+1 FMAX"],
    "haas": ["G234 H1", "G49", "G0 B0. C0."],
    "iso": ["G43.4 H1", "G49", "G0 X1. Y2. Z90. I0. J0. K1."],
}


def mutants(case: Case) -> Iterator[tuple[str, list[str]]]:
    """Texts with one wrong word of a plane or about one."""
    lines, _ = text_of(case)
    family = case.control if case.control in CHANGED else "iso"
    begun = next(k for k, line in enumerate(lines) if re.fullmatch(_ON, line))
    for k, line in enumerate(lines):
        if k < begun - 2:
            continue
        before, behind = lines[:k], lines[k + 1 :]
        retract = 1 + (line.startswith("G91 G28"))
        if re.fullmatch(_RETRACT, line) and not re.match(r"M30|\d+ M30|G49$|M5", lines[k + retract]):
            yield f"no retract: {k}", before + behind
        if not re.fullmatch(_ABOUT, line):
            continue
        yield f"dropped: {line}", before + behind
        number = re.match(r"(\d+ )?", line)
        assert number is not None
        if re.fullmatch(_ON, line):
            yield f"doubled: {line}", [*before, line, line, *behind]
            for word in re.finditer(r"(?<=[IJABC,])[-+]?\d+\.\d+", line):
                for change in (0.01, 90.0):
                    text = f"{float(word[0]) + change:{'+' if case.control == 'heidenhain' else ''}.4f}"
                    yield (
                        f"{change} on {word[0]}: {line}",
                        [*before, line[: word.start()] + text + line[word.end() :], *behind],
                    )
            for word_ in _INSERTED[family]:
                yield f"{word_} in {line}", [*lines[: k + 4], number[0] + word_, *lines[k + 4 :]]
            last = max(at for at in range(k) if re.fullmatch(_RETRACT, lines[at]))
            yield f"before the retract: {line}", [*lines[:last], line, *lines[last:k], *behind]
        for old, new in CHANGED[family]:
            if re.search(old, line):
                changed = re.sub(old, new, line).split("\n")
                if [line] != changed:
                    yield f"{old} to {new}: {line}", [*before, *changed, *behind]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_mutants_of_planes_are_found(case: Case) -> None:
    every = list(mutants(case))
    assert len(every) > 20
    chosen = share(every, 12, CASES.index(case))
    assert [kind for kind, lines in chosen if not problems(case, lines)] == []


def _planes_of(lines: list[str], old: str, new: Callable[[np.ndarray, np.ndarray], str], case: Case) -> list[str]:
    """The text with another zero of each plane: what `new` says for its frame and zero, and positions from there."""
    on, off, frame = words_of(case)
    zero, turned, found = np.array([5.0, -7.0, 11.0]), None, []
    for line in lines:
        if match := re.fullmatch(on, line):
            turned = frame(*map(float, match.groups()))
            line = re.sub(old, new(turned.as_matrix(), zero), line)
        elif re.fullmatch(off, line):
            turned = None
        elif turned is not None and (move := re.search(r"G[01] X(\S+) Y(\S+)( Z(\S+))?", line)):
            x, y, z = np.array([move[1], move[2], move[4] or 0], float) - turned.inv().apply(zero)
            line = line.replace(move[0], f"{move[0][:2]} X{x:.9f} Y{y:.9f}" + (f" Z{z:.9f}" if move[4] else ""))
        found.append(line)
    return found


@pytest.mark.parametrize(
    ("case", "old", "new"),
    [
        (CASES[0], r"X0\. Y0\. Z0\.", lambda frame, zero: "X{} Y{} Z{}".format(*zero)),
        (CASES[1], "57,0,0,0", lambda frame, zero: "57,{},{},{}".format(*zero)),
        (CASES[1], "0,0,0,-1", lambda frame, zero: "{:.12f},{:.12f},{:.12f},-1".format(*(zero @ frame))),
        (CASES[1], r'0,"",0', lambda frame, zero: '1,"TC_1",100000'),
    ],
    ids=["G68.2", "before the turns", "behind the turns", "names and display"],
)
def test_planes_of_other_posts_are_read(case: Case, old: str, new: Callable[[np.ndarray, np.ndarray], str]) -> None:
    lines, _ = text_of(case, cycles="moves")
    other = lines
    if "TC" in new(np.eye(3), np.zeros(3)):
        other = [line.replace('0,"",0', new(np.eye(3), np.zeros(3))) for line in lines]
    else:
        other = _planes_of(lines, old, new, case)
    assert other != lines
    one, two = (read_nc("\n".join(each).encode(), control=case.control) for each in (lines, other))
    np.testing.assert_allclose(one.tip, two.tip, atol=1e-6)
    np.testing.assert_allclose(one.second, two.second, atol=1e-12)
    assert two.problems == ()
    if not re.search("TC_1", "".join(other)):  # which data record, and what the display shows, is the user's own affair
        assert any("CS571" in text for text in problems(case, other))


def test_a_table_of_your_own_may_name_the_data_record() -> None:
    own = """like = "siemens"
name = "mine"
[forms.g1.plane]
on = ['CYCLE800(1,"TC1",100000,57,0,0,0,{first},{second},{third},0,0,0,1)']
"""
    form, stream = choose_form(parse_control(own), "g1", planes=True), io.BytesIO()
    result = postprocess(CL.encode(), stream, Settings(tolerance=EPS), form=form, processes=1)
    assert b'CYCLE800(1,"TC1",100000,57,' in stream.getvalue()
    assert result.verification is not None
    assert result.verification.problems == ()
    assert result.unverified == ""


def _beside(axis: int) -> tuple[str, NDArray[np.float64]]:
    """A cut in one tilted plane, and where the linear axes stand at its poses for both pairs of angles, (2, n)."""
    cl = "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nFEDRAT/MMPM,300\nRAPID\nGOTO/50,10,60,0.48,0.36,0.8\n"
    cl += "GOTO/20,-12.5,10\nGOTO/26,-20.5,10\nRAPID\nGOTO/50,10,60\nFINI\n"
    machine, program = load_machine("table-ac"), read(cl.encode())
    both = solutions(machine, program.axis[:1]).angles[0]
    places = [nose_position(machine, program.tip, np.tile(one, (len(program), 1)))[:, axis] for one in both]
    return cl, np.array(places)


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
@pytest.mark.parametrize(("which", "code"), [((), ""), ((0,), "CS379"), ((1,), "CS379"), ((0, 1), "CS374")])
def test_one_of_the_positions_of_the_rotary_axes_keeps_the_travel(
    control: str, which: tuple[int, ...], code: str
) -> None:
    cl, places = _beside(1)
    apart = places.max(axis=1) < places.min(axis=1)[::-1]
    assert apart.any()  # the two are on either side of a gap
    lower = int(np.argmax(apart))
    low, high = places.min() - 1.0, places.max() + 1.0
    gap = (places[lower].max() + places[1 - lower].min()) / 2.0
    ends = {(): (low, high), (lower,): (gap, high), (1 - lower,): (low, gap), (0, 1): (gap - 0.01, gap)}[which]
    machine = replace(load_machine("table-ac"), travel=(Travel("Y", *ends),))
    order = ["AC".index(name) for name in machine.names]
    form = choose_form(control, machine=machine, planes=True)
    program, stream = read(cl.encode()), io.BytesIO()
    smoothed = smooth(program, fit_settings(Settings(tolerance=EPS), form, "mm"))
    if code == "CS374":
        with pytest.raises(InputError, match="Y of table-ac would have to go to") as refused:
            write(smoothed, stream, form=form)
        assert refused.value.code == code
        return
    said = {one.code: one.text for one in write(smoothed, stream, form=form).findings}
    assert ("CS379" in said) == (code == "CS379")
    if code:
        told = re.search(r"A(\S+) C(\S+)|C(\S+) A(\S+)", said[code])
        assert told is not None
        angles = [float(told[1] or told[4]), float(told[2] or told[3])]
        there = nose_position(machine, program.tip, np.tile([angles[k] for k in order], (len(program), 1)))[:, 1]
        assert (ends[0] <= there).all()
        assert (there <= ends[1]).all()


def test_haas_turns_its_axes_itself_and_their_travel_is_known() -> None:
    cl, _ = _beside(1)
    form = choose_form("haas", machine=load_machine("table-bc"), planes=True)
    program = read(cl.encode())
    place = nose_position(form.machine, program.tip, np.tile([36.8699, 36.8699], (len(program), 1)))
    assert np.isfinite(place).all()
    for high, good in ((400.0, True), (-400.0, False)):
        machine = replace(form.machine, travel=(Travel("Z", -500.0, high),))
        chosen = choose_form("haas", machine=machine, planes=True)
        smoothed = smooth(program, fit_settings(Settings(tolerance=EPS), chosen, "mm"))
        if good:
            assert "CS379" not in {one.code for one in write(smoothed, io.BytesIO(), form=chosen).findings}
        else:
            with pytest.raises(InputError, match="Z of table-bc"):
                write(smoothed, io.BytesIO(), form=chosen)
