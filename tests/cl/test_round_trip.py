"""Random paths, written the way four CAM systems write them, come back as they were."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cornersmooth.cl import read
from cornersmooth.model import Move


@dataclass(frozen=True)
class Pose:
    tip: tuple[int, int, int]  # 1e-4 mm
    axis: int  # row of AXES
    rapid: bool
    feed: int


AXES = np.array([[0, 0, 1], [0, 0.6, 0.8], [0.6, 0, 0.8], [1, 0, 0], [0, -1, 0], [-0.28, 0.96, 0]])

poses = st.lists(
    st.builds(
        Pose,
        st.tuples(*[st.integers(-9_999_999, 9_999_999)] * 3),
        st.integers(0, len(AXES) - 1),
        st.booleans(),
        st.sampled_from([100, 250, 1200]),
    ),
    min_size=1,
    max_size=40,
)


def number(ticks: int, decimals: int) -> str:
    sign, digits = "-" if ticks < 0 else "", f"{abs(ticks):05d}"
    return f"{sign}{digits[:-4]}.{digits[-4:]}" + "0" * (decimals - 4)


def write(path: list[Pose], head: str, rapid: str, feed: str, goto: Callable[[str, str, bool], str], d: int) -> str:
    def lines() -> Iterator[str]:
        yield head
        axis, rate = 0, 0
        for pose in path:
            if pose.rapid:
                yield rapid
            elif pose.feed != rate:
                rate = pose.feed
                yield feed.format(rate)
            tip = ",".join(number(ticks, d) for ticks in pose.tip)
            yield goto(tip, ",".join(f"{value:.7f}" for value in AXES[pose.axis]), pose.axis != axis)
            axis = pose.axis

    return "\n".join(lines())


def nx(path: list[Pose]) -> str:
    """Axis only where it changes; feed unit first."""
    return write(
        path,
        "TOOL PATH/A,TOOL,B\nTLDATA/MILL,10.0,5.0\nPAINT/PATH",
        "PAINT/COLOR,211\nRAPID",
        "FEDRAT/MMPM,{}.0000",
        lambda tip, axis, new: f"GOTO/{tip},{axis}" if new else f"GOTO/{tip}",
        4,
    )


def catia(path: list[Pose]) -> str:
    """Six numbers each, blanks, CRLF."""
    text = write(
        path,
        "$$     CATIA APT VERSION 1.0\nMULTAX",
        "RAPID",
        "FEDRAT/  {}.0000,MMPM",
        lambda tip, axis, new: "GOTO  / " + f"{tip},{axis}".replace(",", ", "),
        5,
    )
    return text.replace("\n", "\r\n")


def creo(path: list[Pose]) -> str:
    """Six numbers in two lines; three where the axis is +Z."""
    return write(
        path,
        "$$*         Pro/CLfile  Version 9.0\nUNITS / MM\nMULTAX / ON",
        "RAPID ",
        "FEDRAT / {}.000000,  MMPM",
        lambda tip, axis, new: (
            f"GOTO / {tip}".replace(",", ", ")
            + ("" if axis == "0.0000000,0.0000000,1.0000000" else ",  $\n" + axis.replace(",", ", "))
        ),
        10,
    )


def wrapped(path: list[Pose]) -> str:
    """Every number on a line of its own."""
    return nx(path).replace(",", ",$ x\n  ")


@settings(max_examples=60, deadline=None)
@pytest.mark.parametrize("writer", [nx, catia, creo, wrapped])
@given(path=poses)
def test_round_trip(writer: Callable[[list[Pose]], str], path: list[Pose]) -> None:
    result = read(writer(path).encode())
    assert result.tip.tolist() == [[float(number(ticks, 4)) for ticks in pose.tip] for pose in path]
    assert result.axis == pytest.approx(AXES[[pose.axis for pose in path]], abs=1e-15)
    assert result.kind.tolist() == [Move.RAPID if pose.rapid else Move.LINEAR for pose in path]
    cutting = [i for i, pose in enumerate(path) if not pose.rapid]
    assert result.feed[cutting].tolist() == [path[i].feed for i in cutting]
