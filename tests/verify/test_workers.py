"""Work in processes of their own: the same results in the same order, whatever happens on the way."""

from __future__ import annotations

import io
import os
import signal
import sys
from dataclasses import fields

import numpy as np
import pytest

from cornersmooth.model import Move, Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import blocks, read_nc, verify, workers
from cornersmooth.verify import ring as ring_of

from .writing import wavy

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely")


def nowhere(_item):
    return False


@pytest.mark.parametrize("processes", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 4, 5, 40])
def test_results_come_in_order(processes, count):
    found = list(workers.apart(lambda item: (item, os.getpid()), range(count), processes, nowhere))
    assert [item for item, _ in found] == list(range(count))
    used = {process for _, process in found}
    if processes > 1 and count >= 5:
        assert len(used) == processes
        assert os.getpid() not in used
    else:
        assert used <= {os.getpid()}


def test_large_items_and_results_do_not_stand_still():
    data = bytes(3_000_000)
    found = list(workers.apart(lambda item: item[1] * 2, ((k, data) for k in range(12)), 2, nowhere))
    assert [len(item) for item in found] == [6_000_000] * 12


def test_some_items_stay_here():
    found = list(workers.apart(lambda item: os.getpid(), range(20), 2, lambda item: item % 4 == 0))
    assert [process == os.getpid() for process in found] == [k % 4 == 0 for k in range(20)]


def test_items_are_taken_a_fixed_number_ahead():
    seen = []
    for processes in (1, 2, 3):
        taken, given = [], []

        def items(taken=taken, given=given):
            for k in range(30):
                taken.append(len(given))
                yield k

        for found in workers.apart(lambda item: item, items(), processes, nowhere):
            given += [found]
        seen.append(taken)
    assert seen[0] == seen[1] == seen[2]


def test_error_of_a_process_is_raised_here():
    def work(item):
        if item == 17:
            raise ValueError("seventeen")
        return item

    with pytest.raises(ValueError, match="seventeen"):
        list(workers.apart(work, range(30), 2, nowhere))


def test_process_that_is_killed_is_want_of_memory():
    def work(item):
        if item == 8:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    with pytest.raises(MemoryError):
        list(workers.apart(work, range(30), 2, nowhere))


def test_nobody_is_left_behind():
    from multiprocessing import active_children

    found = workers.apart(lambda item: item, range(30), 2, nowhere)
    assert next(found) == 0
    assert active_children()
    found.close()
    assert not active_children()


def test_verification_is_the_same(monkeypatch):
    monkeypatch.setattr(blocks, "BLOCK", 700)
    tip, axis = wavy(1500)
    kind = np.where(np.arange(1500) % 60, Move.LINEAR, Move.RAPID).astype(np.uint8)
    program = Program.from_poses(tip, axis, kind=kind, feed=np.full(1500, 250.0))
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(tolerance=0.02), choose_form(), "mm")), stream)
    nc = read_nc(stream.getvalue())
    used = []
    monkeypatch.setattr(workers._Crew, "start", _counted(workers._Crew.start, used))
    one, two = (verify(program, nc, tolerance=0.02, processes=processes) for processes in (1, 2))
    for field in fields(one):
        np.testing.assert_equal(getattr(one, field.name), getattr(two, field.name), err_msg=field.name)
    assert len(used) > 3


def _counted(start, used):
    def counted(crew, item):
        used.append(item)
        return start(crew, item)

    return counted


def test_ring_hands_on_in_turn():
    def work(place):
        said = []
        for k in range(place.index, 10, place.count):
            total = (place.take() if k else 0) + k
            said.append((k, total))
            place.give(total)
        return said

    for count in (1, 2, 3):
        if count == 1:
            found = [work(ring_of.Place())]
        else:
            ring = ring_of.Ring(work, count)
            found = ring.results()
            ring.end()
        assert sorted(pair for part in found for pair in part) == [(k, k * (k + 1) // 2) for k in range(10)]


@pytest.mark.parametrize("who", [0, 1, 2])
def test_ring_raises_what_one_of_it_has_raised(who):
    def work(place):
        if place.index == who:
            raise ValueError(f"place {who}")
        return place.take()

    ring = ring_of.Ring(work, 3)
    with pytest.raises(ValueError, match=f"place {who}"):
        ring.results()
    ring.end()


def test_ring_with_a_killed_process_is_want_of_memory():
    def work(place):
        if place.index == 1:
            os.kill(os.getpid(), signal.SIGKILL)
        place.give(1)
        return bytes(1_000_000)

    ring = ring_of.Ring(work, 2)
    with pytest.raises(MemoryError):
        ring.results()
    ring.end()
