"""Tables of reports as CSV text, a block of rows at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

from cornersmooth.kinematics.machine import LINEAR

if TYPE_CHECKING:  # the planner takes long to load
    from cornersmooth.feedrate.timelaw import TimeLaw

#: rows of text made at a time
_BLOCK = 10_000


def csv_text(forms: Mapping[str, str], count: int, columns: Callable[[slice], Iterable[NDArray[Any]]]) -> Iterator[str]:
    """Header, then the rows: `columns` gives those of a slice, `forms` say how each is written (``{"x": "%.6f"}``)."""
    yield ",".join(forms) + "\n"
    form = ",".join(forms.values()) + "\n"
    for begin in range(0, count, _BLOCK):
        block = (column.tolist() for column in columns(slice(begin, min(begin + _BLOCK, count))))
        yield "".join(map(form.__mod__, zip(*block, strict=True)))


#: digits that third differences over a period of 1 ms still need
_NUMBER = "%.14g"

#: columns: way, speed, acceleration and jerk are in rad where the tip stands still and only the axis turns
COLUMNS = {
    **dict.fromkeys("t_s s_mm v_mm_per_s a_mm_per_s2 j_mm_per_s3 centripetal_mm_per_s2".split(), _NUMBER),
    **dict.fromkeys("x_mm y_mm z_mm i j k".split(), _NUMBER),
    **dict.fromkeys(("turning", "line"), "%d"),
}


def timelaw_csv(law: TimeLaw) -> Iterator[str]:
    """The law at all multiples of its period and at its end as CSV text, a block of rows at a time.

    For a law that was planned for a machine the positions of its axes follow: linear ones as without tool centre point
    control (`cornersmooth.kinematics.machine_position`), rotary ones unwrapped.
    """
    names = () if law.machine_axes is None else law.machine_axes.names
    own = {f"machine_{name.lower()}_{'mm' if name in LINEAR else 'deg'}": _NUMBER for name in names}
    times = law.every_period()

    def columns(part: slice) -> Iterable[NDArray[Any]]:
        now = law.at(times[part])
        # adding 0.0 turns -0.0 into 0.0
        for one in (now.t, now.s, now.v, now.a, now.j, now.centripetal, *now.tip.T, *now.axis.T):
            yield one + 0.0
        yield from (now.turning, now.line)
        if own:
            yield from (law.axes_at(times[part])[0] + 0.0).T

    return csv_text(COLUMNS | own, len(times), columns)
