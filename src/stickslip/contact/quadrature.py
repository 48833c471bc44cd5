"""Quadrature on triangles: symmetric rules with positive weights and inner points (Dunavant 1985; Strang & Fix 1973)."""

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error

# degree -> orbits (weight, barycentric coordinates); an orbit holds all permutations
_ORBITS: dict[int, tuple[tuple[float, tuple[float, float, float]], ...]] = {
    1: ((1.0, (1 / 3, 1 / 3, 1 / 3)),),
    2: ((1 / 3, (2 / 3, 1 / 6, 1 / 6)),),
    4: (
        (0.223381589678011, (0.108103018168070, 0.445948490915965, 0.445948490915965)),
        (0.109951743655322, (0.816847572980459, 0.091576213509771, 0.091576213509771)),
    ),
    5: (
        (0.225, (1 / 3, 1 / 3, 1 / 3)),
        ((155 + 15**0.5) / 1200, ((9 - 2 * 15**0.5) / 21, (6 + 15**0.5) / 21, (6 + 15**0.5) / 21)),
        ((155 - 15**0.5) / 1200, ((9 + 2 * 15**0.5) / 21, (6 - 15**0.5) / 21, (6 - 15**0.5) / 21)),
    ),
    6: (
        (0.116786275726379, (0.501426509658179, 0.249286745170910, 0.249286745170910)),
        (0.050844906370207, (0.873821971016996, 0.063089014491502, 0.063089014491502)),
        (0.082851075618374, (0.636502499121399, 0.310352451033785, 0.053145049844816)),
    ),
}
HIGHEST_DEGREE = max(_ORBITS)


def triangle_rule(degree: int) -> tuple[FloatArray, FloatArray]:
    """Return barycentric points (n, 3) and weights (n,) with sum 1, exact for polynomials up to `degree`.

    Raises
    ------
    InputError
        If no rule of that degree is known.
    """
    if not 1 <= degree <= HIGHEST_DEGREE:
        raise input_error(
            "degree of the quadrature",
            f"must lie between 1 and {HIGHEST_DEGREE}, got {degree}",
            "Products of quadratic shape functions on triangles have degree 4, on quadrilaterals 6.",
        )
    orbits = _ORBITS[min(known for known in _ORBITS if known >= degree)]
    points: list[tuple[float, ...]] = []
    weights: list[float] = []
    for weight, (a, b, c) in orbits:
        orbit = sorted({(a, b, c), (b, c, a), (c, a, b), (a, c, b), (c, b, a), (b, a, c)})
        points += orbit
        weights += [weight] * len(orbit)
    return np.array(points), np.array(weights)
