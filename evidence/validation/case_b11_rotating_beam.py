"""B11: a rotating cantilever, Euler-Bernoulli, flap and lag, by beam elements.

The table was made with 120 elements, as here. Its lag is off the relation lag² = flap² - speed² by up to two units of the last digit.
"""

import numpy as np

from evidence.validation.compare import Record, record
from stickslip.model.fe.beam import Beam, rotating_beam
from stickslip.model.fe.solid import Material
from stickslip.model.modes import natural_frequencies

SOURCE = "literature benchmark B11"
CASE = "B11 rotating cantilever"
UNIT = Beam(1.0, 1.0, 1.0, Material(young_modulus=1.0, poisson_ratio=0.0, density=1.0))
ELEMENTS = 120
LAST_DIGIT = 1e-6  # absolute; lag: twice
TABLE = (  # hub radius, speed, flap 1, flap 2, flap 3, lag 1; 0: not in the table
    (0, 0, 3.516015, 22.034491, 61.697215, 3.516015),
    (0, 1, 3.681647, 22.181011, 61.841763, 3.543236),
    (0, 2, 4.137319, 22.614922, 62.273185, 3.621796),
    (0, 3, 4.797278, 23.320264, 62.984968, 3.743511),
    (0, 4, 5.585002, 24.273350, 63.966761, 3.897723),
    (0, 5, 6.449545, 25.446080, 65.205041, 4.073896),
    (0, 10, 11.202328, 33.640366, 74.649295, 5.048974),
    (1, 1, 3.888823, 22.375014, 0, 3.758050),
    (1, 2, 4.833689, 23.366042, 0, 4.400516),
    (1, 3, 6.081750, 24.927745, 0, 5.290338),
    (1, 4, 7.475048, 26.957262, 0, 6.314771),
    (1, 5, 8.940358, 29.352835, 0, 7.411477),
    (1, 10, 16.606363, 44.368224, 0, 13.257876),
    (2, 1, 4.085336, 0, 0, 0),
    (2, 2, 5.439948, 0, 0, 0),
    (2, 3, 7.133713, 0, 0, 0),
    (2, 4, 8.966379, 0, 0, 0),
    (2, 5, 10.861596, 0, 0, 0),
    (2, 10, 20.611190, 0, 0, 0),
)


def run() -> list[Record]:
    """Compare dimensionless frequencies with the table."""
    records = []
    for hub, speed, *flap, lag in TABLE:
        out, within = (
            2 * np.pi * natural_frequencies(rotating_beam(UNIT, ELEMENTS, speed, hub_radius=hub, bending=d), 3)
            for d in ("z", "y")
        )
        rows = [(f"flap {i + 1}", out[i], theirs, 1) for i, theirs in enumerate(flap)]
        for name, ours, theirs, units in [*rows, ("lag 1", within[0], lag, 2)]:
            if theirs:
                quantity = f"{name}, hub {hub}, speed {speed}, dimensionless"
                tolerance = units * LAST_DIGIT / theirs
                records.append(record(CASE, quantity, ours, theirs, tolerance, SOURCE))
    return records
