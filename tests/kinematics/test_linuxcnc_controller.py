"""A sample on LinuxCNC's whole controller: a minute and a half, so only where CORNERSMOOTH_CONTROLLER asks for it."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

TESTS = Path(__file__).resolve().parent.parent

pytestmark = [
    pytest.mark.linuxcnc,
    pytest.mark.skipif(
        shutil.which("linuxcnc") is None, reason="LinuxCNC is not installed: apt-get install linuxcnc-uspace"
    ),
    pytest.mark.skipif(
        not os.environ.get("CORNERSMOOTH_CONTROLLER"),
        reason="set CORNERSMOOTH_CONTROLLER=1 to run the whole controller",
    ),
]


def test_controller_runs_a_sample_to_its_end() -> None:
    script, sample = TESTS / "nc" / "linuxcnc_controller.py", TESTS.parent / "samples" / "impeller.cls"
    result = subprocess.run([sys.executable, script, sample, "-e", "0.01"], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stdout + result.stderr
    assert "impeller.cls: done" in result.stdout
    found = re.search(r"tip within ([0-9.]+) mm of the CL path, axis point within ([0-9.]+) mm", result.stdout)
    assert found is not None
    assert float(found[1]) <= 0.011
    assert float(found[2]) <= 0.012
