"""Writes the reference of the library from its docstrings, as pages for a browser; any warning is an error.

python tools/make_reference.py [FOLDER]
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pdoc
import pdoc.render

import cornersmooth

ROOT = Path(__file__).resolve().parent.parent


def main(folder: Path) -> None:
    """Write the page of the public names; everything below the package is not for users."""
    for name in cornersmooth.__all__:  # they are there when they are asked for; pdoc looks at what is there
        setattr(cornersmooth, name, getattr(cornersmooth, name))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pdoc.render.configure(docformat="numpy", footer_text=f"cornersmooth {cornersmooth.__version__}")
        pdoc.pdoc("cornersmooth", r"!cornersmooth\.", output_directory=folder)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "build" / "docs")
