"""MOVNRB of Creo: its curves are the motion; its points where anything speaks against the curves."""

from __future__ import annotations

import io

import numpy as np
import pytest

from cornersmooth import postprocess, verify
from cornersmooth.arrays import some_poses
from cornersmooth.cl import read
from cornersmooth.cl.nurbs import cubic
from cornersmooth.errors import InputError, Verdict
from cornersmooth.model import Floats, Program
from cornersmooth.nc import choose_form
from cornersmooth.report.verdict import sharp_rows
from cornersmooth.settings import Settings

LOW = np.array([[0, 0, 0], [10, 0, 0], [20, 5, 0], [30, 5, 1], [38, 0, 2], [45, -3, 2.0]])
HIGH = np.array([[0, 0, 10], [10, 1, 10], [22, 5, 10], [33, 5, 10], [42, 0, 11], [50, -3, 11.0]])
KNOTS = [0.0, 0, 0, 0, 0.3, 0.65, 1, 1, 1, 1]


def point_of(control: Floats, u: float) -> Floats:
    """De Boor's recursion, written by definition."""

    def basis(i: int, order: int) -> float:
        if order == 1:
            last = u == KNOTS[-1] and KNOTS[i] < KNOTS[i + 1] == u
            return float(KNOTS[i] <= u < KNOTS[i + 1] or last)
        low, high = KNOTS[i + order - 1] - KNOTS[i], KNOTS[i + order] - KNOTS[i + 1]
        left = (u - KNOTS[i]) / low * basis(i, order - 1) if low else 0.0
        return left + ((KNOTS[i + order] - u) / high * basis(i + 1, order - 1) if high else 0.0)

    return sum(basis(i, 4) * row for i, row in enumerate(control))  # type: ignore[return-value]


def axis_of(u: float) -> Floats:
    way = point_of(HIGH, u) - point_of(LOW, u)
    return way / np.linalg.norm(way)


def numbers(values: Floats) -> str:
    return ", ".join(f"{value:.10f}" for value in np.ravel(values))


PLACES = (0.2, 0.5, 0.8, 1.0)


def goto(u: float, five: bool, split: str) -> str:
    return f"GOTO / {numbers(point_of(LOW, u))}" + (f", {split}{numbers(axis_of(u))}" if five else "") + "\n"


def text(five: bool, *, split: str = " $\n", among: str = "", change: tuple[str, str] = ("", "")) -> bytes:
    head = "$$*         Pro/CLfile  Version 10.0\nUNITS / MM\nLOADTL / 7\nSPINDL / RPM, 6000.0,  CLW\n"
    head += ("MULTAX / ON\n" if five else "") + "RAPID\n"
    start = goto(0.0, five, split)
    up = start.replace(numbers(LOW[0]), "0.0, 0.0, 30.0")
    rows = f"MOVNRB / ON, 4, {len(KNOTS)}, 0, {len(LOW)}, 47.0\n"
    rows += f"MOVNRB / 1, {numbers(np.array(KNOTS[:4]))}\nMOVNRB / 1, {numbers(np.array(KNOTS[4:]))}\n"
    rows += f"MOVNRB / 2, {numbers(LOW[:4])}, $\n {numbers(LOW[4:])}\n"
    rows += f"MOVNRB / 3, {numbers(HIGH)}\n" if five else ""
    points = [goto(u, five, split) for u in PLACES]
    passes = points[0] + among + "".join(points[1:])
    kind = "MOVNRB / M5AXIS, LENGTH, 10.0\n" if five else "MOVNRB / M3AXIS\n"
    end = goto(1.0, five, split).replace("45.0", "60.0")
    whole = f"{head}{up}FEDRAT / 800.0,  MMPM\n{start}{kind}{rows}MOVNRB / NEXT\n{passes}MOVNRB / OFF\n{end}FINI\n"
    assert change[0] in whole
    return whole.replace(*change).encode() if change[0] else whole.encode()


def off(program: Program, u: float) -> tuple[float, float]:
    """Distance of the lines from the curve at a parameter, and of the axis there."""
    tip, axis, a = program.tip[1:-1], program.axis[1:-1], point_of(LOW, u)
    way = np.diff(tip, axis=0)
    part = np.clip(((a - tip[:-1]) * way).sum(axis=1) / (way**2).sum(axis=1), 0, 1)[:, None]
    away = np.linalg.norm(tip[:-1] + part * way - a, axis=1)
    k = int(away.argmin())
    return float(away[k]), float(np.linalg.norm(axis[k] + part[k] * (axis[k + 1] - axis[k]) - axis_of(u)))


@pytest.mark.parametrize("split", [" $\n", ""])
@pytest.mark.parametrize("five", [False, True])
def test_the_curves_are_read_as_lines_near_them(five: bool, split: str) -> None:
    program = read(text(five, split=split), name="x.ncl")
    assert "CS145" in [one.code for one in program.findings]
    assert len(program) > 40
    assert program.tip[1].tolist() == [0, 0, 0]
    assert program.tip[-2] == pytest.approx(LOW[-1])
    assert program.tip[-1, 0] == 60.0
    assert (program.feed[1:] == 800).all()
    for u in np.linspace(0, 1, 101):
        tip, axis = off(program, float(u))
        assert tip < 5.1e-4
        assert axis < 1e-3 if five else (program.axis == [0, 0, 1]).all()
    assert (np.diff(program.line) >= 0).all()


def test_pieces_are_the_curve() -> None:
    found = cubic(np.array(KNOTS), np.hstack((LOW, HIGH)), 5e-4)
    assert found is not None
    middle = (found.u[1:] + found.u[:-1]) / 2
    at = found.bezier.transpose(0, 2, 1) @ np.array([1, 3, 3, 1]) / 8
    exact = np.array([[*point_of(LOW, float(u)), *point_of(HIGH, float(u))] for u in middle])
    assert np.abs(at - exact).max() < 1e-12
    assert set(KNOTS) <= set(found.u)
    away = np.linalg.norm((at - (found.bezier[:, 0] + found.bezier[:, 3]) / 2).reshape(-1, 2, 3), axis=2)
    assert 2e-4 < away.max() <= 5e-4


def alone(five: bool) -> bytes:
    """A curve between rapids."""
    whole = text(five).replace(b"FEDRAT / 800.0,  MMPM\n", b"FEDRAT / 800.0,  MMPM\nRAPID\n")
    return whole.replace(b"MOVNRB / OFF\n", b"MOVNRB / OFF\nRAPID\n")


def written(data: bytes, control: str, form: str, tolerance: float = 0.02) -> str:
    stream = io.BytesIO()
    found = postprocess(data, stream, Settings(tolerance=tolerance), form=choose_form(control, form))
    assert found.verdict is Verdict.PASSED
    return stream.getvalue().decode()


def test_the_control_points_of_the_file_are_in_the_program() -> None:
    blocks = written(alone(True), "fanuc", "g6.2")
    for low, high in zip(LOW, HIGH, strict=True):
        top = low + (high - low) * (100.0 / np.linalg.norm(HIGH[0] - LOW[0]))  # where this form has its second point
        words = [f"{letter}{value:.4f}" for letter, value in zip("XYZUVW", [*low, *top], strict=True)]
        assert " ".join(words) in blocks
    assert blocks.count("G6.2") == 1


@pytest.mark.parametrize(
    ("control", "form"),
    [("fanuc", "g1"), ("fanuc", "g6.2"), ("siemens", "bspline"), ("siemens", "poly"), ("heidenhain", "spl")],
)
@pytest.mark.parametrize("tolerance", [0.02, 0.001])
def test_it_is_written_within_the_tolerance_of_the_curve(control: str, form: str, tolerance: float) -> None:
    assert written(text(form not in ("spl",)), control, form, tolerance)


@pytest.mark.parametrize("form", ["g1", "g6.2"])
def test_a_long_tool_takes_no_more_of_the_tolerance(form: str) -> None:
    settings = Settings(tolerance=0.01, axis_length=300.0)
    found = postprocess(text(True), io.BytesIO(), settings, form=choose_form("fanuc", form))
    assert found.verdict is Verdict.PASSED
    assert found.smoothed.settings.pose_shift < 0.005


def test_a_corner_at_its_end_is_rounded() -> None:
    found = postprocess(text(True), io.BytesIO(), Settings(tolerance=0.02), form=choose_form("fanuc", "g6.2"))
    assert len(sharp_rows(found.smoothed)) == 0
    corners = found.smoothed.corners
    assert corners.rounded[corners.pose == 1].all()
    assert found.smoothed.runs is not None
    assert len(found.smoothed.runs) == 3


def test_what_leaves_the_curve_is_found() -> None:
    data, chosen = alone(True), choose_form("fanuc", "g6.2")
    stream = io.BytesIO()
    postprocess(data, stream, Settings(tolerance=0.02), form=chosen)
    program = read(data, name="x.ncl")
    wrong = stream.getvalue().replace(b"X20.0000 Y5.0000 Z0.0000", b"X20.0000 Y5.0600 Z0.0000")
    assert wrong != stream.getvalue()
    for blocks, passed in ((stream.getvalue(), True), (wrong, False)):
        found = verify(program, blocks, tolerance=0.02, axis_length=10.0, control="fanuc")
        assert (found.verdict is Verdict.PASSED) == passed


def test_curves_stay_with_their_poses_and_systems() -> None:
    whole = read(text(True), name="x.ncl")
    assert whole.curves is not None
    assert whole.curves.runs is not None
    part = some_poses(whole, 1, len(whole))
    assert part.curves is not None
    assert part.curves.runs is not None
    assert (part.curves.pose == whole.curves.pose - 1).all()
    assert part.curves.runs.pose[0] == 0
    cut = some_poses(whole, 5, len(whole)).curves
    assert cut is not None
    assert cut.runs is None
    assert len(cut) == len(whole.curves) - 4
    inch = read(text(True, change=("UNITS / MM", "UNITS / INCHES")), name="x.ncl")
    assert inch.curves is not None
    assert inch.curves.runs is not None
    assert inch.curves.runs.control[-1, :3] == pytest.approx(25.4 * LOW[-1])
    assert np.linalg.norm(inch.curves.runs.control[0, 3:] - inch.curves.runs.control[0, :3]) == pytest.approx(1.0)


def test_the_points_are_taken_of_a_curve_that_is_no_cubic() -> None:
    rows = text(True).replace(b"ON, 4, 10, 0, 6", b"ON, 3, 9, 0, 6")
    rows = rows.replace(b"MOVNRB / 1, 0.0000000000, ", b"MOVNRB / 1, ", 1)
    program = read(rows, name="x.ncl")
    assert len(program) == 7
    assert program.curves is None
    assert [one.text for one in program.findings if one.code == "CS144"] == ["a curve of MOVNRB of order 3: ignored"]


def test_a_curve_from_elsewhere_without_points_is_an_error() -> None:
    rows = text(True, change=("MOVNRB / 2, 0.0000000000,", "MOVNRB / 2, 0.5000000000,"))
    begin, end = rows.index(b"NEXT\n") + 5, rows.index(b"MOVNRB / OFF")
    with pytest.raises(InputError, match=r"error\[CS128\]: .*begins elsewhere"):
        read(rows[:begin] + rows[end:], name="x.ncl")


@pytest.mark.parametrize("five", [False, True])
def test_another_feed_among_the_points_takes_the_points(five: bool) -> None:
    program = read(text(five, among="FEDRAT / 500.0, MMPM\n"), name="x.ncl")
    assert program.tip[2:6] == pytest.approx(np.array([point_of(LOW, u) for u in PLACES]))
    assert program.feed[1:].tolist() == [800, 800, 500, 500, 500, 500]
    assert len(program) == 7


@pytest.mark.parametrize(
    "change",
    [
        ("GOTO / " + numbers(point_of(LOW, 0.5)), "GOTO / " + numbers(point_of(LOW, 0.5) + [0, 0.1, 0])),
        (numbers(axis_of(0.5)), "0.0, 0.6, 0.8"),
        ("MOVNRB / 2, 0.0000000000,", "MOVNRB / 2, 0.5000000000,"),
    ],
)
def test_points_that_are_not_on_the_curve_are_taken_and_told(change: tuple[str, str]) -> None:
    program = read(text(True, change=change), name="x.ncl")
    assert len(program) == 7
    found = [one.text for one in program.findings if one.code == "CS144"]
    assert found == ["a curve of MOVNRB that does not pass by its points: ignored"]


@pytest.mark.parametrize(
    ("change", "why"),
    [
        (("ON, 4, 10, 0", "ON, 4, 10, 1"), "order, knots, 0"),
        (("ON, 4, 10, 0", "ON, 5, 10, 0"), "are no curve"),
        (("ON, 4, 10, 0, 6", "ON, 4, 11, 0, 7"), "has 10 numbers, not 11"),
        (("MOVNRB / NEXT\n", ""), "GOTO comes before MOVNRB/NEXT"),
        (("MOVNRB / NEXT\n", "COOLNT / ON\nMOVNRB / NEXT\n"), "COOLNT comes before MOVNRB/NEXT"),
        (("0.3000000000, 0.65", "0.7000000000, 0.65"), "do not ascend"),
        (("MOVNRB / NEXT\n", "MOVNRB / 4, 1.0\nMOVNRB / NEXT\n"), "MOVNRB/4 is not understood"),
    ],
)
def test_a_record_that_is_no_curve_is_an_error(change: tuple[str, str], why: str) -> None:
    with pytest.raises(InputError, match=rf"x.ncl:\d+: error\[CS128\]: .*({why})"):
        read(text(True, change=change), name="x.ncl")


def test_lines_are_as_near_in_inches() -> None:
    mm, inch = (
        len(read(text(True, change=("UNITS / MM", units)), name="x")) for units in ("UNITS / MM", "UNITS/INCHES")
    )
    assert inch > 4 * mm


def test_a_record_that_does_not_end_is_an_error() -> None:
    whole = text(True)
    with pytest.raises(InputError, match=r"error\[CS128\]: .*MOVNRB/OFF is missing"):
        read(whole[: whole.index(b"MOVNRB / OFF")], name="x.ncl")
