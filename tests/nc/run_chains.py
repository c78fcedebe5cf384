"""Curves of whole runs of random chains, judged twice: ``python -m nc.run_chains FIRST LAST [--chains N]``, by hand.

Each number from FIRST to before LAST is a program of N chains of every character in one of twelve forms, by one of five
tolerances and three distances H. `verify` judges its text, and so does a reader of its own: scipy's splines for curves
with second points, the strict grammars for all other forms. Prints a line for every text that one of them refuses, and
in the end how many chains there were in each form; exit code 1 for any.
"""

from __future__ import annotations

import argparse
import io
import sys
import time
from collections import Counter

import numpy as np

import cornersmooth
from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError
from cornersmooth.settings import Settings
from nc.cases import MACHINES, Case
from nc.curve_texts import PARTS, H, dense, farthest, original, polynomials, stretches
from nc.grammars import reader
from nc.promise import tame, upright
from oracle.chains import Chain, cl_text, random_chains
from oracle.judge import judge
from oracle.motion import unit

TOLERANCES = (0.001, 0.003, 0.01, 0.04, 0.15)
LENGTHS = (H, 50.0, 2.0)
CORNERS = (4, 8, 12)
TURNING = "a machine"
CASES = (
    Case("fanuc", "g1"),
    Case("siemens", "bspline"),
    Case("fanuc", "g6.2"),
    Case("siemens", "poly"),
    Case("heidenhain", "spl"),
    Case("heidenhain", "g1"),
    Case("fanuc", "g1", TURNING),
    Case("siemens", "g1"),
    Case("mitsubishi", "g6.2"),
)
#: forms with second points in curves, which the reader of `curve_texts` measures
SECOND_POINTS = (CASES[1], CASES[2], CASES[3])


def case_of(number: int) -> Case:
    """Form of a number; the machines come in turn."""
    case = CASES[number % len(CASES)]
    if case.machine:
        return Case(case.control, case.form, MACHINES[number // len(CASES) % len(MACHINES)])
    return case


def faults(number: int, count: int) -> tuple[int, list[str]]:
    """How many chains the program of a number has, and what is wrong with its text."""
    case, tolerance = case_of(number), TOLERANCES[number % len(TOLERANCES)]
    length = H if case in SECOND_POINTS else LENGTHS[number // len(TOLERANCES) % len(LENGTHS)]
    form, settings = case.choose(), Settings(method="global", tolerance=tolerance, axis_length=length)
    chains = [
        upright(chain) if form.orientation == "fixed" else tame(chain, case.machine)
        for chain in random_chains(9000 + number, count, corners=CORNERS[number % len(CORNERS)])
    ]
    chains = [chain for chain in chains if np.ptp(chain.tip, axis=0).any()]
    program, target = read(cl_text(chains)[0], name="chains.cls"), io.BytesIO()
    result = cornersmooth.postprocess(program, target, settings, form=form)
    assert result.verification is not None
    found = [f"verify: {problem.code} {problem.text}" for problem in result.verification.problems]
    text = target.getvalue().decode("ascii")
    if case in SECOND_POINTS:
        found += _beyond(text, case, chains, tolerance)
    else:
        strict = reader(case.control, case.form, case.machine, case.tcp, program.units).read(text, length, tolerance)
        worst = judge(strict.runs(length), [chain.original for chain in chains], length, tolerance).deviation.worst
        found += [f"strict reader: {worst:.5f} mm"] if worst > tolerance else []
    return len(chains), [f"{number} {case} {tolerance} mm, H {length:g} mm: {what}" for what in found]


def _beyond(text: str, case: Case, chains: list[Chain], tolerance: float) -> list[str]:
    """Chains whose curves leave the tolerance, measured densely."""
    runs = polynomials(text) if case.form == "poly" else stretches(text, case.control)
    if len(runs) != len(chains):
        return [f"{len(runs)} runs are {len(chains)} chains"]
    found = []
    for run, chain in zip(runs, chains, strict=True):
        turn = np.linalg.norm(np.diff(unit(chain.axis), axis=0), axis=1).max()
        slack = H * (2.0 * turn / PARTS) ** 2 / 8  # of the sampled original
        places = [dense(stretch) for stretch in run]
        tip = farthest(np.concatenate([tips for tips, _ in places]), chain.tip)
        top = farthest(np.concatenate([tops for _, tops in places]), original(chain))
        if tip > tolerance or top > tolerance + slack:
            found.append(f"curves: tip {tip:.5f} mm, axis point {top:.5f} mm")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--chains", type=int, default=8)
    given = parser.parse_args()
    count: Counter[str] = Counter()
    begin = time.process_time()
    for number in range(given.first, given.last):
        case = CASES[number % len(CASES)]
        name = f"{case.control} {case.form}{' in rotary words' if case.machine else ''}"
        try:
            chains, wrong = faults(number, given.chains)
        except CornersmoothError as refusal:
            chains, wrong = 0, []
            count[f"refused: {refusal.code}"] += 1
            print(f"{number} {case_of(number)}: {refusal}", flush=True)
        except Exception as failure:
            chains, wrong = 0, [f"{number} {case_of(number)}: {type(failure).__name__}: {failure}"]
        for line in wrong:
            print(line, flush=True)
        count[name] += chains
        count["chains"] += chains
        count["wrong"] += len(wrong)
    print(dict(count), f"{time.process_time() - begin:.0f} s")
    return 1 if count["wrong"] else 0


if __name__ == "__main__":
    sys.exit(main())
