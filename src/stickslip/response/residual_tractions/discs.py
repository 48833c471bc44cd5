"""Admissible slider positions of a planar contact: the intersection of the discs of all instants.

In units of force the slider is at ``z = K s``, and rests while ``|K x(t) - z| <= μN(t)``.
"""

import numpy as np

from stickslip.arrays import FloatArray

CENTRING = 200  # steps to a place deep in all discs
RAYS = 720  # on which the edge is looked for
CLOSER = 2  # times that the best ray is looked at with rays a hundredth as far apart


def in_all_discs(centres: FloatArray, radii: FloatArray) -> tuple[FloatArray, float]:
    """Return a place (2,) deep inside all discs of `centres` (2, n) and `radii` (n,), and its distance from the nearest edge."""
    at = centres.mean(axis=1)
    best, depth = at, -np.inf
    for step in range(CENTRING):
        away = at[:, None] - centres
        inside = radii - np.hypot(*away)
        worst = int(np.argmin(inside))
        if inside[worst] > depth:
            best, depth = at, float(inside[worst])
        way = -away[:, worst] / max(float(np.hypot(*away[:, worst])), 1e-300)
        at = at + way * float(np.ptp(inside)) / (step + 2.0)
    return best, depth


def farthest_in_discs(inside: FloatArray, centres: FloatArray, radii: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the place (2,) in all discs at which ``slope · z`` is largest.

    Parameters
    ----------
    inside
        (2,) a place in all of them.
    centres, radii
        (2, n) and (n,) of the discs.
    slope
        (2,) not zero.
    """
    away = inside[:, None] - centres
    room = radii**2 - np.sum(away**2, axis=0)
    middle, width = float(np.arctan2(slope[1], slope[0])), np.pi
    best = inside
    for _ in range(1 + CLOSER):
        angles = middle + np.linspace(-width, width, RAYS)
        rays = np.stack([np.cos(angles), np.sin(angles)])
        along = rays.T @ away
        length = np.min(np.sqrt(along**2 + room) - along, axis=1)
        ends = inside[:, None] + length * rays
        top = int(np.argmax(slope @ ends))
        best, middle, width = ends[:, top], float(angles[top]), 0.01 * width
    return np.asarray(best)
