"""Texts with wrong holes, for every control, form and machine; run this for all of them.

``python -m verify.hole_mutations`` in the folder of the tests judges every mutant and prints the score by class.
"""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

from cornersmooth.cl import read
from cornersmooth.errors import InputError
from cornersmooth.model import Program
from cornersmooth.nc import fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.cases import RUNNABLE, Case

EPS, H = 0.01, 20.0

#: a tilted tool where the form can turn it: two cycles, two tools, a cut before and behind
CL = """UNITS/MM
LOADTL/1
SPINDL/2000,RPM,CLW
RAPID
GOTO/{start},{axis}
FEDRAT/MMPM,300
GOTO/0,0,0,{axis}
GOTO/9,1,0,{axis}
GOTO/18,0,0,{axis}
RAPID
GOTO/{over},{axis}
CYCLE/DRILL,FEDTO,12,MMPM,150,RAPTO,3,RTRCTO,20
GOTO/20,5,1,{axis}
GOTO/31,7,1,{axis}
GOTO/28,18,1,{axis}
CYCLE/OFF
LOADTL/2
SPINDL/900,RPM,CLW
RAPID
GOTO/{over},{axis}
CYCLE/DEEP,FEDTO,25,STEP,10,MMPM,90,RAPTO,3,RTRCTO,20,DWELL,0.5
GOTO/20,5,1,{axis}
GOTO/31,7,1,{axis}
CYCLE/OFF
RAPID
GOTO/{over},{axis}
SPINDL/OFF
FINI
"""


@dataclass(frozen=True)
class Mutant:
    """A wrong text: its class, its lines, and the lines (from 1) of which a problem must name one; None if harmless."""

    kind: str
    lines: list[str]
    where: tuple[int, int] | None


def upright(case: Case) -> bool:
    """Whether the tool stays upright in the holes."""
    return case.choose().orientation == "fixed"


@cache
def program_of(case: Case) -> Program:
    """The CL program for a case."""
    axis = np.array([0.0, 0, 1]) if upright(case) else np.array([0.0, 0.28, 0.96])
    said = {
        "axis": ",".join(f"{value:.7f}" for value in axis),
        "start": ",".join(f"{value:.4f}" for value in 40 * axis),
        "over": ",".join(f"{value:.4f}" for value in np.array([20.0, 5, 1]) + 20 * axis),
    }
    text = CL.format(**said)
    if case.choose().orientation == "machine":  # one length of tool goes into every position
        text = text.replace("LOADTL/2\n", "")
    return read(text.encode(), name="holes.cls")


@cache
def text_of(case: Case) -> list[str]:
    """Lines of the right text."""
    form = case.choose()
    settings = fit_settings(Settings(tolerance=EPS, axis_length=H), form, "mm")
    stream = io.BytesIO()
    write(smooth(program_of(case), settings), stream, form=form)
    return stream.getvalue().decode("ascii").splitlines()


def named_in(case: Case, lines: list[str]) -> list[tuple[int, str]]:
    """What is wrong, and where."""
    try:
        found = verify(
            program_of(case),
            ("\n".join(lines) + "\n").encode(),
            tolerance=EPS,
            axis_length=H,
            control=case.control,
            machine=case.choose().machine,
            tcp=case.tcp,
        )
    except InputError as error:
        return [(error.line or 0, str(error))]
    return [(problem.nc_line, f"{problem.code} {problem.text}") for problem in found.problems]


def _is_rapid(case: Case, line: str) -> bool:
    return " FMAX" in line if case.control == "heidenhain" else line.startswith("G0 ")


def _is_feed(case: Case, line: str) -> bool:
    if case.control == "heidenhain":
        return re.match(r"\d+ LN? X", line) is not None and " FMAX" not in line
    return re.match(r"G1 X", line) is not None


def mutants(case: Case) -> Iterator[Mutant]:
    """All mutants of the text of a case."""
    lines = text_of(case)
    height = re.compile(r"Z([-+]?[\d.]+)")
    begins = next(k for k, line in enumerate(lines) if re.search(r"CYCLE/(DRILL)", line))
    feeds = [k for k in range(begins, len(lines)) if _is_feed(case, lines[k])]
    for at, k in enumerate(feeds):
        following = feeds[at + 1] if at + 1 < len(feeds) else len(lines)
        last = sum(_is_rapid(case, line) for line in lines[k:following]) > 2  # no peck that another follows
        out = next(j for j in range(k + 1, len(lines)) if _is_rapid(case, lines[j]) and height.search(lines[j]))
        over = next(j for j in range(k - 1, 0, -1) if _is_rapid(case, lines[j]))
        yield Mutant("hole or peck dropped", [*lines[:k], *lines[k + 1 :]], (feeds[max(at - 2, 0)], out + 3))
        for kind, change in (("too deep", -0.5), ("too shallow", 0.5), ("too deep by 0.02", -0.02)):
            changed = height.sub(lambda found, by=change: f"Z{_number(found[1], by)}", lines[k])
            new = [*lines[:k], changed, *lines[k + 1 :]]
            if last:
                yield Mutant(kind, new, (k - 1, out + 4))
        if re.search(r" F[\d.]+", lines[k]):
            wrong = re.sub(r" F([\d.]+)", lambda found: f" F{float(found[1]) * 2:.4f}", lines[k])
            yield Mutant("wrong feed", [*lines[:k], wrong, *lines[k + 1 :]], (k + 1, out + 6))
            lost = re.sub(r" F[\d.]+", "", lines[k])
            yield Mutant("feed lost", [*lines[:k], lost, *lines[k + 1 :]], (k + 1, out + 6))
        rapid = _as_rapid(case, lines[k])
        yield Mutant("drilled in rapid", [*lines[:k], rapid, *lines[k + 1 :]], (k - 1, out + 4))
        if last:
            yield Mutant("way out lost", [*lines[:out], *lines[out + 1 :]], (k, out + 4))
        aside = re.sub(r"X([-+]?[\d.]+)", lambda found: f"X{_number(found[1], 0.4)}", lines[k])
        yield Mutant("beside the hole", [*lines[:k], aside, *lines[k + 1 :]], (k - 1, out + 4))
        again = [*lines[: out + 1], *lines[over : out + 1], *lines[out + 1 :]]
        if case.control != "heidenhain" and last:
            yield Mutant("drilled twice", again, (out + 1, 2 * out + 4 - over))
    for k in [k for k in range(begins, len(lines)) if re.search(r"^(\d+ )?(G4 |CYCL DEF 9\.1)", lines[k])]:
        if case.control != "heidenhain":
            yield Mutant("dwell lost", [*lines[:k], *lines[k + 1 :]], (begins, len(lines)))
        longer = re.sub(r"([PXF]|DWELL )(\d*\.?\d+)$", lambda found: f"{found[1]}{float(found[2]) * 3:g}", lines[k])
        yield Mutant("dwell of another time", [*lines[:k], longer, *lines[k + 1 :]], (k - 1, k + 3))


def _number(text: str, by: float) -> str:
    decimals = len(text.partition(".")[2])
    value = f"{float(text) + by:.{decimals}f}"
    return value if value[0] == "-" or text[0] not in "+-" else f"+{value}"


def _as_rapid(case: Case, line: str) -> str:
    line = re.sub(r" F[\d.]+", "", line)
    return f"{line} FMAX" if case.control == "heidenhain" else "G0" + line[2:]


def main() -> None:
    """Judge all, and print the score."""
    judged: Counter[str] = Counter()
    right: Counter[str] = Counter()
    for case in RUNNABLE:
        alarm = named_in(case, text_of(case))
        if alarm:
            print(f"FALSE ALARM {case}: {alarm[:2]}")
            continue
        for mutant in mutants(case):
            named = named_in(case, mutant.lines)
            low, high = mutant.where or (1, 0)
            good = not named if mutant.where is None else any(low <= line <= high for line, _ in named)
            judged[mutant.kind] += 1
            right[mutant.kind] += good
            if not good:
                print(f"MISSED {case}: {mutant.kind} in {mutant.where}: {named[:2]}", flush=True)
    for kind in sorted(judged):
        print(f"{kind:30} {right[kind]:5} {judged[kind]:5}")
    print(f"{len(judged)} classes, {sum(right.values())} of {sum(judged.values())} mutants right")


if __name__ == "__main__":
    main()
