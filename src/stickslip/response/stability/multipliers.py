"""Stability of a solved point: Floquet multipliers of the motion on all reduced states and the places of the sliders."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.harmonic.linear import LinearSide, one_structure
from stickslip.model.blas_threads import by_one_thread
from stickslip.model.structure import Structure
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.contact_states import (
    ContactStates,
    is_located,
    located_part,
    located_states,
)
from stickslip.response.stability.kicks import sample_times, sampled_monodromy
from stickslip.response.stability.missing_harmonics import corrected
from stickslip.response.stability.modal_states import ModalStates, modal_states
from stickslip.response.stability.modulus import modulus_text
from stickslip.response.stability.monodromy import monodromy, share_of_monodromy
from stickslip.response.stability.sampled_tangents import (
    Path,
    SampledTangents,
    sampled_tangents,
)
from stickslip.response.time.floquet import UNIT_TOLERANCE, Floquet, floquet
from stickslip.response.time.sectors import InTime, all_in_time

SAMPLES = 256  # of a period, where laws are known by their tangents; and twice as many
SAMPLES_PER_HARMONIC = 16
ROUGH = 0.5  # error of a multiplier, relative to it, beyond which it shows no growth

Verdict = Literal["stable", "unstable", "undecided"]


@dataclass(frozen=True, eq=False)
class Stability:
    """Growth or decay of small disturbances of a periodic motion.

    Parameters
    ----------
    floquet
        Multipliers of the structure's states and of the sliders that move; those of `resting` sliders, which are 1, are left out.
    errors
        (n_states,) how far each multiplier may be from that of the motion with all harmonics: what a Newton step with more
        harmonics changes in it, and its change when the step was halved, where laws are known by sampled tangents. Not finite where nothing is known.
        The part of the step is too small where friction stops a light mass within a step, by up to twenty times in cases measured,
        and where planar contacts close into stick, by up to ten.
    resting
        Number of tangential springs, those of planar contacts among them, whose sliders rest for the whole period: each is a parameter of the motion, not a state.
    grazing
        Number of these that have reached their limit before and rest since: the multipliers are those of the side on which they rest.
    transitions
        Number of changes of state that were located over the period.
    """

    floquet: Floquet
    errors: FloatArray
    resting: int
    grazing: int
    transitions: int

    @property
    def error(self) -> float:
        """Largest error of a multiplier."""
        return float(np.max(self.errors, initial=0.0))

    @property
    def verdict(self) -> Verdict:
        """Whether disturbances die, or one grows; undecided where the error of a multiplier reaches the unit circle.

        A multiplier above 1 whose error is more than half of itself does not show that a disturbance grows: so much is no estimate.
        Neutral multipliers are not judged while their errors are of rounding.
        """
        size, errors = self._judged
        if np.any(self._outside):
            return "unstable"
        return "stable" if np.all(size + errors <= 1.0 + UNIT_TOLERANCE) else "undecided"

    @property
    def multiplier(self) -> float:
        """Modulus of the multiplier that decides, see `reason`; 0 where all are neutral, NaN where none is known."""
        return self._decisive[0]

    @property
    def multiplier_error(self) -> float:
        """How far that multiplier may be from that of the motion with all harmonics."""
        return self._decisive[1]

    @property
    def reason(self) -> str:
        """What the verdict rests on: which multiplier and its error, or what was not known."""
        size, error = self._decisive
        if np.isnan(size):
            return (
                "no multiplier is known: rounding makes more transitions than gaps of these harmonics can have, or a law gave "
                "tangents that are not finite"
            )
        if not np.isfinite(error):
            return (
                f"as it was solved the motion has a largest multiplier of modulus {size:.4g}; what more harmonics would change in it "
                "is not known, no motion with more was found nearby"
            )
        said = modulus_text(size, error)
        return {
            "unstable": f"a multiplier of modulus {said} lies outside the unit circle: a disturbance grows by as much in a period",
            "stable": f"the largest multiplier that is not neutral has the modulus {said}: disturbances die",
            "undecided": f"a multiplier of modulus {said} may lie on either side of the unit circle",
        }[self.verdict]

    @property
    def _judged(self) -> tuple[FloatArray, FloatArray]:
        """Moduli and errors of the multipliers that are judged."""
        off = np.abs(self.floquet.multipliers - 1.0) > UNIT_TOLERANCE
        judged = off | ~(self.errors <= UNIT_TOLERANCE)
        return np.abs(self.floquet.multipliers[judged]), self.errors[judged]

    @property
    def _outside(self) -> BoolArray:
        """Which of these show that a disturbance grows."""
        size, errors = self._judged
        return (size - errors > 1.0 + UNIT_TOLERANCE) & (errors <= ROUGH * size)

    @property
    def _decisive(self) -> tuple[float, float]:
        """Modulus and error of the largest multiplier among those that make the verdict what it is."""
        size, errors = self._judged
        reaching = size + errors > 1.0 + UNIT_TOLERANCE
        of_verdict = next((own for own in (self._outside, reaching) if np.any(own)), size >= 0.0)
        if not np.any(of_verdict):
            unknown = np.any(np.isnan(size))
            return (np.nan, np.inf) if unknown else (0.0, 0.0)
        at = np.flatnonzero(of_verdict)[np.argmax(size[of_verdict])]
        return float(size[at]), float(errors[at])

    @property
    def unknown(self) -> bool:
        """Whether no multiplier is known."""
        return bool(np.any(np.isnan(self.floquet.multipliers)))

    @property
    def stable(self) -> bool:
        """Whether it is known that no small disturbance grows."""
        return self.verdict == "stable"


@by_one_thread
def stability(problem: ForcedProblem, point: ForcedPoint) -> Stability:
    """Return the stability of a solved point of a forced response.

    The multipliers are those of the motion after a Newton step with more harmonics, and what this step changes in them is part of their
    errors: few harmonics give the times of transitions less well than amplitudes. Where one step does not lead nearer to a motion, Newton's
    method goes on to one.

    Parameters
    ----------
    problem
        The forced response that the point belongs to.
    point
        A converged one.

    Raises
    ------
    InputError
        If the point did not converge, a contact is rigid, or what vibrates is one sector of a tuned wheel without all its waves.
    """
    if not point.converged:
        raise input_error(
            "stability: point",
            f"did not converge at {point.omega:g} rad/s ({point.status.advice})",
            "Ask for the stability of solutions only.",
        )
    solved = _of_point(problem, point)
    more = corrected(problem, point)
    better = None if more is None else _of_point(problem, more[0])
    if more is not None and better is not None and not better.unknown and not solved.unknown:
        return _with_change(solved, better, more[1])
    found = better if solved.unknown and better is not None else solved
    return replace(found, errors=np.full_like(found.errors, np.inf))


def _of_point(problem: ForcedProblem, point: ForcedPoint) -> Stability:
    """Return the stability of the motion of a point as it was solved; of a wheel that of all its sectors, each moving on its own."""
    gaps = point.coefficients @ problem.low.interface.gap_operator.T
    return stability_in_time(all_in_time(problem.system, gaps), point.omega)


def _with_change(solved: Stability, better: Stability, times: float) -> Stability:
    """Return the better of two, with so many `times` the change of each multiplier as a part of its error."""
    found = better.floquet.multipliers
    other: ComplexArray = np.append(
        solved.floquet.multipliers, np.zeros(max(0, found.size - solved.errors.size))
    )
    change = np.abs(found - _partners(other, found))
    return replace(better, errors=better.errors + times * change)


@by_one_thread
def motion_stability(
    structure: LinearSide, interface: Interface, gap_coefficients: FloatArray, omega: float
) -> Stability:
    """Return the stability of a periodic motion of a structure with contacts, as it is given.

    Disturbances obey the linear equations of the structure and of the states that each contact is in; the motion enters through the
    times of the transitions and the rates there.

    Parameters
    ----------
    structure
        One structure with real matrices, viscous damping and a mass on every coordinate.
    interface
        Contacts on its dofs.
    gap_coefficients
        (2H+1, 3 n_contacts) real Fourier coefficients of the gaps, m.
    omega
        rad/s.

    Raises
    ------
    InputError
        If a contact is rigid, harmonics vibrate as different structures, or the structure cannot be marched in time.
    """
    whole = one_structure(structure, "stability")
    return stability_in_time(InTime(whole, interface, gap_coefficients), omega)


def stability_in_time(own: InTime, omega: float) -> Stability:
    """Return the stability of a motion of what is marched in time; see `motion_stability`."""
    modes = _prepared(own.structure, own.contacts, omega)
    contacts = located_states(own.contacts, own.gaps)
    if contacts is None:
        return _unknown(modes.n)
    located = np.array([is_located(law) for law in own.contacts.laws], dtype=bool)
    if np.all(located):
        found = _powers(*_located_matrix(modes, contacts, own))
        return _judged(contacts, found, np.zeros(found.size), modes.n)
    return _sampled(modes, contacts, own.contacts, np.flatnonzero(~located), own.gaps)


def period_matrix(own: InTime, omega: float) -> tuple[ModalStates, FloatArray, int] | None:
    """Return the derivative of all states after a period of a motion by those before, the modal ones first; None where nothing is known.

    Of a travelling motion it is that after a share of the period, whose number is returned. Where laws are known by sampled tangents, it is
    that of the finest samples.
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


def _located_matrix(
    modes: ModalStates, contacts: ContactStates, own: InTime
) -> tuple[FloatArray, int]:
    """Return the matrix of a share of the period, where there are shares, and their number."""
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
    """Return the samples of a period, `halves` halves of the least number, and the gaps of the contacts `own`."""
    samples = max(SAMPLES, SAMPLES_PER_HARMONIC * ((len(gap_coefficients) - 1) // 2))
    polynomials = gap_coefficients.reshape(len(gap_coefficients), -1, 3)[:, own]
    return sample_times(contacts, samples, halves), polynomials


def _judged(
    contacts: ContactStates, multipliers: ComplexArray, errors: FloatArray, n: int, more: int = 0
) -> Stability:
    """Return the stability with a multiplier of zero for each slider without a state when the period begins."""
    size = 2 * n + contacts.rows.size + contacts.always_slipping + more
    multipliers, errors = (
        multipliers[:size],
        errors[:size],
    )  # samples before the first leave more zeros
    missing = size - multipliers.size
    found = Floquet(np.append(multipliers, np.zeros(missing, dtype=complex)))
    errors = np.append(errors, np.zeros(missing))
    return Stability(found, errors, contacts.resting, contacts.grazing, contacts.transitions)


def _sampled(
    modes: ModalStates,
    contacts: ContactStates,
    interface: Interface,
    own: IntArray,
    gap_coefficients: FloatArray,
) -> Stability:
    """Return the stability where the tangents of the contacts `own` are sampled: of two steps, extrapolated.

    A third step between these guards the errors against two that agree by chance, as errors of first order do now and then.
    """
    laws = [interface.laws[c] for c in own]
    made = [_samples(contacts, own, gap_coefficients, halves) for halves in (2, 3, 4)]
    times, polynomials = [each for each, _ in made], made[0][1]
    tangents = [_tangents(laws, own, each, polynomials, modes.omega) for each in times]
    if not all(np.all(np.isfinite(each.jac)) for each in tangents):
        return _unknown(modes.n)
    kept = np.any([each.kept for each in tangents], axis=0)
    coarse, between, fine = (
        floquet(
            sampled_monodromy(modes, contacts, at, replace(each, kept=kept), interface.factors[own])
        ).multipliers
        for at, each in zip(times, tangents, strict=True)
    )
    partners = _partners(coarse, fine)
    extrapolated = fine + (fine - partners) / 3.0
    errors = np.maximum(np.abs(fine - partners), np.abs(fine - _partners(between, fine)))
    # a multiplier of 1 is one of a state that keeps its memory, and is not moved
    extrapolated[np.abs(fine - 1.0) <= UNIT_TOLERANCE] = 1.0
    same = np.all([np.all(each.kept == kept, axis=1) for each in tangents], axis=0)
    resting, grazing = (int(np.sum(n[same])) for n in (tangents[-1].resting, tangents[-1].grazing))
    whole = replace(
        contacts, resting=contacts.resting + resting, grazing=contacts.grazing + grazing
    )
    order = np.argsort(-np.abs(extrapolated), kind="stable")
    return _judged(whole, extrapolated[order], errors[order], modes.n, int(kept.sum()))


def _tangents(
    laws: list[ContactLaw],
    own: IntArray,
    times: list[FloatArray],
    polynomials: FloatArray,
    omega: float,
) -> SampledTangents:
    """Return the tangents of laws at samples, without what of them is located."""
    found = sampled_tangents(laws, own, Path(np.concatenate(times), polynomials, omega))
    apart = [located_part(law) is not None for law in laws]
    found.jac[:, apart, 2] = 0.0
    return found


def _partners(coarse: ComplexArray, fine: ComplexArray) -> ComplexArray:
    """Return the coarse multipliers in the order of the fine ones."""
    left, out = coarse.copy(), np.empty_like(fine)
    for i, value in enumerate(fine):
        nearest = int(np.nanargmin(np.abs(left - value))) if np.any(~np.isnan(left)) else 0
        out[i] = left[nearest]
        left[nearest] = np.nan
    return out


def _unknown(n: int) -> Stability:
    """Return that nothing is known: rounding made more transitions than such gaps can have, or a law gave no tangents."""
    unknown = np.full(2 * n, np.nan, dtype=complex)
    return Stability(Floquet(unknown), np.full(2 * n, np.inf), 0, 0, 0)
