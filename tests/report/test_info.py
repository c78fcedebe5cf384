"""The description of a program, on paths whose numbers can be told by hand, and on real files."""

from __future__ import annotations

import json

import numpy as np
import pytest

from cornersmooth.errors import Finding, SettingsError
from cornersmooth.model import Arcs, Move, Program, Source, Statement
from cornersmooth.report import report_json
from cornersmooth.report.info import describe
from oracle.loops import bytecodes

UP = (0.0, 0.0, 1.0)


def square() -> Program:
    """Rapid, three sides of 10 mm and one of 30, an arc, a repeated pose, a pure rotation by 60 degrees."""
    tip = [(0, 0, 50), (0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0), (0, 40, 0), (0, 40, 0), (0, 40, 0), (10, 50, 0)]
    axis = [UP] * 7 + [(0, np.sin(np.radians(60)), 0.5)] * 2
    kind = [Move.FROM, Move.RAPID, *[Move.LINEAR] * 6, Move.ARC]
    feed = [np.nan, np.nan, 300, 300, 100, 300, 300, np.nan, 300]
    return Program.from_poses(
        tip,
        axis,
        kind=np.array(kind, np.uint8),
        feed=np.array(feed),
        arcs=Arcs(np.array([8]), np.array([[10.0, 40, 7]]), np.array([[0.0, 0, 1]]), np.array([np.pi / 2])),
        statements=(
            Statement(0, 1, "PARTNO", ("SQUARE",)),
            Statement(2, 3, "SPINDL", (1000.0,)),
            Statement(9, 12, "SPINDL", ("OFF",)),
        ),
        source=Source("square.cls", "apt", "nx"),
        findings=(Finding("CS199", "note", 4, "said before"),),
    )


def test_counts_and_lengths_of_a_path_by_hand():
    info = describe(square(), 0.01, 10.0)
    assert [info[key] for key in "name format dialect units poses".split()] == ["square.cls", "apt", "nx", "mm", 9]
    assert list(info["statements"].items()) == [("SPINDL", 2), ("PARTNO", 1)]
    motion = info["motion"]
    assert motion["moves"] == {"from": 1, "rapid": 1, "linear": 6, "arc": 1}
    assert (motion["chains"], motion["longest_chain_poses"]) == (1, 7)
    assert (motion["feed_length_mm"], motion["rapid_length_mm"]) == (60, 50)
    assert (motion["box_min_mm"], motion["box_max_mm"]) == ([0, 0, 0], [10, 50, 50])
    assert (motion["feeds_mm_per_min"], motion["feeds_mm_per_rev"]) == ([100, 300], [])
    assert motion["feed_moves_without_feed"] == 1
    assert motion["segment_length_mm"] == {"count": 6, "min": 0, "p5": 0, "p50": 10, "p95": 25, "max": 30}
    assert [one["code"] for one in info["findings"]] == ["CS199"]


def test_axis_and_arcs_by_hand():
    info = describe(square(), 0.01, 10.0)
    axis = info["axis"]
    assert axis["kind"] == "simultaneous"
    assert (axis["translations"], axis["rotations"], axis["repetitions"]) == (4, 1, 1)
    assert axis["step_deg"]["count"] == 1
    assert axis["step_deg"]["max"] == pytest.approx(60)
    assert axis["tilt_deg"]["max"] == pytest.approx(60)
    assert (info["arcs"]["count"], info["arcs"]["helices"]) == (1, 0)
    assert info["arcs"]["radius_mm"]["max"] == pytest.approx(10)
    assert info["arcs"]["sweep_deg"]["max"] == pytest.approx(90)


def test_corners_and_what_limits_them_by_hand():
    corners = describe(square(), 0.01, 10.0)["corners"]
    assert corners["count"] == 5
    assert corners["tip_turn_deg"]["count"] == 3  # the repeated pose and the corner at the pure rotation have no turn
    assert (corners["tip_turn_deg"]["min"], corners["tip_turn_deg"]["max"]) == (pytest.approx(90), pytest.approx(90))
    assert corners["sharp"] == 3
    assert corners["not_smoothed"]["duplicate"] == 1
    assert corners["smoothed"] + sum(corners["not_smoothed"].values()) == corners["count"]
    assert corners["limited_by_tolerance"] == corners["smoothed"]
    assert corners["deviation_mm"]["max"] == pytest.approx(0.01, rel=0.03)
    wide = describe(square(), 5.0, 10.0)["corners"]
    assert wide["limited_by_segment"] > 0
    assert wide["limited_by_segment"] + wide["limited_by_tolerance"] == wide["smoothed"]


@pytest.mark.parametrize(
    ("axis", "kind", "expected"),
    [
        ([UP, UP, UP, UP], [1, 2, 2, 2], "fixed"),
        ([UP, UP, (0, 1, 0), (0, 1, 0)], [1, 2, 1, 2], "indexed"),
        ([UP, UP, (0, 1, 0), (0, 1, 0)], [1, 2, 2, 2], "simultaneous"),
        ([UP, (1e-6, 0, 1), UP, (0, 1e-6, 1)], [1, 2, 2, 2], "fixed"),
    ],
)
def test_kind_of_axis_motion(axis: list[tuple[float, float, float]], kind: list[int], expected: str):
    tip = np.column_stack((np.arange(4.0), np.zeros((4, 2))))
    assert describe(Program.from_poses(tip, axis, kind=np.array(kind)), 0.01, 10)["axis"]["kind"] == expected


def test_next_to_nothing_can_be_described():
    info = describe(Program.from_poses(np.zeros((1, 3)), np.tile(UP, (1, 1))), 0.01, 10)
    assert info["poses"] == 1
    assert info["motion"]["segment_length_mm"] == {"count": 0, **dict.fromkeys(("min", "p5", "p50", "p95", "max"))}
    json.loads(report_json(info))


def test_helices_are_told_from_arcs():
    program = Program.from_poses(
        [(10, 0, 0), (10, 0, 3)],
        [UP, UP],
        kind=np.array([Move.LINEAR, Move.ARC]),
        arcs=Arcs(np.array([1]), np.zeros((1, 3)), np.array([[0.0, 0, 1]]), np.array([2 * np.pi])),
    )
    assert describe(program, 0.01, 10)["arcs"]["helices"] == 1


def test_json_holds_it_all():
    info = describe(square(), 0.02, 25.0)
    contents = json.loads(report_json(info))
    assert contents["schema"] == "cornersmooth-info/2"
    assert contents["corners"]["tolerance_mm"] == 0.02
    assert contents["corners"]["axis_length_mm"] == 25
    assert contents["statements"] == {"SPINDL": 2, "PARTNO": 1}
    assert contents["findings"] == [{"code": "CS199", "severity": "note", "line": 4, "text": "said before", "count": 1}]
    assert contents["motion"]["segment_length_mm"]["p50"] == 10


def test_settings_out_of_bounds_are_refused():
    with pytest.raises(SettingsError, match="tolerance"):
        describe(square(), 0.0, 10.0)


def test_poses_are_described_without_a_loop_over_them():
    u = np.linspace(0, 300, 100_000)
    tip = np.stack((u, 20 * np.sin(u), np.cos(u)), axis=1)
    axis = np.stack((np.sin(u / 10) / 2, np.cos(u / 10) / 2, np.ones_like(u)), axis=1)
    program = Program.from_poses(tip, axis)
    assert describe(program, 0.01, 10)["corners"]["count"] == 99_998
    assert bytecodes(lambda: describe(program, 0.01, 10)) < len(program)
