"""README, docs, helps and messages keep the writing rules of CONTRIBUTING.md."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

from cornersmooth.cli.commands import COMMANDS
from writing import FORBIDDEN, MEAN, MOST, faults, paragraphs, plain, sentences, words

ROOT = Path(__file__).resolve().parent.parent
WRITTEN = ("*.md", "docs/*.md", "docs/dev/*.md", "samples/*.md")
PAGES = [path for name in WRITTEN for path in sorted(ROOT.glob(name))]


def prose(page: Path) -> list[tuple[str, bool]]:
    """Sentences of a page, and whether each is in a table; a message and what to do about it are two."""
    parts = [
        (piece, cell)
        for part, cell in paragraphs(page.read_text())
        for piece in (re.split("; |<br>", part) if page.name == "codes.md" else [part])
    ]
    return [(one, cell) for part, cell in parts for one in sentences(part)]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages_are_written_by_the_rules(page: Path) -> None:
    # the rules themselves name what they forbid, in quotation marks
    rules = page.name == "CONTRIBUTING.md"
    found = prose(page)
    assert [fault for one, _ in found for fault in faults(one) if not (rules and '"' in one)] == []
    lengths = [words(one) for one, cell in found if not cell and words(one) > 2]
    assert sum(lengths) <= MEAN * max(len(lengths), 1)


@pytest.mark.parametrize("name", COMMANDS)
def test_helps_are_written_by_the_rules(name: str) -> None:
    command = COMMANDS[name]
    helps = [command.help or "", *(getattr(one, "help", None) or "" for one in command.params)]
    spoken = [
        text for one in helps for text in one.replace("\b\n", "\n").split("\n\n") if "  cornersmooth " not in text
    ]
    assert [fault for text in spoken for one in sentences(plain(" ".join(text.split()))) for fault in faults(one)] == []


def test_explanations_are_written_by_the_rules() -> None:
    causes = tomllib.loads((ROOT / "src" / "cornersmooth" / "cli" / "causes.toml").read_text(encoding="utf-8"))
    told = [one for entry in causes.values() for text in entry.values() for one in sentences(plain(text))]
    assert len(told) > 20
    assert [fault for one in told for fault in faults(one)] == []


def test_the_measure_sees_what_the_rules_forbid() -> None:
    long = " ".join(["word"] * (MOST + 1)) + "."
    assert faults(long)
    assert not faults("The tool stops after the retract.")
    for wrong in (
        "It is said there.",
        "The text behind it.",
        "It stands there.",
        "It hangs on nothing.",
        "To and fro.",
    ):
        assert faults(wrong)
    assert len(FORBIDDEN) > 8
    page = "# Head\n\nOne fact. Two\nfacts `a b c` here.\n\n    behind\n\n| cells. Two |\n|---|\n\n```\ncode\n```\n"
    assert [one for text, cell in paragraphs(page) if not cell for one in sentences(text)] == [
        "Head",
        "One fact.",
        "Two facts CODE here.",
    ]
    assert "cells. Two" in [text.strip() for text, cell in paragraphs(page) if cell]


def test_the_glossary_has_one_name_for_each_thing() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text()
    names = [
        line.split("|")[1].strip() for line in text[text.index("## One name") :].split("\n") if line.startswith("| ")
    ][1:]
    assert len(names) == len(set(names)) == 25
    assert sum(line[:3].rstrip(". ").isdigit() for line in text.split("\n")) == 15


#: lines of `src` with such a word in code, comments or docstrings; lower it when you take some out
LINES_WITH_SUCH_WORDS = 65


def test_code_names_the_thing_and_not_the_speaker() -> None:
    words = re.compile(r"\b(?:said|told|asked|held|ours|theirs)\b")
    found = [
        f"{path.name}:{number}"
        for path in (ROOT / "src").rglob("*.py")
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if words.search(line)
    ]
    assert len(found) <= LINES_WITH_SUCH_WORDS, found
