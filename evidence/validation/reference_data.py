"""Curves of other solvers, read from the folder beside the repository where it exists, else the rows kept in ``tests/data``."""

import csv
import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from evidence.models.lumped import jenkins, lumped, system, unilateral
from evidence.models.solving import balance_of
from stickslip.arrays import FloatArray
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.cubic_spring import CubicSpring
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.system import System

ROOT = Path(__file__).parents[2]
COPIES = ROOT / "tests" / "data"
COMPLETE = ROOT.parent / "shared" / "reference"


@dataclass(frozen=True, eq=False)
class NlvibCase:
    """A forced response computed with NLvib, and our model of it."""

    balance: HarmonicBalance
    omega: FloatArray  # (rows,)
    rows: FloatArray  # (rows, unknowns) [q_0, c_1, s_1, ...], not scaled
    turning: tuple[int, ...]  # rows, counted from 0, at a turning point


def folder(solver: str, *, complete: bool) -> Path:
    """Return where the curves of a solver lie."""
    return COMPLETE / solver if complete else COPIES


def has_complete() -> bool:
    """Whether the folder with the complete curves lies beside the repository."""
    return COMPLETE.is_dir()


def nlvib(name: str, *, complete: bool) -> NlvibCase:
    """Read a case and build its model.

    A unilateral spring pushes with ``k (x - gap)`` beyond its gap: our normal gap is then ``-x``. A Jenkins element is a tangential spring
    with a constant limit; a cubic spring, too, acts along the tangent. (The source starts its slider at the second sample and we start
    it at the first; no element of these rows slips only while it settles, so that the start does not matter.)
    """
    place = folder("nlvib", complete=complete)
    case = json.loads((place / f"{name}.json").read_text())
    run = case["runs"][0]
    table = np.loadtxt(place / run["file"], delimiter=",", skiprows=1, ndmin=2)
    n = case["n"]
    gap = np.zeros((3 * len(case["elements"]), n))
    laws: list[ContactLaw] = []
    for i, element in enumerate(case["elements"]):
        if element["law"] == "jenkins":
            laws.append(jenkins(element["k"], element["limit"]))
            gap[3 * i] = element["direction"]
        elif element["law"] == "unilateral_spring":
            laws.append(unilateral(element["k"], element["gap"]))
            gap[3 * i + 2] = -np.array(element["direction"], dtype=float)
        elif element["law"] == "cubic_spring":
            laws.append(CubicSpring(cubic_t=element["k"]))
            gap[3 * i] = element["direction"]
        else:
            raise ValueError(f"{name}: no contact law stands for {element['law']!r}")
    force = np.array(run["excitation"]["cos"]) - 1j * np.array(run["excitation"]["sin"])
    matrices = [np.array(case[key], dtype=float) for key in ("M", "D", "K")]
    load = HarmonicLoad(np.zeros(n), {1: force})
    problem: System = system(lumped(*matrices), laws, gap)
    # all coordinates are retained, so that our unknowns are the source's
    problem = System(problem.structure, problem.interface, problem.outputs, free=np.arange(n))
    turning = tuple(row - 1 for row in run["turning_point_rows"]) if complete else ()
    return NlvibCase(balance_of(problem, load, case["H"], case["N"]), table[:, 0], table[:, 1:], turning)


def contact2d(*, complete: bool) -> list[dict[str, float]]:
    """Read the curve of tmdsimpy, one dictionary a row."""
    lines = (folder("tmdsimpy", complete=complete) / "contact2d_frf_A.csv").read_text().splitlines()
    return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(lines[1:])]


def chain_mode() -> FloatArray:
    """Read the nonlinear mode of the chain: log10 a, a, omega, xi, zeta, and two amplitudes of the tip."""
    path = folder("tmdsimpy", complete=True) / "chain_small_epmc_mode1.csv"
    return np.loadtxt(path, delimiter=",", skiprows=2)


def contact2d_balance() -> HarmonicBalance:
    """One node on a contact with variable normal load; y presses, so that our normal gap is -y."""
    stiffness = np.array([[1200.0, 300.0], [300.0, 3000.0]])
    gap = np.zeros((3, 2))
    gap[0, 0], gap[2, 1] = 1.0, -1.0
    law = ElasticCoulomb(k_t=800.0, k_w=0.0, k_n=2000.0, mu=0.4)
    load = HarmonicLoad(np.array([0.0, 40.0]), {1: np.array([6.0 + 0j, 3.0])})
    return balance_of(system(lumped(np.eye(2), 5e-4 * stiffness, stiffness), [law], gap), load, 7, 512)
