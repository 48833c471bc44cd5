"""B5: two masses, one of which rubs on the ground with set-valued Coulomb friction, by the dynamic Lagrangian method.

A friction force that jumps has Fourier coefficients that fall as 1/h, so that any Fourier series finds the instant of the jump, and with it
the first harmonic, to first order in 1/H. Without sticking the error is a clean power series in 1/H, and three orders extrapolate to what
the source has printed. With sticking, the instants at which it ends spoil the series: those motions are compared as they come, with the
error that first order leaves at the H given, and the order itself is a record.
"""

import numpy as np

from evidence.validation.compare import Record, record
from evidence.validation.rigid import RigidMotion, Rubbing, extrapolated, growing
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.matrices import lumped

SOURCE = "literature benchmark B5"
CASE = "B5 set-valued Coulomb friction"
ORDERS = (16, 32, 64, 128, 256)
STICKING_ORDERS = (*ORDERS, 512)
HARMONICS = (1, 3, 5, 7)
PRINTED = 1e-5  # to which the source's harmonics are good
HALF_UNIT = 5e-7  # of the last digit printed
# W, share of sticking, |X_h| of both dofs, h = 1, 3, 5, 7
TABLE = (
    (0.4, 0.13680, ((22.318648, 27.965463), (2.558854, 1.437799), (0.337546, 0.675092), (0.026485, 0.154459))),
    (0.55, 0.0, ((54.359118, 80.780423), (10.840481, 7.860580), (0.058159, 0.323086), (0.008383, 0.107186))),
    (1.0, 0.0, ((10.612322, 15.277103), (0.062598, 0.437462), (0.003762, 0.086097), (0.000660, 0.030707))),
    (1.5, 0.0, ((35.664777, 26.786093), (0.009852, 0.179086), (0.000696, 0.037345), (0.000127, 0.013487))),
    (2.0, 0.36710, ((10.048455, 0.302843), (0.001502, 0.050709), (0.000065, 0.006232), (0.000017, 0.003172))),
)
STICKING = 5e-4  # relative error of the largest harmonics that first order leaves at H = 512
STICKING_SHARE = 2e-3  # of the period: a few samples of a layer of width 1/H


def two_masses(penalty: float | None = None) -> Rubbing:
    """Return the system of the benchmark."""
    structure = lumped(np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]]), np.array([[0.04, -0.02], [-0.02, 0.02]]))
    load = HarmonicLoad(np.zeros(2), {1: np.array([20.0 + 0j, 0.0])})
    return Rubbing(structure, load, 1, 0.9 * 9.0, penalty)


def amplitudes(motion: RigidMotion) -> np.ndarray:
    """Return |X_h| of both dofs for the harmonics of the table."""
    return np.abs(motion.harmonics[list(HARMONICS)])


def order_of_error(motions: list[RigidMotion], exact: float) -> float:
    """Return the exponent with which the error of |X_1| of the rubbing mass falls."""
    errors = [abs(amplitudes(m)[0, 1] - exact) for m in motions]
    return float(-np.polyfit(np.log([m.order for m in motions]), np.log(errors), 1)[0])


def run() -> list[Record]:
    """Compare the harmonics at every frequency of the table."""
    records = []
    for omega, stick, rows in TABLE:
        slides = stick == 0.0
        orders = ORDERS if slides else STICKING_ORDERS
        motions = growing(two_masses(), omega, orders)
        last = [amplitudes(m) for m in motions]
        ours = extrapolated(last[-3:]) if slides else last[-1]
        how = "extrapolated from H = 64, 128, 256" if slides else f"H = {orders[-1]}"
        for h, row, values in zip(HARMONICS, rows, ours, strict=True):
            for dof, (reference, value) in enumerate(zip(row, values, strict=True)):
                tolerance = max(PRINTED, HALF_UNIT / reference)
                if not slides:
                    tolerance = max(STICKING, HALF_UNIT / reference)
                name = f"|X{h}| of dof {dof + 1} at W = {omega:g}, {how}"
                records.append(record(CASE, name, value, reference, tolerance, SOURCE))
        if not slides:
            share = motions[-1].stick - stick
            records.append(
                record(
                    CASE,
                    f"share of sticking at W = {omega:g} less {stick:g}, {how}",
                    share,
                    0.0,
                    STICKING_SHARE,
                    SOURCE,
                )
            )
        exact = rows[0][1]
        records.append(
            record(
                CASE,
                f"order in 1/H of the error of |X1| of dof 2 at W = {omega:g}",
                order_of_error(motions, exact),
                1.0,
                0.05 if slides else 0.7,
                "a force that jumps",
            )
        )
    return records
