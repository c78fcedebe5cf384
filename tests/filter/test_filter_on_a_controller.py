"""The script that compares programs on LinuxCNC's whole controller, with a controller that runs each line exactly."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from nc import controller_filter

CUTS = "M428\nG94 F600\nG0 X0 Y0 Z0 A0 C0\n" + "".join(f"G1 X{10 * k} Y{k % 2} Z0 A0 C0\n" for k in range(1, 9))


def run(text: bytes, *_: object) -> tuple[str, np.ndarray, float]:
    """Commands to the motors: with A and C at zero they are the words."""
    lines = re.findall(r"X([-\d.]+) Y([-\d.]+) Z([-\d.]+) A([-\d.]+) C([-\d.]+)", text.decode())
    ends = np.array(lines, np.float64)
    share = np.linspace(0, 1, 200, endpoint=False)[:, None]
    return "done", np.concatenate([a * (1 - share) + b * share for a, b in pairwise(ends)]), 1.0


def test_deviations_of_both_programs_are_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(controller_filter, "run_controller", run)
    (tmp_path / "part.ngc").write_text(CUTS)
    controller_filter.main([str(tmp_path / "part.ngc"), "--cuts", "6", "--lines", "dense"])
    told = capsys.readouterr().out
    assert "PASSED: 6 of 6 cuts smoothed" in told
    before, after = (float(one) for one in re.findall(r"tip within ([\d.]+) mm", told))
    assert before < 1e-4
    assert 1e-3 < after <= 0.01
