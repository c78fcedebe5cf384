"""Text to numbers: bit for bit what `float` gives, and an offset for everything else."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cornersmooth.text import parse, parse_numbers

FIELDS = st.one_of(
    st.from_regex(r"\A[+-]?[0-9]{1,12}\.[0-9]{0,20}\Z"),
    st.from_regex(r"\A[+-]?\.[0-9]{1,10}\Z"),
    st.from_regex(r"\A[+-]?[0-9]{1,20}\Z"),
    st.from_regex(r"\A[+-]?[0-9]\.[0-9]{1,17}[eEdD][+-]?[0-9]{1,2}\Z"),
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.tuples(st.floats(-1e4, 1e4), st.integers(0, 12)).map(lambda pair: f"{pair[0]:.{pair[1]}f}"),
)
SEPARATORS = st.sampled_from([",", " ", "\n", "\r\n", "\t", " , ", ",\n", "  ", "\r\n \r\n", "\n,"])


def expected(fields: list[str]) -> np.ndarray:
    return np.array([float(re.sub("[dD]", "e", field)) for field in fields], np.float64)


def same_bits(a: np.ndarray, b: np.ndarray) -> bool:
    return a.dtype == b.dtype and a.tobytes() == b.tobytes()


@given(st.lists(st.tuples(FIELDS, SEPARATORS)), st.sampled_from(["", " ", "\r\n"]))
def test_every_bit_is_that_of_float(pairs: list[tuple[str, str]], lead: str) -> None:
    fields = [field for field, _ in pairs]
    text = lead + "".join(field + separator for field, separator in pairs)
    text = text.rstrip(", \t\r\n") + "\n"
    assert same_bits(parse_numbers(text.encode()), expected(fields))


def test_six_numbers_a_line_over_many_blocks() -> None:
    rng = np.random.default_rng(1)
    values = np.round(rng.uniform(-300, 300, (20_000, 6)), 4)
    values[:, 3:] = np.round(values[:, 3:] / 300, 7)
    lines = ["{:.4f},{:.4f},{:.4f},{:.7f},{:.7f},{:.7f}".format(*row) for row in values.tolist()]
    assert len("\n".join(lines)) > 10 * parse.BLOCK
    for line_end in ("\n", "\r\n", ","):
        assert same_bits(parse_numbers(line_end.join(lines).encode()).reshape(-1, 6), values + 0.0)


@pytest.mark.parametrize("block", [1, 2, 3, 7, 64])
def test_result_does_not_depend_on_the_block(monkeypatch: pytest.MonkeyPatch, block: int) -> None:
    text = b" 1.5 , -2.25\r\n\r\n+3,4.0E1\n.5 -.5,5.,12345678901234567890,0.1234567890123456789,\t-0.0 "
    whole = parse_numbers(text)
    monkeypatch.setattr(parse, "BLOCK", block)
    assert same_bits(parse_numbers(text), whole)
    for bad in (b"1 x", b"1,2,1..2,3", b"12 -"):
        with pytest.raises(ValueError):  # noqa: PT011
            parse_numbers(bad)


@pytest.mark.parametrize("text", [b"", b" ", b"\r\n\t "])
def test_no_numbers(text: bytes) -> None:
    assert parse_numbers(text).shape == (0,)


@pytest.mark.parametrize(
    "text",
    [
        b"1 2 nan 3",
        b"1,inf",
        b"1,1e400",
        b"1,-1d999",
        b"1_000",
        b"0x10",
        b"1.2.3",
        b"12 1-2",
        b"12 --2",
        b"12 +-2",
        b"12 -",
        b"12 .",
        b"12 -. 3",
        b"12 e5",
        b"12 1e",
        b"12 1e5.0",
        b"12 1e5d3",
        b"12\x0b13",
        b"12 \x00",
        b"12 13;",
        "12 ３".encode(),
        b"GOTO/1,2,3",
        b"1/2",
        b"1..2",
    ],
)
def test_what_is_not_a_number_is_refused(text: bytes) -> None:
    good = b"-12.5000,0.25,3\n" * 9000
    assert len(good) > 2 * parse.BLOCK
    for whole in (text, good + text + b"\n" + good):
        with pytest.raises(ValueError):  # noqa: PT011
            parse_numbers(whole)


@given(st.text(alphabet="0123456789+-.eEdD,, \n", max_size=12))
def test_random_text_is_read_as_float_would_or_refused(text: str) -> None:
    values: np.ndarray | None
    try:
        values = expected(text.replace(",", " ").split())
        values = values if np.isfinite(values).all() else None
    except ValueError:
        values = None
    if values is None:
        with pytest.raises(ValueError):  # noqa: PT011
            parse_numbers(text.encode())
    else:
        assert same_bits(parse_numbers(text.encode()), values)
