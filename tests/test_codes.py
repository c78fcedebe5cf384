"""The table of codes in the docs is complete, and what the source code says now."""

from __future__ import annotations

import importlib.util
import re
import sys
from pathlib import Path
from types import ModuleType

import pytest

DOCS = Path(__file__).resolve().parent.parent / "docs"


@pytest.fixture(scope="module")
def maker() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_codes", DOCS / "make_codes.py")
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
    assert (DOCS / "codes.md").read_text(encoding="utf-8") == maker.page(), "run: python docs/make_codes.py"
