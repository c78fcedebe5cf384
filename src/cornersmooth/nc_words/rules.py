"""The closed list of words of each control: what they are, what must hold before the tool moves, where they may stand.

They are data (`nc_reader.word_tables`), with the manual that they are from. Keys:

``begin``, ``end``
    Blocks, as regular expressions, that a program begins and ends with.
``header``
    What may stand before that: a mark of the transfer.
``orders``
    What a comment begins with that the control would obey.
``[means]``
    Words of spindle and coolant need no ``[[word]]``: their rules follow.
``[[word]]``: their rules follow. What is no value here the control has no word for. A third
    part says of what kind alone a word is the end (``M89 = "coolant OFF THRU"``). ``""``: not the word of a control
    that this one is like.
``[[word]]``
    ``is``: the word, blanks left out. ``says``: what it means, for the documentation.

    ``state``: what it changes; of a ``[[block]]``, too. Where the tool moves, every state must be what it was at the
    first motion, but for those that ``follows`` the CL file, which others compare. ``off``: what must hold at the end
    of the program. ``compared``: others compare it with the CL file.

    ``first``: when it must have been said: one of these words before the first ``"motion"``; in programs of our own
    before the first ``"retract"``, or before it is ``"used"``: before another word of its state.

    ``needs``: a word that must stand in the same block, of whose state it may say more. ``must``: the same, for a word
    that is nothing without. ``alone``: no other words may stand beside it. ``before``: ``"arc"``. ``after``: a word
    that must have been said since the last time. ``then``, ``behind``: the next block, the block before. ``share``:
    what the number in brackets may be of the tolerance. ``varies``: it may change within the program. ``rotary``: where
    the rotary axes must have been sent before: to ``"zero"``, as, where a parameter says so, the part program turns
    with the angles of that moment; or, in programs of our own, where the ``"next"`` motion has them. ``turns``: the
    control turns them, and nobody says where to. ``never``: the control has no such word.
    ``tool``: in a text with a ``cycle`` of the control, a tilted plane or cutter compensation (all ``cycle``), it may
    differ from tool to tool. ``high``:
    only behind a retract; a control with such a word wants the tool high at the end, too. ``late``: behind a retract it
    may come as late as in the block that first moves Z. ``ends``: it must be switched off before the tool is changed.
    ``outside``: it may not be said while a word that ``ends`` holds. ``drops``: a state that the control forgets with
    it, and that must be said behind it. ``moves``: the tool moves, though the block names no axis.

    In programs of our own: ``bars``: states of which no word that is ``tidy`` or ``ends`` may hold where it is said.
    ``tidy``: it must be switched off before another tool and at the end. ``preset``: the one that is meant where the
    head names none. ``down``: one of its state must hold where the tool comes down from a retract while a word like
    this holds.
``[[block]]``
    A block that counts as a whole. ``retract``: it moves the tool away, which no motion may follow but an approach, in
    which work offset or tool length are said again.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any, Final

from cornersmooth.nc_reader.word_tables import word_table
from cornersmooth.nc_reader.words import Word

#: values that end a state, or do not begin one
_ENDS: Final = frozenset(("OFF", "ORIENT"))

#: keys of a word that are regular expressions
_PATTERNS: Final = frozenset(("is", "needs", "must", "after", "then", "behind", "down", "bars"))


@dataclass(frozen=True)
class WordRule:
    """What the list says of a word; the module says what the fields mean."""

    pattern: re.Pattern[str]
    says: str = ""
    state: str = ""
    off: bool = False
    follows: bool = False
    compared: bool = False
    needs: re.Pattern[str] | None = None
    must: re.Pattern[str] | None = None
    alone: bool = False
    before: str = ""
    after: re.Pattern[str] | None = None
    then: re.Pattern[str] | None = None
    behind: re.Pattern[str] | None = None
    share: float | None = None
    never: bool = False
    high: bool = False
    retract: bool = False
    rotary: str = ""
    tool: bool = False
    cycle: bool = False
    turns: bool = False
    late: bool = False
    ends: bool = False
    outside: bool = False
    drops: str = ""
    moves: bool = False
    first: str = ""
    tidy: bool = False
    preset: str = ""
    bars: re.Pattern[str] | None = None
    down: re.Pattern[str] | None = None

    @property
    def changes_tool(self) -> bool:
        """Whether another tool is taken."""
        return self.compared and (self.high or self.after is not None)


@dataclass(frozen=True)
class WordList:
    """The words of a control."""

    begin: tuple[re.Pattern[str], ...] = ()
    end: tuple[re.Pattern[str], ...] = ()
    header: re.Pattern[str] | None = None
    orders: re.Pattern[str] | None = None
    #: what is the control's own comes first
    words: tuple[WordRule, ...] = ()
    blocks: tuple[WordRule, ...] = field(default=())

    @cached_property
    def heads(self) -> dict[str, list[WordRule]]:
        """Words of which one must come before the first motion, by state."""
        found: dict[str, list[WordRule]] = {}
        for rule in self.words:
            if rule.first == "motion":
                found.setdefault(rule.state, []).append(rule)
        return found


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
        blocks=tuple(map(_rule, table["block"])),
    )


def _functions(means: Mapping[str, Sequence[str]]) -> Iterator[WordRule]:
    """Rules of words of spindle and coolant: what has an end of its own is a state of its own, beside no other."""
    apart = {f"{parts[0]} {parts[2]}" for parts in means.values() if len(parts) > 2}
    for word, parts in means.items():
        kind, last = parts[0], parts[-1]
        if kind in ("spindle", "coolant"):
            states = {kind, *(state for state in apart if state.startswith(kind))}
            state = name if (name := f"{kind} {last}") in apart else kind
            others = sorted(states - {state}) if len(parts) == 2 else ()
            yield WordRule(
                re.compile(re.escape(word)),
                f"{' '.join(parts)}: compared with the statements",
                state=state,
                follows=True,
                compared=True,
                tidy=parts[1] not in _ENDS,
                bars=re.compile("|".join(others)) if others else None,
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
