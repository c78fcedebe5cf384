"""A few poses on LinuxCNC's whole controller, against the unsmoothed program; all of the table is `make controller`."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("controller_table.py")


@pytest.mark.linuxcnc
@pytest.mark.skipif(
    shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed: apt-get install linuxcnc-uspace"
)
def test_our_text_runs_faster_and_keeps_the_tolerance() -> None:
    result = subprocess.run(
        [sys.executable, SCRIPT, "--short"], capture_output=True, text=True, check=False, timeout=150
    )
    if result.returncode == 2:
        pytest.skip(f"the controller cannot run here: {result.stdout}")
    assert result.returncode == 0, result.stdout + result.stderr
