"""The verification on the command line, its reports, tables and pictures."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from cornersmooth.cli import run
from cornersmooth.nc_reader import read_nc
from cornersmooth.nc_reader.tool import written_at
from cornersmooth.report.paths import deviation_at
from cornersmooth.report.tables import verification_csv
from cornersmooth.verify import verify
from cornersmooth.verify.task import Original, Task
from oracle.messages import one_line

from .writing import encode, job

CL = """TOOL PATH/A
LOADTL/3
FEDRAT/MMPM,250
RAPID
GOTO/0,0,0,0,0,1
GOTO/10,0,0
GOTO/10,10,0
FINI
"""
NC = """%
O0001
G21 G90 G94 G17 G40 G49 G80
G91 G28 Z0.
G90
T3 M6
G54
G43.5 H3
G0 X0.0000 Y0.0000 Z0.0000 I0.0000000 J0.0000000 K1.0000000
G1 X9.9500 Y0.0000 Z0.0000 I0.0000000 J0.0000000 K1.0000000 F250.
G1 X10.0000 Y0.0500 Z0.0000 I0.0000000 J0.0000000 K1.0000000
G1 X10.0000 Y10.0000 Z0.0000 I0.0000000 J0.0000000 K1.0000000
G91 G28 Z0.
G90
G49
M30
%
"""


@pytest.fixture
def files(tmp_path):
    source, text = tmp_path / "part.cls", tmp_path / "part.nc"
    source.write_text(CL)
    text.write_text(NC)
    return str(source), str(text)


def test_command(files, tmp_path, capsys):
    source, text = files
    assert run(["verify", source, text, "-e", "0.04"]) == 0
    told = capsys.readouterr()
    (check,) = told.err.splitlines()  # one block leads from the retract to X Y Z
    assert "CS573" in check
    # corner to chamfer: 0.05/sqrt(2)
    assert told.out.startswith("PASSED")
    assert "tip               0.0353553 mm (limit 0.04) at CL line 6, NC line 11" in told.out
    assert "common pose       tip 0.0353553 mm (limit 0.04) at CL line 6, NC line 11" in told.out
    assert run(["verify", source, text, "-e", "0.03", "-q"]) == 1
    told = capsys.readouterr()
    assert told.out == ""
    assert f"{text}:11: error: the tip leaves its path by 0.035355 mm (CL line 6)" in one_line(told.err)


def test_reports_and_refusals(files, tmp_path, capsys):
    source, text = files
    found, rows = tmp_path / "found.json", tmp_path / "poses.csv"
    assert run(["verify", source, text, "-e", "0.04", "--report", str(found), "--report", str(rows)]) == 0
    contents = json.loads(found.read_text())["verification"]
    assert contents["schema"] == "cornersmooth-verification/1"
    assert contents["max_tip_deviation_mm"] == pytest.approx(0.05 / np.sqrt(2))
    assert contents["where"]["max_tip_deviation_mm"] == {"cl_line": 6, "nc_line": 11}
    table = list(csv.DictReader(rows.read_text().splitlines()))
    assert list(table[0]) == (
        "pose cl_line nc_line x y z tip_deviation_mm axis_point_deviation_mm orientation_deviation_deg".split()
    )
    assert [float(row["tip_deviation_mm"]) for row in table] == pytest.approx([0, 0.0353553, 0], abs=1e-6)
    assert run(["verify", source, text, "--report", str(found)]) == 4
    assert run(["verify", source, text, "--report", str(tmp_path / "found.txt")]) == 2
    assert run(["verify", source, text, "--report", str(tmp_path / "found.gif")]) == 2
    assert run(["verify", source, text, "--report", source + ".csv", "--control", "nobody"]) == 2
    assert run(["verify", "-", "-"]) == 2
    (tmp_path / "bad.nc").write_text("G1 X1.0 ???\n")
    assert run(["verify", source, str(tmp_path / "bad.nc")]) == 3
    assert "bad.nc:1: error" in capsys.readouterr().err


def test_distribution_along_the_path():
    program, lines = job("g6.2")
    found, nc = verify(program, encode(lines), tolerance=0.02), read_nc(encode(lines), tolerance=0.02)
    element, share = np.repeat(np.arange(len(nc)), 16), np.tile(np.arange(1, 17) / 16, len(nc))
    along = deviation_at(Task.of(program, 0.02, 10.0), nc, element, share)
    there = np.isfinite(along.share)
    assert there.sum() > 16 * program.chains[0, 1]
    # the largest deviation is that of a corner from its curve: no written pose is farther off
    assert 0.8 * found.max_tip_deviation_mm < np.nanmax(along.tip) <= found.max_tip_deviation_mm + 1e-9
    # at common poses, which serve tip and axis point together: a little more than for the axis point alone
    assert 0.8 < np.nanmax(along.axis_point) / found.max_axis_point_deviation_mm < 1.1
    # both poses of every row can be found again
    motion = Original.of(program, 0.02, 10.0)
    written, _ = written_at(nc, element[there], share[there])
    owner = np.searchsorted(motion.pose, along.pose[there])
    reached, _ = written_at(motion.trail.nc, owner, along.share[there])
    np.testing.assert_allclose(np.linalg.norm(written - reached, axis=1), along.tip[there], atol=1e-9)
    assert "".join(verification_csv(program, found)).count("\n") == 1 + np.isfinite(found.pose_tip).sum()
    assert found.to_dict()["poses"] == len(program)
