"""Every control and form is read back: no false alarm, and the motion that an independent reader makes of the text."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError, InputError
from cornersmooth.kinematics import Machine, load_machine
from cornersmooth.model import Program
from cornersmooth.nc import Form
from cornersmooth.nc_reader import NcProgram, read_nc
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.tool import written_at
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from nc.cases import CHOSEN, Case
from nc.grammars import reader
from nc.promise import tame, upright, written
from oracle.chains import cl_text, random_chains
from oracle.files import cl_file, of_corpus, sample
from oracle.share import covering_share, how_many, share

LIMITS = ((0.001, 10.0), (0.04, 50.0), (0.15, 10.0), (0.04, 10.0))


def chains_for(case: Case, form: Form, seed: int, count: int = how_many(4, 10), units: str = "mm") -> Program:
    """Program of random chains that a form can hold."""
    chains = [
        upright(chain) if form.orientation == "fixed" else tame(chain, case.machine)
        for chain in random_chains(seed, count, corners=4)
    ]
    text = cl_text(chains)[0]
    if units == "inch":
        text = text.replace(b"UNITS/MM", b"UNITS/INCHES").replace(b"MMPM", b"IPM")
    return read(text, name="chains.cls")


def readings(case: Case, machine: Machine | None, settings: Settings) -> dict[str, object]:
    """Keyword arguments of `read_nc` and `verify`."""
    limits = {"tolerance": settings.tolerance, "axis_length": settings.axis_length}
    return {"control": case.control, "machine": machine, "tcp": case.tcp, **limits}


@pytest.mark.parametrize(("units", "case"), covering_share(product(("mm", "inch"), CHOSEN), 5), ids=str)
def test_no_false_alarm_on_random_chains(case: Case, units: str) -> None:
    form, place = case.choose(), CHOSEN.index(case)
    tolerance, axis_length = LIMITS[(place + (units == "inch")) % len(LIMITS)]
    settings = Settings(tolerance=tolerance, axis_length=axis_length, method="proportional")
    program = chains_for(case, form, place, units=units)
    text, _ = written(program, form, settings)
    found = verify(program, text.encode(), **readings(case, form.machine, settings), words=False)
    assert found.problems == ()
    assert found.blocks == sum(map(_is_block, text.replace(" ~\n", " ").splitlines()))
    used = form.table.lines.line_share if form.table.lines.lines == "long" and form.long_lines else 1.0
    assert max(found.tip.value, found.axis_point.value) > 0.5 * used * tolerance  # something has been measured


def _is_block(line: str) -> bool:
    bare = line.lstrip("0123456789 ")
    return bool(bare) and bare != "%" and bare[0] not in "(;"


@pytest.mark.parametrize("case", covering_share(CHOSEN, 2), ids=str)
def test_motion_is_that_of_the_independent_readers(case: Case) -> None:
    form = case.choose()
    settings = Settings(tolerance=0.02, axis_length=10.0, method="proportional")
    text, _ = written(chains_for(case, form, 3, count=how_many(1, 8)), form, settings)
    nc = read_nc(text.encode(), **readings(case, form.machine, settings))
    pieces = reader(case.control, case.form, case.machine, case.tcp, "mm").read(text, 10.0, 0.02).pieces
    blocks = np.split(np.arange(len(nc)), np.flatnonzero(np.diff(nc.line)) + 1)
    if case.form == "bspline":  # the reader there takes neighbouring curves as one spline
        last = np.searchsorted([piece.line for piece in pieces], nc.line, side="right")
        blocks = np.split(np.arange(len(nc)), np.flatnonzero(np.diff(last)) + 1)
    assert len(blocks) == len(pieces)
    # half way the great circle is where the ruled motion is
    share = np.array([0.5, 1.0]) if form.orientation == "vector" else np.linspace(0.0, 1.0, 6)[1:]
    for piece, block in zip(pieces, blocks, strict=True):
        assert piece.rapid == (nc.kind[block[0]] == Element.RAPID)
        tip, axis = piece.at(share[-1:] if piece.rapid or block[0] == 0 else share)
        wanted = np.hstack((tip, tip + 10.0 * axis / np.linalg.norm(axis, axis=1)[:, None]))
        assert _distance(nc, block, wanted) < 1e-4, piece.line


def _distance(nc: NcProgram, block: np.ndarray, wanted: np.ndarray) -> float:
    """Largest distance of poses (k, 6) from the elements of one block."""
    kind = Element(nc.kind[block[0]])
    count = 2000 if kind == Element.CURVE else 400 if len(block) == 1 else 33
    grid = np.linspace(0.0, 1.0, count) if nc.kind[block[0]] != Element.RAPID and block[0] else np.ones(1)
    tip, axis = written_at(nc, np.repeat(block, len(grid)), np.tile(grid, len(block)))
    six = np.hstack((tip, tip + 10.0 * axis))
    start, way = six[:-1], np.diff(six, axis=0)
    if not len(way):
        return float(np.abs(six - wanted[-1:]).max())
    size = np.maximum(np.einsum("ij,ij->i", way, way), 1e-30)
    along = np.clip(((wanted[:, None] - start) * way).sum(axis=2) / size, 0.0, 1.0)
    return float(np.linalg.norm(start + along[..., None] * way - wanted[:, None], axis=2).min(axis=1).max())


@pytest.mark.parametrize("case", covering_share([case for case in CHOSEN if case.control != "linuxcnc"], 6), ids=str)
def test_no_false_alarm_on_the_sample(case: Case) -> None:
    _passes_on(case, "impeller.cls", sample("impeller.cls"), 0.04)


FILES = ["swcam_shimemcunha.apt", "creo11_3x_inch_multiop.ncl", "hecc_flank_nx.cls", "cnclite_tulsyan_altintas.apt"]


OWN = ["nx_blade.cls", "nx_holes.cls", "nx_pocket.cls", "creo_plate.ncl", "solidworks_bracket.apt", "hsm_cover.apt"]


@pytest.mark.parametrize("third", range(3))
@pytest.mark.parametrize(
    ("name", "number"), [*zip(OWN, range(6), strict=True), *of_corpus(zip(FILES, range(4), strict=True))]
)
def test_no_false_alarm_on_files(name: str, number: int, third: int) -> None:
    """Each file in each control and form at one of three tolerances, in turn: `verify.sweep` does all."""
    tolerance = (0.001, 0.04, 0.15)[(number + third) % 3]
    for case in share(CHOSEN[third::3], 24, number):
        _passes_on(case, name, cl_file(name).read_bytes(), tolerance)


def _passes_on(case: Case, name: str, data: bytes, tolerance: float) -> None:
    program = read(data, name=name)
    form = case.choose(endless=True)
    settings = Settings(tolerance=tolerance)
    try:
        text, _ = written(program, form, settings)
    except CornersmoothError:  # the machine, or the form, cannot follow the file
        return
    assert verify(program, text.encode(), **readings(case, form.machine, settings), words=False).passed


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain"])
def test_texts_of_other_controls_are_refused(control: str) -> None:
    """What is written for one control is never taken for another's."""
    program = chains_for(CHOSEN[0], CHOSEN[0].choose(), 1, count=2)
    for case in (Case("fanuc", "g1"), Case("siemens", "g1"), Case("siemens", "bspline"), Case("heidenhain", "g1")):
        if case.control == control:
            continue
        text, _ = written(program, case.choose(), Settings())
        with pytest.raises(InputError):
            read_nc(text.encode(), control=control)


def test_rotary_words_want_their_machine() -> None:
    case = Case("fanuc", "g1", "table-ac")
    text, _ = written(chains_for(case, case.choose(), 1, count=2), case.choose(), Settings())
    with pytest.raises(InputError, match="name the machine"):
        read_nc(text.encode())
    with pytest.raises(InputError):
        read_nc(text.encode(), machine=load_machine("table-bc"))


def test_wrong_machine_is_found() -> None:
    case = Case("fanuc", "g1", "table-ac")
    program = chains_for(case, case.choose(), 1, count=2)
    text, _ = written(program, case.choose(), Settings(tolerance=0.02))
    first, second = load_machine("table-ac").axes
    mirrored = replace(load_machine("table-ac"), axes=(first, replace(second, positive="table")))
    good = verify(program, text.encode(), tolerance=0.02, machine=load_machine("table-ac"))
    assert good.passed
    assert not verify(program, text.encode(), tolerance=0.02, machine=mirrored).passed
    assert not verify(program, text.encode(), tolerance=0.02, machine=load_machine("table-ac"), tcp=False).passed
