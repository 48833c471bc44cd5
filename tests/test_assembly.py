"""Models put together from parts, contacts and loads against the same written by hand."""

import math
import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
from newton_bounds import allowed, answer_at

import stickslip as ss
from stickslip.assembly.assembling import assemble
from stickslip.assembly.contact import Contact, Join
from stickslip.assembly.forces import Load, Output
from stickslip.assembly.model import Model
from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import InputError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.damping import Damping, rayleigh_damping
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.matrices import lumped
from stickslip.model.mesh.blade_pair import BladePair, mesh_blade_pair
from stickslip.model.part import damper_part, solid_part, structure_part
from stickslip.model.rigid.dampers import FlatCurvedDamper, gap_operator
from stickslip.model.structure import Dofs, Structure, join
from stickslip.reduction.choice import Reduction
from stickslip.reduction.fixed_interface import craig_bampton
from stickslip.response.forced.response import Sweep, accepted_points, forced_problem, forced_response
from stickslip.response.system import System

COARSE = {"airfoil_size": 0.05, "platform_size": 0.02, "foot_size": 0.05}
HZ = 2 * math.pi
FLAT = ElasticCoulomb(k_t=450e6, k_w=450e6, k_n=520e6, mu=0.6)
CURVED = ElasticCoulomb(k_t=20e6, k_w=450e6, k_n=25e6, mu=0.6)


def answered(system, load, hertz, order, **settings):
    """Return the fields of a response at given frequencies."""
    sweep = Sweep(
        omega_range=(HZ * hertz[0], HZ * hertz[-1]),
        low=order,
        high=order,
        selection="always_low",
        frequencies=len(hertz),
        peak_points=0,
        **settings,
    )
    problem = forced_problem(system, load, sweep)
    points = accepted_points(list(forced_response(system, load, sweep)))
    assert all(point.converged for point in points)
    return [answer_at(problem, point) for point in points]


@pytest.fixture(scope="module")
def blades():
    damper = FlatCurvedDamper()
    mesh = mesh_blade_pair(BladePair(**COARSE), damper.contact_points())
    part = solid_part(mesh, Material(), reduction=Reduction(10), damping=Damping(ratio=0.003, between_hz=(150, 300)))
    return damper, mesh, part


def two_blades(damper, part):
    return Model(
        parts={"blades": part, "damper": damper_part(damper)},
        contacts={
            "flat": Contact(between=("damper.flat", "blades.underside_1"), law=FLAT, share="interface"),
            "curved": Contact(between=("damper.curved", "blades.underside_2"), law=CURVED, share="interface"),
        },
        loads={
            "pull": Load(on="damper", newton=442.0, direction=(0, 0, 1), harmonic=0),
            "shaker": Load(on="blades.force", newton=22.1, direction=(1, 0, 0)),
        },
        outputs=tuple(Output(name=n, on=f"blades.{n}") for n in ("tip1", "edge1", "tip2")),
    )


def test_two_blades_and_a_damper_are_those_of_the_lower_layers(blades):
    damper, mesh, part = blades
    found = assemble(two_blades(damper, part), 1)

    points, body = damper.contact_points(), damper.body()
    full = rayleigh_damping(assemble_solid(mesh, Material()), 0.003, (150.0, 300.0))
    keep = np.unique(np.concatenate([full.sets[n] for n in ("contact", "force", "output")]))
    both = join(blades=craig_bampton(full, keep, 10), damper=body.structure())
    place = {int(d): i for i, d in enumerate(keep)}
    nodes = np.array([place[int(d)] for d in full.sets["contact"]]).reshape(-1, 3)
    gaps = gap_operator(points, nodes, both.sets["damper"], both.n, body)
    by_side = {
        "flat": ElasticCoulomb(k_t=75e6, k_w=75e6, k_n=520e6 / 6, mu=0.6),
        "curved": ElasticCoulomb(k_t=20e6 / 3, k_w=150e6, k_n=25e6 / 3, mu=0.6),
    }
    laws = tuple(by_side[side] for side in points.side)
    outputs = np.array([place[int(d)] for d in full.sets["output"]])
    system = System(both, Interface(points.names, laws, gaps), outputs, free=both.sets["damper"])
    force = np.zeros(both.n, dtype=complex)
    force[place[int(full.sets["force"][0])]] = 22.1
    static = np.zeros(both.n)
    static[both.sets["damper"][2]] = 442.0
    load = HarmonicLoad(static, {1: force})

    assert found.system.structure.dofs.labels == both.dofs.labels
    assert found.contacts.names == points.names
    assert found.output_labels[:4] == ("tip1.x", "tip1.y", "tip1.z", "edge1.x")
    assert found.error_labels == found.output_labels
    np.testing.assert_allclose(found.system.interface.gap_operator.toarray(), gaps, atol=1e-12)
    for name in ("mass", "damping", "stiffness"):
        mine, theirs = (getattr(s, name) for s in (found.system.structure, both))
        assert np.abs(mine - theirs).max() <= 1e-10 * np.abs(theirs).max()
    np.testing.assert_allclose(found.load.static, static)
    np.testing.assert_allclose(found.load.harmonics[1], force)
    hertz = (170.0, 190.0, 200.0)
    mine = answered(found.system, found.load, hertz, 1)
    for one, other in zip(mine, answered(system, load, hertz, 1), strict=True):
        for name in ("outputs", "gaps", "forces"):
            a, b = getattr(one, name), getattr(other, name)
            assert np.abs(a - b).max() <= allowed(name, one, other)


def masses():
    """Four masses in a chain, the first grounded, two friction elements and a stop."""
    k = 1e5
    stiffness = k * np.array([[2, -1, 0, 0], [-1, 2, -1, 0], [0, -1, 2, -1], [0, 0, -1, 1.0]])
    return lumped(np.ones(4), stiffness, 2e-5 * stiffness, names=("m1", "m2", "m3", "m4"))


def four_masses():
    friction = Jenkins(k_t=4e4, limit=0.5)
    return Model(
        parts={"chain": structure_part(masses())},
        contacts={
            "ring": Contact(between=("chain.m2", "ground"), law=friction, acts="tangential"),
            "between": Contact(between=("chain.m3", "chain.m4"), law=friction, acts="tangential"),
            "stop": Contact(between=("chain.m4", "ground"), law=UnilateralSpring(k_n=1e5), acts="normal", gap=1e-5),
        },
        loads={
            "shaker": Load(on="chain.m1", newton=3.0),
            "weight": Load(on="chain.node3.x", newton=-0.5, harmonic=0),
            "second": Load(on="chain.m2", newton=0.5, harmonic=2, phase=0.7),
        },
    )


@pytest.mark.kernel
def test_four_masses_with_two_friction_elements_and_a_gap_are_those_of_hand_made_matrices():
    found = assemble(four_masses(), 5)
    gaps = np.zeros((9, 4))
    gaps[0, 1] = -1.0
    gaps[3, 2:] = -1.0, 1.0
    gaps[8, 3] = -1.0
    friction = Jenkins(k_t=4e4, limit=0.5)
    stop = UnilateralSpring(k_n=1e5, initial_gap=1e-5)
    interface = Interface(("ring", "between", "stop"), (friction, friction, stop), gaps)
    system = System(masses(), interface, np.array([0, 1]))
    force = {1: np.array([3.0, 0, 0, 0]), 2: np.array([0, 0.5 * np.exp(0.7j), 0, 0])}
    load = HarmonicLoad(np.array([0, 0, 0, -0.5]), force)
    assert found.contacts.names == ("ring", "between", "stop")
    assert found.output_labels == ("shaker.x", "second.x")
    assert found.excitation == 3.0
    np.testing.assert_array_equal(found.system.interface.gap_operator.toarray(), gaps)
    hertz = (8.0, 17.0, 20.0)
    mine = answered(found.system, found.load, hertz, 5)
    for one, other in zip(mine, answered(system, load, hertz, 5), strict=True):
        for name in ("outputs", "gaps", "forces"):
            a, b = getattr(one, name), getattr(other, name)
            assert np.abs(a - b).max() <= allowed(name, one, other)


def test_models_and_what_they_are_assembled_to_survive_pickling():
    model = four_masses()
    assemble(model, 3)
    again = pickle.loads(pickle.dumps(model))
    assert repr(again) == repr(model)
    found = pickle.loads(pickle.dumps(assemble(again, 3)))
    np.testing.assert_array_equal(found.load.static, assemble(model, 3).load.static)


@dataclass(frozen=True)
class _Pressed(Jenkins):
    """A law of one's own whose normal force at zero gap is not called `preload`."""

    n0: float = 1.0


def test_a_gap_of_an_own_law_names_the_fields_it_goes_into():
    own = _Pressed(k_t=1.0, k_n=1.0, limit=1.0)
    one = Contact(between=("chain.m1", "ground"), law=own, acts="normal", gap=-2e-5)
    with pytest.raises(InputError) as error:
        assemble(replace(four_masses(), contacts={"a": one}), 3)
    said = str(error.value)
    assert "interference_m: is given (in Python gap=-2e-05), and the law _Pressed" in said
    assert "has no field `preload`: " in said
    assert "`k_n`" in said.partition("Give the law")[2]


def test_what_is_wrong_with_a_model_is_named():
    model = four_masses()

    def refused(match, harmonics=3, **changes):
        with pytest.raises(InputError, match=match):
            assemble(replace(model, **changes), harmonics)

    law = Jenkins(k_t=1.0, limit=1.0)
    one = Contact(between=("chain.m9", "ground"), law=law, acts="tangential")
    refused(
        r"contact.a.between: there is no surface or set 'chain.m9'. Did you mean .*Known: chain", contacts={"a": one}
    )
    refused(
        "contact.a.between: there is no part 'chian'. Did you mean 'chain'",
        contacts={"a": replace(one, between=("chian.m1", "ground"))},
    )
    refused("is no sector of a wheel", contacts={"a": replace(one, between=("chain.m1", "next.chain.m2"))})
    chain = model.parts["chain"]
    several = replace(chain.structure, sets={**chain.structure.sets, "pair": np.array([2, 3])})
    refused(
        r"contact.a.between: 'chain.pair' has 2 dofs and 'chain.m1' 1",
        parts={**model.parts, "chain": replace(chain, structure=several)},
        contacts={"a": replace(one, between=("chain.pair", "chain.m1"))},
    )
    with pytest.raises(InputError, match=r"contact.a.acts: is missing"):  # before anything is asked
        replace(model, contacts={"a": replace(one, between=("chain.m1", "ground"), acts=None)})
    refused(
        r"contact.a.gap_m: is given \(in Python gap=0.001\), and the law jenkins has a normal force that does not depend on how far",
        contacts={"a": replace(one, between=("chain.m1", "ground"), gap=1e-3)},
    )
    refused("contact: there is none", contacts={})
    refused(
        "load.a.engine_order: is 2, and the model is no sector",
        loads={"a": Load(on="chain.m1", newton=1.0, engine_order=2)},
    )
    refused("load.second.harmonic: is 2, and harmonics up to 1", harmonics=1)
    refused("output.points.tip: there is no surface or set 'chain.tip'", outputs=(Output(name="tip", on="chain.tip"),))
    refused("alert_over: there is no place 'shaker.y'. Did you mean 'shaker.x'", alert_over=("shaker.y",))
    refused("join.a.between: needs two surfaces", joins={"a": Join(between=("chain.m1", "chain.m2"))})


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (
            lambda: ss.Contact(between=("b.m", "ground"), law=ss.Jenkins(k_t=1.0, limit=1.0), acts="x"),
            r"Contact\.acts: is 'x'",
        ),
        (
            lambda: ss.Contact(between=("b.m", "ground"), law=ss.Jenkins(k_t=1.0, limit=1.0), share="all"),
            r"Contact\.share: is 'all'",
        ),
        (
            lambda: ss.Contact(between=("b.m", "ground"), law=ss.Jenkins(k_t=1.0, limit=1.0), pairing="node"),
            r"Contact\.pairing: is 'node'",
        ),
        (lambda: ss.Join(between=("a.m", "b.m"), pairing="node"), r"Join\.pairing: is 'node'"),
        (lambda: ss.Part(structure=ss.model.lumped(np.eye(1), np.eye(1)), cyclic="node"), r"Part\.cyclic: is 'node'"),
    ],
)
def test_words_that_are_none_are_refused_with_those_that_are(make, said):
    with pytest.raises(ss.InputError, match=said + r"\. Give one of "):
        make()


@pytest.mark.parametrize(("nodes", "names"), [((3,), ("brake", "pad")), ((2, 3), ("brake", "pad.1", "pad.2"))])
def test_a_contact_of_one_point_names_it_as_the_study_names_the_contact(nodes, names):
    """Between dofs and between nodes alike; `data.sel(contact="pad")` had ended in a KeyError, since the point was "pad.1"."""
    number = np.array([1, 2, 2, 3, 3])
    place = np.column_stack([number, np.zeros(5), np.zeros(5)]).astype(float)
    dofs = Dofs(number, ("x", "x", "z", "x", "z"), place)
    sets = {"m1": np.array([0]), "face": np.flatnonzero(np.isin(number, nodes))}
    part = structure_part(Structure(np.eye(5), np.zeros((5, 5)), 1e4 * np.eye(5), dofs, sets))
    law = ElasticCoulomb(k_t=1e3, k_w=0.0, k_n=1e3, mu=0.3)
    model = Model(
        parts={"chain": part},
        contacts={
            "brake": Contact(between=("chain.m1", "ground"), law=Jenkins(k_t=1e3, limit=1.0), acts="tangential"),
            "pad": Contact(between=("chain.face", "ground"), law=law, normal=(0, 0, 1), tangent=(1, 0, 0), preload=1.0),
        },
    )
    assert model.pairs.names == names
    assert model.pairs.groups == ("brake", *("pad",) * len(nodes))
