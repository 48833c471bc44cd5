"""Monodromy matrix with located transitions: matrix exponentials between them, projections at them."""

from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray
from stickslip.contact.slider import PERIOD
from stickslip.response.stability.flow_map.contact_states import ContactStates
from stickslip.response.stability.flow_map.low_rank_flow import flow_of
from stickslip.response.stability.flow_map.modal_states import ModalStates
from stickslip.response.time.sectors import InTime


@dataclass(slots=True)
class Disturbance:
    """The states as linear functions of those at the beginning of the period."""

    motion: FloatArray  # (2n, k)
    sliders: FloatArray  # (n_sliders, k)


class Sliders:
    """What sets the places of the sliders, gaps being (3 n_contacts, k) of the first k states."""

    def __init__(self, gaps: FloatArray, contacts: ContactStates) -> None:
        self.contacts = contacts
        self.own, self.normal = gaps[contacts.rows], gaps[contacts.normals]

    def take_hold(self, interval: int, now: Disturbance) -> None:
        """Set the sliders anew that begin to rest with an interval."""
        new = self.contacts.takes_hold[interval]
        by_normal = self.contacts.by_normal[interval, new][:, None]
        row = self.own[new] + by_normal * self.normal[new]
        now.sliders[new] = row @ now.motion[: row.shape[1]]


def monodromy(modes: ModalStates, contacts: ContactStates) -> FloatArray:
    """Return the derivative of all states after a period by those before, where all transitions are located.

    The states are those of the structure and the places of the sliders that rest at the time at which the period begins, which is
    the transition after which the fewest do; the non-zero multipliers are those of any other.
    """
    flow, count = flow_of(modes, contacts), len(contacts.times) - 1
    places = Sliders(flow.gaps, contacts)
    begin = int(np.argmin(contacts.sticks.sum(axis=1)))
    held = contacts.sticks[begin]
    now = identity(modes.n, held, 0)
    now.motion = flow.into @ now.motion
    for i in range(begin, begin + count):
        here, following = i % count, (i + 1) % count
        length = contacts.times[here + 1] - contacts.times[here]
        now.motion = flow.advance(here, length, now.motion, now.sliders)
        places.take_hold(following, now)
    return np.vstack([flow.out @ now.motion, now.sliders[held]])


def share_of_monodromy(modes: ModalStates, contacts: ContactStates, wheel: InTime) -> FloatArray | None:
    """Return the derivative of all states after a share of the period, sectors renumbered, by those before; None where the motion has no shares.

    The motion of a travelling wave does in every share what it does in the first one, in other sectors: the multipliers of the period are
    those of the share to the power of their number. The share begins in the middle of the longest interval.
    """
    times, count = contacts.times, len(contacts.times) - 1
    sliders = contacts.rows.size
    if wheel.shares < 2 or sliders % wheel.sectors:
        return None
    begin = int(np.argmax(np.diff(times)))
    start = 0.5 * (times[begin] + times[begin + 1])
    stop = start + PERIOD / wheel.shares
    held = contacts.sticks[begin]
    flow, now = flow_of(modes, contacts), identity(modes.n, held, 0)
    places = Sliders(flow.gaps, contacts)
    now.motion = flow.into @ now.motion
    here, at = begin, start
    while True:
        i, turn = here % count, (here // count) * PERIOD
        end = min(float(times[i + 1] + turn), stop)
        now.motion = flow.advance(i, end - at, now.motion, now.sliders)
        if end >= stop:
            break
        here, at = here + 1, end
        places.take_hold(here % count, now)
    if not np.array_equal(wheel.shifted(contacts.sticks[here % count]), held):
        return None
    moved = np.linalg.solve(modes.basis, wheel.shifted(modes.basis))
    turned = moved * modes.speed / modes.speed[:, None]
    n, motion = modes.n, flow.out @ now.motion
    return np.vstack([moved @ motion[:n], turned @ motion[n:], wheel.shifted(now.sliders)[held]])


def identity(n: int, held: BoolArray, more: int) -> Disturbance:
    """Return disturbances of one state each, `more` columns being left for others."""
    size = 2 * n + int(np.count_nonzero(held))
    sliders = np.zeros((len(held), size + more))
    sliders[held, 2 * n : size] = np.eye(size - 2 * n)
    return Disturbance(np.eye(2 * n, size + more), sliders)
