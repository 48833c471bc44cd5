"""What the paper leaves open, and which values of it are tried."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

from evidence.models.two_blades import COARSER, TwoBlades, two_blades
from stickslip.model.rigid.dampers import FlatCurvedDamper, section_moments

LENGTH = 0.04  # m: of the damper along its axis
STEEL, TITANIUM = 7850.0, 4430.0  # kg/m^3
FLAT_ANGLE = math.radians(45.0)  # of the paper
FRICTION = math.atan(0.6)  # angle of friction

DAMPING = (0.003, 0.005, 0.0075, 0.0125)
FORCE_SPAN = (0.0, -0.04, -0.08)  # hub, and down the shank
FLAT = ((0.002, 0.029), (0.004, 0.027))  # m
CURVED = (0.0045, 0.0055, 0.0065, 0.009, 0.0105)  # m; the largest with which the damper rests is taken
CURVED_ANGLE = (45.0, 50.0, 55.0, 60.0)  # degrees
SLACK = 1e-4  # m
RETENTION = 1e4  # N/m


@dataclass(frozen=True)
class Candidate:
    """One choice of what the paper leaves open.

    Attributes
    ----------
    damping
        Damping ratio of the blades.
    force_span
        Place of the force (`stickslip.model.mesh.blade_pair.BladePair`).
    flat
        Distances of L1 and L2 from the apex, m.
    curved
        Distance of R from the apex, m.
    curved_angle
        Of the underside that the curved side touches, degrees.
    density
        Of the damper, kg/m^3: with its outline and `LENGTH` it makes mass, inertia and centre of mass.
    """

    damping: float
    force_span: float
    flat: tuple[float, float]
    curved: float
    curved_angle: float
    density: float = STEEL

    @property
    def body(self) -> tuple[float, tuple[float, float, float], tuple[float, float]]:
        """Mass (kg), moments of inertia (kg m^2) and centre of mass from the apex (x and z, m) of the damper as a prism."""
        damper = FlatCurvedDamper(
            flat_distances=self.flat, curved_distance=self.curved, curved_angle=math.radians(self.curved_angle)
        )
        area, centre, second = section_moments(damper.outline() - damper.apex)
        mass = self.density * area * LENGTH
        xx, zz = (float(mass * v) for v in second[:2])
        along = mass * LENGTH**2 / 12
        return mass, (zz + along, xx + zz, xx + along), (float(centre[0]), float(centre[1]))

    @property
    def keys(self) -> dict[str, Any]:
        """The keys of a study that say it, rounded as one would write them."""
        mass, inertia, (x, z) = self.body
        return {
            "damping.ratio": self.damping,
            "part.blades.force_span": self.force_span,
            "part.damper.flat_distances_m": self.flat,
            "part.damper.curved_distance_m": self.curved,
            "part.damper.mass_kg": float(f"{mass:.2g}"),
            "part.damper.inertia_kg_m2": tuple(float(f"{i:.3g}") for i in inertia),
            "part.damper.centre_m": (round(x, 4), 0.0, round(z, 4)),
            "part.blades.curved_angle_deg": self.curved_angle,
            "retention.stiffness_n_per_m": RETENTION,
        }

    def build(self, coarser: float = COARSER) -> TwoBlades:
        """Mesh and reduce it."""
        return two_blades(coarser, **self.keys)

    @property
    def reach(self) -> tuple[float, float, float]:
        """Where the flat side's resultant acts, m from the apex: least, without friction, most.

        Three forces that balance meet in a point: the pull, the curved side's and the flat side's. Each side's leans by up to
        the angle of friction to either side of its normal.
        """
        angle, centre = math.radians(self.curved_angle), self.body[2][0]
        across, down = self.curved * math.cos(angle), self.curved * math.sin(angle)
        found = {}
        for lean in (-FRICTION, 0.0, FRICTION):
            meet = down + (across - centre) * math.tan(math.pi / 2 - angle + lean)  # below the apex
            along = -centre * math.cos(FLAT_ANGLE) + meet * math.sin(FLAT_ANGLE)
            off = meet * math.cos(FLAT_ANGLE) + centre * math.sin(FLAT_ANGLE)
            for own in (-FRICTION, 0.0, FRICTION):
                found[lean, own] = along + off * math.tan(own)
        return min(found.values()), found[0.0, 0.0], max(found.values())

    @property
    def rests(self) -> bool:
        """Whether both flat lines press whatever friction does."""
        least, _, most = self.reach
        return self.flat[0] - SLACK <= least and most <= self.flat[1] + SLACK


OLD = Candidate(0.003, 0.0, (0.002, 0.029), 0.0045, 45.0)  # shipped until November 2026
CHOSEN = Candidate(0.0075, 0.0, (0.002, 0.029), 0.0105, 60.0, TITANIUM)  # the example's
# what becomes of dampers that do not rest on both lines
LIFTING = (Candidate(0.0075, 0.0, (0.002, 0.029), 0.0115, 45.0), Candidate(0.0075, 0.0, (0.004, 0.022), 0.0085, 50.0))


def candidates() -> Iterator[Candidate]:
    """Return the old example, two dampers that do not rest on both lines, and every combination of what does."""
    yield OLD
    yield from LIFTING
    for flat, angle in product(FLAT, CURVED_ANGLE):
        resting = [r for r in CURVED if Candidate(0.0, 0.0, flat, r, angle).rests]
        for place, damping, density in product(FORCE_SPAN, DAMPING, (STEEL, TITANIUM)):
            for curved in resting[-1:]:
                yield Candidate(damping, place, flat, curved, angle, density)
