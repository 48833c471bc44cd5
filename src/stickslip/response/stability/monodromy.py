"""The derivative of the period map where all transitions are located: exponentials between these, projections at them."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.response.stability.contact_states import ContactStates
from stickslip.response.stability.modal_states import ModalStates
from stickslip.response.stability.propagation import propagate


@dataclass(slots=True)
class Disturbance:
    """The states as linear functions of those at the beginning of the period."""

    motion: FloatArray  # (2n, k)
    sliders: FloatArray  # (n_sliders, k)


class Sliders:
    """The places of the sliders: how they pull the structure, and what sets them."""

    def __init__(self, modes: ModalStates, contacts: ContactStates) -> None:
        self.modes, self.contacts = modes, contacts
        self.own, self.normal = modes.gaps[contacts.rows], modes.gaps[contacts.normals]
        self.pull = modes.pull(self.own) * contacts.springs

    def take_hold(self, interval: int, now: Disturbance) -> None:
        """Set the sliders anew that begin to rest with an interval."""
        new = self.contacts.takes_hold[interval]
        by_normal = self.contacts.by_normal[interval, new][:, None]
        row = self.own[new] + by_normal * self.normal[new]
        now.sliders[new] = row @ now.motion[: self.modes.n]


def monodromy(modes: ModalStates, contacts: ContactStates) -> FloatArray:
    """Return the derivative of all states after a period by those before, where all transitions are located.

    The states are those of the structure and the places of the sliders that rest at the time at which the period begins, which is
    the transition after which the fewest do; the non-zero multipliers are those of any other.
    """
    places, count = Sliders(modes, contacts), len(contacts.times) - 1
    begin = int(np.argmin(contacts.sticks.sum(axis=1)))
    held = contacts.sticks[begin]
    now = identity(modes.n, held, 0)
    for i in range(begin, begin + count):
        here, following = i % count, (i + 1) % count
        stuck = contacts.sticks[here]
        matrix = modes.matrix(contacts.stiffness[here])
        length = contacts.times[here + 1] - contacts.times[here]
        now.motion = propagate(
            matrix, now.motion, places.pull[:, stuck], now.sliders[stuck], length
        )
        places.take_hold(following, now)
    return np.vstack([now.motion, now.sliders[held]])


def identity(n: int, held: BoolArray, more: int) -> Disturbance:
    """Return disturbances of one state each, `more` columns being left for others."""
    size = 2 * n + int(np.count_nonzero(held))
    sliders = np.zeros((len(held), size + more))
    sliders[held, 2 * n : size] = np.eye(size - 2 * n)
    return Disturbance(np.eye(2 * n, size + more), sliders)
