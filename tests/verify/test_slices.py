"""Slices of CL files are written and verified, or refused with a reason."""

from pathlib import Path

import pytest

from verify.slices import RIGHT, draw, files_of, outcome

#: numbers of slices of our own files: of all controls, written and refused
SOME = range(8)


@pytest.mark.parametrize("number", SOME)
def test_a_slice_is_written_or_refused(number: int, tmp_path: Path) -> None:
    code, said = outcome(draw(number, files_of([])), tmp_path)
    assert code in RIGHT, said
    assert "internal error" not in said
