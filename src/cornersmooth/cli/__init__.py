"""The command line: `main` is the entry point; `commands` has every command, `declared` every option once.

Nothing else is imported before the signals are in good hands: a Ctrl-C may come while Python is still loading.
"""

from __future__ import annotations

import os
import sys

from cornersmooth.cli.shutdown import Shutdown

TYPE_CHECKING = False  # typing takes longer to load than all the rest
if TYPE_CHECKING:
    from typing import NoReturn


def main() -> NoReturn:
    """Run the command line as a process of its own and leave with its exit code."""
    ending = Shutdown()
    ending.install()

    from cornersmooth.cli import group

    if sys.stderr is None:  # closed by the caller; what goes there must not end up in the NC text
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    if sys.stdout is not None:  # a name outside the console's code page is shown escaped, as on standard error
        sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    sys.exit(group.flushed(group.run(None, ending)))


def run(args: list[str]) -> int:
    """Run the command line within another program, whose signals are its own; returns the exit code."""
    from cornersmooth.cli import group

    return group.run(args, Shutdown())
