"""Small habits of the command line: other names of controls, plurals, blanks, warnings, terminals."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from cornersmooth.cli.commands import COMMANDS
from cornersmooth.cli.declared import HEADINGS
from cornersmooth.nc import control_aliases, control_names, load_control
from oracle.command import DONE, SMALL, USAGE, run, seen_on_a_terminal
from oracle.messages import one_line

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
IMPELLER = SAMPLES / "impeller.cls"


@pytest.mark.parametrize(
    ("name", "control"),
    [
        ("840d", "siemens"),
        ("840D sl", "siemens"),
        ("SINUMERIK", "siemens"),
        ("tnc640", "heidenhain"),
        ("TNC 640", "heidenhain"),
        ("31i", "fanuc"),
        ("31i-B5", "fanuc"),
        ("Siemens", "siemens"),
    ],
)
def test_controls_have_other_names(name: str, control: str) -> None:
    assert load_control(name) == load_control(control)


def test_other_names_mean_one_control() -> None:
    aliases = control_aliases()
    assert set(aliases.values()) == set(control_names())
    assert not set(aliases) & set(control_names())


def test_a_table_may_be_like_another_name(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text('like = "840d"\n')
    assert load_control(tmp_path / "mine.toml").dialect == "siemens"


def test_settings_of_a_control_hold_for_its_other_names(tmp_path: Path) -> None:
    (tmp_path / "cornersmooth.toml").write_text("[smooth.siemens]\nform = 'bspline'\n")
    (tmp_path / "part.cls").write_bytes(SMALL)
    assert b"BSPLINE" in run("smooth", tmp_path / "part.cls", "--control", "840d").stdout


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--control", "tnc64"), "unknown control 'tnc64'; did you mean tnc640, which is heidenhain? "),
        (("--control", "simens"), "did you mean siemens? "),
        (("--machine", "table-bac"), "did you mean table-bc? "),
        (
            ("--control", "siemens", "-f", "bspine"),
            "siemens has no form 'bspine'; did you mean bspline? ",
        ),
    ],
)
def test_the_nearest_name_is_told(options: tuple[str, ...], said: str) -> None:
    result = run("smooth", IMPELLER, *options)
    assert result.returncode == USAGE
    assert said in one_line(result.stderr)
    assert one_line(result.stderr).count("\n") == 1


def test_a_single_file_may_go_to_a_folder(tmp_path: Path) -> None:
    assert run("smooth", IMPELLER, "-d", tmp_path / "made" / "deep").returncode == DONE
    assert [path.name for path in (tmp_path / "made" / "deep").glob("[!.]*")] == ["impeller.nc"]


def test_one_is_not_several(tmp_path: Path) -> None:
    out = tmp_path / "o.nc"
    assert run("smooth", IMPELLER, "-o", out).returncode == DONE
    out.write_bytes(out.read_bytes().replace(b"F250.", b"F251.", 1))
    said = run("verify", IMPELLER, out).stdout.decode()
    assert said.startswith("FAILED: 1 problem, first in NC line 20: ")


@pytest.mark.parametrize(
    "words",
    [
        ("smooth", IMPELLER, "-v"),
        ("info", IMPELLER),
        ("time", SAMPLES / "paper_table1.csv", "--units", "mm", "--feed", "1800", "--machine", "table-ac"),
        ("controls",),
        ("machines", "table-ac"),
        ("config",),
        ("smooth", "--help"),
    ],
    ids=lambda words: words[0],
)
def test_no_trailing_blanks_and_no_colours_in_pipes(words: tuple[object, ...]) -> None:
    result = run(*words)
    text = (result.stdout + result.stderr).decode()
    assert text
    assert [line for line in text.splitlines() if line != line.rstrip()] == []
    assert "\x1b" not in text


def warnings(*words: object) -> list[str]:
    lines = one_line(run("smooth", *words).stderr).splitlines()
    return [line for line in lines if ": warning: " in line or line.startswith("CHECK  ")]


def test_what_is_strange_is_warned_of(tmp_path: Path) -> None:
    out = tmp_path / "o.nc"
    one, part = tmp_path / "one.cls", tmp_path / "part.cls"
    one.write_text("UNITS/MM\nFEDRAT/100,MMPM\nGOTO/0,0,0,0,0,1\n")
    part.write_text("UNITS/MM\nRAPID\nGOTO/0,0,0,0,0,1\nFEDRAT/100,MMPM\nGOTO/1,0,0\nGOTO/1,1,0\n")
    assert any("feeds are in mm per minute, the positions" in line for line in warnings(IMPELLER, "--units", "inch"))
    assert any("nothing is cut" in line for line in warnings(one))
    assert any("the tolerance 5 mm is larger than the whole path" in line for line in warnings(part, "-e", "5"))
    assert not any("larger than" in line for line in warnings(part, "-e", "0.1", "-o", out))


def test_time_says_what_is_saved_and_what_limits() -> None:
    given = ("--units", "mm", "--feed", "1800", "-e", "0.15")
    said = run("time", SAMPLES / "paper_table1.csv", *given).stdout.decode().splitlines()
    assert " saves " in said[0]
    assert " of the direct path (" in said[0]
    assert "; limited by " in said[0]
    assert said[0].endswith(" of the cutting time; limits of the tip alone, --limits MACHINE adds the axes")
    assert "saves % of" in said[2]
    assert said[3].split() == ["exact", "stop", "velocity", "jump"]


def test_time_takes_a_feed_where_the_file_has_none(tmp_path: Path) -> None:
    part = tmp_path / "part.cls"
    part.write_bytes(b"".join(line for line in SMALL.splitlines(keepends=True) if b"FEDRAT" not in line))
    assert b"give a feed in mm/min for the whole program (--feed)" in run("time", part).stderr
    result = run("time", part, "--feed", "900")
    assert result.returncode == DONE
    assert "warning: feed move without a feed in the CL file, planned with --feed 900 mm/min" in one_line(result.stderr)
    (tmp_path / "whole.cls").write_bytes(SMALL)
    assert run("time", tmp_path / "whole.cls", "--feed", "900").stderr == b""


def test_what_is_missing_says_how_to_install_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    monkeypatch.delitem(sys.modules, "cornersmooth.cli.batch", raising=False)
    part = tmp_path / "part.cls"
    part.write_bytes(SMALL)
    result = run("smooth", part, "-d", tmp_path / "out", "CORNERSMOOTH_SCHEDULER=tcp://localhost:1")
    assert "install it with: pip install 'cornersmooth[cluster]'" in result.stderr.decode()


@pytest.mark.parametrize("options", [(), ("-o", "-")])
def test_a_terminal_is_not_flooded(options: tuple[str, ...]) -> None:
    seen = seen_on_a_terminal("smooth", IMPELLER, *options, TERM="xterm")
    lines = seen.decode().splitlines()
    assert lines[0] == "%"
    assert ("M30" in lines) == bool(options)
    told = [line for line in lines if line.endswith("more lines; -o FILE writes them, -o - shows them all")]
    assert (len(told) == 1) != bool(options)
    assert (len(lines) > 2000) == bool(options)


#: commands whose short help leaves options out
LONG = ("smooth", "filter", "verify", "surface", "compare", "time", "setup")


@pytest.mark.parametrize("name", COMMANDS)
def test_helps_have_parts_and_fit_80_columns(name: str) -> None:
    lines = run(name, "--help-all" if name in LONG else "-h").stdout.decode().splitlines()
    assert max(map(len, lines)) <= 80
    assert not any("\x1b" in line for line in lines)
    if name in LONG and name not in ("surface", "setup"):
        heads = [line[:-1] for line in lines if line and not line.startswith((" ", "Usage"))]
        assert heads[0] == "Everyday"
        assert heads == [heading for heading in HEADINGS if heading in heads]
        everyday = lines[lines.index("Everyday:") + 1 : lines.index("Output:")]
        options = [line for line in everyday if line.startswith("  -")]
        assert 3 <= len(options) <= 12
        assert options[0].startswith("  -e, --tolerance")


def test_the_list_of_commands_has_every_command_once() -> None:
    listed = run("-h").stdout.decode().partition("Make programs:")[2].partition("Pages")[0]
    assert sorted(re.findall(r"^  (\w+)  ", listed, re.MULTILINE)) == sorted(COMMANDS)


def test_a_terminal_shows_messages_in_colour_but_for_no_color(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("part.cls").write_bytes(SMALL.replace(b"LOADTL/1\n", b""))
    words = "smooth", "part.cls", "-o", "o.nc", "--force"
    seen = seen_on_a_terminal(*words, TERM="xterm")
    assert b"CS334" in seen
    assert b"\x1b[1" in seen
    assert b"\x1b[3" not in seen_on_a_terminal(*words, TERM="xterm", NO_COLOR="1")


def test_small_outputs_say_what_is_true(tmp_path: Path) -> None:
    missing = run("config", "none.cls", cwd=tmp_path)
    assert (missing.returncode, missing.stderr[:22]) == (3, b"none.cls: error[CS100]")
    lines = run("config", cwd=tmp_path).stdout.decode().splitlines()
    shown = {line.split()[0]: line.split("  ", 1)[1].strip().split("  ")[0] for line in lines}
    assert (shown["form"], shown["chord"], shown["modal"]) == ("g1", "a tenth of -e, at most 0.0005", "no")
    (tmp_path / "one.cls").write_bytes(b"UNITS/MM\nRAPID\nGOTO/0,0,0\n")
    told = run("info", "one.cls", cwd=tmp_path).stdout.decode()
    assert "every segment" not in told
    assert re.search(r"^feeds +none$", told, re.MULTILINE)
    (tmp_path / "part.cls").write_bytes(SMALL)
    assert run("smooth", "part.cls", "-o", "part.nc", "-e", "0.02", cwd=tmp_path).returncode == DONE
    for tolerance, verdict, code in (("0.02", b"PASSED: ", 0), ("0.000001", b"FAILED: ", 1)):
        made = run("surface", *"part.cls part.nc --tool 4,2 --stations 100 -e".split(), tolerance, cwd=tmp_path)
        assert (made.returncode, made.stdout[:8]) == (code, verdict)
