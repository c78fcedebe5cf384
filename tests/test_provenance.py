"""What a text says of how it was made, and that it can be verified by that alone."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from cornersmooth import __version__
from cornersmooth.frame import Provenance, read_provenance
from oracle.command import DONE, SMALL, USAGE, run
from oracle.messages import one_line

MADE = Provenance("1.2.3", 0.0127, 25.4, "proportional", "siemens", "bspline", "xyzac-trt", tcp=False)


@pytest.fixture
def part(tmp_path: Path) -> Path:
    path = tmp_path / "part one (A).cls"
    path.write_bytes(SMALL)
    return path


@pytest.mark.parametrize("marks", [("(", ")"), ("; ", ""), ("12 ; ", "")])
def test_what_is_written_is_read(marks: tuple[str, str]) -> None:
    sha256 = "0123456789abcdef" * 4
    whole = replace(MADE, weights=None, planned_feeds=True, axis_tolerance=0.25, work_offset="G54.1_P3", sha256=sha256)
    for made in (MADE, Provenance("0.1.0", 0.01, 10.0, "zhang2016", "fanuc", "g6.2", sha256=sha256), whole):
        text = "\n".join(marks[0] + line + marks[1] for line in made.lines())

        assert read_provenance(b"%\nO0001\n" + text.encode()) == made
        assert all(len(line) <= 120 for line in made.lines())  # each stays one comment


@pytest.mark.parametrize(
    "text", [b"", b"(CORNERSMOOTH)", b"(CORNERSMOOTH 1: E=x H=1)", b"(CORNERSMOOTH 1: H=1)", b"\xff" * 99]
)
def test_what_cannot_be_understood_says_nothing(text: bytes) -> None:
    assert read_provenance(text) is None


def test_the_head_of_a_text(part: Path) -> None:
    text = run("smooth", part, "-e", "0.0005in", "-H", "25", "-f", "g6.2").stdout.decode("ascii")
    first = f"(CORNERSMOOTH {__version__}: E=0.0127 H=25 METHOD=global CONTROL=fanuc FORM=g6.2)"
    second = f"(SHA256={hashlib.sha256(SMALL).hexdigest()} CL=part one [A].cls)"
    assert f"\n{first}\n{second}\n" in text
    assert "CORNERSMOOTH " not in run("smooth", part, "CORNERSMOOTH_NO_COMMENTS=1").stdout.decode("ascii")


@pytest.mark.parametrize(
    "options",
    [
        (),
        ("-e", "0.05", "-H", "40"),
        ("--control", "siemens", "-f", "bspline"),
        ("--control", "heidenhain"),
        ("--control", "linuxcnc", "--machine", "xyzac-trt"),
        ("--machine", "head-ac", "--no-tcp"),
    ],
    ids=" ".join,
)
def test_verify_needs_no_options(part: Path, tmp_path: Path, options: tuple[str, ...]) -> None:
    out = tmp_path / "out.nc"
    assert run("smooth", part, "-o", out, "-q", *options).returncode == DONE
    # what is looser than the default is the user's to say
    found = run("verify", part, out, *options[:2] * ("-e" in options))
    assert found.returncode == DONE, found.stdout.decode() + found.stderr.decode()
    tolerance, height = ("0.05", "40") if "-e" in options else ("0.01", "10")
    assert f"{tolerance} mm, axis point at {height} mm" in found.stdout.decode()
    assert b"warning" not in found.stderr


def test_the_command_line_counts_more(part: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    assert run("smooth", part, "-o", out, "-e", "0.05", "-q").returncode == DONE
    assert run("verify", part, out, "-e", "0.001").returncode == 1
    assert run("verify", part, out, "-H", "20").stdout.decode().count("axis point at 20 mm") == 1
    assert run("verify", part, out, "--control", "heidenhain").returncode != DONE


def test_another_file_and_another_machine_are_named(part: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.nc"
    assert run("smooth", part, "-o", out).returncode == DONE
    part.write_bytes(SMALL + b"\n")
    found = run("verify", part, out)
    assert found.returncode == 1
    assert "out.nc:1: error: the program was made from another CL file, or that has changed since" in one_line(
        found.stderr
    )
    mill = tmp_path / "mill.toml"
    mill.write_text('like = "table-ac"\nname = "our-mill"\n')
    assert run("smooth", part, "-o", out, "--force", "--machine", mill).returncode == DONE
    found = run("verify", part, out)
    assert found.returncode == USAGE
    assert "the program is for the machine our-mill; name its file with --machine" in one_line(found.stderr)
    assert run("verify", part, out, "--machine", mill).returncode == DONE
