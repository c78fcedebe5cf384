"""What commands print with --json has its schema: each command, and each kind of answer."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

from cornersmooth.cli.commands import COMMANDS
from oracle.command import DONE, SMALL, run
from oracle.json_schema import faults

ANSWERS = json.loads(files("cornersmooth.report").joinpath("answers.schema.json").read_text())

#: kind of answer: arguments of commands that give it; part.cls is a CL file, part.nc its program
GIVEN_BY = {
    "info": ("info part.cls", "info part.cls --machine table-ac", "info part.csv"),
    "info_of_program": ("info part.nc",),
    "controls": ("controls", "controls siemens"),
    "machines": ("machines", "machines mine.toml"),
    "pose": ("machines table-ac --pose A30", "machines head-ac --pose A30"),
    "config": ("config part.cls",),
    "codes": ("explain", "explain CS337"),
    "stream": ("explain --stream part.nc",),
    "compare": ("compare part.cls --control haas --limits table-ac -v",),
    "setup": ("setup part.cls --limits table-ac --plans 1",),
    "surface": ("surface part.cls part.nc --tool 6,3 --stations 50",),
    "time": ("time part.cls --limits table-ac", "time part.cls --text part.nc"),
    "time_by_law": (
        "time part.cls --control linuxcnc --machine xyzac-trt --limits table-ac",
        "time part.nc --limits table-ac",
    ),
    "batch": ("smooth part.cls lost.cls -d out --force",),
}
#: commands whose answer with --json is a report
REPORTS = {"smooth", "verify", "filter"}
MACHINE = '[[axis]]\nname = "A"\ndirection = [1, 0, 0]\ncarrier = "table"\n[dynamics.A]\nvelocity = 3000\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("answers")
    (place / "part.cls").write_bytes(SMALL)
    (place / "part.csv").write_text("x,y,z,i,j,k\n0,0,0,0,0,1\n10,0,0,0,0,1\n10,10,0,0,0,1\n")
    (place / "mine.toml").write_text(MACHINE)
    assert run("smooth", "part.cls", "-o", "part.nc", cwd=place).returncode == DONE
    return place


def kinds_of(answer: dict[str, Any]) -> list[str]:
    """Kinds whose schema an answer has; each schema is strict, so it is one at most."""
    kinds = [one["$ref"].removeprefix("#/$defs/") for one in ANSWERS["anyOf"]]
    return [kind for kind in kinds if not [*faults(answer, ANSWERS["$defs"][kind], ANSWERS)]]


@pytest.mark.parametrize(("kind", "line"), [(kind, line) for kind, lines in GIVEN_BY.items() for line in lines])
def test_an_answer_has_its_schema(folder: Path, kind: str, line: str) -> None:
    result = run(*line.split(), "--json", cwd=folder)
    answer = json.loads(result.stdout)
    assert [*faults(answer, ANSWERS["$defs"][kind], ANSWERS)] == []
    assert kinds_of(answer) == [kind]
    assert kinds_of(answer | {"strange": 1}) == []


def test_every_command_with_json_is_tried() -> None:
    with_json = {name for name, one in COMMANDS.items() if any("--json" in option.opts for option in one.params)}
    tried = {line.split()[0] for lines in GIVEN_BY.values() for line in lines}
    assert with_json == tried | REPORTS
    assert {one["$ref"].removeprefix("#/$defs/") for one in ANSWERS["anyOf"]} == set(GIVEN_BY)
