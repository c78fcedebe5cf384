"""A short name for what an output is made with: the same settings have the same, others another."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields, is_dataclass

from cornersmooth import __version__


def fingerprint(*values: object) -> str:
    """Hash of values of any kind, the version of the program among them, in hexadecimal digits."""
    return hashlib.sha256(_plain((__version__, *values)).encode("utf-8", "surrogateescape")).hexdigest()


def _plain(value: object) -> str:
    """Text that tells a value from others and does not depend on the order of sets or the place in memory."""
    if is_dataclass(value) and not isinstance(value, type):
        parts = [f"{item.name}={_plain(getattr(value, item.name))}" for item in fields(value)]
        return f"{type(value).__name__}({', '.join(parts)})"
    if isinstance(value, Mapping):
        return f"{{{', '.join(sorted(f'{_plain(key)}: {_plain(item)}' for key, item in value.items()))}}}"
    if isinstance(value, (set, frozenset)):
        return f"{{{', '.join(sorted(map(_plain, value)))}}}"
    if isinstance(value, (list, tuple)):
        return f"({', '.join(map(_plain, value))})"
    if hasattr(value, "tolist"):
        return _plain(value.tolist())
    return repr(value)
