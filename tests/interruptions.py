"""Interrupts the command at random moments and looks at what is left.

    python tests/interruptions.py [TRIES [SEED]]

Single files, batches and the processes of the verification; Ctrl-C (to the whole group, as a terminal sends it, and to
one process), SIGTERM, SIGKILL of one of the processes. Whatever comes: the old file or a whole new one, no temporary
file, no process left after two seconds, one line of text.
"""

from __future__ import annotations

import math
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from oracle.command import forked
from oracle.messages import one_line

OLD = b"old program\n"
#: seconds after which nothing may be left
LEFT = 2.0
#: SIGINT to the group, as a terminal sends it, or to the command alone; SIGTERM; SIGKILL of one of its processes
HOW = ("group", "process", "term", "kill")
#: files of a batch
FILES = 6


@dataclass(frozen=True)
class Try:
    """One interruption."""

    batch: bool
    how: str  #: one of `HOW`, or "nohup": to the group, which ignores it; "parent": SIGKILL of the command itself
    moment: float  #: as a part of the time that a run takes
    old: bool


@dataclass
class Found:
    """What became of it."""

    code: int
    said: str
    wrong: list[str] = field(default_factory=list)
    early: bool = False  #: Python itself was still starting

    @property
    def word(self) -> str:
        """How it ended, in a word."""
        if self.early:
            return "while Python itself was starting"
        return {0: "finished", 3: "file given up", 130: "interrupted", 143: "terminated"}.get(self.code, "?")


def cl_text(poses: int, seed: int) -> str:
    """A wavy five-axis path; long enough for the verification to use processes of its own."""
    rows = ["UNITS/MM", "RAPID", "GOTO/0,0,50,0,0,1", "FEDRAT/1200,MMPM"]
    for k in range(poses):
        tilt, turn = 0.2 * math.sin(k / 90 + seed), k / 300
        axis = (tilt * math.cos(turn), tilt * math.sin(turn), math.sqrt(1 - tilt * tilt))
        x, y, z = 0.4 * k, 5 * math.sin(k / 7) + seed, math.cos(k / 11)
        rows.append(f"GOTO/{x:.4f},{y:.4f},{z:.4f},{axis[0]:.7f},{axis[1]:.7f},{axis[2]:.7f}")
    return "\n".join([*rows, "FINI", ""])


class Bench:
    """Inputs of so many poses, what they become undisturbed, and how long that takes; 0: only batches."""

    def __init__(self, folder: Path, single: int = 40_000, several: int = 4_000) -> None:
        self.folder = folder
        self.single = folder / "single.cls"
        self.single.write_text(cl_text(single, 0))
        self.several = [folder / f"part{k}.cls" for k in range(FILES)]
        for k, path in enumerate(self.several):
            path.write_text(cl_text(several, k))
        self.whole: dict[str, bytes] = {}
        self.seconds: dict[bool, float] = {}
        for batch in (False, True) if single else (True,):
            out = folder / f"whole{batch:d}"
            out.mkdir()
            begin = time.monotonic()
            with forked(*self.words(batch, out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                assert process.wait() == 0
            self.seconds[batch] = time.monotonic() - begin
            self.whole |= {path.name: path.read_bytes() for path in out.glob("[!.]*")}

    def words(self, batch: bool, out: Path) -> list[str]:
        """What a run is started with."""
        if batch:
            return ["smooth", *map(str, self.several), "-d", str(out), "-j", "2", "--force"]
        return ["smooth", str(self.single), "-o", str(out / "single.nc"), "--force"]

    def interrupt(self, one: Try) -> Found:
        """Run once, interrupt, and look."""
        with tempfile.TemporaryDirectory(dir=self.folder) as name:
            out, scratch = Path(name) / "out", Path(name) / "tmp"
            out.mkdir()
            scratch.mkdir()
            names = [f"{path.stem}.nc" for path in self.several] if one.batch else ["single.nc"]
            for each in names if one.old else ():
                (out / each).write_bytes(OLD)
            process = forked(
                *self.words(one.batch, out),
                prepare=lambda: signal.signal(signal.SIGINT, [signal.SIG_DFL, signal.SIG_IGN][one.how == "nohup"]),
                changes={"TMPDIR": str(scratch)},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
            time.sleep(one.moment * self.seconds[one.batch])
            _send(process, one.how)
            try:
                _, complaint = process.communicate(timeout=60)
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
                return Found(1, "", ["it hangs"])
            found = Found(process.returncode, complaint.decode())
            self._look(found, one, process.pid, out, scratch)
            return found

    def _look(self, found: Found, one: Try, session: int, out: Path, scratch: Path) -> None:
        found.early = "<frozen" in found.said or "site.py" in found.said or found.code in (-2, -15)
        deadline = time.monotonic() + LEFT
        while (left := members(session)) and time.monotonic() < deadline:
            time.sleep(0.02)
        if left:
            found.wrong.append(f"processes left: {left}")
        if found.early:
            return
        ends = {"group": 130, "process": 130, "term": 143, "kill": 3, "nohup": 0, "parent": -9}
        lines = one_line(found.said).splitlines()
        if found.code not in (0, ends[one.how]):
            found.wrong.append(f"exit code {found.code}")
        if found.code in (130, 143) and not (lines and lines[-1].startswith("interrupted")):
            found.wrong.append("it does not say that it was interrupted")
        # a batch has a line for each file that was done before, and warnings of those files
        of_files = [line for line in lines[:-1] if one.batch and (line.startswith("PASSED") or "warning: " in line)]
        of_files += [line for line in lines[:-1] if one.batch and line.startswith(("warning   CS", f"{FILES} files: "))]
        if found.code in (130, 143) and len(lines) != len(of_files) + 1:
            found.wrong.append("not one line")
        if "Traceback" in found.said or "Error" in found.said or "Exception" in found.said:
            found.wrong.append("Python is showing")
        if found.code == 3 and sum("error:" in line for line in lines if not line.startswith("error ")) != 1:
            found.wrong.append("not one line of error")
        for path in (*out.iterdir(), *scratch.iterdir()):
            if path.name == ".cornersmooth":
                continue
            if path.parent == scratch or path.suffix != ".nc":
                found.wrong.append(f"left: {path.name}")
            elif path.read_bytes() not in (OLD if one.old else b"", self.whole[path.name]):
                found.wrong.append(f"half written: {path.name}")


def _send(process: subprocess.Popen[bytes], how: str) -> None:
    if how == "kill":
        if children := [pid for pid in members(process.pid) if pid != process.pid]:
            os.kill(random.choice(children), signal.SIGKILL)
    elif how == "parent":
        process.kill()
    elif how in ("group", "nohup"):
        os.killpg(process.pid, signal.SIGINT)
    else:
        process.send_signal(signal.SIGTERM if how == "term" else signal.SIGINT)


def members(session: int) -> list[int]:
    """Processes of a session that are not yet dead."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                state, _, _, own = (entry / "stat").read_text().rpartition(")")[2].split()[:4]
            except OSError:
                continue
            if int(own) == session and state not in "ZX":
                found.append(int(entry.name))
    return found


def tries(number: int, seed: int) -> list[Try]:
    """Interruptions of all kinds at random moments."""
    chance = random.Random(seed)
    kinds = [(batch, how) for batch in (False, True) for how in HOW]
    return [Try(*kinds[k % len(kinds)], chance.uniform(0.02, 1.0), chance.random() < 0.5) for k in range(number)]


def main(number: int, seed: int) -> int:
    """Interrupt, count, and say what was wrong."""
    counts: Counter[str] = Counter()
    wrong = 0
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(Path(folder))
        for one in tries(number, seed):
            found = bench.interrupt(one)
            counts[f"{'batch' if one.batch else 'single'}, {one.how}: {found.word}"] += 1
            if found.wrong:
                wrong += 1
                print(one, found.code, found.wrong, found.said, sep="\n  ")
    for name, count in sorted(counts.items()):
        print(f"{count:5} {name}")
    print(f"{number} interruptions, {wrong} of them wrong")
    return min(wrong, 1)


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    sys.exit(main(*given, *(100, 1)[len(given) :]))
