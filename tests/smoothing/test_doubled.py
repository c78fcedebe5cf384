"""Poses that are almost doubled are one corner, and every corner that turns and is not rounded is counted."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest

from cornersmooth import pipeline
from cornersmooth.errors import Verdict
from cornersmooth.feedrate import Limits, plan
from cornersmooth.model import Keep, Program, Statement, Status
from cornersmooth.nc import choose_form
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.smoothing.construction import one_corner_each
from oracle.nc_text import Line, parse

TOLERANCE = 0.01
#: how far a pose lies beside the one before, mm
BESIDE = (1e-8, 1e-6, 1e-5, 1e-4, 3.5e-4, 6e-4, 1e-3, 1.2e-3)
FORMS = ("g1", "g6.2")


def wave(count: int = 24) -> Program:
    """A path whose tip and axis turn by 4 to 30 degrees at every pose."""
    s = np.arange(count, dtype=float)
    tip = np.stack((1.6 * s, 6.0 * np.sin(0.5 * s), 2.0 * np.cos(0.9 * s)), axis=1)
    axis = np.stack((0.3 * np.sin(0.4 * s), 0.2 * np.cos(0.6 * s), np.ones(count)), axis=1)
    return Program.from_poses(tip, axis, feed=1200.0)


def doubled(program: Program, beside: float) -> Program:
    """Each pose followed by one beside it, in all three coordinates."""
    tip = np.repeat(program.tip, 2, axis=0)
    tip[1::2] += beside
    return Program.from_poses(tip, np.repeat(program.axis, 2, axis=0), feed=1200.0)


@pytest.mark.parametrize("method", ["proportional", "global", "zhang2016"])
@pytest.mark.parametrize("beside", BESIDE)
def test_as_many_corners_are_rounded_as_without_the_doubles(method: str, beside: float):
    settings = Settings(tolerance=TOLERANCE, method=method, tip_resolution=1e-4, axis_point_resolution=1e-4)
    rounded = smooth(wave(), settings).corners.rounded.sum()
    corners = smooth(doubled(wave(), beside), settings).corners
    assert corners.rounded.sum() >= rounded - (2 if method == "zhang2016" else 0)  # whose corners may stray
    assert not (corners.status == Status.STRAIGHT).any()


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("beside", BESIDE)
def test_programs_keep_the_tolerance_about_all_poses(form: str, beside: float):
    program = doubled(wave(), beside)
    made = pipeline.postprocess(program, io.BytesIO(), Settings(tolerance=TOLERANCE), form=choose_form("fanuc", form))
    assert made.verdict is Verdict.PASSED
    assert made.report()["summary"]["sharp"] == 0
    assert made.report()["summary"]["smoothed"] == len(wave()) - 2


@pytest.mark.parametrize("beside", [1e-6, 1e-4, 1e-3])
def test_the_planned_time_is_that_without_the_doubles(beside: float):
    limits = Limits(accel=1000.0, jerk=5000.0)
    settings = Settings(tolerance=TOLERANCE, method="proportional")
    time = plan(smooth(wave(), settings), limits).total
    assert plan(smooth(doubled(wave(), beside), settings), limits).total <= 1.05 * time


def test_one_doubled_pose_takes_nothing_off_other_corners():
    program = wave()
    beside = program.tip[11] + [0.001, 0.0, 0.0]
    one = Program.from_poses(
        np.insert(program.tip, 12, beside, axis=0), np.insert(program.axis, 12, program.axis[11], axis=0), feed=1200.0
    )
    settings = Settings(tolerance=TOLERANCE, method="proportional")
    alone, corners = smooth(program, settings).corners, smooth(one, settings).corners
    assert corners.trim_in[:8] == pytest.approx(alone.trim_in[:8], rel=1e-9)
    assert corners.trim_out[14:] == pytest.approx(alone.trim_out[13:], rel=1e-9)
    assert alone.trim_in[10] > corners.trim_in[10] > 0.9 * alone.trim_in[10]


def test_errors_count_what_poses_were_moved_by():
    smoothed = smooth(doubled(wave(), 1e-3), Settings(tolerance=TOLERANCE, method="proportional"))
    shift = 1e-3 * np.sqrt(3.0) / 2.0
    tight = smoothed.corners.tip_error[smoothed.corners.smoothed].max()
    assert shift < tight <= TOLERANCE
    # the pose before the last is moved onto the last, which is passed exactly
    assert smoothed.settings.pose_shift == pytest.approx(2.0 * shift)


def test_what_must_be_passed_stays_where_it_is():
    program = doubled(wave(), 1e-3)
    keep = program.keep.copy()
    keep[21] = Keep.CONTRADICTION
    feed = program.feed.copy()
    feed[31:] = 900.0
    stop = (Statement(12, 1, "COOLNT", ("ON",), "COOLNT/ON"), Statement(17, 1, "PPRINT", ("WORDS",), "PPRINT/WORDS"))
    program = replace(program, keep=keep, feed=feed, statements=stop)
    moved, _ = one_corner_each(program, Settings(tolerance=TOLERANCE))
    stays = np.flatnonzero((moved.tip == program.tip).all(axis=1))
    assert {0, 11, 21, 30, len(program) - 1} <= {*stays.tolist()}
    assert np.array_equal(moved.tip[10], program.tip[11])  # those beside them are moved onto them
    assert np.array_equal(moved.tip[31], program.tip[30])
    assert np.array_equal(moved.tip[16], moved.tip[17])  # a comment pins nothing
    assert moved.statements == program.statements


def test_poses_of_a_dense_path_stay():
    s = np.linspace(0.0, 1.0, 400)
    tip = np.stack((s, 0.1 * s * s, 0.0 * s), axis=1)  # 0.0025 mm apart
    program = Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (400, 1)))
    settings = Settings(tolerance=TOLERANCE, tip_resolution=1e-4)
    assert one_corner_each(program, settings)[0] is program


def turns_of_text(text: bytes) -> np.ndarray:
    """Degrees by which the lines of a program turn at each of their ends."""
    points = np.array(
        [[block.end[k] for k in range(3)] for block in parse(text, "g1").blocks if isinstance(block, Line)]
    )
    step = np.diff(points, axis=0)
    step = step[np.linalg.norm(step, axis=1) > 0.0]
    step /= np.linalg.norm(step, axis=1, keepdims=True)
    return np.degrees(np.arccos(np.clip((step[1:] * step[:-1]).sum(axis=1), -1.0, 1.0)))


CORNER = {
    "two stops 1e-4 mm apart": (1e-4, (3, 4)),
    "a stop, and a pose 1e-4 mm beside": (1e-4, (3,)),
    "no stop": (1e-4, ()),
    "stops 0.002 mm apart": (2e-3, (3, 4)),
    "far apart": (0.5, (3,)),
}


@pytest.mark.parametrize("case", CORNER)
def test_the_sharp_corners_are_those_of_the_written_program(case: str):
    beside, stops = CORNER[case]
    tip = np.array([[0, 0, 0], [5, 0, 0], [10, 0, 0], [12, 9, 0], [12 + beside, 9, 0], [22, 18, 0], [32, 18, 0]], float)
    statements = tuple(Statement(pose + 1, 1, "COOLNT", ("ON",), "COOLNT/ON") for pose in stops)
    program = Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (7, 1)), feed=500.0, statements=statements)
    target = io.BytesIO()
    made = pipeline.postprocess(program, target, Settings(tolerance=0.02), form=choose_form("fanuc", "g1"))
    turns = turns_of_text(target.getvalue())
    contents = made.report()
    assert made.verdict is Verdict.PASSED
    assert contents["summary"]["sharp"] == np.count_nonzero(turns > 20.0)  # of the 40 to 80 degrees of corners
    assert len(contents["sharp"]) == contents["summary"]["sharp"]
