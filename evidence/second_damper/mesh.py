"""Whether mesh and fixed-interface modes are fine enough for the second bending mode."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as sl

from evidence.models.two_blades import COARSER, SHIPPED, SIZES, two_blades
from evidence.second_damper.search import Candidate
from stickslip.study.models.study import read_study
from stickslip.units import HZ

FACTORS = (COARSER, 1.0, 0.75)  # on the element sizes of the example
FIRST = 250.0  # Hz: above the first bending
BENDING = 0.9  # share of the motion along the circumference


@dataclass(frozen=True)
class Refined:
    """The second bending of the free blades, not reduced, on a mesh.

    Attributes
    ----------
    factor
        On the element sizes of the example.
    dofs
        Of both blades.
    """

    factor: float
    dofs: int
    hertz: float


def refined(candidate: Candidate, factor: float) -> Refined:
    """Find the lowest mode above the first bending that moves along the circumference."""
    values = {k: list(v) if isinstance(v, tuple) else v for k, v in candidate.values.items()}
    study = read_study(SHIPPED)
    known = study.file.raw["part"]["blades"]
    sizes = {f"part.blades.{k}": factor * known[k] for k in SIZES}
    blades = study.replace(values | sizes).model(0).parts["blades"].structure
    stiffness, mass = (sp.csc_array(m) for m in (blades.stiffness, blades.mass))
    squares, shapes = sl.eigsh(stiffness, 6, M=mass, sigma=(HZ * FIRST) ** 2)
    order = np.argsort(squares)
    for k in order:
        hertz = float(np.sqrt(squares[k]) / HZ)
        moved = np.sum(shapes[:, k].reshape(-1, 3) ** 2, axis=0)
        if hertz > FIRST and moved[0] > BENDING * moved.sum():
            return Refined(factor, blades.n, hertz)
    raise RuntimeError(f"no bending mode among the six nearest to {FIRST} Hz")


def reduction_error(candidate: Candidate) -> float:
    """Return the largest error of the reduced frequencies up to the second bending, free and stuck, a fraction."""
    known = two_blades(COARSER, SHIPPED, **candidate.values).question.model.frequencies
    errors = [
        np.abs(reduced / full - 1)[: np.sum(full < 700.0)].max()
        for full, reduced in ((known.free_full, known.free_reduced), (known.stuck_full, known.stuck_reduced))
    ]
    return float(max(errors))
