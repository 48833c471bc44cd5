"""The motion of all nodes with the static correction, against direct solutions of the unreduced model."""

import math
from dataclasses import replace

import numpy as np
import pytest
from test_assembly_wheel import ORDER, SECTORS, sector_model, shrouded_sector, whole_wheel

from stickslip.api.model import Model
from stickslip.assembly.forces import force_of
from stickslip.assembly.full_field import node_motion
from stickslip.assembly.part_reduction import at_speed, steady_load
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material
from stickslip.model.fe.stress import Neighbours, nodal_stress, stress_error
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.part import solid_part
from stickslip.reduction.choice import Reduction
from stickslip.study.exchange.chosen import chosen, point_of
from stickslip.study.exchange.motion import expanded

pytestmark = pytest.mark.usefixtures("peak_alone")
HZ = 500.0


@pytest.fixture(scope="module", params=[4, 12])
def solved_wheel(request):
    """A sector with shrouds that stick at speed, reduced with few modes: the model, its motion, and the motion of the unreduced one."""
    law = ElasticCoulomb(k_t=6e6, k_w=6e6, k_n=8e6, mu=0.5, preload=1e6)
    own = sector_model(shrouded_sector())
    blade = solid_part(
        own.parts["blade"].mesh,
        Material(),
        sectors=SECTORS,
        reduction=Reduction(request.param),
        damping=own.parts["blade"].damping,
    )
    contacts = {name: replace(c, law=law) for name, c in own.contacts.items()}
    loads = {name: own.loads[name] for name in ("gas", "lean")}
    model = Model(parts={"blade": blade}, contacts=contacts, loads=loads, outputs=own.outputs, speed=800.0)
    result = model.forced_response(
        (400.0, HZ, 600.0), low=1, high=1, selection="always_low", stability="off", peak_points=0
    )
    told = chosen(result.data, hz=HZ)
    whole, fields = expanded(told, model)
    found = node_motion(model, whole, fields, told.omega)["blade"]
    data = result["forced_response"]
    force = data["contact_force"].values[point_of(data, 0, HZ), 0, :, :, 0].ravel()
    return model, found, (_still(model, force), _driven(model))


def _driven(model):
    full = model.at(model.speed, ORDER, "stuck", with_damping=True)
    omega = 2 * math.pi * HZ
    force = full.project(sum(force_of(model.places, n, load) for n, load in model.loads.items() if load.harmonic))
    matrix = full.stiffness + 1j * omega * full.damping - omega**2 * full.mass
    return full.expand(np.linalg.solve(matrix.toarray(), force))


def _still(model, contact_force):
    full, part = model.at(model.speed, 0), model.parts["blade"]
    rest = model.steady["blade"]
    load = steady_load(part, model.spin(model.speed), at_speed("blade", part, model.spin(model.speed), rest), rest)
    load = load - (model.pairs.own + model.pairs.following).T @ contact_force
    load = load + sum(force_of(model.places, n, own) for n, own in model.loads.items() if not own.harmonic)
    return full.expand(np.linalg.solve(full.stiffness.toarray(), full.project(load)))


def test_the_static_motion_is_that_of_the_unreduced_model(solved_wheel):
    model, found, (still, _) = solved_wheel
    wanted = (model.parts["blade"].solid.onto @ still.real).reshape(-1, 3)
    size = np.abs(wanted).max()
    assert np.abs(found.reduced[0] - wanted).max() > 1e-5 * size
    assert np.abs(found.whole[0] - wanted).max() < 1e-9 * size


def test_the_vibration_comes_nearer_to_that_of_the_unreduced_model(solved_wheel):
    """The error falls with the square of the frequency over that of the first omitted mode, here by a factor of about a hundred."""
    model, found, (_, driven) = solved_wheel
    wanted = (model.parts["blade"].solid.onto @ driven).reshape(-1, 3)
    reduced, whole = (np.abs(own[1] - wanted).max() for own in (found.reduced, found.whole))
    assert whole < reduced / 20


def test_nodes_of_both_cyclic_faces_are_paired_and_move_as_the_phase_says(solved_wheel):
    model, found, _ = solved_wheel
    part = model.parts["blade"]
    low, high = found.faces.T
    turn = part.axis.rotation(2 * math.pi / SECTORS)
    assert sorted(low) == sorted(part.mesh.node_sets["cyclic_low"])
    assert part.axis.turned(part.mesh.points[low], 2 * math.pi / SECTORS) == pytest.approx(part.mesh.points[high])
    for h in (0, 1):
        assert found.whole[h][high] == pytest.approx(
            found.phases[h] * found.whole[h][low] @ turn.T, rel=1e-9, abs=1e-15
        )
    assert found.phases[1] == pytest.approx(np.exp(2j * math.pi * ORDER / SECTORS))


def test_stress_on_cyclic_faces_is_that_of_the_whole_wheel():
    """Waves of a sector laid out on the mesh of all sectors, whose nodes on inner faces have the cells of both sides."""
    mesh = shrouded_sector()
    wheel, nodes = whole_wheel(mesh)
    axis, pitch = solid_part(mesh, Material(), sectors=SECTORS).axis, 2 * math.pi / SECTORS
    root = mesh.node_sets["root"]
    low = np.concatenate([mesh.node_sets["cyclic_low"], root[:3]])
    high = np.concatenate([mesh.node_sets["cyclic_high"], root[-3:]])
    turn, rng = axis.rotation(pitch), np.random.default_rng(1)
    phases = np.exp(2j * math.pi * np.arange(3) / SECTORS)
    own = 1e-5 * (rng.normal(size=(3, len(mesh.points), 3)) + 1j * rng.normal(size=(3, len(mesh.points), 3)))
    own[0] = own[0].real
    own[:, high] = phases[:, None, None] * own[:, low] @ turn.T
    laid = np.zeros((3, len(wheel.points), 3), dtype=complex)
    for s in range(SECTORS):
        laid[:, nodes[s]] = phases[:, None, None] ** s * own @ axis.rotation(s * pitch).T
    sector, every = (rotating_solid(SolidMesh(m.points, m.cells, {}), Material()) for m in (mesh, wheel))
    beside = Neighbours(np.stack([low, high], axis=1), turn)
    wanted = nodal_stress(every, laid)[:, nodes[0]]
    found = nodal_stress(sector, own, neighbours=beside.at(phases))
    size = np.abs(wanted).max()
    assert np.abs(found - wanted).max() < 1e-12 * size
    assert np.abs(nodal_stress(sector, own)[:, high] - wanted[:, high]).max() > 0.1 * size  # of one side alone
    assert np.abs(nodal_stress(sector, own[0].real[None], neighbours=beside)[0] - wanted[0]).max() < 1e-12 * size
    other = np.setdiff1d(np.arange(len(mesh.points)), [*low, *high])
    told, of_all = stress_error(sector, own, neighbours=beside.at(phases)), stress_error(every, laid)
    assert told.local[:, other] == pytest.approx(of_all.local[:, nodes[0][other]], rel=1e-9)
    assert stress_error(sector, own).local[:, other] != pytest.approx(of_all.local[:, nodes[0][other]], rel=1e-3)
    many = np.tile(own, (9, 1, 1))  # more fields than are computed at a time
    assert (
        np.abs(nodal_stress(sector, many, neighbours=beside.at(np.tile(phases, 9))) - np.tile(wanted, (9, 1, 1))).max()
        < 1e-12 * size
    )
