r"""
SAFE diagram
============

On a wheel of equal blades a resonance needs more than a frequency: the excitation must have the shape of the mode as well. A
SAFE diagram shows both.

It uses the layers below ``ss.Model``, to show the waves of a wheel as matrices. With ``ss.Model`` the same is asked by ``model.safe()``.
"""

import matplotlib.pyplot as plt
import numpy as np

import stickslip as ss

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
rpm = 2 * np.pi / 60
low, high = 1650 * rpm, 1780 * rpm
found = ss.response.safe(map_, (low, high), engine_orders=range(1, 25), margin=0.0)
for near in found.resonances:
    print(
        f"order {near.engine_order} meets family {near.mode + 1} with {near.nodal_diameter} nodal diameters at "
        f"{near.speed / rpm:.0f} rpm"
    )

figure, axes = plt.subplots(layout="constrained")
for family in range(3):
    axes.plot(map_.nodal_diameters, map_.frequencies_hz[:, family], "o-", label=f"family {family + 1}")
diameters, lowest = found.speed_line(low)
_, highest = found.speed_line(high)
axes.fill_between(diameters, lowest, highest, color="0.85", label="1650 to 1780 rpm")
for number, near in enumerate(found.resonances):
    label = "resonance" if number == 0 else None
    axes.plot(near.nodal_diameter, near.frequency_hz, "s", color="black", fillstyle="none", markersize=11, label=label)
axes.set(
    xlabel="nodal diameters", ylabel="frequency, Hz", title="SAFE diagram of a blisk", xticks=range(13), ylim=(0, 900)
)
axes.legend()
plt.show()
