"""The list of contact transitions in a period: multipliers may jump where it changes."""

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.balance import HarmonicBalance
from stickslip.harmonic.fourier import to_real
from stickslip.response.forced.problem import ForcedPoint, ForcedProblem
from stickslip.response.stability.flow_map.contact_states import ContactStates, is_located, located_part, located_states


def cycle_of(problem: ForcedProblem, point: ForcedPoint) -> bytes | None:
    """Return a text that is the same for motions with the same transitions in the cycle of each contact; None where it is not known.

    Two contacts that change their states at the same time may do so in either order: nothing jumps there. States of laws whose transitions
    are not located are those at the samples.
    """
    balance = problem.balance(point.support)
    if not isinstance(balance, HarmonicBalance):
        return None
    interface = balance.interface
    gaps = to_real(point.coefficients @ interface.gap_operator.T)
    located = [located_part(law) is not None for law in interface.laws]
    parts: list[bytes] = []
    if any(located):
        states = located_states(interface, gaps)
        if states is None:
            return None
        parts += [_located(states, c) for c, there in enumerate(located) if there]
    sampled = [c for c, law in enumerate(interface.laws) if not is_located(law)]
    if sampled:
        period = contact_forces(gaps, balance.compiled, problem.sweep.samples, point.omega)
        parts += [_cycle(period.state[c].T.astype(float)) for c in sampled]
    return b"|".join(parts)


def has_transitions(cycle: bytes) -> bool:
    """Whether any contact changes its state in a cycle."""
    return any(part.partition(b":")[0] != b"1" for part in cycle.split(b"|"))


def _located(states: ContactStates, contact: int) -> bytes:
    own = states.rows // 3 == contact
    stiffness = states.stiffness[:, contact].reshape(len(states.stiffness), -1)
    return _cycle(np.hstack([np.sign(stiffness), states.sticks[:, own]]))


def _cycle(rows: FloatArray) -> bytes:
    """Return rows (n, k) that follow each other in a cycle, the repeated ones once, wherever the cycle begins: their number and themselves."""
    changed = np.any(rows != np.roll(rows, 1, axis=0), axis=1)
    chosen = rows[changed] if np.any(changed) else rows[:1]
    # a contact changes at few of the times at which any of them does
    kept = [b"".join(b"%d" % v for v in row) for row in chosen.astype(np.int64).tolist()]
    turned = min(kept[i:] + kept[:i] for i in range(len(kept)))
    return b"%d:" % len(kept) + b",".join(turned)
