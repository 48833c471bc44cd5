"""Static equilibrium: where the centrifugal load puts the damper before anything vibrates."""

from dataclasses import replace

import numpy as np

from stickslip.arrays import ComplexArray, FloatArray
from stickslip.errors import SingularError
from stickslip.harmonic.balance import HarmonicBalance, harmonic_balance
from stickslip.harmonic.dynamic_stiffness import condense
from stickslip.harmonic.excitation import HarmonicLoad
from stickslip.response.system import System
from stickslip.solve.newton import Newton, Solution, newton, solve_dense

RAMP = (
    0.1,
    0.2,
    0.4,
    0.6,
    0.8,
    1.0,
)  # shares of the load when the full one does not converge at once


def preload(system: System, static_load: FloatArray, options: Newton | None = None) -> FloatArray:
    """Place the structure under a static load, its contacts sticking, slipping or open.

    Parameters
    ----------
    system
        Structure and contacts.
    static_load
        (n,) static forces on all dofs, N.
    options
        Newton options.

    Returns
    -------
    ndarray
        (n_retained,) static displacement of the retained coordinates, m; zero if there is no static load.

    Raises
    ------
    SingularError
        If nothing holds a body (the message names the coordinate) or no equilibrium is found.
    """
    if not np.any(static_load):
        return np.zeros(system.retained.size)
    options = options or Newton(max_iterations=60)
    linear = condense(system.structure, system.retained, HarmonicLoad(static_load))
    balance = harmonic_balance(linear, system.interface, 0, 1)
    bonded = balance.coefficients(bonded_start(balance, 0.0, system))
    q, solution = _at_share(balance, bonded, static_load, options)
    if solution.status.converged:
        return q[0].real
    # from the bonded state every share of the load is the same problem scaled, unless there are preloads or gaps: ramp from small
    q = RAMP[0] * bonded
    for share in RAMP:
        q, solution = _at_share(balance, q, share * static_load, options)
    if not solution.status.converged:
        raise SingularError(
            f"static equilibrium: {solution.status.advice} (residual {solution.residual_norm:.2e} of the load). "
            "Check that the centrifugal load presses the damper against both platforms, or give it a retention stiffness."
        )
    return q[0].real


def _at_share(
    balance: HarmonicBalance, q: ComplexArray, load: FloatArray, options: Newton
) -> tuple[ComplexArray, Solution]:
    loaded = replace(balance, linear=balance.linear.with_load(HarmonicLoad(load)))
    solution = newton(lambda v: loaded.linearise(v, 0.0), loaded.unknowns(q), options)
    return loaded.coefficients(solution.x), solution


def bonded_start(balance: HarmonicBalance, omega: float, system: System) -> FloatArray:
    """Return the scaled solution with every contact bonded: the start of all that follows.

    Raises
    ------
    SingularError
        If a body is held by nothing even then; the message names the coordinate.
    """
    condensed = balance.linear.condensed(omega, balance.order)
    b = balance.interface.gap_operator
    springs = b.T @ (balance.interface.stuck_stiffness()[:, None] * b)
    q = np.zeros((balance.order + 1, balance.linear.n), dtype=complex)
    for h in range(balance.order + 1):
        matrix = condensed.stiffness[h] + springs
        if h == 0:
            static = solve_dense(np.asfortranarray(matrix.real), condensed.load[0].real)
            if static is None:
                raise SingularError(_unheld(matrix.real, system))
            q[0] = static
        elif np.any(condensed.load[h]):
            q[h] = np.linalg.solve(matrix, condensed.load[h])
    return balance.unknowns(q)


def _unheld(matrix: FloatArray, system: System) -> str:
    values, vectors = np.linalg.eigh(matrix)
    worst = vectors[:, int(np.argmin(np.abs(values)))]
    name = system.retained_labels[int(np.argmax(np.abs(worst)))]
    return (
        f"static equilibrium: coordinate {name} is held by nothing even with all contacts stuck. "
        "Add a contact that holds it, or give the damper a retention stiffness."
    )
