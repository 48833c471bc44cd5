"""State-space eigenvectors of an interior with any damping, in modes of unit stiffness (Krack et al. 2017, app. 5)."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.model.blas_threads import threads_for

# condition number of an eigenvalue above which rounding could reach 1e-10 of a receptance
ILL_CONDITIONED = 1e4


@dataclass(frozen=True, eq=False)
class StateSpace:
    """State-space eigenvectors of the interior: ``D_LL⁻¹ = forward diag(1 / (1 - p ν)) backward``."""

    nu: ComplexArray  # (J,) s, inverse poles
    forward: ComplexArray  # (l, J)
    backward: ComplexArray  # (J, l)

    def solve(self, p: complex, right: ComplexArray) -> ComplexArray:
        """Return ``D_LL⁻¹ right`` for `right` (l,) or (l, k)."""
        weight = 1.0 / (1.0 - p * self.nu)
        amplitudes = self.backward @ right
        amplitudes *= weight if right.ndim == 1 else weight[:, None]
        return np.asarray(self.forward @ amplitudes)

    def solve_transposed(self, p: complex, right: ComplexArray) -> ComplexArray:
        """Return ``D_LL⁻ᵀ right`` for `right` (l, k)."""
        amplitudes = (self.forward.T @ right) / (1.0 - p * self.nu)[:, None]
        return np.asarray(self.backward.T @ amplitudes)


def state_space(damping: FloatArray, mass: FloatArray) -> StateSpace | None:
    """Return the eigenvectors of ``ν² + ν C + M`` with diagonal M.

    Parameters
    ----------
    damping
        (l, l) C in coordinates of unit stiffness.
    mass
        (l,) M, not negative.

    Returns
    -------
    StateSpace or None
        None if eigenvectors are so nearly parallel that the sum over them would be less accurate than a factorisation.
    """
    n = mass.size
    root = np.diag(np.sqrt(np.maximum(mass, 0.0)))
    # displacement and root times displacement over ν: normal if C = 0, whatever the spread of frequencies
    state = np.block([[-damping, -root], [root, np.zeros((n, n))]])
    with threads_for(2 * n):
        nu, vectors = np.linalg.eig(state)
    try:
        inverse = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        return None
    condition = np.linalg.norm(inverse, axis=1) * np.linalg.norm(vectors, axis=0)
    if not np.max(condition) <= ILL_CONDITIONED:
        return None
    return StateSpace(nu.astype(complex), vectors[:n].astype(complex), inverse[:, :n].astype(complex))
