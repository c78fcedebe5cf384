"""Rows of words: byte for byte what one careful format per number gives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cornersmooth.errors import OutputError
from cornersmooth.text import RowFormat, rows, to_ticks
from cornersmooth.text.ticks import TICK_LIMIT

XYZ = RowFormat((b"X", b" Y", b" Z"), (4, 4, 4))


def number(ticks: int, decimals: int, form: RowFormat) -> str:
    """One number by integer arithmetic on text."""
    digits = str(abs(ticks)).zfill(decimals + 1)
    whole, part = digits[: len(digits) - decimals], digits[len(digits) - decimals :]
    point = "." if decimals or form.trim else ""
    if form.trim:
        part = part.rstrip("0")
    if not form.leading_zero and part:
        whole = whole.lstrip("0") if int(whole) == 0 else whole
    sign = "-" if ticks < 0 else "+" if form.plus else ""
    return sign + whole + point + part


def careful(
    form: RowFormat,
    ticks: np.ndarray,
    prefix: Sequence[bytes],
    prefix_id: Sequence[int],
    suffix: Sequence[bytes],
    suffix_id: Sequence[int],
) -> list[bytes]:
    lines = []
    for row, head, tail in zip(ticks.tolist(), prefix_id, suffix_id, strict=True):
        line = prefix[head]
        for word, decimals, value in zip(form.words, form.decimals, row, strict=True):
            line += word + number(value, decimals, form).encode()
        lines.append(line + suffix[tail])
    return lines


def check(
    form: RowFormat,
    ticks: np.ndarray,
    prefix: Sequence[bytes],
    prefix_id: Sequence[int],
    suffix: Sequence[bytes],
    suffix_id: Sequence[int],
) -> None:
    case = ticks, prefix, np.array(prefix_id, np.int64), suffix, np.array(suffix_id, np.int64)
    expected = careful(form, ticks, prefix, prefix_id, suffix, suffix_id)
    assert form.rows(*case) == b"".join(expected)
    assert form.each(*case) == expected


TEXTS = st.lists(
    st.one_of(
        st.sampled_from([b"", b"\n", b"G1 ", b" F250.\n", b" R1.\nK1.\nK1.\nK1.\nK1.\n"]),
        st.binary(max_size=80).map(lambda text: text.translate(bytes([63, 63, *range(2, 256)]))),
    ),
    min_size=1,
    max_size=5,
)
TICKS = st.one_of(
    st.integers(-12, 12),
    st.integers(-20_000, 20_000),
    st.integers(0, 15).flatmap(lambda n: st.integers(-2, 2).map(lambda d: min(10**n + d, TICK_LIMIT))),
    st.integers(0, 15).map(lambda n: -(10**n)),
    st.integers(-TICK_LIMIT, TICK_LIMIT),
)


@st.composite
def tables(draw: st.DrawFn) -> tuple[RowFormat, np.ndarray, list[bytes], list[int], list[bytes], list[int]]:
    columns, m = draw(st.integers(0, 4)), draw(st.integers(0, 12))
    form = RowFormat(
        tuple(draw(st.sampled_from([b"", b"X", b" Y", b",", b" P4 K0. X="])) for _ in range(columns)),
        tuple(draw(st.integers(0, 15)) for _ in range(columns)),
        plus=draw(st.booleans()),
        trim=draw(st.booleans()),
        leading_zero=draw(st.booleans()),
    )
    ticks = np.array([[draw(TICKS) for _ in range(columns)] for _ in range(m)], np.int64).reshape(m, columns)
    prefix, suffix = draw(TEXTS), draw(TEXTS)
    prefix_id = [draw(st.integers(0, len(prefix) - 1)) for _ in range(m)]
    suffix_id = [draw(st.integers(0, len(suffix) - 1)) for _ in range(m)]
    return form, ticks, prefix, prefix_id, suffix, suffix_id


@given(tables())
def test_fast_rows_are_the_careful_rows(
    case: tuple[RowFormat, np.ndarray, list[bytes], list[int], list[bytes], list[int]],
) -> None:
    check(*case)


@given(st.lists(st.tuples(st.floats(-9e10, 9e10), st.floats(-1, 1)), max_size=30), st.integers(0, 7))
def test_rows_of_ticks_are_what_percent_f_prints(pairs: list[tuple[float, float]], decimals: int) -> None:
    form = RowFormat((b"X", b" I"), (4, decimals))
    values = np.array(pairs).reshape(-1, 2)
    text = form.rows(to_ticks(values, form.decimals), [b"G1 "], 0, [b"\n"], 0)
    printed = "".join(f"G1 X{x:.4f} I{i:.{decimals}f}\n" for x, i in pairs)
    zeros = {f"{letter}-{0:.{places}f}": f"{letter}{0:.{places}f}" for letter, places in (("X", 4), ("I", decimals))}
    words = [zeros.get(word, word) for word in printed.replace("\n", " \n ").split(" ")]
    assert text.decode() == " ".join(words).replace(" \n ", "\n")


@pytest.mark.parametrize("decimals", [0, 1, 2, 3, 4, 5, 6, 7, 8, 15])
@pytest.mark.parametrize("options", [{}, {"trim": True}, {"trim": True, "leading_zero": False}, {"plus": True}])
def test_every_size_of_number_with_every_number_of_decimals(decimals: int, options: dict[str, bool]) -> None:
    form = RowFormat((b"A",), (decimals,), **options)
    for size in range(16):
        near = np.array([10**size + d for d in (-1, 0, 1)] + [5 * 10**size, 0, 10**size // 2]).clip(0, TICK_LIMIT)
        ticks = np.concatenate((near, -near))[:, None]
        for some in (ticks, ticks[:1], ticks[-1:]):
            check(form, some, [b""], [0] * len(some), [b"\n"], [0] * len(some))


@pytest.mark.parametrize("m", [0, 1, 255, 256, 257])
@pytest.mark.parametrize("block", [1, 7, 256, rows.BLOCK])
def test_result_does_not_depend_on_the_block(monkeypatch: pytest.MonkeyPatch, m: int, block: int) -> None:
    rng = np.random.default_rng(m)
    ticks = rng.integers(-(10**7), 10**7, (m, 3)) // 10 ** rng.integers(0, 8, (m, 3))
    prefix, suffix = (
        [b"G1 ", b"", b"(" + b"long " * 40 + b")\nG0 "],
        [b"\n", b" F250.\nM0\n", b"\n" + b"x" * 500 + b"\n"],
    )
    monkeypatch.setattr(rows, "BLOCK", block)
    check(XYZ, ticks, prefix, rng.integers(0, 3, m).tolist(), suffix, rng.integers(0, 3, m).tolist())


def test_many_rows() -> None:
    m = 2 * rows.BLOCK + 5
    rng = np.random.default_rng(3)
    form = RowFormat((b"X", b" Y", b" Z", b" I", b" J", b" K"), (4, 4, 4, 7, 7, 7))
    values = np.hstack((rng.uniform(-300, 300, (m, 3)), rng.uniform(-1, 1, (m, 3))))
    text = form.rows(to_ticks(values, form.decimals), [b"G1 "], 0, [b"\n"], 0)
    lines = ["G1 X{:.4f} Y{:.4f} Z{:.4f} I{:.7f} J{:.7f} K{:.7f}\n".format(*row) for row in values.tolist()]
    assert text == "".join(lines).encode()


def test_hundreds_of_texts() -> None:
    m = 700
    prefix = [b"N%d " % n for n in range(m)]
    suffix = [b" F%d.\n" % n + b"(%s)\n" % (b"c" * n) for n in range(m)]
    ticks = np.arange(3 * m).reshape(m, 3)
    check(XYZ, ticks, prefix, list(range(m)), suffix, list(range(m))[::-1])


def test_no_rows() -> None:
    assert XYZ.rows(np.zeros((0, 3), np.int64), [], [], [], []) == b""
    assert XYZ.each(np.zeros((0, 3), np.int64), [], [], [], []) == []


def test_strided_ticks() -> None:
    ticks = np.arange(-3000, 3000).reshape(-1, 6)
    m = len(ticks)
    check(XYZ, ticks[:, ::-2], [b""], [0] * m, [b"\n"], [0] * m)


@pytest.mark.parametrize("bad", [TICK_LIMIT + 1, -TICK_LIMIT - 1, np.iinfo(np.int64).min, np.iinfo(np.int64).max])
def test_ticks_out_of_range(bad: int) -> None:
    ticks = np.zeros((600, 3), np.int64)
    ticks[300, 1] = bad
    with pytest.raises(OutputError) as caught:
        XYZ.rows(ticks, [b""], 0, [b"\n"], 0)
    assert caught.value.code == "CS301"


def test_what_does_not_fit_is_refused() -> None:
    good = np.zeros((2, 3), np.int64)
    for texts in ([b"\0"], [b"x" * 100 + b"\0"]):
        with pytest.raises(ValueError, match="zero byte"):
            XYZ.rows(good, texts, 0, [b"\n"], 0)
        with pytest.raises(ValueError, match="zero byte"):
            XYZ.rows(good, [b""], 0, texts, 0)
    for ids in ([0, 1], [-1, 0], 1, [0, 0, 0]):
        with pytest.raises(ValueError):  # noqa: PT011 - numpy says which
            XYZ.rows(good, [b""], ids, [b"\n"], 0)
