"""Packages that only some work needs, the extras of the project, and how to come by them."""

from __future__ import annotations

import shlex
from pathlib import Path


def install_hint(extra: str) -> str:
    """Say how to install an extra: of the checkout that this runs from, or of the package."""
    checkout = Path(__file__).resolve().parents[2]
    if (checkout / "pyproject.toml").is_file() and (checkout / "src" / "cornersmooth").is_dir():
        here = "." if checkout == Path.cwd() else str(checkout)
        return f"install it with: pip install -e {shlex.quote(f'{here}[{extra}]')}"
    return f"install it with: pip install 'cornersmooth[{extra}]'"
