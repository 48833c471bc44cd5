"""Rotating elastic solids: centrifugal load, static displacement under it, and matrices of small vibrations about this state.

In axes that turn with the solid, ``M ü + (C + 2 Ω G) u̇ + K(Ω) u = f``.
"""

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from typing import Literal

import numpy as np
import scipy

from stickslip.arrays import BoolArray, FloatArray, IntArray, Matrix
from stickslip.errors import SingularError, StickslipError, did_you_mean, input_error
from stickslip.model.axis import Axis
from stickslip.model.fe.cell_laws import CellLaws, Temperature, cell_laws, laws_of_group
from stickslip.model.fe.cell_matrices import hourglass_stiffness, inertia
from stickslip.model.fe.elements import EXACT, CellGroup, NodeBlocks, Rules, cell_groups
from stickslip.model.fe.factorisation import factorise
from stickslip.model.fe.links import Links
from stickslip.model.fe.material import Materials
from stickslip.model.fe.prestress import PrestressTerms, internal_force, prestress_terms, thermal_force
from stickslip.model.fe.solid import integrate, node_dofs, support
from stickslip.model.mesh.solid_mesh import SolidMesh
from stickslip.model.structure import Structure

Tangent = Literal["consistent", "textbook", "nonlinear"]
TANGENTS = ("consistent", "textbook", "nonlinear")
Z_AXIS = Axis()
NEWTON_STEPS = 25
BALANCED = 1e-10  # residual of the nonlinear statics as a fraction of the centrifugal load


@dataclass(frozen=True, eq=False)
class SpeedPolynomial:
    """A stiffness that is a polynomial of the speed: ``rest + Ω² square + Ω⁴ fourth``.

    Parameters
    ----------
    rest, square, fourth
        (n, n) CSR matrices in N/m, N s²/m, N s⁴/m; `fourth` is None if zero.
    """

    rest: Matrix
    square: Matrix
    fourth: Matrix | None = None

    def at(self, speed: float) -> Matrix:
        """Return the stiffness in N/m at `speed` in rad/s."""
        stiffness = self.rest + speed**2 * self.square
        if self.fourth is not None:
            stiffness = stiffness + speed**4 * self.fourth
        return scipy.sparse.csr_array(stiffness)

    def by_square(self, speed: float) -> Matrix:
        """Return the derivative of the stiffness with respect to Ω², in N s²/m, at `speed` in rad/s."""
        return self.square if self.fourth is None else self.square + 2.0 * speed**2 * self.fourth


@dataclass(frozen=True, eq=False)
class RotatingSolid:
    """An elastic solid that rotates about an axis; `rotating_solid` makes one.

    Parameters
    ----------
    structure
        The solid at rest.
    mesh, material, axis, quadrature
        Arguments of `rotating_solid`.
    moving
        (n,) position of each dof among the x, y, z of all nodes, node-major.
    nodal_mass
        (nodes, nodes) ``∫ ρ N_i N_j`` in kg, without bricks that have incompatible modes; with point masses.
    centrifugal
        (n,) centrifugal load at 1 rad/s, in N s².
    followers
        (3 nodes, n) CSR from the dofs to the x, y, z of all nodes, some of which follow others by equations; None if none does.
    small
        As in `Links`.
    point_mass
        (nodes,) point masses in kg, which `nodal_mass` includes; None if there are none.
    temperature
        Temperatures of the nodes; None: no thermal strain.
    """

    structure: Structure
    mesh: SolidMesh
    material: Materials
    axis: Axis
    quadrature: Rules
    moving: IntArray
    nodal_mass: Matrix
    centrifugal: FloatArray
    followers: Matrix | None = None
    small: str = ""
    temperature: Temperature | None = None
    point_mass: FloatArray | None = None
    _displacements: dict[str, FloatArray] = field(default_factory=dict, init=False, repr=False)
    _polynomials: dict[tuple[str, str], SpeedPolynomial] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def spin_softening(self) -> Matrix:
        """(n, n) S in kg; rotation subtracts ``Ω² S`` from the stiffness."""
        perpendicular = -self.axis.cross @ self.axis.cross
        return self._of_mass(perpendicular)

    @cached_property
    def coriolis(self) -> Matrix:
        """(n, n) skew G in kg; rotation adds ``2 Ω G`` to the damping."""
        return self._of_mass(self.axis.cross)

    def _of_mass(self, block: FloatArray) -> Matrix:
        """Return the matrix with `block` (3, 3), times the nodal mass, for each pair of nodes."""
        whole = scipy.sparse.kron(self.nodal_mass, block, format="csr")
        return self._of_dofs(with_inner_inertia(whole, self.laws, self.quadrature, block))

    @cached_property
    def hourglass(self) -> Matrix | None:
        """(n, n) share of hourglass control in the stiffness at rest; None without bricks of one integration point."""
        groups = [group for group in self.cell_groups if group.rule.hourglass is not None]
        if not groups:
            return None
        parts = (hourglass_stiffness(group, laws_of_group(self.laws, group.mesh, group.rows)) for group in groups)
        return self._of_dofs(sum(parts))

    @cached_property
    def laws(self) -> CellLaws:
        """Materials of the cells at the temperature."""
        return cell_laws(self.mesh, self.material, self.temperature)

    @cached_property
    def thermal_load(self) -> FloatArray | None:
        """(n,) forces in N whose linear displacement is that of the thermal strain; None without thermal strain."""
        if self.temperature is None or not any(self.laws.expansions):
            return None
        found = np.zeros_like(self.mesh.points)
        for group in self.cell_groups:
            found += thermal_force(laws_of_group(self.laws, group.mesh, group.rows), group.strain)
        return np.asarray(self.onto.T @ found.ravel()) if found.any() else None

    @property
    def heated(self) -> bool:
        """Whether thermal strain loads the solid, at rest, too."""
        return self.thermal_load is not None

    @cached_property
    def onto(self) -> Matrix:
        """(3 nodes, n) CSR from the dofs to the x, y, z of all nodes; rows of supported components are zero."""
        if self.followers is not None:
            return self.followers
        n = self.moving.size
        entries = (np.ones(n), (self.moving, np.arange(n)))
        return scipy.sparse.csr_array(entries, shape=(self.mesh.points.size, n))

    @cached_property
    def free(self) -> BoolArray:
        """(nodes,) whether a node can move."""
        return np.asarray((np.diff(self.onto.indptr) > 0).reshape(-1, 3).any(axis=1))

    def at_nodes(self, vector: FloatArray) -> FloatArray:
        """Return a vector (n,) as (nodes, 3), with zeros at supported components."""
        return np.asarray(self.onto @ vector).reshape(-1, 3)

    def _of_dofs(self, matrix: Matrix) -> Matrix:
        """Return a matrix of the x, y, z of all nodes or of all free nodes on the dofs."""
        index, onto = self.moving, self.followers
        if matrix.shape[0] < self.mesh.points.size:
            rows = node_dofs(np.flatnonzero(self.free))
            index = np.searchsorted(rows, index)
            onto = None if onto is None else onto[rows]
        if onto is not None:
            return scipy.sparse.csr_array(onto.T @ matrix @ onto)
        whole = len(index) == matrix.shape[0]
        return matrix if whole else scipy.sparse.csr_array(matrix[index][:, index])

    def centrifugal_load(self, speed: float) -> FloatArray:
        """Return the (n,) load in N at `speed` in rad/s, on the undeformed solid."""
        return speed**2 * self.centrifugal

    def displacement(self, speed: float, *, tie: Matrix | None = None, nonlinear: bool = False) -> FloatArray:
        """Return the static displacement under the centrifugal load and the thermal strain.

        Parameters
        ----------
        speed
            Speed in rad/s.
        tie
            (n, m) sparse: displacements ``tie @ q`` are admissible (a cyclic sector's tie at wave number 0); None: all.
        nonlinear
            True: equilibrium at finite displacement (St. Venant-Kirchhoff, load on the deformed solid) by Newton's
            method. False: ``K u = f``, linear elasticity, as in the linear static step of FE programs.

        Returns
        -------
        FloatArray
            (n,) displacement in metres.

        Raises
        ------
        SingularError
            If the solid can move rigidly.
        StickslipError
            If Newton's method finds no equilibrium.
        """
        self._check_speed(speed)
        linear = speed**2 * self._unit_displacement(tie)
        if self.heated:
            linear = linear + self._hot_displacement(tie)
        return self._equilibrium(speed, tie, linear)[0] if nonlinear else linear

    def polynomial(
        self,
        tie: Matrix | None = None,
        *,
        tangent: Tangent = "consistent",
        unit: FloatArray | None = None,
        hot: FloatArray | None = None,
    ) -> SpeedPolynomial:
        """Return the stiffness as a polynomial of the speed, exact if the static displacement is linear.

        Parameters
        ----------
        tie
            As in `displacement`. Results are cached for the same tie.
        tangent, unit, hot
            As in `at_speed`; ``"nonlinear"`` has no polynomial.
        """
        if tangent not in TANGENTS[:2]:
            raise input_error(
                "RotatingSolid.polynomial",
                f"tangent {tangent!r} is no polynomial of the speed",
                "Use 'consistent' or 'textbook', or at_speed.",
            )
        self.refuse_small_rotations()
        if hot is None and self.heated:
            hot = self._hot_displacement(tie)
        others = b"" if hot is None else hot.tobytes()
        key = (_content(tie) if unit is None else sha256(unit.tobytes() + others).hexdigest(), tangent)
        if key not in self._polynomials:
            moved = self._unit_displacement(tie) if unit is None else unit
            self._polynomials[key] = self._assemble_polynomial(moved, hot, tangent)
        return self._polynomials[key]

    def at_speed(
        self,
        speed: float,
        *,
        tie: Matrix | None = None,
        tangent: Tangent = "consistent",
        coriolis: bool = False,
        unit: FloatArray | None = None,
        hot: FloatArray | None = None,
    ) -> Structure:
        """Return the structure of small vibrations about the state of steady rotation and temperature.

        Parameters
        ----------
        speed
            Speed in rad/s; its sign affects only the Coriolis matrix.
        tie
            As in `displacement`, for the static displacement only; the structure itself is not tied.
        tangent
            ``"consistent"``: the tangent ``K_L(u0) + K_G(σ) − Ω² S`` at the linear static displacement u0, with
            initial-displacement terms. ``"textbook"``: ``K + K_G(σ) − Ω² S`` without them, which is off by the order
            of the static strain. ``"nonlinear"``: the exact tangent at the equilibrium at finite displacement.
        coriolis
            Whether ``2 Ω G`` is added to the damping.
        unit
            (n,) linear static displacement at 1 rad/s in m s², if other bodies affect it; None: computed from `tie`.
        hot
            (n,) linear static displacement by the thermal strain in m, likewise.
        """
        self._check_speed(speed)
        if tangent not in TANGENTS:
            raise input_error(
                "RotatingSolid.at_speed", f"there is no tangent {tangent!r}", did_you_mean(tangent, list(TANGENTS))
            )
        if self.small and not self.heated:  # no speed
            return self.structure
        if tangent == "nonlinear":
            start = self.displacement(speed, tie=tie)
            stiffness = self._equilibrium(speed, tie, start)[1]
        else:
            stiffness = self.polynomial(tie, tangent=tangent, unit=unit, hot=hot).at(speed)
        damping = self.structure.damping
        if coriolis:
            damping = scipy.sparse.csr_array(damping + 2 * speed * self.coriolis)
        return replace(self.structure, stiffness=stiffness, damping=damping)

    @cached_property
    def cell_groups(self) -> list[CellGroup]:
        """Cells by kind and quadrature."""
        return cell_groups(self.mesh, self.quadrature)

    @cached_property
    def _places(self) -> list[NodeBlocks]:
        return [NodeBlocks(group.mesh, self.free) for group in self.cell_groups]

    def _terms(self, displacement: FloatArray, *, green: bool = False, heated: bool = False) -> PrestressTerms:
        where = self.at_nodes(displacement)
        parts: list[Matrix] = []
        for group, places in zip(self.cell_groups, self._places, strict=True):
            laws = laws_of_group(self.laws, group.mesh, group.rows)
            terms = prestress_terms(laws, group.strain, places, where, green=green, heated=heated)
            own = (terms.linear, terms.quadratic, terms.geometric)
            parts = [a + b for a, b in zip(parts, own, strict=True)] if parts else [*own]
        return PrestressTerms(*(self._of_dofs(part) for part in parts))

    def _inner_force(self, displacement: FloatArray) -> FloatArray:
        where = self.at_nodes(displacement)
        found = np.zeros_like(where)
        for group in self.cell_groups:
            found += internal_force(laws_of_group(self.laws, group.mesh, group.rows), group.strain, where)
        force: FloatArray = np.asarray(self.onto.T @ found.ravel())
        return force if self.hourglass is None else force + self.hourglass @ displacement

    def _unit_displacement(self, tie: Matrix | None) -> FloatArray:
        """Return the linear static displacement (n,) at 1 rad/s, in m s²."""
        key = _content(tie)
        if tie is not None and tie.shape[0] != self.structure.n:
            raise input_error(
                "RotatingSolid: tie",
                f"has {tie.shape[0]} rows for {self.structure.n} dofs",
                "Use the tie of a sector made of this solid's structure.",
            )
        if key not in self._displacements:
            self._displacements[key] = _solve(self.structure.stiffness, self.centrifugal, tie)
        return self._displacements[key]

    def _hot_displacement(self, tie: Matrix | None) -> FloatArray:
        """Return the linear static displacement (n,) by the thermal strain in m."""
        key = f"hot {_content(tie)}"
        if key not in self._displacements:
            assert self.thermal_load is not None
            self._displacements[key] = _solve(self.structure.stiffness, self.thermal_load, tie)
        return self._displacements[key]

    def _equilibrium(self, speed: float, tie: Matrix | None, start: FloatArray) -> tuple[FloatArray, Matrix]:
        """Return displacement (n,) and tangent (n, n) of the equilibrium at finite displacement."""
        displacement, S = start, self.spin_softening
        loads = [self.centrifugal_load(speed), *([] if self.thermal_load is None else [self.thermal_load])]
        goal = BALANCED * sum(float(np.linalg.norm(_on_tie(load, tie))) for load in loads)
        for _ in range(NEWTON_STEPS):
            inner = self._inner_force(displacement)
            outer = speed**2 * (self.centrifugal + S @ displacement)
            terms = self._terms(displacement, green=True, heated=True)
            stiffness = self.structure.stiffness + terms.linear + terms.quadratic + terms.geometric
            stiffness = scipy.sparse.csr_array(stiffness - speed**2 * S)
            if np.linalg.norm(_on_tie(outer - inner, tie)) <= goal:
                return displacement, stiffness
            displacement = displacement + _solve(stiffness, outer - inner, tie)
        raise StickslipError(
            f"RotatingSolid: Newton's method found no equilibrium at {speed:g} rad/s in {NEWTON_STEPS} steps. "
            "The solid may be unstable at this speed: try a lower one, and look at displacement(speed)."
        )

    def _check_speed(self, speed: float) -> None:
        if not math.isfinite(speed):
            raise input_error("speed", f"must be a number in rad/s, got {speed}", "Give rad/s.")
        if speed != 0.0:
            self.refuse_small_rotations()

    def refuse_small_rotations(self) -> None:
        """Refuse links that are right for small rotations only; the message names the first by its line."""
        if self.small:
            raise input_error(
                self.small,
                "right for small rotations alone; a load of rotation or heat makes it change the stiffness at second order, as "
                "the weight of a pendulum does",
                "Compute it at rest, or model that body by elements.",
            )

    def _assemble_polynomial(self, unit: FloatArray, hot: FloatArray | None, tangent: Tangent) -> SpeedPolynomial:
        terms, rest = self._terms(unit), self.structure.stiffness
        square = terms.geometric - self.spin_softening
        if tangent == "consistent":
            square = square + terms.linear
        if hot is not None:
            own = self._terms(hot, heated=True)
            rest = rest + own.geometric
            if tangent == "consistent":
                rest = rest + own.linear + own.quadratic
                # twice the bilinear form of both displacements, brought to one size against rounding
                scale = float(np.linalg.norm(hot) / (np.linalg.norm(unit) or 1.0)) or 1.0
                both = self._terms(hot + scale * unit).quadratic - own.quadratic - scale**2 * terms.quadratic
                square = square + both / scale
            rest = scipy.sparse.csr_array(rest)
        return SpeedPolynomial(rest, square, terms.quadratic if tangent == "consistent" else None)


def rotating_solid(
    mesh: SolidMesh,
    material: Materials,
    axis: Axis = Z_AXIS,
    *,
    clamped: tuple[str, ...] = ("root",),
    held: BoolArray | None = None,
    quadrature: Rules = EXACT,
    links: Links | None = None,
    temperature: Temperature | None = None,
) -> RotatingSolid:
    """Assemble a solid that rotates about an axis together with its supports.

    Parameters
    ----------
    mesh, material, clamped, held, quadrature, links
        As in `assemble_solid`.
    axis
        Axis of rotation.
    temperature
        Temperatures of the nodes: materials are taken there, and thermal strain belongs to the static state.

    Returns
    -------
    RotatingSolid
        The solid with matrices at rest, load, Coriolis matrix and spin softening; terms that depend on the static displacement
        are computed at first use.

    Raises
    ------
    InputError
        As in `assemble_solid`.
    """
    mass, stiffness = integrate(mesh, material, quadrature, links, temperature)
    structure, moving, onto = support(mesh, mass, stiffness, clamped, held, links)
    laws = cell_laws(mesh, material, temperature)
    own = with_inner_inertia(mass, laws, quadrature, -np.eye(3))
    # positions are interpolated like displacements, so the mass matrix integrates the load exactly; none acts on incompatible modes,
    # which are no displacement of the neighbours: with it the error of a block is three times as large
    load = with_inner_inertia(own, laws, quadrature, np.eye(3), moving=False) @ axis.arm(mesh.points).ravel()
    nodal_mass = scipy.sparse.csr_array(own[::3][:, ::3])
    load = load[moving] if onto is None else np.asarray(onto.T @ load)
    small = "" if links is None else links.small
    points = None if links is None or not links.mass.any() else links.mass
    return RotatingSolid(
        structure, mesh, material, axis, quadrature, moving, nodal_mass, load, onto, small, temperature, points
    )


def with_inner_inertia(
    matrix: Matrix, laws: CellLaws, quadrature: Rules, block: FloatArray, *, moving: bool = True
) -> Matrix:
    """Add the inertia of bricks with incompatible modes, with `block` (3, 3), to a matrix (3n, 3n) of all nodes.

    Their mass couples the directions, so it is no nodal mass times a block; that of their nodes alone does not, with `moving` false.
    """
    groups = [group for group in cell_groups(laws.mesh, quadrature) if group.rule.inner]
    if not moving:
        groups = [replace(group, rule=replace(group.rule, inner="")) for group in groups]
    if not groups:
        return matrix
    return matrix + sum(inertia(group, laws_of_group(laws, group.mesh, group.rows), block) for group in groups)


def _content(tie: Matrix | None) -> str:
    """Return a hash of a tie: sectors make their ties anew each time, so identity does not tell equal ones."""
    if tie is None:
        return ""
    tie = scipy.sparse.csr_array(tie)
    digest = sha256(repr(tie.shape).encode())
    for part in (tie.indptr, tie.indices, tie.data):
        digest.update(np.ascontiguousarray(part).tobytes())
    return digest.hexdigest()


def _solve(stiffness: Matrix, load: FloatArray, tie: Matrix | None) -> FloatArray:
    inner = stiffness if tie is None else scipy.sparse.csr_array(tie.T @ stiffness @ tie)
    try:
        solve = factorise(inner)
    except SingularError as error:
        raise SingularError(
            f"RotatingSolid: the static displacement under the centrifugal load is not determined ({error}). "
            "Clamp nodes that hold the solid, also along the axis and around it."
        ) from error
    found = solve(_on_tie(load, tie))
    return np.asarray(found if tie is None else tie @ found)


def _on_tie(force: FloatArray, tie: Matrix | None) -> FloatArray:
    return force if tie is None else np.asarray(tie.T @ force)
