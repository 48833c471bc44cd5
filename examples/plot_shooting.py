r"""
Shooting: the motion without its transient, and its stability
=============================================================

`shoot` finds the periodic motion that time integration would settle to, and says how fast a small disturbance of it
dies: its Floquet multipliers. The blade is one mass on a spring, with a friction damper pressed against it.

It uses the layers below ``ss.Model``, to show time integration over single periods and its multipliers.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %%
# A blade of 0.1 kg, tuned to 50 Hz, and a damper of constant pressure: no normal stiffness, a preload of 20 N,
# friction 0.3.

blade = ss.model.lumped(np.array([0.1]), np.array([[1e4]]), damping=np.array([[0.2]]), names=("blade",))
law = ss.ElasticCoulomb(k_t=5e3, k_w=0.0, k_n=0.0, mu=0.3, preload=20.0)
damper = ss.Interface(("damper",), (law,), np.array([[1.0], [0.0], [0.0]]))  # gaps t, w, n
system = ss.System(blade, damper, outputs=blade.sets["blade"])


def shaker(force):
    """Return a load without a static part and with one harmonic, N."""
    return ss.HarmonicLoad(np.zeros(1), {1: np.array([force + 0j])})


# %%
# First the harmonic balance: a forced response, of which the highest point is taken.

load = shaker(4.0)
sweep = ss.Sweep(omega_range=(250.0, 450.0), frequencies=41, selection="always_high")
problem = ss.response.forced_problem(system, load, sweep)
points = ss.response.accepted_points(list(ss.forced_response(system, load, sweep)))
peak = max(points, key=lambda point: abs(ss.response.fields(problem, point).outputs[1, 0]))
balance = ss.response.fields(problem, peak).outputs[1, 0]

# %%
# Its state at t = 0 is where shooting begins: displacements of all dofs, and the forces in the contacts' tangential
# springs. (Without a start it begins at rest, which needs more periods and, where several motions exist, may find another.)

motion = problem.low.linear.recover(peak.omega, peak.coefficients)  # (harmonics, all dofs)
start = ss.response.start_from_harmonics(motion, peak.omega, damper.gap_operator, damper.laws)


def shot(load, omega, start=None):
    """Shoot with the blade and its damper."""
    return ss.response.shoot(system.structure, damper.gap_operator, damper.laws, load, omega, system.outputs, start)


found = shot(load, peak.omega, start)
first = found.harmonics[1, 0]
print(f"{found.status} after {found.periods} periods, {found.corrections} of them with tangents")
print(f"amplitude {abs(first):.6e} m, by the balance {abs(balance):.6e} m")
print(f"stable: {found.stable}; sizes of the multipliers: {np.abs(found.floquet.multipliers)}")

# %%
# The multipliers of small and large forces, each motion the start of the next one. While the damper sticks, one
# multiplier is 1 (its residual traction, which nothing changes: `neutral`), and the others are those of the weak viscous
# damping, :math:`e^{-cT/2m}` = 0.982 in size. Where it slips, the traction is forgotten within a period (multiplier 0)
# and friction damps disturbances of the motion, most of all at small slip.

forces = np.geomspace(0.5, 40.0, 41)
sizes, amplitudes, state = [], [], None
for force in forces:
    result = shot(shaker(force), peak.omega, state)
    state = result.final
    sizes.append(np.sort(np.abs(result.floquet.multipliers))[::-1])
    amplitudes.append(abs(result.harmonics[1, 0]) if result.converged else np.nan)

figure, (above, below) = plt.subplots(2, 1, sharex=True, layout="constrained", figsize=(6.4, 6.4))
above.semilogx(forces, np.array(amplitudes) / forces * 1e3, "o-", ms=3)
above.set(ylabel="amplitude over force, mm/N", title=f"{peak.omega:.1f} rad/s")
largest = np.array(sizes).T[:3]  # the fourth is that of the direction across, which has no stiffness: 0
for column, name in zip(largest, ("largest", "second", "third"), strict=True):
    below.semilogx(forces, column, "o-", ms=3, label=name)
below.axhline(1.0, color="0.6", lw=0.8)
below.set(xlabel="force, N", ylabel="size of the Floquet multipliers")
below.legend()
plt.show()
