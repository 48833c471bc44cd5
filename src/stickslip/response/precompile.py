"""Compilation of all kernels on a tiny problem, so that the first run does not wait."""

from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import replace
from multiprocessing import get_context

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.contact.compiled import compile_contacts
from stickslip.contact.interface import Interface
from stickslip.contact.law import ContactLaw
from stickslip.contact.law_steps import forces_along
from stickslip.contact.laws import LAWS
from stickslip.contact.laws.coupled_coulomb import CoupledCoulomb
from stickslip.contact.laws.elastic_coulomb import ElasticCoulomb
from stickslip.contact.threads import CONTACTS_WORTH_THREADS
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.balance import JacobianForm, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.structured import StructuredJacobian
from stickslip.harmonic.stuck_contact_elimination import known
from stickslip.model.structure import Dofs, Structure
from stickslip.response.stability.flow_map.monodromy import compiled_kicks
from stickslip.response.time.start import start_from_harmonics
from stickslip.response.time.transient import TimeStepping, integrate
from stickslip.solve.krylov import Automatic, Krylov

SPRING = ElasticCoulomb(k_t=1.0, k_w=1.0, k_n=1.0, mu=0.5, preload=1.0)
PLANAR = CoupledCoulomb(k_t=1.0, k_n=1.0, mu=0.5, preload=1.0)
SAMPLES = 16


def _exact_events() -> None:
    """Evaluate contacts at exact events, and the matrices assembled from them."""
    _over_threads(SPRING)
    _balanced("dense")
    _balanced("structured")


def _marched() -> None:
    """Evaluate a law over a period, and along a path."""
    contact_forces(_gaps(1), compile_contacts([SPRING], None, "march"), SAMPLES)
    forces_along(SPRING, np.zeros((2, 3)))


def _planar() -> None:
    """Evaluate planar friction at located events."""
    _over_threads(PLANAR)
    contact_forces(_gaps(1), compile_contacts([PLANAR]), SAMPLES)


def _on_samples() -> None:
    """Evaluate contacts in intervals between samples, and integrate them in time."""
    for n in (1, CONTACTS_WORTH_THREADS):
        contact_forces(_gaps(n), compile_contacts([SPRING] * n), SAMPLES)
    structure, gap, load = _problem()
    start = start_from_harmonics(np.zeros((2, 3), dtype=complex), 1.0, gap, [SPRING])
    stepping = TimeStepping(steps_per_period=SAMPLES, max_periods=2)
    integrate(structure, gap, [SPRING], load, 1.0, np.array([0]), start, stepping)
    compiled_kicks()


TASKS: dict[str, Callable[[], None]] = {
    "planar friction": _planar,
    "contacts at exact events": _exact_events,
    "laws marched over a period": _marched,
    "contacts on samples, and steps in time": _on_samples,
}


def compile_ahead(workers: int) -> Iterator[tuple[str, int]]:
    """Compile all kernels that are cached on disk.

    Parameters
    ----------
    workers
        Number of processes.

    Yields
    ------
    tuple
        Name of each compiled part, and the number of remaining parts.
    """
    left = len(LAWS) + len(TASKS)
    for name in LAWS:  # compiled once here instead of in each process
        _ = LAWS[name].kernel  # type: ignore[attr-defined]
        left -= 1
        yield f"contact law {name}", left
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        tasks = {pool.submit(task): name for name, task in TASKS.items()}
        for task in as_completed(tasks):
            task.result()
            left -= 1
            yield tasks[task], left


def _gaps(contacts: int) -> FloatArray:
    """Return gaps in one harmonic, t, w and n of each contact."""
    return np.tile([[0.0], [1.0], [0.0]], (1, 3 * contacts))


def _over_threads(law: ContactLaw) -> None:
    """Evaluate enough contacts to use several threads."""
    n = CONTACTS_WORTH_THREADS
    contact_forces(_gaps(n), compile_contacts([law] * n, None, "events"), 0, history=False)


def _problem() -> tuple[Structure, FloatArray, HarmonicLoad]:
    """Return a mass on springs in three directions, its gaps and a load."""
    unit = np.eye(3)
    dofs = Dofs(np.arange(3), ("x", "y", "z"), np.zeros((3, 3)))
    load = HarmonicLoad(np.zeros(3), {1: np.ones(3, dtype=complex)})
    return Structure(unit, 0.1 * unit, unit.copy(), dofs), unit, load


def _balanced(jacobian: JacobianForm) -> None:
    """Assemble the equations of a small problem, and solve with their Jacobian."""
    structure, gap, load = _problem()
    interface = Interface(("contact",), (SPRING,), gap)
    linear = condense(structure, np.arange(3), load)
    whole = harmonic_balance(linear, interface, 3, SAMPLES, "events", jacobian)
    few = whole.with_order(1)
    period = few.forces(np.ones(few.size), 1.0)
    whole.forces(np.ones(whole.size), 1.0, period.events)
    for balance in (whole, whole.with_harmonics((0, 1, 3))):  # arrays of another layout
        here = balance.linearise(np.ones(balance.size), 1.0)
        Automatic().solve(here.jac, here.residual)
        if isinstance(here.jac, StructuredJacobian):
            here.jac.dense()
            slipping = replace(here.jac, blocks=np.ones_like(here.jac.blocks))
            known(here.jac.linear, here.jac.rows).without_resting(
                slipping.coupling, slipping.rows, slipping.scale
            ).array()
            here.jac.matvec(here.residual)
            Krylov().solve(here.jac, here.residual)
            Krylov().solve(here.jac.transposed, here.residual)
