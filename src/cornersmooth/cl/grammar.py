"""Lines of a CL file to statements: continuation, comments, labels, text words, numbers.

Follows the NCCS PostWorks 15.1 manual (PostMacro 1.2, appendix G) where CAM systems agree with it, and real files
where they do not: `$` joins lines and hides what stands after it, `$$` begins a comment, `;` separates statements,
blanks mean nothing outside text, text statements are never taken apart.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

from cornersmooth.cl.messages import error
from cornersmooth.cl.words import KNOWN_WORDS
from cornersmooth.errors import InputError

Argument = float | str

#: a decimal number; FORTRAN writes D exponents, some posts a blank after the sign
NUMBER: Final = re.compile(r"([+-]?)[ \t]*((?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[EeDd][+-]?[0-9]+)?)")

#: a line that holds nothing but further numbers of the statement before it
_NUMERIC_LINE: Final = re.compile(r"(?:[+-][ \t]*)?\.?[0-9][0-9.EeDd+\-, \t]*(\$.*)?$")

#: sequence numbers and labels: ``N27   ,``, ``C12 ,``, ``N10 ``, ``ID)``
_LABEL: Final = re.compile(r"(?:[NC][0-9]+[ \t]*,|N[0-9]+(?=[ \t])|[A-Z0-9]+\))[ \t]*(?=[A-Z$])", re.IGNORECASE)

#: the number of a line before its statement
_NUMBERED: Final = re.compile(r"[0-9]+[ \t]*[:.]?[ \t]*[A-Z]{2}", re.IGNORECASE)

#: columns 73 to 80 of punched cards: a number, with a name before it (CATIA: ``PT     6``)
_CARD: Final = re.compile(r"[ \t]*[A-Z]{0,7}[ \t]*[0-9]+[ \t]*", re.IGNORECASE)

#: a text word at the start of a statement; six letters are a field of their own in APT, blanks may not follow
_TEXT: Final = re.compile(r"(PARTNO|PPRINT|INSERT|REMARK|LETTER|TPRINT|DISPLY|TOOL[ \t]+PATH)[ \t]*(/?)", re.IGNORECASE)

#: a major word: what stands before the slash, or the first word of a statement without one
_WORD: Final = re.compile(r"[A-Z][A-Z0-9_.*-]*", re.IGNORECASE)

#: words that may stand alone on a line and cannot be a minor word of the line before
_LONELY_WORDS: Final = frozenset({"RAPID", "FINI", "END", "GOHOME", "AUTOPS", "END-OF-PATH", "OPSTOP"})

#: words after which a file that is cut short was closed by hand
_CLOSING: Final = frozenset({"FINI", "END"})

Decode = Callable[[bytes], str]


@dataclass(frozen=True, slots=True)
class Record:
    """A statement as read, before anyone knows what it means."""

    line: int  #: line it starts on, from 1
    #: Major word in upper case without inner blanks (but ``"TOOL PATH"``); ``"$$"`` for a comment, ``""`` for a line
    #: that is no statement.
    word: str
    args: tuple[Argument, ...] = ()  #: as in `Statement.args`
    text: str = ""  #: as written, joined over continuation lines
    rest: str = ""  #: what follows the word where no slash does; empty for a proper statement
    #: lines of further numbers after the statement, with their own line numbers
    points: tuple[tuple[int, tuple[Argument, ...]], ...] = ()
    cut_short: bool = False  #: whether the file ends where the statement should go on

    @property
    def option(self) -> Argument:
        """The first argument; an empty word where there is none."""
        return self.args[0] if self.args else ""

    @property
    def values(self) -> list[float]:
        """The arguments that are numbers."""
        return [value for value in self.args if isinstance(value, float)]

    @property
    def words(self) -> list[str]:
        """The other arguments."""
        return [value for value in self.args if isinstance(value, str)]


@dataclass
class _Lines:
    """Consecutive lines, taken one by one."""

    lines: Sequence[bytes]
    first: int
    decode: Decode
    file: str
    follows: str
    at: int = 0

    def peek(self) -> str | None:
        """Return the next line without blanks around it, None after the last one."""
        return self.decode(self.lines[self.at]).strip() if self.at < len(self.lines) else None

    def take(self) -> tuple[int, str]:
        """Return number and text of the next line."""
        text = self.peek()
        assert text is not None
        self.at += 1
        return self.first + self.at - 1, text

    def incomplete(self, line: int, text: str) -> InputError:
        """Return the error for a statement that the next line does not continue."""
        more = self.peek()
        follows = self.follows if more is None else _name(more)
        return error("CS104", self.file, line, word=_name(text), next=follows)


def read_records(lines: Sequence[bytes], first: int, decode: Decode, file: str, follows: str) -> Iterator[Record]:
    """Yield the statements of some lines, whose first has a number (InputError CS104, CS105, CS190).

    `follows` is what comes after these lines, for the message when the last statement is not complete.
    """
    source = _Lines(lines, first, decode, file, follows)
    while source.at < len(lines):
        line, text = source.take()
        if text.startswith("$$"):
            yield _comment(source, line, text)
            continue
        label = _LABEL.match(text)
        if label is not None:
            text = text[label.end() :]
        if not text:
            continue
        found = _TEXT.match(text)
        if found is not None:
            yield _text_statement(source, line, text, found)
        elif _is_card(decode(lines[source.at - 1]).rstrip()):
            raise error("CS189", file, line)
        elif _NUMBERED.match(text):
            raise error("CS190", file, line, text=text)
        elif _NUMERIC_LINE.match(text) or (text[0] in "+-.0123456789" and "," in text):
            raise error("CS105", file, line, text=text)
        else:
            yield from _statements(source, line, text)


def _is_card(line: str) -> bool:
    """Whether a number in columns 73 to 80 is no part of the statement before it."""
    before = line[:72]
    apart = before[71:].isspace() and not before.rstrip().endswith((",", "/", "=")) and "$" not in before
    return apart and len(line) <= 80 and _CARD.fullmatch(line[72:]) is not None


def _comment(source: _Lines, line: int, text: str) -> Record:
    if text.startswith("$$->"):  # Creo's CSYS tables go on in the next line
        text = _continued(source, text, lambda more: _NUMERIC_LINE.match(more) is not None)
    return Record(line, "$$", (text[2:].strip(),), text)


def _text_statement(source: _Lines, line: int, text: str, found: re.Match[str]) -> Record:
    if found[2]:
        text = _continued(source, text, lambda more: not _begins_statement(more))
    return Record(line, _squeeze(found[1]), (text[found.end() :].strip(),), text)


def _continued(source: _Lines, text: str, fits: Callable[[str], bool]) -> str:
    """Text joined with the lines after it that fit, where its sign asks for one; else the sign is text."""
    parts = [text]
    while parts[-1].endswith("$") and not parts[-1].endswith("$$"):
        if (more := source.peek()) is None or not fits(more):
            break
        parts[-1] = parts[-1][:-1].rstrip()
        parts.append(source.take()[1])
    return " ".join(parts)


def _joined(source: _Lines, line: int, text: str, begin: str, fits: Callable[[str], bool]) -> tuple[str, str, bool]:
    """Return a line with those that continue it, the comment after them, and whether the file ends before its end."""
    part, goes_on, comment = _cut(text)
    parts = [part]
    while goes_on:
        more = source.peek()
        if more is None or not fits(more):
            if more is None or _name(parts[0]) != "GOTO" or _name(more) not in _CLOSING:
                raise source.incomplete(line, begin or parts[0])
            break
        part, goes_on, comment = _cut(source.take()[1])
        parts.append(part)
    return " ".join(filter(None, parts)), comment, goes_on


def _statements(source: _Lines, line: int, text: str) -> Iterator[Record]:
    """Yield the statements of a line, joined with its continuation lines, and the comment after them."""
    text, comment, cut_short = _joined(source, line, text, "", lambda more: not _begins_statement(more))
    statements = [part for part in map(str.strip, _split(text, ";")) if part]
    for part in statements[:-1]:
        yield _parse(part, line)
    if statements:
        yield _parse(statements[-1], line, cut_short) if cut_short else _with_points(source, line, statements[-1])
    if comment:
        yield Record(line, "$$", (comment[2:].strip(),), comment)


def _with_points(source: _Lines, line: int, text: str) -> Record:
    """Parse a statement and take the lines of further numbers after it.

    A comma at the end of a line continues the statement even without a `$`.
    """
    statement = text
    points: list[tuple[int, tuple[Argument, ...]]] = []
    while (more := source.peek()) is not None and _NUMERIC_LINE.match(more):
        point_line, more = source.take()
        numbers, _, _ = _joined(source, line, more, text, lambda more: _NUMERIC_LINE.match(more) is not None)
        if not points and statement.endswith(","):
            statement += f" {numbers}"
        else:
            points.append((point_line, arguments(numbers)))
    record = _parse(statement, line)
    return replace(record, points=tuple(points)) if points else record


def arguments(body: str) -> tuple[Argument, ...]:
    """Split what follows the slash: numbers as floats, words in upper case, empty arguments as ``""``.

    Commas inside parentheses and quotes do not separate. A number float64 cannot hold becomes infinite, and is for
    the caller to refuse.
    """
    parts = body.split(",") if "(" not in body and "'" not in body else _split(body, ",")
    if len(parts) == 1 and not parts[0].strip():
        return ()
    return tuple(_argument(part.strip()) for part in parts)


def joined(args: tuple[Argument, ...]) -> str:
    """Arguments as text, for messages."""
    return ",".join(f"{value:g}" if isinstance(value, float) else value for value in args)


def number(token: str) -> float | None:
    """Return the number that a token is, None for anything else."""
    found = NUMBER.fullmatch(token)
    return None if found is None else float((found[1] + found[2]).replace("D", "E").replace("d", "e"))


def _argument(token: str) -> Argument:
    value = number(token)
    if value is not None:
        return value
    return token if token.startswith("'") else token.upper()


def _parse(text: str, line: int, cut_short: bool = False) -> Record:
    head, slash, body = text.partition("/")
    if slash and _WORD.match(word := _squeeze(head)):
        body = body.rstrip(", \t") if cut_short else body
        return Record(line, word, arguments(body), text, cut_short=cut_short)
    found = _WORD.match(text)
    if found is None:
        return Record(line, "", (text,), text)
    if (word := _squeeze(text)) in KNOWN_WORDS:
        return Record(line, word, (), text)
    rest = text[found.end() :].strip()
    return Record(line, found[0].upper(), (rest,) if rest else (), text, rest)


def _squeeze(word: str) -> str:
    """Upper case, without blanks; the two words of TOOL PATH stay apart."""
    squeezed = "".join(word.split()).upper()
    return "TOOL PATH" if squeezed == "TOOLPATH" else squeezed


def _name(text: str) -> str:
    found = re.match(r"[A-Za-z][A-Za-z0-9_-]*", text)
    return found[0].upper() if found else repr(text[:20])


def _cut(text: str) -> tuple[str, bool, str]:
    """Cut a line at its first `$` outside quotes: the statement, whether it goes on, the comment."""
    at = text.find("$")
    if at >= 0 and "'" in text[:at]:
        at = next((i for i in _outside_quotes(text) if text[i] == "$"), -1)
    if at < 0:
        return text.strip(), False, ""
    if text.startswith("$$", at):
        return text[:at].strip(), False, text[at:].strip()
    return text[:at].strip(), True, ""


def _outside_quotes(text: str) -> Iterator[int]:
    """Indices of characters outside '...'; a quote that is never closed is a character like any other."""
    at = 0
    while at < len(text):
        if text[at] == "'" and (end := text.find("'", at + 1)) > 0:
            at = end + 1
            continue
        yield at
        at += 1


def _split(text: str, separator: str) -> list[str]:
    """Split at separators outside quotes and parentheses."""
    if separator not in text:
        return [text]
    parts, depth, start = [], 0, 0
    for i in _outside_quotes(text):
        letter = text[i]
        if letter == "(":
            depth += 1
        elif letter == ")":
            depth -= 1
        elif letter == separator and depth <= 0:
            parts.append(text[start:i])
            start = i + 1
    return [*parts, text[start:]]


def _begins_statement(text: str) -> bool:
    """Whether a line that should continue another one is a statement of its own."""
    head, slash, _ = text.partition("/")
    return _squeeze(head) in KNOWN_WORDS if slash else _squeeze(text.rstrip("$")) in _LONELY_WORDS
