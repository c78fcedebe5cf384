"""Which files a command works on, and where the outputs of each go."""

from __future__ import annotations

import os
import stat
from dataclasses import dataclass
from fnmatch import fnmatch
from typing import NoReturn

import click

from cornersmooth.cli.files import STANDARD, check_path
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import print_line
from cornersmooth.errors import SettingsError

#: names of CL files, for folders
PATTERNS = ("*.cls", "*.clsf", "*.cl", "*.ncl", "*.apt", "*.aptsource", "*.nccl")


@dataclass(frozen=True)
class Input:
    """A file to work on."""

    #: Input and NC file; ``-`` for the standard streams.
    source: str
    target: str
    reports: tuple[str, ...]
    stem: str  #: its place below the folder that was named, without the ending; outputs have the same in their folders

    @property
    def outputs(self) -> tuple[str, ...]:
        """Files that are written."""
        return tuple(path for path in (self.target, *self.reports) if path != STANDARD)


def find_inputs(given: Options, patterns: tuple[str, ...] = PATTERNS, suffix: str | None = None) -> list[Input]:
    """Files that were named, and in batches those of the folders that were, with all below, in alphabetical order.

    In folders they are like the patterns where ``--glob`` does not say. NC files have the suffix, or that of the input.
    Raises UsageError: options do not go together, or not with so many inputs, or names clash; SettingsError CS220: an
    output of one is the input of another; CS224: a folder without any such file.
    """
    _check_together(given)
    found: list[Input] = []
    for name in given.inputs:
        for path, stem in _files(name, given, given.glob or patterns):
            target = given.output or STANDARD
            if given.directory:
                target = os.path.join(given.directory, stem + (suffix or os.path.splitext(path)[1]))
            found.append(Input(path, target, tuple(one.replace("{stem}", stem) for one in given.reports), stem))
    if len(found) > 1 and any("{stem}" not in path for path in given.reports):
        raise click.UsageError("with several inputs a report needs {stem} in its name, as in 'out/{stem}.json'")
    _check_outputs(found)
    return found


def _check_together(given: Options) -> None:
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


def _files(name: str, given: Options, patterns: tuple[str, ...]) -> list[tuple[str, str]]:
    """Files that a name stands for, and their stems."""
    if name == STANDARD:
        return [(name, "stdin")]
    if not (given.directory and os.path.isdir(name)):
        return [(name, _stem(os.path.basename(name)))]
    found: list[tuple[str, str]] = []

    def refused(failure: OSError) -> None:  # reading it will say why
        found.append((failure.filename, os.path.relpath(failure.filename, name)))

    for here, below, names in os.walk(name, onerror=refused):
        below.sort()
        for one in sorted(names):
            path = os.path.join(here, one)
            if not any(fnmatch(one.lower(), pattern.lower()) for pattern in patterns):
                continue
            if os.path.exists(path) and not stat.S_ISREG(os.stat(path).st_mode):  # reading it may never end
                print_line(f"{path}: skipped: it is a pipe, a device or a socket; name it by itself to read it")
            else:
                found.append((path, _stem(os.path.relpath(path, name))))
    if not found:
        raise SettingsError("CS224", f"no file in {name} is like {', '.join(patterns)}", "name others with --glob")
    return found


def _stem(path: str) -> str:
    stem, ending = os.path.splitext(path)
    return os.path.splitext(stem)[0] if ending.lower() == ".gz" else stem


def _check_outputs(inputs: list[Input]) -> None:
    """Refuse two outputs of one name, and outputs of one that are the input of another."""
    sources = [one.source for one in inputs]
    names = {name for source in sources for name in _names(source)}
    taken: dict[str, Input] = {}
    for one in inputs:
        real = [os.path.realpath(path) for path in one.outputs]
        for path, place in zip(one.outputs, real, strict=True):
            other = taken.setdefault(place, one)
            if other is not one or real.count(place) > 1:
                _refuse_clash(other, one, path)
            if not names.isdisjoint(_names(path)):
                check_path(path, sources, force=True)


def _refuse_clash(one: Input, other: Input, path: str) -> NoReturn:
    if one is other:
        raise click.UsageError(f"{path} is the name of two outputs; give each its own")
    if os.path.realpath(one.source) == os.path.realpath(other.source):
        raise click.UsageError(f"{one.source} is named twice; name it once")
    raise click.UsageError(
        f"{one.source} and {other.source} would both be written to {path}; rename one, or give each a -d of its own"
    )


def _names(path: str) -> list[object]:
    """What tells a file from others: its place, and where it exists, its number."""
    if path == STANDARD:
        return []
    try:
        found = os.stat(path)
    except OSError:
        return [os.path.realpath(path)]
    return [os.path.realpath(path), (found.st_dev, found.st_ino)]
