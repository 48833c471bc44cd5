r"""
A shrouded wheel: friction between neighbouring blades
======================================================

The shrouds of 24 blades are cut at an angle, so that the untwist of the turning blades closes the gaps between them. An engine order shakes the wheel: at small forces the
shrouds stick, at larger ones they slip, take energy out of the vibration and let go of each other's stiffness.

The response is that of one sector, with friction between it and its neighbours. The centrifugal load stiffens the blades, and presses and slides the shrouds before
anything vibrates: the static load is what holds the blades where it takes them without contact.
"""

import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

SECTORS, ENGINE_ORDER, HARMONICS = 24, 6, 5
SPEED = 2 * math.pi * 50  # rad/s

geometry = ss.BladedSector(
    sectors=SECTORS,
    platform=None,
    shroud=ss.model.Shroud(span=0.95, face_angle=math.radians(-30)),
    disk_size=0.03,
    platform_size=0.008,
    airfoil_size=0.015,
)
solid = ss.model.rotating_solid(ss.model.mesh_sector(geometry), ss.Material())
at_rest = ss.reduction.cyclic_sector(solid.structure, SECTORS)
structure = solid.at_speed(SPEED, tie=at_rest.tie)

# %%
# Three nodes of each shroud face carry the contacts: two corners of one side and one of the other. The i-th nodes of both faces are partners.

low, high = (structure.sets[name].reshape(-1, 3) for name in ("shroud_low", "shroud_high"))
x, y, z = structure.dofs.position[low[:, 0]].T
radius = np.hypot(x, y)
size = (radius - radius.mean()) / np.ptp(radius), z / np.ptp(z)
corners = [int(np.argmax(a * size[0] + b * size[1])) for a, b in ((1, 1), (-1, 1), (0, -1))]
tip = structure.sets["tip"][:3]
sets = {
    **structure.sets,
    "left": low[corners].ravel(),
    "right": high[corners].ravel(),
    "point": tip,
}
sector = ss.reduction.cyclic_sector(replace(structure, sets=sets), SECTORS)

# %%
# All blades do the same, one after the other, so one sector is enough. Harmonic h of the vibration travels with the wave number h m; each of these waves is reduced and
# written in the gaps between neighbouring shrouds, which are the only unknowns of the harmonic balance.


def reduced(wave, keep, n_modes):
    """Reduce a travelling wave and damp it."""
    return ss.model.rayleigh_damping(ss.craig_bampton(wave, keep, n_modes), 0.001, (200.0, 1000.0))


gaps = ss.contact.neighbour_gaps(sector.structure, SECTORS, low="left", high="right")
keep = np.concatenate([sets[name] for name in ("left", "right", "point")])
names = tuple(f"shroud.{i + 1}" for i in range(len(corners)))
wheel, operator = ss.reduction.tuned_wheel(
    sector, ENGINE_ORDER, HARMONICS, gaps, keep=keep, n_modes=6, reduce=reduced, names=names
)
law = ss.ElasticCoulomb(k_t=2e4, k_w=2e4, k_n=4e4, mu=0.3)
contacts = ss.Interface(names, (law,) * len(names), operator)
system = ss.System(wheel, contacts, outputs=np.arange(wheel.n))
print(f"{structure.n} dofs of a sector became {wheel.n}; {3 * len(names)} gaps are solved for")

steady = solid.displacement(SPEED, tie=at_rest.tie)  # without the contacts
static = wheel.project(structure.stiffness @ steady, 0).real
at_rest_gaps = ss.preload(system, static)[: 3 * len(names)].reshape(-1, 3)
pressure = np.maximum(0.0, -law.k_n * at_rest_gaps[:, 2])
print(f"the blades move by up to {1e3 * np.abs(steady).max():.2f} mm; normal forces {pressure} N")

# %%
# Two linear limits tell where to look: shrouds that do not touch, and shrouds that stick.

wave = wheel.of_harmonic(1)
springs = np.tile([law.k_t, law.k_w, law.k_n], len(names))
free, stuck = (
    ss.model.natural_frequencies(s, 1)[0]
    for s in (wave, ss.model.with_springs(wave, operator, springs))
)
print(f"engine order {ENGINE_ORDER}: {free:.1f} Hz free, {stuck:.1f} Hz stuck")

# %%
# The response to four engine-order forces. At the largest one harmonic is not enough everywhere, and the Jacobian Alert asks for more. (At twice as much, shrouds lift off,
# higher harmonics meet waves of their own and the response near 260 Hz folds: try 5 N.)

force = np.zeros(structure.n)
force[tip[1]] = 1.0  # N, around the wheel
excitation = wheel.project(force, 1)


def response(newton):
    """Return frequencies in Hz, the amplitude of the tip around the wheel in m/N, and the harmonics of each point."""
    load = ss.HarmonicLoad(static, {1: newton * excitation})
    sweep = ss.Sweep(
        omega_range=(2 * math.pi * 200, 2 * math.pi * 330), low=1, high=HARMONICS, points=20
    )
    problem = ss.response.forced_problem(system, load, sweep)
    rows = []
    for point in ss.response.accepted_points(list(ss.forced_response(system, load, sweep))):
        if point.converged:
            moved = wheel.expand(ss.response.fields(problem, point).outputs[1], 1)
            hertz = point.omega / (2 * math.pi)
            rows.append((hertz, abs(moved[tip[1]]) / newton, point.order))
    return np.array(sorted(rows)).T


figure, axis = plt.subplots(figsize=(7, 4), constrained_layout=True)
for newton in (0.02, 0.2, 1.0, 2.5):
    hertz, amplitude, order = response(newton)
    peak = amplitude.argmax()
    more = np.count_nonzero(order > 1)
    print(
        f"{newton:g} N: peak {amplitude[peak]:.3g} m/N at {hertz[peak]:.1f} Hz, {more} of {order.size} "
        f"points with {HARMONICS} harmonics"
    )
    axis.semilogy(hertz, 1e6 * amplitude, ".-", label=f"{newton:g} N on each blade")
axis.axvline(stuck, color="0.6", linestyle="--", zorder=0)
axis.set(xlabel="excitation frequency (Hz)", ylabel="tip amplitude over force (µm/N)")
axis.set_title(f"Engine order {ENGINE_ORDER} on {SECTORS} shrouded blades")
axis.legend()
plt.show()
