"""Which rule of the control's list a word of a block falls under, and what may not stand together in one block."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Final

from cornersmooth.nc_reader.block_texts import any_of, shown, text_of
from cornersmooth.nc_reader.elements import Problem
from cornersmooth.nc_reader.lexer import Lexer
from cornersmooth.nc_reader.word_list import WordList, WordRule
from cornersmooth.nc_reader.words import Line

#: code of words that are not on the list or not in their place
NOT_LISTED: Final = "CS571"

#: blocks, and words, whose rules are remembered
_REMEMBERED: Final = 4096

#: words of which a block may have one
_MOTION: Final = frozenset(("G0", "G1", "G2", "G3", "G6.2", "L", "LN", "SPL", "BSPLINE", "POLY"))


class WordRules:
    """Looks at blocks one by one, whatever stands before them.

    Parameters
    ----------
    positions : sequence of WordRule
        Blocks beyond the list: positions of the machine that its file has.
    tolerance : float
        ε in units of the text.
    """

    def __init__(self, listed: WordList, positions: Sequence[WordRule], lexer: Lexer, tolerance: float) -> None:
        self.words = listed.words
        self.blocks = (*listed.blocks, *positions)
        self._lexer, self._tolerance = lexer, tolerance
        # most blocks beside the motion are alike; those of cycles are not, but most of their words are
        self._find = lru_cache(_REMEMBERED)(self._look_up)
        self._fitting = lru_cache(_REMEMBERED)(self._rules_for)

    def of(self, words: list[str], text: str) -> list[WordRule | None]:
        """Rule of every word, or of the whole block; None for a word that is not on the list, or not beside these."""
        return self._find(tuple(words), text)

    def _look_up(self, words: tuple[str, ...], text: str) -> list[WordRule | None]:
        whole = next((rule for rule in self.blocks if rule.pattern.fullmatch(text)), None)
        if whole is not None:
            return [whole]
        rules: list[WordRule | None] = []
        for k, word in enumerate(words):
            fitting = self._fitting(word)
            if fitting and fitting[0].never:
                fitting = []
            others = _others(words, k)
            beside = [rule for rule in fitting if rule.needs is not None and any_of(rule.needs, others)]
            plain = [rule for rule in fitting if rule.needs is None]
            rules.append(next(iter(beside + plain), None))
        return rules

    def _rules_for(self, word: str) -> list[WordRule]:
        return [rule for rule in self.words if rule.pattern.fullmatch(word)]

    def stands(self, words: list[str]) -> bool:
        """Whether a block moves no tool at the part: one of the list as a whole, or of a word that stands alone."""
        if any(rule.pattern.fullmatch(text_of(words)) for rule in self.blocks):
            return True
        return any(rule.alone and any_of(rule.pattern, words) for rule in self.words)

    def problems(self, line: Line, words: list[str], rules: list[WordRule | None]) -> Iterator[Problem]:
        """What is wrong with a block by itself: words off the list, twice, without others or beside others."""
        number = line.number
        if len(rules) == len(words):  # else the block is on the list as a whole
            yield from self._unlisted(number, words, rules)
        yield from self._spelling(line, words)
        states = [rule.state for rule in rules if rule is not None and rule.state]
        if len(set(states)) < len(states):
            yield Problem(NOT_LISTED, 0, number, "two words of one group in one block")
        for k in range(len(rules)):
            yield from self._company(number, k, words, rules)

    def _unlisted(self, number: int, words: list[str], rules: list[WordRule | None]) -> Iterator[Problem]:
        for word, rule in zip(words, rules, strict=True):
            if rule is None:
                fitting = self._fitting(word)
                if fitting and not fitting[0].never:
                    yield Problem(NOT_LISTED, 0, number, f"{word} is beside nothing that it belongs to")
                else:
                    yield Problem(NOT_LISTED, 0, number, f"{word} is not on the list of words for this control")

    def _spelling(self, line: Line, words: list[str]) -> Iterator[Problem]:
        number = line.number
        for spelt in filter(self._lexer.without_point, line.words):
            text = f"{spelt.text} without a decimal point: the control may count it in its least increment"
            yield Problem(NOT_LISTED, 0, number, text)
        names = [word.name for word in line.words if word.name not in "GM"]
        names += [word for word in words if word[0] in "GM"]
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield Problem(NOT_LISTED, 0, number, f"{name} is twice in one block")
        if sum(word.name == "M" for word in line.words) > 1:
            yield Problem(NOT_LISTED, 0, number, "two M words in one block")
        if sum(word in _MOTION for word in words) > 1:
            yield Problem(NOT_LISTED, 0, number, "two motions in one block")

    def _company(self, number: int, k: int, words: list[str], rules: list[WordRule | None]) -> Iterator[Problem]:
        """What a word misses beside it, or may not have there; and whether it takes too much of the tolerance."""
        rule = rules[k]
        if rule is None:
            return
        word, others = words[k] if len(rules) == len(words) else text_of(words), _others(words, k)
        if rule.must is not None and not any_of(rule.must, others):
            yield Problem(NOT_LISTED, 0, number, f"{word} without {shown(rule.must)}")
        if rule.alone:
            own = [bool(theirs and theirs.needs and theirs.needs.fullmatch(word)) for theirs in rules]
            for other, belongs in zip(words, own, strict=True):
                if other != word and (not belongs or sum(own) > 1):
                    yield Problem(NOT_LISTED, 0, number, f"{other} in the block of {word}")
        if rule.share is not None:
            match = rule.pattern.fullmatch(word)
            if match and float(match[1]) > rule.share * self._tolerance * (1 + 1e-9) + 1e-5:
                yield Problem(NOT_LISTED, 0, number, f"{word} is more than {rule.share:g} of the tolerance")


def _others(words: Sequence[str], k: int) -> list[str]:
    return [*words[:k], *words[k + 1 :]]
