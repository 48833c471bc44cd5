"""Unit systems of finite-element models; all conversions to SI are here."""

from dataclasses import dataclass, replace

import numpy as np
import scipy

from stickslip.arrays import FloatArray, Matrix
from stickslip.errors import InputError, did_you_mean, input_error
from stickslip.model.structure import Dofs, Structure, is_numbered
from stickslip.units import check_quantities, quantity

INCH = 0.0254  # m, exact
POUND = 0.45359237  # kg, exact
GRAVITY = 9.80665  # m/s², exact: a pound-force is a pound under it
DENSITIES = (5.0, 30_000.0)  # kg/m³ of the bounding box: from a hollow part to solid osmium
USUAL = 100.0  # kg/m³ of the bounding box that most parts exceed
SOLIDS = (500.0, 25_000.0)  # kg/m³: from light plastics to heavy metals
MODULI = (1e7, 2e12)  # Pa: from rubber-like to diamond
SIZES = (1e-4, 50.0)  # m
ARGUMENTS = {"units": "units=Units.…()", "plausible": "plausible=False"}  # arguments of all readers, for messages
WRONG_UNITS = "Correct $units, or give $plausible where the numbers are right."


@dataclass(frozen=True)
class Units:
    """A coherent unit system: units of length, mass and time in SI; other units follow from them.

    Parameters
    ----------
    length
        Unit of length in m.
    mass
        Unit of mass in kg.
    time
        Unit of time in s.
    name
        Name of the system, for messages.

    Raises
    ------
    InputError
        If a unit is not positive.
    """

    length: float = quantity("unit of length, in m", above=0)
    mass: float = quantity("unit of mass, in kg", above=0)
    time: float = quantity("unit of time, in s", above=0)
    name: str = "own units"

    def __post_init__(self) -> None:
        check_quantities(self)

    @staticmethod
    def si() -> "Units":
        """Metre, kilogram, second: N, Pa."""
        return Units(1.0, 1.0, 1.0, "SI")

    @staticmethod
    def mm_t_s() -> "Units":
        """Millimetre, tonne, second: N, MPa; steel has 7.85e-9 t/mm³."""
        return Units(1e-3, 1e3, 1.0, "mm-t-s")

    @staticmethod
    def mm_kg_ms() -> "Units":
        """Millimetre, kilogram, millisecond: kN, GPa; steel has 7.85e-6 kg/mm³."""
        return Units(1e-3, 1.0, 1e-3, "mm-kg-ms")

    @staticmethod
    def mm_kg_s() -> "Units":
        """Millimetre, kilogram, second: mN, kPa; steel has 7.85e-6 kg/mm³ and 2.1e8 kPa."""
        return Units(1e-3, 1.0, 1.0, "mm-kg-s")

    @staticmethod
    def inch_lbf_s() -> "Units":
        """Inch, pound-force, second: mass in lbf s²/in, psi; steel has 7.3e-4 lbf s²/in⁴."""
        return Units(INCH, POUND * GRAVITY / INCH, 1.0, "inch-lbf-s")

    @staticmethod
    def foot_slug_s() -> "Units":
        """Foot, slug, second: lbf, lbf/ft²; steel has 15.2 slug/ft³."""
        return Units(12 * INCH, POUND * GRAVITY / (12 * INCH), 1.0, "foot-slug-s")

    @staticmethod
    def named(name: str) -> "Units":
        """Return the system called ``SI``, ``mm-t-s``, ``mm-kg-ms``, ``mm-kg-s``, ``inch-lbf-s`` or ``foot-slug-s``."""
        for units in _known():
            if units.name.lower() == name.lower():
                return units
        raise input_error("units", f"unknown unit system {name!r}", did_you_mean(name, [u.name for u in _known()]))

    @property
    def force(self) -> float:
        """Unit of force in N."""
        return self.mass * self.length / self.time**2

    @property
    def stress(self) -> float:
        """Unit of stress in Pa."""
        return self.mass / (self.length * self.time**2)

    @property
    def density(self) -> float:
        """Unit of density in kg/m³."""
        return self.mass / self.length**3

    def lengths(self, dofs: Dofs) -> FloatArray:
        """Return the unit of each dof: a length in m, or 1 for dofs that are no lengths (rotations, modes).

        Dofs of matrices without a table count as translations: with dimensionless dofs the stiffness would be an energy.
        """
        along = [c in ("x", "y", "z") or is_numbered(c) for c in dofs.component]
        return np.where(along, self.length, 1.0)


SI = Units.si()


def _known() -> tuple[Units, ...]:
    return (Units.si(), Units.mm_t_s(), Units.mm_kg_ms(), Units.mm_kg_s(), Units.inch_lbf_s(), Units.foot_slug_s())


def in_si(structure: Structure, units: Units) -> Structure:
    """Convert a structure, positions included, from `units` to SI.

    Energies are ``mass length² / time²`` in any coordinates, so the unit of a matrix entry is an energy divided by the units of its
    two coordinates. For the mass matrix: ``mass`` between translations, ``mass length²`` between rotations.

    Parameters
    ----------
    structure
        Structure in the numbers of the file.
    units
        Unit system of the file.
    """
    energy = units.mass * units.length**2
    per_length = 1 / units.lengths(structure.dofs)

    def scaled(matrix: Matrix, factor: float) -> Matrix:
        if not scipy.sparse.issparse(matrix):
            return factor * per_length[:, None] * matrix * per_length
        diagonal = scipy.sparse.diags_array(per_length)
        return scipy.sparse.csr_array(factor * (diagonal @ matrix @ diagonal))

    if (units.length, units.mass, units.time) == (1.0, 1.0, 1.0):
        return structure  # exactly unchanged
    return replace(
        structure,
        mass=scaled(structure.mass, energy),
        damping=scaled(structure.damping, energy / units.time),
        stiffness=scaled(structure.stiffness, energy / units.time**2),
        loss=None if structure.loss is None else scaled(structure.loss, energy / units.time**2),
        dofs=replace(structure.dofs, position=units.length * structure.dofs.position),
    )


def translational_mass(structure: Structure) -> FloatArray:
    """Return ``uᵀ M u`` for the unit translations along x, y and z, (3,) in kg: the mass that can move in these directions."""
    components = np.array(structure.dofs.component)
    masses = []
    for axis in ("x", "y", "z"):
        unit = (components == axis).astype(float)
        masses.append(float(np.real(unit @ (structure.mass @ unit))))
    return np.array(masses)


def doubt_about_units(structure: Structure, units: Units) -> str | None:
    """Return a sentence if the unit system is probably wrong; None if mass and size are plausible.

    Mass over volume of the bounding box is at most the density of the material. No part is denser than osmium, and few
    parts fill less than a thousandth of their box.

    Parameters
    ----------
    structure
        Structure in SI, converted from `units`.
    units
        Assumed unit system.
    """
    mass, extent = float(translational_mass(structure).max()), _extent(structure)
    if extent.min() <= 1e-3 * extent.max():
        return None  # flat, slender or without positions: its box tells nothing
    found = mass / float(np.prod(extent))
    if DENSITIES[0] <= found <= DENSITIES[1] and SIZES[0] <= extent.max() <= SIZES[1]:
        return None
    dense, light = [], []
    for other in _known():
        length = other.length / units.length
        density = found * other.density / units.density
        if SIZES[0] <= length * extent.max() <= SIZES[1] and density <= DENSITIES[1]:
            if density >= USUAL:
                dense.append(other.name)
            elif density >= DENSITIES[0]:
                light.append(other.name)
    likely = dense or light
    return (
        f"in {units.name} its mass is {mass:.3g} kg in a box of "
        + " x ".join(f"{e:.3g}" for e in extent)
        + f" m, {found:.3g} kg/m³"
        + (f"; that looks like {' or '.join(likely)}" if likely else "")
    )


def check_units(structure: Structure, units: Units, place: str) -> None:
    """Refuse a structure with implausible mass and size; the message names the likely unit system.

    Raises
    ------
    InputError
        If `doubt_about_units` returns a reason.
    """
    doubt = doubt_about_units(structure, units)
    if doubt:
        raise input_error(place, doubt, WRONG_UNITS, **ARGUMENTS)


def check_material(density: float, young_modulus: float, units: Units, place: str) -> None:
    """Refuse an implausible density (kg/m³) or Young's modulus (Pa); the message names unit systems that would be plausible.

    Raises
    ------
    InputError
        If one is outside the range of solids.
    """

    def fits(factors: Units) -> bool:
        return (
            SOLIDS[0] <= density * factors.density / units.density <= SOLIDS[1]
            and MODULI[0] <= young_modulus * factors.stress / units.stress <= MODULI[1]
        )

    if fits(units):
        return
    likely = [other.name for other in _known() if fits(other)]
    raise _material_error(density, young_modulus, units, likely, place)


def _material_error(density: float, young_modulus: float, units: Units, likely: list[str], place: str) -> InputError:
    return input_error(
        place,
        f"in {units.name} the density is {density:.4g} kg/m³ and Young's modulus {young_modulus:.4g} Pa"
        + (f"; that looks like {' or '.join(likely)}" if likely else ""),
        WRONG_UNITS,
        **ARGUMENTS,
    )


def _extent(structure: Structure) -> FloatArray:
    position = structure.dofs.position[np.isfinite(structure.dofs.position).all(axis=1)]
    if not len(position):
        return np.zeros(3)
    return np.asarray(position.max(axis=0) - position.min(axis=0))
