"""Tables in TOML, those that come with the program and the user's own: found by name, read, their keys checked.

A table may say ``like = NAME`` and then only what is different from that one, ``false`` for what it has not; and with
``aliases = ["840d"]`` what else people call it. Capitals, blanks, hyphens and underscores in names do not count.
"""

from __future__ import annotations

import re
import tomllib
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import MISSING, dataclass, fields, is_dataclass
from functools import lru_cache, partial
from itertools import accumulate
from pathlib import Path
from string import Formatter
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, get_args, get_origin, get_type_hints

from cornersmooth.errors import SettingsError

Table = dict[str, Any]
Record = TypeVar("Record")

#: makes a field of the value of a key; its second argument says where the value stands
Check = Callable[[Any, str], Any]

#: largest whole number, where a field does not say another
_MOST = 1_000_000

#: characters of a table at most
_LARGEST = 1_000_000

#: repeats in a pattern, whose number is the power with which the time of a search grows, and its characters
_MOST_REPEATS, _LONGEST_PATTERN = 4, 200
_COUNTS = ("no", "one", "two", "three")


class Bound(NamedTuple):
    """What a number must keep, as ``Annotated`` says it of a field; `hint` says what to give instead."""

    low: float = 0
    high: float = _MOST
    hint: str = ""


@dataclass(frozen=True)
class Shelf:
    """Where the tables of one kind lie."""

    kind: str  #: what they describe, for messages
    folder: Path  #: where those lie that come with the program
    keys: tuple[str, ...]  #: those that a table may have, ``like`` and ``aliases`` aside
    #: codes of the errors that say that a name is unknown, that a file or its text cannot be read, that a key is
    #: unknown, and that a value is of a wrong kind
    unknown: str
    unreadable: str
    unknown_key: str
    wrong_value: str

    def names(self) -> tuple[str, ...]:
        """Names of the tables that come with the program, sorted."""
        return tuple(sorted(file.stem for file in self.folder.glob("*.toml")))

    def aliases(self) -> dict[str, str]:
        """Name of the table for each of its other names."""
        return {alias: name for name in self.names() for alias in _read(self._text(name)).get("aliases", ())}

    def _text(self, name: str) -> str:
        return (self.folder / f"{name}.toml").read_text(encoding="utf-8")

    def find(self, name: str) -> str:
        """Return the name, as it is written, of the table that is called so; empty for none."""
        known = self.names()
        if name in known:
            return name
        called = {_plain(each): each for each in known} | {_plain(key): own for key, own in self.aliases().items()}
        return called.get(_plain(name), "")

    def choose(self, name_or_path: str | Path) -> tuple[str, str, str]:
        """Text of a table, the file for messages, and the name of what it describes where it has none itself.

        A text that ends in ``.toml`` or holds a path separator is a file; anything else is a name.
        """
        given = str(name_or_path)
        if not is_file(name_or_path):
            return (self.built_in(given), f"{given}.toml", given)
        try:
            with Path(name_or_path).open(encoding="utf-8-sig") as file:  # some editors put a mark before it
                text = file.read(_LARGEST + 1)
        except (OSError, UnicodeDecodeError) as error:
            reason = error.strerror if isinstance(error, OSError) and error.strerror else "not UTF-8 text"
            what = f"{self.kind} file cannot be read: {reason}"
            raise SettingsError(self.unreadable, what, "check the name", file=given) from error
        if len(text) > _LARGEST:
            what = f"{self.kind} file is longer than a table"
            raise SettingsError(self.unreadable, what, "check the name", file=given)
        return (text, given, Path(name_or_path).stem)

    def built_in(self, name: str) -> str:
        """Text of a table that comes with the program (SettingsError, which names the closest name)."""
        found = self.find(name)
        if not found:
            known, aliases = self.names(), self.aliases()
            close = closest(name.lower(), (*known, *aliases))
            meant = f"{close}, which is {aliases[close]}" if close in aliases else close
            advice = f"did you mean {meant}? " if close else ""
            hint = f"{advice}use a TOML file or one of {', '.join(known)}"
            raise SettingsError(self.unknown, f"unknown {self.kind} {name!r}", hint)
        return self._text(found)

    def parse(self, text: str | Table) -> tuple[Table, str]:
        """Table of a text, or one that was read already, on top of the one that it is like; the name of that, or "".

        Raises SettingsError: the text is not TOML, has an unknown key, or is like a table that is not known.
        """
        try:
            table = deepcopy(_read(text)) if isinstance(text, str) else dict(text)
        except tomllib.TOMLDecodeError as error:
            raise SettingsError(self.unreadable, f"not TOML: {error}", "correct the file") from error
        self.check_keys(table, (*self.keys, "like", "aliases"), "")
        table.pop("aliases", None)
        like = table.pop("like", "")
        if not isinstance(like, str):
            raise self.wrong(f"like is {like!r}", f"name one of the built-in {self.kind}s")
        if not like:
            return (table, "")
        base = self.parse(self.built_in(like))[0]
        base.pop("name", None)
        return (_merged(base, table), self.find(like))

    @contextmanager
    def in_file(self, file: str) -> Iterator[None]:
        """Let errors say in which file the table is."""
        try:
            yield
        except SettingsError as error:
            raise SettingsError(error.code, error.what, error.hint, file=file) from error

    def check_keys(self, table: Iterable[str], known: Sequence[str], where: str) -> None:
        """Refuse a key that is not known; `where` is what stands before it in the message."""
        for key in table:
            if key not in known:
                close = closest(key, known)
                advice = f"did you mean {close}?" if close else f"known keys are {', '.join(known)}"
                raise SettingsError(self.unknown_key, f"unknown key {where}{key}", advice)

    def record(
        self, kind: type[Record], table: Any, where: str, given: Mapping[str, Any] | None = None, **checks: Check
    ) -> Record:
        """Dataclass whose fields are the keys of a table, which must have those without a default.

        `where` is the name of the table, for messages, `given` are fields that are no keys. Values are read by the type
        of their field, or by one of the `checks`. Raises SettingsError: `table` is no table, has an unknown key, or
        lacks one, or a value is wrong.
        """
        given, dot = given or {}, f"{where}." if where else ""
        keys = {item.name: item for item in fields(kind) if item.name not in given}  # type: ignore[arg-type]
        self.check_keys(self.table(table, where), tuple(keys), dot)
        for key, item in keys.items():
            if key not in table and item.default is MISSING and item.default_factory is MISSING:
                raise self.wrong(f"{dot}{key} is missing", f"add {key} = ...")
        types = _types(kind)  # type: ignore[arg-type]
        values = {key: (checks.get(key) or self._by_type(types[key]))(value, dot + key) for key, value in table.items()}
        for key, item in keys.items():
            if isinstance(values.get(key), dict) and item.default_factory is not MISSING:
                values[key] = item.default_factory() | values[key]
        return kind(**given, **values)

    def _by_type(self, hint: Any) -> Check:
        """How a value of a field of this type is read."""
        origin, args = get_origin(hint), get_args(hint)
        if origin is Annotated:
            return partial(self._annotated, hint=args[0], rule=args[1])
        plain: dict[Any, Check] = {bool: self.flag, int: self.whole, float: self.number}
        if hint in plain:
            return plain[hint]
        if _is_record(hint):
            return partial(self.record, hint)
        if origin is Literal:
            return partial(self._choice, choices=args)
        if origin is Mapping:
            return partial(self._mapping, keys=get_args(args[0]), kind=args[1])
        if origin is tuple:
            return self._list(hint)
        return self._by_type(args[0]) if type(None) in args else self.text

    def _list(self, hint: Any) -> Callable[..., Any]:
        """How a tuple of texts or numbers is read, so many or any."""
        parts = get_args(hint)
        return partial(self.texts if parts[0] is str else self.numbers, count=None if ... in parts else len(parts))

    def _annotated(self, value: Any, where: str, hint: Any, rule: Any) -> Any:
        """Value of a type with a rule: `Bound`, function that raises ValueError, keys for names, hint for a list."""
        if isinstance(rule, Mapping):
            named = self._mapping(value, where, tuple(rule), get_args(hint)[1])
            return {rule[key]: entry for key, entry in named.items()}
        if isinstance(rule, str):
            return self._list(hint)(value, where, hint=rule)
        if hint is int:
            return self.whole(value, where, rule.low, rule.high)
        read = self._by_type(hint)(value, where)
        if isinstance(rule, Bound):
            return self._need(rule.low <= read <= rule.high, read, where, rule.hint)
        try:
            rule(read)
        except ValueError as error:
            raise self.wrong(f"{where} is {read!r}: {error}", "give a plain regular expression") from error
        return read

    def _choice(self, value: Any, where: str, choices: tuple[str, ...]) -> str:
        """Refuse what is none of the choices; the empty one is where the key is left out."""
        named = [choice for choice in choices if choice]
        several = f"one of {', '.join(named)}" if len(named) > 2 else " or ".join(named)
        hint = f"use {several}{', or leave it out' * (len(named) < 2)}"
        return str(self._need(value in choices, value, where, hint))

    def _mapping(self, value: Any, where: str, keys: tuple[str, ...], kind: Any) -> dict[str, Any]:
        """Table of entries of one type, by any keys, or by known ones; dataclasses get their key as a name."""
        table = self.table(value, where)
        if keys:
            self.check_keys(table, keys, f"{where}.")
        if _is_record(kind):
            return {key: self.record(kind, entry, f"{where}.{key}", {"name": key}) for key, entry in table.items()}
        read = self._by_type(kind)
        return {key: read(entry, f"{where}.{key}") for key, entry in table.items()}

    def table(self, value: Any, where: str) -> Table:
        """Refuse what is no table."""
        return self._need(isinstance(value, dict), value, where, f"write a table [{where}]")

    def flag(self, value: Any, where: str) -> bool:
        """Refuse what is not true or false."""
        return self._need(isinstance(value, bool), value, where, "give true or false")

    def whole(self, value: Any, where: str, least: int = 0, most: int = _MOST) -> int:
        """Refuse what is no whole number within bounds."""
        good = isinstance(value, int) and not isinstance(value, bool) and least <= value <= most
        span = f"from {least} to {most}" if least else f"up to {most}"
        return self._need(good, value, where, f"give a whole number {span}")

    def number(self, value: Any, where: str) -> float:
        """Refuse what is no number."""
        good = isinstance(value, int | float) and not isinstance(value, bool)
        return float(self._need(good, value, where, "give a number"))

    def numbers(self, value: Any, where: str, count: int | None = None, hint: str = "") -> tuple[float, ...]:
        """Refuse what is no list of so many numbers."""
        good = isinstance(value, list) and count in (None, len(value))
        self._need(good, value, where, hint or f"give {_COUNTS[count or 0]} numbers in brackets")
        return tuple(self.number(each, where) for each in value)

    def text(self, value: Any, where: str) -> str:
        """Refuse what is no text, or none that a terminal only shows."""
        good = isinstance(value, str) and value.isprintable()
        return self._need(good, value, where, "write it as one line of text in quotes")

    def texts(self, value: Any, where: str, count: int | None = None, hint: str = "") -> tuple[str, ...]:
        """Refuse what is no list of so many texts."""
        good = isinstance(value, list) and count in (None, len(value)) and all(isinstance(x, str) for x in value)
        many = "a list of strings" if count is None else f"{_COUNTS[count]} texts in brackets"
        self._need(good, value, where, hint or f'give {many}, as in ["M8"]')
        return tuple(self.text(each, where) for each in value)

    def _need(self, good: bool, value: Any, where: str, hint: str) -> Any:
        if not good:
            raise self.wrong(f"{where} is {value!r}", hint)
        return value

    def wrong(self, what: str, hint: str) -> SettingsError:
        """Error that says that a value is of a wrong kind."""
        return SettingsError(self.wrong_value, what, hint)


def _is_record(hint: Any) -> bool:
    return isinstance(hint, type) and is_dataclass(hint)


@lru_cache(maxsize=64)
def _types(kind: type) -> dict[str, Any]:
    """Types of the fields of a dataclass."""
    return get_type_hints(kind, include_extras=True)


@lru_cache(maxsize=64)
def _read(text: str) -> Table:
    """Return the table of a TOML text; it must not be changed."""
    return read_toml(text)


def read_toml(text: str) -> Table:
    """Return the table of a TOML text (TOMLDecodeError: it is no TOML, or is nested without end)."""
    try:
        return tomllib.loads(text)
    except RecursionError:
        raise tomllib.TOMLDecodeError("nested too deeply") from None


def filled(text: str, values: Mapping[str, object]) -> str:
    """Fill the braces of a block by name: nothing but the values gets into it.

    Raises ValueError where a brace holds more than a known name: an attribute, an index, a width.
    """
    for _, name, form, conversion in Formatter().parse(text):
        if name is not None and (name not in values or form or conversion):
            raise ValueError(name)
    return text.format(**values)


def check_pattern(pattern: str) -> None:
    """Refuse a regular expression that is none, or whose search may take without end.

    Raises ValueError, which says why. Groups hold no choice and are not repeated; `_MOST_REPEATS` things may be.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # what Python will read in another way one day
            re.compile(pattern)
    except (re.error, RecursionError, OverflowError, Warning) as error:
        raise ValueError(f"{error}") from error
    bare = re.sub(r"\[\^?\]?[^\]]*\]", "x", re.sub(r"\\.", "x", pattern))
    bare = bare.replace("(?", "(")  # what kind of group it is
    depths = accumulate((letter == "(") - (letter == ")") for letter in bare)
    choices = any(letter == "|" and depth > 0 for letter, depth in zip(bare, depths, strict=True))
    repeats = bool(re.search(r"\)[*+{]", bare)) or len(re.findall(r"[*+{?]", bare)) > _MOST_REPEATS
    if len(pattern) > _LONGEST_PATTERN or choices or repeats:
        raise ValueError(
            "a choice in a group, a group that is repeated, "
            f"more than {_MOST_REPEATS} repeats, or more than {_LONGEST_PATTERN} characters"
        )


#: a regular expression of a table
Pattern = Annotated[str, check_pattern]


def _merged(base: Table, changes: Table) -> Table:
    """Return a table with changes: tables and lists of named tables are merged, ``false`` takes one out."""
    result = dict(base)
    for key, value in changes.items():
        old = result.get(key)
        if value is False and isinstance(old, dict | list):
            del result[key]
        elif isinstance(old, dict) and isinstance(value, dict):
            result[key] = _merged(old, value)
        elif (rows := _by_name(old)) and (changed := _by_name(value)) and changed.keys() <= rows.keys():
            result[key] = [_merged(row, changed.get(name, {})) for name, row in rows.items()]
        else:
            result[key] = value
    return result


def _by_name(rows: Any) -> dict[str, Table]:
    """Tables of a list by their names; nothing where it is no list of named tables."""
    if not isinstance(rows, list) or not all(isinstance(row, dict) and "name" in row for row in rows):
        return {}
    return {str(row["name"]): row for row in rows}


def is_file(name_or_path: str | Path) -> bool:
    """Whether a file is meant: a path, or a text that ends in ``.toml`` or holds a path separator."""
    text = str(name_or_path)
    return isinstance(name_or_path, Path) or text.endswith(".toml") or "/" in text or "\\" in text


def _plain(name: str) -> str:
    """Name without what people write in several ways."""
    return re.sub(r"[\s_-]", "", name).lower()


def closest(word: str, known: Sequence[str]) -> str:
    """Return the known word that is most like this one; empty where none is."""
    from difflib import get_close_matches

    return next(iter(get_close_matches(word, known, n=1)), "")
