"""Whether the verdicts of `bench_lift_off` are right: a longer march that never returns, however fine its step, or one that stays on the balance.

A motion that is told not to be periodic is marched from rest over hundreds of periods, with several steps. Its state at the end of each period
is a point of the Poincaré section: the nearest that these come to each other after 1 to 64 periods says whether it returns, and mean and spread
of the first harmonic have to be the same for every step. A motion that a balance stands for is marched from this balance: it stays there.

``python -m evidence.benchmarks.returns 24 0.3 all 600 800`` does so at these frequencies with 512, 1024 and 2048 steps, or with those that
stand in the place of ``all``; with ``stay`` there it begins on the balances. ``1024 verdict`` in the place of ``all`` repeats the verdict from so many steps on. What is printed
is JSON.
"""

import json
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from time import process_time
from typing import Any

import numpy as np

from evidence.benchmarks.bench_lift_off import ORDER, sweep_over
from evidence.models.many_contacts import Plates, two_plates
from stickslip.response.forced.response import accepted_points, forced_problem, forced_response
from stickslip.response.time.settling import period_harmonics, repetition
from stickslip.response.time.start import TransientStart, rest, start_from_harmonics
from stickslip.response.time.stepping.marcher import Marcher, prepared

STEPS = (512, 1024, 2048)
PERIODS, TURNS = 192, 64  # the later two thirds are judged


@dataclass(frozen=True)
class Section:
    """States (periods, 2n) at the ends of periods, scaled as the march has them, and the first harmonic (periods, n_outputs) of the outputs."""

    states: np.ndarray
    first: np.ndarray

    @property
    def later(self) -> np.ndarray:
        """The states that are judged."""
        return self.states[len(self.states) // 3 :]

    @property
    def returns(self) -> np.ndarray:
        """(TURNS,) largest and least distance of states so many periods apart, of their size."""
        later = self.later
        size = np.linalg.norm(later, axis=1).max()
        apart = [np.linalg.norm(later[m:] - later[:-m], axis=1) for m in range(1, min(TURNS, len(later) // 2) + 1)]
        return np.array([(a.max(), a.min()) for a in apart]) / size

    @property
    def amplitude(self) -> np.ndarray:
        """(periods,) of the first harmonic."""
        return np.asarray(np.linalg.norm(self.first[len(self.first) // 3 :], axis=1))


def marcher_of(plates: Plates, share: float, hertz: float, steps: int) -> Marcher:
    """Return what marches."""
    contacts = plates.system.interface
    return prepared(
        plates.system.structure,
        contacts.gap_operator,
        contacts.laws,
        plates.load(share),
        2.0 * np.pi * hertz,
        steps,
        contacts.weights,
    )


def section(plates: Plates, share: float, hertz: float, steps: int, start: TransientStart, periods: int) -> Section:
    """March so many periods."""
    marcher = marcher_of(plates, share, hertz, steps)
    state, record = marcher.begun(start), marcher.record()
    rows, states, first = marcher.modes.basis[plates.system.outputs], [], []
    for _ in range(periods):
        if marcher.march(state, record) < 0:
            raise FloatingPointError(f"the motion at {hertz} Hz overflowed")
        states.append(state.x[: 2 * marcher.n].copy())
        motion = record.motion @ rows.T
        first.append(period_harmonics(motion[-1], motion, 1)[1])
    return Section(np.array(states), np.array(first))


def returning(contacts: int, share: float, hertz: float, steps: int, periods: int = PERIODS) -> dict[str, Any]:
    """Return how near the motion from rest comes to itself again."""
    plates, began = two_plates(contacts), process_time()
    start = rest(plates.system.structure.n, plates.system.interface.laws)
    found = section(plates, share, hertz, steps, start, periods)
    far, near = found.returns.T
    best = int(far.argmin())
    return {
        "contacts": contacts,
        "share": share,
        "hertz": hertz,
        "steps": steps,
        "periods": periods,
        "always_within": float(far[best]),
        "after": best + 1,
        "after_one": float(far[0]),
        "nearest": float(near.min()),
        "mean_m": float(found.amplitude.mean()),
        "spread": float(found.amplitude.std() / found.amplitude.mean()),
        "cpu_s": round(process_time() - began, 1),
    }


def verdict(contacts: int, share: float, hertz: float, steps: int) -> dict[str, Any]:
    """Return what is told of a frequency if the march begins with so many steps, and looks again with twice as many."""
    plates, began, omega = two_plates(contacts), process_time(), 2.0 * np.pi * hertz
    system = plates.system
    seen = repetition(system.structure, system.interface, plates.load(share), omega, system.outputs, ORDER, steps)
    both = [seen, *([] if seen.finer is None else [seen.finer])]
    return {
        "contacts": contacts,
        "share": share,
        "hertz": hertz,
        "verdict": seen.verdict,
        "every": seen.every,
        "marches": [(s.steps, s.periods, round(s.angle, 3), round(s.wander, 4), round(s.growth, 3)) for s in both],
        "cpu_s": round(process_time() - began, 1),
    }


def staying(contacts: int, share: float, hertz: tuple[float, ...], periods: int = 48) -> Iterator[dict[str, Any]]:
    """Yield how far the motion that begins on a balance is from it after so many periods."""
    plates = two_plates(contacts)
    system, load = plates.system, plates.load(share)
    sweep = sweep_over(hertz)
    linear = forced_problem(system, load, sweep).low.linear
    points = list(forced_response(system, load, sweep))
    for point in accepted_points(points):
        if not point.converged:
            continue
        own = point.omega / (2.0 * np.pi)
        motion = linear.recover(point.omega, point.coefficients)
        start = start_from_harmonics(motion, point.omega, system.interface.gap_operator, system.interface.laws)
        found = section(plates, share, own, 1024, start, periods)
        balance = motion[1, system.outputs]
        off = np.linalg.norm(found.first - balance, axis=1) / np.linalg.norm(balance)
        yield {
            "contacts": contacts,
            "share": share,
            "hertz": round(own, 1),
            "rescue": int(point.rescue),
            "order": point.order,
            "off_after_2": float(off[1]),
            "off_at_end": float(off[-1]),
            "periods": periods,
            "last_change": float(found.returns[0, 0]),
        }


if __name__ == "__main__":
    size, part, how = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
    if how == "stay":
        for told in staying(size, part, tuple(float(hz) for hz in sys.argv[4:])):
            print(json.dumps(told), flush=True)
    elif sys.argv[4] == "verdict":
        for hz in sys.argv[5:]:
            print(json.dumps(verdict(size, part, float(hz), int(how))), flush=True)
    else:
        for hz in sys.argv[4:]:
            for n in STEPS if how == "all" else (int(how),):
                print(json.dumps(returning(size, part, float(hz), n)), flush=True)
