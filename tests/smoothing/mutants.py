# ruff: noqa: E501
"""Faults of the paper's method that `test_paper_equations` must find: ``python -m smoothing.mutants [NUMBER ...]``.

Each is one or two changed places of the source. A copy of the package gets them, and the tests are run on it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

import cornersmooth

PACKAGE = Path(cornersmooth.__file__).parent
TESTS = Path(__file__).parents[1]
PAPER, ROOTS, CURVES = "smoothing/zhang2016.py", "smoothing/synchronise.py", "geometry/nurbs.py"


class Mutant(NamedTuple):
    """A fault."""

    what: str
    file: str
    changes: tuple[tuple[str, str], ...]
    tests: str  # those that are run on it, as pytest's -k takes them


# fmt: off
MUTANTS = (
    Mutant('(20)-(22): v = u', ROOTS, (('    return v.T, missing.T\n', '    return 0.0 * v.T + u, missing.T\n'),), '20 or 22'),
    Mutant('(26): the joint has the axis of v(1)', PAPER, (('        tops[:, -1] = axis_curve[:, -1]', '        tops[:, -1] = tops[:, -1]'),), '26'),
    Mutant('(27): linear in place of the great circle', PAPER, (('turned = np.sin((1.0 - share) * angle) * one + np.sin(share * angle) * other', 'turned = (1.0 - share) * one + share * other'),), '24'),
    Mutant('(21): the grid alone', ROOTS, (('_NEAR, _NEAR_STEPS, _SHORT = 1.0 / 16.0, 4, 1e-7', '_NEAR, _NEAR_STEPS, _SHORT = -1.0, 4, 1e-7'), ('found = _zero(ends, start, wanted)', 'found = np.clip(start, *ends)'),), '20'),
    Mutant('(4): another basis', CURVES, (('[-4, 7, -4, 1, 0]', '[-4, 7, -4, 0.8, 0]'),), '3_and_4'),
    Mutant('(9): second control point', CURVES, (('points[:, 1] -= RATIO', 'points[:, 1] -= 0.6'),), '5_to_9'),
    Mutant('(10): error', PAPER, (('factor = 2.0 * nurbs', 'factor = 1.9 * nurbs'),), '10'),
    Mutant('(14): more than half of a segment', PAPER, (('halves = sizes.min(axis=2) / 2.0', 'halves = sizes.min(axis=2) / 1.8'),), '11 or 13'),
    Mutant('(15), (16): the larger of both lengths', PAPER, (('factor * sines).min(axis=1)', 'factor * sines).max(axis=1)'),), '11'),
    Mutant('(16): 1.1 of the tolerance', PAPER, (('np.array((settings.common_tolerance,', 'np.array((1.1 * settings.common_tolerance,'),), '11'),
    Mutant('(19): sine of the whole turn', PAPER, (('unit(segments[:, :, 0])) / 2.0', 'unit(segments[:, :, 0]))'),), '11'),
    Mutant('v runs backwards', ROOTS, (('np.maximum(last, low), np.clip(', 'np.maximum(0.0 * last, low), np.clip('),), '20'),
    Mutant('the root nearest to the last one', ROOTS, (('np.clip(last + step,', 'np.clip(last + 0.0 * step,'),), '20'),
    Mutant('v in another knot interval', ROOTS, (('float(half.second) / 2.0, (1.0 + half.second) / 2.0', '0.0, 1.0'),), '20'),
    Mutant('without a root, any v', ROOTS, (('sign * slope), np.where(root', '0.0 * slope - 1.0), np.where(root'),), '20'),
    Mutant('(22): the tip at v, too', PAPER, (('tips = nurbs.evaluate(tip_curve[which], u[:, None])', 'tips = nurbs.evaluate(tip_curve[which], at[:, None])'),), '22'),
    Mutant('(24): shares of the whole segment', PAPER, (('fraction: Floats = low + share * (high - low)', 'fraction: Floats = share * high'),), '24'),
    Mutant('(26): ends of the whole segment', PAPER, (('(high, segments.axis_exit[pose, None])', '(high, 1.0 + 0.0 * high)'),), '24'),
    Mutant('least residual in place of the largest', PAPER, (('most, report = residual.max(axis=1)', 'most, report = residual.min(axis=1)'),), '23'),
    Mutant('the motion is not measured', PAPER, (('over = share > 1.0 + EXACT', 'over = share > 1e9'),), 'keeps_the_tolerance'),
    Mutant('0.99 of the size in place of what just keeps ε', PAPER, (('keeping = (1.0 - _JUST) / share', 'keeping = 0.97 * (1.0 - _JUST) / share'),), 'eq_16 or construction'),
    Mutant('the rest of segments is not looked at', PAPER, (('found.append(part[share.max(axis=1) > 1.0])', 'found.append(part[:0])'),), 'left_of'),
)
# fmt: on


def mutated(mutant: Mutant) -> str:
    """Source of the module with the fault; ValueError where a place is not there once."""
    source = (PACKAGE / mutant.file).read_text()
    for old, new in mutant.changes:
        if source.count(old) != 1:
            raise ValueError(f"{mutant.what}: {source.count(old)} times in {mutant.file}: {old!r}")
        source = source.replace(old, new)
    return source


def falls(mutant: Mutant) -> bool:
    """Whether the tests find the fault."""
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "cornersmooth"
        shutil.copytree(PACKAGE, copy, ignore=shutil.ignore_patterns("__pycache__"))
        (copy / mutant.file).write_text(mutated(mutant))
        paths = os.pathsep.join((folder, str(TESTS)))
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-x",
            "-k",
            f"({mutant.tests}) and not mutants",
            "-p",
            "no:cacheprovider",
            "smoothing/test_paper_equations.py",
        ]
        done = subprocess.run(
            command, cwd=TESTS, env={**os.environ, "PYTHONPATH": paths}, capture_output=True, text=True, check=False
        )
        return done.returncode == 1


def main() -> int:
    """Run those that are named by their numbers, or all; the exit code is the number of those that live."""
    numbers = [int(word) for word in sys.argv[1:]] or range(len(MUTANTS))
    living = 0
    for number in numbers:
        fell = falls(MUTANTS[number])
        living += not fell
        print(f"{number:2d} {'falls' if fell else 'LIVES'}  {MUTANTS[number].what}", flush=True)
    return living


if __name__ == "__main__":
    sys.exit(main())
