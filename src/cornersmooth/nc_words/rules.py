"""The closed list of words of each control: what they are, what must hold before the tool moves, where they may stand.

They are data of TOML tables (`nc_reader.word_tables`), with the manual that they are from. Keys:

``begin``, ``end``
    Blocks, as regular expressions, that a program begins and ends with.
``header``
    What may stand before that: a mark of the transfer.
``orders``
    What a comment begins with that the control would obey.
``[[word]]``, ``[[block]]``
    Words, and blocks that count as a whole: ``is``, blanks left out, and the fields of `WordRule`. Those of spindle and
    coolant follow from ``[means]``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

from cornersmooth.nc_reader.word_tables import word_table
from cornersmooth.nc_reader.words import Word

#: values that end a state, or do not begin one
_ENDS: Final = frozenset(("OFF", "ORIENT"))

#: keys of a word that are regular expressions
_PATTERNS: Final = frozenset(("is", "needs", "must", "after", "then", "behind", "extra"))


@dataclass(frozen=True)
class WordRule:
    """What the list says of a word or a block."""

    pattern: re.Pattern[str]
    says: str = ""  #: what it means, for the documentation

    # the block: words that must stand beside it (`needs` finds the rule, and may say more of the state of that word)
    needs: re.Pattern[str] | None = None
    must: re.Pattern[str] | None = None
    alone: bool = False  #: no other words may stand beside it
    #: what the numbers in its groups may be of the tolerance: ``length`` of ε, ``angle`` of that of the tool axis
    share: float | None = None
    extra: re.Pattern[str] | None = None  #: words of its block that switch on what somebody must have asked for
    numbers: str = ""  #: what is done with its numbers, where they have no share and are not `compared`
    never: bool = False  #: the control has no such word

    # blocks before and after
    after: re.Pattern[str] | None = None  #: a word that must have been said since the last time
    behind: re.Pattern[str] | None = None  #: the block before
    then: re.Pattern[str] | None = None  #: the next block
    plane: int = 0  #: the G word of planes that must be in force where it is taken
    before: str = ""  #: ``"arc"``: the next motion must be one, but for the word that held at first

    # its state: where the tool moves, that must be what it was at the first motion
    state: str = ""
    follows: bool = False  #: but not this one: it follows the CL file, and others compare it
    tool: bool = False  #: it may differ from tool to tool in a program with a `cycle`
    cycle: bool = False  #: a hole cycle of the control, a tilted plane, cutter compensation
    late: bool = False  #: after a retract it may come as late as in the block that first moves Z
    compared: bool = False  #: others compare the word with the CL file
    first: bool = False  #: one of its state must come before the first motion
    preset: str = ""  #: the usual one of these
    drops: str = ""  #: a state that the control forgets with it, and that must be said after it

    # until when it may hold
    off: bool = False  #: it switches the state off, which must hold at the end
    ends: bool = False  #: tool tip control: it must be switched off before the tool is changed
    outside: bool = False  #: it may not be said while a word that `ends` holds
    runs: bool = False  #: spindle or coolant is on with it

    # where the tool is
    #: the tool goes away, and none but an approach may follow, in which work offset or tool length are said again
    retract: bool = False
    high: bool = False  #: only after a retract; a control with such a word wants the tool high at the end, too
    moves: bool = False  #: the tool moves, though the block names no axis
    turns: bool = False  #: the control turns the rotary axes, and nobody says where to
    #: they must have been sent to zero before: where a parameter says so, the part program turns with the angles of
    #: that moment
    zero: bool = False

    @property
    def changes_tool(self) -> bool:
        """Whether another tool is taken."""
        return self.compared and (self.high or self.after is not None)


#: the rule of words that are not on the list, or not beside these
UNLISTED: Final = WordRule(re.compile("(?!)"))


@dataclass(frozen=True)
class WordList:
    """The words of a control."""

    begin: tuple[re.Pattern[str], ...]
    end: tuple[re.Pattern[str], ...]
    header: re.Pattern[str] | None
    orders: re.Pattern[str] | None
    #: what is the control's own comes first
    words: tuple[WordRule, ...]
    blocks: tuple[WordRule, ...]


@cache
def word_list(control: str) -> WordList:
    """Words of a control."""
    table = word_table(control)
    means = {word: text.split() for word, text in table["means"].items() if text}
    words: dict[tuple[str, re.Pattern[str] | None], WordRule] = {}
    for rule in (*_functions(means), *map(_rule, table["word"])):
        words.setdefault((rule.pattern.pattern, rule.needs), rule)
    return WordList(
        begin=tuple(map(re.compile, table["begin"])),
        end=tuple(map(re.compile, table["end"])),
        header=re.compile(table["header"]) if "header" in table else None,
        orders=re.compile(table["orders"], re.IGNORECASE) if "orders" in table else None,
        words=tuple(words.values()),
        blocks=tuple(_rule({"alone": True, **entry}) for entry in table["block"]),
    )


def _functions(means: Mapping[str, Sequence[str]]) -> Iterator[WordRule]:
    """Rules of words of spindle and coolant: what has an end of its own is a state of its own, beside no other."""
    apart = {f"{parts[0]} {parts[2]}" for parts in means.values() if len(parts) > 2}
    for word, parts in means.items():
        kind, last = parts[0], parts[-1]
        if kind in ("spindle", "coolant"):
            state = name if (name := f"{kind} {last}") in apart else kind
            yield WordRule(
                re.compile(re.escape(word)),
                f"{' '.join(parts)}: compared with the statements",
                state=state,
                follows=True,
                compared=True,
                runs=parts[1] not in _ENDS,
            )


def _rule(entry: dict[str, Any]) -> WordRule:
    values: dict[str, Any] = {key: re.compile(value) if key in _PATTERNS else value for key, value in entry.items()}
    return WordRule(values.pop("is"), **values)


def word_text(word: Word) -> str:
    """Text of a word as the lists have it: blanks left out, codes without leading zeros."""
    if word.name in ("G", "M") and word.text[:1] == word.name and not _SIGN.search(word.text):
        return f"{word.name}{word.value:g}"
    return word.text if word.name == "block" else word.text.replace(" ", "").replace("\t", "")


def any_of(pattern: re.Pattern[str], words: Iterable[str]) -> bool:
    """Whether any of the words is of a pattern."""
    return any(map(pattern.fullmatch, words))


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
