"""Number of modes of a reduction: up to a frequency, or up to an estimated error of the frequencies."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, Matrix, as_array
from stickslip.errors import input_error
from stickslip.model.fe.factorisation import Say, factorise, negative_eigenvalues, silent
from stickslip.model.modes import normal_modes
from stickslip.model.structure import Structure
from stickslip.reduction.bodies import Body, loose_bodies

SEARCH_FACTOR = 2.0  # frequencies up to this multiple of the limit are examined: a poor reduction overestimates them

SEEN = 3  # number of estimates from which the rate of convergence is determined
FIRST_ORDER = 0.1  # larger estimates are outside the first-order theory: a warning, not a number
DOUBT = 2.0  # uncertainty factor of a forecast of the number of modes
ROUNDING = 1e-9  # relative rounding of a frequency at the limit


@dataclass(frozen=True)
class ModesBelow:
    """Rule: keep all component modes below ``factor * up_to_hz``.

    Parameters
    ----------
    up_to_hz
        Highest frequency that the reduced model is meant for.
    factor
        Usually 1.5 to 2; a higher factor gives a smaller error.

    Raises
    ------
    InputError
        If a number is not positive.
    """

    up_to_hz: float
    factor: float = 1.5

    def __post_init__(self) -> None:
        _positive("ModesBelow", up_to_hz=self.up_to_hz, factor=self.factor)


@dataclass(frozen=True)
class FrequencyError:
    """Rule: keep component modes until the estimated error of the reduced model's frequencies is small enough.

    Parameters
    ----------
    error
        Allowed relative error of the natural frequencies below `up_to_hz`, as estimated by `frequency_errors`.
    up_to_hz
        Highest frequency that the reduced model is meant for.
    most
        Largest number of component modes. The reduction ends with an `InputError` as soon as the convergence of the errors shows
        that they do not suffice.

    Raises
    ------
    InputError
        If a number is not positive.
    """

    error: float
    up_to_hz: float
    most: int = 400

    def __post_init__(self) -> None:
        _positive("FrequencyError", error=self.error, up_to_hz=self.up_to_hz, most=self.most)


ModeChoice = int | ModesBelow | FrequencyError


@dataclass(frozen=True, eq=False)
class FrequencyErrors:
    """Natural frequencies of a reduced model and their estimated errors.

    Parameters
    ----------
    frequencies_hz
        (m,) natural frequencies of the reduced model.
    relative
        (m,) estimated relative errors, by which the full model's frequencies are lower; zero for rigid motions.
    missing
        Number of frequencies of the full model below the limit that the reduced model lacks. Frequencies above the first missing
        one are then numbered wrongly, and their errors refer to the nearest frequency. None if they could not be counted, see
        `negative_eigenvalues`.
    """

    frequencies_hz: FloatArray
    relative: FloatArray
    missing: int | None = None

    @property
    def worst(self) -> float:
        """Largest relative error; infinite if frequencies are missing."""
        return math.inf if self.missing else float(np.max(self.relative, initial=0.0))


def frequency_errors(
    structure: Structure, reduced: Structure, up_to_hz: float, *, say: Say = silent
) -> FrequencyErrors:
    """Estimate the errors of a reduced model's natural frequencies from its residuals in the full model.

    Parameters
    ----------
    structure
        The model before the reduction.
    reduced
        The model after `craig_bampton`, `rubin`, `reduce_interface`, or several of them.
    up_to_hz
        Highest frequency for which errors are estimated, Hz.
    say
        Called with a sentence before each long step.

    Returns
    -------
    FrequencyErrors
        Errors of those natural frequencies of `reduced` that may lie below the limit after correction by their error.

    Raises
    ------
    InputError
        If `reduced` does not come from `structure`.

    Notes
    -----
    A mass-normalised reduced mode ``x`` with the eigenvalue ``λ`` has the residual ``r = K x − λ M x``, orthogonal to the reduced
    space. To first order ``λ`` is too large by ``Σ |φ_dᴴ r|² / (λ_d − λ)`` over the neglected modes. These modes need not be
    known: with one solution ``y = K⁻¹ r``, ``t0 = rᴴ y`` and ``t1 = λ yᴴ M y`` are the first terms of the series in ``λ/λ_d``.
    If one mode dominates, its sum is ``t0 / (1 − t1/t0)``. The exact sum is not smaller (Cauchy-Schwarz); the ratio to the true
    error tends to one as modes are added. A mode orthogonal to the whole reduced space leaves no residual. Therefore the
    frequencies of the full model below the limit are counted by the signs of the pivots of ``K − λ M``.
    """
    _positive("frequency_errors", up_to_hz=up_to_hz)
    basis = _basis_between(structure, reduced)
    bodies = loose_bodies(structure, np.arange(structure.n), say)
    return errors_of(structure, reduced, basis, bodies, up_to_hz, frequencies_below(structure, up_to_hz, say))


def frequencies_below(structure: Structure, limit_hz: float, say: Say) -> int | None:
    """Return the number of natural frequencies below a limit, including rigid motions; None if they cannot be counted."""
    square = (2 * math.pi * limit_hz) ** 2
    return negative_eigenvalues(structure.stiffness - square * structure.mass, say=say)


def errors_of(
    structure: Structure, reduced: Structure, basis: Matrix, bodies: list[Body], up_to_hz: float, count: int | None
) -> FrequencyErrors:
    """Return the estimated errors, given the basis and the factorised bodies.

    Parameters
    ----------
    structure
        The model before the reduction, n dofs.
    reduced
        The model after it, m coordinates.
    basis
        (n, m) matrix from the coordinates of `reduced` to the dofs of `structure`.
    bodies
        Bodies of the structure, free or fixed at dofs whose unit displacements are in the reduced space.
    up_to_hz
        Highest frequency for which errors are estimated, Hz.
    count
        Number of the structure's frequencies below `up_to_hz`, if known.
    """
    modes = normal_modes(reduced, int(np.count_nonzero(reduced.mass.diagonal())))
    below: BoolArray = modes.frequencies_hz <= SEARCH_FACTOR * up_to_hz
    squares = modes.squares[below]
    shapes = basis @ modes.shapes[:, below]
    residual = structure.stiffness @ shapes - (structure.mass @ shapes) * squares
    first, second = np.zeros(squares.size), np.zeros(squares.size)
    for body in bodies:
        r = residual[body.dofs]
        y = body.solve(r)
        first += np.sum((r.conj() * y).real, axis=0)
        # for a free body the series is about the shift
        second += (squares - body.shift) * np.sum((y.conj() * (body.mass @ y)).real, axis=0)
    ratio = np.divide(second, first, out=np.zeros_like(first), where=first > 0)
    too_high = first / np.maximum(1.0 - ratio, 0.5)  # the two terms are no estimate for ratios above a half
    elastic = squares > 0
    relative = np.zeros(squares.size)
    relative[elastic] = np.maximum(too_high[elastic], 0.0) / (2 * squares[elastic])
    frequencies = modes.frequencies_hz[below]
    inside = frequencies * (1.0 - relative) <= up_to_hz
    # near the limit an estimate may be off by its own size
    there = np.count_nonzero(frequencies * (1.0 - 2 * relative) <= (1 + ROUNDING) * up_to_hz)
    missing = None if count is None else max(0, count - int(there))
    return FrequencyErrors(frequencies[inside], relative[inside], missing)


def enough_modes(
    choice: FrequencyError, start: int, available: int, errors: Callable[[int], FrequencyErrors], say: Say
) -> int:
    """Return the number of modes at which the estimated errors suffice.

    The number grows by 15 to 40 % in each step if a few steps suffice, else by 80 %.

    Parameters
    ----------
    choice
        Required error and limits.
    start, available
        First number of modes; number of available modes.
    errors
        Function from a number of modes to the estimated errors.
    say
        Called with a sentence before each step.

    Raises
    ------
    InputError
        If the rate at which the errors fall shows that more than `choice.most` modes are needed.
    """
    count = min(start, available)
    tried: list[tuple[int, float]] = []
    while (worst := errors(count).worst) > choice.error and count < available:
        tried.append((count, worst))
        needed = min(_needed(tried, choice.error), available)
        say(_progress(count, worst, choice.error, needed))
        if count >= choice.most or needed > DOUBT * choice.most:
            raise _too_many(choice, count, worst, needed)
        growth = min(1.4, max(1.15, (worst / choice.error) ** (1 / 3)))
        if math.isfinite(needed) and needed > 3 * count:
            growth = 1.8
        count = min(available, choice.most, max(count + 2, math.ceil(growth * count)))
    return count


def _needed(tried: list[tuple[int, float]], error: float) -> float:
    """Return the number of modes that a power law predicts; NaN with fewer than `SEEN` estimates.

    The faster rate counts, from all estimates or from the last two.
    """
    known = [(count, worst) for count, worst in tried if worst < FIRST_ORDER]
    if len(known) < SEEN:
        return math.nan
    count, worst = known[-1]
    rates = [math.log(w / worst) / math.log(count / c) for c, w in (known[0], known[-2])]
    return float(count * (worst / error) ** (1 / max(1.0, *rates)))


def _progress(count: int, worst: float, error: float, needed: float) -> str:
    known = "a frequency is missing" if math.isinf(worst) else f"estimated error {worst:.2g}"
    ahead = "" if math.isnan(needed) else f"; about {_rounded(needed)} modes will be needed"
    return f"{count} modes: {known}, {error:.2g} asked for{ahead}"


def _rounded(count: float) -> int:
    return int(float(f"{count:.2g}"))


def _too_many(choice: FrequencyError, count: int, worst: float, needed: float) -> Exception:
    known = "a frequency is still missing" if math.isinf(worst) else f"the estimate is {worst:.2g}"
    ahead = "" if math.isnan(needed) else f", and about {_rounded(needed)} modes would be needed"
    return input_error(
        "FrequencyError",
        f"{choice.error:.2g} up to {choice.up_to_hz:g} Hz is not met with {choice.most} modes: "
        f"with {count} {known}{ahead}",
        f"Keep more dofs, allow a larger error, take ModesBelow({choice.up_to_hz:g}), or raise `most`.",
    )


def _basis_between(structure: Structure, reduced: Structure) -> Matrix:
    """Return the matrix from the coordinates of `reduced` to the coordinates of `structure`."""
    if reduced.basis is None:
        raise input_error("frequency_errors", "nothing was reduced", "Give the reduced structure.")
    if structure.basis is None:
        basis = reduced.basis
        if basis.shape[0] != structure.n:
            raise _not_of(structure.n, basis.shape[0])
        return basis
    before, after = structure.basis, reduced.basis
    if before.shape[0] != after.shape[0]:
        raise _not_of(before.shape[0], after.shape[0])
    gram, right = before.conj().T @ before, before.conj().T @ after
    scale = 1 / np.sqrt(gram.diagonal().real)
    if scipy.sparse.issparse(gram):
        diagonal = scipy.sparse.diags_array(scale)
        gram = scipy.sparse.csr_array(diagonal @ gram @ diagonal)
    else:
        gram = scale[:, None] * gram * scale
    right = as_array(right)
    inner = scale[:, None] * factorise(gram)(scale[:, None] * right)
    if np.linalg.norm(before @ inner - after) > 1e-6 * np.linalg.norm(after):
        raise input_error(
            "frequency_errors",
            "the shapes of the reduced model are no combinations of those of the other one",
            "Give the structure from which it was reduced.",
        )
    return inner


def _not_of(full: int, reduced: int) -> Exception:
    return input_error(
        "frequency_errors",
        f"the reduced model leads back to {reduced} dofs, the structure has {full}",
        "Give the structure from which it was reduced.",
    )


def _positive(place: str, **numbers: float) -> None:
    for name, value in numbers.items():
        if not (math.isfinite(value) and value > 0):
            raise input_error(f"{place}.{name}", f"must be positive, got {value}", "Check.")
