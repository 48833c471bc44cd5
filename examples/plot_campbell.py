r"""
Campbell diagram
================

A blade stiffens as it turns. Where a multiple of the speed of rotation meets one of its frequencies it may resonate. The
Campbell diagram shows at which speeds.

It uses the layers below ``ss.Model``, to show a structure that is a function of the speed. With ``ss.Model`` the same is asked by ``model.campbell()``.
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
lag = ss.model.Beam(length, width * thickness, thickness * width**3 / 12, titanium, shear_coefficient=5 / 6)


def blade(speed: float) -> ss.Structure:
    """Flap beside lag with stretching, at a speed in rad/s."""
    return ss.model.join(
        flap=ss.model.rotating_beam(flap, 20, speed, hub_radius=hub),
        lag=ss.model.rotating_beam(lag, 20, speed, hub_radius=hub, bending="y", axial=True, coriolis=True),
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
        f" {order}", (speeds[-1] / rpm, diagram.engine_order_hz(order)[-1]), color="0.5", annotation_clip=True
    )
for mode in range(4):
    axes.plot(speeds / rpm, diagram.frequencies_hz[:, mode], marker=".", label=f"mode {mode + 1}")
at = [(c.speed / rpm, c.frequency_hz) for c in diagram.crossings]
axes.plot(*np.transpose(at), "o", color="black", fillstyle="none", label="crossings")
axes.set(
    xlabel="speed, rpm",
    ylabel="frequency, Hz",
    title="Campbell diagram of a blade",
    xlim=(0, 9300),
    ylim=(0, 1.1 * diagram.frequencies_hz.max()),
)
axes.legend()
plt.show()
