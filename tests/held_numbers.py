"""All numbers of small answers of the solvers: their motions, and also what they estimate, count and choose on the way.

``python tests/held_numbers.py`` writes them anew, after a change of method that is meant.
"""

import gzip
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
from held_pages import Lines, differences, lines
from test_limit_cycles import motions as grown
from test_nonlinear_modes import followed, one_mass

import stickslip as ss
from stickslip.model.matrices import lumped
from stickslip.response.nonlinear_modes.backbone import ModeSweep
from stickslip.response.parameter import Discretisation
from stickslip.response.self_excited.curve import damping_over_amplitude, slip_amplitude

HELD = Path(__file__).parent / "data" / "shown" / "numbers.txt.gz"
# what answers were made from, and what hangs on the clock
LEFT_OUT = (
    "problem",
    "system",
    "load",
    "sweep",
    "structure",
    "balance",
    "oscillator",
    "backbone",
    "search",
    "own",
    "of",
)


def rubbing() -> tuple[ss.System, ss.HarmonicLoad]:
    """Return five masses in a chain, no two of them alike, with a contact in three directions and a slider, and a load of two harmonics."""
    springs = np.array([3.0, 1.7, 2.2, 1.1, 2.6])
    stiffness = np.diag(springs + np.append(springs[1:], 0.0)) - np.diag(springs[1:], 1) - np.diag(springs[1:], -1)
    structure = lumped(np.array([1.0, 1.3, 0.7, 2.0, 1.1]), stiffness, 0.02 * stiffness)
    rows = np.zeros((6, 5))
    rows[0, 1], rows[1, 2], rows[2, 3], rows[3, 4] = 1.0, 1.0, 1.0, 1.0
    rows[3, 2] = -1.0
    laws = (
        ss.ElasticCoulomb(k_t=0.8, k_w=0.5, k_n=0.9, mu=0.35, preload=0.6),
        ss.Jenkins(k_t=0.7, limit=0.15),
    )
    force = np.array([0.12, 0.05j, 0.03, 0.2 - 0.04j, 0.07])
    load = ss.HarmonicLoad(np.array([0.0, 0.02, 0.0, -0.1, 0.01]), {1: force, 2: 0.2 * force[::-1]})
    return ss.System(structure, ss.Interface(("pad", "slider"), laws, rows), np.array([4, 0])), load


def swept(selection: str, **more: Any) -> Any:
    system, load = rubbing()
    sweep = ss.Sweep(omega_range=(0.5, 1.1), points=8, low=2, high=5, selection=selection, **more)
    problem = ss.response.forced_problem(system, load, sweep)
    points = list(ss.forced_response(system, load, sweep))
    return problem, points


def beside(selection: str) -> Mapping[str, Any]:
    """Return what is asked of a response beside its points."""
    problem, points = swept(selection)
    good = ss.response.accepted_points(points)
    top = max(good, key=lambda p: float(np.abs(p.coefficients[1]).max()))
    return {
        "support": ss.response.check_support(problem, good[:3]),
        "drift": ss.response.drift(problem, top),
        "fields": ss.response.fields(problem, top),
        "signals": ss.response.signals(problem, top),
    }


def mode() -> Mapping[str, Any]:
    """Return a nonlinear mode of a mass on a slider."""
    system, load = one_mass(ss.Jenkins(k_t=0.5, limit=0.1), 0)
    found = followed(system, load, Discretisation(order=5), ModeSweep(span=(0.1, 10.0), points=16))
    return {"points": found.points}


def cycles() -> list[Any]:
    problem = grown(-0.05, Discretisation(order=5))
    slips = slip_amplitude(problem)
    return [slips, damping_over_amplitude(problem, (0.5 * slips, 10.0 * slips), 8)]


SELECTIONS = ("jacobian_alert", "always_high", "always_low", "guarded_alert", "goal_oriented")
ANSWERS: Mapping[str, Callable[[], Any]] = {
    **{f"forced {name}": lambda name=name: swept(name)[1] for name in SELECTIONS},  # type: ignore[misc]
    "beside": lambda: beside("always_high"),
    "mode": mode,
    "limit cycles": cycles,
}


def without(value: Any) -> Any:
    """Return an answer without what it was made from and the clock's times."""
    if is_dataclass(value) and not isinstance(value, type):
        own = [f.name for f in fields(value)]
        return {n: without(getattr(value, n)) for n in own if n not in LEFT_OUT and "second" not in n}
    if isinstance(value, Mapping):
        return {key: without(own) for key, own in value.items()}
    if isinstance(value, list | tuple) and any(is_dataclass(own) or isinstance(own, list | tuple) for own in value):
        return [without(own) for own in value]
    return value


def of_answer(name: str) -> Lines:
    return [f"{name}:{line}" for line in lines("", without(ANSWERS[name]()))]


def held(name: str) -> Lines:
    """Return the lines that were written of an answer."""
    every = gzip.decompress(HELD.read_bytes()).decode().split("\n")
    return [line for line in every if line.startswith(f"{name}:")]


def main() -> None:
    """Write the numbers as they are now."""
    old = {name: held(name) if HELD.exists() else [] for name in ANSWERS}
    new = {name: of_answer(name) for name in ANSWERS}
    for name, own in new.items():
        print(f"{name}: {len(own)} lines, {len(differences(own, old[name]))} changed")
    if any(differences(new[name], old[name]) for name in ANSWERS):
        HELD.write_bytes(gzip.compress("\n".join(line for own in new.values() for line in own).encode(), mtime=0))


if __name__ == "__main__":
    main()
