"""The search for the example: where the flat side's resultant can act, and that the example is what it chose."""

import math
from pathlib import Path

import numpy as np
import pytest

from evidence.reconstruction.candidates import CHOSEN, FLAT_ANGLE, FRICTION, LIFTING, TITANIUM, Candidate, candidates
from stickslip.study.models.study import read_study

EXAMPLE = Path(__file__).parents[1] / "examples" / "two_blades" / "study.toml"


def test_the_example_is_the_choice() -> None:
    raw = read_study(EXAMPLE).file.raw
    for key, value in CHOSEN.keys.items():
        table = raw
        *tables, name = key.split(".")
        for part in tables:
            table = table[part]
        found = table.get(name, 0.0) if name == "force_span" else table[name]
        assert found == (list(value) if isinstance(value, tuple) else value), key


def test_what_rests_is_tried_and_what_lifts_is_told_of() -> None:
    tried = list(candidates())
    assert CHOSEN in tried
    assert len(set(tried)) == len(tried)
    assert not any(choice.rests for choice in LIFTING)
    assert all(c.rests for c in tried[1 + len(LIFTING) :])


@pytest.mark.parametrize(("curved", "angle"), [(0.0045, 45.0), (0.0105, 60.0)])
def test_resultants_balance_the_pull_at_the_ends_of_the_reach(curved: float, angle: float) -> None:
    """Solved as two forces and a moment, each side's force at the angle of friction: the least and the most place of all four."""
    choice = Candidate(0.005, 0.0, (0.002, 0.029), curved, angle, TITANIUM)
    centre = choice.body[2][0]
    tilt = math.radians(angle)
    place = np.array([curved * math.cos(tilt), -curved * math.sin(tilt)])
    places = []
    for flat in (-FRICTION, FRICTION):
        for other in (-FRICTION, FRICTION):
            on_flat = np.array([math.sin(FLAT_ANGLE + flat), -math.cos(FLAT_ANGLE + flat)])
            on_curved = np.array([-math.sin(tilt + other), -math.cos(tilt + other)])
            forces = np.linalg.solve(np.column_stack([on_flat, on_curved]), [0.0, -1.0])
            # moments about the apex: flat force at s along the flat side, curved force at R, pull of 1 N at the centre
            lever = -math.cos(FLAT_ANGLE) * on_flat[1] + math.sin(FLAT_ANGLE) * on_flat[0]
            moment = place[0] * on_curved[1] - place[1] * on_curved[0]
            places.append(-(centre + forces[1] * moment) / (forces[0] * lever))
    assert choice.reach[0] == pytest.approx(min(places), rel=1e-9)
    assert choice.reach[2] == pytest.approx(max(places), rel=1e-9)
