"""Measures prose by the writing rules of CONTRIBUTING.md: sentences of a page, their words, and what none may say."""

from __future__ import annotations

import re
from collections.abc import Iterator

#: words in a sentence: at most, and in the mean of a page
MOST, MEAN = 30, 16
#: what our prose does not say, and what it says instead
FORBIDDEN = {
    r"behind": "after, or back of",
    r"texts?": "program (NC), or message",
    r"(?:is|are|was|were|be) said": "write: it is written, the file has",
    r"said": "named, written, stated",
    r"stands|stood": "is",
    r"nobody (?:can tell|knows)": "it is not known",
    r"to and fro": "back and forth",
    r"hangs? on": "depends on",
    r"in the mean": "on average",
    r"looked at anew": "looked at again",
    r"besides": "also",
    r"anyway": "(nothing)",
    r"as ever": "(nothing)",
    r"all but": "nearly",
    r"set aside|promises?|broken": "FAILED, not verified",
    r"twice as far": "2 times the distance",
}
_FORBIDDEN = {re.compile(rf"\b(?:{words})\b", re.IGNORECASE): instead for words, instead in FORBIDDEN.items()}
_END = re.compile(r"(?<=[.!?])[\"')]*\s+(?=[\"'(]*[A-Z0-9`*§εκ−-])")
_SHORT = re.compile(r"\b(?:e\.g|i\.e|etc|vs|cf|No|Fig|approx)\.")


def paragraphs(page: str) -> Iterator[tuple[str, bool]]:
    """Paragraphs, items and cells of a page in Markdown, without code; and whether one is a cell of a table."""
    page = re.sub(r"^```.*?^```$", "", page, flags=re.DOTALL | re.MULTILINE)
    page = re.sub(r"<!--.*?-->", "", page, flags=re.DOTALL)
    for block in re.split(r"\n\s*\n", page):
        lines = block.strip("\n").split("\n")
        if all(line.startswith("    ") for line in lines) or lines == [""]:
            continue
        item: list[str] = []
        for line in lines:
            if line.startswith("|"):
                yield from ((plain(cell), True) for cell in re.split(r"(?<!\\)\|", line.strip("|")))
                continue
            if re.match(r"\s*(?:[-*]|\d+\.|#+) ", line):
                if item:
                    yield plain(" ".join(item)), False
                item = []
                line = re.sub(r"^\s*(?:[-*]|\d+\.|#+) ", "", line)
            item.append(line.strip())
            if re.match(r"#+ ", line):
                yield plain(" ".join(item)), False
                item = []
        if item:
            yield plain(" ".join(item)), False


def plain(text: str) -> str:
    """Words alone: code is one word, a link is its words."""
    text = re.sub(r"``.+?``|`[^`]+`|(?<!\w)--\w[\w-]*", "CODE", text)
    text = re.sub(r"!\[[^]]*\]\([^)]*\)", "", text)
    text = re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", text)
    return re.sub(r"[*_]{1,2}(\S.*?\S|\S)[*_]{1,2}", r"\1", text).strip()


def sentences(text: str) -> list[str]:
    """The sentences of one paragraph."""
    return [one for one in _END.split(_SHORT.sub(lambda found: found[0].replace(".", ""), text)) if one.strip()]


def words(sentence: str) -> int:
    """How many words it has: what holds a letter or a digit."""
    return sum(bool(re.search(r"\w", word)) for word in sentence.split())


def faults(text: str) -> list[str]:
    """What one sentence does that the rules forbid."""
    found = [f"{words(text)} words: {text}"] if words(text) > MOST else []
    return found + [
        f"{hit[0]!r} ({instead}): {text}" for rule, instead in _FORBIDDEN.items() if (hit := rule.search(text))
    ]
