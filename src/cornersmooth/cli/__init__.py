"""The command line: `main` is the entry point; one module per command, `options` with every option once.

Nothing is imported before the signals are in good hands: a Ctrl-C may come while Python is still loading.
"""

from __future__ import annotations

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import NoReturn


def main() -> NoReturn:
    """Run the command line as a process of its own and leave with its exit code."""
    from cornersmooth.cli.shutdown import Shutdown

    ending = Shutdown()
    ending.install()
    import os
    import sys

    from cornersmooth.cli import group

    if sys.stderr is None:  # closed by the caller; what is said to it must not end up in the NC text
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    sys.exit(group.flushed(group.run(None, ending)))


def run(args: list[str]) -> int:
    """Run the command line within another program, whose signals are its own; returns the exit code."""
    from cornersmooth.cli import group
    from cornersmooth.cli.shutdown import Shutdown

    return group.run(args, Shutdown())
