r"""
Non-matching meshes: the patch test
===================================

Two elastic blocks lie on each other and are pressed by 1 MPa. The pressure between them is 1 MPa everywhere, whatever the meshes. This example presses two blocks whose
meshes do not match through contact springs, once with the nodes of one side projected on the facets of the other, and once with quadrature points on the pieces that
facets of both sides have in common.
"""

import matplotlib.pyplot as plt
import numpy as np
import scipy.sparse
import scipy.sparse.linalg
import skfem
from skfem.models.elasticity import lame_parameters, linear_elasticity

import stickslip as ss

young, poisson, pressure = 210e9, 0.3, 1e6
per_area = 4e13  # N/m³; the springs give way by 1/200 of what a block is compressed

# %%
# A block of hexahedra, its stiffness with node-major coordinates, and the facets of one of its faces.


def block(divisions, z):
    """Return points, stiffness and loads of a unit pressure on the top of a block of side 1 m."""
    x, y = (np.linspace(0.0, 1.0, n + 1) for n in divisions)
    mesh = skfem.MeshHex.init_tensor(x, y, z)
    element = skfem.ElementVector(skfem.ElementHex1())
    basis = skfem.Basis(mesh, element)
    order = basis.nodal_dofs.T.ravel()
    stiffness = linear_elasticity(*lame_parameters(young, poisson)).assemble(basis)
    top = mesh.facets_satisfying(lambda p: p[2] > z[-1] - 1e-9)
    push = skfem.LinearForm(lambda v, _: -v[2]).assemble(
        skfem.FacetBasis(mesh, element, facets=top)
    )
    return mesh.p.T, stiffness[order][:, order], push[order]


def interface_side(points, offset, n_dofs, *, upward):
    """Return the face in z = 0 as a contact surface."""
    nodes = np.flatnonzero(np.abs(points[:, 2]) < 1e-9)
    nodes = nodes[np.lexsort((points[nodes, 1], points[nodes, 0]))]
    grid = np.arange(len(nodes)).reshape(len(np.unique(points[nodes, 0])), -1)
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1)
    quads = quads.reshape(-1, 4)
    dofs = offset + 3 * nodes[:, None] + np.arange(3)
    return ss.contact.nodal_surface(
        points[nodes], dofs, n_dofs, quads if upward else quads[:, ::-1]
    )


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
for ax, (name, way) in zip(
    axes,
    {
        "node to segment": ss.contact.node_to_segment,
        "segment to segment": ss.contact.segment_to_segment,
    }.items(),
    strict=True,
):
    pairing = way(side_a, side_b)
    found = contact_pressure(pairing)
    errors[name] = np.abs(found - 1.0).max()
    for side, style in ((side_a, "0.6"), (side_b, "0.8")):
        for quad in side.facets:
            ax.plot(*side.points[[*quad, quad[0]], :2].T, color=style, lw=0.8, zorder=0)
    x, y, _ = pairing.positions.T
    size = 6 + 100 * pairing.weights / pairing.weights.max() * (name == "node to segment")
    dots = ax.scatter(x, y, c=found, s=size, cmap="RdBu_r", vmin=0.6, vmax=1.4, ec="0.3", lw=0.4)
    ax.set(title=f"{name}, {pairing.n_points} points\nlargest error {100 * errors[name]:.2g} %")
    ax.set(xlabel="x, m", aspect="equal")
axes[0].set_ylabel("y, m")
figure.colorbar(dots, ax=axes, label="contact pressure / applied pressure")

# %%
# Segments pass the pressure to rounding; the nodes do not, because their forces reach the other side at one point each.

assert errors["segment to segment"] < 1e-9
assert errors["node to segment"] > 0.1

# %%
# Springs as soft as real joints hide part of the error, and so does a finer mesh on side A. What remains is the difference between a consistent load and one
# that sits on points.

figure, ax = plt.subplots(layout="constrained")
stiffnesses = np.logspace(10, 15, 11)
for name, way in {
    "node to segment, coarse side": (side_a, side_b),
    "node to segment, fine side": (side_b, side_a),
}.items():
    pairing = ss.contact.node_to_segment(*way)
    largest = []
    for value in stiffnesses:
        per_area = value
        largest.append(100 * np.abs(contact_pressure(pairing) - 1.0).max())
    ax.loglog(stiffnesses, largest, "o-", label=name)
ax.set(xlabel="contact stiffness per area, N/m³", ylabel="largest error of the pressure, %")
ax.legend()
plt.show()
