"""Relative coordinates: the same answers with half the unknowns."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from cyclic_models import random_sector
from models import solved, table

from evidence.models.lumped import blades_and_damper
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Structure
from stickslip.reduction.contact_coordinates import in_relative_coordinates
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.response.system import System


def two_flexible_bodies(n_contacts=3, seed=0, sparse=False):
    """Two grounded bodies of 3 n_contacts contact dofs and four others each, pressed together node to node in turned frames."""
    rng = np.random.default_rng(seed)
    own = 3 * n_contacts + 4
    n = 2 * own
    stiffness = np.zeros((n, n))
    for body in (slice(0, own), slice(own, n)):
        a = rng.standard_normal((own, own))
        stiffness[body, body] = 1e5 * (a @ a.T / own + 1.5 * np.eye(own))
    mass = np.diag(0.5 + rng.random(n))
    gap = np.zeros((3 * n_contacts, n))
    for c in range(n_contacts):
        frame = np.linalg.qr(rng.standard_normal((3, 3)))[0]
        gap[3 * c : 3 * c + 3, 3 * c : 3 * c + 3] = -frame.T
        gap[3 * c : 3 * c + 3, own + 3 * c : own + 3 * c + 3] = frame.T
    names = tuple(f"c{i}" for i in range(n_contacts))
    laws = (ElasticCoulomb(k_t=2e5, k_w=1e5, k_n=3e5, mu=0.3, preload=20.0),) * n_contacts
    structure = Structure(
        mass,
        1e-4 * stiffness,
        stiffness,
        table(tuple(f"d{i}" for i in range(n))),
        {"tips": np.array([own - 1, n - 1]), "contact": np.arange(3)},
    )
    if sparse:
        structure = replace(
            structure, **{k: scipy.sparse.csr_array(getattr(structure, k)) for k in ("mass", "damping", "stiffness")}
        )
    static = np.zeros(n)
    normals = gap[2::3]
    static -= 20.0 * normals.sum(axis=0)
    shake = np.zeros(n, dtype=complex)
    shake[[own - 1, n - 2]] = 150.0, 100.0j
    load = HarmonicLoad(static, {1: shake})
    return System(structure, Interface(names, laws, gap), np.arange(n)), load


def relative(system, load):
    structure, gap = in_relative_coordinates(system.structure, system.interface.gap_operator, system.interface.names)
    basis = structure.basis
    load = HarmonicLoad(basis.T @ load.static, {h: basis.T @ f for h, f in load.harmonics.items()})
    interface = replace(system.interface, gap_operator=gap)
    return System(structure, interface, np.arange(structure.n)), load


def test_both_coordinates_give_the_same_response_and_relative_ones_halve_the_unknowns():
    system, load = two_flexible_bodies()
    other, other_load = relative(system, load)
    omega = 330.0
    a, at_a = solved(system, load, omega)
    b, at_b = solved(other, other_load, omega)
    assert b.size * 2 == a.size
    states = a.contacts(at_a.x, omega).state
    assert set(np.unique(states)) >= {0, 1}, "the contacts should slip"
    nodal = a.linear.recover(omega, a.coefficients(at_a.x))
    back = other.structure.expand(b.linear.recover(omega, b.coefficients(at_b.x)).T).T
    assert np.max(np.abs(back - nodal)) < 1e-10 * np.max(np.abs(nodal))
    np.testing.assert_array_equal(states, b.contacts(at_b.x, omega).state)


def test_transform_inverts_the_gap_operator_and_keeps_untouched_dofs():
    system, _ = two_flexible_bodies()
    structure, gap = in_relative_coordinates(system.structure, system.interface.gap_operator)
    np.testing.assert_allclose(system.interface.gap_operator @ structure.basis, gap, atol=1e-14)  # B L = [I 0]
    assert np.linalg.cond(structure.basis) < 3.0  # invertible, and well
    assert np.array_equal(np.flatnonzero(gap.any(axis=0)), structure.sets["gaps"])
    tips = structure.sets["tips"]
    assert [structure.dofs.labels[i] for i in tips] == [
        system.structure.dofs.labels[i] for i in system.structure.sets["tips"]
    ]
    assert "contact" not in structure.sets  # a set of dofs that are gone
    assert structure.dofs.labels[0] == "1.gap_t"
    assert structure.sets["rest"].size == system.interface.gap_operator.shape[0]


def test_local_blocks_are_the_pseudo_inverse_of_the_whole():
    system, _ = two_flexible_bodies(n_contacts=4)
    structure, _ = in_relative_coordinates(system.structure, system.interface.gap_operator)
    gaps = structure.sets["gaps"]
    np.testing.assert_allclose(
        structure.basis[:, gaps], np.linalg.pinv(system.interface.gap_operator.toarray()), atol=1e-13
    )


def test_sparse_structures_stay_sparse_and_reduce_on_their_gaps():
    system, _ = two_flexible_bodies(sparse=True)
    structure, gap = in_relative_coordinates(system.structure, system.interface.gap_operator)
    assert scipy.sparse.issparse(structure.mass)
    reduced = craig_bampton(structure, structure.sets["gaps"], structure.n - gap.shape[0])
    dense, _ = relative(*two_flexible_bodies())
    full = dense.structure
    np.testing.assert_allclose(
        np.sort(np.linalg.eigvals(np.linalg.solve(reduced.mass, reduced.stiffness)).real),
        np.sort(np.linalg.eigvals(np.linalg.solve(full.mass, full.stiffness)).real),
        rtol=1e-8,
    )
    assert reduced.expand(np.zeros(reduced.n)).shape == (system.structure.n,)


def test_directions_without_a_gap_get_no_coordinate():
    system, load = blades_and_damper()  # planar: no w direction
    other, other_load = relative(system, load)
    assert other.structure.sets["gaps"].size == 4
    assert other.interface.gap_operator[1::3].nnz == 0
    omega = 2 * np.pi * 160
    a, at_a = solved(system, load, omega)
    free = replace(other, free=None)
    b, at_b = solved(free, other_load, omega, start=np.zeros((4, 4)))
    assert (a.linear.n, b.linear.n) == (6, 4)  # the damper of two coordinates follows its gaps
    nodal = a.linear.recover(omega, a.coefficients(at_a.x))
    back = other.structure.expand(b.linear.recover(omega, b.coefficients(at_b.x)).T).T
    assert np.max(np.abs(back - nodal)) < 1e-8 * np.max(np.abs(nodal))


def test_dependent_gaps_are_refused_by_name():
    system, _ = two_flexible_bodies()
    gap = system.interface.gap_operator.toarray()
    gap[6:9] = gap[3:6]  # the third contact lies on the second
    with pytest.raises(InputError, match=r"gaps of contacts c1, c2 depend on each other.*6 gaps of which 3"):
        in_relative_coordinates(system.structure, gap, system.interface.names)


def test_wrong_shape_is_refused():
    system, _ = two_flexible_bodies()
    with pytest.raises(InputError, match="gap_operator: has shape"):
        in_relative_coordinates(system.structure, np.zeros((4, system.structure.n)))


def test_no_contacts_leave_the_structure_as_it_is():
    system, _ = two_flexible_bodies()
    structure, gap = in_relative_coordinates(system.structure, np.zeros((0, system.structure.n)))
    np.testing.assert_allclose(structure.stiffness, system.structure.stiffness)
    assert gap.shape == (0, system.structure.n)


def test_a_travelling_wave_keeps_its_waves_in_relative_coordinates():
    """Contacts between neighbours: the gap operator has the neighbour's phase, the spectrum stays, gaps are exact."""
    sector = cyclic_sector(random_sector(5, 3, inner=4), 5)
    wave = travelling_wave(sector, 2)
    contact = wave.dof_set("inner")
    phase = np.exp(2j * np.pi * 2 / 5)
    gap = np.zeros((6, wave.n), dtype=complex)
    gap[np.arange(6), contact[:6]] = phase
    gap[np.arange(6), contact[6:12]] = -1.0
    structure, operator = in_relative_coordinates(wave, gap)
    K, M = (m.toarray() for m in (structure.stiffness, structure.mass))
    assert abs(K - K.conj().T).max() == 0.0
    before = scipy.linalg.eigvalsh(wave.stiffness.toarray(), wave.mass.toarray())
    np.testing.assert_allclose(scipy.linalg.eigvalsh(K, M), before, rtol=1e-10)
    state = np.random.default_rng(0).standard_normal((structure.n, 2)) @ [1.0, 1.0j]
    own = np.linalg.lstsq(wave.basis.toarray(), structure.expand(state))[0]
    np.testing.assert_allclose(gap @ own, operator @ state, atol=1e-12)
    # a skew damping matrix stays skew: it is that of Coriolis forces
    C = wave.damping.toarray()
    L = np.linalg.lstsq(wave.basis.toarray(), structure.basis.toarray())[0]
    np.testing.assert_allclose(structure.damping.toarray(), L.conj().T @ C @ L, atol=1e-13)
