"""How much of the long lists of cases is run: a share by default, all of them with CORNERSMOOTH_THOROUGH=1.

Each file, form, machine and tolerance is tried in a share, not each with each other; `make thorough` runs all.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import fields, is_dataclass
from typing import TypeVar

Item = TypeVar("Item")

THOROUGH = bool(os.environ.get("CORNERSMOOTH_THOROUGH"))


def share(items: Iterable[Item], every: int, first: int = 0) -> list[Item]:
    """Each `every`-th of the items from the `first` one; all of them in a thorough run."""
    return list(items) if THOROUGH else list(items)[first % every :: every]


def covering_share(items: Iterable[Item], every: int, first: int = 0) -> list[Item]:
    """As `share`, and others of the items, until each value of each of their parts is tried: files, forms, limits."""
    everything = list(items)
    if THOROUGH:
        return everything
    chosen = set(range(first % every, len(everything), every))
    tried = {value for k in chosen for value in _parts(everything[k])}
    for k, item in enumerate(everything):
        if not tried.issuperset(parts := _parts(item)):
            chosen.add(k)
            tried |= parts
    return [everything[k] for k in sorted(chosen)]


def _parts(item: object, place: tuple[object, ...] = ()) -> set[tuple[object, ...]]:
    """Each value that an item holds, and where; nothing for what has no parts."""
    if is_dataclass(item) and not isinstance(item, type):
        parts = [getattr(item, one.name) for one in fields(item)]
    elif isinstance(item, tuple):
        parts = list(item)
    else:
        return {(*place, repr(item))} if place else set()
    return {value for k, part in enumerate(parts) for value in _parts(part, (*place, k))}


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
