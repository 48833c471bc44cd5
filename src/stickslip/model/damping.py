"""Damping: proportional, by mode, and structural."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import input_error
from stickslip.model.modes import normal_modes
from stickslip.model.structure import Structure

ROUNDING = 1e-12  # share of a damping matrix below which its skew part is rounding
LARGEST = 5000  # dofs of a full damping matrix: 0.2 GB


@dataclass(frozen=True, kw_only=True)
class Damping:
    """Damping of a part; `loss_factor` may be combined with one of the others.

    Parameters
    ----------
    ratio, between_hz
        Damping ratio at two frequencies in Hz, proportional to mass and stiffness.
    alpha, beta
        Factors of proportional damping ``C = α M + β K``, in 1/s and s.
    modal
        Damping ratios of the modes of the part alone, contacts open, lowest first, or one for all modes.
    loss_factor
        η of the complex stiffness ``K (1 + i η)``.

    Raises
    ------
    InputError
        If two forms of viscous damping are given, a number is missing or out of range.
    """

    ratio: float | None = None
    between_hz: tuple[float, float] | None = None
    alpha: float = 0.0
    beta: float = 0.0
    modal: float | tuple[float, ...] | None = None
    loss_factor: float = 0.0

    def __post_init__(self) -> None:
        factors = bool(self.alpha or self.beta)
        if (self.ratio is None) != (self.between_hz is None):
            lacking = "between_hz" if self.between_hz is None else "ratio"
            raise input_error(
                f"damping.{lacking}",
                "is missing, the other of ratio and between_hz is given",
                "A ratio holds at two frequencies. One ratio of all modes is modal.",
            )
        if (self.ratio is not None) + factors + (self.modal is not None) > 1:
            raise input_error(
                "damping", "is given in several forms", "Give ratio and between_hz, or alpha and beta, or modal."
            )
        given: dict[str, tuple[float, ...]] = {
            "alpha": (self.alpha,),
            "beta": (self.beta,),
            "loss_factor": (self.loss_factor,),
        }
        given["modal"] = self.modal if isinstance(self.modal, tuple) else (self.modal or 0.0,)
        for name, values in given.items():
            if not all(0 <= value < math.inf for value in values):
                raise input_error(f"damping.{name}", f"must not be negative, got {values}", "0 is none.")
        if self.ratio is not None and self.between_hz is not None:
            _check_rayleigh(self.ratio, self.between_hz)

    @property
    def is_modal(self) -> bool:
        """Whether modes are needed."""
        return self.modal is not None and self.modal != 0.0

    def of_matrices(self, structure: Structure, elastic: Matrix | None = None) -> Structure:
        """Return the structure with proportional and structural damping; `elastic` as in `structural_damping`."""
        if self.ratio is not None and self.between_hz is not None:
            structure = rayleigh_damping(structure, self.ratio, self.between_hz)
        elif self.alpha or self.beta:
            proportional = self.alpha * structure.mass + self.beta * structure.stiffness
            structure = _with_dissipation(structure, proportional)
        if self.loss_factor:
            structure = structural_damping(structure, self.loss_factor, elastic=elastic)
        return structure

    def of_modes(self, structure: Structure) -> Structure:
        """Return a structure with modal damping; ratios beyond its number of modes are ignored."""
        if self.modal is None or not self.is_modal:
            return structure
        if isinstance(self.modal, float):
            return modal_damping(structure, self.modal)
        movable = int(np.count_nonzero(structure.mass.diagonal()))
        return modal_damping(structure, self.modal[:movable])


def _check_rayleigh(ratio: float, between_hz: tuple[float, float]) -> None:
    low, high = between_hz
    if not (math.isfinite(ratio) and ratio >= 0):
        raise input_error("damping ratio", f"must not be negative, got {ratio}", "0.001 is 0.1 %.")
    if not 0 < low < high < math.inf:
        raise input_error("damping between_hz", f"needs 0 < low < high, got {between_hz}", "Give hertz.")


def rayleigh_damping(structure: Structure, ratio: float, between_hz: tuple[float, float]) -> Structure:
    """Return the structure with ``C = α M + β K``.

    Parameters
    ----------
    structure
        Structure whose damping matrix is replaced; Coriolis terms (the skew part) stay.
    ratio
        Damping ratio (fraction of critical) at both frequencies; it is lower between them.
    between_hz
        Two different frequencies in Hz.
    """
    _check_rayleigh(ratio, between_hz)
    low, high = between_hz
    total = 2 * math.pi * (low + high)
    alpha = 2 * ratio * (2 * math.pi) ** 2 * low * high / total
    beta = 2 * ratio / total
    return _with_dissipation(structure, alpha * structure.mass + beta * structure.stiffness)


def modal_damping(structure: Structure, ratios: float | Sequence[float] | FloatArray) -> Structure:
    """Return the structure with given damping ratios of its lowest modes, ``C = M Φ diag(2 ζ ω) Φᴴ M``.

    Parameters
    ----------
    structure
        Structure whose damping matrix is replaced; Coriolis terms (the skew part) stay. The modes follow from its present mass
        and stiffness: for ratios of an assembly, join parts or tie contacts first.
    ratios
        Damping ratio of each mode, lowest first; further modes and rigid ones are undamped. One number applies to all modes.

    Returns
    -------
    Structure
        The structure; its damping matrix is full.

    Raises
    ------
    InputError
        If a ratio is negative, there are more ratios than modes, a mode diverges, or the matrix would be too large.
    """
    n = structure.n
    if n > LARGEST:
        raise input_error("modal_damping", f"{n} dofs would need a full matrix", "Reduce the structure first.")
    movable = int(np.count_nonzero(structure.mass.diagonal()))
    given = np.asarray(ratios, dtype=float)
    zeta = np.full(movable, given) if given.ndim == 0 else given
    if zeta.ndim != 1 or not 0 < zeta.size <= movable or not np.all((zeta >= 0) & (zeta < np.inf)):
        raise input_error(
            "modal_damping: ratios",
            f"must be numbers from 0, at most {movable} of them, got {given.tolist()}",
            "0.001 is 0.1 % of critical.",
        )
    modes = normal_modes(structure, zeta.size)
    if np.any(modes.squares < 0):
        raise input_error(
            "modal_damping",
            f"{int(np.count_nonzero(modes.squares < 0))} modes diverge: the stiffness is not positive",
            "Damp the structure at a speed at which it is stable.",
        )
    weighted = structure.mass @ modes.shapes
    rates = 2.0 * zeta * np.sqrt(modes.squares)
    damping = (weighted * rates) @ weighted.conj().T
    return _with_dissipation(structure, (damping + damping.conj().T) / 2)


def structural_damping(structure: Structure, loss_factor: float, *, elastic: Matrix | None = None) -> Structure:
    """Return the structure with structural (hysteretic) damping: stiffness ``K + i η K`` in vibration, K alone in statics.

    Parameters
    ----------
    structure
        Structure whose loss matrix is replaced; viscous damping stays.
    loss_factor
        η, twice the damping ratio at resonance. For parts of different materials call the function once for each, then `join`.
    elastic
        (n, n) stiffness that dissipates, N/m; by default the structure's stiffness. For a rotating structure give the
        stiffness at rest: neither centrifugal tension nor spin softening dissipates.

    Raises
    ------
    InputError
        If the loss factor is negative or `elastic` has another size.
    """
    if not 0 <= loss_factor < math.inf:
        raise input_error(
            "structural_damping: loss_factor", f"must not be negative, got {loss_factor}", "Metals: 1e-4 to 1e-2."
        )
    source = structure.stiffness if elastic is None else elastic
    if source.shape != structure.stiffness.shape:
        raise input_error(
            "structural_damping: elastic",
            f"has shape {source.shape} for {structure.n} dofs",
            "Give the stiffness in the coordinates of the structure.",
        )
    return replace(structure, loss=loss_factor * source)


def dissipates(structure: Structure) -> bool:
    """Whether a structure has damping, apart from Coriolis terms."""
    own = structure.damping
    symmetric = (own + own.conj().T) / 2
    return structure.loss is not None or bool(structure.n and abs(symmetric).max() > ROUNDING * abs(own).max())


def _with_dissipation(structure: Structure, damping: Matrix) -> Structure:
    """Return the structure with `damping` in place of its dissipation; Coriolis terms stay."""
    own = structure.damping
    skew = (own - own.conj().T) / 2
    if structure.n and abs(skew).max() > ROUNDING * abs(own).max():
        damping = damping + skew
    if scipy.sparse.issparse(structure.stiffness) and not scipy.sparse.issparse(damping):
        damping = scipy.sparse.csr_array(damping)
    return structure.with_damping(damping)
