r"""
A bladed disk from one sector
=============================

A wheel of 24 blades with shrouds, computed from one of its sectors: geometry and mesh, the natural frequencies by nodal
diameter at rest and at speed, and one mode of the whole wheel. No solver and no mesh of your own is needed.

It uses the layers below ``ss.Model``, to show the sector, its waves and their shapes. With ``ss.Model`` the same is asked by ``model.modes()``.
"""

import matplotlib.pyplot as plt
import numpy as np
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import stickslip as ss

shroud = ss.model.Shroud(gap=0.0004)  # 0.4 mm: the shrouds do not touch
sizes = {"disk_size": 0.020, "platform_size": 0.012, "airfoil_size": 0.015}
wheel = ss.BladedSector(sectors=24, shroud=shroud, **sizes)
mesh = ss.model.mesh_sector(wheel)
print(f"{len(mesh.points)} nodes, {len(mesh.cells)} second-order tetrahedra")


# %%
# The mesher names the faces. Those at minus and plus half the pitch match node by node, so that one is the other, turned;
# so do the side faces of the platforms and the contact faces of the shrouds, where neighbours meet.


def draw(axes, points, triangles, colors, **view):
    """Draw a skin, `triangles` (k, 3) of `points` (n, 3), with true proportions."""
    paint = {"facecolors": colors, "edgecolors": "#0004", "linewidths": 0.2}
    axes.add_collection3d(Poly3DCollection(points[triangles], **paint))
    low, high = points.min(axis=0), points.max(axis=0)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(high - low, zoom=1.1)
    axes.view_init(**view)
    axes.set_axis_off()


skin = mesh.surface
paint = {"root": "black", "cyclic": "tab:blue", "platform": "tab:red", "shroud": "tab:orange"}
colors = np.full(len(skin), "lightgrey", dtype=object)
for name, nodes in mesh.node_sets.items():
    family = name.split("_")[0]
    if family in paint:
        colors[np.isin(skin, nodes).all(axis=1)] = paint[family]
figure = plt.figure(figsize=(8, 3.5), layout="constrained")
for place, azim in ((121, -60), (122, 140)):
    axes = figure.add_subplot(place, projection="3d")
    draw(axes, mesh.points, skin, colors, elev=25, azim=azim)
for family, color in paint.items():
    figure.gca().scatter([], [], [], color=color, label=family)
figure.legend(loc="upper center", ncols=len(paint))

# %%
# Frequencies come from the travelling waves of one sector. Rotation stiffens the blades: the centrifugal load is solved
# first, and the tangent at that state gives the frequencies at speed.

solid = ss.model.rotating_solid(mesh, ss.Material(), quadrature=ss.model.Quadrature.calculix())
sector = ss.reduction.cyclic_sector(solid.structure, wheel.sectors)
speed = 8000 * 2 * np.pi / 60
turning = ss.reduction.cyclic_sector(solid.at_speed(speed, tie=sector.tie), wheel.sectors)
at_rest = ss.response.nodal_diameter_map(sector, 5, shapes=True)
at_speed = ss.response.nodal_diameter_map(turning, 5)

figure, axes = plt.subplots(layout="constrained")
rest = axes.plot(at_rest.nodal_diameters, at_rest.frequencies_hz, "o-", color="tab:blue")
spun = axes.plot(at_speed.nodal_diameters, at_speed.frequencies_hz, "s--", color="tab:orange")
axes.legend([rest[0], spun[0]], ["at rest", "at 8000 rpm"])
axes.set(xlabel="nodal diameter", ylabel="natural frequency, Hz", title="Nodal-diameter map")

# %%
# Where a line is level, blades vibrate on a disk that stands still; where it climbs, the disk moves with them. A mode of
# one sector is a wave around the wheel. Here is the third family with two nodal diameters, coloured by the displacement
# along the axis: nothing moves that way on the two lines across.

nodal_diameter, family = 2, 2
row = at_rest.row(nodal_diameter)
motion = ss.reduction.wheel_shape(sector, nodal_diameter, at_rest.shapes[row][:, family]).real
field = np.zeros((wheel.sectors, *mesh.points.shape))
field[:, solid.free] = motion.reshape(wheel.sectors, -1, 3)
field = field.reshape(-1, 3) / np.abs(field).max()
axis = ss.model.Axis()
points = np.concatenate([axis.turned(mesh.points, n * wheel.pitch) for n in range(wheel.sectors)])
inside = [np.isin(skin, mesh.node_sets[f"cyclic_{side}"]).all(axis=1) for side in ("low", "high")]
outer = skin[~(inside[0] | inside[1])]
triangles = np.concatenate([outer + n * len(mesh.points) for n in range(wheel.sectors)])
along = field[triangles, 2].mean(axis=1)
figure = plt.figure(figsize=(7, 6), layout="constrained")
hues = plt.get_cmap("coolwarm")((along / np.abs(along).max() + 1) / 2)
draw(figure.add_subplot(projection="3d"), points + 0.03 * field, triangles, hues, elev=50, azim=-60)
frequency = at_rest.frequencies_hz[row, family]
figure.suptitle(f"Two nodal diameters, {frequency:.1f} Hz")
plt.show()
