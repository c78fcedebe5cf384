"""Tables of each control's words, one TOML file in `word_lists`: how the words are spelt and read, what they mean.

What else is in them, rules and where words may stand, is explained in `nc_words.rules`. Keys for the reader:

``like``
    A control whose table holds where this one says nothing; its words come after those of this one.
``points``
    Addresses whose numbers need their decimal point.
``whole``
    Those of them that count in full without it, in millimetres per minute.
``switches``
    Whether tip control is switched by blocks that the machine's file names.
``spelling``
    How the words are spelt: a class of `dialects`; ``"iso"`` unless it says otherwise.
``[grammar]``
    How the words are read: attributes of the control's class in `dialects`.
``[means]``
    What words say beside the motion, as `statements` has it: the kind, then the word of the CL file. What is no value
    here the control has no word for. A third part says of what kind alone a word is the end
    (``M89 = "coolant OFF THRU"``). ``""``: not the word of a control that this one is like.
``[does]``
    What words do to what the control remembers, a row a word: `control.table` explains it. Each key may name several
    words; here each has its own.
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
    does = {word: row for words, row in table.pop("does", {}).items() for word in words.split(" | ")}
    if "like" in table:
        base = word_table(table.pop("like"))
        does |= {word: row for word, row in base["does"].items() if word not in does}
        table = {
            **base,
            **table,
            "means": base["means"] | table.get("means", {}),
            **{key: [*table.get(key, ()), *base[key]] for key in ("word", "block")},
        }
    return table | {"does": does}


@cache
def means_of(control: str) -> Means:
    """What the words of a control say beside the motion."""
    said = {word: text.split() for word, text in word_table(control)["means"].items() if text}
    return {word: (parts[0], "".join(parts[1:2])) for word, parts in said.items()}
