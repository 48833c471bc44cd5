r"""
A shrouded wheel: friction between neighbouring blades
======================================================

The shrouds of twelve blades are cut at an angle, so that the untwist of the turning blades presses them together. An engine order shakes the wheel: at small forces the
shrouds stick, at larger ones they slip at the resonance and take energy out of it.

The response is that of one sector, with friction between it and its neighbours. The centrifugal load stiffens the blades, and
presses and slides the shrouds before anything vibrates: the static load is what holds the blades where it takes them without contact.
"""

import math
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

SECTORS, ENGINE_ORDER, HARMONICS = 12, 4, 5
SPEED = 2 * math.pi * 60  # rad/s

geometry = ss.BladedSector(
    sectors=SECTORS,
    platform=None,
    shroud=ss.Shroud(span=0.95, face_angle=math.radians(-30)),
    disk_size=0.03,
    platform_size=0.013,
    airfoil_size=0.02,
)
solid = ss.rotating_solid(ss.mesh_sector(geometry), ss.Material())
at_rest = ss.cyclic_sector(solid.structure, SECTORS)
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
sector = ss.cyclic_sector(replace(structure, sets=sets), SECTORS)

# %%
# All blades do the same, one after the other, so one sector is enough. Harmonic h of the vibration travels with the wave number h m; each of these waves is reduced and
# written in the gaps between neighbouring shrouds, which are the only unknowns of the harmonic balance.


def reduced(wave, keep, n_modes):
    """Reduce a travelling wave and damp it."""
    return ss.rayleigh_damping(ss.craig_bampton(wave, keep, n_modes), 0.001, (100.0, 1000.0))


gaps = ss.neighbour_gaps(sector.structure, SECTORS, low="left", high="right")
keep = np.concatenate([sets[name] for name in ("left", "right", "point")])
names = tuple(f"shroud.{i + 1}" for i in range(len(corners)))
wheel, operator = ss.tuned_wheel(
    sector, ENGINE_ORDER, HARMONICS, gaps, keep=keep, n_modes=6, reduce=reduced, names=names
)
law = ss.ElasticCoulomb(k_t=1e5, k_w=1e5, k_n=2e5, mu=0.3)
contacts = ss.Interface(names, (law,) * len(names), operator)
system = ss.System(wheel, contacts, outputs=np.arange(wheel.n))
print(f"{structure.n} dofs of a sector became {wheel.n}; {3 * len(names)} gaps are solved for")

steady = solid.displacement(SPEED, tie=at_rest.tie)  # without the contacts
static = wheel.project(structure.stiffness @ steady, 0).real
force = np.zeros(structure.n)
force[tip[1]] = 1.0  # N, around the wheel
excitation = wheel.project(force, 1)

# %%
# The response to three engine-order forces. At 60 N one harmonic would see a quarter of the peak: the normal force changes as much as the friction it allows. The Jacobian
# Alert asks for more there.


def response(newton):
    """Return frequencies in Hz and the amplitude of the tip around the wheel, in m/N."""
    load = ss.HarmonicLoad(static, {1: newton * excitation})
    sweep = ss.Sweep(
        omega_range=(2 * math.pi * 340, 2 * math.pi * 440), low=1, high=HARMONICS, points=20
    )
    problem = ss.forced_problem(system, load, sweep)
    hertz, amplitude = [], []
    for point in ss.accepted_points(list(ss.forced_response(system, load, sweep))):
        if point.converged:
            moved = wheel.expand(ss.fields(problem, point).outputs[1], 1)
            hertz.append(point.omega / (2 * math.pi))
            amplitude.append(abs(moved[tip[1]]) / newton)
    order = np.argsort(hertz)
    return np.array(hertz)[order], np.array(amplitude)[order]


figure, axis = plt.subplots(figsize=(7, 4), constrained_layout=True)
for newton in (5.0, 20.0, 60.0):
    hertz, amplitude = response(newton)
    print(f"{newton:g} N: peak {amplitude.max():.3g} m/N at {hertz[amplitude.argmax()]:.1f} Hz")
    axis.semilogy(hertz, 1e6 * amplitude, ".-", label=f"{newton:g} N on each blade")
axis.set(xlabel="excitation frequency (Hz)", ylabel="tip amplitude over force (µm/N)")
axis.set_title(f"Engine order {ENGINE_ORDER} on {SECTORS} shrouded blades")
axis.legend()
plt.show()
