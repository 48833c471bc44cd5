r"""
Non-matching meshes: the patch test
===================================

Two elastic blocks lie on each other and are pressed by 1 MPa. The pressure between them is 1 MPa everywhere, whatever the meshes. This example presses two blocks whose
meshes do not match through contact springs, once with the nodes of one side projected on the facets of the other, and once with quadrature points on the pieces that
facets of both sides have in common.

It uses the layers below ``ss.Model``, to show contact operators between meshes.
"""

import matplotlib.pyplot as plt
import numpy as np
import scipy.sparse.linalg
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

import stickslip as ss

# pressure in Pa; springs in N/m³, which give way by 1/200 of what a block is compressed
young, poisson, pressure, per_area = 210e9, 0.3, 1e6, 4e13

# %%
# A block of hexahedra, its stiffness with node-major coordinates, and the facets of one of its faces.


def block(divisions, z):
    """Return points, stiffness and loads of a unit pressure on the top of a block of side 1 m."""
    x, y = (np.linspace(0.0, 1.0, n + 1) for n in divisions)
    mesh, element = skfem.MeshHex.init_tensor(x, y, z), skfem.ElementVector(skfem.ElementHex1())
    basis = skfem.Basis(mesh, element)
    order = basis.nodal_dofs.T.ravel()
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    top = mesh.facets_satisfying(lambda p: p[2] > z[-1] - 1e-9)
    over = skfem.FacetBasis(mesh, element, facets=top)
    push = skfem.LinearForm(lambda v, _: -v[2]).assemble(over)
    return mesh.p.T, stiffness[order][:, order], push[order]


def interface_side(points, offset, n_dofs, *, upward):
    """Return the face in z = 0 as a contact surface."""
    nodes = np.flatnonzero(np.abs(points[:, 2]) < 1e-9)
    nodes = nodes[np.lexsort((points[nodes, 1], points[nodes, 0]))]
    grid = np.arange(len(nodes)).reshape(len(np.unique(points[nodes, 0])), -1)
    corners = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    quads = np.stack(corners, axis=-1).reshape(-1, 4)
    facets = quads if upward else quads[:, ::-1]
    return ss.contact.nodal_surface(points[nodes], offset + 3 * nodes[:, None] + np.arange(3), n_dofs, facets)


lower, K_lower, push_lower = block((4, 4), np.linspace(-1.0, 0.0, 4))
upper, K_upper, push_upper = block((6, 5), np.linspace(0.0, 1.0, 4))
n_dofs = lower.size + upper.size
stiffness = scipy.sparse.block_diag([K_lower, K_upper], format="csr")
load = np.concatenate([0 * push_lower, pressure * push_upper])
points = np.vstack([lower, upper])
held = np.abs(points - points.min(axis=0)) < 1e-9  # three planes of symmetry
free = np.flatnonzero(~held.ravel())

side_a = interface_side(lower, 0, n_dofs, upward=True)
side_b = interface_side(upper, lower.size, n_dofs, upward=False)

# %%
# Contact springs per area, stuck: the linear problem.


def contact_pressure(pairing):
    """Return the pressure at the points of a pairing, in units of the one applied."""
    B = pairing.gap_operator
    springs = scipy.sparse.diags_array(np.repeat(per_area * pairing.weights, 3))
    K = (stiffness + B.T @ springs @ B).tocsc()
    u = np.zeros(n_dofs)
    u[free] = scipy.sparse.linalg.spsolve(K[free][:, free], load[free])
    return -per_area * (B @ u)[2::3] / pressure


figure, axes = plt.subplots(1, 2, figsize=(9, 4), sharey=True, layout="constrained")
errors = {}
ways = ss.contact.node_to_segment, ss.contact.segment_to_segment
for ax, way in zip(axes, ways, strict=True):
    name, pairing = way.__name__.replace("_", " "), way(side_a, side_b)
    found = contact_pressure(pairing)
    errors[name] = np.abs(found - 1.0).max()
    for side, style in ((side_a, "0.6"), (side_b, "0.8")):
        for quad in side.facets:
            ax.plot(*side.points[[*quad, quad[0]], :2].T, color=style, lw=0.8, zorder=0)
    x, y, _ = pairing.positions.T
    dots = ax.scatter(x, y, c=found, s=20, cmap="RdBu_r", vmin=0.6, vmax=1.4, ec="0.3", lw=0.4)
    title = f"{name}, {pairing.n_points} points\nlargest error {100 * errors[name]:.2g} %"
    ax.set(title=title, xlabel="x, m", aspect="equal")
figure.colorbar(dots, ax=axes, label="contact pressure / applied pressure")

# %%
# Segments pass the pressure to rounding; the nodes do not, because their forces reach the other side at one point each.

assert errors["segment to segment"] < 1e-9
assert errors["node to segment"] > 0.1
plt.show()
