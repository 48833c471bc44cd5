"""Strong lift-off with many contacts: at each frequency of a sweep a periodic motion, or a verdict from time integration that none is attained.

The plates of `many_contacts` under the pull `lift`, H = 9, through frequencies from 0.34 to 0.85 of the first stuck one, by `forced_response`
with ``rescue = "in_time"``. What the corrector does not find is marched from rest: a motion that repeats itself starts Newton's method, one that
does not is told with what shows so, which half the step has to show as well.

``python -m evidence.benchmarks lift_off`` goes through all; ``python -m evidence.benchmarks.bench_lift_off 100 0.3`` through one sweep, and with
frequencies behind it through these alone.
"""

import sys
from collections.abc import Iterator
from time import process_time
from typing import Any

import numpy as np

from evidence.models.many_contacts import two_plates
from stickslip.response.forced.from_time import marched_of
from stickslip.response.forced.response import ForcedPoint, Sweep, accepted_points, forced_response
from stickslip.solve.newton_method import Newton
from stickslip.solve.status import Rung, Status

HERTZ = (600.0, 800.0, 933.0, 1067.0, 1200.0, 1333.0, 1500.0)
CONTACTS, SHARES = (24, 50, 100), (0.1, 0.2, 0.3)  # loads over the preload
ORDER = 9
PATIENCE = 20  # Newton steps from a start


def sweep_over(hertz: tuple[float, ...], order: int = ORDER) -> Sweep:
    """Return what is asked for."""
    omegas = tuple(2.0 * np.pi * f for f in hertz)
    return Sweep(
        omega_range=(omegas[0], max(omegas[-1], 1.001 * omegas[0])),
        at=omegas,
        low=order,
        high=order,
        selection="always_high",
        peak_points=0,
        rescue="in_time",
        newton=Newton(max_iterations=PATIENCE),
    )


def sweep_records(contacts: int, share: float, hertz: tuple[float, ...] = HERTZ) -> Iterator[dict[str, Any]]:
    """Yield a record for each frequency: 1 where it ends with a motion or a verdict, 0 where it does not."""
    plates, spent = two_plates(contacts), dict.fromkeys(hertz, (0, 0.0))
    points, began = [], process_time()
    for point in forced_response(plates.system, plates.load(share), sweep_over(hertz)):
        points.append(point)
        now = process_time()
        steps, seconds = spent[_hertz(point)]
        spent[_hertz(point)] = steps + point.iterations, seconds + now - began
        print(
            f"{contacts} contacts, share {share:g}, {_hertz(point):.0f} Hz, {point.stage}, {now - began:.0f} s: {told(point)}",
            file=sys.stderr,
            flush=True,
        )
        began = now
    for point in accepted_points(points):
        steps, seconds = spent[_hertz(point)]
        holds = point.converged or point.status is Status.NOT_PERIODIC
        yield {
            "name": f"many/lift_off_{contacts}_share_{share:g}_{_hertz(point):.0f}_hz",
            "value": float(holds),
            "goal": "a motion or a verdict",
            "holds": holds,
            "note": f"H = {ORDER}, {steps} Newton steps, {seconds:.0f} s of CPU: {told(point)}",
        }


def _hertz(point: ForcedPoint) -> float:
    return min(HERTZ, key=lambda f: abs(2.0 * np.pi * f - point.omega))


def told(point: ForcedPoint) -> str:
    """Return how a frequency ended, in words."""
    marched = marched_of(point)
    seen = "" if marched is None else f"; {marched}, contacts open {marched.opened:.0%} of the time"
    if point.converged:
        return ("from the motion in time" if point.rescue is Rung.IN_TIME else "converged") + seen
    return ("not periodic" if point.status is Status.NOT_PERIODIC else "not known") + seen


def run() -> list[dict[str, Any]]:
    """Go through all; the page `many_contacts` says how long it takes."""
    return [r for n in CONTACTS for share in SHARES for r in sweep_records(n, share)]


if __name__ == "__main__":
    asked = tuple(float(hz) for hz in sys.argv[3:]) or HERTZ
    for record in sweep_records(int(sys.argv[1]), float(sys.argv[2]), asked):
        print(record["name"], record["note"], flush=True)
