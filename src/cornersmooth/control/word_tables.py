"""Tables of each control's words, one TOML file in `word_lists`: how the words are spelt and read, and what they do.

Keys:

``like``
    A control whose table holds where this one says nothing; its words come after those of this one.
``begin``, ``end``
    Blocks, as regular expressions, that a program begins and ends with.
``header``
    What may stand before that: a mark of the transfer.
``orders``
    What a comment begins with that the control would obey.
``points``
    Addresses whose numbers need their decimal point.
``whole``
    Those of them that count in full without it, in millimetres per minute.
``feed_in_plane``
    Whether F of a circular block that rises counts in the plane of the circle alone, and not along the helix.
``switches``
    Whether tip control is switched by blocks that the machine's file names.
``spelling``
    How the words are spelt: a class of `dialects`; ``"iso"`` unless it says otherwise.
``[grammar]``
    How the words are read: attributes of the control's class in `dialects`.
``[words]``
    What words do, a row a word (`control.table`). Each key may name several words; here each has its own. ``""`` takes
    a row of a control back that this one is like.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any, Final

#: words, and kind and value of what each says beside the motion
Means = Mapping[str, tuple[str, str]]

_LISTS: Final = files(__package__).joinpath("word_lists")

#: controls whose texts are read
CONTROLS: Final = tuple(sorted(item.name.removesuffix(".toml") for item in _LISTS.iterdir()))


@cache
def word_table(control: str) -> Mapping[str, Any]:
    """Table of a control, with what it takes over of the control that it is like."""
    table = tomllib.loads(_LISTS.joinpath(f"{control}.toml").read_text(encoding="utf-8"))
    rows = table.get("words", {}).items()
    words = {word: row for key, row in rows for word in (key.split(" | ") if key[0] != "/" else [key])}
    base = word_table(table.pop("like")) if "like" in table else {"words": {}}
    words |= {word: row for word, row in base["words"].items() if word not in words}
    return {**base, **table, "words": words}
