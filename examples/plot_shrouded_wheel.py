r"""
A shrouded wheel: friction between neighbouring blades
======================================================

The shrouds of 24 blades are cut at an angle, so that the untwist of the turning blades presses them together. An engine order shakes the
wheel. At small forces the shrouds stick. At larger ones they slip, take energy out of the vibration and let go of each other's stiffness.

The response is that of one sector, with friction between it and its neighbours. `examples/shrouded_sector` is a study file of such a wheel.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

geometry = ss.BladedSector(
    sectors=24,
    platform=None,
    shroud=ss.model.Shroud(span=0.95, face_angle=math.radians(-30)),
    disk_size=0.03,
    platform_size=0.012,
    airfoil_size=0.015,
)
blade = ss.model.solid_part(
    ss.model.mesh_sector(geometry),
    ss.Material(),
    sectors=geometry.sectors,
    reduction=ss.reduction.Reduction(12),
    damping=ss.model.Damping(ratio=0.001, between_hz=(200.0, 1000.0)),
)

# %%
# The shroud of each sector meets that of the next one. Stiffnesses are those of a whole face.

law = ss.ElasticCoulomb(k_t=6e4, k_w=6e4, k_n=12e4, mu=0.3)
faces = ("blade.shroud_high", "next.blade.shroud_low")


def wheel(newton):
    """The wheel under an engine-order force on each blade, at 3000 rpm."""
    gas = ss.Load(on="blade.tip", newton=newton, direction=(0, 1, 0), engine_order=6)
    return ss.Model(
        parts={"blade": blade},
        contacts={"shroud": ss.Contact(between=faces, law=law, share="interface")},
        loads={"gas": gas},
        outputs=(ss.Output(name="tip", on="blade.tip"),),
        speed=2 * math.pi * 50,
    )


# %%
# Two linear limits tell where to look: shrouds that do not touch, and shrouds that stick.

free, stuck = (
    wheel(1.0).modes(number=1, nodal_diameters=[6], contacts=c).data["modes"].frequency_hz.item()
    for c in ("open", "stuck")
)
print(f"six nodal diameters: {free:.1f} Hz free, {stuck:.1f} Hz stuck")

# %%
# The response to four forces. Amplitude over force falls and moves down as the shrouds slip.

figure, axis = plt.subplots(figsize=(7, 4), constrained_layout=True)
peaks = []
for newton in (0.02, 0.2, 1.0, 2.5):
    model = wheel(newton)
    result = model.forced_response(hz=(200, 330), points=20, stability="off")
    table = result.to_dataframe().query("output == 'tip.y'").sort_values("frequency_hz")
    axis.semilogy(table.frequency_hz, 1e6 * table.amplitude / newton, ".-", label=f"{newton:g} N on each")
    peaks.append((newton, result.peaks["frequency (Hz)"][0], table.amplitude.max() / newton))
    print("{:g} N: {:.1f} Hz, {:.3g} m/N".format(*peaks[-1]))
axis.axvline(stuck, color="0.6", linestyle="--", zorder=0)
axis.set(xlabel="excitation frequency (Hz)", ylabel="tip amplitude over force (µm/N)")
axis.set_title("Engine order 6 on 24 shrouded blades")
axis.legend()
plt.show()
assert np.argmin([p for *_, p in peaks]) > 0
