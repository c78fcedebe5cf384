"""``cornersmooth time``."""

from __future__ import annotations

import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cli import run
from oracle import command
from oracle.files import beginning
from oracle.messages import one_line

ROOT = Path(__file__).resolve().parents[2]
TABLE_1 = str(ROOT / "samples" / "paper_table1.csv")
IMPELLER = ROOT / "samples" / "impeller.cls"
PAPER = ["--units", "mm", "--feed", "1800", "--accel", "1000", "--jerk", "5000", "--period", "2ms"]


def test_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["time", TABLE_1, "-e", "0.15", *PAPER, "--json"]) == 0
    contents = json.loads(capsys.readouterr().out)
    assert contents["seconds"]["direct_exact_stop"] == pytest.approx(0.7777, abs=1e-4)
    assert contents["limits"]["period_s"] == pytest.approx(0.002)
    assert contents["limits"]["feed_mm_per_min"] == 1800.0
    assert contents["settings"]["tolerance_mm"] == 0.15


def test_tables(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = tmp_path / "part.cls"
    part.write_bytes(beginning(IMPELLER, 45))
    assert run(["time", str(part), "-e", "0.02"]) == 0
    text = capsys.readouterr().out
    for words in ("direct, exact stop", "as written", "at constant feed"):
        assert words in text
    assert run(["time", TABLE_1, *PAPER, "--quiet"]) == 0
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("law", ["as_written", "direct_velocity_jump"])
def test_csv_holds_the_motion(tmp_path: Path, law: str) -> None:
    path = tmp_path / "motion.csv"
    arguments = ["time", TABLE_1, "-e", "0.15", *PAPER, "--law", law, "--csv", str(path), "-q"]
    assert run(arguments) == 0
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    table = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    t, way = table["t_s"], table["s_mm"]
    assert np.diff(t)[:-1] == pytest.approx(0.002)
    # the jerk as third differences of the written way
    assert np.abs(np.diff(way[:-1], n=3)).max() / 0.002**3 <= 5000.0 * 1.005
    assert np.abs(np.diff(way[:-1], n=2)).max() / 0.002**2 <= 1000.0 * 1.001
    tip = np.column_stack((table["x_mm"], table["y_mm"], table["z_mm"]))
    assert np.linalg.norm(np.diff(tip, axis=0), axis=1).max() <= 30.0 * 0.002 * 1.001
    assert command.run(*arguments[:-2], "-").stdout == path.read_bytes()  # and no table behind it
    assert run(arguments) == 4  # exists already
    assert run([*arguments, "--force"]) == 0


@pytest.mark.parametrize(
    ("arguments", "code", "words"),
    [
        (["--period", "2min"], 2, "not a time"),
        (["--jerk", "-1"], 2, "jerk is -1"),
        ([], 2, "no feed is programmed"),
    ],
)
def test_refusals(arguments: list[str], code: int, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["time", TABLE_1, "--units", "mm", *arguments]) == code
    assert words in capsys.readouterr().err


def test_machine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Times grow, and the axis columns of the CSV are those of the kinematics."""
    from cornersmooth.kinematics import load_machine, machine_position, tool_axis

    path = tmp_path / "motion.csv"
    common = ["time", TABLE_1, *PAPER, "-e", "0.15", "--json"]
    assert run(common) == 0
    free = json.loads(capsys.readouterr().out)
    assert run([*common, "--limits", "table-ac", "--csv", str(path)]) == 0
    bound = json.loads(capsys.readouterr().out)
    assert bound["machine"] == "table-ac"
    for name, seconds in bound["seconds"].items():
        assert seconds >= free["seconds"][name] * 0.999
    assert bound["seconds"]["as_written"] > free["seconds"]["as_written"]
    rows = list(csv.DictReader(io.StringIO(path.read_text())))
    table = {name: np.array([float(row[name]) for row in rows]) for name in rows[0]}
    machine = load_machine("table-ac")
    angles = np.column_stack((table["machine_c_deg"], table["machine_a_deg"]))
    tip = np.column_stack((table["x_mm"], table["y_mm"], table["z_mm"]))
    linear = np.column_stack([table[f"machine_{name}_mm"] for name in "xyz"])
    assert tool_axis(machine, angles) == pytest.approx(np.column_stack((table["i"], table["j"], table["k"])), abs=1e-9)
    assert machine_position(machine, tip, angles) == pytest.approx(linear, abs=1e-9)
    assert run(["time", TABLE_1, *PAPER, "--limits", "table-ac"]) == 0
    assert "table-ac" in capsys.readouterr().out.splitlines()[0]


def test_machine_without_dynamics(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mill = tmp_path / "mill.toml"
    mill.write_text(
        '[[axis]]\nname = "C"\ncarrier = "table"\ndirection = [0, 0, 1]\n'
        '[[axis]]\nname = "A"\ncarrier = "table"\ndirection = [1, 0, 0]\n'
    )
    assert run(["time", TABLE_1, *PAPER, "--machine", str(mill)]) == 2
    assert "machine mill does not say how fast its axes may go; add [dynamics.X]" in one_line(capsys.readouterr().err)


def test_the_machine_of_a_text_need_not_be_said_twice(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    source, text, bare = ROOT / "samples" / "two_tools.cls", tmp_path / "o.nc", tmp_path / "bare.nc"
    assert run(["smooth", str(source), "-o", str(text), "--machine", "table-ac", "-q"]) == 0
    bare.write_text("".join(line for line in text.read_text().splitlines(True) if "MACHINE=" not in line))
    capsys.readouterr()
    told = []
    for words in ([text], [bare, "--machine", "table-ac"]):
        assert run(["time", str(source), "--feed", "900", "--json", "--text", *map(str, words)]) == 0
        told.append(json.loads(capsys.readouterr().out)["length_mm"]["as_written"])
    assert told[0] == told[1] > 100.0


def test_a_text_is_read_before_anything_is_planned(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cornersmooth.cli.times.direct", None)
    text = tmp_path / "o.nc"
    text.write_text("%\nO1\nG21 G90\nG1 X1 NONSENSE\nM30\n%\n")
    assert run(["time", TABLE_1, "--units", "mm", "--feed", "1800", "--text", str(text)]) == 3
    assert one_line(capsys.readouterr().err).startswith(f"{text}:4: error: ")


def test_the_program_of_the_options_is_planned(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What smooth writes with the same options takes the time that is said without it."""
    part, nc = tmp_path / "part.cls", tmp_path / "part.mpf"
    part.write_bytes(re.sub(rb"FEDRAT/[^\n]*\n", b"", beginning(IMPELLER, 45)))
    options = ["--control", "siemens", "-f", "g1", "--feed", "900", "--limits", "table-ac"]
    assert run(["smooth", str(part), *options, "-o", str(nc), "-q"]) == 0
    told = []
    for more in (options, [*options, "--text", str(nc)]):
        assert run(["time", str(part), "--json", *more]) == 0
        told.append(json.loads(capsys.readouterr().out)["seconds"])
    assert list(told[0]) == ["direct_exact_stop", "direct_velocity_jump", "as_written"]
    assert told[0]["as_written"] == pytest.approx(told[1]["as_written"], rel=1e-3)


def test_linuxcnc_is_timed_by_its_own_law(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part, nc = tmp_path / "part.cls", tmp_path / "part.ngc"
    part.write_bytes(beginning(IMPELLER, 60))
    options = ["--control", "linuxcnc", "--machine", "xyzac-trt"]
    assert run(["smooth", str(part), *options, "-o", str(nc)]) == 0
    verdict = capsys.readouterr().err
    assert run(["time", str(part), *options, "--json"]) == 0
    seconds = json.loads(capsys.readouterr().out)["seconds"]
    assert f"time on xyzac-trt {seconds['as_written']:.1f} s instead of {seconds['unsmoothed']:.1f} s" in verdict
    assert run(["time", str(part), *options, "--text", str(nc), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["seconds"] == pytest.approx(seconds, rel=1e-3)
    assert run(["time", str(part), *options, "--csv", str(tmp_path / "a.csv")]) == 2


@pytest.mark.parametrize("control", [[], ["--control", "linuxcnc", "--machine", "xyzac-trt"]])
def test_a_text_may_come_from_standard_input(tmp_path: Path, control: list[str]) -> None:
    part, nc = tmp_path / "part.cls", tmp_path / "part.nc"
    part.write_bytes(beginning(IMPELLER, 40))
    assert command.run("smooth", part, *control, "-o", nc).returncode == 0
    named = command.run("time", part, *control, "--text", nc, "--json")
    piped = command.run("time", part, *control, "--text", "-", "--json", data=nc.read_bytes())
    assert (piped.returncode, piped.stdout) == (0, named.stdout)
    assert command.run("time", "-", *control, "--text", "-").returncode == 2


def test_the_time_is_that_of_the_program_that_smooth_writes_with_the_same_limits(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    part = tmp_path / "part.cls"
    part.write_bytes(beginning(IMPELLER, 60))
    assert run(["smooth", str(part), "--limits", "table-ac", "-o", str(tmp_path / "part.nc"), "--json"]) == 0
    written = json.loads(capsys.readouterr().out)
    assert written["settings"]["method"] == "global"
    assert run(["time", str(part), "--limits", "table-ac", "--json"]) == 0
    planned = json.loads(capsys.readouterr().out)
    assert planned["settings"]["method"] == "global"
    assert planned["seconds"]["as_written"] == pytest.approx(written["times"]["written_s"], rel=1e-3)
