"""The time law as a table: one row for every interpolation period."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cornersmooth.feedrate.timelaw import TimeLaw
from cornersmooth.kinematics.dynamics import LINEAR

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
    """The law at all multiples of its period and at its end as CSV text, a block of rows at a time.

    For a law that was planned for a machine the positions of its axes follow: linear ones as without tool centre point
    control (`cornersmooth.kinematics.machine_position`), rotary ones unwrapped.
    """
    yield ",".join((*COLUMNS, *axis_columns(law))) + "\n"
    form = ",".join([_NUMBER] * 12 + ["%d", "%d"] + [_NUMBER] * len(axis_columns(law))) + "\n"
    times = law.every_period()
    for begin in range(0, len(times), _BLOCK):
        block = times[begin : begin + _BLOCK]
        states = law.at(block)
        axes = np.zeros((len(block), 0)) if law.machine_axes is None else law.axes_at(block)[0]
        # adding 0.0 turns -0.0 into 0.0
        numbers = np.column_stack(
            (states.t, states.s, states.v, states.a, states.j, states.centripetal, states.tip, states.axis)
        )
        rows = zip(
            (numbers + 0.0).tolist(), states.turning.tolist(), states.line.tolist(), (axes + 0.0).tolist(), strict=True
        )
        yield "".join(form % (*row, turning, line, *places) for row, turning, line, places in rows)


def axis_columns(law: TimeLaw) -> tuple[str, ...]:
    """Columns of the machine's axes."""
    if law.machine_axes is None:
        return ()
    return tuple(f"machine_{name.lower()}_{'mm' if name in LINEAR else 'deg'}" for name in law.machine_axes.names)
