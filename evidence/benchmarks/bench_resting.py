"""Contacts that rest, stuck or open all period: what a sweep would gain if they were condensed out of the unknowns.

The plates of `many_contacts` through ten frequencies below the first stuck one. First all contacts are unknown. Then those that rest at all
ten frequencies are taken out by hand: the springs of the stuck ones go into the structure, and their gaps are condensed like any other
coordinate. The states are known beforehand, nothing is checked and nothing comes back: what is measured is the most that can be gained.
"""

import sys
from dataclasses import dataclass, replace
from time import process_time
from typing import Any

import numpy as np
import scipy.sparse
import scipy.sparse.linalg

from evidence.models.many_contacts import Plates, two_plates
from stickslip.arrays import ComplexArray, FloatArray
from stickslip.contact.interface import Interface
from stickslip.harmonic.aft import ContactPeriod
from stickslip.harmonic.balance import harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.model.modes import with_springs
from stickslip.response.equilibrium import bonded_start
from stickslip.response.forced.response import forced_response
from stickslip.response.forced.sweep import Sweep
from stickslip.response.system import System
from stickslip.solve.krylov import Automatic, Krylov
from stickslip.solve.linear import Dense, LinearSolver
from stickslip.solve.newton_method import Newton, newton

# loads over the preload, by contacts: half of the contacts rest, nine tenths, all
SHARES = {24: (0.18, 0.09, 0.02), 50: (0.13, 0.06, 0.02), 100: (0.12, 0.065, 0.02)}
ORDERS = (5, 9)
RANGE, FREQUENCIES = (0.6, 0.9), 10  # of the first stuck frequency
ROUNDING = 1e-12  # share of a contact's largest force
TOLERANCE = 1e-10  # of the residual
GOAL = 1.5


@dataclass(frozen=True, eq=False)
class Swept:
    """Coefficients of the retained coordinates at each frequency, m, which contacts rest, and what it took.

    Attributes
    ----------
    seconds
        CPU time of the preparation of the condensation, of the contacts and of the linear systems, and of all together.
    """

    motion: list[ComplexArray]
    stuck: FloatArray  # (n_contacts,) whether a contact is its springs at all frequencies
    open: FloatArray  # whether it is open all the time
    steps: int
    products: int
    factors: int
    seconds: dict[str, float]


@dataclass(eq=False)
class _Timed:
    """A linear solver and the CPU time it took."""

    linear: LinearSolver
    seconds: float = 0.0

    def solve(self, jac: Any, right: FloatArray) -> FloatArray | None:
        start = process_time()
        found = self.linear.solve(jac, right)
        self.seconds += process_time() - start
        return found

    def solve_bordered(self, *parts: Any) -> tuple[FloatArray | None, float]:
        return self.linear.solve_bordered(*parts)


def swept(
    system: System, load: HarmonicLoad, omegas: FloatArray, order: int, form: str
) -> Swept | None:
    """Go through the frequencies, each from the one before it; None where one does not converge."""
    krylov = Krylov()
    made: dict[str, LinearSolver] = {
        "structured": krylov,
        "dense": Dense(),
        "auto": Automatic(krylov=krylov),
    }
    linear = _Timed(made[form])
    options = Newton(tolerance=TOLERANCE, max_iterations=40, linear=linear)
    begun = process_time()
    condensed = condense(system.structure, system.retained, load)
    balance = harmonic_balance(condensed, system.interface, order, 16 * order, jacobian=form)  # type: ignore[arg-type]
    once, contacts, steps = process_time() - begun, 0.0, 0
    x = bonded_start(balance, omegas[0], system)
    found = []
    for omega in omegas:

        def linearise(v: FloatArray, omega: float = omega) -> Any:
            nonlocal contacts
            start = process_time()
            period = balance.forces(v, omega)
            contacts += process_time() - start
            return balance.linearise(v, omega, period)

        solution = newton(linearise, x, options)
        if not solution.status.converged:
            return None
        x = solution.x
        steps += solution.iterations
        found.append(x)
    spent = process_time() - begun
    periods = [balance.contacts(v, w) for v, w in zip(found, omegas, strict=True)]
    return Swept(
        [balance.coefficients(v) for v in found],
        np.all([_sprung(p, system.interface) for p in periods], axis=0),
        np.all([np.all(p.force == 0.0, axis=(1, 2)) for p in periods], axis=0),
        steps, krylov.counts.products, krylov.counts.preconditioners,
        {"once": once, "contacts": contacts, "linear": linear.seconds, "all": spent},
    )  # fmt: skip


def _sprung(period: ContactPeriod, interface: Interface) -> np.ndarray:
    """Return which contacts are the springs they are before anything has moved: those that stick, and did not slip on the way there."""
    shape = (interface.n_contacts, 3, 1)
    rest, spring = interface.resting_force(), interface.stuck_stiffness()
    expected = rest.reshape(shape) + spring.reshape(shape) * period.gap
    size = np.abs(expected).max(axis=(1, 2), keepdims=True)
    return np.all(np.abs(period.force - expected) <= ROUNDING * size, axis=(1, 2))


def without(
    plates: Plates, stuck: FloatArray, opened: FloatArray, share: float
) -> tuple[System, HarmonicLoad]:
    """Return the plates without the contacts that rest, the springs of the stuck ones in the structure, and the load of that system."""
    system, interface = plates.system, plates.system.interface
    resting = stuck | opened
    resting[np.flatnonzero(~opened)[0]] &= not resting.all()  # one stays: an interface has contacts
    stiffness = np.where(np.repeat(stuck & resting, 3), interface.stuck_stiffness(), 0.0)
    structure = with_springs(system.structure, interface.gap_operator, stiffness)
    kept = np.flatnonzero(~resting)
    rows = (3 * kept[:, None] + np.arange(3)).ravel()
    less = Interface(
        tuple(interface.names[i] for i in kept),
        tuple(interface.laws[i] for i in kept),
        interface.gap_operator[rows],
    )
    load = plates.load(share, "slide")
    gone = np.repeat(stuck & resting, 3)
    clamping = load.static - interface.gap_operator.T @ np.where(
        gone, interface.resting_force(), 0.0
    )
    return replace(system, structure=structure, interface=less), replace(load, static=clamping)


def first_stuck(plates: Plates) -> float:
    """Return the lowest natural frequency of the plates with all contacts stuck, rad/s."""
    bonded = plates.system.stuck_structure()
    return float(
        np.sqrt(
            scipy.sparse.linalg.eigsh(
                scipy.sparse.csc_array(bonded.stiffness), 1, scipy.sparse.csc_array(bonded.mass), sigma=0.0,
                return_eigenvectors=False,
            )[0]
        )
    )  # fmt: skip


def records(points: int, order: int, share: float, forms: tuple[str, ...]) -> list[dict[str, Any]]:
    """Compare the sweep with all contacts and without those that rest."""
    plates = two_plates(points)
    omegas = np.linspace(*RANGE, FREQUENCIES) * first_stuck(plates)
    out = []
    for form in forms:
        whole = _best(plates.system, plates.load(share, "slide"), omegas, order, form)
        assert whole is not None
        less = _best(*without(plates, whole.stuck, whole.open, share), omegas, order, form)
        assert less is not None
        resting = float(np.mean(whole.stuck | whole.open))
        ratio = whole.seconds["all"] / less.seconds["all"]
        note = (
            f"{resting:.0%} of the contacts rest ({np.mean(whole.open):.0%} open); all: {_told(whole)}; without: {_told(less)}; "
            f"answers differ by {_apart(whole, less, plates, share):.1e}"
        )
        out.append(_record(f"many/resting_{points}_h_{order}_load_{share:g}_{form}", ratio, note))
    return out


def _best(*asked: Any) -> Swept | None:
    """Return the faster of two, of which the first compiles what is not compiled yet."""
    first = swept(*asked)
    if first is None or first.seconds["all"] > 10.0:
        return first
    second = swept(*asked)
    assert second is not None
    return min(first, second, key=lambda s: s.seconds["all"])


def _told(s: Swept) -> str:
    t = s.seconds
    return (
        f"{s.motion[0].shape[1]} coordinates, {s.steps} steps, {s.products} products, {s.factors} factors, {t['all']:.3f} s "
        f"(condensation {t['once'] / t['all']:.0%}, contacts {t['contacts'] / t['all']:.0%}, linear systems {t['linear'] / t['all']:.0%})"
    )


def _apart(whole: Swept, less: Swept, plates: Plates, share: float) -> float:
    """Return the largest difference of the gaps that both know, over the largest of them."""
    kept = np.searchsorted(
        plates.system.retained, without(plates, whole.stuck, whole.open, share)[0].retained
    )
    each = zip(whole.motion, less.motion, strict=True)
    return max(
        float(np.abs(a[1:, kept] - b[1:]).max() / np.abs(a[1:, kept]).max()) for a, b in each
    )


def response_record(points: int, order: int, share: float) -> dict[str, Any]:
    """Compare the forced response as the package computes it, from the load on, over the same frequencies."""
    plates = two_plates(points)
    omegas = np.linspace(*RANGE, FREQUENCIES) * first_stuck(plates)
    load = plates.load(share, "slide")
    whole = swept(plates.system, load, omegas, order, "auto")
    assert whole is not None
    less = without(plates, whole.stuck, whole.open, share)
    seconds = [
        min(_response_seconds(*asked, omegas, order) for _ in range(2))
        for asked in ((plates.system, load), less)
    ]
    ratio = seconds[0] / seconds[1]
    note = f"forced_response, {np.mean(whole.stuck | whole.open):.0%} of the contacts rest: {seconds[0]:.3f} s with all, {seconds[1]:.3f} s without"
    return _record(f"many/resting_{points}_h_{order}_load_{share:g}_response", ratio, note)


def _response_seconds(system: System, load: HarmonicLoad, omegas: FloatArray, order: int) -> float:
    sweep = Sweep(
        omega_range=(float(omegas[0]), float(omegas[-1])), selection="always_high", high=order, samples=16 * order,
        evaluator="intervals", frequencies=omegas.size, peak_points=0, newton=Newton(tolerance=TOLERANCE, linear=Automatic()),
    )  # fmt: skip
    start = process_time()
    points = list(forced_response(system, load, sweep))
    assert all(p.converged for p in points)
    return process_time() - start


def _record(name: str, ratio: float, note: str) -> dict[str, Any]:
    holds = ratio >= GOAL
    return {"name": name, "value": ratio, "goal": f">= {GOAL}", "holds": holds, "note": note}


def run() -> list[dict[str, Any]]:
    """Measure all; a minute and a half of CPU time."""
    out = []
    for points, shares in SHARES.items():
        forms = ("auto", "structured", "dense") if points < 50 else ("auto", "structured")
        for order in ORDERS:
            for share in shares:
                out += records(points, order, share, forms)
        out.append(response_record(points, ORDERS[0], shares[1]))
    return out


if __name__ == "__main__":  # contacts, harmonics, load, form
    contacts, harmonics, load_share, how = sys.argv[1:]
    for each in records(int(contacts), int(harmonics), float(load_share), (how,)):
        print(f"{each['name']} {each['value']:.2f}: {each['note']}")
