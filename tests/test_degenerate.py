"""Chains that geometry textbooks leave out, and CL files do not (docs/method.md).

Each goes through reader, smoothing and both writers with numpy's warnings as errors. The strict parser sees to it that
no NaN, no negative zero and no zero-length move is written; the oracle that no pose is lost and the tolerance is kept.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import cornersmooth
from cornersmooth.errors import InputError
from oracle.chains import Chain, cl_text
from oracle.judge import judge, not_passed, runs_of
from oracle.library import write
from oracle.motion import unit
from oracle.nc_text import Curve, Form, Line, Written
from oracle.share import covering_share, how_many

Floats = NDArray[np.float64]

H = 10.0
EPS = 0.02
FORMS: tuple[Form, ...] = ("g1", "g6.2")
UP = [0.0, 0.0, 1.0]
TILTED = [0.6, 0.0, 0.8]
OPPOSITE = [0.0, 0.0, -1.0]
NEARLY_OPPOSITE = [0.0, math.sin(math.radians(174.9)), math.cos(math.radians(174.9))]
STEEP = [math.sin(math.radians(89.99)), 0.0, math.cos(math.radians(89.99))]


def chain(tip: Sequence[Sequence[float]] | Floats, axis: Any = UP) -> Chain:
    tips = np.array(tip, dtype=float).reshape(-1, 3)
    axes = unit(np.broadcast_to(np.array(axis, dtype=float), tips.shape))
    return Chain(np.round(tips, 12), axes, np.full(len(tips), 300.0))


def check(one: Chain, form: Form, tolerance: float = EPS, axis_length: float = H) -> Written:
    """Write the chain, hold it against its promise, return it."""
    written = write(cl_text([one])[0], form, tolerance, axis_length)[0]
    runs = runs_of(written, axis_length, tolerance)
    if not runs:  # nothing moves in the printed digits
        assert np.ptp(one.tip, axis=0).max() <= 1e-4
        return written
    verdict = judge(runs, [one.original], axis_length, tolerance)
    assert verdict.deviation.worst <= tolerance, verdict
    ends = one.original.tip[[0, -1]], one.original.axis[[0, -1]]
    assert not not_passed(written, runs[0], *ends, axis_length)
    return written


RISE = 1e-9
CASES: dict[str, Chain] = {
    "two poses": chain([[0, 0, 0], [10, 0, 0]]),
    "two equal poses": chain([[0, 0, 0], [0, 0, 0]]),
    "duplicates inside": chain([[0, 0, 0], [5, 0, 0], [5, 0, 0], [5, 0, 0], [5, 5, 0]]),
    "duplicates at both ends": chain([[0, 0, 0], [0, 0, 0], [5, 0, 0], [5, 5, 0], [5, 5, 0], [5, 5, 0]]),
    "only duplicates": chain([[1, 2, 3]] * 6, TILTED),
    "duplicates that creep": chain([[k * 4e-7, 0, 0] for k in range(10)] + [[5, 0, 0], [5, 5, 0]]),
    "duplicate of a rotated pose": chain(
        [[0, 0, 0], [5, 0, 0], [5, 0, 0], [5, 0, 0], [9, 2, 0]], [UP, UP, TILTED, TILTED, UP]
    ),
    "1e-9 beside 100": chain([[0, 0, 0], [100, 0, 0], [100, RISE, 0], [100, RISE, 100], [0, RISE, 100]]),
    "many 1e-9 between 100": chain([[0, 0, 0]] + [[100, k * RISE, 0] for k in range(30)] + [[200, 0, 0]]),
    "1e-9 with a turn": chain([[0, 0, 0], [50, 0, 0], [50 + RISE, 0, 0], [100, 50, 0]], [UP, UP, TILTED, TILTED]),
    "segments below the digits": chain([[k * 3e-5, (k % 2) * 3e-5, 0] for k in range(40)]),
    "100 after 0.001": chain([[0, 0, 0], [0.001, 0, 0], [0.001, 100, 0], [0.002, 100, 0], [50, 50, 0]]),
    "exact reversal": chain([[0, 0, 0], [10, 0, 0], [0, 0, 0]]),
    "reversals in a row": chain([[0, 0, 0], [10, 0, 0], [0, 0, 0], [10, 0, 0], [5, 0, 0], [20, 0, 0]]),
    "reversal with a turning axis": chain([[0, 0, 0], [10, 0, 0], [0, 0, 0]], [UP, TILTED, UP]),
    "reversal on a grid": chain([[0, 0, 0], [1, 1, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0], [0, 0, 0]]),
    "nearly a reversal": chain([[0, 0, 0], [10, 0, 0], [0, 1e-6, 0], [10, 2e-6, 0]]),
    "just below and above 170": chain(
        [[0, 0, 0]]
        + [[10 * (k % 2), 10 * math.tan(math.radians(a)) * k, 0] for k, a in enumerate((9.9, 10.1, 9.99, 10.01), 1)]
    ),
    "collinear": chain([[k, 0, 0] for k in (0, 1, 1.5, 7, 20)]),
    "collinear with a turning axis": chain(
        [[k, 0, 0] for k in range(5)], unit(np.array([[math.sin(k / 9), 0, math.cos(k / 9)] for k in (0, 1, 4, 2, 3)]))
    ),
    "collinear in the digits only": chain([[k, 1e-6 * (k % 3), 0] for k in range(9)]),
    "pure rotation": chain([[0, 0, 0], [0, 0, 0], [10, 0, 0]], [UP, TILTED, TILTED]),
    "pure rotations in a row": chain(
        [[0, 0, 0], [10, 0, 0], [10, 0, 0], [10, 0, 0], [10, 0, 0], [20, 0, 0]],
        [UP, UP, TILTED, [0, 0.6, 0.8], UP, UP],
    ),
    "nothing but rotations": chain([[3, 4, 5]] * 5, [UP, TILTED, [0, 0.6, 0.8], UP, [1, 0, 1]]),
    "rotation there and back": chain([[0, 0, 0]] * 3, [UP, TILTED, UP]),
    "pure translation": chain([[0, 0, 0], [10, 0, 0], [10, 10, 0], [10, 10, 10]], TILTED),
    "axis turns on one side only": chain([[0, 0, 0], [10, 0, 0], [20, 0, 0], [30, 0, 0]], [UP, UP, TILTED, TILTED]),
    "constant axis": chain([[math.cos(k), math.sin(k), k / 10] for k in range(40)], [1, 2, 3]),
    "89.99 degrees": chain(
        [[0, 0, 0], [10, 0, 0], [10, 10, 0]],
        [UP, [math.sin(math.radians(89.99)), 0, math.cos(math.radians(89.99))], UP],
    ),
    "tiny turns of the axis": chain([[k, 0, 0] for k in range(6)], [[1e-9 * k, 0, 1] for k in range(6)]),
    "far from the origin": chain([[90000 + k, 90000 - k % 2, 90000] for k in range(6)], [UP, TILTED] * 3),
    "axis point stands still": chain(
        [[-10 * math.sin(a), 0, -10 * math.cos(a)] for a in (0.0, 0.2, 0.4, 0.3)],
        [[math.sin(a), 0, math.cos(a)] for a in (0.0, 0.2, 0.4, 0.3)],
    ),
}


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("name", CASES)
def test_degenerate_chain(name: str, form: Form) -> None:
    check(CASES[name], form)


@pytest.mark.parametrize(("name", "axis_length", "form"), covering_share(product(CASES, [0.5, 500.0], FORMS), 5))
def test_degenerate_chain_at_other_axis_lengths(name: str, form: Form, axis_length: float) -> None:
    check(CASES[name], form, axis_length=axis_length, tolerance=0.05)


@pytest.mark.parametrize("form", FORMS)
def test_one_pose(form: Form) -> None:
    written = write(b"UNITS/MM\nGOTO/1,2,3,0,0.6,0.8\nFINI\n", form, EPS, H)[0]
    (position,) = [block for block in written.blocks if isinstance(block, Line)]
    assert position.end[:3] == (1, 2, 3)
    second = (0, 0.6, 0.8) if form == "g1" else (1, 2 + 0.6 * 100, 3 + 0.8 * 100)  # 100 mm up, whatever H is
    assert position.end[3:] == pytest.approx(second)


@pytest.mark.parametrize("form", FORMS)
def test_no_pose_at_all_is_an_error(form: Form) -> None:
    with pytest.raises(cornersmooth.CornersmoothError) as caught:
        write(b"PARTNO EMPTY\nUNITS/MM\nFINI\n", form, EPS, H)
    assert caught.value.hint


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("moves", [True, False])
def test_axis_flip_passes_every_pose(form: Form, moves: bool) -> None:
    """Between axes far apart there is no ruled motion; the poses must be there, and no corner at the flip."""
    tips = [[0, 0, 0], [10, 0, 0], [20 if moves else 10, 0, 0], [30, 5, 0]]
    one = chain(tips, [UP, UP, NEARLY_OPPOSITE, NEARLY_OPPOSITE])
    written = write(cl_text([one])[0], form, EPS, H)[0]
    (path,) = runs_of(written, H, EPS)
    assert not not_passed(written, path, one.tip, one.original.axis, H)
    assert not any(isinstance(block, Curve) for block in written.blocks)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("moves", [True, False])
def test_flip_between_opposite_axes_is_refused(form: Form, moves: bool) -> None:
    tips = [[0, 0, 0], [10, 0, 0], [20 if moves else 10, 0, 0], [30, 5, 0]]
    text, lines = cl_text([chain(tips, [UP, UP, OPPOSITE, OPPOSITE])])
    with pytest.raises(InputError) as caught:
        write(text, form, EPS, H)
    assert (caught.value.code, caught.value.line) == ("CS183", lines[0][2])


@pytest.mark.parametrize("form", FORMS)
def test_every_pose_that_is_reached_in_rapid_is_its_own(form: Form) -> None:
    text = b"UNITS/MM\n" + b"".join(
        b"RAPID\nGOTO/%d,%d,0,0,0,1\nFEDRAT/100,MMPM\nGOTO/%d,%d,0,0,0,1\nGOTO/%d,%d,0,0,0,1\n" % (k, 0, k, 5, k + 1, 5)
        for k in range(0, 20, 2)
    )
    written = write(text + b"FINI\n", form, EPS, H)[0]
    rapids = [block.end[:3] for block in written.blocks if isinstance(block, Line) and block.rapid]
    if form == "g6.2":  # points have no words for the axis alone: the way down begins at a place of its own
        assert rapids.pop(0) == (0, 0, 20)
    assert rapids == [(k, 0, 0) for k in range(0, 20, 2)]


# ---------------------------------------------------------------- anything goes

AXES = [UP, TILTED, [0.0, 0.6, 0.8], [-0.6, 0.0, 0.8], [0.28, 0.96, 0.0], OPPOSITE]
coordinate = st.sampled_from([0.0, 1e-9, 1e-5, 1e-4, 0.001, 0.05, 1.0, 1.0, 2.0, 100.0, -1.0, -0.05])
Pose = tuple[float, float, float, int]
pose = st.tuples(coordinate, coordinate, coordinate, st.integers(0, len(AXES) - 1))


@settings(max_examples=how_many(40, 150), deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(
    poses=st.lists(pose, min_size=2, max_size=9), form=st.sampled_from(FORMS), tolerance=st.sampled_from([0.002, 0.1])
)
def test_any_chain_of_a_coarse_grid(poses: list[tuple[float, float, float, int]], form: Form, tolerance: float) -> None:
    one = chain([[x, y, z] for x, y, z, _ in poses], [AXES[which] for *_, which in poses])
    steps = np.sum(one.axis[1:] * one.axis[:-1], axis=1)
    if (steps < math.cos(math.radians(175))).any():  # nor a way round
        text, lines = cl_text([one])
        with pytest.raises(InputError) as caught:
            write(text, form, tolerance, H)
        flip = 1 + int(np.argmax(steps < math.cos(math.radians(175))))
        assert (caught.value.code, caught.value.line) == ("CS183", lines[0][flip])
    elif (steps < 1e-9).any():  # no ruled motion between axes 90 degrees apart and more: poses only
        written = write(cl_text([one])[0], form, tolerance, H)[0]
        for path in runs_of(written, H, tolerance):
            ends = one.tip[[0, -1]], one.original.axis[[0, -1]]
            assert not not_passed(written, path, *ends, H)
    else:
        check(one, form, tolerance)
