"""Mistuned wheels: all sectors of a model, against one sector, an assembly of one's own, and the literature."""

import math
from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from newton_bounds import allowed
from test_assembly_wheel import (
    LAW,
    ORDER,
    RADII,
    SECTORS,
    STEEL,
    H,
    answered,
    dofs_of,
    sector_model,
    shrouded_sector,
    whole_wheel,
    whole_with_gaps,
)

import stickslip as ss
from stickslip.assembly import BladeMistuning, ContactMistuning, Mistuning, OwnSector, pattern
from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact
from stickslip.assembly.joints.pairs import at_rest
from stickslip.assembly.sides.deviations import Blade, blade_alone, blade_alone_hz
from stickslip.assembly.sides.mistuned import changed, wheel_modes
from stickslip.contact.interface import Interface
from stickslip.errors import InputError
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.mistuned import MistunedStiffness
from stickslip.harmonic.travelling import condense_side
from stickslip.model.axis import Axis
from stickslip.model.damping import rayleigh_damping
from stickslip.model.fe.rotation import rotating_solid
from stickslip.model.fe.solid import Material
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.modes import natural_frequencies
from stickslip.model.part import solid_part
from stickslip.reduction.contact_coordinates import in_relative_coordinates
from stickslip.reduction.mistuned import MistunedWheel
from stickslip.response.system import System
from stickslip.study.models.study import read_study

DEVIATIONS = np.array([0.03, -0.05, 0.02, 0.06, -0.04])
FRICTION = np.array([0.0, 0.5, -0.3, 0.2, -0.4])


@pytest.mark.parametrize("modes", [None, 4])
def test_without_deviations_all_sectors_do_what_one_does(modes):
    """Slip and lift-off, two harmonics of excitation, rotation."""
    law = replace(LAW, preload=20.0)
    model = sector_model(shrouded_sector())
    model = replace(model, contacts={"shroud": replace(model.contacts["shroud"], law=law)})
    even = BladeMistuning(of="blade", deviations=np.zeros(SECTORS), modes=modes)
    none = Mistuning(blades={"all": even})
    wheel, tuned = assemble(replace(model, mistuning=none), H), assemble(model, H)
    assert wheel.output_labels[4] == "tip[1].y"
    assert np.allclose(wheel.static_force.reshape(SECTORS, -1, 3), tuned.static_force, rtol=1e-9)
    hertz = (2140.0, 2200.0)
    every, one = (answered(wheel.system, wheel.load, hertz), answered(tuned.system, tuned.load, hertz))
    for all_of_them, mine in zip(every, one, strict=True):
        assert mine.energy.max() > 1e-4  # slips
        assert mine.forces[0, :, 2].max() > -20.0  # a point is open for a part of the period
        for h in range(H + 1):
            phase = np.exp(2j * math.pi * h * ORDER * np.arange(SECTORS) / SECTORS)
            for name in ("gaps", "outputs"):
                theirs = getattr(all_of_them, name)[h].reshape(SECTORS, -1)
                own = getattr(mine, name)
                apart = np.abs(theirs - phase[:, None] * own[h].ravel()).max()
                assert apart <= allowed(name, all_of_them, mine)


def assembled_wheel(mesh, model, matrices):
    """Return the dofs of all sectors in one table and matrices of sectors in their own axes put together: no waves, no reduction."""
    whole, nodes = whole_wheel(mesh)
    full = rotating_solid(whole, STEEL).structure
    own = model.parts["blade"].structure
    place = {(int(n), c): i for i, (n, c) in enumerate(zip(own.dofs.node, own.dofs.component, strict=True))}
    members = np.unique(own.dofs.node)
    rows = np.array([[place[int(n), c] for c in "xyz"] for n in members])
    out = scipy.sparse.csr_array((full.n, full.n))
    for s, matrix in enumerate(matrices):
        turn = Axis().rotation(2 * math.pi * s / SECTORS)
        columns = dofs_of(full, nodes[s, members])
        blocks = np.broadcast_to(turn, (len(rows), 3, 3))
        at = (np.repeat(rows[:, :, None], 3, 2), np.repeat(columns[:, None, :], 3, 1))
        into = scipy.sparse.csr_array(
            (blocks.transpose(0, 2, 1).ravel(), (at[0].ravel(), at[1].ravel())), shape=(own.n, full.n)
        )
        out = out + into.T @ matrix @ into
    return full, nodes, scipy.sparse.csr_array(out)


def mistuned_model():
    model = replace(sector_model(shrouded_sector()), speed=0.0)
    mistuning = Mistuning(
        blades={"blade": BladeMistuning(of="blade", deviations=DEVIATIONS)},
        contacts={"worn": ContactMistuning(contact="shroud", quantity="friction_coefficient", values=FRICTION)},
    )
    return replace(model, mistuning=mistuning)


def test_a_mistuned_wheel_answers_as_its_sectors_assembled_one_by_one():
    """Stiffness of each sector times (1 + d)², friction of each interface its own; the whole wheel is put together from the sectors."""
    model = mistuned_model()
    found = assemble(model, H)
    mesh, own = model.parts["blade"].mesh, model.parts["blade"].structure
    full, nodes, stiffness = assembled_wheel(mesh, model, [(1 + d) ** 2 * own.stiffness for d in DEVIATIONS])
    damped = rayleigh_damping(full, 0.003, (500.0, 3000.0))
    structure = replace(damped, stiffness=stiffness)
    _, gaps = whole_with_gaps(model)
    laws = tuple(replace(LAW, mu=LAW.mu * (1 + f)) for f in FRICTION for _ in range(6))
    tip = mesh.node_sets["tip"]
    force = {h: np.zeros(full.n, dtype=complex) for h in (1, 2)}
    static, seen = np.zeros(full.n), []
    for s in range(SECTORS):
        turn = Axis().rotation(2 * math.pi * s / SECTORS)
        here = dofs_of(full, nodes[s, tip])
        unit = np.array([0.2, 1, 0.3]) / np.linalg.norm([0.2, 1, 0.3])
        theta = 2 * math.pi * ORDER * s / SECTORS
        force[1][here] += turn @ unit * 1000.0 * np.exp(1j * theta)
        force[2][here] += turn @ np.array([1.0, 0, 0]) * 300.0 * np.exp(1j * (0.4 + 2 * theta))
        static[here] += turn @ np.array([0, 1, 1]) / math.sqrt(2) * 7.5
        seen.append(here[0])
    small, operator = in_relative_coordinates(structure, gaps)
    interface = Interface(tuple(map(str, range(30))), laws, operator)
    shown = small.basis.tocsr()[np.concatenate(seen)]
    assert np.array_equal(shown.data, np.ones(3 * SECTORS))  # tips are coordinates of their own
    system = System(small, interface, shown.indices)
    hertz = (2140.0, 2142.0)
    mine = answered(found.system, found.load, hertz)
    theirs = answered(
        system, HarmonicLoad(small.project(static), {h: small.project(f) for h, f in force.items()}), hertz
    )
    for one, other in zip(mine, theirs, strict=True):
        assert one.energy.max() > 1e-5
        spread = np.abs(one.outputs[1].reshape(SECTORS, 3)).max(axis=1)
        assert spread.max() > 1.2 * spread.min()  # mistuned indeed
        assert np.abs(one.gaps - other.gaps).max() <= allowed("gaps", one, other)
        for s in range(SECTORS):
            back = Axis().rotation(-2 * math.pi * s / SECTORS)
            there = other.outputs[:, 3 * s : 3 * s + 3] @ back.T
            apart = np.abs(one.outputs[:, 3 * s : 3 * s + 3] - there).max()
            assert apart <= math.sqrt(3) * allowed("outputs", one, other)  # of one turned, the length


def test_all_modes_of_a_blade_are_the_whole_blade_and_a_common_deviation_scales_its_frequencies():
    """Component modes become the nominal ones; both take what the blade does beyond the static motion by its root."""
    model = replace(sector_model(shrouded_sector()), speed=0.0)
    nodes = model.parts["blade"].mesh.node_sets
    blade = np.unique(np.concatenate([nodes["shroud_low"], nodes["shroud_high"]]))
    assert blade.size
    frequencies = {}
    for modes in (None, 3, 72):
        one = BladeMistuning(of="blade.shroud_high", deviations=DEVIATIONS, modes=modes)
        wheel = assemble(replace(model, mistuning=Mistuning(blades={"high": one})), 2)
        frequencies[modes] = natural_frequencies(wheel.bare.stuck_structure(), 8)
    np.testing.assert_allclose(frequencies[72], frequencies[None], rtol=1e-10)
    np.testing.assert_allclose(frequencies[3], frequencies[None], rtol=1e-3)


def around_one_blade(stiffness, dofs):
    """What a blade does beyond the static motion by all that is around it, from the matrix of the whole wheel."""
    rows = stiffness[dofs]
    return rows.T @ np.linalg.solve(rows[:, dofs], rows)


@pytest.mark.parametrize("modes", [None, 200])
def test_a_blade_with_the_cyclic_face_counts_what_both_sectors_do_to_it(modes):
    """A set with both cyclic faces: what lies on the high one is the next blade's."""
    plain = shrouded_sector()
    radius = np.linalg.norm(plain.points[:, :2], axis=1)
    members = np.flatnonzero((radius > np.mean(RADII[:2])) & (radius < np.mean(RADII[2:])))
    mesh = SolidMesh(plain.points, plain.cells, {**plain.node_sets, "inner": members})
    model = replace(sector_model(mesh), speed=0.0)
    own = model.parts["blade"].structure
    full, nodes, stiffness = assembled_wheel(mesh, model, [own.stiffness] * SECTORS)
    stiffness = stiffness.toarray()
    members = np.setdiff1d(members, mesh.node_sets["cyclic_high"])
    blades = [dofs_of(full, nodes[s, members]).ravel() for s in range(SECTORS)]
    more = [((1 + d) ** 2 - 1) * around_one_blade(stiffness, b) for b, d in zip(blades, DEVIATIONS, strict=True)]
    whole = replace(full, stiffness=stiffness + sum(more))
    one = BladeMistuning(of="blade.inner", deviations=DEVIATIONS, modes=modes)
    wheel = assemble(replace(model, mistuning=Mistuning(blades={"b": one})), 2)
    found = natural_frequencies(wheel.bare.structure.of_harmonic(0), 10)
    np.testing.assert_allclose(found, natural_frequencies(whole, 10), rtol=1e-9)
    b, mass = blades[0], full.mass.toarray()
    squares = scipy.linalg.eigh(stiffness[np.ix_(b, b)], mass[np.ix_(b, b)], eigvals_only=True)
    alone = blade_alone_hz(model, "blade.inner", 5, "mistuning.b.of")
    np.testing.assert_allclose(2 * np.pi * alone, np.sqrt(squares[:5]), rtol=1e-9)


def test_modes_of_a_blade_that_nothing_holds_are_those_that_deform_it():
    """A free chain of three masses: the squares are 0, k/m and 3 k/m."""
    stiffness = scipy.sparse.csr_array([[1.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
    one = scipy.sparse.eye_array(3, format="csr")
    free = Blade(stiffness, one, stiffness, whole=True)
    for number, squares in ((1, [1.0]), (2, [1.0, 3.0]), (6, [1.0, 3.0])):
        np.testing.assert_allclose(blade_alone(free, number)[0], squares, rtol=1e-12)


RING = """
schema_version = 2
[part.wheel]
shape = "lumped"
sectors = 5
masses_kg = [1.0, 0.3]
names = ["disk", "tip"]
springs_n_per_m = [["disk", "ground", 2e5], ["disk", "tip", 1e5], ["tip", "next.tip", 3e4], SPRING]
[mistuning.blades]
of = "wheel.tip"
MORE
"""


@pytest.mark.parametrize("spring", ['["tip", "next.disk", 2e4]', '["disk", "next.tip", 2e4]'])
@pytest.mark.parametrize("measured", [False, True])
def test_a_blade_tied_to_both_neighbours_is_held_by_both(tmp_path, spring, measured):
    """Springs are written in one of the two sectors that they tie; a wheel written the other way round is its mirror image."""
    more = f'quantity = "frequency"\nmodes = "all"\ndeviations = {DEVIATIONS.tolist()}'
    alone = math.sqrt((1e5 + 2 * 3e4 + 2e4) / 0.3) / (2 * math.pi)
    if measured:
        more = 'file = "b.csv"\nrelative_to = "model"'
        rows = [f"{n},1,{float(alone * (1 + d))!r}" for n, d in enumerate(DEVIATIONS)]
        (tmp_path / "b.csv").write_text("\n".join(["blade,mode,frequency_hz", *rows]))
    path = tmp_path / "study.toml"
    path.write_text(RING.replace("SPRING", spring).replace("MORE", more))
    model = read_study(path).model()
    place = [2 * n + np.arange(2) for n in range(5)]
    links = [("disk", "tip", 0, 1e5), ("tip", "tip", 1, 3e4)]
    links.append(("tip", "disk", 1, 2e4) if spring.startswith('["tip') else ("disk", "tip", 1, 2e4))
    K = np.diag(np.tile([2e5, 0.0], 5))
    for n in range(5):
        for a, b, ahead, k in links:
            row = np.zeros(10)
            row[place[n][int(a == "tip")]] += 1
            row[place[(n + ahead) % 5][int(b == "tip")]] -= 1
            K += k * np.outer(row, row)
    assert blade_alone_hz(model, "wheel.tip", 1, "") == pytest.approx(alone, rel=1e-12)
    more = [((1 + d) ** 2 - 1) * around_one_blade(K, [p[1]]) for p, d in zip(place, DEVIATIONS, strict=True)]
    squares = scipy.linalg.eigh(K + sum(more), np.diag(np.tile([1.0, 0.3], 5)), eigvals_only=True)
    found = wheel_modes(model, 10, "open").frequencies_hz
    np.testing.assert_allclose(2 * np.pi * found, np.sqrt(squares), rtol=1e-10)


def test_a_sector_with_a_part_of_its_own_is_that_part():
    """Another material in sector 3 alone, all modes of the waves kept: the frequencies of the assembled wheel."""
    model = replace(sector_model(shrouded_sector()), speed=0.0)
    mesh = model.parts["blade"].mesh
    other = solid_part(mesh, Material(young_modulus=1.5e11, density=8200.0), sectors=SECTORS)
    wheel = replace(model, mistuning=Mistuning(own={"repaired": OwnSector(sector=3, part="blade", by=other)}))
    old, new = model.parts["blade"].structure, other.structure
    full, _, stiffness = assembled_wheel(mesh, model, [(new if s == 3 else old).stiffness for s in range(SECTORS)])
    _, _, mass = assembled_wheel(mesh, model, [(new if s == 3 else old).mass for s in range(SECTORS)])
    found = assemble(wheel, 2).bare.structure
    whole = replace(full, stiffness=stiffness, mass=mass)
    np.testing.assert_allclose(natural_frequencies(found, 12), natural_frequencies(whole, 12), rtol=1e-9)


def test_a_clearance_in_sectors_is_added_to_that_of_the_contact():
    """More, less, none left, and pressed: 1 mm of interference with 1e6 N/m is 1 kN."""
    added = np.array([0.0, 2e-5, -3e-5, -5e-5, -1.05e-3])
    for law in (
        ss.UnilateralSpring(k_n=1e6, initial_gap=5e-5),
        ss.ElasticCoulomb(k_t=1e6, k_w=1e6, k_n=1e6, mu=0.3, preload=-50.0),
    ):
        one = ContactMistuning(contact="rim", quantity="gap", values=added)
        found = [changed(law, "mistuning.g", one, value) for value in added]
        forces = [law.preload - 1e6 * getattr(law, "initial_gap", 0.0) for law in found]
        np.testing.assert_allclose(forces, -1e6 * (5e-5 + added), atol=1e-9)
    with pytest.raises(InputError) as refused:
        changed(ss.Jenkins(k_t=1e6, limit=1.0), "mistuning.g", one, 1e-5)
    assert refused.value.place == "mistuning.g.quantity"
    # a preload of the law beside a clearance of the contact
    spring = ss.UnilateralSpring(k_n=1e6, preload=20.0)
    assert at_rest("", Contact(between=("", ""), law=spring, gap=5e-5)).initial_gap == pytest.approx(3e-5)
    assert at_rest("", Contact(between=("", ""), law=spring, gap=1e-5)).preload == pytest.approx(10)


def test_patterns_are_the_same_for_the_same_seed_and_have_the_spread_asked_for():
    for distribution in ("normal", "uniform"):
        one = pattern(20_000, distribution, 0.02, 7)
        assert np.array_equal(one, pattern(20_000, distribution, 0.02, 7))
        assert np.std(one) == pytest.approx(0.02, rel=0.02)
    assert np.abs(one).max() <= math.sqrt(3) * 0.02
    assert not np.array_equal(one, pattern(20_000, "uniform", 0.02, 8))


def test_what_is_no_mistuning_is_refused_with_its_key():
    model = sector_model(shrouded_sector())

    def refused(place, problem, **kinds):
        with pytest.raises(InputError) as found:
            assemble(replace(model, mistuning=Mistuning(**kinds)), 2)
        assert found.value.place == place
        assert problem in found.value.problem

    few = BladeMistuning(of="blade", deviations=np.zeros(3))
    refused("mistuning.a", "has 3 values, and the wheel has 5", blades={"a": few})
    nowhere = BladeMistuning(of="blad", deviations=np.zeros(5))
    refused("mistuning.a.of", "there is no part", blades={"a": nowhere})
    one_side = BladeMistuning(of="blade.cyclic_high", deviations=np.zeros(5))
    refused("mistuning.a.of", "belong to the next blade", blades={"a": one_side})
    gone = ContactMistuning(contact="rim", quantity="gap", values=np.zeros(5))
    refused("mistuning.a.contact", "there is no such contact", contacts={"a": gone})
    far = OwnSector(sector=5, part="blade", by=model.parts["blade"])
    refused("mistuning.a.sector", "the sectors are 0 to 4", own={"a": far})
    here = replace(far, sector=2)
    refused("mistuning.b.sector", "mistuning.a puts another part", own={"a": here, "b": here})
    seven = replace(here, by=replace(model.parts["blade"], sectors=7))
    refused("mistuning.a.by", "is one of 7 sectors, and the part", own={"a": seven})
    many = BladeMistuning(of="blade.shroud_high", deviations=np.zeros((5, 200)))
    refused("mistuning.a.deviations", "is of 200 modes, and the model's blade", blades={"a": many})


def test_a_wheel_condensed_wave_by_wave_is_the_wheel_condensed_as_a_whole():
    """Stiffness, loads, their derivatives, recovery, rows of outputs and energy, with springs on contact coordinates."""
    model = sector_model(shrouded_sector())
    one = BladeMistuning(of="blade.shroud_high", deviations=DEVIATIONS, modes=2)
    found = assemble(replace(model, mistuning=Mistuning(blades={"high": one})), H)
    wheel, retained = found.bare.structure, found.bare.retained
    assert isinstance(wheel, MistunedWheel)
    springs = np.zeros(wheel.n)
    springs[retained] = 3e5 * np.arange(1, retained.size + 1) / retained.size
    wheel = wheel.grounded(scipy.sparse.diags_array(springs).tocsr())
    fast = condense_side(wheel, retained, found.load, H)
    assert isinstance(fast, MistunedStiffness)
    for rate in (0.0, 25.0):
        fast = fast.with_mass_damping(rate)
        structure = wheel.structure
        slow = condense(replace(structure, damping=structure.damping + rate * structure.mass), retained, found.load)
        omega, rng = 2 * math.pi * 2150, np.random.default_rng(1)
        mine, theirs = fast.condensed(omega, H), slow.condensed(omega, H)
        for name in ("stiffness", "derivative", "load", "load_derivative"):
            a, b = getattr(mine, name), getattr(theirs, name)
            for h in range(H + 1):
                assert np.abs(a[h] - b[h]).max() <= 1e-9 * max(np.abs(b[h]).max(), 1e-9 * np.abs(b).max())
        q = rng.standard_normal((H + 1, retained.size)) + 1j * rng.standard_normal((H + 1, retained.size))
        q[0] = q[0].real
        one_way, other = fast.products(omega, (0, 1, 2, 3)), slow.products(omega, (0, 1, 2, 3))
        rows = rng.standard_normal((7, retained.size))
        pairs = [
            (fast.recover(omega, q), slow.recover(omega, q)),
            (fast.recover_change(omega, q), slow.recover_change(omega, q)),
            (fast.strain_energy(omega, q), slow.strain_energy(omega, q)),
            (fast.output_rows(omega, 2, found.bare.outputs), slow.output_rows(omega, 2, found.bare.outputs)),
            (one_way.product(rows), other.product(rows)),
            (one_way.transposed_product(rows), other.transposed_product(rows)),
            (one_way.product_and_slope(rows)[1], other.product_and_slope(rows)[1]),
            (one_way.block(3), other.block(3)),
            (one_way.load, other.load),
            (one_way.load_slope, other.load_slope),
        ]
        for a, b in pairs:
            assert np.abs(a - b).max() < 1e-9 * np.abs(b).max()


def test_a_wheel_whose_springs_are_elsewhere_is_condensed_as_a_whole():
    """Wave by wave springs are added to the retained coordinates: none may be left out."""
    model = sector_model(shrouded_sector())
    one = BladeMistuning(of="blade.shroud_high", deviations=DEVIATIONS, modes=2)
    found = assemble(replace(model, mistuning=Mistuning(blades={"high": one})), H)
    wheel, retained = found.bare.structure, found.bare.retained
    springs = np.zeros(wheel.n)
    springs[[retained[0], np.setdiff1d(np.arange(wheel.n), retained)[0]]] = 3e5
    held = wheel.grounded(scipy.sparse.diags_array(springs).tocsr())
    omega = 2 * math.pi * 2150
    mine = condense_side(held, retained, found.load, H).condensed(omega, H)
    theirs = condense(held.structure, retained, found.load).condensed(omega, H)
    for a, b in zip(mine.stiffness, theirs.stiffness, strict=True):
        assert np.abs(a - b).max() <= 1e-9 * np.abs(b).max()
