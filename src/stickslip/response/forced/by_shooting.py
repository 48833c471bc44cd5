"""Forced response by shooting: periodic motions in time; each frequency starts from the previous motion."""

from collections.abc import Iterator, Sequence
from time import perf_counter

import numpy as np

from stickslip.errors import SingularError
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.linear import one_structure
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.choices import Stage
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, Shot, forced_problem
from stickslip.response.forced.resonance import peak_vertex
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.response.time.shooting import ShootingResult, shoot
from stickslip.response.time.start import TransientStart, start_from_harmonics
from stickslip.response.time.transient import TimeStepping
from stickslip.solve.status import Status

ENDED = {
    "converged": Status.CONVERGED,
    "coarse": Status.CONVERGED,  # its error says how coarse
    "not converged": Status.TOO_MANY_ITERATIONS,
    "diverged": Status.NOT_FINITE,
}


@by_one_thread
def shooting_response(
    system: System, load: HarmonicLoad, sweep: Sweep, stepping: TimeStepping, done: Sequence[ForcedPoint] = ()
) -> Iterator[ForcedPoint]:
    """Find the periodic motion at every frequency of `sweep.grid` by shooting, then at a few near the peak.

    Parameters
    ----------
    system, load
        Structure, contacts and outputs; forces on all dofs, N.
    sweep
        Frequencies, and harmonics to report.
    stepping
        Steps in a period, tolerance, largest number of periods.
    done
        Points of an interrupted run, in their order. They are not computed again, and the remaining points are the
        same.

    Yields
    ------
    ForcedPoint
        Points not in `done`: ``low`` along the sweep, ``peak`` near the peak.

    Raises
    ------
    InputError
        If the system has no equations in time: a tuned wheel, complex matrices, rigid contacts, a singular mass matrix.
    """
    problem = forced_problem(system, load, sweep)
    left, solved, last = iter(done), list[ForcedPoint](), None
    for index, omega in enumerate(sweep.grid.tolist()):
        point = next(left, None)
        if point is None:
            point = _shot_point(problem, omega, last, stepping, "low", index)
            yield point
        solved.append(point)
        last = point if point.converged else last
    known = sorted((p for p in solved if p.converged), key=lambda p: p.omega)
    for index in range(sweep.peak_points):
        heights = [problem.amplitude(p) for p in known]
        omega_next = peak_vertex(known, heights)
        if omega_next is None:
            return
        point = next(left, None)
        if point is None:
            near = min(known, key=lambda p: abs(p.omega - omega_next))
            point = _shot_point(problem, omega_next, near, stepping, "peak", index)
            yield point
        if not point.converged:
            return
        known = sorted([*known, point], key=lambda p: p.omega)


def _shot_point(
    problem: ForcedProblem, omega: float, last: ForcedPoint | None, stepping: TimeStepping, stage: Stage, index: int
) -> ForcedPoint:
    """Return the motion at a frequency, started from another point's motion, or else with all contacts stuck."""
    began, system, linear = perf_counter(), problem.system, problem.low.linear
    there = system.at(omega)
    retained = np.asarray(linear.retained)
    found = shoot(
        one_structure(there.structure, "shooting"),
        there.interface.gap_operator,
        there.interface.laws,
        linear.load_at(omega),
        omega,
        np.concatenate([retained, np.asarray(system.outputs)]),
        _stuck(problem, omega) if last is None else _begun(system, last),
        stepping,
        weights=there.interface.weights,
    )
    status = ENDED[found.status]
    coefficients = found.harmonics[:, : retained.size]
    return ForcedPoint(
        stage=stage,
        index=index,
        omega=omega,
        coefficients=coefficients if status.converged else np.zeros_like(coefficients),
        tangent=np.zeros(0),
        step=0.0,
        status=status,
        iterations=found.corrections,
        predicted_error=float("nan"),
        seconds_contact=0.0,
        seconds_linear=0.0,
        seconds_total=perf_counter() - began,
        harmonics=np.array(problem.low.harmonics),
        shot=(_told(found, stepping),),
    )


def _told(found: ShootingResult, stepping: TimeStepping) -> Shot:
    return Shot(
        residual=found.residual,
        step_error=found.step_error,
        growth_error=found.growth_error,
        steps=stepping.steps_per_period,
        periods=found.periods,
        multipliers=found.floquet.multipliers,
        displacement=found.final.displacement,
        velocity=found.final.velocity,
        states=np.concatenate([np.zeros(0), *found.final.states]),
    )


def _begun(system: System, last: ForcedPoint) -> TransientStart:
    """Return the state at which the motion of a point ends its period."""
    (shot,) = last.shot
    sizes = [np.asarray(law.initial_state()).size for law in system.interface.laws]
    states = np.split(shot.states, np.cumsum(sizes)[:-1])
    return TransientStart(shot.displacement, shot.velocity, states)


def _stuck(problem: ForcedProblem, omega: float) -> TransientStart | None:
    """Return the state of the vibration with all contacts stuck; None (rest) without one."""
    balance, interface = problem.low, problem.system.interface
    try:
        coefficients = balance.coefficients(bonded_start(balance, omega, problem.system))
    except (SingularError, np.linalg.LinAlgError):
        return None
    motion = balance.linear.recover(omega, coefficients)
    return start_from_harmonics(motion, omega, interface.gap_operator, interface.laws)
