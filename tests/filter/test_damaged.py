"""Programs with lines mixed up, doubled, cut, and with bytes changed: no error, and nothing lost outside of runs."""

from __future__ import annotations

import random

import pytest

import cornersmooth as cs
from cornersmooth.errors import Verdict
from cornersmooth.filter import filter_program
from cornersmooth.filter.runs import ProgramReader
from filter.programs import PROGRAMS
from oracle.share import THOROUGH

#: blocks that change what a control remembers
BLOCKS = (
    "G91|G90|G49|G20|M6|G68.2 X0 Y0 Z0 I0 J30. K0|/G0 X5.|#1=5|G93|M98 P5|G95|GOTO 5|TRAFOOF|M129|G41|(|G1 X|"
    "G2 X5 Y5 I1 J1|\xff\xfe|G53 Z0|N5|%|O5|G17 G1 X5.|F500.|G0|X1e5|G1 X99999999999.|RND R5|LBL 5|L X+5 R0|G64|G55"
).split("|")


def damaged(text: str, rng: random.Random) -> bytes:
    """The program after a few accidents."""
    lines = text.encode("latin-1").splitlines(keepends=True)
    for _ in range(rng.randrange(1, 8)):
        i, j = rng.randrange(len(lines)), rng.randrange(len(lines))
        line, place = lines[i], rng.randrange(len(lines[i]) + 1)
        match rng.randrange(5):
            case 0:
                lines[i], lines[j] = lines[j], lines[i]
            case 1:
                lines.insert(i, lines[j])
            case 2:
                lines[i] = line[:place]
            case 3:
                lines[i] = line[:place] + bytes([rng.randrange(256)]) + line[place + 1 :]
            case _:
                lines.insert(i, rng.choice(BLOCKS).encode("latin-1") + b"\n")
    return b"".join(lines)


@pytest.mark.parametrize("name", list(PROGRAMS))
def test_damaged_programs(name: str) -> None:
    control, machine, text = PROGRAMS[name]
    form = cs.choose_form(control, "g1", machine=cs.load_machine(machine) if machine else None)
    for seed in range(200 if THOROUGH else 6):
        old = damaged(text, random.Random(f"{name} {seed}"))
        found = filter_program(old, form, cs.Settings(tolerance=0.02, lines="long" if seed % 2 else "dense"))
        assert found.verdict is (Verdict.PASSED if found.runs else Verdict.NOT_SMOOTHED), (seed, found.checked)
        assert found.smoothed + sum(one.count for one in found.left) == found.cuts
        # every line outside of runs is in the new program, in the same order
        runs = ProgramReader(form.table.dialect, form.machine).read(old).runs
        inside = {number for run in runs for number in range(run.first, run.stop)}
        rest = iter(found.data.split(b"\n"))
        outside = [line for number, line in enumerate(old.split(b"\n")) if number not in inside]
        assert all(any(line == other for other in rest) for line in outside)
