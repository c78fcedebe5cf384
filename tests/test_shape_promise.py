"""The promise of `-e` over the written numbers with every shape and allocation, measured by the oracle."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cornersmooth
from cornersmooth.model import Program, SmoothProgram
from cornersmooth.nc import choose_form
from oracle.chains import cl_text, random_chains
from oracle.distance import deviation
from oracle.judge import judge, not_passed, runs_of
from oracle.library import exact_poses, original_motion
from oracle.motion import written_path
from oracle.nc_text import Curve, Form, Written, parse

ROOT = Path(__file__).resolve().parent.parent
FORMS: tuple[Form, ...] = ("g1", "g6.2")
OPTIONS = {
    "auto": {"shape": "auto"},
    "fair": {"allocation": "fair"},
    "auto-fair": {"shape": "auto", "allocation": "fair"},
    "weights": {"weights": (1.0, 0.65)},
    "sharp weights": {"weights": (2.5, 0.3), "allocation": "fair"},
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


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("tolerance", "axis_length"), [(0.01, 50.0), (0.15, 10.0)])
def test_random_chains(form: Form, tolerance: float, axis_length: float, options: dict[str, Any]) -> None:
    chains = random_chains(100, 150)
    program = cornersmooth.read(cl_text(chains)[0])
    written, smoothed = write(program, form, {"tolerance": tolerance, "axis_length": axis_length, **options})
    assert smoothed.corners.smoothed.mean() > 0.6
    originals = [
        chain.original for chain in chains if np.ptp(chain.tip, axis=0).any() or np.ptp(chain.axis, axis=0).any()
    ]
    verdict = judge(runs_of(written, axis_length, tolerance), originals, axis_length, tolerance)
    assert verdict.deviation.worst <= tolerance, verdict


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@pytest.mark.parametrize("name", SAMPLES)
def test_samples(name: str, options: dict[str, Any], form: Form) -> None:
    keeps_the_promise(ROOT / "samples" / name, form, options)


@pytest.mark.corpus
@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@pytest.mark.parametrize("name", FILES)
def test_real_files(corpus: Path, name: str, options: dict[str, Any], form: Form) -> None:
    keeps_the_promise(corpus / name, form, options)


def keeps_the_promise(path: Path, form: Form, options: dict[str, Any]) -> None:
    """The whole file keeps ε and passes exactly what is not rounded."""
    tolerance, axis_length = 0.04, 20.0
    program = cornersmooth.read(path)
    written, smoothed = write(program, form, {"tolerance": tolerance, "axis_length": axis_length, **options})
    start, *rest = written_path(written, axis_length, tolerance, rapids=True)
    assert not rest
    found = deviation(start, original_motion(program, tolerance), axis_length, tolerance)
    assert found.worst <= tolerance, found
    exact = exact_poses(smoothed)
    assert not not_passed(written, start, program.tip[exact], program.axis[exact], axis_length)


def test_weights_stand_in_the_text_with_three_decimals() -> None:
    written, smoothed = write(cornersmooth.read(ROOT / "samples" / "impeller.cls"), "g6.2", {"shape": "auto"})
    curves = [block for block in written.blocks if isinstance(block, Curve)]
    shown = np.array([curve.weights for curve in curves])
    corners = smoothed.corners
    assert shown[:, 2].tolist() == corners.weights[corners.smoothed, 1].tolist()
    assert (shown[:, [0, 1, 3, 4]] == 1.0).all()
    assert len(np.unique(shown[:, 2])) > 2
