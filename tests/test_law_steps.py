"""Compiled steps of a law along gaps, against the same steps taken one by one and chained with NumPy."""

import numpy as np
import pytest

import stickslip as ss
from stickslip.contact.addresses import law_address
from stickslip.contact.law_steps import steps_along, tangents_at

LAWS = (
    ss.ElasticCoulomb(k_t=3.0, k_w=2.0, k_n=1.5, mu=0.4, preload=1.0),
    ss.CubicSpring(cubic_t=2.0),
    ss.BoucWen(k_t=2.0, beta=0.7, gamma=0.3),
)


def along(law, seed):
    """Return gaps and velocities (40, 3), what share of a step each part ends at, the parts that end a step, and a state."""
    rng = np.random.default_rng(seed)
    gap, velocity = rng.normal(size=(2, 40, 3))
    samples = np.sort(rng.choice(39, 11, replace=False)).astype(np.int64)
    samples = np.append(samples, 39)
    share = rng.uniform(0.1, 1.0, 40)
    share[samples] = 1.0
    return gap, velocity, share, samples, np.array(law.initial_state(), dtype=float)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_steps_are_those_of_the_law_chained(law):
    gap, velocity, share, samples, state = along(law, 3)
    parameters, s = np.asarray(law.parameters(), dtype=float), state.size
    starts, whole = np.zeros((40, s)), np.zeros((len(samples), 3 + s, 9 + s))
    end = state.copy()
    steps_along(law_address(law.kernel), 0, gap, velocity, end, parameters, share, samples, starts, whole)
    found = np.zeros((40, 3, 6))
    every = np.arange(40, dtype=np.int64)
    tangents_at(law_address(law.kernel), gap, velocity, starts, every, parameters, found)

    force, status = np.empty(3), np.empty(2, dtype=np.int64)
    carried, twin = np.eye(s, 9 + s, 6), []
    for i in range(40):
        jac, new = np.zeros((3 + s, 6 + s)), np.empty(s)
        np.testing.assert_array_equal(starts[i], state)
        law.kernel(gap[i], velocity[i], state, parameters, force, new, jac, status)
        np.testing.assert_array_equal(found[i], jac[:3, :6])
        step = jac[:, 6:] @ carried
        step[:, :3] += share[i] * jac[:, :3]
        step[:, 3:6] += jac[:, 3:6]
        step[:, 6 + s :] += (1.0 - share[i]) * jac[:, :3]
        carried, state = step[3:], new
        if i in samples:
            twin.append(step)
            carried = np.eye(s, 9 + s, 6)
    np.testing.assert_array_equal(end, state)
    np.testing.assert_allclose(whole, twin, rtol=1e-13, atol=1e-13)
