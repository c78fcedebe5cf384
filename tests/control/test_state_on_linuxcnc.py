"""What the machine claims to know of a program with lines dropped and mixed up is what LinuxCNC knows."""

from __future__ import annotations

import math
import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

import cornersmooth as cs
from cornersmooth.control.program import Text
from cornersmooth.control.state import Rows, State
from cornersmooth.filter.runs import ProgramReader
from filter.test_filter_by_foreign_readers import THREE_AXES, seeded
from oracle.interpreter import RefusedError, rows_of
from oracle.share import how_many

#: digits of the interpreter's own numbers
SAME = 1e-6


def dropped(text: str, rng: random.Random) -> str:
    """The program without some of its lines, some twice, two in each other's place; subprograms stay subprograms."""
    lines = text.splitlines()
    free = [k for k, line in enumerate(lines) if not line.startswith("o")]
    for _ in range(rng.randrange(3)):
        one, other = rng.choice(free), rng.choice(free)
        lines[one], lines[other] = lines[other], lines[one]
    times = [1 if line.startswith("o") else rng.choices((0, 1, 2), (0.12, 0.84, 0.04))[0] for line in lines]
    return "".join(f"{line}\n" * count for line, count in zip(lines, times, strict=True))


def interpreted(text: str, folder: Path) -> list[tuple[str, int, list[float]]] | None:
    """Kinds, lines and numbers of the interpreter; None where it refuses the program."""
    try:
        rows = rows_of(text.encode(), folder)
    except RefusedError:
        return None
    return [(row[0], int(row[1]), [float(one) for one in row[2:]]) for row in rows]


def claimed(text: str) -> Iterator[tuple[int, State, bool]]:
    """The state behind each line, and whether the line is a motion block and nothing else."""
    reader = ProgramReader("linuxcnc", cs.load_machine(THREE_AXES), tcp=False)
    for item in reader.stream(Text.of(text.encode())):
        if isinstance(item, Rows):
            yield from ((item.first + k + 1, item.after(k + 1), True) for k in range(len(item)))
        else:
            yield item.line + 1, item.after, False


@pytest.mark.linuxcnc
@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC is not installed")
def test_what_is_claimed_is_what_the_interpreter_knows(tmp_path: Path) -> None:
    compared = {"place": 0, "motion": 0, "feed": 0}
    for seed in range(how_many(60, 2000)):
        text = dropped(seeded(seed), random.Random(seed))
        rows = interpreted(text, tmp_path)
        if rows is None:
            continue
        motions: dict[int, list[tuple[str, list[float]]]] = {}
        feeds: dict[int, float] = {}
        for kind, line, numbers in rows:
            if kind in ("rapid", "feed", "arc"):
                motions.setdefault(line, []).append((kind, numbers))
            elif kind == "feed_rate":
                feeds[line] = numbers[0]
        for line, state, plain in claimed(text):
            motion = {"rapid": "rapid", "line": "feed", "arc": "arc"}.get(state.groups["motion"] or "")
            ends = motions.get(line, [])
            for kind, numbers in ends if plain else ends[-1:]:
                if motion is not None and plain:
                    assert kind == motion, (seed, line)
                    compared["motion"] += 1
                for value, letter in zip(numbers, "XYZ", strict=False):
                    place = state.unit * state.place[letter]
                    if not math.isnan(place):
                        assert place == pytest.approx(value, abs=SAME), (seed, line, letter)
                        compared["place"] += 1
            feed = state.unit * state.feed
            if line in feeds and state.groups["feed"] == "minute" and not math.isnan(feed):
                assert feed == pytest.approx(feeds[line], abs=SAME), (seed, line)
                compared["feed"] += 1
    assert min(compared.values()) > 100, compared
