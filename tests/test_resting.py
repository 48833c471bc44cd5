"""What contacts at rest do not couple is left out of arrays: against LU of the whole, in all states, and forced back."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_krylov import OMEGA, STATES, assert_same, load, problem, state, system

from stickslip.contact.interface import sparse_rows
from stickslip.contact.law import PAIRS
from stickslip.contact.product import harmonic_means, less_means
from stickslip.harmonic import balance as balance_module
from stickslip.harmonic import structured as structured_module
from stickslip.harmonic import stuck_contact_elimination as resting_module
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dynamic_stiffness import Condensed, condense
from stickslip.harmonic.matrix_products import MatrixProducts
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.harmonic.stuck_contact_elimination import Resting, TransposedElimination, known
from stickslip.operators import Bordered, Costs, array_of
from stickslip.response.equilibrium import bonded_start
from stickslip.solve.continuation import Following, StepControl, start_point, trace
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.linear import (
    Assembled,
    BorderedElimination,
    Dense,
    Reduced,
    factorised,
    factors_of,
    reduced_factors,
)
from stickslip.solve.newton_method import Newton

KINDS = ("rests", "static", "tangents", "all")


def random_blocks(rng, kinds, pairs, m):
    """Derivatives of contacts: complex numbers for each harmonic, with rows that couple harmonics where the kind says so."""
    numbers = rng.standard_normal((len(kinds), pairs, m, m))
    blocks = numbers - less_means(numbers, harmonic_means(numbers))
    for c, kind in enumerate(kinds):
        for b, (row, _) in enumerate(PAIRS[:pairs]):
            if kind == "static":
                blocks[c, b, 0] = numbers[c, b, 0]
            elif kind == "all" or (kind == "tangents" and row < 2):
                blocks[c, b] = numbers[c, b]
    return blocks


def random_jacobian(seed, kinds, order, n, pairs=7):
    rng = np.random.default_rng(seed)
    m = 2 * order + 1
    z = rng.standard_normal((order + 1, n, n)) + 1j * rng.standard_normal((order + 1, n, n))
    z += 3.0 * np.eye(n) * rng.choice([-1.0, 1.0], n)
    z[0] = z[0].real
    none = np.zeros((order + 1, n), dtype=complex)
    linear = MatrixProducts(Condensed(z, z, none, none), tuple(range(order + 1)))
    operator = rng.standard_normal((3 * len(kinds), n)) * (rng.random((3 * len(kinds), n)) < 0.3)
    return StructuredJacobian(linear, random_blocks(rng, kinds, pairs, m), sparse_rows(operator), 0.7)


def without_resting(jac) -> Resting:
    """The elimination, whatever it costs."""
    return known(jac.linear, jac.rows).without_resting(jac.coupling, jac.rows, jac.scale)


def coupled_rows(jac) -> np.ndarray:
    """Places of the equations that hold other harmonics than their own, or their own not as a complex number."""
    n, whole = jac.linear.n, jac.dense()
    m = len(whole) // n
    found = np.zeros((n, m), dtype=bool)
    for column in whole.reshape(m, n, m, n).transpose(3, 1, 0, 2):
        own = column[:, None].copy()
        stray = np.abs(less_means(own, harmonic_means(own)))[:, 0]
        found |= stray.max(axis=2) > 1e-12 * np.abs(whole).max()
    found[:, 1::2] |= found[:, 2::2]
    found[:, 2::2] |= found[:, 1::2]
    return np.flatnonzero(found.T)


@given(
    st.integers(0, 2**31),
    st.lists(st.sampled_from(KINDS), min_size=1, max_size=4),
    st.integers(0, 3),
    st.integers(0, 2),
)
@settings(max_examples=40, deadline=None)
def test_solution_and_sign_are_those_of_the_whole_array(seed, kinds, order, borders):
    jac = random_jacobian(seed, kinds, order, n=6)
    elimination = without_resting(jac)
    assert np.array_equal(elimination.kept, coupled_rows(jac))
    whole, size = jac.dense(), jac.shape[0] + borders
    rng = np.random.default_rng(seed)
    if borders:
        parts = (
            rng.standard_normal((jac.shape[0], borders)),
            rng.standard_normal((borders, jac.shape[0])),
            rng.standard_normal((borders, borders)),
        )
        elimination = BorderedElimination(elimination, *parts)
        whole = array_of(Bordered(whole, *parts))
    right = rng.standard_normal(size)
    factors = reduced_factors(elimination)
    other = reduced_factors(TransposedElimination(elimination))
    allowed = 1e-11 * np.linalg.cond(whole) * np.linalg.norm(right) / np.linalg.norm(whole, 2)
    for found, matrix in (
        (factors(right), whole),
        (factors(right, transposed=True), whole.T),
        (other(right), whole.T),
        (other(right, transposed=True), whole),
    ):
        assert np.linalg.norm(found - np.linalg.solve(matrix, right)) <= allowed
    assert factors.sign == other.sign == np.linalg.slogdet(whole)[0]


def test_signs_of_both_kinds_were_met():
    signs = {reduced_factors(without_resting(random_jacobian(s, ("rests", "all"), 1, 6))).sign for s in range(20)}
    assert signs == {-1.0, 1.0}
    eliminated = {without_resting(random_jacobian(s, ("rests", "all"), 1, 6)).sign for s in range(20)}
    assert eliminated == {-1.0, 1.0}


def test_all_at_rest_leaves_nothing_and_all_coupled_leaves_all():
    still, moving = (random_jacobian(3, (kind,) * 4, 2, 6) for kind in ("rests", "all"))
    right = np.random.default_rng(0).standard_normal(still.shape[0])
    assert without_resting(still).size == 0
    assert_same(reduced_factors(without_resting(still))(right), np.linalg.solve(still.dense(), right), 1e-11)
    touched = np.unique(moving.rows.columns[moving.rows.values.any(axis=1)]).size
    assert without_resting(moving).size == touched * 5


def test_what_would_lose_digits_is_kept():
    jac = random_jacobian(1, ("rests", "tangents"), 2, 6)
    rest = np.flatnonzero(~jac.coupling.kept[1])
    stiffness = jac.linear.condensed.stiffness.copy()
    # the rows of what rests in the first harmonic, contacts included, become dependent
    contact = [m[np.ix_(rest, rest)] for m in own_stiffness(jac)]
    stiffness[1][np.ix_(rest, rest)] = 1e-14 * np.eye(rest.size) - contact[1]
    linear = replace(jac.linear, condensed=replace(jac.linear.condensed, stiffness=stiffness))
    bad = replace(jac, linear=linear)
    elimination = without_resting(bad)
    assert elimination.harmonics[1].rest.size == 0
    assert elimination.harmonics[2].rest.size > 0
    right = np.random.default_rng(0).standard_normal(bad.shape[0])
    assert_same(reduced_factors(elimination)(right), np.linalg.solve(bad.dense(), right), 1e-10)


def own_stiffness(jac):
    """What contacts at rest add to the matrix of each harmonic, N/m."""
    operator = np.zeros((3 * len(jac.blocks), jac.linear.n))
    for c, (columns, values) in enumerate(zip(jac.rows.columns, jac.rows.values, strict=True)):
        np.add.at(operator[3 * c : 3 * c + 3].T, columns, values.T)
    out = []
    for means in jac.coupling.means:
        middle = np.zeros((len(operator), len(operator)), dtype=complex)
        for c, mean in enumerate(means):
            middle[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] = mean
        out.append(operator.T @ middle @ operator)
    return out


def test_what_is_no_number_is_not_taken_for_rest():
    jac = random_jacobian(1, ("rests", "rests"), 1, 6)
    blocks = jac.blocks.copy()
    blocks[0, 0, 1, 1] = np.nan
    assert replace(jac, blocks=blocks).coupling.coupled[0].any()


@pytest.mark.parametrize("relative", [True, False])
@pytest.mark.parametrize("name", STATES)
def test_normal_gaps_that_stay_closed_and_contacts_that_stick_are_left_out(name, relative):
    balance, x = state(name, relative=relative)
    at = balance.linearise(x, OMEGA)
    elimination = without_resting(at.jac)
    right = np.random.default_rng(0).standard_normal(x.size)
    exact = np.linalg.solve(at.jac.dense(), right)
    assert_same(reduced_factors(elimination)(right), exact, 1e-12)
    states = balance.contacts(x, OMEGA).state
    if relative:  # each gap is a coordinate
        opens = np.any(states == 2, axis=(1, 2))
        slips = np.any(states == 1, axis=2) | opens[:, None]
        # a contact that slipped on its way to stick has a mean force that depends on how far
        anchored = 2 * np.count_nonzero(~slips.all(axis=1))
        most = 7 * (np.count_nonzero(slips) + np.count_nonzero(opens)) + anchored
        assert elimination.size <= most
        assert (elimination.size == 0) == (name == "stick")


def counted(monkeypatch) -> list[int]:
    """Let all systems be solved as arrays without what rests, and say how many unknowns are left of each."""
    left: list[int] = []
    array = Resting.array

    def told(self):
        left.append(self.size)
        return array(self)

    monkeypatch.setattr(Resting, "array", told)
    monkeypatch.setattr(structured_module, "linear_costs", lambda *_, **__: Costs(1e9, 1e9, 1e9))
    return left


def follow_both(balance, span, made_of):
    """Follow a branch by whole arrays and without what rests, and compare the points; return those of the second."""
    branches = []
    for made, linear in ((replace(balance, jacobian="dense"), Dense()), (balance, Automatic())):
        following = Following(
            newton=Newton(tolerance=1e-12, max_iterations=30, linear=linear),
            control=StepControl(scale=0.2, largest=0.2, max_points=300),
            weights=np.ones(made.size),
        )
        start = start_point(made, bonded_start(made, span[0], made_of), span[0], following)
        branches.append([start, *trace(made, start, span[1], following)])
    assert [p.solution.status.converged for p in branches[1]].count(False) == 0
    assert len(branches[0]) == len(branches[1])
    for one, other in zip(*branches, strict=True):
        assert one.p == pytest.approx(other.p, rel=1e-10)
        assert np.max(np.abs(one.x - other.x)) <= 1e-10 * np.max(np.abs(one.x))
        assert np.max(np.abs(one.tangent - other.tangent)) <= 1e-9 * np.max(np.abs(one.tangent))
        assert one.orientation == other.orientation
    return branches[1]


def test_contacts_that_slip_come_back_and_rest_again_along_a_branch(monkeypatch):
    # from stick over the resonance, where contacts slip, to stick
    left = counted(monkeypatch)
    follow_both(problem(0.3), (0.4, 1.6), system())
    # few unknowns are left below the first resonance, many at it, few above it, and many at the second
    first = next(i for i, size in enumerate(left) if size > 60)
    least = first + int(np.argmin(left[first:]))
    assert max(left[:4]) <= 3
    assert left[least] < 20
    assert max(left[least:]) > 100


def test_a_branch_turns_where_it_does_with_whole_arrays(monkeypatch):
    # little damping: contacts that begin to slip soften the resonance, and the branch turns back and forth
    left = counted(monkeypatch)
    made = system()
    light = replace(made.structure, damping=0.3 * made.structure.damping)
    made = replace(made, structure=light)
    linear = condense(light, made.retained, load(0.3))
    balance = harmonic_balance(linear, made.interface, 2, 64, jacobian="structured")
    points = follow_both(balance, (0.5, 1.1), made)
    turns = np.count_nonzero(np.diff(np.sign([p.tangent[-1] for p in points])))
    assert turns == 2
    assert max(left) < balance.size


def test_the_choice_of_solver_takes_what_is_left(monkeypatch):
    left = counted(monkeypatch)
    balance, x = state("micro-slip")
    at = balance.linearise(x, OMEGA)
    right = np.random.default_rng(0).standard_normal(x.size + 1)
    krylov = Krylov()
    automatic = Automatic(krylov=krylov)
    for jac, matrix in ((at.jac, at.jac.dense()), (at.jac.transposed, at.jac.dense().T)):
        assert_same(automatic.solve(jac, right[:-1]), np.linalg.solve(matrix, right[:-1]), 1e-11)
    border = (at.jac_p, x, 0.5)
    found, sign = automatic.solve_bordered(at.jac, *border, right)
    exact, known_sign = Dense().solve_bordered(at.jac.dense(), *border, right)
    assert_same(found, exact, 1e-10)
    assert sign == known_sign
    inverse = factorised(automatic, Bordered(at.jac, *border))
    assert isinstance(inverse, Reduced)
    assert_same(inverse(right), exact, 1e-10)
    assert krylov.counts.systems == 0
    assert all(0 < n < x.size / 2 for n in left)


def test_what_is_eliminated_is_kept_at_a_frequency_while_the_same_contacts_rest(monkeypatch):
    made = []
    split = resting_module._eliminated
    monkeypatch.setattr(resting_module, "_eliminated", lambda *a: made.append(1) or split(*a))
    balance, x = state("micro-slip")
    for scale in (1.0, 1.0 + 1e-9, 1.0 - 1e-9):
        without_resting(balance.linearise(scale * x, OMEGA).jac)
    assert len(made) == balance.order + 1
    without_resting(balance.linearise(x, 1.01 * OMEGA).jac)
    without_resting(balance.linearise(0.1 * x, 1.01 * OMEGA).jac)  # all stick
    assert len(made) == 3 * (balance.order + 1)


def test_rest_is_looked_at_contact_by_contact():
    """A soft stop that closes for good is no rounding of a contact 1e14 times as stiff beside it."""
    jac = random_jacobian(3, ["rest", "rest"], 2, 4)
    same = replace(jac.coupling, means=jac.coupling.means * np.array([1.0, 1e-14])[None, :, None, None])
    other = replace(same, means=same.means * np.array([1.0, 2.0])[None, :, None, None])
    assert same.same_rest(replace(same))
    assert not same.same_rest(other)


def test_middling_problems_are_given_by_their_parts(monkeypatch):
    monkeypatch.setattr(balance_module, "REDUCED", 100)
    balance = replace(problem(STATES["micro-slip"]), jacobian="auto")
    assert balance.reduced
    assert not balance.structured
    x = bonded_start(balance, OMEGA, system())
    dense = replace(balance, jacobian="dense").linearise(x, OMEGA)
    at = balance.linearise(x, OMEGA)
    assert isinstance(at.jac, StructuredJacobian)
    assert_same(at.residual, dense.residual)
    assert_same(at.jac_p, dense.jac_p)
    assert_same(at.jac.dense(), dense.jac)
    assert_same(factors_of(at.jac)(x), np.linalg.solve(dense.jac, x), 1e-11)
    assert_same(Assembled().solve(at.jac, x), np.linalg.solve(dense.jac, x), 1e-11)
