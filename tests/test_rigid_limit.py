"""Contacts far stiffer than the structure: where they stay closed and stuck and their rows are independent, the motion goes to that of the tied structure."""

import numpy as np
import pytest

from stickslip.contact.interface import Interface
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.response.forced.accepted import accepted_points
from stickslip.response.forced.problem import forced_problem
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.newton_method import Newton

RATIOS = 10.0 ** np.arange(3, 10)
OMEGA, PRESSED = 1.1, np.array([0.0, -100.0, 0.0, 100.0])  # N, either body onto the other
# along t and n of either body: 1 and 2 kg on 1 and 3 N/m, all with 2 % of their stiffness as damping
MASS, STIFFNESS = np.diag([1.0, 1.0, 2.0, 2.0]), np.diag([1.0, 1.5, 3.0, 2.5])
GAP = np.array([[1.0, 0.0, -1.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, -1.0]])
FORCE = np.array([1.0, 0.3, 0.0, 0.2j])


def tied() -> np.ndarray:
    """Return the first harmonic of the bodies tied to each other in t and n, by their sum: of no contact is anything used."""
    tie = np.array([[1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    dynamic = STIFFNESS * (1.0 + 0.02j * OMEGA) - OMEGA**2 * MASS
    return np.asarray(tie @ np.linalg.solve(tie.T @ dynamic @ tie, tie.T @ FORCE))


def of_contacts(ratio: float) -> tuple[np.ndarray, int]:
    """Return the first harmonic with contacts so many times as stiff as 1 N/m, and the Newton steps."""
    law = ElasticCoulomb(k_t=ratio, k_w=ratio, k_n=ratio, mu=0.5)
    structure = lumped(MASS, STIFFNESS, 0.02 * STIFFNESS)
    system = System(structure, Interface(("c",), (law,), GAP), np.arange(4))
    load = HarmonicLoad(PRESSED, {1: FORCE})
    sweep = Sweep(
        omega_range=(0.999 * OMEGA, 1.001 * OMEGA), at=(OMEGA,), low=3, high=3, selection="always_low", peak_points=0
    )
    point = accepted_points(list(forced_response(system, load, sweep)))[0]
    assert point.converged
    problem = forced_problem(system, load, sweep)
    return problem.low.linear.recover(OMEGA, point.coefficients)[1], point.iterations


def test_the_error_over_the_stiffness_ratio_falls_with_slope_minus_one() -> None:
    judge = tied()
    found = [of_contacts(ratio) for ratio in RATIOS]
    off = np.array([np.linalg.norm(x - judge) / np.linalg.norm(judge) for x, _ in found])
    # Newton's method ends at a residual of its tolerance times the largest force, the structure's own inverse makes this of it, tenfold
    sum_of_both = np.diag([4.0, 4.0]) * (1.0 + 0.02j * OMEGA) - OMEGA**2 * np.diag([3.0, 3.0])
    left = Newton().tolerance * np.max(np.abs(PRESSED)) * np.linalg.norm(np.linalg.inv(sum_of_both), 2)
    floor = 10.0 * left / np.linalg.norm(judge)
    clear = off > 10.0 * floor
    assert np.count_nonzero(clear) >= 3
    assert np.diff(np.log10(off[clear])) == pytest.approx(-1.0, abs=0.01)
    assert np.all(np.abs(off - off[0] * RATIOS[0] / RATIOS) <= 0.01 * off[0] * RATIOS[0] / RATIOS + floor)
    assert max(steps for _, steps in found) <= 5
