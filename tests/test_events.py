"""The exact evaluator against closed forms, against a twin by companion matrices, against differences, and against physics."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from models import OPEN, SLIP, STICK, analyse, basis, twin
from scipy.optimize import brentq

from stickslip.contact import threads
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.element import element
from stickslip.contact.events import exact_period
from stickslip.contact.intervals import contact_period, prefix_sums
from stickslip.contact.law import NN, TN, TT, WN, WW
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.trigonometric import most_sign_changes, search_grid, sign_changes
from stickslip.harmonic.aft import contact_forces

SIZE = 1e-5  # gap amplitudes of the tests, m
BLOCKS = {TT: (0, 0), WW: (1, 1), NN: (2, 2), TN: (0, 2), WN: (1, 2)}


def evaluate(coefficients, rows, samples=0):
    """(2H+1, 3 n) coefficients of n contacts of one element each: coefficients, blocks, force, state."""
    n = coefficients.shape[1] // 3
    order = (coefficients.shape[0] - 1) // 2
    gap = np.ascontiguousarray((basis(order, samples) @ coefficients).T).reshape(n, 3, samples)
    rows = np.broadcast_to(rows, (n, 7)).copy()
    return exact_period(coefficients, rows, np.arange(n + 1), gap)


def sampled(coefficients, rows, samples):
    """The same by intervals."""
    m, width = coefficients.shape
    n = width // 3
    tables = prefix_sums((m - 1) // 2, samples)
    gap = np.ascontiguousarray((tables[0] @ coefficients).T).reshape(n, 3, samples)
    force, state = np.empty_like(gap), np.empty((n, 2, samples), np.int64)
    blocks = np.empty((n, 5, m, m))
    rows = np.broadcast_to(rows, (n, 7)).copy()
    contact_period(gap, rows, np.arange(n + 1), *tables, force, state, blocks)
    return analyse(force, (m - 1) // 2).reshape(width, m).T, blocks


def random_gaps(rng, order, n=1, tangential=1.0, normal=1.0, means=(0.0, 0.0, 0.0)):
    decay = np.repeat(1.0 / np.maximum(np.arange(order + 1), 1) ** 1.5, 2)[1:, None, None]
    gap = SIZE * rng.standard_normal((2 * order + 1, n, 3)) * decay
    gap *= np.array([tangential, tangential, normal])
    gap[0] += SIZE * np.array(means)
    return gap.reshape(2 * order + 1, 3 * n)


def force_size(row, coefficients):
    """Rounding is measured against the forces that stiff springs would have."""
    return max(row[:3]) * np.sum(np.abs(coefficients)) + abs(row[4])


rows = st.builds(
    lambda k_t, k_w, k_n, mu, preload, m: element(
        k_t=10**k_t, k_w=10**k_w, k_n=10**k_n, mu=mu, preload=preload * 10**k_n * SIZE * 2.0, residual_traction=m
    ),
    k_t=st.floats(4, 8),
    k_w=st.floats(4, 8),
    k_n=st.floats(4, 8),
    mu=st.floats(0, 2),
    preload=st.floats(-1, 3),
    m=st.none() | st.floats(-1, 1),
)


# ---- closed forms -------------------------------------------------------------------------------------------------------

# A/xc: kr/k, ki/k, F3/fc, F5/fc of one Jenkins element (Griffin 1980), printed to ten and to eight digits
PRINTED = {
    1.25: (0.8576215101, 0.2037183272, -0.08148733 - 0.02376714j, 0.00195570 - 0.03338264j),
    1.5: (0.7082085942, 0.2829421211, -0.08892013 - 0.11003305j, 0.03754405 - 0.01013003j),
    2.0: (0.5, 0.3183098862, -0.21220659j, 0.04244132j),
    3.0: (0.2917914058, 0.2829421211, 0.17784026 - 0.22006609j, -0.07508811 - 0.02026005j),
    5.0: (0.1423784899, 0.2037183272, 0.32594932 - 0.09506855j, -0.00782278 - 0.13353057j),
    10.0: (0.0520440193, 0.1145915590, 0.36669299 + 0.10695212j, 0.15547783 - 0.10744105j),
    100.0: (0.0016925506, 0.0126050715, 0.16388067 + 0.38689166j, 0.15349719 + 0.19431059j),
}


def jenkins_harmonic(n, ratio):
    """Harmonic n of one Jenkins element with k = limit = 1 under ``ratio cos t``, from its piecewise form."""

    def integral(m, start, end):
        return end - start if m == 0 else 1j / m * (np.exp(-1j * m * end) - np.exp(-1j * m * start))

    theta = np.arccos(1 - 2 / ratio)
    stuck = (1 - ratio) * integral(n, 0, theta)
    stuck += ratio / 2 * (integral(n - 1, 0, theta) + integral(n + 1, 0, theta))
    return 2 / np.pi * (stuck - integral(n, theta, np.pi))


@pytest.mark.parametrize("unilateral", [True, False])
@pytest.mark.parametrize("ratio", list(PRINTED))
def test_jenkins_element(ratio, unilateral):
    q = np.zeros((11, 3))
    q[1, 0] = ratio
    row = element(k_t=1.0, mu=1.0, preload=1.0, unilateral=unilateral)
    coefficients, _, _, _ = evaluate(q, row)
    harmonics = coefficients[1::2, 0] - 1j * coefficients[2::2, 0]
    theta = np.arccos(1 - 2 / ratio)
    stiffness = (theta - np.sin(2 * theta) / 2) / np.pi + 4j / (np.pi * ratio) * (1 - 1 / ratio)
    assert abs(harmonics[0] / ratio - stiffness) <= 1e-12
    for n in (3, 5):
        assert abs(harmonics[n - 1] - jenkins_harmonic(n, ratio)) <= 1e-12
    assert np.max(np.abs(harmonics[1::2])) <= 1e-14 * ratio
    assert abs(coefficients[0, 0]) <= 1e-14 * ratio
    k_r, k_i, third, fifth = PRINTED[ratio]
    assert harmonics[0] / ratio == pytest.approx(k_r + 1j * k_i, abs=1e-10)
    assert harmonics[2] == pytest.approx(third, abs=1e-8)
    assert harmonics[4] == pytest.approx(fifth, abs=1e-8)


def test_iwan_as_a_sum_of_elements_dissipates_as_its_parts():
    n, amplitude = 40, 0.7
    limits = (np.arange(n) + 0.5) / n * 2.0
    parts = np.array([element(k_t=1 / n, mu=1.0, preload=x / n, unilateral=False) for x in limits])
    q = np.zeros((7, 3))
    q[1, 0] = amplitude
    coefficients, blocks, force, state = exact_period(q, parts, np.array([0, n]), (basis(3, 64) @ q).T[None].copy())
    lost = 4 * np.sum(np.maximum(amplitude - limits, 0.0) * limits / n)
    assert np.pi * amplitude * -coefficients[2, 0] == pytest.approx(lost, rel=1e-13)
    alone = [evaluate(q, row, 64) for row in parts]
    assert np.allclose(coefficients, sum(a[0] for a in alone), rtol=0, atol=1e-14)
    assert np.allclose(blocks, sum(a[1] for a in alone), rtol=0, atol=1e-14)
    assert np.allclose(force, sum(a[2] for a in alone), rtol=0, atol=1e-14)
    assert SLIP in state
    assert np.all(state[0, 0] <= SLIP)


# ---- a twin: roots of companion matrices, clipping between them, Gauss quadrature ----------------------------------------


def at(polynomial, tau):
    order = (len(polynomial) - 1) // 2
    h = np.arange(1, order + 1)
    angles = np.multiply.outer(tau, h)
    return polynomial[0] + np.cos(angles) @ polynomial[1::2] + np.sin(angles) @ polynomial[2::2]


def slope_of(polynomial):
    h = np.repeat(np.arange(1, (len(polynomial) + 1) // 2), 2)
    swapped = polynomial[1:].reshape(-1, 2)[:, ::-1] * np.array([1.0, -1.0])
    return np.concatenate([[0.0], h * swapped.ravel()])


def near_roots(polynomial):
    """Arguments of all roots in exp(iτ) near the unit circle; a few too many do no harm."""
    harmonics = 0.5 * (polynomial[1::2] - 1j * polynomial[2::2])
    roots = np.roots(np.concatenate([harmonics[::-1], [polynomial[0]], harmonics.conj()]))
    return np.angle(roots[np.abs(np.abs(roots) - 1) < 1e-4]) % (2 * np.pi)


def mean(force, ends, m):
    """(m,) Fourier coefficients by Gauss quadrature between the times in `ends`."""
    x, w = np.polynomial.legendre.leggauss(24)
    ends = np.unique(np.concatenate([ends, np.linspace(0, 2 * np.pi, 2 * m + 3)]))
    half = 0.5 * np.diff(ends)[:, None]
    tau = (0.5 * (ends[1:] + ends[:-1])[:, None] + half * x).ravel()
    weights = (half * w).ravel() / np.pi
    columns = [weights / 2]
    for h in range(1, (m + 1) // 2):
        columns += [weights * np.cos(h * tau), weights * np.sin(h * tau)]
    return np.array(columns) @ force(tau)


def twin_spring(x, k, pressure, mu, share):
    """Return the friction force as a function of time and the times at which its piece changes."""

    def wall(tau, sign):
        return k * at(x, tau) - sign * mu * np.maximum(at(pressure, tau), 0.0)

    extrema = [near_roots(slope_of(k * x + sign * mu * pressure)) for sign in (-1, 1)]
    nodes = np.unique(np.concatenate([[0.0, 2 * np.pi], near_roots(pressure), *extrema]))
    z = 0.0 if np.isnan(share) else wall(0.0, share)
    z = np.clip(z, wall(0.0, 1), wall(0.0, -1))
    for node in nodes:
        z = np.clip(z, wall(node, 1), wall(node, -1))
    places, starts = [], [0.0]
    for a, b in pairwise(nodes):
        before, z = z, np.clip(z, wall(b, 1), wall(b, -1))
        sign = 1 if z > before else -1
        start = b
        if z != before:
            start = a
            if (wall(a, sign) - before) * (wall(b, sign) - before) < 0:
                start = brentq(lambda t, s=sign, z=before: wall(t, s) - z, a, b, xtol=1e-15)
        starts += [start, b]
        places += [(before, 0), (z, sign)]
    starts = np.array(starts)

    def force(tau):
        which = np.clip(np.searchsorted(starts, tau, side="right") - 1, 0, len(places) - 1)
        z, sign = np.array(places)[which].T
        spring = (k * at(x, tau) - z) * (at(pressure, tau) > 0.0)
        return np.where(sign != 0, sign * mu * np.maximum(at(pressure, tau), 0.0), spring)

    return force, starts


def companion_twin(coefficients, row):
    """(m, 3) exact coefficients of the force of one element, sharing no code and no search with the package."""
    m = len(coefficients)
    pressure = -row[2] * coefficients[:, 2]
    pressure[0] += row[4]
    out = [mean(*twin_spring(coefficients[:, d], row[d], pressure, row[3], row[5]), m) for d in (0, 1)]
    normal = mean(lambda tau: -np.maximum(at(pressure, tau), 0.0), near_roots(pressure), m)
    return np.array([*out, normal]).T


@settings(max_examples=60, deadline=None)
@given(row=rows, seed=st.integers(0, 2**32 - 1), order=st.integers(1, 12))
def test_coefficients_of_the_twin(row, seed, order):
    rng = np.random.default_rng(seed)
    q = random_gaps(rng, order, 1, 10 ** rng.uniform(-1.5, 1.5), 1.0)
    got = evaluate(q, row)[0]
    # a double root is found by the twin to sqrt(round-off) only, which moves its force by round-off times a few
    assert np.max(np.abs(got - companion_twin(q, row))) <= 1e-10 * force_size(row, q)


@settings(max_examples=25, deadline=None)
@given(row=rows, seed=st.integers(0, 2**32 - 1), order=st.integers(0, 5))
def test_samples_and_coefficients_of_the_dense_march(row, seed, order):
    rng = np.random.default_rng(seed)
    q = random_gaps(rng, order, 1, 10 ** rng.uniform(-1.5, 1.5), 1.0)
    samples, every = 4096, 64
    law = ElasticCoulomb(
        k_t=row[0],
        k_w=row[1],
        k_n=row[2],
        mu=row[3],
        preload=row[4],
        residual_traction=None if np.isnan(row[5]) else row[5],
    )
    want = twin((basis(order, samples) @ q).T, law)
    coefficients, _, force, _ = evaluate(q, row, samples // every)
    # the march sees an extremum of a wall at its nearest sample, an opening up to a sample late, and starts a sample early
    size = force_size(row, q)
    step = 2 * np.pi * max(order, 1) / samples
    assert np.max(np.abs(force[0] - want.force[:, ::every])) <= 2 * step * size
    assert np.max(np.abs(coefficients - analyse(want.force, order).T)) <= 2 * step * size


def root_mean_square(x):
    return float(np.sqrt(np.mean(x**2)))


def test_samples_converge_to_the_events():
    """Forces with the square of the sample's length, derivatives with its length (where no contact closes into stick)."""
    rng = np.random.default_rng(3)
    q = random_gaps(rng, 3, 200, 2.0, 0.5)
    row = element(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.5, preload=2.5 * 3e6 * SIZE)
    coefficients, blocks, _, _ = evaluate(q, row)
    samples = np.array([64, 128, 256, 512, 1024, 2048])
    errors = []
    for n in samples:
        by_samples, blocks_by_samples = sampled(q, row, n)
        errors.append([root_mean_square(by_samples - coefficients), root_mean_square(blocks_by_samples - blocks)])
    force, derivative = -np.polyfit(np.log(samples), np.log(errors), 1)[0]
    assert 1.8 <= force <= 2.2
    assert 0.8 <= derivative <= 1.2


# ---- derivatives --------------------------------------------------------------------------------------------------------

STATES = {
    # name: (k_t, k_w, mu, preload in units of k_n SIZE, tangential size, normal size, means, states that must occur)
    "full stick": (1e6, 2e6, 0.5, 20.0, 1.0, 0.3, (0, 0, 0), {STICK}),
    "micro-slip": (1e6, 2e6, 0.5, 3.0, 1.6, 0.3, (0, 0, 0), {STICK, SLIP}),
    "gross slip": (1e6, 2e6, 0.5, 3.0, 300.0, 0.3, (0, 0, 0), {STICK, SLIP}),
    "lift-off, stick": (1e6, 2e6, 1e3, 0.5, 1.0, 1.0, (0, 0, 0), {STICK, OPEN}),
    "lift-off and slip": (1e6, 2e6, 0.5, 0.5, 3.0, 1.0, (0, 0, 0), {STICK, SLIP, OPEN}),
    "mostly open": (1e6, 2e6, 0.5, -1.0, 3.0, 1.0, (0, 0, 0), {SLIP, OPEN}),
    "always open": (1e6, 2e6, 0.5, -50.0, 1.0, 1.0, (0, 0, 0), {OPEN}),
    "shakedown": (1e6, 2e6, 0.5, 10.0, 0.3, 0.3, (40, -40, 0), {STICK}),
    "soft tangents": (1e3, 1e9, 0.5, 1.0, 2.0, 1.0, (0, 0, 0), {STICK, SLIP, OPEN}),
}


def differences(coefficients, row, step):
    """(m, 3, m, 3) central differences of one contact's force coefficients: force row, force direction, gap row, gap direction."""
    m = coefficients.shape[0]
    moves = step * np.eye(3 * m).reshape(3 * m, m, 3)
    moved = np.stack([coefficients + moves, coefficients - moves]).transpose(2, 0, 1, 3)
    forces = evaluate(moved.reshape(m, -1), row)[0].reshape(m, 2, 3 * m, 3)
    return ((forces[:, 0] - forces[:, 1]) / (2 * step)).transpose(0, 2, 1).reshape(m, 3, m, 3)


def check_blocks(blocks, slope, tolerance):
    for block, (of, by) in BLOCKS.items():
        assert np.max(np.abs(blocks[block] - slope[:, of, :, by])) <= tolerance, f"block {block}"


@pytest.mark.parametrize("residual", [None, 0.0, -0.7], ids=["free start", "m = 0", "m = -0.7"])
@pytest.mark.parametrize("name", list(STATES))
def test_jacobian_in_each_contact_state(name, residual):
    k_t, k_w, mu, preload, tangential, normal, means, must_occur = STATES[name]
    row = element(k_t=k_t, k_w=k_w, k_n=3e6, mu=mu, preload=preload * 3e6 * SIZE, residual_traction=residual)
    rng = np.random.default_rng(7)
    seen = set()
    stiffness = max(k_t, k_w, 3e6 * max(1.0, min(mu, k_w / 3e6)))
    for order in (1, 4):
        for _ in range(3):
            q = random_gaps(rng, order, 1, tangential, normal, means)
            _, blocks, _, state = evaluate(q, row, 256)
            seen |= set(np.unique(state).tolist())
            # the force is smooth within a sequence of states: a step of 1e-6 leaves an error of 1e-12, and round-off of 1e-9
            size = force_size(row, q) / stiffness
            tolerance = 1e-6 * stiffness * max(1.0, 1e-3 * size / SIZE)
            check_blocks(blocks[0], differences(q, row, 1e-6 * SIZE), tolerance)
    assert must_occur <= seen


@settings(max_examples=60, deadline=None)
@given(row=rows, seed=st.integers(0, 2**32 - 1), order=st.integers(0, 6))
def test_jacobian_of_random_contacts(row, seed, order):
    rng = np.random.default_rng(seed)
    q = random_gaps(rng, order, 1, 10 ** rng.uniform(-1.5, 1.5), 1.0)
    size = max(row[0], row[1], row[2] * max(row[3], 1.0))
    coarse, fine = (differences(q, row, step * SIZE) for step in (2e-6, 1e-6))
    # beside a change of the sequence of states differences of two steps disagree: they judge nothing there
    assume(np.max(np.abs(coarse - fine)) <= 1e-6 * size)
    check_blocks(evaluate(q, row)[1][0], fine, 3e-6 * size)


def test_time_of_closing_moves_with_the_gap():
    # the contact closes while x moves and sticks from then on, with a spring that is slack at the gap of that time
    row = element(k_t=1.0, k_n=1.0, mu=10.0, preload=0.5)
    q = np.zeros((3, 3))
    q[2, 2], q[1, 0], q[2, 0] = -1.0, 0.3, 0.2
    _, blocks, _, state = evaluate(q, row, 64)
    state = state[0, 0]
    assert np.any((state == OPEN) & (np.roll(state, -1) == STICK))
    slope = differences(q, row, 1e-6)[:, 0, :, 2]
    assert np.allclose(blocks[0, TN], slope, rtol=0, atol=1e-9)
    # by samples the contact closes at one of them, which does not move: that part is missing, however many there are
    for samples in (512, 4096):
        assert np.max(np.abs(sampled(q, row, samples)[1][0, TN] - slope)) > 0.05


# ---- physics ------------------------------------------------------------------------------------------------------------


def delayed(coefficients, shift):
    """Coefficients of the signal delayed by `shift` rad of the period."""
    out = coefficients.copy()
    for h in range(1, (coefficients.shape[0] - 1) // 2 + 1):
        c, s = coefficients[2 * h - 1], coefficients[2 * h]
        out[2 * h - 1] = c * np.cos(h * shift) - s * np.sin(h * shift)
        out[2 * h] = c * np.sin(h * shift) + s * np.cos(h * shift)
    return out


@settings(max_examples=100, deadline=None)
@given(row=rows, seed=st.integers(0, 2**32 - 1), order=st.integers(1, 8), shift=st.floats(0, 2 * np.pi))
def test_a_contact_that_slips_forgets_when_time_began(row, seed, order, shift):
    rng = np.random.default_rng(seed)
    q = random_gaps(rng, order, 1, 10 ** rng.uniform(-1, 1.5), 1.0)
    here, _, force, state = evaluate(q, row, 256)
    there = evaluate(delayed(q, shift), row)[0]
    for d in range(3):
        if d < 2:
            # both signs of slip, or a lift-off, erase the memory; slip to one side alone may keep the mean of its start
            signs = np.unique(np.sign(force[0, d][state[0, d] == SLIP]))
            if signs.size < 2 and not np.any(state[0, d] == OPEN):
                continue
        assert np.max(np.abs(delayed(here[:, [d]], shift) - there[:, [d]])) <= 1e-12 * force_size(row, q)


@settings(max_examples=200, deadline=None)
@given(row=rows, seed=st.integers(0, 2**32 - 1), order=st.integers(1, 10))
def test_friction_never_gives_energy(row, seed, order):
    rng = np.random.default_rng(seed)
    q = random_gaps(rng, order, 1, 10 ** rng.uniform(-1, 1.5), 1.0)
    force, _, _, state = evaluate(q, row, 256)
    h = np.arange(1, order + 1)
    for d in range(2):
        if np.any(state[0, d] == OPEN):
            continue  # the spring's energy at lift-off is lost, too, but the next spring starts at another gap
        work = np.pi * np.sum(h * (force[1::2, d] * q[2::2, d] - force[2::2, d] * q[1::2, d]))
        assert work >= -1e-13 * order * force_size(row, q) * np.sum(np.abs(q[:, d]))


def test_normal_force_alone_is_conservative():
    rng = np.random.default_rng(8)
    row = element(k_n=2e6, preload=2e6 * SIZE)
    for order in (1, 3, 9):
        q = random_gaps(rng, order)
        force = evaluate(q, row)[0]
        h = np.arange(1, order + 1)
        work = np.sum(h * (force[1::2, 2] * q[2::2, 2] - force[2::2, 2] * q[1::2, 2]))
        assert abs(work) <= 1e-13 * order * force_size(row, q) * np.sum(np.abs(q))


# ---- limits -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["smooth", "rough", "whole numbers", "single harmonics", "tiny"])
def test_thousands_of_motions_are_admissible(kind):
    """Forces on their limits, none missed: every event array is bounded, whatever the motion."""
    n = 4000
    rng = np.random.default_rng(11)
    for order in (1, 2, 5, 9):
        q = random_gaps(rng, order, n // 4) / SIZE
        if kind == "rough":
            q = rng.standard_normal(q.shape)
        elif kind == "whole numbers":  # extrema at t = 0, double roots, equal walls
            q = rng.integers(-2, 3, q.shape).astype(float)
        elif kind == "single harmonics":
            q *= rng.random(q.shape) < 2.0 / q.shape[0]
        elif kind == "tiny":  # round-off between large coefficients
            q = np.round(q) + 1e-15 * rng.standard_normal(q.shape)
        row = np.tile(element(k_t=1.0, k_w=2.0, k_n=1.0, mu=0.5), (n // 4, 1))
        row[:, 4] = rng.integers(-1, 4, n // 4)
        row[::3, 5] = 0.5
        coefficients, blocks, force, state = evaluate(q, row, 128)
        assert np.all(np.isfinite(coefficients))
        assert np.all(np.isfinite(blocks))
        assert np.all((state >= STICK) & (state <= OPEN))
        size = 20.0 * order  # about the largest force
        pressure = row[:, 4, None] - (basis(order, 128) @ q[:, 2::3]).T
        assert np.max(np.abs(force[:, 2] + np.maximum(pressure, 0.0))) <= 1e-13 * size
        assert np.all(np.abs(force[:, :2]) <= -0.5 * force[:, [2]] + 1e-12 * size)
        by_samples, _ = sampled(q, row, 512)
        assert np.max(np.abs(coefficients - by_samples)) <= 0.02 * size


def test_full_stick_is_linear_springs():
    row = element(k_t=1e6, k_w=2e6, k_n=3e6, mu=1e3, preload=1e6)
    q = random_gaps(np.random.default_rng(1), 5)
    coefficients, blocks, _, _ = evaluate(q, row)
    want = q * np.array([1e6, 2e6, 3e6])
    want[0, 2] -= 1e6
    assert np.allclose(coefficients, want, rtol=1e-14, atol=0)
    for block, k in ((TT, 1e6), (WW, 2e6), (NN, 3e6)):
        assert np.allclose(blocks[0, block], k * np.eye(11), rtol=0, atol=1e-15 * k)
    assert not np.any(blocks[0, [TN, WN]])


def test_open_contact_does_nothing():
    row = element(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.5, preload=-1e3, residual_traction=0.5)
    coefficients, blocks, force, state = evaluate(random_gaps(np.random.default_rng(1), 5), row, 64)
    assert np.all(state == OPEN)
    assert not np.any(coefficients)
    assert not np.any(blocks)
    assert not np.any(force)


def test_no_friction_no_tangential_force():
    row = element(k_t=1e6, k_w=1e6, k_n=1e6, mu=0.0, preload=1e6 * SIZE)
    coefficients, blocks, force, _ = evaluate(random_gaps(np.random.default_rng(4), 3), row, 64)
    assert not np.any(coefficients[:, :2])
    assert not np.any(force[0, :2])
    assert np.max(np.abs(blocks[0, [TT, WW, TN, WN]])) == 0.0


@pytest.mark.parametrize("m", [None, -1.0, 0.0, 0.8])
def test_constant_gaps(m):
    q = np.array([[2e-5, -3e-5, -1e-5]])
    row = element(k_t=1e6, k_w=2e6, k_n=1e6, mu=0.5, preload=10.0, residual_traction=m)
    coefficients, _, _, _ = evaluate(q, row)
    # without a start k x = 20 and -60 N, both beyond the limit of 10 N
    want = [10.0, -10.0, -20.0] if m is None else [10.0 * m, 10.0 * m, -20.0]
    assert np.allclose(coefficients[0], want, rtol=1e-14, atol=1e-14)


@pytest.mark.parametrize("m", [-1.0, -0.3, 0.0, 0.8])
def test_residual_traction_is_the_force_at_the_start(m):
    row = element(k_t=1e6, k_n=0.0, mu=0.5, preload=100.0, residual_traction=m)
    q = np.zeros((3, 3))
    q[2, 0] = 0.9 * (1 - abs(m)) * 50.0 / 1e6
    coefficients, _, force, state = evaluate(q, row, 32)
    assert force[0, 0, 0] == pytest.approx(50.0 * m, abs=1e-13)
    assert coefficients[:, 0] == pytest.approx([50.0 * m, 0.0, 1e6 * q[2, 0]], abs=1e-13)
    assert np.all(state == STICK)


def test_pressure_that_touches_zero():
    # N = 1 + cos τ has a double root at τ = π: closed throughout, with a limit that vanishes there
    q = np.zeros((3, 3))
    q[1, 2], q[1, 0], q[2, 0] = -1.0, 0.4, 2.0
    row = element(k_t=1.0, k_n=1.0, mu=0.5, preload=1.0)
    touching = evaluate(q, row)
    for preload in (1.0 + 1e-9, 1.0 - 1e-9):
        near = evaluate(q, element(k_t=1.0, k_n=1.0, mu=0.5, preload=preload))
        assert np.allclose(near[0], touching[0], rtol=0, atol=1e-8)


# ---- sign changes -------------------------------------------------------------------------------------------------------


def found(polynomial):
    order = (len(polynomial) - 1) // 2
    grid = search_grid(order)
    roots = np.empty(most_sign_changes(order))
    width = grid.shape[1]
    count = sign_changes(
        polynomial, slope_of(polynomial), grid, np.empty(width), np.empty(width), np.empty((40, 3)), roots
    )
    return roots[:count]


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), order=st.integers(1, 15), pairs=st.integers(0, 4))
def test_sign_changes_are_those_the_polynomial_was_made_of(seed, order, pairs):
    """Products of sin((τ - a)/2) sin((τ - b)/2) with b so close to a that a grid passes over both."""
    rng = np.random.default_rng(seed)
    pairs = min(pairs, order)
    left = np.sort(rng.uniform(0.01, 2 * np.pi - 0.2, pairs))
    right = left + 10 ** rng.uniform(-4, -2, pairs)
    assume(np.all(np.diff(left) > 0.05))
    roots = np.sort(np.concatenate([left, right]))

    def product(tau):
        factors = np.sin((np.asarray(tau)[..., None] - roots) / 2)
        return np.prod(factors, axis=-1) * (1 + 0.3 * np.cos(tau)) ** (order - pairs)

    polynomial = analyse(product(2 * np.pi * np.arange(4 * order + 4) / (4 * order + 4)), order)
    # what lies between the two of a pair must stand out of round-off
    assume(np.all(np.abs(product((left + right) / 2)) > 1e-13 * np.sum(np.abs(polynomial))))
    got = found(polynomial)
    assert got.size == roots.size
    # a coefficient's round-off moves a root by as much over the slope
    slopes = np.abs(at(slope_of(polynomial), roots))
    assert np.all(np.abs(got - roots) <= 1e-13 * np.sum(np.abs(polynomial)) / slopes + 1e-14)


def test_zero_counts_as_positive():
    assert found(np.zeros(5)).size == 0
    assert found(np.array([-1.0])).size == 0
    assert found(np.array([0.0, 1.0, 0.0])) == pytest.approx([np.pi / 2, 1.5 * np.pi])
    sine = found(np.array([0.0, 0.0, 1.0]))  # positive at 0, negative from π
    assert sine.size == 2
    assert sine == pytest.approx([np.pi, 2 * np.pi])


# ---- threads ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("evaluator", ["intervals", "events"])
def test_threads_change_nothing(evaluator, monkeypatch):
    rng = np.random.default_rng(2)
    laws = [ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.5, preload=60.0 * p) for p in rng.uniform(-0.5, 3.0, 37)]
    contacts = compile_contacts(laws, evaluator=evaluator)
    q = random_gaps(rng, 3, 37, 2.0)
    alone = contact_forces(q, contacts, 64)
    monkeypatch.setattr(threads, "CONTACTS_WORTH_THREADS", 2)
    monkeypatch.setattr(threads.numba, "get_num_threads", lambda: 2)
    assert threads.thread_shares(37) > 1
    shared = contact_forces(q, contacts, 64)
    assert np.array_equal(alone.coefficients, shared.coefficients)
    assert np.array_equal(alone.blocks, shared.blocks)
    assert np.array_equal(alone.force, shared.force)
    assert np.array_equal(alone.state, shared.state)
    monkeypatch.setattr(threads.numba, "get_num_threads", lambda: 1)
    assert threads.thread_shares(10**6) == 1
