"""Times a batch beside one another and on a cluster, then kills it at random moments and runs it again.

    python tests/batch_runs.py [FILES [KILLS [SEED]]]

The same files with -j 1, -j 2 and a Dask cluster of two processes of this machine: wall time, time per file, memory of
the largest process; the texts must be the same. Then each is killed at random (Ctrl-C, SIGTERM, SIGKILL of a worker, of
the command itself) and run again until it is done: no file may be lost, none half written, nothing may be left.
"""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from distributed import LocalCluster

from interruptions import cl_text

COMMAND = [str(Path(sys.executable).parent / "cornersmooth"), "smooth", "cl"]
#: how a run is killed; the last is for runs with processes of their own, which then clean up
HOW = (signal.SIGINT, signal.SIGTERM, "worker", signal.SIGKILL)


@dataclass(frozen=True)
class Way:
    """One way to run the batch."""

    name: str
    options: tuple[str, ...]
    cluster: LocalCluster | None = None

    def words(self, out: Path) -> list[str]:
        """Argument vector."""
        around = [word for word in self.options if word.startswith("CORNERSMOOTH_")]
        return ["env", *around, *COMMAND, "-d", str(out), *(word for word in self.options if word not in around)]

    def workers(self, process: subprocess.Popen[bytes]) -> list[int]:
        """Processes that do the files."""
        if self.cluster is not None:
            return [worker.pid for worker in self.cluster.workers.values() if worker.pid]
        listed = subprocess.run(["ps", "-o", "pid=", "--ppid", str(process.pid)], capture_output=True, check=False)
        return [int(word) for word in listed.stdout.split()]


def texts(folder: Path) -> dict[str, bytes]:
    """All finished files."""
    return {path.name: path.read_bytes() for path in folder.rglob("*.nc")}


def run_whole(way: Way, folder: Path, out: Path) -> dict[str, bytes]:
    """Run undisturbed, and say how long it takes."""
    begin, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(way.words(out), cwd=folder, capture_output=True, check=True)
    wall, after = time.monotonic() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
    found = texts(out)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(
        f"{way.name:<8} {wall:8.1f} s wall {cpu:8.1f} s CPU of the command {1000 * wall / len(found):7.0f} ms a file  "
        f"{done.stderr.decode().splitlines()[-1]}",
        flush=True,
    )
    return found


def run_killed(way: Way, folder: Path, out: Path, whole: dict[str, bytes], seconds: float, kills: int) -> list[str]:
    """Kill the run again and again, then let it end; what was wrong."""
    wrong, ends, again = [], Counter[str](), 0
    for _ in range(kills):
        how = random.choice(HOW[:2] if way.name == "-j 1" else HOW)
        process = subprocess.Popen(way.words(out), cwd=folder, stderr=subprocess.PIPE)
        time.sleep(random.uniform(0.5, max(1.0, 1.5 * seconds / kills)))
        if how == "worker":
            for pid in random.sample(found := way.workers(process), min(1, len(found))):
                os.kill(pid, signal.SIGKILL)
            time.sleep(random.uniform(0.2, 2.0))
            process.send_signal(signal.SIGTERM)
        else:
            process.send_signal(how)
        process.communicate()
        ends[str(getattr(how, "name", how))] += 1
        time.sleep(1.0)  # workers of a cluster end the file that they are at
        wrong += [f"half written: {name}" for name, text in texts(out).items() if text != whole[name]]
    for _ in range(3):  # a worker that was killed gives its file up
        again += 1
        done = subprocess.run(way.words(out), cwd=folder, capture_output=True, check=False)
        if done.returncode == 0:
            break
        print(way.name, done.returncode, [line for line in done.stderr.decode().splitlines() if "error" in line])
    wrong += [f"lost: {name}" for name in whole.keys() - texts(out).keys()]
    wrong += [
        f"left: {path.name}"
        for path in out.rglob("*")
        if path.is_file() and path.suffix != ".nc" and path.parent.name != ".cornersmooth"
    ]
    wrong += [f"half written: {name}" for name, text in texts(out).items() if text != whole[name]]
    told = ", ".join(f"{count} {how}" for how, count in ends.items())
    print(f"{way.name:<8} killed {kills} times ({told}), run again {again} times: {len(wrong)} wrong", flush=True)
    return wrong


def main(files: int, kills: int, seed: int) -> int:
    """Run and kill in all three ways."""
    random.seed(seed)
    with (
        tempfile.TemporaryDirectory() as name,
        LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=50) as cluster,
    ):
        folder = Path(name)
        (folder / "cl").mkdir()
        for number in range(files):
            (folder / "cl" / f"part{number}.cls").write_text(cl_text(random.randint(200, 800), number))
        ways = [
            Way("-j 1", ("-j", "1")),
            Way("-j 2", ("-j", "2")),
            Way("cluster", (f"CORNERSMOOTH_SCHEDULER={cluster.scheduler_address}",), cluster),
        ]
        whole: dict[str, bytes] = {}
        wrong, seconds = [], {}
        for way in ways:
            begin = time.monotonic()
            found = run_whole(way, folder, folder / f"whole{way.name}")
            seconds[way.name] = time.monotonic() - begin
            whole = whole or found
            if found != whole or len(found) != files:
                wrong.append(f"{way.name} makes other texts")
        for way in ways:
            out = folder / f"killed{way.name}"
            wrong += run_killed(way, folder, out, whole, seconds[way.name], kills)
    print(*wrong, sep="\n")
    return min(len(wrong), 1)


if __name__ == "__main__":
    given = [int(word) for word in sys.argv[1:]]
    sys.exit(main(*given, *(200, 8, 1)[len(given) :]))
