"""Linear elastic materials: isotropic ones, and ones of any anisotropy with an orientation and properties over temperature."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.axis import Axis
from stickslip.units import check_quantities, quantity

# components of strain and stress vectors; shear strains are doubled
PAIRS = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
TENSOR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # places of a tensor's components in a vector
SQUARE = 1e-9  # least eigenvalue of an elasticity matrix over its largest


@dataclass(frozen=True, kw_only=True)
class Material:
    """An isotropic elastic material.

    Parameters
    ----------
    young_modulus
        Young's modulus in Pa.
    poisson_ratio
        Poisson's ratio, from 0 to below 1/2.
    density
        Density in kg/m³.
    """

    young_modulus: float = quantity("Young's modulus (steel: 2.1e11)", "pa", default=210e9, above=0)
    poisson_ratio: float = quantity("Poisson's ratio (steel: 0.3)", default=0.3, least=0, below=0.5)
    density: float = quantity("density (steel: 7850)", "kg_per_m3", default=7850.0, above=0)

    def __post_init__(self) -> None:
        check_quantities(self)

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé's constants λ and G in Pa."""
        e, nu = self.young_modulus, self.poisson_ratio
        return e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))

    def matrices(self, temperature: FloatArray | None) -> FloatArray:
        """Return the matrix (6, 6) from strains to stresses in Pa, at (...) temperatures (..., 6, 6)."""
        shape = () if temperature is None else temperature.shape
        row = np.array([self.young_modulus, self.poisson_ratio])
        return _matrix(np.broadcast_to(row, (*shape, 2)))

    @property
    def in_words(self) -> str:
        """Constants, for a line about the material."""
        return f"E {self.young_modulus:.4g} Pa, ν {self.poisson_ratio:g}, ρ {self.density:.4g} kg/m³"


@dataclass(frozen=True)
class Orientation:
    """Axes of a material: the same everywhere, or turning about an axis from place to place.

    Parameters
    ----------
    axes
        (3, 3) nested tuple; its columns are the axes 1, 2, 3 of the material as unit vectors. Of a cylindrical orientation they
        are given in the radial, tangential and axial direction of each place.
    around
        Axis of a cylindrical orientation; None: the axes are global.

    Raises
    ------
    InputError
        If the axes are not perpendicular unit vectors.
    """

    axes: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    around: Axis | None = None

    def __post_init__(self) -> None:
        own = np.asarray(self.axes, dtype=float)
        if own.shape != (3, 3) or not np.allclose(own @ own.T, np.eye(3), atol=1e-8):
            raise input_error(
                "Orientation.axes",
                f"are no perpendicular unit vectors, got {own.tolist()}",
                "Give an orthogonal (3, 3) matrix, or use Orientation.of_axes.",
            )

    @classmethod
    def of_axes(cls, first: Sequence[float], second: Sequence[float], around: Axis | None = None) -> "Orientation":
        """Return axes of which 1 points along `first`, and 2 lies in the plane of `first` and `second` on its side.

        Raises
        ------
        InputError
            If the two vectors are parallel, or one has no length.
        """
        a, b = (np.asarray(v, dtype=float) for v in (first, second))
        normal = np.cross(a, b)
        if not np.linalg.norm(normal) > 1e-9 * np.linalg.norm(a) * np.linalg.norm(b):
            raise input_error(
                "Orientation.of_axes",
                f"{a.tolist()} and {b.tolist()} span no plane",
                "Give two vectors of different directions.",
            )
        one, three = a / np.linalg.norm(a), normal / np.linalg.norm(normal)
        return cls(_nested(np.column_stack([one, np.cross(three, one), three])), around)

    def at(self, points: FloatArray) -> FloatArray:
        """Return the axes (..., 3, 3) as columns at places (..., 3) in m."""
        own = np.asarray(self.axes, dtype=float)
        if self.around is None:
            return np.broadcast_to(own, (*points.shape[:-1], 3, 3))
        arm = self.around.arm(points.reshape(-1, 3)).reshape(points.shape)
        length = np.linalg.norm(arm, axis=-1, keepdims=True)
        if not np.all(length > 0):
            raise input_error(
                "Orientation", "has no radial direction on its own axis", "Move the axis out of the material."
            )
        radial = arm / length
        along = np.broadcast_to(self.around.unit, points.shape)
        return np.asarray(np.stack([radial, np.cross(along, radial), along], axis=-1) @ own)

    def moved(self, turn: FloatArray, move: FloatArray) -> "Orientation":
        """Return the orientation of a material that is turned by the orthogonal (3, 3) `turn`, then moved by `move` (3,) in m."""
        own = np.asarray(self.axes, dtype=float)
        if self.around is None:
            return Orientation(_nested(turn @ own))
        direction = np.linalg.det(turn) * (turn @ self.around.unit)  # an axial vector: a mirror reverses the sense
        origin = turn @ np.asarray(self.around.origin) + move
        # radial and tangential direction follow the body; the axial one changes its sign in a mirror
        flip = np.diag([1.0, 1.0, np.sign(np.linalg.det(turn))])
        return Orientation(_nested(flip @ own), Axis(_triple(direction), _triple(origin)))


@dataclass(frozen=True)
class ByTemperature:
    """Numbers over temperature: linear between the temperatures, constant beyond.

    Parameters
    ----------
    values
        Rows of k numbers, one for each temperature.
    temperatures
        Rising temperatures of the rows; empty for one row, which holds at all temperatures.

    Raises
    ------
    InputError
        If temperatures do not rise, or rows and temperatures differ in number.
    """

    values: tuple[tuple[float, ...], ...]
    temperatures: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        rows, known = len(self.values), len(self.temperatures)
        if rows < 1 or len({len(row) for row in self.values}) != 1 or known != (0 if rows == 1 and not known else rows):
            raise input_error(
                "ByTemperature", f"has {rows} rows for {known} temperatures", "Give one row for each temperature."
            )
        if not np.all(np.diff(self.temperatures) > 0):
            raise input_error(
                "ByTemperature.temperatures", f"must rise, got {list(self.temperatures)}", "Give the lowest first."
            )

    @property
    def varies(self) -> bool:
        """Whether there are several temperatures."""
        return len(self.values) > 1

    def at(self, temperature: FloatArray | None) -> FloatArray:
        """Return the numbers (..., k) at temperatures (...); without temperatures the only row (k,)."""
        rows = np.asarray(self.values, dtype=float)
        if temperature is None or not self.varies:
            return rows[0] if temperature is None else np.broadcast_to(rows[0], (*temperature.shape, rows.shape[1]))
        return np.stack([np.interp(temperature, self.temperatures, column) for column in rows.T], axis=-1)


@dataclass(frozen=True, kw_only=True)
class Expansion:
    """Thermal expansion over temperature.

    Parameters
    ----------
    coefficients
        Rows of 1 number (isotropic), 3 (along the axes of the material) or 6 (order 11, 22, 33, 12, 23, 13) in 1/K.
    kind
        ``"secant"``: the strain from `zero` to a temperature is the coefficient there times the difference of temperature;
        ``"instantaneous"``: the coefficient is the derivative of the strain.
    zero
        Temperature from which secant coefficients count; None if there is one coefficient for all temperatures.

    Raises
    ------
    InputError
        If secant coefficients over temperature have no `zero`, or rows have another length.
    """

    coefficients: ByTemperature
    kind: Literal["secant", "instantaneous"] = "secant"
    zero: float | None = None

    def __post_init__(self) -> None:
        if len(self.coefficients.values[0]) not in (1, 3, 6):
            raise input_error("Expansion.coefficients", "has no rows of 1, 3 or 6 numbers", "Give 1/K for each axis.")
        if self.kind == "secant" and self.coefficients.varies and self.zero is None:
            raise input_error(
                "Expansion.zero",
                "is missing with secant coefficients over temperature",
                "Give the temperature from which they count.",
            )

    def strain(self, start: FloatArray, end: FloatArray) -> FloatArray:
        """Return the strain (..., 6) in the axes of the material, shears doubled, from temperatures `start` to `end` (...)."""
        table = self.coefficients
        if self.kind == "secant" or not table.varies:
            zero = self.zero or 0.0
            found = table.at(end) * (end - zero)[..., None] - table.at(start) * (start - zero)[..., None]
        else:
            found = _integral(table, end) - _integral(table, start)
        whole = np.zeros((*found.shape[:-1], 6))
        if found.shape[-1] == 1:
            whole[..., :3] = found
        else:
            whole[..., : found.shape[-1]] = found
        return whole


def _integral(table: ByTemperature, to: FloatArray) -> FloatArray:
    """Return the integral (..., k) of a table from its lowest temperature to temperatures (...)."""
    at, rows = np.asarray(table.temperatures), np.asarray(table.values, dtype=float)
    done = np.concatenate(
        [np.zeros((1, rows.shape[1])), np.cumsum((rows[1:] + rows[:-1]) / 2 * np.diff(at)[:, None], axis=0)]
    )
    piece = np.clip(np.searchsorted(at, to, side="right") - 1, 0, len(at) - 1)
    step = (to - at[piece])[..., None]
    # within a piece the coefficient is linear, beyond the ends constant
    middle = table.at((to + at[piece]) / 2)
    return np.asarray(done[piece] + middle * step)


@dataclass(frozen=True, kw_only=True)
class ElasticMaterial:
    """A linear elastic material of any symmetry, in its own axes, whose properties may depend on temperature.

    Parameters
    ----------
    elastic
        Rows of Young's modulus (Pa) and Poisson's ratio, or of the 36 numbers of the matrix from strains to stresses (Pa), row by
        row, in the order 11, 22, 33, 12, 23, 13 with doubled shear strains. `stiffness_matrix` makes one.
    density
        Rows of one number in kg/m³.
    orientation
        Axes 1, 2, 3 of the material.
    expansion
        Thermal expansion; None: none.

    Raises
    ------
    InputError
        If a matrix is not symmetric and positive definite, or a density is not positive.
    """

    elastic: ByTemperature
    density_table: ByTemperature
    orientation: Orientation = field(default_factory=Orientation)
    expansion: Expansion | None = None

    def __post_init__(self) -> None:
        if not all(row[0] > 0 for row in self.density_table.values):
            raise input_error("ElasticMaterial.density_table", "must be positive", "Give kg/m³.")
        for row in self.elastic.values:
            refuse_unstable("ElasticMaterial.elastic", _matrix(np.asarray(row, dtype=float)))

    @property
    def varies(self) -> bool:
        """Whether stiffness or density depend on temperature."""
        return self.elastic.varies or self.density_table.varies

    @property
    def density(self) -> float:
        """Density in kg/m³, at the lowest temperature of its table."""
        return float(self.density_table.values[0][0])

    @property
    def young_modulus(self) -> float:
        """Largest Young's modulus along one of the three axes in Pa, at the lowest temperature of its table."""
        return max(self._young_moduli)

    @property
    def _young_moduli(self) -> list[float]:
        return [float(1 / value) for value in np.diag(np.linalg.inv(self.matrices(None)))[:3]]

    @property
    def in_words(self) -> str:
        """Moduli along the axes and density, for a line about the material."""
        moduli = ", ".join(f"{value:.4g}" for value in self._young_moduli)
        return f"E {moduli} Pa along its axes, ρ {self.density:.4g} kg/m³"

    @property
    def is_isotropic(self) -> bool:
        """Whether it is given by Young's modulus and Poisson's ratio."""
        return len(self.elastic.values[0]) == 2

    def matrices(self, temperature: FloatArray | None) -> FloatArray:
        """Return the matrices (..., 6, 6) from strains to stresses in the material's axes, Pa, at temperatures (...)."""
        return _matrix(self.elastic.at(temperature))

    def fixed(self, temperature: float | None) -> "AnyMaterial":
        """Return the material with the stiffness and density of one temperature, without expansion; isotropic if it can be.

        Parameters
        ----------
        temperature
            Temperature; None if nothing depends on it.
        """
        at = None if temperature is None else np.array(temperature)
        row, density = self.elastic.at(at), float(self.density_table.at(at)[0])
        if self.is_isotropic and 0 <= row[1] < 0.5:
            return Material(young_modulus=float(row[0]), poisson_ratio=float(row[1]), density=density)
        elastic = ByTemperature((tuple(float(v) for v in row),))
        return ElasticMaterial(
            elastic=elastic, density_table=ByTemperature(((density,),)), orientation=self.orientation
        )

    def moved(self, turn: FloatArray, move: FloatArray) -> "ElasticMaterial":
        """Return the material of a body that is turned by the orthogonal (3, 3) `turn`, then moved by `move` (3,) in m."""
        return replace(self, orientation=self.orientation.moved(turn, move))


AnyMaterial = Material | ElasticMaterial
Materials = AnyMaterial | Sequence[AnyMaterial]  # one for all cells, or one for each
Order = Literal["12-23-13", "12-13-23", "23-13-12"]
# places of the components 11, 22, 33, 12, 23, 13 in other orders of the shears
ORDERS: dict[Order, list[int]] = {
    "12-23-13": [0, 1, 2, 3, 4, 5],
    "12-13-23": [0, 1, 2, 3, 5, 4],
    "23-13-12": [0, 1, 2, 5, 3, 4],
}


def elastic_material(
    matrix: Any, density: float, orientation: Orientation | None = None, *, order: Order = "12-23-13"
) -> ElasticMaterial:
    """Return a material of one elasticity matrix at all temperatures.

    Parameters
    ----------
    matrix
        (6, 6) matrix from strains to stresses in Pa, shear strains doubled.
    density
        Density in kg/m³.
    orientation
        Axes of the material; None: the global ones.
    order
        Order of the shears in the matrix, behind 11, 22, 33.
    """
    own = np.asarray(matrix, dtype=float)
    if own.shape != (6, 6):
        raise input_error("elastic_material: matrix", f"has the shape {own.shape}", "Give six rows of six numbers.")
    return ElasticMaterial(
        elastic=ByTemperature((row_of(own, order),)),
        density_table=ByTemperature(((float(density),),)),
        orientation=orientation or Orientation(),
    )


def cast_orientation(
    stacking: Sequence[float],
    reference: Sequence[float],
    tilt: float,
    azimuth: float,
    secondary: float,
    around: Axis | None = None,
) -> Orientation:
    """Return the axes of a single crystal as a foundry states them; axis 3 is the ⟨001⟩ direction nearest the stacking axis.

    Axis 1 first lies at `secondary` from the reference about the stacking axis, and axis 3 along the stacking axis. Both are then
    turned by `tilt` about the axis across the stacking axis that leads axis 3 towards `azimuth`.

    Parameters
    ----------
    stacking
        Vector along the stacking axis.
    reference
        Vector from whose part across the stacking axis the angles are counted.
    tilt
        Angle between axis 3 and the stacking axis, rad.
    azimuth, secondary
        Angles about the stacking axis from the reference, rad.
    around
        As of `Orientation`.
    """
    base = np.asarray(Orientation.of_axes(stacking, reference).axes)
    up, side, across = base.T  # stacking axis, reference across it, and their normal
    x, y, z = up.tolist()
    about = Axis((x, y, z))
    a, b, c = (about.rotation(azimuth) @ across).tolist()
    turn = Axis((a, b, c)).rotation(tilt)
    first = turn @ about.rotation(secondary) @ side
    third = turn @ up
    return Orientation(_nested(np.column_stack([first, np.cross(third, first), third])), around)


def moved_materials(material: Materials, turn: FloatArray, move: FloatArray) -> Materials:
    """Return the materials of a body that is turned by the orthogonal (3, 3) `turn`, then moved by `move` (3,) in m."""
    if not isinstance(material, Sequence):
        return material.moved(turn, move) if isinstance(material, ElasticMaterial) else material
    known = {one: moved_materials(one, turn, move) for one in dict.fromkeys(material)}
    return [known[one] for one in material]  # type: ignore[misc]


def row_of(matrix: FloatArray, order: Order = "12-23-13") -> tuple[float, ...]:
    """Return the 36 numbers of `ElasticMaterial.elastic` from a (6, 6) matrix with another order of the shears."""
    places = ORDERS[order]
    return tuple(float(v) for v in matrix[np.ix_(places, places)].ravel())


def orthotropic_stiffness(young: Sequence[float], poisson: Sequence[float], shear: Sequence[float]) -> FloatArray:
    """Return the (6, 6) matrix from strains to stresses in Pa, order 11, 22, 33, 12, 23, 13, of nine engineering constants.

    Parameters
    ----------
    young
        Young's moduli E1, E2, E3 in Pa.
    poisson
        Poisson's ratios ν12, ν13, ν23: νij is minus the strain along j over that along i under tension along i.
    shear
        Shear moduli G12, G13, G23 in Pa.

    Raises
    ------
    InputError
        If the constants belong to no stable material.
    """
    e1, e2, e3 = young
    n12, n13, n23 = poisson
    g12, g13, g23 = shear
    if min(*young, *shear) <= 0:
        raise input_error(
            "orthotropic_stiffness", f"moduli must be positive, got {[*young, *shear]}", "Check the constants."
        )
    compliance = np.diag([1 / e1, 1 / e2, 1 / e3, 1 / g12, 1 / g23, 1 / g13])
    for (i, j), value in (((0, 1), n12 / e1), ((0, 2), n13 / e1), ((1, 2), n23 / e2)):
        compliance[i, j] = compliance[j, i] = -value
    refuse_unstable("orthotropic_stiffness", compliance)
    return np.asarray(np.linalg.inv(compliance))


def refuse_unstable(place: str, matrix: FloatArray) -> None:
    """Refuse a (6, 6) elasticity or compliance matrix that is not symmetric and positive definite."""
    largest = float(np.abs(matrix).max())
    if not np.isfinite(largest) or np.abs(matrix - matrix.T).max() > 1e-9 * largest:
        raise input_error(place, "is no symmetric matrix of finite numbers", "Check the constants and their order.")
    scale = np.sqrt(np.abs(np.diag(matrix)))
    if not np.all(np.diag(matrix) > 0) or np.linalg.eigvalsh(matrix / np.outer(scale, scale))[0] <= SQUARE:
        raise input_error(
            place,
            "belongs to no stable material: some strain would release energy (the matrix is not positive definite)",
            "Check the constants, their order, and which Poisson's ratio is meant (ν12 = -ε2/ε1 under tension along 1).",
        )


def stress_rotation(axes: FloatArray) -> FloatArray:
    """Return the (..., 6, 6) matrices that turn stress vectors from axes (..., 3, 3), given as columns, to the global ones."""
    found = np.empty((*axes.shape[:-2], 6, 6))
    for row, (i, j) in enumerate(PAIRS):
        for column, (k, m) in enumerate(PAIRS):
            value = axes[..., i, k] * axes[..., j, m]
            if k != m:
                value = value + axes[..., i, m] * axes[..., j, k]
            found[..., row, column] = value
    return found


def _matrix(rows: FloatArray) -> FloatArray:
    """Return the matrices (..., 6, 6) of rows of 2 or 36 numbers."""
    if rows.shape[-1] == 36:
        return rows.reshape(*rows.shape[:-1], 6, 6)
    if rows.shape[-1] != 2:
        raise input_error(
            "ElasticMaterial.elastic", f"has {rows.shape[-1]} numbers a row", "Give 2 (isotropic) or 36 (a matrix)."
        )
    e, nu = rows[..., 0], rows[..., 1]
    shear = e / (2 * (1 + nu))
    found = np.zeros((*e.shape, 6, 6))
    found[..., :3, :3] = (e * nu / ((1 + nu) * (1 - 2 * nu)))[..., None, None]
    for i in range(6):
        found[..., i, i] += (2 if i < 3 else 1) * shear
    return found


def _triple(vector: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in vector)
    return x, y, z


def _nested(matrix: FloatArray) -> tuple[tuple[float, ...], ...]:
    return tuple(tuple(float(v) for v in row) for row in matrix)
