"""The time law as a table: one row for every interpolation period."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from cornersmooth.feedrate.timelaw import TimeLaw

#: columns: way, speed, acceleration and jerk are in rad where the tip stands still and only the axis turns
COLUMNS = (
    "t_s",
    "s_mm",
    "v_mm_per_s",
    "a_mm_per_s2",
    "j_mm_per_s3",
    "centripetal_mm_per_s2",
    "x_mm",
    "y_mm",
    "z_mm",
    "i",
    "j",
    "k",
    "turning",
    "line",
)

_BLOCK = 16384

#: digits that third differences over a period of 1 ms still need
_NUMBER = "%.14g"


def timelaw_csv(law: TimeLaw) -> Iterator[str]:
    """The law at all multiples of its period and at its end as CSV text, a block of rows at a time."""
    yield ",".join(COLUMNS) + "\n"
    form = ",".join([_NUMBER] * 12 + ["%d", "%d"]) + "\n"
    times = law.every_period()
    for begin in range(0, len(times), _BLOCK):
        states = law.at(times[begin : begin + _BLOCK])
        # adding 0.0 turns -0.0 into 0.0
        numbers = np.column_stack(
            (states.t, states.s, states.v, states.a, states.j, states.centripetal, states.tip, states.axis)
        )
        rows = zip((numbers + 0.0).tolist(), states.turning.tolist(), states.line.tolist(), strict=True)
        yield "".join(form % (*row, turning, line) for row, turning, line in rows)


def comparison_json(contents: Mapping[str, Any]) -> str:
    """`Comparison.as_dict` as JSON text."""
    return json.dumps(contents, indent=1, ensure_ascii=False, allow_nan=False) + "\n"
