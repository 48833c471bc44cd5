"""Contacts between named surfaces."""

from dataclasses import dataclass
from typing import Literal

from stickslip.contact.law import ContactLaw
from stickslip.errors import input_error

GROUND = "ground"
NEXT = "next."  # prefix of a surface of the neighbouring sector, in the sense of rotation
PairingKind = Literal["node_to_node", "node_to_segment", "segment_to_segment"]
SPATIAL: Literal["spatial_harmonics"] = "spatial_harmonics"  # wheels of different numbers of sectors
Share = Literal["interface", "point", "area"]
# of stages that such a join couples
ALONE = "Ask for [modes], at rest and without contacts; study one stage alone for anything else."


@dataclass(frozen=True, eq=False, kw_only=True)
class Contact:
    """Two surfaces that may stick, slip and lift off.

    Parameters
    ----------
    between
        The first surface gives the points and the normal, ``part.surface``; the second is ``part.surface``, ``next.part.surface``
        (of the neighbouring sector) or ``ground``. The gap is ``frameᵀ (u_second - u_first)``, with n out of the first body.
    law
        Its parameters hold for what `share` says.
    share
        ``interface``: stiffnesses and forces of the law are those of the whole interface, shared among its points; ``point``: of
        each point; ``area``: per square metre.
    pairing
        How points find their partners.
    tangent
        Direction whose part in the contact plane is t; None: that of the surface's own frames, or any where the law does not tell
        its tangents apart.
    normal
        Direction out of the first surface, for nodes that span no facet, such as the tip of a beam; None: that of the surfaces.
    acts
        For surfaces of single dofs, which have no normal: the direction of the contact that their relative motion is.
    tolerance
        Distance of partners node to node, reach of a segment, m; None: the pairing's own.
    gap
        Clearance at rest, m; negative for an interference: so far the bodies would overlap if nothing gave way.
    preload
        Normal force at rest of what `share` says, N or Pa.
    """

    between: tuple[str, str]
    law: ContactLaw
    share: Share = "point"
    pairing: PairingKind = "node_to_node"
    tangent: tuple[float, float, float] | None = None
    normal: tuple[float, float, float] | None = None
    acts: Literal["tangential", "normal"] | None = None
    tolerance: float | None = None
    gap: float = 0.0
    preload: float = 0.0


@dataclass(frozen=True, eq=False, kw_only=True)
class Join:
    """Two surfaces tied to each other for good: the first follows the second.

    Parameters
    ----------
    between, pairing, tolerance
        As of a `Contact`. ``spatial_harmonics`` couples the flanges of wheels of different numbers of sectors in the mean.
    harmonics
        Of such a flange: those of the circumference that are coupled, from 0 on.

    Raises
    ------
    InputError
        If harmonics are missing, or given with another pairing.
    """

    between: tuple[str, str]
    pairing: PairingKind | Literal["spatial_harmonics"] = "node_to_segment"
    tolerance: float | None = None
    harmonics: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        if bool(self.harmonics) != (self.pairing == SPATIAL) or min(self.harmonics, default=0) < 0:
            raise input_error(
                "Join.harmonics",
                f"are {list(self.harmonics)} with pairing {self.pairing!r}",
                f"Give whole numbers from 0 on with {SPATIAL}, and with it alone.",
            )
