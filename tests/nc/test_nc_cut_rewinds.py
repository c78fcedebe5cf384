"""Rotary axes that turn back within a cut: it is left along the tool, and gone on with where it was left."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cornersmooth import postprocess
from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import Dynamics, Machine, load_machine
from cornersmooth.nc import Frame, choose_form, fit_settings, write
from cornersmooth.nc_reader import read_nc, reader
from cornersmooth.rotary import rewound_angles
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from oracle.share import share
from page.making import page_of

EPS, AWAY = 0.05, 25.0
WORD = re.compile(r"([A-Z])(?:=\S*?\()?([-+]?\d+\.?\d*)")

#: what turns the axes, and what stands before it, on each control
UP = {
    "fanuc": "G91 G28 Z0.",
    "mitsubishi": "G91 G28 Z0.",
    "haas": "G53 G0 Z0.",
    "linuxcnc": "G53 G0 Z0",
    "siemens": "SUPA G0 Z0 D0",
    "heidenhain": "L Z-1 R0 FMAX M91",
}

CASES = [
    ("fanuc", "table-ac", True),
    ("fanuc", "table-bc", False),
    ("mitsubishi", "head-ac", True),
    ("haas", "table-bc", True),
    ("linuxcnc", "xyzac-trt", True),
    ("linuxcnc", "xyzac-trt", False),
    ("siemens", "nutated-bc", True),
    ("heidenhain", "table-ac", True),
]


@cache
def program_text(turns: float = 1.8, step: float = 36.0, lean: float = 30.0) -> bytes:
    """Turns about Z with a tool that leans outwards, in one cut."""
    turn = np.radians(np.arange(0.0, 360.0 * turns, step))
    sine, cosine = np.sin(np.radians(lean)), np.cos(np.radians(lean))
    rows = [
        f"GOTO/{40 * np.cos(a):.4f},{40 * np.sin(a):.4f},{-a:.4f},"
        f"{sine * np.cos(a):.7f},{sine * np.sin(a):.7f},{cosine:.7f}"
        for a in turn.tolist()
    ]
    head = ["UNITS/MM", "LOADTL/2", "SPINDL/8000,RPM,CLW", "RAPID", f"GOTO/60,0,60,{sine:.7f},0,{cosine:.7f}"]
    tail = ["RAPID", "GOTO/0,0,90,0,0,1", "FINI"]
    return ("\n".join([*head, "FEDRAT/500,MMPM", *rows, *tail]) + "\n").encode()


def short(name: str, span: float = 280.0) -> Machine:
    """Machine whose C turns less than the cut does."""
    machine = load_machine(name)
    axes = tuple(replace(axis, limits=(-span, span)) if axis.name == "C" else axis for axis in machine.axes)
    return replace(machine, axes=axes)


@cache
def text_of(control: str, name: str, tcp: bool, lines: str = "") -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Lines of the text, and the codes of what is said of it."""
    chosen = choose_form(control, machine=short(name), tcp=tcp, rewind=AWAY)
    stream = io.BytesIO()
    wanted = Settings(tolerance=EPS, lines=lines) if lines else Settings(tolerance=EPS)
    written = write(smooth(read(program_text()), fit_settings(wanted, chosen, "mm")), stream, form=chosen)
    said = tuple(f"{one.code} {one.count}" for one in written.findings)
    return tuple(stream.getvalue().decode().splitlines()), said


def found(lines, control: str, name: str, tcp: bool):
    data = ("\n".join(lines) + "\n").encode()
    how = {"control": control, "machine": short(name), "tcp": tcp}
    return verify(read(program_text()), data, tolerance=EPS, **how)


def bare(lines) -> list[str]:
    return [re.sub(r"^\d+ (?=\D)", "", line) for line in lines]


def rewinds(lines, control: str) -> list[tuple[int, int]]:
    """Where cuts are left (index of the rapid along the tool), and where the tool comes back (index of the feed)."""
    lines = bare(lines)
    inner = [k for k, line in enumerate(lines) if line == UP[control]]
    feeds = [k for k, line in enumerate(lines) if re.match(r"G1 X|L X.*(?<!FMAX)$", line)]
    places = []
    for up in inner:
        before, behind = [k for k in feeds if k < up], [k for k in feeds if k > up]
        if before and behind:
            places.append((before[-1] + 1, behind[0]))
    return places


@pytest.mark.parametrize(("control", "name", "tcp"), CASES)
def test_a_cut_is_left_and_gone_on_with(control: str, name: str, tcp: bool) -> None:
    lines, said = text_of(control, name, tcp)
    checked = found(lines, control, name, tcp)
    assert checked.problems == ()
    places = rewinds(lines, control)
    assert len(places) == len(checked.rewinds) >= 1
    assert f"CS376 {len(places)}" in said
    for (out, back), (out_line, back_line) in zip(places, checked.rewinds, strict=True):
        assert (out + 1, back + 1) == (out_line, back_line)
        words = [dict(WORD.findall(line)) for line in bare(lines)]
        tips = [np.array([float(words[k][axis]) for axis in "XYZ"]) for k in (out - 1, out, back - 1, back)]
        if tcp:  # the same tip, and both ways are along the tool
            np.testing.assert_array_equal(tips[0], tips[3])
            np.testing.assert_allclose(np.linalg.norm(tips[1] - tips[0]), AWAY, atol=1e-3)
            np.testing.assert_allclose(tips[1] - tips[0], tips[2] - tips[3], atol=1e-3)
        assert abs(float(words[out]["C"]) - float(words[back]["C"])) > 170.0
    assert max(abs(float(value)) for line in bare(lines) for value in re.findall(r" C([-+]?[\d.]+)", line)) <= 280.0


def test_lines_that_are_as_long_as_may_be_keep_both_sides_of_the_place() -> None:
    lines, _ = text_of("fanuc", "table-ac", True, "long")
    checked = found(lines, "fanuc", "table-ac", True)
    assert checked.problems == ()
    assert len(checked.rewinds) == len(rewinds(lines, "fanuc")) >= 1


def moved(line: str, word: str, by: float) -> str:
    return re.sub(rf"(?<=\b{word})[-+]?\d+\.\d*", lambda value: f"{float(value[0]) + by:+.4f}", line)


def mutants(lines, control: str, place: tuple[int, int] | None = None) -> dict[str, list[str]]:
    """What goes wrong around a rewind, the first one if its lines are not given."""
    lines = list(lines)
    out, back = place or rewinds(lines, control)[0]
    up = next(k for k in range(out, back) if bare(lines)[k] == UP[control])
    rapid, feed = ("FMAX", "") if control == "heidenhain" else ("G0", "G1")
    in_rapid = f"{lines[back]} FMAX" if control == "heidenhain" else lines[back].replace(feed, rapid, 1)
    turned = [k for k in range(out + 1, back) if re.search(r" C[-+]?\d", lines[k]) and " X" not in lines[k]]
    wrong = {
        "no way out along the tool": [*lines[:out], *lines[out + 1 :]],
        "way out aside": [*lines[:out], moved(lines[out], "X", 0.5), *lines[out + 1 :]],
        "hardly any way out": [*lines[:out], lines[out - 1].replace("G1", "G0", 1), *lines[out + 1 :]],
        "no retract": [*lines[:up], *lines[up + 1 :]],
        "above another place": [*lines[: back - 1], moved(lines[back - 1], "Y", 0.4), *lines[back:]],
        "back beside": [*lines[:back], moved(lines[back], "X", 0.05), *lines[back + 1 :]],
        "back too deep": [*lines[:back], moved(lines[back], "Z", -0.05), *lines[back + 1 :]],
        "back with another axis": [*lines[:back], moved(lines[back], "C", 0.5), *lines[back + 1 :]],
        "back in rapid": [*lines[:back], in_rapid, *lines[back + 1 :]],
        "not back at all": [*lines[:back], *lines[back + 1 :]],
        "no turn": [*lines[:out], *beyond(lines[out:])],
        "a part of the cut is missing": [*lines[: back + 1], *lines[back + 4 :]],
    }
    if turned:
        k = turned[-1]
        wrong["turn in the cut"] = [*lines[:out], lines[k], *lines[out:k], *lines[k + 1 :]]
    return wrong


def beyond(lines) -> list[str]:
    """The same words with C a turn farther on, where it has turned back."""
    return [re.sub(r"(?<=\bC)[-+]?\d+\.\d*", lambda value: f"{float(value[0]) + 360.0:+.4f}", line) for line in lines]


@pytest.mark.parametrize(("control", "name", "tcp"), [CASES[0], CASES[1], CASES[5], CASES[6], CASES[7]])
def test_what_goes_wrong_there_is_found(control: str, name: str, tcp: bool) -> None:
    lines, _ = text_of(control, name, tcp)
    passed = []
    first = CASES.index((control, name, tcp))
    for what, wrong in share(mutants(lines, control).items(), 8 if first else 2, first):
        assert wrong != list(lines), what
        try:
            if found(wrong, control, name, tcp).passed:
                passed.append(what)
        except InputError:
            pass
    assert passed == []


def test_a_cl_file_may_ask_for_all_of_it_itself() -> None:
    """Rapids along the tool and GOHOME of the CL file are its own motion, and no rewind."""
    text = program_text(0.9).decode().splitlines()
    x, y, z, i, j, k = (float(value) for value in text[12].partition("/")[2].split(","))
    above = f"GOTO/{x + 30 * i:.4f},{y + 30 * j:.4f},{z + 30 * k:.4f},{i},{j},{k}"
    program = read(("\n".join([*text[:13], "RAPID", above, "GOHOME", "RAPID", above, *text[12:]]) + "\n").encode())
    form = choose_form("fanuc", machine=load_machine("table-ac"))
    stream = io.BytesIO()
    write(smooth(program, fit_settings(Settings(tolerance=EPS), form, "mm")), stream, form=form)
    how = {"tolerance": EPS, "machine": load_machine("table-ac")}
    checked = verify(program, stream.getvalue(), **how)
    assert checked.problems == ()
    assert checked.rewinds == ()
    nc = verify(program, read_nc(stream.getvalue(), machine=how["machine"]), **how)
    assert nc.problems == ()


def test_reports_and_pages_name_the_places() -> None:
    """Plans of the original leave out limits that it does not keep."""
    machine = replace(short("table-ac"), dynamics=(Dynamics("C", 9000.0, 500.0, 1e5),))
    form, text = choose_form("fanuc", machine=machine, rewind=AWAY), io.BytesIO()
    result = postprocess(program_text(), text, Settings(tolerance=EPS), form=form)
    found = result.report()["verification"]["rewinds"]
    assert [place["back_nc_line"] > place["nc_line"] for place in found] == [True]
    page = page_of(result)
    assert "expect a mark on the part" in page
    assert re.search(r"; time .*[\d.]+ s instead of [\d.]+ s", page)


def test_without_being_asked_it_is_an_error() -> None:
    form = choose_form("fanuc", machine=short("table-ac"))
    with pytest.raises(InputError, match="or give --rewind") as error:
        write(smooth(read(program_text()), fit_settings(Settings(tolerance=EPS), form, "mm")), io.BytesIO(), form=form)
    assert error.value.code == "CS362"


@pytest.mark.parametrize(
    ("control", "form", "machine", "away", "says"),
    [
        ("fanuc", None, None, 20.0, "no rotary axes"),
        ("generic", None, "table-ac", 20.0, "no retract"),
        ("fanuc", None, "table-ac", 0.5, "1 mm or more"),
    ],
)
def test_where_it_cannot_be_it_is_refused(control: str, form: str, machine: str, away: float, says: str) -> None:
    own = load_machine(machine) if machine else None
    with pytest.raises(SettingsError) as error:
        choose_form(control, form, machine=own, rewind=away)
    assert says in str(error.value)


def test_as_few_rewinds_as_can_be() -> None:
    """Ten turns of a table that has two: it turns back five times at most, once for every two turns."""
    machine = short("table-ac", 360.0)
    turn = np.radians(np.arange(0.0, 3600.0, 7.0))
    axis = np.stack((np.sin(0.5) * np.cos(turn), np.sin(0.5) * np.sin(turn), np.full(len(turn), np.cos(0.5))), axis=1)
    tip = np.stack((np.cos(turn), np.sin(turn), turn), axis=1)
    rapid = np.zeros(len(turn), np.bool_)
    rapid[0] = True
    how = {"tolerance": 0.001, "rapid": rapid, "still": ~rapid & rapid, "line": np.arange(len(turn)), "file": None}
    path, source, left = rewound_angles(machine, tip, axis, **how)
    assert 4 <= left.sum() <= 5
    np.testing.assert_array_equal(source[left], source[np.flatnonzero(left) - 1])
    assert np.abs(path.angles[:, 1]).max() <= 60.0
    assert (np.abs(path.angles) <= 360.0 + 1e-6).all()
    step = np.abs(np.diff(path.angles, axis=0)).max(axis=1)
    assert (step[left[1:]] > 170.0).all()
    assert (step[~left[1:]] < 10.0).all()


@pytest.mark.parametrize("along", [0.0, 20.0])
def test_cuts_are_found_left_wherever_the_reader_gives_out_what_it_has(
    along: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Elements are given out in chunks: none of these ends between the way up and the retract behind it."""
    form = choose_form("siemens", machine=short("table-ac"), tcp=False, rewind=AWAY, extras=["cycle832"])
    program, stream = read(program_text()), io.BytesIO()
    write(
        smooth(program, fit_settings(Settings(tolerance=EPS), form, "mm")),
        stream,
        form=form,
        frame=Frame(retract=along),
    )
    text = stream.getvalue()
    nc = read_nc(text, control="siemens", machine=form.machine, tcp=False, tolerance=EPS)
    left = rewinds(text.decode().splitlines(), "siemens")
    assert left
    sizes = {element + more for element in nc.retracts for more in (-2, -1, 0, 1)} | {len(nc) - 2, len(nc) - 1}
    for size in sizes - {-2, -1, 0}:
        monkeypatch.setattr(reader, "GIVEN_OUT", size)
        found = verify(program, text, tolerance=EPS, control="siemens", machine=form.machine, tcp=False)
        assert found.problems == (), size
        assert len(found.rewinds) == len(left)


def test_a_cut_is_left_without_a_work_offset() -> None:
    """On SINUMERIK nothing but D1 says then that the tool comes back from its retract."""
    form = choose_form("siemens", machine=short("table-ac"), tcp=False, rewind=AWAY)
    stream = io.BytesIO()
    result = postprocess(program_text(), stream, Settings(tolerance=EPS), form=form, frame=Frame(work_offset=""))
    assert result.verification is not None
    assert len(result.verification.rewinds) == 1
    assert b"G54" not in stream.getvalue()


@cache
def three_cuts(above: str = "GOTO/-10,0,70,0.5,0,0.8660254") -> bytes:
    """A cut beyond the limits between two that keep them; empty `above`: the upper rapids go to the first pose."""
    lines = program_text().decode().splitlines()
    first, cut = lines[4], lines[6:-3]
    up, tail = ["RAPID", above or first, "RAPID", first, lines[5]], lines[-3:]
    return ("\n".join([*lines[:6], *cut[:5], *up, *cut, *up, *cut[:5], *tail]) + "\n").encode()


@pytest.mark.parametrize(
    ("control", "name", "tcp"),
    [("fanuc", "table-ac", True), ("siemens", "nutated-bc", True), ("fanuc", "nutated-bc", False)],
)
def test_a_rapid_said_twice_may_turn_axes_that_hold_the_tool_alike(control: str, name: str, tcp: bool) -> None:
    """The same cut follows: nothing but their ends tells the two rapids from one that the CL file lacks."""
    chosen = choose_form(control, machine=short(name), rewind=AWAY, tcp=tcp)
    program, stream = read(three_cuts("")), io.BytesIO()
    write(smooth(program, fit_settings(Settings(tolerance=EPS), chosen, "mm")), stream, form=chosen)
    how = {"tolerance": EPS, "control": control, "machine": short(name), "tcp": tcp}
    assert verify(program, stream.getvalue(), **how).problems == ()
    lines = bare(stream.getvalue().decode().splitlines())
    third = [k for k, line in enumerate(lines) if line.startswith("G0 X")][-1]
    without = "\n".join(lines[:third] + lines[third + 1 :]) + "\n"
    assert not verify(program, without.encode(), **how).passed
