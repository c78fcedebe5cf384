"""Work grows no faster than the input: lines of Python of reading, writing and verifying at n and at 4 n."""

from __future__ import annotations

import io

import numpy as np
import pytest

from cornersmooth import read
from cornersmooth.nc import Frame, choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from oracle.loops import lines

HEAD = "UNITS/MM\nLOADTL/1\nSPINDL/5000,RPM,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nFEDRAT/500,MMPM\nGOTO/0,0,0,0,0,1\n"

#: growth with four times the work: a little above 4 for what is done once, well below the 16 of a square.
#: A step that each of 50 does for each other is found at a 60th of the work of one
MOST = 4.25


def poses(count: int) -> list[str]:
    return [f"GOTO/{k + 1},{k % 3},{k % 2},0,0,1" for k in range(count)]


def between(statement: str, count: int) -> str:
    return "\n".join(f"{pose}\n{statement.format('ON' if k % 2 else 'OFF')}" for k, pose in enumerate(poses(count)))


INPUTS = {
    "poses": (12000, lambda n: "\n".join(poses(n))),
    "unknown statements": (50, lambda n: between("ANYWORD/{}", n)),
    "coolant changes": (40, lambda n: between("COOLNT/{}", n)),
    "optional stops": (40, lambda n: between("OPSTOP", n)),
    "comments": (50, lambda n: between("PPRINT of pose {}", n)),
    "length of a line": (1500, lambda n: "GOTO/1,1,1\nPPRINT " + "word " * n + "\nGOTO/2,2,2"),
    "tools": (
        20,
        lambda n: "\n".join(
            f"RAPID\nGOTO/0,0,50\nLOADTL/{k % 90 + 2}\nSPINDL/5000,RPM,CLW\nRAPID\nGOTO/0,0,50,0,0,1\nGOTO/{k % 7},0,0"
            for k in range(n)
        ),
    ),
    "holes": (
        40,
        lambda n: (
            "CYCLE/DRILL,FEDTO,5,MMPM,80,RAPTO,2\n"
            + "\n".join(f"GOTO/{k % 40},{k // 40},0" for k in range(n))
            + "\nCYCLE/OFF"
        ),
    ),
}


def whole(text: str) -> None:
    program = read(f"{HEAD}{text}\nRAPID\nGOTO/0,0,60,0,0,1\nFINI\n".encode(), name="part.cls")
    form = choose_form("fanuc")
    settings = fit_settings(Settings(tolerance=0.01), form, "mm")
    stream = io.BytesIO()
    with np.errstate(all="ignore"):
        write(smooth(program, settings), stream, form=form, frame=Frame())
    assert not [one for one in verify(program, stream.getvalue(), tolerance=0.01).problems if one.code != "CS000"]


@pytest.mark.parametrize("what", list(INPUTS))
def test_four_times_the_input_is_four_times_the_work(what: str) -> None:
    count, make = INPUTS[what]
    whole(make(4 * count))  # what is made once, and what is remembered of words
    nothing, once, four = (lines(lambda n=n: whole(make(n))) for n in (1, count, 4 * count))
    assert four - nothing <= MOST * (once - nothing), (nothing, once, four)
