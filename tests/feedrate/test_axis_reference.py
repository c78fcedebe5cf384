"""Plans under the limits of a machine's axes against linear programmes that keep each limit with its signs.

The planner keeps them with their signs as well, but on cells of its own and with some room to spare; here is by how
much its plans are slower at most.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from axis_programmes import reference_time

from cornersmooth.cl import read
from cornersmooth.feedrate import Limits, plan
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from oracle.share import share

IMPELLER = Path(__file__).resolve().parents[2] / "samples" / "impeller.cls"
#: what cells and room to spare may cost
MOST = 1.035
#: first and last pose, method, and largest distance of nodes, mm
PIECES = [
    (5, 13, "proportional", 0.05),
    (30, 38, "global", 0.05),
    (200, 210, "proportional", 0.03),
    (5, 25, "global", 0.02),
]


def check(program: Program, first: int, last: int, method: str, step: float) -> None:
    piece = Program.from_poses(program.tip[first:last], program.axis[first:last], feed=1800.0)
    limits = Limits()
    law = plan(smooth(piece, Settings(method=method)), limits, machine=load_machine("table-ac"))
    reference = reference_time(law, limits, step)
    # limits of the reference count at its nodes only: it is a little fast
    assert 0.985 * reference <= law.total <= MOST * reference


@pytest.mark.parametrize("piece", share(PIECES, 4, 1), ids=str)
def test_the_impeller(piece: tuple[int, int, str, float]) -> None:
    check(read(IMPELLER.read_bytes(), name=IMPELLER.name), *piece)


@pytest.mark.corpus
def test_the_zigzag(corpus: Path) -> None:
    name = "hecc_point_zigzag.csv"
    check(read((corpus / name).read_bytes(), name=name), 0, 12, "proportional", 0.03)
