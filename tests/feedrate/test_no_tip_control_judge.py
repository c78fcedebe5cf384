"""Planned times of programs without tip control, judged by the written words: all five axes run evenly in each block.

The judge reads the words by itself, and turns them to tips by rotation matrices of its own. Of a plan it takes no more
than how far the tip is along its way at some times; speeds, accelerations and jerks are finite differences.
"""

from __future__ import annotations

import io
import re
from functools import partial

import numpy as np
import pytest

from cornersmooth.feedrate import Limits, TimeLaw, plan_text
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Floats, Ints, Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.pipeline import read_back
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

#: times between neighbouring samples, and between two at a border of blocks, s
STEP, SHORT = 2e-3, 1e-4

#: places in each block
PLACES = 4001


def blocks_of(text: str) -> tuple[Floats, Ints]:
    """Words X Y Z A C after each block that moves any of them, and the lines (from 1) of these."""
    words, rows, lines = dict.fromkeys("XYZAC", np.nan), [], []
    for number, line in enumerate(text.split("\n"), 1):
        found = re.findall(r"([XYZAC])([-+]?\d*\.?\d+)", re.sub(r"\(.*?\)", "", line))
        if found and not re.search(r"G28|G53|G30", line):
            words |= {letter: float(value) for letter, value in found}
            rows.append(list(words.values()))
            lines.append(number)
    return np.array(rows), np.array(lines)


def tips_of(words: Floats) -> Floats:
    """Tips (n, 3) of words of a table of A about X that carries one of C about Z: words are of the tool (ISO 841)."""
    a, c = np.radians(words[:, 3:]).T
    x, y, z = words[:, :3].T
    y, z = np.cos(a) * y - np.sin(a) * z, np.cos(a) * z + np.sin(a) * y
    return np.stack((np.cos(c) * x - np.sin(c) * y, np.cos(c) * y + np.sin(c) * x, z), axis=1)


def winding(seed: int) -> Program:
    """Few long moves with large turns of the axis, off the zero of the part."""
    random = np.random.default_rng(seed)
    number = np.arange(14)
    tip = np.stack((8.0 * number, 25.0 + 3.0 * np.sin(number), 10.0 + random.normal(0.0, 1.0, 14)), axis=1)
    lean, turn = np.radians(25.0 + 8.0 * np.sin(0.7 * number)), np.radians(11.0 * number + random.normal(0.0, 3.0, 14))
    axis = np.stack((np.sin(lean) * np.sin(turn), np.sin(lean) * np.cos(turn), np.cos(lean)), axis=1)
    return Program.from_poses(tip, axis, feed=6000.0)


def rates_of(law: TimeLaw, words: Floats, way: Floats, begin: float, end: float, t: Floats, order: int) -> Floats:
    """Derivatives by time of the words of a block (`PLACES`, 5), from times `t` evenly apart."""
    gone = (law.kinematics(t)[0] - begin) * way[-1] / (end - begin)
    share = np.interp(gone, way, np.linspace(0.0, 1.0, PLACES))
    place = words[0] + share[:, None] * (words[-1] - words[0])
    return np.diff(place, order, axis=0) / (t[1] - t[0]) ** order


@pytest.mark.parametrize("seed", range(2))
def test_the_written_words_keep_the_limits_of_the_axes(seed: int) -> None:
    machine, program = load_machine("table-ac"), winding(seed)
    form = choose_form("fanuc", "g1", machine=machine, tcp=False)
    settings = fit_settings(Settings(tolerance=0.05), form, program.units)
    stream = io.BytesIO()
    write(smooth(program, settings), stream, form=form)
    law = plan_text(read_back(stream.getvalue(), form, settings), Limits(), settings=settings, machine=machine)

    rows, lines = blocks_of(stream.getvalue().decode())
    most = np.array([{item.name: item.per_second for item in machine.dynamics}[name] for name in "XYZAC"]).T
    of_element = law.path.program.line[law.path.move]
    used, looked_at, last = np.zeros((4, 5)), 0, None
    for before, after, line in zip(rows[:-1], rows[1:], lines[1:], strict=True):
        own = np.flatnonzero((of_element == line) & ~law.path.rapid)
        if not len(own):
            last = None
            continue
        begin, end = law.edge[own[0]], law.edge[own[-1] + 1]
        times = law.times_at(np.array([begin, end]))
        words = before + np.linspace(0.0, 1.0, PLACES)[:, None] * (after - before)
        way = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(tips_of(words), axis=0), axis=1)))
        assert way[-1] == pytest.approx(end - begin, rel=2e-3)  # the words are those that were planned

        rates = partial(rates_of, law, words, way, begin, end)
        t = np.arange(times[0] + STEP / 10.0, times[1] - STEP / 10.0, STEP)
        looked_at += len(t)
        for order in range(min(3, len(t) - 1)):
            used[order] = np.maximum(used[order], np.abs(rates(t, order + 1)).max(axis=0) / most[order])
        first = rates(times[0] + np.array([0.0, SHORT]), 1)[0]
        if last is not None:
            used[3] = np.maximum(used[3], np.abs(first - last) / (most[1] * law.limits.period))
        last = rates(times[1] - np.array([SHORT, 0.0]), 1)[0]
    assert looked_at > 200
    speed, acceleration, jerk, jump = used.max(axis=1)
    assert speed <= 1.0
    assert 0.8 < acceleration <= 1.0  # near its limit: else nothing was judged
    assert 0.9 < jerk <= 1.005
    assert 0.8 < jump <= 1.06  # of the speed at a border of blocks, which changes by SHORT times the acceleration
