"""Does verification judge as an independent reader does? Random programs and files, by hand.

``python -m verify.sweep [--seeds FIRST LAST] [--only CASE] [--method NAME] [--programmed] [--eps MM]... [FILE]...``
prints a line for every text that is refused although the oracle finds it right, for every text that passes although it
does not, and for every failure; exit code 1 for any. At the end it says how often each came, and how often what was
drawn. The oracle measures tip and axis point of plain motion: what is written for programs with holes, with a tolerance
of the tool axis, and in curves of whole runs must pass.
"""

from __future__ import annotations

import argparse
import io
import sys
import time
import traceback
import warnings
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np

from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError
from cornersmooth.feedrate import Limits
from cornersmooth.model import Move, Program
from cornersmooth.nc import Form, Frame, fit_settings
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import CHOSEN, Case
from nc.grammars import reader
from nc.promise import runs_of
from oracle.distance import within
from oracle.motion import Original
from verify.random_programs import Trial, trial

#: what verification may find beyond ε and the oracle not, and the other way round: its own arithmetic, in ε
HAIR = 2e-3

#: digits behind the point, where a form has no others
DIGITS = 4

#: how much finer a text is read where few samples do not show that it keeps ε
FINER = 50.0

#: axis lengths that files are tried with
LENGTHS = (10.0, 50.0)


def texts(
    program: Program, form: Form, settings: Settings, *, planned: bool = False, native: bool = False
) -> tuple[bytes, Settings]:
    """NC text of a program, and the settings with the digits of the control in them."""
    frame = Frame(cycles="native" if native else "moves", skip_cycles=True)
    fitted = fit_settings(settings, form, program.units)
    stream = io.BytesIO()
    limits = Limits() if planned else None
    postprocess(program, stream, settings, form=form, frame=frame, plan_feeds=limits, verify=False)
    return stream.getvalue(), fitted


def keeps(case: Case, program: Program, text: bytes, settings: Settings, allowed: float, digits: str = "") -> bool:
    """Whether the oracle finds the text within `allowed` ε of the CL path: by few samples of it, or by many.

    An axis point runs off the chords of its samples where the tool turns.
    """
    limit = allowed * settings.tolerance
    given = reader(case.control, case.form, case.machine, case.tcp, program.units, digits)
    originals = runs_of(program, settings.tolerance)
    step = program.mm_per_unit * 10.0 ** -int(digits or DIGITS)
    for finer in (1.0, FINER):
        found = given.read(text.decode("ascii"), settings.axis_length, settings.tolerance / finer)
        paths = found.runs(settings.axis_length)
        if len(paths) < len(originals):  # there is nothing to write of what the digits do not show
            originals = [run for run in originals if not stands_still(run, settings.axis_length, step)]
        assert len(paths) == len(originals), f"{len(paths)} runs written for {len(originals)}"
        if all(
            within(path, original, settings.axis_length, limit) for path, original in zip(paths, originals, strict=True)
        ):
            return True
    return False


def stands_still(run: Original, axis_length: float, step: float) -> bool:
    """Whether a run leads nowhere in numbers of so many mm a step."""
    tip, point = run.at(np.arange(len(run), dtype=float), axis_length)
    return max(float(np.ptp(end, axis=0).max()) for end in (tip, point)) < step


def judged(one: Trial, program: Program, *, oracle: bool = True) -> tuple[str, str]:
    """Outcome of one text: a word, and what is to be said of it; without `oracle` it must pass."""
    case, settings, digits = one.case, one.settings, one.digits
    form = case.choose(endless=True)
    if digits:
        form = replace(form, table=form.table.with_digits(digits))
    try:
        text, fitted = texts(program, form, settings, planned=one.planned, native=one.native)
    except CornersmoothError as refusal:
        return f"refused {refusal.code}", str(refusal)
    try:
        found = verify(
            program,
            text,
            tolerance=fitted.tolerance,
            axis_length=settings.axis_length,
            axis_tolerance=fitted.axis_tolerance,
            control=case.control,
            machine=form.machine,
            tcp=case.tcp,
            skip_cycles=True,
            slower=one.planned,
        )
        problems = [f"{problem.nc_line}: {problem.code} {problem.text}" for problem in found.problems]
    except CornersmoothError as refusal:
        problems = [str(refusal)]
    oracle = oracle and not has_holes(program) and settings.axis_tolerance is None
    oracle = oracle and not (settings.method == "global" and form.curves)  # it reads curves of one corner only
    if problems:
        wrong = oracle and not keeps(case, program, text, settings, 1.0 - HAIR, digits)
        return ("WRONG PROGRAM" if wrong else "FALSE ALARM"), " | ".join(problems[:3])
    if oracle and not keeps(case, program, text, settings, 1.0 + HAIR, digits):
        return "MISSED", "beyond the tolerance"
    return "passed", ""


def with_method(one: Trial, method: str) -> Trial:
    """The trial by another method of smoothing; as it is where that has another idea of its options."""
    return replace(one, settings=one.settings.but(method=method))


def drawn(one: Trial) -> list[str]:
    """What of a trial is counted."""
    s = one.settings
    said = [
        f"method {s.method}",
        *([f"{s.lines} lines"] if s.lines else []),
        *(f"part {part}" for part in set(one.parts)),
    ]
    said += [f"digits {one.digits}"] if one.digits else []
    said += ["planned feeds"] if one.planned else []
    said += ["native cycles"] if one.native and "holes" in one.parts else []
    return said + (["axis tolerance"] if s.axis_tolerance is not None else [])


def has_holes(program: Program) -> bool:
    """Whether what is cut is more than the CL file's own moves."""
    return bool((program.kind == Move.HOLE).any())


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("files", nargs="*", type=Path)
    parser.add_argument("--seeds", type=int, nargs=2, default=(0, 0))
    parser.add_argument("--only", default="", help="cases whose name holds this")
    parser.add_argument("--programmed", action="store_true", help="no planned feeds")
    parser.add_argument("--method", default="", help="for all programs that a form can write with it")
    parser.add_argument("--eps", type=float, action="append", help="for files; may be repeated")
    parser.add_argument("--keep", type=Path, help="folder for the CL files of what goes wrong")
    given = parser.parse_args()
    warnings.simplefilter("error")
    count: Counter[str] = Counter()
    of: Counter[str] = Counter()
    begin = time.process_time()

    def take(name: str, one: Trial, data: bytes, *, oracle: bool = True) -> None:
        try:
            outcome, said = judged(one, read(data, name="trial.cls"), oracle=oracle)
        except Exception as failure:
            where = traceback.extract_tb(failure.__traceback__)[-1]
            outcome, said = "FAILED", f"{type(failure).__name__}: {failure} ({where.filename}:{where.lineno})"
        count[outcome] += 1
        if outcome.isupper():
            print(f"{outcome} {name}: {said}", flush=True)
            if given.keep:
                given.keep.mkdir(exist_ok=True)
                (given.keep / f"{name.split(':')[0].replace(' ', '')}.cls").write_bytes(data)

    for seed in range(*given.seeds):
        one: Trial = trial(seed, only=given.only)
        if given.programmed:
            one = replace(one, planned=False)
        if given.method:
            one = with_method(one, given.method)
        of.update(drawn(one))
        take(str(one), one, one.cl.encode())
    cases = [case for case in CHOSEN if given.only in str(case)]
    for number, path in enumerate(given.files):
        data = path.read_bytes()
        try:
            read(data, name=path.name)
        except CornersmoothError as refusal:
            print(f"{path.name}: not a CL file: {refusal}")
            continue
        for eps in given.eps or (0.001, 0.04, 0.15):
            settings = Settings(tolerance=eps, axis_length=LENGTHS[number % len(LENGTHS)])
            for case in cases:
                take(f"{path.name} {case} eps {eps:g}", Trial(0, case, settings, "", ""), data, oracle=False)
    if of:
        print("drawn:", ", ".join(f"{what} {number}" for what, number in sorted(of.items())))
    print(f"{sum(count.values())} texts: {_told(count)}; {time.process_time() - begin:.0f} s")
    return 1 if any(name.isupper() for name in count) else 0


def _told(count: Counter[str]) -> str:
    """How many texts came to what, and why those were refused that were."""
    refused = {name: number for name, number in sorted(count.items()) if name.startswith("refused")}
    why = ", ".join(f"{name.removeprefix('refused ')} {number}" for name, number in refused.items())
    said = [f"passed {count['passed']}", f"refused by design {sum(refused.values())}" + (f" ({why})" if why else "")]
    said += [f"rightly found {count['rightly found']}", f"false alarms {count['FALSE ALARM']}"]
    said += [f"wrong programs {count['WRONG PROGRAM']}", f"passed beyond the tolerance {count['MISSED']}"]
    return ", ".join([*said, f"failures {count['FAILED']}"])


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    sys.exit(main())
