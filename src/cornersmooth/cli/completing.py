"""What a shell offers for an option: controls, machines and forms, those of the shop among them.

Reads the tables as text, so that the shell need not wait for arrays to be imported.
"""

from __future__ import annotations

import tomllib
from importlib import resources
from typing import Any

import click
from click.shell_completion import CompletionItem

#: folders of the tables in the package
_FOLDERS = {"controls": ("nc", "controls"), "machines": ("kinematics", "machines")}


def controls(ctx: click.Context, incomplete: str) -> list[CompletionItem]:
    """Names of controls, and files."""
    return _offer("controls", ctx, incomplete)


def machines(ctx: click.Context, incomplete: str) -> list[CompletionItem]:
    """Names of machines, and files."""
    return _offer("machines", ctx, incomplete)


def forms(ctx: click.Context, incomplete: str) -> list[CompletionItem]:
    """Names of the forms of the control that is chosen, or of all of them."""
    tables = {**_built_in("controls"), **_own("controls", ctx)}
    chosen = ctx.params.get("control")
    name = chosen if isinstance(chosen, str) else getattr(chosen, "name", "")
    called = {alias: own for own, table in tables.items() for alias in table.get("aliases", ())}
    one = called.get(name, name)
    found = _forms_of(one, tables) if one in tables else {form for each in tables for form in _forms_of(each, tables)}
    return [CompletionItem(form) for form in sorted(found) if form.startswith(incomplete)]


def _offer(kind: str, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
    tables = {**_built_in(kind), **_own(kind, ctx)}
    items = [
        CompletionItem(name, help=str(table.get("description", "")) or None)
        for name, table in sorted(tables.items())
        if name.startswith(incomplete)
    ]
    aliases = sorted(alias for table in tables.values() for alias in table.get("aliases", ()))
    items += [CompletionItem(alias) for alias in aliases if incomplete and alias.startswith(incomplete)]
    return items or [CompletionItem(incomplete, type="file")]


def _built_in(kind: str) -> dict[str, dict[str, Any]]:
    folder = resources.files("cornersmooth").joinpath(*_FOLDERS[kind])
    return {
        item.name.removesuffix(".toml"): tomllib.loads(item.read_text(encoding="utf-8"))
        for item in folder.iterdir()
        if item.name.endswith(".toml")
    }


def _own(kind: str, ctx: click.Context) -> dict[str, dict[str, Any]]:
    """Tables of the shop settings that hold here."""
    from cornersmooth.cli import shop

    found: dict[str, dict[str, Any]] = {}
    for file in ctx.meta.get(shop.__name__, shop.Shop()).files:
        found |= {name: table for name, table in file.tables.get(kind, {}).items() if isinstance(table, dict)}
    return found


def _forms_of(name: str, tables: dict[str, dict[str, Any]]) -> set[str]:
    """Forms of a control and of that which it is like."""
    table = tables[name]
    like = table.get("like", "")
    inherited = _forms_of(like, tables) if like in tables and like != name else set()
    own = table.get("forms", {})
    return (inherited | set(own)) - {form for form, entry in own.items() if entry is False}
