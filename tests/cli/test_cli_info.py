"""``cornersmooth info`` on a sample, a table of points and standard input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from cornersmooth.cli.commands import COMMANDS
from cornersmooth.errors import InputError
from oracle.messages import one_line

SAMPLE = Path(__file__).resolve().parents[2] / "samples" / "impeller.cls"


def run(*args: str, data: bytes = b"") -> str:
    result = CliRunner().invoke(COMMANDS["info"], args, input=data, standalone_mode=False, catch_exceptions=False)
    assert result.return_value == 0
    return result.stdout


def test_json_is_one_object_with_the_numbers_of_the_file():
    contents = json.loads(run(str(SAMPLE), "--json", "-e", "0.02", "-H", "12"))
    assert (contents["name"], contents["dialect"], contents["poses"]) == ("impeller.cls", "nx", 610)
    assert contents["motion"]["moves"] == {"rapid": 18, "linear": 592}
    assert contents["motion"]["chains"] == 6
    assert contents["motion"]["feeds_mm_per_min"] == [250, 800, 1500]
    assert contents["axis"]["kind"] == "simultaneous"
    assert (contents["corners"]["tolerance_mm"], contents["corners"]["axis_length_mm"]) == (0.02, 12)
    assert contents["corners"]["sharp"] == 24  # engage, trailing edge and its end, retract of six passes


def test_lines_to_read_say_the_same():
    text = run(str(SAMPLE), "-e", "0.02")
    assert "impeller.cls: nx, mm" in text
    assert "18 rapid, 592 linear" in text
    assert "6, the longest 107 poses" in text
    assert "250, 800, 1500 mm/min" in text
    assert "turns while cutting" in text
    assert "at 0.02 mm" in text


def test_standard_input_and_reading_options():
    text = run("-", "--units", "inch", data=b"0 0 0\n1 0 0\n1 1 0\n")
    assert "<stdin>: csv, inch" in text
    assert "50.8 mm of lines at feed" in text
    assert "2 moves without" in text
    assert "<stdin>: note: no columns for the tool axis: +Z is used" in one_line(text)


def test_errors_name_file_and_line(tmp_path: Path):
    path = tmp_path / "bad.csv"
    path.write_text("1,2,3\n1,2\n")
    with pytest.raises(InputError, match=r"bad\.csv:2: error\[\w+\]: 2 columns where 3 are expected"):
        run(str(path))
