"""Mutate tables of controls and machines, and shop settings: each is taken or an error of usage, and nothing else.

    python fuzz/fuzz_tables.py --seconds 300 --seed 1

Seeds are the tables that come with the program and a page of settings. A failure prints the text as a Python literal.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
import time
from importlib import resources
from pathlib import Path

import click

from cornersmooth.cli.shop import find_files
from cornersmooth.errors import CornersmoothError
from cornersmooth.kinematics import parse_machine
from cornersmooth.nc import parse_control

#: a text may take this long, seconds
SLOWEST = 2.0

SETTINGS = """[smooth]
tolerance = 0.01
control = "shop"
[smooth.shop]
form = "bspline"
[controls.shop]
like = "siemens"
[machines.mill]
like = "table-ac"
"""

FRAGMENTS = (
    "{program.__class__}",
    "{program:>999999999}",
    "{}",
    "{{",
    "(a+)+$",
    "[" * 5000,
    '"' * 3,
    "= nan",
    "= inf",
    "= 1e999",
    "= -1",
    "= true",
    "= []",
    "= {}",
    "\x1b[2J",
    "\u202e",
    "like = 'fanuc'",
    "[[axis]]",
    "[program]",
    "9" * 40,
    "\n",
    "#",
    "'",
)


def seeds() -> list[tuple[str, str]]:
    """Kind and text of each seed."""
    found = [("settings", SETTINGS)]
    for kind, package, folder in (
        ("control", "cornersmooth.nc", "controls"),
        ("machine", "cornersmooth.kinematics", "machines"),
    ):
        tables = (resources.files(package) / folder).iterdir()
        found += [(kind, one.read_text(encoding="utf-8")) for one in tables if one.name.endswith(".toml")]
    return found


def mutated(text: str, rng: random.Random) -> str:
    """Text with some lines or characters changed."""
    for _ in range(rng.randint(1, 4)):
        at, length = rng.randrange(len(text) + 1), rng.randint(0, 12)
        match rng.randrange(4):
            case 0:
                text = text[:at] + rng.choice(FRAGMENTS) + text[at:]
            case 1:
                text = text[:at] + text[at + length :]
            case 2:
                text = text[:at] + rng.choice(FRAGMENTS) + text[at + length :]
            case _:
                lines = text.splitlines(keepends=True)
                rng.shuffle(lines)
                text = "".join(lines[: rng.randint(1, len(lines))]) if lines else text
    return text


def take(kind: str, text: str, folder: Path) -> None:
    """Read a text as the command does."""
    if kind == "control":
        parse_control(text)
    elif kind == "machine":
        parse_machine(text)
    else:
        (folder / "cornersmooth.toml").write_text(text, encoding="utf-8", errors="surrogatepass")
        find_files(str(folder))


def main() -> int:
    """Run for so many seconds; 1 where something else than an error of usage came."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng, begin, runs, taken = random.Random(given.seed), time.monotonic(), 0, 0
    known = seeds()
    with tempfile.TemporaryDirectory() as name:
        while time.monotonic() - begin < given.seconds:
            kind, seed = rng.choice(known)
            text, start = mutated(seed, rng), time.monotonic()
            try:
                take(kind, text, Path(name))
                taken += 1
            except (CornersmoothError, click.UsageError):
                pass
            except Exception as failure:
                print(f"{kind}: {type(failure).__name__}: {failure}\n{text!r}")
                return 1
            if time.monotonic() - start > SLOWEST:
                print(f"{kind}: more than {SLOWEST} s\n{text!r}")
                return 1
            runs += 1
    print(f"{runs:,} texts, {taken:,} taken")
    return 0


if __name__ == "__main__":
    sys.exit(main())
