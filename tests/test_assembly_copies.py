"""Copies, joins and surfaces of a model against the same parts meshed and assembled in place."""

import math
from dataclasses import replace

import numpy as np
import pytest
from newton_bounds import allowed, answer_at

from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.forces import Load, Output
from stickslip.assembly.model import Model
from stickslip.assembly.part_copies import copy_of, place_of
from stickslip.assembly.part_reduction import ReducedPart
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.errors import InputError
from stickslip.model.axis import Axis
from stickslip.model.damping import Damping
from stickslip.model.fe.solid import Material
from stickslip.model.matrices import lumped
from stickslip.model.mesh.solid_mesh import SolidMesh, facets_of
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import BodyPoints, Part, Place, rigid_part, solid_part, structure_part
from stickslip.model.rigid.body import RigidBody
from stickslip.reduction.choice import Reduction
from stickslip.response.forced.response import Sweep, forced_problem, forced_response

DAMPING = Damping(ratio=0.01, between_hz=(160.0, 1400.0))
STEEL = Material()
LAW = ElasticCoulomb(k_t=3e6, k_w=3e6, k_n=5e6, mu=0.3, preload=30.0)
OBLIQUE = Axis(direction=(0.3, -0.5, 1.0), origin=(0.1, 0.2, 0.0))
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
EDGES = [(0, 1), (1, 2), (3, 2), (0, 3), (4, 5), (5, 6), (7, 6), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7)]


def bar(cells=(3, 1, 1), *, start=0.0, length=0.3, clamp=True, quadratic=False):
    """A bar along x of bricks, with the sets ``left``, ``right`` and ``top``, skewed so that nothing is symmetric."""
    step = 2 if quadratic else 1
    grid = [step * c + 1 for c in cells]
    place = np.array(list(np.ndindex(*grid)))
    size = np.array([length, 0.03, 0.02])
    points = place / (np.array(grid) - 1) * size + [start, 0, 0]
    points[:, 1] += 0.1 * points[:, 0] + 0.2 * points[:, 2]
    at = {tuple(p): i for i, p in enumerate(place)}
    rows = []
    for corner in np.ndindex(*cells):
        own = [step * (np.array(corner) + c) for c in CORNERS]
        if quadratic:
            own += [(own[a] + own[b]) // 2 for a, b in EDGES]
        rows.append([at[tuple(p)] for p in own])
    used, numbered = np.unique(np.array(rows), return_inverse=True)
    place, points = place[used], points[used]
    sets = {
        "left": np.flatnonzero(place[:, 0] == 0),
        "right": np.flatnonzero(place[:, 0] == grid[0] - 1),
        "top": np.flatnonzero(place[:, 2] == grid[2] - 1),
    }
    if clamp:
        sets["root"] = sets.pop("left")
        sets["top"] = np.setdiff1d(sets["top"], sets["root"])
    return SolidMesh(points, numbered.reshape(len(rows), -1), sets)


def answered(model, hertz=(300.0, 330.0), order=3):
    found = assemble(model, order)
    sweep = Sweep(
        omega_range=(2 * math.pi * hertz[0], 2 * math.pi * hertz[1]),
        low=order,
        high=order,
        selection="always_low",
        frequencies=2,
        peak_points=0,
    )
    problem = forced_problem(found.system, found.load, sweep)
    points = list(forced_response(found.system, found.load, sweep))
    assert all(point.converged for point in points)
    return [answer_at(problem, point) for point in points]


def same(one, other):
    for a, b in zip(answered(one), answered(other), strict=True):
        assert np.abs(b.energy).max() > 1e-9  # something slips
        for name in ("outputs", "forces"):
            mine, theirs = getattr(a, name), getattr(b, name)
            assert np.abs(mine - theirs).max() <= allowed(name, a, b)


@pytest.mark.parametrize("quadratic", [False, True])
def test_facets_of_a_set_are_outward_and_have_the_area_of_the_face(quadratic):
    from stickslip.contact.surface import nodal_surface

    mesh = bar((2, 2, 1), quadratic=quadratic)
    facets = facets_of(mesh, mesh.node_sets["right"])
    assert facets.shape == (2, 8 if quadratic else 4)
    surface = nodal_surface(mesh.points, np.full(mesh.points.shape, -1), 1, facets)
    assert surface.tributary_areas().sum() == pytest.approx(0.03 * 0.02, rel=1e-12)
    normals = surface.node_normals()[mesh.node_sets["right"]]
    assert np.all(normals[:, 0] > 0.9)
    assert not len(facets_of(mesh, mesh.node_sets["right"][:-1])) > 1


def pair(first, second):
    """Two bars whose ends rub against the ground."""
    ends = {"one": first, "two": second}
    return Model(
        parts=ends,
        contacts={
            name: Contact(between=(f"{name}.right", "ground"), law=LAW, tangent=(0.0, 0.2, 1.0)) for name in ends
        },
        loads={name: Load(on=f"{name}.right", newton=60.0, direction=(0, 0.3, 1)) for name in ends},
        outputs=(Output(name="a", on="one.right"), Output(name="b", on="two.right")),
    )


PLACES = {
    "moved": place_of(move=(0.001, 0.04, 0.002)),
    "turned": place_of(turn=0.7, axis=OBLIQUE),
    "mirrored": place_of(mirror=(1.0, 0.4, 0.1), move=(0.6, 0.0, 0.0)),
    "all": place_of(mirror=(0.0, 1.0, 0.0), turn=-0.4, axis=OBLIQUE, move=(0.02, 0.0, 0.01)),
}


@pytest.mark.parametrize("how", PLACES)
@pytest.mark.parametrize("n_modes", [None, 6])
@pytest.mark.parametrize("speed", [0.0, 200.0])
def test_a_copy_is_the_part_assembled_in_place(how, n_modes, speed):
    place, own = PLACES[how], {"reduction": n_modes and Reduction(n_modes), "damping": DAMPING}
    mesh = bar()
    there = replace(mesh, points=mesh.points @ place.turn.T + place.move)
    if np.linalg.det(place.turn) < 0:
        there = replace(there, cells=there.cells[:, [4, 5, 6, 7, 0, 1, 2, 3]])
    first = solid_part(mesh, STEEL, **own)
    copy, meshed = copy_of(first, place), solid_part(there, STEEL, **own)
    assert copy.template is first
    for matrix in ("mass", "stiffness"):
        mine, theirs = (getattr(p.structure, matrix).toarray() for p in (copy, meshed))
        assert np.abs(mine - theirs).max() <= 1e-12 * np.abs(theirs).max()
    np.testing.assert_allclose(copy.solid.centrifugal, meshed.solid.centrifugal, atol=1e-12)
    models = [replace(pair(first, second), speed=speed) for second in (copy, meshed)]
    found, expected = (natural_frequencies(m.at(speed, 0, "stuck"), 6) for m in models)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    reduced = [assemble(m, 2).system.structure for m in models]
    for matrix in ("mass", "damping", "stiffness"):
        mine, theirs = (natural_sizes(getattr(s, matrix)) for s in reduced)
        np.testing.assert_allclose(mine, theirs, rtol=1e-8, atol=1e-8 * theirs.max())


def natural_sizes(matrix):
    """Return what does not depend on the signs of modes."""
    dense = matrix.toarray() if hasattr(matrix, "toarray") else matrix
    return np.linalg.eigvalsh(dense)


def reductions(part: Part) -> int:
    """Return how many reductions a part remembers."""
    return sum(isinstance(kept, ReducedPart) for kept in part.memo.values())


def test_copies_share_one_reduction_and_answer_as_parts_of_their_own():
    mesh, own = bar(), {"reduction": Reduction(8), "damping": DAMPING}
    place = place_of(mirror=(0.0, 1.0, 0.0), move=(0.0, 0.06, 0.0))
    first = solid_part(mesh, STEEL, **own)
    there = place.put(mesh.points)
    cells = mesh.cells[:, [4, 5, 6, 7, 0, 1, 2, 3]]
    meshed = solid_part(replace(mesh, points=there, cells=cells), STEEL, **own)
    same(pair(first, copy_of(first, place)), pair(first, meshed))
    assert reductions(first) == 1


@pytest.mark.parametrize("how", PLACES)
def test_copies_at_rest_share_one_reduction_wherever_they_are(how):
    first = solid_part(bar(), STEEL, reduction=Reduction(4), damping=DAMPING)
    other = copy_of(first, PLACES[how])
    assemble(pair(first, other), 3)
    made = [reductions(part) for part in (first, other)]
    assert made == [1, 0]


def test_a_turned_rigid_body_has_its_points_and_inertia_turned():
    place = place_of(turn=0.9, axis=OBLIQUE)
    body = RigidBody(mass=2.0, inertia=(0.1, 0.2, 0.25), centre=(0.1, 0.0, 0.2))
    frame = np.tile(np.eye(3), (1, 1, 1))
    part = rigid_part(body, {"face": BodyPoints(("p",), np.array([[0.1, 0.1, 0.3]]), frame)})
    copy = copy_of(part, place)
    spin = place.turn @ np.diag(body.inertia) @ place.turn.T
    np.testing.assert_allclose(copy.structure.mass[3:, 3:], spin, atol=1e-14)
    np.testing.assert_allclose(copy.body.centre, place.put(np.array([body.centre]))[0])
    np.testing.assert_allclose(copy.surfaces["face"].frame[0], place.turn)
    twice = copy_of(copy, place)
    assert twice.template is part
    np.testing.assert_allclose(twice.place.turn, place.turn @ place.turn)
    mirrored = copy_of(part, place_of(mirror=(1, 0, 0))).surfaces["face"].frame[0]
    assert np.linalg.det(mirrored) == pytest.approx(1.0)
    np.testing.assert_allclose(mirrored[:, 0], [-1, 0, 0])


def halves(pairing, cells=(2, 1, 1), n_modes=None, **more):
    own = {"reduction": n_modes and Reduction(n_modes), "damping": DAMPING}
    left = solid_part(bar((2, 1, 1), length=0.2), STEEL, **own)
    right = solid_part(bar(cells, start=0.2, length=0.2, clamp=False), STEEL, **own)
    return Model(
        parts={"left": left, "right": right},
        **more,
        joins={"weld": Join(between=("right.left", "left.right"), pairing=pairing)},
        contacts={"stop": Contact(between=("right.right", "ground"), law=LAW, tangent=(0, 0, 1))},
        loads={"shake": Load(on="right.right", newton=60.0, direction=(0, 0.3, 1))},
    )


def whole_bar():
    own = {"damping": DAMPING}
    return Model(
        parts={"bar": solid_part(bar((4, 1, 1), length=0.4), STEEL, **own)},
        contacts={"stop": Contact(between=("bar.right", "ground"), law=LAW, tangent=(0, 0, 1))},
        loads={"shake": Load(on="bar.right", newton=60.0, direction=(0, 0.3, 1))},
    )


@pytest.mark.parametrize("pairing", ["node_to_node", "node_to_segment"])
def test_two_halves_tied_are_the_whole(pairing):
    """At rest and turning, full and reduced to all modes there are; both halves end on the same nodes."""
    tied, whole = halves(pairing), whole_bar()
    for speed in (0.0, 300.0):
        found, expected = (natural_frequencies(m.at(speed, 0, "stuck"), 8) for m in (tied, whole))
        np.testing.assert_allclose(found, expected, rtol=1e-10)
    same(tied, whole)
    few = assemble(replace(halves(pairing, n_modes=12), speed=300.0), 3)
    full = assemble(replace(whole, speed=300.0), 3)
    np.testing.assert_allclose(few.static_gap, full.static_gap, atol=1e-9 * np.abs(full.static_gap).max())
    assert few.frequencies.warnings() == []


def test_a_finer_half_tied_to_facets_moves_as_they_do():
    tied = halves("node_to_segment", cells=(2, 2, 2))
    structure = tied.at(0.0, 0, "open")
    moved = structure.expand(np.random.default_rng(1).standard_normal(structure.n))
    places = tied.places
    fine, coarse = (places.spot(name, "") for name in ("right.left", "left.right"))
    middle = (fine.surface.displacement @ moved).reshape(-1, 3).mean(axis=0)
    corners = (coarse.surface.displacement @ moved).reshape(-1, 3).mean(axis=0)
    np.testing.assert_allclose(middle, corners, atol=1e-12)


def test_points_of_an_interface_share_its_law_by_their_areas():
    mesh = bar((2, 2, 1), length=0.2)
    points = mesh.points.copy()
    points[mesh.node_sets["right"][2:4], 1] -= 0.005  # facets of different widths
    part = solid_part(replace(mesh, points=points), STEEL)
    touch = Contact(between=("bar.right", "ground"), law=LAW, tangent=(0, 0, 1), share="interface", gap=2e-6)
    model = Model(parts={"bar": part}, contacts={"touch": touch})
    pairs = model.pairs
    assert pairs.area.sum() == pytest.approx(0.03 * 0.02, rel=1e-9)
    shares = pairs.area / pairs.area.sum()
    assert np.ptp(shares) > 0.01
    for law, share in zip(pairs.laws, shares, strict=True):
        assert law.k_n == pytest.approx(share * LAW.k_n)
        assert law.preload == pytest.approx(share * (30.0 - 5e6 * 2e-6))
        assert law.mu == LAW.mu
    by_area = Model(parts={"bar": part}, contacts={"touch": replace(touch, share="area", gap=0.0)})
    assert by_area.pairs.laws[0].k_n == pytest.approx(pairs.area[0] * LAW.k_n)
    assert np.all(pairs.frame[:, 0, 2] > 0.9)  # n out of the bar
    moved = np.zeros(part.structure.n)
    moved[model.places.spot("bar.right", "").nodes[:, 0]] = 1e-3
    gaps = (pairs.own @ moved).reshape(-1, 3)
    assert np.all(gaps[:, 2] < 0)  # towards the ground: it closes


def test_a_model_says_what_it_is():
    model = halves("node_to_node")
    assert repr(model) == "<Model: parts left, right; contacts stop; joins weld; loads shake>"
    assert repr(model.parts["left"]) == "<Part: mesh; 24 dofs; right, top, root>"
    assert model.facts.mass == pytest.approx(0.4 * 0.03 * 0.02 * 7850)
    assert model.skin.points.shape[1] == 3
    found = model.at(0.0, 0, "open")
    shape = model.on_skin(found.expand(np.eye(found.n)[:, :2]))
    assert shape.shape == (2, len(model.skin.points), 3)
    assert model.static_state(0.0) is None
    assert model.static_state(100.0).displacement > 0
    assert model.sectors == 1


def test_what_is_wrong_with_surfaces_joins_and_copies_is_named():
    model = whole_bar()
    stop = model.contacts["stop"]

    def refused(match, **changes):
        with pytest.raises(InputError, match=match):
            assemble(replace(model, **changes), 3)

    uneven = replace(stop, tangent=None, law=replace(LAW, k_w=1e6))
    refused(
        r"contact.stop.tangent: is missing, and the law is not the same along t and w: "
        r"tangential_stiffness_n_per_m = 3e\+06, axial_stiffness_n_per_m = 1e\+06\.",
        contacts={"stop": uneven},
    )
    cubic = CubicSpring(k_t=1.0, k_w=1.0, cubic_t=2.0)
    refused(
        r"cubic_tangential_n_per_m5 = 2, cubic_axial_n_per_m5 = 0\.",
        contacts={"stop": replace(uneven, law=cubic, share="area")},
    )
    refused(
        "contact.stop.between: no point of the contact can move",
        contacts={"stop": replace(stop, between=("bar.root", "ground"))},
    )
    points = {"p": solid_part(bar(), STEEL)}
    odd = replace(stop, between=("p.root", "bar.right"), tolerance=1e-6)
    refused(
        "contact.stop .side A: p.root, side B: bar.right.: node_to_node: 4 nodes of side A have no",
        parts={**model.parts, **points},
        contacts={"stop": odd},
    )
    weld = Join(between=("right.right", "left.right"), pairing="node_to_node")
    apart = replace(halves("node_to_node"), joins={"weld": weld})
    told = r"join.weld .*node_to_node: 4 nodes of side A have no.*Use node_to_segment, or raise the tol"
    with pytest.raises(InputError, match=told):
        apart.at(0.0)
    with pytest.raises(InputError, match="no rigid placement"):
        Place(2 * np.eye(3), np.zeros(3))
    with pytest.raises(InputError, match="copy_of"):
        copy_of(structure_part(lumped(np.ones(2), np.eye(2))), place_of(turn=0.3))
