"""The interval kernel against a plain march, against differences, and against what physics demands."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from models import OPEN, SLIP, STICK, analyse, basis, twin

from stickslip.contact.compiled import compile_contacts
from stickslip.contact.law import NN, TN, TT, WN, WW
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.aft import contact_forces

SIZE = 1e-5  # gap amplitudes of the tests, m


def evaluate(coefficients, laws, samples):
    """(2H+1, 3 n) coefficients of n contacts."""
    return contact_forces(coefficients, compile_contacts(laws), samples)


def random_gap(rng, order, tangential=1.0, normal=1.0, means=(0.0, 0.0, 0.0)):
    decay = np.repeat(1.0 / np.maximum(np.arange(order + 1), 1) ** 1.5, 2)[1:, None]
    gap = SIZE * rng.standard_normal((2 * order + 1, 3)) * decay * np.array([tangential, tangential, normal])
    gap[0] += SIZE * np.array(means)
    return gap


laws = st.builds(
    ElasticCoulomb,
    k_t=st.floats(2, 10).map(lambda e: 10**e),
    k_w=st.floats(2, 10).map(lambda e: 10**e),
    k_n=st.floats(2, 10).map(lambda e: 10**e),
    mu=st.floats(0, 2),
    preload=st.floats(-1, 1),
    residual_traction=st.none() | st.floats(-1, 1),
)


def with_preload_in_gaps(law, share):
    """The same law with its preload as a share of the normal force that one unit of gap makes: all states get their turn."""
    return ElasticCoulomb(
        k_t=law.k_t,
        k_w=law.k_w,
        k_n=law.k_n,
        mu=law.mu,
        preload=share * law.k_n * SIZE * 2.0,
        residual_traction=law.residual_traction,
    )


@settings(max_examples=120)
@given(law=laws, seed=st.integers(0, 2**32 - 1), order=st.integers(0, 7), samples=st.integers(16, 512))
def test_forces_and_states_of_the_plain_march(law, seed, order, samples):
    rng = np.random.default_rng(seed)
    law = with_preload_in_gaps(law, law.preload)
    coefficients = random_gap(rng, order, 10 ** rng.uniform(-2, 2), 1.0)
    got = evaluate(coefficients, [law], samples)
    gap = (basis(order, samples) @ coefficients).T
    want = twin(gap, law)
    # the two sum in another order: rounding of k x, which can exceed the force itself by far
    size = max(law.k_t, law.k_w, law.k_n) * np.max(np.abs(gap)) + abs(law.preload)
    assert np.max(np.abs(got.force[0] - want.force)) <= 1e-12 * size
    # a state may differ only where the force lies on its limit to rounding
    differ = got.state[0] != want.state
    assert np.all(want.margin[differ] <= 1e-12 * size)
    assert np.allclose(got.coefficients.T, analyse(got.force[0], order), rtol=0, atol=1e-12 * size)


# ---- Jacobian -----------------------------------------------------------------------------------------------------------

STATES = {
    # name: (k_t, k_w, mu, preload in units of k_n SIZE, tangential size, normal size, means, states that must occur)
    "full stick": (1e6, 2e6, 0.5, 20.0, 1.0, 0.3, (0, 0, 0), {STICK}),
    "micro-slip": (1e6, 2e6, 0.5, 3.0, 1.6, 0.3, (0, 0, 0), {STICK, SLIP}),
    "gross slip": (1e6, 2e6, 0.5, 3.0, 300.0, 0.3, (0, 0, 0), {STICK, SLIP}),
    "lift-off": (1e6, 2e6, 1e3, 0.5, 1.0, 1.0, (0, 0, 0), {STICK, OPEN}),
    "lift-off and slip": (1e6, 2e6, 0.5, 0.5, 3.0, 1.0, (0, 0, 0), {STICK, SLIP, OPEN}),
    "mostly open": (1e6, 2e6, 0.5, -1.0, 3.0, 1.0, (0, 0, 0), {SLIP, OPEN}),
    "always open": (1e6, 2e6, 0.5, -50.0, 1.0, 1.0, (0, 0, 0), {OPEN}),
    "shakedown": (1e6, 2e6, 0.5, 10.0, 0.3, 0.3, (40, -40, 0), {STICK}),
    "soft tangents": (1e3, 1e9, 0.5, 1.0, 2.0, 1.0, (0, 0, 0), {STICK, SLIP, OPEN}),
}
ORDERS, SAMPLES, DRAWS = (1, 4), 64, 2


def differences(coefficients, law, samples):
    """Central differences of all force coefficients and which columns keep every state of both periods.

    Between changes of state the forces are linear in the gap, so a difference is exact but for rounding; a column whose step
    changes a state anywhere would compare two different derivatives and is left out (and counted).
    """
    m = coefficients.shape[0]
    step = 1e-7 * SIZE
    moved = []
    for column in range(3 * m):
        for sign in (1.0, -1.0):
            point = coefficients.copy()
            point[column // 3, column % 3] += sign * step
            moved.append(point)
    forces = evaluate(np.hstack(moved), [law] * len(moved), samples).coefficients.reshape(m, len(moved), 3)
    slope = (forces[:, 0::2] - forces[:, 1::2]) / (2 * step)  # (m, 3 m, 3)
    b = basis((m - 1) // 2, samples)
    before = twin((b @ coefficients).T, law).history
    kept = np.array([np.array_equal(before, twin((b @ p).T, law).history) for p in moved]).reshape(-1, 2).all(axis=1)
    return slope.reshape(m, m, 3, 3), kept.reshape(m, 3)  # [force row, gap row, gap direction, force direction]


def check_blocks(blocks, slope, kept, stiffness):
    want = {TT: (0, 0), WW: (1, 1), NN: (2, 2), TN: (2, 0), WN: (2, 1)}
    for block, (by, of) in want.items():
        wrong = np.abs(blocks[block] - slope[:, :, by, of])[:, kept[:, by]]
        assert np.max(wrong, initial=0.0) <= 1e-6 * stiffness, f"block {block}"
    for by, of in ((0, 1), (1, 0), (0, 2), (1, 2)):
        assert np.all(slope[:, :, by, of] == 0.0)


@pytest.mark.parametrize("residual", [None, 0.0, -0.7], ids=["free start", "m = 0", "m = -0.7"])
@pytest.mark.parametrize("name", list(STATES))
def test_jacobian_in_each_contact_state(name, residual):
    k_t, k_w, mu, preload, tangential, normal, means, must_occur = STATES[name]
    k_n = 3e6
    law = ElasticCoulomb(k_t=k_t, k_w=k_w, k_n=k_n, mu=mu, preload=preload * k_n * SIZE, residual_traction=residual)
    rng = np.random.default_rng(7)
    seen, used, total = set(), 0, 0
    for order in ORDERS:
        for _ in range(DRAWS):
            coefficients = random_gap(rng, order, tangential, normal, means)
            period = evaluate(coefficients, [law], SAMPLES)
            seen |= set(np.unique(period.state).tolist())
            slope, kept = differences(coefficients, law, SAMPLES)
            used, total = used + kept.sum(), total + kept.size
            check_blocks(period.blocks[0], slope, kept, max(k_t, k_w, k_n * max(1.0, mu)))
    assert must_occur <= seen
    assert used >= 0.98 * total


def test_shakedown_slips_in_the_first_period_only():
    _, _, mu, preload, tangential, normal, means, _ = STATES["shakedown"]
    law = ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=mu, preload=preload * 3e6 * SIZE)
    gap = (basis(3, SAMPLES) @ random_gap(np.random.default_rng(7), 3, tangential, normal, means)).T
    history = twin(gap, law).history
    assert np.any(np.abs(history[:, :SAMPLES]) == SLIP)
    assert np.all(history[:, SAMPLES:] == STICK)


@settings(max_examples=40)
@given(law=laws, seed=st.integers(0, 2**32 - 1), order=st.integers(0, 3), samples=st.integers(16, 60))
def test_jacobian_of_random_contacts(law, seed, order, samples):
    rng = np.random.default_rng(seed)
    law = with_preload_in_gaps(law, law.preload)
    coefficients = random_gap(rng, order, 10 ** rng.uniform(-2, 2), 1.0)
    slope, kept = differences(coefficients, law, samples)
    # a force on its limit at every sample (constant gaps) is the one generic kink: all its columns drop out
    check_blocks(
        evaluate(coefficients, [law], samples).blocks[0], slope, kept, max(law.k_t, law.k_w, law.k_n * max(1, law.mu))
    )


def test_pressure_that_touches_zero_counts_as_closed():
    # powers of two: the pressure at sample 0 is zero exactly; the derivative is the one on the closed side
    law = ElasticCoulomb(k_t=2.0**20, k_w=2.0**20, k_n=2.0**20, mu=0.5, preload=2.0)
    coefficients = np.zeros((3, 3))
    coefficients[1] = [2.0**-18, 2.0**-21, 2.0**-19]
    period = evaluate(coefficients, [law], 64)
    assert period.force[0, 2, 0] == 0.0
    assert period.force[0, 0, 0] == 0.0
    assert period.state[0, 0, 0] == SLIP
    step = 2.0**-44
    closed = coefficients.copy()
    closed[0, 2] -= step
    slope = (evaluate(closed, [law], 64).coefficients - period.coefficients) / -step
    # rounding of forces of size 4 over the step: 4e-16 * 4 / 6e-14
    assert np.allclose(period.blocks[0][NN][:, 0], slope[:, 2], atol=0.05)
    assert np.allclose(period.blocks[0][TN][:, 0], slope[:, 0], atol=0.05)
    assert np.allclose(period.blocks[0][WN][:, 0], slope[:, 1], atol=0.05)


# ---- physics ------------------------------------------------------------------------------------------------------------


@settings(max_examples=100)
@given(law=laws, seed=st.integers(0, 2**32 - 1), order=st.integers(1, 5))
def test_friction_never_gives_energy(law, seed, order):
    rng = np.random.default_rng(seed)
    law = with_preload_in_gaps(law, law.preload)
    coefficients = random_gap(rng, order, 10 ** rng.uniform(-1, 1), 1.0)
    period = evaluate(coefficients, [law], 512)
    for d, k in ((0, law.k_t), (1, law.k_w)):
        x, force = period.gap[0, d], period.force[0, d]
        # exact work of the sampled march: elastic energy goes round, what is left is slip against the force at its end
        slipped = np.roll(np.diff(np.append(x, x[0])) - np.diff(np.append(force, force[0])) / k, 1)
        sliding = period.state[0, d] == SLIP
        work = np.sum(force[sliding] * slipped[sliding])
        assert work >= -1e-12 * k * np.max(np.abs(x)) ** 2 * 512
        if np.all(period.state[0] != OPEN):
            # and the same by the Fourier coefficients: the sampled work tends to it as the samples grow
            c, f = coefficients[:, d], analyse(force, order)
            by_harmonics = np.pi * sum(
                h * (f[2 * h - 1] * c[2 * h] - f[2 * h] * c[2 * h - 1]) for h in range(1, order + 1)
            )
            size = 2 * np.pi * order**2 * np.max(np.abs(force)) * np.max(np.abs(x))
            assert by_harmonics >= -0.05 * size


def rotated(coefficients, shift, samples):
    """Coefficients of the signal delayed by `shift` samples."""
    out = coefficients.copy()
    for h in range(1, (coefficients.shape[0] - 1) // 2 + 1):
        c, s = coefficients[2 * h - 1], coefficients[2 * h]
        angle = 2 * np.pi * h * shift / samples
        out[2 * h - 1] = c * np.cos(angle) - s * np.sin(angle)
        out[2 * h] = c * np.sin(angle) + s * np.cos(angle)
    return out


@settings(max_examples=60)
@given(
    seed=st.integers(0, 2**32 - 1),
    order=st.integers(1, 5),
    shift=st.integers(1, 63),
    residual=st.none() | st.floats(-1, 1),
)
def test_a_contact_that_slips_forgets_when_time_began(seed, order, shift, residual):
    rng = np.random.default_rng(seed)
    law = ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.5, preload=20.0, residual_traction=residual)
    coefficients = random_gap(rng, order, 8.0, 1.0)
    period = evaluate(coefficients, [law], 64)
    # both signs of slip, or a lift-off, erase the memory; slip to one side alone may keep the mean of its start
    for d in range(2):
        signs = np.unique(np.sign(period.force[0, d][period.state[0, d] == SLIP]))
        if signs.size < 2 and not np.any(period.state[0, d] == OPEN):
            return
    late = evaluate(rotated(coefficients, shift, 64), [law], 64)
    assert np.allclose(late.force[0], np.roll(period.force[0], shift, axis=1), rtol=0, atol=1e-9 * 60)


@settings(max_examples=60)
@given(law=laws, seed=st.integers(0, 2**32 - 1), order=st.integers(0, 5), direction=st.sampled_from([0, 1]))
def test_mirror_image_of_a_tangent(law, seed, order, direction):
    law = with_preload_in_gaps(law, law.preload)
    residual = law.residual_traction
    coefficients = random_gap(np.random.default_rng(seed), order, 2.0, 1.0)
    if residual is not None:
        coefficients[:, 1 - direction] = (
            0.0  # the start value has one sign for both tangents: mirror them one at a time
        )
    mirrored = coefficients.copy()
    mirrored[:, direction] *= -1.0
    turned = (
        law
        if residual is None
        else ElasticCoulomb(
            k_t=law.k_t, k_w=law.k_w, k_n=law.k_n, mu=law.mu, preload=law.preload, residual_traction=-residual
        )
    )
    a, b = evaluate(coefficients, [law], 48), evaluate(mirrored, [turned], 48)
    assert np.array_equal(b.force[0, direction], -a.force[0, direction])
    assert np.array_equal(b.force[0, 2], a.force[0, 2])
    assert np.array_equal(b.blocks[0, TT + direction], a.blocks[0, TT + direction])
    assert np.array_equal(b.blocks[0, TN + direction], -a.blocks[0, TN + direction])
    if residual is None:
        assert np.array_equal(b.force[0, 1 - direction], a.force[0, 1 - direction])


@settings(max_examples=60)
@given(law=laws, seed=st.integers(0, 2**32 - 1), order=st.integers(0, 5), power=st.integers(-20, 20))
def test_forces_grow_with_gap_and_preload(law, seed, order, power):
    law = with_preload_in_gaps(law, law.preload)
    factor = 2.0**power  # a power of two: scaling commits no rounding, so the two must agree bit by bit
    coefficients = random_gap(np.random.default_rng(seed), order, 2.0, 1.0)
    larger = ElasticCoulomb(
        k_t=law.k_t,
        k_w=law.k_w,
        k_n=law.k_n,
        mu=law.mu,
        preload=factor * law.preload,
        residual_traction=law.residual_traction,
    )
    a, b = evaluate(coefficients, [law], 48), evaluate(factor * coefficients, [larger], 48)
    assert np.array_equal(b.force, factor * a.force)
    assert np.array_equal(b.blocks, a.blocks)


def test_homogeneous_forces_are_their_jacobian_times_the_gap():
    # without preload K q = F (Euler): what the published form of the alert rests on
    law = ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.5)
    rng = np.random.default_rng(3)
    for _ in range(20):
        q = random_gap(rng, 4, 3.0, 1.0, (0, 0, -0.5))
        period = evaluate(q, [law], 64)
        k = period.blocks[0]
        forces = np.stack(
            [k[TT] @ q[:, 0] + k[TN] @ q[:, 2], k[WW] @ q[:, 1] + k[WN] @ q[:, 2], k[NN] @ q[:, 2]], axis=1
        )
        assert np.allclose(forces, period.coefficients, rtol=0, atol=1e-12 * 3e6 * SIZE * 10)


def test_full_stick_is_linear_springs():
    law = ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=1e3, preload=1e6)
    q = random_gap(np.random.default_rng(1), 5)
    period = evaluate(q, [law], 64)
    want = q * np.array([1e6, 2e6, 3e6])
    want[0, 2] -= 1e6
    assert np.allclose(period.coefficients, want, rtol=0, atol=1e-9)  # rounding of a preload of 1e6 N
    for block, k in ((TT, 1e6), (WW, 2e6), (NN, 3e6)):
        assert np.allclose(period.blocks[0, block], k * np.eye(11), rtol=0, atol=1e-12 * k * 64)
    assert np.all(period.blocks[0, [TN, WN]] == 0.0)


def test_open_contact_does_nothing():
    law = ElasticCoulomb(k_t=1e6, k_w=2e6, k_n=3e6, mu=0.5, preload=-1e3, residual_traction=0.5)
    period = evaluate(random_gap(np.random.default_rng(1), 5), [law], 64)
    assert np.all(period.state == OPEN)
    assert not np.any(period.coefficients)
    assert not np.any(period.blocks)


def test_order_of_contacts_does_not_matter():
    rng = np.random.default_rng(5)
    many = [
        ElasticCoulomb(k_t=10**e, k_w=3e5, k_n=1e6, mu=0.3, preload=p, residual_traction=m)
        for e, p, m in zip((5, 6, 7, 5.5), (5.0, -2.0, 50.0, 0.0), (None, 0.2, None, -1.0), strict=True)
    ]
    gaps = [random_gap(rng, 3, 3.0) for _ in many]
    order = [2, 0, 3, 1]
    a = evaluate(np.hstack(gaps), many, 40)
    b = evaluate(np.hstack([gaps[i] for i in order]), [many[i] for i in order], 40)
    # forces and blocks of a contact are computed alone: bit by bit; coefficients go through one matrix product
    assert np.array_equal(b.force, a.force[order])
    assert np.array_equal(b.blocks, a.blocks[order])
    assert np.array_equal(b.state, a.state[order])


@pytest.mark.parametrize("m", [None, -1.0, 0.0, 0.8])
@pytest.mark.parametrize("direction", [0, 1])
def test_a_direction_without_stiffness_carries_no_force(m, direction):
    stiff = {"k_t": 1e6, "k_w": 1e6, ("k_t", "k_w")[direction]: 0.0}
    law = ElasticCoulomb(**stiff, k_n=1e6, mu=0.5, preload=10.0, residual_traction=m)
    period = evaluate(random_gap(np.random.default_rng(6), 3, 3.0, 0.3), [law], 64)
    assert not np.any(period.force[0, direction])
    assert not np.any(period.blocks[0, [TT + direction, TN + direction]])
    assert np.any(period.force[0, 1 - direction])


@pytest.mark.parametrize("m", [-1.0, -0.3, 0.0, 0.8])
def test_residual_traction_sets_the_mean_of_a_stuck_contact(m):
    law = ElasticCoulomb(k_t=1e6, k_w=1e6, k_n=0.0, mu=0.5, preload=100.0, residual_traction=m)
    samples = 32
    coefficients = np.zeros((3, 3))
    # starts at its middle (a sine, one sample before zero), moves by less than what is left to the limit
    amplitude = 0.1 * (1 - abs(m)) * 50.0 / 1e6
    coefficients[2, 0] = amplitude
    period = evaluate(coefficients, [law], samples)
    last = -amplitude * np.sin(2 * np.pi / samples)
    assert period.force[0, 0].mean() == pytest.approx(m * 50.0 - 1e6 * last, abs=1e-10)
    assert period.force[0, 0, -1] == pytest.approx(m * 50.0, abs=1e-10)


def test_residual_traction_does_not_matter_where_all_slips():
    rng = np.random.default_rng(2)
    q = random_gap(rng, 1, 300.0, 0.1)
    both = [
        evaluate(q, [ElasticCoulomb(k_t=1e6, k_w=1e6, k_n=1e6, mu=0.5, preload=20.0, residual_traction=m)], 64).force
        for m in (None, -1.0, 0.0, 1.0)
    ]
    for other in both[1:]:
        assert np.allclose(other, both[0], rtol=0, atol=1e-10)


def test_no_friction_no_tangential_force():
    law = ElasticCoulomb(k_t=1e6, k_w=1e6, k_n=1e6, mu=0.0, preload=5.0)
    period = evaluate(random_gap(np.random.default_rng(4), 3), [law], 64)
    assert not np.any(period.force[0, :2])
    assert not np.any(period.blocks[0, [TT, WW, TN, WN]])


# ---- closed form of one Jenkins spring (Griffin 1980) -------------------------------------------------------------------


@pytest.mark.parametrize("ratio", [1.25, 1.5, 2.0, 5.0, 100.0])
def test_jenkins_equivalent_stiffness(ratio):
    law = ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=0.0, mu=1.0, preload=1.0)
    q = np.zeros((3, 3))
    q[1, 0] = ratio
    samples = 4096
    force = evaluate(q, [law], samples).coefficients[:, 0]
    theta = np.arccos(1 - 2 / ratio)
    real = (theta - np.sin(2 * theta) / 2) / np.pi * ratio
    imaginary = 4 * (1 - 1 / ratio) / np.pi
    # sampling moves the kinks by up to a sample: error O(1/samples²) per kink, larger where the force turns fast
    assert force[1] == pytest.approx(real, abs=20 * ratio / samples)
    assert -force[2] == pytest.approx(imaginary, abs=20 * ratio / samples)
    assert force[0] == pytest.approx(0.0, abs=20 * ratio / samples)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("k_t", -1.0, "must be finite and not negative, got -1.0"),
        ("mu", float("nan"), "must be finite and not negative, got nan"),
        ("preload", float("inf"), "must be finite, got inf"),
        ("residual_traction", 1.5, r"must lie in \[-1, 1\], got 1.5"),
        ("residual_traction", float("nan"), r"must lie in \[-1, 1\], got nan"),
    ],
)
def test_bad_parameters_are_named(field, value, message):
    from stickslip.errors import InputError

    given_values = {"k_t": 1.0, "k_w": 1.0, "k_n": 1.0, "mu": 0.3, field: value}
    with pytest.raises(InputError, match=f"ElasticCoulomb.{field}: {message}"):
        ElasticCoulomb(**given_values)


def test_a_contact_without_stiffness_is_refused():
    from stickslip.errors import InputError

    with pytest.raises(InputError, match="all contact stiffnesses are zero"):
        ElasticCoulomb(k_t=0.0, k_w=0.0, k_n=0.0, mu=0.3)
