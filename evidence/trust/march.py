"""The judge: periodic motions by shooting and their multipliers, with a march of its own. Nothing of stickslip is imported here.

The march is the classical Runge-Kutta method with steps of the same length, and shorter ones where a contact changes what it does. A slider's place
is part of the state and moves at the end of each step as far as its limit asks. Everything is computed with one step and with half of it; the difference is the judge's own error.

Newton's method at the told frequency may leave for another motion. What is farther from the told one than `CLOSE` is looked for again, with steps
that are cut, and from the told motion at other times of its period; the nearest counts. Beside a fold
the told motion lies between two; the one beyond it is looked for, too. Where the branch turns there may
be none at that frequency: there the motion and the frequency of the branch's nearest point are solved for together (Gauss-Newton steps of least length).
It counts where its frequency is that of the point within `NEARBY`.
"""

from dataclasses import dataclass, replace

import numba
import numpy as np
import numpy.typing as npt

from evidence.trust.draw import Machine

Array = npt.NDArray[np.float64]
KINDS = ("slider", "pad", "stop", "cubic")
SLIDER, PAD, STOP, CUBIC = range(4)
ANGLE = 0.04  # of the fastest vibration with all contacts closed, rad a step
LEAST_STEPS = 1500  # a period
MOST_STEPS = 60000
PIECES = 16  # of a step in which a contact changes what it does
AT_LIMIT = 1e-9  # relative, of the force of a slider that slips
INSIDE = 1e-4  # of the amplitude, from the edge of the places at which a slider sticks all the time
SETTLING = 3  # periods of prescribed motion after which sliders repeat
NEWTON = 25  # iterations
SLOW = 0.1  # of the residual before: with more a derivative is taken anew
CLOSED = 1e-8  # residual of a period over the size of the motion
NUDGE = 1e-6  # difference step over the size of the motion
HARMONICS = 6  # that are compared
NEARBY = 1e-5  # relative difference of frequencies: at most 2 % of an amplitude with a damping ratio of 5e-4
CLOSE = 5e-3  # of the largest amplitude: a balance is nearer to its motion as a rule
TWINS = 5e-4  # of the largest amplitude: beside a fold, a motion that is farther off may have a nearer twin
LATER = (0.25, 0.5, 0.75)  # of a period
CUT, CUT_STEPS = 0.3, 12  # share of a step that is taken, and how often, where whole steps leave
ALIKE = 0.05  # of the largest amplitude: what is farther from the told motion is looked for beside the told frequency
TURN = 1e-3  # relative change of the frequency that counts as much as a change of the motion by its amplitude


@numba.njit(cache=True)
def _gap(tangent, normal, c, q):  # type: ignore[no-untyped-def]
    """Return the displacements of a contact along its tangent and its normal."""
    t, z = 0.0, 0.0
    for i in range(q.size):
        t += tangent[c, i] * q[i]
        z += normal[c, i] * q[i]
    return t, z


@numba.njit(cache=True)
def _forces(kind, tangent, normal, number, q, place, out, moved, move):  # type: ignore[no-untyped-def]
    """Fill the contact forces on the dofs, and with `move` the places of the sliders; mark those that moved."""
    out[:] = 0.0
    n = q.size
    for c in range(kind.size):
        t, z = _gap(tangent, normal, c, q)
        along, across = 0.0, 0.0
        if kind[c] == CUBIC:
            along = -number[c, 0] * t * t * t
        elif kind[c] == STOP:
            across = -number[c, 0] * max(0.0, z - number[c, 5])
        else:
            limit = number[c, 1]
            if kind[c] == PAD:
                press = max(0.0, number[c, 4] + number[c, 2] * z)
                across = -press
                limit = number[c, 3] * press
            spring = number[c, 0] * (t - place[c])
            if abs(spring) > limit:
                spring = limit if spring > 0.0 else -limit
                if move:
                    place[c] = t - spring / number[c, 0]
                    moved[c] = True
            along = -spring
        for i in range(n):
            out[i] += tangent[c, i] * along + normal[c, i] * across


@numba.njit(cache=True)
def _landed(kind, tangent, normal, number, q, step, place):  # type: ignore[no-untyped-def]
    """Put the sliders of pads that close within a step where they touch: else the map of a period would not know that a landing moves in time."""
    for c in range(kind.size):
        if kind[c] != PAD:
            continue
        t, z = _gap(tangent, normal, c, q)
        along, across = _gap(tangent, normal, c, step)
        gap = -(z + number[c, 4] / number[c, 2])
        if gap > 0.0 and across > gap:
            place[c] = t + along * gap / across


@numba.njit(cache=True)
def _rate(inverse, damping, stiffness, load, q, v, contact, out):  # type: ignore[no-untyped-def]
    n = q.size
    total = load + contact
    for i in range(n):
        for j in range(n):
            total[i] -= damping[i, j] * v[j] + stiffness[i, j] * q[j]
    for i in range(n):
        out[i] = 0.0
        for j in range(n):
            out[i] += inverse[i, j] * total[j]


@numba.njit(cache=True)
def _narrow(kind, tangent, normal, number, q, places):  # type: ignore[no-untyped-def]
    """Keep of the places (2, contacts) from and to those at which sliders would stick now, too."""
    for c in range(kind.size):
        if kind[c] != SLIDER and kind[c] != PAD:
            continue
        t, z = _gap(tangent, normal, c, q)
        limit = number[c, 1]
        if kind[c] == PAD:
            limit = number[c, 3] * (number[c, 4] + number[c, 2] * z)
        places[0, c] = max(places[0, c], t - limit / number[c, 0])
        places[1, c] = min(places[1, c], t + limit / number[c, 0])


@numba.njit(cache=True)
def _states(kind, tangent, normal, number, q, v, place, code):  # type: ignore[no-untyped-def]
    """Fill what each contact does: 0 a closed spring, 2 open, 1 and -1 slip to either side."""
    for c in range(kind.size):
        t, z = _gap(tangent, normal, c, q)
        along, across = _gap(tangent, normal, c, v)
        code[c] = 0
        if kind[c] == STOP:
            code[c] = 0 if z > number[c, 5] else 2
        elif kind[c] == SLIDER or kind[c] == PAD:
            limit, rate = number[c, 1], 0.0
            if kind[c] == PAD:
                press = number[c, 4] + number[c, 2] * z
                limit, rate = number[c, 3] * press, number[c, 3] * number[c, 2] * across
            spring = number[c, 0] * (t - place[c])
            side = 1.0 if spring > 0.0 else -1.0
            if kind[c] == PAD and limit <= 0.0:
                code[c] = 2
            elif abs(spring) >= limit * (1.0 - AT_LIMIT) and side * number[c, 0] * along > rate:
                code[c] = int(side)


@numba.njit(cache=True)
def _step(
    inverse,
    damping,
    stiffness,
    kind,
    tangent,
    normal,
    number,
    real,
    imaginary,
    static,
    order,
    omega,
    time,
    h,
    q,
    v,
    place,
    moved,
    work,
):  # type: ignore[no-untyped-def]
    """March a step from an angle of the load's first harmonic; q, v, place are changed in place."""
    contact, load, a, b, c, d = work[0], work[1], work[2], work[3], work[4], work[5]
    angle = order * time
    half, whole = angle + 0.5 * order * omega * h, angle + order * omega * h
    load[:] = static + real * np.cos(angle) - imaginary * np.sin(angle)
    _forces(kind, tangent, normal, number, q, place, contact, moved, False)
    _rate(inverse, damping, stiffness, load, q, v, contact, a)
    load[:] = static + real * np.cos(half) - imaginary * np.sin(half)
    qb, vb = q + 0.5 * h * v, v + 0.5 * h * a
    _forces(kind, tangent, normal, number, qb, place, contact, moved, False)
    _rate(inverse, damping, stiffness, load, qb, vb, contact, b)
    qc, vc = q + 0.5 * h * vb, v + 0.5 * h * b
    _forces(kind, tangent, normal, number, qc, place, contact, moved, False)
    _rate(inverse, damping, stiffness, load, qc, vc, contact, c)
    load[:] = static + real * np.cos(whole) - imaginary * np.sin(whole)
    qd, vd = q + h * vc, v + h * c
    _forces(kind, tangent, normal, number, qd, place, contact, moved, False)
    _rate(inverse, damping, stiffness, load, qd, vd, contact, d)
    _landed(kind, tangent, normal, number, q, h / 6 * (v + 2 * vb + 2 * vc + vd), place)
    q += h / 6 * (v + 2 * vb + 2 * vc + vd)
    v += h / 6 * (a + 2 * b + 2 * c + d)
    _forces(kind, tangent, normal, number, q, place, contact, moved, True)


@numba.njit(cache=True)
def period(
    inverse,
    damping,
    stiffness,
    kind,
    tangent,
    normal,
    number,
    real,
    imaginary,
    static,
    order,
    omega,
    steps,
    q,
    v,
    place,
    moved,
    sums,
    places,
):  # type: ignore[no-untyped-def]
    """March one period; q, v, place are changed in place, `sums` (2, harmonics, n) gets the Fourier coefficients, `places` (2, contacts) from and to where sliders stick all the time.

    A step in which a contact begins or ceases to slip, opens or closes is taken in `PIECES`: the times of these decide the multipliers.
    """
    n = q.size
    h = 2 * np.pi / omega / steps
    work = np.zeros((6, n))
    before, after = np.zeros(kind.size, np.int64), np.zeros(kind.size, np.int64)
    q0, v0, place0, moved0 = q.copy(), v.copy(), place.copy(), moved.copy()
    sums[:] = 0.0
    places[0], places[1] = -np.inf, np.inf
    _states(kind, tangent, normal, number, q, v, place, before)
    for s in range(steps):
        for m in range(sums.shape[1]):
            cosine, sine = np.cos(2 * np.pi * m * s / steps), np.sin(2 * np.pi * m * s / steps)
            weight = (1.0 if m == 0 else 2.0) / steps
            for i in range(n):
                sums[0, m, i] += weight * cosine * q[i]
                sums[1, m, i] -= weight * sine * q[i]
        time = 2 * np.pi * s / steps
        _narrow(kind, tangent, normal, number, q, places)
        q0[:], v0[:], place0[:], moved0[:] = q, v, place, moved
        _step(
            inverse,
            damping,
            stiffness,
            kind,
            tangent,
            normal,
            number,
            real,
            imaginary,
            static,
            order,
            omega,
            time,
            h,
            q,
            v,
            place,
            moved,
            work,
        )
        _states(kind, tangent, normal, number, q, v, place, after)
        if np.any(before != after):
            q[:], v[:], place[:], moved[:] = q0, v0, place0, moved0
            for part in range(PIECES):
                ahead = time + part * 2 * np.pi / steps / PIECES
                _step(
                    inverse,
                    damping,
                    stiffness,
                    kind,
                    tangent,
                    normal,
                    number,
                    real,
                    imaginary,
                    static,
                    order,
                    omega,
                    ahead,
                    h / PIECES,
                    q,
                    v,
                    place,
                    moved,
                    work,
                )
            _states(kind, tangent, normal, number, q, v, place, after)
        before[:] = after


@dataclass(frozen=True)
class Orbit:
    """A periodic motion: Fourier coefficients (harmonics, n), largest modulus of its multipliers, the judge's own errors of both, and its frequency's relative distance."""

    motion: npt.NDArray[np.complex128]
    motion_error: float
    multiplier: float
    multiplier_error: float
    shift: float = 0.0


@dataclass(frozen=True)
class _Closed:
    """A motion that closes: state at t = 0, rad/s, Fourier coefficients, largest modulus of its multipliers."""

    state: Array
    omega: float
    motion: npt.NDArray[np.complex128]
    multiplier: float
    jac: Array


def _inside(place: Array, places: Array, scale: Array) -> Array:
    """Return the places of sliders (contacts,), those that stick all the time moved off the edge: there slip begins to one side only, and no derivative says anything."""
    low, high = places
    off = np.minimum(INSIDE * scale, 0.25 * (high - low))
    sticks = np.isfinite(high - low) & (high > low)
    near = (place < low + 0.5 * off) | (place > high - 0.5 * off)
    return np.where(sticks & near, np.clip(place, low + off, np.maximum(high - off, low + off)), place)


class Judge:
    """A machine at one frequency."""

    def __init__(self, machine: Machine, omega: float) -> None:
        self.machine, self.omega = machine, omega
        contacts = machine.contacts
        self.kind = np.array([KINDS.index(c.kind) for c in contacts])
        self.tangent = np.array([c.tangent for c in contacts])
        self.normal = np.array([c.normal for c in contacts])
        self.number = np.array(
            [[c.stiffness, c.limit, c.normal_stiffness, c.friction, c.preload, c.clearance] for c in contacts]
        )
        self.inverse = np.linalg.inv(machine.mass)
        # a pad at rest is held by what presses it: the preload of the contact, as a load
        stuck = machine.stiffness + sum(
            (
                (c.stiffness if c.kind in ("slider", "pad") else 0.0) * np.outer(c.tangent, c.tangent)
                + (c.normal_stiffness if c.kind == "pad" else c.stiffness) * np.outer(c.normal, c.normal)
                for c in contacts
            ),
            np.zeros_like(machine.stiffness),
        )
        fastest = float(np.sqrt(np.max(np.abs(np.linalg.eigvals(self.inverse @ stuck)))))
        self.steps = int(np.clip(2 * np.pi * fastest / omega / ANGLE, LEAST_STEPS, MOST_STEPS))

    def flow(
        self, state: Array, omega: float, steps: int
    ) -> tuple[Array, npt.NDArray[np.complex128], npt.NDArray[np.bool_], Array]:
        """Return the state (2n + contacts,) after a period, the motion's Fourier coefficients, which sliders moved, and between which places (2, contacts) each would stick."""
        n = len(self.machine.mass)
        q, v, place = state[:n].copy(), state[n : 2 * n].copy(), state[2 * n :].copy()
        moved = np.zeros(self.kind.size, dtype=np.bool_)
        sums, places = np.zeros((2, HARMONICS, n)), np.zeros((2, self.kind.size))
        m = self.machine
        period(
            self.inverse,
            m.damping,
            m.stiffness,
            self.kind,
            self.tangent,
            self.normal,
            self.number,
            m.force.real.copy(),
            m.force.imag.copy(),
            m.static,
            m.harmonic,
            omega,
            steps,
            q,
            v,
            place,
            moved,
            sums,
            places,
        )
        return np.concatenate([q, v, place]), sums[0] + 1j * sums[1], moved, places

    def start(self, motion: npt.NDArray[np.complex128]) -> Array:
        """Return the state at t = 0 of a motion (H+1, n): sliders have followed it for some periods from zero."""
        h = np.arange(len(motion))[:, None]
        place = np.zeros(self.kind.size)
        moved = np.zeros(self.kind.size, dtype=np.bool_)
        out = np.zeros(motion.shape[1])
        for angle in np.arange(512 * SETTLING + 1) * 2 * np.pi / 512:
            q = (motion * np.exp(1j * h * angle)).real.sum(axis=0)
            _forces(self.kind, self.tangent, self.normal, self.number, q, place, out, moved, True)
        q = motion.real.sum(axis=0)
        v = (1j * h * self.omega * motion).real.sum(axis=0)
        return np.concatenate([q, v, place])

    def orbit(self, motion: npt.NDArray[np.complex128]) -> Orbit | None:
        """Return the periodic motion beside a motion (H+1, n), at its frequency or where the branch passes nearest to it; None where none is found."""
        begin = self.start(motion)
        own = self._orbit(begin, free=False)
        if own is None or self._apart(own, motion) > CLOSE:
            own = self._nearest(begin, motion, own)
        elif self._apart(own, motion) > TWINS:
            own = min(own, self._beyond(motion, own) or own, key=lambda o: self._apart(o, motion))
        if own is not None and self._apart(own, motion) <= ALIKE:
            return own
        near = self._orbit(begin, free=True)
        if near is not None and near.shift <= NEARBY and self._apart(near, motion) <= ALIKE:
            return near
        return own

    def _nearest(self, begin: Array, motion: npt.NDArray[np.complex128], own: Orbit | None) -> Orbit | None:
        """Return the nearest of the motions that are found in other ways, and of that which was found."""
        found = [own, self._orbit(begin, free=False, cut=CUT)]
        found += [self._later(motion, share) for share in LATER]
        return min((o for o in found if o is not None), key=lambda o: self._apart(o, motion), default=None)

    def _beyond(self, motion: npt.NDArray[np.complex128], own: Orbit) -> Orbit | None:
        """Return the motion on the other side of the told one: beside a fold it lies between two."""
        mirrored = np.zeros((max(len(motion), HARMONICS), motion.shape[1]), complex)
        mirrored[: len(motion)] = 2.0 * motion
        mirrored[:HARMONICS] -= own.motion
        mirrored[HARMONICS:] /= 2.0
        return self._orbit(self.start(mirrored), free=False)

    def _later(self, motion: npt.NDArray[np.complex128], share: float) -> Orbit | None:
        """Return the motion that is found from the told one at a later time: that of the machine whose load is ahead, turned back."""
        turn = np.exp(2j * np.pi * share * np.arange(max(len(motion), HARMONICS)))[:, None]
        ahead = replace(self.machine, force=self.machine.force * turn[self.machine.harmonic, 0])
        later = Judge(ahead, self.omega)
        found = later._orbit(later.start(motion * turn[: len(motion)]), free=False)
        return None if found is None else replace(found, motion=found.motion / turn[:HARMONICS])

    def _apart(self, orbit: Orbit, motion: npt.NDArray[np.complex128]) -> float:
        driven = self.machine.harmonic
        size = float(np.max(np.abs(orbit.motion[driven])))
        return float(np.max(np.abs(orbit.motion[driven] - motion[driven]))) / size

    def _orbit(self, begin: Array, free: bool, cut: float = 1.0) -> Orbit | None:
        one = self._shoot(begin, self.omega, self.steps, free, cut)
        two = None
        if one is not None:
            two = self._shoot(one.state, one.omega, 2 * self.steps, free, jac=one.jac)
        if one is None or two is None:
            return None
        size = float(np.max(np.abs(two.motion[1:])))
        off = float(np.max(np.abs(two.motion - one.motion))) / size
        error = abs(two.multiplier - one.multiplier)
        if free:  # on either side of a turn a multiplier lies on another side of 1
            error += abs(two.multiplier - 1.0)
        return Orbit(two.motion, off, two.multiplier, error, abs(two.omega / self.omega - 1.0))

    def _shoot(
        self, state: Array, omega: float, steps: int, free: bool, cut: float = 1.0, jac: Array | None = None
    ) -> _Closed | None:
        """Return a motion that closes, at the frequency given or, `free`, at one beside it; the derivative of a state nearby serves as long as it is good."""
        scale, n, before = self._scale(state, omega, steps), len(self.machine.mass), np.inf
        for number in range(NEWTON):
            end, found, moved, places = self.flow(state, omega, steps)
            off = (end - state) / scale
            inside = _inside(state[2 * n :], places, scale[2 * n :])
            if np.max(np.abs(off)) < CLOSED and np.any(inside != state[2 * n :]):
                state = np.concatenate([state[: 2 * n], inside])
                continue
            if jac is None or np.max(np.abs(off)) > SLOW * before or np.max(np.abs(off)) < CLOSED:
                jac = self._jacobian(state, omega, steps, scale)
            if np.max(np.abs(off)) < CLOSED:
                return _Closed(state, omega, found, self._largest(jac, moved), jac)
            before = float(np.max(np.abs(off)))
            matrix = np.eye(len(off)) - jac
            if free:
                matrix = np.column_stack([matrix, -self._by_frequency(state, omega, steps, scale)])
            step = np.linalg.lstsq(matrix, off, rcond=1e-7)[0]
            size = np.max(np.abs(step))
            step *= min(1.0, 0.5 / size if size > 0.5 else 1.0)
            step *= cut if number < CUT_STEPS else 1.0
            state = state + scale * step[: len(state)]
            if free:
                omega *= 1.0 + TURN * float(step[-1])
        return None

    def _by_frequency(self, state: Array, omega: float, steps: int, scale: Array) -> Array:
        """Return how the end of a period changes with the frequency, by `TURN` of it."""
        nudge = NUDGE * TURN
        ahead = self.flow(state, omega * (1.0 + nudge), steps)[0]
        behind = self.flow(state, omega * (1.0 - nudge), steps)[0]
        return np.asarray((ahead - behind) / scale / (2 * NUDGE))

    def _scale(self, state: Array, omega: float, steps: int) -> Array:
        n = len(self.machine.mass)
        amplitude = float(np.max(np.abs(self.flow(state, omega, steps)[1][1:]))) or 1.0
        speed = amplitude * omega * self.machine.harmonic
        return np.concatenate([np.full(n, amplitude), np.full(n, speed), np.full(self.kind.size, amplitude)])

    def _jacobian(self, state: Array, omega: float, steps: int, scale: Array) -> Array:
        columns = []
        for i in range(len(state)):
            nudge = np.zeros_like(state)
            nudge[i] = NUDGE * scale[i]
            ahead, behind = (self.flow(state + nudge, omega, steps)[0], self.flow(state - nudge, omega, steps)[0])
            columns.append((ahead - behind) / scale / (2 * NUDGE))
        return np.array(columns).T

    def _largest(self, jac: Array, moved: npt.NDArray[np.bool_]) -> float:
        """Return the largest modulus of the multipliers; sliders that stick all the time have none."""
        n = len(self.machine.mass)
        keep = np.concatenate([np.arange(2 * n), 2 * n + np.flatnonzero(moved)]).astype(int)
        return float(np.max(np.abs(np.linalg.eigvals(jac[np.ix_(keep, keep)]))))
