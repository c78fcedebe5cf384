"""Mutate CL and point files and read them: each is a valid program or an error with its place, and nothing else.

    python fuzz/fuzz_cl.py --seconds 300 --seed 1

Seeds are the hand-written files of the tests, the heads of the samples, and the files of any folder given by --corpus.
A failure prints the input as a Python literal, and how to repeat it.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import patch

import numpy as np

from cornersmooth.cl import DIALECTS, bulk, read
from cornersmooth.cl.apt import read_apt
from cornersmooth.cl.source import clean
from cornersmooth.errors import CornersmoothError, SettingsError
from cornersmooth.model import Move, Program

ROOT = Path(__file__).resolve().parent.parent

#: bytes of a seed at most: short inputs find more in the same time
LONGEST = 1500

#: an input may take this long, seconds
SLOWEST = 2.0

#: bytes of result for every byte of input; a control point of NURBS alone may become a thousand lines
LARGEST_SHARE = 20_000
LARGEST_BASE = 100_000

#: errors about the whole file have no line
WITHOUT_LINE = {"CS101", "CS102", "CS103", "CS150", "CS161"}

STATEMENTS = (
    """
GOTO/1.0000,2.0000,3.0000|GOTO/1.0,2.0,3.0,0.0000000,0.6000000,0.8000000|GOTO  /   10.00000,   20.00000,   30.00000
GOTO / 1.0, 2.0, 3.0,  $|0.0, 0.6, 0.8|1.,2.,3.|FROM/0,0,50,0,0,1|GODLTA/1,2,3|GODLTA/5|GOHOME/0,0,9|RAPID|RAPID/ON
FEDRAT/MMPM,250.0|FEDRAT/ 300.0,MMPM|FEDRAT/10,IPR|UNITS/MM|UNITS / INCHES|MULTAX|MULTAX/OFF|TLAXIS/0,0,1|CYCLE/DRILL,3.
CYCLE/OFF|CUTCOM/LEFT|CUTCOM/OFF|CIRCLE/0.,0.,0.,0.,0.,1.,1.|CIRCLE/0,0,0,0,0,1|TOOL PATH/A,TOOL,B|FINI|END|PAINT/PATH
CIRCLE/0.0,0.0,0.0,0.0,0.0,-1.0,1.0,0.06,0.5,10.0,0.0,TIMES,2|MOVARC/0, 0, 0, 0, 0, 1, 1, ANGLE, 90|PPRINT a $|$$ note
INDIRV/0.,0.,1.|TLON,GOFWD/(CIRCLE/25.,0.,-30.,4.6),ON,2,INTOF,(LINE/25.,0.,-30.,25.,0.,-25.4)|NURBS/|KNOT/.5,1.
CNTRL/1,0,0|HELICAL/0,0,0,0,1,0,0,0,1,2.,10.,0,10,.5|SYN/'A','B'|TRANS/0,0,0|CSYS/1,0,0,0,0,1,0,0,0,0,1,0|MSYS/0,0,0,1,0,0,0,1,0
SPINDL/RPM,$|LOADTL/1;STOP|x,y,z,i,j,k|1.0 2.0 3.0 0 0 1|xa;ya;za;xb;yb;zb|$$-> CSYS / 1.0, $|PSIS/(PLANE/0,0,1,0)
""".strip()
    .replace("\n", "|")
    .split("|")
)

FRAGMENTS = (
    *(bytes([letter]) for letter in b"$;/,\n\r \t'()-+.\0\xe9\xff\x1a"),
    *(
        b"$$",
        b"NaN",
        b"inf",
        b"1e999",
        b"-0",
        b"9" * 30,
        b"1E-320",
        b"1d5",
        b"0x1",
        b"\xc3\xa9",
        b"\x1f\x8b",
        b"\xff\xfe",
    ),
)


def seeds(corpus: list[Path]) -> list[bytes]:
    """Return all seeds: hand-written files, heads of samples and of the corpus, and programs of single statements."""
    files = [*sorted((ROOT / "tests" / "bad").glob("*.cls")), *sorted((ROOT / "samples").glob("*.*"))]
    for folder in corpus:
        files += [path for path in sorted(folder.iterdir()) if path.is_file() and path.suffix != ".md"]
    found = [path.read_bytes()[:LONGEST] for path in files]
    return [*found, *(("\n".join(STATEMENTS[i : i + 8]) + "\n").encode() for i in range(len(STATEMENTS)))]


def mutate(data: bytes, pool: list[bytes], rng: random.Random) -> bytes:
    """Return the data, or statements put together at random, with up to six changes."""
    if rng.random() < 0.4:
        data = ("GOTO/0.,1.,0.\n" + "\n".join(rng.choices(STATEMENTS, k=rng.randint(1, 12))) + "\n").encode()
        if rng.random() < 0.5:
            return data
    for _ in range(rng.randint(1, 6)):
        data = _change(data, pool, rng)
    return data


def _change(data: bytes, pool: list[bytes], rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    to = min(len(data), at + int(rng.expovariate(0.05)))
    form = rng.randrange(9)
    if form == 0:
        return data[:at] + rng.choice(FRAGMENTS) + data[at:]
    if form == 1:
        return data[:at] + data[to:]
    if form == 2:
        return data[:to] + data[at:to] * rng.randint(1, 3) + data[to:]
    if form == 3 and at < len(data):
        return data[:at] + bytes([data[at] ^ 1 << rng.randrange(8)]) + data[at + 1 :]
    if form == 4:
        other = rng.choice(pool)
        cut = rng.randrange(len(other) + 1)
        return (data[:at] + other[cut:])[: 2 * LONGEST]
    lines = data.split(b"\n")
    row = rng.randrange(len(lines))
    if form == 5:
        lines.insert(row, rng.choice(STATEMENTS).encode())
    elif form == 6:
        del lines[row]
    elif form == 7:
        other_row = rng.randrange(len(lines))
        lines[row], lines[other_row] = lines[other_row], lines[row]
    else:
        numbers = lines[row].split(b",")
        numbers[rng.randrange(len(numbers))] = rng.choice(
            (b"0", b"1e9", b"-1e-9", b"", b"1.0000001", b"1E308", b"5", b"-1.")
        )
        lines[row] = b",".join(numbers)
    return b"\n".join(lines)


def check_program(program: Program, size: int) -> None:
    """Assert what every program promises."""
    n = len(program)
    assert n > 0
    assert np.isfinite(program.tip).all()
    assert np.isfinite(program.axis).all()
    assert np.allclose(np.linalg.norm(program.axis, axis=1), 1, rtol=0, atol=1e-12)
    assert (program.kind <= max(Move)).all()
    assert not (program.feed <= 0).any()
    assert not np.isinf(program.feed).any()
    assert (np.diff(program.line) >= 0).all()
    assert program.line[0] >= 1
    places = [(statement.pose, statement.line) for statement in program.statements]
    assert places == sorted(places)
    assert all(0 <= pose <= n for pose, _ in places)
    arcs = program.arcs
    assert (np.diff(arcs.pose) > 0).all()
    assert (program.kind[arcs.pose] == Move.ARC).all()
    assert len(arcs) == np.count_nonzero(program.kind == Move.ARC)
    assert (arcs.sweep > 0).all()
    assert np.isfinite(arcs.centre).all()
    assert np.allclose(np.linalg.norm(arcs.normal, axis=1), 1, rtol=0, atol=1e-12)
    assert (arcs.pose > 0).all()
    assert program.chains.shape[1] == 2
    text = sum(len(statement.text) + sum(len(str(arg)) for arg in statement.args) for statement in program.statements)
    assert n * 90 + len(program.statements) * 300 + text <= LARGEST_SHARE * size + LARGEST_BASE


def check_error(error: CornersmoothError, data: bytes) -> None:
    """Assert that an error about the contents says where."""
    assert not isinstance(error, SettingsError)
    if error.line is None:
        assert error.code in WITHOUT_LINE, f"no line: {error}"
    elif not data.startswith(b"\x1f\x8b"):
        assert 1 <= error.line <= 1 + data.count(b"\n") + data.count(b"\r"), f"no such line: {error}"


def run_one(data: bytes, options: dict[str, object], *, compare: bool) -> str:
    """Read one input; return what came of it.

    Raises
    ------
    AssertionError
        For a program or an error that breaks a promise; any other exception is a defect as well.
    """
    begin = time.perf_counter()
    program, refusal = None, None
    try:
        program = read(data, name="fuzz", **options)  # type: ignore[arg-type]
    except CornersmoothError as error:
        refusal = error
    if program is not None:
        check_program(program, len(data))
        outcome = program.source.format
    else:
        assert refusal is not None
        check_error(refusal, data)
        outcome = refusal.code
    assert time.perf_counter() - begin < SLOWEST, "too slow"
    if compare and outcome != "points" and not outcome.startswith(("CS15", "CS16")):
        assert _apt(data, fast=True) == _apt(data, fast=False)
    return outcome


def _apt(data: bytes, *, fast: bool) -> object:
    find_plain = bulk.find_plain if fast else lambda text: None
    try:
        with patch.object(bulk, "find_plain", find_plain):
            program = read_apt(clean(data, "fuzz"), name="fuzz")
    except CornersmoothError as error:
        return str(error)
    arrays = (program.tip, program.axis, program.kind, program.feed, program.line, program.keep, program.arcs.sweep)
    return [array.tobytes() for array in arrays], program.statements, program.findings


def inputs(runs: int, seed: int, corpus: list[Path]) -> Iterator[tuple[int, bytes, dict[str, object], bool]]:
    """Yield number, contents, options of `read` and whether to compare both readers; the same ones for a seed."""
    rng = random.Random(seed)
    pool = seeds(corpus)
    for run in range(runs):
        data = mutate(rng.choice(pool), pool, rng)
        options: dict[str, object] = {"lenient": rng.random() < 0.3}
        if rng.random() < 0.2:
            options["dialect"] = rng.choice(DIALECTS)
        if rng.random() < 0.1:
            options["arc_rule"] = rng.choice(("left", "right", "tangent"))
        yield run, data, options, rng.random() < 0.2


def fuzz(
    runs: int, seed: int, corpus: list[Path] | None = None, *, seconds: float = math.inf, progress: bool = False
) -> Counter[str]:
    """Read so many mutated inputs, for so many seconds at most; return how often each outcome came."""
    outcomes: Counter[str] = Counter()
    begin = time.perf_counter()
    for run, data, options, compare in inputs(runs, seed, corpus or []):
        if time.perf_counter() - begin >= seconds:
            break
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                outcomes[run_one(data, options, compare=compare)] += 1
        except Exception:
            print(f"--seed {seed}, run {run}: read({data!r}, **{options})", file=sys.stderr)
            raise
        if progress and run % 10_000 == 9_999:
            print(f"{run + 1} inputs, {time.perf_counter() - begin:.0f} s", file=sys.stderr)
    return outcomes


def main() -> None:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", type=int, default=sys.maxsize)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--corpus", type=Path, action="append", default=[], help="folder of more seeds")
    arguments = parser.parse_args()
    outcomes = fuzz(arguments.runs, arguments.seed, arguments.corpus, seconds=arguments.seconds, progress=True)
    for outcome, count in outcomes.most_common():
        print(f"{count:9d} {outcome}")


if __name__ == "__main__":
    main()
