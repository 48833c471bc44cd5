"""Stress over a cycle: alternating and mean stress, signed equivalent stress, and criteria for multiaxial fatigue.

Stresses have the components xx, yy, zz, xy, yz, xz in Pa. The stress of a place over a period is given by its harmonics,
`s(t) = Re Σ_h S_h exp(i h ω t)`, `S_0` is the static stress.
"""

from collections.abc import Callable
from itertools import combinations
from typing import Any, Literal, NamedTuple

import numpy as np

from stickslip.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from stickslip.errors import check_choice, input_error
from stickslip.model.fe.material import TENSOR
from stickslip.model.strength.card import StrengthCard

SAMPLES_PER_HARMONIC = 16  # maxima over the phase are looked for at these samples, then located by Newton's method
MIN_SAMPLES = 64
NEWTON_STEPS = 3
BALL_EXCESS = 1e-8  # relative distance by which a path may leave its smallest ball
BETWEEN_SAMPLES = 1.02  # (π/16)²/2: the share by which a path may go out between samples
MAX_EXCHANGES = 60  # points that are exchanged in the search for a smallest ball
ZOOMED_PEAKS = 3  # highest samples beside which a maximum with kinks is looked for
ZOOM_POINTS, ZOOM_ROUNDS = 9, 8  # each round narrows the interval of a maximum to a quarter
MAX_AXES_TURN_DEG = 10.0  # of principal axes: beyond, a signed equivalent stress jumps
AXES_SHEAR = 0.01  # shear in the mean principal axes that counts as none, over the largest equivalent stress
JACOBI_SWEEPS = 8
COARSE_PLANES = 200  # of a half sphere
BEST_PLANES = 3  # of the coarse ones, from which the search goes on
FINEST_STEP = 1e-3  # angle at which the search ends, rad: a smooth maximum is then right to 1e-6
GRID_PARTS = 8  # in which the coarse planes are looked at
LAST_CHOICE = 0.02  # step of the search below which only the best plane is followed, rad
WORST_PLACES = 1000  # of which a criterion is computed at least; others have an upper bound
CERTAIN = 10  # worst places that no bound of the others may exceed
BATCH = 250
PLACES_AT_ONCE = 200  # whose shear paths are held in memory together
DOUBTFUL_TORSION = 0.8  # torsion limit over fatigue limit, above which metals are brittle and criteria doubtful
DOUBTFUL_LIMIT = 1.1  # predicted over stated limit, above which a criterion does not fit the card
# limit in torsion over that in tension of a material that obeys von Mises
MISES_RATIO = 1 / np.sqrt(3)
Criterion = Literal["crossland", "sines", "findley", "dang_van"]
# deviator of a stress as a vector whose length is √J2
_ROOT = np.sqrt(3) / 2
DEVIATOR = np.array(
    [
        [_ROOT * 2 / 3, -_ROOT / 3, -_ROOT / 3, 0, 0, 0],
        [0, 0.5, -0.5, 0, 0, 0],
        [0, 0, 0, 1, 0, 0],
        [0, 0, 0, 0, 1, 0],
        [0, 0, 0, 0, 0, 1],
    ]
)


def history(harmonics: ComplexArray, samples: int) -> FloatArray:
    """Return the stress (samples, k, 6) at equally spaced times of a period.

    Parameters
    ----------
    harmonics
        (H+1, k, 6) complex amplitudes of the stress at k places in Pa.
    samples
        Number of times.
    """
    return _sampled(_checked(harmonics), samples)


def von_mises(stress: FloatArray) -> FloatArray:
    """Return the equivalent stress (...) by von Mises (1913) of stresses (..., 6), in Pa."""
    return np.asarray(np.sqrt(3) * np.linalg.norm(stress @ DEVIATOR.T, axis=-1))


def alternating_and_mean(harmonics: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the alternating and the mean stress (k,) in Pa, as integrity departments state them.

    The alternating stress is the largest equivalent stress of the dynamic part over the phase. The mean is the equivalent
    stress of the static part, with the sign of its principal stress of the largest size; positive where two are of one size.

    Parameters
    ----------
    harmonics
        (H+1, k, 6) complex amplitudes of the stress at k places in Pa; NaN at a place gives NaN there.
    """
    given = _checked(harmonics)
    return _where_finite(_alternating, given), signed_mean(given[0].real)


def signed_mean(stress: FloatArray) -> FloatArray:
    """Return the equivalent stress (...) of static stresses (..., 6), signed by the largest principal stress, in Pa."""
    finite = np.asarray(np.isfinite(stress).all(axis=-1))
    principal = np.linalg.eigvalsh(np.where(finite[..., None], stress, 0.0)[..., TENSOR])
    # of equal sizes, as in pure shear, the tensile one decides; rounding must not
    compressed = -principal[..., 0] > principal[..., 2] * (1 + 1e-9)
    return np.where(compressed, -1.0, 1.0) * von_mises(stress)


def signed_von_mises(harmonics: ComplexArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return amplitude, mean (k,) in Pa and turn of axes (k,) in degrees of the equivalent stress signed by the largest principal.

    The sign is that of the stress along one axis, on which the largest principal stress of the cycle lies: torsion that reverses
    changes its sign. The turn is twice the largest angle between the principal axes and the axes that fit all samples best. Where
    it is 10 degrees or more, signs jump while the stress is large: amplitude and mean are NaN.

    Parameters
    ----------
    harmonics
        (H+1, k, 6) complex amplitudes of the stress at k places in Pa.
    """
    given = _checked(harmonics)
    turn = _where_finite(lambda own: _common_axes(own)[1], given)
    fit = np.where((turn < MAX_AXES_TURN_DEG)[:, None], given, np.nan)

    def largest(own: ComplexArray, side: float) -> FloatArray:
        along = _common_axes(own)[0]

        def signed(stress: FloatArray) -> FloatArray:
            normal = np.einsum("nkij,ki,kj->nk", stress[..., TENSOR], along, along)
            return np.asarray(side * np.where(normal < 0, -1, 1) * von_mises(stress))

        return _zoomed_maximum(own, signed)

    high, low = (_where_finite(lambda own, side=side: side * largest(own, side), fit) for side in (1, -1))
    return (high - low) / 2, (high + low) / 2, turn


def crossland(harmonics: ComplexArray, card: StrengthCard, *, credit_in_compression: bool = False) -> FloatArray:
    """Return the utilisation (k,) by Crossland (1956): amplitude of √J2 and largest hydrostatic stress.

    The amplitude is the radius of the smallest ball around the path of the deviator. NaN where the static stress is above yield.

    Parameters
    ----------
    harmonics
        (H+1, k, 6) complex amplitudes of the stress at k places in Pa.
    card
        Limits with torsion or R = 0; torsion is taken if both are given.
    credit_in_compression
        Whether hydrostatic compression raises what is allowed.

    Raises
    ------
    InputError
        If the card lacks a second limit, or the limits do not fit the criterion.
    """
    factor, limit = _constants("crossland", card)

    def compute(own: ComplexArray, factor: FloatArray, limit: FloatArray) -> FloatArray:
        pressure = own[..., :3].sum(axis=-1) / 3
        return (deviator_ball(own)[1] + factor * _credited(_largest(pressure), credit_in_compression)) / limit

    return _where_finite(compute, _below_yield(harmonics, card), factor, limit)


def sines(harmonics: ComplexArray, card: StrengthCard, *, credit_in_compression: bool = False) -> FloatArray:
    """Return the utilisation (k,) by Sines (1959): amplitude of √J2 and mean hydrostatic stress; arguments as of `crossland`.

    The second limit is the one at R = 0: alternating torsion has no mean.
    """
    factor, limit = _constants("sines", card)

    def compute(own: ComplexArray, factor: FloatArray, limit: FloatArray) -> FloatArray:
        mean = own[0, :, :3].real.sum(axis=-1) / 3
        return (deviator_ball(own)[1] + factor * _credited(mean, credit_in_compression)) / limit

    return _where_finite(compute, _below_yield(harmonics, card), factor, limit)


def dang_van(harmonics: ComplexArray, card: StrengthCard, *, credit_in_compression: bool = False) -> FloatArray:
    """Return the utilisation (k,) by Dang Van (1993): largest over the cycle of the shear in the grains and hydrostatic stress.

    The stress in the grains is that of the place, less the centre of the smallest ball around the path of the deviator. Arguments
    as of `crossland`.
    """
    factor, limit = _constants("dang_van", card)

    def compute(own: ComplexArray, factor: FloatArray, limit: FloatArray) -> FloatArray:
        static = own[0].real.copy()
        own = own.copy()
        own[0] = 0
        residual = deviator_ball(own)[0] @ np.linalg.pinv(DEVIATOR).T

        def damage(stress: FloatArray) -> FloatArray:
            principal = np.linalg.eigvalsh((stress - residual)[..., TENSOR])
            pressure = (stress + static)[..., :3].sum(axis=-1) / 3
            return np.asarray(
                (principal[..., 2] - principal[..., 0]) / 2 + factor * _credited(pressure, credit_in_compression)
            )

        return _zoomed_maximum(own, damage) / limit

    return _where_finite(compute, _below_yield(harmonics, card), factor, limit)


def critical_plane(harmonics: ComplexArray, card: StrengthCard, *, credit_in_compression: bool = False) -> FloatArray:
    """Return the utilisation (k,) by Findley (1959): largest over all planes of shear amplitude plus k times largest normal stress.

    The shear amplitude is the radius of the smallest circle around the path of the shear on the plane. Arguments as of `crossland`.
    """
    factor, limit = _constants("findley", card)

    def compute(own: ComplexArray, factor: FloatArray, limit: FloatArray) -> FloatArray:
        def damage(normals: FloatArray, least: FloatArray) -> FloatArray:
            shear, normal = _paths_on_planes(own, normals)
            across = factor * _credited(_largest(normal).reshape(normals.shape[:2]), credit_in_compression)
            enough = np.broadcast_to(least - across, across.shape).ravel()
            return enclosing_ball(shear, enough).radius.reshape(across.shape) + across

        return _largest_over_planes(damage, own.shape[1]) / limit

    given = _below_yield(harmonics, card)
    places = given.shape[1]
    factor, limit = np.broadcast_to(factor, places), np.broadcast_to(limit, places)
    parts = [slice(i, i + PLACES_AT_ONCE) for i in range(0, places, PLACES_AT_ONCE)]
    return np.concatenate(
        [np.empty(0), *(_where_finite(compute, given[:, part], factor[part], limit[part]) for part in parts)]
    )


def worst_utilisation(
    criterion: Criterion,
    harmonics: ComplexArray,
    card: StrengthCard,
    counted: BoolArray,
    *,
    credit_in_compression: bool = False,
) -> FloatArray:
    """Return the utilisation (k,) by a criterion at the worst places, and an upper bound of it at all others.

    Places are computed in the order of the bound: at least 1000, and until no bound exceeds the tenth largest utilisation of the
    `counted` ones. The bound takes the alternating stress over √3 for the shear amplitude, and for the normal stress of a plane the
    largest hydrostatic stress and 2/√3 of the largest √J2.

    Parameters
    ----------
    criterion
        ``"crossland"``, ``"sines"``, ``"findley"`` or ``"dang_van"``.
    harmonics, card, credit_in_compression
        As of `crossland`; limits of the card may be arrays (k,).
    counted
        (k,) places among which the worst are looked for.
    """
    given = _below_yield(harmonics, card)
    factor, limit = _constants(criterion, card)

    def bound(own: ComplexArray, factor: FloatArray, limit: FloatArray) -> FloatArray:
        pressure, shear = own[..., :3].sum(axis=-1) / 3, _alternating(own) / np.sqrt(3)
        normal = pressure[0].real if criterion == "sines" else _largest(pressure)
        if criterion == "findley":
            normal = normal + 2 / np.sqrt(3) * (von_mises(own[0].real) / np.sqrt(3) + shear)
        return np.asarray((shear + factor * _credited(normal, credit_in_compression)) / limit)

    found = _where_finite(bound, given, factor, limit)
    known = np.isnan(found)
    order = np.argsort(-np.where(known, -np.inf, found), kind="stable")[: np.count_nonzero(~known)]
    for first in range(0, order.size, BATCH):
        sure = np.sort(found[known & counted & np.isfinite(found)])[-CERTAIN:]
        if first >= WORST_PLACES and sure.size == CERTAIN and found[order[first]] <= sure[0]:
            break
        some = order[first : first + BATCH]
        found[some] = CRITERIA[criterion](given[:, some], card.take(some), credit_in_compression=credit_in_compression)
        known[some] = True
    return found


CRITERIA: dict[Criterion, Callable[..., FloatArray]] = {
    "crossland": crossland,
    "sines": sines,
    "findley": critical_plane,
    "dang_van": dang_van,
}


def criterion_doubt(criterion: Criterion, card: StrengthCard) -> str:
    """Return why a criterion is doubtful with the limits of a card, as a sentence; empty: it fits.

    Parameters
    ----------
    criterion
        ``"crossland"``, ``"sines"``, ``"findley"`` or ``"dang_van"``.
    card
        Limits of the material.

    Raises
    ------
    InputError
        If the criterion cannot be used with the card.
    """
    check_choice("criterion", criterion, CRITERIA)
    factor, limit = _constants(criterion, card)
    tension, torsion, repeated = (
        None if value is None else np.asarray(value, dtype=float)
        for value in (card.fatigue_limit_pa, card.torsion_limit_pa, card.fatigue_limit_r0_pa)
    )
    if torsion is not None and tension is not None and np.any(torsion > DOUBTFUL_TORSION * tension):
        ratio = float(np.max(torsion / tension))
        return f"torsion_limit_pa is {ratio:.3g} of fatigue_limit_pa, as of brittle materials: {criterion} is doubtful above 0.8"
    for value, name, predicted in (
        (torsion, "torsion_limit_pa", _predicted_torsion(criterion, factor, limit)),
        (repeated, "fatigue_limit_r0_pa", _predicted_repeated(criterion, factor, limit)),
    ):
        if value is not None and np.any(predicted > DOUBTFUL_LIMIT * value):
            worst = np.argmax(np.ravel(predicted / value))
            low, high = (
                float(np.ravel(np.broadcast_to(own, np.shape(predicted / value)))[worst]) for own in (value, predicted)
            )
            return f"{criterion} gives {high / 1e6:.4g} MPa for {name}, and the card has {low / 1e6:.4g} MPa"
    return ""


class Ball(NamedTuple):
    """Smallest balls around paths: centres (m, d) and radii (m,)."""

    centre: FloatArray
    radius: FloatArray


def deviator_ball(harmonics: ComplexArray) -> Ball:
    """Return the smallest balls around the paths of the dynamic deviator, whose radius is the amplitude of √J2 in Pa."""
    return enclosing_ball(harmonics @ DEVIATOR.T)


def enclosing_ball(harmonics: ComplexArray, enough: FloatArray | None = None) -> Ball:
    """Return the smallest balls around periodic paths, less their static part.

    The ball of up to d + 1 points of a path is exact; the point farthest outside joins them, and those that do not carry the new
    ball leave, until no point is outside (Gärtner, 1999). The radius grows with each exchange; the one returned encloses the path.

    Parameters
    ----------
    harmonics
        (H+1, m, d) complex amplitudes of m paths in d dimensions.
    enough
        (m,) radii below which a ball that encloses the path suffices, though it be not the smallest.
    """
    path = np.concatenate([np.zeros_like(harmonics[:1]), harmonics[1:]])
    sampled = _sampled(path, _samples(path))
    _, m, d = path.shape
    centre, radius = np.zeros((m, d)), np.zeros(m)
    carrying, count = np.zeros((m, d + 1, d)), np.zeros(m, dtype=np.int64)
    best, reach = np.zeros((m, d)), np.full(m, np.inf)
    open_ = np.arange(m)
    for _ in range(MAX_EXCHANGES):
        # any point outside serves: samples, as long as one is; then the farthest point between them
        away = sampled[:, open_] - centre[open_]
        squared = np.einsum("nmc,nmc->nm", away, away)
        distance = np.sqrt(squared.max(axis=0)) * BETWEEN_SAMPLES
        point = sampled[squared.argmax(axis=0), open_]
        near = np.flatnonzero(distance <= radius[open_] * BETWEEN_SAMPLES**2)
        own = open_[near]
        if near.size:
            point[near], distance[near] = _farthest(path[:, own], squared[:, near], centre[own])
        nearer = distance < reach[open_]
        best[open_[nearer]], reach[open_[nearer]] = centre[open_[nearer]], distance[nearer]
        outside = (distance > radius[open_] * (1 + BALL_EXCESS)) & (distance > 0)
        if enough is not None:
            outside &= reach[open_] > enough[open_]
        open_ = open_[outside]
        if not open_.size:
            break
        centre[open_], radius[open_] = _exchange(carrying, count, open_, point[outside])
    return Ball(best, reach)


def _exchange(carrying: FloatArray, count: IntArray, open_: IntArray, new: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return centres and radii of the balls of the points that carry (m, d+1, d) and a new one (n, d) outside; change what carries.

    Of a few points the smallest ball is the largest one that has some of them on its surface and its centre in their hull.
    """
    old, have = carrying[open_], count[open_]
    centre, radius = new.copy(), np.zeros(len(new))
    chosen = np.zeros((len(new), old.shape[1]), dtype=bool)
    for size in range(1, min(int(have.max(initial=0)), old.shape[2]) + 1):
        for places in combinations(range(int(have.max())), size):
            middle, reach, valid = _circumscribed(old[:, list(places)], new)
            better = valid & (places[-1] < have) & (reach > radius)
            centre[better], radius[better] = middle[better], reach[better]
            chosen[better] = np.isin(np.arange(chosen.shape[1]), places)
    order = np.argsort(~chosen, axis=1, kind="stable")
    kept = np.take_along_axis(old, order[..., None], axis=1)
    number = chosen.sum(axis=1)
    kept[np.arange(len(new)), number] = new
    carrying[open_], count[open_] = kept, number + 1
    return centre, radius


def _circumscribed(points: FloatArray, new: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return centre (n, d), radius (n,) of the ball through points (n, s, d) and a new one, and whether the centre is in their hull."""
    arms = points - new[:, None]
    squares = np.einsum("nsd,nsd->ns", arms, arms)
    gram = 2 * arms @ arms.swapaxes(1, 2)
    size = squares.max(axis=1)
    # points on a line or in a plane have a singular matrix: the ridge makes it solvable, the distances then tell
    gram += (1e-15 * size + 1e-300)[:, None, None] * np.eye(points.shape[1])
    with np.errstate(all="ignore"):
        share = np.linalg.solve(gram, squares[..., None])[..., 0]
        middle = np.einsum("ns,nsd->nd", share, arms)
        reach = np.linalg.norm(middle, axis=1)
        others = np.linalg.norm(arms - middle[:, None], axis=2)
        same = np.all(np.abs(others - reach[:, None]) <= 1e-10 * reach[:, None], axis=1)
        valid = same & np.all(share >= 0, axis=1) & (share.sum(axis=1) <= 1) & (reach > 0)
    return new + middle, reach, np.asarray(valid)


def _constants(criterion: Criterion, card: StrengthCard) -> tuple[FloatArray, FloatArray]:
    """Return the factor of the normal or hydrostatic stress, and the limit in Pa, of a criterion."""
    name = {"crossland": "Crossland", "sines": "Sines", "findley": "Findley", "dang_van": "Dang Van"}[criterion]
    if criterion == "sines":
        tension, repeated = card.need(name, "fatigue_limit_pa", "fatigue_limit_r0_pa")
        return np.sqrt(3) * (tension / repeated - 1), tension / np.sqrt(3)
    if card.torsion_limit_pa is None and card.fatigue_limit_r0_pa is None:
        raise input_error(
            "StrengthCard.torsion_limit_pa",
            f"is missing, and {name} needs it or fatigue_limit_r0_pa",
            "Give one of them, or use alternating_and_mean with a mean stress rule.",
        )
    if card.torsion_limit_pa is not None:
        tension, torsion = card.need(name, "fatigue_limit_pa", "torsion_limit_pa")
        lowest = MISES_RATIO if criterion == "crossland" else 0.5
        _refuse_ratio(name, "torsion_limit_pa", torsion / tension, (lowest, 1.0))
        return _from_torsion(criterion, tension, torsion)
    tension, repeated = card.need(name, "fatigue_limit_pa", "fatigue_limit_r0_pa")
    _refuse_ratio(name, "fatigue_limit_r0_pa", repeated / tension, (0.5, 1.0))
    return _from_repeated(criterion, tension, repeated)


def _refuse_ratio(name: str, field: str, ratio: FloatArray, between: tuple[float, float]) -> None:
    low, high = between
    # 1/√3 of rounded limits is a material that obeys von Mises, not one beyond
    wrong = (ratio < low * (1 - 1e-6)) | (ratio >= high)
    if np.any(wrong):
        raise input_error(
            f"StrengthCard.{field}",
            f"over fatigue_limit_pa = {float(np.ravel(ratio)[np.argmax(np.ravel(wrong))]):.4g}, outside of {low:.4g} to {high:g}: {name} "
            "would credit tension or have no limit",
            "Check both limits, or use another criterion.",
        )


def _from_torsion(criterion: Criterion, tension: FloatArray, torsion: FloatArray) -> tuple[FloatArray, FloatArray]:
    ratio = torsion / tension
    if criterion == "crossland":
        return np.maximum(3 * ratio - np.sqrt(3), 0), torsion
    if criterion == "dang_van":
        return np.maximum(3 * (ratio - 0.5), 0), torsion
    sine = np.maximum(2 * ratio - 1, 0)  # k / √(1 + k²)
    factor = sine / np.sqrt(1 - sine**2)
    return factor, torsion * np.sqrt(1 + factor**2)


def _from_repeated(criterion: Criterion, tension: FloatArray, repeated: FloatArray) -> tuple[FloatArray, FloatArray]:
    if criterion == "findley":
        log = np.log(tension / repeated)  # asinh(2k) - asinh(k)
        factor = np.sinh(np.arctanh(np.sinh(log) / (2 - np.cosh(log))))
        return factor, tension / 2 * (factor + np.sqrt(1 + factor**2))
    # the shear of a tensile stress of 1: √J2 by Crossland, Tresca's by Dang Van
    shear = MISES_RATIO if criterion == "crossland" else 0.5
    factor = 3 * shear * (tension - repeated) / (2 * repeated - tension)
    return factor, tension * (shear + factor / 3)


def _predicted_torsion(criterion: Criterion, factor: FloatArray, limit: FloatArray) -> FloatArray:
    return limit / np.sqrt(1 + factor**2) if criterion == "findley" else limit


def _predicted_repeated(criterion: Criterion, factor: FloatArray, limit: FloatArray) -> FloatArray:
    weight = {
        "crossland": MISES_RATIO + 2 * factor / 3,
        "sines": MISES_RATIO + factor / 3,
        "dang_van": 0.5 + 2 * factor / 3,
        "findley": factor + np.sqrt(1 + 4 * factor**2) / 2,
    }
    return np.asarray(limit / weight[criterion])


def _below_yield(harmonics: ComplexArray, card: StrengthCard) -> ComplexArray:
    """Return harmonics with NaN where the static equivalent stress is above yield: the elastic stress is none there."""
    given = _checked(harmonics)
    if card.yield_pa is None:
        return given
    yielded = von_mises(given[0].real) > np.asarray(card.yield_pa, dtype=float)
    return np.where(yielded[:, None], np.nan, given)


def _credited(stress: FloatArray, credit: bool) -> FloatArray:
    return stress if credit else np.maximum(stress, 0)


def _zoomed_maximum(harmonics: ComplexArray, function: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Return the largest value (k,) over the phase of a function of stresses (n, k, 6) that has kinks."""
    samples = 2 * _samples(harmonics)
    values = function(_sampled(harmonics, samples))
    peaks = (values >= np.roll(values, 1, axis=0)) & (values >= np.roll(values, -1, axis=0))
    highest = np.argsort(np.where(peaks, -values, np.inf), axis=0)[:ZOOMED_PEAKS]
    return np.asarray(np.max([_zoomed(harmonics, function, 2 * np.pi / samples, one) for one in highest], axis=0))


def _zoomed(
    harmonics: ComplexArray, function: Callable[[FloatArray], FloatArray], width: float, sample: IntArray
) -> FloatArray:
    order, each = np.arange(len(harmonics)), np.arange(harmonics.shape[1])
    phase, found = width * sample, np.full(len(each), -np.inf)
    for _ in range(ZOOM_ROUNDS):
        tried = phase + width * np.linspace(-1, 1, ZOOM_POINTS)[:, None]
        waves = np.exp(1j * np.multiply.outer(order, tried))
        values = function(np.einsum("hnk,hkc->nkc", waves, harmonics).real)
        best = values.argmax(axis=0)
        phase, found, width = tried[best, each], np.maximum(found, values[best, each]), width / 4
    return np.asarray(found)


def _common_axes(harmonics: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the axis (k, 3) of the largest normal stress among those in which all samples are most nearly diagonal, and the turn.

    The turn (k,) is twice the largest angle between these axes and the principal ones, in degrees.
    """
    tensors = _sampled(harmonics, _samples(harmonics))[..., TENSOR]
    axes: FloatArray = np.tile(np.eye(3), (tensors.shape[1], 1, 1))
    for _ in range(JACOBI_SWEEPS):
        for i, j in ((0, 1), (1, 2), (0, 2)):
            # Cardoso and Souloumiac (1996): the angle that makes the sum of the squared shears of all samples smallest
            difference, shear = tensors[..., i, i] - tensors[..., j, j], 2 * tensors[..., i, j]
            on, off = (difference**2 - shear**2).sum(axis=0), 2 * (difference * shear).sum(axis=0)
            angle = np.arctan2(off, on) / 4
            turn = np.tile(np.eye(3), (len(angle), 1, 1))
            turn[:, i, i] = turn[:, j, j] = np.cos(angle)
            turn[:, i, j], turn[:, j, i] = -np.sin(angle), np.sin(angle)
            tensors, axes = turn.swapaxes(1, 2) @ tensors @ turn, axes @ turn
    stress = np.stack([tensors[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], axis=-1)
    largest = von_mises(stress).max(axis=0)
    angles = [
        np.where(
            np.abs(tensors[..., i, j]) > AXES_SHEAR * largest,
            np.arctan2(2 * np.abs(tensors[..., i, j]), np.abs(tensors[..., i, i] - tensors[..., j, j])) / 2,
            0,
        )
        for i, j in ((0, 1), (1, 2), (0, 2))
    ]
    sizes = np.abs(np.diagonal(tensors, axis1=2, axis2=3)).max(axis=0)
    # of equal sizes, as in torsion, any serves: the first, whatever rounding says
    first = (sizes >= sizes.max(axis=1, keepdims=True) * (1 - 1e-9)).argmax(axis=1)
    along = np.take_along_axis(axes, first[:, None, None], axis=2)[..., 0]
    return along, np.asarray(2 * np.degrees(np.max(angles, axis=(0, 1))))


def _paths_on_planes(harmonics: ComplexArray, normals: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return the harmonics (H+1, p k, 2) of the shear and (H+1, p k) of the normal stress on planes with normals (p, k, 3)."""
    first, second = _tangents(normals)
    traction = np.einsum("hkij,pkj->hpki", harmonics[..., TENSOR], normals)
    parts = np.stack([np.einsum("hpki,pki->hpk", traction, side) for side in (first, second, normals)], axis=-1)
    parts = parts.reshape(len(harmonics), -1, 3)
    return parts[..., :2], parts[..., 2]


def _tangents(normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    first = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=-1)])
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return first, np.cross(normals, first)


def _largest_over_planes(damage: Callable[[FloatArray, FloatArray], FloatArray], places: int) -> FloatArray:
    """Return the largest value (k,) over normals: on a grid, then by shrinking steps around the best.

    The function takes normals (p, k, 3) and values (k,), and may return any bound where it is below these.
    """
    number = np.arange(COARSE_PLANES)
    height = (number + 0.5) / COARSE_PLANES  # a spiral over the half sphere, equal areas
    azimuth = np.pi * (1 + np.sqrt(5)) * number
    radius = np.sqrt(1 - height**2)
    grid = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=-1)
    normals: FloatArray = np.zeros((BEST_PLANES, places, 3))
    found: FloatArray = np.full((BEST_PLANES, places), -np.inf)
    for i in range(GRID_PARTS):  # each part is spread over the half sphere
        part = np.broadcast_to(grid[i::GRID_PARTS, None], (len(grid[i::GRID_PARTS]), places, 3))
        values = np.concatenate([found, damage(part, found.min(axis=0))])
        best = np.argsort(-values, axis=0, kind="stable")[:BEST_PLANES]
        normals = np.take_along_axis(np.concatenate([normals, part]), best[..., None], axis=0)
        found = np.take_along_axis(values, best, axis=0)
    step = np.full(places, np.sqrt(2 * np.pi / COARSE_PLANES) / 2)
    while step.max(initial=0) > FINEST_STEP:
        if len(found) > 1 and step.max() < LAST_CHOICE:
            best = found.argmax(axis=0)[None]
            normals = np.take_along_axis(normals, best[..., None], axis=0)
            found = np.take_along_axis(found, best, axis=0)
        normals, found, better = _around(damage, normals, found, step)
        step = np.where(better, step, step / 2)
    return np.asarray(found.max(axis=0))


def _around(
    damage: Callable[[FloatArray, FloatArray], FloatArray], normals: FloatArray, found: FloatArray, step: FloatArray
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Return the best of normals (n, k, 3) and six around each at an angle (k,), its value, and whether any place has a better one."""
    first, second = _tangents(normals)
    angle = 2 * np.pi * np.arange(6)[:, None, None, None] / 6
    way = np.cos(angle) * first + np.sin(angle) * second
    tried = np.cos(step)[:, None] * normals + np.sin(step)[:, None] * way
    values = damage(tried.reshape(-1, *normals.shape[1:]), np.tile(found, (6, 1))).reshape(tried.shape[:-1])
    best = values.argmax(axis=0)[None]
    value = np.take_along_axis(values, best, axis=0)[0]
    better = value > found
    moved = np.take_along_axis(tried, best[..., None], axis=0)[0]
    return np.where(better[..., None], moved, normals), np.maximum(value, found), np.asarray(better.any(axis=0))


def _alternating(harmonics: ComplexArray) -> FloatArray:
    if len(harmonics) == 1:
        return np.zeros(harmonics.shape[1])
    path = harmonics @ DEVIATOR.T
    path[0] = 0
    squared = (_sampled(path, _samples(path)) ** 2).sum(axis=-1)
    return np.asarray(np.sqrt(3) * _farthest(path, squared, np.zeros(path.shape[1:]))[1])


def _checked(harmonics: ComplexArray) -> ComplexArray:
    given = np.asarray(harmonics)
    if given.ndim != 3 or given.shape[-1] != 6 or not len(given):
        raise input_error(
            "harmonics",
            f"must have the shape (H+1, k, 6), got {given.shape}",
            "Give harmonic, place, and xx, yy, zz, xy, yz, xz.",
        )
    return given.astype(complex)


def _where_finite(compute: Callable[..., FloatArray], harmonics: ComplexArray, *others: Any) -> FloatArray:
    """Return what is computed of places with finite stresses, and NaN elsewhere; `others` are (k,) arrays."""
    finite = np.isfinite(harmonics).all(axis=(0, 2))
    found = np.full(finite.shape, np.nan)
    found[finite] = compute(harmonics[:, finite], *(np.broadcast_to(other, finite.shape)[finite] for other in others))
    return found


def _samples(harmonics: ComplexArray) -> int:
    return max(MIN_SAMPLES, SAMPLES_PER_HARMONIC * (len(harmonics) - 1))


def _sampled(harmonics: ComplexArray, samples: int) -> FloatArray:
    """Return the signals (samples, ...) of harmonics (H+1, ...) at equally spaced times."""
    phase = 2 * np.pi / samples * np.outer(np.arange(samples), np.arange(len(harmonics)))
    flat = harmonics.reshape(len(harmonics), -1)
    # two real products instead of a complex one
    signals = np.cos(phase) @ flat.real - np.sin(phase) @ flat.imag
    return np.asarray(signals.reshape(samples, *harmonics.shape[1:]))


def _derivatives(harmonics: ComplexArray, phase: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return signals (m, c) of harmonics (H+1, m, c) at a phase (m,) each, and their first two derivatives."""
    shape = harmonics.shape[1:]
    value, slope, bend = np.zeros((3, *shape))
    value += harmonics[0].real
    turn = np.exp(1j * phase)
    wave = np.ones_like(turn)
    for order in range(1, len(harmonics)):
        wave = wave * turn
        term = harmonics[order] * wave[:, None]
        value += term.real
        slope -= order * term.imag
        bend -= order**2 * term.real
    return value, slope, bend


def _farthest(harmonics: ComplexArray, squared: FloatArray, centre: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the points (m, c) of paths farthest from their centres (m, c), and the distances (m,).

    Squared distances of samples (n, m) bracket the maxima, Newton's method locates them.
    """

    def squares(path: IntArray, phase: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        x, slope, bend = _derivatives(harmonics[:, path], phase)
        x -= centre[path]
        return (x**2).sum(axis=1), 2 * (x * slope).sum(axis=1), 2 * (slope**2 + x * bend).sum(axis=1)

    phase, reach = _located(squared, squares)
    return _derivatives(harmonics, phase)[0], np.sqrt(reach)


def _largest(harmonics: ComplexArray) -> FloatArray:
    """Return the largest value (m,) of real signals (H+1, m) over the phase."""

    def signals(path: IntArray, phase: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        value, slope, bend = _derivatives(harmonics[:, path, None], phase)
        return value[:, 0], slope[:, 0], bend[:, 0]

    return _located(_sampled(harmonics, _samples(harmonics)), signals)[1]


Derivatives = Callable[[IntArray, FloatArray], tuple[FloatArray, FloatArray, FloatArray]]


def _located(values: FloatArray, derivatives: Derivatives) -> tuple[FloatArray, FloatArray]:
    """Return phase and value (m,) of the largest maxima of functions with the samples (n, m).

    Of functions `path` at `phase` the derivatives give value, slope and curvature. Between samples a lower one of two maxima may be
    the larger: all that reach the highest sample with twice the rise that a parabola can have are located.
    """
    before, after = np.roll(values, 1, axis=0), np.roll(values, -1, axis=0)
    bend = 2 * values - before - after
    top = values.max(axis=0)
    likely = (values >= before) & (values >= after) & (values + bend / 4 >= top)
    path, sample = np.nonzero(likely.T)
    step = 2 * np.pi / len(values)
    start = step * sample
    phase = start
    for _ in range(NEWTON_STEPS):
        _, slope, curvature = derivatives(path, phase)
        move = np.divide(slope, curvature, out=np.zeros_like(slope), where=curvature < 0)
        phase = np.clip(phase - move, start - step, start + step)
    value = derivatives(path, phase)[0]
    missed = value < values[sample, path]  # at a flat top
    phase, value = np.where(missed, start, phase), np.where(missed, values[sample, path], value)
    order = np.lexsort((value, path))
    best = order[np.append(np.diff(path[order]) != 0, True)]
    return phase[best], value[best]
