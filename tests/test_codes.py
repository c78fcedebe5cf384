"""The table of codes in the docs is complete, and what the source code says now."""

from __future__ import annotations

import importlib.util
import json
import re
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

from cornersmooth.cli.commands import COMMANDS
from cornersmooth.cli.lookup import _code_lines, codes
from oracle.command import run
from writing import faults, plain, sentences, words

DOCS = Path(__file__).resolve().parent.parent / "docs"


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_codes", DOCS.parent / "tools" / "make_codes.py")
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def test_every_code_of_the_source_is_in_the_table_with_a_text(maker: ModuleType) -> None:
    told = {entry.code for entry in maker.entries()}
    assert len(told) > 100
    assert maker.codes_in_source() - told == set()


def test_every_code_that_anything_speaks_of_is_in_the_table() -> None:
    """Also codes that are made from numbers: descriptions and pages name them."""
    told = set(re.findall(r"^\| (CS\d{3}) ", (DOCS / "codes.md").read_text(encoding="utf-8"), re.MULTILINE))
    pages = [*DOCS.glob("*.md"), DOCS.parent / "README.md", *(DOCS.parent / "src").rglob("*.py")]
    named = {  # a range is no code
        code for page in pages for code in re.findall(r"(?<!-)\bCS\d{3}\b(?!-)", page.read_text(encoding="utf-8"))
    }
    assert named - told == set()


def test_the_table_is_what_the_source_says(maker: ModuleType) -> None:
    assert (DOCS / "codes.md").read_text(encoding="utf-8") == maker.page(), "run: python tools/make_codes.py"
    assert maker.TABLE.read_text(encoding="utf-8") == maker.table(), "run: python tools/make_codes.py"


def test_every_code_is_explained_in_80_columns() -> None:
    """Of the data that is in the package, as an installed wheel has it."""
    listed = run("explain").stdout.decode()
    assert all(len(line) <= 80 for line in listed.splitlines())
    for code, known in codes().items():
        assert f"\n  {code}  " in listed
        lines = [*_code_lines(code, known)]
        assert any(f"[{code}]: " in line for line in lines)
        assert all(len(line) <= 80 for line in lines)
        for text in (known["cause"], known["remedy"]):
            assert [fault for one in sentences(plain(text)) for fault in faults(one)] == []
            assert all(words(one) <= 20 for one in sentences(plain(text)))


def test_every_code_has_a_cause_and_what_to_do() -> None:
    causes = tomllib.loads((DOCS.parent / "src" / "cornersmooth" / "cli" / "causes.toml").read_text(encoding="utf-8"))
    assert set(causes) == set(codes())
    assert list(causes) == sorted(causes)
    for one in causes.values():
        assert set(one) == {"cause", "remedy"}
        assert all(text.endswith(".") and words(text) > 2 for text in one.values())


def test_options_that_causes_name_are_there() -> None:
    """Each option is one of some command, and each command that is named has the option beside it."""
    causes = tomllib.loads((DOCS.parent / "src" / "cornersmooth" / "cli" / "causes.toml").read_text(encoding="utf-8"))
    texts = [text for one in causes.values() for text in one.values()]
    known = {option for command in COMMANDS.values() for parameter in command.params for option in parameter.opts}
    named = {option for text in texts for option in re.findall(r"(?<![\w-])--?[a-zA-Z][a-z-]*", text)}
    assert len(named) > 20
    assert named <= known
    commands = {name for text in texts for name in re.findall(r"[`']cornersmooth (\w+)", text)}
    assert len(commands) > 4
    assert commands <= set(COMMANDS)


def test_explain_takes_a_code_as_it_is_printed() -> None:
    said = run("explain", "CS337").stdout.decode()
    assert said.startswith("CS337  NC output: warning, to check\n")
    assert "cause       The first position of a tool is tilted" in said
    assert "FILE:LINE: warning[CS337]: the first motion of a tool turns it to a tilted" in said
    assert "hint: see that it is free to, or name the machine" in said
    assert run("explain", "337").stdout == run("explain", "[cs337]").stdout == said.encode()
    found = json.loads(run("explain", "CS337", "--json").stdout)["codes"]
    assert list(found) == ["CS337"]
    assert found["CS337"]["messages"][0]["kind"] == "warning, to check"
    failed = run("explain", "CS999")
    assert (failed.returncode, failed.stderr[:25]) == (2, b"error: no code 'CS999'\nhi")


#: options of other programs that pages show
OF_OTHERS = set(
    "--cuts --sshlogin --resume-failed --nworkers --joblog --array --nthreads --cpus-per-task --workdir "
    "--scheduler-file --help --help-all --version".split()
)


def test_options_that_pages_name_are_there() -> None:
    known = {option for command in COMMANDS.values() for parameter in command.params for option in parameter.opts}
    for page in (DOCS.parent / "README.md", *DOCS.glob("*.md")):
        named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", page.read_text(encoding="utf-8")))
        assert named - known - OF_OTHERS == set(), page.name
