"""Programs whose text was right and once refused, or wrong and passed: `right/NAME.cls`, cut down to what matters.

The first line of each is a comment that says for what it is written: control, form, machine or ``-``, ``tcp`` or
``axes``, settings by name, ``digits=``, ``planned`` and ``native`` as a `Trial` has them. What follows ``#`` says what
made verification object.
"""

from __future__ import annotations

from ast import literal_eval
from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.settings import Settings
from nc.cases import Case
from oracle.share import THOROUGH, share
from verify.random_programs import Trial
from verify.sweep import judged

#: whose plans, or paths to and fro, take a second each
LONG = ("coolant_at_holes_left_out", "planned_turn_about_the_tool", "tip_and_axis_point_far_apart")
FOLDER = Path(__file__).parent / "right"
FILES = sorted(FOLDER.glob("*.cls"))


def load(path: Path) -> Trial:
    """The trial that a file holds."""
    cl = path.read_text()
    control, form, machine, tcp, *said = cl.splitlines()[0].removeprefix("$$").split("#")[0].split()
    options = dict(word.split("=", 1) for word in said if "=" in word)
    digits = options.pop("digits", "")
    settings = Settings(**{name: literal_eval(value) for name, value in options.items()})
    case = Case(control, form, machine.strip("-"), tcp == "tcp")
    return Trial(0, case, settings, "", cl, digits=digits, planned="planned" in said, native="native" in said)


@pytest.mark.parametrize(
    "path", share([path for path in FILES if THOROUGH or path.stem not in LONG], 2), ids=lambda path: path.stem
)
def test_text_passes(path: Path) -> None:
    """And the oracle agrees, in a thorough run."""
    one = load(path)
    assert judged(one, read(one.cl.encode(), name="trial.cls"), oracle=THOROUGH) == ("passed", "")
