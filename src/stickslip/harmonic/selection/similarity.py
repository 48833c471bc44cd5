"""Similarity of two Jacobians, and coupling between harmonics (Gastaldi & Berruti 2017, sections 4.1 and 6.2)."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.errors import SingularError, input_error
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.harmonic_set import Harmonics
from stickslip.harmonic.structured import real_matrix

Part = Literal["jacobian", "contact", "missing"]
ZERO_ENTRY = 1e-3  # off-diagonal terms of Γ up to this size count as zero; its diagonal is about one


@dataclass(frozen=True, slots=True)
class JacobianSimilarity:
    """Similarity of the enlarged Jacobian J at a solution with few harmonics to J̃ at the solution with many.

    Attributes
    ----------
    change
        ``‖J - J̃‖ / ‖J̃‖`` in the Frobenius norm (eq. 30, as a fraction).
    size
        Number of rows of the Jacobians.
    trace
        Trace of ``Γ = J⁻¹ J̃`` (eq. 31); equal to `size` if both are equal.
    mean_diagonal
        Trace over size.
    zero_share
        Share of the off-diagonal terms of Γ of at most `tolerance`.
    tolerance
        Largest size of an entry that counts as zero.
    """

    change: float
    size: int
    trace: float
    mean_diagonal: float
    zero_share: float
    tolerance: float


def jacobian_similarity(
    balance: HarmonicBalance,
    x: FloatArray,
    reference: FloatArray,
    omega: float,
    tolerance: float = ZERO_ENTRY,
    scales: FloatArray | None = None,
) -> JacobianSimilarity:
    """Compare the Jacobians at a solution with few harmonics and at one with many.

    Both are Jacobians of the same, large problem; the contacts are evaluated at different motions, so they differ only
    in the derivatives K̂ of the contact forces.

    Parameters
    ----------
    balance
        The periodic problem with the harmonics of the reference.
    x
        Scaled unknowns of the solution with few harmonics, padded with zeros: ``balance.unknowns(coefficients)``.
    reference
        Scaled unknowns of the solution with all harmonics of `balance`.
    omega
        Frequency, rad/s.
    tolerance
        Off-diagonal terms of Γ up to this size count as zero.
    scales
        (n,) size of one unit of each retained coordinate, so that translations and rotations can be summed; None: units
        in which stuck contacts and structure have unit stiffness (`natural_scales`). The diagonal of Γ does not depend
        on it.

    Raises
    ------
    SingularError
        If J is singular, so that there is no Γ.
    InputError
        If a vector has the wrong length, or `scales` are not positive.
    """
    for name, vector in (("x", x), ("reference", reference)):
        if np.shape(vector) != (balance.size,):
            raise input_error(
                f"jacobian_similarity: {name}",
                f"has shape {np.shape(vector)} for {balance.size} unknowns",
                "Give balance.unknowns(coefficients).",
            )
    few, many = (_scaled(balance, v, omega, scales) for v in (x, reference))
    if np.linalg.cond(few, 1) > 1.0 / np.finfo(float).eps:
        raise SingularError(f"the Jacobian at {omega:.6g} rad/s is singular: Γ does not exist")
    gamma = np.linalg.solve(few, many)
    size = balance.size
    off = np.abs(gamma[~np.eye(size, dtype=bool)])
    trace = float(np.trace(gamma))
    return JacobianSimilarity(
        float(np.linalg.norm(few - many) / np.linalg.norm(many)),
        size,
        trace,
        trace / size,
        float(np.mean(off <= tolerance)) if off.size else 1.0,
        tolerance,
    )


def harmonic_block_norms(
    balance: HarmonicBalance,
    x: FloatArray,
    omega: float,
    part: Part = "jacobian",
    kept: Harmonics | None = None,
    scales: FloatArray | None = None,
) -> FloatArray:
    """Return the norms of the blocks ``∂r^h/∂q^k`` between harmonics: effect of motion in k on forces in h (fig. 1).

    Parameters
    ----------
    balance
        The periodic problem.
    x
        Scaled unknowns of a solution, padded with zeros where it has fewer harmonics.
    omega
        Frequency, rad/s.
    part
        ``jacobian``: of J; ``contact``: of K̂; ``missing``: of ΔJ (eq. 20), the blocks between different harmonics of
        which at least one is not `kept`, which the solution neglects.
    kept
        Harmonics of the solution with few harmonics, for ``missing``.
    scales
        (n,) size of one unit of each coordinate; see `jacobian_similarity`.

    Returns
    -------
    ndarray
        (n_h, n_h) largest singular values in the order of ``balance.harmonics``. With natural scales, a stuck contact
        has the norm 1.

    Raises
    ------
    InputError
        If the part is unknown, or is ``missing`` without `kept`.
    """
    if part not in get_args(Part) or (part == "missing" and kept is None):
        raise input_error(
            "harmonic_block_norms",
            f"part = {part!r}, kept = {kept!r}",
            f"Give one of {', '.join(get_args(Part))}, and with 'missing' the harmonics kept, such as (0, 1).",
        )
    matrix = _scaled(balance, x, omega, scales, whole=part == "jacobian")
    places = _rows(balance)
    norms = np.array([[np.linalg.norm(matrix[np.ix_(a, b)], ord=2) for b in places] for a in places])
    return norms if part != "missing" else np.where(_neglected(balance, kept or ()), norms, 0.0)


def natural_scales(balance: HarmonicBalance) -> FloatArray:
    """Return the (n,) unit of each retained coordinate in which structure and stuck contacts have unit stiffness.

    In such units every coordinate has the same static stiffness, whatever its original unit; a coordinate without
    stiffness keeps its unit.
    """
    contacts = balance.interface
    stuck = contacts.gap_operator.power(2).T @ contacts.stuck_stiffness()
    stiffness = np.abs(np.diagonal(balance.linear.nn[0])) + stuck
    return np.asarray(1.0 / np.sqrt(np.where(stiffness > 0.0, stiffness, 1.0)))


def _scaled(
    balance: HarmonicBalance, x: FloatArray, omega: float, scales: FloatArray | None, whole: bool = True
) -> FloatArray:
    """Return J, or K̂ alone, in units of `scales`."""
    matrix = balance.linearise(x, omega).dense_jac() / (balance.displacement_scale / balance.force_scale)
    if not whole:
        matrix = matrix - real_matrix([balance.linear_block(omega, h) for h in balance.harmonics])
    own = natural_scales(balance) if scales is None else np.asarray(scales, dtype=float)
    if own.shape != (balance.linear.n,) or not np.all(own > 0.0):
        raise input_error(
            "scales",
            f"must be {balance.linear.n} positive numbers, got shape {own.shape}",
            "Give one a retained coordinate, or none.",
        )
    each = np.tile(own, balance.n_rows)
    return np.asarray(each[:, None] * matrix * each)


def _rows(balance: HarmonicBalance) -> list[IntArray]:
    """Return the rows of the unknowns of each harmonic."""
    n = balance.linear.n
    starts = [0, *(n * (2 * i + 1) for i in range(len(balance.harmonics)))]
    return [np.arange(a, b, dtype=np.int64) for a, b in pairwise(starts)]


def _neglected(balance: HarmonicBalance, kept: Harmonics) -> BoolArray:
    """Return whether each block belongs to ΔJ, (n_h, n_h)."""
    out = ~np.isin(balance.harmonics, kept)
    return (out[:, None] | out) & ~np.eye(out.size, dtype=bool)
