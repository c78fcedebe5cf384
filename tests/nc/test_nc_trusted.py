"""Machine functions that a shop's own table declares to move nothing, and the speed in the block of a tool change."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from cornersmooth.errors import SettingsError
from cornersmooth.nc.control_tables import parse_control
from oracle.command import run

CL = """LOADTL/3
SPINDL/3000,RPM,CLW
COOLNT/ON
FEDRAT/250,MMPM
RAPID
GOTO/0,0,10,0,0,1
GOTO/0,0,0
GOTO/10,0,0
GOTO/10,10,0
RAPID
GOTO/10,10,50
FINI
"""
#: a table with functions of the shop, and what each is like
TABLES = {
    "fanuc": 'tool_change = ["T{tool} M6", "M208"]\ncoolant = { ON = ["M51"] }',
    "siemens": 'tool_change = ["T{tool}", "M6", "M208"]\ncoolant = { ON = ["M51"] }',
    "heidenhain": 'tool_change = ["TOOL CALL {tool} Z", "M208"]\ncoolant = { ON = ["M51"] }',
}


def smoothed(folder: Path, like: str, trusted: str, *more: str, words: str = "", cl: str = CL) -> tuple[int, list[str]]:
    (folder / "part.cls").write_text(cl)
    (folder / "shop.toml").write_text(f'{trusted}\nlike = "{like}"\n[words]\n{words or TABLES[like]}\n')
    told = run("smooth", "part.cls", "--control", "./shop.toml", "-o", "o.nc", "--strict", "--force", *more, cwd=folder)
    return told.returncode, told.stderr.decode().splitlines()


@pytest.mark.parametrize("like", TABLES)
def test_functions_that_are_trusted_pass_under_strict_and_others_do_not(like: str, tmp_path: Path) -> None:
    code, told = smoothed(tmp_path, like, "")
    assert (code, told[0].split(",")[0]) == (1, "NOT VERIFIED")
    assert "M208" in told[1]
    code, told = smoothed(tmp_path, like, 'trusted = ["M208"]')
    assert (code, told[0].split(",")[0]) == (1, "NOT VERIFIED")
    assert "M51" in told[1]
    assert "M208" not in told[1]
    code, told = smoothed(tmp_path, like, 'trusted = ["M208", "M51", "M52"]')
    assert (code, told[0].split(",")[0]) == (0, "PASSED")
    assert any("not compared with the CL file: M208" in line for line in told)  # accepted, and still named
    found = run("verify", "part.cls", "o.nc", "--control", "./shop.toml", "--strict", cwd=tmp_path)
    assert (found.returncode, found.stdout.split(b",")[0].split(b":")[0]) == (0, b"PASSED")


def test_a_trusted_function_beside_a_word_that_may_move_the_tool_is_not_accepted(tmp_path: Path) -> None:
    words = 'tool_change = ["T{tool} M6", "M208 G65 P9023"]'
    code, told = smoothed(tmp_path, "fanuc", 'trusted = ["M208"]', words=words)
    assert (code, told[0].split(",")[0].split(":")[0]) == (1, "NOT VERIFIED")


def test_a_trusted_function_in_the_header_is_accepted(tmp_path: Path) -> None:
    (tmp_path / "head.txt").write_text("M208\n")
    words = "tool_select = []"
    assert smoothed(tmp_path, "fanuc", "", "--header", "head.txt", words=words)[0] == 1
    assert smoothed(tmp_path, "fanuc", 'trusted = ["M208"]', "--header", "head.txt", words=words)[0] == 0


def test_a_function_in_the_cut_that_nobody_asked_for_is_still_found(tmp_path: Path) -> None:
    """Trust is for blocks of the table; the same word anywhere else in a program is wrong as ever."""
    assert smoothed(tmp_path, "fanuc", 'trusted = ["M208", "M51", "M777"]')[0] == 0
    lines = (tmp_path / "o.nc").read_text().splitlines()
    cut = next(number for number, line in enumerate(lines) if line.startswith("G1"))
    (tmp_path / "o.nc").write_text("\n".join([*lines[: cut + 1], "M777", *lines[cut + 1 :], ""]))
    assert run("verify", "part.cls", "o.nc", "--control", "./shop.toml", cwd=tmp_path).returncode == 1


@pytest.mark.parametrize(
    ("like", "patterns", "why"),
    [
        ("fanuc", '["M.*"]', "'M.*' is no function of the shop"),
        ("fanuc", '["M208", "M8"]', "'M8' is no function of the shop"),
        ("fanuc", '["M08"]', "'M08' is no function of the shop"),
        ("haas", '["M88"]', "'M88' is no function of the shop"),
        ("fanuc", '["M96"]', "'M96' is no function of the shop"),
        ("heidenhain", '["M140"]', "'M140' is no function of the shop"),
        ("linuxcnc", '["M428"]', "'M428' is no function of the shop"),
        ("fanuc", '["G65"]', "is no function of the shop"),
        ("fanuc", '["X1"]', "is no function of the shop"),
        ("fanuc", '["M208 X1"]', "is no function of the shop"),
        ("fanuc", '[".208"]', "is no function of the shop"),
        ("fanuc", '["M5[12]"]', "give machine functions"),
        ("fanuc", '"M208"', "trusted is 'M208'"),
    ],
)
def test_what_may_move_the_tool_cannot_be_trusted(like: str, patterns: str, why: str) -> None:
    with pytest.raises(SettingsError, match=r"trusted") as error:
        parse_control(f'like = "{like}"\ntrusted = {patterns}\n')
    assert why in str(error.value)


TWO_TOOLS = CL.replace("COOLNT/ON\n", "").replace("FINI\n", "LOADTL/4\n{}RAPID\nGOTO/0,0,50\nGOTO/0,0,0\nFINI\n")


@pytest.mark.parametrize(
    ("like", "words", "calls"),
    [
        ("heidenhain", 'tool_change = ["TOOL CALL {tool} Z S{speed}"]', ("TOOL CALL 3 Z S3000", "TOOL CALL 4 Z S{}")),
        ("fanuc", 'tool_change = ["T{tool} M6", "S{speed}"]', ("S3000", "S{}")),
    ],
)
@pytest.mark.parametrize(
    ("second", "speed"),
    [
        ("SPINDL/500,RPM,CLW\n", 500),
        ("", 3000),
        ("CUTTER/10\nTLDATA/MILL,10,0,50,0,0\nSPINDL/31.4159265,SMM,CLW\n", 1000),
    ],
)
def test_the_block_of_a_tool_change_may_have_the_first_speed_of_the_tool(
    like: str, words: str, calls: tuple[str, str], second: str, speed: int, tmp_path: Path
) -> None:
    """The speed of the SPINDL after the tool, or what holds; 31.4159 m/min at a diameter of 10 mm are 1000 rev/min."""
    code, told = smoothed(tmp_path, like, "", words=words, cl=TWO_TOOLS.format(second))
    assert (code, told[0][:6]) == (0, "PASSED"), told
    blocks = [line.lstrip("0123456789 ") for line in (tmp_path / "o.nc").read_text().splitlines()]
    changes = [k for k, block in enumerate(blocks) if "M6" in block or re.match(r"TOOL CALL \d", block)]
    assert len(changes) == 2
    assert all(call.format(speed) in blocks[at : at + 2] for at, call in zip(changes, calls, strict=True))


def test_a_tool_without_any_speed_is_an_error_of_its_line(tmp_path: Path) -> None:
    words = 'tool_change = ["TOOL CALL {tool} Z S{speed}"]'
    code, told = smoothed(tmp_path, "heidenhain", "", words=words, cl=CL.replace("SPINDL/3000,RPM,CLW\n", ""))
    assert code == 3
    assert told[0].startswith("part.cls:1: error")
    assert "gives tool 3 none" in told[0]
