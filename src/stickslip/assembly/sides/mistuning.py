"""Mistuning: blades' frequencies, contacts, and parts that differ from sector to sector."""

import reprlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from stickslip.arrays import FloatArray
from stickslip.errors import input_error
from stickslip.model.part import Part

Distribution = Literal["normal", "uniform"]
ContactQuantity = Literal["friction_coefficient", "slip_limit", "stiffness", "preload", "gap"]
LARGEST = 0.5  # relative deviation of a frequency or a stiffness, above which the blade is not the same blade


def pattern(sectors: int, distribution: Distribution, standard_deviation: float, seed: int) -> FloatArray:
    """Return random deviations (n_s,) from a distribution with zero mean; the same for the same seed.

    Parameters
    ----------
    sectors
        Number of sectors n_s.
    distribution
        ``normal``, or ``uniform`` between plus and minus √3 standard deviations.
    standard_deviation
        Standard deviation of the distribution.
    seed
        Seed, an integer from 0.
    """
    draw = np.random.default_rng(seed)
    if distribution == "normal":
        return np.asarray(standard_deviation * draw.standard_normal(sectors))
    edge = np.sqrt(3.0) * standard_deviation
    return np.asarray(edge * (2.0 * draw.random(sectors) - 1.0))


@dataclass(frozen=True, eq=False, kw_only=True)
class BladeMistuning:
    """Blades with deviating natural frequencies and unchanged shapes.

    The deviation changes the stiffness of the blade fixed at its boundary with the rest of the part and with its
    neighbours. Static deformations by this boundary are unchanged, and all frequencies of the blade alone change by the
    deviation.

    Parameters
    ----------
    of
        ``part`` or ``part.set``: the dofs of the blade.
    deviations
        (n_s,) relative deviation of each blade, sector 0 first; or (n_s, r) of each of its lowest r modes.
    modes
        None: the deviation acts on every deformation of the blade (nominal-mode subspace). A number: it acts on this
        number of its lowest modes (component-mode subspace).
    quantity
        Deviating quantity: ``frequency`` or ``stiffness``.
    beyond_radius
        Smallest distance of the blade's nodes from the axis of rotation, m; None: all nodes of `of`.
    """

    of: str
    deviations: FloatArray
    modes: int | None = None
    quantity: Literal["frequency", "stiffness"] = "frequency"
    beyond_radius: float | None = None

    def __post_init__(self) -> None:
        values = np.asarray(self.deviations, dtype=float)
        object.__setattr__(self, "deviations", values)
        if values.ndim not in (1, 2) or not values.size or not np.all(np.isfinite(values)):
            raise input_error(
                "BladeMistuning.deviations",
                f"must be finite, one number a blade or a row of modes a blade, got {reprlib.repr(values.tolist())}",
                "Give relative deviations, such as 0.01.",
            )
        if np.abs(values).max() > LARGEST:
            raise input_error(
                "BladeMistuning.deviations",
                f"goes up to {np.abs(values).max():g}, and a blade deviates by at most {LARGEST:g}",
                "Deviations are relative: 0.01 is one per cent. For another blade give the sector a part of its own.",
            )
        if values.ndim == 2 and self.modes not in (None, values.shape[1]):
            raise input_error(
                "BladeMistuning.modes",
                f"is {self.modes}, and the deviations are of {values.shape[1]} modes",
                "Leave it out.",
            )

    @property
    def factors(self) -> FloatArray:
        """Relative changes of the stiffness, in the shape of the deviations."""
        if self.quantity == "stiffness":
            return self.deviations
        return np.asarray((1.0 + self.deviations) ** 2 - 1.0)


@dataclass(frozen=True, eq=False, kw_only=True)
class ContactMistuning:
    """Contacts that differ from sector to sector.

    Parameters
    ----------
    contact
        Name of the model's contact. The contact of sector n lies in sector n, or between n and n + 1.
    quantity
        ``friction_coefficient``, ``slip_limit``, ``stiffness`` (all stiffnesses alike) or ``preload``: `values` are relative deviations.
        ``gap``: `values` are clearances in m, added to the clearance of the contact.
    values
        (n_s,) deviation of each sector.
    """

    contact: str
    quantity: ContactQuantity
    values: FloatArray

    def __post_init__(self) -> None:
        values = np.asarray(self.values, dtype=float)
        object.__setattr__(self, "values", values)
        if self.quantity not in get_args(ContactQuantity):
            raise input_error(
                "ContactMistuning.quantity",
                f"is {self.quantity!r}",
                f"Give one of {', '.join(get_args(ContactQuantity))}.",
            )
        if values.ndim != 1 or not np.all(np.isfinite(values)):
            raise input_error(
                "ContactMistuning.values",
                f"must be finite, one number a sector, got {reprlib.repr(values.tolist())}",
                "Give a list of numbers.",
            )
        if self.quantity != "gap" and values.min(initial=0.0) <= -1.0:
            raise input_error(
                "ContactMistuning.values",
                f"goes down to {values.min():g}, and nothing is left at -1",
                "Deviations are relative: -0.1 is ten per cent less.",
            )


@dataclass(frozen=True, eq=False, kw_only=True)
class OwnSector:
    """Sector with a different part, such as a damaged or a repaired blade.

    Parameters
    ----------
    sector
        Number of the sector, from 0.
    part
        Name of the replaced part of the model.
    by
        Replacement with the same dofs, such as the same mesh with moved nodes or of another material.
    """

    sector: int
    part: str
    by: Part


@dataclass(frozen=True, eq=False, kw_only=True)
class Mistuning:
    """Differences between the sectors of a wheel.

    Parameters
    ----------
    blades, contacts, own
        Deviating blades, contacts and parts by name.
    """

    blades: Mapping[str, BladeMistuning] = field(default_factory=dict)
    contacts: Mapping[str, ContactMistuning] = field(default_factory=dict)
    own: Mapping[str, OwnSector] = field(default_factory=dict)

    @property
    def patterns(self) -> dict[str, FloatArray]:
        """Name -> (n_s,) deviation of each sector; blades with deviations of several modes have one entry for each mode."""
        found: dict[str, FloatArray] = {}
        for name, one in self.blades.items():
            if one.deviations.ndim == 1:
                found[name] = one.deviations
            else:
                each = enumerate(one.deviations.T)
                found |= {f"{name}, mode {i + 1}": own for i, own in each}
        gap = ", gap in m"
        return found | {name + gap * (one.quantity == "gap"): one.values for name, one in self.contacts.items()}

    def require(self, sectors: int) -> None:
        """Refuse deviations of a wrong number of blades, unknown sectors, and two replacements of one part."""
        values = {name: one.deviations for name, one in self.blades.items()}
        values |= {name: one.values for name, one in self.contacts.items()}
        for name, own in values.items():
            if len(own) != sectors:
                raise input_error(
                    f"mistuning.{name}",
                    f"has {len(own)} values, and the wheel has {sectors} sectors",
                    "Give each sector one.",
                )
        for name, one in self.own.items():
            if not 0 <= one.sector < sectors:
                raise input_error(
                    f"mistuning.{name}.sector",
                    f"is {one.sector}, and the sectors are 0 to {sectors - 1}",
                    "Sector 0 is the one that the parts describe.",
                )
        taken: dict[tuple[str, int], str] = {}
        for name, one in self.own.items():
            first = taken.setdefault((one.part, one.sector), name)
            if first != name:
                raise input_error(
                    f"mistuning.{name}.sector",
                    f"is {one.sector}, where mistuning.{first} puts another part in the place of {one.part!r} already",
                    "Leave one of them out, or name another sector.",
                )
