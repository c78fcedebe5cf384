"""Where curves of transitions meet lines and one another the written tip hardly changes its direction."""

from __future__ import annotations

import io
import os
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import Verdict
from cornersmooth.feedrate import Limits
from cornersmooth.feedrate.path import Kind
from cornersmooth.feedrate.taylor import taylor_along
from cornersmooth.feedrate.written import text_path
from cornersmooth.model import Floats
from cornersmooth.nc import choose_form
from cornersmooth.pipeline import postprocess, read_back
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.smoothing.construction import construction_of

SAMPLES = Path(__file__).parents[2] / "samples"
CORPUS = os.environ.get("CORNERSMOOTH_CORPUS", "")
REAL = (
    "hecc_point_zigzag.csv",
    "hecc_flank_nx.cls",
    "hust_5x_impeller_yelun.cls",
    "nx_clsf_varcontour5x_ust_a.cls",
    "shenmuxin_5x_path.csv",
    "steptools_plane_1.cldata",
)
#: degrees, in four decimals: where lines of 1 µm were left, 2.8 to 18 on five of these files
LARGEST = 1.1


def kinks(file: Path) -> tuple[Floats, Floats]:
    """Turns (k,) of the tip where curves join, degrees, and lengths of lines between two curves, mm, as written."""
    form, stream = choose_form("fanuc", "g6.2"), io.BytesIO()
    program = read(file).with_feed(1800.0)
    result = postprocess(program, stream, Settings(method="proportional"), form=form, processes=1)
    assert result.verdict is Verdict.PASSED
    settings = result.smoothed.settings
    path = text_path(read_back(stream.getvalue(), form, settings), Limits(), settings=settings)
    element = np.arange(len(path))
    ends = [taylor_along(path, element, np.full(len(path), share), 2)[0] for share in (0.0, 1.0)]
    after, before = ends[0][1, 1:], ends[1][1, :-1]
    curve, still = path.kind == Kind.CURVE, path.rapid | path.turning
    joins = (curve[1:] | curve[:-1]) & ~still[1:] & ~still[:-1]
    # a corner that stays sharp is at a pose
    away = np.abs(ends[0][0, 1:, None] - program.tip[None]).max(axis=2).min(axis=1) > 1e-3
    size = np.linalg.norm(after, axis=1) * np.linalg.norm(before, axis=1)
    cosine = np.einsum("ij,ij->i", after, before)[joins & away] / size[joins & away]
    inner = np.flatnonzero(curve[:-2] & ~curve[1:-1] & curve[2:] & ~still[1:-1]) + 1
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), path.length[inner]


@pytest.mark.parametrize(
    "file",
    [SAMPLES / "impeller.cls", SAMPLES / "paper_table1.csv", *(Path(CORPUS) / name for name in REAL)],
    ids=lambda file: file.name,
)
def test_curves_join_with_no_kink_that_counts(file: Path) -> None:
    if not CORPUS and file.name in REAL:
        pytest.skip("CORNERSMOOTH_CORPUS does not name a folder of CL files")
    turn, length = kinks(file)
    assert len(turn) > 3
    assert turn.max() < LARGEST
    assert not len(length) or length.min() > 0.005  # 50 steps of the digits


@pytest.mark.parametrize("method", ["proportional", "zhang2016"])
def test_no_corner_has_no_points(method: str) -> None:
    smoothed = smooth(read(SAMPLES / "paper_table1.csv", units="mm"), Settings(method=method, tolerance=0.05))
    tips, levers = construction_of(method).points(smoothed, np.zeros(0, np.int64), np.array([0.5, 1.0]))
    assert tips.shape == levers.shape == (0, 3, 3)
