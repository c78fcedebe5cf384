"""The times that the whole controller took, of docs/dev/linuxcnc.md, against the planned ones."""

from __future__ import annotations

import pytest

from nc.planned_column import rows


def test_planned_times_are_those_of_the_controller() -> None:
    """Programs of the sample, unsmoothed and ours, at two tolerances: within 2 %, and the column is the plan's."""
    found = list(rows(None))
    assert len(found) == 16
    for line, took, planned in found:
        assert planned == pytest.approx(took, rel=0.02)
        assert float(line.split("|")[6]) == pytest.approx(planned, abs=0.006)
