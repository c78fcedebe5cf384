"""A few poses on LinuxCNC's whole controller, against the unsmoothed program; all of the table is `make controller`."""

from __future__ import annotations

import io
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from nc.linuxcnc_controller import FEEDING, MACHINE, run_samples, tool
from nc.test_nc_first_block import axis, machine_of, part

SCRIPT = Path(__file__).with_name("controller_table.py")


pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed: apt-get install linuxcnc-uspace"
    ),
]


def test_our_text_runs_faster_and_keeps_the_tolerance() -> None:
    result = subprocess.run(
        [sys.executable, SCRIPT, "--short"], capture_output=True, text=True, check=False, timeout=150
    )
    if result.returncode == 2:
        pytest.skip(f"the controller cannot run here: {result.stdout}")
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize("switched", [True, False])
def test_kinematics_that_start_without_tip_control_keep_the_tip(switched: bool) -> None:
    """LinuxCNC's own configuration starts as identity: M428 of our program makes the difference."""
    stream = io.BytesIO()
    postprocess(part(axis(30)).encode(), stream, form=choose_form("linuxcnc", machine=machine_of(MACHINE)))
    text = stream.getvalue() if switched else stream.getvalue().replace(b"M428\n", b"M429\n")
    word, samples = run_samples(text, 120.0, height=100.0)
    if word.startswith("the controller did not start"):
        pytest.skip(word)
    assert word == "done"
    tip, lean = tool(samples[samples[:, 5] == FEEDING, :5])
    tip += (0.0, 0.0, 100.0)
    poses = np.array([(0.0, 0.0, 20.0), (0.0, 0.0, 0.0), (10.0, 0.0, 0.0), (20.0, 2.0, 0.0)])
    start, way = poses[:-1, None], np.diff(poses, axis=0)[:, None]
    share = np.clip((way * (tip - start)).sum(axis=2) / (way**2).sum(axis=2), 0.0, 1.0)[..., None]
    off = np.linalg.norm(tip - start - share * way, axis=2).min(axis=0)
    assert np.degrees(np.arccos(lean[:, 2])) == pytest.approx(30.0, abs=0.001)
    assert bool(off.max() < 0.02) is switched
