"""Evaluators of a period against each other, mixed interfaces and weights."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stickslip.contact.compiled import compile_contacts
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.aft import contact_forces

LAW = ElasticCoulomb(k_t=3.0, k_w=2.0, k_n=5.0, mu=0.4, preload=1.0)


def gaps(seed, order, n_contacts=1, size=1.0):
    return size * np.random.default_rng(seed).standard_normal((2 * order + 1, 3 * n_contacts))


laws = st.builds(
    ElasticCoulomb,
    k_t=st.floats(0.1, 100),
    k_w=st.sampled_from([0.0, 1.0, 30.0]),
    k_n=st.sampled_from([0.0, 1.0, 50.0]),
    mu=st.floats(0, 1),
    preload=st.floats(-20, 50),
    residual_traction=st.none() | st.floats(-1, 1),
)


@settings(max_examples=60)
@given(
    law=laws, seed=st.integers(0, 10**6), order=st.integers(0, 5), samples=st.integers(16, 128), size=st.floats(-2, 1)
)
def test_march_and_intervals_agree(law, seed, order, samples, size):
    gap = gaps(seed, order, size=10**size)
    one = contact_forces(gap, compile_contacts([law]), samples)
    other = contact_forces(gap, compile_contacts([law], evaluator="march"), samples)
    stiffness = max(law.k_t, law.k_w, law.k_n)
    force = stiffness * np.max(np.abs(one.gap)) + abs(law.preload)
    assert other.unsettled == 0
    assert np.max(np.abs(one.force - other.force)) <= 1e-12 * force
    # at equal states the derivatives are those of the same linear pieces
    if np.array_equal(one.state, other.state):
        assert np.max(np.abs(one.blocks - other.blocks)) <= 1e-10 * stiffness


@dataclass(frozen=True)
class LikeElasticCoulomb:
    """A law that hides its elements and has to be marched."""

    law: ElasticCoulomb
    kernel = staticmethod(ElasticCoulomb.kernel)
    pairs = 7

    def parameters(self):
        return self.law.parameters()

    def initial_state(self):
        return self.law.initial_state()

    def stuck_stiffness(self):
        return self.law.stuck_stiffness()


@pytest.mark.parametrize("evaluator", ["intervals", "events"])
def test_groups_come_back_in_their_order(evaluator):
    plain = [LAW, replace(LAW, mu=0.1, preload=-1.0), replace(LAW, k_w=0.0)]
    mixed = [plain[0], LikeElasticCoulomb(plain[1]), plain[2]]
    gap = gaps(5, 3, 3)
    weights = np.array([1.0, 2.0, 4.0])
    want = contact_forces(gap, compile_contacts(plain, weights, evaluator), 4096)
    got = contact_forces(gap, compile_contacts(mixed, weights, evaluator), 4096)
    size = np.max(np.abs(want.coefficients))
    tolerance = 1e-12 if evaluator == "intervals" else 1e-4  # the march has the error of its samples
    assert np.max(np.abs(got.coefficients - want.coefficients)) <= tolerance * size
    assert got.blocks.shape[1] == 7
    assert np.max(np.abs(got.blocks[:, :5] - want.blocks)) <= max(tolerance, 1e-12) * 100
    assert np.all(got.blocks[:, 5:] == 0.0)


def test_contacts_of_an_interface_do_not_feel_each_other():
    mixed = [LAW, replace(LAW, mu=0.1, preload=-1.0), replace(LAW, k_w=0.0, residual_traction=0.5)]
    gap = gaps(3, 3, 3)
    together = contact_forces(gap, compile_contacts(mixed), 64)
    for c, law in enumerate(mixed):
        alone = contact_forces(gap[:, 3 * c : 3 * c + 3], compile_contacts([law]), 64)
        assert np.array_equal(together.force[c], alone.force[0])
        assert np.array_equal(together.blocks[c], alone.blocks[0])


@pytest.mark.parametrize("evaluator", ["intervals", "march", "events"])
def test_weights_are_factors_of_the_forces(evaluator):
    gap = gaps(4, 2, 2)
    weights = np.array([0.5, 3.0])
    plain = contact_forces(gap, compile_contacts([LAW, LAW], None, evaluator), 32)
    weighted = contact_forces(gap, compile_contacts([LAW, LAW], weights, evaluator), 32)
    assert np.allclose(weighted.force, weights[:, None, None] * plain.force, rtol=1e-15)
    assert np.allclose(weighted.blocks, weights[:, None, None, None] * plain.blocks, rtol=1e-15)
    factors = np.repeat(weights, 3)
    assert np.allclose(weighted.coefficients, factors * plain.coefficients, rtol=1e-13, atol=1e-15)


def test_weights_reach_the_stuck_contact():
    one = Interface(("a", "b"), (LAW, LAW), np.eye(6), np.array([2.0, 0.5]))
    assert one.stuck_stiffness().tolist() == [6.0, 4.0, 10.0, 1.5, 1.0, 2.5]
    assert one.resting_force().tolist() == [0.0, 0.0, -2.0, 0.0, 0.0, -0.5]


@pytest.mark.parametrize("bad", [[1.0], [1.0, 0.0], [1.0, -2.0], [1.0, np.nan]])
def test_weights_must_be_positive(bad):
    with pytest.raises(InputError, match="weights: must be 2 positive numbers"):
        Interface(("a", "b"), (LAW, LAW), np.eye(6), np.array(bad))


@pytest.mark.parametrize("hidden", [False, True], ids=["elements alone", "with a marched law"])
@pytest.mark.parametrize("evaluator", ["intervals", "march", "events"])
def test_without_history_the_forces_are_the_same(evaluator, hidden):
    laws = [LAW, LikeElasticCoulomb(LAW) if hidden else replace(LAW, mu=0.1, preload=-1.0)]
    compiled = compile_contacts(laws, np.array([1.0, 2.0]), evaluator)
    gap = gaps(6, 3, 2)
    whole = contact_forces(gap, compiled, 64)
    part = contact_forces(gap, compiled, 64, history=False)
    assert np.array_equal(part.coefficients, whole.coefficients)
    assert np.array_equal(part.blocks, whole.blocks)
    # only exact events do without samples, and only if no law beside them needs any
    samples = 0 if evaluator == "events" and not hidden else 64
    assert part.gap.shape == part.force.shape == (2, 3, samples)
    assert part.state.shape == (2, 2, samples)
    assert whole.force.shape == (2, 3, 64)
