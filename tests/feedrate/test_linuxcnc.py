"""The law of LinuxCNC's planner against times that its whole controller took.

The controller (Debian's 2.9) ran each program of `PROGRAMS` with the limits below; its servo cycles were counted.
`python tests/feedrate/test_linuxcnc.py` runs them again and prints the times.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.feedrate.linuxcnc import AxisLimits, Lines, line_times, program_lines
from cornersmooth.model import Floats

LIMITS = AxisLimits(
    velocity=np.array([500.0, 500.0, 500.0, 120.0, 120.0, 180.0]),
    acceleration=np.array([1000.0, 1000.0, 1000.0, 400.0, 400.0, 500.0]),
    linear_velocity=500.0,
    servo_period=0.001,
)

#: count of lines, waves along the path, degrees of A and C, feed mm/min, P mm, seconds on the controller
PROGRAMS = {
    "five axes, small blend": (120, 3.0, (25.0, 140.0), 1800.0, 0.002, 26.183),
    "five axes, large blend": (120, 3.0, (25.0, 140.0), 1800.0, 0.04, 16.540),
    "five axes, short lines": (600, 3.0, (25.0, 140.0), 1800.0, 0.002, 36.470),
    "five axes, fast": (60, 2.0, (10.0, 20.0), 6000.0, 0.01, 5.622),
    "three axes": (120, 3.0, (0.0, 0.0), 1800.0, 0.01, 4.039),
    "three axes, sharp": (40, 9.0, (0.0, 0.0), 6000.0, 0.01, 5.599),
}


def places(count: int, waves: float, turn: tuple[float, float]) -> Floats:
    """(count + 1, 6) words along a wave."""
    at = np.linspace(0.0, 1.0, count + 1)
    phase = 2.0 * np.pi * waves * at
    a, c = turn
    columns = (80.0 * at, 6.0 * np.sin(phase), 2.0 * np.cos(1.7 * phase) - 2.0)
    return np.round(np.stack((*columns, a * np.sin(phase / 2.0), 0.0 * at, c * np.sin(phase / 3.0)), axis=1), 4)


def lines_of(name: str) -> Lines:
    count, waves, turn, feed, blend, _ = PROGRAMS[name]
    place = places(count, waves, turn)
    return Lines(place[:-1], place[1:], np.full(count, feed / 60.0), np.full(count, blend))


def program_of(name: str) -> bytes:
    count, waves, turn, feed, blend, _ = PROGRAMS[name]
    place = places(count, waves, turn)
    blocks = [
        " ".join(f"{letter}{word:.4f}" for letter, word in zip("XYZAC", row[[0, 1, 2, 3, 5]], strict=True))
        for row in place
    ]
    head = ["G21 G90 G94 G17 G40 G49 G80", f"G64 P{blend} Q0", "M428", "G0 X0 Y0 Z0 A0 C0"]
    return "\n".join([*head, *(f"G1 {block} F{feed}" for block in blocks[1:]), "M2", ""]).encode()


@pytest.mark.parametrize("name", list(PROGRAMS))
def test_the_law_gives_the_controllers_time(name: str) -> None:
    seconds = PROGRAMS[name][-1]
    _, end = line_times(lines_of(name), LIMITS)
    assert end[-1] == pytest.approx(seconds, rel=0.15 if name.startswith("three") else 0.02)


def test_a_line_never_starts_before_the_line_before_the_last_has_ended() -> None:
    begin, end = line_times(lines_of("five axes, short lines"), LIMITS)
    assert (begin[2:] >= end[:-2] - 1e-12).all()
    assert (np.diff(begin) > 0.0).all()
    assert (np.diff(end) > 0.0).all()


def test_exact_stop_and_rapids_part_the_lines() -> None:
    lines = lines_of("five axes, large blend")
    begin, end = line_times(Lines(lines.start, lines.end, lines.feed, np.full(len(lines), np.nan)), LIMITS)
    assert begin[1:] == pytest.approx(end[:-1])
    feed = lines.feed.copy()
    feed[40:] = np.inf
    begin, end = line_times(Lines(lines.start, lines.end, feed, lines.blend), LIMITS)
    assert begin[40] == end[39]
    assert (begin[1:40] < end[:39]).all()


def test_no_lines_take_no_time() -> None:
    nothing = np.zeros((0, 6))
    assert [len(found) for found in line_times(Lines(nothing, nothing, np.zeros(0), np.zeros(0)), LIMITS)] == [0, 0]


def main() -> None:
    sys.path.insert(0, str(Path(__file__).parents[1] / "nc"))
    from linuxcnc_controller import STATED, run_controller

    for name in PROGRAMS:
        word, joints, _ = run_controller(program_of(name), 120.0, STATED)
        planned = line_times(lines_of(name), LIMITS)[1][-1]
        print(f"{name}: {word}, {len(joints) * LIMITS.servo_period:.3f} s; planned {planned:.3f} s")


if __name__ == "__main__":
    main()


def test_a_program_begins_in_g64() -> None:
    """On the whole controller a relief in short lines took 3.52 s with and without the word."""
    cuts = "G21 G90 G94\nG0 X0 Y0 Z0\nG1 F1500\n" + "".join(
        f"X{0.1 * k:.1f} Z{0.02 * (k % 2):.2f}\n" for k in range(1, 99)
    )
    times = {word: line_times(program_lines(word + cuts), LIMITS)[1][-1] for word in ("", "G64\n", "G61\n")}
    assert times[""] == times["G64\n"]
    assert times["G61\n"] > 1.5 * times[""]
