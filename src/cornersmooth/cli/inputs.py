"""Which files a batch works on, and where each of their outputs goes."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from fnmatch import fnmatch

import click

from cornersmooth.cli.files import STANDARD
from cornersmooth.cli.show import print_line
from cornersmooth.cli.values import Given
from cornersmooth.errors import SettingsError

#: names of CL files, for folders
PATTERNS = ("*.cls", "*.clsf", "*.cl", "*.ncl", "*.apt", "*.aptsource", "*.nccl")


@dataclass(frozen=True)
class Input:
    """A file to work on."""

    path: str
    stem: str  #: its place below the folder that was named, without the ending: where its outputs go below theirs


def check_together(given: Given) -> None:
    """Refuse options that do not go together, or not with so many inputs."""
    folder, inputs = given.directory, given.inputs
    if given.quiet and given.verbose:
        raise click.UsageError("-q and -v exclude each other")
    if given.no_verify and given.strict:
        raise click.UsageError("--no-verify and --strict exclude each other")
    if folder and given.output:
        raise click.UsageError("-o and -d exclude each other; -d is for several inputs")
    if given.glob and not folder:
        raise click.UsageError("--glob is for folders, which need -d FOLDER")
    if len(inputs) > 1 and not folder:
        raise click.UsageError("several inputs need -d FOLDER; -o goes with a single input")
    if len(inputs) > 1 and STANDARD in inputs:
        raise click.UsageError("standard input goes with no other input")


def find_inputs(given: Given, patterns: tuple[str, ...] = PATTERNS) -> list[Input]:
    """Files that were named, and in batches those of the folders that were, with all below, in alphabetical order.

    Parameters
    ----------
    patterns : tuple of str
        What the names of files in folders are like where ``--glob`` does not say.

    Raises
    ------
    SettingsError
        CS224: a folder without any such file.
    """
    patterns = given.glob or patterns
    found = []
    for name in given.inputs:
        if name == STANDARD:
            found.append(Input(name, "stdin"))
        elif not (given.directory and os.path.isdir(name)):
            found.append(Input(name, _stem(os.path.basename(name))))
        elif inside := _inside(name, patterns):
            found += inside
        else:
            what = f"no file in {name} is like {', '.join(patterns)}"
            raise SettingsError("CS224", what, "name others with --glob")
    return found


def _inside(folder: str, patterns: tuple[str, ...]) -> list[Input]:
    found: list[Input] = []

    def refused(failure: OSError) -> None:  # reading it will say why
        found.append(Input(failure.filename, os.path.relpath(failure.filename, folder)))

    for here, below, names in os.walk(folder, onerror=refused):
        below.sort()
        for name in sorted(names):
            if any(fnmatch(name.lower(), pattern.lower()) for pattern in patterns):
                path = os.path.join(here, name)
                if _endless(path):
                    print_line(f"{path}: skipped: it is a pipe, a device or a socket; name it by itself to read it")
                    continue
                found.append(Input(path, _stem(os.path.relpath(path, folder))))
    return found


def _endless(path: str) -> bool:
    """Whether it is no file, so that reading it may never end; what is not there says so when it is read."""
    try:
        return not stat.S_ISREG(os.stat(path).st_mode)
    except OSError:
        return False


def _stem(path: str) -> str:
    stem, ending = os.path.splitext(path)
    return os.path.splitext(stem)[0] if ending.lower() == ".gz" else stem
