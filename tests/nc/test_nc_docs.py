"""The page that shows the same program on every control."""

from __future__ import annotations

import importlib.util
from pathlib import Path

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_page_of_two_tools_is_what_is_written() -> None:
    spec = importlib.util.spec_from_file_location("make_two_tools", DOCS / "make_two_tools.py")
    assert spec
    assert spec.loader
    maker = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(maker)
    page = maker.page()
    assert (DOCS / "two_tools.md").read_text(encoding="utf-8") == page, "run: python docs/make_two_tools.py"
    assert "|  |" not in page  # every line has its reason
