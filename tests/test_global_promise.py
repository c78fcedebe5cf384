"""The promise of `--method global`: the written numbers stay within ε of the original motion, says the oracle."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import cornersmooth
from oracle.chains import Chain, cl_text, random_chains
from oracle.command import run
from oracle.judge import feeds_out_of_place, judge, not_passed, runs_of
from oracle.motion import Path as Motion
from oracle.nc_text import Form, Written, parse
from oracle.share import how_many

FORMS: tuple[Form, ...] = ("g1",)
CASES = [(form, tolerance, length) for form in FORMS for tolerance in (0.001, 0.01, 0.15) for length in (10.0, 50.0)]
CHAINS = how_many(10, 120)
#: statuses of the report under which a pose need not be passed
PASSED_BY = ("in_run", "smoothed", "duplicate")


@dataclass(frozen=True)
class Case:
    """What one run of the command made of the random chains."""

    chains: list[Chain]
    written: Written
    paths: list[Motion]
    status: dict[int, str]  #: by source line
    lines: list[np.ndarray]
    tolerance: float
    axis_length: float

    def moving(self) -> list[int]:
        """Chains that leave their first pose; the others write no run."""
        return [
            index
            for index, chain in enumerate(self.chains)
            if np.ptp(chain.tip, axis=0).any() or np.ptp(chain.axis, axis=0).any()
        ]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{case[1]}-{case[2]:g}")
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Case:
    form, tolerance, axis_length = request.param
    folder = tmp_path_factory.mktemp("global")
    chains = random_chains(100 + CASES.index(request.param), CHAINS, corners=12)
    data, lines = cl_text(chains)
    source, out, report = folder / "in.cls", folder / "out.nc", folder / "report.csv"
    source.write_bytes(data)
    options = ["-e", str(tolerance), "-H", str(axis_length), "-f", form, "--method", "global"]
    result = run("smooth", source, "-o", out, "--report", report, *options, "-q", "--no-verify")
    assert result.returncode == 0, result.stderr.decode()
    with report.open(newline="") as stream:
        status = {int(row["line"]): row["status"] for row in csv.DictReader(stream)}
    written = parse(out.read_bytes(), form)
    paths = runs_of(written, axis_length, tolerance)
    return Case(chains, written, paths, status, lines, tolerance, axis_length)


def test_random_chains_keep_the_tolerance(case: Case) -> None:
    originals = [case.chains[index].original for index in case.moving()]
    verdict = judge(case.paths, originals, case.axis_length, case.tolerance)
    assert verdict.deviation.worst <= case.tolerance, verdict


def test_most_corners_are_rounded_in_runs(case: Case) -> None:
    assert np.mean([status == "in_run" for status in case.status.values()]) > 0.6
    assert np.mean([status == "smoothed" for status in case.status.values()]) < 0.01


def test_poses_that_end_runs_are_passed_exactly(case: Case) -> None:
    for index, path in zip(case.moving(), case.paths, strict=True):
        chain, lines = case.chains[index], case.lines[index]
        exact = [k for k in range(len(lines)) if case.status.get(int(lines[k]), "end") not in PASSED_BY]
        lost = not_passed(case.written, path, chain.tip[exact], chain.original.axis[exact], case.axis_length)
        assert not lost, [(int(lines[exact[k]]), case.status.get(int(lines[exact[k]]))) for k in lost]


def test_feeds_keep_their_place(case: Case) -> None:
    for index, path in list(zip(case.moving(), case.paths, strict=True))[::5]:
        chain = case.chains[index]
        complaints = feeds_out_of_place(
            case.written, path, chain.original, chain.feed, case.axis_length, case.tolerance
        )
        assert not complaints, (index, complaints)


def test_built_in_verification_agrees(case: Case, tmp_path: Path) -> None:
    options = ["-e", str(case.tolerance), "-H", str(case.axis_length), "-f", case.written.form, "--method", "global"]
    result = run("smooth", "-", "-o", tmp_path / "o.nc", "-q", *options, data=cl_text(case.chains[::4])[0])
    assert result.returncode == 0, result.stderr.decode()


@pytest.mark.parametrize("sample", ["impeller.cls", "paper_table1.csv"])
@pytest.mark.parametrize("tolerance", ["0.003", "0.04"])
def test_samples_are_verified(sample: str, tolerance: str, tmp_path: Path) -> None:
    source = Path(__file__).parents[1] / "samples" / sample
    report = tmp_path / "r.json"
    options = ("--method", "global", "-e", tolerance, "--report", report, "-q")
    result = run("smooth", source, "-o", tmp_path / "o.nc", *options)
    assert result.returncode == 0, result.stderr.decode()
    assert json.loads(report.read_text())["verification"]["passed"] is True


def test_program_of_a_single_corner_and_of_none() -> None:
    tip = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0]])
    axis = np.tile([0.0, 0, 1], (3, 1))
    settings = cornersmooth.Settings(method="global")
    one = cornersmooth.smooth(cornersmooth.Program.from_poses(tip, axis), settings)
    assert one.runs is not None
    assert len(one.runs) == 1
    assert one.corners.rounded.all()
    none = cornersmooth.smooth(cornersmooth.Program.from_poses(tip[:2], axis[:2]), settings)
    assert none.runs is None


def test_forms_without_long_curves_are_refused(tmp_path: Path) -> None:
    source = Path(__file__).parents[1] / "samples" / "paper_table1.csv"
    for control, form, tcp, instead in (
        ("fanuc", "g6.2", ["--no-tcp"], "cannot run without tool tip control"),
        ("siemens", "bspline", ["--no-tcp"], "cannot run without tool tip control"),
        ("siemens", "poly", [], "has no rotary words"),
        ("heidenhain", "spl", [], "has no rotary words"),
        ("mitsubishi", "g6.2", [], "has no rotary words"),
    ):
        options = ["--control", control, "-f", form, "--machine", "table-ac", *tcp]
        result = run("smooth", source, "-o", tmp_path / "o.nc", "--method", "global", *options)
        assert result.returncode == 2
        assert instead in result.stderr.decode()
        assert "use -f g1" in result.stderr.decode()
