"""The page as one file: markup, style, libraries, scripts and data; nothing is fetched from anywhere."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from importlib.resources import files
from typing import Any

from cornersmooth.page.packing import Pack
from cornersmooth.page.scene import Story, Subject, scene

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
    "corners.js",
    "drive.js",
    "wiring.js",
    "main.js",
)
_STYLES = ("vendor/uplot.css", "page.css")

#: places of the template that are filled in
_MARK = re.compile(r"\{\{(\w+)\}\}")

#: longest text of the user's that is shown
_LONGEST = 300


def page(subject: Subject, story: Story) -> str:
    """Page of a path, as text to be written in UTF-8.

    Same input, same text: no dates, no paths.
    """
    meta, pack = scene(subject, story)
    return document(meta, pack)


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
