"""The sample files are what their generator writes, and tell the same path."""

from __future__ import annotations

import importlib.util
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from cornersmooth.cl.points import read_points
from oracle.files import beginning

SAMPLES = Path(__file__).resolve().parent.parent / "samples"


@pytest.fixture(scope="module")
def generator() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_impeller", SAMPLES / "make_impeller.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def test_committed_files_are_the_generators(generator: ModuleType, tmp_path: Path):
    generator.main(tmp_path)
    for name in ("impeller.cls", "impeller.aptsource"):
        assert (tmp_path / name).read_text() == (SAMPLES / name).read_text()


def test_both_dialects_tell_one_path():
    poses = {}
    for name in ("impeller.cls", "impeller.aptsource"):
        axis: list[float] = []
        poses[name] = []
        for line in re.findall(r"^GOTO\s*/(.*)", (SAMPLES / name).read_text(), re.MULTILINE):
            values = [float(word) for word in line.split(",")]
            axis = values[3:] or axis
            poses[name].append(values[:3] + axis)
    nx, catia = (np.array(poses[name]) for name in poses)
    np.testing.assert_allclose(nx[:, :3], catia[:, :3], rtol=0, atol=0.55e-4)
    np.testing.assert_allclose(nx[:, 3:], catia[:, 3:], rtol=0, atol=0.55e-6)


def test_passes_keep_chord_and_spacing(generator: ModuleType):
    for side in (1, -1):
        t = generator.places(1.0, side)
        tip, axis = generator.flank(t, 1.0, side)
        between, _ = generator.flank((t[1:] + t[:-1]) / 2, 1.0, side)
        chord = np.diff(tip, axis=0)
        length = np.linalg.norm(chord, axis=1)
        distance = np.linalg.norm(np.cross(between - tip[:-1], chord), axis=1) / length
        assert 0.9 * generator.CHORD < distance.max() < 1.05 * generator.CHORD
        assert 0.5 < length.min() < length.max() < generator.LONGEST
        turn = np.arccos((axis[1:] * axis[:-1]).sum(axis=1))
        assert turn.max() < 1.01 * generator.LARGEST_TURN


def test_make_run_smooths_all_of_them_within_their_tolerances(tmp_path: Path):
    for name in ("Makefile", "pyproject.toml"):
        shutil.copy(SAMPLES.parent / name, tmp_path)
    shutil.copytree(SAMPLES, tmp_path / "samples")
    for name in ("impeller.cls", "impeller.aptsource"):  # a part of its first pass
        (tmp_path / "samples" / name).write_bytes(beginning(SAMPLES / name, 40))
    (tmp_path / ".venv").symlink_to(Path(sys.executable).parent.parent)
    # the environment is there already
    script = ["make", "-o", ".venv/.installed", "run"] if shutil.which("make") else [sys.executable, "samples/show.py"]
    done = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    made = tmp_path / "build" / "samples"
    reports = {path.stem: json.loads(path.read_text()) for path in made.glob("*.json")}
    assert set(reports) == {"paper_table1", "impeller_nx", "impeller_catia"}
    for name, report in reports.items():
        summary, tolerance = report["summary"], report["settings"]["tolerance_mm"]
        assert summary["smoothed"] == summary["corners"] > 0
        assert 0.9 * tolerance < max(summary["max_tip_error_mm"], summary["max_axis_error_mm"]) <= tolerance
        assert f"{name}.nc" in done.stdout
        assert len((made / f"{name}.nc").read_text().splitlines()) > summary["blocks_in"]


def test_paper_table_is_read_as_second_points_ten_millimetres_up():
    program = read_points((SAMPLES / "paper_table1.csv").read_bytes(), name="paper_table1.csv")
    assert program.tip.tolist() == [
        [174.1311, -6.4621, -68.1138],
        [176.0862, -6.8579, -68.1299],
        [178.2366, -8.4623, -68.2326],
        [179.5084, -11.8775, -68.4966],
    ]
    np.testing.assert_allclose(program.tip[1] + 10 * program.axis[1], [176.2593, -7.9576, -58.1921], atol=1e-4)
    assert [finding.code for finding in program.findings] == ["CS176", "CS171", "CS177"]
