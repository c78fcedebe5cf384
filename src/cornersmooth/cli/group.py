"""The group of all commands, and how it is run."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cornersmooth import __version__
from cornersmooth.cli.command import write_part
from cornersmooth.cli.commands import COMMANDS, GROUPS
from cornersmooth.cli.show import error_contents, print_message, say_json
from cornersmooth.errors import EXIT_INTERNAL, CornersmoothError, SettingsError, internal_error, message
from cornersmooth.system.output import ClosedPipe, reason

if TYPE_CHECKING:
    from cornersmooth.cli import Shutdown

#: as of a program that SIGINT has ended
EXIT_INTERRUPTED = 130

#: as of a program that is ended by the signal of a closed pipe: who reads has enough
EXIT_CLOSED_PIPE = 141

#: what the system says where a disk, a share of it or a file is full, or the disk is broken
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)


class _Group(click.Group):
    """A group that lists its commands in parts, and knows which was probably meant."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Show the help where there is nothing to do, which is an error."""
        if not args and not ctx.resilient_parsing:
            click.echo(ctx.get_help(), err=True)
            ctx.exit(2)
        return super().parse_args(ctx, args)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Say which command was probably meant where the name is unknown."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            from difflib import get_close_matches

            close = get_close_matches(args[0], COMMANDS, n=1) or list(COMMANDS)
            ctx.fail(f"no such command {args[0]!r}; did you mean {close[0]!r}?")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands."""
        for heading, commands in GROUPS.items():
            write_part(formatter, heading, [(str(one.name), one.get_short_help_str(150)) for one in commands])
        package = Path(__file__).resolve().parent.parent
        pages = next((path for path in (package / "docs", package.parents[1] / "docs") if path.is_dir()), package)
        with formatter.section("Pages that helps name"):
            formatter.write_dl([("docs/", str(pages))])


@click.group(
    cls=_Group,
    commands=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="Exit codes: 0 done; 1 the program FAILED, or is not PASSED under --strict; 2 wrong usage or configuration; "
    "3 input cannot be read or is not valid; 4 output cannot be written.",
)
@click.version_option(__version__, prog_name="cornersmooth")
def cli() -> None:
    """Round the corners of five-axis tool paths within a tolerance.

    \b
    Examples:
      cornersmooth smooth part.cls -e 0.04 -o part.nc
      cornersmooth smooth *.cls -e 0.04 -d out/ -j 2
    """


def run(args: list[str] | None, ending: Shutdown) -> int:
    """Run the command line with the given arguments; returns the exit code."""
    try:
        result: Any = cli.main(args=args, standalone_mode=False, obj=ending)
        return result if isinstance(result, int) else 0
    except click.exceptions.Exit as leaving:
        return leaving.exit_code
    except click.ClickException as wrong:
        where = getattr(wrong, "ctx", None) and wrong.ctx.command_path  # type: ignore[attr-defined]
        what, _, hint = wrong.format_message().rstrip(".").partition("; ")
        return _failed(args, SettingsError("", what, hint or f"{where or 'cornersmooth'} --help shows the options"))
    except CornersmoothError as failure:
        return _failed(args, failure)
    except (ClosedPipe, BrokenPipeError, SystemExit):  # click and rich leave so where a pipe is closed, and else never
        _close_quietly()
        return EXIT_CLOSED_PIPE
    except (click.exceptions.Abort, KeyboardInterrupt):
        return EXIT_INTERRUPTED
    except Exception as failure:  # a fault of the program itself: one line, and never the code of a verdict
        if isinstance(failure, OSError) and failure.errno in _NO_ROOM:  # files are spoken for: it is standard output
            return _unwritten(failure)
        _say(internal_error(failure))
        return EXIT_INTERNAL


def _failed(args: list[str] | None, failure: CornersmoothError) -> int:
    """Print an error, as an object too where the output was to be one (report/error.schema.json); return its code."""
    _say(str(failure))
    if "--json" in (sys.argv[1:] if args is None else args) and sys.stdout is not None:
        say_json(error_contents(failure))
    return failure.exit_code


def flushed(code: int) -> int:
    """Exit code after standard output has taken what it still holds; Python's own complaint would come at its end."""
    try:
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError as failure:
        if failure.errno == errno.EPIPE:
            _close_quietly()
            return EXIT_CLOSED_PIPE
        if code == 0:
            return _unwritten(failure)
        _close_quietly()  # there is a message already
    return code


def _close_quietly() -> None:
    """Keep the interpreter from complaining about the closed pipe when it flushes at exit."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        except AttributeError:  # it was closed by the caller
            continue


def _unwritten(failure: OSError) -> int:
    """Say that standard output does not take what is written to it; returns the exit code."""
    _close_quietly()
    what = f"cannot write to it: {reason(failure)}"
    _say(message("error", what, "CS404", place="<stdout>", hint="choose another place"))
    return 4


def _say(text: str) -> None:
    """Print an error; where standard error is full, the exit code must do."""
    with contextlib.suppress(OSError):
        print_message(text)
