"""Cyclic faces whose meshes do not match, tied in the mean."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.optimize
import scipy.sparse
import scipy.special
from cyclic_models import unlike_wedge
from newton_bounds import allowed
from test_assembly_wheel import answered

from evidence.models.annulus import annular_sector
from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.forces import Load, Output
from stickslip.assembly.joints.cyclic_faces import _face, unlike_faces
from stickslip.assembly.model import Model
from stickslip.assembly.sides.mistuning import BladeMistuning, Mistuning
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.damping import Damping
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.facets import lumped_areas
from stickslip.model.mesh.solid_mesh import SolidMesh, facets_of
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import solid_part
from stickslip.reduction.choice import Reduction
from stickslip.reduction.cyclic import travelling_wave
from stickslip.reduction.full_wheel import wheel
from stickslip.response.system import System

STEEL = Material()
IN_THE_MEAN = "segment_to_segment"
SECTORS = 6


def ring(mesh, sectors=SECTORS, clamped=(), **others):
    return Model(
        parts={"ring": solid_part(mesh, STEEL, clamped=clamped, sectors=sectors, cyclic=IN_THE_MEAN)}, **others
    )


def squares(structure):
    """Return the lowest squares of angular frequencies, rad²/s²."""
    pair = structure.stiffness.toarray(), structure.mass.toarray()
    return scipy.linalg.eigh(*pair, eigvals_only=True)


@pytest.fixture(scope="module")
def free():
    return ring(unlike_wedge(SECTORS, (3, 2), (2, 3)))


def test_a_free_ring_has_its_rigid_motions_and_no_others(free):
    """Two each of the waves 0, 1 and −1: along and about the axis; across it. No other wave has any."""
    for k, rigid in ((0, 2), (1, 2), (5, 2), (2, 0), (3, 0), (4, 0)):
        found = squares(free.at(0.0, k))
        assert np.abs(found[:rigid]).max(initial=0) < 1e-9 * found[6]
        assert found[rigid] > 1e-4 * found[6]


def test_a_constant_stress_passes_the_faces(free):
    """Homogeneous stresses that are waves 0, 1 and 2: the tractions on both cut faces cancel, and the linear fields are among the waves' motions."""
    part = free.parts["ring"]
    mesh, pitch = part.mesh, 2 * np.pi / SECTORS
    whirl = np.array([[0, 0, 1], [0, 0, 1j], [1, 1j, 0]])
    shear = np.array([[1, 1j, 0], [1j, -1, 0], [0, 0, 0]])
    for k, stress in ((0, np.diag([1.0, 1.0, -0.4])), (1, whirl), (2, shear)):
        turn, phase = part.axis.rotation(pitch), np.exp(1j * k * pitch)
        np.testing.assert_allclose(turn @ stress @ turn.T, stress / phase, atol=1e-12)
        structure = free.at(0.0, k)
        force = np.zeros(3 * len(mesh.points), dtype=complex)
        for side in ("low", "high"):
            facets = facets_of(mesh, mesh.node_sets[f"cyclic_{side}"])
            corners = mesh.points[facets[:, :3]]
            area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
            for middle in facets[:, 3:].T:  # the shape functions of corners have no mean
                np.add.at(force.reshape(-1, 3), middle, area @ stress.T / 3)
        assert np.abs(structure.basis.conj().T @ force).max() < 1e-9 * np.abs(force).max()
        field = (mesh.points @ stress.T).ravel()
        components = np.array(["xyz".index(c) for c in structure.dofs.component])
        motion = field[3 * structure.dofs.node + components]
        np.testing.assert_allclose(structure.basis @ motion, field, atol=1e-12)


@pytest.mark.validation
def test_frequencies_converge_to_the_torsion_of_the_free_ring_and_to_those_of_a_matching_mesh():
    """Torsion of wave 0 in closed form: J2(κa) Y2(κb) = J2(κb) Y2(κa), ω² = κ² G/ρ."""
    a, b = 0.5, 1.0

    def free_of_shear(kappa):
        J, Y = scipy.special.jv, scipy.special.yv
        return J(2, kappa * a) * Y(2, kappa * b) - J(2, kappa * b) * Y(2, kappa * a)

    kappa = scipy.optimize.brentq(free_of_shear, 5.0, 8.0)
    G = STEEL.young_modulus / 2 / (1 + STEEL.poisson_ratio)
    torsion = kappa * np.sqrt(G / STEEL.density) / (2 * np.pi)
    matching = annular_sector(a, b, 0.2, sectors=SECTORS, divisions=(6, 3, 3))
    same = Model(parts={"ring": solid_part(matching, STEEL, clamped=(), sectors=SECTORS)})
    errors = []
    for low, high, around in (((2, 1), (3, 2), 2), ((4, 2), (5, 3), 4)):
        model = ring(unlike_wedge(SECTORS, low, high, around=around))
        found = np.sqrt(np.abs(squares(model.at(0.0, 0)))) / (2 * np.pi)
        flexure, expected = (natural_frequencies(m.at(0.0, 2), 3) for m in (model, same))
        errors.append([np.abs(found / torsion - 1).min(), *np.abs(flexure / expected - 1)])
    assert np.max(errors[0]) < 0.2
    assert np.all(np.array(errors[1]) < 0.45 * np.array(errors[0]))
    assert np.max(errors[1]) < 0.012


def mirrored(mesh):
    """Return the mesh mirrored at the plane y = 0, with the cyclic faces exchanged."""
    sets = dict(mesh.node_sets)
    sets["cyclic_low"], sets["cyclic_high"] = sets["cyclic_high"], sets["cyclic_low"]
    order = [1, 0, 2, 3, 4, 6, 5, 8, 7, 9]
    return SolidMesh(mesh.points * [1, -1, 1], mesh.cells[:, order], sets)


@pytest.mark.parametrize("ahead", [1, -1])
def test_which_face_follows_changes_little(ahead):
    """The finer face follows: the mirrored mesh has the same frequencies, and the coarser face as follower moves them by less than 1 %."""
    mesh = unlike_wedge(SECTORS, (4, 3), (3, 2), clamp=True)
    part, other = (ring(m, clamped=("root",)).parts["ring"] for m in (mesh, mirrored(mesh)))
    assert (unlike_faces(part).ahead, unlike_faces(other).ahead) == (-1, 1)
    one, two = (natural_frequencies(travelling_wave(unlike_faces(p), 2), 5) for p in (part, other))
    np.testing.assert_allclose(two, one, rtol=1e-9)
    forced = natural_frequencies(travelling_wave(unlike_faces(part, ahead), 2), 5)
    assert (ahead < 0) == (np.abs(forced / one - 1).max() < 1e-9)
    assert np.abs(forced / one - 1).max() < 0.01


@pytest.mark.parametrize(("low", "high"), [((2, 2), (3, 1)), ((3, 2), (2, 1))])
def test_the_waves_of_a_turning_wheel_have_all_frequencies_of_the_whole(low, high):
    """Centrifugal stiffness and Coriolis forces at speed; clamped nodes on the faces."""
    model = ring(unlike_wedge(5, low, high, clamp=True), 5, ("root",), speed=300.0)
    sector = model.neighbours.sector(model.full(300.0), model.coordinates)
    assert sector.weights is not None
    whole = natural_frequencies(wheel(sector), 15)
    waves = np.concatenate([natural_frequencies(model.at(300.0, k), 15) for k in range(5)])
    np.testing.assert_allclose(np.sort(waves)[:15], whole, rtol=1e-9)


@pytest.mark.parametrize(("low", "high"), [((1, 1), (2, 1)), ((2, 1), (1, 1))])
def test_friction_on_a_turning_sector_is_that_of_the_whole_wheel(low, high):
    """Contacts on the rim, nodes of both faces among them; rotation with Coriolis forces, slip; reduced and not."""
    law = ElasticCoulomb(k_t=2e7, k_w=2e7, k_n=4e7, mu=0.3, preload=300.0)
    order, speed = 2, 300.0
    mesh = unlike_wedge(5, low, high, clamp=True)
    rim = mesh.node_sets["rim"]
    mesh = replace(mesh, node_sets={**mesh.node_sets, "tip": rim[np.abs(mesh.points[rim, 1]) < 1e-9][:1]})
    model = ring(
        mesh,
        5,
        ("root",),
        contacts={"rim": Contact(between=("ring.rim", "ground"), law=law)},
        loads={"gas": Load(on="ring.tip", newton=2.5e5, direction=(0.3, 0.2, 1), engine_order=order)},
        outputs=(Output(name="tip", on="ring.tip"),),
        speed=speed,
        coriolis=True,
    )
    damped = replace(model.parts["ring"], damping=Damping(ratio=0.003, between_hz=(300, 3000)))
    model = replace(model, parts={"ring": damped})
    found = assemble(model, 3)

    full = damped.damping.of_matrices(model.full(speed), damped.structure.stiffness)
    n = full.n
    sector = model.neighbours.sector(replace(full, basis=scipy.sparse.eye_array(n, format="csr")), model.coordinates)
    whole = wheel(sector)
    own = [whole.basis[i * n : (i + 1) * n] for i in range(5)]
    steady = full.stiffness @ model.steady["ring"].displacement(damped, speed)
    force = np.zeros(n, dtype=complex)
    at = [
        int(np.flatnonzero((full.dofs.node == mesh.node_sets["tip"][0]) & (np.array(full.dofs.component) == c))[0])
        for c in "xyz"
    ]
    force[at] = 2.5e5 * np.array([0.3, 0.2, 1]) / np.linalg.norm([0.3, 0.2, 1])
    phases = np.exp(2j * np.pi * order * np.arange(5) / 5)
    load = HarmonicLoad(
        sum(m.T @ steady for m in own), {1: sum(p * (m.T @ force) for p, m in zip(phases, own, strict=True))}
    )
    gaps = scipy.sparse.vstack([model.pairs.own @ m for m in own], format="csr")
    points = len(model.pairs.names)
    names = tuple(f"{s}.{i}" for s in range(5) for i in range(points))
    seen = own[0][at].indices
    system = System(replace(whole, basis=None), Interface(names, (law,) * len(names), gaps), seen)
    hertz = (560.0, 600.0)
    mine, theirs = answered(found.system, found.load, hertz), answered(system, load, hertz)
    for one, every in zip(mine, theirs, strict=True):
        assert one.energy.max() > 1e-4  # else nothing slips
        assert np.abs(one.outputs - every.outputs).max() <= allowed("outputs", one, every)

    few = assemble(replace(model, parts={"ring": replace(damped, reduction=Reduction(12))}), 3)
    for one, every in zip(answered(few.system, few.load, hertz), mine, strict=True):
        assert np.abs(one.outputs - every.outputs).max() < 0.01 * np.abs(every.outputs).max()


def test_a_mistuned_wheel_and_its_mirror_image_have_the_same_frequencies():
    """Either face follows; deviations of a set with the leading face, and contacts to which both faces belong."""
    deviations = np.array([0.02, -0.03, 0.05, 0.0, -0.01])
    law = ElasticCoulomb(k_t=2e7, k_w=2e7, k_n=4e7, mu=0.3, preload=300.0)
    found = []
    mesh = unlike_wedge(5, (2, 1), (1, 1), clamp=True)
    for of, follows, values in (
        (mesh, "low", deviations),
        (mirrored(mesh), "high", np.roll(deviations[::-1], 1)),
    ):
        outer = np.flatnonzero(np.linalg.norm(of.points[:, :2], axis=1) > 0.6)
        outer = np.setdiff1d(outer, of.node_sets[f"cyclic_{follows}"])
        model = ring(
            replace(of, node_sets={**of.node_sets, "outer": outer}),
            5,
            ("root",),
            contacts={"rim": Contact(between=("ring.rim", "ground"), law=law)},
            outputs=(Output(name="tip", on="ring.outer"),),
            mistuning=Mistuning(blades={"b": BladeMistuning(of="ring.outer", deviations=values)}),
        )
        wheel = assemble(model, 1)
        found.append(natural_frequencies(wheel.bare.stuck_structure(), 12))
    np.testing.assert_allclose(found[1], found[0], rtol=1e-8)
    assert np.diff(found[0])[:5].max() > 1.0  # pairs of waves are split


def test_clamped_facets_beside_a_cut_face_do_not_belong_to_it():
    """The low face has its edge of the clamped surface, free; the high one lacks it, clamped."""
    mesh = unlike_wedge(SECTORS, (3, 2), (2, 2), clamp=True)
    angle = np.arctan2(mesh.points[:, 1], mesh.points[:, 0]) + np.pi / SECTORS
    low = np.flatnonzero(np.abs(angle) < 1e-9)
    root = np.setdiff1d(mesh.node_sets["root"], low)
    mesh = replace(mesh, node_sets={**mesh.node_sets, "cyclic_low": low, "root": root})
    part = ring(mesh, clamped=("root",)).parts["ring"]
    (surface, _), (other, _) = (_face(part, name) for name in part.faces)
    assert np.abs(np.arctan2(surface.points[:, 1], surface.points[:, 0]) + np.pi / SECTORS).max() < 1e-9
    assert np.abs(np.arctan2(other.points[:, 1], other.points[:, 0]) - np.pi / SECTORS).max() < 1e-9
    areas = [lumped_areas(side.points, side.facets).sum() for side in (surface, other)]
    np.testing.assert_allclose(areas, 0.5 * 0.2, rtol=1e-9)
    assert unlike_faces(part).ahead == -1


def test_a_join_with_the_next_sector_ties_the_same_faces(free):
    part = replace(free.parts["ring"], solid=None)
    sets = {name.replace("cyclic_", ""): nodes for name, nodes in part.mesh.node_sets.items()}
    bare = replace(part.structure, sets={})
    unpaired = replace(part, mesh=replace(part.mesh, node_sets=sets), structure=bare)
    tied = Join(between=("ring.high", "next.ring.low"), pairing=IN_THE_MEAN)
    joined = Model(parts={"ring": unpaired}, joins={"cut": tied})
    for k in (0, 2):
        found, expected = (squares(m.at(0.0, k))[4:12] for m in (joined, free))
        np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_what_does_not_fit_is_named(free):
    part = free.parts["ring"]
    with pytest.raises(InputError, match='cyclic = "segment_to_segment"'):
        Model(parts={"ring": replace(part, cyclic="node_to_node")}).at(0.0)
    with pytest.raises(InputError, match=r"part\.ring: cyclic: needs a mesh"):
        Model(parts={"ring": replace(part, mesh=None, solid=None)}).at(0.0)
    with pytest.raises(InputError, match=r"have nothing of 'cyclic_low'|no facet of 'cyclic_low'"):
        Model(parts={"ring": replace(part, sectors=5)}).at(0.0)
    on_axis = unlike_wedge(SECTORS, (2, 1), (1, 2), inner=0.0)
    with pytest.raises(InputError, match="lies on the axis"):
        ring(on_axis).at(0.0)
