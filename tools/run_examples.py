"""Runs the examples of a page one after the other and brings what they print up to date.

python tools/run_examples.py PAGE [FOLDER]

Examples are fenced as ``python``, with what they print behind them, fenced as ``text``, or as ``sh``: commands of
cornersmooth, a line each. They run in a folder in which ``part.cls`` is the sample ``impeller.cls``, if there is no
other: a temporary one; the folder ``gallery`` that they write is then moved to FOLDER.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import shutil
import sys
import tempfile
from pathlib import Path

from cornersmooth.cli import run

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = re.compile(r"```(?P<kind>python|sh)\n(?P<code>.*?)```\n(\n```text\n.*?```\n)?", re.DOTALL)


def run_page(text: str, folder: Path) -> str:
    """Return the page with what its examples print now, run in the folder."""
    part = folder / "part.cls"
    if not part.exists():
        shutil.copy(ROOT / "samples" / "impeller.cls", part)
    (folder / "gallery").mkdir()
    names: dict[str, object] = {"__name__": "examples"}

    def example(found: re.Match[str]) -> str:
        said = io.StringIO()
        if found["kind"] == "sh":
            run_commands(found["code"])
        else:
            with contextlib.redirect_stdout(said):
                exec(found["code"], names)
        told = f"\n```text\n{said.getvalue()}```\n" if said.getvalue() else ""
        return f"```{found['kind']}\n{found['code']}```\n{told}"

    with contextlib.chdir(folder):
        return EXAMPLE.sub(example, text)


def run_commands(code: str) -> None:
    """Run lines that begin with ``cornersmooth``."""
    for line in code.splitlines():
        words = shlex.split(line, comments=True)
        if words[0] != "cornersmooth" or run(words[1:]) != 0:
            raise SystemExit(f"{line}: does not work")


def main(page: Path, folder: Path | None) -> None:
    """Rewrite the page; its pictures go to the folder."""
    with tempfile.TemporaryDirectory() as scratch:
        page.write_text(run_page(page.read_text(encoding="utf-8"), Path(scratch)), encoding="utf-8")
        if folder is not None:
            shutil.copytree(Path(scratch) / "gallery", folder / "gallery", dirs_exist_ok=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]) if len(sys.argv) > 2 else None)
