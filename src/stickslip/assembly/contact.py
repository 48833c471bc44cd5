"""Contacts between named surfaces."""

from dataclasses import dataclass
from typing import Literal, get_args

from stickslip.contact.law import ContactLaw
from stickslip.errors import check_choice, input_error

GROUND = "ground"
NEXT = "next."  # prefix of a surface of the neighbouring sector, in the sense of rotation
PairingKind = Literal["node_to_node", "node_to_segment", "segment_to_segment"]
SPATIAL: Literal["spatial_harmonics"] = "spatial_harmonics"  # join of wheels with different numbers of sectors
Share = Literal["interface", "point", "area"]
Acts = Literal["tangential", "normal"]
# remedy in messages about stages that such a join couples
ALONE = "Ask for [modes], at rest and without contacts; study one stage alone for anything else."


@dataclass(frozen=True, eq=False, kw_only=True)
class Contact:
    """Two surfaces that may stick, slip and lift off.

    Parameters
    ----------
    between
        The first surface gives the points and the normal, ``part.surface``; the second is ``part.surface``,
        ``next.part.surface`` (of the neighbouring sector) or ``ground``. The gap is ``frameᵀ (u_second - u_first)``,
        with n out of the first body.
    law
        Contact law. Its stiffnesses and forces refer to the unit of `share`.
    share
        Unit of the parameters of the law. ``interface``: the whole interface, shared among its points; ``point``: each
        point; ``area``: one square metre.
    pairing
        Method that finds the partner of each point.
    tangent
        Direction whose projection on the contact plane is t; None: t of the surface's own frames, or any direction if
        the law is the same along t and w.
    normal
        Direction out of the first surface, for nodes that span no facet, such as the tip of a beam; None: the normal of
        the surfaces.
    acts
        Direction of the relative motion of single dofs, which have no normal: ``tangential`` (along t) or ``normal``.
    tolerance
        Largest distance of partners, m: between nodes, or from a point to its segment; None: the default of the
        pairing.
    gap
        Clearance at rest, m. A negative value is an interference, the overlap of the undeformed bodies.
    preload
        Normal force at rest for the unit of `share`, N or Pa.

    Raises
    ------
    InputError
        If `share`, `pairing` or `acts` is no known word.
    """

    between: tuple[str, str]
    law: ContactLaw
    share: Share = "point"
    pairing: PairingKind = "node_to_node"
    tangent: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] | None = None
    acts: Acts | None = None
    tolerance: float | None = None
    gap: float = 0.0
    preload: float = 0.0

    def __post_init__(self) -> None:
        check_choice("Contact.share", self.share, get_args(Share))
        check_choice("Contact.pairing", self.pairing, get_args(PairingKind))
        if self.acts is not None:
            check_choice("Contact.acts", self.acts, get_args(Acts))


@dataclass(frozen=True, eq=False, kw_only=True)
class Join:
    """Permanent tie of two surfaces: the first follows the second.

    Parameters
    ----------
    between, pairing, tolerance
        As in `Contact`. ``spatial_harmonics`` couples flanges of wheels with different numbers of sectors in the mean.
    harmonics
        Circumferential harmonics, from 0, that such flanges couple.

    Raises
    ------
    InputError
        If `pairing` is no known word; if harmonics are missing, or given with another pairing.
    """

    between: tuple[str, str]
    pairing: PairingKind | Literal["spatial_harmonics"] = "node_to_segment"
    tolerance: float | None = None
    harmonics: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        check_choice("Join.pairing", self.pairing, (*get_args(PairingKind), SPATIAL))
        if bool(self.harmonics) != (self.pairing == SPATIAL) or min(self.harmonics, default=0) < 0:
            raise input_error(
                "Join.harmonics",
                f"are {list(self.harmonics)} with pairing {self.pairing!r}",
                f"Give whole numbers from 0 on with {SPATIAL}, and with it alone.",
            )
