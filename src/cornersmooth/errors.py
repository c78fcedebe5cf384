"""What can go wrong, and how messages have it.

`CornersmoothError` is raised for what stops the work; `Finding` records what was noticed while the work went on.
Both carry a stable code. The library raises and returns them; only `cornersmooth.cli` prints them.
"""

from __future__ import annotations

import os
import shlex
from dataclasses import dataclass
from enum import StrEnum
from functools import partial
from typing import Any, Literal

Severity = Literal["note", "warning", "error"]

#: exit code of the command line for a fault of the program itself
EXIT_INTERNAL = 70

#: numbers of warnings that say nothing of the metal: how the input is spelt, what options choose, what costs time, what
#: the verdict says already
_BESIDE_THE_METAL = frozenset((133, 134, 139, 174, 184, 325, 371, 396, 509))

#: numbers of warnings of what an option leaves out of the program
_LEFT_OUT = frozenset((315,))

#: numbers of notes of what the chosen method could not do, and another way did
_INSTEAD = frozenset((226, 229, 239, 378))


def printable(text: str) -> str:
    """Return one line that a terminal only shows: what would move, colour or hide something is escaped.

    Names of files and words of CL files come from strangers.
    """
    if text.isprintable():
        return text
    return "".join(one if one.isprintable() else one.encode("unicode_escape", "surrogatepass").decode() for one in text)


def message(
    severity: str, text: str, code: str = "", *, place: str = "", hint: str = "", count: int = 1, beside: str = ""
) -> str:
    """Give a message as every output has it: ``FILE:LINE: error[CS123]: what``, and ``hint: what to do`` on a line.

    Without `hint`, that is what follows the first ``"; "`` of the text. `beside` is another place that belongs to it.
    """
    what, _, rest = (text, "", "") if hint else text.partition("; ")
    number, times = f"[{code}]" if code else "", f"{count:,} times" if count > 1 else ""
    brackets = "".join(f" ({part})" for part in (beside, times) if part)
    lines = [f"{place}: " * bool(place) + f"{severity}{number}: {what}{brackets}", f"hint: {hint or rest}"]
    return "\n".join(map(printable, lines if hint or rest else lines[:1]))


def command_text(words: list[str]) -> str:
    """Give a command line as the shell of this system reads it."""
    if os.name != "nt":
        return shlex.join(words)
    from subprocess import list2cmdline

    return list2cmdline(words)


def internal_error(failure: Exception, source: str = "") -> str:
    """Text for an error that is a fault of the program."""
    import traceback  # it takes long to load

    last = traceback.extract_tb(failure.__traceback__)[-1]
    place = f"{os.path.basename(last.filename)}:{last.lineno}"
    what = f"internal error, {type(failure).__name__} at {place}: {failure}"
    return message("error", what, place=source, hint="please report it with the input file")


class CornersmoothError(Exception):
    """Work stopped; the text says what happened and what to do.

    Parameters
    ----------
    code : str
        Stable identifier such as ``"CS101"`` (100s, CS200, CS206, CS209 and CS275: CL input, other 200s: settings,
        300s: NC output, 400s: writing files, 500s: verification).
    what : str
        One clause, lower case, no full stop: what is wrong, with the offending value.
    hint : str
        One clause: what the user can do about it.
    file, line : optional
        Where. `line` counts from 1.
    """

    #: exit code of the command line (docs/smooth.md)
    exit_code = 3

    def __init__(
        self, code: str, what: str, hint: str = "", *, file: str | None = None, line: int | None = None
    ) -> None:
        self.code = code
        self.what = what
        self.hint = hint
        self.file = file
        self.line = line
        super().__init__(code, what, hint, file, line)

    def __reduce__(self) -> tuple[object, ...]:
        """Survive the trip between worker processes with every field."""
        return partial(type(self), file=self.file, line=self.line), (self.code, self.what, self.hint)

    @property
    def place(self) -> str:
        """``FILE:LINE`` as far as known, or the empty string."""
        return self.file or "" if self.line is None else f"{self.file or '<input>'}:{self.line}"

    def __str__(self) -> str:
        """Text of the message, as `message` gives it."""
        return message("error", self.what, code=self.code, place=self.place, hint=self.hint)


class InputError(CornersmoothError):
    """The CL (or NC) text cannot be read or is not valid."""

    exit_code = 3


class SettingsError(CornersmoothError):
    """An option, a configuration file or a combination of them makes no sense."""

    exit_code = 2


class OutputError(CornersmoothError):
    """The result cannot be written."""

    exit_code = 4


class VerdictError(CornersmoothError):
    """The program was written, and its verdict is not good enough to put it in place."""

    exit_code = 1
    result: Any = None  #: What there is all the same (`cornersmooth.Result`)


@dataclass(frozen=True, slots=True)
class Finding:
    """Something noticed that did not stop the work."""

    code: str  #: Stable identifier, as in `CornersmoothError`
    severity: Severity
    line: int  #: Source line it was first met on, 0 where no line applies
    text: str  #: One sentence in the user's words: what was noticed; after the first ``"; "``, what to do
    count: int = 1  #: How often it was met

    @property
    def leaves_out(self) -> bool:
        """Whether it says that an option left something out of the program."""
        return int(self.code[2:]) in _LEFT_OUT

    @property
    def instead(self) -> bool:
        """Whether it says that something was done in another way than the method has it."""
        return int(self.code[2:]) in _INSTEAD

    @property
    def to_check(self) -> bool:
        """Whether it bears on the metal: somebody has to look before the program runs. So do codes that are new."""
        return self.severity == "warning" and int(self.code[2:]) not in _BESIDE_THE_METAL | _LEFT_OUT


class Verdict(StrEnum):
    """How an NC program turned out, from the best to the worst."""

    PASSED = "PASSED"  #: All that the CL file asks for is in the program, within ε, and was measured
    NOT_SMOOTHED = "NOT SMOOTHED"  #: Nothing was smoothed: the program is as it was
    INCOMPLETE = "INCOMPLETE"  #: An option left something out, such as holes; the rest was measured
    NOT_VERIFIED = "NOT VERIFIED"  #: Something that may bear on the motion was not looked at
    FAILED = "FAILED"  #: The program is wrong: verification found a problem

    @classmethod
    def of(cls, *, problems: int = 0, unverified: bool = False, left_out: int = 0) -> Verdict:
        """Give the worst verdict that applies, of problems found, things not looked at, and things left out.

        Returns
        -------
        Verdict
            FAILED, else NOT VERIFIED, else INCOMPLETE, else PASSED.
        """
        if problems:
            return cls.FAILED
        if unverified:
            return cls.NOT_VERIFIED
        return cls.INCOMPLETE if left_out else cls.PASSED
