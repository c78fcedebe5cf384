"""LinuxCNC's interpreter as an independent reader: it takes our text, and finds the same positions and curves in it.

Debian: ``apt-get install --no-install-recommends linuxcnc-uspace``. Its Python modules belong to Debian's own Python.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cornersmooth.cl import read
from cornersmooth.geometry import nurbs
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from nc.cases import Case
from nc.grammars import reader
from nc.linuxcnc_controller import REMAPS, write_remaps
from nc.reading import Reading
from nc.rotations import tool_direction
from oracle.chains import cl_text, random_chains
from oracle.files import OWN, of_corpus
from oracle.interpreter import rows_of
from oracle.judge import judge
from oracle.motion import Path as Motion
from oracle.motion import unit
from oracle.share import covering_share, how_many, share

Floats = NDArray[np.float64]

SAMPLES = Path(__file__).parents[2] / "samples"

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("rs274") is None, reason="LinuxCNC is not installed: apt-get install linuxcnc-uspace"
    ),
]


def positions(text: str, folder: Path) -> list[tuple[str, Floats]]:
    """Kind and X Y Z A B C of every move, in full precision."""
    # without the running controller its modules have no tool table; `accepted` lets the tools be loaded
    alone = re.sub(r"^(T\d+ M6|G43 H\d+( (?=G))?|M42[89]$)", "", text, flags=re.MULTILINE)
    rows = rows_of(alone.encode(), folder)
    return [(row[0], np.array([float(number) for number in row[2:]])) for row in rows if row[0] in ("feed", "rapid")]


def accepted(text: str, folder: Path) -> None:
    """Assert that the interpreter runs the program to its end."""
    file, tools = folder / "program.ngc", folder / "tools.tbl"
    file.write_text(text)
    tools.write_text("".join(f"T{number} P{number} Z0 D0.001\n" for number in range(1, 60)))
    (folder / "remaps.ini").write_text("[RS274NGC]\n" + REMAPS.format(folder=folder))
    write_remaps(folder)
    for _ in range(3):  # where several run at once, one may be killed by a signal: that says nothing of the text
        result = subprocess.run(
            ["rs274", "-i", folder / "remaps.ini", "-t", tools, "-g", file],
            capture_output=True,
            text=True,
            check=False,
            timeout=120,
            cwd=folder,
        )
        if result.returncode >= 0:
            break
    assert result.returncode == 0, result.stderr
    assert "PROGRAM_END" in result.stdout


def written(
    cl: bytes,
    machine: str,
    *,
    tcp: bool = True,
    tolerance: float = 0.01,
    feed: float = 500.0,
    frame: Frame | None = None,
    endless: bool = False,
) -> str:
    program = read(cl, name="part.cls")
    program = replace(program, feed=np.where(np.isnan(program.feed), feed, program.feed))
    chosen = Case("linuxcnc", "g1", machine, tcp).choose(endless=endless)
    smoothed = smooth(program, fit_settings(Settings(tolerance=tolerance), chosen, program.units))
    stream = io.BytesIO()
    write(smoothed, stream, form=chosen, frame=frame or Frame(skip_cycles=True))
    return stream.getvalue().decode("ascii")


def flat(seed: int, count: int = 60) -> tuple[bytes, list]:  # type: ignore[type-arg]
    """Random chains that a trunnion of limited travel can reach."""
    chains = []
    for chain in random_chains(seed, count):
        x, y, z = chain.axis.T
        axis = np.round(unit(np.stack((0.25 * x, 0.25 * y, np.abs(z) + 0.2), axis=1)), 9)
        chains.append(type(chain)(chain.tip, axis, chain.feed))
    return cl_text(chains)[0], chains


def in_inches(cl: bytes) -> bytes:
    return cl.replace(b"UNITS/MM", b"UNITS/INCHES").replace(b"MMPM", b"IPM")


#: machine, tool tip control, units of the program
WAYS = [
    ("xyzac-trt", True, "mm"),
    ("xyzbc-trt", True, "mm"),
    ("xyzac-trt", False, "mm"),
    ("xyzbc-trt", False, "mm"),
    ("xyzac-trt", True, "inch"),
    ("xyzbc-trt", False, "inch"),
]


@pytest.mark.parametrize(("machine", "tcp", "units"), covering_share(WAYS, 5))
def test_positions_are_those_in_the_text(machine: str, tcp: bool, units: str, tmp_path: Path) -> None:
    cl = flat(1, how_many(12, 24))[0]
    text = written(cl if units == "mm" else in_inches(cl), machine, tcp=tcp)
    accepted(text, tmp_path)
    letters = "XYZAC" if "ac" in machine else "XYZBC"
    here, ours = dict.fromkeys(letters, 0.0), []
    for line in text.splitlines():
        if line.startswith(("G0 ", "G1 ", "G53 G0 ")):  # no offsets: positions of the machine are those of the part
            here |= {word: float(number) for word, number in re.findall(r"([A-CX-Z])(-?[\d.]+)", line)}
            ours.append((line.removeprefix("G53 ")[:2], list(here.values())))
    theirs = positions(text, tmp_path)
    assert len(ours) == len(theirs) > 200
    columns = ["XYZABC".index(letter) for letter in letters]
    scale = np.array([1.0 if units == "mm" else 25.4] * 3 + [1.0] * 2)
    assert [code == "G0" for code, _ in ours] == [kind == "rapid" for kind, _ in theirs]
    found = np.array([place for _, place in theirs])[:, columns]
    np.testing.assert_allclose(found, scale * [numbers for _, numbers in ours], rtol=1e-12, atol=1e-9)


@pytest.mark.parametrize(("machine", "tcp", "units"), covering_share(WAYS, 5, 1))
def test_tip_and_axis_by_its_own_formulas_keep_the_tolerance(
    machine: str, tcp: bool, units: str, tmp_path: Path
) -> None:
    """The published kinematics of trtfuncs.c over the positions that the interpreter produces."""
    cl, chains = flat(2, how_many(15, 60) if tcp else how_many(4, 12))
    if units == "inch":
        cl, chains = in_inches(cl), [replace(chain, tip=25.4 * chain.tip) for chain in chains]
    axis_length, tolerance = 10.0, 0.01
    control = reader("linuxcnc", "g1", machine, tcp)
    control.step, control.mode = 0.01, "G94"
    columns = [0, 1, 2, 3 if "ac" in machine else 4, 5]
    reading, before = Reading(control), None
    for number, (kind, place) in enumerate(positions(written(cl, machine, tcp=tcp, tolerance=tolerance), tmp_path)):
        here = place[columns]
        reading.pieces.append(control.piece(number, kind == "rapid", here if before is None else before, here))
        before = here
    runs: list[Motion] = reading.runs(axis_length)
    originals = [
        chain.original for chain in chains if np.ptp(chain.tip, axis=0).any() or np.ptp(chain.axis, axis=0).any()
    ]
    verdict = judge(runs, originals, axis_length, tolerance)
    assert verdict.deviation.worst <= tolerance, verdict


@pytest.mark.parametrize("tcp", [True, False])
def test_every_statement_and_feed_mode_is_accepted(tcp: bool, tmp_path: Path) -> None:
    cl = (
        b"UNITS/MM\nPARTNO ALL OF IT\nLOADTL/4\nSPINDL/5000,RPM,CLW\nCOOLNT/MIST\nCOOLNT/ON\nRAPID\n"
        b"GOTO/0,0,50,0,0,1\nFEDRAT/800,MMPM\nGOTO/0,0,0,0,0,1\nGOTO/20,0,0,0,0.1,1\nGOTO/20,0,0,0,0.3,1\n"
        b"GOTO/20,20,0,0.1,0.3,1\nDELAY/0.5\nSTOP\nOPSTOP\nFEDRAT/0.1,MMPR\nGOTO/0,20,0,0.1,0.3,1\nCOOLNT/OFF\n"
        b"RAPID\nGOTO/0,20,50,0,0,1\nCYCLE/DRILL,FEDTO,10,RAPTO,2,MMPM,100,DWELL,1\nGOTO/5,5,0\nCYCLE/OFF\nSPINDL/OFF\n"
        b"LOADTL/5\nSPINDL/5000,RPM,CCLW\nRAPID\nGOTO/0,0,50\nFINI\n"
    )
    cl = re.sub(rb"GOTO/(\d+,\d+,\d+),([\d.]+),([\d.]+),1\n", _normalised, cl)
    accepted(written(cl, "xyzac-trt", tcp=tcp), tmp_path)


def _normalised(match: re.Match[bytes]) -> bytes:
    axis = np.array([float(match[2]), float(match[3]), 1.0])
    return b"GOTO/%b,%b\n" % (match[1], ",".join(f"{n:.9f}" for n in axis / np.linalg.norm(axis)).encode())


#: poses beyond which a file takes too long here
MOST_POSES = 1000


ARRANGED = [("xyzac-trt", True), ("xyzbc-trt", True), ("xyzac-trt", False)]


@pytest.mark.parametrize(("machine", "tcp"), ARRANGED)
def test_own_files_are_accepted(machine: str, tcp: bool, tmp_path: Path) -> None:
    for path in share(sorted(OWN.iterdir()), 5, ARRANGED.index((machine, tcp))):
        accepted(written(path.read_bytes(), machine, tcp=tcp, tolerance=0.02, endless=True), tmp_path)


@pytest.mark.parametrize(("machine", "tcp"), of_corpus(share(ARRANGED, 3)))
def test_real_files_are_accepted(machine: str, tcp: bool, corpus: Path, tmp_path: Path) -> None:
    files = [path for path in sorted(corpus.iterdir()) if path.is_file() and path.suffix != ".md"]
    taken = 0
    for path in share(files, 4, ARRANGED.index((machine, tcp))):
        if len(read(path.read_bytes(), name=path.name)) > MOST_POSES:
            continue
        data = path.read_bytes().replace(
            b",SFM,", b",RPM,"
        )  # a lathe's; without a speed there is no feed per revolution
        accepted(written(data, machine, tcp=tcp, tolerance=0.02, endless=True), tmp_path)
        taken += 1
    assert taken >= how_many(5, 10)


@pytest.mark.parametrize("name", ["impeller.cls", "paper_table1.csv"])
def test_samples_are_accepted(name: str, tmp_path: Path) -> None:
    accepted(written((SAMPLES / name).read_bytes(), "xyzac-trt", endless=True), tmp_path)


SHORT = b"UNITS/MM\nLOADTL/4\nFEDRAT/800,MMPM\nGOTO/0,0,0,0,0,1\nGOTO/20,0,0\nGOTO/20,20,0\n"


def test_comments_do_nothing(tmp_path: Path) -> None:
    """(LOGOPEN, file) would write a file, (ABORT, text) stop the program."""
    orders = b"".join(b"PPRINT %b,%b\n" % (word, b"made.txt") for word in (b"LOGOPEN", b"log", b"Abort", b"PROBEOPEN"))
    text = written(SHORT + orders + b"GOTO/0,20,0\nFINI\n", "xyzac-trt")
    assert "(- LOGOPEN,made.txt)" in text
    accepted(text, tmp_path)
    with pytest.raises(AssertionError, match="Abort"):  # so that it is known what is kept away
        accepted(text.replace("(- ", "("), tmp_path)


def test_numbers_of_blocks_and_long_lines_are_accepted(tmp_path: Path) -> None:
    poses = b"".join(b"GOTO/%d,%d,0\n" % (number, number % 2) for number in range(10000))
    header = ("(" + 246 * "x" + ")",)
    text = written(SHORT + poses + b"FINI\n", "xyzac-trt", frame=Frame(block_numbers=True, header=header))
    assert "N99990 " in text
    assert max(map(len, text.splitlines())) == 252
    accepted(text, tmp_path)
    with pytest.raises(AssertionError, match="Command too long"):
        accepted(text.replace("(xxx", "(xxxx"), tmp_path)


def test_a_spindle_that_is_oriented_is_accepted(tmp_path: Path) -> None:
    text = written(SHORT + b"SPINDL/2546.479,RPM,CLW\nSPINDL/LOCK\nGOTO/0,20,0\nFINI\n", "xyzac-trt")
    assert "S2546.479 M3" in text
    assert "M19 R0" in text
    accepted(text, tmp_path)


def test_an_error_is_seen(tmp_path: Path) -> None:
    """Whatever the interpreter does not know must not pass for accepted."""
    with pytest.raises(AssertionError, match="Unknown g code"):
        accepted("G21\nG43.5 H1\nM2\n", tmp_path)


def test_its_splines_are_our_curves(tmp_path: Path) -> None:
    """G5.2 with L4 has our knots, and runs in the plane: each projection of both curves is a program of its own."""
    rng = np.random.default_rng(5)
    cl, _ = flat(7, 12)
    smoothed = smooth(read(cl, name="chains.cls"), Settings(tolerance=0.5))
    rows = rng.choice(np.flatnonzero(smoothed.corners.smoothed), how_many(1, 6), replace=False)
    curves = [
        np.round(curve[:, plane], 9)
        for points in nurbs.control_points(smoothed.program, smoothed.corners, rows, 10.0)
        for curve in points
        for plane in ((0, 1), (1, 2), (2, 0))
    ]
    for flat_points, found in zip(curves, _splines(curves, tmp_path), strict=True):
        dense = nurbs.evaluate(flat_points[None], np.linspace(0, 1, 8001))[0]
        start, step = dense[:-1], np.diff(dense, axis=0)
        size = np.einsum("ij,ij->i", step, step)
        for point in found:
            share = np.einsum("ij,ij->i", point - start, step) / np.where(size > 0, size, 1.0)
            foot = start + np.clip(share, 0, 1)[:, None] * step
            assert np.linalg.norm(foot - point, axis=1).min() < 1e-6


def _splines(curves: list[Floats], folder: Path) -> list[Floats]:
    """Points that the interpreter makes of each curve; a rapid leads to its start."""
    lines = ["G21 G90 G17 G94 F100"]
    for points in curves:
        places = [f"X{x:.9f} Y{y:.9f}" for x, y in points.tolist()]
        lines += [f"G0 {places[0]}", f"G5.2 {places[1]} P1 L4", *(f"{place} P1" for place in places[2:]), "G5.3"]
    found: list[list[Floats]] = []
    for kind, place in positions("\n".join([*lines, "M2"]) + "\n", folder):
        if kind == "rapid":
            found.append([])
        else:
            found[-1].append(place[:2])
    assert min(map(len, found)) > 10
    return [np.array(points) for points in found]


def test_its_direction_of_the_tool_is_ours() -> None:
    """Third column of the forward matrix in trtfuncs.c against the machine's own description."""
    angles = {letter: np.array([10.0, -40.0, 77.0]) for letter in "ABC"}
    for name in ("xyzac-trt", "xyzbc-trt"):
        from cornersmooth.kinematics import tool_axis

        machine = load_machine(name)
        words = np.stack([angles[letter] for letter in machine.names], axis=1)
        np.testing.assert_allclose(tool_axis(machine, words), tool_direction(name, angles), atol=1e-12)
