"""Contact laws of an interface as input of the compiled time step."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.contact.addresses import law_address
from stickslip.contact.compiled import checked_weights
from stickslip.contact.law import ContactLaw, Rigid
from stickslip.errors import input_error
from stickslip.response.time.stepping.contact_step import JAC, STATES, ContactTable


@dataclass(frozen=True, eq=False)
class TimeContacts:
    """Contacts in time.

    Parameters
    ----------
    table
        Their laws as arrays.
    start
        (n_states,) the laws' own initial states, one after the other.
    """

    table: ContactTable
    start: FloatArray

    @property
    def n(self) -> int:
        """Number of contacts."""
        return self.table.weight.size

    def on(self, springs: FloatArray) -> "TimeContacts":
        """Return the contacts of a structure that has the springs (3 n,)."""
        return replace(self, table=self.table._replace(springs=springs))

    def separate(self, states: FloatArray) -> tuple[FloatArray, ...]:
        """Return the states of each contact."""
        return tuple(np.split(states, self.state_places[1:-1])) if self.n else ()

    @property
    def state_places(self) -> IntArray:
        """(n + 1,) where the states of each contact begin among all."""
        return np.asarray(self.table.places[STATES])

    @property
    def log_width(self) -> int:
        """Number of derivatives of all laws, see `contact_step.LawWork`."""
        return int(self.table.places[JAC, -1])


def time_contacts(laws: Sequence[ContactLaw], weights: FloatArray | None, caller: str) -> TimeContacts:
    """Lay the laws of contacts out for the time step.

    Parameters
    ----------
    laws
        One law a contact.
    weights
        (n_contacts,) factors of the forces; None: ones.
    caller
        Public function that errors name.

    Raises
    ------
    InputError
        If a contact is rigid, or a weight is not positive.
    """
    if any(isinstance(law, Rigid) for law in laws):
        raise input_error(
            f"{caller}: laws",
            "got RigidCoulomb, which has no stiffness: its force is no function of the gap",
            "Take `RigidCoulomb.softened(stiffness)` in its place.",
        )
    factors = np.ones(len(laws)) if weights is None else checked_weights(weights, len(laws))
    parameters = [np.asarray(law.parameters(), dtype=float) for law in laws]
    states = [np.asarray(law.initial_state(), dtype=float) for law in laws]
    own = np.array([law.stuck_stiffness() for law in laws]).reshape(-1, 3)
    stuck = np.ascontiguousarray((factors[:, None] * own).ravel())
    table = ContactTable(
        _places([law_address(law.kernel) for law in laws], parameters, states),
        _joined(parameters),
        factors,
        stuck,
        stuck,
    )
    return TimeContacts(table, _joined(states))


def _joined(arrays: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate(arrays) if arrays else np.zeros(0)


def _places(kernels: Sequence[int], parameters: Sequence[FloatArray], states: Sequence[FloatArray]) -> IntArray:
    """Return (5, n + 1) where everything of each contact is, see `ContactTable.places`."""
    sizes = np.array([s.size for s in states], dtype=np.int64)
    widths = [np.array([p.size for p in parameters]), sizes, (3 + sizes) * (12 + sizes)]
    begins = [np.concatenate([[0], np.cumsum(w)]) for w in widths]
    entry = begins[2] + np.append((3 + sizes) * (6 + sizes), 0)
    return np.array([[*kernels, 0], *begins, entry], dtype=np.int64)
