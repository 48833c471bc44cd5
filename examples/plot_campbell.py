r"""
Campbell and SAFE diagrams
==========================

A blade stiffens as it turns. Where a multiple of the speed of rotation meets one of its frequencies it may resonate: the
Campbell diagram shows at which speeds. On a wheel of equal blades more is needed, for the excitation must have the shape of
the mode as well: that is what a SAFE diagram adds.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

# %%
# A titanium blade as a beam on a hub. It vibrates out of the plane of rotation (flap) and within it (lag); lag and stretching
# are coupled by Coriolis forces. Both directions side by side are one structure.

titanium = ss.Material(young_modulus=114e9, poisson_ratio=0.33, density=4430.0)
width, thickness, length, hub = 0.054, 0.008, 0.35, 0.25
flap = ss.model.Beam(length, width * thickness, width * thickness**3 / 12, titanium)
lag = ss.model.Beam(
    length, width * thickness, thickness * width**3 / 12, titanium, shear_coefficient=5 / 6
)


def blade(speed: float) -> ss.Structure:
    """Flap beside lag with stretching, at a speed in rad/s."""
    return ss.model.join(
        flap=ss.model.rotating_beam(flap, 20, speed, hub_radius=hub),
        lag=ss.model.rotating_beam(
            lag, 20, speed, hub_radius=hub, bending="y", axial=True, coriolis=True
        ),
    )


rpm = 2 * np.pi / 60
speeds = np.linspace(0.0, 9000.0, 19) * rpm
diagram = ss.response.campbell(blade, speeds, 4, engine_orders=(1, 2, 3, 4, 6, 8), coriolis=True)
for crossing in diagram.crossings:
    print(
        f"order {crossing.engine_order} meets mode {crossing.mode + 1} at {crossing.speed / rpm:.1f} rpm, "
        f"{crossing.frequency_hz:.2f} Hz"
    )

# %%
# Modes keep their colour where they cross: they are followed by shape.

figure, axes = plt.subplots(layout="constrained")
for order in diagram.engine_orders:
    axes.plot(speeds / rpm, diagram.engine_order_hz(order), color="0.75", linewidth=1)
    axes.annotate(
        f" {order}",
        (speeds[-1] / rpm, diagram.engine_order_hz(order)[-1]),
        color="0.5",
        annotation_clip=True,
    )
for mode in range(4):
    axes.plot(speeds / rpm, diagram.frequencies_hz[:, mode], marker=".", label=f"mode {mode + 1}")
at = [(c.speed / rpm, c.frequency_hz) for c in diagram.crossings]
axes.plot(*np.transpose(at), "o", color="black", fillstyle="none", label="crossings")
axes.set(
    xlabel="speed, rpm", ylabel="frequency, Hz", title="Campbell diagram of a blade",
    xlim=(0, 9300), ylim=(0, 1.1 * diagram.frequencies_hz.max()),
)  # fmt: skip
axes.legend()

# %%
# A blisk of 24 blades (Laxalde et al. 2007), each three masses on springs. At one speed the engine orders 0, 1, 2, ... lie on a
# line that turns at twelve nodal diameters: order 22 has the shape of two. A resonance needs a mode *on* the line.

disk, root, tip, next_disk = np.eye(4)  # the last one is a copy, without mass, of the neighbour's
springs = [(6e5, disk), (5e7, disk - next_disk), (1e6, disk - root), (2e6, root - tip)]
sector = ss.Structure(
    np.diag([1.2, 0.35, 0.25, 0.0]),
    np.zeros((4, 4)),
    sum(k * np.outer(pulled, pulled) for k, pulled in springs),
    ss.model.Dofs(np.arange(4), ("x",) * 4, np.zeros((4, 3))),
)
wheel = ss.reduction.CyclicSector(sector, 24, low=np.array([0]), high=np.array([3]), axis=None)
map_ = ss.response.nodal_diameter_map(wheel, 3)
low, high = 1650 * rpm, 1780 * rpm
found = ss.response.safe(map_, (low, high), engine_orders=range(1, 25), margin=0.0)
for near in found.resonances:
    print(
        f"order {near.engine_order} meets family {near.mode + 1} with {near.nodal_diameter} nodal diameters at "
        f"{near.speed / rpm:.0f} rpm"
    )

figure, axes = plt.subplots(layout="constrained")
for family in range(3):
    axes.plot(
        map_.nodal_diameters, map_.frequencies_hz[:, family], "o-", label=f"family {family + 1}"
    )
diameters, lowest = found.speed_line(low)
_, highest = found.speed_line(high)
axes.fill_between(diameters, lowest, highest, color="0.85", label="1650 to 1780 rpm")
for number, near in enumerate(found.resonances):
    label = "resonance" if number == 0 else None
    axes.plot(
        near.nodal_diameter,
        near.frequency_hz,
        "s",
        color="black",
        fillstyle="none",
        markersize=11,
        label=label,
    )
axes.set(
    xlabel="nodal diameters",
    ylabel="frequency, Hz",
    title="SAFE diagram of a blisk",
    xticks=range(13),
    ylim=(0, 900),
)
axes.legend()
