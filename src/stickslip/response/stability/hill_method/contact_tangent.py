"""Contact forces under a disturbance ``e^{στ} Σ_h G_h e^{ihτ}`` of the gaps, along a motion with known transitions.

The forces are ``e^{στ} Σ_h F_h e^{ihτ}``. The matrix from G to F depends on the exponent σ: a slider that sticks from
τ_0 on keeps the displacement of the disturbance at τ_0 while the disturbance grows. The Jacobian of the harmonic
balance uses the matrix at σ = 0, which gives wrong exponents elsewhere.
"""

from dataclasses import dataclass, field

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray, IntArray
from stickslip.contact.slider import PERIOD
from stickslip.response.stability.flow_map.contact_states import ContactStates

SMALL = 1e-3  # |z L| below which (1 - e^{-zL}) / z is evaluated by its series
UNCHANGED_STIFFNESS_SHARE = 1e-12  # change of a stiffness, relative to the largest, below which it counts as constant


@dataclass(frozen=True, eq=False)
class Rests:
    """Stick intervals of the sliders of one contact.

    Attributes
    ----------
    own, normal
        (q,) port of each slider, and port of the normal gap (the slider's own if the normal gap has no influence).
    by_normal
        (q,) derivative of the slider position by the normal gap at the beginning of stick.
    stiffness
        (q,) stiffness of its spring, N/m.
    start, length
        (q,) beginning and length of stick, rad.
    """

    own: IntArray
    normal: IntArray
    by_normal: FloatArray
    stiffness: FloatArray
    start: FloatArray
    length: FloatArray


@dataclass(frozen=True, eq=False)
class ContactTangent:
    """Tangent of one contact over a period, relative to mean springs.

    Attributes
    ----------
    ports
        (m,) indices, among the ports of all contacts, at which the contact differs from the mean springs at any time.
    times
        (n_intervals + 1,) ends of the intervals, from one transition of any contact to the same transition a period
        later.
    changes
        (n_intervals, m, m) stiffness in each interval minus the mean springs, N/m, with fixed sticking sliders.
    rests
        Stick intervals of its sliders.
    """

    ports: IntArray
    times: FloatArray
    changes: FloatArray
    rests: Rests
    known: dict[bytes, ComplexArray] = field(default_factory=dict)

    def matrix(self, sigma: complex, rows: IntArray, columns: IntArray) -> ComplexArray:
        """Return the (r m, c m) matrix from the disturbance to the forces.

        Columns are the harmonics `columns` of the disturbance, rows the harmonics `rows` of the forces.
        """
        m = self.ports.size
        held = self._held(sigma, rows).reshape(rows.size * m, -1)
        placed = self._placed(columns).reshape(-1, columns.size * m)
        return np.asarray(self._without_sliders(rows, columns) - held @ placed)

    def _without_sliders(self, rows: IntArray, columns: IntArray) -> ComplexArray:
        """Return the matrix of springs with periodic stiffness."""
        key = rows.tobytes() + b"|" + columns.tobytes()
        if key not in self.known:
            apart = rows[:, None] - columns
            order, m = int(np.max(np.abs(apart))), self.ports.size
            blocks = self._spectrum(order)[apart + order]
            self.known[key] = blocks.transpose(0, 2, 1, 3).reshape(rows.size * m, columns.size * m)
        return self.known[key]

    def _spectrum(self, order: int) -> ComplexArray:
        """Return the (2 order + 1, m, m) Fourier coefficients -order ... order of the stiffness."""
        j = np.arange(-order, order + 1)[:, None]
        turns = np.exp(-1j * j * self.times)
        shares = (turns[:, :-1] - turns[:, 1:]) / (2j * np.pi * np.where(j, j, 1))
        shares[order] = np.diff(self.times) / PERIOD
        found = shares @ self.changes.reshape(len(self.changes), -1)
        return np.asarray(found.reshape(-1, *self.changes.shape[1:]))

    def _held(self, sigma: complex, harmonics: IntArray) -> ComplexArray:
        """Return the (k, m, q) forces relieved by a unit displacement of each slider while it sticks."""
        rests, h = self.rests, harmonics[:, None]
        share = rests.stiffness / PERIOD * _lasting(sigma + 1j * h, rests.length)
        out = np.zeros((harmonics.size, self.ports.size, rests.own.size), dtype=complex)
        out[:, rests.own, np.arange(rests.own.size)] = share * np.exp(-1j * h * rests.start)
        return out

    def _placed(self, harmonics: IntArray) -> ComplexArray:
        """Return the (q, k, m) derivatives of slider positions at the beginning of stick, over ``e^{σ τ_0}``.

        They are taken by the harmonics of the disturbance.
        """
        rests, each = self.rests, np.arange(self.rests.own.size)
        turns = np.exp(1j * harmonics * rests.start[:, None])
        out = np.zeros((each.size, harmonics.size, self.ports.size), dtype=complex)
        out[each, :, rests.own] = turns
        out[each, :, rests.normal] += rests.by_normal[:, None] * turns
        return out


def contact_tangents(contacts: ContactStates) -> tuple[FloatArray, IntArray, list[ContactTangent]]:
    """Return the tangents of the contacts for a disturbance, from their states over a period.

    Returns
    -------
    springs
        (3 n_contacts,) stiffness of the mean springs, N/m.
    ports
        Rows of the gap operator in which a contact differs from its mean springs.
    tangents
        Tangents of these contacts.
    """
    lengths = np.diff(contacts.times)
    mean = np.tensordot(lengths / PERIOD, contacts.stiffness, axes=1)
    springs = np.diagonal(mean, axis1=1, axis2=2)
    changes = contacts.stiffness - np.eye(3) * springs[:, None, :]
    felt = np.abs(changes) > UNCHANGED_STIFFNESS_SHARE * np.max(np.abs(contacts.stiffness), initial=0.0)
    used = np.any(felt, axis=(0, 3)) | np.any(felt, axis=(0, 2))
    used.flat[contacts.rows] = True
    used.flat[contacts.normals[np.any(contacts.by_normal != 0.0, axis=0)]] = True
    tangents, first = [], 0
    for c in np.flatnonzero(used.any(axis=1)):
        own = np.flatnonzero(used[c])
        ports = np.arange(first, first + own.size)
        rests = _rests(contacts, int(c), own)
        own_changes = np.ascontiguousarray(changes[:, c][:, own[:, None], own])
        tangents.append(ContactTangent(ports, contacts.times, own_changes, rests))
        first += own.size
    return springs.reshape(-1).copy(), np.flatnonzero(used), tangents


def _rests(contacts: ContactStates, contact: int, own: IntArray) -> Rests:
    """Return all stick intervals of a contact's sliders within a period; `own` are its directions that are ports."""
    lengths, count = np.diff(contacts.times), len(contacts.times) - 1
    place = np.searchsorted(own, contacts.rows % 3)
    found = []
    for i, j in zip(*np.nonzero(contacts.takes_hold), strict=True):
        if contacts.rows[j] // 3 != contact:
            continue
        total, k = lengths[i], (i + 1) % count
        while contacts.sticks[k, j] and not contacts.takes_hold[k, j]:
            total, k = total + lengths[k], (k + 1) % count
        found.append((j, i, total))
    slider, at = (np.array([row[c] for row in found], dtype=np.int64) for c in range(2))
    by_normal = contacts.by_normal[at, slider]
    normal = np.where(by_normal != 0.0, own.size - 1, place[slider])
    total_length = np.array([row[2] for row in found], dtype=float)
    return Rests(place[slider], normal, by_normal, contacts.springs[slider], contacts.times[at], total_length)


def _lasting(z: ComplexArray, length: FloatArray) -> ComplexArray:
    """Return ``∫_0^L e^{-zt} dt``."""
    x = z * length
    small = np.abs(x) < SMALL
    series = 1.0 - x / 2.0 * (1.0 - x / 3.0 * (1.0 - x / 4.0 * (1.0 - x / 5.0)))
    away = np.where(small, 1.0, x)
    return np.asarray(length * np.where(small, series, -np.expm1(-away) / away))
