"""The wheel reduced wave by wave, and contacts between its sectors."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from cyclic_models import random_sector, wedge

from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.neighbours import neighbour_interface
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.modes import with_springs
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.reduction.full_wheel import wheel, wheel_shape
from stickslip.reduction.waves import excited_wave
from stickslip.reduction.whole_wheel import reduced_wheel

TILTED = Axis((0.3, -0.4, 0.8), (0.1, 0.2, -0.3))


def squares(structure):
    def dense(matrix):
        return matrix.toarray() if scipy.sparse.issparse(matrix) else matrix

    return scipy.linalg.eigvalsh(dense(structure.stiffness), dense(structure.mass))


def some_sector(sectors, axis=TILTED):
    return cyclic_sector(random_sector(sectors, 3, axis=axis), sectors, axis=axis)


def whole_nodes(sector, count):
    """Return the dofs of `count` inner nodes of the sector."""
    free = np.setdiff1d(sector.independent, sector.low)
    nodes = np.unique(sector.structure.dofs.node[free])[:count]
    return free[np.isin(sector.structure.dofs.node[free], nodes)]


@pytest.mark.parametrize("sectors", [1, 2, 5, 6])
def test_with_all_modes_it_is_the_wheel(sectors):
    sector = some_sector(sectors)
    keep = whole_nodes(sector, 1)
    reduced = reduced_wheel(sector, keep, sector.independent.size - keep.size)
    full = wheel(sector)
    assert reduced.structure.n == full.n
    assert squares(reduced.structure) == pytest.approx(squares(full), rel=1e-9)


def test_it_has_the_union_of_its_reduced_waves():
    sector = some_sector(6)
    keep = whole_nodes(sector, 2)
    reduced = reduced_wheel(sector, keep, 3)
    place = np.searchsorted(sector.independent, keep)
    waves = [craig_bampton(travelling_wave(sector, k), place, 3) for k in range(6)]
    expected = np.sort(np.concatenate([squares(w) for w in waves]))
    assert squares(reduced.structure) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("engine_order", [0, 2, 3, 7])
def test_travelling_load_moves_all_sectors_alike(engine_order):
    """Against one sector's travelling wave, solved in full: kept dofs make the static response exact."""
    sectors = 6
    sector = some_sector(sectors)
    keep = whole_nodes(sector, 2)
    reduced = reduced_wheel(sector, keep, 2)
    k = excited_wave(engine_order, sectors)
    force = np.zeros(sector.structure.n, dtype=complex)
    force[keep] = np.random.default_rng(1).standard_normal(keep.size)
    wave = travelling_wave(sector, k)
    stiffness = wave.stiffness.toarray()
    full = np.linalg.solve(stiffness, wave.basis.conj().T @ force)
    expected = wheel_shape(sector, k, full)
    found = np.linalg.solve(reduced.structure.stiffness, reduced.load(force, k))
    own_axes = reduced.expand(found)
    phases = np.exp(2j * np.pi * k * np.arange(sectors) / sectors)
    scale = np.abs(expected).max()
    assert np.abs(own_axes - phases[:, None] * expected[0]).max() < 1e-9 * scale
    kept = found.reshape(sectors, -1)[:, : keep.size]  # global axes, as the shape of the wheel
    assert np.abs(kept - expected[:, keep]).max() < 1e-9 * scale


def shrouded(sectors):
    """Return a sector whose two inner nodes stand for the faces of a shroud, and their dofs."""
    sector = some_sector(sectors)
    nodes = whole_nodes(sector, 2).reshape(2, 3)
    structure = sector.structure
    sets = {**structure.sets, "left": nodes[0], "right": nodes[1]}
    return replace(sector, structure=replace(structure, sets=sets)), nodes


@pytest.mark.parametrize("sectors", [3, 6])
def test_springs_between_neighbours_have_the_phase_of_the_wave(sectors):
    """On the reduced wheel, against each wave of the full sector with the spring written by hand."""
    sector, (low, high) = shrouded(sectors)
    reduced = reduced_wheel(sector, np.concatenate([low, high]), sector.independent.size - 6)
    normal = np.array([0.6, 0.0, 0.8])
    contacts = neighbour_interface(
        reduced.structure,
        sectors,
        Bonded(k_t=2.0, k_w=2.0, k_n=2.0),
        low="left",
        high="right",
        axis=TILTED,
        normal=normal,
    )
    stuck = with_springs(reduced.structure, contacts.gap_operator, np.full(3 * sectors, 2.0))
    expected = []
    turn = TILTED.rotation(2 * math.pi / sectors)
    for k in range(sectors):
        wave = travelling_wave(sector, k)
        gap = np.zeros((3, sector.structure.n), dtype=complex)
        gap[:, low] = np.exp(2j * np.pi * k / sectors) * turn
        gap[:, high] -= np.eye(3)
        gap = gap @ wave.basis
        stiffness = wave.stiffness.toarray() + 2.0 * gap.conj().T @ gap
        expected.append(scipy.linalg.eigvalsh(stiffness, wave.mass.toarray()))
    assert squares(stuck) == pytest.approx(np.sort(np.concatenate(expected)), rel=1e-9)
    frame = contacts.gap_operator.toarray()[:3, reduced.structure.sets["sector0.right"]]
    assert -frame[2] == pytest.approx(normal)  # of sector 0, out of its high face


def test_plane_faces_know_their_normal():
    """Three nodes in the plane at half a pitch: the normal is that of the plane, towards the next sector."""
    sectors = 8
    mesh = wedge(sectors, cells=(1, 1, 1))
    structure = assemble_solid(mesh, Material())
    sets = dict(structure.sets)
    sets["left"], sets["right"] = sets.pop("cyclic_low"), sets.pop("cyclic_high")
    copies = {f"sector{n}.{name}": sets[name] for n in range(sectors) for name in ("left", "right")}
    interface = neighbour_interface(
        replace(structure, sets=copies), sectors, Bonded(k_t=1.0, k_w=1.0, k_n=1.0), low="left", high="right"
    )
    half = math.pi / sectors
    row = interface.gap_operator.toarray()[2, sets["right"][:3]]
    assert -row == pytest.approx([-math.sin(half), math.cos(half), 0.0], abs=1e-12)


def test_what_does_not_fit_is_said():
    sector, (low, high) = shrouded(6)
    reduced = reduced_wheel(sector, np.concatenate([low, high]), 2)
    law = Bonded(k_t=1.0, k_w=1.0, k_n=1.0)
    with pytest.raises(InputError, match="do not lie in one plane"):
        neighbour_interface(reduced.structure, 6, law, low="left", high="right", axis=TILTED)
    with pytest.raises(InputError, match=r"there is no set 'sector0\.lift'"):
        neighbour_interface(reduced.structure, 6, law, low="lift", high="right", axis=TILTED)
    with pytest.raises(InputError, match="high face or on the axis"):
        reduced_wheel(sector, sector.high[:3], 1)
    with pytest.raises(InputError, match="has shape"):
        reduced.load(np.zeros(3))
    with pytest.raises(InputError, match="got shape"):
        reduced.expand(np.zeros(3))
