"""Branch switching: the directions of a crossing branch, and its first point."""

import numpy as np
import scipy.linalg

from stickslip.arrays import FloatArray, IntArray
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.solve.branch import Following, Point, measure_at, reversed_point
from stickslip.solve.steps import take_step

AWAY = (
    0.05,
    0.1,
    0.2,
    0.02,
    0.4,
    0.01,
    0.003,
    0.001,
)  # of the size of the motion: how far along the new branch its first point is looked for
ROUNDS = 6  # of inverse iteration: singular values are far apart where one is nearly zero
BESIDE = 1e-12  # of the largest entry: what keeps a singular matrix from being divided by


def open_directions(balance: HarmonicBalance, point: Point, following: Following, count: int) -> FloatArray:
    """Return the (count, n + 1) directions across the branch along which equations change least, those of its crossing branches.

    They are singular vectors of the Jacobian with the tangent of the branch as a further row, those of the smallest singular values, by
    inverse iteration.
    """
    at = balance.linearise(point.x, point.p)
    jac = at.dense_jac()
    measure = measure_at(point.x, following)
    scale = np.append(np.full(point.x.size, np.max(measure.weights[:-1])), measure.p)
    row = measure.row(point.tangent / measure.of(point.tangent)) / scale
    matrix = np.vstack([np.column_stack([jac, at.jac_p]) / scale, row * np.max(np.abs(jac)) / scale[0]])
    matrix += BESIDE * np.max(np.abs(matrix)) * np.eye(len(matrix))
    factors = scipy.linalg.lu_factor(matrix)
    block = np.random.default_rng(0).standard_normal((len(matrix), count + 1))
    for _ in range(ROUNDS):
        block = np.linalg.qr(block)[0]
        block = scipy.linalg.lu_solve(factors, scipy.linalg.lu_solve(factors, block, trans=1))
    basis = np.linalg.qr(block)[0]
    turned = np.linalg.svd(matrix @ basis)[2]
    smallest = basis @ turned[::-1][:count].T
    return np.asarray(smallest.T / scale)


def candidates(directions: FloatArray, balance: HarmonicBalance, group: IntArray | None) -> list[FloatArray]:
    """Return the directions in which branches are looked for: each both ways, and combinations of several.

    Where a wheel loses its symmetry by waves of both directions at once, two directions are open and every combination solves the linear
    equations. Those symmetric about a sector, or about the middle between two, belong to branches: where the first sector (of what is no
    wheel, the first coordinate) moves most, where it moves least, and halfway between.
    """
    found = list(directions)
    if len(directions) > 1:
        own = np.arange(balance.linear.n) == 0 if group is None else group == group[0]
        part = directions[:, np.append(np.tile(own, balance.n_rows), False)]
        vectors = np.linalg.eigh(part @ part.T)[1]
        most, least = vectors[:, -1] @ directions, vectors[:, 0] @ directions
        found = [most, least, most + least]
    return [sign * direction for direction in found for sign in (1.0, -1.0)]


def first_point(
    balance: HarmonicBalance, point: Point, direction: FloatArray, following: Following, end: float
) -> Point | None:
    """Return a point of the branch that leaves in a direction, its tangent leading away from the other one; None where none is found."""
    measure = measure_at(point.x, following)
    unit = direction / measure.of(direction)
    for away in AWAY:
        found = take_step(balance, point, unit, away, end, following)
        if found.solution.status.converged:
            leads_away = measure.row(found.y - point.y) @ found.tangent >= 0.0
            return found if leads_away else reversed_point(found)
    return None
