"""Random periodic motions of the systems of `random_machines`, with any law that is piecewise linear: what stability is tried on."""

from dataclasses import dataclass, replace

import numpy as np

from evidence.benchmarks.robustness import OutOfTimeError, at_most
from evidence.models.random_machines import FAMILIES, Random, common, finished
from evidence.models.solving import solve
from stickslip.arrays import FloatArray
from stickslip.contact.law import ContactLaw
from stickslip.contact.laws.bonded import Bonded
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.laws.iwan import Iwan, UniformBand
from stickslip.contact.laws.jenkins import Jenkins
from stickslip.contact.laws.unilateral_spring import UnilateralSpring
from stickslip.errors import StickslipError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.harmonic_set import harmonics_of, to_real
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.stability import Stability, motion_stability
from stickslip.response.system import System

CPU_SECONDS = 15.0  # of a sweep
MANY = 20  # harmonics of the motion that shooting is compared with


@dataclass(frozen=True, eq=False)
class Motion:
    """A solved point, and the gaps of the same motion with more harmonics where it was found."""

    family: str
    laws: str
    system: System
    load: HarmonicLoad
    problem: ForcedProblem
    point: ForcedPoint
    found: Stability
    refined: ForcedPoint | None

    def gaps(self, point: ForcedPoint) -> FloatArray:
        """Return the (2H+1, 3 n_contacts) gaps of a point, m."""
        return gaps_of(self.problem, point)

    def stability_of(self, point: ForcedPoint) -> Stability:
        """Return what the package says of a point's motion as it was solved."""
        return as_solved(self.problem, point)


def gaps_of(problem: ForcedProblem, point: ForcedPoint) -> FloatArray:
    """Return the (2H+1, 3 n_contacts) gaps of a point, m."""
    return to_real(np.asarray(point.coefficients @ problem.low.interface.gap_operator.T))


def as_solved(problem: ForcedProblem, point: ForcedPoint) -> Stability:
    """Return the stability of a point's motion as it was solved."""
    system, gaps = problem.system, gaps_of(problem, point)
    return motion_stability(system.structure, system.interface, gaps, point.omega)


def random_motion(seed: int, number: int) -> Motion | str:
    """Return a motion in which contacts change their states, or why there is none."""
    rng = np.random.default_rng([seed, number])
    family = str(rng.choice(list(FAMILIES)))
    system, load, note = FAMILIES[family](rng, common(rng))
    laws = tuple(another_law(rng, law) for law in system.interface.laws)
    system = replace(system, interface=replace(system.interface, laws=laws))
    drawn = finished(rng, number, family, system, load, note)
    sweep = replace(drawn.sweep, evaluator="events", peak_points=0)
    points: list[ForcedPoint] = []
    try:
        with at_most(CPU_SECONDS):
            points.extend(forced_response(system, load, sweep))
    except (OutOfTimeError, StickslipError):
        pass
    problem = forced_problem(system, load, sweep)
    solved = [p for p in accepted_points(points) if p.converged]
    judged = [(p, as_solved(problem, p)) for p in solved]
    judged = [(p, s) for p, s in judged if s.transitions]
    if not judged:
        return "no contact changes its state"
    # half of the motions are those nearest to losing their stability, or farthest beyond
    last = max(range(len(judged)), key=lambda i: judged[i][1].floquet.growth)
    point, found = judged[last if rng.uniform() < 0.5 else int(rng.integers(len(judged)))]
    kinds = "+".join(sorted({type(law).__name__ for law in laws}))
    refined = with_many_harmonics(problem, point)
    return Motion(family, kinds, system, load, problem, point, found, refined)


def another_law(rng: Random, law: ElasticCoulomb) -> ContactLaw:
    """Return the law as it is, or another one that is piecewise linear, about as stiff."""
    kind = rng.uniform()
    if kind < 0.1:
        return replace(law, residual_traction=float(rng.uniform(-1.0, 1.0)))
    if kind < 0.15 and law.preload >= 0.0:
        return Bonded(k_t=law.k_t, k_w=law.k_w, k_n=law.k_n)
    if kind < 0.25 and law.k_n > 0.0 and law.preload >= 0.0:
        return UnilateralSpring(k_n=law.k_n, preload=law.preload)
    limit = law.mu * law.preload
    if kind < 0.4 and limit > 0.0:
        return Jenkins(k_t=law.k_t, k_w=law.k_w, k_n=law.k_n, limit=limit)
    if kind < 0.5 and limit > 0.0:
        population = UniformBand(n_sliders=int(rng.integers(2, 9)))
        return Iwan(k_t=law.k_t, k_w=law.k_w, k_n=law.k_n, limit=limit, population=population)
    return law


def with_many_harmonics(problem: ForcedProblem, point: ForcedPoint) -> ForcedPoint | None:
    """Return the motion at the frequency of a point with `MANY` harmonics, None where Newton's method does not find it."""
    balance = problem.balance(harmonics_of(MANY))
    try:
        with at_most(CPU_SECONDS):
            x = solve(balance, point.omega, balance.unknowns(point.coefficients))  # type: ignore[arg-type]
    except (RuntimeError, OutOfTimeError):
        return None
    return replace(point, coefficients=balance.coefficients(x), harmonics=np.arange(MANY + 1))
