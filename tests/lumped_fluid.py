"""A fluid of our own around a lumped bladed disk: states between the blades that are driven by their motion and relax with the flow.

Nothing of it knows waves: the judge of influence coefficients and of their signs.
"""

import numpy as np
import scipy.linalg

BLADES = 6
MASSES = 1.0, 0.3  # disk and blade
SPRINGS = 0.6, 0.5, 1.0  # disk to ground, to the next disk, to the blade
LOSS = 2e-3  # of a blade's damping to its stiffness
RATES = (0.9, 0.35)  # the fluid of a passage relaxes, and is fed by the passage behind it (lower number)
STRENGTH = 4e-3
BLADE = 1  # second coordinate of a sector


def disk():
    """Return M, C, K of the whole wheel: sector by sector disk and blade."""
    n = 2 * BLADES
    M = np.diag(np.tile(MASSES, BLADES))
    K = np.zeros((n, n))
    ground, ring, blade = SPRINGS
    for s in range(BLADES):
        d, b, following = 2 * s, 2 * s + 1, 2 * ((s + 1) % BLADES)
        K[d, d] += ground
        for one, other, k in ((d, b, blade), (d, following, ring)):
            K[np.ix_([one, other], [one, other])] += k * np.array([[1, -1], [-1, 1]])
    return M, LOSS * K, K


def coupled(strength=STRENGTH):
    """Return the matrix A of the state (u, v, w), ẋ = A x: w is the lift on each blade."""
    M, C, K = disk()
    n = len(M)
    relax, fed = RATES
    blades = 2 * np.arange(BLADES) + BLADE
    onto = np.zeros((n, BLADES))
    onto[blades, np.arange(BLADES)] = 1.0
    behind = np.roll(np.eye(BLADES), -1, axis=1)  # row n, column n - 1
    ahead = behind.T
    fluid = -relax * np.eye(BLADES) + fed * behind
    # driven by the blade's own velocity and by the difference of its neighbours' places
    by_velocity = -strength * np.eye(BLADES) + 0.8 * strength * behind
    by_place = strength * (1.5 * ahead - 0.6 * behind)
    inverse = np.linalg.inv(M)
    A = np.zeros((2 * n + BLADES,) * 2)
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -inverse @ K, -inverse @ C
    A[n : 2 * n, 2 * n :] = inverse @ onto
    A[2 * n :, :n], A[2 * n :, n : 2 * n] = by_place @ onto.T, by_velocity @ onto.T
    A[2 * n :, 2 * n :] = fluid
    return A


def recorded(omega, strength=STRENGTH, moved=0):
    """Move one blade by Re e^{iωt} until all is periodic, and return the complex force on every blade."""
    A = coupled(strength)
    n = 2 * 2 * BLADES
    fluid, place, velocity = A[n:, n:], A[n:, : n // 2], A[n:, n // 2 : n]
    drive = place[:, 2 * moved + BLADE] + 1j * omega * velocity[:, 2 * moved + BLADE]
    return np.linalg.solve(1j * omega * np.eye(BLADES) - fluid, drive)


def recorded_in_time(omega, strength=STRENGTH, moved=0, periods=12, steps=96):
    """Do the same by marching: what a flow solver does, and what it then transforms."""
    A = coupled(strength)
    n = 2 * 2 * BLADES
    fluid, place, velocity = A[n:, n:], A[n:, : n // 2], A[n:, n // 2 : n]
    # w, cos and sin of ωt as one linear system, exact from step to step
    column = place[:, 2 * moved + BLADE], -omega * velocity[:, 2 * moved + BLADE]
    whole = np.zeros((BLADES + 2,) * 2)
    whole[:BLADES, :BLADES], whole[:BLADES, BLADES:] = fluid, np.column_stack(column)
    whole[BLADES:, BLADES:] = omega * np.array([[0.0, -1.0], [1.0, 0.0]])
    step = scipy.linalg.expm(whole * 2 * np.pi / omega / steps)
    state, lift = np.zeros(BLADES + 2), []
    state[BLADES] = 1.0
    for _ in range(periods * steps):
        lift.append(state[:BLADES])
        state = step @ state
    last = np.array(lift[-steps:])
    return 2 / steps * np.exp(-2j * np.pi * np.arange(steps) / steps) @ last


def modes_of_wave(wave_number, strength=STRENGTH):
    """Return the damped eigenvalues with the shape of a wave, from the whole wheel, lowest frequency first; Im λ > 0."""
    values, vectors = np.linalg.eig(coupled(strength))
    phases = np.exp(2j * np.pi * wave_number * np.arange(BLADES) / BLADES)
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        u = vector[: 2 * BLADES].reshape(BLADES, 2)
        part = phases.conj() @ u / BLADES
        if value.imag > 1e-6 and np.linalg.norm(np.outer(phases, part) - u) < 1e-6 * np.linalg.norm(u):
            found.append(value)
    return np.array(sorted(found, key=lambda v: v.imag))
