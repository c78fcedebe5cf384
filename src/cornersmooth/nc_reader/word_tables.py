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
``[words]``, ``[blocks]``
    The closed list of verification, a row a word: ``EFFECTS: LETTERS; RULES; WHAT IT IS`` (`nc_words.rules`).
``[does]``
    What other words do to what the control remembers, a row a word: ``EFFECTS: LETTERS`` (`control.table`); those of
    `[words]` are among them here.

Each key may name several words; here each has its own. ``""`` takes a row of a control back that this one is like.
"""

from __future__ import annotations

import re
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
    rows = {key: _one_by_one(table.pop(key, {})) for key in ("words", "blocks", "does")}
    effects = {_name(word): _effects(row) for word, row in rows["words"].items() if not row or _effects(row)}
    rows["does"] = effects | rows["does"]
    if "like" in table:
        base = word_table(table.pop("like"))
        rows = {
            key: own | {word: row for word, row in base[key].items() if word not in own} for key, own in rows.items()
        }
        table = {**base, **table, "means": base["means"] | table.get("means", {})}
    return table | rows


def _one_by_one(rows: Mapping[str, str]) -> dict[str, str]:
    """Rows with a word each."""
    return {word: row for words, row in rows.items() for word in (words.split(" | ") if words[0] != "/" else [words])}


def _name(word: str) -> str:
    """Name of a word of the list: of one with a number of its own (``T\\d+``) the letter."""
    return word if re.match(r"/|[GM][\d.]+$|[A-Z_]{2}|.*[*]$", word) else word[0]


def _effects(row: str) -> str:
    """What a row of the list says for `[does]`: its effects, and the letters of the words that belong to them."""
    effects, _, letters = row.partition(";")[0].partition(":")
    names = sorted({re.match(r"[A-Za-z]*", letter)[0].upper() for letter in letters.split()})  # type: ignore[index]
    return f"{effects}: {' '.join(names)}" if names else effects


@cache
def means_of(control: str) -> Means:
    """What the words of a control say beside the motion."""
    meanings = {word: text.split() for word, text in word_table(control)["means"].items() if text}
    return {word: (parts[0], "".join(parts[1:2])) for word, parts in meanings.items()}
