"""Whole texts, small enough to read; `python -m nc.test_nc_golden` in the folder of the tests writes them anew."""

from __future__ import annotations

from pathlib import Path

import pytest

from nc.writing import text_of_cl

GOLDEN = Path(__file__).parent / "golden"
FORMS = ("g1", "g6.2")


def written(form: str) -> str:
    lines, _ = text_of_cl((GOLDEN / "mixed.cls").read_text(), form, tolerance=0.05)
    return "".join(line + "\n" for line in lines)


def golden(form: str) -> Path:
    return GOLDEN / f"mixed.fanuc-{form}.nc"


@pytest.mark.parametrize("form", FORMS)
def test_text_is_what_was_agreed(form: str) -> None:
    assert written(form) == golden(form).read_text()


if __name__ == "__main__":
    for name in FORMS:
        golden(name).write_text(written(name))
