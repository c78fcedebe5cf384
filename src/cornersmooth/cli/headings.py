"""Helps in parts: each option names its heading where it is defined; the ones of every day come first."""

from __future__ import annotations

import os
import sys
from typing import Any, Final

import click

#: in this order; the first holds the options of every day
HEADINGS: Final = (
    "Everyday",
    "Output",
    "Control",
    "Program",
    "Curves",
    "Lines",
    "Holes and planes",
    "Limits",
    "Reading",
    "Verification",
    "Batches",
)
#: epilogs of commands that read no input, of those that do, and of those that write programs, too
EXIT_CODES: Final = "Exit codes: 0 done; 2 wrong usage or configuration; 4 output cannot be written."
EXIT_CODES_OF_READERS: Final = EXIT_CODES.replace("; 4", "; 3 input cannot be read or is not valid; 4")
EXIT_CODES_OF_WRITERS: Final = EXIT_CODES_OF_READERS.replace(
    "0 done;", "0 done; 1 the program FAILED, or is not PASSED under --strict;"
)
#: room for the names of options
_NAMES: Final = 26


class HeadedOption(click.Option):
    """An option with a heading."""

    def __init__(self, *args: Any, heading: str, **given: Any) -> None:
        super().__init__(*args, **given)
        self.heading = heading


class HeadedCommand(click.Command):
    """A command whose help has its options under headings."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options of each heading."""
        parts: dict[str, list[tuple[str, str]]] = {heading: [] for heading in HEADINGS}
        for param in self.get_params(ctx):
            if isinstance(param, click.Option) and (record := param.get_help_record(ctx)) is not None:
                parts[getattr(param, "heading", "Output")].append((record[0].ljust(_NAMES), record[1]))
        for heading, rows in parts.items():
            if rows:
                write_part(formatter, heading, rows)


def write_part(formatter: click.HelpFormatter, heading: str, rows: list[tuple[str, str]]) -> None:
    """Write names and their helps below a heading; a terminal shows both in colour."""
    with formatter.section(_styled(heading, bold=True)):
        formatter.write_dl([(_styled(name, fg="cyan"), text) for name, text in rows], col_max=_NAMES)


def _styled(text: str, **style: Any) -> str:
    coloured = sys.stdout is not None and sys.stdout.isatty() and "NO_COLOR" not in os.environ
    return click.style(text, **style) if coloured and os.environ.get("TERM") != "dumb" else text
