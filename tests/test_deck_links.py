"""Equations, rigid bodies, turned supports, point masses, springs and dashpots of decks: closed forms, identities, refusals."""

import re

import numpy as np
import pytest
import scipy

from stickslip import InputError
from stickslip.assembly.locations import Places
from stickslip.assembly.model import Model
from stickslip.assembly.part_copies import copy_of
from stickslip.model import assemble_deck, natural_frequencies, read_deck
from stickslip.model.axis import Axis
from stickslip.model.facts import facts_of_part
from stickslip.model.fe.free_solid import rigid_motions
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.part import Place, solid_part

STEEL = "*MATERIAL, NAME=S\n*ELASTIC\n2.1e11, 0.3\n*DENSITY\n7850.\n*SOLID SECTION, ELSET=E, MATERIAL=S\n"
N = 3  # bricks in a row, each 0.1 x 0.1 x 0.1 m


def bricks(count=N, first=0, start=0.0, turn=None):
    """Return the cards of a row of bricks along x, four nodes a station, numbered from 4 first + 1."""
    nodes, cells = ["*NODE"], ["*ELEMENT, TYPE=C3D8, ELSET=E"]
    for i in range(count + 1):
        for k, (y, z) in enumerate(((0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1))):
            point = np.array([start + 0.1 * i, y, z])
            x, y_, z_ = point if turn is None else turn @ point
            nodes.append(f"{4 * (first + i) + k + 1}, {x:.16g}, {y_:.16g}, {z_:.16g}")
    for i in range(count):
        own = [4 * (first + i) + k for k in (1, 2, 3, 4, 5, 6, 7, 8)]
        cells.append(", ".join(map(str, [first + i + 1, *own])))
    return "\n".join([*nodes, *cells]) + "\n"


ROOT = "*NSET, NSET=R\n1, 2, 3, 4\n*BOUNDARY\nR, 1, 3\n"


def read(tmp_path, text, **options):
    path = tmp_path / "deck.inp"
    path.write_text(text)
    return read_deck(path, **options)


def every_frequency(structure):
    squares = scipy.linalg.eigh(structure.stiffness.toarray(), structure.mass.toarray(), eigvals_only=True)
    return np.sqrt(squares) / (2 * np.pi)


def equations(pairs, factor=1.0, reverse=False):
    """Return equations u_a = u_b for pairs of nodes."""
    lines = ["*EQUATION"]
    for a, b in pairs:
        for d in (1, 2, 3):
            terms = [f"{a}, {d}, {factor}", f"{b}, {d}, {-factor}"]
            lines += ["2", ", ".join(reversed(terms) if reverse else terms)]
    return "\n".join(lines) + "\n"


TWO = bricks(2) + bricks(1, first=3, start=0.2) + STEEL + ROOT  # the second bar starts at node 13, where the first ends
JOINED = [(13 + k, 9 + k) for k in range(4)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return every_frequency(assemble_deck(read(tmp_path_factory.mktemp("whole"), bricks() + STEEL + ROOT)))


def test_two_bars_joined_by_equations_are_one_bar(tmp_path, whole):
    joined = assemble_deck(read(tmp_path, TWO + equations(JOINED)))
    assert joined.n == whole.size
    np.testing.assert_allclose(every_frequency(joined), whole, rtol=1e-10)


@pytest.mark.parametrize(("factor", "reverse"), [(-7.3e5, False), (1.0, True)])
def test_a_factor_and_the_order_of_the_terms_change_nothing(tmp_path, whole, factor, reverse):
    joined = assemble_deck(read(tmp_path, TWO + equations(JOINED, factor, reverse)))
    np.testing.assert_allclose(every_frequency(joined), whole, rtol=1e-10)


def test_chains_and_surplus_equations(tmp_path, whole):
    """Node 13 follows 9 twice over, and node 14 follows 10 through a node without elements."""
    chain = equations([(14, 99), (99, 10), *JOINED[:1], *JOINED[2:], (9, 13)])
    joined = assemble_deck(read(tmp_path, TWO + "*NODE\n99, 7., 7., 7.\n" + chain))
    np.testing.assert_allclose(every_frequency(joined), whole, rtol=1e-10)


def test_surplus_and_holding_equations_are_told(tmp_path):
    deck = read(tmp_path, TWO + equations([*JOINED, (9, 13)]))
    assert len(deck.told) == 1
    assert deck.told[0].startswith("3 equations follow from others and the supports (")
    deck = read(tmp_path, bricks() + STEEL + ROOT + "*EQUATION\n2\n5, 1, 1., 9, 1, -1.\n2\n5, 1, 1., 9, 1, -2.\n")
    assert deck.told[0].startswith("1 equations hold a node, together with others and the supports (")
    assert assemble_deck(deck).n == 36 - 2


def test_equations_against_lagrange_multipliers(tmp_path):
    """The stationary values of the constrained quotient, from the null space of the equations by SVD."""
    rows = "*EQUATION\n3\n5, 1, 1., 13, 1, -2., 9, 2, 0.5\n2\n13, 3, 1., 14, 2, 3.\n"
    deck = read(tmp_path, bricks() + STEEL + ROOT + rows)
    free = assemble_deck(read(tmp_path, bricks() + STEEL + ROOT))
    table = {(n, c): i for i, (n, c) in enumerate(zip(free.dofs.node, free.dofs.component, strict=True))}
    matrix = np.zeros((2, free.n))
    for i, terms in enumerate(([(5, "x", 1), (13, "x", -2), (9, "y", 0.5)], [(13, "z", 1), (14, "y", 3)])):
        for n, c, value in terms:
            matrix[i, table[n, c]] = value
    null = scipy.linalg.null_space(matrix)
    mass, stiffness = (null.T @ m.toarray() @ null for m in (free.mass, free.stiffness))
    expected = np.sqrt(scipy.linalg.eigh(stiffness, mass, eigvals_only=True)) / (2 * np.pi)
    np.testing.assert_allclose(every_frequency(assemble_deck(deck)), expected, rtol=1e-10)


def test_joined_bars_turn_as_one_bar(tmp_path):
    """Load, stress stiffness, spin softening and Coriolis matrix of the joined bars are those of the whole one."""
    axis = Axis((0.0, 0.0, 1.0), (-0.3, 0.0, 0.0))
    found = []
    for text in (bricks() + STEEL + ROOT, TWO + equations(JOINED)):
        deck = read(tmp_path, text)
        solid = rotating_solid(deck.mesh, deck.material, axis, quadrature=deck.quadrature, links=deck.links)
        state = solid.at_speed(3000.0, coriolis=True)
        n = state.n
        first = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [
                    -scipy.linalg.solve(state.mass.toarray(), m)
                    for m in (state.stiffness.toarray(), state.damping.toarray())
                ],
            ]
        )
        exact = solid.displacement(3000.0, nonlinear=True)
        found.append((np.sort(np.abs(np.linalg.eigvals(first).imag)), np.abs(solid.at_nodes(exact)).max()))
    np.testing.assert_allclose(found[1][0], found[0][0], rtol=1e-7)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=1e-8)


SPRINGS = "*ELEMENT, TYPE=SPRING1, ELSET=SP{d}\n{rows}\n*SPRING, ELSET=SP{d}\n{d}\n{k}\n"


def grounded(corners, k=1e6):
    out = ""
    for d in (1, 2, 3):
        rows = "\n".join(f"{100 * d + c}, {c}" for c in corners)
        out += SPRINGS.format(d=d, rows=rows, k=k)
    return out


def test_a_rigid_block_on_springs(tmp_path):
    """A rigid cube of side a on equal springs along x, y, z at its corners: 8 k / m and 24 k / m.

    About an axis the eight corners have sum(r^2) = 8 a^2/2 = 4 a^2, and the inertia is m a^2/6: 24 k / m.
    """
    k, mass = 1e6, 7850 * 1e-3
    text = bricks(1) + STEEL + "*NODE\n50, 0.3, 0.2, 0.1\n*NSET, NSET=ALL\n1, 2, 3, 4, 5, 6, 7, 8\n"
    text += "*RIGID BODY, NSET=ALL, REF NODE=50, ROT NODE=51\n*NODE\n51, 0., 0., 0.\n" + grounded(range(1, 9), k)
    structure = assemble_deck(read(tmp_path, text))
    assert structure.n == 6
    expected = np.sqrt(np.array([8, 8, 8, 24, 24, 24]) * k / mass) / (2 * np.pi)
    np.testing.assert_allclose(every_frequency(structure), expected, rtol=1e-9)


def test_a_held_rotation_node_leaves_translations(tmp_path):
    text = bricks(1) + STEEL + "*NODE\n50, 0.3, 0.2, 0.1\n51, 0., 0., 0.\n*NSET, NSET=ALL\n1, 2, 3, 4, 5, 6, 7, 8\n"
    text += "*RIGID BODY, NSET=ALL, REF NODE=50, ROT NODE=51\n*BOUNDARY\n51, 1, 3\n" + grounded(range(1, 9))
    found = every_frequency(assemble_deck(read(tmp_path, text)))
    np.testing.assert_allclose(found, np.sqrt(8e6 / 7.85) / (2 * np.pi) * np.ones(3), rtol=1e-9)
    by_reference = text.replace("51, 1, 3\n", "50, 4, 6\n")
    np.testing.assert_allclose(every_frequency(assemble_deck(read(tmp_path, by_reference))), found, rtol=1e-12)


def test_a_coupling_is_a_rigid_body_of_its_surface(tmp_path):
    text = bricks() + STEEL + ROOT + "*NODE\n50, 0.4, 0.05, 0.05\n*NSET, NSET=END\n13, 14, 15, 16\n"
    text += "*ELEMENT, TYPE=MASS, ELSET=M\n90, 50\n*MASS, ELSET=M\n2.5\n"
    coupled = (
        text + "*SURFACE, NAME=S1, TYPE=NODE\nEND\n*COUPLING, CONSTRAINT NAME=C, REF NODE=50, SURFACE=S1\n*KINEMATIC\n"
    )
    rigid = text + "*RIGID BODY, NSET=END, REF NODE=50\n"
    found = [every_frequency(assemble_deck(read(tmp_path, one))) for one in (coupled, rigid, coupled + "1, 3\n")]
    np.testing.assert_allclose(found[0], found[1], rtol=1e-12)
    np.testing.assert_allclose(found[2], found[1], rtol=1e-12)
    structure = assemble_deck(read(tmp_path, rigid))
    assert [c for n, c in zip(structure.dofs.node, structure.dofs.component, strict=True) if n == 50] == ["x", "y", "z"]


def test_a_point_mass_on_a_spring(tmp_path):
    """A mass beside the structure on a spring along its own line, held in the other directions."""
    text = bricks(1) + STEEL + ROOT + "*BOUNDARY\n5, 1, 3\n6, 1, 3\n7, 1, 3\n*NODE\n50, 3.0, 4.0, 0.1\n"
    text = text.replace("5, 1, 3\n", "5, 1, 3\n50, 3\n") + "*ELEMENT, TYPE=MASS, ELSET=M\n90, 50\n*MASS, ELSET=M\n2.\n"
    text += "*ELEMENT, TYPE=SPRINGA, ELSET=SP\n91, 4, 50\n*SPRING, ELSET=SP\n\n8000.\n"
    text += "*TRANSFORM, NSET=M50, TYPE=R\n3.0, 4.0, 0.0, -4.0, 3.0, 0.0\n*NSET, NSET=M50\n50\n*BOUNDARY\n50, 2, 2\n"
    text = text.replace("50, 3\n", "").replace("50, 2, 2\n", "50, 2, 3\n")
    found = every_frequency(assemble_deck(read(tmp_path, text)))
    # node 4 is the origin of the spring at (0, 0, 0.1)
    np.testing.assert_allclose(found[0], np.sqrt(8000.0 / 2.0) / (2 * np.pi), rtol=1e-9)


def test_negative_springs_and_dashpots_are_told(tmp_path):
    text = bricks(1) + STEEL + ROOT + "*ELEMENT, TYPE=SPRING1, ELSET=SP\n91, 5\n*SPRING, ELSET=SP\n3\n-8000.\n"
    text += "*ELEMENT, TYPE=DASHPOTA, ELSET=D\n92, 5, 6\n*DASHPOT, ELSET=D\n\n-3.\n"
    spring, dashpot = read(tmp_path, text).told
    assert re.fullmatch(r"the stiffness -8000 is negative \(.*: line \d+\): it pushes away from rest", spring)
    assert re.fullmatch(r"the damping -3 is negative \(.*: line \d+\): it feeds vibration", dashpot)


def test_supports_in_turned_axes(tmp_path):
    """A bar and its supports, turned together, have the frequencies of the bar with supports along x, y, z."""
    turn = scipy.spatial.transform.Rotation.from_rotvec([0.3, -0.5, 0.8]).as_matrix()
    plain = bricks() + STEEL + "*NSET, NSET=R\n1, 2, 3, 4\n*BOUNDARY\nR, 1\n1, 2, 3\n2, 3\n16, 2\n"
    ends = ", ".join(f"{v:.16g}" for v in np.concatenate([turn[:, 0], turn[:, 1]]))
    axes = f"*NSET, NSET=A, GENERATE\n1, 16\n*TRANSFORM, NSET=A\n{ends}\n"
    turned = bricks(turn=turn) + STEEL + axes + plain[plain.index("*NSET, NSET=R") :]
    found = [every_frequency(assemble_deck(read(tmp_path, text))) for text in (plain, turned)]
    assert len(found[0]) == len(found[1]) == 48 - 8
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


def test_cylindrical_axes_are_those_of_each_node(tmp_path):
    """Node 14 lies at (0.3, 0.1): held along its circle, it moves along its radius."""
    text = (
        bricks()
        + STEEL
        + ROOT
        + "*NSET, NSET=A\n14\n*TRANSFORM, NSET=A, TYPE=C\n0., 0., 0., 0., 0., 1.\n*BOUNDARY\n14, 2\n"
    )
    deck = read(tmp_path, text)
    solid = rotating_solid(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    row = solid.onto[3 * 13 : 3 * 13 + 3].toarray()
    used = np.flatnonzero(np.abs(row[:2]).any(axis=0))
    assert used.size == 1
    np.testing.assert_allclose(row[1, used] / row[0, used], 0.1 / 0.3, rtol=1e-12)


def test_dashpots_are_damping(tmp_path):
    text = bricks() + STEEL + ROOT + "*ELEMENT, TYPE=DASHPOTA, ELSET=D\n91, 13, 15\n*DASHPOT, ELSET=D\n\n30.\n"
    structure = assemble_deck(read(tmp_path, text))
    along = np.array([0.0, 1.0, 1.0]) / np.sqrt(2)
    row = np.zeros(structure.n)
    for node, sign in ((13, -1.0), (15, 1.0)):
        row[structure.dofs.node == node] = sign * along
    np.testing.assert_allclose(structure.damping.toarray(), 30.0 * np.outer(row, row), atol=1e-12)


def test_a_copy_of_joined_bars_is_joined(tmp_path, whole):
    deck = read(tmp_path, TWO + equations(JOINED))
    part = solid_part(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    turn = scipy.spatial.transform.Rotation.from_rotvec([0.0, 0.0, 0.7]).as_matrix()
    moved = copy_of(part, Place(turn, np.array([0.0, 0.0, 1.0])))
    np.testing.assert_allclose(natural_frequencies(moved.structure, 4), whole[:4], rtol=1e-8)
    q = np.arange(part.structure.n, dtype=float)
    back = np.linalg.lstsq(moved.solid.onto.toarray(), (part.solid.at_nodes(q) @ turn.T).ravel(), rcond=None)
    assert back[1].max(initial=0.0) < 1e-18 * np.sum(q**2)


@pytest.mark.parametrize(
    ("kind", "rows"),
    [
        ("STRAIGHT, 1, 13, 5, 9", {"y": [(5, 2 / 3, 1 / 3), (9, 1 / 3, 2 / 3)]}),
        ("PLANE, 1, 4, 13, 9", {"y": [(9, 1 / 3, 2 / 3)]}),
    ],
)
def test_multi_point_constraints_hold_nodes_on_lines_and_planes(tmp_path, kind, rows):
    deck = read(tmp_path, bricks() + STEEL + "*MPC\n" + kind + "\n")
    solid = rotating_solid(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    rng = np.random.default_rng(3)
    moved = solid.at_nodes(rng.normal(size=solid.structure.n))
    for node, first, last in rows["y"]:
        np.testing.assert_allclose(moved[node - 1, 1], first * moved[0, 1] + last * moved[12, 1], rtol=1e-12)
    assert solid.structure.n == 48 - (4 if kind.startswith("S") else 1)


def test_a_beam_of_calculix_keeps_a_distance(tmp_path):
    deck = read(tmp_path, bricks() + STEEL + "*MPC\nBEAM, 5, 11\n")
    solid = rotating_solid(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    moved = solid.at_nodes(np.random.default_rng(3).normal(size=solid.structure.n))
    along = deck.mesh.points[10] - deck.mesh.points[4]
    assert abs((moved[10] - moved[4]) @ along) < 1e-14


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("*EQUATION\n3\n5, 1, 1., 9, 1, -1.\n", r"line 33: announces 3 terms and has 6 numbers"),
        ("*EQUATION\n2\n5, 7, 1., 9, 1, -1.\n", "the direction 7"),
        ("*EQUATION\n2\n5, 1, , 9, 1, -1.\n", "the coefficient '' is no finite number"),
        (
            "*EQUATION\n2\n5, 1, 1., 9, 1, -1.\n*NSET, NSET=B\n5\n*TRANSFORM, NSET=B\n1., 1., 0., 0., 1., 0.\n",
            "turns the axes of node 5, which a line above supports or ties",
        ),
        (
            "*EQUATION\n2\n5, 4, 1., 9, 1, -1.\n",
            r"\*EQUATION: names the rotation 4 of node 5, which is no reference node",
        ),
        ("*EQUATION\n2\nR, 1, 1., 9, 1, -1.\n", "'R' has 4 nodes"),
        ("*EQUATION, REMOVE\n5, 1\n", "the parameter REMOVE is not read"),
        (
            "*MPC\nMEANROT, 5, 6, 7\n",
            r"line 33, \*MPC: an MPC of type MEANROT ties nodes and is not read. Read are PLANE, STRAIGHT, BEAM",
        ),
        ("*MPC\nSTRAIGHT, 5, 9, 14\n", r"node 14 does not lie on the straight line of nodes \[5, 9\]"),
        ("*RIGID BODY, NSET=R\n", "lacks the parameter REF NODE"),
        ("*RIGID BODY, NSET=R, REF NODE=1, TIE NSET=R\n", "the parameter TIE NSET is not read"),
        (
            "*COUPLING, REF NODE=1, SURFACE=A\n*DISTRIBUTING\n",
            r"line 33, \*DISTRIBUTING: is read in decks of Abaqus for surfaces of nodes alone",
        ),
        (
            "*NSET, NSET=B\n1\n*TRANSFORM, NSET=B\n1., 1., 0., 0., 1., 0.\n",
            r"\*TRANSFORM: turns the axes of node 1, which a line above supports or ties",
        ),
        ("*NSET, NSET=B\n9\n*TRANSFORM, NSET=B\n1., 0., 0., 2., 0., 0.\n", "gives a node at .* no axes"),
        ("*ELEMENT, TYPE=SPRING2, ELSET=A\n90, 5, 6\n*SPRING, ELSET=A\n1\n3.\n", "gives the directions .1."),
        (
            "*ELEMENT, TYPE=SPRINGA, ELSET=A\n90, 5, 6\n*SPRING, ELSET=A, NONLINEAR\n1., 0.\n",
            "the parameter NONLINEAR is not read",
        ),
        ("*ELEMENT, TYPE=SPRINGA, ELSET=A\n90, 5, 6\n*SPRING, ELSET=A\n\n1.\n2.\n", "has 2 lines of data, 1 expected"),
        ("*ELEMENT, TYPE=MASS, ELSET=A\n90, 5\n*SPRING, ELSET=A\n\n1.\n", r"its set has elements \['MASS'\]"),
    ],
)
def test_what_is_wrong_is_named_by_line(tmp_path, more, message):
    with pytest.raises(InputError, match=message):
        assemble_deck(read(tmp_path, bricks() + STEEL + ROOT + more))


def test_steady_rotation_of_a_rigid_body_is_refused_by_line(tmp_path):
    text = bricks() + STEEL + ROOT + "*NODE\n50, 0.4, 0.05, 0.05\n*NSET, NSET=END\n13, 14, 15, 16\n"
    deck = read(tmp_path, text + "*RIGID BODY, NSET=END, REF NODE=50\n")
    solid = rotating_solid(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    solid.at_speed(0.0)
    for turning in (lambda: solid.at_speed(10.0), solid.polynomial, lambda: solid.displacement(1.0)):
        with pytest.raises(InputError, match=r"line 36, \*RIGID BODY: a rigid body: right for small rotations"):
            turning()


def test_nodes_of_cyclic_faces_do_not_follow(tmp_path):
    deck = read(tmp_path, bricks() + STEEL + ROOT + equations([(9, 13)]))
    links = deck.links
    for lasting, gone in (([12], 8), ([8], 12)):
        kept = type(links)(
            links.equations, links.places, links.mass, links.springs, links.dashpots, "", np.array(lasting)
        )
        solid = rotating_solid(deck.mesh, deck.material, links=kept)
        assert deck.mesh.numbers[gone] not in solid.structure.dofs.node
    kept = type(links)(links.equations, links.places, links.mass, links.springs, links.dashpots, "", np.array([8, 12]))
    with pytest.raises(InputError, match=r"line 33, \*EQUATION: ties nodes of the cyclic faces"):
        rotating_solid(deck.mesh, deck.material, links=kept)


def block(first, start, count, side=0.1):
    """Return cards of bricks that fill a cube with `count` bricks along y and z, one along x; numbers begin after `first`."""
    nodes, cells, place = ["*NODE"], ["*ELEMENT, TYPE=C3D8, ELSET=E"], {}
    for i, j, k in np.ndindex(2, count + 1, count + 1):
        place[i, j, k] = first + len(place) + 1
        x, y, z = start + side * i, side * j / count, side * k / count
        nodes.append(f"{place[i, j, k]}, {x:.16g}, {y:.16g}, {z:.16g}")
    for n, (j, k) in enumerate(np.ndindex(count, count)):
        own = [place[i, j + b, k + c] for c in (0, 1) for i, b in ((0, 0), (1, 0), (1, 1), (0, 1))]
        cells.append(", ".join(map(str, [first + n + 1, *own])))
    ends = f"*ELSET, ELSET=B{first}, GENERATE\n{first + 1}, {first + count**2}\n"
    ends += f"*SURFACE, NAME=L{first}\nB{first}, S6\n*SURFACE, NAME=H{first}\nB{first}, S4\n"
    return "\n".join([*nodes, *cells]) + "\n" + ends


def tied(slave, master, options="", gap=0.0):
    return block(0, 0.0, 2) + block(100, 0.1 + gap, 3) + STEEL + f"*TIE, NAME=T{options}\n{slave}, {master}\n"


def test_tied_faces_that_match_are_one_mesh(tmp_path):
    """Two cubes of four bricks each, tied, have the frequencies of the two with common nodes."""
    held = "*NSET, NSET=A, GENERATE\n1, 9\n*BOUNDARY\nA, 1, 3\n"
    text = block(0, 0.0, 2) + block(100, 0.1, 2) + STEEL + held
    joined = every_frequency(assemble_deck(read(tmp_path, text + "*TIE, NAME=T\nL100, H0\n")))
    common = text + equations([(101 + k, 10 + k) for k in range(9)])
    np.testing.assert_allclose(joined, every_frequency(assemble_deck(read(tmp_path, common))), rtol=1e-10)


@pytest.mark.parametrize(("slave", "master"), [("L100", "H0"), ("H0", "L100")])
def test_a_tie_of_faces_that_do_not_match_carries_linear_fields(tmp_path, slave, master):
    """Rigid motions and constant strains stay free of contradiction: independent nodes that move so take the others along."""
    deck = read(tmp_path, tied(slave, master))
    solid = rotating_solid(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    gradient = np.random.default_rng(1).normal(size=(3, 3))
    field = deck.mesh.points @ gradient.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(solid.at_nodes(field.ravel()[solid.moving]), field, atol=1e-12)


def test_a_gap_within_the_tolerance_is_closed(tmp_path):
    deck = read(tmp_path, tied("L100", "H0", ", POSITION TOLERANCE=0.002", gap=0.001))
    assert set(deck.mesh.points[:, 0].round(12)) == {0.0, 0.1, 0.201}
    kept = read(tmp_path, tied("L100", "H0", ", POSITION TOLERANCE=0.002, ADJUST=NO", gap=0.001))
    assert set(kept.mesh.points[:, 0].round(12)) == {0.0, 0.1, 0.101, 0.201}
    with pytest.raises(InputError, match=r"no node of 'L100' lies within 0\.0005 of 'H0'\. Correct the surfaces"):
        read(tmp_path, tied("L100", "H0", ", POSITION TOLERANCE=0.0005", gap=0.001))


def test_a_negative_tolerance_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"line \d+, \*TIE: the POSITION TOLERANCE -0\.002 is negative"):
        read(tmp_path, tied("L100", "H0", ", POSITION TOLERANCE=-0.002", gap=0.001))


def test_nodes_beyond_the_tolerance_are_told(tmp_path):
    text = tied("L100", "H0").replace("*NODE\n101, 0.1,", "*NODE\n101, 0.12,")
    deck = read(tmp_path, text)
    assert deck.ignored[0].startswith("the tie of 1 of 16 nodes of L100, which lie further than 0.00125 from H0 (")


def test_a_distributing_coupling_moves_as_the_mean(tmp_path):
    """Rigid motions of the nodes take the reference node along; any motion gives it the mean momentum and moment of momentum."""
    text = (
        "*PREPRINT, ECHO=NO\n"
        + bricks()
        + STEEL
        + ROOT
        + "*NODE\n50, 0.5, 0.1, -0.02\n*NSET, NSET=END\n13, 14, 15, 10\n"
    )
    text += "*ELEMENT, TYPE=MASS, ELSET=M\n90, 50\n*MASS, ELSET=M\n2.5\n*SURFACE, NAME=S1, TYPE=NODE\nEND\n"
    deck = read(tmp_path, text + "*COUPLING, CONSTRAINT NAME=C, REF NODE=50, SURFACE=S1\n*DISTRIBUTING\n")
    solid = rotating_solid(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    moved = solid.at_nodes(np.random.default_rng(5).normal(size=solid.structure.n))
    row = {int(n): i for i, n in enumerate(deck.mesh.numbers)}
    nodes = [row[n] for n in (13, 14, 15, 10)]
    arms = deck.mesh.points[nodes] - deck.mesh.points[nodes].mean(axis=0)
    inertia = sum(np.dot(r, r) * np.eye(3) - np.outer(r, r) for r in arms)
    spin = np.linalg.solve(inertia, np.cross(arms, moved[nodes]).sum(axis=0))
    away = deck.mesh.points[row[50]] - deck.mesh.points[nodes].mean(axis=0)
    np.testing.assert_allclose(moved[row[50]], moved[nodes].mean(axis=0) + np.cross(spin, away), rtol=1e-9)
    # the mass lies on the bar through that operator
    free = assemble_deck(read(tmp_path, bricks() + STEEL + ROOT))
    operator = np.zeros((3, free.n))
    table = {(int(n), c): i for i, (n, c) in enumerate(zip(free.dofs.node, free.dofs.component, strict=True))}
    for node, arm in zip((13, 14, 15, 10), arms, strict=True):
        for k in range(3):
            unit = np.eye(3)[k]
            operator[:, table[node, "xyz"[k]]] = unit / 4 + np.cross(
                np.linalg.solve(inertia, np.cross(arm, unit)), away
            )
    mass = free.mass.toarray() + 2.5 * operator.T @ operator
    expected = np.sqrt(scipy.linalg.eigh(free.stiffness.toarray(), mass, eigvals_only=True)) / (2 * np.pi)
    np.testing.assert_allclose(every_frequency(assemble_deck(deck)), expected, rtol=1e-9)


def test_a_support_along_a_global_axis_of_turned_axes_is_plain(tmp_path):
    text = (
        bricks()
        + STEEL
        + ROOT
        + "*NSET, NSET=A\n14\n*TRANSFORM, NSET=A, TYPE=C\n0., 0., 0., 0., 0., 1.\n*BOUNDARY\n14, 3\n"
    )
    deck = read(tmp_path, text)
    assert deck.links is None
    assert deck.held[13].tolist() == [False, False, True]


def test_places_on_nodes_that_follow_are_refused_by_name(tmp_path):
    deck = read(
        tmp_path, TWO + "*NSET, NSET=SEAM\n13, 14, 15, 16\n*NSET, NSET=TIP\n17, 18, 19, 20\n" + equations(JOINED)
    )
    part = solid_part(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    places = Places({"bar": part})
    assert set(part.structure.dofs.node) == set(range(5, 9)) | set(range(13, 21))
    assert places.spot("bar.SEAM", "load.a.on").surface is not None
    for name in ("bar.node9", "bar.node9.x"):
        with pytest.raises(InputError, match=f"load.a.on: some directions of '{name}' follow others by equations"):
            places.spot(name, "load.a.on")
    other = solid_part(
        deck.mesh, deck.material, links=type(deck.links)(**{**vars(deck.links), "lasting": np.arange(8, 12)})
    )
    with pytest.raises(InputError, match=r"contact.a: 4 nodes of 'bar.SEAM', e.g. node 13, follow others by equations"):
        Places({"bar": other}).spot("bar.SEAM", "contact.a")


def test_hourglass_control_of_the_deck_is_told(tmp_path):
    text = bricks().replace("C3D8", "C3D8R") + STEEL + ROOT + "*SECTION CONTROLS, NAME=EC, HOURGLASS=ENHANCED\n"
    assert read(tmp_path, text).ignored == (
        "*SECTION CONTROLS (deck.inp: line 32): give the factor of hourglass control of C3D8R in the study",
    )


def test_point_masses_count_and_rigid_bodies_do_not_turn(tmp_path):
    text = bricks() + STEEL + ROOT + "*NODE\n50, 0.4, 0.05, 0.05\n*NSET, NSET=END\n13, 14, 15, 16\n"
    text += "*ELEMENT, TYPE=MASS, ELSET=M\n90, 50\n*MASS, ELSET=M\n2.5\n*RIGID BODY, NSET=END, REF NODE=50\n"
    deck = read(tmp_path, text)
    part = solid_part(deck.mesh, deck.material, quadrature=deck.quadrature, links=deck.links)
    own = 0.3 * 0.1 * 0.1 * 7850
    facts = facts_of_part(part)
    np.testing.assert_allclose(facts.mass, own + 2.5, rtol=1e-12)
    np.testing.assert_allclose(facts.centre[0], (own * 0.15 + 2.5 * 0.4) / (own + 2.5), rtol=1e-12)
    Model(parts={"bar": part})
    with pytest.raises(InputError, match=r"\*RIGID BODY: a rigid body: right for small rotations alone"):
        Model(parts={"bar": part}, speed=10.0)


def test_a_massless_direction_without_stiffness_is_left_out(tmp_path):
    """One coupled node turns its reference node freely: the direction that only that rotation followed is no dof."""
    text = (
        bricks() + STEEL + ROOT + "*NODE\n50, 0.4, 0.05, 0.05\n*NSET, NSET=END\n13\n*SURFACE, NAME=S1, TYPE=NODE\nEND\n"
    )
    coupled = text + "*COUPLING, CONSTRAINT NAME=C, REF NODE=50, SURFACE=S1\n*KINEMATIC\n1, 1\n3, 3\n"
    found = every_frequency(assemble_deck(read(tmp_path, coupled)))
    np.testing.assert_allclose(found, every_frequency(assemble_deck(read(tmp_path, text))), rtol=1e-12)


def test_a_point_mass_that_nothing_holds_moves_at_no_frequency(tmp_path):
    text = (
        bricks()
        + STEEL
        + ROOT
        + "*NODE\n50, 0.4, 0.05, 0.05\n*ELEMENT, TYPE=MASS, ELSET=M\n90, 50\n*MASS, ELSET=M\n2.5\n"
    )
    text += "*NSET, NSET=END\n13, 14, 15, 16\n*SURFACE, NAME=S1, TYPE=NODE\nEND\n"
    text += "*COUPLING, CONSTRAINT NAME=C, REF NODE=50, SURFACE=S1\n*KINEMATIC\n1\n3\n"
    deck = read(tmp_path, text)
    solid = rotating_solid(deck.mesh, *deck.materials.values(), Axis(), clamped=("root",), links=deck.links)
    assert rigid_motions(solid).shape[1] == 0


@pytest.mark.parametrize(
    ("cards", "said"),
    [
        ("*EQUATION\n2\n5, 1, 1., 77, 1, -1.\n", "line 34: names node 77, which the deck lacks"),
        (
            "*SURFACE, NAME=S1, TYPE=NODE\nR\n*COUPLING, CONSTRAINT NAME=C, REF NODE=5, SURFACE=S1\n*KINEMATIC\n7\n",
            "line 36: the directions 7 to 7",
        ),
        ("*ELEMENT, TYPE=MASS, ELSET=M\n90, 5\n*MASS, ELSET=M\n-2.5\n", "the mass -2.5"),
        # ccx 2.20 takes the last mass alone, and a spring along the global direction
        ("*ELEMENT, TYPE=MASS, ELSET=M\n90, 5\n" + 2 * "*MASS, ELSET=M\n2.5\n", "gives element 90 a second"),
        (
            (
                "*NSET, NSET=T\n5\n*TRANSFORM, NSET=T\n1., 2., 0., -2., 1., 0.\n"
                "*ELEMENT, TYPE=SPRING1, ELSET=P\n90, 5\n*SPRING, ELSET=P\n2\n1.E8\n"
            ),
            "along a direction of node 5, whose axes",
        ),
    ],
)
def test_what_no_structure_has_is_refused_by_line(tmp_path, cards, said):
    with pytest.raises(InputError, match=said):
        read(tmp_path, bricks() + STEEL + ROOT + cards)


def test_an_element_without_its_mass_is_told(tmp_path):
    deck = read(tmp_path, bricks() + STEEL + ROOT + "*ELEMENT, TYPE=MASS, ELSET=M\n90, 5\n")
    assert deck.ignored == ("elements MASS without *MASS: 1, e.g. 90",)
