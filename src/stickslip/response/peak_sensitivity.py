"""Sensitivity of a resonance peak to the model: to the contact stiffness, the number of contact points, and other changes.

A solution of ``R(x, ω, κ) = 0``, with the logarithm κ of a factor on all contact stiffnesses, changes by ``dx/dκ = -J⁻¹
∂R/∂κ``. Only the contact forces depend on κ; their derivative is a finite difference at the same motion. At a peak
``∂A/∂ω = 0``, so that by the envelope theorem the peak amplitude has the same derivative as the amplitude at a fixed
frequency. Solved points lie near the peak, not on it. Two of them with slightly different frequencies give the
derivatives of ``∂A/∂ω`` and ``∂A/∂κ`` by the frequency, and from these the peak frequency, its derivative ``dω/dκ =
-A_κω / A_ωω`` and ``∂A/∂κ`` at the peak.

With half as many contact points, each point represents two neighbours and their mean gap. Other changes of the model are found by solving
its peak again, from the peak of the first one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from scipy import sparse

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem, forced_problem
from stickslip.response.forced.resonance import peak_from
from stickslip.response.forced.response import accepted_points, forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.newton_method import newton
from stickslip.units import HZ

STIFFNESSES = ("k_t", "k_w", "k_n", "cubic_t", "cubic_w", "cubic_n")  # fields of laws, N/m and N/m³
STEP = 1e-5  # relative step of the stiffness, and of the motion for the amplitude, in central differences
FOLLOWS_RTOL = 1e-9  # rounding of a stuck stiffness; the steps of the stiffness are far larger
APART = 1e-4  # relative distance of the two frequencies
TINY = float(np.finfo(float).tiny)
PEAK_DISTANCE_RTOL = 0.005  # largest relative distance of a peak from its solved point
BESIDE = 0.03  # half-width of a short sweep about a peak, relative to its frequency
SWEPT_POINTS = 12  # points of this sweep
PEAK_POINTS = 4  # points added to resolve its peak
MOST_HARMONICS = 15  # of peaks that are compared, both alike; more change the comparison less than its last digit told
AT_AN_END = 1e-9  # relative distance from an end of the sweep, below which a peak is no resonance
UNKNOWN_CHANGE = (float("nan"), float("nan"))
FEWEST_HALVED = 8  # smallest number of points of a contact that is halved: fewer would support it differently


@dataclass(frozen=True)
class StiffnessSlope:
    """Sensitivity of a peak to a relative change of all contact stiffnesses.

    Attributes
    ----------
    amplitude
        Relative change of the amplitude over the relative change of the stiffness.
    omega
        Change of the frequency over the relative change of the stiffness, rad/s; NaN at a fixed frequency.
    """

    amplitude: float
    omega: float


def stiffer(interface: Interface, factor: float) -> Interface | None:
    """Return contacts with all stiffnesses times a factor; friction, preloads and initial gaps do not change.

    None if it is not known which parameters of a law are stiffnesses.

    Parameters
    ----------
    interface
        Contacts.
    factor
        Factor on the stiffnesses along t, w and n. A negative preload, which represents a gap, is multiplied as well.
    """
    laws = [_stiffer(law, factor) for law in interface.laws]
    known = tuple(law for law in laws if law is not None)
    return replace(interface, laws=known) if len(known) == len(laws) else None


def _stiffer(law: ContactLaw, factor: float) -> ContactLaw | None:
    """Return the law with its stiffnesses times a factor; None if its stuck stiffness does not follow them.

    A law of one's own may give its stiffnesses other names: fields on which the stuck stiffness depends.
    """
    own: Any = law
    names = [f.name for f in fields(own)]
    changed = {name: factor * getattr(own, name) for name in STIFFNESSES if name in names and getattr(own, name)}
    if "preload" in names and own.preload < 0.0:
        changed["preload"] = factor * own.preload
    if _follows(own, changed, factor):
        return law if not changed else replace(own, **changed)
    for name in names:
        more = None if name in changed else _times(getattr(own, name), factor)
        if more is not None and not _follows(own, {name: more}, 1.0):
            changed[name] = more
    return replace(own, **changed) if _follows(own, changed, factor) else None


def _times(value: object, factor: float) -> float | tuple[float, ...] | None:
    """Return a number, or a tuple of numbers, times a factor; None for anything else."""
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return factor * value
    if isinstance(value, tuple) and all(isinstance(one, (int, float)) for one in value):
        return tuple(factor * one for one in value)
    return None


def _follows(law: Any, changed: dict[str, Any], factor: float) -> bool:
    """Whether the stuck stiffness of a law with these fields changed is `factor` times the law's own."""
    before, after = (np.asarray(one.stuck_stiffness(), dtype=float) for one in (law, replace(law, **changed)))
    return bool(np.allclose(after, factor * before, rtol=FOLLOWS_RTOL, atol=0.0))


def stiffness_slope(
    problem: ForcedProblem, point: ForcedPoint, output: int, *, resonance: bool
) -> StiffnessSlope | None:
    """Return the sensitivity of a solved point, or of the peak near it, to the stiffness of all contacts.

    Parameters
    ----------
    problem
        The forced response.
    point
        A converged point of it.
    output
        Number of the output.
    resonance
        Whether to evaluate at the peak near the point, instead of at the frequency of the point.

    Returns
    -------
    StiffnessSlope or None
        None if contacts are rigid, no contact has a stiffness, it is not known which parameters of a law are
        stiffnesses, or the Jacobian is singular.
    """
    balance = problem.balance(point.support)
    interface = problem.low.interface
    if not isinstance(balance, HarmonicBalance) or interface.rigid:
        return None
    twice = stiffer(interface, 2.0)
    if twice is None or twice.laws == interface.laws:
        return None
    here = _slopes(problem, balance, point, output)
    if here is None:
        return None
    fixed = StiffnessSlope(here.by_stiffness / here.amplitude, float("nan"))
    beside = _beside(problem, balance, point) if resonance else None
    there = None if beside is None else _slopes(problem, balance, beside, output)
    if beside is None or there is None:
        return fixed
    step = beside.omega - point.omega
    curved = (there.by_omega - here.by_omega) / step
    turned = (there.by_stiffness - here.by_stiffness) / step
    if not curved < 0.0 or abs(here.by_omega / curved) > PEAK_DISTANCE_RTOL * point.omega:
        return fixed
    way = -here.by_omega / curved
    height = here.amplitude + 0.5 * here.by_omega * way
    return StiffnessSlope((here.by_stiffness + turned * way) / height, -turned / curved)


@dataclass(frozen=True)
class _Slopes:
    """Amplitude at a point, m, and its derivatives by frequency and by the logarithm of the stiffness."""

    amplitude: float
    by_omega: float
    by_stiffness: float


def _slopes(problem: ForcedProblem, balance: HarmonicBalance, point: ForcedPoint, output: int) -> _Slopes | None:
    x, omega = balance.unknowns(point.coefficients), point.omega
    rates = np.asarray(balance.linearise(x, omega).jac_p), _by_stiffness(balance, x, omega)
    found = []
    for rate, turning in zip(rates, (1.0, 0.0), strict=True):
        change = problem.sweep.newton.linear.solve(balance.linearise(x, omega).jac, -rate)
        if change is None or not np.all(np.isfinite(change)):
            return None
        step = STEP * float(np.linalg.norm(x)) / max(float(np.linalg.norm(change)), TINY)
        ends = [(omega + s * turning, balance.coefficients(x + s * change)) for s in (step, -step)]
        high, low = (problem.amplitude_of(*end, output) for end in ends)
        found.append((high - low) / (2.0 * step))
    return _Slopes(problem.amplitude(point, output), *found)


def _by_stiffness(balance: HarmonicBalance, x: FloatArray, omega: float) -> FloatArray:
    """Return the (size,) derivative of the scaled residual by the logarithm of the stiffness of all contacts."""
    evaluator = balance.compiled.evaluator
    forces = []
    for factor in (1.0 + STEP, 1.0 - STEP):
        known = stiffer(balance.interface, factor)
        compiled = (balance.interface if known is None else known).compiled(evaluator)
        forces.append(replace(balance, compiled=compiled).forces(x, omega).coefficients)
    return balance.scaled_forces((forces[0] - forces[1]) / (2.0 * STEP))


def _beside(problem: ForcedProblem, balance: HarmonicBalance, point: ForcedPoint) -> ForcedPoint | None:
    """Return the solution at a frequency near a point; None without convergence."""
    omega = point.omega * (1.0 + APART)
    start = balance.unknowns(point.coefficients)
    found = newton(lambda x: balance.linearise(x, omega), start, problem.sweep.newton)
    if not found.status.converged:
        return None
    return replace(point, omega=omega, coefficients=balance.coefficients(found.x))


def halved(system: System, groups: Sequence[str], position: FloatArray, area: FloatArray) -> tuple[System, int] | None:
    """Return a system with half the points of its meshed contacts, and the number of removed points.

    The result is None if no contact has enough points.

    Parameters
    ----------
    system
        System with contacts on meshes.
    groups
        (p,) name of each point's contact.
    position
        (p, 3) positions, m.
    area
        (p,) areas, m²; NaN for points without facets.

    Notes
    -----
    A remaining point takes over the stuck stiffness of its removed neighbour. Its gap is the mean of both gaps,
    weighted by their stiffness. The contact keeps its total stiffness and its centre.
    """
    own = system.interface
    stiffness = own.stuck_stiffness().reshape(-1, 3).sum(axis=1)
    takes: IntArray = np.arange(own.n_contacts)
    for group in dict.fromkeys(groups):
        points = np.flatnonzero(np.array(groups) == group)
        meshed = np.all(np.isfinite(area[points])) and np.all(np.isfinite(position[points]))
        if points.size >= FEWEST_HALVED and meshed and np.all(stiffness[points] > 0.0):
            takes[points] = points[_pairs(position[points])]
    stays = np.flatnonzero(takes == np.arange(takes.size))
    if stays.size == takes.size:
        return None
    whole = np.zeros(own.n_contacts)
    np.add.at(whole, takes, stiffness)
    row = np.searchsorted(stays, takes)
    mean = sparse.csr_array((stiffness / whole[takes], (row, np.arange(takes.size))))
    few = Interface(
        tuple(own.names[i] for i in stays),
        tuple(own.laws[i] for i in stays),
        sparse.kron(mean, np.eye(3), format="csr") @ own.gap_operator,
        (own.factors * whole / stiffness)[stays],
    )
    return replace(system, interface=few), int(takes.size - stays.size)


def _pairs(position: FloatArray) -> IntArray:
    """Return the representative of each point: itself, or the nearest earlier point that represents only itself."""
    takes = np.arange(len(position))
    open_to = np.ones(len(position), dtype=bool)
    for i in range(len(position)):
        if not open_to[i]:
            continue
        others = np.flatnonzero(open_to)
        others = others[others > i]
        if not others.size:
            break
        near = others[np.argmin(np.linalg.norm(position[others] - position[i], axis=1))]
        takes[near] = i
        open_to[[i, near]] = False
    return takes


Found = tuple[ForcedProblem, ForcedPoint] | None  # a peak, with the problem that it solves


def with_few_harmonics(load: HarmonicLoad, point: ForcedPoint) -> ForcedPoint:
    """Return a point without the harmonics that a comparison of two peaks does not need."""
    rows = point.harmonics <= max(MOST_HARMONICS, 3 * max(load.harmonics))
    if np.all(rows):
        return point
    kept = point.kept[rows] if point.kept.size else point.kept
    harmonics = point.harmonics[rows]
    return replace(point, coefficients=point.coefficients[: harmonics[-1] + 1], harmonics=harmonics, kept=kept)


def at_resonance(sweep: Sweep, point: ForcedPoint) -> bool:
    """Whether a sweep resolved a peak at a point: frequencies are not listed, and it is no end of the sweep."""
    ends = np.array(sweep.omega_range)
    return not (np.any(np.abs(ends / point.omega - 1.0) < AT_AN_END) or sweep.grid.size)


def comparing_sweep(sweep: Sweep, point: ForcedPoint) -> Sweep:
    """Return the sweep that finds a peak from a point, with its harmonics and few points."""
    own, few = point.support, min(sweep.peak_points, PEAK_POINTS)
    return replace(sweep, low=own, high=own, selection="always_high", peak_points=few)


def peak_near(system: System, load: HarmonicLoad, sweep: Sweep, point: ForcedPoint) -> Found:
    """Find the peak of a system near a point of another one; at listed frequencies and ends of the sweep, the motion there.

    Parameters
    ----------
    system, load
        The changed model.
    sweep
        Sweep that found the point.
    point
        A peak of the other system.
    """
    own = comparing_sweep(sweep, point)
    problem = forced_problem(system, load, own)
    if at_resonance(sweep, point):
        peak = peak_from(problem, point) or _swept_peak(system, load, own, point)
        return None if peak is None else (problem, peak)
    balance = problem.balance(point.support)
    start = balance.unknowns(point.coefficients)
    found = newton(lambda x: balance.linearise(x, point.omega), start, own.newton)
    if not found.status.converged:
        return None
    return problem, replace(point, coefficients=balance.coefficients(found.x))


def _swept_peak(system: System, load: HarmonicLoad, sweep: Sweep, point: ForcedPoint) -> ForcedPoint | None:
    """Find a peak by a short sweep, where no solver finds it from a point; None at an end of the sweep."""
    around = (point.omega * (1.0 - BESIDE), point.omega * (1.0 + BESIDE))
    short = replace(sweep, omega_range=around, points=SWEPT_POINTS, rescue="off")
    problem = forced_problem(system, load, short)
    found = [p for p in accepted_points(list(forced_response(system, load, short))) if p.converged]
    top = max(found, key=problem.amplitude, default=None)
    inside = top is not None and min(p.omega for p in found) < top.omega < max(p.omega for p in found)
    return top if inside else None


def peak_change(own: Found, other: Found, output: int) -> tuple[float, float]:
    """Return the relative change of a peak's amplitude, and the change of its frequency in Hz; NaN if either was not found."""
    if own is None or other is None:
        return UNKNOWN_CHANGE
    before, after = (problem.amplitude(point, output) for problem, point in (own, other))
    return after / before - 1.0, (other[1].omega - own[1].omega) / HZ
