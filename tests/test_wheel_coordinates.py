"""One sector of a tuned wheel answers as all sectors do, in gaps and in nodal coordinates, with whatever the contacts touch."""

import math
from dataclasses import replace

import numpy as np
import pytest
from cyclic_models import mass_ring
from newton_bounds import allowed, answer_at
from test_reduced_wheel import TILTED, shrouded, some_sector, whole_nodes

from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.neighbours import neighbour_gaps
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.structure import Dofs, Structure, join
from stickslip.reduction.cyclic import CyclicSector
from stickslip.reduction.full_wheel import _from_wheel, wheel
from stickslip.reduction.tuned import tuned_wheel
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System

LAW = ElasticCoulomb(k_t=2.0, k_w=1.5, k_n=3.0, mu=0.4, preload=1.0)
OMEGA, ORDER = 0.9, 3
SWEEP = Sweep(omega_range=(OMEGA, 1.1), at=(OMEGA,), low=ORDER, high=ORDER, selection="always_low", peak_points=0)


def dense(matrix):
    return matrix.toarray() if hasattr(matrix, "toarray") else np.asarray(matrix)


def solved(structure, interface, load, free=None):
    system = System(structure, interface, np.arange(structure.n), free=free)
    problem = forced_problem(system, load, SWEEP)
    point = accepted_points(list(forced_response(system, load, SWEEP)))[0]
    assert point.converged
    return answer_at(problem, point)


def both(sector, engine_order, gaps, loads, law=LAW, free=(), **how):
    """Solve one sector and the wheel of all, and compare gaps, forces and the displacements of the sector; return the former."""
    sectors, count = sector.sectors, gaps[0].shape[0] // 3
    static, force = loads
    names = tuple(str(i) for i in range(count))
    tuned, operator = tuned_wheel(sector, engine_order, ORDER, gaps, names=names, **how)
    assert np.isrealobj(operator)
    load = HarmonicLoad(tuned.project(static, 0).real, {1: tuned.project(force, 1)})
    own_free = [i for i, label in enumerate(tuned.dofs.labels) if label in free]
    one = solved(tuned, Interface(names, (law,) * count, operator), load, np.array(own_free, dtype=int))
    assert np.any(one.energy > 1e-4), "nothing slips"

    whole = wheel(sector)
    maps = [dense(_from_wheel(sector, n)) for n in range(sectors)]
    own, following = (0.0 * gaps[0] if g is None else g for g in gaps)
    rows = [own @ maps[n] + following @ maps[(n + 1) % sectors] for n in range(sectors)]
    pairs = Interface(
        tuple(f"{n}.{name}" for n in range(sectors) for name in names),
        (law,) * (count * sectors),
        np.vstack([dense(r) for r in rows]),
    )
    phase = np.exp(2j * math.pi * engine_order * np.arange(sectors) / sectors)
    all_free = [i for i, label in enumerate(whole.dofs.labels) if label.split(".", 1)[-1] in free]
    everything = solved(
        whole,
        pairs,
        HarmonicLoad(
            sum(m.T @ static for m in maps), {1: sum(p * (m.T @ force) for p, m in zip(phase, maps, strict=True))}
        ),
        np.array(all_free, dtype=int),
    )
    for h in range(ORDER + 1):
        turned = phase**h
        for name in ("gaps", "forces"):
            theirs, mine = getattr(everything, name), getattr(one, name)
            expected = (turned[:, None, None] * mine[h]).reshape(-1, 3)
            assert np.abs(theirs[h] - expected).max() <= allowed(name, everything, one)
        moved = tuned.expand(one.outputs[h], h)
        mine = maps[0] @ everything.outputs[h]
        assert np.abs(mine - moved).max() < 1e-7 * np.abs(tuned.expand(one.outputs[1], 1)).max()
    return tuned, operator, one


def loads_on(sector, low, high):
    static, force = np.zeros((2, sector.structure.n))
    static[low] = 0.2, -0.1, 0.15
    force[high] = 1.5, 1.0, -0.5
    return static, force


@pytest.mark.parametrize("relative", [None, True, False])
@pytest.mark.parametrize("engine_order", [1, 3, 5])
def test_shrouds_in_gaps_and_in_nodal_coordinates(engine_order, relative):
    sector, (low, high) = shrouded(5)
    keep = np.concatenate([low, high])
    gaps = neighbour_gaps(sector.structure, 5, low="left", high="right", axis=TILTED, normal=np.array([0.6, 0.0, 0.8]))
    tuned, operator, _ = both(
        sector,
        engine_order,
        gaps,
        loads_on(sector, low, high),
        relative=relative,
        keep=keep,
        n_modes=sector.independent.size - keep.size,
    )
    assert tuned.multipliers.size == 0
    touched = np.flatnonzero(np.any(dense(operator), axis=0))
    assert touched.size == (6 if relative is False else 3)
    if relative is False:
        table = sector.structure.dofs
        assert tuned.dofs.labels[:6] == tuple(table.labels[i] for i in keep)
        np.testing.assert_array_equal(tuned.of_harmonic(0).sets["left"], [0, 1, 2])


@pytest.mark.parametrize("engine_order", [1, 4])
def test_more_quadrature_points_than_dofs(engine_order):
    """Their gaps depend on each other and are no coordinates."""
    sector, (low, high) = shrouded(5)
    gaps = [
        dense(g)
        for g in neighbour_gaps(
            sector.structure, 5, low="left", high="right", axis=TILTED, normal=np.array([0.6, 0.0, 0.8])
        )
    ]
    several = tuple(np.vstack([w * g for w in (1.0, 0.7, 0.4)]) for g in gaps)
    how = {"keep": np.concatenate([low, high]), "n_modes": sector.independent.size - 6}
    loads = loads_on(sector, low, high)
    tuned, _, _ = both(sector, engine_order, several, loads, **how)
    assert "gaps" not in tuned.of_harmonic(0).sets
    both(sector, engine_order, several, loads)  # nothing reduced
    with pytest.raises(InputError, match="depend on each other"):
        tuned_wheel(sector, engine_order, ORDER, several, relative=True, **how)


@pytest.mark.parametrize(("sectors", "engine_order"), [(5, 2), (4, 1), (3, 0), (6, -1)])
def test_a_mass_that_touches_both_neighbours(sectors, engine_order):
    """The same dof on both sides of a gap, which vanishes in wave 0: a copy of it is held to what the neighbour does."""
    sector = mass_ring(sectors, damping=0.05)
    own, following = np.zeros((2, 3, 2))
    own[0, 0], following[0, 0] = -1.0, 1.0
    # a second contact to the ground, so that something slips in wave 0 too
    ground = np.zeros((3, 2))
    ground[0, 0] = 1.0
    gaps = np.vstack([own, ground]), np.vstack([following, 0.0 * ground])
    law = ElasticCoulomb(k_t=0.8, k_w=0.0, k_n=0.0, mu=0.5, preload=0.2)
    loads = np.array([0.05, 0.0]), np.array([1.0, 0.0])
    tuned, _, _ = both(sector, engine_order, gaps, loads, law)
    if engine_order == 0:  # the gap vanishes in the only wave
        assert tuned.n == 1
        return
    assert tuned.dofs.labels == ("node0.x", "next.node0.x", "next.node0.tie_x")
    np.testing.assert_array_equal(tuned.multipliers, [2])
    with pytest.raises(InputError, match="gaps"):
        tuned_wheel(sector, engine_order, ORDER, gaps, relative=True)


def test_a_node_between_both_neighbours_with_modes():
    """Six gaps of a reduced sector act on one node: it is its own neighbour on both sides."""
    sector = some_sector(5)
    node = whole_nodes(sector, 1)
    structure = replace(sector.structure, sets={"left": node, "right": node})
    gaps = neighbour_gaps(structure, 5, low="left", high="right", axis=TILTED, normal=np.array([0.6, 0.0, 0.8]))
    how = {"keep": node, "n_modes": sector.independent.size - 3}
    for relative in (None, False):
        tuned, _, _ = both(sector, 2, gaps, loads_on(sector, node, node), relative=relative, **how)
    assert tuned.multipliers.size == 3


def test_contacts_on_the_high_face():
    """What lies on the high face is what the neighbour's low face does."""
    sector = some_sector(5)
    node = sector.low[:3]
    partner = sector.high[:3]
    own = np.zeros((3, sector.structure.n))
    inner = whole_nodes(sector, 1)
    own[:, inner], own[:, partner] = -np.eye(3), np.eye(3)
    keep = np.concatenate([inner, node])
    how = {"keep": keep, "n_modes": sector.independent.size - 6}
    for relative in (None, False):
        both(sector, 3, (own, None), loads_on(sector, inner, node), relative=relative, **how)


def rigid_body():
    """Return a body of six dofs between the shrouds, held softly: the preloads of its contacts do not balance each other."""
    components = ("x", "y", "z", "rx", "ry", "rz")
    dofs = Dofs(np.full(6, -1), components, np.tile([0.4, 0.1, 0.3], (6, 1)))
    turned = np.linalg.qr(np.random.default_rng(3).standard_normal((3, 3)))[0]
    inertia = turned @ np.diag([0.02, 0.03, 0.05]) @ turned.T
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = 0.3 * np.eye(3), inertia
    stiffness = np.diag([0.8, 0.8, 0.8, 0.1, 0.1, 0.1])
    return Structure(mass, 0.02 * stiffness, stiffness, dofs)


@pytest.mark.parametrize("engine_order", [1, 3])
@pytest.mark.parametrize("relative", [None, False])
def test_a_sector_joined_with_a_rigid_damper(engine_order, relative):
    """The damper touches its own blade at one point and the next one at two: it has partners on no face."""
    blade, (low, high) = shrouded(5)
    joined = join(blade=blade.structure, damper=rigid_body())
    first = blade.structure.n
    sector = CyclicSector(joined, 5, blade.low, blade.high, TILTED)
    body = first + np.arange(6)
    own, following = np.zeros((2, 9, joined.n))
    turn = TILTED.rotation(2 * math.pi / 5)
    frame = np.linalg.qr(np.random.default_rng(8).standard_normal((3, 3)))[0]
    points = np.array([[0.1, 0.0, 0.05], [-0.1, 0.08, 0.0], [0.0, -0.1, 0.02]])
    other = np.linalg.qr(np.random.default_rng(9).standard_normal((3, 3)))[0]
    for i, r in enumerate(points):
        rows = slice(3 * i, 3 * i + 3)
        cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        to_frame = (frame if i == 0 else other).T
        own[rows, body] = to_frame @ np.hstack([np.eye(3), -cross])
        if i == 0:
            own[rows, high] = -to_frame
        else:
            following[rows, low] = -(0.5 + 0.2 * i) * to_frame @ turn
    keep = np.concatenate([low, high, body])
    static, force = loads_on(sector, low, high)
    static[body[:3]] = 0.02, 0.01, -0.02
    free = tuple(joined.dofs.labels[i] for i in body)
    both(
        sector,
        engine_order,
        (own, following),
        (0.3 * static, 0.3 * force),
        relative=relative,
        keep=keep,
        free=free,
        law=LAW,
        n_modes=sector.independent.size - keep.size,
    )


def test_a_contact_on_the_axis_is_refused_by_name():
    sector = CyclicSector(
        Structure(np.eye(2), np.zeros((2, 2)), 2 * np.eye(2), Dofs(np.arange(2), ("x", "x"), np.zeros((2, 3)))),
        4,
        np.array([1]),
        np.array([1]),
        axis=None,
    )
    own = np.zeros((3, 2))
    own[0] = 1.0, -1.0
    with pytest.raises(InputError, match=r"node1\.x lies on the axis"):
        tuned_wheel(sector, 1, 1, (own, None), relative=False)
