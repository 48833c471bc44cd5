"""Hill's method, exact for friction; for a wheel, disturbances of every wave on one sector."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import islice
from typing import Any

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import input_error
from stickslip.harmonic.harmonic_set import to_real
from stickslip.model.blas_threads import by_one_thread
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.flow_map.contact_states import ContactStates, is_located, located_states
from stickslip.response.stability.found import Floquet, Stability
from stickslip.response.stability.hill_method.contact_tangent import contact_tangents
from stickslip.response.stability.hill_method.hill_modes import HillSide
from stickslip.response.stability.hill_method.hill_segment import Hill, Keep, not_kept
from stickslip.response.stability.hill_method.hill_spectrum import Exponents, exponents, segments_of
from stickslip.response.stability.missing_harmonics import corrected, more_harmonics
from stickslip.response.stability.waves import WaveDisturbance
from stickslip.response.system import System

# highest harmonic of disturbances: FACTOR times the highest harmonic of the motion plus MORE, within the limits below
HARMONICS_FACTOR, HARMONICS_MORE = 2, 3
MIN_HILL_HARMONICS, MAX_HILL_HARMONICS = 8, 20
MAX_ROWS = 1300
MIN_HARMONICS_OF_MANY_ROWS = 5
# rows up to which harmonics are added until every mode resonates in one
MAX_RINGING_ROWS = 400
# rows up to which harmonics are doubled while higher ones matter,
# and added until every mode that contacts may destabilise resonates in one
MAX_DOUBLED_ROWS = 700
# rows up to which all waves of a wheel are compared with the motion as solved; beyond, only the fastest growing ones
MAX_ROWS_OF_COMPARED_WAVES = 700
COMPARED_WAVES = 3
# modulus over the largest, above which a multiplier is one of the largest;
# multipliers without a comparison take the largest change of their group
NEAR_LARGEST_SHARE = 0.95
# relative error of a multiplier from modes that resonate above all solved harmonics; measured 9e-5
RINGING_ABOVE = 3e-4
# real part above which exponents decide, and the largest allowed change of these by higher harmonics
DECIDING_REAL_PART, DECIDED_CHANGE = -0.03, 3e-3
FURTHER_MOTIONS = 2  # motions with more harmonics to try if the verdict stays open


@dataclass(frozen=True, eq=False)
class HillStability:
    """Growth or decay of small disturbances of a motion, by Hill's method.

    Parameters
    ----------
    stability
        Verdict, and the multipliers near and outside the unit circle.
    disturbance
        Disturbance of the deciding multiplier; None without a multiplier near the unit circle.
    missing
        Number of multipliers outside the unit circle that were counted by the winding of the determinant but not found;
        None if they could not be counted.
    """

    stability: Stability
    disturbance: WaveDisturbance | None
    missing: int | None

    @property
    def reason(self) -> str:
        """Basis of the verdict."""
        if self.stability.verdict == "unstable":
            return self.stability.reason
        if self.missing is None:
            return (
                "Hill's method did not count the multipliers outside the unit circle: contacts may make a mode grow that rings above the harmonics "
                "solved, its polynomial is too far from the contacts, or rounding made more transitions than there can be"
            )
        if self.missing:
            return f"{self.missing} multipliers outside the unit circle were counted that Hill's method did not find"
        return self.stability.reason


@by_one_thread
def hill_stability(problem: ForcedProblem, point: ForcedPoint, keep: Keep = not_kept) -> HillStability:
    """Return the stability of a solved point of a forced response.

    For a tuned wheel the disturbances have every wave.

    As in `stability`, the multipliers belong to the motion with more harmonics, and their change is part of the errors.
    Structural damping and frequency-dependent aerodynamic coefficients act as in the balance.

    Parameters
    ----------
    problem, point
        As in `stability`.
    keep
        Cache of intermediate results by their inputs, from which an interrupted computation continues.

    Raises
    ------
    InputError
        If the point did not converge, a law's transitions are not located, or a tuned wheel lacks waves.
    """
    if not point.converged:
        raise input_error(
            "hill_stability: point",
            f"did not converge at {point.omega:g} rad/s ({point.status.advice})",
            "Ask for the stability of solutions only.",
        )
    system, more = problem.system.at(point.omega), corrected(problem, point)
    better, times = (point, np.inf) if more is None else more
    hill, states = _of_point(system, problem, better, keep=keep)
    if hill is None or states is None:
        return _unknown()
    hill, found = _refined(hill)
    change = np.full(found.values.size, np.inf)
    if better is point and more is not None:
        change[:] = 0.0
    elif more is not None:
        solved, _ = _of_point(system, problem, point, hill.order, keep)  # with the same modes
        change = change if solved is None else times * _changes(found, solved)
    first = _judged(found, change, states, hill)
    if first.missing or more is None or better is point:
        return first
    return _climbed(
        problem, replace(point, coefficients=better.coefficients, harmonics=better.harmonics), hill, found, first, keep
    )


def _climbed(
    problem: ForcedProblem, point: ForcedPoint, hill: Hill, found: Exponents, first: HillStability, keep: Keep
) -> HillStability:
    """Return the stability of the motion with about twice the harmonics.

    If the verdict stays open, four times as many are used.
    """
    system, best = problem.system.at(point.omega), first
    for more in islice(more_harmonics(problem, point), FURTHER_MOTIONS):
        if best.stability.settled:
            break
        now, states = _of_point(system, problem, more.point, hill.order, keep)
        if now is None or states is None:
            break
        last, found, hill = found, exponents(now), now
        best = _judged(found, _distances(found, last, now), states, now)
    return best


@by_one_thread
def hill_exponents(system: System, gaps: ComplexArray, omega: float, order: int | None = None) -> Exponents:
    """Return the Floquet exponents of a given motion near the imaginary axis and right of it.

    Parameters
    ----------
    system
        A structure, or a tuned wheel with all its waves.
    gaps
        (H+1, 3 n_contacts) complex coefficients of the gaps (of sector 0 for a wheel), m.
    omega
        Frequency of the motion, rad/s.
    order
        Highest solved harmonic of the disturbances; higher ones act to first order. None: chosen from the harmonics of
        the motion.

    Raises
    ------
    InputError
        If a contact is rigid, a law's transitions are not located, rounding makes more transitions than possible, or a
        tuned wheel lacks waves.
    """
    hill, _ = _prepared(system, gaps, omega, order)
    if hill is None:
        raise input_error(
            "hill_exponents",
            "rounding makes more transitions than gaps of these harmonics can have",
            "Give a motion of fewer harmonics.",
        )
    return exponents(hill) if order is not None else _refined(hill)[1]


def _refined(hill: Hill) -> tuple[Hill, Exponents]:
    """Return the problem and its exponents with enough harmonics, if the limits allow.

    The deciding exponent has then converged.
    """
    found = exponents(hill)
    while True:
        deciding = np.max(found.errors[found.values.real > DECIDING_REAL_PART], initial=0.0)
        more = replace(hill, order=2 * hill.order)
        known = found.missing == 0 and deciding < DECIDED_CHANGE
        in_vain = more.order < hill.reach
        if known or in_vain or more.rows > MAX_DOUBLED_ROWS:
            return hill, found
        hill, found = more, exponents(more)


def _of_point(
    system: System, problem: ForcedProblem, point: ForcedPoint, order: int | None = None, keep: Keep = not_kept
) -> tuple[Hill | None, ContactStates | None]:
    gaps = point.coefficients @ problem.low.interface.gap_operator.T
    hill, states = _prepared(system, gaps, point.omega, order)
    if hill is None:
        return None, None
    motion = sha256(np.ascontiguousarray(gaps).tobytes()).hexdigest()

    def kept(place: str, make: Callable[[], Mapping[str, Any]]) -> Mapping[str, Any]:
        return keep(f"{motion} {point.omega!r} {place}", make)

    return replace(hill, keep=kept), states


def _prepared(
    system: System, gaps: ComplexArray, omega: float, order: int | None
) -> tuple[Hill | None, ContactStates | None]:
    """Return Hill's problem of a motion and the states of its contacts; None if these are unknown."""
    side, interface = system.structure, system.interface
    if side.wheel is not None and not side.wheel.has_every_wave:
        raise input_error(
            "hill_stability",
            "the wheel has not all its waves, each of which a disturbance may be",
            "Assemble it with every_wave=True.",
        )
    if interface.rigid or not all(is_located(law) for law in interface.laws):
        raise input_error(
            "hill_stability",
            "a contact is rigid, or its law changes its state at times that are not located",
            "Take a piecewise linear law, as elastic_coulomb; the multipliers of `stability` know the others, but for rigid ones.",
        )
    states = located_states(interface, to_real(gaps))
    if states is None:
        return None, None
    springs, ports, tangents = contact_tangents(states)
    hill = Hill(HillSide(system, springs, ports, omega, {}), tangents, order or 0)
    return replace(hill, order=_order(hill, len(gaps) - 1)) if order is None else hill, states


def _order(hill: Hill, motion: int) -> int:
    """Return the highest solved harmonic.

    If affordable, each mode, or each mode that may grow, resonates in a solved harmonic.
    """
    ports = max(hill.side.ports.size, 1)
    ratios = hill.side.modes(0, 0).ratios
    least = min(max(HARMONICS_FACTOR * motion + HARMONICS_MORE, MIN_HILL_HARMONICS), MAX_HILL_HARMONICS)
    highest = float(np.max(ratios[np.isfinite(ratios)], initial=0.0))
    for top, rows in ((max(highest, hill.reach), MAX_RINGING_ROWS), (hill.reach, MAX_DOUBLED_ROWS)):
        order = int(np.ceil(top)) + 1
        if order > least and (2 * order + 1) * ports <= rows:
            return order
    return max(min(least, (MAX_ROWS // ports - 1) // 2), MIN_HARMONICS_OF_MANY_ROWS)


def _changes(found: Exponents, solved: Hill) -> FloatArray:
    """Return the change of each multiplier against the motion as solved.

    For a large wheel it is estimated from a few waves.
    """
    waves = solved.side.waves
    if waves <= COMPARED_WAVES or solved.rows <= MAX_ROWS_OF_COMPARED_WAVES:
        return _distances(found, exponents(solved, segments_of(solved)), solved)
    standing = np.minimum(found.waves, waves - found.waves) % waves
    first = list(dict.fromkeys(standing.tolist()))[:COMPARED_WAVES]
    other = exponents(solved, [s for s in segments_of(solved) if s.wave in first])
    known, size = np.isin(standing, first), np.abs(found.multipliers)
    change = np.where(known, _distances(found, other, solved), 0.0)
    for alike in (size > NEAR_LARGEST_SHARE * np.max(size), size <= NEAR_LARGEST_SHARE * np.max(size)):
        some = known & alike
        most = np.max(change[some] / size[some], initial=0.0) if np.any(some) else 1.0
        change = np.where(alike & ~known, most * size, change)
    return np.asarray(change)


def _distances(found: Exponents, other: Exponents, hill: Hill) -> FloatArray:
    """Return the distance of each multiplier from the nearest other one of the same wave.

    Any shift of the harmonic is allowed.
    """
    own, theirs = found.multipliers, other.multipliers
    out = np.abs(own)  # a new multiplier counts as changed from zero
    for i, wave in enumerate(found.waves):
        waves = [hill.side.wave_of(int(wave), turn) for turn in (-1, 0, 1)]
        out[i] = np.min(np.abs(theirs[np.isin(other.waves, waves)] - own[i]), initial=out[i])
    return np.asarray(out)


def _judged(found: Exponents, change: FloatArray, states: ContactStates, hill: Hill) -> HillStability:
    values = found.multipliers
    errors = change + 2.0 * np.pi * np.abs(values) * found.errors
    ratios = hill.side.modes(0, 0).ratios
    if np.any(ratios[np.isfinite(ratios)] > hill.order) and hill.tangents:
        errors = errors + RINGING_ABOVE * np.abs(values)
    if found.missing is None or found.missing:
        # missing multipliers cannot stabilise a motion with a known growing one
        errors = np.where(np.abs(values) > 1.0, errors, np.inf)
        if not values.size:
            values, errors = np.array([np.nan + 0j]), np.array([np.inf])
    own = Stability(Floquet(values), errors, states.resting, states.grazing, states.transitions)
    if not found.values.size:
        return HillStability(own, None, found.missing)
    size = own.multiplier
    at = int(np.argmin(np.abs(np.abs(values) - size))) if np.isfinite(size) else 0
    return HillStability(own, _disturbance(found, at, hill.side), found.missing)


def _disturbance(found: Exponents, at: int, side: HillSide) -> WaveDisturbance:
    """Return the disturbance of an exponent: its strongest harmonic, as a wave with positive frequency."""
    value, harmonic = found.values[at], int(found.harmonics[at])
    frequency = float(value.imag) + harmonic
    wave = side.wave_of(int(found.waves[at]), harmonic)
    wave = wave if frequency >= 0.0 else -wave % side.waves
    multiplier = complex(found.multipliers[at])
    return WaveDisturbance(multiplier, wave, float("nan"), abs(frequency) * side.omega)


def _unknown() -> HillStability:
    none = Stability(Floquet(np.array([np.nan + 0j])), np.array([np.inf]), 0, 0, 0)
    return HillStability(replace(none), None, None)
