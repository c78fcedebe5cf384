"""Functions that take what others take: type checkers and `help` show those parameters."""

from __future__ import annotations

from collections.abc import Callable
from inspect import signature
from typing import Any, ParamSpec, TypeVar, cast

_Given = ParamSpec("_Given")
_Found = TypeVar("_Found")


def taking_what(kind: Callable[_Given, object]) -> Callable[[Callable[..., _Found]], Callable[_Given, _Found]]:
    """Say of a function that it takes what another takes."""

    def decorate(function: Callable[..., _Found]) -> Callable[_Given, _Found]:
        own = signature(function).return_annotation
        cast(Any, function).__signature__ = signature(kind).replace(return_annotation=own)
        return function

    return decorate
