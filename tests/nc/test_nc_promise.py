"""The promise for every control and form: what each control makes of its text stays within ε, by the oracle.

`nc.sweep` does the same by hand with more: every control with every machine, more chains, all files of a folder.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.model import Arcs, Move, Program
from cornersmooth.settings import Settings
from nc.cases import CHOSEN, Case
from nc.promise import random_verdict, runs_of, verdict, without_holes
from oracle.chains import Chain, cl_text
from oracle.files import cl_file, of_corpus, sample
from oracle.motion import Original, unit
from oracle.share import covering_share, how_many, share

#: every case has one of them
LIMITS = ((0.002, 10.0), (0.05, 50.0), (0.01, 10.0))


@pytest.mark.parametrize(
    ("case", "tolerance", "axis_length", "units"),
    [(case, *LIMITS[index % len(LIMITS)], "inch" if index % 4 == 3 else "mm") for index, case in enumerate(CHOSEN)],
    ids=str,
)
def test_random_chains_keep_the_tolerance(case: Case, tolerance: float, axis_length: float, units: str) -> None:
    settings = Settings(tolerance=tolerance, axis_length=axis_length)
    count = how_many(2, 24) if case.tcp else how_many(2, 6)  # without tool tip control every line becomes many
    found = random_verdict(case, settings, len(str(case)), count, units)
    assert found.deviation.worst <= tolerance, found


def keeps_the_tolerance(name: str, data: bytes, case: Case, tolerance: float = 0.02, axis_length: float = 20.0) -> bool:
    """Whether the case could be tried: the tool need not be upright, nor the machine reach that far."""
    program = without_holes(read(data, name=name))
    if case.control == "linuxcnc":  # it moves at a feed or not at all
        program = replace(program, feed=np.where(np.isnan(program.feed), 500.0, program.feed))
    settings = Settings(tolerance=tolerance, axis_length=axis_length)
    try:
        found = verdict(program, runs_of(program, tolerance), case, case.choose(endless=True), settings)
    except (InputError, SettingsError) as refusal:
        if refusal.code not in ("CS219", "CS336", "CS361", "CS362"):  # not upright; no compensation; out of reach
            raise
        return False
    assert found.deviation.worst <= tolerance, (name, found)
    return True


@pytest.mark.parametrize("case", covering_share(CHOSEN, 6, 1), ids=str)
def test_samples_keep_the_tolerance(case: Case) -> None:
    tried = [keeps_the_tolerance(name, sample(name), case) for name in ("impeller.cls", "paper_table1.csv")]
    upright = case in (Case("heidenhain", "spl"), Case("mitsubishi", "g6.2"))
    assert any(tried) is not upright


#: changing axes; arcs and a fixed axis; every kind of statement; inches
FILES = [
    "hust_5x_impeller_yelun.cls",
    "nx_clsf_varcontour5x_ust_a.cls",
    "cnclite_tulsyan_altintas.apt",
    "nx_clsf_helix_times_gohome.cls",
    "creo11_3x_inch_multiop.ncl",
    "swcam_shimemcunha.apt",
]


#: of the project's own: changing axes, arcs, statements and inches too
OWN = ["nx_blade.cls", "nx_pocket.cls", "creo_plate.ncl", "solidworks_bracket.apt", "hsm_cover.apt", "ncl_surface.as"]


@pytest.mark.parametrize(
    ("name", "part"),
    [*((name, part) for part, name in enumerate(OWN)), *of_corpus((name, part) for part, name in enumerate(FILES))],
)
def test_files_keep_the_tolerance(name: str, part: int) -> None:
    """Each file in a tenth of the controls and forms: `nc.sweep` does all."""
    path = cl_file(name)
    # without tool tip control every line becomes many: `nc.sweep` tries those
    small = path.stat().st_size < 12_000 and name not in OWN
    cases = [case for case in CHOSEN if (case.tcp or small) and case.choose().orientation != "fixed"]
    cases = share(cases, 10, part)
    assert 2 * sum(keeps_the_tolerance(name, path.read_bytes(), case) for case in cases) > len(cases)


@pytest.mark.parametrize("control", ["haas", "fanuc"])
def test_machine_positions_go_with_the_angles_as_written(control: str) -> None:
    """Metres from the axes of the tables the last digit of an angle moves the tip by more than ε."""
    tip = np.array([[5000.0, 0, 0], [5010, 0, 0], [5010, 10, 0], [5020, 10, 2]])
    axis = unit(np.array([[0.3, 0, 1], [0.31, 0.01, 1], [0.32, 0, 1], [0.3, 0.02, 1]]))
    program = read(cl_text([Chain(tip, np.round(axis, 9), np.full(4, 500.0))])[0], name="far.cls")
    case, settings = Case(control, "g1", "table-bc", tcp=False), Settings(tolerance=0.002)
    found = verdict(program, [Original(tip, axis)], case, case.choose(), settings)
    assert found.deviation.worst <= settings.tolerance, found


@pytest.mark.parametrize(
    "case", covering_share([case for case in CHOSEN if case.choose().orientation != "fixed"], 6), ids=str
)
def test_arcs_with_a_turning_tool_keep_the_tolerance(case: Case) -> None:
    """A circular block has no words for it: lines, on which tip and axis run as one."""
    axis = unit(np.array([[0.1, 0.0, 1.0], [0.0, 0.3, 1.0]]))
    program = Program.from_poses(
        [(10.0, 0, 0), (0, 10, 2)],
        axis,
        kind=np.array([Move.RAPID, Move.ARC]),
        feed=300.0,
        arcs=Arcs(np.array([1]), np.zeros((1, 3)), np.array([[0.0, 0, 1]]), np.array([np.pi / 2])),
    )
    share = np.linspace(0, 1, 4001)[:, None]
    angle = share[:, 0] * np.pi / 2
    tip = np.stack((10 * np.cos(angle), 10 * np.sin(angle), 2 * share[:, 0]), axis=1)
    settings = Settings(tolerance=0.01, axis_length=30.0)
    original = Original(tip, unit(axis[0] + share * (axis[1] - axis[0])))
    if case.machine and case.choose().curves:  # angles of an arc are not looked for there
        with pytest.raises(SettingsError, match=r"the tool turns on an arc, .*\nhint: use -f g1"):
            verdict(program, [original], case, case.choose(), settings)
        return
    found = verdict(program, [original], case, case.choose(), settings)
    assert found.deviation.worst <= settings.tolerance, found
