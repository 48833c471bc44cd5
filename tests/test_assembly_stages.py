"""Only what a change touches is built again: reductions are shared by models, and taken from a store by later runs."""

from dataclasses import replace

import numpy as np
import pytest
from test_assembly_copies import LAW, STEEL, bar, pair, place_of
from test_assembly_wheel import STEEL as SAME
from test_assembly_wheel import sector_model, shrouded_sector

from stickslip.assembly.assembling import assemble
from stickslip.assembly.part_copies import copy_of
from stickslip.model.damping import Damping
from stickslip.model.part import solid_part
from stickslip.reduction.choice import METHODS, Reduction
from stickslip.reduction.fixed_interface import craig_bampton

OWN = {"reduction": Reduction(6), "damping": Damping(ratio=0.01, between_hz=(160.0, 1400.0))}


@pytest.fixture
def reductions(monkeypatch):
    """Sizes of the structures reduced so far."""
    sizes = []

    def counted(structure, *others, **more):
        sizes.append(structure.n)
        return craig_bampton(structure, *others, **more)

    monkeypatch.setitem(METHODS, "craig_bampton", counted)
    return sizes


class Shelf(dict):
    """A store in memory."""

    def __call__(self, content, make):
        if content not in self:
            self[content] = {name: np.array(value) for name, value in make().items()}
        return self[content]


def twins():
    first = solid_part(bar(), STEEL, **OWN)
    return pair(first, copy_of(first, place_of(move=(0.0, 0.1, 0.0))))


def test_friction_loads_and_speed_of_sound_parts_reduce_nothing_again(reductions):
    model = twins()
    assemble(model, 3)
    assert len(reductions) == 1  # of both copies
    rough = {name: replace(c, law=replace(LAW, mu=0.5)) for name, c in model.contacts.items()}
    strong = {name: replace(load, newton=5.0) for name, load in model.loads.items()}
    second = assemble(replace(model, contacts=rough, loads=strong, retention=1.0), 5)
    assert len(reductions) == 1
    assert second.system.interface.laws[0].mu == 0.5
    assemble(replace(model, speed=100.0), 3)
    assert len(reductions) == 3  # the copy stands beside the axis: the rotation stresses it differently
    elsewhere = {**model.loads, "new": replace(model.loads["one"], on="one.top")}
    assemble(replace(model, loads=elsewhere), 3)
    assert len(reductions) == 4


def test_a_store_gives_later_runs_what_earlier_ones_reduced(reductions):
    shelf = Shelf()
    first = assemble(twins(), 3, shelf)
    assert len(reductions) == 1
    again = assemble(twins(), 3, shelf)
    assert len(reductions) == 1
    for name in ("mass", "damping", "stiffness"):
        mine, theirs = (getattr(a.system.structure, name) for a in (first, again))
        np.testing.assert_array_equal(mine, theirs)
    np.testing.assert_array_equal(first.frequencies.stuck_full, again.frequencies.stuck_full)
    softer = replace(STEEL, young_modulus=200e9)
    assemble(pair(solid_part(bar(), softer, **OWN), solid_part(bar(), STEEL, **OWN)), 3, shelf)
    assert len(reductions) == 2  # the steel one is there already


def test_waves_are_reduced_once(reductions):
    shelf = Shelf()
    assert SAME == STEEL
    model = reduced_sector_model()
    first = assemble(model, 3, shelf)
    assert len(reductions) == 3  # waves 0, 1 and 2 of 0, 2, 4, 1
    assert first.system.structure.n < model.places.n
    assemble(model, 3)
    rough = {n: replace(c, law=replace(c.law, mu=0.5)) for n, c in model.contacts.items()}
    assemble(replace(model, contacts=rough), 2)
    again = assemble(reduced_sector_model(), 3, shelf)
    assert len(reductions) == 3
    np.testing.assert_array_equal(first.load.static, again.load.static)
    for k, wave in first.system.structure.waves.items():
        np.testing.assert_array_equal(wave.stiffness, again.system.structure.waves[k].stiffness)
    assert first.frequencies.warnings() == []
    assert np.abs(first.static_gap - assemble(sector_model(shrouded_sector()), 3).static_gap).max() < 1e-12


def reduced_sector_model():
    model = sector_model(shrouded_sector())
    return replace(
        model, parts={"blade": solid_part(shrouded_sector(), STEEL, sectors=5, **OWN | {"reduction": Reduction(20)})}
    )
