"""The promise of `-e` over the written numbers with free weights, measured by the oracle."""

from __future__ import annotations

import io
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cornersmooth
from cornersmooth.model import Program, SmoothProgram
from cornersmooth.nc import choose_form
from oracle.chains import cl_text, random_chains
from oracle.distance import deviation
from oracle.files import cl_file, of_corpus
from oracle.judge import feeds_out_of_place, judge, not_passed, runs_of
from oracle.library import exact_poses, original_motion
from oracle.motion import written_path
from oracle.nc_text import Curve, Form, Written, parse, without_way_down
from oracle.share import covering_share, how_many

ROOT = Path(__file__).resolve().parent.parent
FORMS: tuple[Form, ...] = ("g1", "g6.2")
OPTIONS = {
    "weights": {"weights": (1.0, 0.65)},
    "sharp weights": {"weights": (2.5, 0.3)},
}
SAMPLES = ("paper_table1.csv", "impeller.cls")
FILES = (
    "cnclite_iso_S_test.apt",
    "cnclite_tulsyan_altintas.apt",
    "creo9_5x_finition2_head.ncl",
    "hecc_flank_creo.ncl",
    "hust_5x_impeller_yelun.cls",
    "hust_5x_toolpath_fan.txt",
    "shenmuxin_5x_path.csv",
)


def write(program: Program, form: Form, options: dict[str, Any]) -> tuple[Written, SmoothProgram]:
    wanted = cornersmooth.Settings(**options)
    smoothed = cornersmooth.smooth(
        program, cornersmooth.fit_settings(wanted, choose_form("fanuc", form), program.units)
    )
    stream = io.BytesIO()
    cornersmooth.write(smoothed, stream, control="fanuc", form=form)
    return parse(stream.getvalue(), form), smoothed


@pytest.mark.parametrize(
    ("options", "form", "tolerance", "axis_length"),
    [
        (OPTIONS[name], form, *limits)
        for name, form, limits in covering_share(product(OPTIONS, FORMS, [(0.01, 50.0), (0.15, 10.0)]), 5)
    ],
)
def test_random_chains(form: Form, tolerance: float, axis_length: float, options: dict[str, Any]) -> None:
    # every case sees other chains
    case = FORMS.index(form) + 2 * list(OPTIONS.values()).index(options) + 4 * int(tolerance > 0.1)
    chains = random_chains(100 + case, how_many(15, 150))
    program = cornersmooth.read(cl_text(chains)[0])
    written, smoothed = write(program, form, {"tolerance": tolerance, "axis_length": axis_length, **options})
    assert smoothed.corners.smoothed.mean() > 0.6
    moving = [chain for chain in chains if np.ptp(chain.tip, axis=0).any() or np.ptp(chain.axis, axis=0).any()]
    paths = runs_of(written, axis_length, tolerance)
    verdict = judge(paths, [chain.original for chain in moving], axis_length, tolerance)
    assert verdict.deviation.worst <= tolerance, verdict
    for path, chain in zip(paths, moving, strict=True):
        assert not feeds_out_of_place(written, path, chain.original, chain.feed, axis_length, tolerance)


@pytest.mark.parametrize(("name", "way", "form"), covering_share(product(SAMPLES, OPTIONS, FORMS), 4))
def test_samples(name: str, way: str, form: Form) -> None:
    options = OPTIONS[way]
    keeps_the_promise(ROOT / "samples" / name, form, options)


@pytest.mark.parametrize(
    ("form", "options", "name"),
    [
        (form, OPTIONS[option], name)
        for form, option, name in covering_share(
            product(FORMS, OPTIONS, ["nx_blade.cls", "creo_vane.ncl", "points_fan.txt"]), 4
        )
    ],
)
def test_own_files(name: str, options: dict[str, Any], form: Form) -> None:
    keeps_the_promise(cl_file(name), form, options)


@pytest.mark.parametrize(("name", "options", "form"), of_corpus(covering_share(product(FILES, OPTIONS, FORMS), 12)))
def test_real_files(name: str, options: str, form: Form) -> None:
    keeps_the_promise(cl_file(name), form, OPTIONS[options])


def keeps_the_promise(path: Path, form: Form, options: dict[str, Any]) -> None:
    """The whole file keeps ε and passes exactly what is not rounded."""
    tolerance, axis_length = 0.04, 20.0
    program = cornersmooth.read(path)
    written, smoothed = write(program, form, {"tolerance": tolerance, "axis_length": axis_length, **options})
    start, *rest = written_path(without_way_down(written), axis_length, tolerance, rapids=True)
    assert not rest
    found = deviation(start, original_motion(program, tolerance), axis_length, tolerance)
    assert found.worst <= tolerance, found
    exact = exact_poses(smoothed)
    assert not not_passed(written, start, program.tip[exact], program.axis[exact], axis_length)


def test_weights_stand_in_the_text_with_three_decimals() -> None:
    program = cornersmooth.read(ROOT / "samples" / "impeller.cls")
    written, _ = write(program, "g6.2", {"weights": (0.9123, 0.58449)})
    shown = np.array([block.weights for block in written.blocks if isinstance(block, Curve)])
    assert len(shown) > 100
    assert (shown == [1.0, 0.912, 0.584, 0.912, 1.0]).all()


def test_weights_are_refused_where_the_method_has_its_own() -> None:
    with pytest.raises(cornersmooth.CornersmoothError, match="leave out weights"):
        cornersmooth.Settings(method="global", weights=(1.0, 0.5))
