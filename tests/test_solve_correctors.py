"""The three correctors: equal roots of piecewise linear systems, units, singular Jacobians, and why each of them stopped."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from newton_bounds import unknowns_bound

from stickslip.errors import InputError
from stickslip.operators import Bordered, array_of, times, transpose_of, transposed_times
from stickslip.solve.fallbacks import ByDifference, Homotopy, solve_robustly
from stickslip.solve.line_search import Kinks
from stickslip.solve.linear import Dense, factorised
from stickslip.solve.newton_method import GLOBALISATIONS, Newton, newton
from stickslip.solve.status import Rung, Status
from stickslip.solve.trust_region import _shorter, damped_step

CORRECTORS = sorted(GLOBALISATIONS)


@dataclass(frozen=True, eq=False)
class At:
    residual: np.ndarray
    jac: np.ndarray
    seconds_contact: float = 0.0


@dataclass(frozen=True, eq=False)
class Springs:
    """A positive definite structure with friction springs and unilateral springs: strictly monotone, so that it has one root."""

    structure: np.ndarray
    rows: np.ndarray
    stiffness: np.ndarray
    limit: np.ndarray  # NaN: unilateral
    gap: np.ndarray
    load: np.ndarray

    def __call__(self, x):
        u = self.rows @ x
        friction = ~np.isnan(self.limit)
        sticks = np.abs(self.stiffness * u) < np.where(friction, self.limit, 0.0)
        on = np.where(friction, sticks, u > self.gap)
        slips = np.where(friction, self.limit, 0.0) * np.sign(u)
        linear = self.stiffness * (u - np.where(friction, 0.0, self.gap))
        force = np.where(on, linear, slips)
        jac = self.structure + self.rows.T @ ((self.stiffness * on)[:, None] * self.rows)
        residual = self.structure @ x + self.rows.T @ force - self.load
        return At(residual, np.asfortranarray(jac))


def springs(seed, n, contacts, decades=1.0):
    rng = np.random.default_rng(seed)
    basis, _ = np.linalg.qr(rng.standard_normal((n, n)))
    limit = 10.0 ** rng.uniform(-1, 1, contacts)
    limit[rng.random(contacts) < 0.5] = np.nan
    return Springs(
        basis @ np.diag(10.0 ** rng.uniform(-decades, 0, n)) @ basis.T,
        rng.standard_normal((contacts, n)),
        10.0 ** rng.uniform(-1, decades, contacts),
        limit,
        rng.uniform(-1, 1, contacts),
        rng.standard_normal(n) * 10.0 ** rng.uniform(0, 1.5),
    )


def scaled(evaluate, units, force):
    """The same equation in other units of each unknown and of the forces."""

    def wrapped(x):
        at = evaluate(x * units)
        return At(force * at.residual, np.asfortranarray(force * at.jac * units))

    return wrapped


# ---- piecewise linear systems -------------------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 8), contacts=st.integers(0, 12))
def test_all_find_the_same_root_of_springs(seed, n, contacts):
    problem = springs(seed, n, contacts)
    roots = []
    for name in CORRECTORS:
        options = Newton(tolerance=1e-11, max_iterations=200, globalisation=name)
        solution = solve_robustly(problem, [np.zeros(n)], options)
        assert solution.status is Status.CONVERGED, name
        roots.append(solution.x)
    # the structure is softest with 0.1: an error of the residual of 1e-11 in each of n equations moves x by less than 1e-9
    assert np.allclose(roots, roots[0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", CORRECTORS)
def test_stiff_springs_over_decades(name):
    # four decades of stiffness, thirty contacts: halving steps alone, without crossing kinks, solved 1 of these 20
    options = Newton(tolerance=1e-9, max_iterations=150, globalisation=name)
    solutions = [newton(springs(seed, 30, 30, 2.0), np.zeros(30), options) for seed in range(20)]
    assert sum(s.status.converged for s in solutions) >= 19
    assert {s.status for s in solutions} <= {Status.CONVERGED, Status.STALLED, Status.TOO_MANY_ITERATIONS}


@pytest.mark.parametrize("name", CORRECTORS)
@pytest.mark.parametrize("start", [-3.0, -1e-9, 1e-9, 3.0])
def test_lift_off_of_a_stiff_contact(name, start):
    # soft spring, preload, and a contact a million times stiffer: the residual rises a million times faster behind the kink
    def contact(x):
        closed = x[0] < 0.0
        return At(np.array([x[0] + (1e6 * x[0] if closed else 0.0) - 2.0]), np.array([[1.0 + 1e6 * closed]], order="F"))

    solution = newton(contact, np.array([start]), Newton(globalisation=name))
    assert solution.status is Status.CONVERGED
    assert solution.x[0] == pytest.approx(2.0, rel=1e-9)


def test_a_kink_is_crossed_where_every_shortened_step_goes_uphill():
    # two pieces whose Newton directions lead on, while the residual grows a hundredfold on the far side
    steep = np.array([[1.0, 0.0], [100.0, 1.0]])

    def pieces(x):
        far = x[0] > 1e-6
        jac = steep if far else np.eye(2)
        kink = np.array([0.0, -1e-4]) if far else np.zeros(2)
        return At(jac @ x + kink - np.array([1.0, 0.0]), np.asfortranarray(jac))

    options = Newton(tolerance=1e-12)
    solution = newton(pieces, np.zeros(2), options)
    assert solution.status is Status.CONVERGED
    assert solution.rung is Rung.DAMPED_STEP
    assert np.allclose(solution.x, [1.0, 1e-4 - 100.0])


def test_a_step_that_hardly_helped_is_taken_where_no_kink_leads_on(monkeypatch):
    """The residual falls by a hundredth: better than to stay, as long as nothing else helps more."""
    monkeypatch.setattr(Kinks, "cross", lambda *_: Status.STALLED)

    def floor(x):
        return At(np.array([x[0], 10.0 + 0.1 * math.tanh(x[1])]), np.diag([1.0, 0.1 / math.cosh(x[1]) ** 2]))

    solution = newton(floor, np.zeros(2), Newton(globalisation="levenberg_marquardt"))
    assert not solution.status.converged
    assert floor(solution.x).residual[1] < 9.95


def test_crossing_kinks_ends_where_it_gains_nothing():
    class Flat:
        def at(self, x):
            return Iterated(x)

        rejected = 0

    @dataclass
    class Iterated:
        x: np.ndarray

        @property
        def at(self):
            return At(np.array([1.005]), np.eye(1))

    kinks, now = Kinks(), Iterated(np.zeros(1))
    outcomes = [kinks.cross(Flat(), now, np.ones(1)) for _ in range(15)]
    assert isinstance(outcomes[0], Iterated)
    assert outcomes[-1] is Status.STALLED


# ---- units --------------------------------------------------------------------------------------------------------------


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), powers=st.lists(st.integers(-8, 8), min_size=4, max_size=4))
@pytest.mark.parametrize("name", CORRECTORS)
def test_units_of_the_unknowns_do_not_matter(name, seed, powers):
    # up to 1e5 between the units: pivots of LU are compared with each other, so that far more would look singular
    problem = springs(seed, 4, 5)
    units = 2.0 ** np.array(powers)
    options = Newton(globalisation=name, max_iterations=100)
    plain = newton(problem, np.zeros(4), options)
    other = newton(scaled(problem, units, 1.0), np.zeros(4), options)
    assert other.status is plain.status
    if plain.status.converged:
        assert np.allclose(other.x * units, plain.x, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("name", CORRECTORS)
@pytest.mark.parametrize("force", [2.0**-40, 2.0**40])
def test_units_of_the_force_change_the_tolerance_alone(name, force):
    problem = springs(3, 6, 8)
    plain = newton(problem, np.zeros(6), Newton(globalisation=name, tolerance=2.0**-33))
    other = newton(
        scaled(problem, np.ones(6), force), np.zeros(6), Newton(globalisation=name, tolerance=2.0**-33 * force)
    )
    assert plain.status is Status.CONVERGED
    assert other.iterations == plain.iterations
    assert np.allclose(other.x, plain.x, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", CORRECTORS)
def test_badly_scaled(name):
    # Powell (1970): 1e4 x y = 1, exp(-x) + exp(-y) = 1.0001; roots near 1.1e-5 and 9.106
    def powell(x):
        with np.errstate(over="ignore"):
            e = np.exp(-x)
        return At(
            np.array([1e4 * x[0] * x[1] - 1.0, e[0] + e[1] - 1.0001]),
            np.array([[1e4 * x[1], 1e4 * x[0]], [-e[0], -e[1]]], order="F"),
        )

    options = Newton(globalisation=name, tolerance=1e-11, max_iterations=200)
    solution = newton(powell, np.array([0.0, 1.0]), options)
    assert solution.status is Status.CONVERGED
    # known to seven digits (Moré, Garbow & Hillstrom 1981)
    assert np.allclose(solution.x, [1.098159e-5, 9.106146], rtol=1e-6)


@pytest.mark.parametrize("name", CORRECTORS)
@pytest.mark.parametrize("seed", range(3))
def test_of_a_linear_problem_no_step_is_refused(name, seed):
    # a step reduces a linear residual exactly as much as it promises, however long it is
    rng = np.random.default_rng(seed)
    matrix, right = np.asfortranarray(np.eye(6) + 0.3 * rng.standard_normal((6, 6))), rng.standard_normal(6)
    options = Newton(globalisation=name, max_iterations=60, tolerance=1e-8)
    solution = newton(lambda x: At(matrix @ x - right, matrix.copy(order="F")), np.zeros(6), options)
    assert solution.status is Status.CONVERGED
    assert solution.rung is Rung.FULL_STEPS


# ---- smooth problems with singular Jacobians ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["dogleg", "levenberg_marquardt"])
def test_a_singular_start_is_left(name):
    # at x = 0 the second unknown has no influence: Newton has no step, the gradient leads on
    def product(x):
        return At(np.array([x[0] - 1.0, x[0] * x[1] - 2.0]), np.array([[1.0, 0.0], [x[1], x[0]]], order="F"))

    assert newton(product, np.zeros(2), Newton()).status is Status.SINGULAR
    solution = newton(product, np.zeros(2), Newton(globalisation=name, max_iterations=60))
    assert solution.status is Status.CONVERGED
    assert np.allclose(solution.x, [1.0, 2.0], atol=1e-9)


@pytest.mark.parametrize("name", ["dogleg", "levenberg_marquardt"])
def test_a_rank_that_is_missing_everywhere(name):
    # two equal equations: a line of solutions
    def line(x):
        r = x[0] + x[1] - 2.0
        return At(np.array([r, r]), np.ones((2, 2), order="F"))

    assert newton(line, np.zeros(2), Newton()).status is Status.SINGULAR
    solution = newton(line, np.zeros(2), Newton(globalisation=name, max_iterations=60))
    assert solution.status is Status.CONVERGED
    # from zero, the nearest point of the line
    assert np.allclose(solution.x, 1.0, atol=1e-6)


@pytest.mark.parametrize("name", CORRECTORS)
def test_a_nearly_singular_jacobian(name):
    # Jacobian of condition 1e10 at the start: a full step would be 1e9 long
    def narrow(x):
        bend = np.tanh(x[1] - 12.0)
        return At(
            np.array([x[0] - 1.0, bend + 0.5]), np.array([[1.0, 0.0], [0.0, (1.0 - bend) * (1.0 + bend)]], order="F")
        )

    options = Newton(globalisation=name, max_iterations=200, tolerance=1e-11)
    solution = newton(narrow, np.array([0.0, 0.5]), options)
    assert solution.status is Status.CONVERGED
    # the slope there is 3/4
    assert solution.x[1] == pytest.approx(12.0 - np.arctanh(0.5), abs=1e-10)


@pytest.mark.parametrize("name", ["dogleg", "levenberg_marquardt"])
def test_a_minimum_without_a_root_is_called_so(name):
    solution = newton(
        lambda x: At(np.array([x[0] ** 2 + 1.0]), np.array([[2.0 * x[0]]], order="F")),
        np.array([0.0]),
        Newton(globalisation=name),
    )
    assert solution.status is Status.LOCAL_MINIMUM


@pytest.mark.parametrize("name", CORRECTORS)
def test_the_best_iterate_is_returned_where_there_is_no_root(name):
    norms = []

    def rootless(x):
        norms.append(abs(x[0] ** 2 + 1.0))
        return At(np.array([x[0] ** 2 + 1.0]), np.array([[2.0 * x[0]]], order="F"))

    solution = newton(rootless, np.array([1.7]), Newton(globalisation=name))
    assert not solution.status.converged
    assert solution.residual_norm == pytest.approx(1.0 + solution.x[0] ** 2)
    assert solution.residual_norm <= norms[0]


# ---- steps that are not finite ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CORRECTORS)
def test_nothing_is_evaluated_outside_the_finite_numbers(name):
    class Overflowing:
        def solve(self, jac, right):
            return np.array([np.inf])

    seen = []

    def cubic(x):
        seen.append(x.copy())
        return At(np.array([x[0] ** 3 + 1.0]), np.array([[3.0 * x[0] ** 2]], order="F"))

    solution = newton(cubic, np.array([0.5]), Newton(globalisation=name, linear=Overflowing()))
    assert np.all(np.isfinite(seen))
    if name == "line_search":
        assert solution.status is Status.SINGULAR
    else:  # these have a way without a Newton step
        assert solution.residual_norm <= 1.125


@pytest.mark.parametrize("name", CORRECTORS)
def test_a_trial_that_is_not_finite_is_refused(name):
    def root(x):
        with np.errstate(invalid="ignore"):
            y = np.sqrt(x[0])
        return At(np.array([y - 1.5]), np.array([[0.5 / y]], order="F"))

    solution = newton(root, np.array([30.0]), Newton(globalisation=name, max_iterations=60))
    assert solution.status is Status.CONVERGED
    assert solution.x[0] == pytest.approx(2.25)


def test_unknown_globalisation_is_refused():
    with pytest.raises(InputError, match=r"Newton\.globalisation: is 'bisection'.*line_search"):
        Newton(globalisation="bisection")


# ---- linear algebra -----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Products:
    """An array that shows its products only."""

    array: np.ndarray

    @property
    def shape(self):
        return self.array.shape

    def matvec(self, v):
        return self.array @ v

    def rmatvec(self, v):
        return self.array.T @ v

    @property
    def transposed(self):
        return Products(self.array.T)


def borders(m: int, inside) -> tuple[np.ndarray, Bordered]:
    """A random matrix with `m` borders as an array, and as an operator around its inside."""
    rng = np.random.default_rng(m)
    whole = np.asfortranarray(rng.standard_normal((4 + m, 4 + m)))
    return whole, Bordered(inside(whole[:4, :4]), whole[:4, 4:], whole[4:, :4], whole[4:, 4:])


@pytest.mark.parametrize("inside", [np.array, Products])
@pytest.mark.parametrize("m", [1, 2, 3])
def test_a_bordered_matrix_multiplies_as_its_array(m, inside):
    whole, bordered = borders(m, inside)
    v = np.random.default_rng(9).standard_normal(4 + m)
    assert bordered.shape == whole.shape
    assert np.allclose(times(bordered, v), whole @ v, rtol=0, atol=1e-14)
    assert np.allclose(transposed_times(bordered, v), whole.T @ v, rtol=0, atol=1e-14)
    assert np.allclose(times(transpose_of(bordered), v), whole.T @ v, rtol=0, atol=1e-14)


def test_one_border_may_be_given_as_vectors_and_a_number():
    whole, bordered = borders(1, np.array)
    given = Bordered(bordered.jac, whole[:4, 4], whole[4, :4], float(whole[4, 4]))
    assert np.array_equal(array_of(given), whole)


def test_borders_around_borders_are_borders_of_what_is_inside():
    whole, _ = borders(3, np.array)
    inner = Bordered(whole[:4, :4], whole[:4, 4], whole[4, :4], whole[4, 4])
    outer = Bordered(inner, whole[:5, 5:], whole[5:, :5], whole[5:, 5:])
    assert outer.shape == whole.shape
    assert outer.flat.jac is inner.jac
    assert np.array_equal(array_of(outer), whole)
    assert array_of(Bordered(Products(whole), whole[:, :1], whole[:1], np.eye(1))) is None


@pytest.mark.parametrize("m", [1, 2, 3])
def test_factors_solve_with_a_bordered_matrix_and_its_transpose(m):
    whole, bordered = borders(m, np.array)
    right = np.random.default_rng(3).standard_normal(4 + m)
    for inverse in (factorised(Dense(), bordered), factorised(Dense(), whole.copy(order="F"))):
        assert np.allclose(inverse(right), np.linalg.solve(whole, right), rtol=1e-12)
        expected = np.linalg.solve(whole.T, right)
        assert np.allclose(inverse(right, transposed=True), expected, rtol=1e-12)
    found, sign = Dense().solve_bordered(*vars(bordered).values(), right)
    assert np.allclose(found, np.linalg.solve(whole, right), rtol=1e-12)
    assert sign == np.sign(np.linalg.det(whole))


@pytest.mark.parametrize("corner", [2.5, -0.4])
def test_a_border_whose_row_prescribes_the_last_unknown_alone(corner):
    random = np.random.default_rng(5)
    a, column, right = (random.standard_normal((5, 5)), random.standard_normal(5), random.standard_normal(6))
    before = a.copy()
    whole = array_of(Bordered(a, column, np.zeros(5), corner))
    found, sign = Dense().solve_bordered(a, column, np.zeros(5), corner, right)
    assert np.allclose(found, np.linalg.solve(whole, right), rtol=1e-12)
    assert sign == np.sign(np.linalg.det(whole))
    assert np.array_equal(a, before)
    a[:, 1] = a[:, 0]
    assert Dense().solve_bordered(a, column, np.zeros(5), corner, right) == (None, 0.0)
    column[2] = np.nan
    assert Dense().solve_bordered(before, column, np.zeros(5), corner, right) == (None, 0.0)


def test_a_singular_matrix_in_a_regular_border():
    # at a fold: the matrix has no inverse, the bordered one has
    a = np.diag([1.0, 0.0])
    column, row = np.array([0.0, 1.0]), np.array([0.0, 2.0])
    x, sign = Dense().solve_bordered(a, column, row, 0.0, np.array([1.0, 2.0, 3.0]))
    assert np.allclose(x, [1.0, 1.5, 2.0])
    assert sign == np.sign(np.linalg.det(array_of(Bordered(a, column, row, 0.0)))) == -1.0
    assert Dense().solve(np.asfortranarray(a), np.ones(2)) is None
    assert Dense().solve_bordered(a, column, np.zeros(2), 0.0, np.ones(3)) == (None, 0.0)


def test_dense_says_that_it_needs_an_array():
    with pytest.raises(InputError, match=r"Newton\.linear: Dense needs the Jacobian as an array"):
        Dense().solve(Products(np.eye(2)), np.ones(2))


@pytest.mark.parametrize("inside", [np.asfortranarray, Products])
def test_a_damped_step_solves_its_normal_equations(inside):
    rng = np.random.default_rng(4)
    a, right = rng.standard_normal((6, 6)), rng.standard_normal(6)
    scale = 10.0 ** rng.uniform(-1, 1, 6)
    step = damped_step(inside(a), right, scale, 0.1)
    exact = np.linalg.solve(a.T @ a + 0.1 * np.diag(scale**2), a.T @ right)
    # by products it is found to 1e-4 of the residual
    tolerance = 1e-11 if inside is np.asfortranarray else 1e-2
    assert np.allclose(step, exact, rtol=0, atol=tolerance * np.max(np.abs(exact)))


@pytest.mark.parametrize("name", ["dogleg", "levenberg_marquardt"])
def test_a_jacobian_known_by_its_products(name):
    problem = springs(11, 8, 6)

    class Through:
        def solve(self, jac, right):
            return np.linalg.solve(jac.array, right)

    def evaluate(x):
        at = problem(x)
        return At(at.residual, Products(at.jac))

    options = Newton(globalisation=name, max_iterations=100)
    exact = newton(problem, np.zeros(8), options)
    solution = newton(evaluate, np.zeros(8), Newton(globalisation=name, linear=Through(), max_iterations=100))
    assert exact.status is solution.status is Status.CONVERGED
    bound = unknowns_bound(exact.x, problem(exact.x), problem(solution.x))
    assert np.abs(solution.x - exact.x).max() <= bound


# ---- trying harder ------------------------------------------------------------------------------------------------------


def test_an_easy_problem_stays_on_the_first_rung():
    calls = []

    def easy(x):
        calls.append(x)
        return At(2.0 * x - 4.0, 2.0 * np.eye(3, order="F"))

    solution = solve_robustly(easy, [np.zeros(3)], Newton())
    assert solution.rung is Rung.FULL_STEPS
    assert len(calls) == 2


def well(x):
    """A root at -2.1038 behind a minimum of the residual at 1, beside an unknown that gives lengths a size."""
    return At(
        np.array([x[0] ** 3 - 3.0 * x[0] + 3.0, x[1] - 1.0]),
        np.array([[3.0 * x[0] ** 2 - 3.0, 0.0], [0.0, 1.0]], order="F"),
    )


FEW = 8  # iterations, so that no corrector gets out of the minimum by luck
BEHIND = [1.4, 1.6, 2.0, 2.2, 3.0]


def loads(s):
    """The same with a load that is least at s = 0, where roots lie on both sides of the minimum."""

    def evaluate(x):
        at = well(x)
        return At(at.residual - np.array([2.0 * (1.0 - s), 0.0]), at.jac)

    assert 0.0 <= s <= 1.0
    return evaluate


def stuck(start):
    return all(
        not newton(well, start, Newton(globalisation=name, max_iterations=FEW)).status.converged for name in CORRECTORS
    )


def homotopies(kind, start):
    if kind == "load":
        return [Homotopy((ByDifference(loads),), start)]
    if kind == "two legs":
        half = ByDifference(lambda s: loads(0.5 * s))
        return [Homotopy((half, ByDifference(lambda s: loads(0.5 + 0.5 * s))), start)]
    return []


@pytest.mark.parametrize("kind", ["residual", "load", "two legs"])
def test_a_homotopy_passes_folds_to_the_root(kind):
    starts = [np.array([x, 1.0]) for x in BEHIND]
    starts = [start for start in starts if stuck(start)]
    assert len(starts) >= 3
    for start in starts:
        solution = solve_robustly(well, [start], Newton(max_iterations=FEW), homotopies(kind, start), patience=FEW)
        assert solution.status is Status.CONVERGED
        assert solution.rung is Rung.HOMOTOPY
        assert solution.x[0] == pytest.approx(-2.1038034, abs=1e-6)


@pytest.mark.parametrize("empty", ["legs", "begins"])
def test_a_homotopy_with_nothing_to_follow_is_refused(empty):
    given = {"legs": (ByDifference(loads),), "start": np.zeros(2), "begins": (0.0,)} | {empty: ()}
    with pytest.raises(InputError, match=rf"Homotopy\.{empty}: is empty, so nothing can be followed\. Give at least"):
        Homotopy(**given)


def test_starts_and_homotopies_are_asked_for_one_by_one():
    asked = []

    def starts():
        for x in (1.4, -2.0, 5.0):
            asked.append(x)
            yield np.array([x, 1.0])

    def never():
        raise AssertionError("a homotopy was asked for although a start converged")
        yield

    solution = solve_robustly(well, starts(), Newton(max_iterations=FEW), never())
    assert solution.status is Status.CONVERGED
    assert asked == [1.4, -2.0]
    single = newton(well, np.array([-2.0, 1.0]), Newton(max_iterations=FEW))
    assert solution.iterations > single.iterations, "the start that failed is charged"


def test_where_nothing_helps_the_nearest_attempt_is_returned():
    def rootless(x):
        return At(np.array([x[0] ** 2 + 1.0]), np.array([[2.0 * x[0]]], order="F"))

    single = newton(rootless, np.array([1.7]), Newton())
    solution = solve_robustly(rootless, [np.array([1.7])], Newton())
    assert not solution.status.converged
    assert 1.0 <= solution.residual_norm <= single.residual_norm
    assert solution.iterations > single.iterations, "all attempts are charged"


def test_rungs_are_counted_in_their_order():
    assert [rung.name for rung in sorted(Rung)] == [
        "FULL_STEPS",
        "DAMPED_STEP",
        "SHORTER_STEP",
        "OTHER_GLOBALISATION",
        "HOMOTOPY",
        "IN_TIME",
    ]


@pytest.mark.parametrize(
    ("change", "slope", "factor"),
    [(1.0, -1.0, 0.25), (0.0, -1.0, 0.5), (-0.5, -1.0, 0.5), (99.0, -1.0, 0.1), (-2.0, -1.0, 0.5), (np.nan, -1.0, 0.1)],
)
def test_a_step_is_shortened_to_the_minimum_of_the_parabola(change: float, slope: float, factor: float) -> None:
    # change = slope + curvature / 2, least at -slope / curvature
    assert _shorter(change, slope) == factor
