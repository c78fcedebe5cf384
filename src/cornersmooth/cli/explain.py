"""``cornersmooth explain``: causes and remedies of codes."""

from __future__ import annotations

import re
import textwrap
import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from typing import Any, Final

import click

from cornersmooth.cli.options import Options
from cornersmooth.cli.show import say

#: what the hundreds of the codes are about
PARTS: Final = {
    "1": "CL input",
    "2": "Settings, controls and machines",
    "3": "NC output",
    "4": "Files",
    "5": "Verification",
}
#: what each kind of message means
KINDS: Final = {
    "error": "The command ends. No program is written, and an old one is as it was.",
    "problem": "Verification found a fault in the program: the verdict is FAILED.",
    "warning, to check": "The program is written. Somebody has to look at this before it runs.",
    "warning": "The program is written. The warning is not about the metal.",
    "note": "The program is written. -v prints notes.",
}
_WIDTH: Final = 80


def run_explain(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    if given.stream:
        if given.name is not None:
            raise click.UsageError("--stream shows a program: leave the code out")
        from cornersmooth.cli.filter import explain_program

        return explain_program(str(given.stream), given)
    known, code = codes(), given.name
    if code is not None:
        number = re.fullmatch(r"(?:CS)?(\d{3})", code.strip("[]"), re.IGNORECASE)
        code = f"CS{number[1]}" if number else code
        if code not in known:
            raise click.UsageError(f"no code {code!r}; 'cornersmooth explain' lists them")
    found = {name: one for name, one in known.items() if code in (None, name)}
    lines = _all(known) if code is None else _one(code, known[code])
    say(given, {"schema": "cornersmooth-codes/1", "codes": found}, lines)
    return 0


def codes() -> dict[str, dict[str, Any]]:
    """Give messages, cause and remedy of every code; cause and remedy are empty where the message is all there is."""
    messages, causes = (
        tomllib.loads((files(__package__) / f"{name}.toml").read_text(encoding="utf-8")) for name in ("codes", "causes")
    )
    keys = ("kind", "message", "hint")
    return {
        code: {
            "about": PARTS[code[2]],
            "messages": [dict(zip(keys, row, strict=True)) for row in rows],
            **{key: causes.get(code, {}).get(key, "") for key in ("cause", "remedy")},
        }
        for code, rows in messages.items()
    }


def _all(known: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    about = ""
    for code, one in known.items():
        if one["about"] != about:
            yield from ("",) * bool(about)
            about = one["about"]
            yield f"{code[:3]}xx  {about}"
        first = one["messages"][0]
        kind = first["kind"].partition(",")[0]
        message = textwrap.shorten(first["message"], _WIDTH - len(f"  {code}  {kind:<8}"), placeholder=" ...")
        yield f"  {code}  {kind:<8}{message}"


def _one(code: str, found: Mapping[str, Any]) -> Iterator[str]:
    kinds = list(dict.fromkeys(one["kind"] for one in found["messages"]))
    yield f"{code}  {found['about']}: {' or '.join(kinds)}"
    for kind in kinds:
        yield from _paragraph("meaning", KINDS[kind])
    yield from _paragraph("cause", found["cause"])
    yield from _paragraph("what to do", found["remedy"])
    yield ""
    yield "as it is printed (... is filled in):"
    for one in found["messages"]:
        severity = {"problem": "error"}.get(one["kind"], one["kind"].partition(",")[0])
        yield from _wrapped(f"FILE:LINE: {severity}[{code}]: {one['message'].replace('…', '...')}", "  ")
        if one["hint"]:
            yield from _wrapped(f"hint: {one['hint'].replace('…', '...')}", "  ")


def _paragraph(label: str, text: str) -> list[str]:
    return _wrapped(text.replace("`", ""), f"  {label:<12}") if text else []


def _wrapped(text: str, indent: str) -> list[str]:
    further = " " * len(indent) if indent.strip() else indent + "  "
    return textwrap.wrap(
        text, _WIDTH, initial_indent=indent, subsequent_indent=further, break_long_words=False, break_on_hyphens=False
    )
