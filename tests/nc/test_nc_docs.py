"""The pages that show what stands in the texts of every control."""

from __future__ import annotations

import importlib.util
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def made(name: str) -> str:
    """Page that a script of the docs makes."""
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    assert spec
    assert spec.loader
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    page: str = maker.page()
    return page


def test_the_page_of_two_tools_is_what_is_written() -> None:
    page = made("make_two_tools")
    assert (DOCS / "two_tools.md").read_text(encoding="utf-8") == page, "run: python docs/make_two_tools.py"
    assert "|  |" not in page  # every line has its reason


def test_each_finding_is_mended_refused_or_said() -> None:
    page = made("make_findings")
    assert (DOCS / "findings.md").read_text(encoding="utf-8") == page, "run: python docs/make_findings.py"
    cells = [line.split(" | ", 1)[1] for line in page.splitlines() if line.startswith("| ") and line != "| | |"]
    words = ("mended", "refused", "said", "–", "no limit", "endless axis", "`modulo`")
    assert len(cells) > 18
    assert all(any(word in cell for word in words) for cell in cells)
