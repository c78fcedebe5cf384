"""Texts that are still being written while they are read."""

from __future__ import annotations

import threading
import time

import pytest

from cornersmooth.control.source import Source
from cornersmooth.errors import InputError

WHOLE = b"".join(b"N%d G1 X%d\n" % (k, k) for k in range(900))


def test_text_is_read_by_one_thread_while_another_writes(tmp_path):
    """What is not there yet is waited for; nothing is read twice or left out."""
    path = tmp_path / "growing"
    path.write_bytes(b"")
    source = Source(path)

    def fill():
        with path.open("ab") as file:
            for begin in range(0, len(WHOLE), 999):
                file.write(WHOLE[begin : begin + 999])
                file.flush()
                time.sleep(0.001)
        source.finish()

    writer = threading.Thread(target=fill)
    writer.start()
    read = list(iter(lambda: source.read(700), b""))
    writer.join()
    assert b"".join(read) == WHOLE
    assert {len(part) for part in read[:-1]} == {700}
    source.close()


def test_bytes_are_read_from_their_beginning_on():
    source = Source(WHOLE)
    assert source.read(100) + source.read(10**6) == WHOLE
    assert source.read(5) == b""


def test_file_that_is_not_there(tmp_path):
    with pytest.raises(InputError, match="cannot read"):
        Source(tmp_path / "none.nc")
