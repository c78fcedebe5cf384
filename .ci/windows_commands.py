"""Everyday commands in a Windows Python under wine, beside the same in this Python on Linux.

    python .ci/windows_commands.py PYTHON.EXE

Both run in folders of their own. Exit codes must be as the list has them, and programs, tables and standard output the
same bytes. wine gives a Windows Python no files of Linux as its streams, so one Python of Windows runs all commands.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

CODE = "import sys; sys.argv[0] = 'cornersmooth'; from cornersmooth.cli import main; main()"

PART = b"""PARTNO PLATE
UNITS/MM
LOADTL/1
SPINDL/12000,RPM,CLW
RAPID
GOTO/0,0,0,0,0,1
FEDRAT/500,MMPM
GOTO/10,0,0,0,0,1
GOTO/10,10,0,0,0.1,1
GOTO/20,10,0,0,0.1,1
"""
HOLES = b"CYCLE/DRILL,FEDTO,5,FEDRAT,100\nGOTO/30,10,0,0.1,0,1\nGOTO/30,20,0,0.1,0,1\nCYCLE/OFF\n"
FILES = {
    "part.cls": PART + b"FINI\n",
    "other.cls": PART.replace(b"500", b"600") + b"FINI\n",
    "holes.cls": PART + HOLES + b"FINI\n",
    "broken.cls": PART.replace(b"GOTO/10,10", b"GOTO/10,nan") + b"FINI\n",
    "Größe β.cls": PART + b"FINI\n",
    "old.nc": b"old program\r\n",
    "cl/a1.cls": PART + b"FINI\n",
    "cl/below/a2.cls": PART + b"FINI\n",
}
#: settings of a user: in the folder that the system has for them
SETTINGS = "[info]\ntolerance = 0.02\n"


#: seconds after which a command hangs
PATIENCE = 300

#: exit code, standard output, standard error
Found = tuple[int, str, str]


@dataclass(frozen=True)
class Command:
    """A command line, its exit code, what is given to it, and what standard output must have."""

    words: str
    code: int = 0
    data: bytes = b""
    output: str = ""
    same: bool = True  #: whether standard output is the same on both


COMMANDS = (
    Command("--version"),
    Command("controls"),
    Command("machines table-ac"),
    Command("explain CS404"),
    Command("info part.cls", output="at 0.02 mm"),
    Command("config part.cls --json", same=False),
    Command("smooth part.cls -o part.nc"),
    Command("smooth part.cls -o part.nc", 4),
    Command("smooth other.cls -o part.nc --force"),
    Command("smooth holes.cls -o old.nc --force --strict --skip-cycles", 1),
    Command("smooth missing.cls -o x.nc", 3),
    Command("smooth broken.cls -o x.nc", 3),
    Command("smooth part.cls --tolerence 1 -o x.nc", 2),
    Command("smooth - -e 0.04", data=FILES["part.cls"]),
    Command("smooth part.cls --control siemens -f bspline -o part.mpf"),
    Command("smooth part.cls --control linuxcnc --machine xyzac-trt -o part.ngc"),
    Command("smooth part.cls -f g6.2 --method global --limits table-ac -o curve.nc --report part.csv"),
    Command("smooth Größe_β.cls -o Größe_β.nc --report Größe_β.html"),
    Command("info Größe_β.cls --json"),
    Command("verify other.cls part.nc --report found.csv"),
    Command("verify part.cls part.nc", 1),
    Command("filter part.ngc --control linuxcnc --machine xyzac-trt -o new.ngc"),
    Command("smooth cl part.cls -d out -j 2 --summary made.json"),
    Command("smooth cl part.cls -d out -j 2", output=""),
)


def folder_of(parent: Path, name: str) -> Path:
    """A folder with the inputs."""
    for path, text in FILES.items():
        file = parent / name / path.replace(" ", "_")
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(text)
    return parent / name


def run_all(folder: str, result: str) -> None:
    """Run all commands one after the other in a folder, by this Python, and write what became of them."""
    found: list[Found] = []
    for command in COMMANDS:
        found.append(run_one(command, folder) or run_one(command, folder) or (-1, "", "no end, twice"))
        Path(result).write_text(json.dumps(found))


def run_one(command: Command, folder: str) -> Found | None:
    """Run a command; None where it does not end, which a process of wine does now and then before it begins."""
    with subprocess.Popen(
        [sys.executable, "-c", CODE, *command.words.split()],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=folder,
    ) as process:
        try:
            out, said = process.communicate(command.data, PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            return None
    return process.returncode, out.decode("latin-1"), said.decode("latin-1")


def files(folder: Path) -> dict[str, bytes]:
    """Files that do not differ from run to run."""
    found = {str(path.relative_to(folder)): path for path in sorted(folder.rglob("*")) if path.is_file()}
    return {name: path.read_bytes() for name, path in found.items() if not name.endswith((".html", ".json"))}


def wrong(command: Command, windows: Found, linux: Found) -> str:
    """What is wrong with a command; empty for nothing."""
    code, out, said = windows
    expected = linux[1]
    told = out if command.data else out.replace("\r\n", "\n")
    if not code == linux[0] == command.code:
        return f"exit codes {code} and {linux[0]} on Linux, in place of {command.code}: {said}"
    if "--json" in command.words and command.same:  # escaped is what a code page has not; last digits are numpy's
        told, expected = (
            json.dumps(json.loads(one.encode("latin-1"), parse_float=lambda text: f"{float(text):.9g}"))
            for one in (told, expected)
        )
    if command.same and told != expected:
        return f"standard output differs from that on Linux: {told!r}"
    if command.output not in told:
        return f"standard output has no {command.output!r}"
    return said if "Traceback" in said or "internal error" in said else ""


def main() -> int:
    """Run both, say what came out, and return whether anything is wrong."""
    python = sys.argv[1]
    user = next(Path(os.environ["WINEPREFIX"], "drive_c", "users").glob("[!P]*"))
    with tempfile.TemporaryDirectory() as parent:
        here, there, config = (
            folder_of(Path(parent), "linux"),
            folder_of(Path(parent), "windows"),
            Path(parent, "config"),
        )
        for place in (user / "AppData" / "Roaming", config):
            (place / "cornersmooth").mkdir(parents=True, exist_ok=True)
            (place / "cornersmooth" / "cornersmooth.toml").write_text(SETTINGS)
        running = [
            subprocess.Popen(
                [*start, __file__, "--run", str(folder), f"{folder}.json"],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                env=os.environ | around,
            )
            for start, folder, around in (
                (["wine", python], there, {}),
                ([sys.executable], here, {"XDG_CONFIG_HOME": str(config)}),
            )
        ]
        said = [process.communicate()[0].decode("utf-8", "replace") for process in running]
        results = [Path(f"{folder}.json") for folder in (there, here)]
        if not all(result.exists() for result in results):
            print(f"Windows: the commands did not begin: {said}")
            return 1
        failures = 0
        for command, windows, linux in zip(COMMANDS, *(json.loads(one.read_text()) for one in results), strict=True):
            why = wrong(command, windows, linux)
            failures += bool(why)
            print(f"{windows[0]:>4}  {'WRONG' if why else 'same':<5}  cornersmooth {command.words}  {why}")
        made, expected = files(there), files(here)
    differ = sorted(name for name in made.keys() | expected.keys() if made.get(name) != expected.get(name))
    same = len(expected) - len(differ)
    print(f"Windows: {len(COMMANDS) - failures} of {len(COMMANDS)} commands, {same} of {len(expected)} files the same")
    if differ:
        print(f"Windows: not the same: {', '.join(differ)}")
    return int(bool(failures or differ))


if __name__ == "__main__":
    if sys.argv[1] == "--run":
        run_all(*sys.argv[2:])
    else:
        sys.exit(main())
