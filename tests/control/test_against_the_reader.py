"""Places and feeds of the machine are those that `nc_reader` finds, in programs of every control.

The two share the lexers and the columns of lines, and nothing else: what words do is in rows here, in classes there.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import cornersmooth as cs
from cornersmooth.control.program import Text
from cornersmooth.control.state import Rows
from cornersmooth.filter.runs import ProgramReader
from cornersmooth.nc_reader import read_nc

GOLDEN = sorted((Path(__file__).parents[1] / "nc" / "golden").glob("*.nc"))


@pytest.mark.parametrize("path", GOLDEN, ids=[path.stem for path in GOLDEN])
def test_places_and_feeds_are_those_of_the_reader(path: Path) -> None:
    parts = re.fullmatch(r"\w+\.(\w+?)-(?:g1|g6\.2|bspline|poly|spl)-?(.*?)(-axes)?", path.stem)
    assert parts is not None
    control, name, axes = parts.groups()
    machine, data = cs.load_machine(name) if name else None, path.read_bytes()
    read = read_nc(data, control=control, machine=machine, tcp=not axes)
    ends = {line: row for row, line in enumerate(read.line.tolist())}  # the last element of each line
    compared = 0
    for item in ProgramReader(control, machine, tcp=not axes).stream(Text.of(data)):
        if not isinstance(item, Rows):
            continue
        for k in range(len(item)):
            row, state = ends.get(item.first + k + 1), item.after(k + 1)
            place = state.unit * np.array([state.place[letter] for letter in "XYZ"])
            if row is None or axes or not np.isfinite(place).all():
                continue
            assert place == pytest.approx(read.tip[row], abs=1e-9), item.first + k + 1
            if state.groups["motion"] == "line" and state.groups["feed"] == "minute" and not math.isnan(state.feed):
                scale = 0.1 if control == "heidenhain" and state.unit != 1.0 else 1.0  # tenths of inches there
                assert scale * state.unit * state.feed == pytest.approx(read.feed[row]), item.first + k + 1
            compared += 1
    assert compared >= 5 or axes or "g1" not in path.stem
