"""The JSON and CSV reports of a smoothed program (docs/smooth.md)."""

from __future__ import annotations

import csv
import io
import json
from dataclasses import replace

import numpy as np
import pytest

from cornersmooth import Program, Result, Settings, postprocess, smooth
from cornersmooth.errors import Finding
from cornersmooth.report import corners_csv, report_json

COLUMNS = (
    "corner,line,x,y,z,tip_angle_deg,axis_angle_deg,tip_length_in_mm,tip_length_out_mm,axis_length_in_mm,"
    "axis_length_out_mm,tip_error_mm,axis_error_mm,orientation_error_deg,curvature_max_per_mm,limited_by,status"
)


@pytest.fixture
def program() -> Program:
    """A square with a repeated corner, a tilting axis and a reversal."""
    tips = [[0, 0, 0], [10, 0, 0], [10, 10, 0], [10, 10, 0], [0, 10, 0], [10, 10, 0]]
    axes = [[0, 0, 1], [0, 0, 1], [0.1, 0, 1], [0.1, 0, 1], [0.1, 0, 1], [0.1, 0, 1]]
    return Program.from_poses(np.array(tips, float), np.array(axes, float), feed=1000.0)


def table(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def written(program: Program, settings: Settings) -> Result:
    return postprocess(program, io.BytesIO(), settings, verify=False)


def test_json_has_the_agreed_keys_and_counts(program):
    made = written(program, Settings(tolerance=0.02))
    finding = Finding("CS310", "warning", 7, "X is not translated", 3)
    contents = json.loads(report_json(replace(made, findings=(finding,)).report()))
    assert contents["schema"] == "cornersmooth-report/2"
    judged = {"verdict", "verdict_text", "to_check", "left_out", "not_verified"}
    assert (
        set(contents)
        == set("schema kind made_by input program settings times findings summary worst sharp".split()) | judged
    )
    assert (contents["verdict"], contents["to_check"]) == ("NOT VERIFIED", 1)
    given = contents["input"]
    assert (given["poses"], given["chains"], given["feed_moves"], given["units"]) == (6, 1, 6, "mm")
    summary = contents["summary"]
    assert summary["corners"] == 4
    assert summary["smoothed"] == 2
    assert summary["not_smoothed"] == {"reversal": 1, "duplicate": 1}
    assert summary["limited_by_tolerance"] + summary["limited_by_segment"] == 2
    assert summary["blocks_in"] == 6
    assert summary["blocks_out"] == made.written.blocks > 6
    assert summary["length_mm"] == pytest.approx(40.0)
    assert contents["findings"] == [
        {"code": "CS310", "severity": "warning", "line": 7, "text": "X is not translated", "count": 3, "to_check": True}
    ]
    assert contents["settings"]["tolerance_mm"] == 0.02
    assert len(contents["worst"]) == 2
    assert list(contents["worst"][0]) == COLUMNS.split(",")


def test_csv_has_a_row_for_every_corner(program):
    smoothed = smooth(program, Settings(tolerance=0.02))
    text = "".join(corners_csv(smoothed))
    assert text.splitlines()[0] == COLUMNS
    rows = table(text)
    assert [row["status"] for row in rows] == ["smoothed", "smoothed", "duplicate", "reversal"]
    assert [row["line"] for row in rows] == ["2", "3", "4", "5"]
    first = rows[0]
    assert float(first["tip_angle_deg"]) == pytest.approx(90.0)
    assert float(first["tip_error_mm"]) == pytest.approx(smoothed.corners.tip_error[0], rel=1e-9)
    assert float(rows[3]["tip_angle_deg"]) == pytest.approx(180.0)
    assert float(rows[3]["tip_length_in_mm"]) == 0.0


def test_lengths_and_curvature_are_those_of_the_closed_form():
    tips = np.array([[-50.0, 0, 0], [0, 0, 0], [0, 50.0, 0]])
    smoothed = smooth(Program.from_poses(tips, np.tile([0.0, 0, 1], (3, 1))), Settings(tolerance=0.05))
    (row,) = table("".join(corners_csv(smoothed)))
    beta = np.pi / 4
    length = 3 * 0.05 / np.sin(beta)
    assert float(row["tip_length_in_mm"]) == pytest.approx(length, rel=1e-8)
    assert float(row["curvature_max_per_mm"]) == pytest.approx(
        2 * np.sin(beta) / (length * np.cos(beta) ** 2), rel=1e-8
    )
    assert row["limited_by"] == "tolerance"


def test_the_papers_method_adds_what_its_synchronisation_leaves(program):
    smoothed = smooth(program, Settings(tolerance=0.02, method="zhang2016"))
    rows = table("".join(corners_csv(smoothed)))
    smoothed_row = next(row for row in rows if row["status"] == "smoothed")
    assert float(smoothed_row["sync_residual_mm"]) >= 0.0
    assert {"joint_jump_in_deg", "joint_jump_out_deg"} <= set(rows[0])
    summary = json.loads(report_json(written(program, smoothed.settings).report()))["summary"]
    assert summary["max_sync_residual_mm"] >= 0.0
    assert summary["max_joint_jump_deg"] >= 0.0


def test_a_program_without_corners_has_an_empty_report():
    made = written(Program.from_poses(np.zeros((1, 3)), np.array([[0.0, 0, 1]])), Settings())
    assert "".join(corners_csv(made.smoothed)) == COLUMNS + "\n"
    contents = json.loads(report_json(made.report()))
    assert contents["summary"]["max_tip_error_mm"] == 0.0
    assert contents["worst"] == []


@pytest.mark.parametrize("count", [3, 22, 60])
def test_the_worst_corners_are_found_some_at_a_time(monkeypatch, count):
    """By the distances of all corners."""
    from cornersmooth.report import tables
    from cornersmooth.report.tables import path_distances

    monkeypatch.setattr(tables, "_TOGETHER", 3)
    steps = np.random.default_rng(count).normal(size=(count, 3))
    smoothed = smooth(Program.from_poses(np.cumsum(steps, axis=0), np.tile([0.0, 0, 1], (count, 1))))
    tip_error, axis_error, worst = tables.worst_corners(smoothed)
    rows = np.flatnonzero(smoothed.corners.rounded)
    tip, axis_point = path_distances(smoothed, rows, dense=True)
    larger = np.maximum(tip, axis_point)
    assert tip_error == tip.max()
    assert axis_error == axis_point.max()
    assert worst.tolist() == rows[np.lexsort((rows, -larger))][:20].tolist()
