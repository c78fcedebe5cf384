"""Curves of whole runs as they are written: read back with scipy's splines, measured densely, joints looked at."""

from __future__ import annotations

import io
import itertools
import json
from pathlib import Path
from typing import BinaryIO

import numpy as np
import pytest
from scipy.interpolate import BSpline

import cornersmooth
from cornersmooth import Program
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Form, choose_form
from cornersmooth.pipeline import Result
from nc import run_chains
from nc.curve_texts import FORMS, PARTS, H, dense, farthest, original, polynomials, stretches
from nc.run_chains import faults
from oracle.chains import cl_text, random_chains
from oracle.command import run
from oracle.motion import unit
from oracle.share import how_many

SAMPLES = Path(__file__).parents[1] / "samples"


@pytest.mark.parametrize("control", FORMS)
@pytest.mark.parametrize("tolerance", [0.003, 0.05])
def test_random_chains_keep_the_tolerance(control: str, tolerance: float, tmp_path: Path) -> None:
    chains = [chain for chain in random_chains(31, how_many(2, 18), corners=6) if np.ptp(chain.tip, axis=0).any()]
    options = ["--control", control, "-f", FORMS[control][0], "--method", "global", "-e", str(tolerance)]
    out = tmp_path / "o.nc"
    result = run("smooth", "-", "-o", out, "-q", *options, data=cl_text(chains)[0])
    assert result.returncode == 0, result.stderr.decode()  # verified, too
    written = stretches(out.read_text(), control)
    assert len(written) == len(chains)
    for stretch_list, chain in zip(written, chains, strict=True):
        tops = original(chain)
        turn = np.linalg.norm(np.diff(unit(chain.axis), axis=0), axis=1).max()
        slack = H * (2.0 * turn / PARTS) ** 2 / 8  # of the sampled original
        for stretch in stretch_list:
            tip, top = dense(stretch)
            assert farthest(tip, chain.tip) <= tolerance
            assert farthest(top, tops) <= tolerance + slack
    long = sum(len(stretch.points) > 5 for stretch_list in written for stretch in stretch_list)
    assert long > 0.3 * len(chains)


@pytest.mark.parametrize("tolerance", [0.003, 0.05])
def test_polynomials_of_random_chains_keep_the_tolerance(tolerance: float, tmp_path: Path) -> None:
    chains = [chain for chain in random_chains(32, how_many(3, 18), corners=6) if np.ptp(chain.tip, axis=0).any()]
    options = ["--control", "siemens", "-f", "poly", "--method", "global", "-e", str(tolerance)]
    result = run("smooth", "-", "-o", tmp_path / "o.nc", "-q", *options, data=cl_text(chains)[0])
    assert result.returncode == 0, result.stderr.decode()  # verified, too
    written = polynomials((tmp_path / "o.nc").read_text())
    assert len(written) == len(chains)
    for blocks, chain in zip(written, chains, strict=True):
        turn = np.linalg.norm(np.diff(unit(chain.axis), axis=0), axis=1).max()
        places = [dense(block) for block in blocks]
        assert farthest(np.concatenate([tip for tip, _ in places]), chain.tip) <= tolerance
        tops = np.concatenate([top for _, top in places])
        assert farthest(tops, original(chain)) <= tolerance + H * (2.0 * turn / PARTS) ** 2 / 8
    assert sum(block.degree == 3 for blocks in written for block in blocks) > 4 * len(chains)


@pytest.mark.parametrize("number", [4])
def test_chains_as_they_are_run_by_hand(number: int) -> None:
    """SPL: `nc.run_chains` does more of them."""
    assert faults(number, 2) == (2, [])


@pytest.mark.parametrize("number", [1])
def test_chains_run_by_hand_are_judged(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Measured against half of what is asked of the program."""
    whole = run_chains.cornersmooth.postprocess

    def loose(program: Program, target: BinaryIO, settings: cornersmooth.Settings, *, form: Form) -> Result:
        return whole(program, target, settings.but(tolerance=3.0 * settings.tolerance), form=form)

    monkeypatch.setattr(run_chains.cornersmooth, "postprocess", loose)
    assert faults(number, 2)[1]


@pytest.mark.parametrize(("control", "form"), [("heidenhain", "spl"), ("siemens", "poly")])
def test_polynomials_of_an_upright_tool_are_verified_and_fewer(control: str, form: str) -> None:
    rng = np.random.default_rng(1)
    tip = np.cumsum(rng.normal(size=(80, 3)) * 0.5 + np.array([1.0, 0.0, 0.0]), axis=0)
    program = cornersmooth.Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (80, 1)), feed=1000.0)
    blocks = []
    for method in ("global", "proportional"):
        settings = cornersmooth.Settings(method=method, tolerance=0.1)
        chosen = choose_form(control, form, machine=None)
        result = cornersmooth.postprocess(program, io.BytesIO(), settings, form=chosen)
        assert result.verification is not None
        assert result.verification.passed
        blocks.append(result.written.blocks)
    assert blocks[0] < 0.9 * blocks[1]


@pytest.mark.parametrize("control", FORMS)
def test_sections_meet_smoothly_and_are_few(control: str, tmp_path: Path) -> None:
    out = tmp_path / "o.nc"
    options = ["--control", control, "-f", FORMS[control][0], "--method", "global"]
    for tolerance, most in (("0.01", 1.4), ("0.005", 2.5)):  # the closer one has runs of several sections
        result = run("smooth", SAMPLES / "impeller.cls", "-o", out, *options, "-e", tolerance, "-q", "--force")
        assert result.returncode == 0, result.stderr.decode()
        assert out.read_text().count("\n") <= most * 610
    joined = 0
    for curves in stretches(out.read_text(), control):
        for one, other in itertools.pairwise(curves):
            if one.degree == other.degree == 3:
                joined += 1
                ends = [BSpline(s.knots, s.points, 3).derivative(1)(s.knots[at]) for s, at in ((one, -1), (other, 0))]
                size = np.linalg.norm(ends[0])
                # the written digits leave this much
                assert np.linalg.norm(ends[1] - ends[0]) < 0.02 * size
    assert joined >= 6


def test_sections_are_the_curve_of_the_run() -> None:
    from cornersmooth.smoothing.runs.rows import SPANS, section_rows

    program = cornersmooth.read(SAMPLES / "impeller.cls")
    smoothed = cornersmooth.smooth(
        program, cornersmooth.Settings(method="global", tolerance=0.005, round_feed_changes=False)
    )
    runs = smoothed.runs
    assert runs is not None
    rows = section_rows(runs, program)
    assert rows.spline is not None
    begin, points = np.flatnonzero(rows.curve == 1), np.hstack((rows.tip, rows.other))
    assert len(begin) > len(runs)
    assert rows.curve.max() <= SPANS + 3 + 4 <= np.iinfo(np.int8).max  # as rows of a text count them
    gone, run_of, at = 0.0, 0, 0
    first = np.concatenate(([0], np.cumsum(runs.knot_count)))
    for start, end in zip(begin, np.append(begin[1:], len(points)), strict=True):
        knots = np.concatenate((rows.spline[start:end, 0], [rows.spline[end - 1, 2]] * 4)) * 1000.0
        np.testing.assert_allclose(knots, np.round(knots), atol=1e-6)  # three decimals hold them
        section = BSpline(knots, points[start:end], 3)
        own = runs.knot[first[run_of] : first[run_of + 1]]
        control = runs.control[at : at + len(own) + 2]
        whole = BSpline(np.concatenate(([own[0]] * 3, own, [own[-1]] * 3)), control, 3)
        u = np.linspace(0, knots[-1], 50)
        digit = np.finfo(float).eps * np.abs(control).max()  # of coordinates; derivatives are their differences
        for order in range(3):
            np.testing.assert_allclose(
                section.derivative(order)(u) if order else section(u),
                whole.derivative(order)(gone + u) if order else whole(gone + u),
                rtol=1e-9,
                atol=1e-9 * np.abs(whole.derivative(order)(gone + u) if order else 1.0).max()
                + 8.0 * digit / np.diff(own).min() ** order,
            )
        gone += knots[-1]
        if gone >= own[-1]:
            at, run_of, gone = at + len(own) + 2, run_of + 1, 0.0
    assert run_of == len(runs)


def test_a_long_span_beside_short_ones_is_verified(tmp_path: Path) -> None:
    chain = random_chains(4, 6, corners=8)[0]  # beside a sharp corner; the axis turns by 8 degrees in one span
    for control, (form, _) in FORMS.items():
        options = ["--control", control, "-f", form, "--method", "global", "-e", "0.003"]
        result = run("smooth", "-", "-o", tmp_path / f"{control}.nc", "-q", *options, data=cl_text([chain])[0])
        assert result.returncode == 0, result.stderr.decode()


def test_turns_between_knots_far_apart_are_verified(tmp_path: Path) -> None:
    chain = random_chains(5010, 20, corners=8)[1]  # the axis turns by 27 degrees in one segment, with few knots in it
    options = ["-f", "g6.2", "--method", "global", "-e", "0.001", "-H", "50"]
    result = run("smooth", "-", "-o", tmp_path / "o.nc", "-q", *options, data=cl_text([chain])[0])
    assert result.returncode == 0, result.stderr.decode()


@pytest.mark.parametrize(("seed", "row"), [(1000, 35), (1002, 31), (5010, 47)])
def test_long_elements_beside_short_ones_are_no_false_alarm(seed: int, row: int) -> None:
    """Knots stand close at a corner, far apart behind it: the nearest sample is on a short element, the path is not."""
    chain = random_chains(seed, 50, corners=12)[row]
    settings = cornersmooth.Settings(method="global", tolerance=0.001, axis_length=50.0)
    form = choose_form("fanuc", "g6.2", machine=None)
    result = cornersmooth.postprocess(cl_text([chain])[0], io.BytesIO(), settings, form=form)
    assert result.verification is not None
    assert result.verification.passed
    assert result.smoothed.runs is not None


def test_runs_with_steep_turns_are_named_where_curves_are_written() -> None:
    tilt = np.radians([0.0, 5.0, 70.0, 75.0, 80.0])
    tip = np.stack((np.arange(5) * 5.0, [0.0, 1, 0, 1, 0], np.zeros(5)), axis=1)
    axis = np.stack((np.sin(tilt), 0 * tilt, np.cos(tilt)), axis=1)
    program = cornersmooth.Program.from_poses(tip, axis)
    for lines in (True, False):
        settings = cornersmooth.Settings(method="global", round_feed_changes=lines)
        smoothed = cornersmooth.smooth(program, settings)
        told = [finding for finding in smoothed.findings if finding.code == "CS229"]
        assert (smoothed.runs is not None) == lines
        assert [finding.count for finding in told] == ([] if lines else [3])
        assert smoothed.corners.rounded.all()


@pytest.mark.parametrize(
    ("control", "form", "machine", "settings", "used"),
    [
        ("fanuc", "g1", "", {}, "proportional"),
        ("linuxcnc", "g1", "xyzac-trt", {}, "proportional"),
        ("fanuc", "g6.2", "", {}, "global"),
        ("siemens", "bspline", "", {}, "global"),
        ("siemens", "poly", "", {}, "global"),
        ("heidenhain", "spl", "", {}, "global"),
        ("fanuc", "g6.2", "", {"method": "proportional"}, "proportional"),
        ("fanuc", "g1", "", {"method": "global"}, "global"),
    ],
)
def test_the_method_is_that_of_the_form(
    control: str, form: str, machine: str, settings: dict[str, object], used: str
) -> None:
    chain = random_chains(7, 1, corners=6)[0]
    chosen = choose_form(control, form, machine=load_machine(machine) if machine else None)
    program = cornersmooth.read(cl_text([chain])[0])
    smoothed = cornersmooth.smooth(program, cornersmooth.Settings(**settings), form=chosen)  # type: ignore[arg-type]
    assert smoothed.settings.method == used


def test_without_a_form_corners_are_rounded_one_by_one() -> None:
    program = Program.from_poses(np.eye(3), np.tile([0.0, 0.0, 1.0], (3, 1)))
    assert cornersmooth.smooth(program).settings.method == "proportional"


def told(tmp_path: Path, data: bytes, *options: str) -> tuple[list[str], dict[str, object]]:
    """Lines of the terminal that begin with the method, and the summary of the report."""
    report = tmp_path / "r.json"
    result = run("smooth", "-", "-o", tmp_path / "o.nc", "--report", report, "--force", *options, data=data)
    assert result.returncode == 0, result.stderr.decode()
    lines = [line for line in result.stderr.decode().splitlines() if line.startswith("        method")]
    return lines, json.loads(report.read_text())["summary"]


def test_the_method_and_what_it_could_not_do_are_said_in_one_line(tmp_path: Path) -> None:
    """A turn of 65 degrees in one move: curves take its run corner by corner, lines as a whole."""
    poses = [(0, 0, 0), (5, 1, 5), (10, 0, 70), (15, 1, 75), (20, 0, 80)]
    goto = "".join(
        f"GOTO/{x},{y},0,{np.sin(np.radians(tilt)):.6f},0,{np.cos(np.radians(tilt)):.6f}\n" for x, y, tilt in poses
    )
    data = f"UNITS/MM\nLOADTL/1\nSPINDL/900,CLW\nFEDRAT/300,MMPM\n{goto}FINI\n".encode()
    why = "corner rounded by itself: the tool axis turns by more than 30 deg in one move of its run (3 times)"
    lines, summary = told(tmp_path, data, "-f", "g6.2")
    assert lines == [f"        method global; {why}"]
    assert summary["instead"] == [{"count": 3, "text": why.removesuffix(" (3 times)")}]
    lines, summary = told(tmp_path, data, "--method", "global")
    assert lines == ["        method global, 1 run with 3 corners"]
    assert (summary["method"], summary["runs"], summary["corners_in_runs"], summary["instead"]) == ("global", 1, 3, [])
    assert told(tmp_path, data)[0] == ["        method proportional"]


@pytest.mark.parametrize(("options", "said"), [((), False), (("--lines", "dense"), False), (("--lines", "long"), True)])
def test_long_lines_of_runs_are_warned_of_where_the_control_blends(options: tuple[str, ...], said: bool) -> None:
    """Measured on LinuxCNC's controller: docs/dev/linuxcnc.md."""
    goto = "".join(f"GOTO/{x},{x % 2},0,0,0,1\n" for x in range(8))
    data = f"UNITS/MM\nLOADTL/1\nSPINDL/900,CLW\nFEDRAT/300,MMPM\n{goto}FINI\n".encode()
    words = ("--control", "linuxcnc", "--machine", "xyzac-trt", "--method", "global" if said or options else "auto")
    result = run("smooth", "-", *words, *options, data=data)
    assert ("use --method proportional" in result.stderr.decode()) == said


@pytest.mark.parametrize("top", [120.0, 119.999, 119.0])
def test_runs_at_the_limit_of_an_axis_are_rounded_corner_by_corner(top: float) -> None:
    """A of the machine goes to 120 degrees, and the poses with it: the curve of the run would go on."""
    t = np.linspace(0.0, 1.0, 40)
    tilt = np.radians(np.minimum(top, top - 30.0 + 50.0 * t))
    aside = np.where(t < 0.55, 0.5 * np.sin(t / 0.55 * np.pi), 0.0)
    tip = np.stack((60.0 * t, 2.0 * np.sin(9.0 * t), 0.0 * t), axis=1)
    axis = np.stack((np.sin(tilt) * np.sin(aside), -np.sin(tilt) * np.cos(aside), np.cos(tilt)), axis=1)
    program = Program.from_poses(tip, axis, feed=1000.0)
    chosen = choose_form("fanuc", machine=load_machine("table-ac"))
    result = cornersmooth.postprocess(program, io.BytesIO(), cornersmooth.Settings(method="global"), form=chosen)
    assert result.verification is not None
    assert result.verification.passed
    assert (result.smoothed.runs is None) == (top > 119.5)
    assert result.smoothed.corners.rounded.all()
    counts = [finding.count for finding in result.findings if finding.instead]
    assert counts == ([38] if top > 119.5 else [])
