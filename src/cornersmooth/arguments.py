"""What values may be, by the words of annotations: of arguments of the public functions, and of options in records.

Words are compared by their names, as nothing is loaded for a look.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import wraps
from numbers import Integral, Real
from typing import Any, Final, get_args

from cornersmooth.errors import InputError, SettingsError

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
