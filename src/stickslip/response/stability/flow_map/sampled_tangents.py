"""Tangents of contact laws without located transitions, at samples of a period.

Hysteresis reverses where a gap reverses. A step across a reversal is divided there, with an interpolated gap, since
both sides have different slopes. Velocity-dependent friction is steep where the velocity passes zero; its tangents are
integrated adaptively over the steps on both sides of a sample.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.arrays import BoolArray, FloatArray, IntArray
from stickslip.contact.addresses import law_address
from stickslip.contact.law import ContactLaw
from stickslip.contact.law_steps import steps_along, tangents_at

MOST_PERIODS = 200
PLAIN = 2  # periods before the first Newton correction of the state
SETTLED = 1e-12  # relative change of the state over a period that ends the iteration
KEPT = 1e-10  # relative singular value below which a direction never forgets
EQUAL = 1e-12  # difference of derivatives that is rounding
DISPLACED = 1e-9  # displacement of a slider from its initial position, relative to the largest gap
ON_CIRCLE = 1e-6  # distance of a root from the unit circle that is rounding

ACCURACY = 1e-8  # error of the integral over a part, relative to the integral over the period
MOST_HALVINGS = 50


@dataclass(frozen=True, eq=False)
class SampledTangents:
    """Derivatives of force and new state by gap, gap velocity, old state and the gap at the previous sample.

    Attributes
    ----------
    contacts
        (n,) indices of the contacts.
    kept
        (n, s) whether a law state is a state of the motion: forces depend on it, and it changes in the period.
    jac
        (samples, n, 3 + s, 9 + s).
    resting, grazing
        (n,) number of sliders that stick for the whole period, and number of these that have moved from their initial
        position.
    """

    contacts: IntArray
    kept: BoolArray
    jac: FloatArray
    resting: IntArray
    grazing: IntArray


@dataclass(frozen=True, eq=False)
class Path:
    """Gaps of contacts at ascending `times` in [0, 4π): (2H+1, n, 3) Fourier coefficients in m, and ω in rad/s."""

    times: FloatArray
    polynomials: FloatArray
    omega: float


def sampled_tangents(laws: Sequence[ContactLaw], contacts: IntArray, path: Path) -> SampledTangents:
    """Evaluate each law along its gaps until its state repeats; return the tangents of the last period.

    Parameters
    ----------
    laws, contacts
        (n,) laws and indices of their contacts.
    path
        Gaps of the contacts over one period.
    """
    most = max((law.initial_state().size for law in laws), default=0)
    jac = np.zeros((len(path.times), len(laws), 3 + most, 9 + most))
    kept = np.zeros((len(laws), most), dtype=bool)
    resting, grazing = np.zeros((2, len(laws)), dtype=np.int64)
    for j, law in enumerate(laws):
        steps = _Steps(law, path, j)
        size, (own, state) = steps.size, steps.settled()
        still = _unmoved(own, size)
        kept[j, :size] = _felt(own, size) & ~still
        springs = law.stuck_stiffness() != 0.0
        sliders = still & np.any(own[:, :3, 6 : 6 + size] != 0.0, axis=0)[springs].any(axis=0)
        resting[j] = np.count_nonzero(sliders)
        grazing[j] = np.count_nonzero(sliders & steps.displaced(state))
        jac[:, j, : 3 + size, : 6 + size] = own[:, :, : 6 + size]
        jac[:, j, : 3 + size, 6 + most :] = own[:, :, 6 + size :]
    return SampledTangents(contacts, kept, jac, resting, grazing)


def _unmoved(jac: FloatArray, size: int) -> BoolArray:
    """Return whether each state stays constant over the period for any disturbance."""
    return np.asarray(np.all(np.abs(jac[:, 3:] - np.eye(size, 9 + size, 6)) <= EQUAL, axis=(0, 2)))


def _felt(jac: FloatArray, size: int) -> BoolArray:
    """Return whether a force depends on each state, directly or through other states."""
    by_state = np.any(jac[:, :, 6 : 6 + size] != 0.0, axis=0)
    felt = np.any(by_state[:3], axis=0)
    for _ in range(size):
        felt = felt | np.any(by_state[3:][felt], axis=0)
    return np.asarray(felt)


def _turns(polynomial: FloatArray) -> FloatArray:
    """Return the times in [0, 2π) at which a trigonometric polynomial has an extremum."""
    h = np.arange(1, (polynomial.size + 1) // 2)
    slope = 0.5 * h * (1j * polynomial[1::2] + polynomial[2::2])  # of exp(ihτ)
    if not np.any(slope):
        return np.zeros(0)
    roots = np.roots(np.concatenate([slope[::-1], [0.0], slope.conj()]))
    return np.asarray(np.angle(roots[np.abs(np.abs(roots) - 1.0) < ON_CIRCLE]) % (2 * np.pi))


class _Steps:
    """Steps of one contact over a period, one to each sample.

    A step is divided where a tangential gap reverses between two samples.
    """

    def __init__(self, law: ContactLaw, path: Path, j: int) -> None:
        self.law, self.parameters = law, np.asarray(law.parameters(), dtype=float)
        self.address = law_address(law.kernel)
        self.size = law.initial_state().size
        polynomials = path.polynomials[:, j]
        before = path.times[-1] - 2 * np.pi
        turns = np.concatenate([_turns(polynomials[:, d]) for d in range(2)])
        turns = np.concatenate([turns + 2 * np.pi * k for k in (-1, 0, 1, 2)])
        turns = turns[(turns > before) & (turns < path.times[-1])]
        self.path, self.polynomials = path, polynomials
        self.times = np.unique(np.concatenate([path.times, turns]))
        self.starts = np.zeros((len(self.times), self.size))  # state at the beginning of each part
        self.samples = np.searchsorted(self.times, path.times)
        basis, slope = _fourier_basis(self.times, len(polynomials))
        self.gap = np.ascontiguousarray(basis @ polynomials)
        self.velocity = np.ascontiguousarray(path.omega * (slope @ polynomials))
        # position of each part's end between its two samples
        index = np.searchsorted(path.times, self.times)
        left = np.concatenate([[before], path.times])[index]
        self.share = (self.times - left) / (path.times[index] - left)

    def settled(self) -> tuple[FloatArray, FloatArray]:
        """Return the (samples, 3 + s, 9 + s) tangents in the periodic state, and this state.

        Tangents are NaN if a step is not finite.
        """
        state = np.array(self.law.initial_state(), dtype=float)
        if np.any(np.isnan(state)):
            state = self._period(state, len(self.times) - 1)[0]
        largest = float(np.max(np.abs(self.gap)))
        jac: FloatArray = np.zeros((len(self.samples), 3 + self.size, 9 + self.size))
        for period in range(MOST_PERIODS):
            new, jac = self._period(state)
            change = new - state
            size = max(float(np.max(np.abs(new), initial=0.0)), largest)
            if np.max(np.abs(change), initial=0.0) <= SETTLED * size:
                break
            if not (np.all(np.isfinite(new)) and np.all(np.isfinite(jac))):
                return np.full_like(jac, np.nan), state
            state = self._corrected(state, new, jac) if period % 4 == PLAIN else new
        self._integrate(jac)
        return jac, state

    def displaced(self, state: FloatArray) -> BoolArray:
        """Return whether each state differs from its initial value."""
        away = np.abs(state - np.asarray(self.law.initial_state(), dtype=float))
        return np.asarray(away > DISPLACED * float(np.max(np.abs(self.gap))))

    def _integrate(self, jac: FloatArray) -> None:
        """Replace the tangents at samples by means over the steps.

        This applies to derivatives by the velocity, and for laws without states also by the gap.
        """
        columns = slice(0, 6) if not self.size else slice(3, 6)
        before = np.concatenate([[self.path.times[-1] - 2 * np.pi], self.times[:-1]])
        ends = np.column_stack([before, self.times])
        if self.size and not np.any(self._tangents(self.times, np.arange(len(ends)))[:, :, columns]):
            return
        step = np.searchsorted(self.path.times, self.times)

        def tangents(tau: FloatArray, part: IntArray) -> FloatArray:
            return self._tangents(tau, part)[:, :, columns]

        jac[:, :3, columns] = _hat_integrals(tangents, ends, step, self.path.times)

    def _tangents(self, tau: FloatArray, part: IntArray) -> FloatArray:
        """Return the (k, 3, 6) derivatives of the forces at times within parts of steps."""
        basis, slope = _fourier_basis(tau, len(self.polynomials))
        gap, velocity = basis @ self.polynomials, self.path.omega * (slope @ self.polynomials)
        out = np.empty((tau.size, 3, 6))
        tangents_at(self.address, gap, velocity, self.starts, part, self.parameters, out)
        return out

    def _corrected(self, state: FloatArray, new: FloatArray, jac: FloatArray) -> FloatArray:
        """Return the state after a Newton correction towards a periodic state, without directions that never forget."""
        kept = np.eye(self.size)
        for step in jac:
            kept = step[3:, 6 : 6 + self.size] @ kept
        correction = np.linalg.pinv(np.eye(self.size) - kept, rcond=KEPT) @ (new - state)
        return np.asarray(state + correction if np.all(np.isfinite(correction)) else new)

    def _period(self, state: FloatArray, first: int = 0) -> tuple[FloatArray, FloatArray]:
        """Evaluate the law over a period; return the final state and the tangents of whole steps."""
        new, s = np.array(state, dtype=float), self.size
        whole = np.zeros((len(self.samples), 3 + s, 9 + s))
        steps_along(
            self.address,
            first,
            self.gap,
            self.velocity,
            new,
            self.parameters,
            self.share,
            self.samples,
            self.starts,
            whole,
        )
        return new, whole


def _fourier_basis(tau: FloatArray, m: int) -> tuple[FloatArray, FloatArray]:
    """Return 1, cos hτ, sin hτ, ... at times, and their derivatives by τ."""
    h = np.arange(1, (m + 1) // 2)
    cos, sin = np.cos(np.outer(tau, h)), np.sin(np.outer(tau, h))
    basis, slope = np.ones((tau.size, m)), np.zeros((tau.size, m))
    basis[:, 1::2], basis[:, 2::2] = cos, sin
    slope[:, 1::2], slope[:, 2::2] = -h * sin, h * cos
    return basis, slope


def _hat_integrals(
    tangents: Callable[[FloatArray, IntArray], FloatArray], ends: FloatArray, step: IntArray, samples: FloatArray
) -> FloatArray:
    """Return weighted means of tangents about each sample.

    The weight decreases linearly to zero at the neighbouring samples.

    A force much shorter than a step becomes two impulses with the same sum and mean time. Parts are halved until
    Simpson's rule converges.

    Parameters
    ----------
    tangents
        Function that returns the (k, ...) tangents at k times, each within a part of a step.
    ends
        (n_parts, 2) beginning and end of the parts; times of steep tangents must be among them.
    step
        (n_parts,) sample at the end of the step of each part.
    samples
        (n_samples,) times; the first step begins at the last sample of the previous period.
    """
    lengths = np.diff(samples, prepend=samples[-1] - 2 * np.pi)
    part, left, right = np.arange(len(ends)), ends[:, 0], ends[:, 1]
    shape = tangents(ends[:1, 1], part[:1]).shape[1:]
    found = np.zeros((2, len(samples), int(np.prod(shape))))  # at the beginning and the end of a step

    def moments(tau: FloatArray, parts: IntArray) -> FloatArray:
        own = tangents(tau, parts).reshape(tau.size, -1)
        share = 1.0 - (samples[step[parts]] - tau) / lengths[step[parts]]
        return np.stack([own * (1.0 - share)[:, None], own * share[:, None]])

    for halvings in range(MOST_HALVINGS + 1):
        length = (right - left)[:, None]
        places = [left + (right - left) * share for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
        a, b, c, d, e = (moments(tau, part) for tau in places)
        whole = length / 6.0 * (a + 4.0 * c + e)
        halves = length / 12.0 * (a + 4.0 * b + 2.0 * c + 4.0 * d + e)
        total = np.sum(np.abs(found), axis=(0, 1)) + np.sum(np.abs(halves), axis=(0, 1))
        done = np.all(np.abs(halves - whole) <= ACCURACY * total, axis=(0, 2))
        done |= halvings == MOST_HALVINGS
        for side in range(2):
            np.add.at(found[side], step[part[done]], halves[side, done])
        if np.all(done):
            break
        middle = 0.5 * (left + right)[~done]
        part = np.concatenate([part[~done]] * 2)
        left, right = (np.concatenate([left[~done], middle]), np.concatenate([middle, right[~done]]))
    shares = 0.5 * (lengths + np.roll(lengths, -1))
    means = (np.roll(found[0], -1, axis=0) + found[1]) / shares[:, None]
    return np.asarray(means.reshape(-1, *shape))
