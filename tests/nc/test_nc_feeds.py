"""Feeds where a curve begins: the block that would have said them may have no length in the written digits."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from cornersmooth.cl import read
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import CHOSEN, Case
from nc.promise import written

#: the move behind the last rapid is so short that the line before its curve is nothing in the written digits
CL = """UNITS/MM
LOADTL/1
RAPID
GOTO/1,0,0,0,0,1
FEDRAT/500,MMPM
GOTO/20,0,0
RAPID
GOTO/0,0,0
FEDRAT/800,MMPM
GOTO/-0.0004,-0.0002,0
GOTO/-0.0008,0.0005,0
FINI
"""

#: all forms with curves
CURVES = [case for case in CHOSEN if case.form != "g1"]


@pytest.mark.parametrize("case", CURVES, ids=str)
def test_a_curve_says_the_feed_where_no_line_is_left_before_it(case: Case) -> None:
    form = case.choose()
    form = replace(form, table=form.table.with_digits("4"))
    program = read(CL.encode(), name="part.cls")
    settings = Settings(tolerance=0.003, allocation="fair", shape="paper")
    text, _ = written(program, form, settings)
    blocks = text.replace(" ~\n", " ").splitlines()
    rapid = max(k for k, block in enumerate(blocks) if re.search("^G0 .*X|X.* FMAX$", block))
    behind = blocks[rapid + 1 :]
    curve = next(block for block in behind if "X" in block)
    assert any(word in curve for word in ("G6.2", "BSPLINE", "POLY", "SPL"))
    assert curve.rstrip(".").endswith(" F800")
    assert sum(" F8" in block for block in behind) == 1
    found = verify(program, text.encode(), tolerance=0.003, control=case.control, machine=form.machine, tcp=case.tcp)
    assert found.problems == ()
