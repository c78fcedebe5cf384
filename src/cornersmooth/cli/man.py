"""``cornersmooth man``: the manual page, made from the help of all commands."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterator

import click

from cornersmooth import __version__
from cornersmooth.cli.headings import EXIT_CODES


@click.command("man", epilog=EXIT_CODES)
def command() -> int:
    """Print the manual page of all commands, for the program man.

    \b
    Examples:
      cornersmooth man | man -l -
      cornersmooth man > ~/.local/share/man/man1/cornersmooth.1
    """
    from cornersmooth.cli.group import cli

    for line in _page(cli):
        click.echo(line)
    return 0


def _page(group: click.Group) -> Iterator[str]:
    yield f'.TH CORNERSMOOTH 1 "" "cornersmooth {__version__}" "User Commands"'
    yield ".SH NAME"
    help_text = _paragraphs(group.help or "")
    yield rf"cornersmooth \- {_plain(next(help_text)[1].rstrip('.'))}"
    yield ".SH SYNOPSIS"
    with click.Context(group, info_name="cornersmooth", **group.context_settings) as context:
        commands = [(name, group.get_command(context, name)) for name in group.list_commands(context)]
        for name, _ in commands:
            yield rf"\fBcornersmooth {name}\fR [\fIoptions\fR] ..."
            yield ".br"
        for name, one in commands:
            if one is not None:
                yield from _section(name, one, context)
    yield ".SH EXIT STATUS"
    for code, meaning in re.findall(r"(\d) ([^;.]+)", group.epilog or ""):
        yield ".TP"
        yield rf"\fB{code}\fR"
        yield _plain(meaning)


def _section(name: str, one: click.Command, parent: click.Context) -> Iterator[str]:
    with click.Context(one, info_name=name, parent=parent) as context:
        yield f'.SH "{name.upper()}"'
        pieces = " ".join(one.collect_usage_pieces(context))
        yield rf"\fBcornersmooth {_plain(name)}\fR {_plain(pieces)}"
        for kept, text in _paragraphs(one.help or ""):
            yield ".PP"
            if kept:
                yield ".nf"
                yield from (_plain(line) for line in text.splitlines())
                yield ".fi"
            else:
                yield _plain(" ".join(text.split()))
        for param in one.get_params(context):
            record = param.get_help_record(context)
            if record is not None and record[1]:
                yield ".TP"
                yield rf"\fB{_plain(record[0])}\fR"
                yield _plain(record[1])


def _paragraphs(text: str) -> Iterator[tuple[bool, str]]:
    """Paragraphs of a help text, and whether their lines are to be kept as they are."""
    for paragraph in re.split(r"\n\s*\n", inspect.cleandoc(text)):
        if paragraph.strip():
            kept = paragraph.lstrip(" ").startswith("\b")
            yield kept, paragraph.replace("\b\n", "").strip("\n") if kept else paragraph.strip()


def _plain(text: str) -> str:
    """Text that means itself to roff."""
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\\&" + text if text.startswith((".", "'")) else text
