"""Write a cutter-location file in the style of Siemens NX, for timing: ``make_clsf.py OUT [N]``.

N five-axis points (a million take about 60 MB) of a bladed rotor: zigzag passes of a thousand points along the flow,
about a millimetre apart, each pass with its approach, plunge, cut and retract. The cut bends gently; at the turns of
the zigzag and at a few points of the cut there are sharp corners. The same N gives the same file.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from cornersmooth.text import RowFormat, to_ticks

Floats = NDArray[np.float64]

POINTS = 1_000_000
PASS = 1000  # points of a pass, approach and retract included
STRIP = 110  # points of a strip between two turns of the zigzag
STEP_OVER = 0.8  # mm between strips
RETRACT = 40.0  # mm
CHUNK = 100  # passes made at a time

HEADER = b"""\
TOOL PATH/VARIABLE_CONTOUR_ROUGH,TOOL,BALL_MILL_D8_TAPER_3
TLDATA/MILL,8.0000,4.0000,75.0000,3.0000,0.0000
MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000
$$ centerline data
PAINT/PATH
PAINT/SPEED,10
LOAD/TOOL,1,ADJUST,1
SPINDL/RPM,12000,CLW
COOLNT/ON
"""
FOOTER = b"""\
PAINT/SPEED,10
PAINT/TOOL,NOMORE
END-OF-PATH
"""
BEFORE = [
    b"GOTO/",
    b"PAINT/COLOR,211\nRAPID\nGOTO/",  # approach
    b"PAINT/COLOR,42\nFEDRAT/MMPM,800.0000\nGOTO/",  # plunge
    b"PAINT/COLOR,31\nFEDRAT/MMPM,2500.0000\nGOTO/",  # cut
    b"PAINT/COLOR,37\nRAPID\nGOTO/",  # retract
]
ROW = RowFormat((b"", b",", b",", b",", b",", b","), (4, 4, 4, 7, 7, 7))


def make_passes(first: int, count: int) -> tuple[Floats, Floats]:
    """Tips and axes, (count, PASS, 3) each, of passes `first` and following."""
    random = np.random.default_rng([2016, first])
    cut = np.arange(PASS - 2)  # a point of approach and a point of retract lie above the others
    strip, place = np.divmod(cut, STRIP)
    along = np.where(strip % 2, STRIP - 1 - place, place) / (STRIP - 1.0)
    number = first + np.arange(count)[:, None]
    across = (strip * STEP_OVER + number % 50 * 0.05)[:, :, None]
    turn = number[:, :, None] * 0.37
    along = along[None, :, None] + np.zeros((count, 1, 1))

    # along the flow: from axial to radial, wrapped round the rotor; across it: up the blade
    radius = 28.0 + 55.0 * along**2 + across
    height = 75.0 - 70.0 * along + 12.0 * along**3 + 0.5 * across * (1.0 - along)
    angle = turn + 0.9 * along + 0.15 * np.sin(2.5 * along)
    tip = np.concatenate((radius * np.cos(angle), radius * np.sin(angle), height), axis=2)
    tip += random.uniform(-0.01, 0.01, tip.shape)  # what the tolerance of the CAM system leaves
    kinks = random.random((count, PASS - 2)) < 0.01
    tip[kinks] += random.uniform(-0.3, 0.3, (int(kinks.sum()), 3))

    lean = 0.5 + 0.5 * along + 0.02 * across + 0.05 * np.sin(9.0 * along)
    swing = angle + 0.6 - 0.8 * along
    axis = np.concatenate((np.sin(lean) * np.cos(swing), np.sin(lean) * np.sin(swing), np.cos(lean)), axis=2)

    axis = axis[:, [0, *cut, PASS - 3]]
    tip = tip[:, [0, *cut, PASS - 3]]
    tip[:, [0, -1]] += RETRACT * axis[:, [0, -1]]
    return tip, axis


def make_file(points: int) -> Iterator[bytes]:
    """Text of a file of `points` points, in pieces."""
    yield HEADER
    phase = np.zeros(PASS, np.int64)
    phase[[0, 1, 2, PASS - 1]] = 1, 2, 3, 4
    for first in range(0, -(-points // PASS), CHUNK):
        tip, axis = make_passes(first, CHUNK)
        values = np.concatenate((tip, axis), axis=2).reshape(-1, 6)[: points - first * PASS]
        ticks = to_ticks(values, ROW.decimals)
        yield ROW.rows(ticks, BEFORE, np.tile(phase, CHUNK)[: len(ticks)], [b"\n"], 0)
    yield FOOTER


def main() -> None:
    """Write the file that the command line names."""
    if not 2 <= len(sys.argv) <= 3:
        sys.exit(f"usage: {sys.argv[0]} OUT [N]")
    points = int(sys.argv[2]) if len(sys.argv) == 3 else POINTS
    with open(sys.argv[1], "wb") as file:
        file.writelines(make_file(points))


if __name__ == "__main__":
    main()
