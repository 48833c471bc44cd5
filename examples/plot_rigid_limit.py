r"""
Rigid Coulomb friction: limit of the penalty law
=================================================

Two masses, the second of which rubs on the ground. A *penalty law* puts a spring in front of the slider; a *rigid* contact has none: it
sticks without moving, and the friction force jumps when the velocity changes its sign. The dynamic Lagrangian frequency-time method solves
for it. It has a penalty :math:`\varepsilon` of its own, which is no property of the contact. The motion at 1.5 rad/s is known exactly by
integration from event to event: the second mass moves by 26.786093 in its first harmonic.

It uses the layers below ``ss.Model``, to show the method by which rigid contacts are solved. With ``ss.Model`` the same is asked by the law ``ss.RigidCoulomb`` in a contact.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

omega, exact = 1.5, 26.786093
structure = ss.model.lumped(np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]]), np.array([[0.04, -0.02], [-0.02, 0.02]]))
load = ss.HarmonicLoad(np.zeros(2), {1: np.array([20.0 + 0j, 0.0])})
linear = ss.harmonic.condense(structure, retained=np.array([1]), load=load)
gap = np.zeros((3, 2))  # rows t, w, n; columns the two masses
gap[0, 1] = 1.0
rigid = ss.RigidCoulomb(mu=0.9, preload=9.0)


def amplitude(problem, start=None):
    """Solve from rest or from a first harmonic; return that of the rubbing mass."""
    guess = np.zeros((2, 1), dtype=complex)
    guess[1] = 0.0 if start is None else start
    found = ss.solve.newton(
        lambda x: problem.linearise(x, omega),
        problem.unknowns(guess),
        ss.solve.Newton(max_iterations=200, tolerance=1e-10),
    )
    if not found.status.converged:
        raise RuntimeError(found.status.advice)
    return problem.coefficients(found.x)[1, 0]


def rubbing(order, samples, penalty=None):
    """Return the periodic problem with the rigid contact."""
    interface = ss.Interface(("rub",), (rigid,), gap)
    return ss.harmonic.dynamic_lagrangian(linear, interface, order, samples, penalty)


# %%
# Penalty of the method. With as many samples as there are Fourier coefficients the laws hold at the samples to rounding, whatever
# :math:`\varepsilon` is. With more samples they hold on the average, and the answer depends on :math:`\varepsilon` by less than the error
# that the missing harmonics make. The stiffness of the structure is 1 here.

order = 15
penalties = np.logspace(-1, 3, 13)
same = np.array([abs(amplitude(rubbing(order, 2 * order + 1, e))) for e in penalties])
spread = np.ptp(same) / same[0]
print(f"{2 * order + 1} samples: relative spread over four decades of the penalty {spread:.1e}")

moderate = penalties[penalties < 20.0]
more = np.array([abs(amplitude(rubbing(order, 64 * order, e))) for e in moderate])

figure, axes = plt.subplots(layout="constrained")
axes.semilogx(penalties, same / exact - 1.0, "o-", label=f"{2 * order + 1} samples")
axes.semilogx(moderate, more / exact - 1.0, "s-", label=f"{64 * order} samples")
axes.axhline(0.0, color="0.6", linewidth=0.8)
axes.set(xlabel=r"penalty $\varepsilon$ of the method, N/m", ylabel="relative error of the amplitude")
axes.legend()

# %%
# Stiffness of the penalty law. Its motion tends to the rigid one as the root of the flexibility: after each reversal the spring turns
# round before the slider does, which delays the jump of the force by a time of order :math:`k^{-1/2}`. Both end at the error that 63
# harmonics leave; exact events keep errors of sampling out.

order, samples = 63, 2048
limit = amplitude(rubbing(order, samples))
stiffnesses = np.logspace(0, 6, 25)
differences, start = [], limit
for k in stiffnesses:
    interface = ss.Interface(("rub",), (rigid.softened(k),), gap)
    start = amplitude(ss.harmonic.harmonic_balance(linear, interface, order, samples, "events"), start)
    differences.append(abs(abs(start) / exact - 1.0))

figure, axes = plt.subplots(layout="constrained")
axes.loglog(stiffnesses, differences, "o-", label=f"penalty law, H = {order}")
axes.loglog(stiffnesses, differences[0] * (stiffnesses / stiffnesses[0]) ** -0.5, ":", label="$k^{-1/2}$")
axes.axhline(abs(abs(limit) / exact - 1.0), color="C1", label=f"rigid contact, H = {order}")
axes.set(xlabel="tangential stiffness $k$ of the contact, N/m", ylabel="relative error of the amplitude")
axes.legend()
plt.show()
