"""A model that is a sector of a wheel against all sectors without symmetry, assembled from one mesh of the whole."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse

from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.load import Load, Output
from stickslip.assembly.model import Model
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.pairing import node_to_segment
from stickslip.contact.surface import nodal_surface
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.axis import Axis
from stickslip.model.damping import rayleigh_damping
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.mesh_facets import facets_of
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import BodyPoints, rigid_part, solid_part
from stickslip.model.rigid.body import RigidBody
from stickslip.reduction.waves import excited_wave
from stickslip.response.equilibrium import preload
from stickslip.response.forced.response import Sweep, forced_problem, forced_response
from stickslip.response.recovery import fields
from stickslip.response.system import System

SECTORS, ORDER, H = 5, 2, 3
SPEED = 300.0
RADII = (0.10, 0.13, 0.18, 0.20)
STEEL = Material()
LAW = ElasticCoulomb(k_t=6e6, k_w=6e6, k_n=8e6, mu=0.15, preload=200.0)


def shrouded_sector():
    """One of five sectors: a piece of a ring, a blade of one brick, a shroud whose two contact faces are meshed differently."""
    half = math.pi / SECTORS
    angle, depth = np.array([-half, -0.3 * half, 0.35 * half, half]), (-0.02, 0.004, 0.02)
    number = np.arange(4 * 4 * 3).reshape(4, 4, 3)
    points = np.array(
        [[r * math.cos(a), r * math.sin(a), z] for r in RADII for a in angle for z in depth]
    )
    for i in (2, 3):  # the middle nodes of the high face lie elsewhere
        points[number[i, 3, 1], 2] = -0.006
    cells = []
    for i, columns in ((0, range(3)), (1, (1,)), (2, range(3))):
        for j in columns:
            for k in range(2):
                a, b, c, d = number[i, j, k], number[i + 1, j, k], number[i + 1, j + 1, k], number[i, j + 1, k]
                top = [number[i, j, k + 1], number[i + 1, j, k + 1], number[i + 1, j + 1, k + 1], number[i, j + 1, k + 1]]
                cells.append([a, b, c, d, *top])
    sets = {
        "root": number[0].ravel(),
        "cyclic_low": number[1, 0],
        "cyclic_high": number[1, 3],
        "shroud_low": number[2:, 0].ravel(),
        "shroud_high": number[2:, 3].ravel(),
        "tip": number[3, 1:3, 1],
        "flank_low": number[1:3, 1].ravel(),
    }
    return SolidMesh(points, np.array(cells), sets)


def whole_wheel(mesh):
    """Return the mesh of all sectors, the nodes of shared faces merged, and the nodes of each sector in it."""
    n = len(mesh.points)
    low, high = mesh.node_sets["cyclic_low"], mesh.node_sets["cyclic_high"]
    root = mesh.node_sets["root"]
    low = np.concatenate([low, root[:3]])
    high = np.concatenate([high, root[-3:]])
    place = np.arange(SECTORS * n).reshape(SECTORS, n)
    for s in range(SECTORS):
        place[s, high] = place[(s + 1) % SECTORS, low]
    axis = Axis()
    points = np.vstack([axis.turned(mesh.points, 2 * math.pi * s / SECTORS) for s in range(SECTORS)])
    used, cells = np.unique(place[:, mesh.cells].reshape(-1, 8), return_inverse=True)
    nodes = np.searchsorted(used, place)
    sets = {"root": np.unique(nodes[:, root])}
    return SolidMesh(points[used], cells.reshape(-1, 8), sets), nodes


def dofs_of(structure, nodes):
    """Return the (k, 3) dofs of nodes of a structure assembled from a mesh without numbers."""
    place = {(int(n), c): i for i, (n, c) in enumerate(zip(structure.dofs.node, structure.dofs.component, strict=True))}
    return np.array([[place.get((int(n), c), -1) for c in "xyz"] for n in nodes])


def answered(system, load, hertz):
    sweep = Sweep(
        omega_range=(2 * math.pi * hertz[0], 2 * math.pi * hertz[1]),
        low=H, high=H, selection="always_low", frequencies=2, peak_points=0,
    )  # fmt: skip
    problem = forced_problem(system, load, sweep)
    points = list(forced_response(system, load, sweep))
    assert all(point.converged for point in points)
    return [fields(problem, point) for point in points]


def sector_model(mesh, **changes):
    own = {"damping_ratio": 0.003, "between": (2 * math.pi * 500, 2 * math.pi * 3000)}
    return Model(
        parts={"blade": solid_part(mesh, STEEL, sectors=SECTORS, **own)},
        contacts={
            "shroud": Contact(
                between=("blade.shroud_high", "next.blade.shroud_low"),
                law=LAW,
                pairing="node_to_segment",
                tangent=(1.0, 0.0, 0.0),
            )
        },
        loads={
            "gas": Load(on="blade.tip", newton=2000.0, direction=(0.2, 1, 0.3), engine_order=ORDER),
            "more": Load(on="blade.tip", newton=600.0, direction=(1, 0, 0), harmonic=2, phase=0.4, engine_order=ORDER),
            "lean": Load(on="blade.tip", newton=15.0, direction=(0, 1, 1), harmonic=0),
        },
        outputs=(Output(name="tip", on="blade.tip"),),
        speed=SPEED,
        **changes,
    )


def test_shrouds_that_do_not_match_answer_on_one_sector_as_on_all():
    """Rotation, static loads, two harmonics of excitation and slip, on the mesh of the whole wheel without symmetry."""
    mesh = shrouded_sector()
    model = sector_model(mesh)
    found = model.assembled(H)
    assert found.engine_order == ORDER
    assert found.system.retained.size == 3 * 6  # gaps, not nodes of both sides

    whole, nodes = whole_wheel(mesh)
    solid = rotating_solid(whole, STEEL)
    turning = solid.at_speed(SPEED)
    damped = rayleigh_damping(turning, 0.003, (500.0, 3000.0))
    static = turning.stiffness @ solid.displacement(SPEED)
    force = {h: np.zeros(damped.n, dtype=complex) for h in (1, 2)}
    tip = mesh.node_sets["tip"]
    axis = Axis()
    surfaces, directions = [], []
    for s in range(SECTORS):
        turn = axis.rotation(2 * math.pi * s / SECTORS)
        here = dofs_of(damped, nodes[s, tip])
        unit = np.array([0.2, 1, 0.3]) / np.linalg.norm([0.2, 1, 0.3])
        theta = 2 * math.pi * ORDER * s / SECTORS
        force[1][here] += turn @ unit * 2000.0 / 2 * np.exp(1j * theta)
        force[2][here] += turn @ np.array([1.0, 0, 0]) * 600.0 / 2 * np.exp(1j * (0.4 + 2 * theta))
        static[here] += turn @ np.array([0, 1, 1]) / math.sqrt(2) * 15.0 / 2
        for side in ("shroud_high", "shroud_low"):
            own = nodes[s, mesh.node_sets[side]]
            local = np.full(len(mesh.points), -1)
            local[mesh.node_sets[side]] = np.arange(6)
            facets = local[facets_of(mesh, mesh.node_sets[side])]
            surfaces.append(nodal_surface(whole.points[own], dofs_of(damped, own), damped.n, facets))
        directions.append(tuple(turn[:, 0]))
    gaps = [
        node_to_segment(surfaces[2 * s], surfaces[2 * ((s + 1) % SECTORS) + 1], direction=directions[s]).gap_operator
        for s in range(SECTORS)
    ]
    names = tuple(f"{s}.{i}" for s in range(SECTORS) for i in range(6))
    interface = Interface(names, (LAW,) * len(names), scipy.sparse.vstack(gaps, format="csr"))
    seen = dofs_of(damped, nodes[0, tip[:1]]).ravel()
    system = System(damped, interface, seen)
    load = HarmonicLoad(static, force)

    at_rest = (interface.gap_operator[:, system.retained] @ preload(system, static)).reshape(-1, 3)
    assert np.abs(at_rest[:6] - found.static_gap).max() < 1e-9 * np.abs(at_rest).max()
    assert np.ptp(found.static_force[:, 2]) > 5.0  # rotation presses the points differently
    hertz = (2140.0, 2200.0)
    mine, theirs = answered(found.system, found.load, hertz), answered(system, load, hertz)
    for one, every in zip(mine, theirs, strict=True):
        assert one.energy.max() > 1e-4  # else nothing slips
        assert np.abs(one.outputs - every.outputs).max() < 1e-8 * np.abs(every.outputs).max()
        for h in range(H + 1):
            phase = np.exp(2j * math.pi * h * ORDER * np.repeat(np.arange(SECTORS), 6) / SECTORS)
            own = np.tile(one.gaps[h].reshape(6, 3), (SECTORS, 1))
            there = every.gaps[h].reshape(-1, 3)
            assert np.abs(there - phase[:, None] * own).max() < 1e-8 * np.abs(every.gaps).max()
