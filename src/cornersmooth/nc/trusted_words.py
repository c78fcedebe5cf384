"""Machine functions that a shop's own table declares not to move the tool: ``trusted = ["M208", "M3[0-4]0"]``."""

from __future__ import annotations

import re
from collections.abc import Iterable

from cornersmooth.nc_reader import CONTROLS
from cornersmooth.nc_reader.word_list import WordRule, word_list
from cornersmooth.tables import check_pattern

#: largest number of a machine function
_LARGEST = 9999

#: functions that mean the same on every machine (ISO 6983-1; M17 ends a subprogram)
_FIXED = re.compile(r"M(\d|17|19|30)")

#: functions that move the tool, change what coordinates mean, or jump to other blocks
_MOVING = re.compile(r"M(9[6-9]|198|428|429|430)")

#: path functions of Klartext
_PATH_FUNCTIONS = re.compile(r"M(89|9\d|1[0-4]\d)")


def trusted_words(patterns: Iterable[str], dialect: str) -> frozenset[str]:
    """Return all words that some patterns of machine functions, M with its number, hold for a control.

    ValueError says why not: a pattern of other words, of none, or of words that may move the tool or that the control
    knows.
    """
    found: set[str] = set()
    rules = word_list(dialect).words if dialect in CONTROLS else ()

    def rule_of(word: str) -> WordRule | None:
        return next((rule for rule in rules if rule.pattern.fullmatch(word)), None)

    any_function = rule_of(f"M{_LARGEST}")
    for pattern in patterns:
        check_pattern(pattern)
        own = {word for number in range(_LARGEST + 1) if re.fullmatch(pattern, word := f"M{number}")}
        if not pattern.startswith("M") or not own:
            raise ValueError(f"{pattern!r} is no machine function: other words may move the tool")
        for word in sorted(own, key=lambda word: int(word[1:])):
            if _MOVING.fullmatch(word) or (dialect == "heidenhain" and _PATH_FUNCTIONS.fullmatch(word)):
                raise ValueError(f"{pattern!r} holds {word}, which may move the tool")
            if _FIXED.fullmatch(word) or rule_of(word) is not any_function:
                raise ValueError(f"{pattern!r} holds {word}, which verification compares with the CL file")
        found |= own
    return frozenset(found)
