"""The elementary contact: a normal spring with two independent Jenkins springs (Gastaldi & Berruti 2017, section 5.1).

Its row of parameters is ``k_t, k_w, k_n, mu, preload, residual_traction, unilateral``. With ``unilateral = 1`` the
normal force is ``N = max(0, preload - k_n g_n)`` and limits each tangential spring to ``mu N``. With ``unilateral = 0``
the limit is the constant ``mu preload``, and the normal spring ``k_n g_n`` acts in both directions.
``residual_traction = m`` sets the tangential force just before t = 0 to ``m mu N``; with NaN the spring is unstretched
at zero displacement.
"""

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.law import kernel_in

ROUND_OFF = 4e-16
K_T, K_W, K_N, MU, PRELOAD, RESIDUAL, UNILATERAL = range(7)


def element(
    *,
    k_t: float = 0.0,
    k_w: float = 0.0,
    k_n: float = 0.0,
    mu: float = 0.0,
    preload: float = 0.0,
    residual_traction: float | None = None,
    unilateral: bool = True,
) -> FloatArray:
    """Return the (7,) row of an elementary contact."""
    m = np.nan if residual_traction is None else residual_traction
    return np.array([k_t, k_w, k_n, mu, preload, m, float(unilateral)])


element_step = kernel_in("element")


def slider_start(residual_traction: float | None, slider: tuple[float, float] | None = None) -> FloatArray:
    """Return the (2,) slider positions before t = 0: `slider`, or zero without one; NaN if a residual traction is given."""
    if residual_traction is not None:
        return np.full(2, np.nan)
    return np.zeros(2) if slider is None else np.array(slider)
