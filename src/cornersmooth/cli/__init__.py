"""The command line: `main` is the entry point; `commands` has every command, `declared` every option once.

Nothing else is imported before the signals are in good hands: a Ctrl-C may come while Python is still loading. A run
ends by a signal with one line, nothing half written, no process left, at any moment. A handler may come between any two
steps of Python, so it raises no exception, which would have to find its way through everybody's clean-up: it ends the
other processes, removes the temporary files and leaves.
"""

from __future__ import annotations

import gc
import io
import os
import signal
import sys

TYPE_CHECKING = False  # typing takes longer to load than all the rest
if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import NoReturn

#: signals that end a run: Ctrl-C, the polite end, the end of the terminal, Ctrl-Break of Windows
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
SIGNALS = tuple(getattr(signal, name) for name in _NAMES if hasattr(signal, name))

#: shows the cursor again and begins a new line, where a bar was being drawn
_TIDY_TERMINAL = b"\r\x1b[2K\x1b[?25h"


class Shutdown:
    """What is done when a signal ends the run: `clean` first, then `keep`, which writes what has to outlast the run.

    `say` gives the line that is printed, `loaded` is called when the modules of the command are loaded.
    """

    def __init__(self) -> None:
        self.loaded: Callable[[], None] = lambda: None
        self.say: Callable[[], str] = lambda: "interrupted"
        self.clean: Callable[[], None] | None = None
        self.keep: Callable[[], None] | None = None
        self._owner = os.getpid()

    def install(self) -> None:
        """Take the signals over; those that this process was started to ignore stay ignored, as with nohup."""
        for number in SIGNALS:
            if signal.getsignal(number) != signal.SIG_IGN:
                signal.signal(number, self.leave)

    def leave(self, number: int, frame: object) -> NoReturn:
        """End everything and leave with 128 + the number of the signal."""
        for other in SIGNALS:
            signal.signal(other, signal.SIG_IGN)
        code = 128 + number
        if os.getpid() != self._owner:  # forked a moment ago: all this is the parent's
            os._exit(code)
        for step in (self.clean, _kill_children, _remove_unfinished, self.keep, self._tell):
            try:
                if step is not None:
                    step()
            except BaseException:  # whatever it was, the rest must be done
                continue
        os._exit(code)

    def _tell(self) -> None:
        line = f"{self.say()}\n".encode("utf-8", "backslashreplace")
        os.write(2, (_TIDY_TERMINAL if os.isatty(2) else b"") + line)


def _kill_children() -> None:
    """End processes that were forked to help."""
    process = sys.modules.get("multiprocessing.process")
    for child in process.active_children() if process else ():
        child.kill()


def _remove_unfinished() -> None:
    output = sys.modules.get("cornersmooth.system.output")
    if output is not None:
        output.remove_unfinished()


def _collect_again() -> None:
    """Collect garbage from now on, but not among what is loaded, which stays to the end."""
    gc.freeze()
    gc.enable()


def main() -> NoReturn:
    """Run the command line as a process of its own and leave with its exit code."""
    ending = Shutdown()
    ending.install()
    gc.disable()  # until all is loaded: collections while loading and at the end take a sixth of a small run
    ending.loaded = _collect_again

    from cornersmooth.cli import group

    if sys.stderr is None:  # closed by the caller; what goes there must not end up in the NC text
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    if sys.stdout is not None and isinstance(sys.stdout.buffer, io.RawIOBase):  # it may take a part of what is written
        sys.stdout = io.TextIOWrapper(io.BufferedWriter(sys.stdout.buffer), sys.stdout.encoding, line_buffering=True)
    if sys.stdout is not None:  # a name outside the console's code page is shown escaped, as on standard error
        sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    sys.exit(group.flushed(group.run(None, ending)))


def run(args: list[str]) -> int:
    """Run the command line within another program, whose signals are its own; returns the exit code."""
    from cornersmooth.cli import group

    return group.run(args, Shutdown())
