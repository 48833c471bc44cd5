"""Factorisations against dense solutions: every backend, real and complex, and what is singular."""

import logging
import os
import re
import sys
from importlib.util import find_spec
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse

from stickslip.errors import InputError, SingularError, StickslipError
from stickslip.model.fe import factorisation
from stickslip.model.fe.factorisation import factorise, negative_eigenvalues

RNG = np.random.default_rng(5)
REQUIRED = os.environ.get("STICKSLIP_OPTIONAL") == "required"  # then nothing is skipped
needs_feral = pytest.mark.skipif(
    find_spec("feral") is None and not REQUIRED, reason="feral is not installed: pip install 'stickslip[sparse]'"
)
SPARSE = ["superlu", pytest.param("feral", marks=needs_feral)]


def laplacian(shape, shift=0.0):
    """The graph Laplacian of a grid: symmetric, with one zero eigenvalue without a shift."""
    parts = []
    for n in shape:
        line = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
        line[0, 0] = line[-1, -1] = 1.0
        parts.append(scipy.sparse.csr_array(line))
    whole = scipy.sparse.kronsum(parts[0], parts[1])
    return scipy.sparse.csr_array(whole) + shift * scipy.sparse.eye_array(whole.shape[0])


def hermitian(shape, shift):
    """The same with a phase on every edge along the first axis of the lower half."""
    matrix = laplacian(shape, shift).toarray().astype(complex)
    turn = np.exp(1j * np.linspace(0, 3, len(matrix)))
    matrix = matrix * np.where(np.eye(len(matrix)) > 0, 1.0, turn[:, None] * turn.conj()[None, :])
    matrix[3, 4] *= 1j
    matrix[4, 3] *= -1j
    return scipy.sparse.csr_array(matrix)


def check(found, matrix):
    n = matrix.shape[0]
    for right in (
        RNG.standard_normal(n),
        RNG.standard_normal((n, 5)),
        RNG.standard_normal((n, 2)) + 1j * RNG.standard_normal((n, 2)),
        np.asfortranarray(RNG.standard_normal((n, 3)))[:, 1:],
    ):
        answer = found(right)
        assert answer.shape == right.shape
        np.testing.assert_allclose(matrix @ answer, right, atol=1e-9)


@pytest.mark.parametrize("backend", ["dense", *SPARSE])
@pytest.mark.parametrize("shift", [0.3, -0.3])  # definite, indefinite
@pytest.mark.parametrize("draw", [laplacian, hermitian])
def test_solutions_of_every_backend(backend, shift, draw):
    matrix = draw((23, 22), shift)
    found = factorise(matrix, backend=backend)
    assert found.backend == backend
    check(found, matrix)
    if backend == "dense":
        assert found.negative is None
    else:  # Sylvester: the signs of the pivots are those of the eigenvalues
        negative = int(np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0))
        assert found.negative == negative
        assert (negative > 0) == (shift < 0)


@pytest.mark.parametrize("kind", [float, complex])
def test_positive_matrices_front_by_front(kind, monkeypatch):
    """Large ones go there without the optional package; an indefinite one comes back to SuperLU."""
    draw = {float: laplacian, complex: hermitian}[kind]
    matrix = draw((23, 22), 0.3)
    found = factorise(matrix, backend="multifrontal")
    assert found.negative == 0
    check(found, matrix)
    with pytest.raises(SingularError, match="not positive definite"):
        factorise(draw((23, 22), -0.3), backend="multifrontal")
    monkeypatch.setattr(factorisation, "MIN_FERAL_ROWS", 100)
    monkeypatch.setattr(factorisation, "HUGE", 500)
    monkeypatch.setattr(factorisation, "find_spec", lambda name: None)
    assert factorise(matrix).backend == "multifrontal"
    assert factorise(draw((21, 22), 0.3)).backend == "superlu"
    below = draw((23, 22), -0.3)
    below.setdiag(below.diagonal() + 0.0)
    assert np.all(below.diagonal().real > 0)
    check(factorise(below), below)


@pytest.mark.parametrize("kind", [float, complex])
def test_general_matrices_go_to_superlu(kind, monkeypatch):
    monkeypatch.setattr(factorisation, "MIN_FERAL_ROWS", 100)
    skew = scipy.sparse.csr_array(np.eye(506, k=3) - np.eye(506, k=-3))
    matrix = laplacian((23, 22), 0.3) + skew
    if kind is complex:  # complex symmetric: a loss factor
        matrix = laplacian((23, 22), 0.3) * (1 + 0.01j)
    found = factorise(matrix)
    assert found.backend == "superlu"
    check(found, matrix)
    with pytest.raises(InputError, match="which this is not"):
        factorise(matrix, backend="feral")


@pytest.mark.parametrize("shift", [0.3, -0.3])
def test_large_complex_matrices_are_factorised_front_by_front(monkeypatch, shift):
    """Definite ones; the others go on to feral, if installed, or to SuperLU."""
    monkeypatch.setattr(factorisation, "HUGE", 100)
    monkeypatch.setattr(factorisation, "MIN_FERAL_ROWS", 100)
    monkeypatch.setattr(factorisation, "DENSE", 50)
    matrix = hermitian((13, 12), shift)
    found = factorise(matrix)
    lost = "feral" if find_spec("feral") else "superlu"
    assert found.backend == ("multifrontal" if shift > 0 else lost)
    check(found, matrix)
    negative = int(np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0))
    assert negative_eigenvalues(matrix) == found.negative == negative


@needs_feral
def test_large_hermitian_matrices_go_to_the_package(monkeypatch):
    monkeypatch.setattr(factorisation, "MIN_FERAL_ROWS", 500)
    assert factorise(laplacian((23, 22), 0.3)).backend == "feral"
    assert factorise(laplacian((21, 22), 0.3)).backend == "superlu"


def test_without_the_package_superlu_does_it(monkeypatch):
    monkeypatch.setattr(factorisation, "MIN_FERAL_ROWS", 100)
    monkeypatch.setattr(factorisation, "find_spec", lambda name: None)
    assert factorise(laplacian((23, 22), 0.3)).backend == "superlu"


@pytest.mark.skipif(find_spec("feral") is not None, reason="feral is installed")
def test_the_extra_is_named_where_the_package_is_absent():
    with pytest.raises(StickslipError, match=r"feral-solver is not installed.*stickslip\[sparse\]"):
        factorise(laplacian((23, 22), 0.3), backend="feral")


def test_an_unknown_backend_is_refused():
    with pytest.raises(InputError, match=r"got 'cholmod'\. Use one of auto, dense"):
        factorise(np.eye(3), backend="cholmod")


@pytest.mark.parametrize("backend", ["dense", *SPARSE])
@pytest.mark.parametrize("units", [1.0, 1e9])
def test_a_free_body_is_singular_in_any_unit(backend, units):
    with pytest.raises(SingularError, match="singular"):
        factorise(units * laplacian((23, 22)), backend=backend)


@pytest.mark.parametrize("backend", ["dense", *SPARSE])
def test_unlike_units_in_one_matrix_are_not_singular(backend):
    """Metres and radians: rows that differ by twelve decades are scaled before they are judged."""
    scale = scipy.sparse.diags_array(np.where(np.arange(506) % 2, 1e6, 1.0))
    matrix = scipy.sparse.csr_array(scale @ laplacian((23, 22), 0.3) @ scale)
    found = factorise(matrix, backend=backend)
    right = matrix @ np.ones(506)
    np.testing.assert_allclose(found(right), 1.0, atol=1e-9)


@pytest.mark.parametrize("backend", SPARSE)
def test_a_weakly_held_body_is_not_singular(backend):
    matrix = laplacian((23, 22)).tolil()
    matrix[7, 7] += 1e-7
    check_right = np.ones(506)
    answer = factorise(scipy.sparse.csr_array(matrix), backend=backend)(check_right)
    np.testing.assert_allclose(answer, 506 / 1e-7, rtol=1e-3)  # all load hangs on the one spring


@pytest.mark.parametrize("matrix", [np.zeros((2, 2)), np.full((2, 2), np.nan), np.ones((2, 2))])
def test_hopeless_matrices_are_refused(matrix):
    with pytest.raises(SingularError, match=r"singular|not finite"):
        factorise(matrix)


@pytest.mark.parametrize("size", [90, 500])
@pytest.mark.parametrize("phase", [0.0, 0.7])
@pytest.mark.parametrize("square", [-1.0, 0.011, 1.3, 3.7, 5.0])
def test_negative_eigenvalues_are_counted_without_an_optional_package(size, phase, square):
    """Dense and SuperLU's pivots, real and complex, against all eigenvalues."""
    matrix = 2 * np.eye(size, dtype=complex) - np.eye(size, k=1) - np.eye(size, k=-1)
    matrix[0, -1], matrix[-1, 0] = -np.exp(-1j * phase), -np.exp(1j * phase)
    matrix = (matrix if phase else matrix.real) - square * np.eye(size)
    expected = np.count_nonzero(np.linalg.eigvalsh(matrix) < 0)
    assert negative_eigenvalues(scipy.sparse.csr_array(matrix)) == expected
    assert factorise(scipy.sparse.csr_array(matrix), backend="superlu").negative == expected


@needs_feral
@pytest.mark.parametrize("draw", [laplacian, hermitian])
def test_the_package_leaves_the_matrix_as_it_is(draw):
    matrix = scipy.sparse.csc_array(draw((23, 22), -0.3))
    before = matrix.toarray()
    factorise(matrix, backend="feral")
    np.testing.assert_array_equal(matrix.toarray(), before)


class PanicException(BaseException):  # what a panic of Rust becomes
    pass


class Young:
    """The interface of feral-solver over a dense solution, with faults of choice."""

    class FeralError(Exception):
        pass

    def __init__(self, *, off=0.0, miscounted=0, vanish=0, error=None):
        self.off, self.miscounted, self.error = off, miscounted, error
        self.inertia = SimpleNamespace(n_zero=vanish)

    def CscMatrix(self, n, indptr, indices, data):
        lower = scipy.sparse.csc_array((data, indices, indptr), shape=(n, n)).toarray()
        return lower + np.tril(lower, -1).T

    def Solver(self, **_):
        return self

    def factor(self, matrix):
        if self.error:
            raise self.error
        self.matrix = matrix
        counted = np.count_nonzero(np.linalg.eigvalsh(matrix) < 0)
        self.num_negative_eigenvalues = int(counted) + self.miscounted

    def solve(self, right):
        answer = np.linalg.solve(self.matrix, right)
        answer[7] *= 1 + self.off
        return answer


@pytest.fixture
def young(monkeypatch):
    """Put a package in the place of feral that has the faults asked for, for matrices of more than 100 rows."""

    def put(**faults):
        monkeypatch.setattr(factorisation, "MIN_FERAL_ROWS", 100)
        monkeypatch.setattr(factorisation, "HUGE", 100)
        monkeypatch.setattr(factorisation, "DENSE", 50)
        monkeypatch.setattr(factorisation, "find_spec", lambda _: SimpleNamespace(origin="there"))
        monkeypatch.setitem(sys.modules, "feral", Young(**faults))

    return put


@pytest.mark.parametrize("draw", [laplacian, hermitian])
def test_factors_with_a_small_residual_are_used(young, caplog, draw):
    young()
    matrix = draw((13, 12), -0.3)
    found = factorise(matrix)
    assert found.backend == "feral"
    check(found, matrix)
    negative = int(np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0))
    assert found.negative == negative_eigenvalues(matrix) == negative > 0
    assert caplog.messages == []


@pytest.mark.parametrize("draw", [laplacian, hermitian])
@pytest.mark.parametrize(
    ("faults", "told"),
    [
        ({"off": 1e-6}, r"leaves a residual of \S+ in 156 equations"),
        ({"off": np.nan}, "leaves a residual of nan"),
        ({"error": Young.FeralError("delayed")}, r"failed \(delayed\)"),
        ({"error": PanicException("index")}, r"failed \(index\)"),
        ({"vanish": 2}, None),
    ],
)
def test_superlu_takes_its_place_where_the_package_errs(young, caplog, draw, faults, told):
    young(**faults)
    matrix = draw((13, 12), -0.3)
    found = factorise(matrix)
    assert found.backend == "superlu"
    check(found, matrix)
    negative = np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0)
    assert negative_eigenvalues(matrix) == negative
    if told:
        assert [r.levelno for r in caplog.records] == 2 * [logging.WARNING]
        assert re.search(f"feral-solver is not used: it {told}.*SuperLU takes its place", caplog.text)
    with pytest.raises(StickslipError, match=told or "2 pivots vanish"):
        factorise(matrix, backend="feral")


@pytest.mark.parametrize("limit", [1000, 100])
def test_counts_are_checked_with_superlu(young, caplog, monkeypatch, limit):
    """Up to a size beyond which its factors do not fit."""
    monkeypatch.setattr(factorisation, "MAX_CHECKED_ROWS", limit)
    young(miscounted=1)
    matrix = laplacian((13, 12), -0.3)
    right = np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0)
    said = []
    assert negative_eigenvalues(matrix, say=said.append) == (right if limit == 1000 else right + 1)
    if limit == 1000:
        assert f"it counts {right + 1} negative pivots of 156, SuperLU {right}" in caplog.text
    else:
        assert said[-1].startswith(f"{right + 1} negative pivots by feral alone")


@pytest.mark.skipif(find_spec("feral") is not None, reason="feral is installed")
def test_a_folder_called_feral_is_not_the_package(tmp_path, monkeypatch):
    (tmp_path / "feral").mkdir()
    monkeypatch.syspath_prepend(str(tmp_path))
    assert find_spec("feral") is not None
    assert factorise(laplacian((60, 60), 0.3)).backend == "superlu"
