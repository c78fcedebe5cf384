"""The closed list of words of each control: what they are, what must hold before the tool moves, where they may stand.

The lists are data, one TOML file for each control in `word_lists`, with the manual that they are from. Keys:

``begin``, ``end``
    Blocks, as regular expressions, that a program begins and ends with.
``header``
    What may stand before that: a mark of the transfer.
``points``
    Addresses whose numbers need their decimal point.
``switches``
    Whether tip control is switched by blocks that the machine's file names.
``orders``
    What a comment begins with that the control would obey.
``[[word]]``
    ``is``: the word, blanks left out. ``says``: what it means, for the documentation.

    ``state``: what it changes; of a ``[[block]]``, too. Where the tool moves, every state must be what it was at the
    first motion, but for those that ``follows`` the CL file, which others compare. ``head``: one of these words must be
    said before the first motion. ``off``: what must hold at the end of the program. ``compared``: others compare it
    with the CL file.

    ``needs``: a word that must stand in the same block, of whose state it may say more. ``must``: the same, for a word
    that is nothing without. ``alone``: no other words may stand beside it. ``before``: ``"arc"``. ``after``: a word
    that must have been said since the last time. ``then``, ``behind``: the next block, the block before. ``share``:
    what the number in brackets may be of the tolerance. ``varies``: it may change within the program. ``zero``: the
    rotary axes must have been sent to zero before: where a parameter says so, the part program turns with the angles of
    that moment. ``turns``: the control turns them, and nobody says where to. ``never``: the control has no such word.
    ``tool``: in a text with a ``cycle`` of the control, a tilted plane or cutter compensation (all ``cycle``), it may
    differ from tool to tool. ``high``:
    only behind a retract; a control with such a word wants the tool high at the end, too. ``late``: behind a retract it
    may come as late as in the block that first moves Z. ``ends``: it must be switched off before the tool is changed.
    ``outside``: it may not be said while a word that ``ends`` holds. ``drops``: a state that the control forgets with
    it, and that must be said behind it. ``moves``: the tool moves, though the block names no axis.

    In texts of our own (`own_frame`): ``first``: it must come before the first retract (``"first"``), or before
    another word of its state (``"used"``). ``bars``: a state of which no word that is ``tidy`` or ``ends`` may hold
    where it is said. ``tidy``: it must be switched off before another tool and at the end. ``turned``: the rotary axes
    must stand as the next motion has them. ``preset``: the one that is meant where the head names none. ``down``: one
    of its state must hold where the tool comes down from a retract while a word like this holds.
``[[block]]``
    A block that counts as a whole. ``retract``: it moves the tool away, which no motion may follow but an approach, in
    which work offset or tool length are said again.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass, field, replace
from functools import cache, cached_property
from importlib.resources import files
from typing import Any, Final

#: keys of a word that are regular expressions
_PATTERNS: Final = frozenset(("is", "needs", "must", "after", "then", "behind", "down"))


@dataclass(frozen=True)
class WordRule:
    """What the list says of a word; the module says what the fields mean."""

    pattern: re.Pattern[str]
    says: str = ""
    state: str = ""
    head: bool = False
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
    varies: bool = False
    never: bool = False
    high: bool = False
    retract: bool = False
    zero: bool = False
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
    turned: bool = False
    preset: str = ""
    bars: str = ""
    down: re.Pattern[str] | None = None


@dataclass(frozen=True)
class WordList:
    """The words of a control."""

    begin: tuple[re.Pattern[str], ...] = ()
    end: tuple[re.Pattern[str], ...] = ()
    header: re.Pattern[str] | None = None
    points: frozenset[str] = frozenset()
    switches: bool = False
    orders: re.Pattern[str] | None = None
    #: what is the control's own comes first
    words: tuple[WordRule, ...] = ()
    blocks: tuple[WordRule, ...] = field(default=())

    @cached_property
    def heads(self) -> dict[str, list[WordRule]]:
        """Words of which one must come before the first motion, by state."""
        found: dict[str, list[WordRule]] = {}
        for rule in self.words:
            if rule.head and not any(self.shadows(other, rule) for other in self.words):
                found.setdefault(rule.state, []).append(rule)
        return found

    def shadows(self, other: WordRule, rule: WordRule) -> bool:
        """Whether a rule that stands before another is for the same words."""
        same = other.pattern.pattern == rule.pattern.pattern and other.needs == rule.needs
        return same and self.words.index(other) < self.words.index(rule)


@cache
def word_list(control: str) -> WordList:
    """Words of a control."""
    table = tomllib.loads(files(__package__).joinpath("word_lists", f"{control}.toml").read_text(encoding="utf-8"))
    base = word_list(table["like"]) if "like" in table else WordList()
    own: dict[str, Any] = {name: _patterns(table[name]) for name in ("begin", "end") if name in table}
    if "switches" in table:
        own["switches"] = table["switches"]
    if "header" in table:
        own["header"] = re.compile(table["header"])
    if "points" in table:
        own["points"] = frozenset(table["points"])
    if "orders" in table:
        own["orders"] = re.compile(table["orders"], re.IGNORECASE)
    return replace(
        base,
        **own,
        words=(*map(_rule, table.get("word", ())), *base.words),
        blocks=(*map(_rule, table.get("block", ())), *base.blocks),
    )


def _patterns(texts: list[str]) -> tuple[re.Pattern[str], ...]:
    return tuple(map(re.compile, texts))


def _rule(entry: dict[str, Any]) -> WordRule:
    values: dict[str, Any] = {key: re.compile(value) if key in _PATTERNS else value for key, value in entry.items()}
    return WordRule(values.pop("is"), **values)
