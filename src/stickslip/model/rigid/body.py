"""Rigid bodies: six degrees of freedom, no stiffness of their own, and their surfaces for pictures."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.model.structure import Dofs, Structure
from stickslip.units import check_quantities, quantity


@dataclass(frozen=True, eq=False)
class BodySolid:
    """Triangulated surface of a rigid body.

    Parameters
    ----------
    points
        (n, 3) in m.
    triangles
        (k, 3) points of each triangle.
    drawn_from
        Source of the shape, for captions: the section, or the contact faces only.
    """

    points: FloatArray
    triangles: IntArray
    drawn_from: Literal["section", "contact faces"]

    def moved(self, turn: FloatArray, move: FloatArray) -> "BodySolid":
        """Return the surface after ``turn @ x + move``."""
        return replace(self, points=self.points @ turn.T + move)


def prism(outline: FloatArray, low: float, high: float) -> BodySolid:
    """Return the prism along y from `low` to `high`, m, over a convex polygon (k, 2) in x and z, m."""
    k = len(outline)
    ends = [np.column_stack([outline[:, 0], np.full(k, y), outline[:, 1]]) for y in (low, high)]
    fan = np.arange(1, k - 1)
    cap = np.column_stack([np.zeros_like(fan), fan, fan + 1])
    here = np.arange(k)
    after = (here + 1) % k
    sides = [np.column_stack([here, after, after + k]), np.column_stack([here, after + k, here + k])]
    return BodySolid(np.vstack(ends), np.vstack([cap, cap[:, ::-1] + k, *sides]), "section")


def from_faces(points: FloatArray, normals: FloatArray, centre: FloatArray) -> BodySolid | None:
    """Return the convex body between contact faces and parallel planes through the centre of mass.

    Parameters
    ----------
    points, normals
        (p, 3) contact points in m, and their unit normals out of the body.
    centre
        (3,) centre of mass in m.

    Returns
    -------
    BodySolid or None
        None if all points lie in a plane.
    """
    from scipy.spatial import ConvexHull, QhullError  # imported late: an invalid study file is refused sooner

    inward = np.einsum("pd,pd->p", centre - points, normals)
    every = np.vstack([points, points + inward[:, None] * normals])
    try:
        hull = ConvexHull(every)
    except QhullError:
        return None
    used, place = np.unique(hull.simplices, return_inverse=True)
    return BodySolid(every[used], place.reshape(hull.simplices.shape).astype(np.int64), "contact faces")


COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
Triple = tuple[float, float, float]
ALONG_XYZ: tuple[Triple, Triple, Triple] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SKEW = 1e-12  # product of inertia over the largest moment: less is rounding


@dataclass(frozen=True, kw_only=True)
class RigidBody:
    """A rigid body: mass, principal moments of inertia, centre of mass.

    Parameters
    ----------
    mass
        Mass in kg.
    inertia
        Moments of inertia about the principal axes through `centre`, in kg m².
    centre
        Centre of mass in metres.
    axes
        Unit vectors along the three principal axes; x, y, z unless the body is turned.

    Raises
    ------
    InputError
        If mass or inertia are not positive, no body can have these moments of inertia, or the axes are not orthogonal.
    """

    mass: float = quantity("mass of the body", "kg", above=0)
    inertia: tuple[float, float, float] = quantity(
        "moments of inertia [x, y, z] about the centre of mass", "kg_m2", above=0, entries=(3, 3)
    )
    centre: tuple[float, float, float] = quantity("centre of mass [x, y, z]", "m", usual=100, entries=(3, 3))
    axes: tuple[Triple, Triple, Triple] = ALONG_XYZ

    def __post_init__(self) -> None:
        check_quantities(self)
        if 2 * max(self.inertia) > sum(self.inertia) * (1 + 1e-9):
            raise input_error(
                "RigidBody.inertia",
                f"the largest moment exceeds the sum of the other two, got {self.inertia}",
                "No distribution of mass has such moments: check their order and units (kg m²).",
            )
        axes = np.array(self.axes, dtype=float)
        if axes.shape != (3, 3) or not np.allclose(axes @ axes.T, np.eye(3)):
            raise input_error(
                "RigidBody.axes",
                f"are no three unit vectors square to each other, got {self.axes}",
                "Give the principal axes, or leave them out where they are x, y, z.",
            )

    @property
    def tensor(self) -> FloatArray:
        """(3, 3) inertia about the centre of mass along x, y, z, in kg m²."""
        axes = np.array(self.axes, dtype=float)
        return np.asarray(axes.T * self.inertia @ axes)

    def moved(self, turn: FloatArray, move: FloatArray) -> "RigidBody":
        """Return the body after ``turn @ x + move``; `turn` is orthogonal (3, 3), `move` (3,) in metres."""
        axes = np.array(self.axes, dtype=float) @ turn.T
        first, second, third = (_triple(axis) for axis in axes)
        centre = _triple(turn @ np.array(self.centre) + move)
        return replace(self, centre=centre, axes=(first, second, third))

    def structure(self) -> Structure:
        """Return the structure with six dofs ``x y z rx ry rz`` at the centre of mass, without stiffness and damping."""
        dofs = Dofs(np.full(6, -1), COMPONENTS, np.tile(self.centre, (6, 1)))
        mass = np.diag([self.mass] * 3 + [0.0] * 3).astype(float)
        mass[3:, 3:] = self.tensor
        return Structure(mass, np.zeros((6, 6)), np.zeros((6, 6)), dofs)

    def at_speed(self, speed: float, axis: Axis, *, coriolis: bool = False) -> Structure:
        r"""Return the structure of the body in rotating axes, with spin softening and, if `coriolis`, the gyroscopic matrix.

        With the tensor J and the angular velocity Ω, the potential of the centrifugal forces is
        ``-(m |Ω x r|² + Ω·J(θ)Ω) / 2``; its second derivatives are the stiffness. The gyroscopic matrix is ``2 m Ω̂`` for
        translations and ``tr(J) Ω̂ - 2 (JΩ)^`` for rotations (linearised Newton-Euler equations).

        Parameters
        ----------
        speed
            Speed in rad/s.
        axis
            Axis of rotation.
        coriolis
            Whether the gyroscopic matrix is added to the damping.
        """
        rest, spin = self.structure(), speed * axis.unit
        tensor, cross = self.tensor, speed * axis.cross
        moment = tensor @ spin
        stiffness, gyroscopic = np.zeros((6, 6)), np.zeros((6, 6))
        stiffness[:3, :3] = self.mass * cross @ cross
        mixed = np.outer(moment, spin)
        stiffness[3:, 3:] = cross @ tensor @ cross - (mixed + mixed.T) / 2 + (spin @ moment) * np.eye(3)
        gyroscopic[:3, :3] = 2 * self.mass * cross
        gyroscopic[3:, 3:] = np.trace(tensor) * cross - 2 * _cross(moment)
        return replace(rest, stiffness=stiffness, damping=gyroscopic if coriolis else rest.damping)

    def centrifugal(self, speed: float, axis: Axis) -> FloatArray:
        """Return the (6,) centrifugal force (N) at the centre and moment (N m) at a speed in rad/s."""
        spin = speed * axis.unit
        force = self.mass * speed**2 * axis.arm(np.array([self.centre], dtype=float))[0]
        return np.concatenate([force, -np.cross(spin, self.tensor @ spin)])

    def displacement_operator(self, points: FloatArray) -> FloatArray:
        """Return the (p, 3, 6) operator that gives the displacement ``u_G + θ × r`` of material points.

        Parameters
        ----------
        points
            (p, 3) positions in metres.
        """
        operator = np.zeros((len(points), 3, 6))
        operator[:, :, :3] = np.eye(3)
        x, y, z = (np.asarray(points, dtype=float) - self.centre).T
        operator[:, 0, 4], operator[:, 0, 5] = z, -y
        operator[:, 1, 3], operator[:, 1, 5] = -z, x
        operator[:, 2, 3], operator[:, 2, 4] = y, -x
        return operator


def body_of_tensor(mass: float, tensor: FloatArray, centre: FloatArray) -> RigidBody:
    """Return the body with the inertia `tensor` (3, 3) in kg m² about its `centre` (3,) in metres."""
    tilted = np.abs(tensor - np.diag(np.diag(tensor))).max() > SKEW * np.abs(tensor).max()
    moments, columns = np.linalg.eigh(tensor) if tilted else (np.diag(tensor), np.eye(3))
    first, second, third = (_triple(axis) for axis in columns.T)
    return RigidBody(mass=mass, inertia=_triple(moments), centre=_triple(centre), axes=(first, second, third))


def _triple(vector: FloatArray) -> Triple:
    x, y, z = (float(v) for v in vector)
    return x, y, z


def _cross(vector: FloatArray) -> FloatArray:
    """Return the (3, 3) matrix of the product ``vector x``."""
    return np.cross(vector, np.eye(3)).T
