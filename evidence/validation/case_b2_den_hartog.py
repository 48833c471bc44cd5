"""B2: Den Hartog's mass with rigid Coulomb friction, by the dynamic Lagrangian method.

Amplitudes and harmonics of the motions without sticking are extrapolated from H = 63, 127 and 255 (see B5); at b = 0.5 from 127, 255
and 511, because 63 to 255 leave 1.7e-5 of the third harmonic, of whose printed digits rounding leaves 7.4e-5 and takes 5.7e-5. With one harmonic and a penalty
beyond all stiffnesses the friction force is the sign of the velocity, and the closed form of one harmonic follows.

At b = 0.5 the source also prints the largest displacement, 1.46697. Twice the excitation frequency is then the natural frequency of the
undamped mass: its motion holds a free vibration of frequency 2W (0.1346 in an integration from rest, 1.3333 of odd harmonics beside it)
that no friction ends, because it never turns the velocity round, and that depends on the start. The odd harmonics do not, and are compared,
also with their closed form: with twice the excitation frequency natural, half a period of the motion without that free vibration is
``r - r cos 2τ + 4/3 cos τ`` in ``τ = Wt``, from one turning point to the next.
"""

import numpy as np

from evidence.validation.compare import Record, record
from evidence.validation.rigid import RigidMotion, Rubbing, extrapolated, growing
from stickslip.arrays import FloatArray
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped
from stickslip.solve.newton_method import Newton, newton

SOURCE = "literature benchmark B2"
CASE = "B2 Den Hartog"
ORDERS = (7, 15, 31, 63, 127, 255)
HALF = 0.5  # b at which twice the excitation frequency is natural
TOLERANCE = 1e-5
SAMPLES_OF_SIGN = 2**18  # of a force that jumps between samples
HALF_UNIT = 5e-6  # of the last digit printed at b = 0.5
TABLE = (
    (0.7, 0.3, 1.8856998504),
    (0.8, 0.4, 2.5017878810),
    (0.9, 0.5, 4.2159037168),
    (1.1, 0.5, 3.5610501056),
    (1.2, 0.5, 1.6574674711),
    (1.5, 0.3, 0.7211102551),
    (2.0, 0.2, 0.3179797338),
)
HARMONICS = (
    (0.9, 0.5, 4.22064112, 0.03373714),
    (1.2, 0.5, 1.66099265, 0.01774303),
    (0.7, 0.3, 1.89752959, 0.03733840),
    (0.5, 0.2, 1.37588, 0.06791),
)


def mass_on_spring(limit: float, penalty: float | None = None) -> Rubbing:
    """Return the undamped mass with m = k = P = 1."""
    load = HarmonicLoad(np.zeros(1), {1: np.array([1.0 + 0j])})
    return Rubbing(lumped(np.eye(1), np.eye(1)), load, 0, limit, penalty)


def largest(motion: RigidMotion) -> float:
    """Return the largest displacement: the one at which the velocity turns round, of a series cut at H."""
    t = np.linspace(0.0, 2.0 * np.pi, 1 + 32 * motion.order)
    h = np.arange(motion.harmonics.shape[0])
    return float(np.max(np.real(np.exp(1j * np.outer(t, h)) @ motion.harmonics[:, 0])))


def one_harmonic(b: float, r: float) -> float:
    """Return |X1| with one harmonic and a penalty of a million stiffnesses."""
    problem = mass_on_spring(r, penalty=1e6).problem(1, SAMPLES_OF_SIGN)
    start = np.sqrt(1 - (4 * r / np.pi) ** 2) / abs(1 - b**2) * np.exp(-0.5j)
    solution = newton(
        lambda v: problem.linearise(v, b),
        problem.unknowns(np.array([[0.0], [start]])),
        Newton(max_iterations=60, tolerance=1e-9),
    )
    if not solution.status.converged:
        raise RuntimeError(f"b = {b}: {solution.status.advice}")
    return float(abs(problem.coefficients(solution.x)[1, 0]))


def half_harmonic(r: float, h: int) -> float:
    """Return |X_h| k/P of the closed form at b = 0.5, of odd `h`."""
    cosine = 4 / 3 if h == 1 else 0.0
    return float(np.hypot(cosine, 2 * r / np.pi * (2 / h - 1 / (h + 2) - 1 / (h - 2))))


def limits(motions: list[RigidMotion]) -> FloatArray:
    """Return the extrapolated largest displacement, |X1| and |X3|.

    The orders are one less than powers of two; the series is in 1/(H+1).
    """
    return extrapolated([np.array([largest(m), abs(m.harmonics[1, 0]), abs(m.harmonics[3, 0])]) for m in motions[-3:]])


def run() -> list[Record]:
    """Compare amplitudes, harmonics and the closed form of one harmonic."""
    records = []
    for b, r, x0 in TABLE:
        found = limits(growing(mass_on_spring(r), b, ORDERS))
        records.append(record(CASE, f"x0 k/P at b = {b:g}, r = {r:g}", found[0], x0, TOLERANCE, SOURCE))
        formula = np.sqrt(1 - (4 * r / np.pi) ** 2) / abs(1 - b**2)
        records.append(
            record(CASE, f"|X1| k/P at b = {b:g}, r = {r:g}, H = 1", one_harmonic(b, r), formula, 1e-5, "closed form")
        )
    for b, r, x1, x3 in HARMONICS:
        orders = (*ORDERS, 511) if b == HALF else ORDERS
        found = limits(growing(mass_on_spring(r), b, orders))
        for h, value, reference in ((1, found[1], x1), (3, found[2], x3)):
            tolerance = max(TOLERANCE, HALF_UNIT / reference) if b == HALF else TOLERANCE
            name = f"|X{h}| k/P at b = {b:g}, r = {r:g}"
            records.append(record(CASE, name, value, reference, tolerance, SOURCE))
            if b == HALF:
                exact = half_harmonic(r, h)
                records.append(record(CASE, name, value, exact, TOLERANCE, "closed form"))
    return records
