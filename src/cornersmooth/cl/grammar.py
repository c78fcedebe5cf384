"""Lines of a CL file to statements: continuation, comments, labels, text words, numbers.

Follows the NCCS PostWorks 15.1 manual (PostMacro 1.2, appendix G) where CAM systems agree with it, and real files
where they do not: `$` joins lines and hides what stands behind it, `$$` begins a comment, `;` separates statements,
blanks mean nothing outside text, text statements are never taken apart.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from cornersmooth.cl.messages import error
from cornersmooth.cl.words import KNOWN_WORDS

Argument = float | str

#: a decimal number; FORTRAN writes D exponents, some posts a blank after the sign
NUMBER: Final = re.compile(r"([+-]?)[ \t]*((?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[EeDd][+-]?[0-9]+)?)")

#: the start of a line that holds nothing but further numbers of the statement before it
NUMERIC_LINE: Final = re.compile(r"[ \t]*[+-]?[ \t]*\.?[0-9]+[0-9.EeDd+\-, \t]*(\$.*)?$")

#: sequence numbers and labels: ``N27   ,``, ``C12 ,``, ``N10 ``, ``ID)``
_LABEL: Final = re.compile(r"(?:[NC][0-9]+[ \t]*,|N[0-9]+[ \t]+|[A-Za-z0-9]+\))[ \t]*(?=[A-Za-z$])", re.IGNORECASE)

#: a text word at the start of a statement; six letters are a field of their own in APT, blanks may not follow
_TEXT: Final = re.compile(r"(?i)(PARTNO|PPRINT|INSERT|REMARK|LETTER|TPRINT|DISPLY|TOOL[ \t]+PATH)[ \t]*(/?)")

#: a major word: what stands before the slash, or the first word of a statement without one
_WORD: Final = re.compile(r"[A-Za-z][A-Za-z0-9_.*-]*")

#: a statement that begins a new line although the line before asked for a continuation
_NEW_STATEMENT: Final = re.compile(r"[ \t]*([A-Za-z][A-Za-z0-9 ,_-]*?)[ \t]*(/|\$*[ \t]*$)")

Decode = Callable[[bytes], str]


@dataclass(frozen=True, slots=True)
class Record:
    """A statement as read, before anyone knows what it means.

    Parameters
    ----------
    line : int
        Line it starts on, from 1.
    word : str
        Major word in upper case without inner blanks (but ``"TOOL PATH"``); ``"$$"`` for a comment, ``""`` for a
        line that is no statement.
    args : tuple of (float | str)
        As in `Statement.args`.
    text : str
        As written, joined over continuation lines.
    rest : str
        What follows the word where no slash does; empty for a proper statement.
    points : tuple of (int, args)
        Lines of further numbers after the statement, with their own line numbers.
    """

    line: int
    word: str
    args: tuple[Argument, ...] = ()
    text: str = ""
    rest: str = ""
    points: tuple[tuple[int, tuple[Argument, ...]], ...] = ()

    def moved(self, lines: int) -> Record:
        """Return the same statement so many lines further down."""
        points = tuple((line + lines, args) for line, args in self.points)
        return Record(self.line + lines, self.word, self.args, self.text, self.rest, points)


def read_records(lines: Sequence[bytes], first: int, decode: Decode, file: str, follows: str) -> Iterator[Record]:
    """Yield the statements of some consecutive lines.

    Parameters
    ----------
    lines : sequence of bytes
        Without line ends.
    first : int
        Number of the first of them.
    decode : callable
        bytes to str.
    file : str
        For messages.
    follows : str
        What comes after these lines, for the message when the last statement is not complete.

    Raises
    ------
    InputError
        CS104, CS105
    """
    at = 0
    while at < len(lines):
        text = decode(lines[at]).strip()
        line = first + at
        at += 1
        if not text:
            continue
        if text.startswith("$$"):
            while _is_creo_table(text) and at < len(lines) and NUMERIC_LINE.match(decode(lines[at])):
                text = text.rstrip()[:-1].rstrip() + " " + decode(lines[at]).strip()
                at += 1
            yield Record(line, "$$", (text[2:].strip(),), text)
            continue
        label = _LABEL.match(text)
        if label is not None:
            text = text[label.end() :]
        found = _TEXT.match(text)
        if found is not None:
            while found[2] and text.endswith("$") and not text.endswith("$$") and at < len(lines):
                more = decode(lines[at]).strip()
                if _begins_statement(more):
                    break
                text = text[:-1].rstrip() + " " + more
                at += 1
            yield Record(line, _squeeze(found[1]), (text[found.end() :].strip(),), text)
            continue
        if NUMERIC_LINE.match(text):
            raise error("CS105", file, line, text=text)

        text, goes_on, comment = _cut(text)
        while goes_on:
            if at == len(lines):
                raise error("CS104", file, line, word=_name(text), next=follows)
            more = decode(lines[at]).strip()
            if _begins_statement(more):
                closed = _name(text) == "GOTO" and _name(more) in ("FINI", "END")
                if not closed:
                    raise error("CS104", file, line, word=_name(text), next=_name(more))
                text = text.rstrip(", \t") + " $"
                break
            at += 1
            more, goes_on, more_comment = _cut(more)
            comment = comment or more_comment
            text = (text + " " + more).strip()
        statements = [part for part in (part.strip() for part in _split(text, ";")) if part]
        for part in statements[:-1]:
            yield _parse(part, line)
        if statements:
            record = _parse(statements[-1], line)
            points = []
            while at < len(lines) and NUMERIC_LINE.match(numbers := decode(lines[at])):
                point_line = first + at
                numbers, goes_on, _ = _cut(numbers)
                at += 1
                while goes_on and at < len(lines) and NUMERIC_LINE.match(more := decode(lines[at])):
                    more, goes_on, _ = _cut(more)
                    numbers += " " + more
                    at += 1
                if goes_on:
                    after = _name(decode(lines[at])) if at < len(lines) else follows
                    raise error("CS104", file, point_line, word=record.word, next=after)
                if record.args and record.args[-1] == "":  # a comma at the end of the line continues it too
                    record = _parse(record.text + " " + numbers.strip(), line)
                else:
                    points.append((point_line, arguments(numbers)))
            if points:
                record = Record(line, record.word, record.args, record.text, record.rest, tuple(points))
            yield record
        if comment:
            yield Record(line, "$$", (comment[2:].strip(),), comment)


def arguments(body: str) -> tuple[Argument, ...]:
    """Split what follows the slash: numbers as floats, words in upper case, empty arguments as ``""``.

    Commas inside parentheses and quotes do not separate. A number float64 cannot hold becomes infinite, and is for
    the caller to refuse.
    """
    parts = body.split(",") if "(" not in body and "'" not in body else _split(body, ",")
    if len(parts) == 1 and not parts[0].strip():
        return ()
    return tuple(_argument(part.strip()) for part in parts)


def number(token: str) -> float | None:
    """Return the number that a token is, None for anything else."""
    found = NUMBER.fullmatch(token)
    return None if found is None else float((found[1] + found[2]).replace("D", "E").replace("d", "e"))


def _argument(token: str) -> Argument:
    value = number(token)
    if value is not None:
        return value
    return token if token.startswith("'") else token.upper()


def _parse(text: str, line: int) -> Record:
    head, slash, body = text.partition("/")
    if slash:
        word = _squeeze(head)
        body = body.removesuffix("$")  # a GOTO that its file cuts short
        if _WORD.match(word):
            return Record(line, word, arguments(body), text)
    found = _WORD.match(text)
    if found is None:
        return Record(line, "", (text,), text)
    if text.upper() in KNOWN_WORDS or _squeeze(text) in KNOWN_WORDS:
        return Record(line, _squeeze(text), (), text)
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
    found = _NEW_STATEMENT.match(text)
    return found is not None and (
        _squeeze(found[1]) in KNOWN_WORDS if found[2].startswith("/") else _squeeze(found[1]) in _LONELY_WORDS
    )


def _is_creo_table(text: str) -> bool:
    """Whether a comment is one of Creo's ``$$-> CSYS`` tables, which go on after a `$`."""
    return text.startswith("$$->") and text.endswith("$")


#: words that may stand alone on a line and cannot be a minor word of the line before
_LONELY_WORDS: Final = frozenset({"RAPID", "FINI", "END", "GOHOME", "AUTOPS", "END-OF-PATH", "OPSTOP"})
