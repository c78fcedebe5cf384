"""The verification shares no code with what it checks."""

from __future__ import annotations

import ast
from importlib import import_module
from pathlib import Path

import pytest

#: the name `cornersmooth.verify` is the function
FOLDER = Path(str(import_module("cornersmooth.verify").__file__)).parent
ALLOWED = (
    "cornersmooth.verify",
    "cornersmooth.model",
    "cornersmooth.errors",
    "cornersmooth.settings",
    "cornersmooth.text",
    "cornersmooth.kinematics.machine",  # what a machine is; its kinematics are the verification's own
)


def imported(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name} imports relatively"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: str(path.relative_to(FOLDER)))
def test_imports_nothing_that_writes(path):
    names = [name for name in imported(path) if name.split(".")[0] == "cornersmooth"]
    assert [name for name in names if not name.startswith(ALLOWED)] == []


def test_there_are_modules_to_look_at():
    assert len(list(FOLDER.rglob("*.py"))) > 20
