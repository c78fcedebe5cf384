"""Runs the command line: in this process, or where a test is about processes, signals or streams, as users do."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import pty
import signal
import subprocess
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any
from unittest.mock import patch

import pytest

from oracle.chains import cl_text, random_chains
from oracle.messages import one_line

DONE, USAGE, BAD_INPUT, BAD_OUTPUT, CLOSED_PIPE = 0, 2, 3, 4, 141
OLD = b"old program\n"

SMALL = b"""PARTNO CONTRACT
UNITS/MM
LOADTL/1
SPINDL/12000,RPM,CLW
RAPID
GOTO/0,0,0,0,0,1
FEDRAT/500,MMPM
GOTO/10,0,0,0,0,1
GOTO/10,10,0,0,0.1,1
GOTO/20,10,0,0,0.1,1
FINI
"""

SCRIPT = Path(sys.executable).parent / "cornersmooth"
#: seconds after which a run counts as hanging
PATIENCE = 120


def command(*args: str | Path) -> list[str]:
    """Argument vector of ``cornersmooth ARGS``."""
    assert SCRIPT.exists(), "install the package into the interpreter that runs the tests"
    return [str(SCRIPT), *map(str, args)]


#: what changes looks
LOOKS = ("NO_COLOR", "FORCE_COLOR", "COLUMNS")


def environment(**changes: str) -> dict[str, str]:
    """Environment of the tests without what changes looks, plus `changes`."""
    return {name: value for name, value in os.environ.items() if name not in LOOKS} | changes


def run(*args: str | Path, data: bytes = b"", cwd: Path | None = None) -> subprocess.CompletedProcess[bytes]:
    """Run the command line to its end in this process, with streams of its own.

    Warnings are errors here, as everywhere in the tests. Words such as CORNERSMOOTH_MODAL=1 are for the environment.
    """
    from cornersmooth import cli

    given = [str(word) for word in args]
    changes = dict(word.split("=", 1) for word in given if word.startswith("CORNERSMOOTH_"))
    words = [word for word in given if not word.startswith("CORNERSMOOTH_")]
    streams = [
        io.TextIOWrapper(io.BytesIO(given), encoding="utf-8", errors="backslashreplace") for given in (data, b"", b"")
    ]
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.chdir(cwd or os.getcwd()))
        stack.enter_context(patch.dict(os.environ, environment(**changes), clear=True))
        stack.enter_context(patch.object(sys, "argv", ["cornersmooth", *words]))
        for name, stream in zip(("stdin", "stdout", "stderr"), streams, strict=True):
            stack.enter_context(patch.object(sys, name, stream))
        code = cli.run(words)
    out, said = (_written(stream) for stream in streams[1:])
    return subprocess.CompletedProcess(words, code, out, said)


def _written(stream: io.TextIOWrapper) -> bytes:
    stream.flush()
    buffer = stream.buffer
    assert isinstance(buffer, io.BytesIO)
    return buffer.getvalue()


def run_script(*args: str | Path, prepare: Callable[[], None] | None = None) -> subprocess.CompletedProcess[bytes]:
    """Run the installed script to its end: for tests about how Python starts."""
    return subprocess.run(
        command(*args),
        input=b"",
        capture_output=True,
        env=environment(),
        timeout=PATIENCE,
        preexec_fn=prepare,
        check=False,
    )


def run_process(
    *args: str | Path, data: bytes | None = None, prepare: Callable[[], None] = lambda: None, **streams: IO[bytes]
) -> subprocess.CompletedProcess[bytes]:
    """Run the command to its end in a process of its own; streams that are not given are pipes."""
    pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
    with forked(*args, prepare=prepare, **(pipes | streams)) as process:
        out, said = process.communicate(data, PATIENCE)
    return subprocess.CompletedProcess(process.args, process.returncode, out, said)


def forked(
    *args: str | Path,
    prepare: Callable[[], None] = lambda: None,
    changes: Mapping[str, str] | None = None,
    **options: Any,
) -> subprocess.Popen[bytes]:
    """A process of the command that is a copy of this one: Python and its arrays are loaded already.

    Streams, session and signals are those of a process that is started. What is called before a process would load its
    program is the command, and ends it.
    """
    words = [str(word) for word in args]
    around = environment(**changes or {})

    def work() -> None:
        code = 1
        try:
            prepare()
            code = _command_line(words, around)
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)

    return subprocess.Popen([SCRIPT, *words], preexec_fn=work, restore_signals=False, **options)


def _command_line(words: list[str], around: dict[str, str]) -> int:
    """Be a process that has just been started."""
    from cornersmooth import cli

    os.closerange(3, os.sysconf("SC_OPEN_MAX"))  # Popen waits for its own of these
    os.environ.clear()
    os.environ.update(around)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
    sys.argv = ["cornersmooth", *words]
    sys.stdin, sys.stdout, sys.stderr = (
        os.fdopen(number, mode, line, encoding="utf-8", errors=errors, closefd=False)
        for number, mode, line, errors in (
            (0, "r", -1, "strict"),
            (1, "w", -1, "strict"),
            (2, "w", 1, "backslashreplace"),
        )
    )
    try:
        cli.main()
    except SystemExit as leaving:
        sys.stdout.flush()
        return leaving.code if isinstance(leaving.code, int) else 1


def _interruptible() -> None:
    """Ctrl-C interrupts: what a shell starts in the background inherits that it does not."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextlib.contextmanager
def started(*args: str | Path, session: bool = False, cwd: Path | None = None) -> Iterator[subprocess.Popen[bytes]]:
    """A process of the command with its streams in pipes; it is gone when the block ends."""
    pipe = subprocess.PIPE
    with forked(
        *args, prepare=_interruptible, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=session, cwd=cwd
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def seen_on_a_terminal(*args: str | Path, out: bool = True, **changes: str) -> bytes:
    """What a terminal shows of a run that ends well: standard error and, unless `out` is false, standard output."""
    leader, follower = pty.openpty()
    process = forked(
        *args,
        changes=changes,
        stdin=subprocess.DEVNULL,
        stdout=follower if out else subprocess.DEVNULL,
        stderr=follower,
    )
    os.close(follower)
    seen = b""
    while True:
        try:
            part = os.read(leader, 65536)
        except OSError:  # the other end is closed
            break
        if not part:
            break
        seen += part
    os.close(leader)
    assert process.wait() == DONE
    return seen


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait until the condition is true; looked at every millisecond."""
    end = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < end, "it never came"
        time.sleep(0.001)


def quiet(stderr: bytes) -> bool:
    """No trace of Python in what the user sees."""
    return b"Traceback" not in stderr and b"Error(" not in stderr and b'File "' not in stderr


def message(stderr: bytes) -> str:
    """The one error, in one line."""
    lines = [line for line in one_line(stderr).splitlines() if "error:" in line]
    assert len(lines) == 1, stderr.decode()
    return lines[0]


def lock(monkeypatch: pytest.MonkeyPatch, *paths: Path) -> None:
    """Answer as the system does where there is no right to read: root has it, whatever the mode of a file says."""
    locked = tuple(map(str, paths))

    def answering(real: Callable[..., object]) -> Callable[..., object]:
        def answer(path: object = ".", *more: object, **how: object) -> object:
            below = tuple(one + os.sep for one in locked)
            if str(path).startswith(below) or (str(path) in locked and real is not os_stat):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
            return real(path, *more, **how)

        return answer

    os_stat, allowed = os.stat, os.access
    for module, name in ((io, "open"), (os, "scandir"), (os, "stat")):
        monkeypatch.setattr(module, name, answering(getattr(module, name)))
    monkeypatch.setattr(os, "access", lambda path, mode: str(path) not in locked and allowed(path, mode))


def only(folder: Path, *names: str) -> bool:
    """Whether the folder holds these names and nothing else, but for the marks of a batch."""
    return sorted(set(os.listdir(folder)) - {".cornersmooth"}) == sorted(names)


@pytest.fixture
def small(tmp_path: Path) -> Path:
    """A file with two corners in a folder of its own."""
    path = tmp_path / "small.cls"
    path.write_bytes(SMALL)
    return path


@pytest.fixture(scope="session")
def medium(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some two thousand corners: more text than a pipe or a small disk holds."""
    path = tmp_path_factory.mktemp("medium") / "medium.cls"
    path.write_bytes(cl_text(random_chains(7, 500, tame=True))[0])
    return path


@pytest.fixture(scope="session")
def large(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Some ten thousand corners: enough text to be interrupted while it is written."""
    path = tmp_path_factory.mktemp("large") / "large.cls"
    data = cl_text(random_chains(7, 250, tame=True))[0]
    begin, end = data.index(b"RAPID"), data.index(b"SPINDL/OFF")
    path.write_bytes(data[:begin] + 10 * data[begin:end] + data[end:])
    return path
