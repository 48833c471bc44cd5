"""Shooting: the periodic motion that the time integration settles to, by Newton's method on the period map.

The map from a state to the state one period later is that of `integrate`, step for step; its derivative, the monodromy
matrix, comes from tangents carried along the steps. The method finds unstable motions as well as stable ones, does not
wait for undamped vibrations of a damper to die, and gives the Floquet multipliers.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray, Matrix
from stickslip.contact.law import ContactLaw
from stickslip.harmonic.linear import LinearSide, one_structure
from stickslip.response.time.floquet import Floquet, floquet
from stickslip.response.time.period_map import Derivative, Image, PeriodMap, period_map
from stickslip.response.time.propagator import PeriodicLoad
from stickslip.response.time.settling import period_harmonics, remaining_change
from stickslip.response.time.transient import TimeStepping, TransientStart, check_arguments, rest

ShootingStatus = Literal["converged", "not converged", "diverged"]
TOLERANCE = (
    1e-9  # of the distance to the orbit, relative to its vibration, where no stepping is given
)
MOST_CORRECTIONS = 40
WARM_UP = (
    2  # periods before the first correction: slipping contacts forget what the start got wrong
)
SHORTEST = 1.0 / 16.0  # part of a correction, tried before it is given up
CONTRACTION = 0.5  # a derivative is kept while a period, which costs far less, halves the distance
FALLBACK = 8  # plain periods where no part of a correction comes nearer to an orbit
ANEW = 8  # corrections of a search begun anew: from where the plain periods near an orbit four are enough
RESERVE = 2 * ANEW  # periods left for them
SINGULAR = 1e-9  # of the largest singular value of (1 - monodromy): below it a direction is neutral


@dataclass(frozen=True, eq=False)
class ShootingResult:
    """A periodic motion and what becomes of disturbances.

    Parameters
    ----------
    status
        ``converged``; ``not converged``: the periods ran out, or the plain periods settled and the corrections from there
        did not, or there is no periodic motion nearby (a drift); ``diverged``: the motion overflowed, and all arrays are
        NaN.
    harmonics
        (n_h + 1, n_outputs) complex amplitudes, m.
    floquet
        Multipliers of the motion, and how many of them are neutral.
    grazing
        Number of tangential springs that reach their limit without slipping: they have just shaken down, and the
        multipliers are those of the side on which they stick.
    periods
        Periods marched, those with tangents among them; a correction that is under way may go beyond the most by a few.
    corrections
        Periods marched with tangents, each of which costs as much as some six others.
    residual
        Distance of the state after a period from that before, relative to the vibration of the orbit.
    distance
        Length of the last correction, relative to the same.
    contact_failures
        Time steps of the last period in which the contact equations were not solved to rounding.
    final
        State at t = 0 and at the end of every period.
    outputs
        (steps, n_outputs) displacements at t = T/steps, 2T/steps, ... T; m.
    gap, contact_force
        (steps, n_contacts, 3) gaps (m) and forces ``T_t, T_w, -N`` (N) at the same times.
    """

    status: ShootingStatus
    harmonics: ComplexArray
    floquet: Floquet
    grazing: int
    periods: int
    corrections: int
    residual: float
    distance: float
    contact_failures: int
    final: TransientStart
    outputs: FloatArray
    gap: FloatArray
    contact_force: FloatArray

    @property
    def converged(self) -> bool:
        """Whether the motion is periodic to the tolerance."""
        return self.status == "converged"

    @property
    def stable(self) -> bool:
        """Whether it is periodic and no small disturbance of it grows; neutral multipliers are not judged."""
        return self.converged and self.floquet.stable


@dataclass(slots=True)
class _Search:
    """Where the search for a fixed point stands."""

    state: FloatArray
    status: ShootingStatus = "not converged"
    periods: int = 0
    corrections: int = 0
    distance: float = np.inf
    derivative: Derivative | None = None


def shoot(
    structure: LinearSide,
    gap_operator: Matrix,
    laws: Sequence[ContactLaw],
    load: PeriodicLoad,
    omega: float,
    outputs: IntArray,
    start: TransientStart | None = None,
    stepping: TimeStepping | None = None,
) -> ShootingResult:
    """Find a periodic motion of ``M ü + C u̇ + K u + gap_operatorᵀ λ = f(t)`` with the period of the load.

    Newton's method on ``P(z) = z`` for the state z at t = 0, P being one period of the steps that `integrate` takes.
    Where contacts stick for the whole period a family of motions exists, one for each residual traction, and the
    derivative of ``P(z) - z`` is singular: the shortest correction is taken, which leads to a member nearby. The search
    begins with plain periods; a correction that leads away from the orbit is shortened, and if that does not help
    replaced by plain periods. Where forty corrections do not converge, the motion is marched on from the start in ever
    longer blocks, as `integrate` would, with a short search after each of them, until it settles or the periods run out.

    Parameters
    ----------
    structure, gap_operator, laws, load, omega, outputs
        As in `integrate`: all laws are `ElasticCoulomb`, and a `HarmonicLoad` is a load.
    start
        State at t = 0, best that of a harmonic balance (`start_from_harmonics`); rest if None.
    stepping
        Steps of a period, most periods in all, number of harmonics; `tolerance` bounds the length of the last correction
        relative to the vibration. If None, 1024 steps and 1e-9.

    Raises
    ------
    InputError
        If an argument has a wrong shape or value, a law is not elastic Coulomb, or the mass matrix is singular.
    """
    structure = one_structure(structure, "shoot")
    stepping = stepping or TimeStepping(tolerance=TOLERANCE)
    start = start or rest(structure.n, laws, "shoot")
    check_arguments(structure.n, len(laws), outputs, start, "shoot")
    steps = stepping.steps_per_period
    mapping, state = period_map(structure, gap_operator, laws, load, omega, start, steps)
    search = _Search(state)
    _march(mapping, search, WARM_UP)
    warm = search.state
    _search(mapping, search, stepping, MOST_CORRECTIONS)
    if search.status == "not converged":
        _march_and_search(mapping, search, stepping, warm)
    return _result(mapping, search, outputs, stepping)


def _search(mapping: PeriodMap, search: _Search, stepping: TimeStepping, corrections: int) -> None:
    """Correct the state until it converges, or the corrections or all periods have run out."""
    last = search.corrections + corrections
    while (
        search.status == "not converged"
        and search.corrections < last
        and search.periods < stepping.max_periods
    ):
        if not _correct(mapping, search, stepping.tolerance):
            _march(mapping, search, FALLBACK)


def _march_and_search(
    mapping: PeriodMap, search: _Search, stepping: TimeStepping, warm: FloatArray
) -> None:
    """March on from `warm` in blocks, each twice as long as the last, with a search begun anew after each.

    The march does not take over what a search that failed has left: it comes to every orbit that `integrate` comes to, in
    as many periods.
    """
    changes: list[float] = []
    block, settled = FALLBACK, False
    while search.status == "not converged" and not settled:
        room = stepping.max_periods - search.periods - RESERVE
        if room <= 0:
            return
        search.state = warm
        settled = _settle(mapping, search, min(block, room), changes, stepping.tolerance)
        warm, block = search.state, 2 * block
        _search_anew(mapping, search, stepping)


def _search_anew(mapping: PeriodMap, search: _Search, stepping: TimeStepping) -> None:
    """Take some corrections; leave it to the march where one does not come nearer."""
    last = search.corrections + ANEW
    while (
        search.status == "not converged"
        and search.corrections < last
        and search.periods < stepping.max_periods
    ):
        if not _correct(mapping, search, stepping.tolerance):
            return


def _settle(
    mapping: PeriodMap,
    search: _Search,
    periods: int,
    changes: list[float],
    tolerance: float,
) -> bool:
    """March plain periods; return whether the state has settled, as `integrate` judges the first harmonic."""
    for _ in range(periods):
        image = mapping.image(search.state)
        search.periods += 1
        if image.failures < 0:
            search.status = "diverged"
            return False
        change = float(np.linalg.norm(image.state - search.state))
        changes.append(change / _vibration(mapping, image))
        search.state = image.state
        if remaining_change(changes) < tolerance:
            return True
    return False


def _march(mapping: PeriodMap, search: _Search, periods: int) -> None:
    """Replace the state by that some plain periods later."""
    for _ in range(periods):
        image = mapping.image(search.state)
        search.periods += 1
        if image.failures < 0:
            search.status = "diverged"
            return
        search.state = image.state


def _correct(mapping: PeriodMap, search: _Search, tolerance: float) -> bool:
    """Take one Newton correction; return whether it came nearer to an orbit, True too where that is settled."""
    here = search.derivative = mapping.derivative(search.state)
    image = here.image
    search.periods += 1
    search.corrections += 1
    if image.failures < 0:
        search.status = "diverged"
        return True
    inverse = np.linalg.pinv(np.eye(mapping.size) - here.monodromy, rcond=SINGULAR)
    defect = image.state - search.state
    correction = inverse @ defect
    vibration = _vibration(mapping, image)
    length = float(np.linalg.norm(correction))
    search.distance = length / vibration
    if search.distance <= tolerance and np.linalg.norm(defect) <= tolerance * vibration:
        search.state = search.state + correction
        search.status = "converged"
        return True
    return _approach(mapping, search, inverse, correction, tolerance * vibration)


def _approach(
    mapping: PeriodMap,
    search: _Search,
    inverse: FloatArray,
    correction: FloatArray,
    close: float,
) -> bool:
    """Correct the state, and go on with the same derivative for as long as that pays; return whether it came nearer.

    Distances are taken in the measure of the correction itself, in which weakly damped directions count as much as others.
    """
    length, share, nearer = float(np.linalg.norm(correction)), 1.0, False
    state = search.state
    while share >= SHORTEST:
        trial = state + share * correction
        after = mapping.image(trial)
        search.periods += 1
        following = inverse @ (after.state - trial)
        left = float(np.linalg.norm(following))
        if not left <= (1.0 - share / 4) * length:  # NaN where the motion overflowed
            if nearer:
                break
            share /= 2
            continue
        search.state, nearer = after.state, True
        if share < 1.0 or left > CONTRACTION * length or left <= close:
            break
        state, correction, length = trial, following, left
    return nearer


def _vibration(mapping: PeriodMap, image: Image) -> float:
    """Return the size of the vibration over a period in the measure of the states; that of the state where there is none."""
    n = mapping.modes.speed.size
    swing = mapping.scale[:n] * np.std(image.record.motion, axis=0)
    size = float(np.sqrt(2.0) * np.linalg.norm(swing))
    return max(size, 1e-9 * float(np.linalg.norm(image.state)), np.finfo(float).tiny)


def _result(
    mapping: PeriodMap, search: _Search, outputs: IntArray, stepping: TimeStepping
) -> ShootingResult:
    """March the period that is reported."""
    image = mapping.image(search.state)
    status: ShootingStatus = "diverged" if image.failures < 0 else search.status
    known = np.nan if status == "diverged" else 1.0
    begin = mapping.start_of(search.state)
    n = mapping.modes.speed.size
    modal = period_harmonics(begin.x[:n], image.record.motion, stepping.harmonics)
    displacement, velocity = mapping.modes.physical(begin.x[: 2 * n])
    contacts = (stepping.steps_per_period, -1, 3)
    found = search.derivative
    monodromy = np.full((mapping.size, mapping.size), np.nan) if found is None else found.monodromy
    return ShootingResult(
        status=status,
        harmonics=np.asarray(known * (modal @ mapping.modes.basis[outputs].T)),
        floquet=floquet(known * monodromy),
        grazing=0 if found is None else found.grazing,
        periods=search.periods + 1,
        corrections=search.corrections,
        residual=known
        * float(np.linalg.norm(image.state - search.state) / _vibration(mapping, image)),
        distance=known * search.distance,
        contact_failures=image.failures,
        final=TransientStart(
            known * displacement, known * velocity, known * begin.force.reshape(-1, 3)[:, :2]
        ),
        outputs=known * (image.record.motion @ mapping.modes.basis[outputs].T),
        gap=known * image.record.gap.reshape(contacts),
        contact_force=known * image.record.force.reshape(contacts),
    )
