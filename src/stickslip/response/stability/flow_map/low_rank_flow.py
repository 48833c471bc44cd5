"""Propagation of disturbances over the intervals of a period whose contact states differ in a few springs.

The base state, in which each contact stays longest, is decomposed into eigenvectors; its exponential is then diagonal.
Another state differs by a matrix of rank r, the number of differing springs: ``A = A₀ + U V``. The difference of the
exponentials is an integral of the difference of the resolvents along a hyperbola around the eigenvalues (Weideman &
Trefethen 2007),

    exp(hA) - exp(hA₀) = 1/(2πi) ∫ exp(zh) R U (1 - V R U)⁻¹ V R dz,    R = (z - A₀)⁻¹,

which the trapezoidal rule turns into a product of two thin matrices. Overdamped modes lie far inside the hyperbola and
need no halving of the interval; the exponential of a full matrix needs five halvings or more. As a check, the integral
is repeated for one vector with other nodes. If the results differ, the interval is halved; if they still differ after
some halvings, the full matrix is used.
"""

from typing import Protocol

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.response.stability.flow_map.contact_states import ContactStates
from stickslip.response.stability.flow_map.modal_states import ModalStates
from stickslip.response.stability.flow_map.propagation import propagate

NODES = 23  # in the upper half plane, including the real one
WIDTH, ANGLE, STEP = 21.771, 0.7148, 0.0834  # parameters of the hyperbola, chosen for the smallest error ...
REACH = 4.0  # ... for all eigenvalues with |Im z| <= REACH - Re z: 2e-13
MARGIN = 1.25  # allowance for eigenvalues of other states, which lie farther out
AGREES = 1e-11  # largest difference of two sets of nodes
TRIES = 4  # halvings
FEW = 50  # coordinates below which the full matrix costs less
DECOMPOSED = 60.0  # cost of the eigenvectors, in products of full matrices
FULL, THIN = 17.0, 5.0  # cost of an interval by full and by thin matrices; for thin ones the rank adds to it
ILL = 1e5  # condition number of the eigenvectors above which they are not used


class Flow(Protocol):
    """Propagation of states through intervals, in its own coordinates."""

    into: FloatArray  # (2n, 2n) from modal states to these coordinates
    out: FloatArray  # (2n, 2n) back to modal states
    gaps: FloatArray  # (3 n_contacts, k) gaps of the first k coordinates

    def advance(self, interval: int, length: float, states: FloatArray, sliders: FloatArray) -> FloatArray:
        """Return the states (2n, k) after `length` within an interval, with all sliders (n_sliders, k) fixed."""
        ...


class FullFlow:
    """Propagation of modal states by the exponential of a full matrix."""

    def __init__(self, modes: ModalStates, contacts: ContactStates) -> None:
        self.modes, self.contacts = modes, contacts
        self.into: FloatArray = np.eye(2 * modes.n)
        self.out: FloatArray = self.into
        self.gaps: FloatArray = modes.gaps
        self.pull: FloatArray = modes.pull(modes.gaps[contacts.rows]) * contacts.springs

    def advance(self, interval: int, length: float, states: FloatArray, sliders: FloatArray) -> FloatArray:
        """Propagate by the exponential of the interval's matrix."""
        stuck = self.contacts.sticks[interval]
        matrix = self.modes.matrix(self.contacts.stiffness[interval])
        return propagate(matrix, states, self.pull[:, stuck], sliders[stuck], length)


class LowRankFlow:
    """Propagation by the eigenvectors of the base state and low-rank differences; `full` is the fallback."""

    def __init__(self, full: FullFlow, base: FloatArray) -> None:
        self.full, self.contacts, self.base = full, full.contacts, base
        modes = full.modes
        n = modes.n
        values, vectors = np.linalg.eig(modes.matrix(base))
        self.rate, self.turn, self.other, self.out = _real_form(values, vectors)
        try:
            self.into: FloatArray = np.linalg.inv(self.out)
        except np.linalg.LinAlgError:  # a free body has a defective eigenvalue
            self.into = np.full_like(self.out, np.inf)
        self.pull = self.into[:, n:] @ modes.pull(modes.gaps)
        self.gaps: FloatArray = modes.gaps @ self.out[:n]
        far = float(np.max(np.abs(self.turn) + self.rate))
        self.longest = REACH / (MARGIN * max(far, 10.0 * float(np.max(self.rate)), 1e-3))
        self.rooms = [np.empty(0)] * 4
        self.probe = np.cos(np.arange(2.0 * n) ** 2)

    def advance(self, interval: int, length: float, states: FloatArray, sliders: FloatArray) -> FloatArray:
        """Propagate by eigenvalues in the base state, and by low-rank differences in other states."""
        if length == 0.0:  # two simultaneous transitions
            return states
        stuck = self.contacts.sticks[interval]
        pulled = self.pull[:, self.contacts.rows[stuck]] * self.contacts.springs[stuck]
        columns, rows = self._difference(self.contacts.stiffness[interval] - self.base)
        if not columns.shape[1]:
            grown, mean = self._base_functions(length)
            return self._times(grown, states) + self._times(mean, pulled @ sliders[stuck])
        halvings = max(0, int(np.ceil(np.log2(length / self.longest))))
        for more in range(halvings, halvings + TRIES):
            found = self._transition(columns, rows, pulled, length / 2**more)
            if found is not None:
                exponential, driven = found
                for _ in range(more):
                    driven += exponential @ driven
                    exponential = exponential @ exponential
                return np.asarray(exponential @ states + driven @ sliders[stuck])
        return np.asarray(self.into @ self.full.advance(interval, length, self.out @ states, sliders))

    @property
    def condition(self) -> float:
        """Condition number of the eigenvectors."""
        return float(np.linalg.norm(self.into, 1) * np.linalg.norm(self.out, 1))

    def _difference(self, stiffness: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return U (2n, r) and V (r, 2n) of a state whose stiffness differs by this matrix from the base state."""
        changed = np.flatnonzero(np.any(stiffness != 0.0, axis=2))
        contact, direction = np.divmod(changed, 3)
        own = self.gaps.reshape(-1, 3, self.gaps.shape[1])[contact]
        rows = np.einsum("rd,rdk->rk", stiffness[contact, direction], own)
        return -self.pull[:, changed], rows

    def _base_functions(self, length: float) -> tuple[ComplexArray, ComplexArray]:
        """Return the exponential of an interval and its integral for each eigenvalue of the base."""
        value = self.rate + 1j * self.turn
        still = np.abs(value * length) < 1e-12
        mean = np.expm1(value * length) / np.where(still, 1.0, value)
        return np.exp(value * length), np.where(still, length, mean)

    def _times(self, function: ComplexArray, columns: FloatArray) -> FloatArray:
        """Return a function of the base matrix, given by its values at the eigenvalues, times columns."""
        out = function.real[:, None] * columns
        out += function.imag[:, None] * columns[self.other]
        return np.asarray(out)

    def _transition(
        self, columns: FloatArray, rows: FloatArray, pulled: FloatArray, length: float
    ) -> tuple[FloatArray, FloatArray] | None:
        """Return the (2n, 2n) matrix of an interval and the (2n, m) effect of sliders.

        The result is None if the nodes do not suffice.
        """
        n2, r = columns.shape
        nodes, weights = HYPERBOLA
        own, cross = self._resolvent(nodes / length)
        small = np.linalg.inv(np.eye(r) - self._small(own, cross, columns, rows))
        small *= weights[:, None, None] / length
        left = self._spread(0, own[:NODES].conj(), cross[:NODES].conj(), columns.T)
        right = self._spread(1, own[:NODES], -cross[:NODES], rows)
        joined = self._room(2, (NODES, 2 * r, n2 + pulled.shape[1]))
        np.matmul(_real(small[:NODES]), right, out=joined[:, :, :n2])
        of_sliders = small[:NODES] * (length / nodes[:NODES, None, None])
        joined[:, :, n2:] = _real(of_sliders) @ (right @ pulled)
        added = left.reshape(-1, n2).T @ joined.reshape(-1, joined.shape[2])
        judged = self._on_probe(own[NODES:], cross[NODES:], small[NODES:], columns, rows)
        if not np.max(np.abs(added[:, :n2] @ self.probe - judged)) <= AGREES:
            return None
        grown, mean = self._base_functions(length)
        at = np.arange(n2)
        added[at, at] += grown.real
        added[at, self.other] += grown.imag
        return added[:, :n2], added[:, n2:] + self._times(mean, pulled)

    def _resolvent(self, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the (nodes, 2n) factors of the base resolvent.

        The first act on a column itself, the second on its partner in a complex pair.
        """
        off = z[:, None] - self.rate
        inverse = 1.0 / (off * off + self.turn * self.turn)
        return off * inverse, np.asarray(self.turn * inverse, dtype=complex)

    def _spread(self, place: int, own: ComplexArray, cross: ComplexArray, rows: FloatArray) -> FloatArray:
        """Return (nodes, 2 r, 2n) real and imaginary parts of the products of the resolvent with rows (r, 2n)."""
        shape = (len(own), 2, *rows.shape)
        out, more = self._room(place, shape), self._room(3, shape)
        for each, of, into in ((own, rows, out), (cross, rows[:, self.other], more)):
            np.multiply(each.real[:, None], of, out=into[:, 0])
            np.multiply(each.imag[:, None], of, out=into[:, 1])
        out += more
        return out.reshape(len(own), -1, rows.shape[1])

    def _room(self, place: int, shape: tuple[int, ...]) -> FloatArray:
        """Return an array in reused memory; a new allocation would cost as much as filling it."""
        size = int(np.prod(shape))
        if self.rooms[place].size < size:
            self.rooms[place] = np.empty(size)
        return self.rooms[place][:size].reshape(shape)

    def _small(self, own: ComplexArray, cross: ComplexArray, columns: FloatArray, rows: FloatArray) -> ComplexArray:
        """Return (nodes, r, r) ``V R U``."""
        both = columns, columns[self.other]
        first, second = (np.einsum("rk,ks->krs", rows, u).reshape(len(u), -1) for u in both)
        return np.asarray(own @ first + cross @ second).reshape(len(own), len(rows), -1)

    def _on_probe(
        self, own: ComplexArray, cross: ComplexArray, small: ComplexArray, columns: FloatArray, rows: FloatArray
    ) -> FloatArray:
        """Return the difference of the exponentials times one vector."""
        known = own @ (rows * self.probe).T - cross @ (rows[:, self.other] * self.probe).T
        forces = (small @ known[:, :, None])[:, :, 0]
        out = own * (forces @ columns.T)
        out += cross * (forces @ columns[self.other].T)
        return np.asarray(np.sum(out, axis=0).real)


def _real(matrices: ComplexArray) -> FloatArray:
    """Convert complex matrices (k, r, r) to real ones (k, 2 r, 2 r) for real and imaginary parts."""
    real, imaginary = matrices.real, matrices.imag
    return np.concatenate(
        [np.concatenate([real, -imaginary], axis=2), np.concatenate([imaginary, real], axis=2)], axis=1
    )


def flow_of(modes: ModalStates, contacts: ContactStates) -> Flow:
    """Return the cheaper flow."""
    full = FullFlow(modes, contacts)
    if modes.n < FEW:
        return full
    base = _longest(contacts)
    rank = np.count_nonzero(np.any(contacts.stiffness != base, axis=3), axis=(1, 2))
    thin = np.where(rank, THIN + rank * NODES / modes.n, 0.0)
    if DECOMPOSED + np.sum(thin) > FULL * len(rank):
        return full
    found = LowRankFlow(full, base)
    return found if found.condition < ILL else full


def _longest(contacts: ContactStates) -> FloatArray:
    """Return the stiffness (n_contacts, 3, 3) of each contact in the state in which it stays longest."""
    base: FloatArray = contacts.stiffness[0].copy()
    lengths = np.diff(contacts.times)
    for c in np.flatnonzero(np.any(contacts.stiffness != base, axis=(0, 2, 3))):
        # many intervals have few distinct states: found by their bytes, sorted by their numbers
        states = contacts.stiffness[:, c].reshape(lengths.size, -1) + 0.0  # no negative zeros
        place: dict[bytes, int] = {}
        which = np.array([place.setdefault(row.tobytes(), len(place)) for row in states])
        known = states[[int(np.argmax(which == k)) for k in range(len(place))]]
        order = np.lexsort(known.T[::-1])
        times = np.bincount(which, lengths)[order]
        base[c] = known[order[np.argmax(times)]].reshape(3, 3)
    return base


def _real_form(values: ComplexArray, vectors: ComplexArray) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
    """Return the eigenvectors of pairs in real form.

    The result is real parts, signed imaginary parts, the partner of each, and the real basis.
    """
    values, vectors = np.asarray(values, complex), np.asarray(vectors, complex)
    real, upper = np.flatnonzero(values.imag == 0.0), np.flatnonzero(values.imag > 0.0)
    first = np.arange(upper.size)
    other = np.concatenate([upper.size + first, first, 2 * upper.size + np.arange(real.size)])
    kept = np.concatenate([upper, upper, real])
    turn = values.imag[kept]
    turn[upper.size : 2 * upper.size] *= -1.0
    own = vectors[:, upper]
    basis = np.hstack([own.real, own.imag, vectors[:, real].real])
    return values.real[kept], turn, other, basis


def _hyperbola() -> tuple[ComplexArray, ComplexArray]:
    """Return nodes and weights of two trapezoidal rules in the upper half plane.

    Weights include the exponential; the real part of the sum counts.
    """
    at = np.concatenate([np.arange(NODES), np.arange(NODES) + 0.5])
    turned = 1j * STEP * at - ANGLE
    z = WIDTH * (1.0 + np.sin(turned))
    weights = STEP / np.pi * WIDTH * np.cos(turned) * np.exp(z)
    weights[0] *= 0.5
    return np.asarray(z), np.asarray(weights)


HYPERBOLA = _hyperbola()
