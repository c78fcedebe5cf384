"""Rounding for output: float64 to whole steps of the last printed digit, and one number as text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from cornersmooth.errors import OutputError
from cornersmooth.model import Floats, Ints

#: largest number of ticks, and the most decimals: within them a product with a power of ten is known to a fraction of
#: a tick, so that a tie can be seen
TICK_LIMIT: Final = 10**15
MOST_DECIMALS: Final = 15
BLOCK: Final = 1 << 15  #: numbers rounded at a time
#: 2^27 + 1 splits a float64 into two halves whose products are exact (T. J. Dekker, Numer. Math. 18 (1971) 224)
_SPLITTER: Final = 134217729.0


def to_ticks(values: ArrayLike, decimals: int | Sequence[int]) -> Ints:
    """Round to the integer n for which ``n * 10**-decimals`` is what ``'%.{decimals}f' % value`` prints.

    The exact binary value is rounded, exact ties to even. This is the only rounding of numbers for output. Decimals, up
    to `MOST_DECIMALS`, are for all values, or one for each column of the last axis. CS301 for a value that is not
    finite or has more than `TICK_LIMIT` ticks.
    """
    numbers = np.asarray(values, np.float64)
    places = np.asarray(decimals)
    if places.ndim > 1 or (places.size and not 0 <= places.min() <= places.max() <= MOST_DECIMALS):
        raise ValueError(f"decimals is {decimals!r}: give whole numbers from 0 to {MOST_DECIMALS}")
    if places.ndim and numbers.shape[-1:] != places.shape:
        raise ValueError(f"{len(places)} decimals for values of shape {numbers.shape}")
    ticks = np.empty(numbers.shape, np.int64)
    if not numbers.size:
        return ticks
    flat, target = numbers.reshape(-1), ticks.reshape(-1)
    scale = np.array([float(10**n) for n in places.reshape(-1).tolist()])
    scale = np.tile(scale, -(-min(BLOCK, len(flat)) // len(scale)))  # whole rows, the scales of a block in one array
    for start in range(0, len(flat), len(scale)):
        block = flat[start : start + len(scale)]
        target[start : start + len(scale)] = _round_block(block, scale[: len(block)])
    return ticks


def _round_block(values: Floats, scale: Floats) -> Floats:
    """Round each of (r,) values to whole ticks, `scale` (r,) of them to the unit."""
    with np.errstate(over="ignore", invalid="ignore"):
        product = values * scale
        largest = max(-product.min(), product.max())
    if not largest <= TICK_LIMIT:
        raise _unprintable(values, scale)
    ticks: Floats = np.rint(product)
    product -= ticks
    # the product is within largest·2^-53 of the true one: only so near to a half can rint be misled
    near = np.flatnonzero(np.abs(product) >= 0.5 - largest * 2.0**-52)
    if len(near):
        ticks[near] = _round_exactly(values[near], scale[near])
    return ticks


def _round_exactly(values: Floats, scale: Floats) -> Floats:
    """Round values·scale half to even, deciding on the exact product."""
    product = values * scale
    error = _product_error(values, scale, product)
    below = np.floor(product)
    half = (product - below) - 0.5  # both differences are exact, and the sign of the sum below is the true one
    rest = half + error
    up = (rest > 0) | ((rest == 0) & (below % 2 == 1))
    return below + up


def _product_error(a: Floats, b: Floats, product: Floats) -> Floats:
    """Return a·b − product without rounding, for factors that neither overflow nor vanish when split."""
    a_high = _SPLITTER * a - (_SPLITTER * a - a)
    b_high = _SPLITTER * b - (_SPLITTER * b - b)
    a_low, b_low = a - a_high, b - b_high
    return a_low * b_low - (((product - a_high * b_high) - a_low * b_high) - a_high * b_low)


def _unprintable(values: Floats, scale: Floats) -> OutputError:
    with np.errstate(over="ignore"):
        worst = np.argmin(np.abs(values * scale) <= TICK_LIMIT)  # not a number compares as False
    value, limit = float(values[worst]), float(TICK_LIMIT / scale[worst])
    if not math.isfinite(value):
        return OutputError("CS301", f"a number to be written is {value}", "please report this with the input file")
    return OutputError("CS301", f"the number {value:g} is too large to be written", f"keep numbers below {limit:g}")


def format_number(value: float, decimals: int, *, trim: bool = False, plus: bool = False) -> str:
    """Write one number as `RowFormat` writes it: rounded by `to_ticks`, never as ``-0`` or with an exponent.

    0 decimals write no point unless `trim`, which drops trailing zeros but keeps the point: ``"12."``, ``"0.5"``.
    `plus` writes ``+`` before numbers that are not negative. CS301, as `to_ticks`.
    """
    if not abs(value) * 10.0**decimals < TICK_LIMIT:
        to_ticks(value, decimals)  # says what is wrong
    digits = f"{abs(value):.{decimals}f}"  # rounds as `to_ticks` does, at a fraction of its cost for one number
    sign = "+" if plus else ""
    if value < 0 and digits.strip("0."):
        sign = "-"
    if trim:
        return f"{sign}{digits.rstrip('0')}" if decimals else f"{sign}{digits}."
    return sign + digits
