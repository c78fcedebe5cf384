"""What M words mean is data of each control: a new one needs a line of its control's tables and nothing else."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import pytest

from cornersmooth.cl import read
from cornersmooth.control import table as word_tables
from cornersmooth.control.table import table_of
from cornersmooth.errors import Verdict
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import choose_form, control_tables
from cornersmooth.nc_reader.dialects import dialect_of
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.tables import Shelf
from cornersmooth.verify import verify

CL = """LOADTL/1
SPINDL/900,RPM,CLW
{}
RAPID
GOTO/0,0,50
FEDRAT/100,MMPM
GOTO/0,0,0
COOLNT/FLOOD
GOTO/9,0,0
{}
GOTO/9,9,0
COOLNT/OFF
GOTO/20,9,0
RAPID
GOTO/20,9,50
FINI
"""

#: a coolant that no CAM system has: its word in the writer's table, what the reader's list says, blocks of the program
AIR = {
    "fanuc": ('XAIR = ["M977"]', 'M977 = "coolant=XAIR;; compared"', ["M977", "M9", "M8", "M9", "M977", "M9"]),
    "siemens": ('XAIR = ["M978"]', 'M978 = "coolant=XAIR;; compared"', ["M978", "M9", "M8", "M9", "M978", "M9"]),
    "haas": (
        'XAIR = ["M983"]',
        'M983 = "coolant=XAIR;; compared"\nM984 = "coolant=-XAIR;; compared"',
        ["M983", "M984", "M8", "M9", "M983", "M984"],
    ),
}


@pytest.fixture
def _with_air(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """Tables of both sides with one entry more; HEIDENHAIN has none."""
    written = Shelf.built_in
    caches = (control_tables._built_in, word_tables.word_table, table_of, dialect_of)

    def table(self: Shelf, name: str) -> str:
        text = written(self, name)
        entry = AIR[name][0] if name in AIR else ""
        text = text.replace("coolant = {", f"coolant = {{ {entry},") if entry else text
        return text.replace("coolant_off = {", 'coolant_off = { XAIR = ["M984"],')

    for control in word_tables.CONTROLS:
        text = word_tables._LISTS.joinpath(f"{control}.toml").read_text(encoding="utf-8")
        text = text.replace("[words]", f"[words]\n{AIR[control][1]}") if control in AIR else text
        (tmp_path / f"{control}.toml").write_text(text, encoding="utf-8")
    monkeypatch.setattr(Shelf, "built_in", table)
    monkeypatch.setattr(word_tables, "_LISTS", tmp_path)
    for cached in caches:
        cached.cache_clear()
    yield
    monkeypatch.undo()
    for cached in caches:
        cached.cache_clear()


def _lines(control: str, cl: str) -> tuple[list[str], dict[str, object]]:
    """Lines of the verified program, and how it is read."""
    machine = load_machine("table-bc") if control == "haas" else None
    stream = io.BytesIO()
    result = postprocess(cl.encode(), stream, Settings(), form=choose_form(control, machine=machine))
    assert result.verification is not None
    assert result.verification.passed
    how = {"control": control, "machine": machine, "tolerance": 0.01, "axis_length": 10}
    return stream.getvalue().decode().splitlines(), how


#: the end of a kind of coolant of its own is asked for by the digest of its part alone
WRONG = (Verdict.FAILED, Verdict.NOT_VERIFIED)


@pytest.mark.usefixtures("_with_air")
@pytest.mark.parametrize("control", AIR)
def test_a_new_coolant_of_a_control(control: str) -> None:
    cl = CL.format("COOLNT/XAIR", "COOLNT/XAIR")
    lines, how = _lines(control, cl)
    program = read(cl.encode(), name="air.cls")
    words = {"M8", "M9", *AIR[control][2]}
    at = [k for k, line in enumerate(lines) if line in words]
    assert [lines[k] for k in at] == AIR[control][2]
    for k in at:
        for other in ([], ["M7"]):
            text = "\n".join([*lines[:k], *other, *lines[k + 1 :]]) + "\n"
            assert verify(program, text.encode(), **how).verdict in WRONG, (lines[k], other)


@pytest.mark.usefixtures("_with_air")
@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
def test_the_number_of_one_control_is_another_word_on_the_next(control: str) -> None:
    cl = CL.format("AUXFUN/977", "COOLNT/ON")
    lines, how = _lines(control, cl)
    without = [line for line in lines if not line.endswith("M977")]
    assert len(without) == len(lines) - 1
    text = "\n".join(without) + "\n"
    code = "CS553" if control == "fanuc" else "CS558"
    found = verify(read(cl.encode(), name="air.cls"), text.encode(), **how).problems
    assert [problem.code for problem in found] == [code]


@pytest.mark.usefixtures("_with_air")
def test_what_a_control_has_no_word_for_is_not_missing() -> None:
    lines, _ = _lines("heidenhain", CL.format("COOLNT/XAIR", "COOLNT/XAIR"))
    assert any("COOLNT/XAIR" in line for line in lines)


def test_a_coolant_that_is_asked_for_by_its_number_is_switched_off_at_the_end() -> None:
    lines, _ = _lines("haas", CL.format("AUXFUN/88", "COOLNT/ON"))
    words = ("M88", "M89", "M8", "M9")
    assert [line for line in lines if line in words] == ["M88", "M89", "M8", "M8", "M9"]
    lines, _ = _lines("haas", CL.format("COOLNT/OFF", "AUXFUN/88").replace("COOLNT/OFF\nGOTO/20", "AUXFUN/9\nGOTO/20"))
    assert [line for line in lines if line in words] == ["M9", "M8", "M9", "M88", "M89", "M9"]
