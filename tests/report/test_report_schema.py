"""JSON reports of smooth, verify and filter: what they say, their schema, the same bytes from run to run."""

from __future__ import annotations

import hashlib
import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from oracle.command import run
from oracle.json_schema import faults

SCHEMA = json.loads(files("cornersmooth.report").joinpath("report.schema.json").read_text())
CL = """TOOL PATH/A
LOADTL/3
SPINDL/3000,CLW
FEDRAT/MMPM,250
RAPID
GOTO/0,0,10,0,0,1
GOTO/0,0,0
GOTO/10,0,0
GOTO/10,10,0
RAPID
GOTO/10,10,50
FINI
"""

#: name, and arguments of what makes the report r.json; {0} is the CL file, a.nc a program of it
REPORTS = {
    "smooth": "smooth {0} -o o.nc --limits table-ac --report r.json",
    "quiet": "smooth {0} -o o.nc -q --report r.json",
    "curves": "smooth {0} -o o.nc --control siemens -f bspline --report r.json",
    "global": "smooth {0} -o o.nc --control siemens --method global --report r.json",
    "zhang": "smooth {0} -o o.nc --method zhang2016 --report r.json",
    "not verified": "smooth {0} -o o.nc --no-verify --report r.json",
    "axis": "smooth {0} -o o.nc --axis-tolerance 0.1 --report r.json",
    "verify": "verify {0} a.nc -e 0.02 --report r.json",
    "failed": "verify {0} a.nc -e 0.001 --report r.json",
    "filter": "filter a.nc -o o.nc --limits table-ac --report r.json",
    "compared": "verify a.nc a.nc --report r.json",
}


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    folder = tmp_path_factory.mktemp("program")
    (folder / "part.cls").write_text(CL)
    assert run("smooth", "part.cls", "-o", "a.nc", "-e", "0.02", "-q", cwd=folder).returncode == 0
    return (folder / "a.nc").read_bytes()


@pytest.fixture
def part(tmp_path: Path, program: bytes) -> Path:
    source = tmp_path / "part.cls"
    source.write_text(CL)
    (tmp_path / "a.nc").write_bytes(program)
    return source


def made(name: str, part: Path, *more: str) -> dict[str, Any]:
    told = run(*REPORTS[name].format(part.name).split(), *more, cwd=part.parent)
    assert told.returncode == int(name == "failed"), told.stderr
    found: dict[str, Any] = json.loads((part.parent / "r.json").read_text())
    return found


@pytest.mark.parametrize("name", REPORTS)
def test_a_report_is_what_the_schema_says_and_the_same_in_the_next_run(name: str, part: Path) -> None:
    contents = made(name, part)
    assert list(faults(contents, SCHEMA, SCHEMA)) == []
    path = part.parent / "r.json"
    before = path.read_bytes()
    for old in (path, part.parent / "o.nc"):
        old.unlink(missing_ok=True)
    made(name, part)
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"verdict": "OK"}, "$.verdict: 'OK' is none of"),
        ({"colour": 1}, "$: colour is not known"),
        ({"kind": "filter"}, "$: left_as_it_is is missing"),
        ({"to_check": -1}, "$.to_check: -1 is less than 0"),
        ({"sharp": [{"line": 1, "status": "reversal"}]}, "$.sharp[0]: turn_deg is missing"),
    ],
)
def test_the_schema_refuses_what_is_wrong(change: dict[str, Any], said: str, part: Path) -> None:
    assert any(fault.startswith(said) for fault in faults(made("quiet", part) | change, SCHEMA, SCHEMA))


def test_a_report_names_files_hashes_control_machine_times_and_command(part: Path) -> None:
    contents = made("smooth", part)
    folder = part.parent
    hashes = {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in ("part.cls", "o.nc")}
    assert (contents["schema"], contents["kind"], contents["verdict"]) == ("cornersmooth-report/2", "smooth", "PASSED")
    assert (contents["input"]["name"], contents["input"]["sha256"]) == ("part.cls", hashes["part.cls"])
    program = {"name": "o.nc", "sha256": hashes["o.nc"], "control": "fanuc", "form": "g1", "machine": None, "tcp": True}
    assert contents["program"] == program
    assert contents["made_by"]["command"] == "cornersmooth " + REPORTS["smooth"].format("part.cls")
    times = contents["times"]
    # 30 mm at 250 mm/min take 7.2 s; rapids and ramps are little beside it
    assert 7.2 < times["unsmoothed_s"] < 9.0
    assert 7.2 < times["written_s"] < 9.0
    assert times["limits"] == "table-ac"
    assert contents["settings"]["tolerance_mm"] == 0.01
    assert made("quiet", part, "--force")["times"] is None
    curves = made("curves", part, "--force")
    assert [curves["program"][key] for key in ("control", "form", "machine")] == ["siemens", "bspline", None]


def test_verify_takes_the_form_from_the_head_and_says_what_failed(part: Path) -> None:
    contents = made("failed", part)
    assert contents["verdict"] == "FAILED"
    assert contents["program"]["form"] == "g1"
    assert contents["program"]["sha256"] == hashlib.sha256((part.parent / "a.nc").read_bytes()).hexdigest()
    assert contents["verification"]["problem_count"] == len(contents["verification"]["problems"]) > 0
    assert contents["settings"] == {"tolerance_mm": 0.001, "axis_length_mm": 10.0, "axis_tolerance_deg": None}


def test_filter_counts_cuts_and_compares(part: Path) -> None:
    contents = made("filter", part)
    assert contents["summary"]["cuts"] >= contents["summary"]["smoothed"] > 0
    assert contents["compared"]["problem_count"] == 0
    assert contents["input"]["format"] == "nc"
    new = (part.parent / "o.nc").read_bytes()
    assert contents["program"]["sha256"] == hashlib.sha256(new).hexdigest()
    assert contents["summary"]["lines_out"] == new.count(b"\n")


@pytest.mark.parametrize(
    ("command", "schema"),
    [
        ("smooth part.cls -o o.nc --json", "cornersmooth-report/2"),
        ("smooth part.cls -d out --json", "cornersmooth-batch/2"),
        ("filter a.nc -o o.nc --json", "cornersmooth-report/2"),
        ("verify part.cls a.nc --json", "cornersmooth-report/2"),
        ("verify a.nc a.nc --json", "cornersmooth-report/2"),
        ("compare part.cls --control linuxcnc --machine xyzac-trt --json -q", "cornersmooth-compare/1"),
        ("time part.cls --limits table-ac --json", "cornersmooth-time/1"),
        ("setup part.cls --limits table-ac --plans 1 --json -q", "cornersmooth-setup/1"),
        ("surface part.cls a.nc --tool 10 --json", "cornersmooth-surface/1"),
        ("info part.cls --json", "cornersmooth-info/2"),
        ("info a.nc --json", "cornersmooth-info/2"),
        ("controls --json", "cornersmooth-controls/1"),
        ("controls siemens --json", "cornersmooth-controls/1"),
        ("machines --json", "cornersmooth-machines/1"),
        ("machines table-ac --json", "cornersmooth-machines/1"),
        ("machines table-ac --pose A30,C45 --json", "cornersmooth-pose/1"),
        ("config --json", "cornersmooth-config/1"),
    ],
)
def test_every_command_with_figures_prints_one_json_object(command: str, schema: str, part: Path) -> None:
    told = run(*command.split(), cwd=part.parent)
    assert told.returncode in (0, 1), told.stderr
    assert json.loads(told.stdout)["schema"] == schema


def test_the_values_of_machines_controls_and_settings(part: Path) -> None:
    def printed(*command: str) -> Any:
        return json.loads(run(*command, "--json", cwd=part.parent).stdout)

    pose = printed("machines", "table-ac", "--pose", "A90,C0")
    # a table that turns by 90 degrees about X lays the tool along Y, whichever way it counts
    assert [abs(round(part, 9)) for part in pose["tool_vector"]] == [0.0, 1.0, 0.0]
    assert pose["angles_deg"] == {"A": 90.0, "C": 0.0}
    (siemens,) = printed("controls", "840d")["controls"]
    assert siemens["name"] == "siemens"
    assert "840d" in siemens["aliases"]
    assert "bspline" in [form["name"] for form in siemens["forms"]]
    assert {machine["name"] for machine in printed("machines")["machines"]} >= {"table-ac", "xyzac-trt"}
    (part.parent / "cornersmooth.toml").write_text("[smooth]\ntolerance = 0.02\n")
    values = {item["key"]: item for item in printed("config")["values"]}
    assert values["tolerance"]["value"] == 0.02
    assert "cornersmooth.toml" in values["tolerance"]["from"]


def test_json_of_smooth_and_filter_leaves_standard_output_to_the_object(part: Path) -> None:
    for command in ("smooth part.cls --json", "filter a.nc --json"):
        found = run(*command.split(), cwd=part.parent)
        assert found.returncode == 2, command
        assert "-o FILE" in json.loads(found.stdout)["what"], command
    assert b"-o FILE" in found.stderr
