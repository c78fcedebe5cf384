"""Shop settings: files and environment, what counts more, and what is said of it."""

from __future__ import annotations

from pathlib import Path

import pytest

from oracle.command import DONE, SMALL, USAGE, lock, run
from oracle.messages import one_line


@pytest.fixture
def part(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A file in a project whose user has a folder of settings."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    path = tmp_path / "project" / "jobs" / "part.cls"
    path.parent.mkdir(parents=True)
    path.write_bytes(SMALL)
    return path


def project(part: Path, text: str) -> None:
    (part.parent.parent / "cornersmooth.toml").write_text(text)


def user(part: Path, text: str) -> None:
    folder = part.parents[2] / "home" / "cornersmooth"
    folder.mkdir(parents=True)
    (folder / "cornersmooth.toml").write_text(text)


def config(part: Path) -> dict[str, tuple[str, str]]:
    """Value and origin by option."""
    result = run("config", part)
    assert result.returncode == DONE, result.stderr.decode()
    rows = [line.split("  ", 1) for line in result.stdout.decode().splitlines()]
    return {key: tuple(part.strip() for part in rest.strip().partition("  ")[::2]) for key, rest in rows}


def test_option_environment_project_user_default_in_this_order(part: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = run("smooth", part, "-q").stdout
    texts = {e: run("smooth", part, "-q", "-e", e).stdout for e in ("0.02", "0.03", "0.04", "0.05")}
    assert len({plain, *texts.values()}) == 5
    user(part, "[smooth]\ntolerance = 0.02\naxis-length = 25\n")
    assert run("smooth", part, "-q", "-H", "10").stdout == texts["0.02"]
    project(part, "[smooth]\ntolerance = 0.03\naxis_length = 10\n")
    assert run("smooth", part, "-q").stdout == texts["0.03"]
    monkeypatch.setenv("CORNERSMOOTH_TOLERANCE", "0.04mm")
    assert run("smooth", part, "-q").stdout == texts["0.04"]
    assert run("smooth", part, "-q", "-e", "0.05").stdout == texts["0.05"]


def test_marks_before_the_text_are_none_of_it(part: Path) -> None:
    """Some editors put the three bytes EF BB BF before a text."""
    mark = "\ufeff"
    header = part.parent / "head.txt"
    header.write_text(mark + "(OF THE SHOP)\r\n")
    project(part, mark + "[smooth]\r\ntolerance = 0.03\r\n")
    (part.parent / "mill.toml").write_text(mark + 'like = "table-ac"\n')
    assert config(part)["tolerance"] == ("0.03", f"{part.parent.parent / 'cornersmooth.toml'} [smooth]")
    assert run("machines", part.parent / "mill.toml").returncode == DONE
    text = part.parent / "part.nc"
    assert run("smooth", part, "--header", header, "-o", text).returncode == DONE
    assert b"\n(OF THE SHOP)\n" in text.read_bytes()
    assert run("verify", part, text, "--trust", header).returncode == DONE


def test_settings_that_cannot_be_read_say_why(part: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    project(part, "[smooth]\n")
    settings = part.parent.parent / "cornersmooth.toml"
    lock(monkeypatch, settings)
    said = run("config", part)
    assert said.returncode == USAGE
    assert one_line(said.stderr) == f"{settings}: error: cannot read it: permission denied; correct the file\n"


def test_config_says_where_every_value_is_from(part: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    user(part, "[smooth]\ntolerance = 0.02\naxis-length = '0.5in'\n")
    project(
        part,
        "[smooth]\ntolerance = 0.03\nwith = ['cycle832']\ncontrol = 'siemens'\n[smooth.siemens]\nform = 'bspline'\n",
    )
    monkeypatch.setenv("CORNERSMOOTH_METHOD", "zhang2016")
    found = config(part)
    shop = part.parents[1] / "cornersmooth.toml"
    assert found["tolerance"] == ("0.03", f"{shop} [smooth]")
    assert found["axis-length"] == ("12.7", f"{part.parents[2] / 'home/cornersmooth/cornersmooth.toml'} [smooth]")
    assert found["with"] == ("cycle832", f"{shop} [smooth]")
    assert found["form"] == ("bspline", f"{shop} [smooth.siemens]")
    assert found["method"] == ("zhang2016", "CORNERSMOOTH_METHOD")
    assert found["cycles"] == ("moves", "default")
    assert "output" not in found


def test_tables_of_a_control_hold_for_it_alone(part: Path) -> None:
    plain, curves = run("smooth", part).stdout, run("smooth", part, "-f", "g6.2").stdout
    project(part, "[smooth.fanuc]\nform = 'g6.2'\n[smooth.siemens]\nform = 'poly'\n")
    assert run("smooth", part).stdout == curves != plain
    assert b"POLY" in run("smooth", part, "--control", "siemens").stdout
    assert run("smooth", part, "--control", "generic").returncode == DONE


def test_what_smooth_says_holds_for_the_other_commands(part: Path, tmp_path: Path) -> None:
    out = tmp_path / "part.mpf"
    project(part, "[smooth]\ntolerance = 0.04\ncontrol = 'siemens'\n[info]\ntolerance = 0.08\n[time]\naccel = 500\n")
    assert run("smooth", part, "-o", out).returncode == DONE
    verified = run("verify", part, out)
    assert verified.returncode == DONE
    assert b"0.04 mm, axis point at 10 mm" in verified.stdout
    assert b"at 0.08 mm" in run("info", part).stdout
    assert run("time", part, "-q").returncode == DONE


def test_controls_and_machines_of_the_shop(part: Path) -> None:
    project(
        part,
        "[smooth]\ncontrol = 'shop'\n[controls.shop]\nlike = 'siemens'\nprogram.end = ['M17']\n"
        "[machines.mill]\nlike = 'table-ac'\n",
    )
    assert run("smooth", part).stdout.splitlines()[-1] == b"M17"
    assert b" C" in run("smooth", part, "--machine", "mill").stdout
    assert dict(config(part))["control"][0] == "shop"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[smoth]\n", "unknown key smoth; did you mean smooth?"),
        ("[smooth]\ntolerence = 1\n", "unknown key smooth.tolerence; did you mean tolerance?"),
        ("[smooth.siemens]\nfrom = 'poly'\ncontrol = 3\n", ""),  # not this control's
        ("[smooth.fanuc]\nfrom = 'poly'\n", "unknown key smooth.fanuc.from; did you mean form?"),
        ("[smooth]\nforce = true\n", "unknown key smooth.force; "),
        ("[smooth]\ntolerance = 'abc'\n", "smooth.tolerance: 'abc' is not a length"),
        ("[smooth]\nmethod = 'magic'\n", "smooth.method: 'magic' is not one of"),
        ("[smooth]\nblock-numbers = 1\n", "smooth.block-numbers is 1; give true or false"),
        ("[smooth]\nwith = 'cycle832'\n", "smooth.with is 'cycle832'; give a list of strings"),
        (
            "[controls.shop]\nlike = 'siemens'\nlayut = 1\n[smooth]\ncontrol = 'shop'\n",
            "unknown key layut; did you mean layout?",
        ),
        ("smooth = 3\n", "smooth is 3; write a table [smooth]"),
        ("[smooth\n", "cannot read it: "),
    ],
)
def test_mistakes_are_named_with_the_file(part: Path, text: str, said: str) -> None:
    project(part, text)
    result = run("smooth", part)
    assert result.returncode == (USAGE if said else DONE)
    if said:
        message = one_line(result.stderr)
        assert message.startswith(str(part.parents[1] / "cornersmooth.toml"))
        assert said in message
        assert len(message.splitlines()) == 1


def test_names_in_the_environment_that_are_nearly_right(part: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CORNERSMOOTH_ACCEL", "500")  # of another command
    monkeypatch.setenv("CORNERSMOOTH_CORPUS", "/data")  # nobody's
    assert run("smooth", part).returncode == DONE
    monkeypatch.setenv("CORNERSMOOTH_TOLERENCE", "0.1")
    result = run("smooth", part)
    assert result.returncode == USAGE
    assert "CORNERSMOOTH_TOLERENCE in the environment; did you mean CORNERSMOOTH_TOLERANCE?" in one_line(result.stderr)
