"""The verification shares no code with what it checks."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

#: the name `cornersmooth.verify` is the function
FOLDERS = [
    Path(str(import_module(f"cornersmooth.{name}").__file__)).parent
    for name in ("verify", "statements", "nc_words", "nc_reader", "control")
]
MODULES = [path for folder in FOLDERS for path in sorted(folder.rglob("*.py"))]
ALLOWED = (
    "cornersmooth.verify",
    "cornersmooth.statements",
    "cornersmooth.nc_words",
    "cornersmooth.nc_reader",
    "cornersmooth.control",
    "cornersmooth.model",
    # rows of tables, not vectors
    *(f"cornersmooth.arrays.{name}" for name in ("distinct", "ranges", "some_rows", "spread", "starts")),
    "cornersmooth.errors",
    "cornersmooth.system.processes",  # who does the work, not how
    "cornersmooth.settings",
    "cornersmooth.text",
    "cornersmooth.frame",  # the head of a program, which both know
    "cornersmooth.errors",  # a word, not a measure
    "cornersmooth.kinematics.machine",  # what a machine is; its kinematics are the verification's own
)


def imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} imports relatively"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: f"{path.parent.name}/{path.name}")
def test_imports_nothing_that_writes(path):
    names = [name for name in imported(path) if name.split(".")[0] == "cornersmooth"]
    assert [name for name in names if not name.startswith(ALLOWED)] == []


def test_there_are_modules_to_look_at():
    assert len(MODULES) > 30


def test_the_reader_does_not_know_who_judges():
    for path in MODULES:
        if "verify" not in path.parts:
            assert [name for name in imported(path) if name.startswith("cornersmooth.verify")] == [], path.name


def test_no_file_imports_itself_by_way_of_others():
    """Only `verify` as a package gives out what its modules have."""
    names = {".".join(path.with_suffix("").parts[path.parts.index("cornersmooth") :]): path for path in MODULES}
    names = {name.removesuffix(".__init__"): path for name, path in names.items()}
    needs = {
        name: {one if one in names else one.rpartition(".")[0] for one in imported(path)} & names.keys() - {name}
        for name, path in names.items()
    }
    while free := {name for name, others in needs.items() if not others & needs.keys()}:
        needs = {name: others for name, others in needs.items() if name not in free}
    assert not needs
