"""Inputs and outputs by name: files, folders with all below, and ``-`` for the standard streams."""

from __future__ import annotations

import contextlib
import io
import os
import re
import stat
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import click

from cornersmooth.cli.show import print_line, warn
from cornersmooth.errors import CornersmoothError, InputError, OutputError, SettingsError
from cornersmooth.system import output

if TYPE_CHECKING:
    from cornersmooth.cli.options import Options

STANDARD = "-"

#: why there is no page of a program
STILL = "the program does not move"


def read_input(path: str, *, size_limit: bool = True) -> tuple[bytes, str]:
    """Contents and display name of an input; ``-`` is standard input (InputError CS100, and CS199: too large)."""
    from cornersmooth.cl.source import read_bounded

    if path == STANDARD:
        if sys.stdin is None:
            raise InputError("CS100", "standard input is closed", "name a file", file="<stdin>")
        return read_bounded(sys.stdin.buffer, "<stdin>", size_limit=size_limit), "<stdin>"
    with _reading(path), Path(path).open("rb") as file:
        return read_bounded(file, path, size_limit=size_limit), path


def check_inputs(*paths: str) -> None:
    """Refuse inputs that cannot be read, before any output is looked at (InputError CS100: as `read_input`)."""
    for path in paths:
        with _reading(path):
            if path != STANDARD and not stat.S_ISFIFO(os.stat(path).st_mode):  # a pipe is opened once
                open(path, "rb").close()


@contextlib.contextmanager
def _reading(path: str) -> Iterator[None]:
    try:
        yield
    except OSError as failure:
        what = f"cannot read it: {output.reason(failure)}"
        folder = isinstance(failure, IsADirectoryError)
        hint = "name a file; smooth takes folders with -d" if folder else "check the path"
        raise InputError("CS100", what, hint, file=path) from failure


def read_head(nc: bytes | str | os.PathLike[str]) -> bytes:
    """Beginning of an NC program; empty where it cannot be read twice."""
    from cornersmooth.frame import HEAD

    if isinstance(nc, bytes):
        return nc[:HEAD]
    with contextlib.suppress(OSError):  # who reads it all says why
        if os.path.isfile(nc):
            with open(nc, "rb") as file:
                return file.read(HEAD)
    return b""


def read_lines(path: str) -> tuple[str, ...]:
    """Lines of a text of the user's own; a mark that some editors put before it is none of it."""
    return tuple(read_input(path)[0].decode("utf-8-sig", "replace").splitlines())


def target_of(path: str) -> output.Target:
    """Where a text goes: the path, or standard output for ``-`` (OutputError CS406: standard output is closed)."""
    if path != STANDARD:
        return path
    if sys.stdout is None:
        raise OutputError("CS406", "standard output is closed", "use -o", file="<stdout>")
    return sys.stdout.buffer


def check_path(path: str, inputs: list[str], *, force: bool | None, beginning: bytes = b"") -> bool:
    """Refuse an output that would destroy something, as `check_output`; standard streams are known by ``-``."""
    if path == STANDARD:
        return True
    sources = [0 if source == STANDARD else source for source in inputs]
    return output.check_output(path, sources, force=force, beginning=beginning)


def suffix_of(path: str) -> str:
    """Ending of a name, which says the form of a report."""
    return os.path.splitext(path)[1].lower()


def check_endings(option: str, paths: Iterable[str], endings: str) -> None:
    """Refuse names that have none of the endings, which say the form."""
    for path in paths:
        if suffix_of(path) not in re.findall(r"\.\w+", endings):
            raise click.UsageError(f"--{option} {path}: let the name end in {endings}")


def check_pair(given: Options) -> None:
    """Refuse two standard inputs, inputs that cannot be read, and reports that would destroy something."""
    pair = [given.source, given.text]
    if pair == [STANDARD, STANDARD]:
        raise click.UsageError("only one of the inputs can be standard input")
    check_inputs(*pair)
    check_endings("report", given.reports, ".json, .csv or .html")
    for path in given.reports:
        check_path(path, pair, force=given.force)


def write_report(path: str, parts: Iterable[str | bytes], *, replace: bool = True) -> None:
    """Write the parts of a report; names in it need not be UTF-8."""
    with output.open_output(target_of(path), replace=replace) as made:
        for part in parts:
            made.stream.write(part if isinstance(part, bytes) else part.encode("utf-8", "backslashreplace"))


def csv_table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows with the same keys as CSV text."""
    import csv

    text = io.StringIO()
    table = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def write_reports(
    paths: Mapping[str, bool],
    contents: Mapping[str, Any],
    *,
    table: Callable[[], Iterable[str]] | None = None,
    page: Callable[[], str] | None = None,
    no_page: str = "",
) -> None:
    """Write reports in the forms that their names end in; of each path, whether it may be replaced.

    `no_page` is why there is none.
    """
    from cornersmooth.report import report_json

    for path, replace in paths.items():
        form = suffix_of(path)
        if form == ".html" and no_page:
            warn(f"no page is written: {no_page}", path)
        elif form == ".csv" and table is not None:
            write_report(path, table(), replace=replace)
        else:
            text = page() if form == ".html" and page is not None else report_json(contents)
            write_report(path, [text], replace=replace)


@contextlib.contextmanager
def naming(name: str) -> Iterator[None]:
    """Name the file in errors that do not."""
    try:
        yield
    except CornersmoothError as error:
        error.file = error.file or name
        raise


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
    sources = {os.path.realpath(one.source) for one in inputs if one.source != STANDARD}
    taken: dict[str, Input] = {}
    for one in inputs:
        for path in one.outputs:
            place = os.path.realpath(path)
            if place in sources:
                raise SettingsError("CS220", f"{path} is the input", "choose another name for the output")
            if place in taken:
                _refuse_clash(taken[place], one, path)
            taken[place] = one


def _refuse_clash(one: Input, other: Input, path: str) -> NoReturn:
    if one is other:
        raise click.UsageError(f"{path} is the name of two outputs; give each its own")
    if os.path.realpath(one.source) == os.path.realpath(other.source):
        raise click.UsageError(f"{one.source} is named twice; name it once")
    raise click.UsageError(
        f"{one.source} and {other.source} would both be written to {path}; rename one, or give each a -d of its own"
    )
