"""Machines: the built-in ones, and what is said about files that describe none."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.kinematics import load_machine, machine_names, machine_table, parse_machine
from oracle.messages import one_line

PLAIN = """
name = "mine"
preferred = "B-"
tool_length = 120
part_zero = [1, 2, 3]
[[axis]]
name = "C"
carrier = "table"
direction = [0, 0, 2]
point = [10, 0, 0]
positive = "table"
limits = [-360, 360]
[[axis]]
name = "B"
carrier = "head"
direction = [0, 1, 0]
"""


def test_built_in_machines_load_and_describe_themselves():
    names = machine_names()
    assert set(names) >= {
        "xyzac-trt",
        "xyzbc-trt",
        "table-ac",
        "table-bc",
        "head-table-bc",
        "head-ac",
        "nutated-bc",
    }
    for name in names:
        machine = load_machine(name)
        text = machine.describe()
        assert machine.name == name
        assert text.startswith(f"{name}: {machine.description}")
        assert all(f"\n  {axis.name} in the {axis.carrier}" in text for axis in machine.axes)
    assert load_machine("head-ac").kind == "head-head"
    assert load_machine("nutated-bc").kind == "table-head"


def test_file_is_read_whole(tmp_path: Path):
    path = tmp_path / "mine.toml"
    path.write_text(PLAIN, encoding="utf-8")
    machine = load_machine(path)
    assert machine == load_machine(str(path))
    assert machine.names == ("C", "B")
    assert machine.preferred == ("B", -1.0)
    assert machine.axes[0].sign == -1
    np.testing.assert_array_equal(machine.axes[0].unit, [0, 0, 1])
    np.testing.assert_array_equal(machine.limits, [[-360, 360], [-np.inf, np.inf]])
    assert "positive turns the table" in machine.describe()
    assert "B in the head, nearest to the tool: about (0, 1, 0) through (0, 0, 0) mm, without end" in machine.describe()


def test_file_without_name_takes_that_of_the_file(tmp_path: Path):
    path = tmp_path / "mill.toml"
    path.write_text(PLAIN.replace('name = "mine"', ""), encoding="utf-8")
    assert load_machine(path).name == "mill"


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("tool_length", "tool_lenght", "m.toml: error: unknown key tool_lenght; did you mean tool_length?"),
        ("direction = [0, 0, 2]", "dirction = [0, 0, 2]", "unknown key axis 1.dirction; did you mean direction?"),
        ("part_zero", "zzz", "unknown key zzz; known keys are name, description, preferred"),
        ("[0, 0, 2]", "[0, 0, 0]", "rotary axis C: direction is zero; give a vector along the axis"),
        ("[0, 0, 2]", "[0, 0]", "axis 1.direction is [0, 0]; give three numbers in brackets"),
        ("[0, 0, 2]", "[0, 0, nan]", "rotary axis C: direction is not a point of space"),
        ("[0, 0, 2]", "[0, 1, 0]", "machine mine: C and B are parallel; give two different directions"),
        ("[0, 1, 0]", "[0, 0, 1]", "machine mine: C and B are parallel"),
        ('name = "B"', 'name = "C"', "machine mine: both rotary axes are called C"),
        ('name = "B"', 'name = "Q"', "rotary axis name 'Q' is not an address; use A, B or C"),
        ('carrier = "table"', 'carrier = "bed"', "rotary axis C: carrier is 'bed'; use table or head"),
        ('"B-"', '"A-"', "machine mine: preferred names 'A'; use C+, C-, B+ or B-"),
        ('"B-"', '"negative"', "preferred is 'negative'; write an axis and its sign"),
        ("[-360, 360]", "[360, -360]", "rotary axis C: limits are 360 and -360; give the lower one first"),
        ("[-360, 360]", "360", "axis 1.limits is 360; write limits = [lowest, highest] in degrees"),
        ("120", '"long"', "tool_length is 'long'; give a number"),
        ("120", "-1", "machine mine: tool_length is -1; give 0 mm or more"),
        ('positive = "table"', 'positive = "left"', "rotary axis C: positive is 'left'; use tool or table"),
        ('carrier = "head"', 'carrier = "head"\npositive = "table"', "rotary axis B: positive is 'table'; use tool"),
        ('carrier = "head"\n', "", "axis 2.carrier is missing; add carrier = ..."),
        ("[1, 2, 3]", "[1, 2, 3", "m.toml: error: not TOML: "),
        (
            'carrier = "table"\ndirection = [0, 0, 2]\npoint = [10, 0, 0]\npositive = "table"',
            'carrier = "head"\ndirection = [0, 0, 2]',
            None,
        ),
    ],
)
def test_what_is_wrong_is_said(old: str, new: str, message: str | None):
    assert old in PLAIN
    text = PLAIN.replace(old, new)
    if message is None:
        assert parse_machine(text).kind == "head-head"
        return
    with pytest.raises(SettingsError) as caught:
        parse_machine(text, file="m.toml")
    assert message in one_line(caught.value)
    assert one_line(caught.value).startswith("m.toml: error: ")


def test_order_of_axes_is_checked():
    text = PLAIN.replace('carrier = "table"', 'carrier = "HEAD"').replace('carrier = "head"', 'carrier = "table"')
    text = text.replace('"HEAD"', '"head"').replace('positive = "table"\n', "")
    with pytest.raises(SettingsError, match="the head axis C comes before the table axis B\nhint: list the axes from"):
        parse_machine(text)


def test_axis_along_the_tool_is_refused():
    with pytest.raises(SettingsError, match="C turns the tool about itself\nhint: check the directions"):
        parse_machine(
            '[[axis]]\nname = "A"\ncarrier = "table"\ndirection = [1, 0, 0]\n'
            '[[axis]]\nname = "C"\ncarrier = "table"\ndirection = [0, 0, 1]\n'
        )


def test_number_of_axes_is_checked():
    axis = '[[axis]]\nname = "A"\ncarrier = "table"\ndirection = [1, 0, 0]\n'
    with pytest.raises(SettingsError, match=r"3 rotary axes are described\nhint: write \[\[axis\]\] twice at most"):
        parse_machine(3 * axis)
    assert parse_machine(axis).names == ("A",)
    assert parse_machine("axis = []").names == ()


def test_unknown_names_and_files(tmp_path: Path):
    with pytest.raises(SettingsError, match=r"unknown machine 'xyzac-tt'\nhint: did you mean xyzac-trt\?"):
        load_machine("xyzac-tt")
    with pytest.raises(SettingsError, match=r"missing\.toml: error\[\w+\]: machine file cannot be read: No such file"):
        load_machine(tmp_path / "missing.toml")
    binary = tmp_path / "binary.toml"
    binary.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SettingsError, match="not UTF-8 text"):
        load_machine(binary)


DYNAMIC = PLAIN + "\n[dynamics.B]\njerk = 900\n[dynamics.X]\nvelocity = 6000\nacceleration = 2500\n"


def test_dynamics_are_read_and_told():
    machine = parse_machine(DYNAMIC)
    assert [item.name for item in machine.dynamics] == ["X", "B"]
    assert machine.dynamics[0].per_second == (100.0, 2500.0, np.inf)
    assert machine.dynamics[1].per_second == (np.inf, np.inf, 900.0)
    assert "X up to 6000 mm/min, 2500 mm/s2" in machine.describe()
    assert "B up to 900 deg/s3" in machine.describe()
    assert parse_machine(PLAIN).dynamics == ()
    for name in machine_names():
        built_in = load_machine(name)
        assert [item.name for item in built_in.dynamics] == ["X", "Y", "Z", *built_in.names]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[dynamics.B]", "[dynamics.A]", "unknown key dynamics.A; known keys are X, Y, Z, C, B"),
        ("jerk = 900", "jerk = 0", "dynamics of B: jerk is 0; give a positive number"),
        ("jerk = 900", "jerk = nan", "dynamics of B: jerk is nan; give a positive number"),
        ("jerk = 900", 'jerk = "soft"', "dynamics.B.jerk is 'soft'; give a number"),
        ("velocity", "velocty", "unknown key dynamics.X.velocty; did you mean velocity?"),
        ("[dynamics.B]\njerk", "[dynamics]\njerk", "unknown key dynamics.jerk; known keys are X, Y, Z, C, B"),
    ],
)
def test_what_is_wrong_in_dynamics_is_said(old: str, new: str, message: str):
    assert old in DYNAMIC
    with pytest.raises(SettingsError) as caught:
        parse_machine(DYNAMIC.replace(old, new), file="m.toml")
    assert message in one_line(caught.value)


SAMPLES = sorted((Path(__file__).parents[2] / "samples" / "machines").glob("*.toml"))


def test_the_samples_are_there():
    kinds = {path.stem: load_machine(path).kind for path in SAMPLES}
    assert kinds == {
        "fork-head": "head-head",
        "four-axis-a": "table",
        "nutated-head-table": "table-head",
        "three-axis": "",
        "trunnion-ac": "table-table",
        "trunnion-bc": "table-table",
    }


@pytest.mark.parametrize("path", SAMPLES, ids=lambda path: path.stem)
def test_samples_are_whole(path: Path):
    machine = load_machine(path)
    assert machine.name == path.stem
    assert [item.name for item in machine.travel] == ["X", "Y", "Z"]
    assert {item.name for item in machine.dynamics} == {*"XYZ", *machine.names}
    assert machine.tool_length > 0
    told = machine.describe()
    for item in machine.travel:
        assert f"\n  {item.name} from {item.low:g} to {item.high:g} mm" in told
    assert "zero of the part at (" in told


@pytest.mark.parametrize("name", machine_names())
def test_every_key_of_a_table_has_a_comment(name: str):
    keys = set()
    for line in machine_table(name).splitlines():
        if "=" in line and not line.startswith("#"):
            assert " # " in line, line
            keys.add(line.split("=")[0].strip())
    text = machine_table(name)
    for key in ("name", "direction", "carrier", "velocity", "acceleration", "jerk", "preferred"):
        assert key in keys, key
    for key in ("tool_direction", "tool_length", "part_zero", "travel"):
        assert f"{key} = " in text, key
    assert parse_machine(text) == load_machine(name)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("travel = 3", "travel is 3; write a table [travel]"),
        ("[travel]\nX = 3", "travel.X is 3; write X = [lowest, highest] in mm"),
        ("[travel]\nX = [1, 1]", "travel of X is 1 and 1; give the lower one first, in mm"),
        ("[travel]\nC = [1, 2]", "unknown key travel.C; known keys are X, Y, Z"),
        ('[travel]\nY = ["low", 2]', "travel.Y is 'low'; give a number"),
        ("[travel]\nY = [-inf, 2]", "travel of Y is -inf and 2"),
    ],
)
def test_wrong_travel_is_said(text: str, message: str):
    begin, axes = PLAIN.split("[[axis]]", 1)
    whole = f"{begin}\n{text}\n[[axis]]{axes}" if "=" in text.split("\n")[0] else f"{PLAIN}\n{text}"
    with pytest.raises(SettingsError) as caught:
        parse_machine(whole)
    assert message in one_line(caught.value)


@pytest.mark.parametrize("name", machine_names())
def test_every_key_that_a_table_only_shows_stands_where_it_belongs(name: str) -> None:
    table = machine_table(name)
    for key in re.finditer(r"^# (\w+ = .*)$", table, re.MULTILINE):
        before, behind = table[: key.start()], table[key.end() :]
        if key[1].startswith("modulo"):
            behind = re.sub(r"\nlimits = .*", "", behind, count=1)
        parse_machine(before + key[1] + behind)
