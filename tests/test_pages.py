"""Python shown on pages of the documentation runs, and finds what the page says of it."""

import re
from pathlib import Path

import numpy as np
import pytest

import stickslip as ss
from stickslip.errors import InputError

DOCS = Path(__file__).parents[1] / "docs"


def run_page(name: str) -> dict[str, object]:
    """Execute the Python blocks of a page, one after the other, and return their names."""
    blocks = re.findall(r"```python\n(.*?)```", (DOCS / name).read_text(), flags=re.DOTALL)
    assert blocks
    names: dict[str, object] = {}
    for block in blocks:
        exec(compile(block, name, "exec"), names)  # our own page
    return names


def test_shooting_from_a_balance() -> None:
    names = run_page("theory/shooting.md")
    found = names["found"]
    assert isinstance(found, ss.response.ShootingResult)
    assert found.stable
    balance = ss.response.fields(names["problem"], names["peak"]).outputs[1, 0]
    # five harmonics and 1024 steps a period: the damper slips, so that neither is exact
    assert found.harmonics[1, 0] == pytest.approx(balance, rel=2e-3)
    # friction damps disturbances far more than the dashpot alone, e^{-cT/2m}
    viscous = np.exp(-0.2 * 2 * np.pi / names["peak"].omega / (2 * 0.1))
    assert np.max(np.abs(found.floquet.multipliers)) < 0.8 * viscous


def test_stuck_damper_leaves_the_multipliers_of_the_dashpot() -> None:
    names = run_page("theory/shooting.md")
    blade, damper, omega = names["blade"], names["damper"], names["peak"].omega
    faint = ss.HarmonicLoad(np.zeros(1), {1: np.array([1.0 + 0j])})
    found = ss.response.shoot(blade, damper.gap_operator, damper.laws, faint, omega, np.array([0]))
    # of the two springs the one along w has no stiffness and holds nothing
    expected = [1.0, *[np.exp(-0.2 * 2 * np.pi / omega / (2 * 0.1))] * 2, 0.0]
    np.testing.assert_allclose(np.sort(np.abs(found.floquet.multipliers))[::-1], expected, rtol=1e-9)


def test_shoot_names_itself_when_it_refuses() -> None:
    blade = ss.model.lumped(np.ones(1), np.ones((1, 1)))
    arguments = (np.eye(3)[:, :1], [ss.RigidCoulomb(mu=0.3)])
    load = ss.HarmonicLoad(np.zeros(1), {1: np.ones(1, dtype=complex)})
    with pytest.raises(InputError, match=r"shoot: laws: got RigidCoulomb.*softened"):
        ss.response.shoot(blade, *arguments, load, 1.0, np.array([0]))
    with pytest.raises(InputError, match=r"integrate: laws: got RigidCoulomb.*softened"):
        ss.response.integrate(blade, *arguments, load, 1.0, np.array([0]))
    with pytest.raises(InputError, match=r"shoot: omega"):
        ss.response.shoot(blade, np.zeros((0, 1)), [], load, -1.0, np.array([0]))


def test_contributions_of_harmonics() -> None:
    names = run_page("theory/goal_oriented.md")
    problem, system, shaker = names["problem"], names["system"], names["shaker"]
    middle = min(
        ss.response.accepted_points(list(ss.forced_response(system, shaker, names["sweep"]))),
        key=lambda point: abs(point.omega - 0.5),
    )
    found = ss.response.harmonic_contributions(problem, middle)
    assert found.missing == (2, 3, 4, 5)
    assert found.labels == ("node0.x",)
    parts = np.abs(found.parts[0])
    assert max(parts[0], parts[2]) < 1e-9 * parts[1]  # a symmetric motion has no even harmonics
    # the sum is the change that all five make, solved for: an estimate of third order in a change of 2 %
    every = ss.Sweep(omega_range=(0.3, 0.7), frequencies=3, peak_points=0, selection="always_high")
    full = min(
        ss.response.accepted_points(list(ss.forced_response(system, shaker, every))),
        key=lambda point: abs(point.omega - 0.5),
    )
    change = full.coefficients[1, 0] / middle.coefficients[1, 0] - 1.0
    assert found.parts[0].sum() == pytest.approx(change, rel=0.1)
    alike = ss.response.harmonic_contributions(problem, full)
    assert alike.missing == ()
    assert alike.bound == 0.0


def test_contributions_ask_for_a_solution() -> None:
    names = run_page("theory/goal_oriented.md")
    from dataclasses import replace

    lost = replace(names["point"], status=ss.solve.Status.STALLED)
    with pytest.raises(InputError, match="is not a solution"):
        ss.response.harmonic_contributions(names["problem"], lost)
