"""Rounding: what is printed is what Python's own formatting prints."""

from __future__ import annotations

import re
from decimal import Decimal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cornersmooth.errors import OutputError
from cornersmooth.text import format_number, ticks, to_ticks


def printed_ticks(value: float, decimals: int) -> int:
    return int((f"{value:.{decimals}f}").replace(".", ""))


@st.composite
def awkward(draw: st.DrawFn) -> tuple[float, int]:
    """Values at and beside the middle between two ticks, and any others, with decimals."""
    decimals = draw(st.integers(0, 15))
    limit = 10.0 ** (15 - decimals)
    middle = draw(st.integers(-(10**6), 10**6)) * 2 + 1
    value = draw(
        st.one_of(
            st.floats(-limit, limit),
            st.just(middle / 2 / 10**decimals),
            st.just(middle / 2 ** draw(st.integers(0, 30))),
            st.integers(-(10**15), 10**15).map(lambda n: n / 10**decimals),
        )
    )
    value = float(np.nextafter(value, draw(st.sampled_from([value, -np.inf, np.inf]))))
    return min(max(value, -limit), limit), decimals


@given(st.lists(awkward(), min_size=1, max_size=20))
def test_ticks_are_those_of_percent_f(pairs: list[tuple[float, int]]) -> None:
    values = [value for value, _ in pairs]
    for value, decimals in pairs:
        assert to_ticks(value, decimals) == printed_ticks(value, decimals)
    decimals = min(decimals for _, decimals in pairs)
    got = to_ticks(np.array(values), decimals) if max(map(abs, values)) * 10**decimals <= 1e15 else []
    assert [printed_ticks(v, decimals) for v in values] == list(got) or len(got) == 0


@pytest.mark.parametrize("decimals", [0, 3, 4, 5, 7])
def test_inputs_with_one_more_decimal_are_full_of_ties(decimals: int) -> None:
    rng = np.random.default_rng(decimals)
    values = np.round(rng.uniform(-900, 900, 20_000), decimals + 1)
    naive = np.rint(values * 10**decimals).astype(np.int64)
    expected = [printed_ticks(v, decimals) for v in values.tolist()]
    assert to_ticks(values, decimals).tolist() == expected
    if decimals:
        assert naive.tolist() != expected  # the test means something


@pytest.mark.parametrize(("value", "even"), [(0.5, 0), (1.5, 2), (2.5, 2), (-0.5, 0), (-1.5, -2), (1e15 / 4 + 0.5, 0)])
def test_exact_ties_go_to_even(value: float, even: int) -> None:
    got = int(to_ticks(value, 0))
    assert got % 2 == 0
    assert got == even or even == 0


def test_decimals_by_column() -> None:
    rng = np.random.default_rng(5)
    values = rng.uniform(-1, 1, (20_000, 3))
    decimals = [4, 7, 0]
    got = to_ticks(values, decimals)
    assert values.size > ticks.BLOCK
    for column, places in enumerate(decimals):
        assert (got[:, column] == to_ticks(values[:, column].copy(), places)).all()
    assert (to_ticks(values[::-2, ::-1], decimals[::-1]) == got[::-2, ::-1]).all()


def test_shapes_are_kept() -> None:
    assert to_ticks(1.5, 1).shape == ()
    assert to_ticks(np.zeros((0, 3)), [4, 4, 4]).shape == (0, 3)
    assert to_ticks(np.zeros((2, 3, 4)), 4).shape == (2, 3, 4)
    assert to_ticks(np.zeros((5, 0)), []).shape == (5, 0)
    assert to_ticks([1, 2], 0).dtype == np.int64


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.0000001e11, -1e300, 1.7e308])
def test_what_cannot_be_written_is_refused(bad: float) -> None:
    values = np.ones((10, 2))
    values[7, 1] = bad
    with pytest.raises(OutputError, match=re.escape(f"{bad:g}")) as caught:
        to_ticks(values, 4)
    assert caught.value.code == "CS301"
    with pytest.raises(OutputError):
        format_number(bad, 4)


@pytest.mark.parametrize("decimals", [-1, 16, [4, 16], [[4]], [4, 4, 4]])
def test_wrong_decimals(decimals: object) -> None:
    with pytest.raises(ValueError, match="decimals"):
        to_ticks(np.zeros((3, 2)), decimals)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("value", "decimals", "options", "text"),
    [
        (12.3, 4, {}, "12.3000"),
        (-0.00001, 4, {}, "0.0000"),
        (-0.0, 4, {"plus": True}, "+0.0000"),
        (0.5, 4, {"trim": True}, "0.5"),
        (12.0, 4, {"trim": True}, "12."),
        (-100.0, 4, {"trim": True}, "-100."),
        (0.0, 4, {"trim": True}, "0."),
        (7.0, 0, {}, "7"),
        (7.0, 0, {"trim": True}, "7."),
        (250.0, 4, {"trim": True, "plus": True}, "+250."),
        (-99999999999.9999, 4, {}, "-99999999999.9999"),
        (2.675, 2, {}, "2.67"),
        (0.125, 2, {}, "0.12"),
    ],
)
def test_one_number(value: float, decimals: int, options: dict[str, bool], text: str) -> None:
    assert format_number(value, decimals, **options) == text


@given(awkward(), st.booleans(), st.booleans())
def test_one_number_says_what_percent_f_says(pair: tuple[float, int], trim: bool, plus: bool) -> None:
    value, decimals = pair
    text = format_number(value, decimals, trim=trim, plus=plus)
    assert Decimal(text) == Decimal(f"{value:.{decimals}f}")
    assert text.startswith("+") == (plus and Decimal(text) >= 0)
    assert not text.startswith("-0.") or Decimal(text) < 0
    if not trim:
        plain = f"{value:.{decimals}f}"
        assert text.lstrip("+") == (plain.lstrip("-") if Decimal(text) == 0 else plain)
