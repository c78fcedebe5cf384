"""Comments in NC text: ASCII, no parentheses inside, lines of bearable length."""

from __future__ import annotations

import unicodedata

#: characters of a comment's text in one block; controls truncate or refuse long ones
_LONGEST = 120

#: brackets end a comment, ``%`` a file, ``;`` a block on some controls; ``~`` lets a block go on in the next line
_REPLACED = str.maketrans("()%;~", "[]/,-")

_SPELLED = {"ß": "ss", "Ø": "O", "ø": "o", "Æ": "AE", "æ": "ae", "Œ": "OE", "œ": "oe", "đ": "d", "Đ": "D", "ł": "l"}


def plain_text(text: str) -> str:
    """Return the text in the characters that controls accept in a comment; what has no such form becomes ``?``."""
    text = "".join(_SPELLED.get(letter, letter) for letter in text)
    decomposed = unicodedata.normalize("NFKD", text)
    kept = "".join(letter for letter in decomposed if not unicodedata.combining(letter))
    ascii_text = kept.encode("ascii", "replace").decode("ascii")
    printable = "".join(letter if letter.isprintable() else " " for letter in ascii_text)
    return " ".join(printable.translate(_REPLACED).split())


def comment_lines(text: str, marks: tuple[str, str] = ("(", ")"), orders: tuple[str, ...] = ()) -> list[str]:
    """Text as one or more comments between marks; none for an empty text.

    Parameters
    ----------
    orders : tuple of str
        First words that the control would obey.
    """
    plain, at = plain_text(text), 0
    lines = []
    while at < len(plain):
        part = plain[at : at + _LONGEST]
        at += _LONGEST
        at += plain[at : at + 1] == " "  # there are no two blanks side by side
        if part.upper().startswith(orders):
            part = f"- {part}"
        lines.append(f"{marks[0]}{part}{marks[1]}".rstrip())
    return lines
