"""Wheel and sdist hold what they should: the version, types, tables, and every page that a help names."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from email.parser import Parser
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from cornersmooth import __version__
from cornersmooth.cli.commands import COMMANDS
from oracle.command import run

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with both, made by the build backend."""
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("dist")
    code = f"import hatchling.build as b; b.build_wheel({str(folder)!r}); b.build_sdist({str(folder)!r})"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True)
    return folder


def test_the_wheel_holds_code_tables_types_and_pages(built: Path) -> None:
    with zipfile.ZipFile(built / f"cornersmooth-{__version__}-py3-none-any.whl") as wheel:
        names = set(wheel.namelist())
        (metadata,) = (wheel.read(name).decode() for name in names if name.endswith("/METADATA"))
    source = {
        path.relative_to(ROOT / "src").as_posix()
        for path in (ROOT / "src" / "cornersmooth").rglob("*")
        if path.is_file() and path.suffix != ".pyc"
    }
    pages = {f"cornersmooth/docs/{path.name}" for path in (ROOT / "docs").glob("*.md")}
    assert "cornersmooth/py.typed" in source
    assert {name for name in names if ".dist-info/" not in name} == source | pages
    told = Parser().parsestr(metadata)
    assert told["Version"] == __version__
    heading = "Unreleased\n" if ".dev" in __version__ else f"{__version__} - 20"  # a checkout is no release
    assert f"\n## {heading}" in (ROOT / "CHANGELOG.md").read_text()
    assert told["Description-Content-Type"] == "text/markdown"
    classifiers = " ".join(told.get_all("Classifier") or [])
    assert all(word in classifiers for word in ("Operating System", "3.11", "3.13", "Topic", "Typed"))


def test_the_sdist_holds_source_tests_and_documents(built: Path) -> None:
    with tarfile.open(built / f"cornersmooth-{__version__}.tar.gz") as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    assert {
        "pyproject.toml",
        "README.md",
        "LICENSE",
        "tests/test_packages.py",
        "docs/verify.md",
        "samples/impeller.cls",
    } <= names


def test_helps_name_pages_that_are_there() -> None:
    (folder,) = re.findall(r"docs/ +(\S+)", run("--help").stdout.decode())
    named = {
        name for command in COMMANDS for name in re.findall(r"docs/([a-z]+\.md)", run(command, "-h").stdout.decode())
    }
    assert named
    assert [name for name in sorted(named) if not (Path(folder) / name).is_file()] == []


SOURCE = ROOT / "src" / "cornersmooth"
MODULES = {
    ".".join(("cornersmooth", *path.relative_to(SOURCE).with_suffix("").parts)).removesuffix(".__init__"): path
    for path in SOURCE.rglob("*.py")
}


def imports(nodes: list[ast.AST]) -> Iterator[str]:
    """Modules of the package that statements import, at once or when they run; not those that only types need."""
    for node in nodes:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test):
            yield from imports([*node.orelse])
        elif isinstance(node, ast.ImportFrom) and node.module:
            for alias in node.names:
                name = f"{node.module}.{alias.name}"
                yield name if name in MODULES else node.module
        else:
            yield from imports([*ast.iter_child_nodes(node)])


def test_no_file_imports_itself_in_a_circle() -> None:
    graph = {
        name: {one for one in imports([ast.parse(path.read_text(encoding="utf-8"))]) if one in MODULES and one != name}
        for name, path in MODULES.items()
    }
    assert sum(map(len, graph.values())) > 800
    TopologicalSorter(graph).prepare()  # it names a circle


def test_the_root_has_ten_modules() -> None:
    assert len(list(SOURCE.glob("*.py"))) <= 10


@pytest.mark.parametrize("package", ["nc", "rotary"])
def test_modules_of_the_writer_are_a_few_screens(package: str) -> None:
    sizes = {path.name: path.read_text(encoding="utf-8").count("\n") for path in (SOURCE / package).glob("*.py")}
    assert {name for name, size in sizes.items() if size > 400} == set()
