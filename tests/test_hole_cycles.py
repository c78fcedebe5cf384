"""Hole cycles through the whole command: drilled in every form, or refused, or left out and counted."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.errors import InputError
from cornersmooth.nc import Frame
from cornersmooth.nc_reader import read_nc
from cornersmooth.pipeline import postprocess
from oracle.command import BAD_INPUT, DONE, OLD, message, run

FORMS = {
    "g1": (),
    "g6.2": ("-f", "g6.2"),
    "siemens": ("--control", "siemens", "-f", "bspline"),
    "heidenhain": ("--control", "heidenhain"),
    "linuxcnc": ("--control", "linuxcnc", "--machine", "xyzac-trt"),
    "native": ("--cycles", "native"),
    "native siemens": ("--control", "siemens", "--cycles", "native"),
    "global": ("-f", "g6.2", "--method", "global"),
}
#: NX: a cycle, and ON with another depth; 70 mm above the system of the file
NX = b"""TOOL PATH/HOLES,TOOL,D13
TLDATA/DRILL,MILL,13.0,0.0,75.0,118.0,35.0
MSYS/0,0,0,1.0,0.0,0.0,0.0,1.0,0.0
LOAD/TOOL,62,ADJUST,62
SPINDL/RPM,3600,CLW
RAPID
GOTO/60.0,14.0,80.0,0.0,0.0,1.0
CYCLE/DRILL,DEEP,STEP,20.0,CLEAR,3.0,FEDTO,-72.0,RTRCTO,AUTO,MMPM,250.0
GOTO/60.0,14.0,70.0
CYCLE/ON,FEDTO,-74.5,RTRCTO,AUTO
GOTO/-90.0,47.0,70.0
CYCLE/ON,FEDTO,-72.0,RTRCTO,AUTO
GOTO/-100.0,-36.0,70.0
CYCLE/OFF
END-OF-PATH
"""
#: what CATIA's table means by bare numbers, nobody else knows
OPEN = b"""UNITS/MM
LOADTL/1
SPINDL/RPM,2000,CCLW
RAPID
GOTO/0,0,50,0,0,1
CYCLE/DRILL,3.0,5.0
GOTO/10,0,0
GOTO/20,0,0
CYCLE/TAP,DEPTH,9,MMPM,500,RAPTO,2
GOTO/30,0,0
CYCLE/OFF
FINI
"""


@pytest.mark.parametrize("form", FORMS)
def test_a_cycle_goes_on_with_what_on_says(tmp_path: Path, form: str) -> None:
    done = run("smooth", "-", "-o", tmp_path / "o.nc", "--report", tmp_path / "r.json", *FORMS[form], data=NX)
    assert done.returncode == DONE, done.stderr
    assert json.loads((tmp_path / "r.json").read_text())["verification"]["passed"]
    if "linuxcnc" in form:  # its words are positions of axes
        return
    control = "siemens" if "siemens" in form else "heidenhain" if "heidenhain" in form else "fanuc"
    tip = read_nc((tmp_path / "o.nc").read_bytes(), control=control).tip
    for x, bottom in ((60.0, -2.0), (-90.0, -4.5), (-100.0, -2.0)):
        assert tip[np.abs(tip[:, 0] - x) < 1e-6, 2].min() == bottom


def test_what_is_not_understood_is_refused_with_its_line(tmp_path: Path) -> None:
    out = tmp_path / "o.nc"
    out.write_bytes(OLD)
    done = run("smooth", "-", "-o", out, "--force", data=OPEN)
    assert done.returncode == BAD_INPUT
    told = message(done.stderr)
    assert ":6: error: the hole cycle is not written: its words are not understood" in told
    assert "--skip-cycles" in told
    assert out.read_bytes() == OLD
    with pytest.raises(InputError) as refused:  # the library's default is the command's
        postprocess(OPEN, io.BytesIO())
    assert (refused.value.code, refused.value.line) == ("CS342", 6)


def test_what_is_left_out_is_counted(tmp_path: Path) -> None:
    out, report = tmp_path / "o.nc", tmp_path / "r.json"
    done = run("smooth", "-", "-o", out, "--report", report, "--skip-cycles", "CORNERSMOOTH_NO_COMMENTS=1", data=OPEN)
    assert done.returncode == DONE, done.stderr
    assert out.read_text().count("(NOT DRILLED: HOLE AT X") == 3
    left_out = [one for one in json.loads(report.read_text())["findings"] if one["code"] == "CS315"]
    assert [(one["line"], one["count"]) for one in left_out] == [(7, 2), (10, 1)]
    assert "clockwise" in left_out[1]["text"]
    result = postprocess(OPEN, io.BytesIO(), frame=Frame(skip_cycles=True))
    assert sum(finding.count for finding in result.findings if finding.code == "CS315") == 3
