"""Tables of controls with every kind of wrong value in every place: an error that names file and key, never a crash."""

from __future__ import annotations

import copy
import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.nc import control_names, control_table
from cornersmooth.nc.control_tables import parse_control
from oracle.messages import one_line
from oracle.share import share

WRONG: tuple[Any, ...] = (3, -1, 1.5, True, "x", "{", "{nix}", "\n", [], [3], ["{nix}"], {}, {"x": 1})


def toml(value: Any) -> str:
    """Value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def text_of(table: dict[str, Any]) -> str:
    return "\n".join(f"{key} = {toml(value)}" for key, value in table.items())


def places(table: dict[str, Any], before: tuple[str, ...] = ()) -> Iterator[tuple[str, ...]]:
    """Every key, with those of tables in it."""
    for key, value in table.items():
        yield (*before, key)
        if isinstance(value, dict):
            yield from places(value, (*before, key))


def put(table: dict[str, Any], place: tuple[str, ...], value: Any) -> dict[str, Any]:
    """Copy of the table with a value at a place."""
    changed = inner = copy.deepcopy(table)
    for key in place[:-1]:
        inner = inner[key]
    inner[place[-1]] = value
    return changed


@pytest.mark.parametrize("control", control_names())
def test_wrong_values_are_refused_by_file_and_key(control: str) -> None:
    table = tomllib.loads(control_table(control))
    refused = tried = 0
    for number, place in enumerate(places(table)):
        for value in share(WRONG, 5, number):
            tried += 1
            try:
                parse_control(put(table, place, value), file="own.toml")
            except SettingsError as refusal:
                refused += 1
                said = one_line(refusal)
                named = place[-1] in said or ".".join(place[:2]) in said or place == ("like",)
                if not (said.startswith("own.toml: error: ") and named and refusal.hint):
                    raise AssertionError(f"{place} = {value!r}: {said}") from refusal
    assert refused > 5 / len(WRONG) * tried > 0


@pytest.mark.parametrize("control", ["fanuc", "heidenhain", "siemens"])
def test_misspelt_keys_are_refused_with_the_right_one(control: str) -> None:
    table = tomllib.loads(control_table(control))
    free = ("forms", "extras", "words.coolant", "digits.systems")  # tables whose keys are names
    for place in places(table):
        if ".".join(place[:-1]) in free or len(place[-1]) < 4:
            continue
        wrong = put(table, (*place[:-1], place[-1][:-1] + "x" + place[-1][-1]), 1)
        with pytest.raises(
            SettingsError, match=rf"^own.toml: error\[\w+\]: unknown key .*\nhint: did you mean {place[-1]}\?$"
        ):
            parse_control(text_of(wrong), file="own.toml")


def test_what_would_only_fail_later_is_refused_too() -> None:
    for text, message in (
        ("like = 'fanuc'\n[program]\nname_pattern = '('\n", "program.name_pattern is '('"),
        ("like = 'fanuc'\n[program]\nend = ['{retract} M5']\n", "program.end: '{retract} M5' holds more than a step"),
        ("like = 'fanuc'\n[program]\nend = ['{retrakt}']\n", "program.end: '{retrakt}' has unknown braces"),
        ("like = 'fanuc'\n[digits]\nmm = 10\n", "digits.mm is 10; give a whole number up to 9"),
        ("like = 'fanuc'\n[layout]\ncomment = ['(']\n", "layout.comment is"),
        ("like = 'fanuc'\n[extras]\nx = 1\n", "extras.x is 1"),
        ("like = 'fanuc'\n[extras.x]\non = ['{offset}']\n", "extras.x.on: '{offset}' has unknown braces; use {blend}"),
    ):
        with pytest.raises(SettingsError) as refused:
            parse_control(text, file="own.toml")
        assert one_line(refused.value).startswith(f"own.toml: error: {message}")


def test_the_documents_show_what_is_true() -> None:
    """The table of one's own is accepted, the dual form is that of a text kept in `golden`."""
    document = (Path(__file__).parents[2] / "docs" / "controls.md").read_text()
    table = document.partition("```toml\n")[2].partition("```")[0]
    assert list(parse_control(table, file="docs/controls.md").forms) == ["g1"]
    shown = [line.strip() for line in document.splitlines() if re.match(r"    (G1 X|G6\.2|K)", line)]
    kept = (Path(__file__).parent / "golden" / "corner.generic-g6.2.nc").read_text()
    assert len(shown) == 18
    assert "\n".join(shown) in kept
