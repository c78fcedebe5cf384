"""The figures of the paper (10, 11, 14, 16) as pages, made from the samples.

python tools/make_pages.py [FOLDER]

Figures 10 and 11 show the deviation of Table 1 at two tolerances, 14 the speed on an impeller blade
with direct and smoothed motion, 16 the errors of the machined surface.
docs/page.png shows the page of the first program of README.md, as Chromium draws it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
OUT = ROOT / "build" / "pages"

#: ms until a page is drawn, also by a busy machine without a graphics card
PATIENCE = 15_000

#: ``cornersmooth`` of the interpreter that runs this
COMMAND = (sys.executable, "-m", "cornersmooth")


@dataclass(frozen=True)
class Figure:
    """One page.

    Parameters
    ----------
    name : str
        Of the file.
    sample : str
    commands : tuple of tuple of str
        Words behind ``cornersmooth``; ``IN``, ``NC`` and ``PAGE`` stand for the files.
    """

    name: str
    sample: str
    commands: tuple[tuple[str, ...], ...]


LIMITS = ("--feed", "1800", "--accel", "1000", "--jerk", "5000", "--period", "2ms")
PAPER = ("--method", "zhang2016", "-f", "g6.2", "--feed", "1800")

FIGURES = (
    Figure(
        "figure10",
        "paper_table1.csv",
        (("smooth", "IN", "-e", "0.078", *PAPER, "-o", "NC", "--report", "PAGE", "--force"),),
    ),
    Figure(
        "figure11",
        "paper_table1.csv",
        (("smooth", "IN", "-e", "0.15", *PAPER, "-o", "NC", "--report", "PAGE", "--force"),),
    ),
    Figure(
        "figure14",
        "impeller.cls",
        (("time", "IN", "-e", "0.04", "-H", "12", *LIMITS, "--report", "PAGE", "--force"),),
    ),
    Figure(
        "figure16",
        "impeller.cls",
        (
            ("smooth", "IN", "-e", "0.04", "-H", "12", "-o", "NC", "--force", "-q"),
            ("surface", "IN", "NC", "-e", "0.04", "-H", "12", "--stations", "140", "--report", "PAGE", "--force"),
        ),
    ),
)


def make(figure: Figure, folder: Path) -> Path:
    """Run the commands of a figure; return its page."""
    page = folder / f"{figure.name}.html"
    files = {"IN": ROOT / "samples" / figure.sample, "NC": folder / f"{figure.name}.nc", "PAGE": page}
    for words in figure.commands:
        given = [str(files.get(word, word)) for word in words]
        subprocess.run([*COMMAND, *given], check=True, stdout=subprocess.DEVNULL)
    return page


def picture(folder: Path, target: Path) -> None:
    """Let Chromium draw the page of the first program of README.md."""
    page, program = folder / "part.html", shutil.which("chromium") or "chromium-browser"
    made = ("-e", "0.01", "--limits", "table-ac", "-o", str(folder / "part.nc"), "--report", str(page), "--force", "-q")
    subprocess.run([*COMMAND, "smooth", str(ROOT / "samples" / "impeller.cls"), *made], check=True)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driving:
        browser = driving.chromium.launch(
            executable_path=program, args=["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
        )
        shown = browser.new_page(viewport={"width": 1100, "height": 700})
        shown.goto(page.as_uri())
        shown.wait_for_timeout(PATIENCE)
        shown.screenshot(path=str(target))
        browser.close()


def main(folder: Path) -> int:
    """Make all pages and say where they are."""
    folder.mkdir(parents=True, exist_ok=True)
    for figure in FIGURES:
        page = make(figure, folder)
        sys.stdout.write(f"{os.path.relpath(page)}: {page.stat().st_size / 1e6:.2f} MB\n")
    picture(folder, ROOT / "docs" / "page.png")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else OUT))
