"""Every file is read: the project's own, and the real ones with the counts of the corpus's manifest.

Where they differ: the manifest counts FROM and GOHOME as rapids; it counts the word CIRCLE only (catia_demo5 has three
arcs on drive surfaces); one arc of the core mill is 0.1 um long and read as a line; NURBS become lines.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError
from cornersmooth.model import Move, Program
from oracle import files
from oracle.files import cl_file, of_corpus

#: file: dialect, units, poses, kinds (FROM, RAPID, LINEAR, ARC, HOLE), distinct feeds
COUNTS = {
    "catia_5x6args_prepaflans_pointage.aptsource": ("catia", "mm", 50, (0, 36, 2, 0, 12), 2),
    "catia_demo3.aptsource": ("catia", "mm", 198, (0, 59, 138, 0, 1), 4),
    "catia_demo5.aptsource": ("catia", "mm", 8, (0, 0, 5, 3, 0), 3),
    "cnclite_iso_S_test.apt": ("plain", "mm", 16, (0, 0, 16, 0, 0), 0),
    "cnclite_tulsyan_altintas.apt": ("plain", "mm", 29, (0, 0, 29, 0, 0), 0),
    "creo11_3x_inch_multiop.ncl": ("creo", "inch", 153, (0, 66, 87, 0, 0), 1),
    "creo9_5x_finition2_head.ncl": ("creo", "inch", 2992, (0, 2, 2990, 0, 0), 1),
    "hecc_flank_catia.aptsource": ("catia", "mm", 149, (0, 4, 145, 0, 0), 2),
    "hecc_flank_creo.ncl": ("creo", "mm", 149, (0, 4, 145, 0, 0), 1),
    "hecc_flank_nx.cls": ("nx", "mm", 153, (0, 6, 147, 0, 0), 2),
    "hust_5x_PathPointsFile.cls": ("plain", "mm", 39, (0, 0, 39, 0, 0), 0),
    "hust_5x_impeller_yelun.cls": ("plain", "mm", 52, (0, 0, 52, 0, 0), 0),
    "ncl_upside_down_5x.as": ("ncl", "inch", 26, (0, 3, 23, 0, 0), 0),
    "nx_clsf_coremill_steptools.cls": ("nx", "mm", 3130, (0, 356, 2161, 613, 0), 1),
    "nx_clsf_cutcom_arcs.cls": ("nx", "mm", 566, (0, 76, 350, 140, 0), 1),
    "nx_clsf_deepdrill.cls": ("nx", "mm", 2, (0, 0, 0, 0, 2), 0),
    "nx_clsf_drill_pattern.cls": ("nx", "mm", 91, (1, 61, 29, 0, 0), 1),
    "nx_clsf_facemill_sideaxis.cls": ("nx", "mm", 10, (0, 2, 8, 0, 0), 1),
    "nx_clsf_helix_times_gohome.cls": ("nx", "mm", 12, (1, 4, 1, 6, 0), 1),
    "nx_clsf_nurbs.cls": ("nx", "mm", 17814, (0, 1, 17813, 0, 0), 1),
    "nx_clsf_varcontour5x_ust_a.cls": ("nx", "mm", 546, (0, 38, 508, 0, 0), 1),
    "steptools_plane_1.cldata": ("makino", "mm", 206, (1, 5, 171, 29, 0), 1),
    "swcam_shimemcunha.apt": ("solidworks", "mm", 86, (0, 23, 32, 28, 3), 6),
    "swcam_teste_metrologia.apt": ("solidworks", "mm", 454, (0, 92, 297, 65, 0), 3),
}

#: files for a lathe
TURNING = ("catia_demo3.aptsource", "catia_demo5.aptsource")

#: files of the project's own, one or more in the manner of each CAM system
OWN = {
    "catia_contour.aptsource": ("catia", "mm", 60, (0, 4, 56, 0, 0), 2),
    "catia_profile.aptsource": ("catia", "mm", 9, (0, 2, 6, 1, 0), 2),
    "creo_plate.ncl": ("creo", "inch", 22, (0, 3, 18, 1, 0), 2),
    "creo_vane.ncl": ("creo", "inch", 24, (0, 2, 22, 0, 0), 1),
    "hsm_cover.apt": ("hsm", "mm", 31, (0, 5, 26, 0, 0), 3),
    "makino_contour.cldata": ("makino", "mm", 12, (1, 3, 6, 2, 0), 2),
    "ncl_surface.as": ("ncl", "inch", 28, (0, 2, 26, 0, 0), 1),
    "nx_blade.cls": ("nx", "mm", 56, (0, 6, 50, 0, 0), 2),
    "nx_holes.cls": ("nx", "mm", 6, (0, 2, 0, 0, 4), 0),
    "nx_pocket.cls": ("nx", "mm", 19, (1, 4, 8, 6, 0), 2),
    "nx_spline.cls": ("nx", "mm", 222, (0, 2, 220, 0, 0), 1),
    "plain_fan.apt": ("plain", "mm", 18, (0, 0, 18, 0, 0), 0),
    "points_fan.txt": ("csv", "mm", 25, (0, 1, 24, 0, 0), 0),
    "points_zigzag.csv": ("csv", "mm", 30, (0, 1, 29, 0, 0), 0),
    "solidworks_bracket.apt": ("solidworks", "mm", 22, (0, 8, 10, 2, 2), 4),
}


def kinds(program: Program) -> tuple[int, ...]:
    return tuple(np.bincount(program.kind, minlength=len(Move)).tolist())


@pytest.mark.parametrize(("name", "counts"), [*OWN.items(), *of_corpus(COUNTS.items())])
def test_counts(name: str, counts: tuple[str, str, int, tuple[int, ...], int]) -> None:
    dialect, units, poses, kind, feeds = counts
    program = read(cl_file(name), lenient=name in TURNING)
    assert (program.source.dialect, program.units, len(program)) == (dialect, units, poses)
    assert kinds(program) == kind
    assert len(np.unique(program.feed[~np.isnan(program.feed)])) == feeds
    assert program.source.name == name
    assert np.allclose(np.linalg.norm(program.axis, axis=1), 1, rtol=0, atol=1e-15)


def test_every_own_file_is_counted() -> None:
    assert sorted(OWN) == sorted(path.name for path in files.OWN.iterdir())


def test_own_arcs_turn_as_their_systems_mean_them() -> None:
    """Turned the other way they would leave the lines beside them by a kink."""
    sweeps = {
        "nx_pocket.cls": [4 * np.pi, *4 * [np.pi / 2], np.pi / 2],
        "makino_contour.cldata": [np.pi / 2, np.pi / 2],
        "creo_plate.ncl": [np.pi / 2],
        "solidworks_bracket.apt": [np.pi / 2, np.pi / 2],
        "catia_profile.aptsource": [np.pi / 2],
    }
    for name, wanted in sweeps.items():
        program = read(cl_file(name))
        assert np.abs(program.arcs.sweep) == pytest.approx(wanted), name
        assert "CS142" not in [finding.code for finding in program.findings], name


def tilt(program: Program, line: int) -> float:
    """Angle in degrees from +Z of the axis at the first pose at or after a line."""
    axis = program.axis[np.searchsorted(program.line, line)]
    return float(np.degrees(np.arctan2(np.hypot(axis[0], axis[1]), axis[2])))


def test_what_three_numbers_mean_for_the_axis(corpus: Path) -> None:
    shimemcunha = read(corpus / "swcam_shimemcunha.apt")  # the next operation's CSYS sets the axis upright again
    assert tilt(shimemcunha, 15) == pytest.approx(0.29, abs=0.005)
    assert tilt(shimemcunha, 48) == 0
    metrologia = read(corpus / "swcam_teste_metrologia.apt")
    assert tilt(metrologia, 270) == 0
    assert (metrologia.axis[metrologia.line > 276] == [1, 0, 0]).all()
    side = read(corpus / "nx_clsf_facemill_sideaxis.cls")  # said once, then held
    assert (side.axis == [0, 1, 0]).all()
    tilted = read(corpus / "nx_clsf_varcontour5x_ust_a.cls")
    assert len(np.unique(tilted.axis, axis=0)) == 63
    turning = read(corpus / "catia_demo3.aptsource", lenient=True)  # SYN makes a comment of TLAXIS
    assert (turning.axis == [0, 0, 1]).all()


def test_turning_is_refused(corpus: Path) -> None:
    for name, line in zip(TURNING, (29, 17), strict=True):
        with pytest.raises(InputError, match=rf"{name}:{line}: error\[CS179\]: T.* is for a lathe"):
            read(corpus / name)
