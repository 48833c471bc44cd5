"""Floquet multipliers of a solved point, with all reduced states and slider positions; with more harmonics until the verdict is clear."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.harmonic.linear import LinearSide, one_structure
from stickslip.model.blas_threads import by_one_thread
from stickslip.model.structure import Structure
from stickslip.response.forced.along import SAFETY
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.flow_map.contact_states import ContactStates, is_located, located_part, located_states
from stickslip.response.stability.flow_map.modal_states import ModalStates, modal_states
from stickslip.response.stability.flow_map.monodromy import (
    monodromy,
    sample_times,
    sampled_monodromy,
    share_of_monodromy,
)
from stickslip.response.stability.flow_map.sampled_tangents import Path, SampledTangents, sampled_tangents
from stickslip.response.stability.found import UNIT_TOLERANCE, Floquet, Stability, changes, floquet, may_leave, partners
from stickslip.response.stability.missing_harmonics import corrected_by_step, more_harmonics, with_more
from stickslip.response.time.sectors import InTime, all_in_time

SAMPLES = 256  # in a period for laws with sampled tangents; the finest step has twice as many
SAMPLES_PER_HARMONIC = 16
PRODUCTS = 20  # matrix products for the exponential of an interval
DECOMPOSED = 25  # cost of eigenvalues, in matrix products


@by_one_thread
def motion_stability(
    structure: LinearSide, interface: Interface, gap_coefficients: FloatArray, omega: float
) -> Stability:
    """Return the stability of a given periodic motion of a structure with contacts.

    Disturbances obey the linear equations of the structure and of the present contact states; the motion enters through
    the times of the transitions and the rates there.

    Parameters
    ----------
    structure
        One structure with real matrices, viscous damping and a mass on every coordinate.
    interface
        Contacts on its dofs.
    gap_coefficients
        (2H+1, 3 n_contacts) real Fourier coefficients of the gaps, m.
    omega
        Frequency of the motion, rad/s.

    Raises
    ------
    InputError
        If a contact is rigid, harmonics have different structural matrices, or the structure has no equations in time.
    """
    whole = one_structure(structure, "stability")
    return stability_in_time(InTime(whole, interface, gap_coefficients), omega)


def stability_in_time(own: InTime, omega: float) -> Stability:
    """Return the stability of a motion of a structure in time; see `motion_stability`."""
    modes = _prepared(own.structure, own.contacts, omega)
    contacts = located_states(own.contacts, own.gaps)
    if contacts is None:
        return _unknown(modes.n)
    located = np.array([is_located(law) for law in own.contacts.laws], dtype=bool)
    if np.all(located):
        found = _powers(*_located_matrix(modes, contacts, own))
        none = np.zeros(found.size)
        return _judged(contacts, found, none, none, modes.n)
    return _sampled(modes, contacts, own.contacts, np.flatnonzero(~located), own.gaps)


def period_matrix(own: InTime, omega: float) -> tuple[ModalStates, FloatArray, int] | None:
    """Return the modal states, the monodromy matrix and the number of shares of the period; None if unknown.

    The matrix has the modal states first.

    For a travelling wave the matrix covers one share of the period. For laws with sampled tangents it belongs to the
    finest samples.
    """
    interface = own.contacts
    modes = _prepared(own.structure, interface, omega)
    contacts = located_states(interface, own.gaps)
    if contacts is None:
        return None
    sampled = np.flatnonzero([not is_located(law) for law in interface.laws])
    if not sampled.size:
        return modes, *_located_matrix(modes, contacts, own)
    times, polynomials = _samples(contacts, sampled, own.gaps, 4)
    laws_there = [interface.laws[c] for c in sampled]
    at = _tangents(laws_there, sampled, times, polynomials, modes.omega)
    if not np.all(np.isfinite(at.jac)):
        return None
    return modes, sampled_monodromy(modes, contacts, times, at, interface.factors[sampled]), 1


def _located_matrix(modes: ModalStates, contacts: ContactStates, own: InTime) -> tuple[FloatArray, int]:
    """Return the monodromy matrix of a share of the period, and the number of shares (1 without symmetry)."""
    share = share_of_monodromy(modes, contacts, own)
    return (monodromy(modes, contacts), 1) if share is None else (share, own.shares)


def _powers(matrix: FloatArray, shares: int) -> ComplexArray:
    """Return the multipliers of the period from the matrix of one of its shares."""
    return np.asarray(floquet(matrix).multipliers ** shares)


def _prepared(structure: Structure, interface: Interface, omega: float) -> ModalStates:
    """Return the modal states."""
    if interface.rigid:
        raise input_error(
            "stability",
            "a contact is rigid: its states have no multipliers that follow from forces as functions of gaps",
            "Give the contacts a stiffness, as elastic_coulomb.",
        )
    return modal_states(structure, interface.gap_operator, interface.stuck_stiffness(), omega)


def _samples(
    contacts: ContactStates, own: IntArray, gap_coefficients: FloatArray, halves: int
) -> tuple[list[FloatArray], FloatArray]:
    """Return the samples of a period, and the Fourier coefficients of the contacts `own`.

    The samples are `halves` / 2 times the smallest number.
    """
    samples = max(SAMPLES, SAMPLES_PER_HARMONIC * ((len(gap_coefficients) - 1) // 2))
    polynomials = gap_coefficients.reshape(len(gap_coefficients), -1, 3)[:, own]
    return sample_times(contacts, samples, halves), polynomials


def _judged(
    contacts: ContactStates, multipliers: ComplexArray, errors: FloatArray, moduli: FloatArray, n: int, more: int = 0
) -> Stability:
    """Return the stability with a multiplier of zero for each slider without a state at the beginning of the period."""
    size = 2 * n + contacts.rows.size + contacts.always_slipping + more
    rest = np.zeros(max(0, size - multipliers.size))
    found = Floquet(np.append(multipliers[:size], rest.astype(complex)))
    return Stability(
        found,
        np.append(errors[:size], rest),  # samples before the first leave more zeros
        contacts.resting,
        contacts.grazing,
        contacts.transitions,
        np.append(moduli[:size], rest),
        (PRODUCTS * (len(contacts.times) - 1) + DECOMPOSED) * 2.0 * (2.0 * n) ** 3,
    )


def _sampled(
    modes: ModalStates, contacts: ContactStates, interface: Interface, own: IntArray, gap_coefficients: FloatArray
) -> Stability:
    """Return the stability with sampled tangents of the contacts `own`, extrapolated from two steps.

    A third step between these protects the error estimate against chance agreement of two steps, which happens with
    first-order errors.
    """
    laws = [interface.laws[c] for c in own]
    made = [_samples(contacts, own, gap_coefficients, halves) for halves in (2, 3, 4)]
    times, polynomials = [each for each, _ in made], made[0][1]
    tangents = [_tangents(laws, own, each, polynomials, modes.omega) for each in times]
    if not all(np.all(np.isfinite(each.jac)) for each in tangents):
        return _unknown(modes.n)
    kept = np.any([each.kept for each in tangents], axis=0)
    coarse, between, fine = (
        floquet(sampled_monodromy(modes, contacts, at, replace(each, kept=kept), interface.factors[own])).multipliers
        for at, each in zip(times, tangents, strict=True)
    )
    extrapolated = fine + (fine - partners(coarse, fine)) / 3.0
    pairs = [changes(fine, other) for other in (coarse, between)]
    errors, moduli = (np.maximum(a, b) for a, b in zip(*pairs, strict=True))
    # an exact multiplier of 1 belongs to a permanent state
    extrapolated[np.abs(fine - 1.0) <= UNIT_TOLERANCE] = 1.0
    same = np.all([np.all(each.kept == kept, axis=1) for each in tangents], axis=0)
    resting, grazing = (int(np.sum(n[same])) for n in (tangents[-1].resting, tangents[-1].grazing))
    whole = replace(contacts, resting=contacts.resting + resting, grazing=contacts.grazing + grazing)
    order = np.argsort(-np.abs(extrapolated), kind="stable")
    own_states = int(kept.sum())
    return _judged(whole, extrapolated[order], errors[order], moduli[order], modes.n, own_states)


def _tangents(
    laws: list[ContactLaw], own: IntArray, times: list[FloatArray], polynomials: FloatArray, omega: float
) -> SampledTangents:
    """Return the sampled tangents of laws, without their parts with located transitions."""
    found = sampled_tangents(laws, own, Path(np.concatenate(times), polynomials, omega))
    apart = [located_part(law) is not None for law in laws]
    found.jac[:, apart, 2] = 0.0
    return found


def _unknown(n: int) -> Stability:
    """Return an unknown stability: rounding made more transitions than possible, or a law gave no tangents."""
    unknown = np.full(2 * n, np.nan, dtype=complex)
    return Stability(Floquet(unknown), np.full(2 * n, np.inf), 0, 0, 0)


ROUGHLY = 3.0  # error of a multiplier over its change by one Newton step
FIRST = 2.0  # error of a multiplier over its change from the motion as solved
SAME_MOTION = 0.1  # distance over the threshold, up to which a motion with more harmonics is the same motion
MOST_FURTHER_ROWS = 1000  # of the balance that is solved to see whether multipliers meet
OTHER = 2.0  # additional factor on both errors if the numbers of transitions differ


@dataclass(frozen=True, eq=False)
class _Rung:
    """Motion with its stability, and its relative change from the previous motion with fewer harmonics."""

    point: ForcedPoint
    stability: Stability
    change: float = float("nan")


@dataclass(frozen=True, eq=False)
class Settled:
    """Stability of a point, and the motion that has it if this is not the point as solved.

    Parameters
    ----------
    stability
        Stability of the motion with more harmonics.
    motion
        The motion with more harmonics, if the point as solved differs in stability or is another motion; its predicted
        error is its change from fewer harmonics. Otherwise None.
    """

    stability: Stability
    motion: ForcedPoint | None = None


@by_one_thread
def stability(problem: ForcedProblem, point: ForcedPoint, more: ForcedPoint | None = None) -> Stability:
    """Return the stability of a solved point of a forced response; `settled_stability` also returns the motion."""
    return settled_stability(problem, point, more).stability


@by_one_thread
def settled_stability(problem: ForcedProblem, point: ForcedPoint, more: ForcedPoint | None = None) -> Settled:
    """Return the stability of a solved point of a forced response.

    The multipliers belong to the motion after a Newton step with more harmonics, since few harmonics give transition
    times less accurately than amplitudes. Their error is their change by this step times `ROUGHLY`. If the verdict
    stays open, the motion is solved repeatedly with about twice the harmonics, and the change from one solution to the
    next is the error.

    Near a fold, or where contacts bounce, several motions lie within a few percent, and more harmonics may lead to
    another one. The verdict then belongs to the returned motion. A motion farther away than the threshold of the
    strategy gives no verdict on the point.

    Parameters
    ----------
    problem
        The forced response that the point belongs to.
    point
        A converged point.
    more
        The same motion solved with more harmonics, if known; it replaces the Newton step.

    Raises
    ------
    InputError
        If the point did not converge, a contact is rigid, or the structure is a sector of a tuned wheel without all its
        waves.
    """
    if not point.converged:
        raise input_error(
            "stability: point",
            f"did not converge at {point.omega:g} rad/s ({point.status.advice})",
            "Ask for the stability of solutions only.",
        )
    first = _Rung(point, of_point(problem, point))
    if more is not None:
        found = of_point(problem, more)
        best = _unsure(first) if found.unknown else _compared(found, first, FIRST)
        rung = _Rung(more, found, problem.real_error(point, more))
        open_ = _open(problem, first, found, more.order)
        settled = _settled(problem, rung, 1.0, best, first.stability.work + found.work, open_=open_)
        return _beside(problem, first, *settled)
    step = corrected_by_step(problem, point)
    if step is not None and step.point is point:
        return Settled(first.stability)
    work, best, open_ = first.stability.work, _unsure(first), False
    if step is not None:
        found = of_point(problem, step.point)
        work += found.work + step.work
        if not found.unknown:
            best = _compared(found, first, ROUGHLY)
            open_ = _open(problem, first, found, step.point.order)
    return _beside(problem, first, *_settled(problem, first, FIRST, best, work, open_=open_))


def _beside(problem: ForcedProblem, first: _Rung, found: Stability, last: _Rung) -> Settled:
    """Return the stability, with its motion if this is not the point as solved.

    The motion is given if the point differs in stability or lies away; the stability is unknown if it lies too far
    away.

    Near a fold, a stable and an unstable motion may lie within a percent. A point with few harmonics may be closer to
    one of them while more harmonics lead to the other; the verdict then belongs to the motion with more harmonics.
    """
    if last is first or found.verdict not in ("stable", "unstable"):
        return Settled(found)
    threshold, away = problem.strategy.threshold, problem.real_error(first.point, last.point)
    same_side = first.stability.grows == (found.verdict == "unstable")
    raises = problem.sweep.auto and problem.strategy.verifies
    if same_side and not (raises and away > SAME_MOTION * threshold):
        return Settled(found)
    if away > threshold:
        return Settled(replace(_unsure(first), work=found.work))
    bound = SAFETY[1] * last.change
    own = last.point
    return Settled(found, with_more(first.point, own.coefficients, own.harmonics, bound))


def _open(problem: ForcedProblem, first: _Rung, found: Stability, order: int) -> bool:
    """Return whether a stable verdict needs one more motion: few harmonics move multipliers far, and a meeting may follow.

    Not for large systems, whose next motion costs more than `MOST_FURTHER_ROWS` rows.
    """
    rows = problem.system.retained.size * (2 * (2 * order + 3) + 1)
    worse = first.stability
    if rows > MOST_FURTHER_ROWS or found.unknown or worse.unknown:
        return False
    return may_leave(found.floquet.multipliers, worse.floquet.multipliers)


def _unsure(rung: _Rung) -> Stability:
    """Return the stability of a motion whose change with more harmonics is unknown."""
    own = rung.stability
    return replace(own, errors=np.full_like(own.errors, np.inf), moduli=None)


def _settled(
    problem: ForcedProblem, last: _Rung, times: float, best: Stability, work: float, *, open_: bool = False
) -> tuple[Stability, _Rung]:
    """Return the stability with increasing harmonics until it is settled, and the last motion.

    The first error is `times` the change. `open_`: one more motion is solved, whatever the verdict.
    """
    rungs = more_harmonics(problem, last.point)
    while (open_ or not best.settled) and (more := next(rungs, None)) is not None:
        found = of_point(problem, more.point)
        work += found.work + more.work
        if found.unknown:
            continue
        best = _compared(found, last, times)
        last = _Rung(more.point, found, problem.real_error(last.point, more.point))
        times, open_ = 1.0, False
    return replace(best, work=work), last


def of_point(problem: ForcedProblem, point: ForcedPoint) -> Stability:
    """Return the stability of a point as solved; for a wheel with independent disturbances of all sectors."""
    gaps = point.coefficients @ problem.low.interface.gap_operator.T
    return stability_in_time(all_in_time(problem.system, gaps), point.omega)


def _compared(found: Stability, other: _Rung, times: float) -> Stability:
    """Return the stability of a motion; its errors are `times` its change from a less accurate one."""
    worse = other.stability
    if worse.unknown:
        return replace(found, errors=np.full_like(found.errors, np.inf), moduli=None)
    if times > 1.0 and worse.transitions != found.transitions:
        times *= OTHER
    distance, modulus = changes(found.floquet.multipliers, worse.floquet.multipliers)
    own = found.errors if found.moduli is None else found.moduli
    return replace(found, errors=found.errors + times * distance, moduli=own + times * modulus)
