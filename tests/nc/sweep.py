"""Every control and form over random chains and over files: ``python -m nc.sweep [--seeds N] [FILE]...``, by hand.

Prints a line for every violation and a table of the worst deviations in shares of the tolerance; exit code 1 for any
violation. What the tests run is a part of this.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path

from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError
from cornersmooth.settings import Settings
from nc.cases import CHOSEN, RUNNABLE, Case
from nc.promise import random_verdict, runs_of, verdict, without_holes
from oracle.judge import Verdict

LIMITS = ((0.002, 10.0), (0.05, 50.0), (0.01, 10.0))
FILE_LIMITS = ((0.02, 20.0), (0.005, 50.0))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--seeds", type=int, default=0)
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--all", action="store_true", help="every control with every machine")
    parser.add_argument("--chains", type=int, default=24)
    given = parser.parse_args()
    cases = [case for case in (RUNNABLE if given.all else CHOSEN) if given.only in str(case)]
    worst: dict[str, float] = {}
    count: Counter[str] = Counter()

    def measure(what: str, case: Case, tolerance: float, judged: Callable[[], Verdict]) -> None:
        begin = time.process_time()
        try:
            share = judged().deviation.worst / tolerance
        except CornersmoothError as refusal:
            count[f"refused: {refusal.code}"] += 1
            return
        except Exception as failure:
            count["failed"] += 1
            print(f"{what} {case}: {type(failure).__name__}: {failure}", flush=True)
            return
        count["judged"] += 1
        worst[str(case)] = max(worst.get(str(case), 0.0), share)
        if share > 1.0:
            count["violations"] += 1
            print(f"{what} {case}: {share:.4f} of {tolerance} mm", flush=True)
        if (taken := time.process_time() - begin) > 60:
            print(f"{what} {case}: {taken:.0f} s", flush=True)

    for seed in range(given.seeds):
        for index, case in enumerate(cases):
            tolerance, axis_length = LIMITS[(index + seed) % len(LIMITS)]
            units = "inch" if seed % 4 == 3 else "mm"
            settings = Settings(tolerance=tolerance, axis_length=axis_length)
            judged = partial(random_verdict, case, settings, seed, given.chains, units)
            measure(f"seed {seed} {units}", case, tolerance, judged)
    for number, path in enumerate(given.files):
        try:
            program = without_holes(read(path.read_bytes(), name=path.name))
        except CornersmoothError as refusal:
            print(f"{path.name}: not usable: {refusal}")
            continue
        tolerance, axis_length = FILE_LIMITS[number % len(FILE_LIMITS)]
        originals = runs_of(program, tolerance)
        settings = Settings(tolerance=tolerance, axis_length=axis_length)
        begin = time.process_time()
        for case in cases if originals else []:
            form = case.choose(endless=True)
            measure(path.name, case, tolerance, partial(verdict, program, originals, case, form, settings))
        print(f"{path.name}: {len(program)} poses, {time.process_time() - begin:.0f} s", flush=True)
    for case in cases:
        print(f"{case!s:36} {worst.get(str(case), float('nan')):.4f}")
    print(dict(count))
    return 1 if count["violations"] or count["failed"] else 0


if __name__ == "__main__":
    sys.exit(main())
