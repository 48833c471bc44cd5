"""Strong lift-off with many contacts: at each frequency a periodic motion, or a verdict from time integration that none is attained.

The plates of `many_contacts` under the pull `lift`, H = 9, through frequencies around 0.6 of the first stuck one. A frequency that the forced response does
not find (`rescue = "off"`) is marched from rest until the motion repeats or the periods are spent. A motion that repeats starts Newton's method. Of one that
does not, a copy that is kicked by a millionth is marched beside it: if the two part, it is no slow decay.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from time import process_time
from typing import Any

import numpy as np

from evidence.models.many_contacts import Plates, two_plates
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.response.forced.response import ForcedProblem, Sweep, forced_problem, forced_response
from stickslip.response.time.contact_step import StepState
from stickslip.response.time.marcher import Marcher, prepared
from stickslip.response.time.settling import period_harmonics
from stickslip.response.time.start import rest
from stickslip.solve.newton_method import Newton, newton

HERTZ = (800.0, 1067.0, 1333.0)  # 0.45 to 0.75 of the first stuck frequency
SHARES = {24: (0.1, 0.2, 0.3), 50: (0.1, 0.3), 100: (0.1, 0.3)}  # contacts: loads over the preload
ORDER, STEPS = 9, 512
PERIODS, LATER = 48, 12  # marched at most; the last of them are judged
REPEATS = 1e-4  # largest change of a gap's harmonics from period to period, of their size, that counts as none
CHANGES = 1e-2  # that counts as one, if it has not become less over the last quarters
KICK, KICKED = 1e-6, 8  # of the speeds; periods
PATIENCE = 20  # Newton steps from a start
NEAR = 0.05  # change up to which Newton's method is started from the march


@dataclass(frozen=True, eq=False)
class March:
    """Harmonics of all coordinates and of the gaps in each period, and how fast a kicked copy parts.

    Attributes
    ----------
    motion
        (ORDER + 1, n) of the last period, m.
    first
        (periods, 3) first harmonic of the corner, m.
    change
        (periods - 1,) of the harmonics of all gaps from period to period, of their size.
    growth
        Factor by which a small difference grows in a period; NaN where the motion repeats.
    opened
        Share of the time in which contacts are open, in the last period.
    """

    motion: ComplexArray
    first: ComplexArray
    change: FloatArray
    growth: float
    opened: float

    @property
    def verdict(self) -> str:
        """What the march tells."""
        last = self.change[-LATER:].max()
        if self.change[-4:].max() < REPEATS:
            return "periodic"
        lasting = last > CHANGES and last > 0.5 * self.change[-2 * LATER : -LATER].max()
        return "not periodic" if lasting and self.growth > 1.0 else "not known"

    @property
    def wander(self) -> float:
        """Largest change of the first harmonic from one period to the next over the last ones, of its size."""
        moved = np.linalg.norm(np.diff(self.first[-LATER:], axis=0), axis=1)
        return float(moved.max() / np.linalg.norm(self.first[-LATER:], axis=1).max())


def march(plates: Plates, share: float, hertz: float) -> March:
    """Return how the plates move in time, from rest on."""
    system = plates.system
    contacts = system.interface
    marcher = prepared(
        system.structure, contacts.gap_operator, contacts.laws, plates.load(share), 2.0 * np.pi * hertz, STEPS
    )  # fmt: skip
    state = marcher.begun(rest(marcher.n, contacts.laws))
    gaps: list[ComplexArray] = []
    first: list[ComplexArray] = []
    record, corner = marcher.record(), marcher.modes.basis[system.outputs].T
    for _ in range(PERIODS):
        assert marcher.march(state, record) >= 0
        gaps.append(_harmonics(record.gap.reshape(STEPS, -1)))
        first.append(_harmonics(record.motion @ corner)[1])
        if len(gaps) > LATER and max(_changes(gaps[-5:])) < REPEATS:
            break
    change = np.array(_changes(gaps))
    motion = _harmonics(record.motion @ marcher.modes.basis.T)
    opened = float(np.mean(record.force[:, :, 2] == 0.0))
    growth = np.nan if change[-4:].max() < REPEATS else _growth(marcher, state)
    return March(motion, np.array(first), change, growth, opened)


def _growth(marcher: Marcher, state: StepState) -> float:
    """Return the mean factor by which the distance of a kicked copy grows in a period while it is small."""
    n, record = marcher.n, marcher.record()
    other = StepState(*(part.copy() for part in state))
    other.x[n : 2 * n] += KICK * np.abs(state.x[n : 2 * n]).max() * np.cos(2.4 * np.arange(n))
    size = np.linalg.norm(state.x[: 2 * n])
    apart = [float(np.linalg.norm(other.x[: 2 * n] - state.x[: 2 * n]) / size)]
    for _ in range(KICKED):
        marcher.march(state, record)
        marcher.march(other, record)
        apart.append(float(np.linalg.norm(other.x[: 2 * n] - state.x[: 2 * n]) / size))
        if apart[-1] > NEAR:
            break
    return float((apart[-1] / apart[0]) ** (1.0 / (len(apart) - 1)))


def _harmonics(samples: FloatArray) -> ComplexArray:
    return period_harmonics(samples[-1], samples, ORDER)


def _changes(gaps: Sequence[ComplexArray]) -> list[float]:
    size = max(float(np.linalg.norm(g[1:])) for g in gaps)
    return [float(np.linalg.norm(b - a)) / size for a, b in pairwise(gaps)]


def found(
    plates: Plates, share: float
) -> tuple[ForcedProblem, dict[float, tuple[bool, int, float]]]:
    """Return, by frequency in Hz, whether the forced response has it, with how many Newton steps and in how many CPU seconds."""
    omegas = tuple(2.0 * np.pi * f for f in HERTZ)
    sweep = Sweep(
        omega_range=(omegas[0], omegas[-1]), at=omegas, low=ORDER, high=ORDER, selection="always_high", peak_points=0,
        rescue="off", newton=Newton(max_iterations=PATIENCE),
    )  # fmt: skip
    told: dict[float, tuple[bool, int, float]] = {}
    start = process_time()
    for point in forced_response(plates.system, plates.load(share), sweep):
        hertz = min(HERTZ, key=lambda f: abs(2.0 * np.pi * f - point.omega))
        _, steps, seconds = told.get(hertz, (False, 0, 0.0))
        now = process_time()
        told[hertz] = point.converged, steps + point.iterations, seconds + now - start
        start = now
    return forced_problem(plates.system, plates.load(share), sweep), told


def sweep_records(points: int, share: float) -> Iterator[dict[str, Any]]:
    """Yield a record for each frequency: 1 where it ends with a motion or a verdict, 0 where it does not."""
    plates = two_plates(points)
    problem, told = found(plates, share)
    for hertz in HERTZ:
        converged, steps, seconds = told[hertz]
        note = f"H = {ORDER}, {steps} Newton steps in {seconds:.0f} s: "
        if converged:
            yield _record(points, share, hertz, True, note + "converged")
            continue
        start = process_time()
        seen = march(plates, share, hertz)
        spent = process_time() - start
        note += f"not converged; in time {seen.verdict} ({len(seen.change) + 1} periods, {spent:.0f} s, open {seen.opened:.0%} of the time, "
        if seen.verdict == "periodic":
            note += f"gaps change by {seen.change[-1]:.1g} a period)"
        else:
            note += f"first harmonic of the corner changes by up to {seen.wander:.1%} from period to period over the last {LATER}, "
            note += f"a small difference grows {seen.growth:.3g}-fold a period)"
        if seen.change[-4:].max() < NEAR:
            balance, omega = problem.high, 2.0 * np.pi * hertz
            x = balance.unknowns(seen.motion[:, balance.linear.retained])
            again = newton(lambda v, b=balance, w=omega: b.linearise(v, w), x, problem.sweep.newton)
            converged = again.status.converged
            note += f"; from there Newton's method {'converges' if converged else 'does not converge'} in {again.iterations} steps"
        yield _record(points, share, hertz, converged or seen.verdict != "not known", note)


def _record(points: int, share: float, hertz: float, holds: bool, note: str) -> dict[str, Any]:
    name = f"many/lift_off_{points}_share_{share:g}_{hertz:.0f}_hz"
    return {
        "name": name,
        "value": float(holds),
        "goal": "a motion or a verdict",
        "holds": holds,
        "note": note,
    }


def run() -> list[dict[str, Any]]:
    """Go through all; see the page `many_contacts` for how long it takes."""
    return [r for n, shares in SHARES.items() for share in shares for r in sweep_records(n, share)]
