"""A short run of the fuzzer, always the same; long ones are run by hand (``python fuzz/fuzz_cl.py --seconds N``)."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from types import ModuleType

import pytest


@pytest.fixture(scope="module")
def fuzzer() -> ModuleType:
    path = Path(__file__).parent.parent.parent / "fuzz" / "fuzz_cl.py"
    spec = importlib.util.spec_from_file_location("fuzz_cl", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_mutated_files(fuzzer: ModuleType) -> None:
    outcomes = fuzzer.fuzz(1500, seed=3)
    assert sum(outcomes.values()) == 1500
    assert outcomes["apt"] > 100
    assert len(outcomes) > 25


def test_the_time_ends_a_run(fuzzer: ModuleType) -> None:
    assert 0 < sum(fuzzer.fuzz(10**9, seed=4, seconds=0.2).values()) < 10**5


def test_same_seed_same_inputs(fuzzer: ModuleType) -> None:
    assert [*fuzzer.inputs(50, 7, [])] == [*fuzzer.inputs(50, 7, [])]


def test_checks_can_fail(fuzzer: ModuleType) -> None:
    from cornersmooth.cl import read
    from cornersmooth.cl.messages import error

    program = read(b"GOTO/1,2,3,0,0,1\n")
    fuzzer.check_program(program, 17)
    program.axis[0, 2] = 2
    with pytest.raises(AssertionError):
        fuzzer.check_program(program, 17)
    with pytest.raises(AssertionError):
        fuzzer.check_error(error("CS111", "x", None), b"")
    with pytest.raises(AssertionError):
        fuzzer.check_error(error("CS111", "x", 5), b"\n")
