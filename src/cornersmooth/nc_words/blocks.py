"""Which rule of the control's list a word of a block falls under, and what may not be together in one block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.words import Line
from cornersmooth.nc_words.rules import UNLISTED, WordList, WordRule, any_of, shown

#: words of a block, or the block as a whole, with their rules
Ruled = list[tuple[str, WordRule]]

#: code of words that are not on the list or not in their place
NOT_LISTED: Final = "CS571"

#: blocks, and words, whose rules are remembered
_REMEMBERED: Final = 4096

#: words of which a block may have one
_MOTION: Final = frozenset(("G0", "G1", "G2", "G3", "G6.2", "L", "LN", "SPL", "BSPLINE", "POLY"))


class WordRules:
    """Looks at blocks one by one, whatever is before them.

    Parameters
    ----------
    positions : sequence of WordRule
        Blocks beyond the list: positions of the machine that its file has.
    tolerance : float
        ε in units of the text.
    axis_tolerance : float
        That of the tool axis, degrees.
    """

    def __init__(
        self,
        listed: WordList,
        positions: Sequence[WordRule],
        lexer: Lexer,
        tolerance: float,
        axis_tolerance: float = 0.0,
    ) -> None:
        self._words, self._blocks = listed.words, (*listed.blocks, *positions)
        self._lexer, self._rooms = lexer, {"length": tolerance, "angle": axis_tolerance}
        # most blocks beside the motion are alike; those of cycles are not, but most of their words are
        self._find = lru_cache(_REMEMBERED)(self._look_up)
        self._fitting = lru_cache(_REMEMBERED)(self._rules_for)

    def of(self, words: Sequence[str]) -> Ruled:
        """Rules of the words of a block, or of the whole block where that is on the list."""
        return self._find(tuple(words))

    def _look_up(self, words: tuple[str, ...]) -> Ruled:
        text = " ".join(words)
        for rule in self._blocks:
            if rule.pattern.fullmatch(text):
                return [(text, rule)]
        ruled: Ruled = []
        for k, word in enumerate(words):
            others = words[:k] + words[k + 1 :]
            fitting = [rule for rule in self._fitting(word) if rule.needs is None or any_of(rule.needs, others)]
            # what belongs beside another word comes first
            ruled.append((word, min(fitting, key=lambda rule: rule.needs is None, default=UNLISTED)))
        return ruled

    def _rules_for(self, word: str) -> list[WordRule]:
        fitting = [rule for rule in self._words if rule.pattern.fullmatch(word)]
        return [] if fitting and fitting[0].never else fitting

    def problems(self, line: Line, words: Sequence[str], ruled: Ruled, whole: str) -> Iterator[Problem]:
        """What is wrong with a block by itself: words off the list, twice, without others or beside others.

        Numbers of the addresses in `whole` need no point.
        """

        def wrong(text: str) -> Problem:
            return Problem(NOT_LISTED, 0, line.number, text)

        for word, rule in ruled:
            if rule is UNLISTED and self._fitting(word):
                yield wrong(f"{word} is beside nothing that it belongs to")
            elif rule is UNLISTED:
                yield wrong(f"{word} is not on the list of words for this control")
        for spelt in (word for word in line.words if word.name not in whole and self._lexer.without_point(word)):
            yield wrong(f"{spelt.text} without a decimal point: the control may count it in its least increment")
        names = [word.name for word in line.words if word.name not in "GM"]
        names += [word for word in words if word[0] in "GM"]
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield wrong(f"{name} is twice in one block")
        if sum(word.name == "M" for word in line.words) > 1:
            yield wrong("two M words in one block")
        if sum(word in _MOTION for word in words) > 1:
            yield wrong("two motions in one block")
        states = [rule.state for _, rule in ruled if rule.state]
        if len(set(states)) < len(states):
            yield wrong("two words of one group in one block")
        for k, (word, rule) in enumerate(ruled):
            others = [*words[:k], *words[k + 1 :]]
            if rule.must is not None and not any_of(rule.must, others):
                yield wrong(f"{word} without {shown(rule.must)}")
            if rule.alone:
                own = [bool(theirs.needs and theirs.needs.fullmatch(word)) for _, theirs in ruled]
                for (other, _), belongs in zip(ruled, own, strict=True):
                    if other != word and (not belongs or sum(own) > 1):
                        yield wrong(f"{other} in the block of {word}")
            shared = rule.pattern.fullmatch(word) if rule.share is not None else None
            for name, number in shared.groupdict().items() if shared else ():
                room = (rule.share or 0.0) * self._rooms[name] * (1 + 1e-9) + 1e-5
                if number is not None and float(number) > room:
                    yield wrong(f"{word} is more than {rule.share:g} of the tolerance")
                elif number is not None and not float(number):
                    yield wrong(f"{word}: 0 is no tolerance, and the control rounds as it likes")
