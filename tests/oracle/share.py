"""How much of the long lists of cases is run: a share by default, all of them with CORNERSMOOTH_THOROUGH=1.

The share walks through files, forms and tolerances alike, so that each of them is tried; `make thorough` runs all.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

Item = TypeVar("Item")

THOROUGH = bool(os.environ.get("CORNERSMOOTH_THOROUGH"))


def share(items: Iterable[Item], every: int, first: int = 0) -> list[Item]:
    """Each `every`-th of the items from the `first` one; all of them in a thorough run."""
    return list(items) if THOROUGH else list(items)[first % every :: every]


def share_of_kinds(items: Sequence[Item], kind: Callable[[Item], object], every: int) -> list[Item]:
    """The first of each kind and then each `every`-th of it; all of them in a thorough run."""
    seen: dict[object, int] = {}
    chosen = []
    for item in items:
        seen[kind(item)] = seen.get(kind(item), -1) + 1
        if THOROUGH or seen[kind(item)] % every == 0:
            chosen.append(item)
    return chosen


def how_many(usual: int, thorough: int) -> int:
    """How many random cases."""
    return thorough if THOROUGH else usual
