"""Influence coefficients: transform, interpolation, sign and direction against a fluid of its own around the whole wheel."""

from dataclasses import replace

import lumped_fluid as fluid
import numpy as np
import pytest
from cyclic_models import random_sector

import stickslip as ss
from stickslip.harmonic.travelling import condense_side, condense_waves
from stickslip.model.matrices import lumped
from stickslip.reduction import (
    Feedback,
    InfluenceCoefficients,
    TunedWheel,
    cyclic_sector,
    from_phase_angles,
    reduced_wheel,
    to_phase_angles,
    travelling_wave,
    tuned_wheel,
)
from stickslip.reduction.tuned import conjugate
from stickslip.response.stability.hill_method.hill_modes import hill_modes
from stickslip.response.time.sectors import all_sectors
from stickslip.units import RPM

RNG = np.random.default_rng(5)
SECTORS = 5


def table(patterns=2, frequencies=(80.0, 100.0, 130.0), distances=(-1, 0, 1), **more):
    shape = (1, len(frequencies), len(distances), patterns, patterns)
    values = RNG.standard_normal(shape) + 1j * RNG.standard_normal(shape)
    return InfluenceCoefficients(np.array(distances), values, np.array(frequencies), **more)


def test_disturbances_feel_the_table_where_it_depends_on_the_frequency_and_the_frozen_form_elsewhere():
    """Coefficients of one frequency hold as stiffness and dashpot at all; those of a table take their place at each."""
    structure = lumped(np.array([1.0, 2.0, 3.0]), np.diag([4.0, 5.0, 6.0]) + 0.5, 0.02 * np.eye(3))
    pattern, no_contact = np.array([[1.0], [0.5], [-0.2]]), np.zeros((0, 3))

    def modes(feedback):
        return hill_modes(structure, no_contact, np.zeros(0), np.zeros(0, dtype=int), 1.5, feedback)

    one = InfluenceCoefficients([0], np.array([0.3 + 0.2j]).reshape(1, 1, 1, 1, 1))
    two = InfluenceCoefficients([0], np.array([0.3 + 0.2j, 0.5 + 0.6j]).reshape(1, 2, 1, 1, 1), np.array([1.0, 4.0]))
    places = [0.1 + 1j, 2j, -0.2 + 2.5j]
    plain, frozen, table = (modes(own and Feedback(pattern, 0.0, own, 1.0)) for own in (None, one, two))
    more = []
    for z in places:
        np.testing.assert_array_equal(frozen.dynamic(z, 1.0), plain.dynamic(z, 1.0))
        np.testing.assert_array_equal(frozen.diagonal(z, 1.0), plain.diagonal(z, 1.0))
        # table less frozen form at 1.5 Im z; the frozen form is 0.3 + 0.2 s in the exponent s = 1.5 z
        share = (1.5 * z.imag - 1.0) / 3.0
        felt = (0.3 + 0.2 * share) + 1j * (0.2 + 0.4 * share) - 0.3 - 0.2 * 1.5 * z
        more.append((plain.dynamic(z, 1.0) - table.dynamic(z, 1.0)) / felt)
    for own in more:
        assert np.linalg.matrix_rank(own, tol=1e-12) == 1
        np.testing.assert_allclose(own, more[0], atol=1e-14)


def test_the_transform_leads_both_ways_and_angles_may_come_in_any_order():
    angles = 2 * np.pi * np.arange(7) / 7
    of_waves = RNG.standard_normal((7, 2, 2)) + 1j * RNG.standard_normal((7, 2, 2))
    order = RNG.permutation(7)
    signed = np.where(angles > np.pi, angles - 2 * np.pi, angles)
    distances, values = from_phase_angles(signed[order], of_waves[order], sectors=12)
    assert distances.tolist() == [-3, -2, -1, 0, 1, 2, 3]
    np.testing.assert_allclose(to_phase_angles(distances, values, angles), of_waves, atol=1e-14)
    # by hand: sector n feels sector n + j, which leads by jθ
    by_hand = sum(values[i] * np.exp(1j * j * 0.7) for i, j in enumerate(distances))
    own = InfluenceCoefficients(distances, values[None, None])
    np.testing.assert_allclose(own.of_wave(0.7, 3.0), by_hand, atol=1e-14)
    with pytest.raises(ss.InputError, match="not spread evenly"):
        from_phase_angles(angles[:-1], of_waves[:-1])
    with pytest.raises(ss.InputError, match="7 of them on 6 sectors"):
        from_phase_angles(angles, of_waves, sectors=6)


def test_between_the_rows_of_the_table_and_outside_of_it():
    own = table()
    for i, omega in enumerate(own.frequencies):
        np.testing.assert_allclose(own.at(omega), own.values[0, i], rtol=1e-14)
    step = 1e-4
    for omega in (85.0, 99.9, 100.0, 117.0):
        differences = (own.at(omega + step) - own.at(omega - step)) / (2 * step)
        np.testing.assert_allclose(own.slope(omega), differences, atol=1e-4)
    with pytest.raises(ss.InputError, match=r"12\.7324 to 20\.6901 Hz, asked for 23\.8732 Hz") as told:
        own.at(150.0)
    assert "nearest" in told.value.remedy
    held = replace(own, beyond="nearest")
    np.testing.assert_array_equal(held.at(150.0), held.at(130.0))
    # what holds beyond the table or at any frequency does not change, in each coefficient
    constant = InfluenceCoefficients(own.distances, own.values[:, :1])
    for flat in (held, constant):
        assert flat.slope(150.0).shape == flat.at(150.0).shape
        assert flat.slope_of_wave(0.7, 150.0).shape == flat.of_wave(0.7, 150.0).shape
        assert not flat.slope(150.0).any()
        assert not flat.slope_of_wave(0.7, 150.0).any()
    speeds = InfluenceCoefficients([0], np.array([1.0, 3.0 - 2j]).reshape(2, 1, 1, 1, 1), speeds=np.array([1.0, 2.0]))
    assert speeds.at_speed(1.25).at(7.0).item() == pytest.approx(1.5 - 0.5j)
    with pytest.raises(ss.InputError, match="turns at"):
        speeds.at_speed(3.0 * RPM)
    with pytest.raises(ss.InputError, match="several speeds"):
        speeds.at(7.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"distances": [0, 0, 1]}, "neighbour twice"),
        ({"distances": [0, 1]}, "has shape"),
        ({"frequencies": [3.0, 2.0, 5.0]}, "ascend"),
        ({"values": np.full((1, 3, 3, 2, 2), np.nan)}, "NaN"),
    ],
)
def test_what_is_no_table_is_refused(change, words):
    with pytest.raises(ss.InputError, match=words):
        replace(table(), **change)


def random_wheel(frequencies=(1.0, 1.5, 9.0)):
    """A wheel of random sectors with forces of two patterns that no symmetry has, and all its waves."""
    sector = cyclic_sector(random_sector(SECTORS, 3), SECTORS)
    influence = table(2, frequencies, (-2, -1, 0, 1, 2), beyond="nearest")
    influence = replace(influence, values=0.05 * influence.values)
    patterns = RNG.standard_normal((sector.structure.n, 2))

    def feedback(k, wave):
        return Feedback(wave.project(patterns), 2 * np.pi * k / SECTORS, influence, 1.2)

    waves = {k: travelling_wave(sector, k) for k in range(SECTORS)}
    forces = {k: feedback(k, own) for k, own in waves.items()}
    return sector, waves, forces, feedback


def test_the_frozen_force_is_that_of_the_reference_and_its_wheel_is_real():
    sector, waves, forces, feedback = random_wheel()
    omega = 1.2
    for k, own in forces.items():
        frozen = own.frozen(waves[k])
        plain, with_force = (s.stiffness + 1j * omega * s.damping for s in (waves[k], frozen))
        exact = own.patterns @ own.force(omega) @ own.patterns.conj().T
        np.testing.assert_allclose(with_force, plain.toarray() - exact, atol=1e-13)
        back = forces[-k % SECTORS].frozen(waves[-k % SECTORS])
        np.testing.assert_allclose(back.stiffness, frozen.stiffness.conj(), atol=1e-13)
        # neither the force nor its frozen form is Hermitian, nor are those of both directions alike
        assert np.abs(frozen.stiffness - frozen.stiffness.conj().T).max() > 1e-2
        assert k == 0 or np.abs(own.force(omega) - forces[-k % SECTORS].force(omega)).max() > 1e-2
    keep = sector.structure.dof_set("inner")
    keep = np.setdiff1d(keep, sector.high)
    n_modes = sector.independent.size - keep.size
    wheel = reduced_wheel(sector, keep, n_modes, feedback=feedback)
    assert not wheel.structure.is_complex
    by_sector = np.sort_complex(np.linalg.eigvals(np.linalg.solve(wheel.structure.mass, wheel.structure.stiffness)))
    by_wave = np.concatenate(
        [np.linalg.eigvals(np.linalg.solve(w.mass.toarray(), forces[k].frozen(w).stiffness)) for k, w in waves.items()]
    )
    for value in by_wave:
        assert np.abs(by_sector - value).min() < 1e-9 * np.abs(by_wave).max()


def test_the_balance_takes_the_coefficients_at_the_frequency_of_each_harmonic():
    """Against the full dynamic stiffness of each wave, and by differences; wave 4 of harmonic 2 is no mirror of wave 1."""
    _, waves, forces, _ = random_wheel()
    order, high = 2, 3
    wheel = TunedWheel({k: waves[k] for k in (0, 2, 4, 1)}, SECTORS, order, high)
    wheel = wheel.with_aerodynamics({k: forces[k] for k in wheel.waves})
    n = wheel.n
    load = ss.HarmonicLoad(RNG.standard_normal(n), {1: RNG.standard_normal(n) + 1j * RNG.standard_normal(n)})
    retained = np.array([1, 4, 7])
    side = condense_side(wheel, retained, load, high)
    omega = 1.07
    found = side.condensed(omega, high)
    for h, k in enumerate((0, 2, 4, 1)):
        own, force = waves[k], forces[k]
        K, C, M = (m.toarray() for m in (own.stiffness, own.damping, own.mass))
        if h:
            G = force.patterns @ force.force(h * omega) @ force.patterns.conj().T
            D = K + 1j * h * omega * C - (h * omega) ** 2 * M - G
        else:
            D = force.frozen(own).stiffness.real
        rest = np.setdiff1d(np.arange(n), retained)
        a, b = np.ix_(retained, rest), np.ix_(rest, retained)
        condensed = D[np.ix_(retained, retained)] - D[a] @ np.linalg.solve(D[np.ix_(rest, rest)], D[b])
        np.testing.assert_allclose(found.stiffness[h], condensed, atol=1e-11 * np.abs(D).max())
    step = 1e-5
    there, back = (side.condensed(omega + d, high) for d in (step, -step))
    for value, slope in (("stiffness", "derivative"), ("load", "load_derivative")):
        differences = (getattr(there, value) - getattr(back, value)) / (2 * step)
        scale = np.abs(differences).max()
        assert np.abs(getattr(found, slope) - differences).max() < 1e-7 * scale
    # what the frozen form alone would be is another answer: the table counts
    frozen = condense_waves(side.waves.structures, retained, load).condensed(omega, high)
    assert np.abs(frozen.stiffness - found.stiffness).max() > 1e-3 * np.abs(found.stiffness).max()
    # the strain energy is that of the structure
    q = RNG.standard_normal((high + 1, 3)) + 1j * RNG.standard_normal((high + 1, 3))
    q[0] = q[0].real
    x = side.recover(omega, q)
    energy = side.strain_energy(omega, q)
    for h, k in enumerate((0, 2, 4, 1)):
        share = 0.25 if h else 0.5
        own = share * (x[h].conj() @ waves[k].stiffness @ x[h]).real
        assert energy[h] == pytest.approx(own, rel=1e-9)


def lumped_wheel(influence, reference):
    """The judge's disk as one sector, its blades under the force of the coefficients, engine order 1."""
    ground, ring, blade = fluid.SPRINGS
    K = np.diag([ground + ring + blade, blade, ring])
    K[0, 1] = K[1, 0] = -blade
    K[0, 2] = K[2, 0] = -ring
    M = np.diag([*fluid.MASSES, 0.0])
    dofs = ss.model.lumped(np.ones(3), np.eye(3)).dofs
    structure = ss.Structure(M, fluid.LOSS * K, K, dofs)
    sector = ss.reduction.CyclicSector(structure, fluid.BLADES, np.array([0]), np.array([2]), axis=None)
    gaps = np.zeros((3, 3))
    gaps[0, fluid.BLADE] = 1.0
    wheel, operator = tuned_wheel(sector, 1, 3, (gaps, None), relative=False)
    pattern = np.zeros((3, 1))
    pattern[fluid.BLADE] = 1.0
    feedback = {
        k: Feedback(wave.project(pattern), 2 * np.pi * k / fluid.BLADES, influence, reference)
        for k, wave in wheel.waves.items()
    }
    return wheel, wheel.with_aerodynamics(feedback), operator


def of_one_moved_blade(omega):
    """Coefficients as a user records them: blade 0 is moved, the force on blade p is that of the neighbour j = −p."""
    force = fluid.recorded_in_time(omega)
    j = -np.arange(fluid.BLADES)
    return InfluenceCoefficients(np.where(j < -fluid.BLADES // 2, j + fluid.BLADES, j), force.reshape(1, 1, -1, 1, 1))


def eigenvalue_near(structure, place):
    """Return the eigenvalue of a wave of disk and blade that is nearest to a place."""
    M, C, K = (np.asarray(m)[:2, :2] for m in (structure.mass, structure.damping, structure.stiffness))
    inverse = np.linalg.inv(M)
    values = np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ K, -inverse @ C]]))
    return values[np.argmin(np.abs(values - place))]


@pytest.mark.parametrize("number", range(fluid.BLADES))
def test_each_wave_decays_as_on_the_whole_wheel_with_its_fluid(number):
    """Coefficients recorded at the frequency of the mode: sign and direction come from the whole wheel, which knows neither."""
    exact = fluid.modes_of_wave(number)[-1]
    bare, wheel, _ = lumped_wheel(of_one_moved_blade(exact.imag), exact.imag)
    # harmonics 0 to 3 have the waves 0 to 3; the others are their conjugates
    mirrored = number > fluid.BLADES // 2
    waves = [one.waves[fluid.BLADES - number if mirrored else number] for one in (bare, wheel)]
    waves = [conjugate(own) for own in waves] if mirrored else waves
    structural, ours = (eigenvalue_near(own, exact) for own in waves)
    assert abs(exact.real - structural.real) > 1e-4
    # frozen at iω instead of at λ: second order in the force
    # frozen at iω instead of at λ, which the structure's damping alone moves by 5e-3
    assert ours.real - structural.real == pytest.approx(exact.real - structural.real, rel=0.02, abs=1e-5)
    assert ours.imag == pytest.approx(exact.imag, abs=2e-5)


def test_all_sectors_in_time_have_the_waves_of_both_directions():
    """Real matrices of the whole wheel, unsymmetric, without a mirror of k and −k: all the judge's eigenvalues at once."""
    reference = 2.2
    _, wheel, operator = lumped_wheel(of_one_moved_blade(reference), reference)
    contacts = ss.Interface(("rub",), (ss.Jenkins(k_t=1.0, limit=1.0),), operator)
    load = ss.HarmonicLoad(np.zeros(wheel.n), {1: wheel.project(np.array([0.0, 1.0, 0.0]), 1)})
    whole = all_sectors(ss.System(wheel, contacts, np.arange(2)), load)
    s = whole.structure
    assert np.abs(s.stiffness - s.stiffness.T).max() > 1e-4
    inverse = np.linalg.inv(s.mass)
    zero, one = np.zeros_like(inverse), np.eye(len(inverse))
    values = np.linalg.eigvals(np.block([[zero, one], [-inverse @ s.stiffness, -inverse @ s.damping]]))
    blades = [fluid.modes_of_wave(k)[-1] for k in range(fluid.BLADES)]
    for exact in blades:
        near = values[np.argmin(np.abs(values - exact))]
        assert near.imag == pytest.approx(exact.imag, abs=1e-4)
        assert near.real == pytest.approx(exact.real, rel=0.03)
    assert abs(blades[1].real - blades[5].real) > 1e-3  # else a mirror would pass
