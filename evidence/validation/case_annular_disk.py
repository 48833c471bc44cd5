"""A thin annular disk, clamped at the bore, from one of its sectors: plate theory, and the number of sectors.

Kirchhoff's plate has the deflection A J_n + B Y_n + C I_n + D K_n of the radius; the clamped bore and the free rim give the
frequencies. A solid comes near it as the thickness falls: it differs by terms of first order (layer at the free edge, none for
n = 0) and second order (shear, rotatory inertia), which three thicknesses of ratio 2 eliminate. Poisson's ratio is 0, because
clamping a thick edge hinders a lateral contraction that the plate does not know.
"""

import itertools
from functools import lru_cache

import numpy as np
from scipy import optimize, special

from evidence.models.annulus import annular_sector
from evidence.validation.compare import Record, record
from stickslip.arrays import FloatArray
from stickslip.model.fe.elements import Quadrature
from stickslip.model.fe.solid import Material, assemble_solid
from stickslip.model.modes import natural_frequencies
from stickslip.reduction.cyclic import cyclic_sector, travelling_wave

CASE = "annular disk"
INNER, OUTER = 0.1, 0.2  # m
MATERIAL = Material(poisson_ratio=0.0)
BESSEL = (special.jvp, special.yvp, special.ivp, special.kvp)
THICKNESSES = (0.004, 0.002, 0.001)  # m
# 32 elements along the radius leave 1e-5, by comparison with 16; the rule of C3D20R does not lock
DIVISIONS, RULE = (32, 4, 1), Quadrature(stiffness=3, mass=4)
N_MODES = 2


def boundary_determinant(root: float, n: int) -> float:
    """Return the determinant of the boundary conditions for r from 1/2 (clamped) to 1 (free), Poisson's ratio 0."""

    def terms(radius: float, order: int) -> FloatArray:
        return np.array([root**order * f(n, root * radius, order) for f in BESSEL])

    value, slope, bend, third = (terms(1.0, order) for order in range(4))
    rows = [
        terms(INNER / OUTER, 0),
        terms(INNER / OUTER, 1),
        bend,
        third + bend - (1 + 2 * n**2) * slope + 3 * n**2 * value,
    ]
    matrix = np.array(rows)
    return float(np.linalg.det(matrix / np.abs(matrix).max(axis=0)))


@lru_cache
def plate_roots(n: int) -> tuple[float, ...]:
    """Return the lowest roots of the boundary determinant for n nodal diameters."""
    grid = np.linspace(1.0, 15.0, 400)
    values = [boundary_determinant(x, n) for x in grid]
    brackets = [i for i in range(len(grid) - 1) if values[i] * values[i + 1] < 0][:N_MODES]
    return tuple(
        float(optimize.brentq(boundary_determinant, grid[i], grid[i + 1], args=(n,), xtol=1e-13)) for i in brackets
    )


def plate_frequencies(n: int, thickness: float) -> FloatArray:
    """Return the frequencies of the plate in Hz."""
    speed = np.sqrt(MATERIAL.young_modulus * thickness**2 / (12 * MATERIAL.density))
    return np.asarray(np.array(plate_roots(n)) ** 2 * speed / OUTER**2 / (2 * np.pi))


def solid_frequencies(
    thickness: float, sectors: int, divisions: tuple[int, int, int], wave_number: int, n_modes: int = N_MODES
) -> FloatArray:
    """Return the frequencies in Hz of the solid disk for a wave number, from one sector."""
    mesh = annular_sector(INNER, OUTER, thickness, sectors=sectors, divisions=divisions)
    sector = cyclic_sector(assemble_solid(mesh, MATERIAL, quadrature=RULE), sectors)
    return natural_frequencies(travelling_wave(sector, wave_number), n_modes)


def run() -> list[Record]:
    """Compare the limit of small thickness with the plate, and cuts into 6, 12, 24 sectors with each other."""
    records = []
    for n in range(4):
        ratio = [solid_frequencies(h, 24, DIVISIONS, n) / plate_frequencies(n, h) for h in THICKNESSES]
        once = [2 * fine - coarse for coarse, fine in itertools.pairwise(ratio)]
        limit = (4 * once[1] - once[0]) / 3
        for mode in range(N_MODES):
            records += [
                record(
                    CASE,
                    f"frequency over that of the plate, nodal diameter {n}, mode {mode + 1}, thickness 1/200 of the radius",
                    ratio[-1][mode],
                    1.0,
                    2e-3,
                    "Kirchhoff's plate, by Bessel functions",
                ),
                record(
                    CASE,
                    f"the same, extrapolated to no thickness, nodal diameter {n}, mode {mode + 1}",
                    limit[mode],
                    1.0,
                    2e-4,
                    "Kirchhoff's plate, by Bessel functions",
                ),
            ]
    return records + [r for wave_number in range(4) for r in cuts(wave_number)]


def cuts(wave_number: int) -> list[Record]:
    """Compare the disk cut in 6 sectors with finer cuts: their waves k, k + 6, k + 12 ... are its wave k."""
    whole = solid_frequencies(0.004, 6, (8, 8, 1), wave_number, n_modes=8)
    records = []
    for sectors, around in ((12, 4), (24, 2)):
        waves = range(wave_number, sectors, 6)
        parts = [solid_frequencies(0.004, sectors, (8, around, 1), k, n_modes=8) for k in waves]
        union = np.sort(np.concatenate(parts))[: len(whole)]
        worst = int(np.argmax(np.abs(union / whole - 1)))
        records.append(
            record(
                CASE,
                f"wave number {wave_number} of 6 sectors from a cut in {sectors}, mode {worst + 1} (the worst of 8), Hz",
                union[worst],
                whole[worst],
                1e-9,
                "the same mesh, cut otherwise",
            )
        )
    return records
