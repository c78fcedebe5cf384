"""The promise for every control and form: what each control makes of its text stays within ε, by the oracle."""

from __future__ import annotations

import io
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.kinematics import Machine, load_machine
from cornersmooth.model import Move, Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from nc.reading import READERS
from oracle.chains import AXIS_DECIMALS, Chain, cl_text, random_chains
from oracle.judge import judge
from oracle.library import original_motion
from oracle.motion import Original, unit

#: control, form, machine, tool tip control
CASES = [
    ("generic", "g1", "", True),
    ("siemens", "g1", "", True),
    ("siemens", "bspline", "", True),
    ("siemens", "poly", "", True),
    ("heidenhain", "g1", "", True),
    ("fanuc", "g1", "table-ac", True),
    ("fanuc", "g1", "table-ac", False),
    ("fanuc", "g1", "table-bc", False),
    ("fanuc", "g6.2", "table-ac", True),
    ("fanuc", "g6.2", "head-table-bc", True),
    ("fanuc", "g6.2", "nutated-bc", True),
    ("mitsubishi", "g1", "head-table-bc", True),
    ("siemens", "g1", "head-ac", True),
    ("heidenhain", "g1", "table-bc", True),
    ("heidenhain", "spl", "table-bc", True),
    ("heidenhain", "spl", "", True),
    ("mitsubishi", "g6.2", "", True),
    ("haas", "g1", "table-bc", True),
    ("haas", "g1", "nutated-bc", True),
    ("linuxcnc", "g1", "xyzac-trt", True),
    ("linuxcnc", "g1", "xyzbc-trt", True),
]


def tame(chain: Chain, machine: str) -> Chain:
    """Chain with axes that the machine can reach, still through the pole and with large steps."""
    if not machine:
        return chain
    x, y, z = chain.axis.T
    flatter = 0.25 if machine.endswith("trt") else 1.0
    axis = unit(np.stack((flatter * x, flatter * y, np.abs(z) + 0.2), axis=1))
    return replace(chain, axis=np.round(axis, AXIS_DECIMALS))


def upright(chain: Chain) -> Chain:
    """Chain with the tool parallel to Z."""
    return replace(chain, axis=np.broadcast_to((0.0, 0.0, 1.0), chain.axis.shape))


#: every case has one of them
LIMITS = ((0.002, 10.0), (0.05, 50.0), (0.01, 10.0))


@pytest.mark.parametrize(
    ("control", "form", "machine", "tcp", "tolerance", "axis_length"),
    [(*case, *LIMITS[index % len(LIMITS)]) for index, case in enumerate(CASES)],
)
def test_random_chains_keep_the_tolerance(
    control: str, form: str, machine: str, tcp: bool, tolerance: float, axis_length: float
) -> None:
    fixed = (
        choose_form(control, form, machine=load_machine(machine) if machine else None, tcp=tcp).orientation == "fixed"
    )
    chains = [
        upright(chain) if fixed else tame(chain, machine)
        for chain in random_chains(len(control + form + machine), 48, corners=4)
    ]
    program = read(cl_text(chains)[0], name="chains.cls")
    chosen = choose_form(control, form, machine=load_machine(machine) if machine else None, tcp=tcp)
    settings = fit_settings(Settings(tolerance=tolerance, axis_length=axis_length), chosen, "mm")
    smoothed = smooth(program, settings)
    assert smoothed.corners.smoothed.mean() > 0.6
    stream = io.BytesIO()
    write(smoothed, stream, form=chosen)
    reader = READERS[f"{control} {form}{'' if tcp else ' machine'}"](machine)
    reading = reader.read(stream.getvalue().decode("ascii"), axis_length, tolerance)
    originals = [
        chain.original for chain in chains if np.ptp(chain.tip, axis=0).any() or np.ptp(chain.axis, axis=0).any()
    ]
    verdict = judge(reading.runs(axis_length), originals, axis_length, tolerance)
    assert verdict.deviation.worst <= tolerance, verdict


#: files with changing axes, and one with arcs and a fixed axis
FILES = [
    "hecc_flank_nx.cls",
    "hust_5x_impeller_yelun.cls",
    "nx_clsf_varcontour5x_ust_a.cls",
    "cnclite_tulsyan_altintas.apt",
    "nx_clsf_helix_times_gohome.cls",
]


@pytest.mark.corpus
@pytest.mark.parametrize("name", FILES)
def test_real_files_keep_the_tolerance(name: str, corpus: Path) -> None:
    tolerance, axis_length = 0.02, 20.0
    program = read((corpus / name).read_bytes(), name=name)
    originals = runs_of(program, tolerance)
    for control, form, machine, tcp in CASES:
        if len(program.arcs) and not machine and form == "g1":
            continue  # circular blocks are `test_nc_arcs`'
        if machine == "nutated-bc":
            continue  # it does not reach below the horizontal
        upright_tool = (program.axis == (0.0, 0.0, 1.0)).all()
        chosen = choose_form(control, form, machine=endless(machine) if machine else None, tcp=tcp)
        if chosen.orientation == "fixed" and not upright_tool:
            continue
        settings = fit_settings(Settings(tolerance=tolerance, axis_length=axis_length), chosen, "mm")
        stream = io.BytesIO()
        write(smooth(program, settings), stream, form=chosen)
        reader = READERS[f"{control} {form}{'' if tcp else ' machine'}"](machine)
        reading = reader.read(stream.getvalue().decode("ascii"), axis_length, tolerance)
        verdict = judge(reading.runs(axis_length), originals, axis_length, tolerance)
        assert verdict.deviation.worst <= tolerance, (control, form, machine, verdict)


def endless(name: str) -> Machine:
    """Machine without limits: the files were made for others."""
    machine = load_machine(name)
    first, second = (replace(axis, limits=None) for axis in machine.axes)
    return replace(machine, axes=(first, second))


def runs_of(program: Program, limit: float) -> list[Original]:
    """Feed motion between rapids."""
    cuts = [*np.flatnonzero(program.kind == Move.RAPID).tolist(), len(program)]
    runs = []
    for begin, end in pairwise([0, *cuts] if cuts[0] else cuts):
        part = np.arange(begin, end)
        if (program.kind[part] == Move.FROM).all():
            continue
        arcs = np.flatnonzero((program.arcs.pose > begin) & (program.arcs.pose < end))
        run = original_motion(
            replace(
                program,
                **{name: getattr(program, name)[part] for name in ("tip", "axis", "kind", "feed", "line")},
                **{name: getattr(program, name)[part] for name in ("feed_mode", "keep")},
                arcs=replace(
                    program.arcs,
                    pose=program.arcs.pose[arcs] - begin,
                    **{name: getattr(program.arcs, name)[arcs] for name in ("centre", "normal", "sweep")},
                ),
                statements=(),
            ),
            limit,
        )
        if len(run) > 1 and (np.ptp(run.tip, axis=0).any() or np.ptp(run.axis, axis=0).any()):
            runs.append(run)
    return runs
