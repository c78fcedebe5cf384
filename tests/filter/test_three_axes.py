"""Programs that name no rotary axis and no tool vector need no machine; the control is recognised, or asked for."""

from __future__ import annotations

import math
import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.nc_reader.recognition import needs_its_control
from filter.foreign import by_words, difference
from oracle.command import DONE, USAGE, run
from page.making import values_of

EPS = 0.01
THREE_AXES = Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml"
PASS = [(round(0.9 * k, 3), round(0.7 * ((k * 7) % 5), 3), -1 - round(0.1 * ((k * 3) % 4), 3)) for k in range(1, 21)]
CUTS = "".join(f"X{x:.3f} Y{y:.3f} Z{z:.3f}\n" for x, y, z in PASS)
FANUC = (
    "%\nO0011\n(RELIEF A5 BALL, B2)\nG21 G90 G94 G17 G40 G49 G80\nT4 M6\nG54 G0 X0. Y0. S12000 M3\nG43 H4 Z20. M8\n"
    "G1 Z-1. F350.\n{}G0 Z20. M9\nM5\nG91 G28 Z0.\nG90\nM30\n%\n"
)
SIEMENS = (
    "; A1\nG17 G90 G94 G710\nT1 M6\nCYCLE832(0.01,_FINISH,1)\nG54\nG0 X0 Y0 Z20 S900 M3\nG1 Z-1 F350\n{}G0 Z20\nM30\n"
)
KLARTEXT = (
    "0 BEGIN PGM A1 MM\n1 TOOL CALL 3 Z S3000\n2 L Z+50 R0 FMAX M3\n3 CYCL DEF 1.0 PECKING\n4 CYCL DEF 1.1 SET UP2\n"
    "5 CYCL DEF 1.2 DEPTH-9\n6 CYCL DEF 1.3 PECKG3\n7 CYCL DEF 1.4 DWELL0\n8 CYCL DEF 1.5 F150\n"
    "9 L X+20 Y+20 R0 FMAX M99\n10 L Z+50 R0 FMAX\n11 TOOL CALL 5 Z S9000\n12 L X+0 Y+0 R0 FMAX M3\n"
    "13 L Z+2 R0 FMAX\n14 L Z-1 R0 F300\n"
    + "".join(f"{k + 15} L X{x:+.3f} Y{y:+.3f} Z{z:+.3f}\n" for k, (x, y, z) in enumerate(PASS))
    + "45 L Z+50 R0 FMAX M5\n46 M30\n47 END PGM A1 MM\n"
)
PROGRAMS = {
    "fanuc": FANUC.format(CUTS),
    "haas": FANUC.format(CUTS),
    "mitsubishi": FANUC.format(CUTS),
    "siemens": SIEMENS.format(CUTS),
    "heidenhain": KLARTEXT,
    "linuxcnc": "G21 G90 G94 G17\nG0 X0 Y0 Z20\nG1 Z-1 F350\n" + CUTS + "G0 Z20\nM2\n",
}


def filtered(folder: Path, text: str, *options: object) -> tuple[str, bytes]:
    """First line of what ``filter`` says, and the program."""
    (folder / "part.nc").write_text(text)
    made = run("filter", "part.nc", "-e", EPS, "--lines", "dense", *options, "-o", "new.nc", "--force", cwd=folder)
    assert made.returncode == DONE, made.stderr
    told = [line for line in made.stderr.decode().splitlines() if "warning" not in line]
    return told[0] + told[1], (folder / "new.nc").read_bytes()


@pytest.mark.parametrize("control", PROGRAMS)
def test_no_machine_is_needed(control: str, tmp_path: Path) -> None:
    text = PROGRAMS[control]
    told, new = filtered(tmp_path, text, "--control", control)
    assert told.startswith("PASSED")
    assert int(re.search(r"(\d+) of \d+ cuts smoothed", told)[1]) >= len(PASS)  # type: ignore[index]
    assert difference(by_words(text.encode()), by_words(new), EPS) == ""
    on = ("--control", control, "-e", EPS)
    assert run("verify", "part.nc", "new.nc", *on, cwd=tmp_path).stdout.startswith(b"PASSED")
    timed = run("time", "part.nc", *on, "--limits", THREE_AXES, cwd=tmp_path)
    assert timed.returncode == DONE
    assert b"cuts differ" in timed.stdout


@pytest.mark.parametrize("control", ["fanuc", "linuxcnc", "heidenhain"])
@pytest.mark.parametrize("option", ["--machine", "--limits"])
def test_ways_to_smooth_it_are_compared(control: str, option: str, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(PROGRAMS[control])
    found = run("compare", "part.nc", "--control", control, option, THREE_AXES, cwd=tmp_path)
    assert found.returncode == DONE, found.stderr
    assert b"  cornersmooth filter part.nc" in found.stdout


@pytest.mark.parametrize("control", ["siemens", "heidenhain"])
def test_the_control_is_recognised(control: str, tmp_path: Path) -> None:
    told, new = filtered(tmp_path, PROGRAMS[control])
    assert told.startswith(f"PASSED  new.nc  {control} ")
    assert new == filtered(tmp_path, PROGRAMS[control], "--control", control)[1]


@pytest.mark.parametrize(
    ("text", "needed"),
    [
        ("G21\nG90\nG0 X0 Y0\nZ10\nG1 Z-1 F333\nX0 Y3 F1000\nX0.5 Y3.596\nX1 Y4\n", True),
        ("G21 ; units\nG90 ; absolute\nG0 X0. Y0.\nG1 Z-1. F333.\nX1. Y4.\nX2. Y3.\n", True),
        ("G21;\nG90 (A; B X5);\nG0 X0 Y0. Z0;\nG1 Z-1. F333;\nX1. Y4.;\nX2. Y3.;\n", False),
    ],
)
def test_the_control_is_asked_for_where_it_would_be_a_guess(text: str, needed: bool, tmp_path: Path) -> None:
    assert needs_its_control(text.encode()) is needed
    (tmp_path / "part.nc").write_text(text + "G0 Z10.\nM30\n")
    made = run("filter", "part.nc", "-o", "new.nc", cwd=tmp_path)
    assert made.returncode == (USAGE if needed else DONE)
    assert (b"error[CS267]: part.nc does not say its control" in made.stderr) is needed
    assert run("filter", "part.nc", "--control", "linuxcnc", "-o", "b.nc", cwd=tmp_path).returncode == DONE


@pytest.mark.parametrize(
    ("block", "smoothed"),
    [
        ("G43 H4 Z20.", True),
        ("G43 H4\nZ20.", True),
        ("G44 H4 Z20.", True),
        ("G49\nZ20.", True),
        ("G18 G43 H4 Z20.\nG17", True),
        ("G43 H4 Z20.\nG43.4 H4 Z20.", False),
        ("G55 Z20.", False),
        ("T5 M6\nZ20.", False),
    ],
)
def test_the_length_of_the_tool_loses_its_axis_alone(block: str, smoothed: bool, tmp_path: Path) -> None:
    cuts = "".join(f"Y{0.7 * k:.3f} Z{-1 - 0.1 * (k % 3):.3f}\n" for k in range(1, 12))  # X is never said again
    text = f"%\nO1\nG21 G90 G94 G17 G40 G49 G80\nG54 G0 X3. Y0.\n{block}\nG1 Z-1. F350.\n{cuts}G0 Z20.\nM30\n%\n"
    told, new = filtered(tmp_path, text, "--machine", THREE_AXES)
    assert (new != text.encode()) is smoothed
    assert told.startswith("PASSED" if smoothed else "NOT SMOOTHED")


def test_feeds_keep_the_digits_of_the_program(tmp_path: Path) -> None:
    cuts = "".join(f"X{x:.3f} Y{y:.3f} F{1.07 + 0.01313 * k:.5f}\n" for k, (x, y, _) in enumerate(PASS))
    told, new = filtered(tmp_path, SIEMENS.format(cuts), "--control", "siemens")
    assert told.startswith("PASSED")
    assert b"F1.08313" in new


def test_whole_numbers_keep_their_points(tmp_path: Path) -> None:
    cuts = "".join(f"X{k}. Y0. Z-1.\n" for k in range(1, 30))
    told, new = filtered(tmp_path, PROGRAMS["fanuc"].split("G1 Z-1.")[0] + f"G1 Z-1. F350.\n{cuts}G0 Z20.\nM30\n%\n")
    assert told.startswith("PASSED")
    assert b"X29. Y0. Z-1." in new


def test_a_modal_cycle_of_klartext_is_called_by_every_block(tmp_path: Path) -> None:
    text = KLARTEXT.replace("13 L Z+2 R0 FMAX", "13 M89")
    assert filtered(tmp_path, text, "--control", "heidenhain")[0].startswith("NOT SMOOTHED")


def test_rotary_words_without_a_machine_say_what_is_missing(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(PROGRAMS["fanuc"].replace("G1 Z-1.", "G1 A5. Z-1."))
    made = run("filter", "part.nc", "-o", "new.nc", cwd=tmp_path)
    assert b"an axis turns in it: name the machine" in made.stderr


@pytest.mark.parametrize(
    ("control", "block"),
    [
        ("grbl", "$H"),
        ("grbl", "$G"),
        ("mach3", "G71 G91.1"),
        ("mach3", "G70"),
        ("mach3", "G50\nG69"),
        ("mach3", "G90.1"),
    ],
)
def test_words_of_hobby_controls_leave_the_rest_known(control: str, block: str, tmp_path: Path) -> None:
    text = PROGRAMS["linuxcnc"].replace("G0 X0 Y0 Z20\n", f"{block}\nG0 X0 Y0 Z20\n")
    told, new = filtered(tmp_path, text, "--control", control)
    assert told.startswith("PASSED")
    unit = 25.4 if block == "G70" else 1.0
    assert difference(by_words(text.encode()), by_words(new), EPS / unit) == ""
    left = difference(by_words(text.encode()), by_words(new), 0.1 * EPS / unit)
    assert "farther away" in left  # so the units are those that it says


def test_an_axis_is_said_again_and_stands_still(tmp_path: Path) -> None:
    cuts = CUTS.replace("\n", " A90.\n")
    text = FANUC.format(cuts).replace("G54 G0 X0. Y0.", "G54 G0 X0. Y0. A90.")
    told, new = filtered(tmp_path, text)
    assert f"{len(PASS) + 1} of {len(PASS) + 1} cuts" in told
    assert difference(by_words(text.encode()), by_words(new), EPS) == ""
    for other in (text.replace("A90.\nG0 Z20.", "A91.\nG0 Z20."), text.replace("G1 Z-1.", "G91\nG1 Z-21.")):
        told, new = filtered(tmp_path, other)
        assert int(re.search(r"(\d+) of \d+ cuts", told)[1]) <= len(PASS)  # type: ignore[index]
        assert difference(by_words(other.encode()), by_words(new), EPS) == ""


def test_what_is_not_known_is_said_with_the_line_since_which(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(FANUC.format("M98 P1000\nG1 " + CUTS))
    made = run("filter", "part.nc", "-o", "new.nc", cwd=tmp_path)
    assert b"not said again since 'M98 P1000': compensation of the cutter (G40), G90 or G91, units" in made.stderr


@pytest.mark.parametrize("corner", [",C1.", ",R0.5"])
def test_a_chamfer_leaves_the_rest_known(corner: str, tmp_path: Path) -> None:
    text = FANUC.format(f"X-9. {corner}\nY9.\nX0.\n" + CUTS)
    told, new = filtered(tmp_path, text)
    assert told.startswith("PASSED")
    assert f"G1 Z-1. F350.\nX-9. {corner}\nY9.\n".encode() in new
    assert int(re.search(r"(\d+) of \d+ cuts smoothed", told)[1]) >= len(PASS)  # type: ignore[index]


@pytest.mark.parametrize(("first", "smoothed"), [("RNDM=2", 0), ("RNDM=0.0", 19), ("RNDM=2\nG1 X0 Y5\nRNDM=0", 19)])
def test_cuts_stay_where_the_program_rounds_all_corners(first: str, smoothed: int, tmp_path: Path) -> None:
    """In fewer blocks the control would round them farther."""
    told, _ = filtered(tmp_path, SIEMENS.format(f"{first}\n{CUTS}"), "--control", "siemens")
    assert f" {smoothed} of " in told, told


@pytest.mark.parametrize("control", ["fanuc", "linuxcnc"])
@pytest.mark.parametrize("command", ["time", "compare", "filter"])
def test_limits_without_an_axis_that_moves_are_refused(control: str, command: str, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(PROGRAMS[control])
    (tmp_path / "router.toml").write_text("axis = []\n[dynamics.X]\nvelocity = 6000\nacceleration = 500\njerk = 1e4\n")
    out = ("-o", "new.nc") if command == "filter" else ()
    done = run(command, "part.nc", "--control", control, "--limits", "router.toml", *out, cwd=tmp_path)
    assert done.returncode == USAGE
    assert b"error[CS263]" in done.stderr
    assert b"[dynamics.Y] and [dynamics.Z]" in done.stderr
    assert b"Warning" not in done.stderr
    assert not (tmp_path / "new.nc").exists()


def test_the_machine_file_of_the_page_is_complete(tmp_path: Path) -> None:
    page = (Path(__file__).parents[2] / "docs" / "linuxcnc.md").read_text()
    block = re.search(r"\n\n(    axis = \[\]\n(?:    .*\n|\n)+)", page)[1]  # type: ignore[index]
    (tmp_path / "router.toml").write_text(re.sub("(?m)^    ", "", block))
    (tmp_path / "part.nc").write_text(PROGRAMS["linuxcnc"])
    done = run("time", "part.nc", "--control", "linuxcnc", "--limits", "router.toml", cwd=tmp_path)
    assert done.returncode == DONE, done.stderr


@pytest.mark.parametrize(
    ("control", "options", "text", "noted"),
    [
        ("linuxcnc", (), PROGRAMS["linuxcnc"], True),
        ("grbl", (), PROGRAMS["linuxcnc"], True),
        ("linuxcnc", ("--limits", THREE_AXES), PROGRAMS["linuxcnc"], False),
        ("linuxcnc", ("--lines", "dense"), PROGRAMS["linuxcnc"], False),
        ("linuxcnc", (), "G21 G90 G94 G17\nG0 X0 Y0\nG1 Z-1 F350\nM2\n", False),
        ("fanuc", (), PROGRAMS["fanuc"], False),
    ],
)
def test_arcs_without_limits_are_noted_on_linuxcnc(
    control: str, options: tuple[object, ...], text: str, noted: bool, tmp_path: Path
) -> None:
    """Cuts along an arc that LinuxCNC may run slower than its chords; nothing is noted where none was written."""
    arc = "".join(f"X{20 - 20 * math.cos(a):.3f} Y{20 * math.sin(a):.3f}\n" for a in np.linspace(0.05, 3.0, 60))
    (tmp_path / "part.nc").write_text(text.replace(CUTS, arc))
    made = run("filter", "part.nc", "--control", control, *options, "-o", "new.nc", cwd=tmp_path)
    assert made.returncode == DONE, made.stderr
    assert (b"arcs may take longer on LinuxCNC: give --limits" in made.stderr) is noted


def test_tip_control_without_a_machine_names_its_line(tmp_path: Path) -> None:
    text = "G21 G90 G94\n(M428)\n\nM428\nG0 X0 Y0 Z20 A0 C0\nG1 Z-1 F350\nX1 A5\nX2 A9\nM429\nM2\n"
    (tmp_path / "part.nc").write_text(text)
    for order in (("filter", "part.nc", "-o", "new.nc"), ("compare", "part.nc", "--limits", THREE_AXES)):
        made = run(*order, "--control", "linuxcnc", cwd=tmp_path)
        assert made.returncode == USAGE
        assert b"part.nc:4: error[CS215]: the program has tip control" in made.stderr
        assert b"--machine" in made.stderr


def test_an_unknown_control_names_all_that_work(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(PROGRAMS["linuxcnc"])
    made = run("filter", "part.nc", "--control", "marlin", "-o", "new.nc", cwd=tmp_path)
    assert made.returncode == USAGE
    hint = made.stderr.decode().partition("hint: ")[2].strip()
    alone = {name.strip() for name in re.split(r", or, read as LinuxCNC,|, ", hint.partition("one of ")[2])}
    assert alone >= {"fanuc", "linuxcnc", "siemens", "grbl", "grblhal", "fluidnc", "mach", "mach3", "mach4"}
    for name in ("grbl", "mach3", "linuxcnc"):
        made = run("filter", "part.nc", "--control", name, "-o", f"{name}.nc", cwd=tmp_path)
        assert made.returncode == DONE, made.stderr


def test_a_program_that_gains_no_time_is_to_be_left(tmp_path: Path) -> None:
    relief = "".join(f"G1 X{0.5 * k:.3f} Z{math.cos(0.4 * k) - 2:.3f}\n" for k in range(1, 61))
    (tmp_path / "part.nc").write_text(f"G21 G90 G17 G94\nG0 X0 Y0 Z-1\nF600\n{relief}G0 Z5\nM2\n")
    on = ("--control", "linuxcnc", "--limits", THREE_AXES, "--report", "page.html")
    made = run("filter", "part.nc", *on, "-o", "new.nc", cwd=tmp_path)
    told = made.stderr.decode().splitlines()[0]
    times = re.search(r", ([\d.]+) s instead of ([\d.]+) s \([-+][\d.]+ %\)(.*)", told)
    assert times, made.stderr
    assert times[1] == times[2]
    assert times[3] == "; no time is gained, leave the program as it was"
    planned = dict(values_of((tmp_path / "page.html").read_text())[0]["facts"])["planned with"]
    assert planned.startswith("feed as programmed; the law of linuxcnc-2.9; axes of ")
    given = tomllib.loads(THREE_AXES.read_text())["dynamics"]["Y"]
    assert "Y up to {velocity:g} mm/min, {acceleration:g} mm/s2".format(**given) in planned
    assert "5000" not in planned  # mm/s³ of the tip: that law has none


def test_a_run_with_as_few_blocks_as_can_be_is_no_fault(tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(FANUC.format("".join(f"X{k}. Y{k % 2}. Z-{k}.\n" for k in range(1, 9))))
    made = run("filter", "part.nc", "--control", "fanuc", "-o", "new.nc", cwd=tmp_path)
    assert "already as few blocks as ε allows" in made.stderr.decode()
