"""Straight uniform beams, slender or with shear, at rest or turning about an axis across them.

Bending is in one plane or in both; a straight uniform beam does not couple them. With shear, the shape functions of deflection
and section rotation are solutions of the static equations, so the elements do not lock: Z. Friedman and J. B. Kosmatka, "An
improved two-node Timoshenko beam finite element", Computers & Structures 47 (1993) 473-481. Rotation: D. H. Hodges and M. J.
Rutkowski, "Free-vibration analysis of rotating beams by a variable-order finite-element method", AIAA Journal 19 (1981)
1459-1466.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
import scipy

from stickslip.arrays import FloatArray, IntArray
from stickslip.errors import input_error
from stickslip.model.fe.material import Material
from stickslip.model.structure import Dofs, Structure, join_dofs
from stickslip.units import check_quantities, length, quantity

End = Literal["clamped", "pinned", "sliding", "free"]
Direction = Literal["y", "z"]
Bending = Literal["y", "z", "both"]
COMPONENTS = ("x", "y", "z", "rx", "ry", "rz")
# whether deflection, rotation and axial displacement are held; a sliding end moves across the beam
HELD = {
    "clamped": (True, True, True),
    "pinned": (True, False, True),
    "sliding": (False, True, True),
    "free": (False, False, False),
}
POINTS, WEIGHTS = (0.5 * (a + b) for a, b in zip(np.polynomial.legendre.leggauss(4), (1.0, 0.0), strict=True))


@dataclass(frozen=True)
class Beam:
    """A uniform straight beam.

    Parameters
    ----------
    length
        Length in m.
    area
        Area of the section, m².
    second_moment
        Second moment of area for the bending considered, m⁴.
    second_moment_y
        Second moment of area for deflections along y, if the beam bends both ways; None: equal to `second_moment`.
    material
        Linear elastic material.
    shear_coefficient
        κ of the shear stiffness ``κ G A``; Timoshenko beam with rotary inertia. None: Euler-Bernoulli beam.
    ends
        Supports of the first and last end: ``clamped``, ``pinned``, ``sliding`` or ``free``.

    Raises
    ------
    InputError
        If a size is not positive or an end is unknown.
    """

    length: float = length("length of the beam", usual=1e4)
    area: float = quantity("area of its section, of a rectangle width times height", "m2", above=0)
    second_moment: float = quantity(
        "second moment of area for its bending, of a rectangle width times height³ / 12", "m4", above=0
    )
    material: Material = quantity("the table of its material")
    shear_coefficient: float | None = quantity(
        "shear coefficient κ, which makes a Timoshenko beam; left out: Euler-Bernoulli", default=None, above=0, usual=2
    )
    second_moment_y: float | None = quantity(
        'second moment of area for deflections along y, with bending = "both"; left out: the same',
        "m4",
        default=None,
        above=0,
    )
    ends: tuple[End, End] = quantity(
        "how the first and the last end are held", default=("clamped", "free"), choices=get_args(End), entries=(2, 2)
    )

    def __post_init__(self) -> None:
        check_quantities(self)


def beam(shape: Beam, elements: int, *, bending: Bending = "z", axial: bool = False) -> Structure:
    """Return the finite-element model of a beam along x.

    Parameters
    ----------
    shape
        The beam.
    elements
        Number of equal elements.
    bending
        Direction of the deflection; the rotation is about the other one (``ry`` is minus the slope of z). ``both``: y and z.
    axial
        Whether the beam also stretches.

    Returns
    -------
    Structure
        Dense. Sets ``deflection``, ``rotation`` and ``axial`` contain the free dofs along the beam, ``tip`` the deflection of the last
        node, if free; with both bendings, ``tip`` contains all displacements of this node, as a point in space.

    Raises
    ------
    InputError
        If there are no elements.
    """
    return rotating_beam(shape, elements, 0.0, bending=bending, axial=axial)


def rotating_beam(
    shape: Beam,
    elements: int,
    speed: float,
    *,
    hub_radius: float = 0.0,
    bending: Bending = "z",
    axial: bool = False,
    coriolis: bool = False,
) -> Structure:
    """Return the model of a beam on a hub that turns about z, in the rotating frame.

    The centrifugal tension stiffens bending. Spin softening ``- Ω² M`` reduces the stiffness of motion in the plane of rotation
    (deflections in y, lag, and stretching), but not of deflections in z (flap).

    Parameters
    ----------
    shape
        The beam, clamped at the hub and free at its tip.
    elements
        Number of equal elements.
    speed
        Speed in rad/s.
    hub_radius
        Distance of the clamped end from the axis, m.
    bending
        ``z``: flap, along the axis of rotation; ``y``: lag, in the plane of rotation; ``both``.
    axial
        Whether the beam also stretches.
    coriolis
        Whether Coriolis terms, which couple lag with stretching, are added to the damping.

    Raises
    ------
    InputError
        If the beam turns and is not clamped and free, the hub's radius is negative, or Coriolis terms are requested without axial motion.
    """
    if elements < 1:
        raise input_error("rotating_beam: elements", f"is {elements}", "Give 1 or more.")
    if bending not in get_args(Bending):
        raise input_error("rotating_beam: bending", f"is {bending!r}", f"Give one of {', '.join(get_args(Bending))}.")
    if not 0 <= hub_radius < math.inf or not math.isfinite(speed):
        raise input_error("rotating_beam", f"got hub radius {hub_radius} and speed {speed}", "In m and rad/s.")
    if speed and tuple(shape.ends) != ("clamped", "free"):
        raise input_error(
            "rotating_beam: ends",
            f"got {shape.ends}: the tension depends on how both ends are held",
            "A turning beam is clamped at the hub and free at the tip.",
        )
    if coriolis and not axial:
        raise input_error(
            "rotating_beam: coriolis",
            "acts between deflection and stretching, and the beam does not stretch",
            "Give axial=True.",
        )
    if bending == "both":
        return _both(shape, elements, speed, hub_radius, axial, coriolis)
    size = shape.length / elements
    starts = size * np.arange(elements)
    blocks = [_element(shape, size, start, speed, hub_radius, bending) for start in starts]
    n = 3 * (elements + 1)
    mass, damping, stiffness = np.zeros((3, n, n))
    for i, (m, c, k) in enumerate(blocks):
        here = np.s_[3 * i : 3 * i + 6, 3 * i : 3 * i + 6]
        mass[here] += m
        stiffness[here] += k
        if coriolis:
            damping[here] += c
    kept = _free(shape, elements, axial)
    square = np.ix_(kept, kept)
    dofs = _dofs(shape, elements, hub_radius, bending).take(kept)
    return Structure(mass[square], damping[square], stiffness[square], dofs, _sets(dofs, bending, elements))


def _both(shape: Beam, elements: int, speed: float, hub_radius: float, axial: bool, coriolis: bool) -> Structure:
    """Return the beam that bends in both planes, dofs node by node; stretching is assembled with lag (Coriolis coupling)."""
    across = replace(shape, second_moment=shape.second_moment_y or shape.second_moment)
    lag = rotating_beam(across, elements, speed, hub_radius=hub_radius, bending="y", axial=axial, coriolis=coriolis)
    flap = rotating_beam(shape, elements, speed, hub_radius=hub_radius, bending="z")
    table = join_dofs({"lag": lag.dofs, "flap": flap.dofs})
    rank = np.array([COMPONENTS.index(component) for component in table.component])
    order = np.lexsort((rank, table.node))
    square = np.ix_(order, order)
    mass, damping, stiffness = (
        scipy.linalg.block_diag(getattr(lag, name), getattr(flap, name))[square]
        for name in ("mass", "damping", "stiffness")
    )
    dofs = replace(table.take(order), part=())
    component = np.array(dofs.component)
    sets = {
        name: np.flatnonzero(np.isin(component, kinds))
        for name, kinds in (("deflection", ("y", "z")), ("rotation", ("ry", "rz")), ("axial", ("x",)))
    }
    moves = np.isin(component, ("x", "y", "z"))
    sets["tip"] = np.flatnonzero(moves & (dofs.node == elements))
    found = {name: index for name, index in sets.items() if index.size}
    return Structure(mass, damping, stiffness, dofs, found)


def _element(
    shape: Beam, size: float, start: float, speed: float, hub_radius: float, bending: Direction
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return (6, 6) mass, Coriolis and stiffness matrices for deflection, rotation and axial displacement of two nodes."""
    E, rho = shape.material.young_modulus, shape.material.density
    EI, EA, rA = E * shape.second_moment, E * shape.area, rho * shape.area
    shear, rI = math.inf, 0.0
    if shape.shear_coefficient is not None:
        shear = shape.shear_coefficient * 0.5 * E / (1 + shape.material.poisson_ratio) * shape.area
        rI = rho * shape.second_moment
    x = start + size * POINTS
    L = shape.length
    tension = rA * speed**2 * (hub_radius * (L - x) + 0.5 * (L**2 - x**2))
    w, slope, theta, curvature, strain = _shapes(size, 12 * EI / (shear * size**2))
    u, stretch = _axial_shapes(size)
    if bending == "z":  # a positive rotation about y is a negative slope of z along x
        flip = np.array([1.0, -1.0, 1.0, 1.0, -1.0, 1.0])
        w, slope, theta, curvature, strain = (a * flip for a in (w, slope, theta, curvature, strain))
    weight = size * WEIGHTS

    def integral(left: FloatArray, right: FloatArray, factor: float | FloatArray) -> FloatArray:
        return np.asarray(np.einsum("q,qi,qj->ij", weight * factor, left, right))

    mass = integral(w, w, rA) + integral(theta, theta, rI) + integral(u, u, rA)
    elastic = integral(curvature, curvature, EI) + integral(stretch, stretch, EA)
    if math.isfinite(shear):
        elastic += integral(strain, strain, shear)
    # rotary inertia softens a section that tilts out of the plane of rotation, but not one that turns within it
    softening = integral(u, u, rA) + (integral(w, w, rA) if bending == "y" else integral(theta, theta, rI))
    coriolis = np.zeros((6, 6))
    if bending == "y":
        across = integral(w, u, 2 * speed * rA)
        coriolis = across - across.T
    return mass, coriolis, elastic + integral(slope, slope, tension) - speed**2 * softening


def _shapes(size: float, flexibility: float) -> tuple[FloatArray, ...]:
    """Return deflection, its slope, rotation, its slope and shear strain at the quadrature points, (4, 6) each.

    `flexibility` is ``12 EI / (κ G A size²)``, 0 for the cubic Hermite polynomials.
    """
    x, f = POINTS, flexibility
    one = np.ones_like(x)
    w = [
        2 * x**3 - 3 * x**2 - f * x + 1 + f,
        size * (x**3 - (2 + f / 2) * x**2 + (1 + f / 2) * x),
        -2 * x**3 + 3 * x**2 + f * x,
        size * (x**3 - (1 - f / 2) * x**2 - f / 2 * x),
    ]
    slope = [
        (6 * x**2 - 6 * x - f) / size,
        3 * x**2 - (4 + f) * x + 1 + f / 2,
        (-6 * x**2 + 6 * x + f) / size,
        3 * x**2 - (2 - f) * x - f / 2,
    ]
    theta = [6 * (x**2 - x) / size, 3 * x**2 - (4 + f) * x + 1 + f, -6 * (x**2 - x) / size, 3 * x**2 - (2 - f) * x]
    curvature = [6 * (2 * x - 1) / size**2, (6 * x - 4 - f) / size, -6 * (2 * x - 1) / size**2, (6 * x - 2 + f) / size]
    strain = [-f / size * one, -f / 2 * one, f / size * one, -f / 2 * one]
    return tuple(_placed(values, (0, 1, 3, 4)) / (1 + f) for values in (w, slope, theta, curvature, strain))


def _axial_shapes(size: float) -> tuple[FloatArray, FloatArray]:
    """Return axial displacement and strain at the quadrature points, (4, 6) each."""
    one = np.ones_like(POINTS)
    return _placed([1 - POINTS, POINTS], (2, 5)), _placed([-one / size, one / size], (2, 5))


def _placed(values: Sequence[FloatArray], columns: tuple[int, ...]) -> FloatArray:
    out = np.zeros((POINTS.size, 6))
    out[:, columns] = np.array(values).T
    return out


def _free(shape: Beam, elements: int, axial: bool) -> IntArray:
    """Return the unsupported dofs, in node order."""
    held = np.zeros((elements + 1, 3), dtype=bool)
    held[0], held[-1] = (HELD[end] for end in shape.ends)
    if not axial:
        held[:, 2] = True
    return np.flatnonzero(~held.reshape(-1))


def _dofs(shape: Beam, elements: int, hub_radius: float, bending: Direction) -> Dofs:
    points = np.zeros((elements + 1, 3))
    points[:, 0] = hub_radius + np.linspace(0.0, shape.length, elements + 1)
    names = ("y", "rz", "x") if bending == "y" else ("z", "ry", "x")
    return Dofs(np.repeat(np.arange(elements + 1), 3), names * (elements + 1), np.repeat(points, 3, axis=0))


def _sets(dofs: Dofs, bending: Direction, elements: int) -> dict[str, IntArray]:
    component = np.array(dofs.component)
    turning = "rz" if bending == "y" else "ry"
    names = {"deflection": bending, "rotation": turning, "axial": "x"}
    sets = {name: np.flatnonzero(component == kind) for name, kind in names.items()}
    sets["tip"] = np.flatnonzero((component == bending) & (dofs.node == elements))
    return {name: index for name, index in sets.items() if index.size}
