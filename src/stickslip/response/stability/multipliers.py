"""Floquet multipliers of a solved point, with all reduced states and slider positions."""

from dataclasses import replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error
from stickslip.harmonic.linear import LinearSide, one_structure
from stickslip.model.blas_threads import by_one_thread
from stickslip.model.structure import Structure
from stickslip.response.stability.flow_map.contact_states import ContactStates, is_located, located_part, located_states
from stickslip.response.stability.flow_map.modal_states import ModalStates, modal_states
from stickslip.response.stability.flow_map.monodromy import (
    monodromy,
    sample_times,
    sampled_monodromy,
    share_of_monodromy,
)
from stickslip.response.stability.flow_map.sampled_tangents import Path, SampledTangents, sampled_tangents
from stickslip.response.stability.found import UNIT_TOLERANCE, Floquet, Stability, changes, floquet, partners
from stickslip.response.time.sectors import InTime

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
