"""Reference amplitudes for amplification and localisation of a mistuned wheel."""

import numpy as np

from stickslip.arrays import FloatArray

BOUND = "Whitehead's (1 + √n)/2, a bound for one family of modes, equal damping of all waves and no friction only,"


def whitehead(blades: int) -> float:
    """Return Whitehead's (1 + √n)/2: largest amplification of one family of modes with equal damping in all waves, without friction."""
    return 0.5 * (1.0 + float(np.sqrt(blades)))


def localisation(amplitudes: FloatArray) -> float:
    """Return the localisation factor of amplitudes (n,): 0 if all are equal, 1 if a single blade moves."""
    largest = float(np.max(amplitudes))
    others = np.delete(amplitudes, int(np.argmax(amplitudes)))
    if not largest or not others.size:
        return 0.0
    return float(1.0 - np.sqrt(np.mean(others**2)) / largest)
