"""Forces and states of a planar contact on samples, from its stored course."""

import numpy as np

from stickslip.contact.cache import njit
from stickslip.contact.law import STICK
from stickslip.contact.planar.motion import place
from stickslip.contact.planar.radau import CROWDED, INNER, NEARLY, POWER
from stickslip.contact.planar.slip import interpolated
from stickslip.contact.planar.trajectory import (
    COUNT,
    END,
    FIRST,
    PIECE_ANGLE,
    PIECE_KIND,
    PIECE_START,
    PIECE_WIDTH,
    PLACE_X,
    PLACE_Y,
    START,
    STATE,
)
from stickslip.contact.slider import PERIOD


@njit(**INNER)
def sample_plane(course, gap, k, force, state):  # type: ignore[no-untyped-def]
    """Fill the force in the plane and the states where the contact is closed."""
    n = gap.shape[1]
    if n == 0:
        return
    step = PERIOD / n
    for s in range(course.counts[0]):
        segment = course.segments[s]
        now = int(segment[STATE])
        piece = int(segment[FIRST])
        last = piece + int(segment[COUNT]) - 1
        i = int(np.ceil(segment[START] / step))
        while i * step < segment[END]:
            at = i % n
            if now == STICK:
                force[0, at] = k * gap[0, at] - segment[PLACE_X]
                force[1, at] = k * gap[1, at] - segment[PLACE_Y]
            elif last >= piece:
                tau = i * step
                while piece < last and tau > course.pieces[piece + 1, PIECE_START]:
                    piece += 1
                row = course.pieces[piece]
                share = (tau - row[PIECE_START]) / row[PIECE_WIDTH]
                share = min(max(share, 0.0), 1.0)
                if row[PIECE_KIND] == CROWDED:
                    share = min((1.0 - (1.0 - share) ** (1.0 / POWER)) / NEARLY, 1.0)
                angle = interpolated(row[PIECE_ANGLE:], share)
                _, _, limit = place(course.motion, tau)
                limit = max(limit, 0.0)
                force[0, at], force[1, at] = limit * np.cos(angle), limit * np.sin(angle)
            state[0, at] = state[1, at] = now
            i += 1
