"""As few lines and arcs as ε allows: what becomes of programs in many short lines, by readers that share no code."""

from __future__ import annotations

import re
import shutil
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import cornersmooth as cs
from cornersmooth.control.source import CHUNK
from cornersmooth.errors import Verdict
from cornersmooth.filter import Filtered, filter_program, verify_programs
from cornersmooth.filter.program import THREE_AXES
from cornersmooth.filter.runs import ProgramReader
from cornersmooth.nc import parse_control
from filter.fine_programs import HEAD, NAMES, made, program, relief
from filter.foreign import by_rs274, by_words, difference
from oracle.command import DONE, run
from oracle.share import covering_share

EPS = 0.01

#: blocks by a greedy count of lines and plain arcs, each with both ends at vertices, within 0.0095 mm
COUNTS = {
    "relief": 52,
    "coarse relief": 76,
    "mould": 30,
    "mould, turned": 63,
    "mould, coarse": 54,
    "carving": 144,
    "fine": 19,
}


@cache
def few(text: str | bytes, control: str = "fanuc", **options: object) -> Filtered:
    """What the filter makes of a program in its default way."""
    form = cs.choose_form(control, "g1", machine=THREE_AXES)
    data = text.encode() if isinstance(text, str) else text
    return filter_program(data, form, cs.Settings(tolerance=EPS), **options)  # type: ignore[arg-type]


def blocks(text: str | bytes) -> int:
    """Cutting blocks of a program."""
    data = text.decode() if isinstance(text, bytes) else text
    return len(re.findall(r"(?m)^(?:G1[789] )?(?:G[123] )?[XYZ].*$", data))


#: all arcs of the turned mould are steep
FEW = list(product([name for name in NAMES if name != "mould, turned"], ["fanuc", "haas", "mitsubishi"]))


@pytest.mark.parametrize(("name", "control"), covering_share(FEW, 4))
def test_few_blocks_say_the_same_motion(name: str, control: str) -> None:
    text = made(name)
    found = few(text, control)
    assert found.verdict is Verdict.PASSED
    assert difference(by_words(text.encode()), by_words(found.data), EPS) == ""
    assert blocks(found.data) < blocks(text)
    assert b"R" in found.data


@pytest.mark.parametrize("name", NAMES)
def test_blocks_are_near_a_greedy_count(name: str) -> None:
    """Where F counts along a helix; where it does not, helices are flat."""
    assert blocks(few(made(name), "linuxcnc").data) <= 1.3 * COUNTS[name]


def steepest(text: bytes) -> float:
    """Largest way of the tool on an arc for each mm of it in its plane: what F is multiplied by, if it counts there."""
    place, plane, largest = np.zeros(3), "G17", 0.0
    for line in text.decode().splitlines():
        plane = next((word for word in ("G17", "G18", "G19") if word in line), plane)
        words = dict(re.findall(r"([XYZR])([-+]?[\d.]+)", line))
        end = np.array([float(words.get(letter, old)) for letter, old in zip("XYZ", place, strict=True)])
        if re.search(r"G[23] ", line):
            rise = {"G17": 2, "G18": 1, "G19": 0}[plane]
            chord, radius = np.linalg.norm(np.delete(end - place, rise)), float(words["R"])
            largest = max(largest, np.hypot(1.0, (end - place)[rise] / (2 * radius * np.arcsin(chord / 2 / radius))))
        place = end
    return largest


@pytest.mark.parametrize("name", ["mould, turned", "fine"])
def test_helices_are_flat_where_f_counts_in_their_plane(name: str) -> None:
    """FANUC: F along the arc, and the third axis is faster by as much as it rises (1403#5 HTG 0)."""
    text = made(name)
    assert steepest(few(text, "fanuc").data) < 1.021
    assert steepest(few(text, "linuxcnc").data) > 1.05


@pytest.mark.parametrize("mode", ["G93", "G95"])
def test_a_run_behind_another_kind_of_feed(mode: str) -> None:
    """The first cut behind G94 says the feed: none was known before it."""
    text = START.format("") + f"{mode}\nG1 X-1. F2.\nG94\nX0. F700.\n" + WAVE + "G0 Z50.\nM30\n"
    found = few(text)
    assert found.verdict is Verdict.PASSED, found.left
    assert found.smoothed > 70
    assert difference(by_words(text.encode()), by_words(found.data), EPS) == ""
    assert found.data.count(b"F700") == 1
    wrong = found.data.replace(b" F700.", b"").replace(b" F700", b"")
    form = cs.choose_form("fanuc", "g1", machine=THREE_AXES)
    assert verify_programs(text.encode(), wrong, form, cs.Settings(tolerance=EPS)).verdict is Verdict.FAILED


@pytest.mark.linuxcnc
@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC is not installed")
@pytest.mark.parametrize("name", NAMES)
def test_linuxcnc_takes_the_arcs(name: str, tmp_path: Path) -> None:
    text = made(name).replace("%\nO1\n", "").replace("%\n", "")
    found = few(text, "linuxcnc")
    assert found.verdict is Verdict.PASSED
    assert difference(by_rs274(text.encode(), tmp_path), by_rs274(found.data, tmp_path), EPS) == ""


def turns(rows: list[tuple[str, tuple[float, ...]]]) -> list[float]:
    """Degrees by which neighbouring cuts turn, of a program that another reader has read; arcs are many cuts."""
    place = np.array([numbers[:3] for kind, numbers in rows if kind == "feed"])
    way = np.diff(place, axis=0)
    way = way[np.linalg.norm(way, axis=1) > 1e-9]
    way /= np.linalg.norm(way, axis=1)[:, None]
    return np.degrees(np.arccos(np.clip((way[1:] * way[:-1]).sum(axis=1), -1.0, 1.0))).tolist()


def test_a_smooth_path_stays_smooth() -> None:
    """No corner of 2 degrees is made where the program has none; what is read as chords adds half of what they turn."""
    text = program([np.column_stack((t := np.arange(0.0, 9.0, 0.05), 3 * np.sin(0.3 * t), np.cos(0.4 * t)))])
    assert max(turns(by_words(text.encode()))[2:-2]) < 2.5
    assert max(turns(by_words(few(text).data))[2:-2]) < 2.3


@pytest.mark.parametrize("name", NAMES)
def test_what_is_filtered_again_stays(name: str) -> None:
    once = few(made(name))
    again = few(once.data)
    assert again.new_lines <= once.new_lines
    assert blocks(again.data) >= 0.97 * blocks(once.data)


def test_arcs_of_klartext_and_siemens() -> None:
    """XY alone: the length of the tool acts across the plane, and CR has two axes."""
    t = np.linspace(0.0, 3.0, 200)
    ring = [(9 * np.cos(a), 9 * np.sin(a)) for a in t]
    klartext = (
        "0 BEGIN PGM A MM\n1 TOOL CALL 3 Z S3000\n2 L X+9 Y+0 Z+5 R0 FMAX M3\n3 L Z-1 F300\n"
        + "".join(f"{k + 4} L X{x:+.3f} Y{y:+.3f}\n" for k, (x, y) in enumerate(ring))
        + "900 L Z+50 R0 FMAX\n901 M30\n902 END PGM A MM\n"
    )
    found = few(klartext, "heidenhain")
    assert re.findall(rb"(?m)^\d+ CR X\S+ Y\S+ R\+(9.00)\d DR\+", found.data) == [b"9.00"] * 2
    assert difference(by_words(klartext.encode()), by_words(found.data), EPS) == ""
    siemens = "G17 G90 G94 G710\nG54\nG0 X9 Y0 Z20 S900 M3\nG1 Z-1 F350\n{}G0 Z20\nM30\n"
    siemens = siemens.format("".join(f"X{x:.3f} Y{y:.3f}\n" for x, y in ring))
    found = few(siemens, "siemens")
    assert re.findall(rb"X\S+ Y\S+ CR=(9.00)", found.data) == [b"9.00"] * 2
    assert few(siemens.replace("G17", "G18"), "siemens").data.count(b"CR=") == 0


def test_plane_and_motion_are_put_back() -> None:
    x = np.arange(0.0, 8.0, 0.1)
    run = "".join(f"X{a:.3f} Z{np.sin(a):.3f}\n" for a in x)
    for behind, restored in (("G0 Z20.\n", ["G17"]), ("X30.\nG0 Z20.\n", ["G17 G1"]), ("M8\nX30.\n", ["G17 G1"])):
        text = HEAD + "G1 Z0. F300.\n" + run + behind.replace("X30.\n", "(A)\nX30.\n") + "G0 Z20.\nM30\n%\n"
        found = few(text)
        assert found.verdict is Verdict.PASSED
        lines = found.data.decode().splitlines()
        assert [line for line in lines if re.fullmatch("G17( G1)?", line)] == restored
        assert difference(by_words(text.encode()), by_words(found.data), EPS) == ""
    text = HEAD + "G18\nG1 Z0. F300.\n" + run + "G0 Z20.\nM30\n%\n"
    assert re.findall(rb"G1[789]", few(text).data) == [b"G17", b"G18"]


def test_arcs_that_are_off_are_found() -> None:
    text = made("fine").encode()
    new = few(text, "linuxcnc").data
    form = cs.choose_form("linuxcnc", "g1", machine=THREE_AXES)
    assert verify_programs(text, new, form, cs.Settings(tolerance=EPS)).verdict is Verdict.PASSED
    for old, other in ((rb"R(\d+)\.", b"R1\\1."), (rb"G2 ", b"G3 "), (rb"G18 G", b"G17 G")):
        wrong = re.sub(old, other, new, count=1)
        if wrong != new:
            found = verify_programs(text, wrong, form, cs.Settings(tolerance=EPS))
            assert found.verdict is Verdict.FAILED


def test_each_cut_keeps_its_feed() -> None:
    x = np.arange(0.0, 8.0, 0.1)
    run = "".join(f"X{a:.3f} Z{np.sin(a):.3f} F{300 if a < 4 else 500}.\n" for a in x)
    text = HEAD + "G1 Z0. F300.\n" + run + "G0 Z20.\nM30\n%\n"
    lines = few(text).data.decode().splitlines()
    k = next(k for k, line in enumerate(lines) if "F500" in line)
    assert "X4.000 " not in lines[k]  # the cut to 4.0 is the first at 500
    assert "X3.900 " in lines[k - 1]


def test_the_fastest_is_taken_where_times_are_known() -> None:
    machine = cs.load_machine(Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml")
    text = made("relief").replace("%\nO1\n", "").replace("%\n", "").replace("F300", "F3000")
    # exact stop at each vertex; blending, which is fast already: on the whole controller 67 lines with arcs took 1.79 s
    # within 4 m/s² where the 488 of the program took 1.67 s, and 403 without arcs 1.66 s
    for before, share, lines in (("G61\n", 0.6, 0.5), ("", 1.001, 0.9)):
        found = few(before + text, "linuxcnc", axes=machine)
        assert found.seconds is not None
        assert found.seconds[1] < share * found.seconds[0]
        assert found.new_lines < lines * found.lines
    zigzag = "".join(f"X{2 * k} Y{k % 2}\n" for k in range(1, 9))
    text = "G21 G90 G94 G17\nG61\nG0 X0 Y0 Z5\nG1 Z0 F300\n" + zigzag + "G0 Z5\nM2\n"
    found = few(text, "linuxcnc", axes=machine)
    assert found.seconds is None or found.seconds[1] < found.seconds[0]


WAVE = "".join(f"X{a:.3f} Y{np.sin(a):.3f}\n" for a in np.arange(0.1, 8.0, 0.1))
KLARTEXT = "".join(f"L {line.replace('X', 'X+').replace('Y', 'Y+').replace('+-', '-')}\n" for line in WAVE.splitlines())
START = "G21 G90 G94 G17 G40 G49 G80\nG54 G0 X0. Y0.\n{}\nG0 X0. Y0. Z5.\nG1 Z0. F300.\n"


@pytest.mark.parametrize(
    ("control", "words", "smoothed"),
    [
        ("fanuc", "A90.", True),
        ("haas", "G0 A90. B10.", True),
        ("fanuc", "G68.2 X0. Y0. Z0. I0. J30. K0.\nG53.1", True),
        ("fanuc", "G68 X0. Y0. R30.", True),
        ("fanuc", "G51.1 X0.", True),
        ("fanuc", "G51 X0. Y0. Z0. P2.", False),
        ("fanuc", "G66 P9000", False),
        ("siemens", "TRANS X10\nAROT X30", True),
        ("siemens", 'CYCLE800(0,"",0,57,0,0,0,30,0,0,0,0,0,-1)', True),
        ("siemens", "SCALE X2\nAROT X30", False),
        ("siemens", "SCALE X2\nTRANS", True),
        ("heidenhain", "CYCL DEF 19.0 WORKING PLANE\nCYCL DEF 19.1 A+30 B+0 C+0", True),
        ("heidenhain", "PLANE SPATIAL SPA+30 SPB+0 SPC+0 TURN FMAX", True),
        ("heidenhain", "CYCL DEF 11.0 SCALING\nCYCL DEF 11.1 SCL0.9\nCYCL DEF 19.1 A+30 B+0 C+0", False),
    ],
)
def test_what_stands_still_under_a_run_is_no_hindrance(control: str, words: str, smoothed: bool) -> None:
    text = START.format(words) + WAVE + "G0 Z50.\nM30\n"
    if control == "siemens":
        text = text.replace("G21", "G710").replace(" G49 G80", "")
    if control == "heidenhain":
        text = f"BEGIN PGM A MM\nTOOL CALL 3 Z S3000\n{words}\nL X+0 Y+0 Z+5 R0 FMAX\nL Z+0 R0 F300\n"
        text += KLARTEXT + "L Z+50 R0 FMAX\nM30\nEND PGM A MM\n"
    found = few(text, control)
    assert (found.smoothed > 70) is smoothed, found.left
    if smoothed:
        assert found.verdict is Verdict.PASSED
        assert found.new_lines < 40
    else:
        assert "scaled or called by a macro" in found.left[0].reason


def test_cuts_in_which_an_axis_turns_ask_for_the_machine() -> None:
    text = START.format("A0.") + "".join(f"X{k}. A{k}.\n" for k in range(1, 9)) + WAVE + "G0 Z50.\nM30\n"
    found = few(text)
    assert found.left[0].reason == "an axis turns in it: name the machine"
    assert found.left[0].count == 8
    assert found.smoothed > 70


def test_an_axis_that_is_never_named_stands_still() -> None:
    text = START.replace("Y0.", "").format("G43 H1") + WAVE.replace("Y", "Z") + "G0 Z50.\nM30\n"
    found = few(text)
    assert found.verdict is Verdict.PASSED
    assert found.smoothed > 70
    assert b"Y" not in found.data
    assert b"G18 G" in found.data
    assert difference(by_words(text.encode()), by_words(found.data), EPS) == ""


def test_a_feed_in_a_line_of_its_own_is_no_end_of_a_run() -> None:
    lines = WAVE.splitlines(keepends=True)
    text = START.format("") + "".join(lines[:40]) + "F500.\n" + "".join(lines[40:]) + "F600.\nG0 Z50.\nM30\n"
    found = few(text)
    assert found.runs == 1
    assert found.verdict is Verdict.PASSED
    assert re.findall(rb"F\d+", found.data) == [b"F300", b"F500", b"F600"]
    assert difference(by_words(text.encode()), by_words(found.data), EPS) == ""


@pytest.mark.parametrize("control", ["grbl", "FluidNC", "mach3", "Mach4"])
def test_controls_of_three_axes_have_the_words_of_linuxcnc(control: str, tmp_path: Path) -> None:
    text = "; made elsewhere\nG21\nG90\nG0 X0 Y0\nZ5\nG1 Z-1 F300\n" + WAVE + "G0 Z5\nM2\n"
    (tmp_path / "part.nc").write_text(text)
    made = run("filter", "part.nc", "--control", control, "-o", "new.nc", cwd=tmp_path)
    assert made.returncode == DONE, made.stderr
    assert made.stderr.startswith(b"PASSED")
    assert (tmp_path / "new.nc").read_bytes().count(b"R") >= 4
    asked = run("filter", "part.nc", "-o", "other.nc", cwd=tmp_path)
    assert b"--control grbl, mach3" in asked.stderr


def test_distances_to_centres_are_nothing_to_arcs_with_a_radius() -> None:
    """`G91.1` is in the first block of many programs for Mach and LinuxCNC; `G90.1` changes what I and J are."""
    text = "G90 G94 {} G40 G49 G17\nG21\nG0 X0 Y0 Z5\nG1 Z-1 F300\n" + WAVE + "G0 Z5\nM2\n"
    assert few(text.format("G91.1"), "linuxcnc").smoothed > 70
    found = few(text.format("G90.1"), "linuxcnc")
    assert found.smoothed > 70
    assert not set(b"IJK") & set(found.data.replace(b"G40", b"").replace(b"G49", b""))
    assert b"R" in found.data


def test_the_first_block_of_a_run_says_that_it_cuts() -> None:
    """Behind a rapid, where the run before it stays and another begins in a cut; a program without it is found out."""
    zigzag = "G0 X0. Y0. Z5.\nG1 Z-1. F240.\nG4 P100\nX5. Y9.\nX9. Y0.\nX14. Y9.\n"
    text = START.format("") + zigzag + "G0 X0. Y0. Z5.\nG1 " + WAVE + "G0 Z50.\nM30\n"
    found = few(text)
    assert found.smoothed > 70
    assert difference(by_words(text.encode()), by_words(found.data), EPS) == ""
    first = found.data.index(b"X0. Y0. Z5.", found.data.index(b"X14.")) + len(b"X0. Y0. Z5.\n")
    wrong = found.data[:first] + re.sub(rb"^G[1-3] ", b"", found.data[first:])
    assert wrong != found.data
    form = cs.choose_form("fanuc", "g1", machine=THREE_AXES)
    assert verify_programs(text.encode(), wrong, form, cs.Settings(tolerance=EPS)).verdict is Verdict.FAILED


def test_a_run_goes_on_where_the_text_is_divided() -> None:
    text = relief(rows=400).encode()
    assert len(text) > CHUNK
    (run,) = ProgramReader("linuxcnc", THREE_AXES).read(text).runs
    assert len(run) == 400 * 120 - 1


def test_long_lines_without_tip_control_are_the_fewest_lines() -> None:
    form = cs.choose_form("fanuc", "g1", machine=THREE_AXES)
    found = cs.filter_program(made("relief").encode(), form, cs.Settings(tolerance=EPS, lines="long"))
    assert found.verdict is Verdict.PASSED
    assert found.new_lines < 0.9 * found.lines
    assert not re.search(rb"\n(G1[78] )?G0?[23] ", found.data)


@pytest.mark.parametrize(("own", "arcs"), [("", 0), ("[motion]\nfeed_in_plane = false\n", 2)])
def test_a_steep_helix_has_arcs_where_f_counts_along_it(own: str, arcs: int) -> None:
    """FANUC with HTG 1 says so by a table of its own, and verification takes its word."""
    turn = np.linspace(0.0, np.pi, 120)
    helix = np.stack((10.0 * np.cos(turn), 10.0 * np.sin(turn), -9.0 * turn), axis=1)
    form = cs.choose_form(parse_control(f'like = "fanuc"\n{own}'), "g1", machine=THREE_AXES)
    found = filter_program(program([helix]).encode(), form, cs.Settings(tolerance=0.005))
    assert found.verdict is Verdict.PASSED
    assert len(re.findall(rb"(?m)^G[23] ", found.data)) == arcs
