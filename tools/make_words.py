"""Writes the tables of words into docs/dev/words.md, as the lists of `verify` have them.

python tools/make_words.py
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
LISTS = ROOT / "src" / "cornersmooth" / "control" / "word_lists"
PAGE = ROOT / "docs" / "dev" / "words.md"
#: behind a word that must stand beside another
NEEDED = " (needed)"
BEGIN, END = "<!-- made by make_words.py -->\n", "<!-- end -->\n"


def shown(text: str) -> str:
    """Regular expression in a cell of a table."""
    return f"`{text}`".replace("|", "\\|")


def cells(row: str) -> str:
    """What a row says, as cells of a table: what the word is, what it does, what is beside it, and its rules."""
    head, rules, says = row.split(";", 2)
    effects, _, letters = head.partition(":")
    beside = [
        shown(letter.rstrip("!=~")) + NEEDED * ("!" in letter) for letter in letters.split() if letter[0].isupper()
    ]
    known = " ".join(effects.split()), " ".join(beside), rules.replace("_", " ").replace("|", "\\|").strip()
    return f"{says.strip()} | {known[0]} | {known[1]} | {known[2]}"


def section(control: str) -> Iterator[str]:
    """Table of one control."""
    text = (LISTS / f"{control}.toml").read_text(encoding="utf-8")
    table = tomllib.loads(text)
    source = " ".join(line[2:] for line in re.match(r"(?:# .*\n)+", text)[0].splitlines())
    yield f"### {control}\n"
    yield source + "\n"
    for key, what in (("begin", "begins with"), ("end", "ends with")):
        if key in table:
            yield f"The program {what} {', '.join(map(shown, table[key])) or 'nothing in particular'}."
    if table.get("points"):
        yield f"Numbers after {table['points']} need their decimal point."
    if "orders" in table:
        yield f"Comments may not begin with {shown(table['orders'])}."
    if "like" in table:
        yield f"What is not named here is as for {table['like']}."
    listed = {words: row for words, row in table.get("words", {}).items() if not row or ";" in row}
    if listed:
        yield "\n| word | what it is | what it sets or does | beside it | rules |\n|---|---|---|---|---|"
    for words, row in listed.items():
        name = " ".join(map(shown, [words.strip("/")] if words[0] == "/" else words.split(" | ")))
        yield f"| {name} | {cells(row) if row else 'the control has no such words | | |'} |"
    yield ""


def page() -> str:
    """The page with the tables as they are now."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    tables = "\n".join(line for path in sorted(LISTS.iterdir()) for line in section(path.stem))
    return f"{before}{BEGIN}\n{tables}\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
