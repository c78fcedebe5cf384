"""Programs, and what their controls make of them block by block: one folder, as LinuxCNC's interpreter has it.

``streams/CONTROL.MACHINE.nc`` is a program, ``.txt`` beside it the stream. ``python -m control.test_streams`` in
``tests`` writes the streams anew; each line of a change is to be looked at with the control's manual.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import cornersmooth as cs
from cornersmooth.control.program import Text, listing
from cornersmooth.control.table import CONTROLS
from cornersmooth.filter.runs import ProgramReader
from oracle.command import BAD_INPUT, DONE, USAGE, run

PROGRAMS = sorted((Path(__file__).parent / "streams").glob("*.nc"))


def stream_of(path: Path) -> str:
    control, _, machine = path.stem.partition(".")
    reader = ProgramReader(control, cs.load_machine(machine) if machine else None)
    return "".join(f"{line}\n" for line in listing(reader.stream(Text.of(path.read_bytes()))))


@pytest.mark.parametrize("path", PROGRAMS, ids=[path.stem for path in PROGRAMS])
def test_the_stream_of_a_program(path: Path) -> None:
    assert stream_of(path) == path.with_suffix(".txt").read_text()


def test_there_is_a_program_for_each_control() -> None:
    assert {path.stem.partition(".")[0] for path in PROGRAMS} == set(CONTROLS)


def test_explain_prints_it(tmp_path: Path) -> None:
    (path,) = (path for path in PROGRAMS if path.stem == "haas.table-bc")
    shown = run("explain", "--stream", path, "--control", "haas", "--machine", "table-bc")
    assert shown.returncode == DONE
    assert shown.stdout.decode() == path.with_suffix(".txt").read_text()
    assert run("explain", "CS337", "--stream", path).returncode == USAGE
    (tmp_path / "part.cls").write_text("PARTNO A\nGOTO/0,0,0\nGOTO/1,0,0\nFINI\n")
    assert run("explain", "--stream", tmp_path / "part.cls").returncode == BAD_INPUT


if __name__ == "__main__":
    for program in PROGRAMS:
        program.with_suffix(".txt").write_text(stream_of(program))
