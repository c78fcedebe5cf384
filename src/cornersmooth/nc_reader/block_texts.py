"""Blocks as texts: how the word lists have them, and how they are shown and compared."""

from __future__ import annotations

import re
from typing import Final

from cornersmooth.nc_reader.words import Word

#: stands for any number in a block of the user's
_ANY: Final = "9075301"


def said(word: Word) -> str:
    """Text of a word as the list has it: blanks left out, codes without leading zeros."""
    if word.name in ("G", "M") and word.text[:1] == word.name and not _SIGN.search(word.text):
        return f"{word.name}{word.value:g}"
    return word.text if word.name == "block" else word.text.replace(" ", "").replace("\t", "")


def numbers_in(template: str) -> str:
    """Block of the user's with numbers for what stands in braces; a word of its own is a G word."""

    def number(found: re.Match[str]) -> str:
        return _ANY if template[: found.start()][-1:] not in ("", " ") else f"G{_ANY}"

    return re.sub(r"\{\w+\}", number, template)


def any_numbers(text: str) -> re.Pattern[str]:
    """Pattern of blocks that differ from one of `numbers_in` in these numbers only."""
    return re.compile(re.escape(text).replace(_ANY, r"[-+]?[\d.]+"))


def text_of(words: list[str]) -> str:
    """Text of a block of words."""
    return " ".join(words)


def any_of(pattern: re.Pattern[str], words: list[str]) -> bool:
    """Whether any of the words is of a pattern."""
    return any(pattern.fullmatch(word) for word in words)


def shown(pattern: re.Pattern[str]) -> str:
    """Regular expression in the user's words."""
    text = pattern.pattern
    for old, new in _PLAIN:
        text = text.replace(old, new)
    return text


#: no code has one
_SIGN: Final = re.compile("[-+]")

_PLAIN: Final = (
    (r"(?=\d*[1-9])", ""),
    *((old, "…") for old in (r"\d+", r"\d{1,8}", r"\d{1,5}", r"[\d.]+", r"\w+", ".*", "(\\.\\d*)?")),
    (r"\.", "."),
    ("(?:", "("),
    ("|", " or "),
)
