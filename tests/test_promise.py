"""The promise of `-e`: the written numbers, measured by the oracle, stay within ε of the original motion.

Through the whole command, both forms, over 1,000 random chains of every character for each tolerance and axis length,
over the samples, the project's own files and the real files of the corpus.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import pytest

import cornersmooth
from cornersmooth.model import Move
from oracle.chains import Chain, cl_text, random_chains
from oracle.command import run
from oracle.distance import deviation
from oracle.files import cl_file, of_corpus
from oracle.judge import feeds_out_of_place, judge, not_passed, runs_of
from oracle.library import exact_poses, original_motion, write
from oracle.motion import Path as Motion
from oracle.motion import written_path
from oracle.nc_text import Code, Curve, Form, Line, Written, parse, without_way_down
from oracle.share import covering_share, how_many

TOLERANCES = (0.001, 0.01, 0.04, 0.15)
AXIS_LENGTHS = (10.0, 50.0)
FORMS: tuple[Form, ...] = ("g1", "g6.2")
#: for each tolerance and axis length; half of them in either form
CHAINS = how_many(40, 1000)
#: statuses of the report under which a pose need not be passed
ROUNDED = "smoothed"
REPEATED = "duplicate"


@dataclass(frozen=True)
class Case:
    """What one run of the command made of the random chains."""

    chains: list[Chain]
    written: Written
    status: dict[int, str]  #: by source line
    lines: list[np.ndarray]
    tolerance: float
    axis_length: float

    @cached_property
    def paths(self) -> list[Motion]:
        return runs_of(self.written, self.axis_length, self.tolerance)


def smooth(
    folder: Path, data: bytes, form: Form, tolerance: float, axis_length: float
) -> tuple[Written, dict[int, str]]:
    """Parsed NC text and status of every corner by source line."""
    source, out, report = folder / "in.cls", folder / "out.nc", folder / "report.csv"
    source.write_bytes(data)
    # the oracle is to judge, not the built-in verification
    options = ["-e", str(tolerance), "-H", str(axis_length), "-f", form, "--force", "-q", "--no-verify"]
    result = run("smooth", source, "-o", out, "--report", report, "--method", "proportional", *options)
    assert result.returncode == 0, result.stderr.decode()
    with report.open(newline="") as stream:
        status = {int(row["line"]): row["status"] for row in csv.DictReader(stream)}
    return parse(out.read_bytes(), form), status


CASES = [(form, tolerance, length) for form in FORMS for tolerance in TOLERANCES for length in AXIS_LENGTHS]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{case[0]}-{case[1]}-{case[2]:g}")
def case(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Case:
    form, tolerance, axis_length = request.param
    # every case sees other chains
    chains = random_chains(CASES.index(request.param), CHAINS // len(FORMS), corners=4)
    data, lines = cl_text(chains)
    written, status = smooth(tmp_path_factory.mktemp("promise"), data, form, tolerance, axis_length)
    return Case(chains, written, status, lines, tolerance, axis_length)


def moving(case: Case) -> list[int]:
    """Chains that leave their first pose; the others write no run."""
    return [
        index
        for index, chain in enumerate(case.chains)
        if np.ptp(chain.tip, axis=0).any() or np.ptp(chain.axis, axis=0).any()
    ]


def test_random_chains_keep_the_tolerance(case: Case) -> None:
    originals = [case.chains[index].original for index in moving(case)]
    verdict = judge(case.paths, originals, case.axis_length, case.tolerance)
    assert verdict.deviation.worst <= case.tolerance, verdict
    if case.written.form == "g1" and case.axis_length == max(AXIS_LENGTHS):  # controls turn vectors either way
        # a quarter of the chains, without the one that is cut in two
        part = replace(case.written, blocks=case.written.blocks[: len(case.written.blocks) // 4])
        paths = runs_of(part, case.axis_length, case.tolerance, "great circle")[:-1]
        assert len(paths) > len(originals) // 8
        verdict = judge(paths, originals[: len(paths)], case.axis_length, case.tolerance)
        assert verdict.deviation.worst <= case.tolerance, verdict


def test_random_chains_are_rounded_at_all(case: Case) -> None:
    """Passing every pose would keep any tolerance."""
    share = np.mean([status == ROUNDED for status in case.status.values()])
    assert share > 0.6
    blocks = case.written.blocks
    if case.written.form == "g6.2":
        assert sum(isinstance(block, Curve) for block in blocks) == sum(s == ROUNDED for s in case.status.values())
    else:
        assert sum(isinstance(block, Line) for block in blocks) > 2 * len(case.status)


def test_poses_not_rounded_are_passed_exactly(case: Case) -> None:
    for index, path in zip(moving(case), case.paths, strict=True):
        chain, lines = case.chains[index], case.lines[index]
        exact = [k for k in range(len(lines)) if case.status.get(int(lines[k]), "end") not in (ROUNDED, REPEATED)]
        axis = chain.original.axis
        lost = not_passed(case.written, path, chain.tip[exact], axis[exact], case.axis_length)
        assert not lost, [(int(lines[exact[k]]), case.status.get(int(lines[exact[k]]))) for k in lost]


def test_built_in_verification_agrees(case: Case, tmp_path: Path) -> None:
    """What the oracle finds right, the command must not refuse."""
    out, options = tmp_path / "o.nc", ["-e", str(case.tolerance), "-H", str(case.axis_length), "-f", case.written.form]
    result = run("smooth", "-", "-o", out, "-q", *options, data=cl_text(case.chains[::4])[0])
    assert result.returncode == 0, result.stderr.decode()


def test_feeds_keep_their_place(case: Case) -> None:
    for index, path in list(zip(moving(case), case.paths, strict=True))[::5]:
        chain = case.chains[index]
        complaints = feeds_out_of_place(
            case.written, path, chain.original, chain.feed, case.axis_length, case.tolerance
        )
        assert not complaints, (index, chain, complaints)


@pytest.mark.parametrize(("form", "axis_length"), [("g1", 50.0), ("g6.2", 50.0), ("g6.2", 500.0), ("g1", 500.0)])
def test_long_segments_with_steep_turns(form: Form, axis_length: float) -> None:
    """The axis turns by 80 degrees over a metre: b of the written lines must follow at the finest tolerance."""
    angle = np.radians(80)
    axis = np.array([[0, 0, 1.0], [np.sin(angle), 0, np.cos(angle)], [np.sin(angle), 0, np.cos(angle)]])
    chain = Chain(np.array([[0.0, 0, 0], [1000, 0, 0], [1000, 500, 0]]), axis, np.full(3, 500.0))
    written = write(cl_text([chain])[0], form, 0.001, axis_length)[0]
    verdict = judge(runs_of(written, axis_length, 0.001), [chain.original], axis_length, 0.001)
    assert verdict.deviation.worst <= 0.001, verdict


# ---------------------------------------------------------------- whole files

FOUR_OR_LESS = (
    "catia_5x6args_prepaflans_pointage.aptsource",
    "creo11_3x_inch_multiop.ncl",
    "nx_clsf_drill_pattern.cls",
    "nx_clsf_facemill_sideaxis.cls",
    "nx_clsf_helix_times_gohome.cls",
    "nx_clsf_nurbs.cls",
    "steptools_plane_1.cldata",
    "swcam_shimemcunha.apt",
)
FIVE_AXIS = (
    "cnclite_iso_S_test.apt",
    "cnclite_tulsyan_altintas.apt",
    "creo9_5x_finition2_head.ncl",
    "hecc_flank_catia.aptsource",
    "hecc_flank_creo.ncl",
    "hecc_flank_nx.cls",
    "hecc_point_zigzag.csv",
    "hust_5x_PathPointsFile.cls",
    "hust_5x_impeller_yelun.cls",
    "hust_5x_toolpath_fan.txt",
    "ncl_upside_down_5x.as",
    "nx_clsf_varcontour5x_ust_a.cls",
    "shenmuxin_5x_path.csv",
)
SAMPLES = ("paper_table1.csv", "impeller.cls", "impeller.aptsource")
ROOT = Path(__file__).resolve().parent.parent


def whole_file(path: Path, form: Form, tolerance: float, axis_length: float) -> None:
    """The file from its first pose to its last, rapids included, keeps the tolerance and passes its poses."""
    program = cornersmooth.read(path)
    written, smoothed, _ = write(program, form, tolerance, axis_length)
    start, *rest = written_path(without_way_down(written), axis_length, tolerance, rapids=True)
    assert not rest
    if not (program.kind == Move.HOLE).any():  # what a hole cycle does between its poses is not of the CL path
        original = original_motion(program, tolerance)
        found = deviation(start, original, axis_length, tolerance)
        assert found.worst <= tolerance, found
    exact = exact_poses(smoothed)
    lost = not_passed(written, start, program.tip[exact], program.axis[exact], axis_length)
    assert not lost, [int(program.line[exact[k]]) for k in lost]


def _every(names: tuple[str, ...], cases: list[tuple[Form, float, float]]) -> list[tuple[str, Form, float, float]]:
    return [(name, *case) for case in cases for name in names]


@pytest.mark.parametrize(("name", "form", "tolerance", "axis_length"), covering_share(_every(SAMPLES, CASES), 16))
def test_samples(name: str, form: Form, tolerance: float, axis_length: float) -> None:
    whole_file(ROOT / "samples" / name, form, tolerance, axis_length)


#: of the project's own
OWN_FIVE_AXIS = ("nx_blade.cls", "creo_vane.ncl", "points_zigzag.csv")
OWN_OTHERS = (
    "nx_pocket.cls",
    "nx_spline.cls",
    "nx_holes.cls",
    "catia_contour.aptsource",
    "catia_profile.aptsource",
    "creo_plate.ncl",
    "solidworks_bracket.apt",
    "hsm_cover.apt",
    "ncl_surface.as",
    "makino_contour.cldata",
    "plain_fan.apt",
    "points_fan.txt",
)


@pytest.mark.parametrize(
    ("name", "form", "tolerance", "axis_length"),
    [*covering_share(_every(OWN_FIVE_AXIS, CASES), 16), *of_corpus(covering_share(_every(FIVE_AXIS, CASES), 24))],
)
def test_five_axis_files(name: str, form: Form, tolerance: float, axis_length: float) -> None:
    whole_file(cl_file(name), form, tolerance, axis_length)


ONCE: list[tuple[Form, float, float]] = [(form, 0.04, 10.0) for form in FORMS]


@pytest.mark.parametrize(
    ("name", "form", "tolerance", "axis_length"),
    [*covering_share(_every(OWN_OTHERS, ONCE), 6), *of_corpus(covering_share(_every(FOUR_OR_LESS, ONCE), 9, 1))],
)
def test_files_with_arcs_holes_and_fixed_axes(name: str, form: Form, tolerance: float, axis_length: float) -> None:
    whole_file(cl_file(name), form, tolerance, axis_length)


# ---------------------------------------------------------------- statements

AXES = ("0,0,1", "0.28,0,0.96", "0.6,0,0.8")
STATEMENTS = {
    "COOLNT/ON": "M8",
    "COOLNT/OFF": "M9",
    "STOP": "M0",
    "OPSTOP": "M1",
    "DELAY/0.5": "G4 P500",
    "SPINDL/8000,RPM,CLW": "S8000 M3",
    "SPINDL/OFF": "M5",
}


@pytest.mark.parametrize("form", FORMS)
def test_statements_keep_their_place(tmp_path: Path, form: Form) -> None:
    """What acts on the machine stands exactly at its pose, in order; a message stands beside its corner."""
    rng = np.random.default_rng(11)
    tip = np.cumsum(rng.uniform(1, 3, (121, 3)) * rng.choice([-1, 1], (121, 3)), axis=0).round(4)
    text, wanted, told = ["UNITS/MM", "LOADTL/1", "MULTAX/ON", "RAPID"], [], []
    for pose, (x, y, z) in enumerate(tip):
        text.append(f"GOTO/{x:.4f},{y:.4f},{z:.4f},{AXES[pose % 3]}")
        if pose == 0:
            text.append("FEDRAT/300,MMPM")
        elif pose % 4 == 1:
            name = str(rng.choice(list(STATEMENTS)))
            text.append(name)
            wanted.append((pose, STATEMENTS[name]))
        elif pose % 4 == 3:
            text.append(f"PPRINT/MARK {pose}")
            told.append(pose)
    text += ["FINI", ""]
    written, _ = smooth(tmp_path, "\n".join(text).encode(), form, 0.1, 10.0)
    place, codes, comments = np.zeros(3), [], {}
    for block in written.blocks:
        if isinstance(block, Line):
            place = np.array(block.end[:3])
        elif isinstance(block, Curve):
            place = np.array(block.points[-1][:3])
        elif isinstance(block, Code) and "MARK" in block.text:
            comments[int(block.text.strip("()").split()[-1])] = place
        elif isinstance(block, Code) and block.text in STATEMENTS.values():
            codes.append((block.text, place))
    # the same state twice, such as coolant on when it is on, may be left out
    _in_order(codes, wanted, tip)
    assert list(comments) == told
    for pose, place in comments.items():
        legs = [np.linalg.norm(tip[pose] - tip[pose - 1]), np.linalg.norm(tip[pose + 1] - tip[pose])]
        assert np.linalg.norm(place - tip[pose]) <= max(legs) / 2 + 1e-3, pose


def _in_order(codes: list[tuple[str, np.ndarray]], wanted: list[tuple[int, str]], tip: np.ndarray) -> None:
    remaining = list(codes)
    modal: dict[str, str] = {}
    group = {"M8": "coolant", "M9": "coolant", "S8000 M3": "spindle", "M5": "spindle"}
    for pose, code in wanted:
        if remaining and remaining[0][0] == code and np.allclose(remaining[0][1], tip[pose], atol=1e-9):
            remaining.pop(0)
        else:
            assert code in group, (pose, code, remaining[:1])
            assert modal.get(group[code]) == code, (pose, code, remaining[:1])
        if code in group:
            modal[group[code]] = code
        elif code in ("M0", "M1"):  # most controls stop spindle and coolant with it
            for again in (modal.get("spindle", "M5"), modal.get("coolant", "M9")):
                if again not in ("M5", "M9"):
                    said, place = remaining.pop(0)
                    assert said == again
                    assert np.allclose(place, tip[pose], atol=1e-9)
    # what may follow is the end of the program
    assert all(code in ("M5", "M9") and np.allclose(place, tip[-1]) for code, place in remaining)
