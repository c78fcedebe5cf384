"""What is no NC program is an error, and nothing is written; a program without cuts stays as it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from oracle.command import BAD_INPUT, DONE, run

LIMITS = Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml"
PROGRAM = b"G21 G90 G94 G17\nG0 X0 Y0 Z20\nG1 Z-1 F350\nX1 Y1\nX2 Y3\nG0 Z20\nM2\n"
STL = (
    b"solid foo\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    b"endfacet\nendsolid\n"
)
OTHERS = {
    "text": (b"hello\n", "no NC block"),
    "letter": (b"Dear reader,\n\nplease mill 3 parts of these; G1 would do.\nYours, M\n", "no NC block"),
    "settings": (b'axis = []\n\n[dynamics.X]\nvelocity = 6000 # mm/min\nname = "router"\n', "no NC block"),
    "empty": (b"", "no NC block"),
    "stl": (STL, "an STL model"),
    "binary stl": (b"header".ljust(80, b"\0") + bytes(range(150)), "binary"),
    "svg": (b'<svg xmlns="x"><path d="M0 0"/></svg>\n', "an SVG drawing"),
    "xml": (b'\xef\xbb\xbf<?xml version="1.0"?>\n<x>\nG1 X1\n</x>\n', "other XML"),
    "html": (b"<!DOCTYPE html>\n<style>p {color: #fff; top: 3}</style>\n<pre>\nG1 X1 Y2\n</pre>\n", "an HTML page"),
    "random": (np.random.default_rng(5).integers(0, 256, 20_000, np.uint8).tobytes(), "binary"),
}


@pytest.mark.parametrize("control", ["linuxcnc", "fanuc", "siemens", "heidenhain", None])
@pytest.mark.parametrize("name", OTHERS)
def test_another_kind_of_file_is_an_error(name: str, control: str | None, tmp_path: Path) -> None:
    data, what = OTHERS[name]
    (tmp_path / "part.nc").write_bytes(data)
    on = ("--control", control) if control else ()
    made = run("filter", "part.nc", *on, "-o", "new.nc", cwd=tmp_path)
    assert made.returncode == BAD_INPUT, made.stderr
    assert b"error[CS595]" in made.stderr
    assert b"part.nc" in made.stderr
    assert what.encode() in made.stderr
    assert not (tmp_path / "new.nc").exists()


@pytest.mark.parametrize("name", OTHERS)
def test_it_has_no_time_and_is_compared_with_nothing(name: str, tmp_path: Path) -> None:
    (tmp_path / "other.nc").write_bytes(OTHERS[name][0])
    (tmp_path / "part.nc").write_bytes(PROGRAM)
    on = ("--control", "linuxcnc")
    for order in (("time", "other.nc", "--limits", LIMITS), ("compare", "other.nc", "--limits", LIMITS)):
        made = run(*order, *on, cwd=tmp_path)
        assert made.returncode == BAD_INPUT, (order, made.stderr)
    assert run("verify", "other.nc", "part.nc", *on, cwd=tmp_path).returncode == BAD_INPUT
    made = run("verify", "part.nc", "other.nc", *on, cwd=tmp_path)
    assert made.returncode == BAD_INPUT, made.stderr
    assert b"other.nc: error[CS595]" in made.stderr


@pytest.mark.parametrize(
    ("control", "text"),
    [
        ("fanuc", "%\nO0001\nM98 P2\nM98 P3\nM30\n%\n"),
        ("fanuc", "O9001\n#100 = 5.\n#<depth> = 3\n"),
        ("fanuc", "N1 T4 M6\n"),
        ("linuxcnc", "o<probe> sub\n#<a> = 1\no<probe> endsub\n"),
        ("linuxcnc", "G0 X1 Y1\n"),
        ("linuxcnc", "X1 Y1\n"),
        ("siemens", "R1=5\nR2=7\n"),
        ("siemens", 'MSG("x")\nM17\n'),
        ("heidenhain", "0 BEGIN PGM A MM\n1 TOOL CALL 3 Z S3000\n2 END PGM A MM\n"),
        ("heidenhain", "1 FN 0: Q1 = +5\n"),
    ],
)
def test_a_program_without_cuts_stays_as_it_is(control: str, text: str, tmp_path: Path) -> None:
    (tmp_path / "part.nc").write_text(text)
    made = run("filter", "part.nc", "--control", control, "-o", "new.nc", cwd=tmp_path)
    assert made.returncode == DONE, made.stderr
    assert made.stderr.startswith(b"NOT SMOOTHED")
    assert (tmp_path / "new.nc").read_text() == text
