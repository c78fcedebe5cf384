"""The law of LinuxCNC's planner against times that its whole controller took.

The controller (Debian's 2.9) ran each program of `PROGRAMS` with the limits below; its servo cycles were counted.
`python tests/feedrate/test_linuxcnc.py` runs them again and prints the times.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.errors import InputError
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


#: plane, mm that each arc rises, degrees of the corners between them, words of G64, feed mm/min, seconds that the
#: controller took for the cuts, and how far off the law may be
ARCS = {
    "flat arcs": (17, 0.0, 1.0, "", 1500, 2.192, 0.01),
    "flat arcs in XZ, fast": (18, 0.0, 1.0, "", 6000, 1.612, 0.01),
    "flat arcs, tangent": (17, 0.0, 0.0, " P0.01 Q0", 6000, 1.750, 0.01),
    "flat arcs, corners": (17, 0.0, 10.0, " P0.01 Q0", 1500, 2.445, 0.01),
    "arcs that rise": (17, 0.3, 1.0, "", 1500, 2.583, 0.02),
    "arcs that rise, fast": (17, 0.3, 1.0, "", 6000, 2.576, 0.02),
    "arcs that rise, within P": (17, 0.3, 0.0, " P0.01 Q0", 6000, 3.809, 0.06),
}


def arcs(name: str) -> str:
    """Arcs in waves with small corners between them, and three lines."""
    plane, rise, corner, blend, feed, *_ = ARCS[name]
    u, v, w = {17: "XYZ", 18: "ZXY", 19: "YZX"}[plane]
    lines = ["G21 G90 G94 G40 G49 G80", f"G64{blend}", f"G{plane}", "G0 X0 Y0 Z0 A0 C0"]
    place, heading = np.zeros(3), 0.0
    for k in range(24):
        sense, radius = (1 if (k // 3) % 2 else -1), 1.5 + 0.5 * (k % 4)
        heading += np.radians(corner) * (-1) ** k
        centre = place[:2] + sense * radius * np.array([-np.sin(heading), np.cos(heading)])
        heading += sense * np.radians(40 + 10 * (k % 3))
        end = centre - sense * radius * np.array([-np.sin(heading), np.cos(heading)])
        place = np.array([*end, place[2] + rise])
        word = "G3" if sense > 0 else "G2"
        lines.append(f"{word} {u}{place[0]:.4f} {v}{place[1]:.4f} {w}{place[2]:.4f} R{radius:.4f} F{feed}")
        if k % 8 == 7:
            place = place + [1.0, -0.5, 1.0]
            lines.append(f"G1 {u}{place[0]:.4f} {v}{place[1]:.4f} {w}{place[2]:.4f}")
    return "\n".join([*lines, "M2", ""])


def seconds_of_cuts(text: str) -> float:
    lines = program_lines(text.encode())
    begin, end = line_times(lines, LIMITS)
    cuts = np.flatnonzero(np.isfinite(lines.feed))
    return float(end[cuts[-1]] - begin[cuts[0]])


@pytest.mark.parametrize("name", list(ARCS))
def test_the_law_of_arcs_gives_the_controllers_time(name: str) -> None:
    assert seconds_of_cuts(arcs(name)) == pytest.approx(ARCS[name][-2], rel=ARCS[name][-1])


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
    from linuxcnc_controller import FEEDING, STATED, run_controller, run_samples

    for name in PROGRAMS:
        word, joints, _ = run_controller(program_of(name), 120.0, STATED)
        planned = line_times(lines_of(name), LIMITS)[1][-1]
        print(f"{name}: {word}, {len(joints) * LIMITS.servo_period:.3f} s; planned {planned:.3f} s")
    for name in ARCS:
        word, samples = run_samples(arcs(name).encode(), 60.0, STATED)
        cutting = int((samples[:, 5] >= FEEDING).sum())
        print(f"{name}: {word}, {cutting * LIMITS.servo_period:.3f} s; planned {seconds_of_cuts(arcs(name)):.3f} s")


def test_a_program_begins_in_g64() -> None:
    """On the whole controller a relief in short lines took 3.52 s with and without the word."""
    cuts = "G21 G90 G94\nG0 X0 Y0 Z0\nG1 F1500\n" + "".join(
        f"X{0.1 * k:.1f} Z{0.02 * (k % 2):.2f}\n" for k in range(1, 99)
    )
    times = {word: line_times(program_lines((word + cuts).encode()), LIMITS)[1][-1] for word in ("", "G64\n", "G61\n")}
    assert times[""] == times["G64\n"]
    assert times["G61\n"] > 1.5 * times[""]


@pytest.mark.parametrize(
    "line",
    [
        "o100 sub",
        "N5 o<hole> call",
        "#1=3",
        "X#1",
        "Z[1+1]",
        "o110 while [#5 lt 10]",
        "M98 P100",
        "G90.1",
        "G3 X9",
        "G2 X9 I0",
        "G8 X9",
        "G0 X9 U1",
        "G4 P1 X9",
        "G95",
        "/G0\nX9",
    ],
)
def test_what_the_text_does_not_say_has_no_time(line: str) -> None:
    with pytest.raises(InputError, match="CS264") as error:
        program_lines(f"O0001\n(X#1 [a remark])\nG1 X5 F100\n{line}\n".encode(), "part.ngc")
    assert error.value.line == 4 + line.count("\n")


@pytest.mark.parametrize("line", ["G10 L20 P1 X0 Y9", "G92 X0"])
def test_axes_of_other_words_are_no_moves(line: str) -> None:
    """They were lines to these places."""
    assert program_lines(f"G0 X1 Y2\nG1 F100 X5\n{line}\nX6\n".encode()).end[:, 0].tolist() == [5.0, 6.0]


def test_a_modal_arc_keeps_its_sense_behind_other_words() -> None:
    head = "G17 G0 X0 Y0 Z0\nG3 F600 X10 Y0 I5\n"
    modal, named = (program_lines(f"{head}M8\n{word} X20 Y0 I5\n".encode()) for word in ("", "G3"))
    assert modal.arc.tolist() == named.arc.tolist()
    assert modal.arc[0, 11] == 1.0


def test_distances_take_the_time_of_positions() -> None:
    head, tail = "G0 X0 Y0 Z5\nG1 F900\n", "G0 Z5\n"
    there = "G90\nX10\nX12 Y3\nZ-1\n" + tail
    by = "G91\nX10\nX2 Y3\nZ-6\nG90\n" + tail
    assert (
        line_times(program_lines((head + by).encode()), LIMITS)[1][-1]
        == line_times(program_lines((head + there).encode()), LIMITS)[1][-1]
    )
    home = "G91 G28 Z0\nG90\n"  # a rapid of a length that is not known
    assert len(program_lines((head + there + home).encode())) == len(program_lines((head + there).encode()))


if __name__ == "__main__":
    main()


def test_straight_on_is_as_nearly_straight_on() -> None:
    """Tolerance over the smallest number was infinite, with a warning."""
    straight, bent = (
        program_lines(f"G64 P20\nG0 X0 Y0\nG1 F9000 X100\nX200 Y{y}\nX300\n".encode()) for y in ("0", "0.000001")
    )
    assert line_times(straight, LIMITS)[1] == pytest.approx(line_times(bent, LIMITS)[1], rel=1e-6)
