"""The fast path and the careful reader give the same program, bit for bit, or the same error."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cornersmooth.cl import bulk
from cornersmooth.cl.apt import read_apt
from cornersmooth.cl.source import clean
from cornersmooth.errors import InputError
from cornersmooth.model import Arcs, Program
from oracle.files import OWN, corpus_folder, of_corpus
from oracle.share import how_many, share

ARRAYS = ("tip", "axis", "kind", "feed", "line", "feed_mode", "keep")


def outcome(data: bytes, *, fast: bool, processes: int = 1) -> Program | str:
    finds = bulk.find_plain if fast else lambda text: None
    try:
        with patch.object(bulk, "find_plain", finds):
            return read_apt(clean(data, "x.cls"), name="x.cls", processes=processes)
    except InputError as error:
        return str(error)


def assert_same(left: Program | str, right: Program | str) -> None:
    if isinstance(left, str) or isinstance(right, str):
        assert left == right
        return
    for name in ARRAYS:
        a, b = getattr(left, name), getattr(right, name)
        assert a.dtype == b.dtype
        assert a.tobytes() == b.tobytes(), name
    for name in Arcs.__dataclass_fields__:
        assert getattr(left.arcs, name).tobytes() == getattr(right.arcs, name).tobytes()
    assert left.statements == right.statements
    assert (left.units, left.source, left.findings) == (right.units, right.source, right.findings)


@pytest.mark.parametrize(("own", "least"), [(True, 13), *of_corpus([(False, 20)])])
def test_files(own: bool, least: int) -> None:
    """Also with blocks of a few lines, so that every kind of statement stands at an edge of one."""
    paths = sorted((OWN if own else corpus_folder() or OWN).iterdir())
    paths = [path for path in paths if path.suffix in {".cls", ".apt", ".aptsource", ".ncl", ".as", ".cldata"}]
    assert len(paths) >= least
    for path in paths:
        data = path.read_bytes()
        careful = outcome(data, fast=False)
        assert isinstance(careful, Program), careful
        assert_same(outcome(data, fast=True), careful)
        with patch.object(bulk, "CHUNK", 300):
            assert_same(outcome(data, fast=True), careful)
            if path in share(paths, 4):
                assert_same(outcome(data, fast=True, processes=2), careful)


numbers = st.one_of(
    st.integers(-9999, 9999).map(lambda i: f"{i / 1000:.4f}"),
    st.sampled_from("0|1.|.25|-.5|+3.0|- 1.0|12000|-0.0000000395|1e-3|2.5D+00||nan|1.2.3|1 2|x|-|.".split("|")),
    st.just("9" * 400),
)
good_numbers = st.integers(-9999, 9999).map(lambda i: f"{i / 1000:.4f}")
axes = st.sampled_from(["0.0000000,0.0000000,1.0000000", "0.6, 0.0, 0.8", "-0.1,0.2,0.9746794", "0,1,0", "0., .6,.8"])
separators = st.sampled_from([",", ", ", " ,", ",  "])


@st.composite
def positions(draw: st.DrawFn) -> str:
    separator = draw(separators)
    word = draw(st.sampled_from(["GOTO/", "GOTO / ", "GOTO  /   ", "goto/", " GOTO/"] + ["GOTO/"] * 5))
    tip = separator.join(draw(st.lists(good_numbers, min_size=3, max_size=3)))
    form = draw(st.integers(0, 7))
    if form < 3:
        return word + tip
    if form == 3:
        return f"{word}{tip},  $\n{draw(axes)}"
    if form == 4:
        return f"{word}{tip},$\n{draw(axes)}$\n" + draw(st.sampled_from(["", "1.,2.,3."]))
    return f"{word}{tip}{separator}{draw(axes)}"


@st.composite
def odd_positions(draw: st.DrawFn) -> str:
    values = draw(st.lists(numbers, min_size=0, max_size=10))
    return (
        "GOTO/" + draw(separators).join(values) + draw(st.sampled_from(["", " ", ",", "$", " $ 7", " $$ c", ";RAPID"]))
    )


harmless = st.sampled_from(
    "RAPID|PAINT/COLOR,31|FEDRAT/MMPM,250.0|FEDRAT/100.,IPM|FEDRAT/PERMIN,7|$$ x||  |MULTAX/ON|MULTAX/OFF|TLAXIS/0,1,0"
    "|CYCLE/DRILL,1.|CYCLE/OFF|CUTCOM/LEFT|CUTCOM/OFF|END|FROM/0,0,1|GOHOME/0,0,9|SPINDL/RPM,$\n100,CLW|PPRINT a$"
    "|TOOL PATH/A|CSYS/0,0,1.,0,0,1.,0,0,-1.,0,0,0|RAPID/ON|RAPID/OFF|LOADTL/1;RAPID|PPRINT/x $|goto/1,2,3|GOTO/1,2,3e0"
    "|GOTO/1.,2.,3.\n4.,5.,6.\n7,8,9,0,0,1|GOTO/1,2,3,0,1,0,1,0,0|GOTO/1 2 3|GODLTA/1.,2.".split("|")
)
harmful = st.sampled_from(
    "SPINDL/RPM,$|1.,2.,3.|CIRCLE/0,0,0,0,0,1,1.|UNITS/INCHES|FINI|NURBS/|KNOT/1.|CNTRL/1,2,3\nCNTRL/2,3,4\nCNTRL/5,5,5"
    "|GODLTA/1.|GOTO/1,2,3,0,0,0|GOTO/1,2,3,0,0,2|GOTO/1,2,3,4,5|TRANS/1,2,3".split("|")
)
good_programs = st.lists(st.one_of(positions(), positions(), harmless), min_size=1, max_size=25)
programs = st.lists(st.one_of(positions(), positions(), harmless, harmful, odd_positions()), min_size=1, max_size=12)


@settings(max_examples=how_many(50, 300), deadline=None)
@given(
    st.one_of(programs, good_programs, good_programs),
    st.sampled_from(["", "$$-> FEATNO / 1\n", "TLDATA/MILL,1.\n"]),
    st.booleans(),
)
def test_random_programs(lines: list[str], head: str, small: bool) -> None:
    data = (head + "\n".join(lines)).encode()
    careful = outcome(data, fast=False)
    assert_same(outcome(data, fast=True), careful)
    if small:
        with patch.object(bulk, "CHUNK", 40):
            assert_same(outcome(data, fast=True), careful)


@pytest.mark.parametrize("harm", ["", "SPINDL/RPM,$", "FINI", "GOTO/1,2,3,0,0,2"])
def test_processes_read_the_same(harm: str) -> None:
    lines = [f"GOTO/{k}.5,{-k}.25,1.,0,0,1" if k % 7 else f"FEDRAT/MMPM,{k}." for k in range(1, 700)]
    lines.insert(500, harm)
    data = "\n".join(lines).encode()
    with patch.object(bulk, "CHUNK", 300):
        assert len([*bulk._chunks(data)]) > bulk._FEW
        alone = outcome(data, fast=True)
        assert isinstance(alone, str) == bool(harm)
        assert_same(outcome(data, fast=True, processes=3), alone)


def test_plain_lines_take_the_fast_path() -> None:
    text = b"GOTO/1.,2.,3.,0,0,1\nGOTO/1.,2.,4.\n" * 10 + b"RAPID\nGOTO / 1., 2., 3.,  $\n0., 0., 1.\n"
    first, between, last = bulk.parts(text)
    assert between == (21, b"RAPID\n", None, "GOTO")
    assert first.poses is not None
    assert last.poses is not None
    poses = np.concatenate((first.poses, last.poses))
    assert poses[:, 6].tolist() == [*range(1, 21), 22]
    assert np.array_equal(~np.isnan(poses[:, 3]), [True, False] * 10 + [True])


@pytest.mark.parametrize(
    "line",
    "GOTO/1,2,3,4|GOTO/1 2,3,4|GO1TO/1,2,3|GOTO/1,2,3,|GOTO/,2,3,1|GOTO 1/2,3,4|GOTO/1.2.3,1,1|GOTO/1,2,3\n4,5,6"
    "|GOTO/1,2,3\n 4,5,6|GOTO/1,2,3,$ 9\n0,0,1|GOTO/1,-,3|GOTO/1,2,3,$\nRAPID|GOTO/1,2,3\n5e1,1,1".split("|"),
)
def test_odd_lines_are_left_to_the_careful_reader(line: str) -> None:
    assert [part.poses for part in bulk.parts(f"{line}\n".encode())] == [None]
