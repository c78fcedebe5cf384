"""What verification measures in the text is what the report calculates from the construction."""

from __future__ import annotations

import io
import math
from itertools import pairwise, product
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import cKDTree

from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError
from cornersmooth.model import Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc_reader import read_nc
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.tool import written_at
from cornersmooth.report.paths import deviation_at
from cornersmooth.report.tables import path_distances, worst_corners
from cornersmooth.settings import LARGEST_CHORD, Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from cornersmooth.verify.task import Task
from oracle.files import sample
from oracle.share import covering_share, how_many, share

SAMPLES = Path(__file__).parents[2] / "samples"

FORMS = ("g1", "g6.2")
LIMITS = ((0.001, 10.0), (0.04, 10.0), (0.15, 50.0))


def differences(program: Program, form: str, tolerance: float, axis_length: float) -> tuple[float, float, float]:
    """Measured less calculated at tip and axis point, and the printed digit, mm."""
    chosen = choose_form("fanuc", form)
    smoothed = smooth(
        program,
        fit_settings(
            Settings(tolerance=tolerance, axis_length=axis_length, method="proportional"), chosen, program.units
        ),
    )
    stream = io.BytesIO()
    write(smoothed, stream, form=chosen)
    text = read_nc(stream.getvalue())
    measured = verify(program, stream.getvalue(), tolerance=tolerance, axis_length=axis_length)
    tip, axis_point, _ = worst_corners(smoothed, dense=not chosen.curve)
    return (
        measured.max_tip_deviation_mm - tip,
        measured.max_axis_point_deviation_mm - axis_point,
        text.tip_step,
    )


def room(step: float) -> float:
    """Half a printed digit in each of three coordinates, and what only arithmetic may do."""
    return math.sqrt(3) / 2 * step + 1e-6


@pytest.mark.parametrize(
    ("name", "form"), covering_share(product(["paper_table1.csv", "impeller.cls", "impeller.aptsource"], FORMS), 3)
)
def test_samples(name: str, form: str) -> None:
    program = read((SAMPLES / name).read_bytes(), name=name)
    for tolerance, axis_length in LIMITS:
        tip, axis_point, step = differences(program, form, tolerance, axis_length)
        assert max(abs(tip), abs(axis_point)) <= room(step), (tolerance, axis_length, tip, axis_point)


@pytest.mark.corpus
@pytest.mark.parametrize("form", FORMS)
def test_real_files(form: str, corpus: Path) -> None:
    looked_at = turn = 0
    for path in sorted(corpus.glob("*.*")):
        turn += 1
        if turn % how_many(4, 1) != FORMS.index(form) % how_many(4, 1):  # each second file, in one of the forms
            continue
        try:
            program = read(path.read_bytes(), name=path.name)
            # each file at one of the limits; arcs, which become many lines, at those of rough cuts
            limits_of = LIMITS[1:] if len(program.arcs.pose) else LIMITS
            found = [differences(program, form, *limits) for limits in share(limits_of, len(limits_of), looked_at)]
        except CornersmoothError:  # not a CL file, or a form without words for it
            continue
        looked_at += 1
        # the report is about corners: lines for arcs leave those by the chord tolerance
        arcs = LARGEST_CHORD if len(program.arcs.pose) else 0.0
        for tip, axis_point, step in found:
            assert max(abs(tip), abs(axis_point)) <= room(step) + arcs, (path.name, tip, axis_point)
    assert looked_at >= how_many(5, 20)


@pytest.mark.parametrize("dense", [True, False])
def test_unequal_legs_pass_nearer_than_the_construction_says(dense: bool) -> None:
    """By brute force: the curve in 20,001 points, or its chords; what is said is 1e-4 of it larger at most."""
    rng = np.random.default_rng(3)
    tip = np.cumsum(rng.normal(size=(60, 3)) * rng.choice([0.3, 3.0], (60, 1)), axis=0)
    axis = np.array([0.0, 0.0, 1.0]) + np.cumsum(0.1 * rng.normal(size=(60, 3)), axis=0)
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    rows = [",".join(f"{number:.9f}" for number in row) for row in np.hstack((tip, axis)).tolist()]
    program = read(("x,y,z,i,j,k\n" + "\n".join(rows) + "\n").encode(), name="chain.csv")
    smoothed = smooth(program, Settings(tolerance=0.1))
    all_rows = np.flatnonzero(smoothed.corners.smoothed)
    near_tip, near_axis = path_distances(smoothed, all_rows, dense=dense)
    assert (near_tip < 0.8 * smoothed.corners.tip_error[all_rows]).sum() > 5
    for k, row in enumerate(all_rows.tolist()):
        tips, tops = _path(smoothed, row, dense)
        pose = smoothed.corners.pose[row]
        corner = program.tip[pose]
        assert near_tip[k] == pytest.approx(np.linalg.norm(tips - corner, axis=1).min(), abs=1e-5)
        top = corner + 10.0 * program.axis[pose]
        assert near_axis[k] == pytest.approx(np.linalg.norm(tops - top, axis=1).min(), abs=1e-5)


def _path(smoothed, row: int, dense: bool):  # type: ignore[no-untyped-def]
    """Tips and axis points of one transition, close together."""
    from cornersmooth.geometry import nurbs
    from cornersmooth.smoothing.sampling import nodes
    from cornersmooth.smoothing.segments import lines_of

    corners = smoothed.corners
    tip_curve, axis_curve = nurbs.control_points(smoothed.program, corners, np.array([row]), 10.0)
    u = np.linspace(0, 1, 20001)
    if dense:
        u = np.concatenate(([0.0], nodes(int(lines_of(smoothed, np.array([row]))[0]))))
    tips, tops = (nurbs.evaluate(curve, u)[0] for curve in (tip_curve, axis_curve))
    axes = tops - tips
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    if dense:
        share = np.linspace(0, 1, 4001)[:, None]
        tips = np.concatenate([a + share * (b - a) for a, b in pairwise(tips)])
        axes = np.concatenate([a + share * (b - a) for a, b in pairwise(axes)])
        axes /= np.linalg.norm(axes, axis=1)[:, None]
    return tips, tips + 10.0 * axes


def test_what_is_farthest_between_the_vertices_of_a_curve_is_measured() -> None:
    """Curves are divided for the proof alone: their parts may bend by an eighth of ε."""
    program = read(sample("impeller.cls"), name="impeller.cls")
    chosen = choose_form("fanuc", "g6.2")
    smoothed = smooth(program, fit_settings(Settings(method="global"), chosen, program.units))
    stream = io.BytesIO()
    write(smoothed, stream, form=chosen)
    text, task = read_nc(stream.getvalue()), Task.of(program, 0.01, 10.0)
    curves = np.flatnonzero(text.kind == Element.CURVE)
    along = np.linspace(0.0, 1.0, 301)
    written = task.six(*written_at(text, np.repeat(curves, len(along)), np.tile(along, len(curves))))
    place = np.interp(np.arange(0.0, task.path.length[-1], 0.001), task.path.length, np.arange(len(task.path.length)))
    apart, _ = cKDTree(task.path.at(place)[:, 3:]).query(written[:, 3:], distance_upper_bound=0.02)
    measured = verify(program, stream.getvalue(), tolerance=0.01, axis_length=10.0)
    # where both are within ε at one moment, no amount at a common pose is beyond
    every = np.repeat(np.arange(len(text)), 8), np.tile(np.arange(1, 9) / 8, len(text))
    together = deviation_at(task, text, *every)
    assert max(np.nanmax(together.tip), np.nanmax(together.axis_point)) <= 0.01 + 1e-6
    assert measured.together_axis_point.value <= 0.01 + 1e-6
    assert measured.max_axis_point_deviation_mm >= apart[np.isfinite(apart)].max() - 2e-5


#: the tip hardly moves where the tool turns: lines there are a hundredth of ε long
STANDING = """FEDRAT/MMPM,4000
GOTO/26.819958,12.220369,17.425087,-0.007309,-0.588412,0.808528
GOTO/27.602362,14.518102,20.454959,0.089116,-0.591095,0.801664
GOTO/27.602275,14.520865,20.453433,-0.046852,-0.539243,0.840846
GOTO/24.439343,15.685060,18.339468,0.046646,-0.565454,0.823460
GOTO/24.439659,15.685810,18.339610,0.032832,-0.560673,0.827386
GOTO/27.891213,19.944442,12.876121,0.046080,-0.572239,0.818791
"""


def test_the_nearest_place_is_found_many_lines_away() -> None:
    tip, axis_point, step = differences(read(STANDING.encode(), name="p.cls"), "g1", 0.02, 10.0)
    assert max(abs(tip), abs(axis_point)) <= room(step), (tip, axis_point)


#: the tip stands where the tool turns by 20 degrees and more
TURNING = """FEDRAT/MMPM,777
GOTO/-0.2421,5.7117,-3.0528,-0.127379,-0.165692,0.977917
GOTO/-0.2421,5.7117,-3.0528,-0.228651,0.204438,0.951800
GOTO/2.1285,7.3622,-0.9342,-0.034548,-0.362621,0.931296
GOTO/-0.0490,6.7864,-0.5560,0.153040,0.199291,0.967916
GOTO/-0.0490,6.7864,-0.5560,-0.085638,0.129161,0.987919
GOTO/-1.1191,6.8765,0.6386,-0.022422,-0.133096,0.990850
GOTO/-5.5138,3.9047,-0.4580,-0.298700,0.212609,0.930363
"""


def test_two_curves_on_their_own_state_no_more_than_they_keep() -> None:
    program, chosen = read(TURNING.encode(), name="p.cls"), choose_form("fanuc", "g1")
    stream = io.BytesIO()
    settings = Settings(tolerance=0.5, method="zhang2016")
    write(smooth(program, fit_settings(settings, chosen, program.units)), stream, form=chosen)
    measured = verify(program, stream.getvalue(), tolerance=0.5, axis_length=10.0)
    assert measured.passed
    assert measured.max_tip_deviation_mm <= 0.5
