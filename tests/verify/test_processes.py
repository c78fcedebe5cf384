"""Work in processes of their own: the same results in the same order, whatever happens on the way."""

from __future__ import annotations

import io
import os
import signal
import sys
import time
from dataclasses import fields

import numpy as np
import pytest

from cornersmooth.model import Move, Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc_reader import read_nc
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.system import processes as crews
from cornersmooth.verify import stretches, verifier, verify

from .writing import wavy

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux forks safely")


@pytest.mark.parametrize("processes", [1, 2, 3])
@pytest.mark.parametrize("count", [0, 1, 4, 5, 40])
def test_results_come_in_order(processes, count):
    found = list(crews.map_in_processes(lambda item: (item, os.getpid()), range(count), processes))
    assert [item for item, _ in found] == list(range(count))
    used = {process for _, process in found}
    if processes > 1:
        assert len(used) == min(processes, count)
        assert os.getpid() not in used
    else:
        assert used <= {os.getpid()}


def test_large_items_and_results_do_not_stand_still():
    data = bytes(3_000_000)
    found = list(crews.map_in_processes(lambda item: item[1] * 2, ((k, data) for k in range(12)), 2))
    assert [len(item) for item in found] == [6_000_000] * 12


@pytest.mark.parametrize("room", [1 << 12, 1 << 20])
def test_arrays_of_items_come_whole_whether_they_have_room_or_not(monkeypatch, room):
    monkeypatch.setattr(crews, "_ROOM", room)

    def work(item):
        number, arrays = item
        arrays[0][:1] += 1.0  # as in the process that made them
        return number, arrays[::-1]

    def item(k):
        return [np.full(5 + k, k / 3.0), np.zeros(0), np.arange(100.0 * k), np.full((300, 3), k)[:, ::2], np.True_]

    found = list(crews.map_in_processes(work, ((k, item(k)) for k in range(20)), 2))
    for k, (number, arrays) in enumerate(found):
        wanted = item(k)
        wanted[0][:1] += 1.0
        assert number == k
        assert all(np.array_equal(one, other) for one, other in zip(arrays[::-1], wanted, strict=True))


def test_an_item_goes_to_a_process_that_is_free(tmp_path):
    def work(item):
        if item == 3:
            (tmp_path / "third").touch()
        patience = time.monotonic() + 60.0
        while item == 0 and not (tmp_path / "third").exists() and time.monotonic() < patience:
            time.sleep(0.01)
        return os.getpid(), time.monotonic() < patience

    found = list(crews.map_in_processes(work, range(4), 2))
    assert all(in_time for _, in_time in found)
    assert [process == found[0][0] for process, _ in found] == [True, False, False, False]


def test_items_are_taken_a_fixed_number_ahead():
    seen = []
    for processes in (1, 2, 3):
        taken, given = [], []

        def items(taken=taken, given=given):
            for k in range(30):
                taken.append(len(given))
                yield k

        for found in crews.map_in_processes(lambda item: item, items(), processes):
            given += [found]
        seen.append(taken)
    assert seen[0] == seen[1] == seen[2]


def test_error_of_a_process_is_raised_here():
    def work(item):
        if item == 17:
            raise ValueError("seventeen")
        return item

    with pytest.raises(ValueError, match="seventeen"):
        list(crews.map_in_processes(work, range(30), 2))


def test_process_that_is_killed_is_want_of_memory():
    def work(item):
        if item == 8:
            os.kill(os.getpid(), signal.SIGKILL)
        return item

    with pytest.raises(MemoryError):
        list(crews.map_in_processes(work, range(30), 2))


def test_nobody_is_left_behind():
    from multiprocessing import active_children

    found = crews.map_in_processes(lambda item: item, range(30), 2)
    assert next(found) == 0
    assert active_children()
    found.close()
    assert not active_children()


def test_verification_is_the_same(monkeypatch):
    monkeypatch.setattr(stretches, "BATCH", 700)
    monkeypatch.setattr(verifier, "_LONG", 0)
    tip, axis = wavy(1500)
    kind = np.where(np.arange(1500) % 60, Move.LINEAR, Move.RAPID).astype(np.uint8)
    program = Program.from_poses(tip, axis, kind=kind, feed=np.full(1500, 250.0))
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(tolerance=0.02), choose_form(), "mm")), stream)
    nc = read_nc(stream.getvalue())
    used = []
    monkeypatch.setattr(crews.Helper, "start", _counted(crews.Helper.start, used))
    one, two = (verify(program, nc, tolerance=0.02, processes=processes) for processes in (1, 2))
    for field in fields(one):
        np.testing.assert_equal(getattr(one, field.name), getattr(two, field.name), err_msg=field.name)
    assert len(used) > 3


def _counted(start, used):
    def counted(crew, item):
        used.append(item)
        return start(crew, item)

    return counted


def _helper(work):
    """A helper that works already."""
    helper = crews.Helper(lambda _: work())
    helper.start()
    return helper


def test_helper_works_meanwhile():
    helper = _helper(lambda: (os.getpid(), bytes(1_000_000)))
    process, data = helper.result()
    helper.end()
    assert process != os.getpid()
    assert len(data) == 1_000_000


def test_helper_raises_what_its_work_raises():
    def work():
        raise ValueError("helper")

    helper = _helper(work)
    with pytest.raises(ValueError, match="helper"):
        helper.result()
    helper.end()


def test_helper_that_is_killed_is_want_of_memory():
    helper = _helper(lambda: os.kill(os.getpid(), signal.SIGKILL))
    with pytest.raises(MemoryError):
        helper.result()
    helper.end()


def test_helper_that_is_sent_away_leaves_nobody_behind(tmp_path):
    """The processes of a helper end with it."""
    from multiprocessing import active_children

    def work():
        def item(k):
            (tmp_path / f"{os.getpid()}").touch()
            time.sleep(0.02)
            return k

        return list(crews.map_in_processes(item, range(10**6), 2))

    helper = _helper(work)
    while len(list(tmp_path.iterdir())) < 2:
        time.sleep(0.005)
    used = [int(path.name) for path in tmp_path.iterdir()]
    helper.end()
    assert not active_children()
    while any(_alive(process) for process in used):
        time.sleep(0.005)


def _alive(process):
    try:
        with open(f"/proc/{process}/stat", encoding="ascii") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except OSError:
        return False
