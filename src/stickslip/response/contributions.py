"""Contribution of each missing harmonic to the outputs: the terms by which `GoalOriented` chooses."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, IntArray
from stickslip.errors import input_error
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.selection.adjoint import Goal, contributions, estimate, outputs_of
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, with_stiffness


@dataclass(frozen=True, eq=False)
class HarmonicContributions:
    """Relative changes of outputs by the harmonics that a solution lacks, one row an output and one column a harmonic.

    Attributes
    ----------
    omega
        Frequency, rad/s.
    kept, missing
        Harmonics of the point, and those of the reference that it lacks.
    harmonics, dofs
        (k,) what the outputs are: a harmonic of a dof each; those that hardly move are left out.
    labels
        k names of the dofs.
    parts
        (k, n_missing) change of the output by each missing harmonic over the output itself: the real part is, to first order,
        the relative change of the amplitude, the imaginary part that of the phase in rad. The sum over a row is the estimated
        change. Infinite where the Jacobian is singular.
    bound
        Largest relative change that is to be expected of any output; never below the prediction of the Jacobian Alert.
    """

    omega: float
    kept: Harmonics
    missing: Harmonics
    harmonics: IntArray
    dofs: IntArray
    labels: tuple[str, ...]
    parts: ComplexArray
    bound: float


def harmonic_contributions(problem: ForcedProblem, point: ForcedPoint, goal: Goal = "motion") -> HarmonicContributions:
    """Estimate what each missing harmonic of the reference would change in the outputs at a solved point.

    Residuals of the missing harmonics weighted by the adjoints of the outputs (Becker & Rannacher 2001, section 2), with the
    mean Jacobian of two or three evaluations with all harmonics; nothing is iterated.

    Parameters
    ----------
    problem
        The forced response (`forced_problem`); its reference harmonics are those of ``Sweep.high``.
    point
        A converged point of the response.
    goal
        What of a change counts: ``motion``, amplitude and phase; or ``amplitude``, its real part alone.

    Returns
    -------
    HarmonicContributions
        Without columns where the point has all harmonics of the reference.

    Raises
    ------
    InputError
        If the point is not a solution.
    """
    if not point.converged:
        raise input_error(
            "harmonic_contributions: point",
            f"at {point.omega:g} rad/s is not a solution, its status is {point.status.name}",
            "Give one of accepted_points(...) that converged.",
        )
    own, high = (with_stiffness(b) for b in (problem.balance(point.support), problem.high))
    x = own.unknowns(point.coefficients)
    outputs = outputs_of(problem.measure, own.linear.recover(point.omega, point.coefficients), goal)
    missing = tuple(h for h in high.harmonics if h not in own.harmonics)
    parts, bound = np.zeros((outputs.dofs.size, len(missing)), dtype=complex), 0.0
    if missing:
        found = estimate(own, high, x, point.omega, outputs, problem.alert_solve)
        bound = found.bound
        singular = found.mean is None and bound > 0.0
        parts = (
            np.full(parts.shape, complex(np.inf)) if singular else contributions(own, high, point.omega, outputs, found)
        )
    names = problem.system.structure.dofs.labels
    labels = tuple(names[dof] for dof in outputs.dofs)
    return HarmonicContributions(
        point.omega, own.harmonics, missing, outputs.harmonics, outputs.dofs, labels, parts, bound
    )
