"""Aerodynamic influence coefficients of a model, and the modes or points that they refer to."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from stickslip.errors import input_error
from stickslip.reduction.aerodynamics import InfluenceCoefficients, one_twice

Direction = tuple[float, float, float] | None


@dataclass(frozen=True, eq=False, kw_only=True)
class Aerodynamics:
    """Influence coefficients of a wheel, and the modes or points that they refer to.

    Parameters
    ----------
    influence
        Coefficients, in the order of the modes or points.
    reference
        Reference frequency ω_r, rad/s. Constant matrices represent the force exactly at this frequency.
    modes
        Numbers of the modes, from 1.
    shapes
        ``wave``: modes of each wave; ``blade_alone``: modes of a part with the nodes `clamped` and its cyclic faces fixed, in all
        waves; ``nodal_diameter``: modes of one nodal diameter, in all waves.
    nodal_diameter
        Nodal diameter of the modes for ``nodal_diameter``; unused otherwise.
    clamped
        Node set at which the blade is fixed for ``blade_alone``, such as ``blade.root``.
    largest_displacement
        Largest displacement of the scaled modes, m; coefficients are then in J. None: modes of unit mass, coefficients in 1/s².
    over
        Part on which the largest displacement is taken; empty: all parts.
    contacts
        Contact state of the modes for ``wave``, as in `Model.at`.
    points
        Name -> place and direction, as in `Load`, for coefficients that refer to points; empty: they refer to modes.

    Raises
    ------
    InputError
        If numbers of modes or points do not fit the coefficients.
    """

    influence: InfluenceCoefficients
    reference: float
    modes: tuple[int, ...] = (1,)
    shapes: Literal["wave", "blade_alone", "nodal_diameter"] = "wave"
    nodal_diameter: int = 0
    clamped: str = ""
    largest_displacement: float | None = None
    over: str = ""
    contacts: Literal["static", "stuck", "open"] = "static"
    points: Mapping[str, tuple[str, Direction]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        named = len(self.points) or len(self.modes)
        if named != self.influence.patterns:
            raise input_error(
                "Aerodynamics",
                f"has coefficients between {self.influence.patterns} and names {named} modes or points",
                "Give as many.",
            )
        if not 0 < self.reference < math.inf:
            raise input_error("Aerodynamics.reference", f"is {self.reference}", "Give rad/s.")
        size = self.largest_displacement
        if size is not None and not 0 < size < math.inf:
            raise input_error("Aerodynamics.largest_displacement", f"is {size}", "Give metres.")
        if min(self.modes) < 1:
            raise input_error("Aerodynamics.modes", f"are {self.modes}", "The lowest is 1.")

    def require(self, sectors: int) -> None:
        """Refuse coefficients that do not fit a wheel.

        A blade must not be a neighbour twice, and the nodal diameter must be in range.
        """
        twice = one_twice(self.influence.distances, sectors)
        if twice:
            raise input_error(
                "Aerodynamics.influence",
                f"has the neighbours {twice[0]} and {twice[1]}, one blade of {sectors}, whose motion would count twice",
                "Leave one of them out.",
            )
        if self.shapes == "nodal_diameter" and not 0 <= 2 * self.nodal_diameter <= sectors:
            raise input_error(
                "aero.nodal_diameter",
                f"is {self.nodal_diameter}, and {sectors} sectors have the nodal diameters 0 to {sectors // 2}",
                "Name the one whose modes the coefficients belong to.",
            )

    @property
    def of_points(self) -> bool:
        """Whether the coefficients refer to points."""
        return bool(self.points)
