"""The control that a text looks like."""

from __future__ import annotations

from pathlib import Path

import pytest

from cornersmooth.nc_reader.recognition import recognise_control
from oracle.command import DONE, SMALL, run
from oracle.messages import one_line

GOLDEN = sorted((Path(__file__).resolve().parents[1] / "nc" / "golden").glob("*.nc"))
#: controls with words of their own in every text
PLAIN = ("heidenhain", "linuxcnc", "siemens")


@pytest.mark.parametrize("path", GOLDEN, ids=lambda path: path.stem)
def test_texts_of_all_controls(path: Path) -> None:
    control = path.name.split(".", 1)[1].split("-")[0].removesuffix(".nc")
    allowed = {control} if control in PLAIN else {control, "fanuc", ""}
    assert recognise_control(path.read_bytes()) in allowed


@pytest.mark.parametrize("text", [b"", b"%\nO1\nG21 G90\nG1 X1. F100.\nM30\n%\n", b"(TRAORI)\nG1 X1\n", b"\xff\xfe"])
def test_nothing_is_guessed_without_a_sign(text: bytes) -> None:
    assert recognise_control(text) == ""


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    part, text = tmp_path / "part.cls", tmp_path / "part.mpf"
    part.write_bytes(SMALL)
    assert run("smooth", part, "--control", "siemens", "CORNERSMOOTH_NO_COMMENTS=1", "-o", text).returncode == DONE
    return part, text


def test_verify_takes_what_a_text_looks_like(files: tuple[Path, Path]) -> None:
    result = run("verify", *files)
    assert result.returncode == DONE
    assert one_line(result.stderr) == f"{files[1]}: warning: it looks like Siemens: --control siemens is taken\n"


def test_what_is_said_counts_more(files: tuple[Path, Path]) -> None:
    result = run("verify", *files, "--control", "fanuc")
    assert result.returncode != DONE
    assert one_line(result.stderr).splitlines()[0].endswith("warning: it looks like Siemens: --control siemens")
    assert run("verify", *files, "--control", "siemens").stderr == b""


def test_another_control_of_the_same_words_is_no_surprise(files: tuple[Path, Path], tmp_path: Path) -> None:
    text = tmp_path / "part.nc"
    given = ("--control", "mitsubishi")
    assert run("smooth", files[0], *given, "CORNERSMOOTH_NO_COMMENTS=1", "-o", text).returncode == DONE
    assert run("verify", files[0], text, *given).stderr == b""
