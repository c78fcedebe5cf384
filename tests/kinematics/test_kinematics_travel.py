"""Where the linear axes go, and what is said of it: travel, and a machine at a pose."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest

from cornersmooth import Program, Settings
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import check_travel, load_machine, machine_names, nose_position, tool_axis
from cornersmooth.kinematics.posed import parse_pose, pose_facts, pose_lines
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess
from oracle.command import run

SAMPLES = Path(__file__).parents[2] / "samples" / "machines"


def turn(axis, degrees):
    """Matrix of a right-handed turn about a coordinate axis."""
    sine, cosine = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    if axis == "A":
        return np.array([[1, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    if axis == "B":
        return np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    return np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])


def test_the_nose_over_a_trunnion():
    # the cradle turns the table the other way than the tool is seen to turn; the axes of the machine follow the part
    machine = load_machine(SAMPLES / "trunnion-ac.toml")
    cradle, table = machine.axes[1].point, machine.axes[0].point
    for a, c in ((0, 0), (30, 0), (-50, 70), (90, -120)):
        tip = np.array([12.0, -7.0, 31.0])
        part = turn("C", -c) @ (tip + machine.part_zero - table) + table
        part = turn("A", -a) @ (part - cradle) + cradle
        expected = part + [0.0, 0.0, machine.tool_length]
        found = nose_position(machine, tip[None], np.array([[c, a]], float))[0]
        np.testing.assert_allclose(found, expected, atol=1e-9)


def test_the_nose_of_a_fork_head():
    machine = load_machine(SAMPLES / "fork-head.toml")
    lever = 245.0 + machine.tool_length
    for a, c in ((0, 0), (30, 0), (-50, 70), (90, -120)):
        tip = np.array([[12.0, -7.0, 31.0]])
        axis = turn("C", c) @ turn("A", a) @ [0.0, 0.0, 1.0]
        np.testing.assert_allclose(tool_axis(machine, np.array([[c, a]], float))[0], axis, atol=1e-12)
        pivot = tip[0] + machine.part_zero + lever * axis
        found = nose_position(machine, tip, np.array([[c, a]], float))[0]
        np.testing.assert_allclose(found, pivot - [0.0, 0.0, 245.0], atol=1e-9)


def test_what_is_beyond_the_travel_is_said_with_its_line():
    machine = load_machine(SAMPLES / "trunnion-ac.toml")
    tip = np.array([[0.0, 0.0, 0.0], [340.0, 0.0, 0.0], [350.0, 0.0, 0.0]])
    angles = np.zeros((3, 2))
    check_travel(machine, tip[:1], angles[:1], np.array([7]))
    with pytest.raises(
        InputError,
        match=r"^part.cls:8: error\[\w+\]: X of trunnion-ac would have to go to 340.000 mm, its travel .* 2 positions",
    ):
        check_travel(machine, tip, angles, np.array([7, 8, 9]), "part.cls")
    # turned by C the same point leaves Y, and the lower end counts, too
    with pytest.raises(InputError, match=r"Y of trunnion-ac would have to go to -340.000 mm, its travel ends at -325 "):
        check_travel(machine, tip[1:2], np.array([[90.0, 0.0]]), np.array([8]))
    check_travel(load_machine("table-ac"), 1e6 * tip, angles, np.array([7, 8, 9]))


@pytest.mark.parametrize("tcp", [True, False])
def test_travel_is_checked_with_and_without_tip_control(tcp):
    machine = load_machine(SAMPLES / "trunnion-ac.toml")
    x = np.arange(0.0, 30.0, 2.0)
    lean = np.radians(1.0 * np.arange(len(x)))
    axis = np.stack((0 * x, -np.sin(lean), np.cos(lean)), axis=1)
    tip = np.stack((x, np.where(np.arange(len(x)) % 2, 1.0, 0.0), 0 * x), axis=1)
    form = choose_form("fanuc", machine=machine, tcp=tcp)
    inside = Program.from_poses(tip, axis, feed=1000.0)
    assert postprocess(inside, io.BytesIO(), Settings(), form=form).verification.passed
    beyond = Program.from_poses(tip + [300.0, 0.0, 0.0], axis, feed=1000.0, line=np.arange(101, 101 + len(x)))
    with pytest.raises(InputError, match=r":114: error\[\w+\]: X of trunnion-ac would have to go to 32\d\.\d+ mm"):
        postprocess(beyond, io.BytesIO(), Settings(), form=form)


def test_poses_are_read():
    machine = load_machine("table-ac")
    whole = {"A": 30.0, "C": 45.0, "X": 0.0, "Y": 0.0, "Z": 0.0}
    for text in ("A30,C45", "C45 A30", "a=30, c=45", "30,45", "A+3e1;C45.0"):
        assert parse_pose(machine, text) == whole
    assert parse_pose(machine, "A30") == {**whole, "C": 0.0}
    assert parse_pose(machine, "A30,C45,X-.5,Z5") == {**whole, "X": -0.5, "Z": 5.0}
    for wrong in ("", "B3", "A30,A31", "30", "30,45,1", "A", "A30C45x", "A30,45", "nan,0"):
        with pytest.raises(SettingsError, match=r"is no pose of table-ac.*\n.*as in A30,C45"):
            parse_pose(machine, wrong)


@pytest.mark.parametrize("name", machine_names())
def test_poses_are_described(name):
    machine = load_machine(name)
    angles = {axis.name: 20.0 + 5.0 * index for index, axis in enumerate(machine.axes)}
    text = "\n".join(pose_lines(pose_facts(machine, {**angles, "X": 1.0, "Y": 2.0, "Z": 3.0})))
    given = np.array([[angles[axis] for axis in machine.names]])
    vector = [float(word) for word in re.search(r"tool vector +I(\S+) J(\S+) K(\S+)", text).groups()]
    np.testing.assert_allclose(vector, tool_axis(machine, given)[0], atol=1e-7)
    other = dict(re.findall(r"([ABC])(-?[\d.]+)", re.search(r"same tool vector (.*) deg", text)[1]))
    again = np.array([[float(other[axis]) for axis in machine.names]])
    np.testing.assert_allclose(tool_axis(machine, again), tool_axis(machine, given), atol=1e-5)
    assert np.abs(again - given).max() > 1.0


def test_a_pose_says_what_does_not_allow_it():
    machine = load_machine(SAMPLES / "trunnion-bc.toml")
    text = "\n".join(pose_lines(pose_facts(machine, parse_pose(machine, "B-40,Y-300"))))
    assert "beyond the limits: B goes from -35 to 120 deg" in text
    assert "beyond the travel: Y goes from -510 to 0 mm" in text
    assert "at the pole: C does not turn the tool axis" in "\n".join(
        pose_lines(pose_facts(machine, parse_pose(machine, "B0")))
    )


def test_the_command_describes_a_pose():
    done = run("machines", SAMPLES / "fork-head.toml", "--pose", "A90")
    assert done.returncode == 0
    assert b"tool vector       I0.0000000 J-1.0000000 K0.0000000" in done.stdout
    assert run("machines", "--pose", "A90").returncode == 2
    assert run("machines", "table-ac", "--pose", "A90", "--table").returncode == 2
    wrong = run("machines", "table-ac", "--pose", "B9")
    assert wrong.returncode == 2
    assert b"'B9' is no pose of table-ac: B9\nhint: write angles" in wrong.stderr
