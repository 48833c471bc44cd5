"""Bound of the frequencies at which contacts can make modes grow: the harmonics that a disturbance needs.

A mode that rings above all harmonics that are solved acts on the others by its receptance alone. Contacts that change its stiffness while it
rings may feed it, which no count of the others shows.
"""

from collections.abc import Sequence

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.slider import PERIOD
from stickslip.response.stability.contact_tangent import ContactTangent
from stickslip.response.stability.hill_modes import HillModes, HillSide

TOGETHER = 2.0  # times what changes of stiffness do to a mode alone: for what modes do together
LET_GO = 0.1  # of its mean: a mode whose stiffness falls below is carried away by what is left, however it is damped


def reach(side: HillSide, tangents: Sequence[ContactTangent]) -> float:
    """Return the highest frequency, over that of the motion, at which a mode rings that contacts may make grow; 0 where there is none."""
    if not tangents:
        return 0.0
    tops = (_top(side.modes(wave, 0), tangents) for wave in range(side.waves // 2 + 1))
    return max(tops)


def _top(modes: HillModes, tangents: Sequence[ContactTangent]) -> float:
    """Return that of the modes of one wave.

    The amplitude of a fast mode grows at a sudden change of its stiffness by at most the root of the ratio of its frequencies before and
    after, at the phase that is worst, and decays by its damping. A mode for which the sum over the period is negative cannot grow.
    """
    share = _relative(modes, tangents)
    own = np.log(np.maximum(1.0 + share, LET_GO))
    jumps = 0.25 * np.sum(np.abs(own - np.roll(own, 1, axis=0)), axis=0)
    damping = np.real(modes.damping if modes.damping.ndim == 1 else np.diagonal(modes.damping))
    damping = damping - np.sum(np.abs(modes.springs) ** 2, axis=0)
    ratios = modes.ratios
    loss = np.real(modes.loss if modes.loss.ndim == 1 else np.diagonal(modes.loss))
    with np.errstate(divide="ignore", invalid="ignore"):
        decay = 0.5 * PERIOD * (damping + loss / ratios) / modes.mass
    held = np.min(share, axis=0) > LET_GO - 1.0
    grows = np.isfinite(ratios) & ~(held & (TOGETHER * jumps < decay))
    highest = ratios * np.sqrt(np.maximum(1.0 + np.max(share, axis=0), 0.0))
    return float(np.max(highest[grows], initial=0.0))


def _relative(modes: HillModes, tangents: Sequence[ContactTangent]) -> FloatArray:
    """Return the (n_intervals, n) change of the stiffness of each mode by the contacts, over its mean."""
    total = np.zeros((len(tangents[0].times) - 1, modes.mass.size))
    for tangent in tangents:
        ports = modes.ports[tangent.ports]
        forces = np.tensordot(tangent.changes, ports, axes=1)
        total += np.real(np.einsum("pj,ipj->ij", ports.conj(), forces))
    return np.asarray(total / modes.stiffness)
