"""What can go wrong, and how messages have it.

`CornersmoothError` is raised for what stops the work; `Finding` records what was noticed while the work went on.
Both carry a stable code. The library raises and returns them; only `cornersmooth.cli` prints them. What arguments and
options may be is said by the words of their annotations, which are compared by name: nothing is loaded for a look.
"""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import partial, wraps
from numbers import Integral, Real
from typing import Any, Final, Literal, get_args

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
        Stable identifier such as ``"CS101"`` (100s, CS200, CS206 and CS209: CL input, other 200s: settings, 300s: NC
        output, 400s: writing files, 500s: verification).
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


#: a text longer than this is not shown
_SHOWN: Final = 60


def _is_path(value: Any) -> bool:
    return isinstance(value, str) or hasattr(value, "__fspath__")


def _is_binary(value: Any) -> bool:
    return hasattr(value, "write") and not hasattr(value, "encoding")


#: what fits a word, and how it is called; a word that is neither here nor below takes anything
_WORDS: Final[dict[str, tuple[Callable[[Any], bool], str]]] = {
    "None": (lambda value: value is None, "None"),
    "bool": (lambda value: isinstance(value, bool) or type(value).__name__ == "bool", "True or False"),
    "str": (lambda value: isinstance(value, str), "a text"),
    "bytes": (lambda value: isinstance(value, bytes), "bytes"),
    "Path": (_is_path, "a path"),
    "os.PathLike": (_is_path, "a path"),
    "int": (lambda value: isinstance(value, Integral) and not isinstance(value, bool), "a whole number"),
    "float": (lambda value: isinstance(value, Real) and not isinstance(value, bool), "a number"),
    "Callable": (callable, "a function"),
    "Progress": (callable, "a function"),
    "Stream": (_is_binary, 'a binary stream, as of open(name, "wb")'),
    "Target": (lambda value: _is_path(value) or _is_binary(value), "a path or a binary stream"),
}

#: records, and where they come from
_RECORDS: Final = {
    "Program": "what read or from_poses gives",
    "SmoothProgram": "what smooth gives",
    "Settings": "a record such as Settings(tolerance=0.01)",
    "Limits": "a record such as Limits(feed=1500)",
    "Frame": "a record such as Frame(block_numbers=True)",
    "Form": 'what choose_form("fanuc", "g1") gives',
    "Machine": 'what load_machine("table-ac") gives',
    "Control": 'what load_control("fanuc") gives',
    "Verification": "what verify gives",
    "NcProgram": "a program that was read",
}


def wanted(annotation: str, value: Any) -> str:
    """Say what is asked for where a value does not fit an annotation; empty where it fits."""
    words = annotation.split(" | ")
    if _is_path(value) and "os.PathLike" in annotation and "\n" in str(value):  # a whole text is no name of a file
        words = [word for word in words if word not in ("str", "os.PathLike[str]")]
    texts = [_wanted_by(word, value) for word in words]
    return " or ".join(texts) if all(texts) else ""


def _wanted_by(word: str, value: Any) -> str:
    """As `wanted`, by one word."""
    name, _, inner = word.removesuffix("]").partition("[")
    if name == "tuple":
        each, many = inner.removesuffix(", ...").split(", "), inner.endswith(", ...")
        fits = isinstance(value, (tuple, list)) and (many or len(value) == len(each))
        fits = fits and not any(map(wanted, each * len(value) if many else each, value))
        text = f"a tuple of {', '.join(_WORDS[one][1] for one in each)}{' and so on' * many}"
    elif name in _RECORDS:
        fits, text = any(one.__name__ == name for one in type(value).__mro__), _RECORDS[name]
    elif name in _WORDS:
        fits, text = _WORDS[name][0](value), _WORDS[name][1]
    else:
        return ""
    return "" if fits else text


def shown(value: Any) -> str:
    """Give a value in a message; what it is where that is long."""
    if isinstance(value, (str, bytes)) and len(value) > _SHOWN:
        return f"a text of {len(value):,} characters"
    plain = value is None or isinstance(value, (str, bytes, Real))
    return repr(value) if plain or (isinstance(value, (tuple, list)) and len(repr(value)) < _SHOWN) else _named(value)


def _named(value: Any) -> str:
    name = type(value).__name__
    return f"{'an' if re.match('[AEIOaeio]', name) else 'a'} {name}"


def checked(function: Callable[..., Any], home: str) -> Callable[..., Any]:
    """Make a function that looks at its arguments first, as one of a package.

    It raises InputError CS167: an argument is nothing that its annotation names; SettingsError CS230: a word that is
    none of several.
    """
    import inspect

    signature = inspect.signature(function)

    @wraps(function)
    def door(*args: Any, **kwargs: Any) -> Any:
        for name, value in signature.bind(*args, **kwargs).arguments.items():
            annotation = str(signature.parameters[name].annotation)
            choices = get_args(function.__globals__.get(annotation.removesuffix(" | None")))
            if isinstance(value, str) and choices and all(isinstance(one, str) for one in choices):
                if value not in choices:
                    raise SettingsError("CS230", f"unknown {name} {value!r}", f"use one of {', '.join(choices)}")
            elif text := wanted(annotation, value):
                raise InputError("CS167", f"{name} of {function.__name__} is {shown(value)}", f"give {text}")
        return function(*args, **kwargs)

    door.__module__ = home  # where pickle finds it
    return door
