"""Writes what the declarations of the options say: a table of docs/settings.md, the settings of the report's schema.

python tools/make_options.py
"""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args, get_origin, get_type_hints

from cornersmooth.cli import shop
from cornersmooth.cli.command import _Setting
from cornersmooth.cli.commands import COMMANDS
from cornersmooth.settings import Settings, key_of

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "settings.md"
SCHEMA = ROOT / "src" / "cornersmooth" / "report" / "report.schema.json"
BEGIN, END = "<!-- made by tools/make_options.py -->\n", "<!-- end -->\n"
#: what reports of all commands have
MEASURES = ("tolerance_mm", "axis_length_mm", "axis_tolerance_deg")
TYPES = {float: "number", str: "string", bool: "boolean", NoneType: "null"}


def page() -> str:
    """Write the page with a row for each setting that no command line has."""
    text = PAGE.read_text(encoding="utf-8")
    rows = ["| setting | what it does |", "|---|---|"]
    for param in COMMANDS["smooth"].params:
        if isinstance(param, _Setting):
            kind = "true" if param.is_flag else (param.metavar or param.type.name.upper()).replace("|", "\\|")
            rows.append(f"| `{shop.key(str(param.name))} = {kind}` | {param.help} |")
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + "\n".join([*rows, ""]) + END + rest.partition(END)[2]


def schema() -> str:
    """Write the schema with the keys of all settings, their types and bounds."""
    hints = get_type_hints(Settings)
    keys = {key_of(item.name, item.metadata["unit"]): kind(hints[item.name]) for item in fields(Settings)}
    keys["axis_length_mm"] = {"type": ["number", "null"]}  # no measure where the axis has a tolerance of its own
    rows = ",\n".join(f"    {json.dumps(name)}: {json.dumps(value)}" for name, value in keys.items())
    return re.sub(
        r'(?<=  "settings": \{\n   "type": "object",\n   "properties": \{\n).*?(?=\n   \})',
        lambda _: rows,
        SCHEMA.read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )


def kind(hint: Any) -> dict[str, Any]:
    """Give the JSON type of a setting."""
    inner = [one for one in get_args(hint) if one is not NoneType]
    if get_origin(hint) is tuple:
        return {"type": "array", "items": {"type": "number"}}
    if inner and get_origin(inner[0]) is Literal:
        return {"enum": [*get_args(inner[0]), None]}
    return {"type": [TYPES[inner[0]], "null"] if inner else TYPES[hint]}


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    SCHEMA.write_text(schema(), encoding="utf-8")
