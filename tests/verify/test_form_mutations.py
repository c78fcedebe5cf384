"""The mutation test for every control and form: what matters is found at the right line, what does not is let pass."""

from __future__ import annotations

import io
from collections import Counter
from functools import cache

import pytest

from cornersmooth.errors import InputError
from cornersmooth.kinematics import Machine
from cornersmooth.nc import fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from nc.cases import RUNNABLE, Case

from .form_mutations import EPS, H, mutants, program_of
from .writing import encode

#: every control in every form; Mitsubishi's lines and those of the neutral form are FANUC's
CASES = [case for case in RUNNABLE if case.machine in ("", "xyzac-trt" if case.control == "linuxcnc" else "table-ac")]
CASES = [
    case
    for case in CASES
    if case.control not in ("generic", "mitsubishi") or str(case) in ("generic-g6.2", "mitsubishi-g6.2")
]


def text_of(case: Case) -> list[str]:
    """Lines of the program of all mutants."""
    form = case.choose()
    settings = fit_settings(Settings(tolerance=EPS, axis_length=H), form, "mm")
    stream = io.BytesIO()
    write(smooth(program_of(case), settings), stream, form=form)
    return stream.getvalue().decode("ascii").splitlines()


@cache
def machine_of(case: Case) -> Machine | None:
    """Machine of the control."""
    return case.choose().machine


def lines_named(case: Case, text: bytes) -> list[tuple[int, str]]:
    """What is wrong, and where."""
    try:
        found = verify(
            program_of(case),
            text,
            tolerance=EPS,
            axis_length=H,
            control=case.control,
            machine=machine_of(case),
            tcp=case.tcp,
        )
    except InputError as error:
        return [(error.line or 0, str(error))]
    return [(problem.nc_line, f"{problem.code} {problem.text}") for problem in found.problems]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_every_mutant_that_matters_is_found(case: Case) -> None:
    lines = text_of(case)
    assert lines_named(case, encode(lines)) == []
    score, missed = Counter(), []
    for mutant in mutants(case, lines):
        named = lines_named(case, ("\n".join(mutant.lines) + "\n").encode("latin-1"))
        if mutant.where is None:
            good = not named
        else:
            good = any(mutant.where[0] <= line <= mutant.where[1] for line, _ in named)
        score[mutant.kind, good] += 1
        if not good:
            missed.append(
                (
                    mutant.kind,
                    mutant.where,
                    named[:3],
                    [b for a, b in zip(lines, mutant.lines, strict=False) if a != b][:1],
                )
            )
    total = sum(score.values())
    print(f"\n{case}: {total - len(missed)} of {total} mutants judged rightly")
    assert missed == []
    assert total >= 40
