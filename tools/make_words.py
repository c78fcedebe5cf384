"""Writes the tables of words into docs/dev/words.md, as the lists of `verify` have them.

python tools/make_words.py
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
LISTS = ROOT / "src" / "cornersmooth" / "nc_reader" / "word_lists"
PAGE = ROOT / "docs" / "dev" / "words.md"
BEGIN, END = "<!-- made by make_words.py -->\n", "<!-- end -->\n"


def shown(text: str) -> str:
    """Regular expression in a cell of a table."""
    return f"`{text}`".replace("|", "\\|")


def roles(entry: dict[str, Any], kind: str) -> str:
    """Where a word may stand, and what must hold."""
    said = []
    if entry.get("first"):
        said.append("**must come before the first motion**")
    if entry.get("state") and not entry.get("follows"):
        said.append("the same wherever the tool moves")
    if entry.get("off"):
        said.append("must hold at the end")
    if entry.get("alone"):
        said.append("in a block of its own")
    for key, text in (
        ("needs", "only beside {}"),
        ("must", "only with {}"),
        ("after", "{} before it"),
        ("then", "{} in the next block"),
        ("behind", "only after {}"),
    ):
        if key in entry:
            said.append(text.format(shown(entry[key])))
    if "share" in entry:
        said.append(f"at most {entry['share']:g} ε")
    if entry.get("needs") and entry.get("follows"):
        said.append("may change from line to line")
    if entry.get("before"):
        said.append("before an arc")
    if entry.get("zero"):
        said.append("only where the rotary axes are at zero")
    if entry.get("high"):
        said.append("only after a retract")
    if entry.get("retract"):
        said.append("before the first motion, before an approach or at the end")
    if entry.get("late"):
        said.append("after a retract, as late as in the block that first moves Z")
    if entry.get("never"):
        said.append("refused")
    return "; ".join(said) or ("anywhere" if kind == "word" else "")


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
    if said := table.get("means"):
        yield "Words of spindle and coolant are compared with the statements. These words have a meaning beside"
        yield "the motion:\n"
        yield "| word | meaning |\n|---|---|"
        yield from (f"| {shown(word)} | {text or 'nothing'} |" for word, text in said.items())
    rows = [(entry, kind) for kind in ("word", "block") for entry in table.get(kind, ())]
    if rows:
        yield "\n| word | what it is | state | where it may stand |\n|---|---|---|---|"
    for entry, kind in rows:
        yield f"| {shown(entry['is'])} | {entry.get('says', '')} | {entry.get('state', '')} | {roles(entry, kind)} |"
    yield ""


def page() -> str:
    """The page with the tables as they are now."""
    before, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    after = rest.partition(END)[2]
    tables = "\n".join(line for path in sorted(LISTS.iterdir()) for line in section(path.stem))
    return f"{before}{BEGIN}\n{tables}\n{END}{after}"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
