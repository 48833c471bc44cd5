"""Static equilibrium under the centrifugal load, and contact states for small vibrations."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse

from stickslip.arrays import BoolArray, FloatArray, Matrix
from stickslip.contact.initial_sliders import freezable, left_behind, sharing_friction
from stickslip.contact.interface import Interface
from stickslip.contact.law import OPEN, ContactLaw, ResidualTraction, holding_directions
from stickslip.errors import SingularError, input_error
from stickslip.harmonic.aft import contact_forces
from stickslip.harmonic.balance import HarmonicBalance, Linearisation, harmonic_balance
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.harmonic.factors import as_array, real_part, solved, with_contacts
from stickslip.harmonic.harmonic_set import to_complex
from stickslip.harmonic.harmonics_per_dof import AnyBalance
from stickslip.model.blas_threads import by_one_thread
from stickslip.model.fe.factorisation import factorise
from stickslip.response.system import System
from stickslip.solve.continuation import Following, StepControl, reversed_point, start_point, trace
from stickslip.solve.linear import solve_dense
from stickslip.solve.newton_method import Newton, Solution, newton
from stickslip.solve.status import Status

HOLDING = StepControl(scale=1.0, first=0.05, largest=0.5, smallest=1e-5)
FAR = 1e6  # m: gap at which every contact is open, also in dimensionless models


@dataclass(frozen=True, eq=False)
class _Held:
    """Static problem with an additional spring on every coordinate, p times the typical contact stiffness.

    At p = 0 it is the real problem.
    """

    balance: HarmonicBalance

    def linearise(self, x: FloatArray, p: float) -> Linearisation:
        at = self.balance.linearise(x, 0.0)
        return Linearisation(at.residual + p * x, at.dense_jac() + p * np.eye(x.size), x, at.seconds_contact)


@by_one_thread
def preload(system: System, static_load: FloatArray) -> FloatArray:
    """Find the static equilibrium under a load, with contacts that stick, slip or are open.

    Parameters
    ----------
    system
        Structure and contacts.
    static_load
        (n,) static forces on all dofs, N.

    Returns
    -------
    ndarray
        (n_retained,) static displacement of the retained coordinates, m; zero without a static load.

    Raises
    ------
    SingularError
        If a body has no support (the message names the coordinate), or no equilibrium is found.
    """
    # a residual traction is a force without stiffness: it shifts the mean of the vibration, not the seat of the damper
    interface = replace(system.springs, laws=tuple(map(_unstretched, system.springs.laws)))
    resting = float(np.max(np.abs(interface.resting_force()), initial=0.0))
    if not np.any(static_load) and resting == 0.0:
        return np.zeros(system.retained.size)
    options = Newton(max_iterations=60)
    linear = system.condensed(HarmonicLoad(static_load), 0)
    balance = harmonic_balance(linear, interface, 0, 1)
    # the rounding of a large preload limits the accuracy under a small static load
    coarser = max(1.0, resting / balance.force_scale)
    balance = replace(
        balance, force_scale=coarser * balance.force_scale, displacement_scale=coarser * balance.displacement_scale
    )
    start = bonded_start(balance, 0.0, system)
    solution = newton(lambda v: balance.linearise(v, 0.0), start, options)
    if not solution.status.converged:
        solution = _released(balance, options)
    if not solution.status.converged:
        raise SingularError(
            f"static equilibrium: {solution.status.advice} (residual {solution.residual_norm:.2e} of the load). "
            "Check that the centrifugal load presses the damper against both platforms, between the lines of its flat side, "
            "or give it a retention stiffness."
        )
    return np.asarray(balance.coefficients(solution.x)[0].real)


def frozen_sliders(system: System, static_load: FloatArray, friction_share: float = 1.0) -> System:
    """Return the system with all sliders at their positions in the static equilibrium.

    Without slip and lift-off, a vibration is then linear about the static state, and the static part is independent of
    the harmonics (Gastaldi & Berruti 2017, eq. 17). A slider that slips or lifts off loses its initial position.

    Parameters
    ----------
    system
        Structure and contacts.
    static_load
        (n,) static forces on all dofs, N.
    friction_share
        Factor on the friction coefficients in the static solution, above 0 to 1: contacts carry at most this share of
        ``mu N`` at rest. With 1, a contact that slips under the static load is at its friction limit, and any vibration
        moves its slider.

    Returns
    -------
    System
        System whose laws have a `slider`; `preload` finds the same static state for it.

    Raises
    ------
    InputError
        If the share is not above 0 to 1, or a law has no single slider.
    SingularError
        If there is no equilibrium under the static load.
    """
    if not 0.0 < friction_share <= 1.0:
        raise input_error(
            "frozen_sliders: friction_share",
            f"must be above 0 to 1, got {friction_share}",
            "Without friction nothing may hold a body along the contacts.",
        )
    own = system.interface
    if not any(freezable(n, law) for n, law in zip(own.names, own.laws, strict=True)):
        return system
    weaker = replace(own, laws=tuple(sharing_friction(law, friction_share) for law in own.laws))
    static = preload(replace(system, interface=weaker), static_load)
    gaps = own.gap_operator[:, system.retained] @ static
    compiled = replace(weaker, weights=None).compiled()
    force = contact_forces(gaps[None], compiled, samples=1).force[:, :, 0]
    each = zip(own.laws, gaps.reshape(-1, 3), force, strict=True)
    frozen = tuple(left_behind(law, gap, own_force) for law, gap, own_force in each)
    return replace(system, interface=replace(own, laws=frozen))


def _unstretched(law: ContactLaw) -> ContactLaw:
    return law.unstretched() if isinstance(law, ResidualTraction) else law


def _released(balance: HarmonicBalance, options: Newton) -> Solution:
    """Solve with a spring on every coordinate, and remove the springs by continuation.

    A wedged damper that rolls onto its seat passes states from which Newton's method fails, with all contacts slipping
    and some open.
    """
    held = _Held(balance)
    following = Following(newton=options, control=HOLDING, weights=np.ones(balance.size))
    points = [start_point(held, np.zeros(balance.size), 1.0, following)]
    if points[0].solution.status.converged:
        points += trace(held, reversed_point(points[0]), 0.0, following)
    last = points[-1]
    if last.p > 0.0 and last.solution.status.converged:
        return replace(last.solution, status=Status.TOO_MANY_ITERATIONS)
    return last.solution


def bonded_start(balance: AnyBalance, omega: float, system: System) -> FloatArray:
    """Return the scaled solution with every contact bonded, the start of all other solutions.

    Raises
    ------
    SingularError
        If a body has no support even with bonded contacts. The message names the coordinate.
    """
    load = to_complex(balance.linear_load(omega))
    rows = balance.rows
    springs = balance.springs.stuck_stiffness().reshape(-1, 3, 1) * np.eye(3)
    q = np.zeros((balance.order + 1, balance.linear.n), dtype=complex)
    for place, h in enumerate(balance.harmonics):
        if h > 0 and not np.any(load[place]):
            continue
        matrix = with_contacts(balance.linear_block(omega, h), springs, rows)
        if h == 0:
            static = _static(real_part(matrix), load[0].real)
            if static is None and any(map(_hardens, system.interface.laws)):
                # hardening springs hold the rest: Newton's method continues from the other coordinates' equilibrium
                static = np.linalg.lstsq(as_array(matrix.real), load[0].real, rcond=None)[0]
            if static is None:
                raise SingularError(_unheld(as_array(matrix.real), system))
            q[0] = static
        else:
            q[h] = solved(matrix, load[place])
    return balance.unknowns(q)


def _hardens(law: ContactLaw) -> bool:
    """Whether a law has a restoring force along a direction without stiffness at rest."""
    return bool(np.any(holding_directions(law) & ~(law.stuck_stiffness() > 0.0)))


def _static(matrix: Matrix, right: FloatArray) -> FloatArray | None:
    """Return the solution; None if the matrix is singular."""
    if not scipy.sparse.issparse(matrix):
        return solve_dense(matrix, right)
    try:
        return np.asarray(factorise(matrix)(right))
    except SingularError:
        return None


def _unheld(matrix: FloatArray, system: System) -> str:
    values, vectors = np.linalg.eigh(matrix)
    worst = vectors[:, int(np.argmin(np.abs(values)))]
    name = system.retained_labels[int(np.argmax(np.abs(worst)))]
    return (
        f"static equilibrium: coordinate {name} is held by nothing even with all contacts stuck. "
        "Add a contact that holds it, or give the damper a retention stiffness."
    )


def holding(system: System, static_load: FloatArray) -> BoolArray:
    """Return whether each contact point (p,) of a system sticks in small vibrations under a static load (n,), N."""
    gap = system.interface.gap_operator[:, system.retained] @ preload(system, static_load)
    force = static_contact_force(system.springs, gap)
    return pressed_by(system.springs.laws, force)


def static_contact_force(interface: Interface, gap: FloatArray) -> FloatArray:
    """Return the (p, 3) forces t, w, n of contacts loaded once from rest to `gap` (p, 3)."""
    coefficients = gap.reshape(1, -1)
    return contact_forces(coefficients, interface.compiled(), samples=1).force[:, :, 0]


def pressed_by(laws: Sequence[ContactLaw], force: FloatArray) -> BoolArray:
    """Return whether each contact point (p,) sticks in small vibrations: it is under pressure, or its law never opens.

    Parameters
    ----------
    laws
        Law of each point.
    force
        (p, 3) static contact forces t, w, n, N.
    """
    return np.asarray((force[:, 2] < 0.0) | ~opening(laws))


def opening(laws: Sequence[ContactLaw]) -> BoolArray:
    """Return whether the law of each contact point (p,) opens at a large gap."""
    found: dict[int, bool] = {}
    for law in laws:
        found.setdefault(id(law), _opens(law))
    return np.array([found[id(law)] for law in laws], dtype=bool)


def _opens(law: ContactLaw) -> bool:
    """Whether a law opens at a large gap."""
    state = law.initial_state()
    jac = np.zeros((3 + state.size, 6 + state.size))
    status = np.empty(2, dtype=np.int64)
    force, after = np.empty(3), np.empty_like(state)
    parameters = law.parameters()
    law.kernel(np.array([0.0, 0.0, FAR]), np.zeros(3), state, parameters, force, after, jac, status)
    return bool(np.all(status == OPEN))
