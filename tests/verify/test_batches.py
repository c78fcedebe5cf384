"""Texts in many small batches: the same as in one, with any number of processes, also while the text grows."""

from __future__ import annotations

import io
import os
import re
import sys
import threading
import time
from dataclasses import fields, replace

import numpy as np
import pytest

from cornersmooth.control import source
from cornersmooth.errors import InputError
from cornersmooth.model import FeedMode, Move, Program, Statement
from cornersmooth.nc import Frame, choose_form, fit_settings, write
from cornersmooth.nc_reader import reader
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import Verifier, Where, stretches, verifier, verify
from oracle.share import share

from .writing import unit, wavy

TOLERANCE = 0.02
forks = pytest.param(3, marks=pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely"))


@pytest.fixture
def used(monkeypatch):
    """Small batches for all texts; takes down how many there were."""
    found = []
    work = verifier.map_in_processes

    def noted(function, items, processes, **how):
        count = 0
        for result in work(function, items, processes, **how):
            count += 1
            yield result
        found.append(count)

    monkeypatch.setattr(verifier, "map_in_processes", noted)
    monkeypatch.setattr(stretches, "BATCH", 150)
    monkeypatch.setattr(reader, "GIVEN_OUT", 170)
    monkeypatch.setattr(verifier, "_LONG", 0)
    return found


def part(count=600, every=45, units="mm", seed=0, fixed=False):
    """Passes between rapids, with changes of feed, tools, stops and an axis that stands still for a while."""
    tip, axis = wavy(count, seed=seed)
    axis[count // 3 : count // 2] = axis[count // 3]
    if fixed:
        axis[:] = [0, 0, 1]
    kind = np.where(np.arange(count) % every, Move.LINEAR, Move.RAPID).astype(np.uint8)
    feed = np.full(count, 250.0)
    feed[count // 4 : count // 2] = 400.0
    feed[-count // 5 :] = 123.5
    statements = (
        Statement(0, 1, "LOADTL", (3.0,), "LOADTL/3"),
        Statement(0, 2, "SPINDL", (9000.0, "RPM", "CLW"), "SPINDL/9000,RPM,CLW"),
        Statement(min(every * 4, count), 3, "COOLNT", ("ON",), "COOLNT/ON"),
        Statement(min(every * 7, count), 4, "OPSTOP", (), "OPSTOP"),
        Statement(min(every * 9 + 11, count), 5, "DELAY", (1.5,), "DELAY/1.5"),
        Statement(min(every * 12, count), 6, "COOLNT", ("OFF",), "COOLNT/OFF"),
        Statement(count, 7, "FINI", (), "FINI"),
    )
    line = np.arange(100, 100 + count)
    return Program.from_poses(tip, unit(axis), kind=kind, feed=feed, line=line, statements=statements, units=units)


def text_of(program, control="fanuc", form="g1", frame=None, **settings):
    stream = io.BytesIO()
    chosen = choose_form(control, form)
    wanted = Settings(tolerance=TOLERANCE, **{"method": "proportional", **settings})
    smoothed = smooth(program, fit_settings(wanted, chosen, program.units))
    write(smoothed, stream, form=chosen, frame=frame or Frame())
    return stream.getvalue()


#: what was found in programs as a whole: the same for any number of processes
WHOLE = {}


def check(program, text, used, processes=1, batches_used=True, everywhere=True, **reading):
    """Verify in small batches and in large ones, and compare; return the result."""
    used.clear()
    found = verify(program, text, tolerance=TOLERANCE, processes=processes, **reading)
    if processes == 1:  # else it is noted in another process
        assert used[-1] > 2 or not batches_used
    if (case := (text, *reading.items())) not in WHOLE:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(stretches, "BATCH", 1 << 16)
            patch.setattr(reader, "GIVEN_OUT", 1 << 15)
            WHOLE[case] = verify(program, text, tolerance=TOLERANCE, **reading)
            assert used[-1] == 1
    expected = WHOLE[case]
    if not expected.passed:
        # what is nearest to a vertex far off its way depends a little on what its batch holds
        assert found.problems[0].code[:4] == expected.problems[0].code[:4]
        assert found.problems[0].nc_line == expected.problems[0].nc_line
        for mine, theirs in ((found, expected), (expected, found)):
            lines = np.array([at.nc_line for at in theirs.problems])
            assert all(np.abs(lines - at.nc_line).min() < 20 for at in mine.problems) or not everywhere
        assert found.tip.value == pytest.approx(expected.tip.value, rel=0.02)
        assert found.axis_point.value == pytest.approx(expected.axis_point.value, rel=0.02)
        return found
    for field in fields(expected):
        mine, theirs = getattr(found, field.name), getattr(expected, field.name)
        if field.name == "pose_nc_line":  # a pose at the joint of two batches is near both; blocks may stand between
            assert np.abs(mine - theirs).max() <= 5
        elif isinstance(theirs, np.ndarray):
            np.testing.assert_allclose(mine, theirs, atol=1e-9, rtol=0)
        elif isinstance(theirs, Where):
            assert mine.value == pytest.approx(theirs.value, abs=1e-9), field.name
        else:
            assert mine == theirs, field.name
    return found


ONE_BY_ONE = [
    ("fanuc", "g1"),
    ("fanuc", "g6.2"),
    ("siemens", "g1"),
    ("siemens", "bspline"),
    ("siemens", "poly"),
    ("heidenhain", "g1"),
    ("generic", "g1"),
]


@pytest.mark.parametrize(
    ("control", "form", "processes"),
    [
        *((*case, 1) for case in ONE_BY_ONE),
        *(pytest.param(*case, 3, marks=forks.marks) for case in share(ONE_BY_ONE, 4, 1)),
    ],
)
def test_same_as_the_whole(used, control, form, processes):
    program = part(400)
    assert check(program, text_of(program, control, form), used, processes, control=control).passed


@pytest.mark.parametrize("processes", [1, forks])
def test_inches_block_numbers_and_a_fixed_tool(used, processes):
    cases = ((part(units="inch"), None), (part(fixed=True), None), (part(), Frame(block_numbers=True)))
    for program, frame in share(cases, 2, processes != 1):
        assert check(program, text_of(program, frame=frame), used, processes).passed


def test_feed_said_long_before(used):
    """A feed may hold for many batches."""
    program = part()
    text = text_of(program)
    assert text.count(b"F250.") == 3  # at the start, after a stop, and after another feed
    assert check(program, text, used, 3 if sys.platform == "linux" else 1).passed
    per_revolution = np.full(len(program), FeedMode.PER_REVOLUTION, np.uint8)
    program = Program.from_poses(
        program.tip, program.axis, kind=program.kind, feed=0.1 + 0 * program.feed, feed_mode=per_revolution
    )
    assert check(program, text_of(program), used, 3 if sys.platform == "linux" else 1).passed


def _spoilt(lines):
    """Texts that are wrong in one of the later batches."""
    motion = [k for k, line in enumerate(lines) if line.startswith("G1 ")]
    rapids = [k for k, line in enumerate(lines) if line.startswith("G0 ")]
    middle = motion[len(motion) // 2]
    yield "block left out", [*lines[:middle], *lines[middle + 7 :]], "CS52"
    yield "rapid left out", [*lines[: rapids[9]], *lines[rapids[9] + 1 :]], "CS5"
    yield "another feed", [line.replace("F400.", "F40.") for line in lines], "CS541"
    yield "stop left out", [line for line in lines if line != "M1"], "CS555"
    yield "units", [*lines[:middle], "G20", *lines[middle:]], "CS505"
    yield "end left out", [*lines[: motion[-200]], "M30", "%"], "CS5"
    yield "bad number", [*lines[:middle], lines[middle].replace("X", "X9"), *lines[middle + 1 :]], "CS521"
    yield "other tool", [line.replace("T3 M6", "T4 M6") for line in lines], "CS551"
    yield "no control", [line for line in lines if not line.startswith("G43.5")], "CS506"


@pytest.mark.parametrize("processes", [1, forks])
def test_what_is_wrong_is_reported_as_for_the_whole(used, processes):
    program = part()
    lines = text_of(program, chord_tolerance=TOLERANCE / 10).decode().splitlines()
    for name, spoilt, code in share(_spoilt(lines), 3, processes != 1):
        # behind a change of units no rapid fits any more: which is missed for which is decided batch by batch
        text = ("\n".join(spoilt) + "\n").encode()
        found = check(program, text, used, processes, batches_used=False, everywhere=name != "units")
        assert not found.passed, name
        assert any(problem.code.startswith(code) for problem in found.problems), name


@pytest.mark.parametrize("processes", [1, forks])
def test_what_cannot_be_read_says_its_line(used, processes):
    program = part()
    lines = text_of(program).decode().splitlines()
    lines.insert(700, "G91")
    with pytest.raises(InputError) as failure:
        verify(program, "\n".join(lines).encode(), tolerance=TOLERANCE, processes=processes)
    assert failure.value.line == 701


@pytest.mark.parametrize(
    ("control", "form", "processes"),
    [
        *((*case, 1) for case in share(ONE_BY_ONE[:4], 3)),
        *(pytest.param(*case, 3, marks=forks.marks) for case in share(ONE_BY_ONE[:4], 4, 1)),
    ],
)
def test_pass_longer_than_batches_is_cut(used, control, form, processes):
    program = part(300, every=290)
    text = text_of(program, control, form)
    assert check(program, text, used, processes, control=control).passed
    lines = text.decode().splitlines()
    number = len(lines) // 2
    while not lines[number].startswith("G1 X"):
        number += 1
    spoilt = [*lines[:number], lines[number].replace("X", "X9", 1), *lines[number + 1 :]]
    found = check(
        program,
        ("\n".join(spoilt) + "\n").encode(),
        used,
        processes,
        batches_used=False,
        everywhere=False,
        control=control,
    )
    assert abs(found.problems[0].nc_line - number) < 3


def test_pass_that_runs_to_and_fro_is_cut(used):
    """Where a path runs to and fro on the same line only its length tells where a place is."""
    steps = np.tile([0.0, 4.0], 900)
    tip = np.stack((steps, 0 * steps, 0 * steps), axis=1)
    program = Program.from_poses(tip, np.tile([0.0, 0.0, 1.0], (1800, 1)), feed=np.full(1800, 250.0))
    assert check(program, text_of(program), used).passed


@pytest.mark.parametrize("processes", [1, forks])
def test_a_wrong_guess_lets_nothing_pass(used, monkeypatch, processes):
    """Where a long stretch is cut the place is guessed."""
    program = part(150, every=140)
    text = text_of(program)
    right = verify(program, text, tolerance=TOLERANCE, processes=processes)
    assert right.passed

    for off in share((7.5, 0.0), 2) if processes != 1 else (7.5, 0.0):
        monkeypatch.setattr(stretches.Stretches, "_guess", lambda *given, off=off: np.minimum(given[2] + off, given[3]))
        assert verify(program, text, tolerance=TOLERANCE, processes=processes).verdict in ("FAILED", "NOT VERIFIED")
    for number in share((30, 1, 39), 3) if processes != 1 else (30, 1, 39):
        spoilt = text.replace(b"G1 X", b"G1 X9", number + 1).replace(b"G1 X9", b"G1 X", number)
        assert verify(program, spoilt, tolerance=TOLERANCE, processes=processes).verdict == "FAILED"


@pytest.mark.parametrize("processes", [1, forks])
def test_text_that_is_still_being_written(used, tmp_path, processes):
    program = part()
    text = text_of(program)
    path = tmp_path / "growing.nc"
    path.write_bytes(b"")
    with Verifier(program, path, tolerance=TOLERANCE, processes=processes) as verifier:
        with path.open("ab") as file:
            for begin in range(0, len(text), 7001):
                file.write(text[begin : begin + 7001])
                file.flush()
                time.sleep(0.002)
        found = verifier.result()
    assert processes > 1 or used[-1] > 4
    assert found.passed
    assert found.blocks == verify(program, text, tolerance=TOLERANCE).blocks


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely")
def test_nobody_waits_for_a_text_that_is_not_finished(used, tmp_path):
    from multiprocessing import active_children

    path = tmp_path / "growing.nc"
    path.write_bytes(b"%\n")
    verifier = Verifier(part(), path, tolerance=TOLERANCE, processes=2)
    with verifier:
        assert len(active_children()) == 1
    assert not active_children()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes here")
@pytest.mark.parametrize("processes", [1, forks])
def test_text_from_a_pipe(used, tmp_path, processes):
    program = part()
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    writer = threading.Thread(target=pipe.write_bytes, args=(text_of(program),))
    writer.start()
    assert verify(program, pipe, tolerance=TOLERANCE, processes=processes).passed
    writer.join()
    assert processes > 1 or used[-1] > 4


def _moved(line, by):
    return re.sub(r"(?<=X)-?\d+\.\d+", lambda found: f"{float(found[0]) + by:.4f}", line)


def test_rapids_that_miss_their_poses_one_after_another_are_those_of_their_poses(used, monkeypatch):
    """What is at hand of the text may be fewer rapids than are looked for: the rest of them is still to come."""
    monkeypatch.setattr(source, "CHUNK", 4000)
    program = part(count=600, every=5)
    lines = text_of(program).decode().splitlines()
    rapids = [k for k, line in enumerate(lines) if re.match(r"(G0 |)X.*I", line) and "G0" in line][30:70]
    for k in rapids:
        lines[k] = _moved(lines[k], 0.05)
    found = verify(program, ("\n".join(lines) + "\n").encode(), tolerance=TOLERANCE, processes=1)
    assert used[-1] > 2
    assert [at.nc_line for at in found.problems if at.code == "CS531"] == [k + 1 for k in rapids]
    assert not {"CS532", "CS533", "CS535", "CS536"} & {at.code for at in found.problems}


@pytest.mark.parametrize("processes", [1, forks])
def test_feed_moves_without_end_behind_the_last_pose_are_said_once(used, processes):
    program = replace(part(), kind=np.append(part().kind[:-1], Move.RAPID).astype(np.uint8))
    lines = text_of(program).decode().splitlines()
    last = next(k for k in reversed(range(len(lines))) if "X" in lines[k])
    more = [_moved(line, 0.5 + 0.01 * k) for k, line in enumerate(2000 * [lines[last].replace("G0", "G1")])]
    text = ("\n".join([*lines[: last + 1], *more, *lines[last + 1 :]]) + "\n").encode()
    found = check(program, text, used, processes)
    assert [(at.code, at.nc_line) for at in found.problems if at.code == "CS536"] == [("CS536", last + 2)]
