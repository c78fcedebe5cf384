"""Malformed files: the first line of each says the exact message; one that is accepted is a failure."""

from __future__ import annotations

from pathlib import Path
from unittest.mock import patch

import pytest

from cornersmooth.cl import bulk, messages, read
from cornersmooth.cl.apt import read_apt
from cornersmooth.cl.source import clean
from cornersmooth.errors import InputError
from oracle.messages import one_line

FILES = sorted((Path(__file__).parent.parent / "bad").glob("*.cls"))
EXPECT = "$$ expect: "

#: codes of errors that need another file than a text: unreadable, broken gzip; and of tables of points
NOT_TEXT = {"CS199", "CS206", "CS100", "CS103", "CS191"} | {f"CS{number}" for number in range(150, 180)}


def test_there_are_enough() -> None:
    assert len(FILES) >= 60


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_message(path: Path) -> None:
    first = path.read_text(encoding="utf-8").splitlines()[0]
    assert first.startswith(EXPECT)
    with pytest.raises(InputError) as caught:
        read(path, name="x")
    assert one_line(caught.value) in (f"x:{first.removeprefix(EXPECT)}", f"x: {first.removeprefix(EXPECT)}")


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_careful_reader_says_the_same(path: Path) -> None:
    said = []
    for find_plain in (bulk.find_plain, lambda text: None):
        with pytest.raises(InputError) as caught, patch.object(bulk, "find_plain", find_plain):
            read_apt(clean(path.read_bytes(), "x"), name="x")
        said.append(str(caught.value))
    assert said[0] == said[1]


def test_every_error_has_a_file() -> None:
    met = set()
    for path in FILES:
        with pytest.raises(InputError) as caught:
            read(path)
        met.add(caught.value.code)
    assert met == {code[:5] for code in messages.ERRORS} - NOT_TEXT


@pytest.mark.parametrize("data", [b"", b"\n \n", b"\x1a", b"\xef\xbb\xbf"])
def test_empty(data: bytes) -> None:
    with pytest.raises(InputError, match=r"^<stdin>:1: error\[\w+\]: holds no tool positions\nhint: ") as caught:
        read(data, name="<stdin>")
    assert (caught.value.code, caught.value.line) == ("CS101", 1)


@pytest.mark.parametrize("data", [b"\x7fELF\x00\x01" * 9, b"\xff\xfe\x00", b"GOTO/1,2,3\n\x00"])
def test_binary(data: bytes) -> None:
    with pytest.raises(InputError, match="is a binary file"):
        read(data)
