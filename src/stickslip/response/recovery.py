"""Recovery of all reported quantities at a point from its retained coordinates."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.harmonic.aft import ContactPeriod, contact_forces
from stickslip.harmonic.dlft import DynamicLagrangian
from stickslip.harmonic.harmonic_set import to_complex, to_real
from stickslip.model.structure import ROTATIONS
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem


@dataclass(frozen=True, eq=False)
class Fields:
    """Harmonics 0 to order of all reported quantities.

    Attributes
    ----------
    outputs
        (order+1, n_outputs) displacement of the output dofs, m.
    gaps, forces
        (order+1, n_contacts, 3) gaps in m and contact forces in N, along t, w, n.
    energy
        (n_contacts,) energy dissipated per cycle, J.
    """

    outputs: ComplexArray
    gaps: ComplexArray
    forces: ComplexArray
    energy: FloatArray


@dataclass(frozen=True, eq=False)
class Signals:
    """Gaps, forces and states of the contacts over one period.

    Attributes
    ----------
    time
        (samples,) s.
    gap, force
        (n_contacts, 3, samples) in m and N.
    state
        (n_contacts, 2, samples): 0 stick, 1 slip, 2 open, for t and w.
    """

    time: FloatArray
    gap: FloatArray
    force: FloatArray
    state: IntArray


def fields(problem: ForcedProblem, point: ForcedPoint) -> Fields:
    """Recover outputs, gaps, forces and dissipated energy at a point.

    The energy is the work of the tangential forces over the period, exact for the kept harmonics: ``E = π Σ_h h
    Im(conj(G_h) Λ_h)``. The normal spring is conservative and does not contribute.
    """
    linear, interface = problem.low.linear, problem.low.interface
    outputs = linear.recover(point.omega, point.coefficients)[:, problem.system.outputs]
    gaps = point.coefficients @ interface.gap_operator.T
    period = _period(problem, point)
    forces = to_complex(period.coefficients)
    h = np.arange(gaps.shape[0])[:, None]
    work = np.pi * np.sum(h * np.imag(np.conj(gaps) * forces), axis=0)
    shape = (gaps.shape[0], interface.n_contacts, 3)
    energy = work.reshape(interface.n_contacts, 3)[:, :2].sum(axis=1)
    return Fields(outputs, gaps.reshape(shape), forces.reshape(shape), energy)


def equivalent_damping(problem: ForcedProblem, point: ForcedPoint) -> float:
    """Return the damping ratio of a linear oscillator with the same loss factor.

    At a peak this is half the inverse of the quality factor.

    ``ζ = W / (4π U)``, where W is the work of the harmonic loads in a cycle, which equals the total dissipation of a
    steady motion, and U the largest vibration energy in structure and contacts, twice its mean. NaN without a
    vibration.
    """
    work, _, stored = _work_and_energy(problem, point)
    return work / (4.0 * np.pi * stored) if stored > 0.0 else float("nan")


def damped_share(problem: ForcedProblem, point: ForcedPoint, ratio: float) -> float:
    """Return the dissipation of a damping `ratio` in a cycle over the largest work of the loads at any phase.

    Far below 1, the loads balance stiffness and inertia; damping shifts the phase of the motion by this angle, rad, but
    does not change its amplitude. Near 1 or above, damping determines the amplitude. NaN if the loads do no work.
    """
    _, most, stored = _work_and_energy(problem, point)
    return 4.0 * np.pi * ratio * stored / most if most > 0.0 else float("nan")


def _work_and_energy(problem: ForcedProblem, point: ForcedPoint) -> tuple[float, float, float]:
    """Return the work of the harmonic loads in a cycle, its largest value for any phases, and the largest energy, J."""
    linear, every = problem.low.linear, fields(problem, point)
    order = len(point.coefficients) - 1
    moved = linear.recover(point.omega, point.coefficients)
    load = linear.load_at(point.omega).coefficients(order)
    each = np.pi * np.sum(load * np.conj(moved), axis=1)[1:]  # of a harmonic in its own cycle
    strain = linear.strain_energy(point.omega, point.coefficients)[1:].sum()
    springs = 0.25 * np.real(np.conj(every.gaps[1:]) * every.forces[1:]).sum()
    return float(each.imag.sum()), float(np.abs(each).sum()), float(2.0 * (strain + springs))


def signals(problem: ForcedProblem, point: ForcedPoint) -> Signals:
    """Return one period of gaps, forces and states at the contacts, at the samples of the sweep."""
    period = _period(problem, point)
    samples = problem.sweep.samples
    time = np.arange(samples) / samples * 2.0 * np.pi / point.omega
    return Signals(time, period.gap, period.force, period.state)


def _period(problem: ForcedProblem, point: ForcedPoint) -> ContactPeriod:
    """Return the contact forces and states over the period of a point."""
    own = problem.balance(point.support)
    if isinstance(own, DynamicLagrangian):  # rigid contacts follow from equilibrium
        return own.contacts(own.unknowns(point.coefficients), point.omega)
    gaps = point.coefficients @ own.interface.gap_operator.T
    return contact_forces(to_real(gaps), own.compiled, problem.sweep.samples, point.omega)


def rotation_and_strain(
    problem: ForcedProblem, point: ForcedPoint, away: FloatArray, stiff_volume: float
) -> tuple[float, float]:
    """Return the largest rotation (rad) and the root mean square of the strain of a motion; NaN where one is not known.

    Rotations are those of rotational dofs, and the mean slope from the clamp to an output.

    Parameters
    ----------
    problem
        The forced response.
    point
        A converged point of it.
    away
        (k,) distances of the first k outputs from the clamp, m; NaN where unknown.
    stiff_volume
        Volume times modulus of the elastic parts, J; NaN if unknown.
    """
    system, linear = problem.system, problem.low.linear
    moved = np.abs(linear.recover(point.omega, point.coefficients))[1:].sum(axis=0)
    turns = np.isin(np.array(system.structure.dofs.component), ROTATIONS)
    known = np.concatenate([moved[turns], moved[system.outputs[: away.size]] / away])
    known = known[np.isfinite(known)]
    strain = np.nan
    if np.isfinite(stiff_volume):
        energy = linear.strain_energy(point.omega, point.coefficients)[1:].sum()
        strain = float(np.sqrt(max(4.0 * energy, 0.0) / stiff_volume))
    return (float(known.max()) if known.size else np.nan), strain
