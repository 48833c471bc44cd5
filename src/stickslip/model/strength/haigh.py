"""Haigh diagram: amplitude that is allowed at a mean stress, utilisation, and cycles of an S-N line.

Amplitude and mean are those of one equivalent stress, as `alternating_and_mean` gives them. The amplitude grows at a fixed mean.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.errors import check_choice, input_error, missing_package
from stickslip.model.strength.card import StrengthCard

NEWTON_STEPS = 60
NO_YIELD = "the card has no yield_pa: whether the static stress is above yield is not known"
AboveYield = Literal["void", "shakedown", "neuber"]


@dataclass(frozen=True, eq=False)
class HaighTable:
    """Allowed amplitude over the mean stress, linear between the points.

    Parameters
    ----------
    means
        (n,) rising mean stresses in Pa, or over the fatigue limit.
    amplitudes
        (n,) allowed amplitudes in Pa, or over the fatigue limit.
    relative
        Whether both are divided by the fatigue limit at R = -1.

    Raises
    ------
    InputError
        If means do not rise, or amplitudes are negative.
    """

    means: FloatArray
    amplitudes: FloatArray
    relative: bool = False

    def __post_init__(self) -> None:
        means, amplitudes = np.asarray(self.means, dtype=float), np.asarray(self.amplitudes, dtype=float)
        if means.ndim != 1 or means.shape != amplitudes.shape or len(means) < 2:
            raise input_error(
                "HaighTable",
                f"has means of shape {means.shape} and amplitudes of shape {amplitudes.shape}",
                "Give as many amplitudes as means, at least two.",
            )
        if not np.all(np.diff(means) > 0):
            raise input_error("HaighTable.means", f"must rise, got {means.tolist()}", "Give the lowest first.")
        if not np.all(amplitudes >= 0):
            raise input_error(
                "HaighTable.amplitudes",
                f"must not be negative, got {amplitudes.tolist()}",
                "End the table where 0 is reached.",
            )

    def __call__(self, card: StrengthCard, mean: FloatArray) -> FloatArray:
        """Return the allowed amplitude at means (...) in Pa; below the first point it stays.

        Raises
        ------
        InputError
            If a mean lies above the last point of a table that does not end at amplitude 0.
        """
        (limit,) = card.need("a Haigh table", "fatigue_limit_pa")
        scale = limit if self.relative else np.asarray(1.0)
        last = float(np.asarray(self.means)[-1])
        beyond = mean / scale > last
        if np.any(beyond) and np.asarray(self.amplitudes)[-1] > 0:
            raise input_error(
                "HaighTable.means",
                f"end at {last:g}, and {int(beyond.sum())} places have up to {np.max(np.where(beyond, mean / scale, last)):g}",
                "Go on with the table to the largest mean stress, or down to amplitude 0.",
            )
        return np.asarray(scale * np.interp(mean / scale, self.means, self.amplitudes))


def _goodman(card: StrengthCard, mean: FloatArray) -> FloatArray:
    limit, ultimate = card.need("Goodman's line", "fatigue_limit_pa", "ultimate_pa")
    return np.asarray(limit * (1 - mean / ultimate))


def _gerber(card: StrengthCard, mean: FloatArray) -> FloatArray:
    limit, ultimate = card.need("Gerber's parabola", "fatigue_limit_pa", "ultimate_pa")
    return np.asarray(limit * (1 - (mean / ultimate) ** 2))


def _soderberg(card: StrengthCard, mean: FloatArray) -> FloatArray:
    limit, proof = card.need("Soderberg's line", "fatigue_limit_pa", "yield_pa")
    return np.asarray(limit * (1 - mean / proof))


def _morrow(card: StrengthCard, mean: FloatArray) -> FloatArray:
    limit, fracture = card.need("Morrow's line", "fatigue_limit_pa", "fracture_pa")
    return np.asarray(limit * (1 - mean / fracture))


def _walker(card: StrengthCard, mean: FloatArray) -> FloatArray:
    """Solve (a + m)^(1-γ) a^γ = f for the amplitude a: convex in ln a, so Newton's method falls to the root from f."""
    limit, gamma = card.need("Walker's rule", "fatigue_limit_pa", "walker_exponent")
    log = np.log(np.broadcast_to(limit, np.broadcast_shapes(limit.shape, mean.shape)))
    for _ in range(NEWTON_STEPS):
        a = np.exp(log)
        step = ((1 - gamma) * np.log(a + mean) + gamma * log - np.log(limit)) / ((1 - gamma) * a / (a + mean) + gamma)
        log = log - step
        if not np.any(np.abs(step) > 1e-14):
            break
    return np.asarray(np.exp(log))


Rule = Callable[[StrengthCard, FloatArray], FloatArray]
MEAN_STRESS_RULES: dict[str, Rule] = {
    "goodman": _goodman,
    "gerber": _gerber,
    "soderberg": _soderberg,
    "morrow": _morrow,
    "walker": _walker,
}
NO_COMPRESSION = ("gerber", "walker")  # the parabola falls on both sides; Walker's stress has no meaning for R > 1


def allowable_amplitude(
    rule: str | HaighTable, card: StrengthCard, mean: FloatArray, *, credit_in_compression: bool = False
) -> FloatArray:
    """Return the amplitude (...) in Pa that is allowed at mean stresses (...); 0 beyond the end of the diagram.

    Parameters
    ----------
    rule
        ``"goodman"`` (1899), ``"gerber"`` (1874), ``"soderberg"`` (1930), ``"morrow"`` (1968), ``"walker"`` (1970), or a table.
    card
        Limits of the material, at the temperature of each place where they depend on it.
    mean
        (...) mean stress in Pa.
    credit_in_compression
        Whether a compressive mean raises the allowed amplitude; by default the limit at R = -1 holds there.

    Raises
    ------
    InputError
        If the card lacks what the rule needs, or the rule has no branch in compression and credit is asked for.
    """
    own = np.asarray(mean, dtype=float)
    if isinstance(rule, str):
        check_choice("rule", rule, MEAN_STRESS_RULES)
        if credit_in_compression and rule in NO_COMPRESSION:
            raise input_error(
                "credit_in_compression",
                f"is true, and the rule {rule} has no branch in compression",
                "Leave it out, or choose goodman or a table.",
            )
    found = (MEAN_STRESS_RULES[rule] if isinstance(rule, str) else rule)(
        card, own if credit_in_compression else np.maximum(own, 0)
    )
    return np.maximum(found, 0)


@dataclass(frozen=True, kw_only=True)
class Hardening:
    """Stress-strain curve for Neuber's rule: ε = σ/E + 0.002 (σ/R_p0.2)^(1/n) (Ramberg and Osgood, 1943).

    Parameters
    ----------
    young_modulus
        Young's modulus E in Pa.
    exponent
        Hardening exponent n in (0, 1).
    """

    young_modulus: float
    exponent: float

    def __post_init__(self) -> None:
        if not self.young_modulus >= 1e8:
            raise input_error(
                "Hardening.young_modulus", f"must be at least 1e8 Pa, got {self.young_modulus:g}", "Steel: 2.1e11."
            )
        if not 0 < self.exponent < 1:
            raise input_error("Hardening.exponent", f"must lie in (0, 1), got {self.exponent:g}", "Steels: 0.1 to 0.2.")

    def local_stress(self, elastic: FloatArray, proof: FloatArray) -> FloatArray:
        """Return the stress (...) whose product with its strain is that of the `elastic` stress, σ ε = S²/E (Neuber, 1961)."""
        size, e, n = np.abs(elastic), self.young_modulus, self.exponent
        # σ² / E + 0.002 σ (σ/R)^(1/n) = S²/E in ln σ is convex and rising: Newton's method falls to the root from S
        log = np.log(np.maximum(size, 1e-300))
        for _ in range(NEWTON_STEPS):
            s = np.exp(log)
            plastic = 0.002 * e * s * (s / proof) ** (1 / n)
            step = (s**2 + plastic - size**2) / (2 * s**2 + (1 + 1 / n) * plastic)
            log = log - np.where(size > 0, step, 0)
            if not np.any(np.abs(step[size > 0]) > 1e-14):
                break
        return np.asarray(np.where(np.isnan(elastic), np.nan, np.sign(elastic) * np.where(size > 0, np.exp(log), 0)))


@dataclass(frozen=True, eq=False)
class Margin:
    """Margin of places in the Haigh diagram; NaN where `void`.

    Parameters
    ----------
    mean
        (k,) mean stress with which it was computed, after shakedown or Neuber's rule, in Pa.
    allowed
        (k,) allowed amplitude at that mean in Pa.
    utilisation, factor
        (k,) amplitude over the allowed one, 1 at the limit, and its inverse.
    void
        (k,) places whose elastic static stress is above yield and was not corrected.
    doubt
        What could not be judged, as a sentence; empty: nothing.
    """

    mean: FloatArray
    allowed: FloatArray
    utilisation: FloatArray
    factor: FloatArray
    void: BoolArray
    doubt: str = ""


def margin(
    rule: str | HaighTable,
    card: StrengthCard,
    amplitude: FloatArray,
    mean: FloatArray,
    *,
    above_yield: AboveYield = "void",
    hardening: Hardening | None = None,
    credit_in_compression: bool = False,
) -> Margin:
    """Return utilisation and factor of amplitudes at mean stresses; the amplitude grows at a fixed mean.

    Parameters
    ----------
    rule, card, credit_in_compression
        As of `allowable_amplitude`.
    amplitude, mean
        (k,) alternating stress, and elastic mean stress with its sign, in Pa.
    above_yield
        What is done with a static stress above yield: ``"void"`` gives no number, ``"shakedown"`` bounds the mean of all places by
        yield minus amplitude (elastic shakedown; void where the amplitude exceeds yield), ``"neuber"`` corrects it by `hardening`.
    hardening
        Stress-strain curve for Neuber's rule.

    Raises
    ------
    InputError
        If the card lacks what is needed, or `above_yield` and `hardening` do not go together.
    """
    check_choice("above_yield", above_yield, ("void", "shakedown", "neuber"))
    if (above_yield == "neuber") != (hardening is not None):
        raise input_error(
            "hardening",
            f"is {'missing' if hardening is None else 'given'} with above_yield = {above_yield!r}",
            "Give hardening=Hardening(young_modulus=…, exponent=…) with 'neuber', and with nothing else.",
        )
    own, elastic = np.broadcast_arrays(np.asarray(amplitude, dtype=float), np.asarray(mean, dtype=float))
    used, void = _static(card, own, elastic, above_yield, hardening)
    allowed = allowable_amplitude(rule, card, np.where(void, 0.0, used), credit_in_compression=credit_in_compression)
    allowed = np.where(void | np.isnan(used), np.nan, allowed)
    with np.errstate(divide="ignore", invalid="ignore"):
        utilisation = np.where(allowed > 0, own / allowed, np.where(np.isnan(allowed), np.nan, np.inf))
        factor = np.where(own > 0, allowed / own, np.where(allowed > 0, np.inf, 0.0 * allowed))
    factor = np.where(np.isnan(own), np.nan, factor)
    utilisation = np.where(np.isnan(own), np.nan, utilisation)
    doubt = "" if card.yield_pa is not None else NO_YIELD
    return Margin(np.where(void, np.nan, used), allowed, utilisation, factor, void, doubt)


def _static(
    card: StrengthCard, amplitude: FloatArray, mean: FloatArray, above_yield: str, hardening: Hardening | None
) -> tuple[FloatArray, BoolArray]:
    """Return the mean stress after yielding, and which places are void."""
    if card.yield_pa is None and above_yield == "void":
        return mean, np.zeros(mean.shape, dtype=bool)
    (proof,) = card.need(f"above_yield = {above_yield!r}", "yield_pa")
    if hardening is not None:
        return np.where(np.abs(mean) > proof, hardening.local_stress(mean, proof), mean), np.zeros(
            mean.shape, dtype=bool
        )
    if above_yield == "shakedown":
        room = proof - amplitude
        return np.clip(mean, -np.maximum(room, 0), np.maximum(room, 0)), room < 0
    return mean, np.abs(mean) > proof


def fkm_goodman_table(slope: float, slope_above: float) -> HaighTable:
    """Return the Haigh diagram of the FKM guideline, of which pyLife computes the points (extra ``life``).

    Parameters
    ----------
    slope, slope_above
        Mean stress sensitivities M for R below 0, M2 for R between 0 and 1 (in the guideline M/3).

    Raises
    ------
    StickslipError
        If pyLife is not installed.
    """
    return _of_pylife("fkm_goodman", (0.0,), {"M": slope, "M2": slope_above})


def five_segment_table(slopes: tuple[float, float, float, float, float], knees: tuple[float, float]) -> HaighTable:
    """Return a Haigh diagram of five segments, of which pyLife computes the points (extra ``life``).

    Parameters
    ----------
    slopes
        Mean stress sensitivities M0 to M4: for R below 0, up to the first and the second of the `knees`, up to 1, and above 1.
    knees
        Stress ratios R12 and R23 between 0 and 1.

    Raises
    ------
    InputError
        If the knees do not rise between 0 and 1.
    StickslipError
        If pyLife is not installed.
    """
    if not 0 < knees[0] < knees[1] < 1:
        raise input_error("knees", f"must rise between 0 and 1, got {list(knees)}", "Give R12, then R23.")
    named = {f"M{i}": value for i, value in enumerate(slopes)}
    return _of_pylife("five_segment_correction", (0.0, *knees), {**named, "R12": knees[0], "R23": knees[1]})


def _of_pylife(function: str, knees: tuple[float, ...], constants: dict[str, float]) -> HaighTable:
    """Return the diagram through the stress ratios at which its slope changes; it is straight between them."""
    try:
        from pylife.strength import meanstress
    except (ImportError, OSError) as error:
        raise missing_package("pylife", error, "life") from error
    # rays from the origin: R = 2 lies in compression, R = -inf at mean = -amplitude, 0.99999 is the end of the diagram
    ratios = np.array([2.0, *(-1e9,), -1.0, *knees, 0.99999])
    mean = (1 + ratios) / (1 - ratios)
    equivalent: Any = getattr(meanstress, function)(np.ones_like(mean), mean, R_goal=-1.0, **constants)
    amplitude = 1 / np.asarray(equivalent, dtype=float)
    points = np.column_stack([mean * amplitude, amplitude])
    return HaighTable(points[:, 0], points[:, 1], relative=True)


def cycles(amplitude: FloatArray, card: StrengthCard) -> FloatArray:
    """Return the number of cycles (...) endured at amplitudes (...) in Pa at R = -1, infinite where the limit is endured for ever.

    With a mean stress give utilisation times fatigue limit. The survival probability is that of the card.

    Parameters
    ----------
    amplitude
        (...) equivalent amplitude at R = -1 in Pa.
    card
        Limits of the material with `sn_slope` and `knee_cycles`.

    Raises
    ------
    InputError
        If the card lacks the S-N line.
    """
    limit, slope, knee = card.need("an S-N line", "fatigue_limit_pa", "sn_slope", "knee_cycles")
    own = np.asarray(amplitude, dtype=float)
    beyond = np.asarray(np.inf if card.sn_slope_beyond is None else card.sn_slope_beyond, dtype=float)
    with np.errstate(divide="ignore", over="ignore"):
        ratio = limit / own
        return np.asarray(knee * ratio ** np.where(ratio > 1, beyond, slope))
