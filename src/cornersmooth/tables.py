"""Tables in TOML, those that come with the program and the user's own: found by name, read, their keys checked."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

from cornersmooth.errors import SettingsError

Table = dict[str, Any]


class TableText(NamedTuple):
    """Text of a table, the file for messages, and the name of what it describes where it has none itself."""

    text: str
    file: str
    name: str


@dataclass(frozen=True)
class Shelf:
    """Where the tables of one kind lie.

    Parameters
    ----------
    kind : str
        What they describe, for messages.
    package, folder : str
        Where those lie that come with the program.
    unknown, unreadable : str
        Codes of the errors that say that a name is unknown, and that a file or its text cannot be read.
    """

    kind: str
    package: str
    folder: str
    unknown: str
    unreadable: str

    def names(self) -> tuple[str, ...]:
        """Names of the tables that come with the program, sorted."""
        files = (resources.files(self.package) / self.folder).iterdir()
        return tuple(sorted(item.name.removesuffix(".toml") for item in files if item.name.endswith(".toml")))

    def choose(self, name_or_path: str | Path) -> TableText:
        """Table of that name, or in that file.

        A text that ends in ``.toml`` or holds a path separator is a file; anything else is a name.

        Raises
        ------
        SettingsError
            The name is unknown, or the file cannot be read.
        """
        given = str(name_or_path)
        if (
            not isinstance(name_or_path, Path)
            and not given.endswith(".toml")
            and "/" not in given
            and "\\" not in given
        ):
            return TableText(self.built_in(given), f"{given}.toml", given)
        try:
            text = Path(name_or_path).read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else "not UTF-8 text"
            what = f"{self.kind} file cannot be read: {reason}"
            raise SettingsError(self.unreadable, what, "check the name", file=given) from error
        return TableText(text, given, Path(name_or_path).stem)

    def built_in(self, name: str) -> str:
        """Text of a table that comes with the program.

        Raises
        ------
        SettingsError
            The name is unknown; the closest known one is named.
        """
        known = self.names()
        if name not in known:
            close = closest(name, known)
            advice = f"did you mean {close}? " if close else ""
            hint = f"{advice}use a TOML file or one of {', '.join(known)}"
            raise SettingsError(self.unknown, f"unknown {self.kind} {name!r}", hint)
        return (resources.files(self.package) / self.folder / f"{name}.toml").read_text(encoding="utf-8")

    def parse(self, text: str) -> Table:
        """Table that a text holds.

        Raises
        ------
        SettingsError
            The text is not TOML.
        """
        try:
            return tomllib.loads(text)
        except tomllib.TOMLDecodeError as error:
            raise SettingsError(self.unreadable, f"not TOML: {error}", "correct the text") from error


def unknown_key(table: Iterable[str], known: Sequence[str]) -> tuple[str, str] | None:
    """First key of a table that is not known and what to do about it; None where all are known."""
    for key in table:
        if key not in known:
            close = closest(key, known)
            return key, f"did you mean {close}?" if close else f"known keys are {', '.join(known)}"
    return None


def closest(word: str, known: Sequence[str]) -> str:
    """Return the known word that is most like this one; empty where none is."""
    return next(iter(difflib.get_close_matches(word, known, n=1)), "")
