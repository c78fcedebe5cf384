"""Where the tool is before every word of its position has been said."""

from __future__ import annotations

import numpy as np

from cornersmooth.verify.elements import Element, Elements


def settle(elements: Elements) -> int | None:
    """Put the tool where words that come later first send it, as long as it moves at rapid only.

    Parameters
    ----------
    elements : Elements
        Positions are changed in place; they have NaN where no word has been said yet.

    Returns
    -------
    int or None
        NC line where a feed move goes from or to such a place although a part of it has been said; None without any.
    """
    for values in (elements.tip, elements.second):
        if not len(values) or not np.isnan(values[0]).any():  # what has been said holds
            continue
        unknown = np.isnan(values)
        first = np.where(unknown.all(axis=0), len(values), unknown.argmin(axis=0))
        feed = elements.kind[: int(first.max()) + 1] != Element.RAPID
        if feed.any():
            # the first move has no start that could be known, but it has an end
            return int(elements.line[min(max(int(feed.argmax()), int(first.min())), len(values) - 1)])
        for column, begin in zip(values.T, first.tolist(), strict=True):
            column[:begin] = column[begin] if begin < len(column) else 0.0
    return None
