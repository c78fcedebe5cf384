"""Systems with few diagonals."""

from importlib.machinery import PathFinder

import numpy as np
import pytest
import scipy.linalg.lapack

from cornersmooth.system import lapack


def test_solves_as_scipy_does() -> None:
    random = np.random.default_rng(3)
    bands = random.uniform(-1.0, 1.0, (3, 40))
    bands[2] = 5.0
    right = random.uniform(-1.0, 1.0, 40)
    _, solution, info = lapack.dpbsv(np.array(bands, order="F"), right, overwrite_ab=1)
    assert info == 0
    np.testing.assert_array_equal(solution, scipy.linalg.solveh_banded(bands, right))
    factors, info = lapack.dpbtrf(np.array(bands, order="F"))
    assert info == 0
    np.testing.assert_array_equal(lapack.dpbtrs(factors, right)[0], solution)


def test_says_where_a_pivot_is_not_positive() -> None:
    assert lapack.dpbsv(np.array([[0.0, 2.0], [1.0, 1.0]]), np.ones(2))[2] == 2


def test_another_place_of_the_compiled_module_is_no_harm(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(PathFinder, "find_spec", lambda *_: None)
    own = scipy.linalg.lapack
    assert lapack._solvers() == [own.dpbsv, own.dpbtrf, own.dpbtrs]
