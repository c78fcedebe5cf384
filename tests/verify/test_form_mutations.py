"""The mutation test for every control and form: what matters is found at the right line, what does not is let pass."""

from __future__ import annotations

from functools import partial

import pytest

from cornersmooth.model import Program
from cornersmooth.verify import verify
from nc.cases import RUNNABLE, Case
from oracle.share import THOROUGH, share_of_kinds

from .form_mutations import EPS, H, mutants, program_of
from .judging import judge
from .word_mutations import text_of

#: every control in every form; Mitsubishi's lines and those of the neutral form are FANUC's
CASES = [case for case in RUNNABLE if case.machine in ("", "xyzac-trt" if case.control == "linuxcnc" else "table-ac")]
CASES = [
    case
    for case in CASES
    if case.control not in ("generic", "mitsubishi") or str(case) in ("generic-g6.2", "mitsubishi-g6.2")
]


def named_in(case: Case, program: Program, lines: list[str]) -> list[tuple[int, str]]:
    """What is wrong, and where."""
    found = verify(
        program,
        ("\n".join(lines) + "\n").encode("latin-1"),
        tolerance=EPS,
        axis_length=H,
        control=case.control,
        machine=case.choose().machine,
        tcp=case.tcp,
    )
    return [(problem.nc_line, f"{problem.code} {problem.text}") for problem in found.problems]


#: each control and each form but FANUC's lines, which test_mutations.py has: with the one form in which a fold may be
#: lost, all kinds of mutants are among theirs
USUAL = (
    "fanuc-g1-table-ac-axes",
    "generic-g6.2",
    "haas-g1-table-ac",
    "heidenhain-g1",
    "heidenhain-spl",
    "linuxcnc-g1-xyzac-trt",
    "mitsubishi-g6.2",
    "siemens-bspline",
    "siemens-poly",
)


@pytest.mark.parametrize("case", [case for case in CASES if THOROUGH or str(case) in USUAL], ids=str)
def test_every_mutant_that_matters_is_found(case: Case) -> None:
    program = program_of(case)
    lines = text_of(case)
    assert named_in(case, program, lines) == []
    chosen = share_of_kinds(mutants(case, lines), lambda mutant: mutant.kind, 20)
    score = judge(chosen, partial(named_in, case, program))
    print(f"\n{case}: {score}")
    assert score.missed == []
    assert sum(score.judged.values()) == len(chosen) >= 15
