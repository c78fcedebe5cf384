"""Tables of reports as CSV text, a block of rows at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from numpy.typing import NDArray

#: rows of text made at a time
_BLOCK = 10_000


def csv_text(forms: Mapping[str, str], count: int, columns: Callable[[slice], Iterable[NDArray[Any]]]) -> Iterator[str]:
    """Header, then the rows: `columns` gives those of a slice, `forms` say how each is written (``{"x": "%.6f"}``)."""
    yield ",".join(forms) + "\n"
    form = ",".join(forms.values()) + "\n"
    for begin in range(0, count, _BLOCK):
        block = (column.tolist() for column in columns(slice(begin, min(begin + _BLOCK, count))))
        yield "".join(map(form.__mod__, zip(*block, strict=True)))
