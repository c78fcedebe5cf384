"""The page as one file: markup, style, libraries, scripts and data; nothing is fetched from anywhere."""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import re
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: types that a browser has arrays of, by the name of the page
_TYPES = {"f4": np.float32, "i4": np.int32, "u1": np.uint8}

#: starts of arrays are multiples of this: typed arrays want to be aligned
_ALIGNED = 4


class Pack:
    """Arrays by name, for `text` and `table`."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._length = 0
        self.table: dict[str, dict[str, Any]] = {}

    def add(self, name: str, values: NDArray[Any], kind: str, bits: int | None = None) -> None:
        """Add an array (n,) or (n, w) as ``"f4"``, ``"i4"`` or ``"u1"``; to so many binary places it packs better."""
        if bits is not None:
            values = np.ldexp(np.round(np.ldexp(values, bits)), -bits)
        data = np.ascontiguousarray(values, dtype=np.dtype(_TYPES[kind]).newbyteorder("<")).tobytes()
        width = 1 if values.ndim == 1 else values.shape[1]
        self.table[name] = {"type": kind, "at": self._length, "count": len(values), "width": width}
        padding = -len(data) % _ALIGNED
        self._parts.append(data + bytes(padding))
        self._length += len(data) + padding

    def text(self) -> str:
        """Everything in base64 of gzip; the same arrays give the same text."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), 6, mtime=0)).decode("ascii")


#: scripts in the order they are run
_LIBRARIES = ("vendor/three.js", "vendor/uplot.js")
_SCRIPTS = (
    "data.js",
    "colours.js",
    "geometry.js",
    "paths.js",
    "camera.js",
    "pace.js",
    "tool.js",
    "metal.js",
    "view.js",
    "charts.js",
    "places.js",
    "problems.js",
    "list.js",
    "corners.js",
    "runs.js",
    "drive.js",
    "wiring.js",
    "main.js",
)
_STYLES = ("vendor/uplot.css", "page.css")

#: places of the template that are filled in
_MARK = re.compile(r"\{\{(\w+)\}\}")

#: longest text of the user's that is shown
_LONGEST = 300


def document(meta: dict[str, Any], pack: Pack) -> str:
    """Put a page together; whatever stands in `meta` is shown as text and never as markup."""
    styles = "\n".join(_asset(name) for name in _STYLES)
    libraries = "\n".join(_asset(name) for name in _LIBRARIES)
    script = '(() => {\n"use strict";\n' + "\n".join(_asset(name) for name in _SCRIPTS) + "\n})();\n"
    policy = (
        f"default-src 'none'; img-src data:; style-src {_hash(styles)}; script-src {_hash(libraries)} {_hash(script)}; "
        "base-uri 'none'; form-action 'none'"
    )
    values = json.dumps({**_shortened(meta), "arrays": pack.table}, ensure_ascii=True, allow_nan=False)
    # within a script element only these could end it or begin a comment
    values = values.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
    parts = {
        "policy": policy,
        "title": html.escape(_shortened(meta["title"])),
        "styles": styles,
        "libraries": libraries,
        "script": script,
        "values": values,
        "arrays": pack.text(),
    }
    # in one pass: what is put in is not looked at again
    return _MARK.sub(lambda mark: parts[mark[1]], _asset("page.html"))


def _asset(name: str) -> str:
    return (files("cornersmooth.page") / "assets" / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode('ascii')}'"


def _shortened(value: Any) -> Any:
    """The same values with long texts cut, and numbers that JSON has no word for as null."""
    if isinstance(value, str):
        # characters that are no text, such as halves of pairs out of names that are not UTF-8
        value = value.encode("utf-8", "replace").decode("utf-8")
        return value if len(value) <= _LONGEST else value[:_LONGEST] + " …"
    if isinstance(value, dict):
        return {str(key): _shortened(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_shortened(item) for item in value]
    if isinstance(value, float) and value - value != 0.0:
        return None
    return value
