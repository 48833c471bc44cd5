"""A part that nothing holds is refused by name with its free motions, before anything long is computed."""

from pathlib import Path

import numpy as np
import pytest
from small_v2 import changed, write_four_masses, write_shrouded_deck, write_two_blades
from test_assembly_copies import LAW, bar, halves
from test_cli import done, refused

from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.forces import Load, force_of
from stickslip.assembly.joints.unconstrained_bodies import refuse_pulled, refuse_unheld, unheld
from stickslip.assembly.model import Model
from stickslip.contact.interface import Interface
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.polynomial_spring import PolynomialSpring
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError
from stickslip.model.fe.solid import Material
from stickslip.model.part import rigid_part, solid_part, structure_part
from stickslip.model.rigid.body import RigidBody
from stickslip.model.structure import Structure, numbered_dofs
from stickslip.response.equilibrium import preload
from stickslip.response.system import System

pytestmark = pytest.mark.usefixtures("parts_once")

STICKY = ElasticCoulomb(k_t=3e6, k_w=3e6, k_n=5e6, mu=0.3)


def free_bar(contacts=None, joins=None, law=LAW, **more):
    """A bar that nothing holds but what is given, beside a clamped one of the same size."""
    parts = {
        "held": solid_part(bar((1, 1, 1), length=0.1), Material()),
        "loose": solid_part(bar((1, 1, 1), start=0.1, length=0.1, clamp=False), Material()),
    }
    touching = {"touch": Contact(between=("loose.right", "ground"), law=law, tangent=(0, 0, 1))}
    return Model(
        parts=parts,
        contacts=touching if contacts is None else contacts,
        joins=joins or {},
        loads={"shake": Load(on="loose.right", newton=1.0, direction=(0, 0, 1))},
        **more,
    )


def test_what_nothing_touches_is_free_in_all_directions() -> None:
    contact = Contact(between=("held.right", "ground"), law=LAW, tangent=(0, 0, 1))
    with pytest.raises(InputError) as error:
        refuse_unheld(free_bar({"touch": contact}))
    assert "part.loose: is held by nothing" in str(error.value)
    for word in ("translation along", "rotation about"):
        for axis in "xyz":
            assert f"{word} {axis}" in str(error.value)


def test_a_contact_holds_what_its_springs_strain() -> None:
    refuse_unheld(free_bar())
    normal = free_bar(law=UnilateralSpring(k_n=1e6))
    with pytest.raises(InputError) as error:
        refuse_unheld(normal)
    said = str(error.value)
    assert "translation along y, translation along z, rotation about x" in said
    assert "translation along x" not in said
    with pytest.raises(InputError, match=r"part.loose: is held by nothing"):
        assemble(normal, 1)


def test_a_join_holds_and_so_does_a_joined_neighbour() -> None:
    refuse_unheld(halves("node_to_node"))
    weld = {"weld": Join(between=("loose.left", "held.right"), pairing="node_to_node")}
    refuse_unheld(free_bar(law=UnilateralSpring(k_n=1e6), joins=weld))


def test_open_contacts_hold_nothing() -> None:
    found = unheld(free_bar(), np.zeros(4, dtype=bool))
    assert [error.place for error in found] == ["part.loose"]


def test_a_static_load_that_opens_all_contacts_is_refused_before_the_equilibrium() -> None:
    # along -x the loose bar leaves the ground at its right end; 45° to it friction of 0.3 does not hold, nor does a tilting moment
    for toward in ((-1.0, 0.0, 0.0), (-1.0, 1.0, 0.0)):
        pull = Load(on="loose.left", newton=10.0, direction=toward, harmonic=0)
        with pytest.raises(InputError, match=r"load.pull: pulls part.loose off") as error:
            refuse_pulled(*with_static(free_bar(law=STICKY), pull))
        assert "part.held" not in str(error.value)
    for toward in ((1.0, 0.0, 0.0), (1.0, 0.2, 0.0)):  # pressed; within the cone of friction
        push = Load(on="loose.right", newton=10.0, direction=toward, harmonic=0)
        refuse_pulled(*with_static(free_bar(law=STICKY), push))
    side = Load(on="loose.right", newton=10.0, direction=(1.0, 0.5, 0.0), harmonic=0)
    with pytest.raises(InputError, match=r"load.pull: pulls part.loose off"):
        refuse_pulled(*with_static(free_bar(law=STICKY), side))
    weld = {"weld": Join(between=("loose.left", "held.right"), pairing="node_to_node")}
    pull = Load(on="loose.left", newton=10.0, direction=(-1.0, 0.0, 0.0), harmonic=0)
    refuse_pulled(*with_static(free_bar(joins=weld), pull))


def with_static(model: Model, load: Load) -> tuple[Model, dict[str, np.ndarray]]:
    return model, {"load.pull": force_of(model.places, "pull", load)}


def test_a_body_of_open_contacts_is_warned_of(tmp_path: Path) -> None:
    path = tmp_path / "study.toml"
    gap = "[contact.stop]\nbetween = ['chain.m3', 'chain.m1']\nlaw = 'unilateral_spring'\n"
    gap += "normal_stiffness_n_per_m = 1e4\ngap_m = 1e-3\n[load.shaker]"
    path.write_text(FREE.replace("[load.shaker]", gap))
    said = " ".join(done("check", str(path)).split())
    assert "part.chain: the body of m2 is held by nothing at rest" in said
    held = FREE.replace("[2, 3, 1e4]]", "[2, 3, 1e4], [1, 2, 1e2]]")
    path.write_text(held.replace("[load.shaker]", gap))
    assert "held by nothing" not in done("check", str(path))


def test_a_rigid_body_is_held_by_contacts_or_its_retention() -> None:
    law = UnilateralSpring(k_n=1e6)
    body = RigidBody(mass=1.0, inertia=(1.0, 1.0, 1.0), centre=(0.2, 0.0, 0.0))
    model = free_bar(law=law)
    parts = {"held": model.parts["held"], "block": rigid_part(body)}
    contact = Contact(between=("held.right", "ground"), law=LAW, tangent=(0, 0, 1))
    loads = {"shake": Load(on="block", newton=1.0, direction=(0, 0, 1))}
    alone = Model(parts=parts, contacts={"c": contact}, loads=loads)
    with pytest.raises(InputError, match=r"part.block: .*rotation about z.*\[retention\]"):
        refuse_unheld(alone)
    refuse_unheld(Model(parts=parts, contacts={"c": contact}, loads=loads, retention=1.0))


def test_dofs_without_a_place_are_judged_by_their_stiffness() -> None:
    K = np.diag([2.0, 2.0, 0.0]) - np.eye(3, k=1) - np.eye(3, k=-1)
    K[2] = K[:, 2] = 0.0
    zero = np.zeros((3, 3))
    part = structure_part(Structure(np.eye(3), zero, K, numbered_dofs(3)))
    contact = Contact(between=("own.dof1", "ground"), law=LAW, acts="tangential")
    model = Model(parts={"own": part}, contacts={"c": contact})
    with pytest.raises(InputError, match=r"part.own: the body of dof3 .*own.dof3 the most|dof3"):
        refuse_unheld(model)


@pytest.mark.parametrize("write", [write_two_blades, write_four_masses, write_shrouded_deck])
def test_what_is_held_is_not_refused(tmp_path: Path, write) -> None:
    from stickslip.study.models.study import read_study

    refuse_unheld(read_study(write(tmp_path)).model())


FREE = """
schema_version = 2
[part.chain]
shape = "lumped"
masses_kg = [1.0, 1.0, 1.0]
springs_n_per_m = [["ground", 1, 1e4], [2, 3, 1e4]]
[contact.brake]
between = ["chain.m1", "ground"]
law = "jenkins"
tangential_stiffness_n_per_m = 1e3
slip_limit_n = 1.0
[load.shaker]
on = "chain.m3"
force_n = 1.0
[forced_response]
frequency_hz = [10.0, 20.0]
"""


@pytest.mark.parametrize("command", ["check", "run"])
def test_the_command_line_names_part_and_motion(tmp_path: Path, command: str) -> None:
    path = tmp_path / "study.toml"
    path.write_text(FREE)
    said = refused(command, str(path))
    assert "part.chain: the body of m2 is held by nothing" in said
    assert "translation along x" in said
    path.write_text(changed(FREE, {"contact.brake.between": '["chain.m1", "chain.m2"]'}))
    assert "good to run" in done("check", str(path))


def test_a_wheel_that_only_its_shrouds_touch_is_free_and_check_says_so(tmp_path: Path) -> None:
    from stickslip.study.models.study import read_study

    path = write_shrouded_deck(tmp_path)
    deck = tmp_path / "sector.inp"
    lines = deck.read_text().splitlines(keepends=True)
    at = next(i for i, line in enumerate(lines) if line.upper().startswith("*BOUNDARY"))
    deck.write_text("".join(lines[:at] + lines[at + 2 :]))
    with pytest.raises(InputError, match="keeps it from moving along the axis and turning about"):
        refuse_unheld(read_study(path).model())
    chain = tmp_path / "chain.toml"
    chain.write_text(FREE.partition("[contact")[0] + "[modes]\nnumber = 2\n")
    said = " ".join(done("check", str(chain)).split())
    assert "note: part.chain: the body of m2 is held by nothing" in said


@pytest.mark.parametrize(
    ("law", "held"),
    [
        (CubicSpring(cubic_t=1.0), True),
        (CubicSpring(cubic_t=-1.0), False),
        (PolynomialSpring(along_t=(0.0, 0.0, 1.0)), True),
        (PolynomialSpring(along_t=(0.0, 1.0)), False),  # it pushes one way alone
    ],
)
def test_a_mass_is_held_by_a_spring_whose_force_opposes_large_displacements(law, held):
    one = np.ones((1, 1))
    mass = structure_part(Structure(one, 0.0 * one, 0.0 * one, numbered_dofs(1)))
    first = mass.structure.dofs.labels[0]
    model = Model(
        parts={"mass": mass},
        contacts={"spring": Contact(between=(f"mass.{first}", "ground"), law=law, acts="tangential")},
        loads={"shake": Load(on=f"mass.{first}", newton=1.0)},
    )
    assert bool(unheld(model, np.ones(1, dtype=bool))) is not held


@pytest.mark.parametrize("force", [0.0, 8.0])
def test_the_equilibrium_of_a_mass_on_a_cubic_spring_alone(force):
    one, gap = np.ones((1, 1)), np.array([[1.0], [0.0], [0.0]])
    structure = Structure(one, 0.1 * one, 0.0 * one, numbered_dofs(1))
    contact = Interface(("spring",), (CubicSpring(cubic_t=1.0),), gap)
    system = System(structure, contact, np.array([0]))
    # x³ = force
    assert preload(system, np.array([force])) == pytest.approx([np.cbrt(force)], rel=1e-6)


@pytest.mark.parametrize("springs", ["", "springs_n_per_m = [[1, 2, 1e4]]"])
def test_masses_that_a_cubic_spring_alone_holds_have_normal_modes(tmp_path: Path, springs: str):
    from stickslip.model.modes import normal_modes
    from stickslip.study.models.study import read_study

    path = tmp_path / "study.toml"
    spring = "law = 'cubic_spring'\ncubic_tangential_n_per_m3 = 1e8\n"
    text = FREE.partition("[contact")[0].replace("[1.0, 1.0, 1.0]", "[1.0, 3.0]")
    text = "\n".join(springs if line.startswith("springs") else line for line in text.splitlines())
    text += f"\n[contact.c]\nbetween = ['chain.m1', 'ground']\n{spring}"
    path.write_text(text + "[load.l]\non = 'chain.m1'\nforce_n = 1.0\n[modes]\nnumber = 1\n")
    model = read_study(path).model()
    if springs:
        refuse_unheld(model)
    squares = normal_modes(model.parts["chain"].structure, 2).squares
    # all free without springs; with one between them ω² = k (1/m1 + 1/m2)
    assert squares == pytest.approx([0.0, 1e4 * (1 + 1 / 3) if springs else 0.0], rel=1e-12)
